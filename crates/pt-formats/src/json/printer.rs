//! Printer of readable JSON: values that fit are on a single line.

use std::fmt::Write;

/// A value to print. Numbers are stored as digits, so that each numeric type keeps its
/// representation.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Out {
    Null,
    Flag(bool),
    Number(String),
    Text(String),
    List(Vec<Out>),
    Object(Entries),
}

/// Keys and values in order.
pub(super) type Entries = Vec<(String, Out)>;

/// Maximum line length in columns.
const WIDTH: usize = 100;

impl Out {
    pub(super) fn text(text: impl Into<String>) -> Self {
        Self::Text(text.into())
    }

    /// Returns the text of a file.
    pub(super) fn print(&self) -> String {
        let mut text = String::new();
        self.print_at(0, 0, &mut text);
        text.push('\n');
        text
    }

    /// Prints the value on lines with this indentation, the first of which has `column` columns
    /// already.
    fn print_at(&self, indent: usize, column: usize, text: &mut String) {
        let mut line = String::new();
        let fits = self.print_in_line(WIDTH.saturating_sub(column + 1), &mut line);
        match self {
            _ if fits && (column > 0 || indent > 0) => text.push_str(&line),
            Self::List(list) => {
                let items = list.iter().map(|item| (String::new(), item));
                print_block(['[', ']'], items, indent, text);
            }
            Self::Object(entries) => {
                let items = entries.iter().map(|(key, value)| (quoted(key) + ": ", value));
                print_block(['{', '}'], items, indent, text);
            }
            _ => text.push_str(&self.in_line()),
        }
    }

    fn in_line(&self) -> String {
        let mut line = String::new();
        self.print_in_line(usize::MAX, &mut line);
        line
    }

    /// Prints the value without line breaks. Returns true if it has at most `most` bytes; otherwise
    /// the output is truncated.
    fn print_in_line(&self, most: usize, line: &mut String) -> bool {
        match self {
            Self::Null => line.push_str("null"),
            Self::Flag(flag) => line.push_str(if *flag { "true" } else { "false" }),
            Self::Number(digits) => line.push_str(digits),
            Self::Text(text) => line.push_str(&quoted(text)),
            Self::List(list) => {
                line.push('[');
                for (i, item) in list.iter().enumerate() {
                    line.push_str(if i > 0 { ", " } else { "" });
                    if !item.print_in_line(most, line) {
                        return false;
                    }
                }
                line.push(']');
            }
            Self::Object(entries) if entries.is_empty() => line.push_str("{}"),
            Self::Object(entries) => {
                line.push_str("{ ");
                for (i, (key, value)) in entries.iter().enumerate() {
                    line.push_str(if i > 0 { ", " } else { "" });
                    let _ = write!(line, "{}: ", quoted(key));
                    if !value.print_in_line(most, line) {
                        return false;
                    }
                }
                line.push_str(" }");
            }
        }
        line.len() <= most
    }
}

fn print_block<'a>(
    [open, close]: [char; 2],
    items: impl ExactSizeIterator<Item = (String, &'a Out)>,
    indent: usize,
    text: &mut String,
) {
    const STEP: usize = 2;
    text.push(open);
    let count = items.len();
    for (i, (key, value)) in items.enumerate() {
        let _ = write!(text, "\n{:1$}{key}", "", indent + STEP);
        value.print_at(indent + STEP, indent + STEP + key.len(), text);
        text.push_str(if i + 1 < count { "," } else { "" });
    }
    let _ = write!(text, "\n{:indent$}{close}", "");
}

/// Quotes and escapes a string.
fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_fits_into_a_line_stands_in_one() {
        let number = |n: u32| Out::Number(n.to_string());
        let short = Out::Object(vec![("a".into(), Out::List(vec![number(1), number(2)]))]);
        let long = Out::List((0..60).map(number).collect());
        let root = Out::Object(vec![("x \"y\"".into(), short), ("long".into(), long)]);
        let text = root.print();
        assert!(
            text.starts_with("{\n  \"x \\\"y\\\"\": { \"a\": [1, 2] },\n  \"long\": [\n    0,\n"),
            "{text}"
        );
        assert!(text.ends_with("    59\n  ]\n}\n"), "{text}");
        assert!(text.lines().all(|line| line.len() <= WIDTH), "{text}");
    }
}
