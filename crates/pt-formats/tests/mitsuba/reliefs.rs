//! Normal and bump maps, and opacities, by the options of their bsdfs and by the integrator.

use pt_scene::Surface;
use pt_scene::material::{Averted, Mix, SurfaceDetail, ThinGlass, TwoSided};
use pt_scene::texture::{NormalOrBump, Scalar};

use super::materials::bitmap;
use super::{read, surface};

#[test]
fn reliefs_are_normals_or_heights() {
    let embossed = |bsdf: String| {
        let Surface::SurfaceDetail(SurfaceDetail { relief, .. }) = surface(&bsdf) else {
            panic!("{bsdf}")
        };
        relief
    };
    let inner = "<bsdf type=\"diffuse\"/>";
    let normals = bitmap("normalmap", "<boolean name=\"raw\" value=\"true\"/>");
    let normals = embossed(format!("<bsdf type=\"normalmap\">{normals}{inner}</bsdf>"));
    assert!(matches!(normals, NormalOrBump::Normals(_)));
    let scale = "<float name=\"scale\" value=\"0.5\"/>";
    let heights =
        embossed(format!("<bsdf type=\"bumpmap\">{}{scale}{inner}</bsdf>", bitmap("", "")));
    assert!(matches!(heights, NormalOrBump::Heights(_, 0.5)));
}

/// Shadowing and the flipping of normals are on by default in both kinds of maps. With "twosided"
/// outside of the map, the back is the mirror image of the front; with "twosided" inside, it is the
/// other side of the relief.
#[test]
fn reliefs_shade_as_described() {
    let embossed = |bsdf: &str| {
        let Surface::SurfaceDetail(embossed) = surface(bsdf) else { panic!("{bsdf}") };
        embossed
    };
    let relief = |kind: &str, options: &str, inner: &str| {
        let map = bitmap(if kind == "normalmap" { kind } else { "" }, "");
        format!("<bsdf type=\"{kind}\">{map}{options}{inner}</bsdf>")
    };
    let two_sided = |inner: &str| format!("<bsdf type=\"twosided\">{inner}</bsdf>");
    let diffuse = "<bsdf type=\"diffuse\"/>";
    let off = "<boolean name=\"use_shadowing_function\" value=\"false\"/>\
               <boolean name=\"flip_invalid_normals\" value=\"false\"/>";
    for kind in ["normalmap", "bumpmap"] {
        let on = embossed(&relief(kind, "", diffuse));
        assert_eq!((on.shadowing, on.averted, on.mirrored), (true, Averted::Turned, false));
        let off = embossed(&relief(kind, off, diffuse));
        assert_eq!((off.shadowing, off.averted), (false, Averted::Black));
        let outside = embossed(&two_sided(&relief(kind, "", diffuse)));
        let inside = embossed(&relief(kind, "", &two_sided(diffuse)));
        assert!(outside.mirrored && !inside.mirrored);
        assert_eq!(outside.surface, inside.surface);
        let both = two_sided(&format!("{diffuse}{}", relief(kind, "", diffuse)));
        let Surface::TwoSided(TwoSided { back, .. }) = surface(&both) else { panic!("{both}") };
        assert!(matches!(*back, Surface::SurfaceDetail(SurfaceDetail { mirrored: true, .. })));
    }
}

/// Returns the opacities of a mask and a `null`, and the surface of the mask, in a scene with this
/// content.
fn holes(content: &str) -> ([Scalar; 2], Surface) {
    let mask = "<shape type=\"sphere\"><bsdf type=\"mask\"><float name=\"opacity\" value=\"0.25\"/>\
                <bsdf type=\"diffuse\"/></bsdf></shape>";
    let null = "<shape type=\"sphere\"><bsdf type=\"null\"/></shape>";
    let mut scene = read(&format!("{mask}{null}{content}"));
    let [mask, null] = &mut scene.materials[..] else { panic!("two materials") };
    ([mask.opacity.clone(), null.opacity.clone()], mask.surface.clone())
}

/// Without media, opacities become a thin glass of index 1 if a path depth limit counts them, or if
/// a light without an extent could shine through them. Otherwise, and for media, they are kept.
#[test]
fn holes_are_counted_where_mitsuba_counts_them() {
    let path = |depth: i32| {
        format!(
            "<integrator type=\"path\"><integer name=\"max_depth\" value=\"{depth}\"/></integrator>"
        )
    };
    let media = path(4).replace("path", "volpath");
    let spot = "<emitter type=\"spot\"/>".to_owned();
    let sky = "<emitter type=\"constant\"/>".to_owned();
    let open = [Scalar::Value(0.25), Scalar::Value(0.0)];
    for content in [String::new(), path(-1), media.clone(), sky, format!("{media}{spot}")] {
        let (opacities, surface) = holes(&content);
        assert_eq!(opacities, open, "{content}");
        assert!(matches!(surface, Surface::Diffuse(_)), "{content}");
    }
    for content in [path(4), spot] {
        let (opacities, surface) = holes(&content);
        assert_eq!(opacities, [1.0; 2].map(Scalar::Value), "{content}");
        let Surface::Mix(Mix { first, second, amount: share }) = surface else {
            panic!("{content}")
        };
        assert!(matches!(*first, Surface::ThinGlass(ThinGlass { ior: 1.0, .. })), "{content}");
        assert!(
            matches!(*second, Surface::Diffuse(_)) && share == Scalar::Value(0.25),
            "{content}"
        );
    }
}
