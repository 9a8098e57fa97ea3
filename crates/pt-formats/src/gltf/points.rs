//! Primitives of points and lines. [glTF 2.0, §3.7.2.1]

use std::sync::Arc;

use pt_scene::{Geometry, Object, Points};

use super::item::Item;
use super::material::MeshAttributes;
use super::mesh::{Form, check_finite};
use super::{GltfReader, deform};
use crate::LoadError;

/// Modes of primitives: points, line lists, line loops and line strips.
const POINTS: usize = 0;
const LINES: usize = 1;
const LINE_LOOP: usize = 2;
const LINE_STRIP: usize = 3;

impl<'a> GltfReader<'a> {
    /// Returns true if a primitive consists of points or lines.
    pub(super) fn is_of_points(primitive: &Item<'a>) -> Result<bool, LoadError> {
        Ok(primitive.whole("mode")?.is_some_and(|mode| mode <= LINE_STRIP))
    }

    /// Creates the object of a primitive of points or lines, without a transform; returns `None`
    /// and reports a warning if it has no points. The points are cached under `key` for all nodes
    /// that share them.
    pub(super) fn object_of_points(
        &mut self,
        node: &Item<'a>,
        (mesh, primitive): (&Item<'a>, &Item<'a>),
        key: Option<(usize, usize)>,
        form: &Form<'_>,
    ) -> Result<Option<Object>, LoadError> {
        let known = key.and_then(|key| self.points.get(&key).cloned());
        let points = if let Some(known) = known {
            known
        } else {
            let made = self.points(primitive, &mesh.name(), form)?.map(Arc::new);
            self.points.extend(key.map(|key| (key, made.clone())));
            made
        };
        let Some(points) = points else { return Ok(None) };
        let index = primitive.whole("material")?;
        let described = index
            .map(|index| self.root.member("materials", index, primitive, "material"))
            .transpose()?;
        let values =
            MeshAttributes { colors: points.colors.is_some(), tangents: false, opacities: false };
        let layout = Self::layout(described.as_ref())?;
        let made = if layout.uv_set.is_none() {
            self.material(index, described.as_ref(), values)?
        } else {
            self.warn(
                primitive,
                "the textures and the colour of the material are ignored for points and lines",
            );
            self.material(None, None, values)?
        };
        Ok(Some(Object {
            name: node.name(),
            to_world: pt_math::DAffine3::IDENTITY,
            motion: None,
            materials: vec![Some(made.material)],
            geometry: Geometry::Points { points, radius: None },
            media: None,
            at: node.span(),
        }))
    }

    fn points(
        &mut self,
        primitive: &Item<'a>,
        name: &str,
        form: &Form<'_>,
    ) -> Result<Option<Points>, LoadError> {
        let Some((attributes, mut positions)) = self.vertices(primitive)? else { return Ok(None) };
        let vertices = positions.len();
        let indices = self.indices(primitive, vertices)?;
        self.morph(primitive, form.weights, &mut positions, (None, None))?;
        if let Some(joints) = form.joints {
            let influences = self.influences(&attributes, vertices, joints.len())?;
            deform::bend(&influences, joints, &mut positions, None, None);
        }
        check_finite(primitive, &positions)?;
        let colored = self.colors(&attributes, vertices);
        let colored = self.context.forgive(colored, "primitive without colours of vertices")?;
        let colored = colored.unwrap_or_default();
        if colored.opacities.is_some() {
            self.warn(&attributes, "the opacity of COLOR_0 is ignored for points and lines");
        }
        let mut colors = colored.colors;
        let mode = primitive.whole("mode")?.unwrap_or(POINTS);
        let segments = if mode == POINTS {
            if let Some(indices) = indices {
                let pick = |all: &[[f32; 3]]| indices.iter().map(|i| all[*i as usize]).collect();
                colors = colors.as_deref().map(pick);
                positions = pick(&positions);
            }
            Vec::new()
        } else {
            segments(mode, &indices.unwrap_or_else(|| (0..vertices as u32).collect()))
        };
        if positions.is_empty() || mode != POINTS && segments.is_empty() {
            self.warn(primitive, "primitive without points; it is omitted");
            return Ok(None);
        }
        Ok(Some(Points { name: name.to_owned(), positions, colors, segments }))
    }
}

/// Returns the segments between vertices; an incomplete segment is ignored.
fn segments(mode: usize, ends: &[u32]) -> Vec<[u32; 2]> {
    let strip = || ends.windows(2).map(|pair| [pair[0], pair[1]]);
    match mode {
        LINES => ends.as_chunks().0.to_vec(),
        LINE_LOOP => {
            strip().chain(Option::zip(ends.last(), ends.first()).map(|(a, b)| [*a, *b])).collect()
        }
        _ => strip().collect(),
    }
}
