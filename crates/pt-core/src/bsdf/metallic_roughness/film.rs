//! Reflectance of a thin film on a surface. [Belcour & Barla 2017, "A Practical Extension to
//! Microfacet Theory for the Modeling of Varying Iridescence"; in the form of glTF 2.0,
//! KHR_materials_iridescence]

use std::f32::consts::PI;

use pt_math::{FloatExt, Spectrum, Vec3, trig};

use crate::bsdf::fresnel::schlick_weight;

/// A thin film.
#[derive(Clone, Copy, Debug)]
pub(super) struct ThinFilm {
    /// Index of refraction, at least 1.
    pub(super) ior: f32,
    /// Thickness in nanometres.
    pub(super) thickness: f32,
}

/// Thickness in nanometres below which the index of the film fades to that of the medium above.
const THIN: f32 = 0.03;
/// Number of orders of interference.
const ORDERS: u8 = 2;

/// Reflectance at normal incidence between two media.
#[inline]
fn normal_reflectance(above: f32, below: f32) -> f32 {
    let root = (below - above) / (below + above);
    root * root
}

/// Index of refraction against vacuum of a surface with reflectance `f0` at normal incidence.
#[inline]
fn index_of(f0: f32) -> f32 {
    let root = (f0 + 1e-4).clamp(0.0, 0.9999).sqrt();
    (1.0 + root) / (1.0 - root)
}

/// Schlick's reflectance of one channel.
#[inline]
fn schlick(f0: f32, cos: f32) -> f32 {
    f0.lerp(1.0, schlick_weight(cos))
}

/// Reflectance of two surfaces with constructive interference. [Born & Wolf, Principles of Optics,
/// §7.6]
#[inline]
fn together(first: f32, second: f32) -> f32 {
    let (a, b) = (first.sqrt(), second.sqrt());
    let sum = (a + b) / (1.0 + a * b);
    sum * sum
}

/// Spectral sensitivity of the eye to light with a phase difference by an optical path, in
/// nanometres, and by `shift`, in linear Rec. 709: Gaussians in the frequency, fitted to the colour
/// matching functions. [Belcour & Barla 2017, supplemental material]
#[inline]
fn sensitivity(path: f32, shift: Vec3) -> Vec3 {
    const VALUE: Vec3 = Vec3::new(5.4856e-13, 4.4201e-13, 5.2481e-13);
    const POSITION: Vec3 = Vec3::new(1.681e6, 1.7953e6, 2.2084e6);
    const VARIANCE: Vec3 = Vec3::new(4.3278e9, 9.3046e9, 6.6121e9);
    /// The second lobe of the first function.
    const SECOND: [f32; 3] = [9.747e-14, 2.2399e6, 4.5282e9];
    const SCALE: f32 = 1.0685e-7;
    let phase = 2.0 * PI * path * 1e-9;
    let lobe = |value: f32, position: f32, variance: f32, shift: f32| {
        let (_, cos) = trig::sin_cos(position * phase + shift);
        value * (2.0 * PI * variance).sqrt() * cos * trig::exp(-phase * phase * variance)
    };
    let mut xyz: [f32; 3] =
        std::array::from_fn(|i| lobe(VALUE[i], POSITION[i], VARIANCE[i], shift[i]));
    xyz[0] += lobe(SECOND[0], SECOND[1], SECOND[2], shift.x);
    let [x, y, z] = xyz.map(|value| value / SCALE);
    Vec3::new(
        3.240_454_2 * x - 1.537_138_5 * y - 0.498_531_4 * z,
        -0.969_266 * x + 1.876_010_8 * y + 0.041_556 * z,
        0.055_643_4 * x - 0.204_025_9 * y + 1.057_225_2 * z,
    )
}

impl ThinFilm {
    /// Effective index of refraction, which fades to 1 for very thin films.
    #[inline]
    fn index(self) -> f32 {
        let t = (self.thickness / THIN).clamp(0.0, 1.0);
        1.0.lerp(self.ior, t * t * (3.0 - 2.0 * t))
    }

    /// Reflectance for light from vacuum at a cosine, from 0 to 1, of a surface whose reflectance
    /// at normal incidence without the film is `f0`.
    pub(super) fn reflectance(self, cos: f32, f0: Spectrum) -> Spectrum {
        let index = self.index();
        let sin2 = (1.0 - cos * cos) / (index * index);
        if sin2 >= 1.0 {
            return Spectrum::ONE;
        }
        let cos_inside = (1.0 - sin2).sqrt();
        let r12 = schlick(normal_reflectance(1.0, index), cos);
        let t121 = 1.0 - r12;
        let turned = |is_thinner: bool| if is_thinner { PI } else { 0.0 };
        let phi21 = PI - turned(index < 1.0);
        let below = f0.map(index_of).to_array();
        let r23 = below.map(|below| schlick(normal_reflectance(index, below), cos_inside));
        let phi = Vec3::from(below.map(|below| phi21 + turned(below < index)));
        let path = 2.0 * index * self.thickness * cos_inside;
        let r123 = r23.map(|r23| (r12 * r23).min(0.9999));
        let amplitude = Vec3::from(r123.map(f32::sqrt));
        let spread: [f32; 3] = std::array::from_fn(|c| t121 * t121 * r23[c] / (1.0 - r123[c]));
        let mut sum = Vec3::splat(r12) + Vec3::from(spread);
        let mut term = Vec3::from(spread) - Vec3::splat(t121);
        for order in 1..=ORDERS {
            let order = f32::from(order);
            term *= amplitude;
            sum += term * sensitivity(order * path, phi * order) * 2.0;
        }
        // Colours outside Rec. 709 have channels above the reflectance of constructive
        // interference.
        let most = Vec3::from(r23.map(|r23| together(r12, r23)));
        Spectrum(sum.clamp(Vec3::ZERO, most))
    }

    /// Reflectance at a cosine with constructive interference: an upper bound of
    /// [`Self::reflectance`] for any thickness.
    pub(super) fn most(self, cos: f32, f0: f32) -> f32 {
        let index = self.index();
        let inside = (1.0 - (1.0 - cos * cos) / (index * index)).max(0.0).sqrt();
        let r12 = schlick(normal_reflectance(1.0, index), cos);
        together(r12, schlick(normal_reflectance(index, index_of(f0)), inside))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A film of thickness 0 or of the index of the medium above has no effect.
    #[test]
    fn no_film_is_the_surface_below() {
        for film in [ThinFilm { ior: 1.8, thickness: 0.0 }, ThinFilm { ior: 1.0, thickness: 300.0 }]
        {
            let f0 = Spectrum::rgb(0.04, 0.3, 0.8);
            let got = film.reflectance(1.0, f0).0;
            assert!((got - f0.0).abs().max_element() < 1e-3, "{film:?}: {got}");
        }
    }

    /// A thick film mixes light of all phases: r12 + t² r23 / (1 − r12 r23), from intensities.
    #[test]
    fn thick_films_have_no_colours() {
        let (ior, f0) = (1.33_f32, 0.04_f32);
        let film = ThinFilm { ior, thickness: 50_000.0 };
        let got = film.reflectance(1.0, Spectrum::splat(f0)).0;
        let r12 = normal_reflectance(1.0, ior);
        let r23 = normal_reflectance(ior, index_of(f0));
        let want = r12 + (1.0 - r12) * (1.0 - r12) * r23 / (1.0 - r12 * r23);
        assert!((got - Vec3::splat(want)).abs().max_element() < 1e-4, "{got} {want}");
    }

    /// A quarter-wave film whose index is the square root of that below reflects nothing of its
    /// wavelength: green is dark, as on coated lenses.
    #[test]
    fn a_quarter_wave_reflects_least() {
        let below = 1.9_f32;
        let film = |thickness| ThinFilm { ior: below.sqrt(), thickness };
        let f0 = Spectrum::splat(normal_reflectance(1.0, below));
        let green = |thickness| film(thickness).reflectance(1.0, f0).0.y;
        let quarter = 550.0 / (4.0 * below.sqrt());
        assert!(green(quarter) < 0.012, "{}", green(quarter));
        assert!(green(2.0 * quarter) > 0.08, "{}", green(2.0 * quarter));
    }

    #[test]
    fn reflectances_are_shares_below_the_most() {
        for thickness in (0..60_u8).map(|i| f32::from(i) * 25.0) {
            for ior in [1.0, 1.2, 1.33, 1.8, 2.5] {
                for f0 in [0.0, 0.04, 0.5, 0.95, 1.0] {
                    let film = ThinFilm { ior, thickness };
                    for cos in [1.0, 0.6, 0.2, 0.01, 0.0] {
                        let f = film.reflectance(cos, Spectrum::splat(f0));
                        assert!(f.is_finite(), "{film:?} {f0} {cos}: {f:?}");
                        assert!(f.0.min_element() >= 0.0 && f.max_channel() <= 1.0);
                        let most = film.most(cos, f0);
                        assert!(
                            f.max_channel() <= most + 1e-6,
                            "{film:?} {f0} {cos}: {f:?} {most}"
                        );
                    }
                }
            }
        }
    }
}
