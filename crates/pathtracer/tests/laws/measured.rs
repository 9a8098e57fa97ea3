//! Measured materials: files measured from known lobes, and scenes that use them.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use pathtracer::{Scene, Session, Settings};
use pt_core::bsdf::microfacet::MicrofacetDistribution;
use pt_core::bsdf::{
    Gonioreflectometer, Lobe, MeasuredTables, RoughConductor, RoughPlastic, SmoothConductor,
    TabulatedLobe,
};
use pt_cpu::Tracer;
use pt_formats::save;
use pt_math::{Ray, Spectrum, Vec3};
use pt_scene::material::{Distribution, Masking, Measured};
use pt_scene::measured::Measurements;
use pt_scene::texture::Scalar;
use pt_scene::{Material, Surface};
use pt_testing::Random;

use crate::scenes::size;

const SCENES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes");

/// A blue surface under an isotropic glossy lobe of roughness 0.35.
fn glossy() -> Measurements {
    let distribution = MicrofacetDistribution::isotropic(Distribution::Ggx, 0.35);
    let lobe = RoughPlastic {
        rho: Spectrum::rgb(0.08, 0.2, 0.5),
        f0: Spectrum::splat(0.08),
        distribution,
    };
    let instrument = Gonioreflectometer {
        theta: 8,
        phi: 3,
        distribution: [32, 3],
        visible: [24, 17],
        reflected: 16,
    };
    instrument.measure(&TabulatedLobe {
        description: "blue gloss",
        eval: &|wo, wi| lobe.eval(wo, wi),
        // Half of the distribution is that of the glossy lobe, the other half constant, for the
        // diffuse part.
        distribution: &|m| 0.5 * distribution.d(m) + 0.5 * std::f32::consts::FRAC_1_PI,
        is_isotropic: true,
        is_relative: true,
    })
}

/// Brushed copper, of roughness 0.4 along the brush and 0.15 across it.
fn brushed() -> Measurements {
    let (distribution, masking) = (Distribution::Ggx, Masking::Correlated);
    let distribution = MicrofacetDistribution { distribution, masking, alpha: [0.4, 0.15] };
    let metal = SmoothConductor {
        eta: Spectrum::rgb(0.2, 0.92, 1.1),
        k: Spectrum::rgb(3.9, 2.45, 2.14),
        reflectance: Spectrum::ONE,
    };
    let instrument = Gonioreflectometer {
        theta: 6,
        phi: 5,
        distribution: [32, 33],
        visible: [16, 17],
        reflected: 8,
    };
    let lobe = RoughConductor { metal, distribution };
    instrument.measure(&TabulatedLobe {
        description: "brushed copper",
        eval: &|wo, wi| lobe.eval(wo, wi),
        distribution: &|m: Vec3| distribution.d(m),
        is_isotropic: false,
        is_relative: true,
    })
}

/// File of the measurements.
fn file_of(measurements: Measurements) -> Vec<u8> {
    let surface = Measured { measurements: Arc::new(measurements), two_sided: true }.into();
    let material = Material {
        name: "measured".to_owned(),
        surface,
        emission: [0.0; 3].into(),
        hidden_emission: false,
        opacity: Scalar::Value(1.0),
    };
    let scene = Scene { materials: vec![material].into(), ..Scene::default() };
    let folder = tempfile::tempdir().expect("a folder");
    save(&scene, &folder.path().join("scene.json"), true).expect("it is written");
    let files = folder.path().join("scene_files");
    let file = std::fs::read_dir(files).expect("files").next().expect("a file").expect("readable");
    std::fs::read(file.path()).expect("a readable file")
}

/// The files of the scenes equal the measurements of the instrument. `PT_WRITE_GENERATED=1` writes
/// them.
#[test]
fn files_of_scenes_are_what_is_measured() {
    for (name, measurements) in [("gloss.bsdf", glossy()), ("brushed.bsdf", brushed())] {
        let path: PathBuf = Path::new(SCENES).join("mitsuba").join(name);
        let bytes = file_of(measurements);
        if std::env::var_os("PT_WRITE_GENERATED").is_some() {
            std::fs::write(&path, &bytes).expect("a writable folder");
        }
        assert!(bytes == std::fs::read(&path).expect("the file exists"), "{name}");
    }
}

/// f cos θ, densities and sampled directions of Mitsuba 3.9.1 in the variant scalar_rgb: after the
/// name of the file `wo`, `wi` (half of them sampled), eval, pdf, two random numbers, and the
/// direction sampled with these, which may be below the surface.
const BY_MITSUBA: &str = include_str!("measured.txt");
/// The same without sampled directions in the variant scalar_spectral, of the file of pbrt's scene:
/// its eval at 1000 wavelengths, as a colour of Rec. 709 under D65.
const SPECTRA_BY_MITSUBA: &str = include_str!("measured_spectra.txt");

/// Errors of eval, relative to its largest channel, and of pdf, compared with a row.
fn errors(lobe: &pt_core::bsdf::Measured<'_>, row: &[f32]) -> [f32; 2] {
    let three = |i: usize| Vec3::from_slice(&row[i..]);
    let (wo, wi) = (three(0), three(3));
    let of_eval = (lobe.eval(wo, wi).0 - three(6)).abs().max_element();
    let of_pdf = (lobe.pdf(wo, wi).get() - row[9]).abs();
    [of_eval / three(6).max_element().max(1e-3), of_pdf / row[9].max(1e-3)]
}

fn numbers(words: &str) -> Vec<f32> {
    words.split(' ').map(|word| word.parse().expect("a number")).collect()
}

/// Over 6000 of such rows, the largest errors were 2·10⁻⁵, 4·10⁻⁵ and 2·10⁻⁴.
#[test]
fn values_are_those_of_mitsuba() {
    let files = ["gloss", "brushed"].map(|name| (name, tables_of("mitsuba", name)));
    for row in BY_MITSUBA.lines() {
        let (name, words) = row.split_once(' ').expect("a name");
        let numbers = numbers(words);
        let (_, tables) = files.iter().find(|(file, _)| *file == name).expect("a file");
        let lobe = pt_core::bsdf::Measured::new(0, tables);
        let errors = errors(&lobe, &numbers);
        let expected = Vec3::from_slice(&numbers[12..]);
        let drawn = lobe.sample(Vec3::from_slice(&numbers), [numbers[10], numbers[11], 0.0]);
        let of_drawn = match drawn {
            Some(drawn) => (drawn.wi - expected).length(),
            None => expected.z.max(0.0),
        };
        assert!(errors[0] < 1e-4 && errors[1] < 1e-4 && of_drawn < 5e-4, "{row}: {errors:?}");
    }
}

/// A perfect reflector has Y = 0.9989 here, as it has in Mitsuba's own colours of spectra.
#[test]
fn colors_of_spectra_are_those_of_mitsuba() {
    let tables = tables_of("pbrt", "gloss");
    let lobe = pt_core::bsdf::Measured::new(0, &tables);
    for row in SPECTRA_BY_MITSUBA.lines() {
        let errors = errors(&lobe, &numbers(row));
        assert!(errors[0] < 2e-3 && errors[1] < 1e-4, "{row}: {errors:?}");
    }
}

/// The back of a two-sided sheet has the reflectance of the front for mirrored directions of light
/// and viewer, though brushed metals measured over half a turn are not their own mirror images.
#[test]
fn backs_look_like_fronts_seen_through_them() {
    let scene = scene_of("mitsuba", "brushed", "{\"type\": \"rectangle\", \"material\": \"m\"}");
    let session = Session::new(&scene, size([4, 4]), Settings::default()).expect("it compiles");
    let scene = session.scene();
    let mut random = Random::new(6);
    let mut different = 0;
    for _ in 0..500 {
        let [wo, wi] = [0, 1].map(|_| random.direction().abs() + Vec3::Z * 0.1);
        let signs = Vec3::new(random.between(-1.0, 1.0), random.between(-1.0, 1.0), 1.0);
        let [wo, wi] = [wo.normalize(), (wi * signs).normalize()];
        let seen = |turn: Vec3| {
            let ray = Ray::new(wo * turn, -wo * turn);
            let mut hits = Vec::new();
            Tracer::new(scene, false).intersect(&[ray], |_| 0.0, &mut hits);
            let hit = hits[0].expect("it is in the way");
            let at = scene.interaction(&ray, &hit, 0.0);
            let resolved = scene.evaluate_material(&at, &hit, 0.0, 0.5, None);
            scene.bsdf(&at, resolved.as_ref()).eval(wi * turn).0
        };
        let front = seen(Vec3::ONE);
        let near = |f: Vec3| (f - front).abs().max_element() < 1e-4 * front.max_element();
        assert!(near(seen(Vec3::new(1.0, 1.0, -1.0))), "{wo} {wi}");
        different += u32::from(!near(seen(Vec3::new(1.0, -1.0, 1.0))));
    }
    assert!(different > 400, "{different}");
}

/// A scene with a material `m` by a file of the scenes, and an object.
fn scene_of(folder: &str, name: &str, object: &str) -> Scene {
    let material =
        format!("\"type\": \"measured\", \"measurements\": {{\"file\": \"{name}.bsdf\"}}");
    let text = format!(
        "{{\"pathtracer\": 1, \"materials\": {{\"m\": {{{material}}}}}, \"objects\": [{object}], \"cameras\": [{{\"type\": \"panorama\"}}]}}"
    );
    let path = Path::new(SCENES).join(folder).join("measured.json");
    pt_formats::parse(text.as_bytes(), &path).expect("a scene")
}

/// The tables of a file of the scenes.
fn tables_of(folder: &str, name: &str) -> MeasuredTables {
    let scene = scene_of(folder, name, "");
    let Surface::Measured(measured) = &scene.materials[0].surface else { panic!("measured") };
    MeasuredTables::new(&measured.measurements)
}
