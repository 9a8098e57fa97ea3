//! The buffer of a binary file, its views and accessors, and the chunks around them. [glTF 2.0,
//! §3.6 and §4.4]

use serde_json::{Map, Value, json};

use super::super::container;

/// Target of buffer views of vertex attributes.
const VERTICES: u32 = 34_962;
/// Target of buffer views of vertex indices.
const INDICES: u32 = 34_963;
/// Largest number of vertices for indices of 16 bits. The index 65535 is excluded, since readers
/// may interpret it as primitive restart. [glTF 2.0, §3.7.2.1]
const LAST_SHORT: usize = 65_535;

/// Component type of single-precision numbers.
const F32: u32 = 5126;
/// Component type of 16-bit integers.
const U16: u32 = 5123;
/// Component type of 32-bit integers.
const U32: u32 = 5125;

/// The only buffer of a file, with its views and accessors.
#[derive(Default)]
pub(super) struct BinaryBuffer {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl BinaryBuffer {
    /// Adds bytes and returns the index of their view.
    pub(super) fn view(&mut self, bytes: impl IntoIterator<Item = u8>) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let start = self.bytes.len();
        self.bytes.extend(bytes);
        let length = self.bytes.len() - start;
        self.views.push(json!({"buffer": 0, "byteOffset": start, "byteLength": length}));
        self.views.len() - 1
    }

    /// Adds vertex attributes, all finite, and returns the index of their accessor. With
    /// `has_bounds`, the accessor contains the minimum and the maximum, as positions require.
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

    /// Adds indices below `vertices` and returns the index of their accessor.
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

    /// Returns the bytes of a file with this JSON and buffer.
    ///
    /// # Errors
    /// If they exceed 4 GiB, the limit of a file.
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
            let mut binary = BinaryBuffer::default();
            binary.indices(&[0, 1, 2], vertices);
            assert_eq!(binary.accessors[0]["componentType"], component);
        }
    }

    #[test]
    fn positions_are_reported_with_their_box() {
        let mut binary = BinaryBuffer::default();
        binary.view([1]);
        binary.vertices(&[[0.1, -1.0], [0.2, -2.0]], true);
        assert_eq!(binary.views[1]["byteOffset"], 4);
        assert_eq!(binary.accessors[0]["min"], json!([f64::from(0.1_f32), -2.0]));
        assert_eq!(binary.accessors[0]["max"], json!([f64::from(0.2_f32), -1.0]));
    }
}
