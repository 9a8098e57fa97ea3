//! Counts of style violations listed in CONTRIBUTING.md. Each has a limit, which may only fall.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};

use crate::project::root;

/// A rule with the maximum number of violations.
struct StyleRule {
    name: &'static str,
    limit: usize,
    /// Returns true for a line of source code that breaks the rule.
    is_broken: fn(&str) -> bool,
    /// Parts of the paths of files to which the rule does not apply.
    except: &'static [&'static str],
    /// True if the rule also applies to unit tests.
    in_tests: bool,
}

/// Files that may name options: the program, the chores, tests, and what runs other programs.
const WITH_OPTIONS: &[&str] =
    &["crates/pt-cli/", "crates/xtask/", "/tests/", "/examples/", "pt-denoise/src/find.rs"];

/// Files whose numbers reach no film: tests, chores, and estimates of the remaining time.
const WITHOUT_FILMS: &[&str] =
    &["/tests/", "/tests.rs", "/laws", "pt-testing/", "xtask/", "/examples/", "/eta.rs"];

const RULES: [StyleRule; 6] = [
    StyleRule {
        name: "comment lines over 100 columns",
        limit: 0,
        is_broken: is_wide_comment,
        except: &[],
        in_tests: true,
    },
    StyleRule {
        name: "comment lines that begin with What, How, Whether, Where, Who, Those or Likewise",
        limit: 0,
        is_broken: begins_with_clause,
        except: &[],
        in_tests: true,
    },
    StyleRule {
        name: "doc comments of one or two words",
        limit: 0,
        is_broken: says_nothing,
        except: &[],
        in_tests: true,
    },
    StyleRule {
        name: "comment lines with told, tells, hears, glow or glows",
        limit: 0,
        is_broken: has_banned_word,
        except: &[],
        in_tests: true,
    },
    StyleRule {
        name: "texts of libraries with options of the command line",
        limit: 1, // an option of pbrt
        is_broken: names_option,
        except: WITH_OPTIONS,
        in_tests: true,
    },
    StyleRule {
        name: "calls of the C library's mathematics, whose roundings differ between libraries",
        limit: 1, // the digits of a note
        is_broken: calls_c_library,
        except: WITHOUT_FILMS,
        in_tests: false,
    },
];

/// Maximum number of violations printed for a rule that exceeds its limit.
const SHOWN: usize = 20;

/// Folders of source code.
const FOLDERS: [&str; 2] = ["crates", "fuzz"];

/// Maximum number of columns of a comment line.
const MAX_COLUMNS: usize = 100;

/// Checks all rules, and the files in the glossary.
///
/// # Errors
/// If a rule is broken more often than its limit allows, or a file of the glossary is missing.
pub(crate) fn check() -> Result<()> {
    let root = root();
    let mut sources = Vec::new();
    for folder in FOLDERS {
        collect(&root.join(folder), &mut sources)?;
    }
    let mut places: [Vec<String>; RULES.len()] = Default::default();
    for path in &sources {
        let text = fs::read_to_string(path).with_context(|| path.display().to_string())?;
        let name = path.strip_prefix(root).unwrap_or(path).display().to_string();
        let mut is_test = false;
        for (number, line) in (1..).zip(text.lines()) {
            is_test |= line == "#[cfg(test)]";
            for (rule, places) in RULES.iter().zip(&mut places) {
                let is_excepted = rule.except.iter().any(|part| name.contains(part));
                let applies = !is_excepted && (rule.in_tests || !is_test);
                if applies && (rule.is_broken)(line) {
                    places.push(format!("{name}:{number}: {}", line.trim()));
                }
            }
        }
    }
    let mut broken = false;
    for (StyleRule { name, limit, .. }, places) in RULES.iter().zip(&places) {
        let count = places.len();
        println!("{count} {name}; the limit is {limit}");
        if count > *limit {
            broken = true;
            for place in places.iter().take(SHOWN) {
                println!("  {place}");
            }
        }
    }
    ensure!(!broken, "there is more of this than before; CONTRIBUTING.md says how to write it");
    glossary(root)
}

/// Collects the Rust files below a folder, in order, except those of build folders.
fn collect(folder: &Path, files: &mut Vec<PathBuf>) -> Result<()> {
    let entries = fs::read_dir(folder).with_context(|| folder.display().to_string())?;
    let mut paths = entries.map(|entry| Ok(entry?.path())).collect::<Result<Vec<_>>>()?;
    paths.sort();
    for path in paths {
        if path.is_dir() {
            if path.file_name().is_none_or(|name| name != "target") {
                collect(&path, files)?;
            }
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
    Ok(())
}

/// Text of a comment line, without its slashes.
fn comment(line: &str) -> Option<&str> {
    let text = line.trim_start().strip_prefix("//")?;
    Some(text.trim_start_matches(['/', '!']).trim())
}

fn is_wide_comment(line: &str) -> bool {
    comment(line).is_some() && line.chars().count() > MAX_COLUMNS
}

fn begins_with_clause(line: &str) -> bool {
    let is_doc = ["///", "//!"].iter().any(|mark| line.trim_start().starts_with(mark));
    let first = comment(line).and_then(|text| text.split([' ', ',', '.', ';', ':']).next());
    let words = ["What", "How", "Whether", "Where", "Who", "Those", "Likewise"];
    is_doc && first.is_some_and(|first| words.contains(&first))
}

fn says_nothing(line: &str) -> bool {
    let pronouns = ["They", "It", "Its", "Both", "Why", "So", "The same", "Where", "How", "Which"];
    let text = comment(line).and_then(|text| text.strip_suffix('.'));
    line.trim_start().starts_with("///")
        && text.is_some_and(|text| {
            text.split(' ').count() <= 2 && pronouns.iter().any(|word| text.starts_with(word))
        })
}

fn has_banned_word(line: &str) -> bool {
    let words = ["told", "tells", "hears", "glow", "glows"];
    let mut all = comment(line).unwrap_or("").split(|c: char| !c.is_alphanumeric() && c != '_');
    all.any(|word| words.contains(&word))
}

fn names_option(line: &str) -> bool {
    let is_option = |rest: &str| rest.starts_with(|c: char| c.is_ascii_lowercase());
    let has = |mark| line.split(mark).skip(1).any(is_option);
    comment(line).is_none() && [" --", "\"--", "(--"].into_iter().any(has)
}

/// Functions of the standard library that are those of the C library; `libm` and
/// `pt_math::trig` have portable ones.
const C_FUNCTIONS: [&str; 24] = [
    "acos", "acosh", "asin", "asinh", "atan", "atan2", "atanh", "cbrt", "cos", "cosh", "exp",
    "exp2", "exp_m1", "hypot", "ln", "ln_1p", "log", "log10", "log2", "powf", "sin", "sin_cos",
    "tan", "tanh",
];

fn calls_c_library(line: &str) -> bool {
    let mut calls = line.split('.').skip(1).filter_map(|rest| rest.split_once('('));
    comment(line).is_none() && calls.any(|(name, _)| C_FUNCTIONS.contains(&name))
}

/// Checks that the files in the last column of the glossary's tables exist.
fn glossary(root: &Path) -> Result<()> {
    let path = root.join("docs/glossary.md");
    let text = fs::read_to_string(&path).with_context(|| path.display().to_string())?;
    let rows = text.lines().filter(|line| line.starts_with('|'));
    let last = rows.filter_map(|row| row.trim_end_matches('|').rsplit('|').next());
    let files = last.flat_map(|cell| cell.split('`').skip(1).step_by(2));
    for file in files {
        let is_there = root.join("crates").join(file).exists();
        ensure!(is_there, "docs/glossary.md: {file} is not below crates/; name the file that is");
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rules_find_what_they_rule_out() {
        let wide = format!("    // {}", "x".repeat(MAX_COLUMNS));
        assert!(is_wide_comment(&wide) && !is_wide_comment(&wide[..MAX_COLUMNS]));
        assert!(!is_wide_comment(&wide.replace("//", "  ")));
        assert!(
            begins_with_clause("    /// What is lit.") && begins_with_clause("//! How, and why.")
        );
        assert!(!begins_with_clause("    /// Whatever is lit.") && !begins_with_clause("// What"));
        assert!(says_nothing("/// They.") && says_nothing("    /// So many."));
        assert!(!says_nothing("/// It is a number of pixels."));
        assert!(names_option("    \"give --force\"") && names_option("f(\"--limit: {0}\")"));
        assert!(!names_option("    // --force") && !names_option("    a - -b -- 3"));
        assert!(calls_c_library("let x = y.abs().hypot(z);") && calls_c_library("a.ln() * b"));
        assert!(!calls_c_library("trig::hypot(x, y)") && !calls_c_library("// x.sin()"));
        assert!(has_banned_word("// what is told") && !has_banned_word("let told = 1;"));
    }
}
