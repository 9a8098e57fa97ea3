//! Assembles the scene from the directives.

use std::collections::HashMap;
use std::rc::Rc;
use std::sync::Arc;

use pt_math::{DAffine3, DMat3, DVec3};
use pt_scene::material::SurfaceDetail;
use pt_scene::shapes::flip;
use pt_scene::texture::{Input, Scalar};
use pt_scene::{
    Attribute, Camera, Geometry, Key, LightKind, Material, Mesh, Motion, Object, RenderHints,
    Scene, Span, Surface, Warning,
};

use super::camera::CameraSetup;
use super::color_space::ColorSpace;
use super::curve::is_tube;
use super::emission::{AreaLight, area, area_light};
use super::entity::Entity;
use super::media::PbrtMedia;
use super::position::TokenPosition;
use super::shape::{PbrtMeshCache, shape, sphere_mesh};
use super::state::GraphicsState;
use super::texture::PbrtTextures;
use super::token::Tokens;
use super::types::Moving;
use super::upsample::Illuminant;
use super::{camera, displace, film, hair, medium_emission, subsurface, white_balance};
use crate::LoadError;
use crate::pbrt::types::{MaterialName, PlacedShape, Tube, is_same, key_of};
use crate::pbrt::world::PbrtWorld;
use crate::shared::context::{Folder, LoadContext};
use crate::shared::names::{did_you_mean, quote};
use crate::shared::placeholder;
use crate::shared::registry::Registry;

/// Maximum number of shapes of a scene. Short files can request any number: objects of many shapes,
/// and many instances of them.
const MAX_SHAPES: usize = 1_000_000;

impl PbrtWorld {
    pub(super) fn new(folder: &Folder, file: Span) -> Self {
        let nowhere = Tokens::new("", &file.file).end();
        let default = Entity::new(
            "Material",
            "diffuse".to_owned(),
            nowhere,
            Vec::new(),
            &[],
            ColorSpace::SRGB,
        );
        Self {
            scene: Scene::default(),
            sight: CameraSetup::default(),
            textures: PbrtTextures::new(folder.clone()),
            media: PbrtMedia::new(folder.clone()),
            materials: vec![Rc::new(default)],
            named_materials: Registry::default(),
            objects: HashMap::new(),
            times: [0.0, 1.0],
            meshes: PbrtMeshCache::default(),
            shapes: Vec::new(),
            surfaces: HashMap::new(),
            within: HashMap::new(),
            made: HashMap::new(),
            laid_out: HashMap::new(),
            skies: HashMap::new(),
            spheres: HashMap::new(),
            file,
        }
    }

    /// Adds an unnamed material.
    pub(super) fn add_material(&mut self, entity: Entity) -> MaterialName {
        self.materials.push(Rc::new(entity));
        MaterialName::Anonymous(self.materials.len() - 1)
    }

    /// Adds a named material.
    pub(super) fn name_material(&mut self, name: String, entity: Entity) -> Result<(), LoadError> {
        let duplicate = entity.at.error(format!("duplicate material {}", quote(&name)));
        let is_new = self.named_materials.define(name, Rc::new(entity));
        is_new.then_some(()).ok_or(duplicate)
    }

    /// Reads a shape with the current state. Shapes of objects cannot emit light.
    pub(super) fn shape(
        &mut self,
        entity: &Entity,
        state: &GraphicsState,
        in_object: bool,
    ) -> Result<PlacedShape, LoadError> {
        let folder = self.textures.folder.clone();
        let geometry = shape(entity, state, &mut self.meshes, &folder, &mut self.scene.warnings)?;
        let geometry = self.displaced(entity, state, geometry)?;
        self.context().take_placeholder_used();
        let alpha = self.textures.number(entity, "alpha", [0.0, 1.0])?;
        let alpha = alpha.filter(|_| !self.context().take_placeholder_used()).unwrap_or(1.0.into());
        let tube = is_tube(entity)?.then_some(Tube { is_inside_out: state.reverses });
        entity.finish()?;
        let mut light = state.area_light.clone();
        if in_object && light.take().is_some() {
            let message =
                "emissive shapes in object definitions are not supported; the emission is ignored"
                    .to_owned();
            self.scene.warnings.push(Warning { at: entity.at.span(""), message });
        }
        Ok(PlacedShape {
            name: entity.kind.clone(),
            to_world: state.ctm,
            geometry,
            material: state.material.clone(),
            alpha,
            light,
            media: Rc::clone(&state.media),
            tube,
            at: entity.at.clone(),
        })
    }

    /// Applies the `displacement` of a mesh file, if it has one.
    fn displaced(
        &mut self,
        entity: &Entity,
        state: &GraphicsState,
        geometry: Geometry,
    ) -> Result<Geometry, LoadError> {
        const DISPLACEMENT: &str = "displacement";
        const HEIGHTS: [f32; 2] = [f32::MIN, f32::MAX];
        let (Geometry::Mesh(mesh), "plymesh") = (&geometry, entity.kind.as_str()) else {
            return Ok(geometry);
        };
        let edge = entity.positive("displacement.edgelength", 1.0)?;
        let edge = entity.positive("edgelength", edge)?;
        let Some(heights) = self.textures.number(entity, DISPLACEMENT, HEIGHTS)? else {
            return Ok(geometry);
        };
        let refuse = |why: String| entity.refuse(DISPLACEMENT, why);
        let made = displace::displaced(mesh, &heights, edge, &state.ctm[0]).map_err(refuse)?;
        let context = Arc::clone(&self.textures.folder.context);
        self.meshes.count(&made, &context).map_err(refuse)?;
        Ok(Geometry::Mesh(Arc::new(made)))
    }

    /// State shared by the readers of scenes.
    fn context(&self) -> &LoadContext {
        &self.textures.folder.context
    }

    /// Adds a shape to the world.
    pub(super) fn place(&mut self, placed: PlacedShape) -> Result<(), LoadError> {
        if self.shapes.last_mut().is_some_and(|last| last.joins(&placed)) {
            return Ok(());
        }
        let most = self.context().limits().shapes(MAX_SHAPES);
        if self.shapes.len() >= most {
            let message = format!("the number of shapes exceeds {most}");
            return Err(LoadContext::exceeded(placed.at.span(""), message));
        }
        self.shapes.push(placed);
        Ok(())
    }

    /// Adds the shapes of an object to the world.
    pub(super) fn instance(
        &mut self,
        name: &str,
        to_world: Moving,
        at: &TokenPosition,
    ) -> Result<(), LoadError> {
        let Some(shapes) = self.objects.get(name).cloned() else {
            let hint = did_you_mean(name, self.objects.keys().map(String::as_str));
            return Err(at.error(format!(
                "undefined object {}; expected the name of an object above{hint}",
                quote(name)
            )));
        };
        for shape in shapes.iter() {
            let placed = [0, 1].map(|i| to_world[i] * shape.to_world[i]);
            let name = format!("{} of {name}", shape.name);
            self.place(PlacedShape { name, to_world: placed, at: at.clone(), ..shape.clone() })?;
        }
        Ok(())
    }

    /// Builds the scene.
    pub(super) fn finish(mut self) -> Result<Scene, LoadError> {
        let context = Arc::clone(&self.textures.folder.context);
        let settings = film::settings(&self.sight, &mut self.scene.warnings);
        let (mut settings, mut exposure) =
            context.ok_or_report(settings)?.unwrap_or((RenderHints::default(), 1.0));
        settings.sides_by_shading_normal = true;
        let resolution = settings.resolution.unwrap_or([1280, 720]);
        let camera = self.camera(resolution);
        if let Some((camera, share)) = context.ok_or_report(camera)? {
            exposure *= share;
            self.scene.cameras.push(camera);
        }
        for placed in std::mem::take(&mut self.shapes) {
            let done = self.object(placed, exposure);
            context.ok_or_report(done)?;
        }
        let moves = |motion: &Option<Arc<Motion>>| motion.is_some();
        let anything_moves = self.scene.objects.iter().any(|object| moves(&object.motion));
        for camera in &mut self.scene.cameras {
            if !anything_moves && camera.motion.is_none() {
                camera.shutter = [camera.shutter[0]; 2];
            }
        }
        for light in &mut self.scene.lights {
            expose(&mut light.kind, exposure as f32);
        }
        let mut some_emit = false;
        for medium in &mut self.media.made {
            medium_emission::expose(&mut medium.matter, exposure as f32);
            some_emit |= medium.matter.emits();
        }
        let illuminant = Illuminant::of_scene(&self.scene.lights, &self.scene.materials);
        if let Some(illuminant) = illuminant.filter(|_| !some_emit) {
            self.scene
                .materials
                .iter_mut()
                .for_each(|material| illuminant.light_up(&mut material.surface));
        }
        if !self.within.is_empty() {
            subsurface::prepare(&mut settings);
        }
        let is_volumetric = settings.integrator == Some("volpath");
        if is_volumetric && self.media.made.is_empty() {
            settings.integrator = None;
        }
        self.scene.media = self.media.made.into();
        self.scene.settings = settings;
        // Errors of the film were reported above.
        let white =
            self.sight.film.as_ref().and_then(|film| film::white_balance(film).ok().flatten());
        if let Some(kelvin) = white {
            white_balance::balance(&mut self.scene, white_balance::of_daylight(kelvin));
        }
        Ok(self.scene)
    }

    /// Builds the camera and returns it with the factor by which it multiplies light.
    fn camera(&mut self, resolution: [u32; 2]) -> Result<(Camera, f64), LoadError> {
        let Some((entity, to_world, media)) = &self.sight.camera else {
            // A camera that could not be read was reported.
            if self.context().has_errors() {
                return Err(LoadError::AlreadyReported);
            }
            let message = "missing Camera; expected one before WorldBegin".to_owned();
            return Err(LoadError::Content { at: self.file.clone(), message });
        };
        let medium = self.media.number(&media.outside, media.at.as_ref())?;
        let diagonal = match &self.sight.film {
            Some(film) => film.positive("diagonal", 35.0)?,
            None => 35.0,
        };
        let around = camera::Around {
            to_world: *to_world,
            times: self.times,
            medium,
            resolution,
            diagonal,
            folder: &self.textures.folder,
        };
        camera::camera(entity, &around, &mut self.scene.warnings)
    }

    /// Adds a shape with its material; a two-sided emitter is two objects.
    fn object(&mut self, placed: PlacedShape, exposure: f64) -> Result<(), LoadError> {
        let PlacedShape { name, to_world: [start, end], mut geometry, .. } = placed;
        for map in [start, end] {
            if !(map.is_finite() && map.inverse().is_finite() && map.matrix3.determinant() != 0.0) {
                return Err(placed.at.error(
                    "found a transform that flattens the shape, expected an invertible one",
                ));
            }
        }
        let known = self.surface_once(&placed.material)?;
        let of_tube = placed.tube.and_then(|_| hair::of_tube((*known).as_ref()?));
        let surface = of_tube.as_ref().or((*known).as_ref());
        if let (Some(_), Some(Tube { is_inside_out: true }), Geometry::Mesh(mesh)) =
            (&of_tube, placed.tube, &mut geometry)
        {
            flip(Arc::make_mut(mesh));
        }
        let within = self.within.get(&key_of(&placed.material)).copied();
        let mut light = None;
        match (&placed.light, surface) {
            (Some(entity), Some(_)) => {
                light = Some(area_light(
                    entity,
                    area(&geometry, &start),
                    exposure,
                    &self.textures.folder,
                )?);
            }
            (Some(_), None) => {
                let message =
                    "emission of an interface between media is not supported; the emission is \
                     ignored"
                        .to_owned();
                self.scene.warnings.push(Warning { at: placed.at.span(""), message });
            }
            (None, _) => {}
        }
        let is_textured = surface.is_some_and(shows_texture)
            || is_laid(&placed.alpha)
            || light.as_ref().is_some_and(|light| is_laid(&light.radiance));
        if is_textured {
            geometry = self.laid_out(geometry).map_err(|message| placed.at.error(message))?;
        }
        let [start, end] = match geometry {
            Geometry::Sphere { .. } => [start, end].map(|map| map * SPHERE),
            Geometry::Mesh(_) | Geometry::Points { .. } => [start, end],
        };
        let two_sided = light.as_ref().is_some_and(|light| light.two_sided);
        let is_tube = of_tube.is_some();
        let material = self.material(&placed.material, (surface, is_tube), &placed.alpha, light);
        let motion = (start != end).then(|| {
            let keys = self
                .times
                .into_iter()
                .zip([start, end])
                .map(|(time, to_world)| Key { time, to_world });
            Motion::new(keys.collect()).map_err(|error| placed.at.error(error.message))
        });
        let motion = motion.transpose()?.map(Arc::new);
        let object = Object {
            name,
            to_world: if motion.is_some() { DAffine3::IDENTITY } else { start },
            motion,
            geometry,
            materials: vec![Some(material)],
            media: self.media.sides(&placed.media, within)?,
            at: placed.at.span(""),
        };
        if let (true, Geometry::Mesh(mesh)) = (two_sided, &object.geometry) {
            let back = Geometry::Mesh(Arc::new(pt_scene::shapes::back_of(mesh)));
            let name = format!("back of {}", object.name);
            let materials = vec![Some(self.back_of(material))];
            let back = Object { name, geometry: back, media: None, materials, ..object.clone() };
            self.scene.objects.push(back);
        }
        self.scene.objects.push(object);
        Ok(())
    }

    /// Returns a shape with texture coordinates, which are created once per mesh.
    fn laid_out(&mut self, geometry: Geometry) -> Result<Geometry, String> {
        Ok(match geometry {
            Geometry::Sphere { radius } => {
                if let Some(known) = self.spheres.get(&radius.to_bits()) {
                    return Ok(Geometry::Mesh(Arc::clone(known)));
                }
                let mesh = Arc::new(sphere_mesh(radius));
                self.meshes.count(&mesh, &self.textures.folder.context)?;
                self.spheres.insert(radius.to_bits(), Arc::clone(&mesh));
                Geometry::Mesh(mesh)
            }
            Geometry::Mesh(mesh) if mesh.uvs.is_none() => {
                let made = || (Arc::clone(&mesh), Arc::new(with_coordinates(&mesh)));
                let (_, made) = self.laid_out.entry(Arc::as_ptr(&mesh)).or_insert_with(made);
                Geometry::Mesh(Arc::clone(made))
            }
            geometry @ (Geometry::Mesh(_) | Geometry::Points { .. }) => geometry,
        })
    }

    /// Returns the surface of a material, which is created once.
    fn surface_once(&mut self, name: &MaterialName) -> Result<Rc<Option<Surface>>, LoadError> {
        let key = key_of(name);
        if let Some(known) = self.surfaces.get(&key) {
            return Ok(Rc::clone(known));
        }
        self.context().take_placeholder_used();
        let surface = self.surface(name)?;
        let surface = Rc::new(match surface {
            Some(_) if self.context().take_placeholder_used() => Some(placeholder::surface()),
            surface => surface,
        });
        self.surfaces.insert(key, Rc::clone(&surface));
        Ok(surface)
    }

    /// Returns the index of a material, which is added if it emits or is new with this opacity.
    fn material(
        &mut self,
        name: &MaterialName,
        (surface, is_tube): (Option<&Surface>, bool),
        alpha: &Scalar,
        light: Option<AreaLight>,
    ) -> u32 {
        let known = self.made.get(&key_of(name)).into_iter().flatten();
        let is_it =
            |(made, of_tube, _): &&(Scalar, bool, u32)| is_same(made, alpha) && *of_tube == is_tube;
        let known = known.filter(|_| light.is_none()).find(is_it);
        if let Some((.., number)) = known {
            return *number;
        }
        let shines = light.is_some();
        let opacity = if surface.is_some() { alpha.clone() } else { 0.0.into() };
        let material = Material {
            name: self.name_of(name),
            surface: surface.cloned().unwrap_or_else(Self::nothing),
            emission: light.map_or(Input::Value([0.0; 3]), |light| light.through(alpha)),
            hidden_emission: shines && *alpha == Input::Value(0.0),
            opacity,
        };
        let number = self.scene.materials.len() as u32;
        self.scene.materials.push(material);
        if !shines {
            self.made.entry(key_of(name)).or_default().push((alpha.clone(), is_tube, number));
        }
        number
    }

    /// Returns the material of the back of a two-sided emitter. If the front is not opaque, the
    /// back only emits.
    fn back_of(&mut self, number: u32) -> u32 {
        let front = &self.scene.materials[number as usize];
        if front.opacity == Input::Value(1.0) {
            return number;
        }
        let back = Material { opacity: 0.0.into(), ..front.clone() };
        self.scene.materials.push(back);
        self.scene.materials.len() as u32 - 1
    }

    fn name_of(&self, name: &MaterialName) -> String {
        match name {
            MaterialName::Anonymous(0) => "default".to_owned(),
            MaterialName::Anonymous(i) => self.materials[*i].kind.clone(),
            MaterialName::Named(name, _) => name.to_string(),
        }
    }
}

/// Transform from a [`Geometry::Sphere`], whose v is 0 at +z, to a sphere of pbrt-v4, whose v is 0
/// at −z. Both face outwards.
const SPHERE: DAffine3 = DAffine3 {
    matrix3: DMat3::from_diagonal(DVec3::new(1.0, 1.0, -1.0)),
    translation: DVec3::ZERO,
};

/// Returns true if a texture uses texture coordinates.
fn is_laid<T>(input: &Input<T>) -> bool {
    input.texture().is_some_and(|texture| texture.uses_coordinates())
}

/// Returns true if a surface needs texture coordinates: it has a texture that uses them, or is
/// anisotropic.
fn shows_texture(surface: &Surface) -> bool {
    let varies = is_laid::<[f32; 3]>;
    match surface {
        Surface::Diffuse(s) => varies(&s.reflectance),
        Surface::DiffuseTransmission(s) => varies(&s.reflectance) || varies(&s.transmittance),
        Surface::CoatedDiffuse(s) => varies(&s.diffuse),
        Surface::RoughCoatedDiffuse(s) => varies(&s.diffuse),
        Surface::Conductor(s) => s.roughness.as_ref().is_some_and(is_laid_out),
        Surface::Glass(s) => s.roughness.as_ref().is_some_and(is_laid_out),
        Surface::Mix(s) => {
            is_laid(&s.amount) || shows_texture(&s.first) || shows_texture(&s.second)
        }
        Surface::SurfaceDetail(SurfaceDetail { .. }) | Surface::Hair(_) => true,
        _ => false,
    }
}

fn is_laid_out(roughness: &pt_scene::material::Roughness) -> bool {
    let [u, v] = &roughness.alpha;
    u != v || is_laid(u)
}

/// Adds the default texture coordinates of pbrt-v4 to a mesh: (0, 0), (1, 0) and (1, 1) at the
/// corners of each triangle.
fn with_coordinates(mesh: &Mesh) -> Mesh {
    let values = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]];
    let indices = Some(vec![[0, 1, 2]; mesh.triangles.len()].into());
    Mesh { uvs: Some(Attribute { values: values.into(), indices }), ..mesh.clone() }
}

/// Multiplies the emission of a light.
fn expose(kind: &mut LightKind, exposure: f32) {
    match kind {
        LightKind::Environment { scale, .. } => *scale *= exposure,
        LightKind::Daylight(light) => {
            light.sky *= exposure;
            light.sun *= exposure;
        }
        _ => {
            if let Some(color) = kind.strength_mut() {
                *color = color.map(|c| c * exposure);
            }
        }
    }
}
