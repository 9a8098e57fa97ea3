//! Compiles light nodes and emissive shapes to lights that can be sampled.

use std::f32::consts::FRAC_PI_2;
use std::sync::Arc;

use pt_math::{DAffine3, DMat3, DVec3, Mat3, Spectrum, point_mesh, trig};
use pt_scene::image::Image;
use pt_scene::{Hint, Light as Node, LightKind, Notes, Scene, Span};

use super::collector::is_similarity;
use super::emitters::{area_square, sphere_light};
use super::instances::MAX_MOVING_LIGHTS;
use super::policies::LightConversion;
use super::reuse::Earlier;
use super::shapes::{Emitter, ShapePrimitives, Shapes, SurfaceEmission};
use super::{CompileError, emission};
use crate::compile::emitters::emitter_triangles;
use crate::id::{Id, Table};
use crate::light::{
    AnyLight, Directional, DistantDisk, Environment, EnvironmentMap, Falloff, HemisphereLight, Ies,
    InvisibleLight, LightSourceIds, LightTables, MeshLight, PlacedMap, PointLight, Portal,
    PortalSky, Projector, SphereLight, Spot, TexturedMesh, TexturedSphere,
};
use crate::texture::Textures;
use crate::texture_record::TextureRecord;

/// All lights during compilation.
#[derive(Default)]
pub(super) struct Lights {
    pub(super) table: Table<AnyLight>,
    pub(super) infinite: Vec<Id<AnyLight>>,
    pub(super) tables: LightTables,
    /// Number of lights that are not in the table: those in trees, and those on instances.
    pub(super) hidden: usize,
    pub(super) origins: LightSourceIds,
    /// Number of lights that are means of daylight over days.
    pub(super) means: usize,
    /// True if environment maps are compensated.
    compensated: bool,
}

impl Lights {
    /// No lights yet. Environment maps may be compensated; see [`CompileOptions::compensated`].
    pub(super) fn new(textures: &Arc<Textures>, compensated: bool) -> Self {
        let tables = LightTables { textures: Arc::clone(textures), ..LightTables::default() };
        Self { tables, compensated, ..Self::default() }
    }

    pub(super) fn add_sky(&mut self, light: impl Into<AnyLight>) {
        let id = self.table.push(light.into());
        self.infinite.push(id);
    }

    /// Adds a sky, restricted to a portal if it has one.
    fn add_sky_behind(
        &mut self,
        portal: Option<pt_scene::Portal>,
        metres: f64,
        sky: Environment,
    ) -> Result<(), String> {
        let Some(portal) = portal else {
            self.add_sky(sky);
            return Ok(());
        };
        let [corner, e1, e2] = portal.edges()?.map(|v| v * metres);
        let number = self.tables.portals.len() as u32;
        self.tables.portals.push(Portal::new(corner, e1, e2));
        self.add_sky(PortalSky { sky, portal: number });
        Ok(())
    }

    /// Adds the light nodes of the scene.
    pub(super) fn add_nodes(
        &mut self,
        (scene, earlier): (&Scene, Option<&Earlier>),
        shapes: &mut Shapes,
        metres: f64,
        convert: Option<LightConversion>,
        notes: &mut Notes,
    ) -> Result<(), CompileError> {
        for (number, node) in scene.lights.iter().enumerate() {
            let to_world = DAffine3::from_scale(DVec3::splat(metres)) * node.to_world;
            if let Some(convert) = convert {
                match convert(node, to_world, &mut self.tables) {
                    Ok(Some(light)) => {
                        self.table.push(light);
                    }
                    Ok(None) => {}
                    Err(note) => notes.push(format!("light \"{}\": {note}", node.name)),
                }
            } else if represents_emissive_shape(node, to_world, shapes) {
                notes.push(format!(
                    "light \"{}\" represents the emissive surface around it, which lights the \
                     scene instead",
                    node.name
                ));
            } else {
                self.add_node(node, number, (to_world, metres, earlier), shapes, notes)?;
                if matches!(node.kind, LightKind::Area { .. }) {
                    self.origins.squares.push(number as u32);
                }
            }
            self.origins.lights.resize(self.table.as_slice().len(), Some(number as u32));
        }
        shapes.remove_old_squares();
        Ok(())
    }

    fn add_node(
        &mut self,
        node: &Node,
        number: usize,
        (to_world, metres, earlier): (DAffine3, f64, Option<&Earlier>),
        shapes: &mut Shapes,
        notes: &mut Notes,
    ) -> Result<(), CompileError> {
        let error = |message| CompileError::Value { at: node.at.clone(), message };
        let position = to_world.translation.as_vec3();
        let axis = (-to_world.matrix3.z_axis).normalize_or_zero().as_vec3();
        match node.kind {
            LightKind::Environment { ref image, scale, rows, portal } => {
                doubt_sky(image, &node.at, notes);
                let kept = earlier.and_then(|e| e.environment(image, rows, self.compensated));
                let image = &match kept {
                    Some(_) => Arc::clone(image),
                    None => sky_of(image, &node.at, notes),
                };
                if kept.is_none() {
                    image.check_radiance().map_err(|e| error(format!("environment image: {e}")))?;
                }
                let turn = orthogonal(to_world.matrix3, "an environment light").map_err(error)?;
                let known = self.tables.environments.iter().position(|m| m.is_of(image, rows));
                let index = match (known, kept) {
                    (Some(index), _) => index as u32,
                    (None, Some(map)) => self.push_prepared(Arc::clone(map)),
                    (None, None) => {
                        self.push_map(EnvironmentMap::of_image(Arc::clone(image), rows))
                    }
                };
                let map = Some(PlacedMap { index, to_world: turn });
                let sky = Environment { radiance: Spectrum::splat(scale), map };
                self.add_sky_behind(portal, metres, sky).map_err(error)?;
            }
            LightKind::Hemisphere { radiance } => {
                self.add_sky(HemisphereLight { radiance: radiance.into() });
            }
            LightKind::Constant { radiance, portal } => {
                let sky = Environment { radiance: radiance.into(), map: None };
                self.add_sky_behind(portal, metres, sky).map_err(error)?;
            }
            LightKind::Directional { irradiance } => {
                let light = Directional { to_light: -axis, irradiance: irradiance.into() };
                self.table.push(light.into());
            }
            LightKind::Point { intensity } => {
                self.table.push(PointLight { position, intensity: intensity.into() }.into());
            }
            LightKind::Daylight(ref daylight) => {
                let turn = orthogonal(to_world.matrix3, "an environment light").map_err(error)?;
                let note = self.add_daylight(daylight, turn).map_err(error)?;
                notes.extend(note.map(|note| format!("light \"{}\": {note}", node.name)));
            }
            LightKind::Ies { ref profile, scale } => {
                let axes = orthogonal(to_world.matrix3, "a luminaire").map_err(error)?;
                let index = self.tables.profiles.len() as u32;
                self.tables.profiles.push(Arc::clone(profile));
                let light = Ies { position, axes, profile: index, scale: scale.into() };
                self.table.push(light.into());
            }
            LightKind::DistantDisk { irradiance, angular_radius } => {
                let radius = angular_radius.to_radians() as f32;
                let irradiance = irradiance.into();
                if radius >= DistantDisk::MIN_ANGLE {
                    let radius = radius.min(FRAC_PI_2);
                    self.add_sky(DistantDisk::new(-axis, radius, irradiance));
                } else {
                    self.table.push(Directional { to_light: -axis, irradiance }.into());
                }
            }
            LightKind::Spot { .. }
            | LightKind::LinearSpot { .. }
            | LightKind::PunctualSpot { .. }
            | LightKind::Projector { .. } => {
                self.add_spot(&node.kind, shapes.slides[number], to_world).map_err(error)?;
            }
            LightKind::Area { radiance } => {
                let (origin, e1, e2) = area_square(to_world);
                // e2 × e1 faces −z unless the node mirrors.
                let flip = to_world.matrix3.determinant() < 0.0;
                let (e1, e2) = if flip { (e1, e2) } else { (e2, e1) };
                shapes.add_emissive_square(origin, e1, e2, radiance.into());
            }
        }
        Ok(())
    }

    /// Adds a spot light or a projector.
    fn add_spot(
        &mut self,
        kind: &LightKind,
        slide: Option<Id<TextureRecord>>,
        to_world: DAffine3,
    ) -> Result<(), String> {
        let position = to_world.translation.as_vec3();
        let axis = (-to_world.matrix3.z_axis).normalize_or_zero().as_vec3();
        match *kind {
            LightKind::Spot { intensity, falloff_angle, falloff_exponent } => {
                let half = (0.5 * falloff_angle).clamp(0.0, 180.0).to_radians() as f32;
                let falloff = Falloff::Cosine {
                    cos_cutoff: trig::sin_cos(half).1,
                    exponent: falloff_exponent as f32,
                };
                let light = Spot { position, axis, intensity: intensity.into(), falloff };
                self.table.push(light.into());
            }
            LightKind::LinearSpot { intensity, beam_angle, cutoff_angle, .. } => {
                let radians = |angle: f64| angle.clamp(0.0, 180.0).to_radians() as f32;
                let cutoff = radians(cutoff_angle);
                let falloff = Falloff::Linear { beam: radians(beam_angle), cutoff };
                let spot = Spot { position, axis, intensity: intensity.into(), falloff };
                match slide {
                    None => _ = self.table.push(spot.into()),
                    Some(texture) => {
                        let axes = projection(to_world.matrix3, cutoff)?;
                        let (sin, cos) = trig::sin_cos(cutoff);
                        self.add_projector(spot, axes, [sin / cos; 2], texture);
                    }
                }
            }
            LightKind::Projector { intensity, x_fov, y_fov, .. } => {
                let tangents = [x_fov, y_fov].map(|fov| libm::tan(0.5 * fov.to_radians()));
                // Beyond the corners, by more than rounding errors.
                let cutoff =
                    libm::atan(libm::hypot(tangents[0], tangents[1]) * (1.0 + 1e-5)) as f32;
                let falloff = Falloff::Flat { cutoff };
                let spot = Spot { position, axis, intensity: intensity.into(), falloff };
                let axes = projection(to_world.matrix3, cutoff)?;
                if let Some(texture) = slide {
                    self.add_projector(spot, axes, tangents.map(|t| t as f32), texture);
                }
            }
            LightKind::PunctualSpot { intensity, inner_angle, outer_angle } => {
                let [inner, outer] = [inner_angle, outer_angle]
                    .map(|angle| angle.clamp(0.0, 90.0).to_radians() as f32);
                let falloff = Falloff::Punctual { inner, outer };
                let light = Spot { position, axis, intensity: intensity.into(), falloff };
                self.table.push(light.into());
            }
            _ => {}
        }
        Ok(())
    }

    /// Adds a spot light with a projected image.
    fn add_projector(
        &mut self,
        spot: Spot,
        axes: Mat3,
        tangents: [f32; 2],
        texture: Id<TextureRecord>,
    ) {
        let slide = self.tables.slides.len() as u32;
        self.tables.slides.push(emission::slide(&self.tables.textures, axes, tangents, texture));
        self.table.push(Projector { spot, slide }.into());
    }

    /// Adds a light for each emissive shape.
    pub(super) fn add_emissive(&mut self, shapes: &mut Shapes) {
        for i in 0..shapes.emitters.len() {
            let light = self.emissive(shapes, &shapes.emitters[i]);
            let surface = shapes.emitters[i].surface;
            shapes.surfaces[surface].light = light.map(|l| self.table.push(l));
        }
    }

    /// Adds lights for emissive instances.
    pub(super) fn add_moving(&mut self, shapes: &mut Shapes, notes: &mut Notes) {
        let mut placed = std::mem::take(&mut shapes.placed);
        // Coats attenuate light by its angle in world space, which instances in their own
        // coordinates do not have.
        let count = placed.add_lights(shapes, |shapes, emitter| {
            let is_plain = emitter.emission.coat == 0.0;
            is_plain.then(|| self.emissive(shapes, emitter))?
        });
        shapes.placed = placed;
        self.hidden += count;
        if count > MAX_MOVING_LIGHTS {
            notes.push(format!(
                "{count} lights move, of which at most {MAX_MOVING_LIGHTS} can be sampled; all are \
                 found by BSDF samples only, which requires more samples"
            ));
        }
    }

    /// Creates the light of an emissive shape; `None` if it has no area.
    fn emissive(&mut self, shapes: &Shapes, emitter: &Emitter) -> Option<AnyLight> {
        let SurfaceEmission { radiance, texture, is_invisible, coat } = emitter.emission;
        let light = match (&emitter.primitives, texture) {
            (ShapePrimitives::Triangles(runs), None) => {
                let triangles = emitter_triangles(shapes, runs, coat);
                MeshLight::new(&mut self.tables, &triangles, radiance).map(Into::into)
            }
            (ShapePrimitives::Triangles(runs), Some(texture)) => {
                self.textured_mesh(shapes, (runs, coat), texture)
            }
            (&ShapePrimitives::Sphere(s), None) => {
                Some(sphere_light(shapes, s, radiance, coat).into())
            }
            (&ShapePrimitives::Sphere(s), Some(texture)) => {
                let sphere = sphere_light(shapes, s, radiance, coat);
                Some(self.textured_sphere(shapes.sphere_axes[s], sphere, texture))
            }
        }?;
        if is_invisible { InvisibleLight::of(light).map(Into::into) } else { Some(light) }
    }

    fn textured_mesh(
        &mut self,
        shapes: &Shapes,
        (runs, coat): (&[std::ops::Range<usize>], f32),
        texture: Id<TextureRecord>,
    ) -> Option<AnyLight> {
        let triangles = emitter_triangles(shapes, runs, coat);
        let laid = emission::textured_triangles(shapes, runs, &triangles, texture);
        TexturedMesh::new(&mut self.tables, &triangles, &laid).map(Into::into)
    }

    fn textured_sphere(
        &mut self,
        axes: Mat3,
        sphere: SphereLight,
        texture: Id<TextureRecord>,
    ) -> AnyLight {
        let map = self.tables.sphere_maps.len() as u32;
        let textures = &self.tables.textures;
        self.tables.sphere_maps.push(emission::sphere_map(textures, axes, &sphere, texture));
        TexturedSphere { sphere, map }.into()
    }

    /// Adds an environment map that is not part of the scene.
    pub(super) fn add_environment(&mut self, map: Option<EnvironmentMap>) {
        if let Some(map) = map {
            self.add_map(map, Spectrum::ONE, Mat3::IDENTITY);
        }
    }

    /// Adds a map to the tables, and returns its index.
    fn push_map(&mut self, mut map: EnvironmentMap) -> u32 {
        if self.compensated {
            map.compensate();
        }
        self.push_prepared(Arc::new(map))
    }

    fn push_prepared(&mut self, map: Arc<EnvironmentMap>) -> u32 {
        self.tables.compensated = self.compensated;
        self.tables.environments.push(map);
        self.tables.environments.len() as u32 - 1
    }

    pub(super) fn add_map(&mut self, map: EnvironmentMap, radiance: Spectrum, to_world: Mat3) {
        let index = self.push_map(map);
        self.add_sky(Environment { radiance, map: Some(PlacedMap { index, to_world }) });
    }

    /// Returns true if the scene has no light.
    pub(super) fn are_out(&self, shapes: &Shapes) -> bool {
        let emits = !shapes.emitters.is_empty() || shapes.placed.emits();
        self.table.as_slice().is_empty() && !emits
    }
}

/// Returns the orthogonal part of a transform that rotates, mirrors and scales uniformly.
///
/// # Errors
/// If the transform of `light` is another one.
fn orthogonal(linear: DMat3, light: &str) -> Result<Mat3, String> {
    if linear.x_axis == DVec3::ZERO || !is_similarity(linear) {
        return Err(format!(
            "found an invalid transform of {light}, expected rotations, reflections and uniform \
             scales only"
        ));
    }
    let x = linear.x_axis.normalize();
    let y = (linear.y_axis - x * x.dot(linear.y_axis)).normalize();
    let z = x.cross(y) * linear.determinant().signum();
    Ok(Mat3::from_cols(x.as_vec3(), y.as_vec3(), z.as_vec3()))
}

/// Axes of an image that a spot light projects along −z of a node, with x and y of the node.
///
/// # Errors
/// If the transform is not a similarity, or the cutoff angle is 90° or more.
fn projection(to_world: DMat3, cutoff: f32) -> Result<Mat3, String> {
    let Mat3 { x_axis, y_axis, z_axis } = orthogonal(to_world, "a light with a projected image")?;
    if cutoff < FRAC_PI_2 {
        return Ok(Mat3::from_cols(x_axis, y_axis, -z_axis));
    }
    let degrees = cutoff.to_degrees();
    Err(format!(
        "found a projected image with an angle of {degrees}° to the axis, expected an angle below \
         90°"
    ))
}

/// Returns true if a light node lies on an emissive mesh, and so represents the same light: then
/// only the visible mesh lights the scene.
///
/// "On" is within a thousandth of the size of the mesh.
fn represents_emissive_shape(node: &Node, to_world: DAffine3, shapes: &Shapes) -> bool {
    let position = to_world.translation.as_vec3();
    node.kind.is_local()
        && shapes.emitters.iter().any(|e| match &e.primitives {
            ShapePrimitives::Triangles(runs) => {
                let triangles = runs.iter().flat_map(Clone::clone).map(|i| shapes.corners(i));
                point_mesh::touches_triangles(position, triangles)
            }
            ShapePrimitives::Sphere(_) => false,
        })
}

/// Notes a sky that is probably in another layout.
fn doubt_sky(image: &Image, at: &Span, notes: &mut Notes) {
    if let Some(doubt) = image.doubt_as_sky() {
        notes.push(format!("{at}: environment image: {doubt}"));
        notes.suggest(Hint::SetSkyLayout);
    }
}

/// Image of a sky in which invalid radiance is replaced, with notes on it.
fn sky_of(image: &Arc<Image>, at: &Span, notes: &mut Notes) -> Arc<Image> {
    let line = |message: String| format!("{at}: environment image: {message}");
    if image.check_radiance().is_ok() {
        return Arc::clone(image);
    }
    let mut light = Image::clone(image);
    notes.extend(light.make_radiance().map(line));
    if light == **image { Arc::clone(image) } else { Arc::new(light) }
}

#[cfg(test)]
mod tests {
    use pt_math::Vec3;
    use pt_scene::{Daylight, Rows};

    use super::*;

    fn compile(kind: LightKind, to_world: DAffine3) -> Result<Vec<AnyLight>, String> {
        let (name, at) = (String::new(), pt_scene::Span::default());
        let lights = vec![Node { name, to_world, kind, at }].into();
        let scene = Scene { lights, metres_per_unit: 0.5, ..Scene::default() };
        let compiled = crate::compile(&scene, crate::CompileOptions::default());
        compiled.map(|c| c.scene.lights.as_slice().to_vec()).map_err(|e| e.to_string())
    }

    fn daylight_of(to_sun: [f64; 3], turbidity: f64) -> LightKind {
        LightKind::Daylight(Daylight { to_sun, turbidity, ..Daylight::default() })
    }

    /// In the node, +y is up: here this is +z of the world.
    #[test]
    fn daylight_is_a_sky_and_a_disk_turned_with_their_node() {
        let up = DAffine3::from_mat3(DMat3::from_cols(DVec3::Y, DVec3::Z, DVec3::X));
        let lights = compile(daylight_of([0.0, 3.0, 4.0], 3.0), up).unwrap();
        let [AnyLight::ClearSky(sky), AnyLight::Sun(sun)] = lights.as_slice() else {
            panic!("{lights:?}");
        };
        assert!((sun.disk.to_light - Vec3::new(0.8, 0.0, 0.6)).length() < 1e-6);
        assert!(sun.disk.radiance.luminance() > 1e3);
        assert_eq!((sky.to_world.y_axis, sun.up), (Vec3::Z, Vec3::Z));
    }

    #[test]
    fn there_is_no_light_with_the_sun_below_the_horizon() {
        let lights = compile(daylight_of([1.0, -0.1, 0.0], 3.0), DAffine3::IDENTITY).unwrap();
        assert!(lights.is_empty());
    }

    /// The irradiance of the sun does not depend on its size.
    #[test]
    fn wide_suns_are_darker() {
        let of = |aperture| {
            let daylight = Daylight { aperture, sky: 0.0, ..Daylight::default() };
            let lights = compile(LightKind::Daylight(daylight), DAffine3::IDENTITY).unwrap();
            let [AnyLight::Sun(sun)] = lights.as_slice() else { panic!("{lights:?}") };
            sun.disk.radiance.luminance() * sun.disk.one_minus_cos
        };
        let (real, wide) = (of(0.5358), of(60.0));
        assert!((real / wide - 1.0).abs() < 1e-5, "{real} {wide}");
    }

    /// A sky of two equal pixels.
    fn image(width: u32, pixel: [f32; 3]) -> LightKind {
        LightKind::Environment {
            image: Arc::new(Image { width, height: 1, pixels: vec![pixel; 2].into() }),
            scale: 1.0,
            rows: Rows::default(),
            portal: None,
        }
    }

    /// Values that are not radiance become black or the largest number, with a note on their number
    /// and place.
    #[test]
    fn values_of_skies_that_are_no_light_are_replaced_and_noted() {
        let values = [(f32::NAN, 0.0), (-1.0, 0.0), (f32::NEG_INFINITY, 0.0), (f32::INFINITY, 1.0)];
        for (value, kept) in values {
            let at = Span::default();
            let mut notes = Notes::default();
            let LightKind::Environment { image, .. } = image(2, [value, 1.0, 1.0]) else { return };
            let light = sky_of(&image, &at, &mut notes);
            assert_eq!(light.pixels, [[kept, 1.0, 1.0]; 2], "{value}");
            let wanted = "2 pixels of 2 with values that are not radiance";
            let is_noted =
                notes.lines().iter().any(|note| note.contains(wanted) && note.contains("(0, 0)"));
            assert!(is_noted, "{value}: {notes:?}");
        }
    }

    #[test]
    fn skies_that_make_no_sense_are_refused() {
        let skewed = DAffine3::from_mat3(DMat3::from_cols(DVec3::X, DVec3::ONE, DVec3::Z));
        let cases = [
            (image(3, [1.0; 3]), DAffine3::IDENTITY, "found 2 pixels, expected"),
            (image(2, [1.0; 3]), skewed, "expected rotations, reflections and uniform scales only"),
            (daylight_of([0.0, 1.0, 0.0], 0.5), DAffine3::IDENTITY, "expected 1 to 10"),
            (daylight_of([0.0; 3], 3.0), DAffine3::IDENTITY, "zero or infinite"),
        ];
        for (kind, to_world, want) in cases {
            let message = compile(kind, to_world).unwrap_err();
            assert!(message.contains(want), "{message}");
        }
    }
}
