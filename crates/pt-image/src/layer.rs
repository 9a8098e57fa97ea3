//! Layers of image files: channels whose names begin with the same name and a dot.

use pt_scene::image::{Channel, Image, Samples};

use super::{Decoded, ImageFile};

/// Suffixes of the three channels that are shown as red, green and blue, in the order in which they
/// are tried; an empty one is black.
const COLORS: [[&str; 3]; 3] = [["R", "G", "B"], ["X", "Y", "Z"], ["U", "V", ""]];

impl ImageFile {
    /// Returns the names of all layers, in the order of the file.
    pub fn layers(&self) -> Vec<&str> {
        let mut names: Vec<&str> = Vec::new();
        for channel in &self.options.channels {
            let name = channel.name.rsplit_once('.').map_or(channel.name.as_str(), |(l, _)| l);
            if !names.contains(&name) {
                names.push(name);
            }
        }
        names
    }

    /// Returns the values of a channel as real numbers.
    pub fn channel(&self, name: &str) -> Option<Vec<f32>> {
        let channel = self.options.channels.iter().find(|channel| channel.name == name)?;
        Some(reals(channel))
    }

    /// Returns three channels of a layer, by their suffixes, as one plane.
    pub fn plane(&self, layer: &str, suffixes: [&str; 3]) -> Option<Vec<[f32; 3]>> {
        let channel = |suffix: &str| match suffix {
            "" => Some(vec![0.0; self.image.pixels.len()]),
            _ => self.channel(&format!("{layer}.{suffix}")),
        };
        let [first, second, third] = suffixes.map(channel);
        let pixels = first?.into_iter().zip(second?).zip(third?);
        Some(pixels.map(|((r, g), b)| [r, g, b]).collect())
    }

    /// Returns a layer as an image: its channels R, G and B; X, Y and Z; U and V; its only channel
    /// in grey; or the channel of this full name in grey. A channel A is its alpha.
    pub fn layer(&self, name: &str) -> Option<Decoded> {
        let of_colors = || COLORS.into_iter().find_map(|suffixes| self.plane(name, suffixes));
        let grey = |values: Vec<f32>| values.into_iter().map(|v| [v; 3]).collect();
        let only = || {
            let is_part = |channel: &&Channel| {
                let rest = channel.name.strip_prefix(name).and_then(|rest| rest.strip_prefix('.'));
                rest.is_some_and(|suffix| !suffix.contains('.'))
            };
            let mut parts = self.options.channels.iter().filter(is_part);
            let first = parts.next()?;
            parts.next().is_none().then(|| grey(reals(first)))
        };
        let pixels = of_colors().or_else(only).or_else(|| self.channel(name).map(grey))?;
        let Image { width, height, .. } = self.image;
        Some(Decoded {
            image: Image { width, height, pixels: pixels.into() },
            alpha: self.channel(&format!("{name}.A")),
            frame: self.frame,
        })
    }
}

fn reals(channel: &Channel) -> Vec<f32> {
    match &channel.samples {
        Samples::Real(values) => values.clone(),
        Samples::Whole(values) => values.iter().map(|&v| v as f32).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SaveOptions;

    fn file(channels: &[(&str, f32)]) -> ImageFile {
        let channel = |(name, value): &(&str, f32)| Channel {
            name: (*name).to_owned(),
            samples: match *name {
                "object.id" => Samples::Whole(vec![*value as u32]),
                _ => Samples::Real(vec![*value]),
            },
            half_suffices: false,
        };
        let channels = channels.iter().map(channel).collect();
        ImageFile {
            image: Image { width: 1, height: 1, pixels: vec![[9.0; 3]].into() },
            options: SaveOptions { channels, ..SaveOptions::default() },
            frame: None,
        }
    }

    #[test]
    fn layers_are_shown_by_the_suffixes_of_their_channels() {
        let file = file(&[
            ("a.A", 0.5),
            ("a.B", 3.0),
            ("a.G", 2.0),
            ("a.R", 1.0),
            ("b.c.Z", 4.0),
            ("object.id", 7.0),
            ("uv.U", 5.0),
            ("uv.V", 6.0),
            ("n.X", 1.0),
            ("n.Y", -2.0),
            ("n.Z", 3.0),
            ("plain", 8.0),
        ]);
        assert_eq!(file.layers(), ["a", "b.c", "object", "uv", "n", "plain"]);
        let layer = |name: &str| {
            let decoded = file.layer(name)?;
            Some((decoded.image.pixels[0], decoded.alpha.map(|alpha| alpha[0])))
        };
        for (name, expected) in [
            ("a", Some(([1.0, 2.0, 3.0], Some(0.5)))),
            ("a.G", Some(([2.0; 3], None))),
            ("b.c", Some(([4.0; 3], None))),
            ("object", Some(([7.0; 3], None))),
            ("uv", Some(([5.0, 6.0, 0.0], None))),
            ("n", Some(([1.0, -2.0, 3.0], None))),
            ("plain", Some(([8.0; 3], None))),
            ("b", None),
            ("", None),
        ] {
            assert_eq!(layer(name), expected, "{name}");
        }
    }
}
