//! Materials that vary: textures, opacity, mixtures, two sides, normal maps and bump maps.

use std::f32::consts::PI;
use std::sync::Arc;

use pathtracer::{Film, Scene, Settings};
use pt_math::{DAffine3, DMat3, DVec3, Spectrum};
use pt_scene::image::Image;
use pt_scene::material::{
    Black, CoatedConductor, CoatedDiffuse, Conductor, DiffuseTransmission, Distribution,
    FresnelPlastic, Glass, Hair, Masking, MetallicRoughness, Mirror, Mix, Pigment, Plastic,
    Principled, PrincipledThin, Refraction, RoughCoatedDiffuse, RoughDiffuse, Roughness,
    SurfaceDetail, ThinGlass, TwoSided,
};
use pt_scene::texture::{
    Bitmap, Color, Filter, NormalOrBump, Pattern, Scalar, Texture, TextureMapping, Wrap,
};
use pt_scene::{LightKind, Surface};

use crate::furnace::ESTIMATORS;
use crate::measure::{assert_all_agree, assert_uniform, render, settings};
use crate::scenes::{Builder, camera, cornell, facing, matte, size};

const COLOR: [f32; 3] = [0.7, 0.4, 0.2];
const OTHER: [f32; 3] = [0.3, 0.6, 0.5];
const GREY: [f32; 3] = [0.3; 3];
const FAR: DVec3 = DVec3::new(0.0, 0.0, 4.0);

/// Image of one row, without interpolation between its texels.
pub(crate) fn row(pixels: &[[f32; 3]], filter: Filter) -> Arc<Texture> {
    let image = Image { width: pixels.len() as u32, height: 1, pixels: pixels.to_vec().into() };
    let bitmap = Bitmap { image: Arc::new(image), wrap: Wrap::CLAMP, filter };
    Arc::new(Texture::from(Pattern::Bitmap(bitmap)))
}

fn texture_of(color: [f32; 3]) -> Color {
    Color::Texture(row(&[color], Filter::Nearest))
}

fn number_of(value: f32) -> Scalar {
    Scalar::Texture(row(&[[value; 3]], Filter::Nearest))
}

/// One number, as the luminance of a grey texel.
fn number(textured: bool) -> Scalar {
    if textured {
        Scalar::Texture(row(&[GREY], Filter::Nearest))
    } else {
        Spectrum::from(GREY).luminance().into()
    }
}

/// A glTF material with all of its parameters.
fn metallic_roughness(
    color: impl Fn([f32; 3]) -> Color,
    share: impl Fn(f32) -> Scalar,
) -> MetallicRoughness {
    MetallicRoughness {
        base_color: color(COLOR),
        metallic: share(0.125),
        roughness: share(0.5),
        specular: share(0.75),
        specular_color: color(OTHER),
        transmission: share(0.375),
        diffuse_transmission: share(0.25),
        diffuse_transmission_color: color(OTHER),
        anisotropy: share(0.5625),
        anisotropy_direction: [share(0.75), share(0.25)],
        iridescence: share(0.625),
        sheen_color: color(COLOR),
        sheen_roughness: share(0.0625),
        clearcoat: share(0.5625),
        clearcoat_roughness: share(0.1875),
        thin: true,
        ..MetallicRoughness::default()
    }
}

/// A principled material with all of its parameters.
fn principled(color: impl Fn([f32; 3]) -> Color, share: impl Fn(f32) -> Scalar) -> Principled {
    Principled {
        base_color: color(COLOR),
        roughness: share(0.5),
        anisotropic: share(0.25),
        metallic: share(0.125),
        spec_trans: share(0.375),
        spec_tint: share(0.625),
        sheen: share(0.75),
        sheen_tint: share(0.875),
        flatness: share(0.0625),
        clearcoat: share(0.5625),
        clearcoat_gloss: share(0.1875),
        ..Principled::default()
    }
}

/// A principled thin sheet with all of its parameters.
fn principled_thin(
    color: impl Fn([f32; 3]) -> Color,
    share: impl Fn(f32) -> Scalar,
) -> PrincipledThin {
    PrincipledThin {
        base_color: color(COLOR),
        roughness: share(0.5),
        anisotropic: share(0.25),
        spec_trans: share(0.375),
        spec_tint: share(0.625),
        sheen: share(0.75),
        sheen_tint: share(0.875),
        flatness: share(0.0625),
        diff_trans: share(0.5625),
        ..PrincipledThin::default()
    }
}

pt_scene::surfaces!(kinds);

/// Surfaces of all kinds whose parameters are values, or textures of these values.
pub(crate) fn surfaces(textured: bool) -> Vec<Surface> {
    KINDS.iter().flat_map(|kind| examples(*kind, textured)).collect()
}

/// Surfaces of a kind. None of the kinds without numbers in their lobe, or with other surfaces
/// inside; measured ones are in `measured.rs`.
fn examples(kind: Kind, textured: bool) -> Vec<Surface> {
    let color = |c: [f32; 3]| if textured { texture_of(c) } else { c.into() };
    let roughness = || Roughness {
        alpha: [number(textured), number(textured)],
        distribution: Distribution::Ggx,
        masking: Masking::Correlated,
        multiple_scattering: false,
    };
    let followed = || Roughness { multiple_scattering: true, ..roughness() };
    let share = |value: f32| if textured { number_of(value) } else { value.into() };
    let (reflectance, diffuse) = (color(COLOR), color(COLOR));
    let (transmittance, specular) = (color(OTHER), color(OTHER));
    let (eta, k) = ([0.2, 0.9, 1.1], [3.9, 2.5, 2.3]);
    let (ior, alpha, two_sided) = (1.5, 0.2, true);
    let surface: Surface = match kind {
        Kind::Diffuse => pt_scene::material::Diffuse { reflectance, two_sided }.into(),
        Kind::RoughDiffuse => {
            RoughDiffuse { reflectance, roughness: number(textured), two_sided }.into()
        }
        Kind::Mirror => Mirror { reflectance }.into(),
        Kind::Glass => {
            let glass = |roughness| -> Surface {
                let (reflectance, transmittance) = (reflectance.clone(), transmittance.clone());
                Glass { reflectance, transmittance, ior, roughness }.into()
            };
            return [None, Some(roughness()), Some(followed())].map(glass).into();
        }
        Kind::ThinGlass => ThinGlass { reflectance, transmittance, ior }.into(),
        Kind::Refraction => Refraction { transmittance, ior }.into(),
        Kind::Conductor => {
            let metal = |roughness| -> Surface {
                let reflectance = reflectance.clone();
                Conductor { eta, k, reflectance, roughness, two_sided }.into()
            };
            return [None, Some(roughness()), Some(followed())].map(metal).into();
        }
        Kind::CoatedDiffuse => {
            CoatedDiffuse { diffuse, specular, ior, nonlinear: true, two_sided }.into()
        }
        Kind::RoughCoatedDiffuse => {
            let (distribution, nonlinear) = (Distribution::Ggx, true);
            RoughCoatedDiffuse { diffuse, specular, ior, alpha, distribution, nonlinear, two_sided }
                .into()
        }
        Kind::FresnelPlastic => {
            FresnelPlastic { diffuse, specular, ior, roughness: roughness(), two_sided }.into()
        }
        Kind::CoatedConductor => {
            let (coat_alpha, thickness) = (0.3, 0.25);
            CoatedConductor { eta, k, alpha, ior, coat_alpha, thickness, two_sided }.into()
        }
        Kind::Plastic => Plastic { diffuse, specular, alpha, two_sided }.into(),
        Kind::Principled => principled(color, share).into(),
        Kind::PrincipledThin => principled_thin(color, share).into(),
        Kind::MetallicRoughness => metallic_roughness(color, share).into(),
        Kind::DiffuseTransmission => DiffuseTransmission { reflectance, transmittance }.into(),
        Kind::Hair => Hair { pigment: Pigment::Reflectance(reflectance), ..Hair::default() }.into(),
        Kind::Measured | Kind::Black | Kind::Mix | Kind::TwoSided | Kind::SurfaceDetail => {
            return Vec::new();
        }
    };
    vec![surface]
}

/// A lamp and a textured surface, with texture coordinates as vertex values or by a transform of
/// others.
#[test]
fn pictures_lie_on_other_coordinates_as_on_those_of_the_mesh() {
    // (u, v) of the texture are (2u + ¼, ½v + ¼u).
    let to_pattern = DMat3::from_cols(
        DVec3::new(2.0, 0.25, 0.0),
        DVec3::new(0.0, 0.5, 0.0),
        DVec3::new(0.25, 0.0, 1.0),
    );
    let pixels = (0..64).map(|i: u16| [0.1, 0.4, 0.8].map(|c| c + f32::from(i % 7) * 0.02));
    let image = Arc::new(Image { width: 8, height: 8, pixels: pixels.collect() });
    let scene = |is_value: bool| {
        let bitmap =
            Bitmap { image: Arc::clone(&image), wrap: Wrap::REPEAT, filter: Filter::Bilinear };
        let pattern = Pattern::Bitmap(bitmap);
        let texture = Arc::new(if is_value {
            let layout = TextureMapping::Coordinates { set: 1 };
            Texture { pattern, layout, to_pattern: DMat3::IDENTITY }
        } else {
            Texture::on_surface(pattern, to_pattern)
        });
        let mut square = pt_scene::shapes::rectangle();
        let uvs = square.uvs.as_ref().expect("coordinates").values.clone();
        let moved = |[u, v]: [f32; 2]| [2.0 * u + 0.25, 0.5 * v + 0.25 * u, 0.0];
        square.attributes.vertices.insert("uv_1".into(), uvs.into_iter().map(moved).collect());
        let painted = pt_scene::material::Diffuse {
            reflectance: Color::Texture(Arc::clone(&texture)),
            two_sided: true,
        };
        Builder::default()
            .mesh(square.clone(), facing(DVec3::ZERO, DVec3::Y, 1.0), painted.into())
            .mesh(square, facing(DVec3::Y * 1.5, DVec3::NEG_Y, 0.5), Black.into())
            .emitting(texture)
            .seen_by(camera(DVec3::new(0.0, 1.0, 3.0), DVec3::ZERO, [40.0, 30.0]))
    };
    let [values, transformed] = [true, false].map(|is_value| film(&scene(is_value), 64, 3));
    for (a, b) in values.pixels().zip(transformed.pixels()) {
        for (a, b) in a.mean().into_iter().zip(b.mean()) {
            assert!((a - b).abs() <= 1e-4 * b.abs().max(0.01), "{a} {b}");
        }
    }
}

fn film(scene: &Scene, spp: u32, seed: u32) -> Film {
    let settings = Settings { max_depth: 6, seed, ..settings(spp) };
    render(scene, size([10, 8]), settings).film().clone()
}

/// A ball lit from one side, so that all parameters of lobes have an effect.
fn ball(surface: Surface) -> Scene {
    Builder::default()
        .sphere(DVec3::ZERO, 1.0, surface)
        .emissive_quad(facing(DVec3::new(2.0, 2.0, 2.0), DVec3::new(-1.0, -1.0, -1.0), 1.0), 5.0)
        .sky(0.3)
        .seen_by(camera(FAR, DVec3::ZERO, [40.0, 32.0]))
}

/// A texture of one colour equals that colour, to the bit: each texture is assigned to the right
/// parameter.
#[test]
fn a_texture_of_one_colour_is_the_colour() {
    for (value, textured) in surfaces(false).into_iter().zip(surfaces(true)) {
        let name = format!("{value:?}");
        assert!(film(&ball(value), 64, 0) == film(&ball(textured), 64, 0), "{name}");
    }
}

/// A wall that fills the view, under an environment of radiance 1.
fn wall(surface: Surface, normal: DVec3) -> Scene {
    Builder::default().quad(facing(DVec3::ZERO, normal, 1.0), surface).sky(1.0).seen_by(camera(
        FAR,
        DVec3::ZERO,
        [8.0, 6.0],
    ))
}

fn boxed(reflectance: f32) -> Box<Surface> {
    matte([reflectance; 3]).into()
}

/// The mean of a mixture is the weighted mean of its parts; also of a mixture of mixtures.
#[test]
fn mixtures_scatter_what_their_parts_do() {
    let mix = |first, second, share: f32| Mix { first, second, amount: share.into() };
    let cases = [
        (mix(boxed(0.2), boxed(0.8), 0.0), 0.2),
        (mix(boxed(0.2), boxed(0.8), 1.0), 0.8),
        (mix(boxed(0.2), boxed(0.8), 0.25), 0.35),
        (mix(Box::new(mix(boxed(0.2), boxed(0.8), 0.5).into()), boxed(0.0), 0.4), 0.3),
    ];
    for (mix, want) in cases {
        let name = format!("{mix:?}");
        assert_uniform(&film(&wall(mix.into(), DVec3::Z), 4096, 1), want, 1e-4, &name);
    }
}

/// Each side has its own surface, and is lit from its side.
#[test]
fn sides_may_differ() {
    let sided = || Surface::from(TwoSided { front: boxed(0.2), back: boxed(0.8) });
    for (normal, want) in [(DVec3::Z, 0.2), (DVec3::NEG_Z, 0.8)] {
        assert_uniform(&film(&wall(sided(), normal), 1024, 2), want, 1e-4, "a side");
    }
}

fn with_opacity(mut scene: Scene, material: usize, opacity: Scalar) -> Scene {
    scene.materials[material].opacity = opacity;
    scene
}

/// Two black sheets in front of the environment transmit (1 − a)(1 − b) of it, and a hole in the
/// opacity texture of one of them all of the rest.
#[test]
fn light_goes_on_through_what_is_not_there() {
    let sheets = || {
        Builder::default()
            .quad(facing(DVec3::ZERO, DVec3::Z, 1.0), Black.into())
            .quad(facing(DVec3::NEG_Z, DVec3::NEG_Z, 3.0), Black.into())
            .sky(1.0)
            .seen_by(camera(FAR, DVec3::ZERO, [8.0, 6.0]))
    };
    let scene = with_opacity(with_opacity(sheets(), 0, 0.3.into()), 1, 0.6.into());
    assert_uniform(&film(&scene, 4096, 3), 0.7 * 0.4, 1e-4, "two sheets");
    let clear = Scalar::Texture(row(&[[0.0; 3]], Filter::Nearest));
    let scene = with_opacity(with_opacity(sheets(), 0, clear), 1, 0.6.into());
    assert_uniform(&film(&scene, 4096, 4), 0.4, 1e-4, "one sheet");
}

/// A floor lit by a point light through a sheet receives the fraction of the light that the sheet
/// transmits, with each estimator of direct light.
#[test]
fn shadows_have_the_holes_of_what_casts_them() {
    let floor = |opacity: f32| {
        let sheet = Builder::default()
            .quad(facing(DVec3::Y, DVec3::Y, 2.0), Black.into())
            .quad(facing(DVec3::ZERO, DVec3::Y, 1.0), matte([0.5; 3]))
            .light(
                LightKind::Point { intensity: [4.0; 3] },
                DAffine3::from_translation(DVec3::Y * 2.0),
            );
        let eye = camera(DVec3::new(0.0, 0.5, 1.0), DVec3::ZERO, [2.0, 1.6]);
        with_opacity(sheet.seen_by(eye), 0, opacity.into())
    };
    let at_center = |opacity| film(&floor(opacity), 4, 0).pixels().nth(44).unwrap().luminance().0;
    let open = at_center(0.0);
    assert!((open - 0.5 / f64::from(PI)).abs() < 1e-3, "{open}");
    for opacity in [0.25, 0.5, 1.0] {
        let share = 1.0 - f64::from(opacity);
        assert!((at_center(opacity) - share * open).abs() < 1e-6, "{opacity}");
    }
}

/// A constant slope, as a normal and as heights, tilts a wall to the light of the sun.
#[test]
fn reliefs_turn_the_surface_to_the_light() {
    const SLOPE: f32 = 0.5;
    let down = DAffine3::from_translation(DVec3::ZERO); // shines along −z
    let context = |relief: NormalOrBump| {
        let surface = SurfaceDetail::new(matte([1.0; 3]), relief);
        let scene = Builder::default()
            .quad(facing(DVec3::ZERO, DVec3::Z, 1.0), surface.into())
            .light(LightKind::Directional { irradiance: [PI; 3] }, down)
            .seen_by(camera(FAR, DVec3::ZERO, [2.0, 1.6]));
        film(&scene, 4, 0)
    };
    // The side of the wall is 2 for 1 of u, so that heights of 2 · slope over it have the slope.
    let heights = row(&[[-SLOPE; 3], [SLOPE; 3]], Filter::Bilinear);
    let n = [-SLOPE, 0.0, 1.0].map(|x| 0.5 * (x / (1.0 + SLOPE * SLOPE).sqrt() + 1.0));
    let want = 1.0 / (1.0 + f64::from(SLOPE * SLOPE)).sqrt();
    for relief in
        [NormalOrBump::Normals(row(&[n], Filter::Nearest)), NormalOrBump::Heights(heights, 0.5)]
    {
        let film = context(relief);
        for pixel in film.pixels() {
            let got = pixel.luminance().0;
            assert!((got - want).abs() < 1e-4, "{got} {want}");
        }
    }
}

/// Room of the other tests with all of these materials.
fn room() -> Scene {
    let chess = |colors| {
        let to_pattern = DMat3::from_diagonal(DVec3::new(2.0, 3.0, 1.0));
        Arc::new(Texture::on_surface(Pattern::Checkerboard(colors), to_pattern))
    };
    let gold = Conductor {
        eta: [0.2, 0.4, 1.4],
        k: [3.9, 2.4, 1.6],
        reflectance: [1.0; 3].into(),
        roughness: Some(Roughness {
            alpha: [0.2.into(), 0.6.into()],
            distribution: Distribution::Ggx,
            masking: Masking::Correlated,
            multiple_scattering: false,
        }),
        two_sided: true,
    };
    let share = Scalar::Texture(chess([[0.2; 3], [0.9; 3]]));
    let mix = Mix { first: Box::new(gold.into()), second: boxed(0.5), amount: share };
    let relief = NormalOrBump::Normals(row(&[[0.7, 0.4, 0.9], [0.4, 0.6, 0.9]], Filter::Bilinear));
    let floor = SurfaceDetail::new(matte([0.6; 3]), relief);
    let mut scene = Builder(cornell())
        .sphere(DVec3::new(-0.3, 0.3, 0.2), 0.3, mix.into())
        .quad(facing(DVec3::NEG_Y * 0.9, DVec3::Y, 0.9), floor.into())
        .quad(facing(DVec3::new(0.2, 0.5, 0.0), DVec3::new(0.3, 1.0, 0.2), 0.5), boxed_sided())
        .0;
    let screen = scene.materials.len() - 1;
    scene.materials[screen].opacity = Scalar::Texture(chess([[0.1; 3], [0.8; 3]]));
    scene
}

fn boxed_sided() -> Surface {
    TwoSided { front: boxed(0.3), back: boxed(0.7) }.into()
}

/// All estimators of direct light agree where materials vary, pixel by pixel.
#[test]
fn estimators_agree_where_materials_vary() {
    let films: Vec<_> = ESTIMATORS
        .into_iter()
        .zip(0..)
        .map(|(direct, seed)| {
            let settings = Settings { direct, seed, max_depth: 4, ..settings(4096) };
            (format!("{direct:?}"), render(&room(), size([12, 10]), settings).film().clone())
        })
        .collect();
    assert_all_agree(&films);
}

/// Anisotropy along a combination of ∂p/∂u and ∂p/∂v is rotated by their angle on a square whose
/// coordinates are square, too.
#[test]
fn anisotropy_turns_with_its_direction() {
    let film = |anisotropy_along: Option<Arc<Texture>>, anisotropy_rotation: f32| {
        let brushed = MetallicRoughness {
            metallic: 1.0.into(),
            roughness: 0.2.into(),
            anisotropy: 0.9.into(),
            anisotropy_rotation,
            anisotropy_along,
            ..MetallicRoughness::default()
        };
        let scene = Builder::default()
            .quad(facing(DVec3::ZERO, DVec3::Z, 1.0), brushed.into())
            .light(LightKind::Point { intensity: [9.0; 3] }, DAffine3::from_translation(DVec3::Z))
            .seen_by(camera(DVec3::Z * 4.0, DVec3::ZERO, [25.0, 25.0]));
        render(&scene, size([12, 12]), settings(16)).film().clone()
    };
    let values = |film: &Film| film.pixels().map(|pixel| pixel.luminance().0).collect::<Vec<_>>();
    let along = row(&[[0.5, 0.75, 0.0]], Filter::Nearest);
    let turned = values(&film(None, f32::atan2(0.75, 0.5)));
    for (a, b) in values(&film(Some(along), 0.0)).iter().zip(&turned) {
        assert!((a / b - 1.0).abs() < 1e-3, "{a} is not {b}");
    }
    let straight = values(&film(None, 0.0));
    assert!(straight.iter().zip(&turned).any(|(a, b)| (a / b - 1.0).abs() > 0.1), "it matters");
}
