//! Names of options as keywords.

use clap::{Arg, CommandFactory};

use crate::args::Cli;

/// Keyword of a long option: with underscores.
pub(crate) fn underscored(long: &str) -> String {
    long.replace('-', "_")
}

/// Replaces options in a message by keywords: `--max-depth`, and the short `-m`, by `max_depth`.
pub(crate) fn in_keywords(message: &str) -> String {
    let command = Cli::command();
    let of_short = |short: char| {
        let arg = command.get_arguments().find(|arg| arg.get_short() == Some(short));
        arg.and_then(Arg::get_long).map(underscored)
    };
    let mut text = String::with_capacity(message.len());
    let mut rest = message;
    while let Some(at) = rest.find('-') {
        let (before, found) = rest.split_at(at);
        text.push_str(before);
        let is_word = !before.ends_with(|c: char| c.is_alphanumeric() || c == '-');
        let name = found.trim_start_matches('-');
        let dashes = found.len() - name.len();
        let end = name.find(|c: char| !c.is_ascii_alphanumeric() && c != '-').unwrap_or(name.len());
        let (name, after) = name.split_at(end);
        let keyword = match (is_word, dashes, name.chars().next()) {
            (true, 2, Some(first)) if first.is_ascii_lowercase() => Some(underscored(name)),
            (true, 1, Some(short)) if name.len() == 1 => of_short(short),
            _ => None,
        };
        match keyword {
            Some(keyword) => text.push_str(&keyword),
            None => text.push_str(&found[..dashes + name.len()]),
        }
        rest = after;
    }
    text + rest
}
