//! What all parts of the reader share: references, lists of numbers, warnings, limits.

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;

use roxmltree::NodeId;

use super::attenuation::Attenuated;
use super::geometry::{Sets, Shape};
use crate::format::context::Context;
use crate::format::mesh_file;
use crate::format::xml::{Document, Node, did_you_mean, quote};
use crate::image::Image;
use crate::{LoadError, Scene, Span, Warning};

/// Most warnings kept; a broken exporter repeats itself for every object.
const MAX_WARNINGS: usize = 100;
/// Most nodes visited plus material slots filled. Nodes that instance nodes that instance nodes
/// can ask for any number.
const MAX_PLACED: usize = 2_000_000;
/// Values that sources may take per byte of the file. More is only possible where many sources
/// share an array.
const MAX_VALUES_PER_BYTE: usize = 2;

/// A document on its way to a [`Scene`].
pub(super) struct Reader<'a> {
    pub(super) document: &'a Document<'a>,
    pub(super) context: &'a Context,
    /// What has been read so far.
    pub(super) scene: Scene,
    /// Index of each material read.
    pub(super) materials: HashMap<NodeId, u32>,
    /// Each image read, or why it is missing.
    pub(super) images: HashMap<PathBuf, Result<Arc<Image>, String>>,
    /// Each geometry read, with the sets of texture coordinates that were asked for; `None` if
    /// there is nothing to see.
    pub(super) shapes: HashMap<(NodeId, Sets<'a>), Option<Shape<'a>>>,
    /// True if the file is written for the course, whose common materials mean their diffuse
    /// colour alone: it uses the course's profile for a material or a light.
    pub(super) of_course: bool,
    /// True if it uses the course's profile for anything. Then cameras that are placed by matrices
    /// stand where the course's program puts them.
    pub(super) has_course_profile: bool,
    /// Elements by tag and id.
    ids: HashMap<(&'a str, &'a str), Node<'a>>,
    /// Lights whose intensities are known in the end.
    pub(super) attenuated: Vec<Attenuated>,
    warnings_dropped: usize,
    placed: usize,
    values_left: usize,
}

impl<'a> Reader<'a> {
    pub(super) fn new(document: &'a Document<'a>, context: &'a Context) -> Self {
        let mut reader = Self {
            document,
            context,
            scene: Scene::default(),
            materials: HashMap::new(),
            images: HashMap::new(),
            shapes: HashMap::new(),
            of_course: document.elements().any(looks_of_course),
            has_course_profile: document.elements().any(is_course_technique),
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
                let message = "there is an earlier one with this id, which is taken instead";
                reader.warn(element, message);
            }
        }
        reader
    }

    /// The scene with its warnings.
    pub(super) fn finish(mut self) -> Scene {
        if self.warnings_dropped > 0 {
            let message = format!("{} further warnings are not shown", self.warnings_dropped);
            let mut at = self.document.span(self.document.root());
            (at.line, at.column, at.element) = (0, 0, String::new());
            self.scene.warnings.push(Warning { at, message });
        }
        self.scene
    }

    /// Tells the user something about an element.
    pub(super) fn warn(&mut self, node: Node<'_>, message: impl Into<String>) {
        self.warn_at(self.document.span(node), message);
    }

    /// Likewise, of an element that stands there.
    pub(super) fn warn_at(&mut self, at: Span, message: impl Into<String>) {
        if self.scene.warnings.len() < MAX_WARNINGS {
            self.scene.warnings.push(Warning { at, message: message.into() });
        } else {
            self.warnings_dropped += 1;
        }
    }

    /// An error about an element.
    pub(super) fn error(&self, node: Node<'_>, message: impl Into<String>) -> LoadError {
        self.document.error(node, message)
    }

    /// The element, with one of the tags, to which an attribute such as `url="#id"` refers.
    /// `None`, with a warning, where it refers to another file.
    ///
    /// # Errors
    /// If there is none.
    pub(super) fn resolve(
        &mut self,
        node: Node<'a>,
        attribute: &str,
        tags: &[&str],
    ) -> Result<Option<Node<'a>>, LoadError> {
        let wanted = tags.iter().map(|t| format!("<{t}>")).collect::<Vec<_>>().join(" or ");
        let Some(url) = node.attribute(attribute) else {
            let message = format!(
                "the attribute {attribute} is missing; expected {attribute}=\"#…\" with the id of \
                 a {wanted}"
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
                "{attribute}={} is in another file, which is not read; it is left out",
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
        let message = format!("{attribute}={} names no {wanted} of this file{hint}", quote(url));
        Err(self.document.error_at(node, node.attribute(attribute).unwrap_or_default(), message))
    }

    /// The element of this file, with one of the tags, to which a URL refers.
    pub(super) fn look_up(&self, url: &str, tags: &[&str]) -> Option<Node<'a>> {
        let url = url.trim();
        let id = url.strip_prefix('#').unwrap_or(url);
        self.find(id, tags).or_else(|| self.find(&mesh_file::percent_decoded(id), tags))
    }

    /// The element with an id and one of the tags.
    pub(super) fn find(&self, id: &str, tags: &[&str]) -> Option<Node<'a>> {
        tags.iter().find_map(|tag| self.ids.get(&(*tag, id)).copied())
    }

    /// The `N` numbers that an element contains, all finite.
    pub(super) fn vector<const N: usize>(&self, node: Node<'_>) -> Result<[f64; N], LoadError> {
        let numbers = self.document.numbers::<f64>(node)?;
        if let Some(bad) = numbers.iter().find(|n| !n.is_finite()) {
            return Err(self.error(node, format!("expected finite numbers, found {bad}")));
        }
        numbers.as_slice().try_into().map_err(|_| {
            let plural = if N == 1 { "number" } else { "numbers" };
            self.error(node, format!("expected {N} {plural}, found {}", numbers.len()))
        })
    }

    /// The finite number that an element contains.
    pub(super) fn scalar(&self, node: Node<'_>) -> Result<f64, LoadError> {
        self.vector::<1>(node).map(|[number]| number)
    }

    /// The colour that an element contains: red, green, blue, and alpha (1 where it is missing).
    ///
    /// # Errors
    /// If there are not three or four numbers, or some are negative, infinite or not a number.
    pub(super) fn rgba(&self, node: Node<'_>) -> Result<[f32; 4], LoadError> {
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
                    "the colour has the component {bad}; expected finite numbers from 0 up"
                );
                Err(self.error(node, message))
            }
            None => Ok(rgba),
        }
    }

    /// The colour that an element contains, without its alpha.
    pub(super) fn rgb(&self, node: Node<'_>) -> Result<[f32; 3], LoadError> {
        self.rgba(node).map(|[r, g, b, _]| [r, g, b])
    }

    /// Counts nodes and slots placed in the scene.
    ///
    /// # Errors
    /// If they become too many.
    pub(super) fn count_placed(&mut self, node: Node<'_>, more: usize) -> Result<(), LoadError> {
        self.placed += more;
        let most = self.context.limits().shapes(MAX_PLACED);
        if self.placed <= most {
            return Ok(());
        }
        let message = format!(
            "the scene places more than {most} nodes and materials; such files are refused"
        );
        Err(Context::exceeded(self.document.span(node), message))
    }

    /// Counts values that a source takes from its array.
    ///
    /// # Errors
    /// If they become too many.
    pub(super) fn count_values(&mut self, node: Node<'_>, more: usize) -> Result<(), LoadError> {
        let Some(left) = self.values_left.checked_sub(more) else {
            let message = "sources repeat the same array too often; write it once";
            return Err(Context::exceeded(self.document.span(node), message));
        };
        self.values_left = left;
        Ok(())
    }
}

/// The first child element with a tag.
pub(super) fn child<'a>(node: Node<'a>, tag: &str) -> Option<Node<'a>> {
    children(node, tag).next()
}

/// The child elements with a tag.
pub(super) fn children<'a>(node: Node<'a>, tag: &str) -> impl Iterator<Item = Node<'a>> {
    node.children().filter(move |n| n.is_element() && n.tag_name().name() == tag)
}

/// The child elements.
pub(super) fn elements(node: Node<'_>) -> impl Iterator<Item = Node<'_>> {
    node.children().filter(Node::is_element)
}

/// The techniques of the course's profile inside the `<extra>` elements of an element.
pub(super) fn course_techniques(node: Node<'_>) -> impl Iterator<Item = Node<'_>> {
    children(node, "extra")
        .flat_map(|extra| children(extra, "technique"))
        .filter(|t| is_course_technique(*t))
}

/// Returns true if an element is a technique of the course's profile.
pub(super) fn is_course_technique(node: Node<'_>) -> bool {
    node.tag_name().name() == "technique"
        && matches!(node.attribute("profile"), Some("CGL" | "CMU462"))
}

/// Returns true if an element is such a technique, and describes a material or a light.
fn looks_of_course(node: Node<'_>) -> bool {
    let is_look = |n: Node<'_>| matches!(n.tag_name().name(), "effect" | "light");
    is_course_technique(node) && node.ancestors().any(is_look)
}

/// What the author calls an element.
pub(super) fn name_of(node: Node<'_>) -> String {
    node.attribute("name").or(node.attribute("id")).unwrap_or_default().to_owned()
}
