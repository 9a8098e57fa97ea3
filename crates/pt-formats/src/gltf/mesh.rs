//! Primitives: triangles with attributes. [glTF 2.0, §3.7.2]

use std::sync::Arc;

use bytemuck::allocation::try_cast_vec;
use glam::DVec2;
use pt_math::{DAffine3, DVec3};
use pt_scene::{Attribute, Attributes, Mesh, Submesh};

use super::accessor::all_parts;
use super::item::Item;
use super::material::{MaterialLayout, MeshAttributes};
use super::{GltfReader, compressed, deform};
use crate::LoadError;

/// Modes of primitives of triangles: list, strip and fan.
const TRIANGLES: [usize; 3] = [4, 5, 6];

/// Deformation and texture mapping of a mesh at a node.
#[derive(Clone)]
pub(super) struct Form<'f> {
    /// Weights of the morph targets.
    pub(super) weights: &'f [f64],
    /// Joint transforms, if the node has a skin.
    pub(super) joints: Option<&'f [DAffine3]>,
    /// Texture coordinates that the material uses.
    pub(super) layout: MaterialLayout,
    /// True if the transform of some instance mirrors the mesh.
    pub(super) is_mirrored: bool,
}

/// Attributes and positions of a primitive.
type PrimitiveVertices<'a> = (Item<'a>, Vec<[f32; 3]>);

/// Colours and opacities of vertices.
#[derive(Default)]
pub(super) struct Colored {
    /// Linear colours.
    pub(super) colors: Option<Vec<[f32; 3]>>,
    /// Opacities, repeated in three channels; `None` if all are 1.
    pub(super) opacities: Option<Vec<[f32; 3]>>,
}

impl<'a> GltfReader<'a> {
    /// Reads the triangles of a primitive; returns `None` and reports a warning if it has none.
    pub(super) fn primitive(
        &mut self,
        primitive: &Item<'a>,
        name: &str,
        form: &Form<'_>,
    ) -> Result<Option<Arc<Mesh>>, LoadError> {
        if primitive.extension(compressed::DRACO)?.is_some() {
            // The compressed data could not be decoded.
            return Err(LoadError::AlreadyReported);
        }
        let mode = primitive.whole("mode")?.unwrap_or(4);
        if !TRIANGLES.contains(&mode) {
            let message = format!("found mode {mode}, expected 0 to 6");
            return Err(primitive.refuse("mode", message));
        }
        let Some((attributes, mut positions)) = self.vertices(primitive)? else { return Ok(None) };
        let vertices = positions.len();
        let corners = self.indices(primitive, vertices)?;
        let mut triangles =
            triangles(mode, corners.unwrap_or_else(|| (0..vertices as u32).collect()));
        if triangles.is_empty() {
            self.warn(primitive, "primitive without triangles; it is omitted");
            return Ok(None);
        }
        let normals = self.attribute::<3>(&attributes, "NORMAL", vertices);
        let mut normals = self.context.forgive(normals, "the primitive is shaded flat")?.flatten();
        let mut tangents = if form.layout.has_frame {
            let tangents = self.attribute::<4>(&attributes, "TANGENT", vertices);
            self.context
                .forgive(tangents, "tangents are computed from the texture coordinates")?
                .flatten()
        } else {
            None
        };
        let frame = (normals.as_mut(), tangents.as_mut());
        self.morph(primitive, form.weights, &mut positions, frame)?;
        if let Some(joints) = form.joints {
            let influences = self.influences(&attributes, vertices, joints.len())?;
            let (normals, tangents) = (normals.as_mut(), tangents.as_mut());
            deform::bend(&influences, joints, &mut positions, normals, tangents);
        }
        check_finite(primitive, &positions)?;
        let uvs = self.coordinates(primitive, &attributes, &form.layout, vertices)?;
        let mut named = Attributes::default();
        for set in &form.layout.other_sets {
            let uvs = self.set_of_coordinates(primitive, &attributes, *set, vertices)?;
            let values = uvs.into_iter().map(|[u, v]| [u, v, 0.0]).collect();
            named.vertices.insert(pt_scene::texture::TextureMapping::set_name(*set), values);
        }
        let mirrored = match &uvs {
            Some(uvs) if form.layout.has_frame => match &tangents {
                Some(tangents) => {
                    let mirrored = last(&mut triangles, |corners| {
                        corners.map(|c| tangents[c as usize][3]).iter().sum::<f32>() < 0.0
                    });
                    let along = along_tangents(&triangles, (&positions, uvs), tangents);
                    named.faces.insert(MeshAttributes::TANGENTS.into(), along.into());
                    mirrored
                }
                None => last(&mut triangles, |corners| lies_mirrored(uvs, corners)),
            },
            _ => 0,
        };
        let colored = self.colors(&attributes, vertices);
        let colored = self.context.forgive(colored, "primitive without colours of vertices")?;
        let Colored { colors, opacities } = colored.unwrap_or_default();
        if opacities.is_some() && form.layout.is_masked {
            self.warn(&attributes, "the opacity of COLOR_0 is ignored where alphaMode is MASK");
        }
        if let Some(opacities) = opacities.filter(|_| form.layout.is_blended) {
            named.vertices.insert(MeshAttributes::OPACITIES.into(), opacities.into());
        }
        let mesh = Mesh {
            name: name.to_owned(),
            submeshes: parts(triangles.len(), mirrored),
            triangles: triangles.into(),
            positions: positions.into(),
            normals: normals.map(at_vertices),
            uvs: uvs.map(at_vertices),
            colors: colors.map(at_vertices),
            face_colors: None,
            attributes: named,
        };
        Ok(Some(Arc::new(mesh)))
    }

    /// Reads the attributes and positions of a primitive; returns `None` and reports a warning if
    /// it has no positions.
    pub(super) fn vertices(
        &mut self,
        primitive: &Item<'a>,
    ) -> Result<Option<PrimitiveVertices<'a>>, LoadError> {
        let Some(attributes) = primitive.child("attributes")? else {
            return Err(primitive.error("missing \"attributes\""));
        };
        let Some(positions) = self.accessors.vectors::<3>(&attributes, "POSITION")? else {
            self.warn(primitive, "missing POSITION; the primitive is omitted");
            return Ok(None);
        };
        Ok(Some((attributes, positions)))
    }

    /// Reads the indices of a primitive and checks that their vertices exist; `None` if it has
    /// none.
    pub(super) fn indices(
        &mut self,
        primitive: &Item<'a>,
        vertices: usize,
    ) -> Result<Option<Vec<u32>>, LoadError> {
        let Some(indices) = self.accessors.wholes::<1>(primitive, "indices")? else {
            return Ok(None);
        };
        let indices = indices.into_flattened();
        let greatest = |part: &[u32]| part.iter().copied().max();
        let exist = |part: &[u32]| greatest(part).is_none_or(|most| (most as usize) < vertices);
        if !all_parts(&indices, exist) {
            let bad = greatest(&indices).unwrap_or_default();
            let message =
                format!("found index {bad}, expected an index of the {vertices} vertices");
            return Err(primitive.refuse("indices", message));
        }
        Ok(Some(indices))
    }

    /// Reads a vertex attribute of a primitive.
    pub(super) fn attribute<const N: usize>(
        &mut self,
        attributes: &Item<'_>,
        name: &str,
        vertices: usize,
    ) -> Result<Option<Vec<[f32; N]>>, LoadError> {
        let values = self.accessors.vectors::<N>(attributes, name)?;
        values.map(|values| as_many(values, attributes, name, vertices)).transpose()
    }

    /// Reads texture coordinates. In glTF v increases downwards, here upwards.
    fn coordinates(
        &mut self,
        primitive: &Item<'a>,
        attributes: &Item<'_>,
        layout: &MaterialLayout,
        vertices: usize,
    ) -> Result<Option<Vec<[f32; 2]>>, LoadError> {
        let name = format!("TEXCOORD_{}", layout.uv_set.unwrap_or(0));
        let uvs = self.attribute::<2>(attributes, &name, vertices);
        let uvs = self.context.forgive(uvs, "texture coordinates are ignored")?.flatten();
        if uvs.is_none() && layout.uv_set.is_some() {
            let message =
                format!("missing {name} for the textures; each triangle shows the whole texture");
            self.warn(primitive, message);
        }
        Ok(uvs.map(|uvs| uvs.into_iter().map(|[u, v]| [u, 1.0 - v]).collect()))
    }

    /// Reads an additional texture coordinate set. If it is missing, a warning is reported and all
    /// coordinates are 0, so that the textures show a single texel.
    fn set_of_coordinates(
        &mut self,
        primitive: &Item<'a>,
        attributes: &Item<'_>,
        set: u32,
        vertices: usize,
    ) -> Result<Vec<[f32; 2]>, LoadError> {
        let name = format!("TEXCOORD_{set}");
        let uvs = self.attribute::<2>(attributes, &name, vertices);
        let Some(uvs) = self.context.forgive(uvs, "texture coordinates are ignored")?.flatten()
        else {
            let message = format!("missing {name} for some textures; one texel of each is shown");
            self.warn(primitive, message);
            return Ok(vec![[0.0; 2]; vertices]);
        };
        Ok(uvs.into_iter().map(|[u, v]| [u, 1.0 - v]).collect())
    }

    /// Reads the vertex colours of a primitive.
    pub(super) fn colors(
        &mut self,
        attributes: &Item<'_>,
        vertices: usize,
    ) -> Result<Colored, LoadError> {
        let Some(numbers) = self.accessors.numbers(attributes, "COLOR_0", &[3, 4])? else {
            return Ok(Colored::default());
        };
        if let Some(highest) = numbers.highest {
            let message = format!(
                "found integers of COLOR_0 that are not \"normalized\", expected normalized ones; \
                 the value {highest} is read as 1"
            );
            self.warn(attributes, message);
        }
        let share = |number: f64| (number / numbers.highest.unwrap_or(1.0)).clamp(0.0, 1.0);
        let colors: Vec<[f32; 3]> = numbers
            .values
            .chunks_exact(numbers.width)
            .map(|color| std::array::from_fn(|c| share(color[c]) as f32))
            .collect();
        let opacities: Vec<[f32; 3]> = if numbers.width == 4 {
            numbers.values.iter().skip(3).step_by(4).map(|a| [share(*a) as f32; 3]).collect()
        } else {
            Vec::new()
        };
        let opacities = opacities.iter().any(|[a, ..]| *a < 1.0).then_some(opacities);
        let colors = Some(as_many(colors, attributes, "COLOR_0", vertices)?);
        Ok(Colored { colors, opacities })
    }

    /// Adds morph targets, multiplied by their weights. [glTF 2.0, §3.7.2.2]
    pub(super) fn morph(
        &mut self,
        primitive: &Item<'a>,
        weights: &[f64],
        positions: &mut [[f32; 3]],
        (mut normals, mut tangents): Frames<'_>,
    ) -> Result<(), LoadError> {
        let count = primitive.count("targets")?;
        for (i, weight) in weights.iter().enumerate().take(count).filter(|(_, w)| **w != 0.0) {
            let target = &primitive.member("targets", i, primitive, "targets")?;
            let count = positions.len();
            if let Some(moved) = self.attribute::<3>(target, "POSITION", count)? {
                add(positions, &moved, *weight);
            }
            if let Some(normals) = &mut normals
                && let Some(turned) = self.attribute::<3>(target, "NORMAL", count)?
            {
                add(normals, &turned, *weight);
            }
            // The handedness, the fourth component, is not morphed.
            if let Some(tangents) = &mut tangents
                && let Some(turned) = self.attribute::<3>(target, "TANGENT", count)?
            {
                add(tangents, &turned, *weight);
            }
        }
        Ok(())
    }

    /// Returns the joints of each vertex with their weights, up to eight. [glTF 2.0, §3.7.3.3]
    pub(super) fn influences(
        &mut self,
        attributes: &Item<'_>,
        vertices: usize,
        joints: usize,
    ) -> Result<Vec<Vec<(u32, f32)>>, LoadError> {
        let mut influences = vec![Vec::new(); vertices];
        for set in 0..2 {
            let (by, weights) = (format!("JOINTS_{set}"), format!("WEIGHTS_{set}"));
            let Some(numbers) = self.accessors.wholes::<4>(attributes, &by)? else { break };
            let numbers = as_many(numbers, attributes, &by, vertices)?;
            let Some(weights) = self.attribute::<4>(attributes, &weights, vertices)? else {
                return Err(
                    attributes.error(format!("found {by} without {weights}, expected both"))
                );
            };
            for (influences, (numbers, weights)) in
                influences.iter_mut().zip(numbers.into_iter().zip(weights))
            {
                for (joint, weight) in numbers.into_iter().zip(weights).filter(|(_, w)| *w != 0.0) {
                    if joint as usize >= joints {
                        let message = format!(
                            "found joint {joint}, expected a joint of the skin, which has {joints}"
                        );
                        return Err(attributes.refuse(&by, message));
                    }
                    influences.push((joint, weight));
                }
            }
        }
        Ok(influences)
    }
}

/// Checks that positions are finite in single precision.
pub(super) fn check_finite(primitive: &Item<'_>, positions: &[[f32; 3]]) -> Result<(), LoadError> {
    let are_finite = |part: &[[f32; 3]]| part.as_flattened().iter().all(|x| x.is_finite());
    if all_parts(positions, are_finite) {
        return Ok(());
    }
    Err(primitive.error("found vertices beyond the range of single precision"))
}

/// Optional normals and tangents of vertices.
type Frames<'m> = (Option<&'m mut Vec<[f32; 3]>>, Option<&'m mut Vec<[f32; 4]>>);

/// Moves the triangles for which `is_last` holds to the end and returns their number.
fn last(triangles: &mut [[u32; 3]], is_last: impl Fn(&[u32; 3]) -> bool) -> usize {
    triangles.sort_by_key(&is_last);
    triangles.len() - triangles.partition_point(|triangle| !is_last(triangle))
}

/// Returns true if the texture coordinates of a triangle are mirrored.
fn lies_mirrored(uvs: &[[f32; 2]], triangle: &[u32; 3]) -> bool {
    let [a, b, c] = triangle.map(|corner| DVec2::from_array(uvs[corner as usize].map(f64::from)));
    (b - a).perp_dot(c - a) < 0.0
}

/// Returns the mean tangent of each triangle as a ∂p/∂u + b ∂p/∂v in the plane of the triangle: (a,
/// b, 0). It is u if the coordinates of the triangle are collinear, or if its tangents cancel.
fn along_tangents(
    triangles: &[[u32; 3]],
    (positions, uvs): (&[[f32; 3]], &[[f32; 2]]),
    tangents: &[[f32; 4]],
) -> Vec<[f32; 3]> {
    let of = |corners: &[u32; 3]| {
        let [p0, p1, p2] = corners.map(|c| DVec3::from(positions[c as usize].map(f64::from)));
        let [c0, c1, c2] = corners.map(|c| DVec2::from(uvs[c as usize].map(f64::from)));
        let (e1, e2, d1, d2) = (p1 - p0, p2 - p0, c1 - c0, c2 - c0);
        let determinant = d1.perp_dot(d2);
        let (u, v) = ((e1 * d2.y - e2 * d1.y) / determinant, (e2 * d1.x - e1 * d2.x) / determinant);
        let mean: DVec3 = corners
            .iter()
            .map(|c| {
                let [x, y, z, _] = tangents[*c as usize];
                DVec3::new(x.into(), y.into(), z.into())
            })
            .sum();
        // Least squares: [u·u u·v; u·v v·v] (a b) = (t·u t·v).
        let (uu, uv, vv) = (u.dot(u), u.dot(v), v.dot(v));
        let (tu, tv) = (mean.dot(u), mean.dot(v));
        let along = DVec2::new(tu * vv - tv * uv, tv * uu - tu * uv) / (uu * vv - uv * uv);
        // Normalized, so that no precision is lost.
        let along = along.try_normalize().unwrap_or(DVec2::X).as_vec2();
        [along.x, along.y, 0.0]
    };
    triangles.iter().map(of).collect()
}

/// Divides the triangles into submeshes: the last ones have mirrored texture coordinates and the
/// second material.
fn parts(triangles: usize, mirrored: usize) -> Vec<Submesh> {
    let (first, all) = ((triangles - mirrored) as u32, triangles as u32);
    let parts =
        [Submesh { triangles: 0..first, slot: 0 }, Submesh { triangles: first..all, slot: 1 }];
    parts.into_iter().filter(|part| !part.triangles.is_empty()).collect()
}

/// Checks that there is one value per vertex.
fn as_many<T>(
    values: Vec<T>,
    attributes: &Item<'_>,
    name: &str,
    vertices: usize,
) -> Result<Vec<T>, LoadError> {
    if values.len() == vertices {
        return Ok(values);
    }
    let message =
        format!("found {} elements, expected {vertices}, one for each vertex", values.len());
    Err(attributes.refuse(name, message))
}

/// Creates an attribute that is indexed like the positions.
fn at_vertices<T>(values: Vec<T>) -> Attribute<T> {
    Attribute { values: values.into(), indices: None }
}

fn add<const N: usize>(values: &mut [[f32; N]], more: &[[f32; 3]], weight: f64) {
    for (value, more) in values.iter_mut().zip(more) {
        for (number, more) in value.iter_mut().zip(more) {
            *number = (f64::from(*number) + weight * f64::from(*more)) as f32;
        }
    }
}

/// Returns the vertex indices of triangles; incomplete triangles are ignored. [glTF 2.0, §3.7.2.1]
fn triangles(mode: usize, mut corners: Vec<u32>) -> Vec<[u32; 3]> {
    match mode {
        4 => {
            corners.truncate(corners.len() / 3 * 3);
            // Large lists are converted in place, as there may be no memory for a copy.
            try_cast_vec(corners).unwrap_or_else(|(_, corners)| corners.as_chunks().0.to_vec())
        }
        5 => corners
            .windows(3)
            .enumerate()
            .map(|(i, t)| if i % 2 == 0 { [t[0], t[1], t[2]] } else { [t[0], t[2], t[1]] })
            .collect(),
        _ => {
            let Some((&first, others)) = corners.split_first() else { return Vec::new() };
            others.windows(2).map(|pair| [pair[0], pair[1], first]).collect()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_and_fans_run_around_the_same_way() {
        let corners = || vec![0, 1, 2, 3, 4];
        assert_eq!(triangles(4, corners()), [[0, 1, 2]]);
        assert_eq!(triangles(4, vec![0, 1, 2, 3, 4, 5]), [[0, 1, 2], [3, 4, 5]]);
        assert_eq!(triangles(5, corners()), [[0, 1, 2], [1, 3, 2], [2, 3, 4]]);
        assert_eq!(triangles(6, corners()), [[1, 2, 0], [2, 3, 0], [3, 4, 0]]);
        assert!([4, 5, 6].iter().all(|mode| triangles(*mode, vec![0, 1]).is_empty()));
    }
}
