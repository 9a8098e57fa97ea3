//! Names in messages: quotes, and suggestions for misspelled names.

/// Maximum length of quoted text, in characters.
const MAX_QUOTE: usize = 60;

/// Quotes a text on one line, truncated if it is long.
pub(crate) fn quote(text: &str) -> String {
    let shown = |c: char| if c.is_control() { ' ' } else { c };
    let mut quoted: String = text.chars().take(MAX_QUOTE).map(shown).collect();
    if text.chars().nth(MAX_QUOTE).is_some() {
        quoted.push('…');
    }
    format!("\"{quoted}\"")
}

/// Returns similar names, the closest ones first. Only the first names of a long list are compared.
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

/// Returns the minimum number of insertions, deletions and replacements of characters between two
/// texts, ignoring case. [Wagner & Fischer 1974]
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

/// Returns ` (did you mean "a" or "b"?)` with similar names, or ` (there is "c", "d", …)` with the
/// first existing names if none is similar.
pub(crate) fn did_you_mean<'c>(written: &str, names: impl Iterator<Item = &'c str>) -> String {
    let names: Vec<_> = names.collect();
    let close = meant(written, names.iter().copied());
    if !close.is_empty() {
        return close;
    }
    let more = if names.len() > MAX_NAMED { ", …" } else { "" };
    match quoted(&names, ", ") {
        none if none.is_empty() => " (known: none)".to_owned(),
        some => format!(" (known: {some}{more})"),
    }
}

/// Returns ` (did you mean "a" or "b"?)` with similar names; empty if there are none.
pub(crate) fn meant<'c>(written: &str, names: impl Iterator<Item = &'c str>) -> String {
    match quoted(&suggestions(written, names), " or ") {
        none if none.is_empty() => none,
        close => format!(" (did you mean {close}?)"),
    }
}

/// Maximum number of names in a message.
const MAX_NAMED: usize = 3;

fn quoted(names: &[&str], separator: &str) -> String {
    names.iter().take(MAX_NAMED).map(|name| quote(name)).collect::<Vec<_>>().join(separator)
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

    #[test]
    fn suggestions_are_close_or_else_all_there_is() {
        let suggest =
            |written, names: &[&'static str]| did_you_mean(written, names.iter().copied());
        assert_eq!(suggest("bal", &["wall", "ball"]), " (did you mean \"ball\"?)");
        assert_eq!(suggest("roof", &["a", "b", "c", "d"]), " (known: \"a\", \"b\", \"c\", …)");
        assert_eq!(suggest("roof", &[]), " (known: none)");
    }
}
