//! Textures with a mapping other than the texture coordinates of the surface, and procedural ones:
//! coordinates of a surface point, and their derivatives along the surface.

use std::f64::consts::{FRAC_1_PI, PI, TAU};

use pt_math::noise::ValueAndGradient;
use pt_math::{DAffine3, DVec3, Spectrum, Vec2, Vec3};
use pt_scene::texture::Procedural;

use crate::procedural;
use crate::texture_eval_context::TextureEvalContext;
use crate::texture_record::{MappedTexture, TextureMappingRecord};

impl TextureMappingRecord {
    /// Coordinates of a point.
    fn coordinates(&self, place: &TextureEvalContext) -> Vec3 {
        let p = |map: &DAffine3| map.transform_point3(place.point.as_dvec3());
        match self {
            // Values were converted to coordinates of the surface before.
            Self::Surface | Self::Values(_) => place.uv.extend(0.0),
            Self::Space(map) => p(map).as_vec3(),
            Self::Sphere(map) => {
                let p = p(map);
                let theta = libm::atan2(p.truncate().length(), p.z);
                let phi = libm::atan2(p.y, p.x);
                let phi = if phi < 0.0 { phi + TAU } else { phi };
                DVec3::new(theta * FRAC_1_PI, phi / TAU, 0.0).as_vec3()
            }
            Self::Cylinder(map) => {
                let p = p(map);
                DVec3::new((PI + libm::atan2(p.y, p.x)) / TAU, p.z, 0.0).as_vec3()
            }
        }
    }

    /// Derivatives of the coordinates along two steps, each given in texture coordinates of the
    /// surface and in world space.
    fn derivatives(&self, place: &TextureEvalContext, steps: [(Vec2, Vec3); 2]) -> [Vec3; 2] {
        let p = |map: &DAffine3| map.transform_point3(place.point.as_dvec3());
        let along = |map: &DAffine3, of: &dyn Fn(DVec3) -> DVec3| {
            steps.map(|(_, step)| {
                let grown = of(map.matrix3 * step.as_dvec3()).as_vec3();
                if grown.is_finite() { grown } else { Vec3::ZERO }
            })
        };
        match self {
            Self::Surface | Self::Values(_) => steps.map(|(step, _)| step.extend(0.0)),
            Self::Space(map) => along(map, &|step| step),
            Self::Sphere(map) => {
                let p = p(map);
                let (equator, squared) = (p.truncate().length(), p.length_squared());
                let to_theta = DVec3::new(p.x * p.z / equator, p.y * p.z / equator, -equator);
                let to_theta = to_theta / (squared * PI);
                let to_phi = DVec3::new(-p.y, p.x, 0.0) / (equator * equator * TAU);
                along(map, &|step| DVec3::new(to_theta.dot(step), to_phi.dot(step), 0.0))
            }
            Self::Cylinder(map) => {
                let p = p(map);
                let to_phi = DVec3::new(-p.y, p.x, 0.0) / (p.truncate().length_squared() * TAU);
                along(map, &|step| DVec3::new(to_phi.dot(step), step.z, 0.0))
            }
        }
    }
}

impl MappedTexture {
    /// Coordinates on the pattern; the origin if they overflow single precision.
    pub(crate) fn at(&self, place: &TextureEvalContext) -> Vec3 {
        let at = self.layout.coordinates(place);
        let at = self.to_pattern.transform_point2(at.truncate()).extend(at.z);
        if at.is_finite() { at } else { Vec3::ZERO }
    }

    fn differentials(&self, place: &TextureEvalContext, steps: [(Vec2, Vec3); 2]) -> [Vec3; 2] {
        let linear = self.to_pattern.matrix2;
        let grown = self.layout.derivatives(place, steps);
        grown.map(|step| (linear * step.truncate()).extend(step.z))
    }

    /// Derivatives of the coordinates on the pattern by u and v of the surface.
    pub(crate) fn along_surface(&self, place: &TextureEvalContext) -> [Vec3; 2] {
        let [u, v] = [place.along_u, place.along_v].map(Option::unwrap_or_default);
        self.differentials(place, [(Vec2::X, u), (Vec2::Y, v)])
    }

    /// Axes of the footprint in coordinates of the pattern.
    pub(crate) fn footprint(&self, place: &TextureEvalContext) -> [Vec3; 2] {
        let [s, t] = place.footprint.in_space();
        if [s, t] == [Vec3::ZERO; 2] {
            return [s, t];
        }
        let [a, b] = place.footprint_on_surface();
        self.differentials(place, [(a, s), (b, t)])
    }

    /// Colour of a procedural pattern.
    pub(crate) fn computed(&self, pattern: Procedural, place: &TextureEvalContext) -> Spectrum {
        procedural::color(pattern, self.at(place), self.width(pattern, place))
    }

    /// Derivatives of a procedural pattern by u and v of the surface.
    pub(crate) fn slopes(&self, pattern: Procedural, place: &TextureEvalContext) -> [Spectrum; 2] {
        let channels = procedural::sloped(pattern, self.at(place), self.width(pattern, place));
        let along = self.along_surface(place);
        along
            .map(|step| Spectrum(Vec3::from(channels.map(|c: ValueAndGradient| c.slope.dot(step)))))
    }

    /// Length of the longer axis of the footprint; 0 if the pattern does not use it.
    fn width(&self, pattern: Procedural, place: &TextureEvalContext) -> f32 {
        if !procedural::has_octaves(pattern) {
            return 0.0;
        }
        let [a, b] = self.footprint(place).map(Vec3::length_squared);
        a.max(b).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use pt_math::{Affine2, DMat3, trig};

    use super::*;
    use crate::texture_record::MappedPattern;

    fn place(point: Vec3) -> TextureEvalContext {
        TextureEvalContext { point, ..TextureEvalContext::of(Vec2::new(0.3, 0.7)) }
    }

    fn laid(layout: TextureMappingRecord) -> MappedTexture {
        let to_pattern =
            Affine2::from_cols(Vec2::new(0.4, 0.3), Vec2::new(-0.2, 0.5), Vec2::new(0.1, 0.2));
        let pattern = MappedPattern::Procedural(Procedural::Windy);
        MappedTexture { layout, to_pattern, pattern }
    }

    fn tilted() -> DAffine3 {
        let turn = DMat3::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 0.7);
        DAffine3::from_mat3_translation(turn * 1.7, DVec3::new(0.3, -0.2, 0.9))
    }

    fn layouts() -> [TextureMappingRecord; 4] {
        [
            TextureMappingRecord::Surface,
            TextureMappingRecord::Space(tilted()),
            TextureMappingRecord::Sphere(tilted()),
            TextureMappingRecord::Cylinder(tilted()),
        ]
    }

    /// Coordinates agree with the polar angle and longitude of the point.
    #[test]
    fn directions_have_the_coordinates_of_a_sphere_and_a_cylinder() {
        for i in 0..100_u16 {
            let theta = 0.01 + 0.0312 * f32::from(i);
            let phi = (0.37 * f32::from(i)) % std::f32::consts::TAU;
            let ((st, ct), (sp, cp)) = (trig::sin_cos(theta), trig::sin_cos(phi));
            let p = Vec3::new(st * cp, st * sp, ct) * (0.5 + f32::from(i));
            let there = TextureMappingRecord::Sphere(DAffine3::IDENTITY).coordinates(&place(p));
            let want = Vec3::new(theta / std::f32::consts::PI, phi / std::f32::consts::TAU, 0.0);
            assert!((there - want).abs().max_element() < 1e-5, "{there} for {want}");
            let there = TextureMappingRecord::Cylinder(DAffine3::IDENTITY).coordinates(&place(p));
            let around = (want.y + 0.5) % 1.0;
            assert!((there - Vec3::new(around, p.z, 0.0)).abs().max_element() < 1e-5, "{there}");
        }
    }

    /// Derivatives along the surface agree with finite differences.
    #[test]
    fn growth_is_a_difference() {
        const STEP: f32 = 1e-2;
        let [u, v] = [Vec3::new(0.4, -0.3, 1.1), Vec3::new(-0.7, 0.5, 0.2)];
        for layout in layouts() {
            let laid = laid(layout);
            for point in [Vec3::new(0.8, 1.3, -0.4), Vec3::new(2.0, -1.5, 0.6)] {
                let at = |[a, b]: [f32; 2]| {
                    let here = place(point + u * a + v * b);
                    let uv = here.uv + Vec2::new(a, b);
                    laid.at(&TextureEvalContext { uv, ..here })
                };
                let here =
                    TextureEvalContext { along_u: Some(u), along_v: Some(v), ..place(point) };
                let grown = laid.along_surface(&here);
                let differences = [[STEP, 0.0], [0.0, STEP]]
                    .map(|step| (at(step) - at(step.map(|s| -s))) / (2.0 * STEP));
                for (grown, difference) in grown.into_iter().zip(differences) {
                    assert!((grown - difference).length() < 2e-3, "{grown} {difference}");
                }
            }
        }
    }

    /// Also tests the axis, the origin, and values beyond the range of single precision.
    #[test]
    fn coordinates_and_their_growth_are_finite_everywhere() {
        let hostile = [0.0, -0.0, 1.0, 1e-40, 1e30, -1e38, f32::INFINITY, f32::NAN];
        for layout in layouts() {
            for x in hostile {
                for point in [Vec3::new(x, 0.0, 0.0), Vec3::new(0.0, 0.0, x), Vec3::splat(x)] {
                    let here = TextureEvalContext {
                        along_u: Some(Vec3::X),
                        along_v: Some(Vec3::Z),
                        ..place(point)
                    };
                    assert!(laid(layout).at(&here).is_finite(), "{layout:?} {point}");
                    let grown = laid(layout).along_surface(&here);
                    assert!(grown.iter().all(|g| g.is_finite()), "{layout:?} {point}: {grown:?}");
                }
            }
        }
    }
}
