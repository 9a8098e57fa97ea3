//! Parameters of materials in the form of glTF: a factor times an image times the colours of the
//! mesh.

use std::sync::Arc;

use pt_math::{DMat3, DVec3, Spectrum};
use pt_scene::image::Image;
use pt_scene::texture::{
    Bitmap, Blend, Color, Edge, Filter, Input, Pattern, Procedural, Scalar, Texture,
    TextureMapping, Wrap,
};
use serde_json::{Map, Value, json};

/// Colours of a mesh that a material uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum ColorSource {
    /// Vertex colours.
    Vertices,
    /// Face colours.
    Faces,
}

/// An image and its mapping to a surface.
#[derive(Clone, Debug)]
pub(super) struct Layer {
    /// Values from 0 to 1, unless they are normals.
    pub(super) image: Arc<Image>,
    pub(super) wrap: Wrap,
    pub(super) filter: Filter,
    /// Transform from the (u, v, 1) of the surface to those of the image, v upwards.
    pub(super) to_pattern: DMat3,
}

/// A parameter of a material: the product of its fields.
#[derive(Clone, Debug)]
pub(super) struct MaterialParameter {
    pub(super) factor: [f32; 3],
    pub(super) layer: Option<Layer>,
    pub(super) colors: Option<ColorSource>,
    /// True if textures were omitted from the product.
    pub(super) lost: bool,
}

impl MaterialParameter {
    /// Converts a colour.
    pub(super) fn of(color: &Color) -> Self {
        let mut made = Self { factor: [1.0; 3], layer: None, colors: None, lost: false };
        made.add(color);
        made.into_shares()
    }

    /// Converts a number: the factor has three equal channels, the image is grey.
    pub(super) fn of_number(number: &Scalar) -> Self {
        let made = match number {
            Input::Value(value) => Self::of(&[*value; 3].into()),
            Input::Texture(texture) => Self::of(&Input::Texture(Arc::clone(texture))),
        };
        let grey = |color: [f32; 3]| [grey(color); 3];
        let layer = made.layer.map(|layer| {
            // A grey image is kept, so that other materials can share it.
            let is_grey = layer.image.pixels.iter().all(|[r, g, b]| r == g && g == b);
            let image = if is_grey { layer.image } else { changed(&layer.image, grey) };
            Layer { image, ..layer }
        });
        Self { factor: grey(made.factor), layer, ..made }
    }

    /// Returns the number if it is constant.
    pub(super) fn number(&self) -> Option<f32> {
        (self.layer.is_none() && self.colors.is_none()).then_some(self.factor[0])
    }

    fn add(&mut self, color: &Color) {
        let texture = match color {
            Input::Value(value) => {
                self.factor = product(self.factor, *value);
                return;
            }
            Input::Texture(texture) => texture,
        };
        match &texture.pattern {
            Pattern::Product(factors) => factors.iter().for_each(|factor| self.add(factor)),
            Pattern::VertexColors => self.colors = Some(ColorSource::Vertices),
            Pattern::FaceColors => self.colors = self.colors.or(Some(ColorSource::Faces)),
            Pattern::Bitmap(_) | Pattern::Checkerboard(_)
                if texture.layout == TextureMapping::Surface =>
            {
                let layer = layer(texture);
                // glTF has no black border; the edge is extended instead.
                self.lost |= layer
                    .as_ref()
                    .is_some_and(|layer| [layer.wrap.u, layer.wrap.v].contains(&Edge::Black));
                self.lay(layer);
            }
            Pattern::Blend(blend) => self.blend(blend),
            other => {
                self.factor = product(self.factor, other.mean());
                self.lost = true;
            }
        }
    }

    /// Multiplies by a blend, or, if that is not possible, by the one of its two parts with the
    /// larger weight.
    fn blend(&mut self, blend: &Blend) {
        if let Some(made) = blended(blend) {
            return self.lay(Some(made));
        }
        let is_second = matches!(blend.amount, Input::Value(share) if share > 0.5);
        self.add(if is_second { &blend.second } else { &blend.first });
        self.lost = true;
    }

    /// Multiplies by an image. Only images with the same mapping and size can be multiplied.
    fn lay(&mut self, layer: Option<Layer>) {
        let Some(layer) = layer else { return };
        let Some(known) = &mut self.layer else {
            self.layer = Some(layer);
            return;
        };
        let size = |layer: &Layer| (layer.image.width, layer.image.height);
        if !known.lies_as(&layer) || size(known) != size(&layer) {
            self.lost = true;
            return;
        }
        let pixels = known.image.pixels.iter().zip(&layer.image.pixels);
        let pixels = pixels.map(|(a, b)| product(*a, *b)).collect();
        known.image = Arc::new(Image { pixels, ..*known.image });
    }

    /// Moves a scale from the image to the factor, so that the image is from 0 to 1.
    fn into_shares(mut self) -> Self {
        let Some(layer) = &mut self.layer else { return self };
        let pixels = layer.image.pixels.as_flattened();
        let most = pixels.iter().copied().filter(|x| x.is_finite()).fold(1.0, f32::max);
        if !pixels.iter().all(|x| (0.0..=1.0).contains(x)) {
            let scale = power_of_two(most);
            let share = |color: [f32; 3]| color.map(|c| (c / scale).clamp(0.0, 1.0));
            layer.image = changed(&layer.image, share);
            self.factor = self.factor.map(|c| c * scale);
        }
        self
    }
}

impl Layer {
    /// Returns true if two images have the same mapping.
    pub(super) fn lies_as(&self, other: &Self) -> bool {
        self.wrap == other.wrap && self.to_pattern == other.to_pattern
    }

    /// Returns the image resampled to a size, by nearest neighbours.
    pub(super) fn with_size(&self, [width, height]: [u32; 2]) -> Arc<Image> {
        let image = &self.image;
        if [image.width, image.height] == [width, height] {
            return Arc::clone(image);
        }
        let nearest = |i: u32, from: u32, to: u32| {
            (u64::from(i) * u64::from(from) + u64::from(from) / 2) / u64::from(to)
        };
        let mut pixels = Vec::with_capacity(width as usize * height as usize);
        for y in 0..height {
            let row = nearest(y, image.height, height) * u64::from(image.width);
            let pixel = |x| image.pixels[(row + nearest(x, image.width, width)) as usize];
            pixels.extend((0..width).map(pixel));
        }
        Arc::new(Image { width, height, pixels: pixels.into() })
    }

    /// Returns the fields of KHR_texture_transform, or `None` if the mapping is the identity.
    ///
    /// # Errors
    /// If the mapping has a shear, which the extension does not support.
    pub(super) fn transform(&self) -> Result<Option<Value>, ShearError> {
        if self.to_pattern == DMat3::IDENTITY {
            return Ok(None);
        }
        let upside_down =
            DMat3::from_cols(DVec3::X, DVec3::new(0.0, -1.0, 0.0), DVec3::new(0.0, 1.0, 1.0));
        let DMat3 { x_axis: u, y_axis: v, z_axis: moved } =
            upside_down * self.to_pattern * upside_down;
        let is_along_axes = u.y == 0.0 && v.x == 0.0;
        // The columns are (cos, −sin) · scale and (sin, cos) · scale.
        let angle = if is_along_axes { 0.0 } else { libm::atan2(-u.y, u.x) };
        let (sin, cos) = libm::sincos(angle);
        let scale =
            if is_along_axes { [u.x, v.y] } else { [u.truncate().length(), v.x * sin + v.y * cos] };
        let across = (v.x * cos - v.y * sin).abs();
        if across > 1e-6 * (scale[0].abs() + scale[1].abs()) {
            return Err(ShearError);
        }
        let mut fields = Map::new();
        let mut put = |name: &str, value: Value| fields.insert(name.to_owned(), value);
        if scale != [1.0; 2] {
            put("scale", scale.to_vec().into());
        }
        if angle != 0.0 {
            put("rotation", angle.into());
        }
        if (moved.x, moved.y) != (0.0, 0.0) {
            put("offset", json!([moved.x, moved.y]));
        }
        Ok(Some(Value::Object(fields)))
    }
}

/// Error of a texture mapping with a shear.
pub(super) struct ShearError;

/// Converts a texture that is an image or a checkerboard.
fn layer(texture: &Texture) -> Option<Layer> {
    if texture.layout != TextureMapping::Surface {
        return None;
    }
    let to_pattern = texture.to_pattern;
    match &texture.pattern {
        Pattern::Bitmap(Bitmap { image, wrap, filter }) => {
            Some(Layer { image: Arc::clone(image), wrap: *wrap, filter: *filter, to_pattern })
        }
        Pattern::Checkerboard([alike, other]) => {
            // From the top, where v is above ½.
            let pixels = vec![*other, *alike, *alike, *other];
            let image = Arc::new(Image { width: 2, height: 2, pixels: pixels.into() });
            Some(Layer { image, wrap: Wrap::REPEAT, filter: Filter::Nearest, to_pattern })
        }
        _ => None,
    }
}

/// Converts a blend to an image, if its parts consist of images with the same mapping and of
/// constants.
fn blended(blend: &Blend) -> Option<Layer> {
    let parts = [
        MaterialParameter::of(&blend.first),
        MaterialParameter::of(&blend.second),
        MaterialParameter::of_number(&blend.amount),
    ];
    if parts.iter().any(|part| part.lost || part.colors.is_some()) {
        return None;
    }
    let layers = || parts.iter().filter_map(|part| part.layer.as_ref());
    let size = |layer: &Layer| [layer.image.width, layer.image.height];
    let finest = layers().max_by_key(|layer| size(layer))?;
    if !layers().all(|layer| layer.lies_as(finest)) {
        return None;
    }
    let [width, height] = size(finest);
    let [first, second, share] = parts.each_ref().map(|part| {
        let image = part.layer.as_ref().map(|layer| layer.with_size([width, height]));
        move |i: usize| {
            product(part.factor, image.as_ref().map_or([1.0; 3], |image| image.pixels[i]))
        }
    });
    let pixel = |i: usize| {
        let (a, b, t) = (first(i), second(i), share(i)[0].clamp(0.0, 1.0));
        std::array::from_fn(|c| (1.0 - t) * a[c] + t * b[c])
    };
    let pixels = (0..finest.image.pixels.len()).map(pixel).collect();
    Some(Layer { image: Arc::new(Image { width, height, pixels }), ..finest.clone() })
}

/// Converts a normal map, if it is an image.
pub(super) fn normals(texture: &Texture) -> Option<Layer> {
    layer(texture)
}

/// Applies a multiplicative function f, for which f(a b) = f(a) f(b), to each number of a
/// parameter.
pub(super) fn mapped<T: Copy>(input: &Input<T>, number: fn(T) -> T, f: fn(f32) -> f32) -> Input<T> {
    match input {
        Input::Value(value) => Input::Value(number(*value)),
        Input::Texture(texture) => Input::Texture(Arc::new(mapped_texture(texture, f))),
    }
}

fn mapped_texture(texture: &Texture, f: fn(f32) -> f32) -> Texture {
    let color = |color: [f32; 3]| color.map(f);
    let each = |part: &Color| match part {
        Input::Value(value) => Input::Value(color(*value)),
        Input::Texture(texture) => Input::Texture(Arc::new(mapped_texture(texture, f))),
    };
    let pattern = match &texture.pattern {
        Pattern::Bitmap(bitmap) => {
            Pattern::Bitmap(Bitmap { image: changed(&bitmap.image, color), ..bitmap.clone() })
        }
        Pattern::Checkerboard(colors) => Pattern::Checkerboard(colors.map(color)),
        Pattern::Procedural(pattern) if let Some(mapped) = pattern.recolored(color) => {
            Pattern::Procedural(mapped)
        }
        Pattern::Product(factors) => Pattern::Product(Box::new(factors.each_ref().map(each))),
        Pattern::Blend(blend) => {
            let Blend { first, second, amount: share } = &**blend;
            let [first, second] = [first, second].map(each);
            Pattern::Blend(Box::new(Blend { first, second, amount: share.clone() }))
        }
        Pattern::VertexColors | Pattern::FaceColors => texture.pattern.clone(),
        // Other patterns are written as their mean.
        other => Pattern::Procedural(Procedural::Checkerboard3d([color(other.mean()); 2])),
    };
    Texture { pattern, ..texture.clone() }
}

fn changed(image: &Image, change: impl Fn([f32; 3]) -> [f32; 3]) -> Arc<Image> {
    let pixels = image.pixels.iter().map(|pixel| change(*pixel)).collect();
    Arc::new(Image { pixels, ..*image })
}

/// Returns the smallest power of two from 1 up that is not below a number, or the largest finite
/// one. Division by it is exact.
pub(super) fn power_of_two(number: f32) -> f32 {
    const LARGEST: f32 = 1.701_411_8e38; // 2¹²⁷
    let mut scale = 1.0;
    while scale < number && scale < LARGEST {
        scale *= 2.0;
    }
    scale
}

/// Returns the luminance of a colour; exact for greys.
fn grey([r, g, b]: [f32; 3]) -> f32 {
    if r == g && g == b { r } else { Spectrum::from([r, g, b]).luminance() }
}

fn product(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    std::array::from_fn(|c| a[c] * b[c])
}
