//! Materials with textures or several lobes: evaluation to one lobe at a surface point.
//!
//! ```text
//! Material ─ textures, sides, chance ─▶ one lobe with its parameters, normal and tangent
//! ```
//!
//! Mixtures select one of their parts by a random number of the path, so that the mean is that of
//! both.

use std::ops::Range;
use std::sync::Arc;

use pt_math::{Frame, Spectrum, Vec2, Vec3};
use pt_scene::hair;
use pt_scene::material::Averted;

use crate::bsdf::{Diffuse, LobeRecord, MetallicRoughness, Orientation, Shadowing};
use crate::id::{Id, Table};
use crate::interaction::Interaction;
use crate::texture::Textures;
use crate::texture_eval_context::TextureEvalContext;
use crate::texture_record::{FloatTexture, TextureRecord};

/// A material, or a part of one.
#[derive(Clone, Copy, Debug)]
pub enum Material {
    /// One lobe.
    Lobe(LobeMaterial),
    /// The second material with the probability `amount`, otherwise the first.
    Mix {
        /// Material for an amount of 0.
        first: Id<Material>,
        /// Material for an amount of 1.
        second: Id<Material>,
        /// Weight of the second material.
        amount: FloatTexture,
    },
    /// One material for each side of the true surface.
    TwoSided {
        /// Material of the front.
        front: Id<Material>,
        /// Material of the back.
        back: Id<Material>,
    },
    /// A material with a normal or bump map.
    SurfaceDetail {
        /// The material.
        surface: Id<Material>,
        /// The normal or bump map.
        relief: NormalOrBumpRecord,
        /// See [`pt_scene::material::SurfaceDetail`].
        shadowing: bool,
        /// See [`pt_scene::material::SurfaceDetail`].
        averted: Averted,
        /// See [`pt_scene::material::SurfaceDetail`].
        mirrored: bool,
    },
}

/// A lobe with textured parameters.
#[derive(Clone, Copy, Debug)]
pub struct LobeMaterial {
    /// The lobe; the values of its textured parameters are replaced.
    pub lobe: Id<LobeRecord>,
    /// True if the back side scatters as the front side does.
    pub two_sided: bool,
    /// True if the lobe depends on the tangent of the surface.
    pub oriented: bool,
    /// Coefficients of ∂p/∂u and ∂p/∂v of the tangent; `None` means ∂p/∂u.
    pub along: Option<Id<TextureRecord>>,
    /// Normals of the clear coat; `None` means those of the lobe.
    pub coat: Option<CoatRecord>,
    /// Begin and end of its [`TextureSlot`]s.
    pub slots: [u32; 2],
}

/// Normals of a clear coat; see [`pt_scene::material::CoatNormals`].
#[derive(Clone, Copy, Debug)]
pub enum CoatRecord {
    /// Normals of the shape.
    Shape,
    /// Normals of the shape with a normal or bump map.
    Relief(NormalOrBumpRecord),
}

/// Textured parameters of a lobe.
#[derive(Clone, Copy, Debug)]
pub struct TextureSlot {
    /// The texture.
    pub texture: Id<TextureRecord>,
    /// Index of the first parameter.
    pub first: u32,
    /// Conversion of the colour of the texture.
    pub kind: SlotKind,
}

/// Conversion from the colour of a texture to parameters of a lobe.
#[derive(Clone, Copy, Debug)]
pub enum SlotKind {
    /// Three parameters: the colour, clamped to [0, 1].
    Weight,
    /// Three parameters: the colour, clamped to at least 0.
    Color,
    /// Three parameters: absorption of fibres that together have the colour.
    Absorption {
        /// See [`pt_scene::hair::slope`].
        slope: f32,
    },
    /// One parameter: the luminance, clamped to bounds.
    Number {
        /// Lower bound.
        least: f32,
        /// Upper bound.
        most: f32,
    },
}

/// A normal or bump map; see [`pt_scene::texture::NormalOrBump`].
#[derive(Clone, Copy, Debug)]
pub enum NormalOrBumpRecord {
    /// Normal map, and the direction of (u, v) that is +x of its frame.
    Normals(Id<TextureRecord>, Vec2),
    /// Normal map, and a texture of the direction of (u, v) that is +x of its frame.
    NormalsAlong(Id<TextureRecord>, Id<TextureRecord>),
    /// Bump map, with heights in metres per luminance.
    Heights(Id<TextureRecord>, f32),
}

/// All materials with textures or several lobes.
#[derive(Clone, Default)]
pub struct Materials {
    /// Materials and their parts.
    pub table: Table<Material>,
    /// Textured parameters of lobes.
    pub slots: Vec<TextureSlot>,
    /// The textures.
    pub textures: Arc<Textures>,
}

/// A material evaluated at a point.
#[derive(Clone, Copy, Debug)]
pub struct EvaluatedMaterial {
    /// The lobe.
    pub lobe: LobeRecord,
    /// True if the back side scatters as the front side does.
    pub two_sided: bool,
    /// Normal, tangent and shadowing.
    pub orientation: Orientation,
}

impl LobeMaterial {
    /// Returns true if the lobe is constant and isotropic.
    pub(crate) fn is_plain(&self) -> bool {
        !self.oriented && self.coat.is_none() && self.slots[0] == self.slots[1]
    }

    fn slots(&self) -> Range<usize> {
        self.slots[0] as usize..self.slots[1] as usize
    }
}

impl Materials {
    /// Returns true if any material is a mixture.
    pub fn is_stochastic(&self) -> bool {
        self.table.as_slice().iter().any(|m| matches!(m, Material::Mix { .. }))
    }

    /// Evaluates a material at a point with the unit shading normal `normal`. The unit vector
    /// `side` is on the front; `choice` from [0, 1) selects parts of mixtures.
    pub fn evaluate(
        &self,
        lobes: &Table<LobeRecord>,
        mut id: Id<Material>,
        at: &Interaction,
        [normal, side]: [Vec3; 2],
        parametrization: &TextureEvalContext,
        mut choice: f32,
    ) -> EvaluatedMaterial {
        let mut view = ViewedSurface::new(at.wo, normal, side);
        loop {
            match self.table[id] {
                Material::Lobe(material) => {
                    let mut lobe = if view.sees_nothing {
                        Diffuse { rho: Spectrum::ZERO }.into()
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
                Material::Mix { first, second, amount } => {
                    let amount = self.textures.number(amount, parametrization).clamp(0.0, 1.0);
                    (id, choice) = if choice < amount {
                        (second, choice / amount)
                    } else {
                        (first, (choice - amount) / (1.0 - amount))
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

    /// Tangent of the lobe's frame; `None` if the lobe is isotropic, or the surface has no tangent.
    fn tangent(&self, material: &LobeMaterial, at: &TextureEvalContext) -> Option<Vec3> {
        let u = material.oriented.then_some(at.along_u).flatten()?;
        let Some(along) = material.along else { return Some(u) };
        let [a, b, _] = self.textures.color(along, at).to_array();
        Some(u * a + at.along_v.unwrap_or(Vec3::ZERO) * b)
    }

    /// A lobe with its textured parameters evaluated at a point.
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

    /// Normal of a normal or bump map on a surface with unit normal `n`, which is returned if the
    /// surface has no texture coordinates. [Heights: Blinn 1978, "Simulation of Wrinkled Surfaces"]
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

/// View of a surface, which normal and bump maps modify.
struct ViewedSurface {
    /// Current unit normal.
    normal: Vec3,
    /// Direction to the viewer.
    wo: Vec3,
    /// True if the viewer is behind the surface.
    is_behind: bool,
    /// Normal about whose plane the view is mirrored; `None` if it is not.
    mirror: Option<Vec3>,
    shadowing: Option<Shadowing>,
    is_for_viewer: bool,
    /// True if a normal faces away from the viewer and the surface is therefore black.
    sees_nothing: bool,
}

impl ViewedSurface {
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

    /// Mirrors a view from behind to the front.
    fn mirror(&mut self) {
        if self.is_behind && self.mirror.is_none() {
            self.mirror = Some(self.normal);
            self.wo -= self.normal * (2.0 * self.normal.dot(self.wo));
            self.is_behind = false;
        }
    }

    /// Applies the unit normal of a normal or bump map.
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

    /// Orientation of the lobe. Lobes flip the normal of a back side, and a normal that was
    /// mirrored and then flipped was rotated by half a turn.
    fn orientation(&self, tangent: Option<Vec3>) -> Orientation {
        let normal = self.mirror.map_or(self.normal, |axis| half_turn(self.normal, axis));
        Orientation {
            shadowing: self.shadowing.unwrap_or_default(),
            is_for_viewer: self.is_for_viewer,
            ..Orientation::plain(normal, tangent)
        }
    }
}

/// Rotates a direction by half a turn about a unit axis.
fn half_turn(v: Vec3, axis: Vec3) -> Vec3 {
    axis * (2.0 * axis.dot(v)) - v
}
