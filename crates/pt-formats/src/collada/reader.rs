//! State shared by all parts of the reader: references, lists of numbers, warnings, limits.

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;

use pt_scene::image::Image;
use pt_scene::{Scene, Span, Warning};
use roxmltree::NodeId;

use super::falloff::Attenuated;
use super::shape::{ColladaShape, Sets};
use crate::LoadError;
use crate::shared::context::LoadContext;
use crate::shared::mesh_file;
use crate::shared::names::{did_you_mean, quote};
use crate::shared::xml::{XmlDocument, XmlNode};

/// Maximum number of warnings; broken exporters repeat an error for every object.
const MAX_WARNINGS: usize = 100;
/// Maximum number of nodes visited plus material slots filled. Nested instances of nodes can make
/// any number.
const MAX_PLACED: usize = 2_000_000;
/// Maximum number of values of sources per byte of the file. More are only possible if many sources
/// share an array.
const MAX_VALUES_PER_BYTE: usize = 2;

/// A document that is converted to a [`Scene`].
pub(super) struct ColladaReader<'a> {
    pub(super) document: &'a XmlDocument<'a>,
    pub(super) context: &'a LoadContext,
    /// Scene so far.
    pub(super) scene: Scene,
    /// Index of each material that was read.
    pub(super) materials: HashMap<NodeId, u32>,
    /// Each image that was read, or the reason why it is missing.
    pub(super) images: HashMap<PathBuf, Result<Arc<Image>, String>>,
    /// Each geometry that was read, by the requested sets of texture coordinates; `None` if it has
    /// no surface.
    pub(super) shapes: HashMap<(NodeId, Sets<'a>), Option<ColladaShape<'a>>>,
    /// True if the file uses the profile `CGL` for a material or a light; then only the diffuse
    /// colour of common materials counts.
    pub(super) has_cgl_shading: bool,
    /// True if the file uses the profile `CGL` for anything. Cameras with matrices are then placed
    /// by [`Placement::Course`](pt_scene::Placement::Course).
    pub(super) has_cgl_profile: bool,
    /// Elements by tag and id.
    ids: HashMap<(&'a str, &'a str), XmlNode<'a>>,
    /// Lights whose intensities are computed at the end.
    pub(super) attenuated: Vec<Attenuated>,
    warnings_dropped: usize,
    placed: usize,
    values_left: usize,
}

impl<'a> ColladaReader<'a> {
    pub(super) fn new(document: &'a XmlDocument<'a>, context: &'a LoadContext) -> Self {
        let mut reader = Self {
            document,
            context,
            scene: Scene::default(),
            materials: HashMap::new(),
            images: HashMap::new(),
            shapes: HashMap::new(),
            has_cgl_shading: document.elements().any(is_cgl_shading),
            has_cgl_profile: document.elements().any(is_cgl_technique),
            ids: HashMap::new(),
            attenuated: Vec::new(),
            warnings_dropped: 0,
            placed: 0,
            values_left: document.length().saturating_mul(MAX_VALUES_PER_BYTE),
        };
        for element in document.elements() {
            let Some(id) = element.attribute("id") else { continue };
            let tag = element.tag_name().name();
            let first = *reader.ids.entry((tag, id)).or_insert(element);
            if first != element {
                let message = "duplicate id; the first element with it is used";
                reader.warn(element, message);
            }
        }
        reader
    }

    /// Returns the scene with its warnings.
    pub(super) fn finish(mut self) -> Scene {
        if self.warnings_dropped > 0 {
            let message = format!("{} further warnings omitted", self.warnings_dropped);
            let mut at = self.document.span(self.document.root());
            (at.line, at.column, at.element) = (0, 0, String::new());
            self.scene.warnings.push(Warning { at, message });
        }
        self.scene
    }

    /// Adds a warning about an element.
    pub(super) fn warn(&mut self, node: XmlNode<'_>, message: impl Into<String>) {
        self.warn_at(self.document.span(node), message);
    }

    /// Adds a warning about an element at a location.
    pub(super) fn warn_at(&mut self, at: Span, message: impl Into<String>) {
        if self.scene.warnings.len() < MAX_WARNINGS {
            self.scene.warnings.push(Warning { at, message: message.into() });
        } else {
            self.warnings_dropped += 1;
        }
    }

    /// Returns an error about an element.
    pub(super) fn error(&self, node: XmlNode<'_>, message: impl Into<String>) -> LoadError {
        self.document.error(node, message)
    }

    /// Returns the element, with one of the tags, to which an attribute such as `url="#id"` refers.
    /// `None`, with a warning, if it refers to another file.
    ///
    /// # Errors
    /// Returns an error if there is no such element.
    pub(super) fn resolve(
        &mut self,
        node: XmlNode<'a>,
        attribute: &str,
        tags: &[&str],
    ) -> Result<Option<XmlNode<'a>>, LoadError> {
        let wanted = tags.iter().map(|t| format!("<{t}>")).collect::<Vec<_>>().join(" or ");
        let Some(url) = node.attribute(attribute) else {
            let message = format!(
                "missing attribute {attribute}; expected {attribute}=\"#…\" with the id of a \
                 {wanted}"
            );
            return Err(self.error(node, message));
        };
        if let Some(found) = self.look_up(url, tags) {
            return Ok(Some(found));
        }
        let url = url.trim();
        let id = url.strip_prefix('#').unwrap_or(url);
        if !url.starts_with('#') && url.contains(['#', '.', '/']) {
            let message = format!(
                "{attribute}={} references another file, which is not supported; it is ignored",
                quote(url)
            );
            self.warn(node, message);
            return Ok(None);
        }
        let elements =
            || self.document.elements().filter_map(|n| n.attribute("id").map(|i| (n, i)));
        let namesake = elements().find(|(_, i)| *i == id);
        let hint = match namesake {
            Some((other, _)) => format!("; the id belongs to a <{}>", other.tag_name().name()),
            None => did_you_mean(
                id,
                elements().filter(|(n, _)| tags.contains(&n.tag_name().name())).map(|(_, i)| i),
            ),
        };
        let message = format!(
            "found {attribute}={}, expected the id of a {wanted} of this file{hint}",
            quote(url)
        );
        Err(self.document.error_at(node, node.attribute(attribute).unwrap_or_default(), message))
    }

    /// Returns the element of this file, with one of the tags, to which a URL refers.
    pub(super) fn look_up(&self, url: &str, tags: &[&str]) -> Option<XmlNode<'a>> {
        let url = url.trim();
        let id = url.strip_prefix('#').unwrap_or(url);
        self.find(id, tags).or_else(|| self.find(&mesh_file::percent_decoded(id), tags))
    }

    /// Returns the element with an id and one of the tags.
    pub(super) fn find(&self, id: &str, tags: &[&str]) -> Option<XmlNode<'a>> {
        tags.iter().find_map(|tag| self.ids.get(&(*tag, id)).copied())
    }

    /// Reads the content of an element as `N` finite numbers.
    pub(super) fn vector<const N: usize>(&self, node: XmlNode<'_>) -> Result<[f64; N], LoadError> {
        let numbers = self.document.numbers::<f64>(node)?;
        if let Some(bad) = numbers.iter().find(|n| !n.is_finite()) {
            return Err(self.error(node, format!("expected finite numbers, found {bad}")));
        }
        numbers.as_slice().try_into().map_err(|_| {
            let plural = if N == 1 { "number" } else { "numbers" };
            self.error(node, format!("expected {N} {plural}, found {}", numbers.len()))
        })
    }

    /// Reads the content of an element as a finite number.
    pub(super) fn scalar(&self, node: XmlNode<'_>) -> Result<f64, LoadError> {
        self.vector::<1>(node).map(|[number]| number)
    }

    /// Reads the content of an element as a colour: red, green, blue, and alpha (1 if it is
    /// missing).
    ///
    /// # Errors
    /// Returns an error if there are not three or four numbers, or any is negative, infinite or
    /// NaN.
    pub(super) fn rgba(&self, node: XmlNode<'_>) -> Result<[f32; 4], LoadError> {
        let numbers = self.document.numbers::<f32>(node)?;
        let rgba = match numbers[..] {
            [r, g, b] => [r, g, b, 1.0],
            [r, g, b, a] => [r, g, b, a],
            _ => {
                let message = format!(
                    "expected a colour of three numbers (red, green, blue) or four (and alpha), \
                     found {}",
                    numbers.len()
                );
                return Err(self.error(node, message));
            }
        };
        match rgba.iter().find(|c| !(c.is_finite() && **c >= 0.0)) {
            Some(bad) => {
                let message = format!(
                    "found the component {bad} in a colour, expected finite numbers from 0 up"
                );
                Err(self.error(node, message))
            }
            None => Ok(rgba),
        }
    }

    /// Reads the content of an element as a colour, without its alpha.
    pub(super) fn rgb(&self, node: XmlNode<'_>) -> Result<[f32; 3], LoadError> {
        self.rgba(node).map(|[r, g, b, _]| [r, g, b])
    }

    /// Counts nodes and slots placed in the scene.
    ///
    /// # Errors
    /// Returns an error if they exceed the limit.
    pub(super) fn count_placed(&mut self, node: XmlNode<'_>, more: usize) -> Result<(), LoadError> {
        self.placed += more;
        let most = self.context.limits().shapes(MAX_PLACED);
        if self.placed <= most {
            return Ok(());
        }
        let message =
            format!("the scene exceeds {most} nodes and materials; such files are rejected");
        Err(LoadContext::exceeded(self.document.span(node), message))
    }

    /// Counts values that a source takes from its array.
    ///
    /// # Errors
    /// Returns an error if they exceed the limit.
    pub(super) fn count_values(&mut self, node: XmlNode<'_>, more: usize) -> Result<(), LoadError> {
        let Some(left) = self.values_left.checked_sub(more) else {
            let message = "found too many sources of the same array; write the source once";
            return Err(LoadContext::exceeded(self.document.span(node), message));
        };
        self.values_left = left;
        Ok(())
    }
}

/// Returns the first child element with a tag.
pub(super) fn child<'a>(node: XmlNode<'a>, tag: &str) -> Option<XmlNode<'a>> {
    children(node, tag).next()
}

/// Iterates over the child elements with a tag.
pub(super) fn children<'a>(node: XmlNode<'a>, tag: &str) -> impl Iterator<Item = XmlNode<'a>> {
    node.children().filter(move |n| n.is_element() && n.tag_name().name() == tag)
}

/// Iterates over the child elements.
pub(super) fn elements(node: XmlNode<'_>) -> impl Iterator<Item = XmlNode<'_>> {
    node.children().filter(XmlNode::is_element)
}

/// Iterates over the techniques of the profile `CGL` in the `<extra>` elements of an element.
pub(super) fn cgl_techniques(node: XmlNode<'_>) -> impl Iterator<Item = XmlNode<'_>> {
    children(node, "extra")
        .flat_map(|extra| children(extra, "technique"))
        .filter(|t| is_cgl_technique(*t))
}

/// Returns true if an element is a technique of the profile `CGL`.
pub(super) fn is_cgl_technique(node: XmlNode<'_>) -> bool {
    node.tag_name().name() == "technique"
        && matches!(node.attribute("profile"), Some("CGL" | "CMU462"))
}

/// Returns true if an element is such a technique of a material or a light.
fn is_cgl_shading(node: XmlNode<'_>) -> bool {
    let is_look = |n: XmlNode<'_>| matches!(n.tag_name().name(), "effect" | "light");
    is_cgl_technique(node) && node.ancestors().any(is_look)
}

/// Returns the name of an element, or its id.
pub(super) fn name_of(node: XmlNode<'_>) -> String {
    node.attribute("name").or(node.attribute("id")).unwrap_or_default().to_owned()
}
