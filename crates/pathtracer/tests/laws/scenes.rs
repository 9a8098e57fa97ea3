//! Scenes built by hand, and those of the project.

use std::path::Path;
use std::sync::Arc;

use pathtracer::{Camera, CompileOptions, Image, Placement, Projection, Scene};
use pt_math::{DAffine3, DVec3};
use pt_scene::material::{Black, Conductor, Diffuse, Plastic, Roughness};
use pt_scene::{
    Color, Geometry, Light, LightKind, Material, Mesh, Object, Rows, Surface, Texture, shapes,
};

/// The scene of the project with this path below `scenes/`.
pub(crate) fn load(name: &str) -> Scene {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes");
    pathtracer::load(&Path::new(folder).join(name)).expect("it can be read")
}

/// A diffuse surface.
pub(crate) fn matte(reflectance: [f32; 3]) -> Surface {
    Diffuse { reflectance: reflectance.into(), two_sided: true }.into()
}

/// A rough metal.
pub(crate) fn metal() -> Surface {
    Conductor {
        eta: [0.2, 0.9, 1.1],
        k: [3.9, 2.5, 2.3],
        reflectance: [1.0; 3].into(),
        roughness: Some(Roughness::beckmann(0.4)),
        two_sided: false,
    }
    .into()
}

/// A glossy surface.
pub(crate) fn gloss() -> Surface {
    Plastic {
        diffuse: [0.2, 0.3, 0.6].into(),
        specular: [0.05; 3].into(),
        alpha: 0.3,
        two_sided: false,
    }
    .into()
}

/// A node at `from` whose −z points to `to`, with its +y as far up as that allows.
pub(crate) fn looking(from: DVec3, to: DVec3) -> DAffine3 {
    let back = (from - to).normalize();
    let up = if back.y.abs() > 0.999 { DVec3::NEG_Z } else { DVec3::Y };
    let right = up.cross(back).normalize();
    DAffine3::from_cols(right, back.cross(right), back, from)
}

/// A pinhole camera with this horizontal and vertical field of view in degrees.
pub(crate) fn camera(from: DVec3, to: DVec3, fov: [f64; 2]) -> Camera {
    Camera {
        name: String::new(),
        to_world: looking(from, to),
        motion: None,
        shutter: [0.0; 2],
        projection: Projection::Perspective { x_fov: fov[0], y_fov: fov[1] },
        near: 0.0,
        far: f64::INFINITY,
        lens_radius: 0.0,
        aperture: None,
        focal_distance: 1.0,
        principal_point_offset: [0.0; 2],
        fit: pathtracer::Fit::Whole,
        medium: None,
        placement: Placement::Node,
        meter: None,
    }
}

/// Transform of the square [−1, 1]² that makes it face along `normal`, scaled by `half`, around
/// `center`.
pub(crate) fn facing(center: DVec3, normal: DVec3, half: f64) -> DAffine3 {
    looking(center, center - normal) * DAffine3::from_scale(DVec3::splat(half))
}

/// Compile options with this resolution.
pub(crate) fn size(resolution: [u32; 2]) -> CompileOptions {
    CompileOptions { resolution: Some(resolution), ..CompileOptions::default() }
}

/// Builder of scenes.
#[derive(Default)]
pub(crate) struct Builder(pub(crate) Scene);

impl Builder {
    fn material(&mut self, surface: Surface, emission: [f32; 3]) -> Vec<Option<u32>> {
        self.0.materials.push(Material {
            name: String::new(),
            surface,
            emission: emission.into(),
            hidden_emission: false,
            opacity: 1.0.into(),
        });
        vec![Some(self.0.materials.len() as u32 - 1)]
    }

    pub(crate) fn object(
        mut self,
        geometry: Geometry,
        to_world: DAffine3,
        surface: Surface,
        emission: [f32; 3],
    ) -> Self {
        let materials = self.material(surface, emission);
        let (name, at) = (String::new(), pt_scene::Span::default());
        let (motion, media) = (None, None);
        self.0.objects.push(Object { name, to_world, motion, geometry, materials, media, at });
        self
    }

    pub(crate) fn mesh(self, mesh: Mesh, to_world: DAffine3, surface: Surface) -> Self {
        self.object(Geometry::Mesh(Arc::new(mesh)), to_world, surface, [0.0; 3])
    }

    pub(crate) fn quad(self, to_world: DAffine3, surface: Surface) -> Self {
        self.mesh(shapes::rectangle(), to_world, surface)
    }

    pub(crate) fn sphere(self, center: DVec3, radius: f64, surface: Surface) -> Self {
        let to_world = DAffine3::from_translation(center);
        self.object(Geometry::Sphere { radius }, to_world, surface, [0.0; 3])
    }

    pub(crate) fn emissive_mesh(
        self,
        mesh: Mesh,
        to_world: DAffine3,
        surface: Surface,
        emission: f32,
    ) -> Self {
        self.object(Geometry::Mesh(Arc::new(mesh)), to_world, surface, [emission; 3])
    }

    /// Sets the emission of the last object to a texture.
    pub(crate) fn emitting(mut self, texture: Arc<Texture>) -> Self {
        if let Some(material) = self.0.materials.last_mut() {
            material.emission = Color::Texture(texture);
        }
        self
    }

    /// Adds a black emissive quad.
    pub(crate) fn emissive_quad(self, to_world: DAffine3, emission: f32) -> Self {
        self.emissive_mesh(shapes::rectangle(), to_world, Black.into(), emission)
    }

    /// Adds a black emissive sphere.
    pub(crate) fn emissive_sphere(self, center: DVec3, radius: f64, emission: f32) -> Self {
        let to_world = DAffine3::from_translation(center);
        self.object(Geometry::Sphere { radius }, to_world, Black.into(), [emission; 3])
    }

    pub(crate) fn light(mut self, kind: LightKind, to_world: DAffine3) -> Self {
        let (name, at) = (String::new(), pt_scene::Span::default());
        self.0.lights.push(Light { name, to_world, kind, at });
        self
    }

    pub(crate) fn sky(self, radiance: f32) -> Self {
        self.light(
            LightKind::Constant { radiance: [radiance; 3], portal: None },
            DAffine3::IDENTITY,
        )
    }

    pub(crate) fn seen_by(mut self, camera: Camera) -> Scene {
        self.0.cameras = vec![camera];
        self.0
    }
}

/// The cube [−1, 1]³ with its front faces inside.
pub(crate) fn inward_cube() -> Mesh {
    let mut mesh = Mesh { uvs: None, ..shapes::cube() };
    for corners in &mut mesh.triangles {
        corners.swap(1, 2);
    }
    mesh
}

/// An open box with coloured walls, lit by a square in the ceiling, an emissive sphere and the
/// environment through the open side; in it a rough metal block, a glossy block and a diffuse
/// sphere.
pub(crate) fn cornell() -> Scene {
    let white = || matte([0.7, 0.7, 0.7]);
    let wall = |b: Builder, normal: DVec3, s| b.quad(facing(-normal, normal, 1.0), s);
    let walls = [
        (DVec3::Y, white()),
        (DVec3::NEG_Y, white()),
        (DVec3::Z, white()),
        (DVec3::X, matte([0.7, 0.1, 0.1])),
        (DVec3::NEG_X, matte([0.1, 0.6, 0.2])),
    ];
    let room = walls.into_iter().fold(Builder::default(), |b, (normal, s)| wall(b, normal, s));
    let block = |x: f64, z: f64, angle: f64, height: f64| {
        DAffine3::from_translation(DVec3::new(x, height - 1.0, z))
            * DAffine3::from_rotation_y(angle)
            * DAffine3::from_scale(DVec3::new(0.28, height, 0.28))
    };
    let area = facing(DVec3::new(0.1, 0.98, -0.1), DVec3::NEG_Y, 0.3);
    room.mesh(shapes::cube(), block(-0.4, -0.3, 0.4, 0.5), metal())
        .mesh(shapes::cube(), block(0.45, 0.1, -0.3, 0.3), gloss())
        .sphere(DVec3::new(0.4, -0.1, -0.4), 0.25, white())
        .emissive_sphere(DVec3::new(-0.6, 0.4, 0.3), 0.15, 3.0)
        .emissive_quad(area, 5.0)
        .sky(0.4)
        .seen_by(camera(DVec3::new(0.0, 0.0, 3.6), DVec3::ZERO, [40.0, 40.0]))
}

/// A rough metal block, a glossy one and a diffuse ball on a floor, under an environment with a
/// small bright part and a dark half.
pub(crate) fn under_a_sky() -> Scene {
    let block = |x: f64, angle: f64| {
        DAffine3::from_translation(DVec3::new(x, 0.5, 0.0))
            * DAffine3::from_rotation_y(angle)
            * DAffine3::from_scale(DVec3::splat(0.5))
    };
    let pixels = (0..128u16).map(|i| match (i % 16, i / 16) {
        (4 | 5, 2) => [30.0, 25.0, 20.0],
        (x, _) if x >= 8 => [0.02, 0.01, 0.0],
        (x, y) => [0.05 * f32::from(x), 0.1 * f32::from(y), 0.4],
    });
    let image = Arc::new(Image { width: 16, height: 8, pixels: pixels.collect() });
    let kind = LightKind::Environment { image, scale: 0.7, rows: Rows::default(), portal: None };
    Builder::default()
        .quad(facing(DVec3::ZERO, DVec3::Y, 4.0), matte([0.5; 3]))
        .mesh(shapes::cube(), block(-0.9, 0.4), metal())
        .mesh(shapes::cube(), block(0.9, -0.3), gloss())
        .sphere(DVec3::new(0.0, 0.3, 0.9), 0.3, matte([0.7; 3]))
        .light(kind, looking(DVec3::ZERO, DVec3::new(0.3, -0.2, -1.0)))
        .seen_by(camera(DVec3::new(0.0, 1.6, 5.0), DVec3::new(0.0, 0.4, 0.0), [40.0, 40.0]))
}
