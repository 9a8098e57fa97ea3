//! Expansion of `phases!`: a set of two phase functions, by the macro and written out.

#[allow(dead_code, unreachable_pub, reason = "the macro makes the same as for the whole set")]
mod by_macro {
    use super::super::*;

    phases! {
        /// Isotropic scattering.
        Isotropic = isotropic::Isotropic,
        /// Scattering by particles much smaller than the wavelength.
        Rayleigh = rayleigh::Rayleigh,
    }
}

mod by_hand {
    use super::super::*;

    /// Any phase function: the closed set that backends match on.
    #[derive(Clone, Debug, PartialEq)]
    pub(super) enum AnyPhase {
        /// Isotropic scattering.
        Isotropic(isotropic::Isotropic),
        /// Scattering by particles much smaller than the wavelength.
        Rayleigh(rayleigh::Rayleigh),
    }

    impl From<isotropic::Isotropic> for AnyPhase {
        fn from(phase: isotropic::Isotropic) -> Self {
            Self::Isotropic(phase)
        }
    }

    impl From<rayleigh::Rayleigh> for AnyPhase {
        fn from(phase: rayleigh::Rayleigh) -> Self {
            Self::Rayleigh(phase)
        }
    }

    impl AnyPhase {
        /// Name of the phase function in `phases!`.
        pub(super) fn name(&self) -> &'static str {
            match self {
                Self::Isotropic(_) => "Isotropic",
                Self::Rayleigh(_) => "Rayleigh",
            }
        }

        /// See [`PhaseFunction::pdf`]; other methods are called in the same way.
        pub(super) fn pdf(&self, wo: Vec3, wi: Vec3) -> Pdf<SolidAngle> {
            match self {
                Self::Isotropic(p) => p.pdf(wo, wi),
                Self::Rayleigh(p) => p.pdf(wo, wi),
            }
        }

        /// Example parameters of all phase functions, for the laws.
        pub(super) fn examples() -> Vec<Self> {
            let isotropic = isotropic::Isotropic::examples().into_iter().map(Self::from);
            isotropic.chain(rayleigh::Rayleigh::examples().into_iter().map(Self::from)).collect()
        }
    }
}

#[test]
fn the_macro_makes_what_is_written_out() {
    let (wo, wi) = (pt_math::Vec3::Z, pt_math::Vec3::new(0.6, 0.0, 0.8));
    let (by_macro, by_hand) = (by_macro::AnyPhase::examples(), by_hand::AnyPhase::examples());
    assert_eq!(format!("{by_macro:?}"), format!("{by_hand:?}"));
    for (a, b) in by_macro.iter().zip(&by_hand) {
        assert_eq!((a.name(), a.pdf(wo, wi).get()), (b.name(), b.pdf(wo, wi).get()));
    }
}
