//! Lines and columns of offsets into a text.

/// Distance in bytes of offsets whose line and column are stored.
const MARK_DISTANCE: usize = 1024;

/// Line and column of regularly spaced offsets, so that locations are found without counting from
/// the start, even if the file is one long line with many elements.
pub(crate) struct SourceMap(Vec<(u32, u32)>);

impl SourceMap {
    pub(crate) fn new(text: &str) -> Self {
        let mut mark = (1, 1);
        let mut marks = vec![mark];
        for chunk in text.as_bytes().chunks_exact(MARK_DISTANCE) {
            mark = advance(mark, chunk);
            marks.push(mark);
        }
        Self(marks)
    }

    /// Returns the line and the column in characters, from 1, of an offset into the same text.
    pub(crate) fn line_and_column(&self, text: &str, offset: usize) -> (u32, u32) {
        let offset = offset.min(text.len());
        let mark = offset / MARK_DISTANCE;
        advance(self.0[mark], &text.as_bytes()[mark * MARK_DISTANCE..offset])
    }
}

/// Returns the line and column after some bytes of UTF-8.
fn advance((line, column): (u32, u32), bytes: &[u8]) -> (u32, u32) {
    let newlines = bytes.split(|b| *b == b'\n').count() as u32 - 1;
    match bytes.iter().rposition(|b| *b == b'\n') {
        Some(last) => (line + newlines, 1 + characters(&bytes[last + 1..])),
        None => (line, column + characters(bytes)),
    }
}

/// Returns the number of characters of a piece of UTF-8.
fn characters(bytes: &[u8]) -> u32 {
    bytes.iter().filter(|b| **b & 0xC0 != 0x80).count() as u32
}

/// Returns the column, in characters from 1, of an offset into a text.
pub(crate) fn column(text: &str, offset: usize) -> u32 {
    let before = &text.as_bytes()[..offset.min(text.len())];
    let start = before.iter().rposition(|b| *b == b'\n').map_or(0, |last| last + 1);
    1 + characters(&before[start..])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_those_that_counting_from_the_start_gives() {
        let text = "ab\né😀\r\n\n".repeat(1000) + &"é".repeat(5000) + "\n" + &"x".repeat(5000);
        let map = SourceMap::new(&text);
        for (offset, _) in text.char_indices().step_by(7) {
            let before = &text[..offset];
            let line = 1 + before.matches('\n').count();
            let column = 1 + before.rsplit('\n').next().map_or(0, |last| last.chars().count());
            let found = map.line_and_column(&text, offset);
            assert_eq!(found, (line as u32, column as u32), "at {offset}");
            assert_eq!(super::column(&text, offset), column as u32, "at {offset}");
        }
    }
}
