//! Data after the header, in chunks of rows that are read in parallel.
//!
//! The start of each chunk is found first, which is fast: rows of a text are its lines, which are
//! counted in parallel, and those of binary files have a constant size except for their lists,
//! which begin with their lengths. The contents of rows are read in parallel and merged in file
//! order, so neither the result nor the list of errors depends on the number of threads.

use std::path::Path;

use ply_rs_bw::ply::{ElementDef, Encoding};
use rayon::prelude::*;

use super::layout::{ElementLayout, NumberType, PlyProperty, PropertyKind};
use super::words::{BinaryWords, ElementRow, RowWords, Text};
use crate::LoadError;
use crate::shared::mesh_diagnostics::MeshDiagnostics;
use crate::shared::mesh_file;

/// Number of rows that a thread reads at a time.
pub(super) const ROWS: usize = 4096;
/// Number of chunks that are read before their contents are merged.
const CHUNKS: usize = 64;
/// Approximate number of bytes of a chunk of a text.
const BYTES: usize = 1 << 17;

/// Data after the header.
pub(super) struct Body<'a> {
    pub(super) path: &'a Path,
    pub(super) encoding: Encoding,
    /// Line of the next row of a text file.
    pub(super) line: u32,
    /// Bytes not read yet.
    pub(super) rest: &'a [u8],
    /// Errors of rows.
    pub(super) faults: &'a mut MeshDiagnostics,
}

/// A range of rows.
pub(super) struct RowChunk<'a> {
    path: &'a Path,
    encoding: Encoding,
    layout: &'a ElementLayout<'a>,
    /// Index of the first row.
    pub(super) first: usize,
    /// Number of rows.
    pub(super) count: usize,
    bytes: &'a [u8],
    /// Line of the first row of a text file; 0 in binary files.
    line: u32,
}

impl<'a> Body<'a> {
    /// Reads all rows of an element: `read` those of a chunk, recording errors, and `take` the
    /// results, in file order.
    ///
    /// # Errors
    /// Returns an error if nothing more can be read.
    pub(super) fn read<P: Send>(
        &mut self,
        layout: &ElementLayout,
        read: impl Fn(&RowChunk, &mut MeshDiagnostics) -> P + Sync,
        mut take: impl FnMut(P),
    ) -> Result<(), LoadError> {
        let mut done = 0;
        while done < layout.element.count {
            let (chunks, end) = self.batch(layout, done);
            if let (Some(first), Some((name, kind))) = (chunks.first(), layout.unsupported) {
                return Err(first.error(
                    first.line,
                    format!(
                        "invalid {} 0: PLY property '{name}' with declared type {kind:?} is \
                         unsupported",
                        layout.element.name
                    ),
                ));
            }
            let noting = |chunk: &RowChunk| {
                let mut faults = MeshDiagnostics::default();
                (read(chunk, &mut faults), faults)
            };
            for (part, faults) in side_by_side(&chunks, noting) {
                take(part);
                self.faults.append(faults);
            }
            if self.faults.is_full() {
                return Err(LoadError::AlreadyReported);
            }
            done += chunks.iter().map(|chunk| chunk.count).sum::<usize>();
            end.map_or(Ok(()), Err)?;
        }
        Ok(())
    }

    /// Skips an element.
    pub(super) fn skip(&mut self, element: &ElementDef) -> Result<(), LoadError> {
        // Rows without properties take no bytes, whatever their number.
        if element.properties.is_empty() && self.encoding != Encoding::Ascii {
            return Ok(());
        }
        self.read(&ElementLayout::passed_over(element), |_, _| (), |()| ())
    }

    /// Returns the next chunks of an element of which `done` rows are read, and the error that ends
    /// them, if any.
    fn batch<'l>(
        &mut self,
        layout: &'l ElementLayout<'l>,
        done: usize,
    ) -> (Vec<RowChunk<'l>>, Option<LoadError>)
    where
        'a: 'l,
    {
        let mut chunks = self.text_chunks(layout, done);
        let mut first = done + chunks.iter().map(|chunk| chunk.count).sum::<usize>();
        while chunks.len() < CHUNKS && first < layout.element.count {
            let (chunk, end) = self.chunk(layout, first);
            first += chunk.count;
            if chunk.count > 0 {
                chunks.push(chunk);
            }
            if end.is_some() {
                return (chunks, end);
            }
        }
        (chunks, None)
    }

    /// Returns the next chunks of a text that consist of rows of an element only, of which `done`
    /// rows are read: their lines are counted in parallel. Empty if few rows are left.
    fn text_chunks<'l>(&mut self, layout: &'l ElementLayout<'l>, done: usize) -> Vec<RowChunk<'l>>
    where
        'a: 'l,
    {
        let (mut chunks, mut first) = (Vec::new(), done);
        if self.encoding != Encoding::Ascii || layout.element.count - done <= ROWS {
            return chunks;
        }
        self.skip_blank_lines();
        let pieces = cut(self.rest);
        let counts = side_by_side(&pieces, |piece| {
            // There is no line after the last line break.
            let (mut lines, mut rows) = (0, 0);
            for line in lines_of(piece.strip_suffix(b"\n").unwrap_or(piece)) {
                lines += 1;
                rows += usize::from(!is_blank(line));
            }
            (lines, rows)
        });
        for (bytes, (lines, count)) in pieces.into_iter().zip(counts) {
            if count > layout.element.count - first {
                break;
            }
            let (path, encoding, line) = (self.path, self.encoding, self.line);
            if count > 0 {
                chunks.push(RowChunk { path, encoding, layout, first, count, bytes, line });
            }
            first += count;
            self.line += lines;
            self.rest = &self.rest[bytes.len()..];
        }
        chunks
    }

    fn chunk<'l>(
        &mut self,
        layout: &'l ElementLayout<'l>,
        first: usize,
    ) -> (RowChunk<'l>, Option<LoadError>)
    where
        'a: 'l,
    {
        let most = (layout.element.count - first).min(ROWS);
        let is_text = self.encoding == Encoding::Ascii;
        if is_text {
            self.skip_blank_lines();
        }
        let (line, rest) = (if is_text { self.line } else { 0 }, self.rest);
        let (count, fault) = match layout.stride() {
            _ if is_text => (self.lines(most), None),
            Some(stride) => {
                let count = (rest.len() / stride.max(1)).min(most);
                self.rest = &rest[count * stride..];
                (count, None)
            }
            None => self.rows_with_lists(layout, most),
        };
        let end = (count < most).then(|| {
            let ElementDef { name, count: all, .. } = layout.element;
            let row = first + count;
            self.error(match fault {
                Some(fault) => format!("invalid {name} {row}: {fault}"),
                None => format!(
                    "unexpected end of the file in {name} {row} of {all}; it may be incomplete"
                ),
            })
        });
        let bytes = &rest[..rest.len() - self.rest.len()];
        let (path, encoding) = (self.path, self.encoding);
        (RowChunk { path, encoding, layout, first, count, bytes, line }, end)
    }

    fn skip_blank_lines(&mut self) {
        while let Some(end) = memchr::memchr(b'\n', self.rest) {
            if !is_blank(&self.rest[..end]) {
                break;
            }
            self.rest = &self.rest[end + 1..];
            self.line += 1;
        }
    }

    /// Skips up to this many lines that are not blank, and returns their number.
    fn lines(&mut self, most: usize) -> usize {
        let mut count = 0;
        while count < most && !self.rest.is_empty() {
            let end = memchr::memchr(b'\n', self.rest).unwrap_or(self.rest.len());
            let line = &self.rest[..end];
            count += usize::from(!is_blank(line));
            self.rest = self.rest.get(end + 1..).unwrap_or_default();
            self.line += 1;
        }
        count
    }

    /// Skips up to this many rows with lists. Returns their number, and the error of the next row,
    /// unless the file just ends.
    fn rows_with_lists(&mut self, layout: &ElementLayout, most: usize) -> (usize, Option<String>) {
        for count in 0..most {
            let size = match self.encoding {
                Encoding::BinaryBigEndian => row_size::<true>(&layout.fields, self.rest),
                _ => row_size::<false>(&layout.fields, self.rest),
            };
            match size {
                Ok(Some(size)) => self.rest = &self.rest[size..],
                Ok(None) => return (count, None),
                Err(fault) => return (count, Some(fault)),
            }
        }
        (most, None)
    }

    /// Returns the expected number of rows: that of the header, but not more than the remaining
    /// bytes can hold.
    pub(super) fn least_count(&self, layout: &ElementLayout) -> usize {
        let size = layout.least_size(self.encoding == Encoding::Ascii);
        layout.element.count.min(1 + self.rest.len() / size.max(1))
    }

    /// Returns an error about the last line that was skipped; binary files have no lines.
    pub(super) fn error(&self, message: String) -> LoadError {
        let line = if self.encoding == Encoding::Ascii { self.line - 1 } else { 0 };
        mesh_file::error(self.path, line, message)
    }
}

impl RowChunk<'_> {
    /// Passes each row with its index, or its error, to `each`; records its errors, and those that
    /// `each` returns.
    pub(super) fn rows(
        &self,
        faults: &mut MeshDiagnostics,
        each: impl FnMut(usize, Result<&ElementRow, String>) -> Result<(), String>,
    ) {
        match self.encoding {
            Encoding::Ascii => self.text_rows(faults, each),
            Encoding::BinaryBigEndian => {
                self.binary_rows(BinaryWords::<true> { rest: self.bytes }, faults, each);
            }
            Encoding::BinaryLittleEndian => {
                self.binary_rows(BinaryWords::<false> { rest: self.bytes }, faults, each);
            }
        }
    }

    fn text_rows(
        &self,
        faults: &mut MeshDiagnostics,
        mut each: impl FnMut(usize, Result<&ElementRow, String>) -> Result<(), String>,
    ) {
        let (mut row, mut number) = (ElementRow::default(), self.first);
        for (i, line) in lines_of(self.bytes).enumerate().filter(|(_, line)| !is_blank(line)) {
            let read = self.row(&mut row, number, &mut Text::new(line));
            if let Err(fault) = each(number, read.map(|()| &row)) {
                faults.add(self.error(self.line + i as u32, fault));
            }
            number += 1;
        }
    }

    fn binary_rows(
        &self,
        mut words: impl RowWords,
        faults: &mut MeshDiagnostics,
        mut each: impl FnMut(usize, Result<&ElementRow, String>) -> Result<(), String>,
    ) {
        let mut row = ElementRow::default();
        for number in self.first..self.first + self.count {
            let read = self.row(&mut row, number, &mut words);
            if let Err(fault) = each(number, read.map(|()| &row)) {
                faults.add(self.error(0, fault));
            }
        }
    }

    fn row(
        &self,
        row: &mut ElementRow,
        number: usize,
        words: &mut impl RowWords,
    ) -> Result<(), String> {
        let name = &self.layout.element.name;
        row.read(&self.layout.fields, words)
            .map_err(|fault| format!("invalid {name} {number}: {fault}"))
    }

    fn error(&self, line: u32, message: String) -> LoadError {
        mesh_file::error(self.path, line, message)
    }
}

/// Applies `work` to all items, in parallel if there are several.
fn side_by_side<T: Sync, P: Send>(items: &[T], work: impl Fn(&T) -> P + Sync + Send) -> Vec<P> {
    match items {
        [one] => vec![work(one)],
        all => all.par_iter().map(work).collect(),
    }
}

/// Returns the next chunks of a text, split at line breaks.
fn cut(text: &[u8]) -> Vec<&[u8]> {
    let (mut chunks, mut rest) = (Vec::new(), text);
    while chunks.len() < CHUNKS && !rest.is_empty() {
        let least = rest.len().min(BYTES);
        let end = memchr::memchr(b'\n', &rest[least..]).map_or(rest.len(), |at| least + at + 1);
        let (chunk, others) = rest.split_at(end);
        chunks.push(chunk);
        rest = others;
    }
    chunks
}

/// Iterates over the lines of a text.
fn lines_of(bytes: &[u8]) -> impl Iterator<Item = &[u8]> {
    let mut start = 0;
    let ends = memchr::memchr_iter(b'\n', bytes).chain([bytes.len()]);
    ends.map(move |end| &bytes[std::mem::replace(&mut start, end + 1)..end])
}

fn is_blank(line: &[u8]) -> bool {
    line.iter().all(u8::is_ascii_whitespace)
}

/// Returns the size of the row at the start of the bytes, which has lists; `None` if it is
/// truncated.
fn row_size<const BIG: bool>(
    fields: &[PlyProperty],
    bytes: &[u8],
) -> Result<Option<usize>, String> {
    let mut size = 0_usize;
    for field in fields {
        match field.kind {
            PropertyKind::Scalar(number) => size += number.size(),
            PropertyKind::List(NumberType::Float | NumberType::Double, _) => {
                return Err(
                    "found a list length that is not an integer type, expected an integer type"
                        .to_owned(),
                );
            }
            PropertyKind::List(length, of) => {
                let mut words = BinaryWords::<BIG> { rest: bytes.get(size..).unwrap_or_default() };
                let Ok(count) = words.whole(length) else { return Ok(None) };
                let count = usize::try_from(count).map_err(|_| {
                    format!("List length cannot be negative (i{})", 8 * length.size())
                })?;
                size += length.size();
                // Lengths have 32 bits, so this is below 2³⁵.
                size = size.saturating_add(count.saturating_mul(of.size()));
            }
        }
    }
    Ok((size <= bytes.len()).then_some(size))
}
