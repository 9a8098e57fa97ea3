//! Image textures.

use std::ops::{Add, Mul, Sub};

use pt_math::{Spectrum, Vec2};
use pt_scene::texture::Wrap;

use crate::byte_levels::{LEVELS, SRGB};
use crate::mipmap;

/// Image in the smallest lossless representation.
#[derive(Clone)]
pub struct Texels {
    size: [u32; 2],
    values: TexelValues,
    /// Coarser mipmap levels, each of half the width and height of the one before, down to one
    /// texel; empty if no texture uses them.
    coarser: Vec<Texels>,
}

#[derive(Clone)]
enum TexelValues {
    /// 8-bit sRGB levels.
    Srgb(Vec<[u8; 3]>),
    /// 8-bit linear levels: multiples of 1/255.
    Levels(Vec<[u8; 3]>),
    Floats(Vec<[f32; 3]>),
}

impl Texels {
    /// Creates an image of `width` × `height` values, in rows from the top.
    pub(crate) fn new(width: u32, height: u32, pixels: &[[f32; 3]]) -> Self {
        let values = SRGB
            .coded(pixels)
            .map(TexelValues::Srgb)
            .or_else(|| LEVELS.coded(pixels).map(TexelValues::Levels))
            .unwrap_or_else(|| TexelValues::Floats(pixels.to_vec()));
        Self { size: [width, height], values, coarser: Vec::new() }
    }

    /// Returns true if there are coarser mipmap levels, or none are needed.
    pub(crate) fn has_mipmap(&self) -> bool {
        !self.coarser.is_empty() || self.size == [1; 2]
    }

    /// Computes the coarser mipmap levels, unless they exist. [Williams 1983, "Pyramidal
    /// Parametrics"]
    pub(crate) fn build_mipmap(&mut self, pixels: &[[f32; 3]]) {
        if self.coarser.is_empty() {
            self.coarser = mipmap::mip_levels(self.size, pixels)
                .map(|([width, height], pixels)| Self::new(width, height, &pixels))
                .collect();
        }
    }

    /// Returns a mipmap level, at most the coarsest; 0 is the finest.
    #[inline]
    fn level(&self, i: usize) -> &Self {
        let coarser = i.checked_sub(1).and_then(|i| self.coarser.get(i).or(self.coarser.last()));
        coarser.unwrap_or(self)
    }

    /// Returns the trilinearly filtered value for a footprint with these axes, in image
    /// coordinates. It is interpolated between the two levels whose texels are about as wide as the
    /// shorter axis, so that nothing is blurred beyond the footprint.
    pub(crate) fn trilinear(&self, uv: Vec2, wrap: Wrap, axes: [Vec2; 2]) -> Spectrum {
        let width = mipmap::shorter_axis(axes.map(|a| self.scaled(a)));
        if width <= 1.0 {
            return self.bilinear(uv, wrap);
        }
        let level = libm::log2f(width).min(self.coarser.len() as f32);
        let share = level - level.floor();
        let [finer, coarser] = [0, 1].map(|i| self.level(level as usize + i).bilinear(uv, wrap));
        finer * (1.0 - share) + coarser * share
    }

    /// Returns the memory of the values in bytes, including coarser levels.
    pub fn bytes(&self) -> usize {
        let own = match &self.values {
            TexelValues::Srgb(v) | TexelValues::Levels(v) => size_of_val(v.as_slice()),
            TexelValues::Floats(v) => size_of_val(v.as_slice()),
        };
        own + self.coarser.iter().map(Self::bytes).sum::<usize>()
    }

    #[inline]
    fn texel(&self, i: usize) -> Spectrum {
        match &self.values {
            TexelValues::Srgb(v) => Spectrum::from(v[i].map(|b| SRGB.light(b))),
            TexelValues::Levels(v) => Spectrum::from(v[i].map(|b| LEVELS.light(b))),
            TexelValues::Floats(v) => v[i].into(),
        }
    }

    /// Returns the texel of column `x` and row `y`, counted from the bottom. It may be outside of
    /// the image.
    #[inline]
    fn at(&self, x: i64, y: i64, wrap: Wrap) -> Spectrum {
        let [w, h] = self.size.map(i64::from);
        match (wrap.u.texel(x, w), wrap.v.texel(y, h)) {
            (Some(x), Some(y)) => self.texel(((h - 1 - y) * w + x) as usize),
            _ => Spectrum::ZERO,
        }
    }

    /// Returns the four texels around a point of the unit square, the lower ones first, and the
    /// offset of the point from the first, in texels.
    #[inline]
    fn around(&self, uv: Vec2, wrap: Wrap) -> ([Spectrum; 4], Vec2) {
        let p = self.scaled(uv) - 0.5;
        let corner = p.floor();
        // Coordinates saturate at 32 bits, so the next one never overflows.
        let (x, y) = (i64::from(corner.x as i32), i64::from(corner.y as i32));
        let texels = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j)| self.at(x + i, y + j, wrap));
        (texels, p - corner)
    }

    /// Converts image coordinates to texels.
    #[inline]
    fn scaled(&self, uv: Vec2) -> Vec2 {
        uv * Vec2::from(self.size.map(|n| n as f32))
    }

    #[inline]
    pub(crate) fn bilinear(&self, uv: Vec2, wrap: Wrap) -> Spectrum {
        let ([a, b, c, d], t) = self.around(uv, wrap);
        let (below, above) = (a * (1.0 - t.x) + b * t.x, c * (1.0 - t.x) + d * t.x);
        below * (1.0 - t.y) + above * t.y
    }

    #[inline]
    pub(crate) fn nearest(&self, uv: Vec2, wrap: Wrap) -> Spectrum {
        let p = self.scaled(uv).floor();
        self.at(p.x as i64, p.y as i64, wrap)
    }

    /// Returns the derivatives of `value` of [`Self::bilinear`] with respect to u and v, for a
    /// linear `value`.
    #[inline]
    pub(crate) fn gradient<T>(&self, uv: Vec2, wrap: Wrap, value: impl Fn(Spectrum) -> T) -> [T; 2]
    where
        T: Copy + Add<Output = T> + Sub<Output = T> + Mul<f32, Output = T>,
    {
        let (texels, t) = self.around(uv, wrap);
        let [a, b, c, d] = texels.map(value);
        let along_u = (b - a) * (1.0 - t.y) + (d - c) * t.y;
        let along_v = (c - a) * (1.0 - t.x) + (d - b) * t.x;
        let [w, h] = self.size.map(|n| n as f32);
        [along_u * w, along_v * h]
    }
}

#[cfg(test)]
mod tests {
    use pt_scene::texture::Edge;

    use super::*;

    fn image(pixels: &[f32], width: u32) -> Texels {
        let pixels: Vec<_> = pixels.iter().map(|&v| [v; 3]).collect();
        Texels::new(width, pixels.len() as u32 / width, &pixels)
    }

    #[test]
    fn values_take_no_more_bytes_than_they_need_and_come_back() {
        let srgb: Vec<f32> = SRGB.values.to_vec();
        let floats = [0.1, 0.123_456_7, -1.0, 7e9];
        for (values, bytes) in [(&srgb[..], 3), (&LEVELS.values[..], 3), (&floats, 12)] {
            let texels = image(values, values.len() as u32);
            assert_eq!(texels.bytes(), bytes * values.len());
            for (i, &v) in values.iter().enumerate() {
                assert_eq!(texels.texel(i), Spectrum::splat(v));
            }
        }
    }

    /// At any distance from the image.
    #[test]
    fn all_coordinates_show_texels() {
        let t = image(&[1.0; 6], 3);
        for far in [1e9, 1e18, 1e30, -1e9, -1e18, -1e30, f32::MAX / 3.0] {
            for wrap in [Wrap::REPEAT, Wrap::CLAMP, Wrap::MIRROR] {
                for uv in [Vec2::new(far, 0.5), Vec2::new(0.5, far), Vec2::splat(far)] {
                    assert_eq!((t.bilinear(uv, wrap).0.x, t.nearest(uv, wrap).0.x), (1.0, 1.0));
                }
            }
        }
    }

    /// At the edge, half of the value is that of the edge texels, and half is the black outside.
    #[test]
    fn beyond_its_edges_an_image_may_be_black() {
        let t = image(&[1.0, 2.0, 3.0, 4.0], 2);
        let at = |u, v| t.bilinear(Vec2::new(u, v), Wrap::BLACK).0.x;
        assert_eq!([at(0.25, 0.25), at(0.75, 0.75)], [3.0, 2.0]);
        assert_eq!([at(0.0, 0.25), at(0.75, 1.0), at(1.0, 0.0)], [1.5, 1.0, 1.0]);
        assert_eq!([at(-0.25, 0.25), at(0.25, 1.3), at(7.0, -3.0)], [0.0; 3]);
        let nearest = |u, v| t.nearest(Vec2::new(u, v), Wrap::BLACK).0.x;
        assert_eq!(
            [nearest(0.01, 0.99), nearest(-0.01, 0.99), nearest(0.01, 1.01)],
            [1.0, 0.0, 0.0]
        );
    }

    /// Rows are stored from the top, v points up. Values are at the centres of texels, and linear
    /// between them.
    #[test]
    fn an_image_lies_on_the_unit_square() {
        let t = image(&[0.0, 1.0, 2.0, 3.0, 4.0, 5.0], 3);
        let at = |u, v, wrap| t.bilinear(Vec2::new(u, v), wrap).0.x;
        for (i, want) in [3.0, 4.0, 5.0].into_iter().enumerate() {
            let u = (i as f32 + 0.5) / 3.0;
            assert!((at(u, 0.25, Wrap::CLAMP) - want).abs() < 1e-5);
            assert!((at(u, 0.75, Wrap::CLAMP) - want + 3.0).abs() < 1e-5);
            assert!((at(u, 0.5, Wrap::CLAMP) - want + 1.5).abs() < 1e-5);
        }
        assert!((at(1.0 / 3.0, 0.25, Wrap::CLAMP) - 3.5).abs() < 1e-5);
        assert!((at(0.0, 0.0, Wrap::CLAMP) - 3.0).abs() < 1e-5);
        assert!((at(0.0, 0.0, Wrap::REPEAT) - 2.5).abs() < 1e-5);
        assert!((at(0.0, 0.0, Wrap::MIRROR) - 3.0).abs() < 1e-5);
        assert!((at(-1.0 / 6.0, 0.25, Wrap::REPEAT) - 5.0).abs() < 1e-5);
        assert!((at(-1.5 / 3.0, 0.25, Wrap::MIRROR) - 4.0).abs() < 1e-5);
        assert_eq!(t.nearest(Vec2::new(0.34, 0.1), Wrap::CLAMP).0.x, 4.0);
        // Left of the first column is the first one if mirrored, or the last one if repeated; below
        // the lowest row is that row.
        let apart = |u| Wrap { u, v: Edge::Clamp };
        let below = Vec2::new(-0.1, -0.1);
        assert_eq!(
            t.nearest(below, apart(Edge::Mirror)),
            t.nearest(Vec2::new(0.1, 0.1), Wrap::CLAMP)
        );
        assert_eq!(
            t.nearest(below, apart(Edge::Repeat)),
            t.nearest(Vec2::new(0.9, 0.1), Wrap::CLAMP)
        );
    }

    #[test]
    fn gradients_are_differences() {
        const STEP: f32 = 1e-3;
        let t = image(&[0.3, 1.0, 2.5, 3.0, -4.0, 5.0, 0.5, 0.25, 1.0], 3);
        for (u, v) in [(0.2, 0.3), (0.45, 0.8), (0.7, 0.55), (0.02, 0.97)] {
            let at =
                |du: f32, dv: f32| t.bilinear(Vec2::new(u + du, v + dv), Wrap::REPEAT).luminance();
            let g = t.gradient(Vec2::new(u, v), Wrap::REPEAT, Spectrum::luminance);
            let g = Vec2::from(g);
            let along_u = (at(STEP, 0.0) - at(-STEP, 0.0)) / (2.0 * STEP);
            let along_v = (at(0.0, STEP) - at(0.0, -STEP)) / (2.0 * STEP);
            assert!((g - Vec2::new(along_u, along_v)).length() < 0.02, "{u} {v}: {g}");
        }
    }
}
