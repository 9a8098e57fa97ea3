//! Sphere with an emission texture.

#[cfg(test)]
use std::f64::consts::TAU;

#[cfg(test)]
use pt_math::DVec3;
use pt_math::{Mat3, Pdf, SolidAngle, Spectrum, Vec3};

#[cfg(test)]
use super::laws::{LightGeometry, LightLaws, level, midpoints};
use super::tree::LightBounds;
use super::{Light, LightHit, LightSample, LightSampleContext, LightTables, SphereLight};
use crate::id::Id;
use crate::texture::Textures;
use crate::texture_eval_context::{TextureEvalContext, sphere_coordinates};
use crate::texture_record::TextureRecord;

/// A sphere with an emission texture, sampled as [`SphereLight`].
#[derive(Clone, Copy, Debug)]
pub struct TexturedSphere {
    /// The sphere, of radiance 1.
    pub sphere: SphereLight,
    /// Index into [`LightTables::sphere_maps`].
    pub map: u32,
}

/// Texture mapping of an emissive sphere.
#[derive(Clone, Copy, Debug)]
pub struct SphereMap {
    /// Texture of its radiance.
    pub texture: Id<TextureRecord>,
    /// Axes of the sphere in the world.
    pub axes: Mat3,
    /// Approximate mean luminance.
    pub mean: f32,
}

impl SphereMap {
    /// Radiance of a sphere at the point in the direction of the unit vector `n` from its centre.
    pub fn radiance(&self, textures: &Textures, sphere: &SphereLight, n: Vec3) -> Spectrum {
        let uv = sphere_coordinates(self.axes.transpose() * n);
        let point = sphere.center + n * sphere.radius.abs();
        let at = TextureEvalContext { point, normal: n, ..TextureEvalContext::of(uv) };
        textures.radiance(self.texture, &at)
    }
}

impl Light for TexturedSphere {
    const DELTA: bool = false;

    fn sample(
        &self,
        tables: &LightTables,
        context: &LightSampleContext,
        u: [f32; 2],
    ) -> Option<LightSample> {
        let sample = self.sphere.sample(tables, context, u)?;
        let n = (sample.end? - self.sphere.center).normalize();
        let map = &tables.sphere_maps[self.map as usize];
        let radiance = map.radiance(&tables.textures, &self.sphere, n);
        let radiance = self.sphere.coated(radiance, n.dot(sample.wi).abs());
        Some(LightSample { radiance, ..sample })
    }

    fn pdf(
        &self,
        t: &LightTables,
        context: &LightSampleContext,
        wi: Vec3,
        hit: Option<LightHit>,
    ) -> Pdf<SolidAngle> {
        self.sphere.pdf(t, context, wi, hit)
    }

    fn bounds(&self, tables: &LightTables) -> Option<LightBounds> {
        let mean = tables.sphere_maps[self.map as usize].mean;
        let SphereLight { center, radius, radiance, .. } = self.sphere;
        Some(LightBounds::of_sphere(center, radius, radiance, mean))
    }

    /// A sphere with an image of two rows and four columns, rotated.
    fn examples() -> Vec<(Self, LightTables)> {
        let values = [1.0, 0.5, 2.0, 0.1, 3.0, 1.5, 0.7, 0.2];
        let (texture, textures) = Textures::of_image(4, 2, &values.map(|v| [v; 3]));
        let (x, y) = (Vec3::new(0.6, 0.0, 0.8), Vec3::new(0.48, 0.8, -0.36));
        let axes = Mat3::from_cols(x, y, x.cross(y));
        let map = SphereMap { texture, axes, mean: 1.0 };
        let sphere = SphereLight {
            center: Vec3::new(0.0, 3.0, 0.0),
            radius: 0.5,
            radiance: Spectrum::ONE,
            inward: false,
            coat: 0.0,
        };
        let tables = LightTables {
            textures: textures.into(),
            sphere_maps: vec![map],
            ..LightTables::default()
        };
        vec![(Self { sphere, map: 0 }, tables)]
    }
}

#[cfg(test)]
impl LightLaws for TexturedSphere {
    fn depends_on_surface(&self) -> bool {
        false
    }

    fn geometry(&self, _: &LightTables) -> LightGeometry {
        LightGeometry::Sphere(self.sphere)
    }

    /// ∫ L cos θ cos θ′ / r² dA over the sphere, by the midpoint rule over parts of equal area.
    fn irradiance(&self, tables: &LightTables, p: DVec3, n: DVec3) -> f64 {
        const PARTS: u32 = 400;
        let map = &tables.sphere_maps[self.map as usize];
        let (center, radius) = (self.sphere.center.as_dvec3(), f64::from(self.sphere.radius));
        midpoints(PARTS, |x, y| {
            let (z, (sin, cos)) = (2.0 * x - 1.0, (y * TAU).sin_cos());
            let equator = (1.0 - z * z).sqrt();
            let outwards = DVec3::new(cos * equator, sin * equator, z);
            let d = center + outwards * radius - p;
            let (cos_light, cos_lit) = (-d.normalize().dot(outwards), d.normalize().dot(n));
            if cos_light <= 0.0 || cos_lit <= 0.0 {
                return 0.0;
            }
            let radiance = map.radiance(&tables.textures, &self.sphere, outwards.as_vec3());
            level(radiance) * cos_light * cos_lit / d.length_squared()
        }) * 2.0
            * TAU
            * radius
            * radius
    }
}
