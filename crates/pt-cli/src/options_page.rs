//! Test: the tables of `docs/reference/options.md` are those of the program.

use std::path::Path;

use clap::builder::StyledStr;
use clap::{Arg, Command, CommandFactory};

use crate::args::Cli;
use crate::command_args::Command as Commands;

/// The tables equal the options. `PT_WRITE_GENERATED=1` writes them anew.
#[test]
fn the_page_of_options_is_that_of_the_program() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/reference/options.md");
    let text = std::fs::read_to_string(&path).unwrap();
    let mut expected = String::new();
    let mut rest = text.as_str();
    while let Some((before, after)) = rest.split_once("<!-- options: ") {
        let (name, after) = after.split_once(" -->").unwrap();
        let (_, after) = after.split_once("<!-- end -->").unwrap();
        expected.extend([
            before,
            "<!-- options: ",
            name,
            " -->\n",
            &tables(name),
            "\n<!-- end -->",
        ]);
        rest = after;
    }
    expected += rest;
    if std::env::var_os("PT_WRITE_GENERATED").is_some() {
        std::fs::write(&path, &expected).unwrap();
    }
    for command in Commands::command().get_subcommands() {
        assert!(text.contains(&format!("<!-- options: {} -->", command.get_name())));
    }
    assert!(text == expected, "docs/reference/options.md differs; PT_WRITE_GENERATED=1 writes it");
}

/// Options of a command, in tables by their headings. Those of `explain` are its own, besides those
/// of `render`.
fn tables(name: &str) -> String {
    let mut render = Cli::command();
    render.build();
    let mut commands = Commands::command();
    commands.build();
    let command = match name {
        "render" => &render,
        _ => commands.find_subcommand(name).expect("a command"),
    };
    let is_own = |arg: &&Arg| name != "explain" || !has(&render, arg);
    let shown: Vec<&Arg> = command
        .get_arguments()
        .filter(|arg| !arg.is_positional() && !arg.is_hide_set())
        .filter(|arg| !matches!(arg.get_id().as_str(), "help" | "version"))
        .filter(is_own)
        .collect();
    let mut headings: Vec<Option<&str>> = vec![None];
    for arg in &shown {
        if !headings.contains(&arg.get_help_heading()) {
            headings.push(arg.get_help_heading());
        }
    }
    let mut text = String::new();
    for heading in headings {
        let group: Vec<_> = shown.iter().filter(|arg| arg.get_help_heading() == heading).collect();
        if !group.is_empty() {
            let title = heading.unwrap_or("General");
            text.extend(["\n### ", title, "\n\n| Option | Default | Meaning |\n|---|---|---|\n"]);
            text.extend(group.into_iter().map(|arg| row(arg)));
        }
    }
    text
}

fn has(command: &Command, arg: &Arg) -> bool {
    command.get_arguments().any(|other| other.get_id() == arg.get_id())
}

fn row(arg: &Arg) -> String {
    let value = arg.to_string();
    let long = value.replace(['<', '>'], "");
    let short = arg.get_short().filter(|_| arg.get_long().is_some());
    let names = short.map_or(String::new(), |short| format!("`-{short}`, ")) + &format!("`{long}`");
    let help = arg.get_long_help().or(arg.get_help()).map(StyledStr::to_string).unwrap_or_default();
    let (meaning, default) = match help.split_once("[default: ") {
        Some((meaning, rest)) => {
            let (default, rest) = rest.split_once(']').expect("a bracket that is closed");
            (format!("{}{rest}", meaning.trim_end()), default.to_owned())
        }
        None => (help, default_of(arg)),
    };
    let default = match default.as_str() {
        "" => String::new(),
        words if words.contains(' ') => code(words),
        word => format!("`{word}`"),
    };
    format!("| {names} | {default} | {}{} |\n", code(&meaning), values(arg))
}

/// Default that clap knows.
fn default_of(arg: &Arg) -> String {
    if !arg.get_action().takes_values() || arg.is_hide_default_value_set() {
        return String::new();
    }
    let words: Vec<_> = arg.get_default_values().iter().map(|v| v.to_string_lossy()).collect();
    words.join(" ")
}

/// Possible values with their meanings.
fn values(arg: &Arg) -> String {
    if !arg.get_action().takes_values() || arg.is_hide_possible_values_set() {
        return String::new();
    }
    let possible = arg.get_possible_values();
    let shown: Vec<_> = possible.iter().filter(|value| !value.is_hide_set()).collect();
    let has_help = shown.iter().any(|value| value.get_help().is_some());
    let words: Vec<_> = shown
        .into_iter()
        .map(|value| match value.get_help() {
            Some(help) => format!("`{}` ({})", value.get_name(), code(&help.to_string())),
            None => format!("`{}`", value.get_name()),
        })
        .collect();
    if words.is_empty() {
        return String::new();
    }
    format!(": {}", words.join(if has_help { "; " } else { ", " }))
}

/// Text in Markdown, with the options as code.
fn code(text: &str) -> String {
    let joined = text.split_whitespace().collect::<Vec<_>>().join(" ");
    let escaped = joined.replace('|', "\\|").replace('<', "\\<");
    let mut code = String::new();
    for (index, part) in escaped.split(' ').enumerate() {
        if index > 0 {
            code.push(' ');
        }
        let is_option = |at: &usize| {
            let (before, name) = (&part[..*at], &part[at + 2..]);
            !before.contains(char::is_alphanumeric) && name.starts_with(char::is_alphabetic)
        };
        let Some(start) = part.find("--").filter(is_option) else {
            code += part;
            continue;
        };
        let is_name = |c: char| c.is_ascii_alphanumeric() || c == '-';
        let end = part[start..].find(|c| !is_name(c)).map_or(part.len(), |n| start + n);
        code.extend([&part[..start], "`", &part[start..end], "`", &part[end..]]);
    }
    code
}
