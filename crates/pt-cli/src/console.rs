//! Progress display of a render.

use std::io::{IsTerminal, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, TryLockError};
use std::time::{Duration, Instant};

use indicatif::{HumanDuration, ProgressBar, ProgressStyle};
use pathtracer::eta::{Eta, TimeRemaining};
use pathtracer::{Observer, Outcome, ProgressUpdate};
use serde_json::json;

use crate::arg_values::ProgressKind;
use crate::job::{DisplayJob, Mode};
use crate::message::printable;

/// Interval between lines without a terminal.
const LINE_EVERY: Duration = Duration::from_secs(10);

/// Interval between JSON lines.
const JSON_EVERY: Duration = Duration::from_millis(500);

/// Interval between updates of the progress bar.
const DRAW_EVERY: Duration = Duration::from_millis(100);

/// Observer of a render that also shows messages and its end.
pub(crate) trait Monitor: Observer {
    /// Begins an image that has `done` of `total` samples.
    fn begin_image(&self, done: u64, total: u64);

    /// Shows a line.
    fn say(&self, text: &str);

    /// Ends an image, which has this number of samples; others may follow.
    fn end_image(&self, samples: u64);

    /// Ends the display of the progress.
    fn finish(&self, progress: Outcome);
}

/// Observer of a render that is run as a library, which shows nothing.
pub(crate) struct Unseen<'a>(pub(crate) &'a dyn Observer);

impl Observer for Unseen<'_> {
    fn progress(&self, advance: &ProgressUpdate) {
        self.0.progress(advance);
    }

    fn cancelled(&self) -> bool {
        self.0.cancelled()
    }
}

impl Monitor for Unseen<'_> {
    fn begin_image(&self, _: u64, _: u64) {}

    fn say(&self, text: &str) {
        report!("{text}");
    }

    fn end_image(&self, _: u64) {}

    fn finish(&self, _: Outcome) {}
}

/// Progress display, according to the options and the terminal, and handler of Ctrl-C.
pub(crate) struct Console {
    display: Display,
    is_adaptive: bool,
    stop: Arc<AtomicBool>,
    start: Instant,
    state: Mutex<ConsoleState>,
}

enum Display {
    Nothing,
    Bar(ProgressBar),
    Lines,
    Json,
    /// Progress line of a program that is reproduced, by the percentage.
    Program(fn(u64)),
}

/// Progress of the render, and of its display.
struct ConsoleState {
    eta: Eta,
    /// Latest update; threads may report updates out of order.
    latest: ProgressUpdate,
    /// Time of the last display, since the start.
    shown: Duration,
    /// Percentage shown last.
    percent: Option<u64>,
    /// Samples of the images before this one.
    earlier: u64,
    /// Rays of the images before this one.
    earlier_rays: u64,
    /// Number of images after this one, which are expected to need the same number of samples.
    rest: u64,
}

impl ConsoleState {
    /// Update of all images by one of this image. A sequence has no error of its own.
    fn of_all(&self, update: &ProgressUpdate) -> ProgressUpdate {
        let of_all = |total: u64| self.earlier + total.saturating_mul(1 + self.rest);
        ProgressUpdate {
            done: self.earlier + update.done,
            estimated_totals: update.estimated_totals.map(of_all),
            rays: self.earlier_rays + update.rays,
            error: update.error.filter(|_| self.earlier + self.rest == 0),
        }
    }
}

impl Console {
    /// Creates the display of renders, and a handler of Ctrl-C: the first one stops the render, the
    /// second one ends the program.
    pub(crate) fn new(job: &DisplayJob, mode: Mode) -> Self {
        let stop = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&stop);
        let handler = ctrlc::set_handler(move || {
            if flag.swap(true, Ordering::Relaxed) {
                std::process::exit(130);
            }
        });
        if let Err(e) = handler {
            report!("warning: Ctrl-C will end the program without saving: {e}");
        }
        let terminal = std::io::stderr().is_terminal();
        let display = match (job.kind, mode.lines()) {
            (ProgressKind::Json, _) => Display::Json,
            (ProgressKind::None, _) => Display::Nothing,
            (ProgressKind::Auto, _) if mode.quiet => Display::Nothing,
            // Programs that are reproduced show their progress on standard output.
            (ProgressKind::Auto, Some(_)) if !std::io::stdout().is_terminal() => Display::Nothing,
            (ProgressKind::Auto, Some(lines)) => Display::Program(lines.progress),
            (ProgressKind::Auto, None) if !terminal => Display::Lines,
            (ProgressKind::Lines, _) => Display::Lines,
            _ => Display::Bar(bar()),
        };
        let state = ConsoleState {
            eta: Eta::new(0, 0, job.is_adaptive),
            latest: ProgressUpdate::default(),
            shown: Duration::ZERO,
            percent: None,
            earlier: 0,
            earlier_rays: 0,
            rest: 0,
        };
        let start = Instant::now();
        Self { display, is_adaptive: job.is_adaptive, stop, start, state: Mutex::new(state) }
    }

    /// Sets the number of images after this one.
    pub(crate) fn set_rest(&self, images: usize) {
        self.lock().rest = images as u64;
    }

    fn lock(&self) -> MutexGuard<'_, ConsoleState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Shows the latest update, if the interval of the display has passed.
    fn show(&self, state: &mut ConsoleState, now: Duration) {
        let advance = state.latest;
        let percent = advance.done * 100 / advance.total().max(1);
        let waited = now.saturating_sub(state.shown);
        match &self.display {
            Display::Bar(bar) if waited >= DRAW_EVERY => {
                bar.set_length(advance.total());
                bar.set_position(advance.done);
                bar.set_message(message(state, now));
            }
            Display::Lines if waited >= LINE_EVERY => {
                report!(
                    "rendering: {percent} %, {:.0} s, {}",
                    now.as_secs_f64(),
                    message(state, now)
                );
            }
            Display::Json if waited >= JSON_EVERY => json("rendering", state, now),
            Display::Program(progress) if state.percent != Some(percent) && percent < 100 => {
                progress(percent);
            }
            _ => return,
        }
        (state.shown, state.percent) = (now, Some(percent));
    }
}

impl Monitor for Console {
    fn begin_image(&self, done: u64, total: u64) {
        let mut state = self.lock();
        let update =
            ProgressUpdate { done, estimated_totals: [total; 3], ..ProgressUpdate::default() };
        state.latest = state.of_all(&update);
        if state.earlier == 0 {
            state.eta = Eta::new(done, state.latest.total(), self.is_adaptive);
        }
    }

    /// Prints the line, above the progress bar.
    fn say(&self, text: &str) {
        match &self.display {
            Display::Bar(bar) => bar.println(printable(text)),
            _ => report!("{text}"),
        }
    }

    fn end_image(&self, samples: u64) {
        let mut state = self.lock();
        state.earlier += samples;
        state.earlier_rays = state.latest.rays;
    }

    /// Removes the progress bar, or prints the last JSON line, whose state is `finished` or
    /// `stopped`.
    fn finish(&self, progress: Outcome) {
        match &self.display {
            Display::Bar(bar) => bar.finish_and_clear(),
            Display::Json => {
                let mut state = self.lock();
                let word = match progress {
                    Outcome::Cancelled => "stopped",
                    Outcome::Finished => {
                        // The last update may have been dropped while another thread held the lock.
                        state.latest.done = state.latest.total();
                        "finished"
                    }
                };
                json(word, &state, self.start.elapsed());
            }
            _ => {}
        }
    }
}

fn bar() -> ProgressBar {
    let bar = ProgressBar::new(1);
    let style = ProgressStyle::with_template("{wide_bar} {percent:>3} %  {elapsed_precise}  {msg}");
    if let Ok(style) = style {
        bar.set_style(style);
    }
    bar
}

/// Rays per second, error, and remaining time.
fn message(state: &ConsoleState, now: Duration) -> String {
    let rays = state.latest.rays as f64 / now.as_secs_f64().max(1e-9) * 1e-6;
    let error =
        state.latest.error.map_or(String::new(), |error| format!(", error {:.2} %", 100.0 * error));
    let human = |seconds: f64| HumanDuration(Duration::from_secs_f64(seconds)).to_string();
    let left = match state.eta.left() {
        Some(TimeRemaining { least, likely, most }) if most < MAX_SECONDS => {
            format!("{} left ({} to {})", human(likely), human(least), human(most))
        }
        _ => "remaining time unknown".into(),
    };
    format!("{rays:.1} M rays/s{error}, {left}")
}

/// Longest remaining time that is shown, about a hundred years.
const MAX_SECONDS: f64 = 3e9;

/// Prints a JSON line.
fn json(word: &str, state: &ConsoleState, now: Duration) {
    let ProgressUpdate { done, estimated_totals: [_, total, _], rays, error } = state.latest;
    let left =
        state.eta.left().map(|l| json!({ "least": l.least, "likely": l.likely, "most": l.most }));
    let line = json!({
        "state": word,
        "seconds": now.as_secs_f64(),
        "samples": done,
        "samples_in_all": total,
        "rays": rays,
        "error": error,
        "seconds_left": left,
    });
    // A closed reader does not stop the render.
    let _ = writeln!(std::io::stdout(), "{line}");
}

impl Observer for Console {
    fn progress(&self, advance: &ProgressUpdate) {
        // If another thread holds the lock, this update is dropped: more will follow.
        let mut state = match self.state.try_lock() {
            Ok(state) => state,
            Err(TryLockError::Poisoned(_) | TryLockError::WouldBlock) => return,
        };
        let advance = state.of_all(advance);
        if advance.done < state.latest.done {
            return;
        }
        let now = self.start.elapsed();
        state.latest = advance;
        state.eta.expect(advance.estimated_totals);
        state.eta.mark(now.as_secs_f64(), advance.done);
        self.show(&mut state, now);
    }

    fn cancelled(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}
