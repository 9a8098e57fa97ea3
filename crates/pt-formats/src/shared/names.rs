//! Names that were perhaps meant.

/// Those names that differ little from what was written, the closest ones first. Of very many, the
/// first ones are compared.
pub fn suggestions<'c>(written: &str, names: impl Iterator<Item = &'c str>) -> Vec<&'c str> {
    const LONGEST: usize = 64; // comparing takes the product of the lengths
    const MAX_COMPARED: usize = 10_000;
    let tolerance = 1 + written.len() / 4;
    let mut close: Vec<(usize, &str)> = names
        .take(MAX_COMPARED)
        .filter(|name| name.len().max(written.len()) <= LONGEST)
        .map(|name| (edit_distance(written, name), name))
        .filter(|(distance, _)| *distance <= tolerance)
        .collect();
    close.sort_unstable();
    close.dedup();
    close.into_iter().map(|(_, name)| name).collect()
}

/// The fewest characters to insert, delete or replace to turn one text into another, without
/// regard to case [Wagner & Fischer 1974].
fn edit_distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().map(|c| c.to_ascii_lowercase()).collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.chars().map(|c| c.to_ascii_lowercase()).enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(x != *y);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(diagonal + 1).min(row[j] + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edit_distances() {
        for (a, b, distance) in [
            ("", "", 0),
            ("", "abc", 3),
            ("kitten", "sitting", 3),
            ("Cube", "cube", 0),
            ("é", "e", 1),
        ] {
            assert_eq!(edit_distance(a, b), distance, "{a} {b}");
            assert_eq!(edit_distance(b, a), distance, "{b} {a}");
        }
    }

    #[test]
    fn names_that_are_alike_come_in_the_order_of_their_distances() {
        let names = ["wall", "ball", "hall of mirrors", "bald"];
        assert_eq!(suggestions("bal", names.into_iter()), ["bald", "ball"]);
        assert_eq!(suggestions("walls", names.into_iter()), ["wall", "ball"]);
        assert_eq!(suggestions("roof", names.into_iter()), [""; 0]);
    }
}
