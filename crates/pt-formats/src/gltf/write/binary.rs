//! The buffer of a binary file with its views and accessors, and what is around them. [glTF 2.0,
//! §3.6 and §4.4]

use serde_json::{Map, Value, json};

use super::super::container;

/// Data of vertices.
const VERTICES: u32 = 34_962;
/// Indices of vertices.
const INDICES: u32 = 34_963;
/// What readers may take for the end of a strip. [glTF 2.0, §3.7.2.1]
const LAST_SHORT: usize = 65_535;

/// Numbers of single precision.
const F32: u32 = 5126;
/// Whole numbers of 16 bits.
const U16: u32 = 5123;
/// Whole numbers of 32 bits.
const U32: u32 = 5125;

/// The only buffer of a file, and the lists that say what is where in it.
#[derive(Default)]
pub(super) struct Binary {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Binary {
    /// Adds bytes, and gives the index of their view.
    pub(super) fn view(&mut self, bytes: impl IntoIterator<Item = u8>) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let start = self.bytes.len();
        self.bytes.extend(bytes);
        let length = self.bytes.len() - start;
        self.views.push(json!({"buffer": 0, "byteOffset": start, "byteLength": length}));
        self.views.len() - 1
    }

    /// Adds values at vertices, all finite, and gives the index of their accessor. Positions are
    /// told with the box around them.
    pub(super) fn vertices<const N: usize>(
        &mut self,
        values: &[[f32; N]],
        has_bounds: bool,
    ) -> usize {
        let view = self.view(values.as_flattened().iter().flat_map(|x| x.to_le_bytes()));
        self.views[view]["target"] = VERTICES.into();
        let kind = format!("VEC{N}");
        let mut accessor = json!({
            "bufferView": view, "componentType": F32, "count": values.len(), "type": kind
        });
        if has_bounds {
            let of = |pick: fn(f32, f32) -> f32| {
                let range =
                    values.iter().copied().reduce(|a, b| std::array::from_fn(|c| pick(a[c], b[c])));
                Value::from(range.unwrap_or([0.0; N]).to_vec())
            };
            accessor["min"] = of(f32::min);
            accessor["max"] = of(f32::max);
        }
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    /// Adds indices below `vertices`, and gives the index of their accessor.
    pub(super) fn indices(&mut self, corners: &[u32], vertices: usize) -> usize {
        let (view, component) = if vertices <= LAST_SHORT {
            (self.view(corners.iter().flat_map(|i| (*i as u16).to_le_bytes())), U16)
        } else {
            (self.view(corners.iter().flat_map(|i| i.to_le_bytes())), U32)
        };
        self.views[view]["target"] = INDICES.into();
        self.accessors.push(json!({
            "bufferView": view, "componentType": component, "count": corners.len(), "type": "SCALAR"
        }));
        self.accessors.len() - 1
    }

    /// The bytes of a file with these lists.
    ///
    /// # Errors
    /// If they are more than the 4 GiB that a file may have.
    pub(super) fn finish(mut self, mut root: Map<String, Value>) -> Result<Vec<u8>, String> {
        if !self.bytes.is_empty() {
            self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
            root.insert("buffers".to_owned(), json!([{"byteLength": self.bytes.len()}]));
            root.insert("bufferViews".to_owned(), self.views.into());
        }
        if !self.accessors.is_empty() {
            root.insert("accessors".to_owned(), self.accessors.into());
        }
        container::pack(Value::Object(root).to_string().into_bytes(), &self.bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn indices_are_as_short_as_they_may_be() {
        for (vertices, component) in [(3, U16), (65_535, U16), (65_536, U32)] {
            let mut binary = Binary::default();
            binary.indices(&[0, 1, 2], vertices);
            assert_eq!(binary.accessors[0]["componentType"], component);
        }
    }

    #[test]
    fn positions_are_told_with_their_box() {
        let mut binary = Binary::default();
        binary.view([1]);
        binary.vertices(&[[0.1, -1.0], [0.2, -2.0]], true);
        assert_eq!(binary.views[1]["byteOffset"], 4);
        assert_eq!(binary.accessors[0]["min"], json!([f64::from(0.1_f32), -2.0]));
        assert_eq!(binary.accessors[0]["max"], json!([f64::from(0.2_f32), -1.0]));
    }
}
