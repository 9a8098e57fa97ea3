//! Formatting and output of messages.
//!
//! A message begins with its severity: `error`, `warning`, `note`, or `help` for advice, which is
//! coloured on terminals unless the environment variable `NO_COLOR` is set.

use std::cell::RefCell;
use std::fmt::{Display, Write as _};
use std::io::Write as _;

use anstyle::{AnsiColor, Style};
use pathtracer::{Hint, LoadError};

/// Severities with their colours.
const SEVERITIES: [(&str, AnsiColor); 4] = [
    ("error", AnsiColor::Red),
    ("warning", AnsiColor::Yellow),
    ("note", AnsiColor::Cyan),
    ("help", AnsiColor::Green),
];

thread_local! {
    /// Lines of this thread while they are collected.
    static COLLECTED: RefCell<Option<Vec<String>>> = const { RefCell::new(None) };
}

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
    let text = printable(&text.to_string());
    let is_collected = COLLECTED.with_borrow_mut(|lines| match lines {
        Some(lines) => {
            lines.push(text.clone());
            true
        }
        None => false,
    });
    if is_collected {
        return;
    }
    let text = colored(&text) + "\n";
    let _ = anstream::AutoStream::auto(std::io::stderr()).write_all(text.as_bytes());
}

/// Runs a command as a library: also returns the lines that it reports on this thread, which are
/// not printed.
pub(crate) fn collected<T>(command: impl FnOnce() -> T) -> (T, Vec<String>) {
    COLLECTED.set(Some(Vec::new()));
    let result = command();
    (result, COLLECTED.take().unwrap_or_default())
}

/// A message whose severity, if it has one, is coloured.
fn colored(text: &str) -> String {
    let severity = SEVERITIES.iter().find_map(|(word, color)| {
        let rest = text.strip_prefix(word).filter(|rest| rest.starts_with(':'))?;
        let style = Style::new().bold().fg_color(Some((*color).into()));
        Some(format!("{style}{word}{style:#}{rest}"))
    });
    severity.unwrap_or_else(|| text.to_owned())
}

/// An error of reading a scene, with remedies.
#[derive(Debug, thiserror::Error)]
#[error("{error}")]
pub(crate) struct WithHints {
    /// The error.
    pub(crate) error: LoadError,
    /// Remedies for it and for missing files.
    pub(crate) hints: Vec<Hint>,
}

/// Reports an error; a scene with several has a message for each.
pub(crate) fn report_error(error: &anyhow::Error) {
    let of_scene = error.downcast_ref::<WithHints>().map(|with| &with.error);
    match of_scene.or_else(|| error.downcast_ref()) {
        Some(LoadError::Several(errors)) => {
            for error in errors.iter().take(LoadError::MAX_SHOWN) {
                report(format_args!("error: {error}"));
            }
            if let Some(more) = errors.len().checked_sub(LoadError::MAX_SHOWN).filter(|n| *n > 0) {
                report(format_args!("note: … and {more} more errors"));
            }
        }
        _ => report(format_args!("error: {}", of_error(error))),
    }
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

/// Formats an error of the command line parser, without the usage; its tips are advice, except the
/// one to pass unknown options as values, since no option takes such a value.
pub(crate) fn of_parser(error: &clap::Error) -> String {
    let text = error.render().to_string();
    let mut paragraphs = text.split("\n\n").map(str::trim_end);
    let first = paragraphs.next().unwrap_or_default();
    let what = first.strip_prefix("error: ").unwrap_or(first).to_owned();
    let tips = paragraphs.filter(|p| p.trim_start().starts_with("tip: ") && !p.contains("'-- "));
    tips.fold(what, |all, tip| all + "\n" + &tip.trim_start().replacen("tip: ", "help: ", 1))
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
    fn severities_are_coloured() {
        assert_eq!(colored("error: a: b"), "\u{1b}[1m\u{1b}[31merror\u{1b}[0m: a: b");
        assert_eq!(colored("errors: a"), "errors: a");
        assert_eq!(colored("saved a.png"), "saved a.png");
    }

    #[test]
    fn lines_of_a_library_are_collected() {
        let ((), lines) = collected(|| report("warning: a\u{1b}"));
        assert_eq!(lines, ["warning: a\\u001b"]);
        let ((), lines) = collected(|| {});
        assert!(lines.is_empty());
    }

    #[test]
    fn causes_are_reported_once() {
        let cause = anyhow::anyhow!("no such file");
        let outer = cause.context("a.dae: cannot be read: no such file").context("nothing to do");
        assert_eq!(of_error(&outer), "nothing to do: a.dae: cannot be read: no such file");
        let outer = anyhow::anyhow!("no such file").context("cannot open a.dae");
        assert_eq!(of_error(&outer), "cannot open a.dae: no such file");
    }
}
