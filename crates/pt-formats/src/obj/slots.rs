//! Assignment of materials to triangles.

use std::collections::HashMap;

use pt_scene::mesh::Submesh;

/// A name with its location.
pub(super) struct LocatedName {
    pub(super) name: String,
    /// Line of the first occurrence.
    pub(super) line: u32,
}

/// Materials by their first triangle.
#[derive(Default)]
pub(super) struct Slots {
    named: Vec<LocatedName>,
    /// Indices into `named`.
    numbers: HashMap<String, usize>,
    /// First triangle and index into `named`, in ascending order of the triangles.
    switches: Vec<(usize, usize)>,
}

impl Slots {
    /// Sets the material from a triangle on.
    pub(super) fn switch(&mut self, triangle: usize, named: LocatedName) {
        let number = self.number(named);
        self.set(triangle, number);
    }

    fn set(&mut self, triangle: usize, number: usize) {
        match self.switches.last_mut() {
            Some((last, of_last)) if *last == triangle => *of_last = number,
            _ => self.switches.push((triangle, number)),
        }
    }

    fn number(&mut self, named: LocatedName) -> usize {
        if let Some(known) = self.numbers.get(&named.name) {
            return *known;
        }
        let next = self.named.len();
        self.numbers.insert(named.name.clone(), next);
        self.named.push(named);
        next
    }

    /// Appends the materials of the lines that follow, after this number of triangles.
    pub(super) fn append(&mut self, triangles: usize, more: Self) {
        let numbers: Vec<_> = more.named.into_iter().map(|named| self.number(named)).collect();
        for (triangle, number) in more.switches {
            self.set(triangles + triangle, numbers[number]);
        }
    }

    /// Splits triangles into runs of the same slot, and returns the material of each slot: `None`
    /// for the triangles above the first name. Materials without triangles have no slot.
    pub(super) fn finish(self, triangles: usize) -> (Vec<Submesh>, Vec<Option<LocatedName>>) {
        let starts = std::iter::once((0, None));
        let starts: Vec<_> =
            starts.chain(self.switches.into_iter().map(|(t, number)| (t, Some(number)))).collect();
        let ends = starts[1..].iter().map(|(start, _)| *start).chain([triangles]);
        let mut named: Vec<_> = self.named.into_iter().map(Some).collect();
        let mut known = HashMap::new();
        let (mut parts, mut slots): (Vec<Submesh>, Vec<_>) = (Vec::new(), Vec::new());
        for ((start, number), end) in
            starts.iter().zip(ends).filter(|((start, _), end)| start < end)
        {
            let slot = *known.entry(*number).or_insert_with(|| {
                slots.push(number.and_then(|number| named[number].take()));
                slots.len() as u32 - 1
            });
            match parts.last_mut() {
                Some(last) if last.slot == slot => last.triangles.end = end as u32,
                _ => parts.push(Submesh { triangles: *start as u32..end as u32, slot }),
            }
        }
        (parts, slots)
    }
}
