//! Cameras and lights. [glTF 2.0, §3.10; KHR_lights_punctual]

use pt_math::{DAffine3, DMat3, DVec3, point_mesh};
use pt_scene::{
    Camera, Fit, Geometry, Light, Material, Object, Placement, Projection, Scene, SimpleLight,
    Span, Surface, framing, shapes,
};
use serde_json::{Map, Value, json};

use super::super::camera::unscaled;
use super::GltfWriter;
use super::exact::near_f64;
use super::layer::power_of_two;
use crate::shared::names::quote;

/// Distance of the far plane of orthographic cameras whose scene has none.
const FAR: f64 = 1e6;

impl GltfWriter<'_> {
    /// Writes the cameras. The one that is used comes first, since other programs use the first
    /// one.
    pub(super) fn cameras(&mut self) -> Result<(), String> {
        let scene = self.scene;
        let Some(used) = scene.camera() else { return Ok(()) };
        let others = scene.cameras.iter().filter(|camera| !std::ptr::eq(*camera, used));
        std::iter::once(used).chain(others).try_for_each(|camera| self.camera(camera))
    }

    fn camera(&mut self, camera: &Camera) -> Result<(), String> {
        let place = format!("camera {}", quote(&camera.name));
        let camera = &self.placed(camera);
        let mut to_world = camera.to_world;
        if let Some(motion) = &camera.motion {
            self.notes
                .note(&place, "the motion is omitted; the pose when the shutter opens is written");
            to_world = motion.at(camera.shutter[0]) * to_world;
        }
        if camera.lens_radius > 0.0 {
            self.notes.note(&place, "depth of field is omitted");
        }
        if camera.principal_point_offset != [0.0; 2] {
            self.notes.note(&place, "the offset of the film is omitted");
        }
        if camera.medium.is_some() {
            self.notes.note(&place, "the medium around the camera is omitted");
        }
        if to_world.matrix3.determinant() < 0.0 {
            self.notes.note(&place, "the reflection in the camera transform is omitted");
        }
        let Some(rigid) = unscaled(self.in_metres(to_world)) else {
            return Err(format!("{place}: found a transform that flattens space"));
        };
        let [near, far] = [camera.near, camera.far].map(|x| x * self.metres);
        let scale = [to_world.matrix3.x_axis, to_world.matrix3.y_axis].map(DVec3::length);
        if camera.meter.is_some() {
            self.notes.note(&place, "meters are not representable in glTF; the camera is omitted");
            return Ok(());
        }
        let view = match camera.projection {
            Projection::Panorama => {
                self.notes
                    .note(&place, "panoramas are not representable in glTF; the camera is omitted");
                return Ok(());
            }
            Projection::Perspective { x_fov, y_fov } => {
                let mut view = perspective([x_fov, y_fov]);
                match (camera.fit, view.as_object_mut()) {
                    (Fit::Height, Some(keys)) => drop(keys.remove("aspectRatio")),
                    (Fit::Width, _) => {
                        self.notes
                            .note(&place, "images of other aspect ratios show the whole view");
                    }
                    _ => {}
                }
                view["znear"] = near.into();
                if far.is_finite() {
                    view["zfar"] = far.into();
                }
                json!({"type": "perspective", "perspective": view})
            }
            Projection::Orthographic { half_width, half_height } => {
                let far = if far.is_finite() { far } else { FAR.max(2.0 * near) };
                let [x, y] = [half_width * scale[0], half_height * scale[1]];
                let [x, y] = [x, y].map(|half| half * self.metres);
                let view = json!({"xmag": x, "ymag": y, "znear": near, "zfar": far});
                json!({"type": "orthographic", "orthographic": view})
            }
        };
        self.cameras.push(view);
        let index = self.cameras.len() - 1;
        let shown = Map::from_iter([("camera".to_owned(), index.into())]);
        self.node(&camera.name, rigid, shown, &place)
    }

    /// Returns the camera; if its placement depends on the surfaces, with the resulting transform.
    fn placed(&self, camera: &Camera) -> Camera {
        if camera.placement == Placement::Node {
            return camera.clone();
        }
        let mut placed = camera.clone();
        let extent = framing::surface_extent(self.scene, Some(camera.shutter));
        let half = framing::place(&mut placed, framing::half_extent(camera), extent);
        if let Projection::Orthographic { half_width, half_height } = &mut placed.projection {
            [*half_width, *half_height] = half;
        }
        placed
    }

    /// Writes the lights.
    pub(super) fn lights(&mut self) -> Result<(), String> {
        let scene = self.scene;
        scene.lights.iter().try_for_each(|light| self.light(light))
    }

    fn light(&mut self, light: &Light) -> Result<(), String> {
        let to_world = self.in_metres(light.to_world);
        let mut note = |note: &str| self.notes.note(&light.at, note);
        let (kind, intensity, cone) = match light.kind.simplified(&mut note) {
            SimpleLight::Directional { irradiance } => ("directional", irradiance, None),
            SimpleLight::Point { intensity } => ("point", intensity, None),
            SimpleLight::Spot { intensity, inner_angle, outer_angle } => {
                ("spot", intensity, Some([inner_angle, outer_angle]))
            }
            SimpleLight::Area { .. } if represents_emissive_mesh(light, self.scene) => {
                note("the light is omitted: it represents the emissive surface around it");
                return Ok(());
            }
            SimpleLight::Area { radiance } => return self.square(light, radiance),
            SimpleLight::Environment => {
                note("environment lights are not representable in glTF; the light is omitted");
                return Ok(());
            }
        };
        if !intensity.iter().all(|c| *c >= 0.0 && c.is_finite()) {
            return Err(format!("{}: found an intensity that is negative or not finite", light.at));
        }
        let strength = match intensity {
            [r, g, b] if r == g && g == b => r,
            [r, g, b] => power_of_two(r.max(g).max(b)),
        };
        let mut fields = json!({"type": kind, "intensity": strength});
        if intensity != [strength; 3] {
            fields["color"] = intensity.map(|c| c / strength).to_vec().into();
        }
        if let Some(cone) = cone {
            let [inner, outer] = self.cone(light, cone);
            fields["spot"] = json!({"innerConeAngle": inner, "outerConeAngle": outer});
        }
        self.lights.push(fields);
        let reference = json!({"light": self.lights.len() - 1});
        let extensions = self.extended([("KHR_lights_punctual", reference)]);
        let shown = Map::from_iter([("extensions".to_owned(), extensions)]);
        self.node(&light.name, to_world, shown, &light.at)
    }

    /// Converts the angles to the axis, in degrees, between which the intensity of a spot light
    /// falls off, to radians within the limits of glTF.
    fn cone(&mut self, light: &Light, [inner, outer]: [f64; 2]) -> [f64; 2] {
        if outer > 90.0 {
            self.notes.note(&light.at, "the cone becomes a half space, the widest one of glTF");
        }
        let radians = |degrees: f64| {
            let degrees = degrees.clamp(0.0, 90.0);
            near_f64(degrees.to_radians(), |angle| angle.to_degrees() == degrees)
        };
        let outer = radians(outer).max(f64::MIN_POSITIVE);
        // The inner angle has to be below the outer one.
        [radians(inner).min(outer * (1.0 - 1e-6)), outer]
    }

    /// Writes a square area light, as a mesh that emits.
    fn square(&mut self, light: &Light, radiance: [f32; 3]) -> Result<(), String> {
        let material = Material {
            name: light.name.clone(),
            surface: Surface::from(pt_scene::material::Black),
            emission: radiance.into(),
            hidden_emission: false,
            opacity: 1.0.into(),
        };
        let worn = self.described(&material, None)?;
        // The square [−1, 1]² faces +z; the light has half its side length and faces −z.
        let size = DMat3::from_diagonal(DVec3::new(-0.5, 0.5, -0.5));
        let turned = DAffine3 { matrix3: size, translation: DVec3::ZERO };
        let object = Object {
            name: light.name.clone(),
            to_world: light.to_world * turned,
            motion: None,
            geometry: Geometry::Mesh(std::sync::Arc::new(shapes::rectangle())),
            materials: vec![None],
            media: None,
            at: Span::default(),
        };
        self.dressed(&object, &[worn])
    }
}

/// Returns true if an area light is on an emissive mesh, which represents it in the file. (Readers
/// omit other lights for which this holds.)
fn represents_emissive_mesh(light: &Light, scene: &Scene) -> bool {
    let emits = |object: &Object, slot: u32| {
        let material = object.materials.get(slot as usize).copied().flatten();
        let material = material.and_then(|index| scene.materials.get(index as usize));
        material.is_some_and(|material| material.emission != [0.0; 3].into())
    };
    let p = light.to_world.translation.as_vec3();
    scene.objects.iter().any(|object| {
        let Geometry::Mesh(mesh) = &object.geometry else { return false };
        let parts = mesh.submeshes.iter().filter(|part| emits(object, part.slot));
        let numbers = parts.flat_map(|part| part.triangles.clone());
        let corner = |v: u32| {
            let position = DVec3::from(mesh.positions[v as usize].map(f64::from));
            object.to_world.transform_point3(position).as_vec3()
        };
        point_mesh::touches_triangles(p, numbers.map(|i| mesh.triangles[i as usize].map(corner)))
    })
}

/// Returns the vertical field of view and the aspect ratio from which a reader computes the same
/// two angles, in degrees.
fn perspective([x_fov, y_fov]: [f64; 2]) -> Value {
    let y = near_f64(y_fov.to_radians(), |y| y.to_degrees() == y_fov);
    let half = libm::tan(0.5 * y);
    let wide = |aspect: f64| 2.0 * libm::atan(aspect * half);
    let guess = libm::tan(0.5 * x_fov.to_radians()) / half;
    let aspect = near_f64(guess, |aspect| wide(aspect).to_degrees() == x_fov);
    json!({"yfov": y, "aspectRatio": aspect})
}
