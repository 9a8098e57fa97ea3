//! Sources: arrays of numbers, and accessors that split them into values.

use std::ops::Range;

use super::reader::{ColladaReader, child, children, elements};
use crate::LoadError;
use crate::collada::pool::Pool;
use crate::shared::xml::XmlNode;

/// Treatment of numbers that are infinite or NaN.
#[derive(Clone, Copy)]
pub(super) enum NonFinite {
    /// The file is rejected.
    Refuse,
    /// The whole value becomes zero, with a warning.
    Zero,
}

impl<const N: usize> Pool<N> {
    /// Returns the indices of the values of a source, which is read on first use.
    pub(super) fn load<'a>(
        &mut self,
        reader: &mut ColladaReader<'a>,
        source: XmlNode<'a>,
        non_finite: NonFinite,
    ) -> Result<Range<u32>, LoadError> {
        if let Some(range) = self.sources.get(&source.id()) {
            return Ok(range.clone());
        }
        let start = self.values.len() as u32;
        self.read(reader, source)?;
        self.check_finite(reader, source, start as usize, non_finite)?;
        let range = start..self.values.len() as u32;
        self.sources.insert(source.id(), range.clone());
        Ok(range)
    }

    /// Appends the values of a source.
    fn read<'a>(
        &mut self,
        reader: &mut ColladaReader<'a>,
        source: XmlNode<'a>,
    ) -> Result<(), LoadError> {
        let accessor = child(source, "technique_common").and_then(|t| child(t, "accessor"));
        let array = match accessor {
            Some(accessor) if accessor.attribute("source").is_some() => {
                reader.resolve(accessor, "source", &["float_array"])?
            }
            _ => child(source, "float_array"),
        };
        let Some(array) = array else {
            return Err(reader.error(source, "missing <float_array>"));
        };
        let numbers = reader.document.numbers::<f32>(array)?;
        check_count(reader, array, numbers.len());
        let layout = match accessor {
            Some(accessor) => AccessorLayout::of(reader, accessor, numbers.len())?,
            None => AccessorLayout::packed(N, numbers.len()),
        };
        let Some(components) = layout.components.first_chunk::<N>() else {
            let message = format!(
                "found values of {} components, expected {N}; see <param> in the <accessor>",
                layout.components.len()
            );
            return Err(reader.error(source, message));
        };
        reader.count_values(source, numbers.len().max(layout.count.saturating_mul(N)))?;
        self.values.extend((0..layout.count).map(|i| {
            let first = layout.offset + i * layout.stride;
            components.map(|c| numbers[first + c])
        }));
        Ok(())
    }

    /// Checks the values from `start` for infinite numbers and NaN.
    fn check_finite<'a>(
        &mut self,
        reader: &mut ColladaReader<'a>,
        source: XmlNode<'a>,
        start: usize,
        non_finite: NonFinite,
    ) -> Result<(), LoadError> {
        let mut bad = 0;
        for (i, value) in self.values[start..].iter_mut().enumerate() {
            if value.iter().all(|c| c.is_finite()) {
                continue;
            }
            if let NonFinite::Refuse = non_finite {
                let message =
                    format!("found {value:?} as value {}, expected finite numbers", i + 1);
                return Err(reader.error(source, message));
            }
            *value = [0.0; N];
            bad += 1;
        }
        if bad > 0 {
            let message = format!("infinite and NaN values are replaced by zero: {bad}");
            reader.warn(source, message);
        }
        Ok(())
    }
}

/// Layout of the values of an accessor, all of which are inside the array.
struct AccessorLayout {
    count: usize,
    stride: usize,
    offset: usize,
    /// Offsets of the components inside a value.
    components: Vec<usize>,
}

impl AccessorLayout {
    /// Returns the layout of consecutive values of `n` numbers.
    fn packed(n: usize, length: usize) -> Self {
        Self { count: length / n, stride: n, offset: 0, components: (0..n).collect() }
    }

    /// Reads the layout of an `<accessor>` for an array of `length` numbers.
    fn of<'a>(
        reader: &mut ColladaReader<'a>,
        accessor: XmlNode<'a>,
        length: usize,
    ) -> Result<Self, LoadError> {
        let params: Vec<_> = children(accessor, "param").collect();
        let stride = match whole_number(reader, accessor, "stride")? {
            Some(0) => return Err(reader.error(accessor, "found stride=\"0\", expected 1 or more")),
            Some(stride) => stride,
            None => params.len().max(1),
        };
        let offset = whole_number(reader, accessor, "offset")?.unwrap_or(0);
        // Parameters without a name are skipped.
        let is_named = |p: &XmlNode<'_>| p.attribute("name").is_some_and(|name| !name.is_empty());
        let mut components: Vec<_> = (0..params.len()).filter(|i| is_named(&params[*i])).collect();
        if components.is_empty() {
            components = (0..stride.min(length)).collect();
        }
        let reach = components.last().map_or(0, |last| last + 1);
        let available = match length.checked_sub(offset.saturating_add(reach)) {
            Some(rest) if reach > 0 => rest / stride + 1,
            _ => 0,
        };
        let count = whole_number(reader, accessor, "count")?.unwrap_or(available);
        if count > available {
            let message = format!(
                "found {available} values in an array of {length} numbers, expected \
                 count=\"{count}\"; the former number is used"
            );
            reader.warn(accessor, message);
        }
        Ok(Self { count: count.min(available), stride, offset, components })
    }
}

/// Reads a non-negative integer attribute.
pub(super) fn whole_number(
    reader: &ColladaReader<'_>,
    node: XmlNode<'_>,
    attribute: &str,
) -> Result<Option<usize>, LoadError> {
    let parsed = node.attribute(attribute).map(|written| {
        written.trim().parse::<usize>().map_err(|_| {
            let message =
                format!("found {attribute}=\"{written}\", expected a whole number from 0 up");
            reader.document.error_at(node, written, message)
        })
    });
    parsed.transpose()
}

/// Warns if a `count` differs from the actual number.
fn check_count<'a>(reader: &mut ColladaReader<'a>, array: XmlNode<'a>, found: usize) {
    let Some(written) = array.attribute("count") else { return };
    if written.trim().parse() != Ok(found) {
        let message = format!(
            "found {found} numbers, expected count=\"{written}\"; the former number is used"
        );
        reader.warn(array, message);
    }
}

/// Iterates over the inputs of a `<vertices>` or of a primitive.
pub(super) fn inputs(node: XmlNode<'_>) -> impl Iterator<Item = XmlNode<'_>> {
    elements(node).filter(|n| n.tag_name().name() == "input")
}
