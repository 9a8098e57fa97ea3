//! Approximates any surface by a metallic-roughness material of glTF.

use pt_scene::material::{
    CoatedConductor, Conductor, DiffuseTransmission, Glass, MetallicRoughness, Mix, Principled,
    PrincipledThin, Roughness, SurfaceDetail, ThinGlass,
};
use pt_scene::texture::{Input, NormalOrBump, Pattern, Scalar};
use pt_scene::{Color, Surface};

use super::layer::mapped;
use crate::shared::legacy_specular;

/// Interior of an object, by its surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum BaseMaterial {
    /// No light is transmitted.
    Opaque,
    /// A solid with an interior that transmits light.
    Solid,
    /// A thin sheet without an interior.
    Sheet,
}

/// A metallic-roughness surface.
#[derive(Debug)]
pub(super) struct ApproximateMaterial {
    pub(super) look: MetallicRoughness,
    pub(super) body: BaseMaterial,
    pub(super) relief: Option<NormalOrBump>,
}

/// √α of a sheen that is about as wide as that of Burley, which has no roughness.
const SHEEN_ROUGHNESS: f32 = 0.5;

/// Returns the best approximation of a surface. `note` receives a note for each difference.
pub(super) fn approximate(surface: &Surface, note: &mut dyn FnMut(&str)) -> ApproximateMaterial {
    let look = match surface {
        Surface::SurfaceDetail(embossed) => return relief(embossed, note),
        Surface::TwoSided(sided) => {
            note("the back side becomes like the front side");
            let inner = approximate(&sided.front, note);
            let look = MetallicRoughness { two_sided: true, ..inner.look };
            return ApproximateMaterial { look, ..inner };
        }
        Surface::Mix(mix) => return mixed(mix, note),
        Surface::MetallicRoughness(look) => look.clone(),
        Surface::Principled(principled) => self::principled(principled, note),
        Surface::PrincipledThin(thin) => sheet(thin, note),
        Surface::Hair(hair) => {
            note("hair becomes diffuse, with the colour of many fibres");
            matte(&hair.color(), true)
        }
        Surface::Measured(measured) => {
            note(
                "the measured material becomes a metal of approximately the same colour and \
                 roughness",
            );
            MetallicRoughness {
                base_color: measured.measurements.color().into(),
                metallic: 1.0.into(),
                roughness: measured.measurements.roughness().sqrt().into(),
                two_sided: measured.two_sided,
                ..MetallicRoughness::default()
            }
        }
        Surface::Diffuse(m) => matte(&m.reflectance, m.two_sided),
        Surface::RoughDiffuse(m) => {
            note("the surface becomes Lambertian");
            matte(&m.reflectance, m.two_sided)
        }
        Surface::DiffuseTransmission(m) => leaf(m, note),
        Surface::Black(_) => matte(&[0.0; 3].into(), true),
        Surface::Mirror(m) => {
            let base_color = m.reflectance.clone();
            MetallicRoughness { base_color, metallic: 1.0.into(), ..bare(true) }
        }
        Surface::Conductor(m) => metal(m, note),
        Surface::CoatedConductor(m) => coated_metal(m, note),
        Surface::Glass(m) => glass(m, note),
        Surface::Refraction(m) => {
            note("the reflectance becomes that of glass");
            transparent(squared(&m.transmittance), index(m.ior, note))
        }
        Surface::ThinGlass(m) => pane(m, note),
        Surface::CoatedDiffuse(m) => {
            note(COATED);
            coated(&m.diffuse, 0.0, m.ior, m.two_sided)
        }
        Surface::RoughCoatedDiffuse(m) => {
            note(COATED);
            coated(&m.diffuse, m.alpha.sqrt(), m.ior.max(1.0), m.two_sided)
        }
        Surface::FresnelPlastic(m) => {
            note(COATED);
            let mut look = coated(&m.diffuse, 0.0, m.ior.max(1.0), m.two_sided);
            roughen(&mut look, Some(&m.roughness), note);
            look
        }
        Surface::Plastic(m) => {
            note("the specular lobe becomes an achromatic GGX lobe");
            let root = legacy_specular::amount(&m.specular).clamp(0.0, 0.96).sqrt();
            let ior = (1.0 + root) / (1.0 - root);
            coated(&m.diffuse, m.alpha.sqrt(), ior, m.two_sided)
        }
    };
    ApproximateMaterial { body: body(&look), look, relief: None }
}

/// Returns the approximation of the surface under a relief.
fn relief(embossed: &SurfaceDetail, note: &mut dyn FnMut(&str)) -> ApproximateMaterial {
    let inner = approximate(&embossed.surface, note);
    if inner.relief.is_some() {
        note("nested normal or bump maps: only the outer one is written");
    }
    if embossed.shadowing {
        note("shadows of the bump map are not written");
    }
    if embossed.mirrored {
        note("bumps of the front side become dents of the back side");
    }
    ApproximateMaterial { relief: Some(embossed.relief.clone()), ..inner }
}

/// Returns the surface with the larger weight.
fn mixed(mix: &Mix, note: &mut dyn FnMut(&str)) -> ApproximateMaterial {
    note("of the mixed surfaces, only the one with the larger weight is written");
    let is_second = matches!(mix.amount, Input::Value(share) if share > 0.5);
    approximate(if is_second { &mix.second } else { &mix.first }, note)
}

/// Returns the interior of a glTF material.
fn body(look: &MetallicRoughness) -> BaseMaterial {
    match (look.transmits(), look.thin) {
        (false, _) => BaseMaterial::Opaque,
        (true, false) => BaseMaterial::Solid,
        (true, true) => BaseMaterial::Sheet,
    }
}

/// Converts a Disney material. The tints of reflection and sheen and the flatness are omitted; the
/// sheen has the roughness [`SHEEN_ROUGHNESS`].
fn principled(principled: &Principled, note: &mut dyn FnMut(&str)) -> MetallicRoughness {
    let zero = Scalar::Value(0.0);
    let left = [&principled.spec_tint, &principled.sheen_tint];
    if left.iter().any(|number| **number != zero) {
        note("the tints of specular reflection and sheen are omitted");
    }
    let clearcoat_roughness = match &principled.clearcoat_gloss {
        _ if principled.clearcoat == zero => zero.clone(),
        Scalar::Value(gloss) => legacy_specular::roughness_of_coat(*gloss).into(),
        Scalar::Texture(_) => {
            note("the textured gloss of the coat is omitted");
            zero.clone()
        }
    };
    if principled.flatness != zero {
        note("flatness is omitted");
    }
    note("diffuse reflection becomes Lambertian below a specular layer that attenuates it");
    let look = MetallicRoughness {
        base_color: principled.base_color.clone(),
        metallic: principled.metallic.clone(),
        transmission: principled.spec_trans.clone(),
        ior: index(principled.ior, note),
        sheen_color: sheen(&principled.sheen),
        sheen_roughness: SHEEN_ROUGHNESS.into(),
        clearcoat: principled.clearcoat.clone(),
        clearcoat_roughness,
        two_sided: principled.two_sided,
        ..brushed(&principled.roughness, &principled.anisotropic, note)
    };
    if look.transmits() { look } else { without_gloss(look, principled.ior) }
}

fn sheet(thin: &PrincipledThin, note: &mut dyn FnMut(&str)) -> MetallicRoughness {
    let zero = Scalar::Value(0.0);
    let left = [&thin.spec_tint, &thin.sheen_tint, &thin.flatness];
    if left.iter().any(|number| **number != zero) {
        note("the tints of specular reflection and sheen, and flatness, are omitted");
    }
    MetallicRoughness {
        base_color: thin.base_color.clone(),
        transmission: thin.spec_trans.clone(),
        diffuse_transmission: mapped(&thin.diff_trans, |x| 0.5 * x, |x| 0.5 * x),
        diffuse_transmission_color: thin.base_color.clone(),
        ior: index(thin.ior, note),
        sheen_color: sheen(&thin.sheen),
        sheen_roughness: SHEEN_ROUGHNESS.into(),
        thin: true,
        two_sided: true,
        ..brushed(&thin.roughness, &thin.anisotropic, note)
    }
}

/// Returns the sheen as a grey colour.
fn sheen(amount: &Scalar) -> Color {
    match amount {
        Input::Value(amount) => Input::Value([*amount; 3]),
        Input::Texture(texture) => Input::Texture(texture.clone()),
    }
}

/// Returns an index of refraction that glTF supports.
fn index(ior: f32, note: &mut dyn FnMut(&str)) -> f32 {
    if ior >= 1.0 {
        return ior;
    }
    note("an index of refraction below 1 is not representable in glTF; the inverse is written");
    1.0 / ior.max(0.01)
}

/// With equal indices nothing is reflected, which glTF expresses by a specular factor of 0.
fn without_gloss(look: MetallicRoughness, ior: f32) -> MetallicRoughness {
    if ior == 1.0 { MetallicRoughness { specular: 0.0.into(), ior: 1.5, ..look } } else { look }
}

/// Converts √α and Burley's anisotropy: glTF has the roughness across highlights, and its
/// interpolation towards 1 along them.
fn brushed(
    roughness: &Scalar,
    anisotropic: &Scalar,
    note: &mut dyn FnMut(&str),
) -> MetallicRoughness {
    let round = || MetallicRoughness { roughness: roughness.clone(), ..bare(false) };
    match (roughness, anisotropic) {
        (_, Scalar::Value(0.0)) => round(),
        (Scalar::Value(root), Scalar::Value(anisotropic)) => {
            let aspect = (1.0 - 0.9 * anisotropic).sqrt();
            stretched([root * root / aspect, root * root * aspect])
        }
        _ => {
            note("textured anisotropy is not representable in glTF; highlights become isotropic");
            round()
        }
    }
}

/// Converts two roughnesses α, of which the first is the greater.
fn stretched([along, across]: [f32; 2]) -> MetallicRoughness {
    let left = (1.0 - across).max(f32::MIN_POSITIVE);
    let strength = ((along.min(1.0) - across) / left).clamp(0.0, 1.0).sqrt();
    MetallicRoughness {
        roughness: across.sqrt().into(),
        anisotropy: strength.into(),
        ..bare(false)
    }
}

/// Smooth dielectric base, from which other surfaces are built.
fn bare(two_sided: bool) -> MetallicRoughness {
    MetallicRoughness { roughness: 0.0.into(), two_sided, ..MetallicRoughness::default() }
}

/// Converts diffuse reflection and transmission to a fraction that is transmitted, and colours that
/// together yield the original reflectance and transmittance.
fn leaf(sheet: &DiffuseTransmission, note: &mut dyn FnMut(&str)) -> MetallicRoughness {
    let matte = matte(&sheet.reflectance, true);
    let (Input::Value(reflected), Input::Value(sent)) = (&sheet.reflectance, &sheet.transmittance)
    else {
        note("textured diffuse transmission is not representable in glTF; it is omitted");
        return matte;
    };
    let most = |color: &[f32; 3]| color.iter().fold(0.0_f32, |a, b| a.max(*b));
    let share = most(sent) / (most(reflected) + most(sent)).max(f32::MIN_POSITIVE);
    if share == 0.0 {
        return matte;
    }
    let part = |color: &[f32; 3], share: f32| {
        color.map(|c| if share > 0.0 { (c / share).min(1.0) } else { 0.0 })
    };
    MetallicRoughness {
        base_color: part(reflected, 1.0 - share).into(),
        diffuse_transmission: share.into(),
        diffuse_transmission_color: part(sent, share).into(),
        thin: true,
        ..matte
    }
}

/// Converts a coated metal to one with the clearcoat of glTF.
fn coated_metal(m: &CoatedConductor, note: &mut dyn FnMut(&str)) -> MetallicRoughness {
    note(
        "the white reflection of the coat and the reflectance of the metal become Schlick's \
         approximation",
    );
    let [eta, k] = [m.eta, m.k].map(|index| index.map(|x| x / m.ior.max(1.0)));
    // Light passes through the coat twice.
    let passed = libm::expf(-2.0 * m.thickness);
    let at_normal = std::array::from_fn::<f32, 3, _>(|c| passed * reflectance(eta[c], k[c]));
    MetallicRoughness {
        base_color: at_normal.into(),
        metallic: 1.0.into(),
        roughness: m.alpha.sqrt().into(),
        clearcoat: 1.0.into(),
        clearcoat_roughness: m.coat_alpha.sqrt().into(),
        ..bare(m.two_sided)
    }
}

/// Returns a Lambertian surface.
fn matte(color: &Color, two_sided: bool) -> MetallicRoughness {
    MetallicRoughness {
        base_color: color.clone(),
        roughness: 1.0.into(),
        specular: 0.0.into(),
        ..bare(two_sided)
    }
}

/// Returns a diffuse base under a gloss of this √α and index of refraction.
fn coated(diffuse: &Color, roughness: f32, ior: f32, two_sided: bool) -> MetallicRoughness {
    let look = MetallicRoughness {
        base_color: diffuse.clone(),
        roughness: roughness.into(),
        ior: ior.max(1.0),
        ..bare(two_sided)
    };
    without_gloss(look, ior)
}

/// Returns a smooth interface that transmits light of a colour.
fn transparent(color: Color, ior: f32) -> MetallicRoughness {
    MetallicRoughness { base_color: color, transmission: 1.0.into(), ior, ..bare(false) }
}

fn metal(m: &Conductor, note: &mut dyn FnMut(&str)) -> MetallicRoughness {
    note("the angular dependence of the reflectance becomes Schlick's approximation");
    let at_normal = std::array::from_fn(|c| reflectance(m.eta[c], m.k[c]));
    let base_color = times(&m.reflectance, at_normal);
    let mut look = MetallicRoughness { base_color, metallic: 1.0.into(), ..bare(m.two_sided) };
    roughen(&mut look, m.roughness.as_ref(), note);
    look
}

fn glass(m: &Glass, note: &mut dyn FnMut(&str)) -> MetallicRoughness {
    note_tint(&m.reflectance, note);
    // In glTF, the colour is the transmittance of two interfaces.
    let mut look = transparent(squared(&m.transmittance), index(m.ior, note));
    roughen(&mut look, m.roughness.as_ref(), note);
    look
}

fn pane(m: &ThinGlass, note: &mut dyn FnMut(&str)) -> MetallicRoughness {
    note_tint(&m.reflectance, note);
    let look = transparent(m.transmittance.clone(), index(m.ior, note));
    MetallicRoughness { thin: true, ..look }
}

fn note_tint(reflectance: &Color, note: &mut dyn FnMut(&str)) {
    if *reflectance != Color::Value([1.0; 3]) {
        note("the tint of reflection is omitted");
    }
}

/// Note about a diffuse base under a coat.
const COATED: &str =
    "the coat becomes a specular layer that does not change the colour of its base";

/// Sets √α and the anisotropy along u.
fn roughen(
    look: &mut MetallicRoughness,
    roughness: Option<&Roughness>,
    note: &mut dyn FnMut(&str),
) {
    let Some(Roughness { alpha: [along_u, along_v], distribution, .. }) = roughness else { return };
    if *distribution == pt_scene::material::Distribution::Beckmann {
        note("the microfacet distribution becomes GGX");
    }
    match (along_u, along_v) {
        (Input::Value(u), Input::Value(v)) if u > v => {
            let MetallicRoughness { roughness, anisotropy, .. } = stretched([*u, *v]);
            (look.roughness, look.anisotropy) = (roughness, anisotropy);
        }
        (Input::Value(u), Input::Value(v)) => {
            if u < v {
                note("anisotropic highlights along v become isotropic");
            }
            look.roughness = (u * v).sqrt().sqrt().into();
        }
        _ => {
            if along_u != along_v {
                note("the roughness becomes isotropic, with the value along u");
            }
            look.roughness = mapped(along_u, f32::sqrt, f32::sqrt);
        }
    }
}

/// Reflectance of a metal of index η + ik at normal incidence.
fn reflectance(eta: f32, k: f32) -> f32 {
    let (below, above) = (eta - 1.0, eta + 1.0);
    (below * below + k * k) / (above * above + k * k)
}

fn squared(color: &Color) -> Color {
    mapped(color, |c| c.map(|x| x * x), |x| x * x)
}

fn times(color: &Color, factor: [f32; 3]) -> Color {
    let factors = [color.clone(), factor.into()];
    match color {
        Input::Value(color) => Input::Value(std::array::from_fn(|c| color[c] * factor[c])),
        Input::Texture(_) => {
            Input::Texture(std::sync::Arc::new(Pattern::Product(Box::new(factors)).into()))
        }
    }
}

#[cfg(test)]
mod tests {
    use pt_scene::material::{Diffuse, Distribution, Masking, Mirror};

    use super::*;

    #[test]
    fn metals_keep_their_colour_and_the_roughness_of_both_directions() {
        let roughness = Roughness {
            alpha: [0.4.into(), 0.1.into()],
            distribution: Distribution::Ggx,
            masking: Masking::Separable,
            multiple_scattering: false,
        };
        let mut look = bare(true);
        roughen(&mut look, Some(&roughness), &mut |note| panic!("{note}"));
        let (Input::Value(root), Input::Value(strength)) = (look.roughness, look.anisotropy) else {
            panic!("they are numbers")
        };
        let across = root * root;
        let along = across + (1.0 - across) * strength * strength;
        assert!((along - 0.4).abs() < 1e-6 && (across - 0.1).abs() < 1e-6);
        assert!((reflectance(1.5, 0.0) - 0.04).abs() < 1e-7);
    }

    #[test]
    fn of_a_mix_the_larger_share_is_kept_with_a_note() {
        let mix = |share: f32| {
            Surface::from(Mix {
                first: Box::new(Diffuse { reflectance: [0.3; 3].into(), two_sided: true }.into()),
                second: Box::new(Mirror { reflectance: [0.9; 3].into() }.into()),
                amount: share.into(),
            })
        };
        for (share, metallic) in [(0.2, 0.0), (0.8, 1.0)] {
            let mut notes = 0;
            let found = approximate(&mix(share), &mut |_| notes += 1);
            assert_eq!((found.look.metallic, notes), (metallic.into(), 1));
        }
    }
}
