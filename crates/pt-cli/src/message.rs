//! Formatting and output of messages.

use std::fmt::{Display, Write as _};
use std::io::Write as _;

/// Prints a line to standard error, as [`message::report`](crate::message::report) does.
macro_rules! report {
    ($($text:tt)*) => { $crate::message::report(format_args!($($text)*)) };
}

/// Prints a line to standard output, as [`message::print_line`](crate::message::print_line) does.
macro_rules! print_line {
    ($($text:tt)*) => { $crate::message::print_line(format_args!($($text)*)) };
}

/// Prints a line to standard error, [printable]. Errors, such as a closed reader or a full disk,
/// are ignored.
pub(crate) fn report(text: impl Display) {
    let _ = std::io::stderr().write_all((printable(&text.to_string()) + "\n").as_bytes());
}

/// Prints a line to standard output, [printable]. Errors, such as a closed reader or a full disk,
/// are ignored.
pub(crate) fn print_line(text: impl Display) {
    let _ = std::io::stdout().write_all((printable(&text.to_string()) + "\n").as_bytes());
}

/// Escapes the control characters of a text as JSON does, except newlines and tabs: names in files
/// and metadata must not control the terminal.
pub(crate) fn printable(text: &str) -> String {
    let mut shown = String::with_capacity(text.len());
    for char in text.chars() {
        if char.is_control() && !matches!(char, '\n' | '\t') {
            // Writing to a string cannot fail.
            let _ = write!(shown, "\\u{:04x}", u32::from(char));
        } else {
            shown.push(char);
        }
    }
    shown
}

/// Formats an error with its causes, without repetitions.
pub(crate) fn of_error(error: &anyhow::Error) -> String {
    let mut text = String::new();
    for cause in error.chain().map(ToString::to_string) {
        if text.is_empty() {
            text = cause;
        } else if !text.contains(&cause) {
            text = format!("{text}: {cause}");
        }
    }
    text
}

/// Formats an error of the command line parser, without the usage and without its tip to pass
/// unknown options as values, since no option takes such a value.
pub(crate) fn of_parser(error: &clap::Error) -> String {
    let text = error.render().to_string();
    let mut paragraphs = text.split("\n\n").map(str::trim_end);
    let first = paragraphs.next().unwrap_or_default();
    let what = first.strip_prefix("error: ").unwrap_or(first).to_owned();
    let tips = paragraphs.filter(|p| p.trim_start().starts_with("tip: ") && !p.contains("'-- "));
    tips.fold(what, |all, tip| all + "\n" + tip)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_characters_are_escaped() {
        assert_eq!(
            printable("a\x1b]0;t\x07\u{9b}\r é\tb\n"),
            "a\\u001b]0;t\\u0007\\u009b\\u000d é\tb\n"
        );
    }

    #[test]
    fn causes_are_told_once() {
        let cause = anyhow::anyhow!("no such file");
        let outer = cause.context("a.dae: cannot be read: no such file").context("nothing to do");
        assert_eq!(of_error(&outer), "nothing to do: a.dae: cannot be read: no such file");
        let outer = anyhow::anyhow!("no such file").context("cannot open a.dae");
        assert_eq!(of_error(&outer), "cannot open a.dae: no such file");
    }
}
