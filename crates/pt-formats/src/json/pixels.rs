//! Pixels of images in the scene file itself, or in arrays.

use pt_image::Decoded;
use pt_math::color::linear_from_srgb;
use pt_scene::Shared;
use pt_scene::image::Image;
use serde_json::{Value, json};

use super::attached::Numbers;
use super::codec::FieldCodec;
use super::context::{JsonReader, JsonWriter};
use super::node::JsonNode;
use super::number::{ANY, vector_schema};
use super::printer::Out;
use crate::LoadError;

/// Reads rows of pixels: lists or an array of colours in linear light; or an array of levels from 0
/// to 255, which are those of sRGB unless they are raw, as in a file.
pub(super) fn read(
    node: &JsonNode<'_>,
    is_raw: bool,
    cx: &mut JsonReader<'_>,
) -> Result<Image, LoadError> {
    let (width, height, pixels) = match node.array() {
        Some((shape, numbers)) => of_array(node, &shape, numbers, is_raw)?,
        None => of_lists(node, cx)?,
    };
    let [width, height] = [width, height].map(|side| u32::try_from(side).unwrap_or(u32::MAX));
    Image::check_size(width, height, pixels.len()).map_err(|message| node.error(message))?;
    let image = Image { width, height, pixels };
    let decoded = Decoded { image, alpha: None, frame: None };
    let checked = cx.context.check_picture(Ok(decoded), "the image".as_ref());
    let image = checked.map_err(|message| node.error(message))?.image;
    cx.account(size_of_val(image.pixels.as_slice()), node)?;
    Ok(image)
}

/// Width, height and colours.
type Pixels = (usize, usize, Shared<[f32; 3]>);

fn of_array(
    node: &JsonNode<'_>,
    shape: &[usize],
    numbers: Numbers,
    is_raw: bool,
) -> Result<Pixels, LoadError> {
    let (height, width, channels) = match *shape {
        [height, width] | [height, width, 1] => (height, width, 1),
        [height, width, 3] => (height, width, 3),
        _ => return Err(node.wrong_shape(shape, "(height, width, 3) or (height, width)")),
    };
    let values = match numbers {
        Numbers::Levels(levels) => {
            let light = |level: u8| {
                let share = f32::from(level) / 255.0;
                if is_raw { share } else { linear_from_srgb(share) }
            };
            let table: Vec<f32> = (0..=u8::MAX).map(light).collect();
            levels.into_iter().map(|level| table[usize::from(level)]).collect()
        }
        Numbers::Reals(_) => node.reals(numbers, width * channels)?,
        Numbers::Wholes(_) | Numbers::Integers(_) => {
            return Err(node.unexpected(
                "an array of real numbers in linear light, or of levels from 0 to 255 of 8 bits",
            ));
        }
    };
    let pixels = if channels == 3 {
        super::array_nodes::rows(values)
    } else {
        values.into_iter().map(|grey| [grey; 3]).collect()
    };
    Ok((width, height, pixels))
}

fn of_lists(node: &JsonNode<'_>, cx: &mut JsonReader<'_>) -> Result<Pixels, LoadError> {
    let rows = node.list("rows of pixels")?;
    let mut pixels = Vec::new();
    let mut width = 0;
    for (i, row) in rows.iter().enumerate() {
        let row_of_pixels = row.list("a row of pixels")?;
        if i > 0 && row_of_pixels.len() != width {
            let found = row_of_pixels.len();
            return Err(row.error(format!("found {found} pixels, expected {width} as before")));
        }
        width = row_of_pixels.len();
        for pixel in &row_of_pixels {
            pixels.push(FieldCodec::<[f32; 3]>::read(&ANY, pixel, cx)?);
        }
    }
    Ok((width, rows.len(), pixels.into()))
}

/// Attaches the pixels to a scene in memory.
pub(super) fn write(image: &Image, cx: &mut JsonWriter<'_>) -> Out {
    let shape = [image.height as usize, image.width as usize, 3];
    cx.array(&shape, Numbers::Reals(image.pixels.as_flattened().to_vec().into()))
}

pub(super) fn schema() -> Value {
    let number = json!({"type": "number"});
    let pixel = json!({"anyOf": [number, vector_schema(&number, 3)]});
    json!({"type": "array", "items": {"type": "array", "items": pixel}})
}
