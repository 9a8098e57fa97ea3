//! Meshes: triangles with one index per corner for all attributes. [glTF 2.0, §3.7.2]

use std::collections::HashMap;
use std::sync::Arc;

use pt_math::DVec3;
use pt_scene::{Attribute, Mesh, Shared, Submesh};
use serde_json::{Value, json};

use super::GltfWriter;
use super::layer::ColorSource;
use super::material::Worn;

/// Tolerance of the length of a unit normal: the rounding error of 8-bit normals, ½ √3 / 127.
const UNIT: f32 = 6.8e-3;
/// Texture coordinates that the renderer uses for triangles without any.
const BARYCENTRIC: [[f32; 2]; 3] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];

/// Attributes of a mesh that a material requires.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Needs {
    colors: Option<ColorSource>,
    has_textures: bool,
}

/// Address of a mesh, and the first triangle and the material of each part.
pub(super) type MeshPartsKey = (usize, Vec<(u32, usize)>);

/// Primitives by the address of the mesh, the range of triangles and the required attributes.
/// Meshes are kept alive so that their addresses remain unique.
pub(super) type PrimitiveCache = HashMap<(usize, u32, u32, Needs), (Value, Arc<Mesh>)>;

/// Triangles with all attributes at their vertices.
struct WeldedPrimitive {
    positions: Shared<[f32; 3]>,
    normals: Option<Shared<[f32; 3]>>,
    uvs: Option<Shared<[f32; 2]>>,
    colors: Option<Shared<[f32; 3]>>,
    triangles: Shared<[u32; 3]>,
}

impl GltfWriter<'_> {
    /// Writes a mesh whose parts have these materials and returns its index; `None` if it has no
    /// triangles.
    ///
    /// # Errors
    /// If its arrays are inconsistent, or a position is not finite.
    pub(super) fn mesh(
        &mut self,
        mesh: &Arc<Mesh>,
        parts: &[(Submesh, Worn)],
    ) -> Result<Option<usize>, String> {
        let materials = parts.iter().map(|(part, worn)| (part.triangles.start, worn.index));
        let key = (Arc::as_ptr(mesh).addr(), materials.collect());
        if let Some(known) = self.known_meshes.get(&key) {
            return Ok(*known);
        }
        check(mesh)?;
        let mut primitives = Vec::new();
        for (part, worn) in parts.iter().filter(|(part, _)| !part.triangles.is_empty()) {
            let needs = Needs { colors: worn.colors, has_textures: worn.has_textures };
            let mut primitive = self.primitive(mesh, part, needs);
            primitive["material"] = worn.index.into();
            primitives.push(primitive);
        }
        let index = (!primitives.is_empty()).then(|| {
            let mut written = json!({"primitives": primitives});
            if !mesh.name.is_empty() {
                written["name"] = mesh.name.clone().into();
            }
            self.meshes.push(written);
            self.meshes.len() - 1
        });
        self.known_meshes.insert(key, index);
        Ok(index)
    }

    /// Writes a primitive without its material.
    fn primitive(&mut self, mesh: &Arc<Mesh>, part: &Submesh, needs: Needs) -> Value {
        let range = &part.triangles;
        let key = (Arc::as_ptr(mesh).addr(), range.start, range.end, needs);
        if let Some((known, _)) = self.primitives.get(&key) {
            return known.clone();
        }
        let WeldedPrimitive { positions, normals, uvs, colors, triangles } =
            welded(mesh, part, needs);
        let binary = &mut self.binary;
        let mut attributes = json!({"POSITION": binary.vertices(&positions, true)});
        if let Some(mut normals) = normals {
            make_unit(&mut normals, &positions, &triangles);
            attributes["NORMAL"] = binary.vertices(&normals, false).into();
        }
        if let Some(uvs) = uvs {
            let finite = |x: f32| if x.is_finite() { x } else { 0.0 };
            let upside_down: Vec<_> =
                uvs.iter().map(|[u, v]| [finite(*u), finite(1.0 - v)]).collect();
            attributes["TEXCOORD_0"] = binary.vertices(&upside_down, false).into();
        }
        if let Some(mut colors) = colors {
            for color in colors.as_flattened_mut() {
                *color = if color.is_nan() { 0.0 } else { color.clamp(0.0, 1.0) };
            }
            attributes["COLOR_0"] = binary.vertices(&colors, false).into();
        }
        let indices = binary.indices(triangles.as_flattened(), positions.len());
        let primitive = json!({"attributes": attributes, "indices": indices});
        self.primitives.insert(key, (primitive.clone(), Arc::clone(mesh)));
        primitive
    }
}

/// Checks that the arrays of a mesh are consistent and that its positions are finite.
fn check(mesh: &Mesh) -> Result<(), String> {
    fn fits<T>(attribute: Option<&Attribute<T>>, mesh: &Mesh) -> bool {
        attribute.is_none_or(|attribute| {
            let indices = attribute.indices.as_ref().unwrap_or(&mesh.triangles);
            indices.len() == mesh.triangles.len()
                && indices.as_flattened().iter().all(|i| (*i as usize) < attribute.values.len())
        })
    }
    let count = mesh.triangles.len();
    let is_whole =
        mesh.triangles.as_flattened().iter().all(|i| (*i as usize) < mesh.positions.len())
            && mesh.submeshes.iter().all(|part| part.triangles.end as usize <= count)
            && fits(mesh.normals.as_ref(), mesh)
            && fits(mesh.uvs.as_ref(), mesh)
            && fits(mesh.colors.as_ref(), mesh)
            && mesh.face_colors.as_ref().is_none_or(|colors| colors.len() == count);
    if !is_whole {
        return Err("found a mesh with indices out of range".to_owned());
    }
    if !mesh.positions.as_flattened().iter().all(|x| x.is_finite()) {
        return Err("found a mesh with a position that is not finite".to_owned());
    }
    Ok(())
}

/// Returns the triangles of a part with one index per corner. Vertices are unchanged if all
/// attributes are indexed like the positions.
fn welded(mesh: &Mesh, part: &Submesh, needs: Needs) -> WeldedPrimitive {
    fn own<T>(attribute: Option<&Attribute<T>>) -> bool {
        attribute.is_some_and(|attribute| attribute.indices.is_some())
    }
    let colors = mesh.colors.as_ref().filter(|_| needs.colors == Some(ColorSource::Vertices));
    let face_colors =
        mesh.face_colors.as_ref().filter(|_| needs.colors == Some(ColorSource::Faces));
    let lacks_uvs = mesh.uvs.is_none() && needs.has_textures;
    let is_whole = part.triangles.len() == mesh.triangles.len();
    let is_split = own(mesh.normals.as_ref()) || own(mesh.uvs.as_ref()) || own(colors);
    if is_whole && !is_split && !lacks_uvs && face_colors.is_none() {
        let values = |attribute: &Attribute<[f32; 3]>| attribute.values.clone();
        return WeldedPrimitive {
            positions: mesh.positions.clone(),
            normals: mesh.normals.as_ref().map(values),
            uvs: mesh.uvs.as_ref().map(|uvs| uvs.values.clone()),
            colors: colors.map(values),
            triangles: mesh.triangles.clone(),
        };
    }
    let mut made = WeldedPrimitive {
        positions: Shared::default(),
        normals: mesh.normals.as_ref().map(|_| Shared::default()),
        uvs: (mesh.uvs.is_some() || lacks_uvs).then(Shared::default),
        colors: (colors.is_some() || face_colors.is_some()).then(Shared::default),
        triangles: Shared::default(),
    };
    let mut known = HashMap::new();
    for i in part.triangles.start as usize..part.triangles.end as usize {
        let at = mesh.triangles[i];
        let normals = mesh.normals.as_ref().map(|normals| normals.corners(i, at));
        let uvs = mesh.uvs.as_ref().map(|uvs| uvs.corners(i, at));
        let tints = colors.map(|colors| colors.corners(i, at));
        let mut vertex = |c: usize| {
            let uv = uvs.map_or(c as u32, |uvs| uvs[c]);
            let tint = tints.map_or(if face_colors.is_some() { i as u32 } else { 0 }, |t| t[c]);
            let key = (at[c], normals.map(|normals| normals[c]), uv, tint);
            let has_uv = uvs.is_some() || lacks_uvs;
            let key = if has_uv { key } else { (key.0, key.1, 0, key.3) };
            *known.entry(key).or_insert_with(|| {
                made.positions.push(mesh.positions[at[c] as usize]);
                if let (Some(all), Some(source), Some(n)) =
                    (&mut made.normals, &mesh.normals, key.1)
                {
                    all.push(source.values[n as usize]);
                }
                if let Some(all) = &mut made.uvs {
                    all.push(mesh.uvs.as_ref().map_or(BARYCENTRIC[c], |t| t.values[uv as usize]));
                }
                if let Some(all) = &mut made.colors {
                    let of_faces = face_colors.map(|colors| colors[i]);
                    all.extend(of_faces.or(colors.map(|colors| colors.values[tint as usize])));
                }
                made.positions.len() as u32 - 1
            })
        };
        let corners = [vertex(0), vertex(1), vertex(2)];
        made.triangles.push(corners);
    }
    made
}

/// Normalizes normals that are not of unit length. A normal without direction becomes the
/// area-weighted mean of the normals of the adjacent triangles.
fn make_unit(normals: &mut [[f32; 3]], positions: &[[f32; 3]], triangles: &[[u32; 3]]) {
    let wide = |v: [f32; 3]| DVec3::from_array(v.map(f64::from));
    let is_unit = |n: &[f32; 3]| (wide(*n).length() as f32 - 1.0).abs() <= UNIT;
    if normals.iter().all(is_unit) {
        return;
    }
    let mut around = vec![DVec3::ZERO; positions.len()];
    for triangle in triangles {
        let [a, b, c] = triangle.map(|i| wide(positions[i as usize]));
        for i in triangle {
            around[*i as usize] += (b - a).cross(c - a);
        }
    }
    for (normal, around) in normals.iter_mut().zip(around).filter(|(n, _)| !is_unit(n)) {
        let direction = wide(*normal).try_normalize().or(around.try_normalize());
        *normal = direction.unwrap_or(DVec3::Y).as_vec3().to_array();
    }
}

/// Returns true if some triangle of a part has mirrored texture coordinates.
pub(super) fn is_mirrored_somewhere(mesh: &Mesh, part: &Submesh) -> bool {
    let Some(uvs) = &mesh.uvs else { return false };
    part.triangles.clone().any(|i| {
        let corners = uvs.corners(i as usize, mesh.triangles[i as usize]);
        let [a, b, c] = corners.map(|corner| uvs.values[corner as usize].map(f64::from));
        (b[0] - a[0]) * (c[1] - a[1]) < (b[1] - a[1]) * (c[0] - a[0])
    })
}

#[cfg(test)]
mod tests {
    use pt_scene::shapes;

    use super::*;

    const PLAIN: Needs = Needs { colors: None, has_textures: false };

    fn whole(mesh: &Mesh) -> Submesh {
        Submesh { triangles: 0..mesh.triangles.len() as u32, slot: 0 }
    }

    #[test]
    fn corners_that_differ_become_vertices_of_their_own() {
        let mesh = Mesh { normals: None, ..shapes::cube() };
        let uvs = mesh.uvs.as_ref().expect("a cube has them");
        let made = welded(&mesh, &whole(&mesh), PLAIN);
        let found = made.uvs.as_ref().expect("a cube has them");
        let mut distinct = std::collections::HashSet::new();
        for (i, (triangle, original)) in made.triangles.iter().zip(&mesh.triangles).enumerate() {
            let corners = uvs.corners(i, *original);
            for c in 0..3 {
                let vertex = triangle[c] as usize;
                assert_eq!(made.positions[vertex], mesh.positions[original[c] as usize]);
                assert_eq!(found[vertex], uvs.values[corners[c] as usize]);
                distinct.insert((original[c], corners[c]));
            }
        }
        assert_eq!((made.positions.len(), made.triangles.len()), (distinct.len(), 12));
    }

    #[test]
    fn a_part_takes_the_vertices_that_it_has() {
        let mesh = Mesh { uvs: None, normals: None, ..shapes::cube() };
        let part = Submesh { triangles: 0..2, slot: 0 };
        assert_eq!(welded(&mesh, &part, PLAIN).positions.len(), 4);
        assert_eq!(welded(&mesh, &whole(&mesh), PLAIN).positions, mesh.positions);
        let painted = welded(&mesh, &part, Needs { has_textures: true, ..PLAIN });
        let uvs = painted.uvs.expect("textures ask for them");
        for triangle in painted.triangles {
            assert_eq!(triangle.map(|i| uvs[i as usize]), BARYCENTRIC);
        }
    }

    #[test]
    fn colours_of_faces_stand_at_their_corners() {
        let colors: Vec<_> = (0..12).map(|i| [i as f32 / 12.0; 3]).collect();
        let mesh = Mesh {
            uvs: None,
            normals: None,
            face_colors: Some(colors.clone().into()),
            ..shapes::cube()
        };
        let needs = Needs { colors: Some(ColorSource::Faces), has_textures: false };
        let made = welded(&mesh, &whole(&mesh), needs);
        let shown = made.colors.expect("they are asked for");
        for (triangle, color) in made.triangles.iter().zip(colors) {
            assert!(triangle.iter().all(|i| shown[*i as usize] == color));
        }
    }

    #[test]
    fn normals_become_unit_ones_and_those_without_a_direction_that_of_the_surface() {
        let positions = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let mut normals = [[0.0, 3.0, 0.0], [0.0; 3], [0.6, 0.8, 0.0]];
        make_unit(&mut normals, &positions, &[[0, 1, 2]]);
        assert_eq!(normals, [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.6, 0.8, 0.0]]);
    }
}
