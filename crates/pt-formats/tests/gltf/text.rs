//! Builder of small files.

use std::fmt::Write;

use serde_json::{Value, json};

/// Encodes bytes as a data URI.
pub(crate) fn data(bytes: &[u8]) -> String {
    let mut uri = "data:application/octet-stream,".to_owned();
    for byte in bytes {
        write!(uri, "%{byte:02X}").expect("texts have room");
    }
    uri
}

/// A file with accessors of numbers.
#[derive(Default)]
pub(crate) struct Text {
    bytes: Vec<u8>,
    accessors: Vec<Value>,
    views: Vec<Value>,
}

impl Text {
    /// Adds an accessor of bytes with a type such as "VEC3" and a component type such as 5126.
    pub(crate) fn accessor(
        &mut self,
        bytes: &[u8],
        kind: &str,
        component: usize,
        count: usize,
    ) -> usize {
        self.views
            .push(json!({"buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len()}));
        self.bytes.extend_from_slice(bytes);
        self.accessors.push(json!({
            "bufferView": self.views.len() - 1, "type": kind, "componentType": component, "count": count
        }));
        self.accessors.len() - 1
    }

    /// Adds an accessor of single-precision vectors.
    pub(crate) fn vectors<const N: usize>(&mut self, vectors: &[[f32; N]]) -> usize {
        let kind = ["SCALAR", "VEC2", "VEC3", "VEC4"].get(N - 1).unwrap_or(&"MAT4");
        let bytes: Vec<u8> = vectors.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect();
        self.accessor(&bytes, kind, 5126, vectors.len())
    }

    /// Adds an accessor of 8-bit colours, each padded to four bytes, which may be marked as
    /// normalized.
    pub(crate) fn levels(&mut self, colors: &[[u8; 3]], is_normalized: bool) -> usize {
        let bytes: Vec<u8> = colors.iter().flat_map(|[r, g, b]| [*r, *g, *b, 0]).collect();
        let accessor = self.accessor(&bytes, "VEC3", 5121, colors.len());
        self.views[accessor]["byteStride"] = 4.into();
        if is_normalized {
            self.accessors[accessor]["normalized"] = true.into();
        }
        accessor
    }

    /// Adds the positions of a triangle.
    pub(crate) fn triangle(&mut self) -> Value {
        json!({"POSITION": self.vectors(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])})
    }

    /// Returns the file with the given fields and the accessors.
    pub(crate) fn with(self, mut fields: Value) -> String {
        fields["asset"] = json!({"version": "2.0"});
        if !self.bytes.is_empty() {
            fields["accessors"] = self.accessors.into();
            fields["bufferViews"] = self.views.into();
            fields["buffers"] = json!([{"uri": data(&self.bytes), "byteLength": self.bytes.len()}]);
        }
        fields.to_string()
    }
}
