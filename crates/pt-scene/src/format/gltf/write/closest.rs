//! The nearest of what glTF can say to any surface.

use super::super::super::gloss;
use super::layer::mapped;
use crate::material::{Matte, Mix, Principled, PrincipledThin, Roughness};
use crate::texture::{Input, Pattern, Relief, Scalar};
use crate::{Color, Surface};

/// What is inside of a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Body {
    /// Nothing that is seen.
    Opaque,
    /// What light goes through.
    Solid,
    /// It is a sheet without an inside.
    Sheet,
}

/// A surface of metallic and roughness.
#[derive(Debug)]
pub(super) struct Closest {
    pub(super) look: Principled,
    pub(super) body: Body,
    pub(super) relief: Option<Relief>,
}

/// Index of what reflects nothing.
const NO_GLOSS: f32 = 1.0;

/// The surface that looks most like another one. `tell` is given what is different.
pub(super) fn closest(surface: &Surface, tell: &mut dyn FnMut(&str)) -> Closest {
    match surface {
        Surface::Embossed(embossed) => {
            let inner = closest(&embossed.surface, tell);
            if inner.relief.is_some() {
                tell("of two reliefs, the outer one alone is written");
            }
            if embossed.shadowing {
                tell("its relief shadows nothing");
            }
            if embossed.mirrored {
                tell("what is raised on its front becomes a dent on its back");
            }
            Closest { relief: Some(embossed.relief.clone()), ..inner }
        }
        Surface::Sided(sided) => {
            tell("its back becomes like its front");
            let inner = closest(&sided.front, tell);
            let look = Principled { two_sided: true, ..inner.look };
            Closest { look, ..inner }
        }
        Surface::Mix(mix) => mixed(mix, tell),
        Surface::Principled(principled) => self::principled(principled, tell),
        Surface::PrincipledThin(thin) => sheet(thin, tell),
        Surface::Hair(hair) => {
            tell("its fibres become matte, of the colour that many of them have together");
            let matte = Matte { reflectance: hair.color(), two_sided: true };
            closest(&matte.into(), tell)
        }
        Surface::Measured(measured) => {
            tell("what was measured of it becomes a metal of about the same colour and roughness");
            let metal = Principled {
                base_color: measured.measurements.color().into(),
                metallic: 1.0.into(),
                roughness: measured.measurements.roughness().sqrt().into(),
                two_sided: measured.two_sided,
                ..Principled::default()
            };
            closest(&metal.into(), tell)
        }
        _ => {
            let (look, body) = plain(surface, tell);
            Closest { look, body, relief: None }
        }
    }
}

/// Two surfaces: one of a sheet that is a metal in places, as glTF has it, or the one with the larger share.
fn mixed(mix: &Mix, tell: &mut dyn FnMut(&str)) -> Closest {
    if let (Surface::PrincipledThin(thin), Surface::Principled(metal)) = (&*mix.first, &*mix.second)
        && metal.metallic == Scalar::Value(1.0)
        && metal.base_color == thin.base_color
    {
        let Closest { look, .. } = sheet(thin, tell);
        let Principled { clearcoat, clearcoat_gloss, .. } = metal.clone();
        let metallic = mix.share.clone();
        let look = Principled { metallic, clearcoat, clearcoat_gloss, ..look };
        return Closest { look, body: Body::Sheet, relief: None };
    }
    tell("of the surfaces that it mixes, the one with the larger share is written");
    let is_second = matches!(mix.share, Input::Value(share) if share > 0.5);
    closest(if is_second { &mix.second } else { &mix.first }, tell)
}

fn principled(principled: &Principled, tell: &mut dyn FnMut(&str)) -> Closest {
    let zero = Scalar::Value(0.0);
    let left = [&principled.spec_tint, &principled.sheen_tint];
    if left.iter().any(|number| **number != zero) {
        tell("the tints of its reflection and its sheen are left out");
    }
    let mut look = principled.clone();
    if !principled.layered {
        if let Scalar::Value(gloss) = principled.clearcoat_gloss {
            look.clearcoat_gloss = (1.0 - gloss::roughness_of_coat(gloss)).into();
        }
        if principled.flatness != zero {
            tell("its flatness is left out");
        }
        tell("its diffuse part becomes Lambertian, under a gloss that takes light from it");
    }
    if principled.inside_out {
        tell("its inside becomes its outside");
    }
    let body = if principled.transmits() { Body::Solid } else { Body::Opaque };
    Closest { look, body, relief: None }
}

fn sheet(thin: &PrincipledThin, tell: &mut dyn FnMut(&str)) -> Closest {
    let zero = Scalar::Value(0.0);
    let left = [&thin.spec_tint, &thin.sheen_tint, &thin.flatness];
    if left.iter().any(|number| **number != zero) {
        tell("the tints of its reflection and its sheen, and its flatness, are left out");
    }
    if thin.diff_trans != zero {
        tell("no light goes through it diffusely");
    }
    let PrincipledThin { base_color, roughness, anisotropic, spec_trans, ior, sheen, .. } =
        thin.clone();
    let look =
        Principled { base_color, roughness, anisotropic, spec_trans, ior, sheen, ..bare(true) };
    let body = if look.transmits() { Body::Sheet } else { Body::Opaque };
    Closest { look, body, relief: None }
}

/// What other surfaces are built from.
fn bare(two_sided: bool) -> Principled {
    Principled { roughness: 0.0.into(), two_sided, ..Principled::default() }
}

/// Surfaces of one model.
fn plain(surface: &Surface, tell: &mut dyn FnMut(&str)) -> (Principled, Body) {
    let matte = |color: &Color, two_sided| Principled {
        base_color: color.clone(),
        roughness: 1.0.into(),
        ior: NO_GLOSS,
        ..bare(two_sided)
    };
    let coated = |diffuse: &Color, roughness: f32, ior, two_sided| Principled {
        base_color: diffuse.clone(),
        roughness: roughness.into(),
        ior,
        ..bare(two_sided)
    };
    let glass = |color: Color, ior| Principled {
        base_color: color,
        spec_trans: 1.0.into(),
        ior,
        ..bare(false)
    };
    let opaque = |look| (look, Body::Opaque);
    match surface {
        Surface::Matte(m) => opaque(matte(&m.reflectance, m.two_sided)),
        Surface::RoughDiffuse(m) => {
            tell("it becomes Lambertian");
            opaque(matte(&m.reflectance, m.two_sided))
        }
        Surface::DiffuseTransmission(m) => {
            tell("no light goes through it diffusely");
            opaque(matte(&m.reflectance, true))
        }
        Surface::Black(_) => opaque(matte(&[0.0; 3].into(), true)),
        Surface::Mirror(m) => {
            let base_color = m.reflectance.clone();
            opaque(Principled { base_color, metallic: 1.0.into(), ..bare(true) })
        }
        Surface::Conductor(m) => {
            tell("its reflectance between straight and grazing light becomes that of Schlick");
            let at_normal = std::array::from_fn(|c| reflectance(m.eta[c], m.k[c]));
            let base_color = times(&m.reflectance, at_normal);
            let mut look = Principled { base_color, metallic: 1.0.into(), ..bare(m.two_sided) };
            roughen(&mut look, m.roughness.as_ref(), tell);
            opaque(look)
        }
        Surface::CoatedConductor(m) => {
            tell(
                "its coat reflects white over the metal, whose reflectance becomes that of Schlick",
            );
            let [eta, k] = [m.eta, m.k].map(|index| index.map(|x| x / m.ior.max(1.0)));
            // Light goes through the coat twice.
            let passed = libm::expf(-2.0 * m.thickness);
            let at_normal =
                std::array::from_fn::<f32, 3, _>(|c| passed * reflectance(eta[c], k[c]));
            opaque(Principled {
                base_color: at_normal.into(),
                metallic: 1.0.into(),
                roughness: m.alpha.sqrt().into(),
                clearcoat: 1.0.into(),
                clearcoat_gloss: (1.0 - m.coat_alpha.sqrt()).into(),
                ..bare(m.two_sided)
            })
        }
        Surface::Glass(m) => {
            if m.reflectance != Color::Value([1.0; 3]) {
                tell("the tint of what it reflects is left out");
            }
            // Its colour is that of two surfaces.
            let mut look = glass(squared(&m.transmittance), m.ior);
            roughen(&mut look, m.roughness.as_ref(), tell);
            (look, Body::Solid)
        }
        Surface::Refraction(m) => {
            tell("it reflects as glass does");
            (glass(squared(&m.transmittance), m.ior), Body::Solid)
        }
        Surface::ThinGlass(m) => {
            if m.reflectance != Color::Value([1.0; 3]) {
                tell("the tint of what it reflects is left out");
            }
            (glass(m.transmittance.clone(), m.ior), Body::Sheet)
        }
        Surface::CoatedDiffuse(m) => {
            tell(COATED);
            opaque(coated(&m.diffuse, 0.0, m.ior, m.two_sided))
        }
        Surface::RoughCoatedDiffuse(m) => {
            tell(COATED);
            opaque(coated(&m.diffuse, m.alpha.sqrt(), m.ior.max(1.0), m.two_sided))
        }
        Surface::Plastic(m) => {
            tell("its gloss becomes a grey one of GGX facets");
            let root = gloss::amount(&m.specular).clamp(0.0, 0.96).sqrt();
            let ior = (1.0 + root) / (1.0 - root);
            opaque(coated(&m.diffuse, m.alpha.sqrt(), ior, m.two_sided))
        }
        Surface::Principled(_)
        | Surface::PrincipledThin(_)
        | Surface::Hair(_)
        | Surface::Measured(_)
        | Surface::Mix(_)
        | Surface::Sided(_)
        | Surface::Embossed(_) => unreachable!("they are made of others"),
    }
}

/// What is told of a diffuse base under a coat.
const COATED: &str = "its coat becomes a gloss over a base that keeps its colour";

/// Sets √α and how much longer facets are along u.
fn roughen(look: &mut Principled, roughness: Option<&Roughness>, tell: &mut dyn FnMut(&str)) {
    let Some(Roughness { alpha: [along_u, along_v], distribution, .. }) = roughness else { return };
    if *distribution == crate::material::Distribution::Beckmann {
        tell("its facets become those of GGX");
    }
    match (along_u, along_v) {
        (Input::Value(u), Input::Value(v)) if u > v => {
            look.anisotropic = ((1.0 - v / u) / 0.9).min(1.0).into();
            look.roughness = (u * v).sqrt().sqrt().into();
        }
        (Input::Value(u), Input::Value(v)) => {
            if u < v {
                tell("its highlights, which are long along v, become round");
            }
            look.roughness = (u * v).sqrt().sqrt().into();
        }
        _ => {
            if along_u != along_v {
                tell("its roughness becomes the same in all directions, that along u");
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
    use super::*;
    use crate::material::{Distribution, Masking, Mirror};

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
        let (Input::Value(root), Input::Value(a)) = (look.roughness, look.anisotropic) else {
            panic!("they are numbers")
        };
        let aspect = (1.0 - 0.9 * a).sqrt();
        assert!(
            (root * root / aspect - 0.4).abs() < 1e-6 && (root * root * aspect - 0.1).abs() < 1e-6
        );
        assert!((reflectance(1.5, 0.0) - 0.04).abs() < 1e-7);
    }

    #[test]
    fn of_a_mix_the_larger_share_is_kept_with_a_note() {
        let mix = |share: f32| {
            Surface::from(Mix {
                first: Box::new(Matte { reflectance: [0.3; 3].into(), two_sided: true }.into()),
                second: Box::new(Mirror { reflectance: [0.9; 3].into() }.into()),
                share: share.into(),
            })
        };
        for (share, metallic) in [(0.2, 0.0), (0.8, 1.0)] {
            let mut notes = 0;
            let found = closest(&mix(share), &mut |_| notes += 1);
            assert_eq!((found.look.metallic, notes), (metallic.into(), 1));
        }
    }
}
