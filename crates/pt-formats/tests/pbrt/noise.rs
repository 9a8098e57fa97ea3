//! Procedural textures, and texture mappings in space.

use pt_math::{DAffine3, DMat3, DVec3};
use pt_scene::material::{Conductor, Diffuse};
use pt_scene::texture::{Input, Marble, Noise, Pattern, Procedural, Texture, TextureMapping};
use pt_scene::{Geometry, Scene, Surface};

use super::read;

fn scene(textures: &str) -> Scene {
    let world =
        format!("{textures} Material \"diffuse\" \"texture reflectance\" \"t\" Shape \"sphere\"");
    read("", &world)
}

/// Returns the texture `t` of the diffuse surface.
fn texture(textures: &str) -> Texture {
    let mut scene = scene(textures);
    let Surface::Diffuse(Diffuse { reflectance: Input::Texture(texture), .. }) =
        scene.materials.to_mut().swap_remove(0).surface
    else {
        panic!("not textured")
    };
    (*texture).clone()
}

/// Returns the texture coordinates of a world-space point.
fn at(texture: &Texture, p: DVec3) -> DVec3 {
    let (TextureMapping::Space { to_texture }
    | TextureMapping::Sphere { to_texture }
    | TextureMapping::Cylinder { to_texture }) = texture.layout
    else {
        panic!("it is not in space")
    };
    to_texture.transform_point3(p)
}

const PLACED: &str = "Translate 1 2 3 Scale 2 4 8";
const POINT: DVec3 = DVec3::new(3.0, 6.0, 11.0);

/// Points are in the coordinate system of the directive; the layers of marble are refined by their
/// scale.
#[test]
fn noise_is_where_its_directive_stands() {
    let marble = texture(&format!(
        "{PLACED} Texture \"t\" \"spectrum\" \"marble\" \"float scale\" 3 \"integer octaves\" 5 \"float variation\" .5 Identity"
    ));
    let noise = Noise { octaves: 5, roughness: 0.5 };
    let want = Procedural::Marble(Marble { noise, variation: 0.5 });
    assert_eq!(marble.pattern, Pattern::Procedural(want));
    assert_eq!((at(&marble, POINT), marble.to_pattern), (DVec3::splat(3.0), DMat3::IDENTITY));
    let cubes = texture(&format!(
        "{PLACED} Texture \"t\" \"spectrum\" \"checkerboard\" \"integer dimension\" 3 \"rgb tex2\" [.1 .2 .3] Identity"
    ));
    let want = Procedural::Checkerboard3d([[1.0; 3], [0.1, 0.2, 0.3]]);
    assert_eq!(cubes.pattern, Pattern::Procedural(want));
    assert_eq!(at(&cubes, POINT), DVec3::splat(0.5));
    for (kind, want) in [
        ("fbm", Procedural::Fbm(Noise::default())),
        ("wrinkled", Procedural::Wrinkled(Noise::default())),
        ("windy", Procedural::Windy),
    ] {
        let blend = texture(&format!(
            "{PLACED} Texture \"n\" \"float\" \"{kind}\" Identity \
             Texture \"t\" \"spectrum\" \"mix\" \"texture amount\" \"n\""
        ));
        let Pattern::Blend(blend) = blend.pattern else { panic!("no blend") };
        let share = blend.amount.texture().expect("a texture");
        let want = Pattern::Procedural(want);
        assert_eq!((&share.pattern, at(share, POINT)), (&want, DVec3::ONE));
    }
}

/// u and v are dot products with both directions; the transform as a whole may be singular.
#[test]
fn mappings_are_those_of_their_names() {
    let of = |mapping: &str| {
        texture(&format!(
            "{PLACED} Texture \"t\" \"spectrum\" \"dots\" \"string mapping\" {mapping} Identity"
        ))
    };
    let planar = of("\"planar\" \"vector3 v1\" [1 2 0] \"vector v2\" [0 0 3] \"float udelta\" .25");
    assert_eq!(at(&planar, POINT), DVec3::new(3.25, 3.0, 0.0));
    assert_eq!(at(&of("\"planar\""), POINT).truncate().to_array(), [1.0, 1.0]);
    let (sphere, cylinder) = (of("\"spherical\""), of("\"cylindrical\""));
    assert!(
        matches!(sphere.layout, TextureMapping::Sphere { .. }) && at(&sphere, POINT) == DVec3::ONE
    );
    assert!(
        matches!(cylinder.layout, TextureMapping::Cylinder { .. })
            && at(&cylinder, POINT) == DVec3::ONE
    );
    let want = Procedural::Dots([[0.0; 3], [1.0; 3]]);
    assert_eq!(sphere.pattern, Pattern::Procedural(want));
}

/// The direction is in the coordinate system of the directive, and of length 1 in the world.
#[test]
fn textures_are_mixed_by_where_surfaces_look_to() {
    let of = |parameters: &str| {
        texture(&format!(
            "Rotate 90 1 0 0 Scale 1 1 5 Texture \"t\" \"spectrum\" \"directionmix\" {parameters} Identity"
        ))
    };
    let mixed = of("\"rgb tex1\" [.1 .2 .3] \"vector3 dir\" [0 0 -2]");
    let Pattern::Blend(blend) = mixed.pattern else { panic!("no blend") };
    assert_eq!([blend.first, blend.second], [[1.0; 3].into(), [0.1, 0.2, 0.3].into()]);
    let share = blend.amount.texture().expect("a texture");
    let Pattern::AbsNormalDot(direction) = share.pattern else { panic!("no normal") };
    assert!((DVec3::from(direction.map(f64::from)) - DVec3::Y).length() < 1e-6, "{direction:?}");
    let Pattern::Blend(by_default) = of("").pattern else { panic!("no blend") };
    assert_eq!([by_default.first, by_default.second], [[1.0; 3].into(), [0.0; 3].into()]);
    let share = by_default.amount.texture().expect("a texture");
    let Pattern::AbsNormalDot(direction) = share.pattern else { panic!("no normal") };
    assert!((DVec3::from(direction.map(f64::from)) - DVec3::Z).length() < 1e-6, "{direction:?}");
}

/// Spheres remain spheres with textures that use no texture coordinates.
#[test]
fn what_needs_no_coordinates_gets_none() {
    let is_sphere =
        |textures: &str| matches!(scene(textures).objects[0].geometry, Geometry::Sphere { .. });
    assert!(is_sphere("Texture \"t\" \"spectrum\" \"marble\""));
    assert!(is_sphere("Texture \"t\" \"spectrum\" \"dots\" \"string mapping\" \"planar\""));
    assert!(is_sphere("Texture \"t\" \"spectrum\" \"directionmix\""));
    assert!(!is_sphere("Texture \"t\" \"spectrum\" \"dots\""));
}

/// For a roughness of noise, the root is evaluated pointwise.
#[test]
fn roughness_by_noise_has_its_root() {
    let mut scene = read(
        "",
        "Texture \"n\" \"float\" \"wrinkled\" Material \"conductor\" \"texture roughness\" \"n\" Shape \"sphere\"",
    );
    let Surface::Conductor(Conductor { roughness: Some(r), .. }) =
        scene.materials.to_mut().swap_remove(0).surface
    else {
        panic!("no rough metal")
    };
    let Pattern::Sqrt(square) = &r.alpha[0].texture().expect("a texture").pattern else {
        panic!("no root")
    };
    let square = square.texture().expect("a texture");
    let want = Procedural::Wrinkled(Noise::default());
    assert_eq!(square.pattern, Pattern::Procedural(want));
    assert_eq!(square.layout, TextureMapping::Space { to_texture: DAffine3::IDENTITY });
}

#[test]
fn textures_stay_where_they_are_at_the_start() {
    let moves = "ActiveTransform EndTime Translate 1 0 0 ActiveTransform All";
    let count = |textures: &str| {
        let scene = scene(textures);
        scene
            .warnings
            .iter()
            .filter(|w| w.message.contains("moving textures are not supported"))
            .count()
    };
    assert_eq!(count(&format!("{moves} Texture \"t\" \"spectrum\" \"marble\"")), 1);
    assert_eq!(count(&format!("{moves} Texture \"t\" \"spectrum\" \"directionmix\"")), 1);
    assert_eq!(count(&format!("{moves} Texture \"t\" \"spectrum\" \"dots\"")), 0);
    assert_eq!(count("Texture \"t\" \"spectrum\" \"marble\""), 0);
}
