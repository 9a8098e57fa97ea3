//! Materials of Mitsuba scenes.

use std::path::Path;
use std::sync::Arc;

use pt_math::{DMat3, DVec3};
use pt_scene::material::{
    Black, CoatedDiffuse, Conductor, Diffuse, Distribution, Glass, Masking, Mirror, Mix,
    Principled, PrincipledThin, RoughCoatedDiffuse, RoughDiffuse, Roughness, ThinGlass, TwoSided,
};
use pt_scene::metals::{METALS, Metal};
use pt_scene::texture::{Bitmap, Color, Filter, Pattern, Wrap};
use pt_scene::{Geometry, Scalar, Surface, Texture};

use crate::{material, read, surface};

/// Default roughness of rough surfaces.
pub(crate) const ROUGH: Roughness = Roughness {
    alpha: [Scalar::Value(0.1), Scalar::Value(0.1)],
    distribution: Distribution::Beckmann,
    masking: Masking::Separable,
    multiple_scattering: false,
};

#[test]
fn shapes_without_a_bsdf_are_grey_or_black_if_they_emit() {
    let grey = Diffuse { reflectance: [0.5; 3].into(), two_sided: false };
    assert_eq!(material("").surface, grey.into());
    assert_eq!(material("").emission, [0.0; 3].into());
    let lamp = material("<emitter type=\"area\"/>");
    assert_eq!((lamp.surface, lamp.emission), (Black.into(), [1.0; 3].into()));
}

#[test]
fn both_sides_reflect_if_the_author_says_so() {
    let twosided = |bsdf: &str| surface(&format!("<bsdf type=\"twosided\">{bsdf}</bsdf>"));
    let diffuse = "<bsdf type=\"diffuse\"/>";
    assert_eq!(surface(diffuse), Diffuse { reflectance: [0.5; 3].into(), two_sided: false }.into());
    assert_eq!(twosided(diffuse), Diffuse { reflectance: [0.5; 3].into(), two_sided: true }.into());
    let mirror = "<bsdf type=\"conductor\"><string name=\"material\" value=\"none\"/></bsdf>";
    assert_eq!(twosided(mirror), Mirror { reflectance: [1.0; 3].into() }.into());
    let one_sided = Conductor {
        eta: [0.0; 3],
        k: [1.0; 3],
        reflectance: [1.0; 3].into(),
        roughness: None,
        two_sided: false,
    };
    assert_eq!(surface(mirror), one_sided.clone().into());
    let rough = Conductor { roughness: Some(ROUGH), two_sided: true, ..one_sided };
    assert_eq!(twosided("<bsdf type=\"roughconductor\"/>"), rough.into());
}

#[test]
fn metals_have_names_and_facets_a_distribution() {
    let gold = Conductor {
        eta: [0.143, 0.3753, 1.442],
        k: [3.983, 2.3856, 1.6034],
        reflectance: [1.0; 3].into(),
        roughness: Some(Roughness {
            alpha: [0.3.into(), 0.3.into()],
            distribution: Distribution::Ggx,
            ..ROUGH
        }),
        two_sided: false,
    };
    let found = surface(
        "<bsdf type=\"roughconductor\"><string name=\"material\" value=\"Au\"/>\
         <float name=\"alpha\" value=\"0.3\"/><string name=\"distribution\" value=\"ggx\"/></bsdf>",
    );
    assert_eq!(found, gold.into());
}

#[test]
fn dielectrics_may_be_rough_or_thin() {
    let index = "<float name=\"int_ior\" value=\"1.5\"/><float name=\"ext_ior\" value=\"1\"/>";
    let of_kind = |kind| surface(&format!("<bsdf type=\"{kind}\">{index}</bsdf>"));
    let clear = [1.0; 3];
    let rough = Glass {
        reflectance: clear.into(),
        transmittance: clear.into(),
        ior: 1.5,
        roughness: Some(ROUGH),
    };
    assert_eq!(of_kind("roughdielectric"), rough.into());
    let thin = ThinGlass { reflectance: clear.into(), transmittance: clear.into(), ior: 1.5 };
    assert_eq!(of_kind("thindielectric"), thin.into());
}

#[test]
fn plastic_is_a_base_under_a_coat() {
    let plain = CoatedDiffuse {
        diffuse: [0.5; 3].into(),
        specular: [1.0; 3].into(),
        ior: (1.49 / 1.000_277) as f32,
        nonlinear: false,
        two_sided: false,
    };
    assert_eq!(surface("<bsdf type=\"plastic\"/>"), plain.clone().into());
    let both = surface(
        "<bsdf type=\"twosided\"><bsdf type=\"plastic\">\
         <boolean name=\"nonlinear\" value=\"true\"/></bsdf></bsdf>",
    );
    assert_eq!(both, CoatedDiffuse { nonlinear: true, two_sided: true, ..plain }.into());
}

/// Indices of refraction of transition metals, n and k, at these wavelengths in nanometres.
/// [Johnson & Christy 1974, "Optical constants of transition metals: Ti, V, Cr, Mn, Fe, Co, Ni, and
/// Pd"]
const NANOMETRES: [u16; 18] =
    [354, 368, 381, 397, 413, 431, 451, 471, 496, 521, 549, 582, 617, 659, 704, 756, 821, 892];
#[expect(clippy::approx_constant, reason = "numbers that were measured")]
const TRANSITION_METALS: [(&str, [[f32; 18]; 2]); 5] = [
    (
        "Co",
        [
            [
                1.49, 1.50, 1.53, 1.57, 1.61, 1.67, 1.74, 1.81, 1.88, 1.97, 2.05, 2.13, 2.19, 2.25,
                2.31, 2.40, 2.53, 2.65,
            ],
            [
                2.61, 2.71, 2.82, 2.93, 3.05, 3.17, 3.28, 3.41, 3.55, 3.68, 3.82, 3.96, 4.11, 4.27,
                4.45, 4.64, 4.88, 5.16,
            ],
        ],
    ),
    (
        "Fe",
        [
            [
                1.93, 2.02, 2.12, 2.24, 2.35, 2.48, 2.59, 2.67, 2.74, 2.86, 2.95, 2.94, 2.88, 2.92,
                2.86, 2.87, 2.94, 2.96,
            ],
            [
                2.35, 2.43, 2.50, 2.58, 2.65, 2.71, 2.77, 2.82, 2.88, 2.91, 2.93, 2.99, 3.05, 3.10,
                3.19, 3.28, 3.39, 3.56,
            ],
        ],
    ),
    (
        "Ni",
        [
            [
                1.74, 1.70, 1.72, 1.72, 1.70, 1.71, 1.73, 1.78, 1.82, 1.85, 1.92, 1.96, 1.99, 1.99,
                2.06, 2.13, 2.26, 2.40,
            ],
            [
                2.32, 2.40, 2.48, 2.57, 2.69, 2.82, 2.95, 3.09, 3.25, 3.42, 3.61, 3.80, 4.02, 4.26,
                4.50, 4.73, 4.97, 5.23,
            ],
        ],
    ),
    (
        "Pd",
        [
            [
                1.23, 1.24, 1.26, 1.30, 1.33, 1.37, 1.41, 1.46, 1.52, 1.57, 1.64, 1.68, 1.75, 1.80,
                1.86, 1.95, 2.06, 2.23,
            ],
            [
                2.65, 2.74, 2.83, 2.93, 3.03, 3.14, 3.26, 3.39, 3.54, 3.68, 3.84, 4.02, 4.21, 4.42,
                4.65, 4.89, 5.19, 5.50,
            ],
        ],
    ),
    (
        "Ti",
        [
            [
                1.82, 1.90, 1.99, 2.08, 2.14, 2.21, 2.27, 2.32, 2.36, 2.44, 2.54, 2.60, 2.67, 2.76,
                2.86, 3.00, 3.21, 3.29,
            ],
            [
                2.87, 2.90, 2.93, 2.95, 2.98, 3.01, 3.04, 3.10, 3.19, 3.30, 3.43, 3.58, 3.72, 3.84,
                3.96, 4.01, 4.01, 3.96,
            ],
        ],
    ),
];

/// Metals that Mitsuba does not have equal those with their spectra in the file.
#[test]
fn transition_metals_are_those_of_their_spectra() {
    let mut wrong = Vec::new();
    for (name, indices) in TRANSITION_METALS {
        let [eta, k] = indices.map(|values| {
            let pairs = NANOMETRES.iter().zip(values).map(|(nm, x)| format!("{nm}:{x}"));
            pairs.collect::<Vec<_>>().join(", ")
        });
        let conductor = |inside: &str| {
            let surface = surface(&format!("<bsdf type=\"conductor\">{inside}</bsdf>"));
            let Surface::Conductor(metal) = surface else { panic!("{surface:?}") };
            [metal.eta, metal.k]
        };
        let named = conductor(&format!("<string name=\"material\" value=\"{name}\"/>"));
        let spectra = conductor(&format!(
            "<spectrum name=\"eta\" value=\"{eta}\"/><spectrum name=\"k\" value=\"{k}\"/>"
        ));
        let differ = |(a, b): (&f32, &f32)| (a - b).abs() > 1e-4;
        if named.as_flattened().iter().zip(spectra.as_flattened()).any(differ) {
            wrong.push((name, named, spectra));
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}

/// Metals of Palik's handbook that have two names in Mitsuba are equal under both.
#[test]
fn metals_of_the_handbook_have_two_names() {
    for metal in METALS {
        let other = Metal::named(&format!("{}_palik", metal.name));
        assert_eq!(other == Some(*metal), metal.palik, "{metal:?}");
    }
}

#[test]
fn rough_diffuse_surfaces_have_a_roughness() {
    let plain =
        RoughDiffuse { reflectance: [0.5; 3].into(), roughness: 0.5.into(), two_sided: false };
    assert_eq!(surface("<bsdf type=\"roughdiffuse\"/>"), plain.clone().into());
    let other = surface(
        "<bsdf type=\"twosided\"><bsdf type=\"roughdiffuse\">\
         <rgb name=\"reflectance\" value=\"0.1 0.2 0.3\"/><float name=\"roughness\" value=\"0.9\"/>\
         </bsdf></bsdf>",
    );
    let reflectance = [0.1, 0.2, 0.3].into();
    assert_eq!(other, RoughDiffuse { reflectance, roughness: 0.9.into(), two_sided: true }.into());
}

#[test]
fn rough_plastic_has_one_roughness() {
    let plain = RoughCoatedDiffuse {
        diffuse: [0.5; 3].into(),
        specular: [1.0; 3].into(),
        ior: (1.49 / 1.000_277) as f32,
        alpha: 0.1,
        distribution: Distribution::Beckmann,
        nonlinear: false,
        two_sided: false,
    };
    assert_eq!(surface("<bsdf type=\"roughplastic\"/>"), plain.clone().into());
    let other = surface(
        "<bsdf type=\"twosided\"><bsdf type=\"roughplastic\">\
         <string name=\"distribution\" value=\"ggx\"/><float name=\"alpha\" value=\"0.3\"/>\
         <boolean name=\"nonlinear\" value=\"true\"/></bsdf></bsdf>",
    );
    let want = RoughCoatedDiffuse {
        alpha: 0.3,
        distribution: Distribution::Ggx,
        nonlinear: true,
        two_sided: true,
        ..plain
    };
    assert_eq!(other, want.into());
}

#[test]
fn principled_materials_have_their_parameters() {
    type Field = fn(&mut Principled) -> &mut Scalar;
    let principled = |parameters: &str| {
        let surface = surface(&format!("<bsdf type=\"principled\">{parameters}</bsdf>"));
        let Surface::Principled(principled) = surface else { panic!("{surface:?}") };
        principled
    };
    let index = |parameters: &str| principled(parameters).ior;
    assert_eq!(principled(""), Principled::default());
    assert_eq!(index("<float name=\"eta\" value=\"1.33\"/>"), 1.33);
    assert_eq!(index("<float name=\"specular\" value=\"0\"/>"), 1.0);
    // At normal incidence a dielectric reflects ((η − 1) / (η + 1))².
    let reflectance = ((1.6f64 - 1.0) / (1.6 + 1.0)).powi(2);
    let specular = format!("<float name=\"specular\" value=\"{}\"/>", reflectance / 0.08);
    assert!((index(&specular) - 1.6).abs() < 1e-6);

    let numbers: [(&str, Field); 10] = [
        ("roughness", |p| &mut p.roughness),
        ("anisotropic", |p| &mut p.anisotropic),
        ("metallic", |p| &mut p.metallic),
        ("spec_trans", |p| &mut p.spec_trans),
        ("spec_tint", |p| &mut p.spec_tint),
        ("sheen", |p| &mut p.sheen),
        ("sheen_tint", |p| &mut p.sheen_tint),
        ("flatness", |p| &mut p.flatness),
        ("clearcoat", |p| &mut p.clearcoat),
        ("clearcoat_gloss", |p| &mut p.clearcoat_gloss),
    ];
    for (name, field) in numbers {
        let mut want = Principled::default();
        *field(&mut want) = 0.25.into();
        assert_eq!(principled(&format!("<float name=\"{name}\" value=\"0.25\"/>")), want);
        let textured = principled(&format!("<texture type=\"checkerboard\" name=\"{name}\"/>"));
        assert!(field(&mut textured.clone()).texture().is_some(), "{name}");
    }
}

#[test]
fn thin_principled_materials_have_their_parameters() {
    type Field = fn(&mut PrincipledThin) -> &mut Scalar;
    let thin = |parameters: &str| {
        let surface = surface(&format!("<bsdf type=\"principledthin\">{parameters}</bsdf>"));
        let Surface::PrincipledThin(thin) = surface else { panic!("{surface:?}") };
        thin
    };
    assert_eq!(thin(""), PrincipledThin::default());
    assert_eq!(thin("<float name=\"eta\" value=\"1.33\"/>").ior, 1.33);
    let most = thin("<float name=\"diff_trans\" value=\"2\"/>").diff_trans;
    assert_eq!(most, 2.0.into());
    let numbers: [(&str, Field); 8] = [
        ("roughness", |p| &mut p.roughness),
        ("anisotropic", |p| &mut p.anisotropic),
        ("spec_trans", |p| &mut p.spec_trans),
        ("spec_tint", |p| &mut p.spec_tint),
        ("sheen", |p| &mut p.sheen),
        ("sheen_tint", |p| &mut p.sheen_tint),
        ("flatness", |p| &mut p.flatness),
        ("diff_trans", |p| &mut p.diff_trans),
    ];
    for (name, field) in numbers {
        let mut want = PrincipledThin::default();
        *field(&mut want) = 0.25.into();
        assert_eq!(thin(&format!("<float name=\"{name}\" value=\"0.25\"/>")), want);
        let textured = thin(&format!("<texture type=\"checkerboard\" name=\"{name}\"/>"));
        assert!(field(&mut textured.clone()).texture().is_some(), "{name}");
    }
}

/// Transmissive materials are two-sided; others are if the author specifies it.
#[test]
fn principled_materials_have_sides() {
    let flip = "<boolean name=\"flip_normals\" value=\"true\"/>";
    let bsdf = "<bsdf type=\"principled\"/>";
    let sphere = |inside: String| {
        read(&format!("<shape type=\"sphere\">{inside}</shape>")).materials[0].surface.clone()
    };
    assert_eq!(sphere(format!("{flip}{bsdf}")), Principled::default().into());
    let both = Principled { two_sided: true, ..Principled::default() };
    let twosided = format!("<bsdf type=\"twosided\">{bsdf}</bsdf>");
    assert_eq!(sphere(twosided.clone()), both.clone().into());
    assert_eq!(sphere(format!("{flip}{twosided}")), both.into());
}

#[test]
fn glass_has_the_index_of_its_inside_over_its_outside() {
    let ior = |parameters: &str| {
        let bsdf = format!("<bsdf type=\"dielectric\">{parameters}</bsdf>");
        let Surface::Glass(glass) = surface(&bsdf) else { panic!("no glass") };
        glass.ior
    };
    assert_eq!(ior(""), (1.5046 / 1.000_277) as f32);
    let bubble = "<string name=\"int_ior\" value=\"air\"/><string name=\"ext_ior\" \
                  value=\"Water\"/>";
    assert_eq!(ior(bubble), (1.000_277 / 1.333) as f32);
    let numbers = "<float name=\"int_ior\" value=\"3\"/><integer name=\"ext_ior\" value=\"2\"/>";
    assert_eq!(ior(numbers), 1.5);
}

/// A sphere is flipped by each of flip_normals, a mirroring transform and a negative radius.
#[test]
fn spheres_turned_inside_out() {
    let sphere = |parameters: &str, bsdf: &str| {
        let scene =
            read(&format!("<shape type=\"sphere\">{parameters}<bsdf type=\"{bsdf}\"/></shape>"));
        let Geometry::Sphere { radius } = scene.objects[0].geometry else { panic!("a sphere") };
        (radius, scene.materials[0].surface.clone(), scene.warnings.len())
    };
    let flip = "<boolean name=\"flip_normals\" value=\"true\"/>";
    let mirror = "<transform name=\"to_world\"><scale x=\"-1\"/></transform>";
    let negative = "<float name=\"radius\" value=\"-1\"/>";
    for (parameters, inverted) in [
        (String::new(), false),
        (flip.to_owned(), true),
        (mirror.to_owned(), true),
        (negative.to_owned(), true),
        (format!("{flip}{mirror}"), false),
        (format!("{flip}{mirror}{negative}"), true),
    ] {
        let matte: Surface = Diffuse { reflectance: [0.5; 3].into(), two_sided: false }.into();
        let radius = if inverted { -1.0 } else { 1.0 };
        assert_eq!(sphere(&parameters, "diffuse"), (radius, matte, 0), "{parameters}");
    }
}

// ---- textures ----------------------------------------------------------------------------------

/// An image in the folder of the comparison scenes.
pub(crate) fn bitmap(name: &str, more: &str) -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/mitsuba/parts");
    let file = folder.join("clouds.png");
    format!(
        "<texture type=\"bitmap\" name=\"{name}\"><string name=\"filename\" value=\"{}\"/>{more}\
         </texture>",
        file.display()
    )
}

pub(crate) fn texture_of(surface: Surface) -> Arc<Texture> {
    let Surface::Diffuse(Diffuse { reflectance: Color::Texture(texture), .. }) = surface else {
        panic!("{surface:?}")
    };
    texture
}

#[test]
fn images_lie_on_surfaces_as_their_author_says() {
    let diffuse = |more: &str| {
        let texture = bitmap("reflectance", more);
        texture_of(surface(&format!("<bsdf type=\"diffuse\">{texture}</bsdf>")))
    };
    let plain = diffuse("");
    let Pattern::Bitmap(Bitmap { image, wrap, filter }) = &plain.pattern else {
        panic!("no image")
    };
    assert_eq!((image.width, *wrap, *filter), (32, Wrap::REPEAT, Filter::Bilinear));
    // Linear values are less than the stored ones, except for black and white.
    let raw = diffuse("<boolean name=\"raw\" value=\"true\"/>");
    let Pattern::Bitmap(Bitmap { image: stored, .. }) = &raw.pattern else { panic!("no image") };
    let pairs = || image.pixels.as_flattened().iter().zip(stored.pixels.as_flattened());
    assert!(pairs().all(|(light, stored)| light <= stored) && pairs().any(|(l, s)| l < s));
    let other = diffuse(
        "<string name=\"wrap_mode\" value=\"mirror\"/>\
         <string name=\"filter_type\" value=\"nearest\"/>\
         <transform name=\"to_uv\"><scale x=\"2\" y=\"3\"/><translate x=\"0.5\" y=\"0.25\"/></transform>",
    );
    let Pattern::Bitmap(Bitmap { wrap, filter, .. }) = &other.pattern else { panic!("no image") };
    assert_eq!((*wrap, *filter), (Wrap::MIRROR, Filter::Nearest));
    // v = 0 is the top row in Mitsuba, and the bottom row here.
    let at = |m: DMat3, u: f64, v: f64| (m * DVec3::new(u, v, 1.0)).truncate().to_array();
    assert_eq!(at(plain.to_pattern, 0.25, 0.125), [0.25, 0.875]);
    assert_eq!(at(other.to_pattern, 0.25, 0.125), [1.0, 1.0 - 0.625]);
}

#[test]
fn a_texture_is_read_once_for_all_that_refer_to_it() {
    let sphere = "<shape type=\"sphere\"><bsdf type=\"diffuse\">\
                  <ref name=\"reflectance\" id=\"t\"/></bsdf></shape>";
    let chess = "<texture type=\"checkerboard\" id=\"t\"><rgb name=\"color0\" value=\"1, 0.5, 0\"/></texture>";
    let scene = read(&format!("{chess}{sphere}{sphere}"));
    let [a, b] = [0, 1].map(|i: usize| texture_of(scene.materials[i].surface.clone()));
    assert!(Arc::ptr_eq(&a, &b));
    assert_eq!(a.pattern, Pattern::Checkerboard([[1.0, 0.5, 0.0], [0.2; 3]]));
}

/// In Mitsuba 3.9.1, at uv (0.2, 0.2) of a checkerboard of 0.1 and 0.9, `eval` returns 0.1 and
/// `eval_1` 0.9.
#[test]
fn a_checkerboard_has_its_colours_the_other_way_round_where_it_is_a_number() {
    let chess = |name: &str| {
        format!(
            "<texture type=\"checkerboard\" name=\"{name}\"><float name=\"color0\" value=\"0.1\"/>\
             <float name=\"color1\" value=\"0.9\"/></texture>"
        )
    };
    let colour = surface(&format!("<bsdf type=\"diffuse\">{}</bsdf>", chess("reflectance")));
    assert_eq!(texture_of(colour).pattern, Pattern::Checkerboard([[0.1; 3], [0.9; 3]]));
    let masked = format!("<bsdf type=\"mask\">{}<bsdf type=\"diffuse\"/></bsdf>", chess("opacity"));
    let scene = read(&format!("<shape type=\"sphere\">{masked}</shape>"));
    let opacity = scene.materials[0].opacity.texture().expect("a texture").pattern.clone();
    assert_eq!(opacity, Pattern::Checkerboard([[0.9; 3], [0.1; 3]]));
}

/// Mitsuba accepts texture values above 1 from a <float>; here reflectances are clamped to 1, with
/// a note.
#[test]
fn levels_of_textures_may_be_above_1() {
    let texture = "<texture type=\"checkerboard\" name=\"reflectance\"><float name=\"color1\" value=\"1.4\"/></texture>";
    let scene =
        read(&format!("<shape type=\"sphere\"><bsdf type=\"diffuse\">{texture}</bsdf></shape>"));
    let pattern = &texture_of(scene.materials[0].surface.clone()).pattern;
    assert_eq!(*pattern, Pattern::Checkerboard([[0.4; 3], [1.4; 3]]));
    let noted =
        scene.warnings.iter().filter(|note| note.message.contains("above 1 are clamped to 1"));
    assert_eq!(noted.count(), 1, "{:?}", scene.warnings);
}

#[test]
fn raw_constants_are_the_same_everywhere() {
    let of = |value: &str| {
        let texture =
            format!("<texture type=\"rawconstant\" name=\"reflectance\">{value}</texture>");
        texture_of(surface(&format!("<bsdf type=\"diffuse\">{texture}</bsdf>"))).pattern.clone()
    };
    let constant = |color| Pattern::Checkerboard([color; 2]);
    assert_eq!(of("<float name=\"value\" value=\"0.25\"/>"), constant([0.25; 3]));
    assert_eq!(of("<vector name=\"value\" value=\"0.25, 0.5, 1\"/>"), constant([0.25, 0.5, 1.0]));
}

#[test]
fn shapes_may_have_an_emission_texture() {
    let texture = bitmap("radiance", "");
    let lamp = material(&format!("<emitter type=\"area\">{texture}</emitter>"));
    let Color::Texture(texture) = lamp.emission else { panic!("{:?}", lamp.emission) };
    assert!(matches!(texture.pattern, Pattern::Bitmap(_)));
    assert_eq!(lamp.surface, Black.into());
}

#[test]
fn roughness_may_depend_on_the_direction_and_the_place() {
    let alphas = |inner: &str| {
        let metal = surface(&format!("<bsdf type=\"roughconductor\">{inner}</bsdf>"));
        let Surface::Conductor(Conductor { roughness: Some(roughness), .. }) = metal else {
            panic!("{metal:?}")
        };
        roughness.alpha
    };
    let two = "<float name=\"alpha_u\" value=\"0.25\"/><float name=\"alpha_v\" value=\"0.5\"/>";
    assert_eq!(alphas(two), [0.25.into(), 0.5.into()]);
    let [u, v] = alphas(&bitmap("alpha", ""));
    assert!(u.texture().is_some() && u == v);
}

#[test]
fn surfaces_are_made_of_others() {
    let (grey, red) = (
        Diffuse { reflectance: [0.5; 3].into(), two_sided: false },
        Diffuse { reflectance: [1.0, 0.0, 0.0].into(), two_sided: false },
    );
    let boxed = |matte: &Diffuse| Box::new(Surface::from(matte.clone()));
    let inner = "<bsdf type=\"diffuse\"/><bsdf type=\"diffuse\">\
                 <rgb name=\"reflectance\" value=\"1, 0, 0\"/></bsdf>";
    let blend =
        format!("<bsdf type=\"blendbsdf\"><float name=\"weight\" value=\"0.25\"/>{inner}</bsdf>");
    let mix = Mix { first: boxed(&grey), second: boxed(&red), amount: 0.25.into() };
    assert_eq!(surface(&blend), mix.into());
    let behind = Diffuse { two_sided: true, ..red.clone() };
    let sides = TwoSided { front: boxed(&grey), back: boxed(&behind) };
    assert_eq!(surface(&format!("<bsdf type=\"twosided\">{inner}</bsdf>")), sides.into());
    let mask = "<bsdf type=\"mask\"><float name=\"opacity\" value=\"0.25\"/>\
                <bsdf type=\"diffuse\"/></bsdf>";
    let (mask, null) = (material(mask), material("<bsdf type=\"null\"/>"));
    assert_eq!((mask.surface, mask.opacity), (grey.clone().into(), 0.25.into()));
    assert_eq!((null.surface, null.opacity), (Black.into(), 0.0.into()));
}
