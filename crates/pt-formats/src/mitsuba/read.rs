//! Reads XML files into objects: parameters `$name`, includes, search folders, aliases, values.

mod placing;

use std::borrow::Cow;
use std::cell::Cell;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use pt_math::DVec3;
use pt_scene::Span;

use super::object::{ChildObject, ChildTarget, MitsubaObject, ObjectTree};
use super::value::{self, ParameterValue};
use super::{nesting, spectrum};
use crate::LoadError;
use crate::mitsuba::nesting::MAX_DEPTH;
use crate::shared::context::LoadContext;
use crate::shared::names::{did_you_mean, quote};
use crate::shared::number::number;
use crate::shared::reference_stack::{ReferenceError, ReferenceStack};
use crate::shared::registry::Registry;
use crate::shared::spectra::SpectrumColors;
use crate::shared::xml::{XmlDocument, XmlNode};
use crate::shared::{mesh_file, xml};

/// Maximum nesting depth of included files, as in Mitsuba.
const MAX_INCLUDE_DEPTH: usize = 15;
/// Maximum number of included files. Files that include others twice multiply.
const MAX_FILES: usize = 1000;
/// Maximum number of names that `<default>` may define.
const MAX_NAMES: usize = 1000;
/// Maximum length of an attribute after substitution of `$name`, in bytes. Nested names multiply.
const MAX_SUBSTITUTED: usize = 4096;

/// Tags of objects.
const OBJECTS: [&str; 12] = [
    "bsdf",
    "emitter",
    "film",
    "integrator",
    "medium",
    "phase",
    "rfilter",
    "sampler",
    "sensor",
    "shape",
    "texture",
    "volume",
];
/// Other tags inside of objects.
const OTHERS: [&str; 15] = [
    "alias",
    "animation",
    "boolean",
    "default",
    "float",
    "include",
    "integer",
    "path",
    "point",
    "ref",
    "rgb",
    "spectrum",
    "string",
    "transform",
    "vector",
];

/// Reads a scene and its included files. Names that are defined by the caller have to be used.
pub(super) fn read(
    bytes: &[u8],
    path: &Path,
    context: &Arc<LoadContext>,
) -> Result<ObjectTree, LoadError> {
    let definitions = context.options().definitions.as_slice();
    for (i, (name, _)) in definitions.iter().enumerate() {
        if definitions[..i].iter().any(|(before, _)| before == name) {
            return Err(mesh_file::error(
                path,
                0,
                format!("duplicate definition of {}", quote(name)),
            ));
        }
    }
    let given = |(name, value): &(String, String)| NameDefinition {
        text: name.clone(),
        value: value.clone(),
        is_used: Cell::new(false),
    };
    let root = MitsubaObject {
        tag: "scene".to_owned(),
        kind: String::new(),
        id: String::new(),
        at: mesh_file::place(path, 0),
        parameters: Vec::new(),
        children: Vec::new(),
        is_broken: false,
    };
    let tree = ObjectTree {
        context: Arc::clone(context),
        objects: vec![root],
        ids: Registry::default(),
        has_lost_folder: false,
        search: vec![mesh_file::folder_of(path)],
        warnings: Vec::new(),
    };
    let names = definitions.iter().map(given).collect();
    let way = ReferenceStack::of_files(context.limits(), MAX_INCLUDE_DEPTH, MAX_FILES);
    let mut reader = MitsubaReader { tree, names, lost_names: Vec::new(), way, depth: 0 };
    let _ = reader.way.enter_file(path); // the first file is always allowed
    reader.file(bytes, path, 0)?;
    let (given, others) = reader.names.split_at(definitions.len());
    if let Some(name) = given.iter().find(|name| !name.is_used.get())
        && !context.has_errors()
    {
        let hint = did_you_mean(&name.text, others.iter().map(|name| name.text.as_str()));
        let message = format!("unused definition of {}{hint}", quote(&name.text));
        return Err(mesh_file::error(path, 0, message));
    }
    spectrum::resolve(&mut reader.tree)?;
    nesting::check(&mut reader.tree)?;
    Ok(reader.tree)
}

struct MitsubaReader {
    tree: ObjectTree,
    /// Values of `$name`.
    names: Vec<NameDefinition>,
    /// Names whose value could not be read, which was reported.
    lost_names: Vec<String>,
    /// Files being read, each included by the one before.
    way: ReferenceStack<PathBuf>,
    /// Number of objects that enclose the element being read.
    depth: usize,
}

/// Definition of `$name`.
struct NameDefinition {
    text: String,
    value: String,
    /// True if the value was substituted somewhere.
    is_used: Cell<bool>,
}

/// Attributes of an element, after substitution of `$name`.
struct ElementAttributes<'a> {
    document: &'a XmlDocument<'a>,
    node: XmlNode<'a>,
    values: Vec<(&'a str, Cow<'a, str>)>,
}

impl ElementAttributes<'_> {
    /// Returns an attribute, if it is specified.
    fn find(&self, name: &str) -> Option<&str> {
        self.values.iter().find(|(n, _)| *n == name).map(|(_, value)| &**value)
    }

    /// Returns an attribute, or an empty string.
    fn text(&self, name: &str) -> &str {
        self.find(name).unwrap_or_default()
    }

    /// Parses an attribute; `None` if it is not specified.
    fn parse<T>(
        &self,
        name: &str,
        parse: impl Fn(&str) -> Result<T, String>,
    ) -> Result<Option<T>, LoadError> {
        let Some(text) = self.find(name) else { return Ok(None) };
        let result = parse(text);
        result.map(Some).map_err(|message| self.error(text, format!("{name}: {message}")))
    }

    /// Reads `value="1 2 3"`, `value="1"`, or any of x, y and z.
    fn vector(&self, default: f64) -> Result<DVec3, LoadError> {
        if let Some(value) = self.parse("value", value::one_or_three)? {
            if ["x", "y", "z"].iter().any(|axis| self.find(axis).is_some()) {
                return Err(self.error("", "expected value or x, y and z, found both"));
            }
            return Ok(DVec3::from_array(value));
        }
        let axis = |name| Ok(self.parse(name, number)?.unwrap_or(default));
        Ok(DVec3::new(axis("x")?, axis("y")?, axis("z")?))
    }

    /// Returns an error at a part of an attribute.
    fn error(&self, piece: &str, message: impl Into<String>) -> LoadError {
        self.document.error_at(self.node, piece, message)
    }
}

impl MitsubaReader {
    /// Reads a file into the object with an index.
    fn file(&mut self, bytes: &[u8], path: &Path, parent: usize) -> Result<(), LoadError> {
        let text = xml::decode(bytes, path)?;
        let document = XmlDocument::parse(&text, path, self.tree.context.limits())?;
        let root = document.root();
        self.outermost(&document, root, parent)
    }

    /// Reads the outermost element of a file.
    fn outermost<'a>(
        &mut self,
        document: &'a XmlDocument<'a>,
        root: XmlNode<'a>,
        parent: usize,
    ) -> Result<(), LoadError> {
        if root.tag_name().name() == "scene" {
            check_version(document, root)?;
            self.content(document, root, parent)
        } else if parent == 0 && self.way.len() == 1 {
            let message = "expected <scene version=\"3.0.0\">, the outermost element of a Mitsuba \
                           scene";
            Err(document.error(root, message))
        } else {
            self.element(document, root, parent)
        }
    }

    /// Reads the children of an element into the object with an index.
    fn content<'a>(
        &mut self,
        document: &'a XmlDocument<'a>,
        node: XmlNode<'a>,
        object: usize,
    ) -> Result<(), LoadError> {
        let most = self.tree.context.limits().depth(MAX_DEPTH);
        if self.depth >= most {
            let message = format!("objects are nested deeper than {most}");
            return Err(document.error(node, message));
        }
        self.depth += 1;
        for child in node.children().filter(XmlNode::is_element) {
            let done = self.element(document, child, object);
            if self.tree.context.ok_or_report(done)?.is_none() {
                self.tree.objects[object].is_broken = true;
                if let Some(id) = child.attribute("id") {
                    self.tree.ids.fail(id.to_owned());
                }
                self.tree.has_lost_folder |= child.tag_name().name() == "path";
                if let ("default", Some(name)) = (child.tag_name().name(), child.attribute("name"))
                {
                    self.lost_names.push(name.to_owned());
                }
            }
        }
        self.depth -= 1;
        Ok(())
    }

    /// Reads an element into the object that contains it.
    fn element<'a>(
        &mut self,
        document: &'a XmlDocument<'a>,
        node: XmlNode<'a>,
        parent: usize,
    ) -> Result<(), LoadError> {
        if let Some((name, value)) = self.named_value(document, node)? {
            return self.tree.objects[parent].add_parameter(name, value, document.span(node));
        }
        match node.tag_name().name() {
            "ref" => {
                let attributes = self.attributes(document, node, &["id"], &["name"])?;
                let target = ChildTarget::Reference(attributes.text("id").to_owned());
                let (at, name) = (document.span(node), attributes.text("name").to_owned());
                self.tree.objects[parent].children.push(ChildObject { name, at, target });
                Ok(())
            }
            "alias" => self.alias(document, node),
            "default" => self.define(document, node),
            "path" => self.search_path(document, node),
            "include" => self.include(document, node, parent),
            tag if OBJECTS.contains(&tag) || tag == "spectrum" => {
                self.object(document, node, parent)
            }
            tag => {
                let hint = did_you_mean(tag, OBJECTS.into_iter().chain(OTHERS));
                Err(document.error(node, format!("unsupported <{tag}>{hint}")))
            }
        }
    }

    /// Reads `<float name="…" value="…"/>` and similar elements; `None` for any other element.
    fn named_value<'a>(
        &mut self,
        document: &'a XmlDocument<'a>,
        node: XmlNode<'a>,
    ) -> Result<Option<(String, ParameterValue)>, LoadError> {
        type Parse = fn(&str) -> Result<ParameterValue, String>;
        let parse: Parse = match node.tag_name().name() {
            "float" => |text| number(text).map(ParameterValue::Float),
            "integer" => |text| value::integer(text).map(ParameterValue::Integer),
            "boolean" => |text| value::boolean(text).map(ParameterValue::Boolean),
            "string" => |text| Ok(ParameterValue::Text(text.to_owned())),
            "rgb" => |text| value::rgb(text).map(ParameterValue::Rgb),
            "spectrum" if !node.has_attribute("type") => {
                return self.spectrum(document, node).map(Some);
            }
            "point" | "vector" => {
                let attributes =
                    self.attributes(document, node, &["name"], &["value", "x", "y", "z"])?;
                let vector = ParameterValue::Vector(attributes.vector(0.0)?.to_array());
                return Ok(Some((attributes.text("name").to_owned(), vector)));
            }
            "transform" => {
                let attributes = self.attributes(document, node, &["name"], &[])?;
                let name = attributes.text("name").to_owned();
                return Ok(Some((
                    name,
                    ParameterValue::Transform(self.transform(document, node)?),
                )));
            }
            "animation" => {
                let attributes = self.attributes(document, node, &["name"], &[])?;
                let name = attributes.text("name").to_owned();
                return Ok(Some((
                    name,
                    ParameterValue::Animation(self.animation(document, node)?),
                )));
            }
            _ => return Ok(None),
        };
        let attributes = self.attributes(document, node, &["name", "value"], &[])?;
        let value = attributes.parse("value", parse)?;
        Ok(value.map(|value| (attributes.text("name").to_owned(), value)))
    }

    /// Reads `<spectrum name="…" value="…"/>`, or one with a file of samples.
    fn spectrum<'a>(
        &self,
        document: &'a XmlDocument<'a>,
        node: XmlNode<'a>,
    ) -> Result<(String, ParameterValue), LoadError> {
        let attributes = self.attributes(document, node, &["name"], &["value", "filename"])?;
        let read = |text: &str| {
            let path = self.tree.resolve(text).ok_or_else(|| self.tree.not_found(text))?;
            SpectrumColors::read(&self.tree.context, &path)
        };
        let value = attributes.parse("value", SpectrumColors::parse)?;
        let samples = attributes.parse("filename", read)?;
        let ((Some(spectrum), None) | (None, Some(spectrum))) = (value, samples) else {
            return Err(document.error(node, "expected either value or filename"));
        };
        Ok((attributes.text("name").to_owned(), ParameterValue::Spectrum(spectrum)))
    }

    /// Reads an object and its content.
    fn object<'a>(
        &mut self,
        document: &'a XmlDocument<'a>,
        node: XmlNode<'a>,
        parent: usize,
    ) -> Result<(), LoadError> {
        let attributes = self.attributes(document, node, &["type"], &["id", "name"])?;
        let index = self.tree.objects.len();
        let id = attributes.text("id").to_owned();
        if !id.is_empty() && !self.tree.ids.define(id.clone(), index) {
            return Err(document.error(node, format!("duplicate id {}", quote(&id))));
        }
        let at = document.span(node);
        self.tree.objects[parent].children.push(ChildObject {
            name: attributes.text("name").to_owned(),
            at: at.clone(),
            target: ChildTarget::Object(index),
        });
        self.tree.objects.push(MitsubaObject {
            tag: node.tag_name().name().to_owned(),
            kind: attributes.text("type").to_owned(),
            id,
            at,
            parameters: Vec::new(),
            children: Vec::new(),
            is_broken: false,
        });
        self.content(document, node, index)
    }

    /// Adds a second identifier for an object.
    fn alias<'a>(
        &mut self,
        document: &'a XmlDocument<'a>,
        node: XmlNode<'a>,
    ) -> Result<(), LoadError> {
        let attributes = self.attributes(document, node, &["id", "as"], &[])?;
        let (id, alias) = (attributes.text("id"), attributes.text("as"));
        let undefined = |hint: &str| {
            let message =
                format!("undefined id {}; expected the id of an element above{hint}", quote(id));
            attributes.error(id, message)
        };
        let index = *self.tree.ids.get(id, undefined)?;
        if !self.tree.ids.define(alias.to_owned(), index) {
            return Err(attributes.error(alias, format!("duplicate id {}", quote(alias))));
        }
        Ok(())
    }

    /// Defines `$name`, unless it is already defined.
    fn define<'a>(
        &mut self,
        document: &'a XmlDocument<'a>,
        node: XmlNode<'a>,
    ) -> Result<(), LoadError> {
        let attributes = self.attributes(document, node, &["name", "value"], &[])?;
        let (name, value) = (attributes.text("name"), attributes.text("value"));
        if name.is_empty() {
            return Err(document.error(node, "found an empty name, expected a name"));
        }
        if self.names.iter().any(|known| known.text == name) {
            return Ok(());
        }
        if self.names.len() >= MAX_NAMES {
            return Err(document.error(node, format!("more than {MAX_NAMES} names")));
        }
        let (text, value) = (name.to_owned(), value.to_owned());
        self.names.push(NameDefinition { text, value, is_used: Cell::new(false) });
        Ok(())
    }

    /// Adds a search folder in front of the others.
    fn search_path<'a>(
        &mut self,
        document: &'a XmlDocument<'a>,
        node: XmlNode<'a>,
    ) -> Result<(), LoadError> {
        let attributes = self.attributes(document, node, &["value"], &[])?;
        let text = attributes.text("value");
        let folder = self.tree.resolve(text).filter(|path| path.is_dir());
        let folder = folder.ok_or_else(|| attributes.error(text, self.tree.not_found(text)))?;
        self.tree.context.check_inside(&folder).map_err(|why| attributes.error(text, why))?;
        self.tree.search.insert(0, folder);
        Ok(())
    }

    /// Reads another file in place of the element.
    fn include<'a>(
        &mut self,
        document: &'a XmlDocument<'a>,
        node: XmlNode<'a>,
        parent: usize,
    ) -> Result<(), LoadError> {
        let attributes = self.attributes(document, node, &["filename"], &["name"])?;
        let text = attributes.text("filename");
        let at = document.span(node);
        let Some(path) = self.tree.resolve(text) else {
            return self.tree.miss(&at, &self.tree.not_found(text), "its content is omitted");
        };
        match self.way.enter_file(&path) {
            Ok(()) => {}
            Err(circle @ ReferenceError::Circle) => {
                return Err(attributes.error(text, circle.of_file(text)));
            }
            Err(barred) => return Err(LoadContext::exceeded(at, barred.of_file(text))),
        }
        let done = match self.tree.context.read(&path) {
            Ok(bytes) => self.file(&bytes, &path, parent),
            Err(why) => self.tree.miss(&at, &why, "its content is omitted"),
        };
        self.way.leave();
        done
    }

    /// Reads the attributes of an element: all that are required, and none but the given ones.
    fn attributes<'a>(
        &self,
        document: &'a XmlDocument<'a>,
        node: XmlNode<'a>,
        required: &[&str],
        optional: &[&str],
    ) -> Result<ElementAttributes<'a>, LoadError> {
        let tag = node.tag_name().name();
        let mut values = Vec::new();
        for attribute in node.attributes() {
            let name = attribute.name();
            if !required.contains(&name) && !optional.contains(&name) {
                let known = required.iter().chain(optional).copied();
                let hint = did_you_mean(name, known);
                let message = format!("unknown attribute {} of <{tag}>{hint}", quote(name));
                return Err(document.error_at(node, name, message));
            }
            let value = self.substitute(attribute.value()).map_err(|message| match message {
                Some(message) => document.error_at(node, attribute.value(), message),
                None => LoadError::AlreadyReported,
            })?;
            values.push((name, value));
        }
        if let Some(missing) = required.iter().find(|r| !node.has_attribute(**r)) {
            return Err(
                document.error(node, format!("missing attribute {missing}=\"…\" of <{tag}>"))
            );
        }
        Ok(ElementAttributes { document, node, values })
    }

    /// Substitutes the values of `$name`. The longest matching name is used, and `\$` is a dollar
    /// sign. The error is a message, or `None` if the cause was already reported.
    fn substitute<'a>(&self, text: &'a str) -> Result<Cow<'a, str>, Option<String>> {
        if !text.contains('$') {
            return Ok(Cow::Borrowed(text));
        }
        let (mut result, mut rest) = (String::new(), text);
        while let Some((before, after)) = rest.split_once('$') {
            if let Some(before) = before.strip_suffix('\\') {
                result += before;
                result.push('$');
                rest = after;
                continue;
            }
            let fits =
                |name: &&NameDefinition| !name.text.is_empty() && after.starts_with(&name.text);
            let fitting = self.names.iter().filter(fits);
            let Some(found) = fitting.max_by_key(|name| name.text.len()) else {
                let end = after.find(|c: char| !c.is_alphanumeric() && c != '_');
                let name = &after[..end.unwrap_or(after.len())];
                if self.lost_names.iter().any(|lost| lost == name) {
                    return Err(None);
                }
                let hint = did_you_mean(name, self.names.iter().map(|n| n.text.as_str()));
                let message = "undefined name; add <default name=\"…\" value=\"…\"/> above";
                return Err(Some(format!("{}: {message}{hint}", quote(&format!("${name}")))));
            };
            found.is_used.set(true);
            result += before;
            result += &found.value;
            rest = &after[found.text.len()..];
            if result.len() > MAX_SUBSTITUTED {
                return Err(Some(format!(
                    "value longer than {MAX_SUBSTITUTED} bytes after substitution of all $names"
                )));
            }
        }
        Ok(Cow::Owned(result + rest))
    }
}

impl ObjectTree {
    /// Returns the first path at which a file or folder exists.
    pub(super) fn resolve(&self, text: &str) -> Option<PathBuf> {
        self.search.iter().map(|folder| folder.join(text)).find(|path| path.exists())
    }

    /// Reports a file that cannot be used, with the fallback.
    ///
    /// # Errors
    /// If the cause is a missing search folder.
    pub(super) fn miss(&self, at: &Span, why: &str, instead: &str) -> Result<(), LoadError> {
        if self.has_lost_folder {
            return Err(LoadError::AlreadyReported);
        }
        self.context.missing(at.clone(), format!("{why}; {instead}"));
        Ok(())
    }

    /// Message about a file that does not exist.
    pub(super) fn not_found(&self, text: &str) -> String {
        let folders: Vec<_> = self.search.iter().map(|f| f.display().to_string()).collect();
        format!("{} not found; searched in {}", quote(text), folders.join(", "))
    }
}

/// Rejects scenes of Mitsuba 0.x and 1.x, which use different names.
fn check_version<'a>(document: &'a XmlDocument<'a>, root: XmlNode<'a>) -> Result<(), LoadError> {
    let version = root.attribute("version").unwrap_or_default();
    let major = version.split('.').next().and_then(|m| m.parse::<u32>().ok());
    match major {
        Some(2 | 3) => Ok(()),
        Some(0 | 1) => {
            let message = "unsupported names of Mitsuba 0.x and 1.x; convert the scene with \
                           Mitsuba 3 (mitsuba -u)";
            Err(document.error_at(root, version, message))
        }
        _ => {
            let message = format!(
                "found version {}, expected one such as <scene version=\"3.0.0\">",
                quote(version)
            );
            Err(document.error_at(root, version, message))
        }
    }
}
