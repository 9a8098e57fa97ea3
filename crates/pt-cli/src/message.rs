//! Errors as one clear message.

/// What went wrong and why, without what a cause only repeats.
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

/// What the parser of the command line says, without the usage, and without its advice to pass
/// unknown options as values, which no value here could be.
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
    fn causes_are_told_once() {
        let cause = anyhow::anyhow!("no such file");
        let outer = cause.context("a.dae: cannot be read: no such file").context("nothing to do");
        assert_eq!(of_error(&outer), "nothing to do: a.dae: cannot be read: no such file");
        let outer = anyhow::anyhow!("no such file").context("cannot open a.dae");
        assert_eq!(of_error(&outer), "cannot open a.dae: no such file");
    }
}
