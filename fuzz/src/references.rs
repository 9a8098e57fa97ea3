//! Structural mutations of texts with references by name and number: references are redirected,
//! also in circles, and their targets are duplicated.

use std::ops::Range;

use libfuzzer_sys::fuzzer_mutate;

/// One of this many mutations uses the structure of the text; the others are those of the fuzzer.
const SHARE: u64 = 3;
/// Number of bytes before the JSON of a binary glTF: the header of the file and of its first chunk.
const GLB_HEADER: usize = 20;

/// Random numbers. [Steele, Lea & Flood 2014, "Fast Splittable Pseudorandom Number Generators"]
struct Random(u64);

impl Random {
    fn below(&mut self, count: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) % count.max(1) as u64) as usize
    }

    fn one<'a, T>(&mut self, of: &'a [T]) -> Option<&'a T> {
        of.get(self.below(of.len()))
    }
}

/// Mutates the first `size` bytes in place; returns the new size, at most `data.len()` and `most`.
pub fn mutate(data: &mut [u8], size: usize, most: usize, seed: u32) -> usize {
    let mut random = Random(seed.into());
    if random.below(SHARE as usize) > 0 {
        return fuzzer_mutate(data, size, most);
    }
    let Some(text) = changed(&data[..size], &mut random) else {
        return fuzzer_mutate(data, size, most);
    };
    put(data, &text, most)
}

/// [`mutate`] for the JSON of a binary glTF, whose lengths are updated.
pub fn mutate_glb(data: &mut [u8], size: usize, most: usize, seed: u32) -> usize {
    let mut random = Random(seed.into());
    let length = |at: usize| {
        let bytes = data[..size].get(at..at + 4)?;
        Some(u32::from_le_bytes(bytes.try_into().ok()?) as usize)
    };
    let text = length(12).and_then(|json| data[..size].get(GLB_HEADER..GLB_HEADER + json));
    let Some((text, end)) = text.map(|text| (text, GLB_HEADER + text.len())) else {
        return fuzzer_mutate(data, size, most);
    };
    let changed = if random.below(SHARE as usize) > 0 { None } else { changed(text, &mut random) };
    let Some(mut changed) = changed else { return fuzzer_mutate(data, size, most) };
    changed.resize(changed.len().next_multiple_of(4), b' ');
    let mut file = data[..GLB_HEADER].to_vec();
    file[12..16].copy_from_slice(&(changed.len() as u32).to_le_bytes());
    file.extend(&changed);
    file.extend(&data[end..size]);
    let all = file.len() as u32;
    file[8..12].copy_from_slice(&all.to_le_bytes());
    put(data, &file, most)
}

fn put(data: &mut [u8], new: &[u8], most: usize) -> usize {
    let count = new.len().min(most).min(data.len());
    data[..count].copy_from_slice(&new[..count]);
    count
}

/// Returns the text with a redirected reference, or with one of its parts duplicated.
fn changed(text: &[u8], random: &mut Random) -> Option<Vec<u8>> {
    let words = words(text);
    let (at, new) = match random.below(4) {
        0 => {
            let blocks = blocks(text, random);
            let block = random.one(&blocks)?.clone();
            let place = random.one(&blocks)?.start;
            let separator: &[u8] = if text[block.start] == b'{' { b"," } else { b"" };
            (place..place, [&text[block], separator].concat())
        }
        kind => {
            let target = random.one(&words)?.clone();
            let is_number = |word: &Range<usize>| text[word.clone()].iter().all(u8::is_ascii_digit);
            let alike: Vec<_> =
                words.iter().filter(|w| is_number(w) == is_number(&target)).cloned().collect();
            let new = if kind == 1 && is_number(&target) {
                random.below(16).to_string().into_bytes()
            } else {
                text[random.one(&alike)?.clone()].to_vec()
            };
            (target, new)
        }
    };
    Some([&text[..at.start], &new, &text[at.end..]].concat())
}

/// Finds names and integers.
fn words(text: &[u8]) -> Vec<Range<usize>> {
    let is_part = |byte: &u8| byte.is_ascii_alphanumeric() || b"_#.-".contains(byte);
    let (mut words, mut start) = (Vec::new(), None);
    for (at, byte) in text.iter().enumerate() {
        match (is_part(byte), start) {
            (true, None) => start = Some(at),
            (false, Some(first)) => {
                words.push(first..at);
                start = None;
            }
            _ => {}
        }
    }
    words
}

/// Finds JSON objects, XML elements, or lines, depending on the text, that begin at random
/// positions.
fn blocks(text: &[u8], random: &mut Random) -> Vec<Range<usize>> {
    let open = match text.iter().find(|byte| !byte.is_ascii_whitespace()) {
        Some(b'{') => b'{',
        Some(b'<') => b'<',
        _ => b'\n',
    };
    let starts: Vec<_> = (0..text.len()).filter(|at| text[*at] == open).collect();
    let drawn = (0..8).filter_map(|_| random.one(&starts).copied());
    drawn.filter_map(|start| Some(start..end_of_block(text, start, open)?)).collect()
}

fn end_of_block(text: &[u8], start: usize, open: u8) -> Option<usize> {
    let rest = &text[start + 1..];
    if open == b'\n' {
        return Some(start + 1 + rest.iter().position(|byte| *byte == b'\n')?);
    }
    let mut depth = 0_i32;
    for (at, byte) in text.iter().enumerate().skip(start) {
        let next = text.get(at + 1);
        depth += match (open, byte) {
            (b'{', b'{') => 1,
            (b'{', b'}') => -1,
            (b'<', b'<') if next == Some(&b'/') => -1,
            (b'<', b'<') if next.is_some_and(u8::is_ascii_alphabetic) => 1,
            (b'<', b'/') if next == Some(&b'>') => -1,
            _ => 0,
        };
        let is_end = (open == b'{' && *byte == b'}') || (open == b'<' && *byte == b'>');
        if depth <= 0 && is_end {
            return Some(at + 1);
        }
    }
    None
}
