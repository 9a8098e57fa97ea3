//! Converts the author's textures to those that renderers read, and to the parameters of lobes.

use std::collections::{BTreeSet, HashMap};
use std::sync::Arc;

use pt_math::{Affine2, DAffine3, DVec3, Mat3, Spectrum, Vec2};
use pt_scene::hair;
use pt_scene::image::Image;
use pt_scene::material::Surface;
use pt_scene::measured::Measurements;
use pt_scene::texture::{
    Bitmap, Blend, Color, Filter, Pattern, Procedural, Scalar, Texture, TextureMapping,
};

use super::reuse::Earlier;
use crate::bsdf::{self, LobeRecord, LobeTables, MeasuredTables};
use crate::id::{Id, Table};
use crate::image_texture::Texels;
use crate::material::{CoatRecord, LobeMaterial, Material, Materials, SlotKind, TextureSlot};
use crate::medium::WorldGrid;
use crate::procedural;
use crate::texture::{MeshColors, Textures};
use crate::texture_record::{
    Factor, FloatTexture, MappedPattern, MappedTexture, PatternRecord, TextureMappingRecord,
    TextureRecord,
};

/// Minimum roughness; below it, surfaces look smooth, but single precision is not sufficient.
pub(super) const MIN_ALPHA: f32 = 1e-3;
/// Maximum roughness; above it, the microfacet model is not valid.
const MAX_ALPHA: f32 = 10.0;

/// Mesh values that textures use, as indices of [`Lowering::mesh_values`].
pub(super) type ShownValues = BTreeSet<u32>;

/// Conversion of a material in place of the physical one; `None` where they are equal.
pub(super) type SurfaceConversion = fn(&Surface, &mut Lowering<'_>) -> Option<Material>;

/// Lobes, materials and textures compiled so far, and the state of the current material.
pub(super) struct Lowering<'a> {
    /// Conversion of materials that differ from the physical one.
    pub(super) conversion: SurfaceConversion,
    /// Metres per unit of the scene.
    pub(super) metres: f32,
    /// Earlier compilation, from which images and tables are taken over.
    earlier: Option<&'a Earlier>,
    pub(super) lobes: Table<LobeRecord>,
    pub(super) lobe_tables: LobeTables,
    /// Materials; their textures are in `textures`.
    pub(super) materials: Materials,
    textures: Textures,
    /// Compiled textures.
    known: HashMap<*const Texture, Id<TextureRecord>>,
    images: HashMap<*const Image, Id<Texels>>,
    /// Indices of the tables of measured materials.
    measured: HashMap<*const Measurements, u32>,
    /// Mesh values that textures used since [`Self::take_shown`].
    shown: ShownValues,
    /// Patterns of mesh values, without duplicates.
    pub(super) mesh_values: Vec<Pattern>,
    /// Slots of the next lobe.
    slots: Vec<TextureSlot>,
    oriented: bool,
    /// See [`LobeMaterial::along`].
    along: Option<Id<TextureRecord>>,
    /// Normals of the clear coat of the next lobe.
    coat: Option<CoatRecord>,
}

impl<'a> Lowering<'a> {
    pub(super) fn new(
        conversion: SurfaceConversion,
        metres: f32,
        earlier: Option<&'a Earlier>,
    ) -> Self {
        Self {
            conversion,
            metres,
            earlier,
            lobes: Table::default(),
            lobe_tables: LobeTables::default(),
            measured: HashMap::new(),
            materials: Materials::default(),
            textures: Textures::default(),
            known: HashMap::new(),
            images: HashMap::new(),
            shown: ShownValues::default(),
            mesh_values: Vec::new(),
            slots: Vec::new(),
            oriented: false,
            along: None,
            coat: None,
        }
    }

    /// Takes the mesh values that textures used since the last call.
    pub(super) fn take_shown(&mut self) -> ShownValues {
        std::mem::take(&mut self.shown)
    }

    /// Returns all lobes, tables and materials, with the colours of meshes.
    pub(super) fn finish(
        self,
        mut mesh_colors: Vec<MeshColors>,
    ) -> (Table<LobeRecord>, LobeTables, Materials) {
        mesh_colors.resize_with(self.mesh_values.len(), MeshColors::default);
        let textures = Arc::new(Textures { mesh_colors, ..self.textures });
        (self.lobes, self.lobe_tables, Materials { textures, ..self.materials })
    }

    /// Images and tables for the next compilation, by the addresses of their originals.
    pub(super) fn kept(
        &self,
    ) -> (HashMap<usize, Arc<Texels>>, HashMap<usize, Arc<MeasuredTables>>) {
        let texels = &self.textures.texels;
        let images = self.images.iter().map(|(of, id)| (of.addr(), Arc::clone(&texels[*id])));
        let tables = &self.lobe_tables.measured;
        let table = |number: u32| Arc::clone(&tables[number as usize]);
        let measured = self.measured.iter().map(|(of, number)| (of.addr(), table(*number)));
        (images.collect(), measured.collect())
    }

    /// Returns true if any texture or material uses texture coordinates.
    pub(super) fn uses_coordinates(&self) -> bool {
        let materials = self.materials.table.as_slice();
        let oriented = |m: &Material| matches!(m, Material::Lobe(l) if l.oriented);
        !self.known.is_empty() || materials.iter().any(oriented)
    }

    /// Adds a lobe, with the textured parameters added since the last one.
    pub(super) fn lobe(&mut self, lobe: impl Into<LobeRecord>, two_sided: bool) -> Material {
        self.stored(lobe.into(), two_sided)
    }

    /// Adds a measured lobe, whose tables are created once. A reflecting back side has the same x
    /// and y as the front, as in Mitsuba and pbrt-v4.
    pub(super) fn measured(&mut self, of: &Arc<Measurements>, two_sided: bool) -> Material {
        let tables = &mut self.lobe_tables.measured;
        let number = *self.measured.entry(Arc::as_ptr(of)).or_insert_with(|| {
            let known = self.earlier.and_then(|earlier| earlier.measured(of)).cloned();
            tables.push(known.unwrap_or_else(|| Arc::new(MeasuredTables::new(of))));
            tables.len() as u32 - 1
        });
        let lobe = bsdf::Measured::new(number, &tables[number as usize]);
        let [front, back] = [lobe, lobe.mirrored()].map(LobeRecord::from);
        let mut side = |record| {
            self.oriented = !of.is_isotropic();
            self.stored(record, two_sided)
        };
        if !two_sided || of.is_mirrored() {
            return side(front);
        }
        let [front, back] = [front, back].map(&mut side);
        let [front, back] = [front, back].map(|side| self.materials.table.push(side));
        Material::TwoSided { front, back }
    }

    fn stored(&mut self, lobe: LobeRecord, two_sided: bool) -> Material {
        let slots = &mut self.materials.slots;
        let first = slots.len() as u32;
        slots.append(&mut self.slots);
        Material::Lobe(LobeMaterial {
            lobe: self.lobes.push(lobe),
            two_sided,
            oriented: std::mem::take(&mut self.oriented),
            along: self.along.take(),
            coat: self.coat.take(),
            slots: [first, slots.len() as u32],
        })
    }

    /// Sets the normals of the clear coat of the next lobe.
    pub(super) fn coat(&mut self, normals: CoatRecord) {
        self.coat = Some(normals);
    }

    /// Marks the next lobe as anisotropic.
    pub(super) fn orient(&mut self) {
        self.oriented = true;
    }

    /// Sets the direction of the next lobe to another one than u.
    pub(super) fn orient_along(&mut self, along: &Arc<Texture>) {
        self.along = Some(self.texture(along));
    }

    /// A reflectance or transmittance, which the next lobe packs from `first` on.
    pub(super) fn share(&mut self, color: &Color, first: usize) -> Spectrum {
        match color {
            Color::Value(value) => (*value).into(),
            Color::Texture(texture) => {
                self.slot(texture, first, SlotKind::Weight);
                Spectrum::ONE
            }
        }
    }

    /// A non-negative colour, which the next lobe packs from `first` on.
    pub(super) fn color(&mut self, color: &Color, first: usize) -> Spectrum {
        match color {
            Color::Value(value) => (*value).into(),
            Color::Texture(texture) => {
                self.slot(texture, first, SlotKind::Color);
                Spectrum::ONE
            }
        }
    }

    /// Absorption coefficient of fibres that together have a colour, which the next lobe packs from
    /// `first` on; see [`hair::slope`].
    pub(super) fn absorption(&mut self, color: &Color, first: usize, slope: f32) -> Spectrum {
        match color {
            Color::Value(value) => hair::absorption(*value, slope).into(),
            Color::Texture(texture) => {
                self.slot(texture, first, SlotKind::Absorption { slope });
                Spectrum::ZERO
            }
        }
    }

    /// A roughness, which the next lobe packs as parameter `first`.
    pub(super) fn alpha(&mut self, alpha: &Scalar, first: usize) -> f32 {
        match alpha {
            Scalar::Value(alpha) => alpha.max(MIN_ALPHA),
            texture @ Scalar::Texture(_) => self.number(texture, first, [MIN_ALPHA, MAX_ALPHA]),
        }
    }

    /// A number within bounds, which the next lobe packs as parameter `first`.
    pub(super) fn number(&mut self, number: &Scalar, first: usize, [least, most]: [f32; 2]) -> f32 {
        match number {
            Scalar::Value(value) => value.clamp(least, most),
            Scalar::Texture(texture) => {
                self.slot(texture, first, SlotKind::Number { least, most });
                most
            }
        }
    }

    fn slot(&mut self, texture: &Arc<Texture>, first: usize, kind: SlotKind) {
        let texture = self.texture(texture);
        self.slots.push(TextureSlot { texture, first: first as u32, kind });
    }

    /// A number that is not a parameter of a lobe.
    pub(super) fn varying(&mut self, scalar: &Scalar) -> FloatTexture {
        match scalar {
            Scalar::Value(value) => FloatTexture::Value(*value),
            Scalar::Texture(texture) => FloatTexture::Texture(self.texture(texture)),
        }
    }

    /// Compiles a texture, once for all its uses.
    pub(super) fn texture(&mut self, texture: &Arc<Texture>) -> Id<TextureRecord> {
        if let Some(known) = self.known.get(&Arc::as_ptr(texture)) {
            let known = *known;
            self.show(known);
            return known;
        }
        let to_pattern = affine(texture.to_pattern.as_mat3());
        let pattern = match &texture.pattern {
            Pattern::Bitmap(Bitmap { image, wrap, filter }) => {
                PatternRecord::Bitmap(self.image(image, *filter), *wrap, *filter)
            }
            Pattern::Checkerboard(colors) => {
                PatternRecord::Checkerboard(colors.map(Spectrum::from))
            }
            Pattern::VertexColors | Pattern::VertexAttribute(_) => {
                PatternRecord::VertexColors(self.mesh_value(&texture.pattern))
            }
            Pattern::FaceColors | Pattern::FaceAttribute(_) => {
                PatternRecord::FaceColors(self.mesh_value(&texture.pattern))
            }
            Pattern::Product(factors) => {
                PatternRecord::Product([0, 1].map(|i: usize| self.factor(&factors[i])))
            }
            Pattern::Blend(blend) => {
                let Blend { first, second, amount: share } = &**blend;
                let parts = [first, second].map(|color| self.factor(color));
                PatternRecord::Blend(parts, self.varying(share))
            }
            Pattern::Sqrt(square) => PatternRecord::Root(self.factor(square)),
            Pattern::AbsNormalDot(direction) => {
                let along = DVec3::from(direction.map(f64::from)).try_normalize();
                PatternRecord::Facing(along.unwrap_or_default().as_vec3())
            }
            Pattern::Procedural(pattern) => self.laid(texture, *pattern),
            Pattern::Grid { grid, filter } => {
                let field = WorldGrid::on_unit_cube(Arc::clone(grid), *filter);
                self.textures.grids.push(field);
                let pattern = MappedPattern::Grid(self.textures.grids.len() as u32 - 1);
                let layout = self.layout(texture);
                PatternRecord::Laid(self.textures.laid.push(MappedTexture {
                    layout,
                    to_pattern,
                    pattern,
                }))
            }
        };
        let pattern = match pattern {
            PatternRecord::Bitmap(..) | PatternRecord::Checkerboard(_)
                if texture.layout != TextureMapping::Surface =>
            {
                let layout = self.layout(texture);
                let pattern = MappedPattern::Flat(pattern);
                PatternRecord::Laid(self.textures.laid.push(MappedTexture {
                    layout,
                    to_pattern,
                    pattern,
                }))
            }
            pattern => pattern,
        };
        let id = self.textures.records.push(TextureRecord { pattern, to_pattern });
        self.known.insert(Arc::as_ptr(texture), id);
        self.show(id);
        id
    }

    /// Adds a procedural pattern.
    fn laid(&mut self, texture: &Texture, pattern: Procedural) -> PatternRecord {
        self.textures.uses_footprints |= procedural::has_octaves(pattern);
        let layout = self.layout(texture);
        let to_pattern = affine(texture.to_pattern.as_mat3());
        let pattern = MappedPattern::Procedural(pattern);
        PatternRecord::Laid(self.textures.laid.push(MappedTexture { layout, to_pattern, pattern }))
    }

    /// Mapping of a texture from points in metres.
    fn layout(&mut self, texture: &Texture) -> TextureMappingRecord {
        let to_units = DAffine3::from_scale(DVec3::splat(1.0 / f64::from(self.metres)));
        match texture.layout {
            TextureMapping::Surface => TextureMappingRecord::Surface,
            TextureMapping::Coordinates { set } => {
                let values = Pattern::VertexAttribute(TextureMapping::set_name(set));
                TextureMappingRecord::Values(self.mesh_value(&values))
            }
            TextureMapping::Space { to_texture } => {
                TextureMappingRecord::Space(to_texture * to_units)
            }
            TextureMapping::Sphere { to_texture } => {
                TextureMappingRecord::Sphere(to_texture * to_units)
            }
            TextureMapping::Cylinder { to_texture } => {
                TextureMappingRecord::Cylinder(to_texture * to_units)
            }
        }
    }

    fn factor(&mut self, color: &Color) -> Factor {
        match color {
            Color::Value(value) => Factor::Value((*value).into()),
            Color::Texture(texture) => Factor::Texture(self.texture(texture)),
        }
    }

    /// Index of a pattern in [`Self::mesh_values`].
    fn mesh_value(&mut self, pattern: &Pattern) -> u32 {
        let known = self.mesh_values.iter().position(|known| known == pattern);
        known.unwrap_or_else(|| {
            self.mesh_values.push(pattern.clone());
            self.mesh_values.len() - 1
        }) as u32
    }

    /// Records the mesh values that a texture uses.
    fn show(&mut self, id: Id<TextureRecord>) {
        match self.textures.records[id].pattern {
            PatternRecord::VertexColors(value) | PatternRecord::FaceColors(value) => {
                self.shown.insert(value);
            }
            PatternRecord::Product(factors) => self.show_factors(&factors),
            PatternRecord::Blend(parts, share) => {
                self.show_factors(&parts);
                if let FloatTexture::Texture(id) = share {
                    self.show(id);
                }
            }
            PatternRecord::Root(square) => self.show_factors(&[square]),
            PatternRecord::Laid(laid) => {
                if let TextureMappingRecord::Values(value) = self.textures.laid[laid].layout {
                    self.shown.insert(value);
                }
            }
            PatternRecord::Bitmap(..)
            | PatternRecord::Checkerboard(_)
            | PatternRecord::Facing(_) => {}
        }
    }

    fn show_factors(&mut self, factors: &[Factor]) {
        for factor in factors {
            if let Factor::Texture(id) = factor {
                self.show(*id);
            }
        }
    }

    /// Compiles an image, once for all its uses, with its mipmap if the filter needs it.
    fn image(&mut self, image: &Arc<Image>, filter: Filter) -> Id<Texels> {
        let Image { width, height, pixels } = &**image;
        let texels = &mut self.textures.texels;
        let known = self.earlier.and_then(|earlier| earlier.image(image)).cloned();
        let make = || known.unwrap_or_else(|| Arc::new(Texels::new(*width, *height, pixels)));
        let id = *self.images.entry(Arc::as_ptr(image)).or_insert_with(|| texels.push(make()));
        if filter == Filter::Trilinear {
            if !texels[id].has_mipmap() {
                // Another scene may share them.
                Arc::make_mut(&mut texels[id]).build_mipmap(pixels);
            }
            self.textures.uses_footprints = true;
        }
        id
    }

    /// Makes all lobes of a material two-sided.
    pub(super) fn show_both_sides(&mut self, id: Id<Material>) {
        match &mut self.materials.table[id] {
            Material::Lobe(lobe) => lobe.two_sided = true,
            &mut Material::SurfaceDetail { surface, .. } => self.show_both_sides(surface),
            &mut (Material::Mix { first, second, .. }
            | Material::TwoSided { front: first, back: second }) => {
                self.show_both_sides(first);
                self.show_both_sides(second);
            }
        }
    }
}

/// Part of a matrix that acts on (u, v).
fn affine(m: Mat3) -> Affine2 {
    let [x, y, z] = [m.x_axis, m.y_axis, m.z_axis].map(|c| Vec2::new(c.x, c.y));
    Affine2::from_cols(x, y, z)
}
