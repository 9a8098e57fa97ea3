//! Primitives of a mesh: triangles, strips, fans and polygons.

use std::ops::Range;

use pt_math::DVec3;

use super::reader::{ColladaReader, child, elements};
use super::shape::{MISSING, MeshBuilder, Sets};
use super::source::{NonFinite, inputs, whole_number};
use crate::LoadError;
use crate::collada::pool::Pool;
use crate::shared::triangulate::Triangulator;
use crate::shared::xml::{XmlNode, words};

/// Adds the triangles of a primitive element to a mesh, with the set of texture coordinates of its
/// material.
pub(super) fn read<'a>(
    reader: &mut ColladaReader<'a>,
    builder: &mut MeshBuilder<'a>,
    primitive: XmlNode<'a>,
    sets: &Sets<'a>,
) -> Result<(), LoadError> {
    let lists = index_lists(reader, primitive);
    if lists.is_empty() {
        if whole_number(reader, primitive, "count")?.unwrap_or(0) > 0 {
            reader.warn(primitive, "missing <p>; the primitive is omitted");
        }
        return Ok(());
    }
    let set = primitive.attribute("material").and_then(|symbol| sets.get(symbol)).copied();
    let lanes = IndexLanes::of(reader, builder, primitive, set)?;
    let mut faces =
        FaceBuilder { builder, lanes: &lanes, cutter: Triangulator::default(), lost: [0; 2] };
    let mut count = 0;
    for p in lists {
        let list = lanes.indices(reader, p)?;
        let corners = list.len() / lanes.stride;
        count += match primitive.tag_name().name() {
            "triangles" => faces.triangles(reader, p, &list, corners)?,
            "tristrips" => faces.strip(&list, corners),
            "trifans" => faces.fan(&list, corners),
            "polygons" => faces.polygon(&list, 0..corners),
            _ => {
                let sizes = polygon_sizes(reader, primitive, p, corners)?;
                faces.polygons(&list, &sizes)
            }
        };
    }
    let [small, large] = faces.lost;
    builder.close_part(primitive.attribute("material"));
    if small > 0 {
        let message = format!("faces with fewer than three corners are omitted: {small}");
        reader.warn(primitive, message);
    }
    if large > 0 {
        let message = format!(
            "concave polygons with too many corners are triangulated as if convex: {large}"
        );
        reader.warn(primitive, message);
    }
    check_count(reader, primitive, count)
}

/// Returns the `<p>` elements of a primitive. Those of polygons may be in a `<ph>`, beside holes.
fn index_lists<'a>(reader: &mut ColladaReader<'a>, primitive: XmlNode<'a>) -> Vec<XmlNode<'a>> {
    let mut lists = Vec::new();
    for element in elements(primitive) {
        match element.tag_name().name() {
            "p" => lists.push(element),
            "ph" => {
                lists.extend(child(element, "p"));
                if child(element, "h").is_some() {
                    reader.warn(element, "holes in polygons are not supported; they are filled");
                }
            }
            _ => {}
        }
    }
    if primitive.tag_name().name() == "polylist" {
        lists.truncate(1); // there is one <vcount>, so there is one <p>
    }
    lists
}

/// Returns the numbers of corners of the polygons of a `<polylist>`.
fn polygon_sizes(
    reader: &ColladaReader<'_>,
    primitive: XmlNode<'_>,
    p: XmlNode<'_>,
    corners: usize,
) -> Result<Vec<u32>, LoadError> {
    let Some(vcount) = child(primitive, "vcount") else {
        let message = "missing <vcount> with the number of corners of each polygon";
        return Err(reader.error(primitive, message));
    };
    let sizes = reader.document.numbers::<u32>(vcount)?;
    let sum: u64 = sizes.iter().map(|n| u64::from(*n)).sum();
    if sum == corners as u64 {
        return Ok(sizes);
    }
    let message =
        format!("found indices of {corners} corners, expected {sum}, the sum of <vcount>");
    Err(reader.error(p, message))
}

/// Warns if a `count` differs from the actual number.
fn check_count<'a>(
    reader: &mut ColladaReader<'a>,
    primitive: XmlNode<'a>,
    found: usize,
) -> Result<(), LoadError> {
    if let Some(count) = whole_number(reader, primitive, "count")?
        && count != found
    {
        let message = format!(
            "found {found} primitives, expected count=\"{count}\"; the former number is used"
        );
        reader.warn(primitive, message);
    }
    Ok(())
}

/// Number of indices per corner, and their meanings.
struct IndexLanes {
    stride: usize,
    position: Lane,
    normal: Option<Lane>,
    uv: Option<Lane>,
}

/// Position of an index in a corner, and the range of the pool to which it refers.
struct Lane {
    offset: usize,
    values: Range<u32>,
}

/// An `<input>`, with its offset and set in the primitive.
struct PrimitiveInput<'a> {
    node: XmlNode<'a>,
    semantic: &'a str,
    offset: usize,
    set: usize,
}

/// Returns the inputs of a primitive followed by those of its vertices, and the number of indices
/// per corner.
fn all_inputs<'a>(
    reader: &mut ColladaReader<'a>,
    primitive: XmlNode<'a>,
) -> Result<(Vec<PrimitiveInput<'a>>, usize), LoadError> {
    let (mut found, mut stride) = (Vec::new(), 1);
    for node in inputs(primitive) {
        let offset = whole_number(reader, node, "offset")?.unwrap_or(0);
        stride = stride.max(offset.saturating_add(1));
        let set = whole_number(reader, node, "set")?.unwrap_or(0);
        let semantic = node.attribute("semantic").unwrap_or_default();
        found.push(PrimitiveInput { node, semantic, offset, set });
    }
    if let Some(vertex) = found.iter().find(|input| input.semantic == "VERTEX") {
        let (node, offset) = (vertex.node, vertex.offset);
        if let Some(vertices) = reader.resolve(node, "source", &["vertices"])? {
            found.extend(inputs(vertices).map(|node| {
                let semantic = node.attribute("semantic").unwrap_or_default();
                PrimitiveInput { node, semantic, offset, set: 0 }
            }));
        }
    }
    Ok((found, stride))
}

/// Removes all texture coordinates except those of a set; if that set is missing, all are kept,
/// with a warning.
fn keep_set<'a>(
    reader: &mut ColladaReader<'a>,
    primitive: XmlNode<'a>,
    inputs: &mut Vec<PrimitiveInput<'a>>,
    set: Option<usize>,
) {
    let Some(set) = set else { return };
    let is_coordinate = |input: &PrimitiveInput| input.semantic == "TEXCOORD";
    if inputs.iter().any(|input| is_coordinate(input) && input.set == set) {
        inputs.retain(|input| !is_coordinate(input) || input.set == set);
    } else if inputs.iter().any(is_coordinate) {
        let message = format!(
            "missing set {set} of texture coordinates, which a <bind_vertex_input> selects; the \
             lowest set is used"
        );
        reader.warn(primitive, message);
    }
}

impl Lane {
    /// Reads the source of the first input with a semantic; of the lowest set if there are several.
    fn of<'a, const N: usize>(
        reader: &mut ColladaReader<'a>,
        pool: &mut Pool<N>,
        inputs: &[PrimitiveInput<'a>],
        semantic: &str,
        non_finite: NonFinite,
    ) -> Result<Option<Self>, LoadError> {
        let with_meaning = inputs.iter().filter(|input| input.semantic == semantic);
        let Some(input) = with_meaning.min_by_key(|input| input.set) else { return Ok(None) };
        let Some(source) = reader.resolve(input.node, "source", &["source"])? else {
            return Ok(None);
        };
        let values = pool.load(reader, source, non_finite)?;
        Ok(Some(Self { offset: input.offset, values }))
    }

    /// Returns the index of a corner into the pool.
    fn at(&self, list: &[u32], stride: usize, corner: usize) -> u32 {
        self.values.start + list[corner * stride + self.offset]
    }
}

impl IndexLanes {
    /// Reads the inputs of a primitive, and their sources.
    fn of<'a>(
        reader: &mut ColladaReader<'a>,
        builder: &mut MeshBuilder<'a>,
        primitive: XmlNode<'a>,
        set: Option<usize>,
    ) -> Result<Self, LoadError> {
        let (mut inputs, stride) = all_inputs(reader, primitive)?;
        keep_set(reader, primitive, &mut inputs, set);
        let MeshBuilder { positions, normals, uvs, .. } = builder;
        let position = Lane::of(reader, positions, &inputs, "POSITION", NonFinite::Refuse)?;
        let Some(position) = position else {
            let message = "missing positions of corners; expected an <input semantic=\"VERTEX\"> \
                           that references <vertices> with an <input semantic=\"POSITION\">";
            return Err(reader.error(primitive, message));
        };
        Ok(Self {
            stride,
            position,
            normal: Lane::of(reader, normals, &inputs, "NORMAL", NonFinite::Zero)?,
            uv: Lane::of(reader, uvs, &inputs, "TEXCOORD", NonFinite::Zero)?,
        })
    }

    /// Reads and validates the indices of a `<p>`.
    fn indices(&self, reader: &ColladaReader<'_>, p: XmlNode<'_>) -> Result<Vec<u32>, LoadError> {
        let list = reader.document.numbers::<u32>(p)?;
        if list.len() % self.stride != 0 {
            let message = format!(
                "found {} indices, expected a multiple of {}, which is the largest offset of the \
                 inputs plus 1",
                list.len(),
                self.stride
            );
            return Err(reader.error(p, message));
        }
        let lanes = [
            ("position", Some(&self.position)),
            ("normal", self.normal.as_ref()),
            ("texture coordinate", self.uv.as_ref()),
        ];
        for (what, lane) in lanes.into_iter().filter_map(|(what, lane)| Some((what, lane?))) {
            let exist = lane.values.len();
            let mut of_lane = list.iter().skip(lane.offset).step_by(self.stride);
            if let Some(corner) = of_lane.position(|i| *i as usize >= exist) {
                let at = corner * self.stride + lane.offset;
                let message = format!("found {what} {}, expected an index below {exist}", list[at]);
                let word = words(p).nth(at).unwrap_or_default();
                return Err(reader.document.error_at(p, word, message));
            }
        }
        Ok(list)
    }
}

/// Adds faces to a mesh, given as positions in a list of indices.
struct FaceBuilder<'b, 'a> {
    builder: &'b mut MeshBuilder<'a>,
    lanes: &'b IndexLanes,
    cutter: Triangulator,
    /// Numbers of faces with fewer than three corners, and of polygons that were too large to be
    /// triangulated correctly.
    lost: [usize; 2],
}

impl FaceBuilder<'_, '_> {
    fn add(&mut self, list: &[u32], corners: [usize; 3]) {
        let IndexLanes { stride, position, normal, uv } = self.lanes;
        let of = |lane: &Lane| corners.map(|corner| lane.at(list, *stride, corner));
        self.builder.triangles.push(of(position));
        self.builder.normal_corners.push(normal.as_ref().map_or([MISSING; 3], of));
        self.builder.uv_corners.push(uv.as_ref().map_or([MISSING; 3], of));
    }

    /// Adds a triangle for every three corners. Returns their number.
    fn triangles(
        &mut self,
        reader: &ColladaReader<'_>,
        p: XmlNode<'_>,
        list: &[u32],
        corners: usize,
    ) -> Result<usize, LoadError> {
        if !corners.is_multiple_of(3) {
            let message = format!("found {corners} corners, expected a multiple of 3");
            return Err(reader.error(p, message));
        }
        (0..corners / 3).for_each(|i| self.add(list, [3 * i, 3 * i + 1, 3 * i + 2]));
        Ok(corners / 3)
    }

    /// Adds a triangle for each corner after the second and the two before it, every other one
    /// reversed so that all have the same orientation. Strips are joined by degenerate triangles,
    /// which are skipped.
    fn strip(&mut self, list: &[u32], corners: usize) -> usize {
        for i in 2..corners {
            let triangle = if i % 2 == 0 { [i - 2, i - 1, i] } else { [i - 1, i - 2, i] };
            let [a, b, c] = triangle.map(|i| self.lanes.position.at(list, self.lanes.stride, i));
            if a != b && b != c && c != a {
                self.add(list, triangle);
            }
        }
        self.count_small(corners)
    }

    /// Adds a triangle for each corner after the second, the one before it and the first one.
    fn fan(&mut self, list: &[u32], corners: usize) -> usize {
        (2..corners).for_each(|i| self.add(list, [0, i - 1, i]));
        self.count_small(corners)
    }

    /// Adds consecutive polygons of the given sizes. Returns their number.
    fn polygons(&mut self, list: &[u32], sizes: &[u32]) -> usize {
        let mut start = 0;
        for size in sizes {
            let end = start + *size as usize;
            self.polygon(list, start..end);
            start = end;
        }
        sizes.len()
    }

    fn polygon(&mut self, list: &[u32], corners: Range<usize>) -> usize {
        let first = corners.start;
        if corners.len() <= 3 {
            if corners.len() == 3 {
                self.add(list, [first, first + 1, first + 2]);
            }
            return self.count_small(corners.len());
        }
        let IndexLanes { stride, position, .. } = self.lanes;
        let mut points = Vec::with_capacity(corners.len());
        points.extend(corners.map(|corner| {
            let index = position.at(list, *stride, corner) as usize;
            let [x, y, z] = self.builder.positions.values[index].map(f64::from);
            DVec3::new(x, y, z)
        }));
        let mut cutter = std::mem::take(&mut self.cutter);
        let is_well_cut = cutter.cut(&points, |cut| self.add(list, cut.map(|i| first + i)));
        self.cutter = cutter;
        self.lost[1] += usize::from(!is_well_cut);
        1
    }

    /// Returns 1, the number of faces, and counts the face as lost if it has too few corners.
    fn count_small(&mut self, corners: usize) -> usize {
        self.lost[0] += usize::from(corners < 3);
        1
    }
}
