//! Meshes for the ray queries.

use anyhow::{Context, Result, bail};
use pt_bvh::Geometry;
use pt_math::{Bounds3, DVec3, Vec3, trig};

use super::{shapes, structures};
use crate::bench::rays::input::{PinholeCamera, TriangleMesh};
use crate::project::course_scene;

/// Mesh that can be selected.
pub(super) struct MeshSource {
    pub(super) name: &'static str,
    from: From,
}

enum From {
    /// File of the university course.
    File { path: &'static str, view: Option<PinholeCamera> },
    /// Generated mesh.
    Made(fn() -> TriangleMesh),
}

/// View of the opening of the course's Cornell box, filling the image.
const BOX: PinholeCamera = PinholeCamera {
    eye: Vec3::new(0.0, 0.75, -4.0),
    look: Vec3::new(0.0, 0.75, 0.0),
    fov_degrees: 30.0,
};

/// All meshes.
pub(super) const SOURCES: &[MeshSource] = &[
    file("cow", "meshedit/cow.dae", None),
    file("maxplanck", "meshedit/maxplanck.dae", None),
    file("CBbunny", "sky/CBbunny.dae", Some(BOX)),
    file("building", "keenan/building.dae", None),
    made("blob_300k", || shapes::blob(194)),
    made("blob_2m", || shapes::blob(500)),
    made("hall", || shapes::hall(0)),
    made("hall_ropes", || shapes::hall(260)),
    made("terrain", || structures::terrain(700)),
    made("boxes", || structures::boxes(20_000)),
    made("rods", || structures::rods(20_000)),
    made("playground", structures::playground),
    made("office", structures::office),
];

const fn file(name: &'static str, path: &'static str, view: Option<PinholeCamera>) -> MeshSource {
    MeshSource { name, from: From::File { path, view } }
}

const fn made(name: &'static str, make: fn() -> TriangleMesh) -> MeshSource {
    MeshSource { name, from: From::Made(make) }
}

/// Returns the meshes with these names.
///
/// # Errors
/// If a name is unknown.
pub(super) fn named(names: &[String]) -> Result<Vec<&'static MeshSource>> {
    let find = |name: &String| {
        let Some(source) = SOURCES.iter().find(|s| s.name == name) else {
            let known: Vec<_> = SOURCES.iter().map(|s| s.name).collect();
            bail!("there is no mesh {name}, but {}", known.join(", "));
        };
        Ok(source)
    };
    names.iter().map(find).collect()
}

impl MeshSource {
    /// Loads the mesh; the inner error is the path of a missing file.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub(super) fn load(&self) -> Result<Result<TriangleMesh, String>> {
        let (path, view) = match self.from {
            From::Made(make) => return Ok(Ok(make())),
            From::File { path, view } => (path, view),
        };
        let Some(found) = course_scene(path) else {
            return Ok(Err(format!("../shared/scenes/dae/{path}")));
        };
        let scene = pt_formats::load(&found).context(self.name)?;
        Ok(Ok(TriangleMesh { view, ..in_world(&scene) }))
    }
}

/// Triangles of all meshes of a scene, in world space.
fn in_world(scene: &pt_scene::Scene) -> TriangleMesh {
    let mut all = TriangleMesh::default();
    for object in &scene.objects {
        let pt_scene::Geometry::Mesh(mesh) = &object.geometry else { continue };
        let base = all.positions.len() as u32;
        let place = |p: &[f32; 3]| {
            object.to_world.transform_point3(DVec3::from(p.map(f64::from))).as_vec3()
        };
        all.positions.extend(mesh.positions.iter().map(place));
        all.triangles.extend(mesh.triangles.iter().map(|t| t.map(|i| base + i)));
    }
    all
}

impl TriangleMesh {
    pub(super) fn geometry(&self) -> Geometry<'_> {
        Geometry { positions: &self.positions, triangles: &self.triangles, spheres: &[] }
    }

    /// Vertices of a triangle.
    pub(super) fn corners(&self, triangle: usize) -> [Vec3; 3] {
        self.triangles[triangle].map(|i| self.positions[i as usize])
    }

    /// Box around all triangles.
    pub(super) fn bounds(&self) -> Bounds3 {
        self.triangles.iter().flatten().map(|&i| self.positions[i as usize]).collect()
    }

    /// Camera of the mesh. The default looks along −z and somewhat down, so that three quarters of
    /// the sphere around the bounds fill the image.
    pub(super) fn view(&self) -> PinholeCamera {
        self.view.unwrap_or_else(|| {
            let bounds = self.bounds();
            let (fov_degrees, look) = (40.0f32, bounds.center());
            let radius = bounds.diagonal().length() / 2.0;
            let (sin, _) = trig::sin_cos(fov_degrees.to_radians() / 2.0);
            let eye = look + Vec3::new(0.0, 0.25, 1.0).normalize() * (0.75 * radius / sin);
            PinholeCamera { eye, look, fov_degrees }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn meshes_are_found_by_name() {
        let names = ["hall", "cow"].map(String::from);
        let found: Vec<_> = named(&names).unwrap().iter().map(|s| s.name).collect();
        assert_eq!(found, names);
        let error = named(&["cov".into()]).err().unwrap().to_string();
        assert!(error.contains("cov") && error.contains("maxplanck"), "{error}");
    }

    #[test]
    fn transformations_of_objects_are_applied() {
        let scene = pt_formats::parse(
            b"v 1 2 3\nv 4 5 6\nv 7 8 10\nf 1 2 3\n",
            std::path::Path::new("one.obj"),
        );
        let mut scene = scene.unwrap();
        let twice = pt_math::DAffine3::from_scale(DVec3::splat(2.0));
        scene.objects[0].to_world = twice * scene.objects[0].to_world;
        let again = scene.objects[0].clone();
        scene.objects.push(again);
        let mesh = in_world(&scene);
        assert_eq!(mesh.triangles.len(), 2);
        assert_eq!(mesh.corners(1)[0], Vec3::new(2.0, 4.0, 6.0));
    }
}
