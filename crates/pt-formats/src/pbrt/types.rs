//! References to materials, placed shapes, and the media on both sides of surfaces.

use std::rc::Rc;
use std::sync::Arc;

use pt_math::DAffine3;
use pt_scene::texture::Input;
use pt_scene::{Geometry, Scalar};

use crate::pbrt::entity::Entity;
use crate::pbrt::position::TokenPosition;

/// Reference to the material of a shape.
#[derive(Clone, Debug)]
pub(super) enum MaterialName {
    /// Index of an unnamed material; 0 is the default.
    Anonymous(usize),
    /// Name of a material, which may be defined later, and the position of the reference.
    Named(Rc<str>, TokenPosition),
}

/// Index or name of a material.
pub(super) type MaterialKey = (usize, Option<Rc<str>>);

/// A shape with its graphics state.
#[derive(Clone)]
pub(super) struct PlacedShape {
    pub(super) name: String,
    pub(super) to_world: Moving,
    pub(super) geometry: Geometry,
    pub(super) material: MaterialName,
    /// Opacity.
    pub(super) alpha: Scalar,
    pub(super) light: Option<Rc<Entity>>,
    pub(super) media: Rc<MediumInterface>,
    pub(super) tube: Option<Tube>,
    pub(super) at: TokenPosition,
}

/// Maximum number of triangles of merged curves.
const MAX_JOINED: usize = 1 << 22;

impl PlacedShape {
    /// Merges a curve into the previous one if both have the same transform, material and media,
    /// since hair would otherwise consist of many shapes. Returns false if they differ.
    pub(super) fn joins(&mut self, curve: &Self) -> bool {
        let is_same_kind = [&*self, curve].iter().all(|p| p.name == "curve" && p.light.is_none())
            && self.to_world == curve.to_world
            && self.tube == curve.tube
            && key_of(&self.material) == key_of(&curve.material)
            && is_same(&self.alpha, &curve.alpha)
            && Rc::ptr_eq(&self.media, &curve.media);
        let (Geometry::Mesh(first), Geometry::Mesh(second)) = (&mut self.geometry, &curve.geometry)
        else {
            return false;
        };
        if !is_same_kind || first.triangles.len() + second.triangles.len() > MAX_JOINED {
            return false;
        }
        Arc::get_mut(first).is_some_and(|first| pt_scene::shapes::append(first, second))
    }
}

/// A curve that is a closed tube.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Tube {
    pub(super) is_inside_out: bool,
}

pub(super) fn key_of(name: &MaterialName) -> MaterialKey {
    match name {
        MaterialName::Anonymous(i) => (*i, None),
        MaterialName::Named(name, _) => (0, Some(Rc::clone(name))),
    }
}

/// Returns true if both inputs are the same value or the same texture.
pub(super) fn is_same(a: &Scalar, b: &Scalar) -> bool {
    match (a, b) {
        (Input::Value(a), Input::Value(b)) => a == b,
        (Input::Texture(a), Input::Texture(b)) => Arc::ptr_eq(a, b),
        _ => false,
    }
}

/// Names of the media on both sides of a surface; empty names are vacuum.
#[derive(Clone, Debug, Default)]
pub(super) struct MediumInterface {
    pub(super) inside: String,
    pub(super) outside: String,
    /// Position of the directive; `None` for the default.
    pub(super) at: Option<TokenPosition>,
}

/// A transform at the start and at the end of the motion.
pub(super) type Moving = [DAffine3; 2];
