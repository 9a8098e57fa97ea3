//! What a scene file may ask for.

use std::time::Duration;

use super::xml::{did_you_mean, quote};

/// What the reading of a scene may take. What is `None` is limited by what each format has by
/// itself, which docs/formats.md lists.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Limits {
    /// Bytes of the files that are read, of the pictures in them, and of the meshes of the scene,
    /// together.
    pub memory: Option<u64>,
    /// Nesting of elements, objects, nodes and attributes; a format may have a lower limit.
    pub depth: Option<u64>,
    /// Shapes in the scene, each as often as it is placed.
    pub shapes: Option<u64>,
    /// Elements of an XML file, and values in the JSON of a glTF file.
    pub elements: Option<u64>,
    /// Width and height of a picture, in pixels.
    pub texture_side: Option<u64>,
    /// Pixels of a picture.
    pub texture_pixels: Option<u64>,
    /// How deep files may include each other.
    pub include_depth: Option<u64>,
    /// Files that are included.
    pub files: Option<u64>,
    /// Seconds of reading, which are looked at between items; half a second later, reading of a
    /// file is given up in the middle of one, which goes on until its end on a thread of its
    /// own, for nothing.
    pub seconds: Option<u64>,
    /// Triangles that the round and bent shapes of pbrt-v4 scenes, and each file of curves of
    /// Mitsuba, are cut into.
    pub triangles: Option<u64>,
}

impl Limits {
    /// The names of all limits.
    pub const NAMES: [&str; 10] = [
        "memory",
        "depth",
        "shapes",
        "elements",
        "texture-side",
        "texture-pixels",
        "include-depth",
        "files",
        "seconds",
        "triangles",
    ];

    /// Sets the limit of a name.
    ///
    /// # Errors
    /// If there is none, with the nearest ones or the list.
    pub fn set(&mut self, name: &str, value: u64) -> Result<(), String> {
        let limit = match name {
            "memory" => &mut self.memory,
            "depth" => &mut self.depth,
            "shapes" => &mut self.shapes,
            "elements" => &mut self.elements,
            "texture-side" => &mut self.texture_side,
            "texture-pixels" => &mut self.texture_pixels,
            "include-depth" => &mut self.include_depth,
            "files" => &mut self.files,
            "seconds" => &mut self.seconds,
            "triangles" => &mut self.triangles,
            _ => {
                let hint = did_you_mean(name, Self::NAMES.into_iter());
                let all = Self::NAMES.join(", ");
                return Err(format!("there is no limit {}{hint}; all: {all}", quote(name)));
            }
        };
        *limit = Some(value);
        Ok(())
    }

    /// What nesting may reach, where a format has this limit by itself, which is not exceeded:
    /// readers recurse.
    pub(super) fn depth(&self, of_format: usize) -> usize {
        or(self.depth, of_format).min(of_format)
    }

    /// What the number of shapes may reach, where a format has this limit by itself.
    pub(super) fn shapes(&self, of_format: usize) -> usize {
        or(self.shapes, of_format)
    }

    /// What the number of triangles may reach, where a format has this limit by itself.
    pub(super) fn triangles(&self, of_format: usize) -> usize {
        or(self.triangles, of_format)
    }

    /// What the number of elements may reach, where a format has this limit by itself.
    pub(super) fn elements(&self, of_format: usize) -> usize {
        or(self.elements, of_format)
    }

    /// What the nesting of included files may reach, where a format has this limit by itself, which
    /// is not exceeded.
    pub(super) fn include_depth(&self, of_format: usize) -> usize {
        or(self.include_depth, of_format).min(of_format)
    }

    /// What the number of included files may reach, where a format has this limit by itself.
    pub(super) fn files(&self, of_format: usize) -> usize {
        or(self.files, of_format)
    }

    /// The time that reading may take, if it is limited.
    pub(super) fn time(&self) -> Option<Duration> {
        self.seconds.map(Duration::from_secs)
    }
}

fn or(limit: Option<u64>, of_format: usize) -> usize {
    limit.map_or(of_format, |limit| usize::try_from(limit).unwrap_or(usize::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_set_by_their_names() {
        let mut limits = Limits::default();
        for (i, name) in (0..).zip(Limits::NAMES) {
            limits.set(name, i).expect("a name");
        }
        let Limits { memory, depth, texture_side, seconds, .. } = limits;
        assert_eq!([memory, depth, texture_side, seconds], [0, 1, 4, 8].map(Some));
        let error = limits.set("texture-sides", 1).expect_err("no name");
        assert!(error.contains("did you mean \"texture-side\""), "{error}");
        assert!(error.contains("include-depth, files, seconds, triangles"), "{error}");
    }
}
