//! What a relief's slopes hide of the light that comes to them.

use pt_math::Vec3;

/// The light that a relief leaves at a point: as if its normal were one of facets about the normal
/// of the shape, of which some hide the others. Without it, light ends abruptly where the relief
/// still faces it and the shape does not. Not reciprocal: only the direction of light is shadowed.
/// [Conty Estevez, Lecocq & Stein 2019, "A Microfacet-Based Shadowing Function to Solve the Bump
/// Terminator Problem", Ray Tracing Gems, chapter 12]
#[derive(Clone, Copy, Debug, Default)]
pub struct Shadowing {
    /// Unit normal of the shape.
    normal: Vec3,
    /// Square of the roughness of facets, of which the relief's slope is an extreme one; 0 shadows
    /// nothing.
    alpha_squared: f32,
}

impl Shadowing {
    /// That of a relief with a unit normal on a shape with another.
    pub(crate) fn new(shape: Vec3, relief: Vec3) -> Self {
        /// Share of the squared tangent between the normals. [The chapter, section 12.3]
        const SHARE: f32 = 0.125;
        let alpha_squared = (SHARE * tangent_squared(shape.dot(relief))).min(1.0);
        Self { normal: shape, alpha_squared }
    }

    /// The share of light from `wi` (world, unit) that is not hidden, by the GGX distribution.
    #[inline(always)]
    pub(crate) fn visible(&self, wi: Vec3) -> f32 {
        if self.alpha_squared == 0.0 {
            return 1.0;
        }
        let slopes = self.alpha_squared * tangent_squared(self.normal.dot(wi));
        2.0 / (1.0 + (1.0 + slopes).sqrt())
    }
}

/// The square of the tangent of an angle, on either side, which is large but finite at 90°.
#[inline(always)]
fn tangent_squared(cos: f32) -> f32 {
    const MIN: f32 = 1e-6;
    let cos = cos.abs().clamp(MIN, 1.0);
    (1.0 - cos) * (1.0 + cos) / (cos * cos)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A slope of √8 is that of facets with α = 1, whose shadowing at tan θ = √3 is 2/3; a surface
    /// that is not raised shadows nothing, and none lets through more than all light or less
    /// than none.
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
        // tan² = 1/3 between the normals: α² = 1/24, and 2 / (1 + √(1 + 3/24)) is left.
        let gentle = Shadowing::new(Vec3::Z, Vec3::new(0.5, 0.0, 0.75_f32.sqrt()));
        let want = 2.0 / (1.0 + 1.125_f32.sqrt());
        assert!((gentle.visible(at_60) - want).abs() < 1e-6);
    }
}
