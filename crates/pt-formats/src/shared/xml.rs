//! Components shared by the XML formats: decoding, limits, locations for messages, lists of
//! numbers.
//!
//! The parser is `roxmltree`, which rejects document type definitions (and with them the entities
//! that expand a small file to a large one). [`XmlDocument::parse`] adds limits on other growth
//! that a hostile file could cause.

use std::borrow::Cow;
use std::cell::RefCell;
use std::path::Path;
use std::str::FromStr;

use pt_scene::{Span, Warning};

use super::limits::Limits;
use super::names::quote;
use super::source_map::SourceMap;
use super::text::{unmarked, with_line_feeds};
use crate::LoadError;

/// An element, a text or a comment of an [`XmlDocument`].
pub(crate) type XmlNode<'a> = roxmltree::Node<'a, 'a>;

/// Maximum nesting of elements. Scenes of modelling tools stay below 100; readers may recurse.
const MAX_DEPTH: usize = 1000;
/// Maximum number of attributes of an element; the parser compares all pairs.
const MAX_ATTRIBUTES: usize = 1000;
/// Maximum number of namespace declarations of a file; the parser copies them to nested elements.
const MAX_NAMESPACES: usize = 10_000;
/// Maximum number of elements, texts and comments of a file; each takes about 100 bytes.
const MAX_NODES: usize = 20_000_000;
/// A parsed file with the locations of its elements.
pub(crate) struct XmlDocument<'a> {
    path: &'a Path,
    tree: roxmltree::Document<'a>,
    map: SourceMap,
    first_comma: RefCell<Option<Span>>,
}

impl<'a> XmlDocument<'a> {
    /// Parses a text returned by [`decode`].
    ///
    /// # Errors
    /// Returns an error if the XML is not well-formed, has a document type definition, or exceeds a
    /// limit.
    pub(crate) fn parse(text: &'a str, path: &'a Path, limits: &Limits) -> Result<Self, LoadError> {
        let map = SourceMap::new(text);
        let at = |offset| place(path, map.line_and_column(text, offset), String::new());
        if let Err((offset, message)) = check_limits(text, limits.depth(MAX_DEPTH)) {
            return Err(LoadError::Content { at: at(offset), message });
        }
        let most_nodes = u32::try_from(limits.elements(MAX_NODES)).unwrap_or(u32::MAX);
        let options = roxmltree::ParsingOptions { nodes_limit: most_nodes, ..Default::default() };
        match roxmltree::Document::parse_with_options(text, options) {
            Ok(tree) => Ok(Self { path, tree, map, first_comma: RefCell::default() }),
            Err(error) => {
                let (offset, message) = explain(&error, text, most_nodes);
                let at = match offset {
                    Some(offset) => at(offset),
                    None => place(path, (error.pos().row, error.pos().col), String::new()),
                };
                Err(LoadError::Content { at, message })
            }
        }
    }

    /// Returns the outermost element.
    pub(crate) fn root(&'a self) -> XmlNode<'a> {
        self.tree.root_element()
    }

    /// Iterates over all elements in document order.
    pub(crate) fn elements(&'a self) -> impl Iterator<Item = XmlNode<'a>> {
        self.tree.descendants().filter(XmlNode::is_element)
    }

    /// Returns the size of the file, in bytes.
    pub(crate) fn length(&self) -> usize {
        self.tree.input_text().len()
    }

    /// Returns the path of the file.
    pub(crate) fn path(&self) -> &Path {
        self.path
    }

    /// Returns the location and the description of an element.
    pub(crate) fn span(&self, node: XmlNode<'_>) -> Span {
        self.span_at(node, node.range().start)
    }

    /// Returns an error about an element.
    pub(crate) fn error(&self, node: XmlNode<'_>, message: impl Into<String>) -> LoadError {
        LoadError::Content { at: self.span(node), message: message.into() }
    }

    /// Returns an error about a piece of the content or of an attribute of an element.
    pub(crate) fn error_at(
        &self,
        node: XmlNode<'_>,
        piece: &str,
        message: impl Into<String>,
    ) -> LoadError {
        let offset = self.offset_of(piece).unwrap_or(node.range().start);
        LoadError::Content { at: self.span_at(node, offset), message: message.into() }
    }

    /// Returns a warning about an element.
    pub(crate) fn warning(&self, node: XmlNode<'_>, message: impl Into<String>) -> Warning {
        Warning { at: self.span(node), message: message.into() }
    }

    /// Parses the content of an element as numbers separated by white space.
    ///
    /// # Errors
    /// Returns an error about the first word that is no such number.
    pub(crate) fn numbers<T: XmlNumber>(&self, node: XmlNode<'_>) -> Result<Vec<T>, LoadError> {
        let mut numbers = Vec::new();
        for word in words(node) {
            let parsed = word.parse().ok().or_else(|| {
                let number = T::with_comma(word)?;
                self.first_comma.borrow_mut().get_or_insert_with(|| self.span(node));
                Some(number)
            });
            numbers.push(parsed.ok_or_else(|| {
                let index = numbers.len() + 1;
                let message =
                    format!("found {} as value {index}, expected {}", quote(word), T::NAME);
                self.error_at(node, word, message)
            })?);
        }
        Ok(numbers)
    }

    /// Returns the location of the first number with a decimal comma, as programs write them in
    /// some languages.
    pub(crate) fn first_comma(&self) -> Option<Span> {
        self.first_comma.borrow().clone()
    }

    /// Returns the location of an offset into the text, with the description of an element.
    fn span_at(&self, node: XmlNode<'_>, offset: usize) -> Span {
        let place_in_text = self.map.line_and_column(self.tree.input_text(), offset);
        place(self.path, place_in_text, describe(node))
    }

    /// Returns the offset of a piece of text in the file; `None` if the parser had to rewrite it.
    fn offset_of(&self, piece: &str) -> Option<usize> {
        let text = self.tree.input_text();
        let offset = piece.as_ptr().addr().checked_sub(text.as_ptr().addr())?;
        (text.get(offset..)?.get(..piece.len())? == piece).then_some(offset)
    }
}

/// Returns the words of an element, separated by white space and comments.
pub(crate) fn words(node: XmlNode<'_>) -> impl Iterator<Item = &str> {
    let texts = node.children().filter(XmlNode::is_text).filter_map(|text| text.text());
    texts.flat_map(str::split_ascii_whitespace)
}

/// Number types of [`XmlDocument::numbers`].
pub(crate) trait XmlNumber: FromStr {
    /// Name of the expected type, for messages.
    const NAME: &str;

    /// Parses a word with one comma as the decimal separator; `None` for integer types.
    fn with_comma(word: &str) -> Option<Self> {
        let (whole, fraction) = word.split_once(',')?;
        let is_real = Self::NAME == f32::NAME && !whole.contains('.');
        is_real.then(|| format!("{whole}.{fraction}").parse().ok())?
    }
}

impl XmlNumber for f32 {
    const NAME: &str = "a number such as 0.5 or 1e-3";
}

impl XmlNumber for f64 {
    const NAME: &str = f32::NAME;
}

impl XmlNumber for u32 {
    const NAME: &str = "a whole number from 0 to 4294967295";
}

/// Decodes the text of a file in UTF-8, UTF-16 or UTF-32, with line feeds as line ends.
///
/// # Errors
/// Returns an error with the location of the first invalid character.
pub(crate) fn decode<'a>(bytes: &'a [u8], path: &Path) -> Result<Cow<'a, str>, LoadError> {
    let text: Cow<str> = match unmarked(bytes, path)? {
        Cow::Borrowed(bytes) => decode_utf8(bytes, path)?.into(),
        Cow::Owned(bytes) => decode_utf8(&bytes, path)?.to_owned().into(),
    };
    Ok(match with_line_feeds(text.as_bytes()) {
        Cow::Owned(changed) => String::from_utf8_lossy(&changed).into_owned().into(),
        Cow::Borrowed(_) => text,
    })
}

/// Decodes UTF-8 without a byte-order mark.
fn decode_utf8<'a>(bytes: &'a [u8], path: &Path) -> Result<&'a str, LoadError> {
    std::str::from_utf8(bytes).map_err(|error| {
        let good = error.valid_up_to();
        let before = String::from_utf8_lossy(&bytes[..good]);
        let line_and_column = SourceMap::new(&before).line_and_column(&before, good);
        LoadError::Content {
            at: place(path, line_and_column, String::new()),
            message: format!(
                "found the byte 0x{:02X}, expected UTF-8; save the file as UTF-8 (or as UTF-16 \
                 with a byte order mark)",
                bytes[good]
            ),
        }
    })
}

fn place(path: &Path, (line, column): (u32, u32), element: String) -> Span {
    Span { file: path.to_owned(), line, column, element }
}

/// Describes an element by the nearest name around it, as in `<polylist> of geometry "bunny"`.
fn describe(node: XmlNode<'_>) -> String {
    let name_of = |n: XmlNode<'_>| n.attribute("id").or(n.attribute("name")).map(quote);
    let tag = node.tag_name().name();
    let named = node.ancestors().find_map(|n| name_of(n).map(|name| (n, name)));
    match named {
        Some((owner, name)) if owner == node => format!("<{tag}> {name}"),
        Some((owner, name)) => format!("<{tag}> of {} {name}", owner.tag_name().name()),
        None => format!("<{tag}>"),
    }
}

/// Rejects documents on which the parser, or code that traverses its tree, would spend time or
/// memory out of proportion to the size of the file. The error contains the offset. Text that is no
/// XML is left to the parser.
fn check_limits(text: &str, most_deep: usize) -> Result<(), (usize, String)> {
    let (mut depth, mut namespaces, mut next) = (0_usize, 0, 0);
    while let Some(start) = text[next..].find('<').map(|found| next + found) {
        let rest = &text[start..];
        let skipped = [("<!--", "-->"), ("<![CDATA[", "]]>"), ("<?", "?>")];
        if let Some((open, close)) = skipped.iter().find(|(open, _)| rest.starts_with(open)) {
            let Some(end) = rest[open.len()..].find(close) else { break };
            next = start + open.len() + end + close.len();
            continue;
        }
        let Some(tag) = scan_tag(rest) else { break };
        next = start + tag.length;
        namespaces += tag.namespaces;
        match tag.kind {
            TagKind::Open => depth += 1,
            TagKind::Close => depth = depth.saturating_sub(1),
            TagKind::Empty => {}
        }
        let refusal = if depth > most_deep {
            Some(format!("elements are nested deeper than {most_deep}"))
        } else if tag.attributes > MAX_ATTRIBUTES {
            Some(format!("element with more than {MAX_ATTRIBUTES} attributes"))
        } else if namespaces > MAX_NAMESPACES {
            Some(format!("more than {MAX_NAMESPACES} declared namespaces"))
        } else {
            None
        };
        if let Some(refusal) = refusal {
            return Err((start, format!("{refusal}; such files are rejected")));
        }
    }
    Ok(())
}

enum TagKind {
    Open,
    Close,
    Empty,
}

struct Tag {
    /// Length from `<` to `>`, in bytes.
    length: usize,
    attributes: usize,
    namespaces: usize,
    kind: TagKind,
}

/// Scans the tag at the start of a text; `None` if it does not end.
fn scan_tag(text: &str) -> Option<Tag> {
    let bytes = text.as_bytes();
    let (mut attributes, mut namespaces, mut at) = (0, 0, 1);
    loop {
        match *bytes.get(at)? {
            b'>' => break,
            quote @ (b'"' | b'\'') => {
                at += 1 + bytes[at + 1..].iter().position(|b| *b == quote)?;
            }
            b'=' => attributes += 1,
            b'x' if bytes[at..].starts_with(b"xmlns") => namespaces += 1,
            _ => {}
        }
        at += 1;
    }
    let kind = match (bytes[1], bytes[at - 1]) {
        (b'/', _) => TagKind::Close,
        (b'!', _) | (_, b'/') => TagKind::Empty,
        _ => TagKind::Open,
    };
    Some(Tag { length: at + 1, attributes, namespaces, kind })
}

/// Describes an error of the parser, with the offset if the parser does not provide the location.
fn explain(error: &roxmltree::Error, text: &str, most_nodes: u32) -> (Option<usize>, String) {
    use roxmltree::Error as E;
    let ends_early = |what: &str| (Some(text.len()), format!("{what}; the file may be incomplete"));
    match error {
        E::NoRootNode if text.trim().is_empty() => (Some(0), "the file is empty".to_owned()),
        E::NoRootNode => (Some(0), "found no XML element".to_owned()),
        E::UnclosedRootNode => {
            ends_early("unexpected end of the file before its outermost element is closed")
        }
        E::UnexpectedEndOfStream => ends_early("unexpected end of the file within an element"),
        _ if !text.trim_start().starts_with('<') => {
            let start: String = text.trim_start().chars().take(20).collect();
            (
                Some(0),
                format!("found no XML: the file starts with {}, expected \"<\"", quote(&start)),
            )
        }
        E::DtdDetected => (
            text.find("<!DOCTYPE"),
            "document type definitions are rejected because they can expand a small file \
             enormously; remove the <!DOCTYPE …>"
                .to_owned(),
        ),
        E::NodesLimitReached => {
            (Some(0), format!("more than {most_nodes} elements and texts; such files are rejected"))
        }
        E::UnexpectedCloseTag(expected, actual, _) => {
            (None, format!("found </{actual}>, expected </{expected}>"))
        }
        _ => {
            let message = error.to_string();
            let message = message.replace(&format!(" at {}", error.pos()), "");
            (None, format!("malformed XML: {message}"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_count_tags_and_nothing_else() {
        let siblings = "<b c='>' d=\"<'\"/><b></b>".repeat(MAX_DEPTH + 1);
        let comments = "<!-- <a> --><![CDATA[<a>]]><?x <a> ?>".repeat(MAX_DEPTH + 1);
        assert_eq!(check_limits(&format!("<a>{siblings}{comments}</a>"), MAX_DEPTH), Ok(()));
        let nested = |depth| "<a b='/'>".repeat(depth) + &"</a>".repeat(depth);
        assert_eq!(check_limits(&nested(MAX_DEPTH), MAX_DEPTH), Ok(()));
        let (offset, _) = check_limits(&nested(MAX_DEPTH + 1), MAX_DEPTH).expect_err("too deep");
        assert_eq!(offset, MAX_DEPTH * "<a b='/'>".len());
        assert_eq!(
            check_limits("<a <b 'c", MAX_DEPTH),
            Ok(()),
            "broken files are the parser's business"
        );
    }
}
