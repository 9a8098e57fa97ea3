//! Expansion of `lights!`: a set of two lights, by the macro and written out.

#[allow(dead_code, unreachable_pub, reason = "the macro makes the same as for the whole set")]
mod by_macro {
    use super::super::*;

    lights! {
        /// A point light.
        Point = point::PointLight,
        /// A spot light.
        Spot = spot::Spot,
    }
}

mod by_hand {
    use super::super::*;

    /// Any light: the closed set that backends match on.
    #[derive(Clone, Copy, Debug)]
    pub(super) enum AnyLight {
        /// A point light.
        Point(point::PointLight),
        /// A spot light.
        Spot(spot::Spot),
    }

    impl From<point::PointLight> for AnyLight {
        fn from(light: point::PointLight) -> Self {
            Self::Point(light)
        }
    }

    impl From<spot::Spot> for AnyLight {
        fn from(light: spot::Spot) -> Self {
            Self::Spot(light)
        }
    }

    impl AnyLight {
        /// See [`Light::DELTA`]; other constants are looked up in the same way.
        pub(super) fn is_delta(self) -> bool {
            match self {
                Self::Point(_) => <point::PointLight as Light>::DELTA,
                Self::Spot(_) => <spot::Spot as Light>::DELTA,
            }
        }

        /// Name of the light in `lights!`.
        pub(super) fn name(self) -> &'static str {
            match self {
                Self::Point(_) => "Point",
                Self::Spot(_) => "Spot",
            }
        }

        /// See [`Light::sample`]; other methods are called in the same way.
        pub(super) fn sample(
            &self,
            t: &LightTables,
            context: &LightSampleContext,
            u: [f32; 2],
        ) -> Option<LightSample> {
            match self {
                Self::Point(l) => l.sample(t, context, u),
                Self::Spot(l) => l.sample(t, context, u),
            }
        }

        /// Examples of all lights, for the laws.
        pub(super) fn examples() -> Vec<(Self, LightTables)> {
            let points = point::PointLight::examples().into_iter().map(|(l, t)| (l.into(), t));
            points.chain(spot::Spot::examples().into_iter().map(|(l, t)| (l.into(), t))).collect()
        }
    }
}

#[test]
fn the_macro_makes_what_is_written_out() {
    let context = super::LightSampleContext::in_space(pt_math::Vec3::new(0.1, 0.2, 0.3));
    let (by_macro, by_hand) = (by_macro::AnyLight::examples(), by_hand::AnyLight::examples());
    assert_eq!(by_macro.len(), by_hand.len());
    for ((a, tables), (b, _)) in by_macro.iter().zip(&by_hand) {
        assert_eq!(format!("{a:?}"), format!("{b:?}"));
        assert_eq!((a.is_delta(), a.name()), (b.is_delta(), b.name()));
        let [a, b] = [a.sample(tables, &context, [0.5; 2]), b.sample(tables, &context, [0.5; 2])];
        assert_eq!(format!("{a:?}"), format!("{b:?}"));
    }
}
