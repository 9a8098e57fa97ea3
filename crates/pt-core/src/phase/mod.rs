//! Scattering in media: the [`PhaseFunction`] contract and the closed set of phase functions.
//!
//! To add one: write `my_phase.rs`, and add one line to `phases!` below. The laws of `laws.rs` then
//! check that it fulfils its contract.

mod blend;
mod henyey_greenstein;
mod isotropic;
#[cfg(test)]
mod laws;
mod microflakes;
mod rayleigh;
mod table;

use pt_math::{Frame, Pdf, SolidAngle, Vec3, trig};

/// Scattering by a particle: p(wo, wi), which integrates to 1 over all `wi`.
///
/// Both directions are of unit length and point away from the particle: `wo` to the camera side,
/// `wi` to the light side. Undeflected light has `wi` = −`wo`.
pub trait PhaseFunction: Clone {
    /// The phase function, which is also the density with which [`Self::sample`] returns `wi`; the
    /// weight of a sample is therefore 1.
    fn pdf(&self, wo: Vec3, wi: Vec3) -> Pdf<SolidAngle>;
    /// Samples `wi` by a map from the unit square.
    fn sample(&self, wo: Vec3, u: [f32; 2]) -> Vec3;
    /// Projected area of the particles in a direction, which is a factor of the extinction; 1 if it
    /// is equal in all directions. Reciprocity: area(wo) p(wo, wi) = area(wi) p(wi, wo).
    fn area(&self, _w: Vec3) -> f32 {
        1.0
    }
    /// Example parameters for the laws.
    fn examples() -> Vec<Self>;
}

/// The direction `wi` of light scattered by an angle of this cosine, at the azimuth 2π `v` around
/// `wo`.
#[inline]
fn turned(wo: Vec3, cos: f64, v: f32) -> Vec3 {
    let sin = ((1.0 - cos) * (1.0 + cos)).sqrt() as f32;
    let (sin_phi, cos_phi) = trig::sin_cos_tau(v);
    let local = Vec3::new(sin * cos_phi, sin * sin_phi, cos as f32);
    Frame::from_normal(-wo).to_world(local)
}

/// Makes the closed set of phase functions, `AnyPhase`, from lines of a name and a type. The module
/// `expansion` has what the macro makes of two lines, written out.
macro_rules! phases {
    ($($(#[$doc:meta])* $name:ident = $module:ident::$ty:ident),* $(,)?) => {
        $(pub use $module::$ty;)*

        /// Any phase function: the closed set that backends match on.
        #[derive(Clone, Debug, PartialEq)]
        pub enum AnyPhase { $($(#[$doc])* $name($ty)),* }

        $(impl From<$ty> for AnyPhase {
            fn from(phase: $ty) -> Self { Self::$name(phase) }
        })*

        impl AnyPhase {
            /// Name of the phase function in `phases!`.
            pub fn name(&self) -> &'static str {
                match self { $(Self::$name(_) => stringify!($name)),* }
            }
            /// See [`PhaseFunction::pdf`].
            #[inline]
            pub fn pdf(&self, wo: Vec3, wi: Vec3) -> Pdf<SolidAngle> {
                match self { $(Self::$name(p) => p.pdf(wo, wi)),* }
            }
            /// See [`PhaseFunction::sample`].
            #[inline]
            pub fn sample(&self, wo: Vec3, u: [f32; 2]) -> Vec3 {
                match self { $(Self::$name(p) => p.sample(wo, u)),* }
            }
            /// See [`PhaseFunction::area`].
            #[inline]
            pub fn area(&self, w: Vec3) -> f32 {
                match self { $(Self::$name(p) => p.area(w)),* }
            }
            /// Example parameters of all phase functions, for the laws.
            pub fn examples() -> Vec<Self> {
                [$($ty::examples().into_iter().map(Self::$name).collect::<Vec<_>>()),*].concat()
            }
        }
    };
}

#[cfg(test)]
mod expansion;

phases! {
    /// Isotropic scattering.
    Isotropic = isotropic::Isotropic,
    /// Forward or backward scattering, by one parameter.
    HenyeyGreenstein = henyey_greenstein::HenyeyGreenstein,
    /// Scattering by particles much smaller than the wavelength.
    Rayleigh = rayleigh::Rayleigh,
    /// Scattering by flat particles.
    Microflakes = microflakes::Microflakes,
    /// Tabulated phase function.
    Table = table::TabulatedPhase,
    /// Mixture of phase functions.
    Blend = blend::BlendPhase,
}
