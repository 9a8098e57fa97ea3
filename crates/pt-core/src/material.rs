//! Materials that are not the same everywhere: from a surface point to the lobe there.
//!
//! ```text
//! Material ─ textures, sides, chance ─▶ one lobe with its parameters, normal and tangent
//! ```
//!
//! Mixtures choose one of their parts by a number of the path: what both would scatter on average.

use std::ops::Range;
use std::sync::Arc;

use pt_math::{Frame, Vec3};
use pt_scene::hair;

use crate::bsdf::{LobeRecord, Orientation};
use crate::id::{Id, Table};
use crate::parametrization::Parametrization;
use crate::scene::Interaction;
use crate::texture::{TextureRecord, Textures, Varying};

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
        share: Varying,
    },
    /// One for each side of the true surface.
    Sided {
        /// Seen from its front.
        front: Id<Material>,
        /// Seen from behind.
        back: Id<Material>,
    },
    /// One with other normals.
    Embossed {
        /// What it is made of.
        surface: Id<Material>,
        /// Its normals.
        relief: ReliefRecord,
    },
}

/// A lobe, and which of its parameters vary.
#[derive(Clone, Copy, Debug)]
pub struct LobeMaterial {
    /// The lobe; its parameters that vary have any value.
    pub lobe: Id<LobeRecord>,
    /// Whether the back side scatters as the front side does.
    pub two_sided: bool,
    /// Whether it matters which way the frame of the surface is turned.
    pub oriented: bool,
    /// Where its [`Slot`]s begin, and end.
    pub slots: [u32; 2],
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
    Share,
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

/// How normals differ from those of the shape; see [`pt_scene::texture::Relief`].
#[derive(Clone, Copy, Debug)]
pub enum ReliefRecord {
    /// By colours.
    Normals(Id<TextureRecord>),
    /// By heights, in metres per luminance.
    Heights(Id<TextureRecord>, f32),
}

/// All materials that vary.
#[derive(Default)]
pub struct Materials {
    /// Materials and their parts.
    pub table: Table<Material>,
    /// What textures give to lobes.
    pub slots: Vec<Slot>,
    /// The textures.
    pub textures: Arc<Textures>,
}

/// The scattering at a point.
#[derive(Clone, Copy, Debug)]
pub struct Resolved {
    /// The lobe.
    pub lobe: LobeRecord,
    /// Whether the back side scatters as the front side does.
    pub two_sided: bool,
    /// Normal and tangent.
    pub orientation: Orientation,
}

impl LobeMaterial {
    /// Whether it is the same everywhere.
    pub(crate) fn is_plain(&self) -> bool {
        !self.oriented && self.slots[0] == self.slots[1]
    }

    fn slots(&self) -> Range<usize> {
        self.slots[0] as usize..self.slots[1] as usize
    }
}

impl Materials {
    /// Whether some material chooses by chance.
    pub fn choose(&self) -> bool {
        self.table.as_slice().iter().any(|m| matches!(m, Material::Mix { .. }))
    }

    /// The scattering of a material at a point with the unit shading normal `normal`; `choice` from
    /// [0, 1) makes its choices.
    pub fn resolve(
        &self,
        lobes: &Table<LobeRecord>,
        mut id: Id<Material>,
        at: &Interaction,
        normal: Vec3,
        parametrization: &Parametrization,
        mut choice: f32,
    ) -> Resolved {
        let mut normal = normal;
        loop {
            match self.table[id] {
                Material::Lobe(material) => {
                    return Resolved {
                        lobe: self.lobe(lobes, &material, parametrization),
                        two_sided: material.two_sided,
                        orientation: Orientation {
                            normal,
                            tangent: material.oriented.then_some(parametrization.along_u).flatten(),
                        },
                    };
                }
                Material::Mix { first, second, share } => {
                    let share = self.textures.number(share, parametrization).clamp(0.0, 1.0);
                    (id, choice) = if choice < share {
                        (second, choice / share)
                    } else {
                        (first, (choice - share) / (1.0 - share))
                    };
                }
                Material::Sided { front, back } => {
                    id = if at.wo.dot(at.point.normal) < 0.0 { back } else { front };
                }
                Material::Embossed { surface, relief } => {
                    normal = self.embossed(relief, normal, parametrization);
                    id = surface;
                }
            }
        }
    }

    /// A lobe with the parameters that textures give it at a point.
    fn lobe(
        &self,
        lobes: &Table<LobeRecord>,
        material: &LobeMaterial,
        at: &Parametrization,
    ) -> LobeRecord {
        let mut lobe = lobes[material.lobe];
        for slot in &self.slots[material.slots()] {
            let color = self.textures.color(slot.texture, at);
            let first = slot.first as usize;
            match slot.kind {
                SlotKind::Share => {
                    let share = color.0.clamp(Vec3::ZERO, Vec3::ONE).to_array();
                    lobe.parameters_mut()[first..first + 3].copy_from_slice(&share);
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
    fn embossed(&self, relief: ReliefRecord, n: Vec3, at: &Parametrization) -> Vec3 {
        let bent = match relief {
            ReliefRecord::Normals(texture) => {
                let [x, y, z] = self.textures.color(texture, at).map(|c| 2.0 * c - 1.0).to_array();
                let Some(tangent) = at.along_u else { return n };
                Frame::from_normal_and_tangent(n, tangent).to_world(Vec3::new(x, y, z))
            }
            ReliefRecord::Heights(texture, scale) => {
                let (u, v) = match (at.along_u, at.along_v) {
                    (Some(u), Some(v)) => (u, v),
                    _ if self.textures.is_in_space(texture) => n.any_orthonormal_pair(),
                    _ => return n,
                };
                let at = Parametrization { along_u: Some(u), along_v: Some(v), ..*at };
                let slope = self.textures.gradient(texture, &at) * scale;
                let u = u + n * (slope.x - n.dot(u));
                let v = v + n * (slope.y - n.dot(v));
                let bent = u.cross(v);
                if bent.dot(n) < 0.0 { -bent } else { bent }
            }
        };
        bent.try_normalize().unwrap_or(n)
    }
}
