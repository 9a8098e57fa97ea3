//! Display windows: placement of pixels in a larger or smaller frame.

use pt_scene::image::{Image, Samples};

use super::{Decoded, ImageMemory};

/// A display window that differs from the data window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DisplayWindow {
    /// Position of the first pixel relative to the upper left corner of the display window, to the
    /// right and down.
    pub offset: [i64; 2],
    /// Width and height of the display window.
    pub size: [u32; 2],
}

impl DisplayWindow {
    /// Number of pixels.
    pub(super) fn area(&self) -> u64 {
        u64::from(self.size[0]) * u64::from(self.size[1])
    }

    /// Copies the rows of an image of this size to their positions in the rows of the window; data
    /// beyond the edges of the window are left out.
    pub(super) fn copy<T: Copy>(&self, from: &[T], [width, height]: [u32; 2], to: &mut [T]) {
        let visible = |side: u32, begin: i64, length: u32| {
            let from = (-begin).clamp(0, i64::from(side));
            let to = (i64::from(length) - begin).clamp(from, i64::from(side));
            from as usize..to as usize
        };
        let columns = visible(width, self.offset[0], self.size[0]);
        if columns.is_empty() {
            return;
        }
        for row in visible(height, self.offset[1], self.size[1]) {
            let source = row * width as usize;
            let target = (row as i64 + self.offset[1]) as usize * self.size[0] as usize;
            let start = target + (columns.start as i64 + self.offset[0]) as usize;
            to[start..start + columns.len()]
                .copy_from_slice(&from[source + columns.start..source + columns.end]);
        }
    }

    /// Content of the window: zero where there are no data.
    pub(super) fn content<T: Copy + Default>(&self, from: &[T], size: [u32; 2]) -> Vec<T> {
        let mut to = vec![T::default(); self.area() as usize];
        self.copy(from, size, &mut to);
        to
    }

    /// Content of the window of a channel.
    pub(super) fn samples(&self, from: &Samples, size: [u32; 2]) -> Samples {
        match from {
            Samples::Real(values) => Samples::Real(self.content(values, size)),
            Samples::Whole(values) => Samples::Whole(self.content(values, size)),
        }
    }
}

impl Decoded {
    /// Returns the content of the display window: black and transparent where there is no data, and
    /// without data beyond its edges.
    ///
    /// # Errors
    /// Returns a message if it has more than a gibibyte of pixels.
    pub fn framed(self) -> Result<Self, String> {
        let Some(window) = self.frame else { return Ok(self) };
        let _grant =
            ImageMemory::OF_PROCESS.ask(window.area().checked_mul(size_of::<[f32; 4]>() as u64))?;
        let size = [self.image.width, self.image.height];
        let [width, height] = window.size;
        Ok(Self {
            image: Image { width, height, pixels: window.content(&self.image.pixels, size).into() },
            alpha: self.alpha.map(|alpha| window.content(&alpha, size)),
            frame: None,
        })
    }

    /// Returns a rectangle of the image by its upper left corner and its size.
    ///
    /// # Errors
    /// Returns a message if it has more than a gibibyte of pixels.
    pub fn cropped(self, [x, y]: [u32; 2], size: [u32; 2]) -> Result<Self, String> {
        let offset = [-i64::from(x), -i64::from(y)];
        Self { frame: Some(DisplayWindow { offset, size }), ..self }.framed()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The window is larger on the left and at the bottom, and smaller on the right and at the top.
    #[test]
    fn data_stand_at_their_place_in_the_window() {
        let window = DisplayWindow { offset: [1, -1], size: [3, 3] };
        assert_eq!(
            window.content(&[1, 2, 3, 4, 5, 6, 7, 8, 9], [3, 3]),
            [0, 4, 5, 0, 7, 8, 0, 0, 0]
        );
        let beside = DisplayWindow { offset: [9, 0], size: [2, 1] };
        assert_eq!(beside.content(&[1, 2], [2, 1]), [0, 0]);
    }
}
