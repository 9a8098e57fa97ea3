//! Assembly of an image from images of its parts.

use pt_scene::image::{Channel, Image, Samples};

use super::{DisplayWindow, ImageFile, ImageMemory, Precision, SaveOptions};

/// An image that is assembled from parts.
#[derive(Clone, Debug)]
pub struct Mosaic {
    file: ImageFile,
    /// True for the pixels of the parts so far.
    covered: Vec<bool>,
}

/// Reason for which a part cannot be added to a mosaic.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MosaicError {
    /// Part of the image is outside of the whole.
    #[error("{width} x {height} pixels at column {x}, row {y} are not inside of the whole image")]
    Outside {
        /// First column of the part.
        x: u32,
        /// First row of the part.
        y: u32,
        /// Number of columns of the part.
        width: u32,
        /// Number of rows of the part.
        height: u32,
    },
    /// The part has other channels than the first one.
    #[error("found other channels: {added} in addition, {missing} missing")]
    Channels {
        /// Channels that only this part has, or "none".
        added: String,
        /// Channels that only the first part has, or "none".
        missing: String,
    },
    /// A pixel of an earlier part has other values.
    #[error("found different values of the pixel in column {x}, row {y}")]
    Overlap {
        /// Column of the pixel, from the left.
        x: u32,
        /// Row of the pixel, from the top.
        y: u32,
    },
}

impl Mosaic {
    /// Creates an empty mosaic with the channels, texts and options of a part.
    ///
    /// # Errors
    /// Returns a message if it needs more than a gibibyte.
    pub fn new([width, height]: [u32; 2], part: &ImageFile) -> Result<Self, String> {
        let count = u64::from(width) * u64::from(height);
        let channels = &part.options.channels;
        let bytes = size_of::<[f32; 4]>() + size_of::<f32>() * channels.len() + size_of::<bool>();
        let _grant = ImageMemory::OF_PROCESS.ask(count.checked_mul(bytes as u64))?;
        let count = count as usize;
        let empty = |channel: &Channel| Channel {
            samples: match channel.samples {
                Samples::Real(_) => Samples::Real(vec![0.0; count]),
                Samples::Whole(_) => Samples::Whole(vec![0; count]),
            },
            name: channel.name.clone(),
            half_suffices: channel.half_suffices,
        };
        let options = SaveOptions {
            alpha: part.options.alpha.as_ref().map(|_| vec![0.0; count]),
            channels: channels.iter().map(empty).collect(),
            metadata: part.options.metadata.clone(),
            ..part.options
        };
        let image = Image { width, height, pixels: vec![[0.0; 3]; count].into() };
        let covered = vec![false; count];
        Ok(Self { file: ImageFile { image, options, frame: None }, covered })
    }

    /// Adds a part, whose upper left pixel has this column and row. Pixels of earlier parts must
    /// have the same values, to the bit. The pixel type becomes that of the most precise part.
    ///
    /// # Errors
    /// If the part does not belong to the mosaic.
    pub fn add(&mut self, [x, y]: [u32; 2], part: &ImageFile) -> Result<(), MosaicError> {
        let Image { width, height, .. } = part.image;
        let is_inside = |start: u32, length: u32, end: u32| {
            start.checked_add(length).is_some_and(|sum| sum <= end)
        };
        let whole = [self.file.image.width, self.file.image.height];
        if !is_inside(x, width, whole[0]) || !is_inside(y, height, whole[1]) {
            return Err(MosaicError::Outside { x, y, width, height });
        }
        let [found, expected] = [part, &self.file].map(channels);
        if found != expected {
            let [added, missing] = [(&found, &expected), (&expected, &found)].map(only_in_first);
            return Err(MosaicError::Channels { added, missing });
        }
        let place = Place {
            size: [width, height],
            at: DisplayWindow { offset: [x.into(), y.into()], size: whole },
        };
        if let Some([column, row]) = self.difference(place, part) {
            return Err(MosaicError::Overlap { x: x + column, y: y + row });
        }
        self.paste(place, part);
        Ok(())
    }

    /// Column and row in a part of the first pixel that differs from an earlier part.
    fn difference(&self, place: Place, part: &ImageFile) -> Option<[u32; 2]> {
        let covered = place.cut(&self.covered);
        if !covered.contains(&true) {
            return None;
        }
        let (own, other) = (&self.file, part);
        let mut first = place
            .difference(&own.image.pixels, &other.image.pixels, &covered, |p| p.map(f32::to_bits));
        let mut note = |found: Option<usize>| first = [first, found].into_iter().flatten().min();
        if let (Some(own), Some(other)) = (&own.options.alpha, &other.options.alpha) {
            note(place.difference(own, other, &covered, f32::to_bits));
        }
        for (own, other) in own.options.channels.iter().zip(&other.options.channels) {
            note(match (&own.samples, &other.samples) {
                (Samples::Real(own), Samples::Real(other)) => {
                    place.difference(own, other, &covered, f32::to_bits)
                }
                (Samples::Whole(own), Samples::Whole(other)) => {
                    place.difference(own, other, &covered, |v| v)
                }
                _ => None,
            });
        }
        let width = place.size[0] as usize;
        first.map(|i| [(i % width) as u32, (i / width) as u32])
    }

    fn paste(&mut self, place: Place, part: &ImageFile) {
        let Place { size, at } = place;
        let (own, other) = (&mut self.file, part);
        at.copy(&other.image.pixels, size, &mut own.image.pixels);
        if let (Some(own), Some(other)) = (&mut own.options.alpha, &other.options.alpha) {
            at.copy(other, size, own);
        }
        for (own, other) in own.options.channels.iter_mut().zip(&other.options.channels) {
            own.half_suffices &= other.half_suffices;
            match (&mut own.samples, &other.samples) {
                (Samples::Real(own), Samples::Real(other)) => at.copy(other, size, own),
                (Samples::Whole(own), Samples::Whole(other)) => at.copy(other, size, own),
                _ => {}
            }
        }
        if other.options.exr_type == Precision::Float {
            own.options.exr_type = Precision::Float;
        }
        at.copy(&vec![true; other.image.pixels.len()], size, &mut self.covered);
    }

    /// Returns a rectangle without data, as column, row, width and height: the first pixel without
    /// data, those to its right, and the rows below.
    pub fn gap(&self) -> Option<[u32; 4]> {
        let width = self.file.image.width as usize;
        let first = self.covered.iter().position(|is_covered| !is_covered)?;
        let (x, y) = (first % width, first / width);
        let is_free = |is_covered: &&bool| !**is_covered;
        let columns = self.covered[first..(y + 1) * width].iter().take_while(is_free).count();
        let rows = self.covered[y * width..].chunks(width);
        let rows = rows.take_while(|row| row[x..x + columns].iter().all(|is_covered| !is_covered));
        Some([x, y, columns, rows.count()].map(|n| n as u32))
    }

    /// Returns the image, black and transparent where there are no data.
    pub fn into_file(self) -> ImageFile {
        self.file
    }
}

/// Position of a part in the whole.
#[derive(Clone, Copy)]
struct Place {
    /// Size of the part.
    size: [u32; 2],
    /// Window of the whole.
    at: DisplayWindow,
}

impl Place {
    /// Returns the pixels of the part in the whole.
    fn cut<T: Copy + Default>(self, whole: &[T]) -> Vec<T> {
        let window = DisplayWindow { offset: self.at.offset.map(|n| -n), size: self.size };
        window.content(whole, self.at.size)
    }

    /// Index of the first pixel of the part that is covered and differs from the whole.
    fn difference<T: Copy + Default, B: PartialEq>(
        self,
        whole: &[T],
        part: &[T],
        covered: &[bool],
        bits: impl Fn(T) -> B,
    ) -> Option<usize> {
        let pairs = self.cut(whole).into_iter().zip(part).zip(covered);
        let mut differs = pairs.map(|((a, b), is_covered)| *is_covered && bits(a) != bits(*b));
        differs.position(|differs| differs)
    }
}

/// Names of the channels besides the colours, with the kind of their values.
fn channels(file: &ImageFile) -> Vec<String> {
    let alpha = file.options.alpha.iter().map(|_| "A".to_owned());
    let name = |channel: &Channel| match channel.samples {
        Samples::Real(_) => channel.name.clone(),
        Samples::Whole(_) => format!("{} (integers)", channel.name),
    };
    alpha.chain(file.options.channels.iter().map(name)).collect()
}

/// Names in the first list that are not in the second, or "none".
fn only_in_first((first, second): (&Vec<String>, &Vec<String>)) -> String {
    let names: Vec<_> =
        first.iter().filter(|name| !second.contains(name)).map(String::as_str).collect();
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(size: [u32; 2], value: f32, id: u32) -> ImageFile {
        let count = (size[0] * size[1]) as usize;
        let channel =
            |name: &str, samples| Channel { name: name.into(), samples, half_suffices: true };
        let channels = vec![
            channel("depth.Z", Samples::Real(vec![value; count])),
            channel("object.id", Samples::Whole(vec![id; count])),
        ];
        let options =
            SaveOptions { channels, alpha: Some(vec![1.0; count]), ..SaveOptions::default() };
        let image =
            Image { width: size[0], height: size[1], pixels: vec![[value; 3]; count].into() };
        ImageFile { image, options, frame: None }
    }

    #[test]
    fn parts_stand_at_their_places_and_gaps_are_found() {
        let first = part([2, 1], 1.0, 7);
        let mut mosaic = Mosaic::new([3, 2], &first).expect("it fits");
        assert_eq!(mosaic.gap(), Some([0, 0, 3, 2]));
        assert_eq!(mosaic.add([0, 0], &first), Ok(()));
        assert_eq!(mosaic.gap(), Some([2, 0, 1, 2]));
        assert_eq!(mosaic.add([2, 0], &part([1, 2], 2.0, 8)), Ok(()));
        assert_eq!(mosaic.gap(), Some([0, 1, 2, 1]));
        assert_eq!(mosaic.add([0, 1], &part([2, 1], 3.0, 9)), Ok(()));
        assert_eq!(mosaic.gap(), None);
        let ImageFile { image, options, .. } = mosaic.into_file();
        let values = [1.0, 1.0, 2.0, 3.0, 3.0, 2.0];
        assert_eq!(image.pixels, values.map(|v| [v; 3]));
        assert_eq!(options.channels[0].samples, Samples::Real(values.to_vec()));
        assert_eq!(options.channels[1].samples, Samples::Whole(vec![7, 7, 8, 9, 9, 8]));
        assert_eq!(options.alpha, Some(vec![1.0; 6]));
    }

    /// Equal pixels may overlap; others, of any channel, may not, and change nothing.
    #[test]
    fn what_does_not_belong_is_refused() {
        let first = part([2, 2], 1.0, 7);
        let mut mosaic = Mosaic::new([3, 2], &first).expect("it fits");
        assert_eq!(mosaic.add([0, 0], &first), Ok(()));
        assert_eq!(mosaic.add([1, 0], &first), Ok(()), "equal values");
        for other in [part([1, 1], 1.0, 8), part([1, 1], 1.5, 7)] {
            assert_eq!(mosaic.add([2, 1], &other), Err(MosaicError::Overlap { x: 2, y: 1 }));
        }
        let outside = MosaicError::Outside { x: 2, y: 0, width: 2, height: 2 };
        assert_eq!(mosaic.add([2, 0], &first), Err(outside));
        let mut without = first.clone();
        without.options.channels.pop();
        let error = mosaic.add([0, 0], &without).expect_err("a channel is missing").to_string();
        assert_eq!(error, "found other channels: none in addition, object.id (integers) missing");
    }
}
