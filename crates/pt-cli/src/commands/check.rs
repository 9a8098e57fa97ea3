//! `pathtracer check`: errors of a scene, missing files, and approximated features.

use std::fmt::Write as _;
use std::process::ExitCode;

use anyhow::Result;
use pathtracer::{LoadError, LoadResult, Span, Warning, scene_stats};
use serde_json::{Value, json};

use super::render;
use crate::command_args::Check;
use crate::{FAILURE, hints, output};

/// Exit status of a scene with notes alone, as of approximated features.
const NOTES: u8 = 1;
/// Maximum number of lines of each list.
const MAX_SHOWN: usize = LoadError::MAX_SHOWN;

/// Location, as far as it is known, and message of a finding.
type Finding = (Option<Span>, String);

/// Findings about a scene.
struct Findings {
    errors: Vec<Finding>,
    missing: Vec<Finding>,
    notes: Vec<Finding>,
    /// Remedies.
    advice: Vec<String>,
}

/// Prints the findings about a scene.
///
/// # Errors
/// If the text cannot be printed.
pub(crate) fn run(check: &Check) -> Result<ExitCode> {
    let mut reading = pathtracer::read_with(&check.scene, &check.loading.options(false));
    if let (Ok(scene), Some(placement)) = (&mut reading.scene, check.loading.placement()) {
        scene.place_camera(placement);
    }
    let findings = Findings::of(reading);
    let file = check.scene.display().to_string();
    let text = if check.json { findings.json(&file) } else { findings.text(&file) };
    output::print(&text)?;
    Ok(findings.status(check.strict))
}

impl Findings {
    fn of(reading: LoadResult) -> Self {
        let listed =
            |list: Vec<Warning>| list.into_iter().map(|w| (Some(w.at), w.message)).collect();
        let mut notes: Vec<Finding> = listed(reading.notes);
        let mut errors = Vec::new();
        let mut hints = reading.hints;
        match &reading.scene {
            Err(error) => errors.extend(error.each().iter().map(of_error)),
            Ok(scene) => match scene_stats::compiled(scene) {
                Ok(session) => {
                    notes.extend(session.notes().iter().map(|note| (None, note.clone())));
                    hints.extend(session.hints().iter().cloned());
                }
                Err(error) => errors.push((None, error.to_string())),
            },
        }
        let advice = hints.iter().map(hints::advice).collect();
        Self { errors, missing: listed(reading.missing), notes, advice }
    }

    /// Exit status: it indicates if a render would reject the scene or render it with placeholders.
    fn status(&self, strict: bool) -> ExitCode {
        match self {
            Self { errors, .. } if !errors.is_empty() => ExitCode::from(FAILURE),
            Self { missing, .. } if !missing.is_empty() && strict => ExitCode::from(FAILURE),
            Self { missing, .. } if !missing.is_empty() => ExitCode::from(render::MISSING),
            Self { notes, .. } if !notes.is_empty() => ExitCode::from(NOTES),
            _ => ExitCode::SUCCESS,
        }
    }

    fn text(&self, file: &str) -> String {
        let mut text = String::new();
        for (name, list) in
            [("error", &self.errors), ("warning", &self.missing), ("note", &self.notes)]
        {
            for (at, message) in list.iter().take(MAX_SHOWN) {
                let at = at.as_ref().map_or(file.to_owned(), ToString::to_string);
                // Writing to a string cannot fail.
                let _ = writeln!(text, "{name}: {at}: {message}");
            }
            if let Some(more) = list.len().checked_sub(MAX_SHOWN).filter(|more| *more > 0) {
                let _ = writeln!(text, "{name}: … and {more} more");
            }
        }
        for advice in &self.advice {
            let _ = writeln!(text, "help: {advice}");
        }
        let count = |list: &[Finding], one: &str| {
            let s = if list.len() == 1 { "" } else { "s" };
            format!("{} {one}{s}", list.len())
        };
        let sums =
            [(&self.errors, "error"), (&self.missing, "missing file"), (&self.notes, "note")];
        let sums = sums.map(|(list, one)| count(list, one)).join(", ");
        let _ = writeln!(text, "{file}: {sums}");
        text
    }

    fn json(&self, file: &str) -> String {
        let list =
            |list: &[Finding]| list.iter().take(MAX_SHOWN).map(of_finding).collect::<Vec<_>>();
        let [errors, missing, notes] = [&self.errors, &self.missing, &self.notes];
        let value = json!({
            "scene": file,
            "counts": {
                "errors": errors.len(),
                "missing": missing.len(),
                "notes": notes.len(),
            },
            "errors": list(errors),
            "missing": list(missing),
            "help": self.advice,
            "notes": list(notes),
        });
        format!("{value:#}\n")
    }
}

fn of_error(error: &LoadError) -> Finding {
    (error.place().cloned(), error.message())
}

/// Formats a location and a message as JSON; unknown numbers are null.
fn of_finding((at, message): &Finding) -> Value {
    let known = |number: u32| (number > 0).then_some(number);
    json!({
        "file": at.as_ref().map(|at| at.file.display().to_string()),
        "line": at.as_ref().and_then(|at| known(at.line)),
        "column": at.as_ref().and_then(|at| known(at.column)),
        "element": at.as_ref().map(|at| &at.element).filter(|element| !element.is_empty()),
        "message": message,
    })
}
