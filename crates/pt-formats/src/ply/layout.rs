//! Properties of an element, and the roles in which they are read.

use ply_rs_bw::ply::{ElementDef, PropertyType, ScalarType};

/// Names of the properties of a texture coordinate.
const UV_NAMES: [[&str; 2]; 3] = [["u", "v"], ["s", "t"], ["texture_u", "texture_v"]];
/// Names of the properties of a colour.
const COLOR_NAMES: [[&str; 3]; 2] = [["r", "g", "b"], ["red", "green", "blue"]];
/// Names of the list of corners of a face.
const CORNER_NAMES: [&str; 2] = ["vertex_indices", "vertex_index"];

/// Numeric types, named as in the parser of headers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NumberType {
    Char,
    UChar,
    Short,
    UShort,
    Int,
    UInt,
    Float,
    Double,
}

impl NumberType {
    fn of(kind: &ScalarType) -> Self {
        match kind {
            ScalarType::Char => Self::Char,
            ScalarType::UChar => Self::UChar,
            ScalarType::Short => Self::Short,
            ScalarType::UShort => Self::UShort,
            ScalarType::Int => Self::Int,
            ScalarType::UInt => Self::UInt,
            ScalarType::Float => Self::Float,
            ScalarType::Double => Self::Double,
        }
    }

    /// Returns the size in a binary file, in bytes.
    pub(super) fn size(self) -> usize {
        match self {
            Self::Char | Self::UChar => 1,
            Self::Short | Self::UShort => 2,
            Self::Int | Self::UInt | Self::Float => 4,
            Self::Double => 8,
        }
    }

    fn is_real(self) -> bool {
        matches!(self, Self::Float | Self::Double)
    }

    /// Returns the maximum of a colour channel; 1 for real numbers. Signed integers are no colours.
    fn levels(self) -> Option<f32> {
        match self {
            Self::Float | Self::Double => Some(1.0),
            Self::UChar => Some(f32::from(u8::MAX)),
            Self::UShort => Some(f32::from(u16::MAX)),
            Self::UInt => Some(u32::MAX as f32),
            Self::Char | Self::Short | Self::Int => None,
        }
    }
}

/// Type of a property: one number, or a list, with the types of its length and its items.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PropertyKind {
    Scalar(NumberType),
    List(NumberType, NumberType),
}

/// Name of the list of texture coordinates of the corners of a face, and of the index of its image.
const COORDINATES_NAME: &str = "texcoord";
pub(super) const IMAGE_NAME: &str = "texnumber";

/// Slots of the numbers of a row: position, normal, texture coordinate, colour and image.
pub(super) const POSITION: usize = 0;
pub(super) const NORMAL: usize = 3;
pub(super) const UV: usize = 6;
pub(super) const COLOR: usize = 8;
pub(super) const IMAGE: usize = 11;
/// Number of slots of a row.
pub(super) const SLOTS: usize = 12;

/// Role of a property.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum PropertyRole {
    /// Ignored.
    Nothing,
    /// A number of the row, with its slot, divided by `levels`.
    Slot { slot: usize, levels: f32 },
    /// Corners of a face or of a strip.
    Corners,
    /// Texture coordinates of the corners of a face.
    Coordinates,
}

/// A property.
#[derive(Clone, Debug)]
pub(super) struct PlyProperty {
    pub(super) kind: PropertyKind,
    pub(super) role: PropertyRole,
}

/// Properties of an element, in file order.
#[derive(Debug)]
pub(super) struct ElementLayout<'a> {
    pub(super) element: &'a ElementDef,
    pub(super) fields: Vec<PlyProperty>,
    /// Maximum of a colour channel, if there are colours: 1 for real numbers.
    levels: Option<f32>,
    /// The first property whose type does not match its role, and that type.
    pub(super) unsupported: Option<(&'a str, PropertyKind)>,
}

impl<'a> ElementLayout<'a> {
    pub(super) fn new(element: &'a ElementDef) -> Self {
        let mut unsupported = None;
        let field = |(name, property): (&'a String, &'a ply_rs_bw::ply::PropertyDef)| {
            let kind = match &property.data_type {
                PropertyType::Scalar(kind) => PropertyKind::Scalar(NumberType::of(kind)),
                PropertyType::List(count, of) => {
                    PropertyKind::List(NumberType::of(count), NumberType::of(of))
                }
            };
            let role = role(&element.name, name, kind).unwrap_or_else(|| {
                unsupported.get_or_insert((name.as_str(), kind));
                PropertyRole::Nothing
            });
            PlyProperty { kind, role }
        };
        let fields = element.properties.iter().map(field).collect();
        let levels = levels_of_colors(element);
        Self { element, fields, levels, unsupported }
    }

    /// Assigns the colour channels to the properties of these names, and to no others; integers are
    /// not scaled.
    pub(super) fn show(&mut self, names: &[String]) {
        let colors = COLOR..COLOR + 3;
        for ((name, _), field) in self.element.properties.iter().zip(&mut self.fields) {
            if let Some(channel) = names.iter().position(|shown| shown == name) {
                field.role = PropertyRole::Slot { slot: COLOR + channel, levels: 1.0 };
            } else if matches!(field.role, PropertyRole::Slot { slot, .. } if colors.contains(&slot))
            {
                field.role = PropertyRole::Nothing;
            }
        }
        self.levels = (!names.is_empty()).then_some(1.0);
    }

    /// Creates the layout of an element with only the properties of these names, each in the slot
    /// of its position in the list.
    pub(super) fn of_columns(element: &'a ElementDef, names: &[&str]) -> Self {
        let mut layout = Self::passed_over(element);
        for (name, field) in element.properties.keys().zip(&mut layout.fields) {
            if let Some(slot) = names.iter().position(|column| column == name) {
                field.role = PropertyRole::Slot { slot, levels: 1.0 };
            }
        }
        layout
    }

    /// Creates the layout of an element of which nothing is read.
    pub(super) fn passed_over(element: &'a ElementDef) -> Self {
        let mut layout = Self::new(element);
        layout.fields.iter_mut().for_each(|field| field.role = PropertyRole::Nothing);
        Self { unsupported: None, ..layout }
    }

    /// Returns true if the element has all properties of these names.
    pub(super) fn has(&self, names: &[&str]) -> bool {
        names.iter().all(|name| self.element.properties.contains_key(*name))
    }

    pub(super) fn has_uvs(&self) -> bool {
        UV_NAMES.iter().any(|names| self.has(names))
    }

    /// Returns true if faces have texture coordinates of their own.
    pub(super) fn has_coordinates(&self) -> bool {
        self.fields.iter().any(|field| field.role == PropertyRole::Coordinates)
    }

    pub(super) fn has_corners(&self) -> bool {
        CORNER_NAMES.iter().any(|name| self.has(&[name]))
    }

    /// Returns the maximum of a colour channel, if there are colours: 1 for real numbers.
    pub(super) fn color_levels(&self) -> Option<f32> {
        self.levels
    }

    /// Returns the size of a row of a binary file in bytes; `None` if it has lists.
    pub(super) fn stride(&self) -> Option<usize> {
        self.fields.iter().try_fold(0, |sum, field| match field.kind {
            PropertyKind::Scalar(kind) => Some(sum + kind.size()),
            PropertyKind::List(..) => None,
        })
    }

    /// Returns the minimum size of a row in bytes.
    pub(super) fn least_size(&self, is_text: bool) -> usize {
        let size = |field: &PlyProperty| match (field.kind, is_text) {
            (_, true) => 2, // "0 "
            (PropertyKind::Scalar(kind) | PropertyKind::List(kind, _), false) => kind.size(),
        };
        self.fields.iter().map(size).sum()
    }
}

/// See [`ElementLayout::color_levels`].
fn levels_of_colors(element: &ElementDef) -> Option<f32> {
    let of_channel = |name: &&str| match &element.properties.get(*name)?.data_type {
        PropertyType::Scalar(kind) => NumberType::of(kind).levels(),
        PropertyType::List(..) => None,
    };
    let of_all = |names: &[&str; 3]| {
        names.iter().map(of_channel).try_fold(1.0f32, |most, levels| Some(most.max(levels?)))
    };
    COLOR_NAMES.iter().find_map(of_all)
}

/// Returns the role of a property of this name in this element; `None` if its type is not allowed.
fn role(element: &str, name: &str, kind: PropertyKind) -> Option<PropertyRole> {
    let is_vertex = element == "vertex";
    if let Some(channel) = channel(name) {
        let levels = match kind {
            PropertyKind::Scalar(kind) => kind.levels(),
            PropertyKind::List(..) => None,
        };
        return Some(levels.map_or(PropertyRole::Nothing, |levels| PropertyRole::Slot {
            slot: COLOR + channel,
            levels,
        }));
    }
    if is_vertex {
        return match (vertex_slot(name), kind) {
            (None, _) => Some(PropertyRole::Nothing),
            (Some(slot), PropertyKind::Scalar(_)) => Some(PropertyRole::Slot { slot, levels: 1.0 }),
            (Some(_), PropertyKind::List(..)) => None,
        };
    }
    match kind {
        PropertyKind::Scalar(_) if name == IMAGE_NAME => {
            Some(PropertyRole::Slot { slot: IMAGE, levels: 1.0 })
        }
        PropertyKind::List(count, _) if name == COORDINATES_NAME && !count.is_real() => {
            Some(PropertyRole::Coordinates)
        }
        _ if !CORNER_NAMES.contains(&name) => Some(PropertyRole::Nothing),
        PropertyKind::List(count, of) if !count.is_real() && !of.is_real() => {
            Some(PropertyRole::Corners)
        }
        PropertyKind::List(..) | PropertyKind::Scalar(_) => None,
    }
}

/// Returns the slot of a property of a vertex that is no colour.
fn vertex_slot(name: &str) -> Option<usize> {
    Some(match name {
        "x" => POSITION,
        "y" => POSITION + 1,
        "z" => POSITION + 2,
        "nx" => NORMAL,
        "ny" => NORMAL + 1,
        "nz" => NORMAL + 2,
        "u" | "s" | "texture_u" => UV,
        "v" | "t" | "texture_v" => UV + 1,
        _ => return None,
    })
}

/// Returns the colour channel of a property of this name.
fn channel(name: &str) -> Option<usize> {
    match name {
        "r" | "red" => Some(0),
        "g" | "green" => Some(1),
        "b" | "blue" => Some(2),
        _ => None,
    }
}
