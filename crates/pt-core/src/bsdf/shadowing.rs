//! Shadowing of light by the slopes of a relief.

use pt_math::Vec3;

/// Shadowing function of a relief at a point, which treats its normal as one of microfacets about
/// the normal of the shape.
///
/// Without it, light ends abruptly where the relief still faces it and the shape does not. Not
/// reciprocal: only the direction of light is shadowed. [Conty Estevez, Lecocq & Stein 2019, "A
/// Microfacet-Based Shadowing Function to Solve the Bump Terminator Problem", Ray Tracing Gems,
/// chapter 12]
#[derive(Clone, Copy, Debug, Default)]
pub struct Shadowing {
    /// Unit normal of the shape.
    normal: Vec3,
    /// Squared roughness of the facets, for which the slope of the relief is extreme; 0 means no
    /// shadowing.
    alpha_squared: f32,
}

impl Shadowing {
    /// Creates the shadowing of a relief by the unit normals of the shape and of the relief.
    pub(crate) fn new(shape: Vec3, relief: Vec3) -> Self {
        /// Factor of the squared tangent between the normals. [The chapter, section 12.3]
        const SHARE: f32 = 0.125;
        let alpha_squared = (SHARE * tangent_squared(shape.dot(relief))).min(1.0);
        Self { normal: shape, alpha_squared }
    }

    /// Fraction of light from `wi` (world, unit) that is not shadowed, by the GGX distribution.
    #[inline(always)]
    pub(crate) fn visible(&self, wi: Vec3) -> f32 {
        if self.alpha_squared == 0.0 {
            return 1.0;
        }
        let slopes = self.alpha_squared * tangent_squared(self.normal.dot(wi));
        2.0 / (1.0 + (1.0 + slopes).sqrt())
    }
}

/// Squared tangent of an angle, on either side; large but finite at 90°.
#[inline(always)]
fn tangent_squared(cos: f32) -> f32 {
    const MIN: f32 = 1e-6;
    let cos = cos.abs().clamp(MIN, 1.0);
    (1.0 - cos) * (1.0 + cos) / (cos * cos)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A slope of √8 corresponds to facets with α = 1, whose shadowing at tan θ = √3 is 2/3. A flat
    /// surface has no shadowing, and results are within [0, 1].
    #[test]
    fn slopes_hide_what_facets_hide() {
        let steep = Vec3::new(8.0_f32.sqrt(), 0.0, 1.0).normalize();
        let at_60 = Vec3::new(0.0, 0.75_f32.sqrt(), 0.5);
        let shadowing = Shadowing::new(Vec3::Z, steep);
        assert!((shadowing.alpha_squared - 1.0).abs() < 1e-5);
        assert!((shadowing.visible(at_60) - 2.0 / 3.0).abs() < 1e-5);
        assert_eq!(shadowing.visible(Vec3::Z), 1.0);
        assert!((0.0..1e-5).contains(&shadowing.visible(Vec3::X)));
        assert_eq!(Shadowing::new(Vec3::Z, Vec3::Z).visible(at_60), 1.0);
        // tan² = 1/3 between the normals: α² = 1/24, and the visible fraction is 2 / (1 + √(1 +
        // 3/24)).
        let gentle = Shadowing::new(Vec3::Z, Vec3::new(0.5, 0.0, 0.75_f32.sqrt()));
        let want = 2.0 / (1.0 + 1.125_f32.sqrt());
        assert!((gentle.visible(at_60) - want).abs() < 1e-6);
    }
}
