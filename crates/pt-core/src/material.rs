//! Materials that are not the same everywhere: from a surface point to the lobe there.
//!
//! ```text
//! Material ─ textures, sides, chance ─▶ one lobe with its parameters, normal and tangent
//! ```
//!
//! Mixtures choose one of their parts by a number of the path: what both would scatter on average.

use std::ops::Range;
use std::sync::Arc;

use pt_math::{Frame, Spectrum, Vec2, Vec3};
use pt_scene::hair;
use pt_scene::material::Averted;

use crate::bsdf::{AnyLobe, Diffuse, LobeRecord, MetallicRoughness, Orientation, Shadowing};
use crate::id::{Id, Table};
use crate::scene::Interaction;
use crate::texture::{FloatTexture, TextureRecord, Textures};
use crate::texture_eval_context::TextureEvalContext;

/// A material, or a part of one.
#[derive(Clone, Copy, Debug)]
pub enum Material {
    /// One lobe.
    Lobe(LobeMaterial),
    /// The second with the probability `share`, else the first.
    Mix {
        /// Where the share is 0.
        first: Id<Material>,
        /// Where the share is 1.
        second: Id<Material>,
        /// Share of the second.
        share: FloatTexture,
    },
    /// One for each side of the true surface.
    TwoSided {
        /// Seen from its front.
        front: Id<Material>,
        /// Seen from behind.
        back: Id<Material>,
    },
    /// One with other normals.
    SurfaceDetail {
        /// What it is made of.
        surface: Id<Material>,
        /// Its normals.
        relief: NormalOrBumpRecord,
        /// See [`pt_scene::material::SurfaceDetail`].
        shadowing: bool,
        /// See [`pt_scene::material::SurfaceDetail`].
        averted: Averted,
        /// See [`pt_scene::material::SurfaceDetail`].
        mirrored: bool,
    },
}

/// A lobe, and which of its parameters vary.
#[derive(Clone, Copy, Debug)]
pub struct LobeMaterial {
    /// The lobe; its parameters that vary have any value.
    pub lobe: Id<LobeRecord>,
    /// True if the back side scatters as the front side does.
    pub two_sided: bool,
    /// True if it matters which way the frame of the surface is turned.
    pub oriented: bool,
    /// The shares of ∂p/∂u and ∂p/∂v of the direction to which it is turned, if that is not u.
    pub along: Option<Id<TextureRecord>>,
    /// Which normals its clear coat has, if not those of the lobe.
    pub coat: Option<CoatRecord>,
    /// Where its [`Slot`]s begin, and end.
    pub slots: [u32; 2],
}

/// Normals of a clear coat; see [`pt_scene::material::CoatNormals`].
#[derive(Clone, Copy, Debug)]
pub enum CoatRecord {
    /// Those of the shape.
    Shape,
    /// Those of the shape with a relief.
    Relief(NormalOrBumpRecord),
}

/// Parameters of a lobe that a texture gives.
#[derive(Clone, Copy, Debug)]
pub struct Slot {
    /// The texture.
    pub texture: Id<TextureRecord>,
    /// The first of the parameters.
    pub first: u32,
    /// What becomes of the texture's colour.
    pub kind: SlotKind,
}

/// What a texture gives a lobe.
#[derive(Clone, Copy, Debug)]
pub enum SlotKind {
    /// Three parameters: its colour, with channels from 0 to 1.
    Weight,
    /// Three parameters: its colour, with channels from 0 up.
    Color,
    /// Three parameters: what fibres absorb that have its colour together.
    Absorption {
        /// See [`pt_scene::hair::slope`].
        slope: f32,
    },
    /// One parameter: its luminance, within these bounds.
    Number {
        /// The least.
        least: f32,
        /// The greatest.
        most: f32,
    },
}

/// How normals differ from those of the shape; see [`pt_scene::texture::NormalOrBump`].
#[derive(Clone, Copy, Debug)]
pub enum NormalOrBumpRecord {
    /// By colours, and the direction of (u, v) that is +x of their frame.
    Normals(Id<TextureRecord>, Vec2),
    /// By colours, and a texture of these directions.
    NormalsAlong(Id<TextureRecord>, Id<TextureRecord>),
    /// By heights, in metres per luminance.
    Heights(Id<TextureRecord>, f32),
}

/// All materials that vary.
#[derive(Default)]
pub struct Materials {
    /// Materials and their parts.
    pub table: Table<Material>,
    /// Parameters of lobes that textures give.
    pub slots: Vec<Slot>,
    /// The textures.
    pub textures: Arc<Textures>,
}

/// The scattering at a point.
#[derive(Clone, Copy, Debug)]
pub struct EvaluatedMaterial {
    /// The lobe.
    pub lobe: LobeRecord,
    /// True if the back side scatters as the front side does.
    pub two_sided: bool,
    /// Normal and tangent.
    pub orientation: Orientation,
}

impl LobeMaterial {
    /// Returns true if it is the same everywhere.
    pub(crate) fn is_plain(&self) -> bool {
        !self.oriented && self.coat.is_none() && self.slots[0] == self.slots[1]
    }

    fn slots(&self) -> Range<usize> {
        self.slots[0] as usize..self.slots[1] as usize
    }
}

impl Materials {
    /// Returns true if some material chooses by chance.
    pub fn is_stochastic(&self) -> bool {
        self.table.as_slice().iter().any(|m| matches!(m, Material::Mix { .. }))
    }

    /// The scattering of a material at a point with the unit shading normal `normal`, where the
    /// unit vector `side` is on the front; `choice` from [0, 1) makes its choices.
    pub fn evaluate(
        &self,
        lobes: &Table<LobeRecord>,
        mut id: Id<Material>,
        at: &Interaction,
        [normal, side]: [Vec3; 2],
        parametrization: &TextureEvalContext,
        mut choice: f32,
    ) -> EvaluatedMaterial {
        let mut view = View::new(at.wo, normal, side);
        loop {
            match self.table[id] {
                Material::Lobe(material) => {
                    let mut lobe = if view.sees_nothing {
                        AnyLobe::from(Diffuse { rho: Spectrum::ZERO }).record()
                    } else {
                        self.lobe(lobes, &material, parametrization)
                    };
                    let tangent = self.tangent(&material, parametrization);
                    let orientation = view.orientation(tangent);
                    if let Some(coat) = material.coat
                        && !view.sees_nothing
                    {
                        let above = match coat {
                            CoatRecord::Shape => normal,
                            CoatRecord::Relief(relief) => {
                                self.perturbed_normal(relief, normal, parametrization)
                            }
                        };
                        let is_back = material.two_sided && at.wo.dot(side) < 0.0;
                        let place = orientation.place_of(above, is_back);
                        let first = MetallicRoughness::COAT_NORMAL;
                        lobe.parameters_mut()[first..first + 2].copy_from_slice(&place);
                    }
                    return EvaluatedMaterial { lobe, two_sided: material.two_sided, orientation };
                }
                Material::Mix { first, second, share } => {
                    let share = self.textures.number(share, parametrization).clamp(0.0, 1.0);
                    (id, choice) = if choice < share {
                        (second, choice / share)
                    } else {
                        (first, (choice - share) / (1.0 - share))
                    };
                }
                Material::TwoSided { front, back } => {
                    id = if at.wo.dot(side) < 0.0 { back } else { front };
                }
                Material::SurfaceDetail { surface, relief, shadowing, averted, mirrored } => {
                    if mirrored {
                        view.mirror();
                    }
                    let bent = self.perturbed_normal(relief, view.normal, parametrization);
                    view.bend(bent, averted, shadowing);
                    id = surface;
                }
            }
        }
    }

    /// The direction to which the frame of a lobe is turned, if it matters and there is one.
    fn tangent(&self, material: &LobeMaterial, at: &TextureEvalContext) -> Option<Vec3> {
        let u = material.oriented.then_some(at.along_u).flatten()?;
        let Some(along) = material.along else { return Some(u) };
        let [a, b, _] = self.textures.color(along, at).to_array();
        Some(u * a + at.along_v.unwrap_or(Vec3::ZERO) * b)
    }

    /// A lobe with the parameters that textures give it at a point.
    fn lobe(
        &self,
        lobes: &Table<LobeRecord>,
        material: &LobeMaterial,
        at: &TextureEvalContext,
    ) -> LobeRecord {
        let mut lobe = lobes[material.lobe];
        for slot in &self.slots[material.slots()] {
            let color = self.textures.color(slot.texture, at);
            let first = slot.first as usize;
            match slot.kind {
                SlotKind::Weight => {
                    let share = color.0.clamp(Vec3::ZERO, Vec3::ONE).to_array();
                    lobe.parameters_mut()[first..first + 3].copy_from_slice(&share);
                }
                SlotKind::Color => {
                    let color = color.0.max(Vec3::ZERO).to_array();
                    lobe.parameters_mut()[first..first + 3].copy_from_slice(&color);
                }
                SlotKind::Absorption { slope } => {
                    let absorption = hair::absorption(color.to_array(), slope);
                    lobe.parameters_mut()[first..first + 3].copy_from_slice(&absorption);
                }
                SlotKind::Number { least, most } => {
                    lobe.parameters_mut()[first] = color.luminance().clamp(least, most);
                }
            }
        }
        lobe
    }

    /// The normal of a relief on a surface with unit normal `n`; that one where the surface has no
    /// texture coordinates. [Heights: Blinn 1978, "Simulation of Wrinkled Surfaces"]
    fn perturbed_normal(
        &self,
        relief: NormalOrBumpRecord,
        n: Vec3,
        at: &TextureEvalContext,
    ) -> Vec3 {
        let by_colors = |texture, along: Vec2| {
            let [x, y, z] = self.textures.color(texture, at).map(|c| 2.0 * c - 1.0).to_array();
            let u = at.along_u?;
            let tangent = u * along.x + at.along_v.unwrap_or(Vec3::ZERO) * along.y;
            Some(Frame::from_normal_and_tangent(n, tangent).to_world(Vec3::new(x, y, z)))
        };
        let bent = match relief {
            NormalOrBumpRecord::Normals(texture, along) => by_colors(texture, along),
            NormalOrBumpRecord::NormalsAlong(texture, along) => {
                let [a, b, _] = self.textures.color(along, at).to_array();
                by_colors(texture, Vec2::new(a, b))
            }
            NormalOrBumpRecord::Heights(texture, scale) => {
                let (u, v) = match (at.along_u, at.along_v) {
                    (Some(u), Some(v)) => (u, v),
                    _ if self.textures.is_in_space(texture) => n.any_orthonormal_pair(),
                    _ => return n,
                };
                let at = TextureEvalContext { along_u: Some(u), along_v: Some(v), ..*at };
                let slope = self.textures.gradient(texture, &at) * scale;
                let u = u + n * (slope.x - n.dot(u));
                let v = v + n * (slope.y - n.dot(v));
                let bent = u.cross(v);
                Some(if bent.dot(n) < 0.0 { -bent } else { bent })
            }
        };
        bent.and_then(Vec3::try_normalize).unwrap_or(n)
    }
}

/// How a surface is seen while its reliefs bend its normal.
struct View {
    /// Unit normal so far.
    normal: Vec3,
    /// Where it is seen from.
    wo: Vec3,
    /// True if that is behind it.
    is_behind: bool,
    /// The normal across whose plane all is mirrored, if it is.
    mirror: Option<Vec3>,
    shadowing: Option<Shadowing>,
    is_for_viewer: bool,
    /// True if a normal looks away from the viewer, who then sees nothing.
    sees_nothing: bool,
}

impl View {
    fn new(wo: Vec3, normal: Vec3, side: Vec3) -> Self {
        Self {
            normal,
            wo,
            is_behind: wo.dot(side) < 0.0,
            mirror: None,
            shadowing: None,
            is_for_viewer: false,
            sees_nothing: false,
        }
    }

    /// Sees the back as the mirror image of the front.
    fn mirror(&mut self) {
        if self.is_behind && self.mirror.is_none() {
            self.mirror = Some(self.normal);
            self.wo -= self.normal * (2.0 * self.normal.dot(self.wo));
            self.is_behind = false;
        }
    }

    /// Takes a relief's unit normal.
    fn bend(&mut self, bent: Vec3, averted: Averted, shadows: bool) {
        if shadows && self.shadowing.is_none() {
            self.shadowing = Some(Shadowing::new(self.normal, bent));
        }
        let faces = if self.is_behind { -1.0 } else { 1.0 };
        let is_averted = bent.dot(self.wo) * faces <= 0.0;
        self.normal = match averted {
            Averted::Turned if is_averted => {
                self.is_for_viewer = true;
                half_turn(bent, self.normal)
            }
            Averted::Black if is_averted => {
                self.sees_nothing = true;
                bent
            }
            _ => bent,
        };
    }

    /// The orientation of the lobe. From behind, lobes see a normal from its other side, and what
    /// was mirrored and then turned to the other side was turned by half a turn.
    fn orientation(&self, tangent: Option<Vec3>) -> Orientation {
        let normal = self.mirror.map_or(self.normal, |axis| half_turn(self.normal, axis));
        Orientation {
            shadowing: self.shadowing.unwrap_or_default(),
            is_for_viewer: self.is_for_viewer,
            ..Orientation::plain(normal, tangent)
        }
    }
}

/// A direction after half a turn about a unit axis.
fn half_turn(v: Vec3, axis: Vec3) -> Vec3 {
    axis * (2.0 * axis.dot(v)) - v
}
