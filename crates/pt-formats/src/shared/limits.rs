//! Resource limits of scene files.

use std::time::Duration;

use super::names::{did_you_mean, quote};

/// Resource limits of reading a scene. For `None`, the limits of each format apply, which
/// `docs/formats.md` lists.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Limits {
    /// Total number of bytes of the files that are read, of their images, and of the meshes of the
    /// scene.
    pub memory: Option<u64>,
    /// Maximum nesting of elements, objects, nodes and attributes; a format may have a lower limit.
    pub depth: Option<u64>,
    /// Maximum number of shapes in the scene, counted once per instance.
    pub shapes: Option<u64>,
    /// Maximum number of elements of an XML file, and of values in the JSON of a glTF file.
    pub elements: Option<u64>,
    /// Maximum width and height of an image, in pixels.
    pub texture_side: Option<u64>,
    /// Maximum number of pixels of an image.
    pub texture_pixels: Option<u64>,
    /// Maximum nesting of included files.
    pub include_depth: Option<u64>,
    /// Maximum number of included files.
    pub files: Option<u64>,
    /// Maximum time of the read in seconds, which is checked between items. Half a second later,
    /// the read of an item is abandoned; it continues to its end on a thread of its own, and its
    /// result is lost.
    pub seconds: Option<u64>,
    /// Maximum number of triangles of the tessellated shapes of pbrt-v4 scenes, and of each file of
    /// curves of Mitsuba.
    pub triangles: Option<u64>,
}

impl Limits {
    /// Names of all limits.
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
    /// Returns a message if there is no such limit, with similar names or all names.
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
                return Err(format!("unknown limit {}{hint}; known: {all}", quote(name)));
            }
        };
        *limit = Some(value);
        Ok(())
    }

    /// Returns the maximum nesting for a format with this limit, which is never exceeded: readers
    /// recurse.
    pub(crate) fn depth(&self, of_format: usize) -> usize {
        or(self.depth, of_format).min(of_format)
    }

    /// Returns the maximum number of shapes, where the format has this default.
    pub(crate) fn shapes(&self, of_format: usize) -> usize {
        or(self.shapes, of_format)
    }

    /// Returns the maximum number of triangles, where the format has this default.
    pub(crate) fn triangles(&self, of_format: usize) -> usize {
        or(self.triangles, of_format)
    }

    /// Returns the maximum number of elements, where the format has this default.
    pub(crate) fn elements(&self, of_format: usize) -> usize {
        or(self.elements, of_format)
    }

    /// Returns the maximum nesting of included files for a format with this limit, which is never
    /// exceeded.
    pub(crate) fn include_depth(&self, of_format: usize) -> usize {
        or(self.include_depth, of_format).min(of_format)
    }

    /// Returns the maximum number of included files, where the format has this default.
    pub(crate) fn files(&self, of_format: usize) -> usize {
        or(self.files, of_format)
    }

    /// Returns the maximum time of the read; `None` if unlimited.
    pub(crate) fn time(&self) -> Option<Duration> {
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
