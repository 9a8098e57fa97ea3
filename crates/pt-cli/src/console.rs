//! What a render tells the user while it runs.

use std::io::IsTerminal;
use std::sync::Arc;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use pathtracer::Observer;

/// Without a terminal, a line as often as this.
const LINE_EVERY: Duration = Duration::from_secs(10);

/// Shows progress as the settings and the terminal allow, and listens for Ctrl-C.
pub(crate) struct Console {
    display: Display,
    stop: Arc<AtomicBool>,
}

enum Display {
    Nothing,
    Bar(ProgressBar),
    Lines { start: Instant, last: Mutex<Instant> },
    Course { shown: Mutex<Option<u64>> },
}

impl Console {
    /// A display for `total` samples, and a handler for Ctrl-C: the first one asks the render to
    /// stop, a second one ends the program.
    pub(crate) fn new(total: u64, course: bool, quiet: bool) -> Self {
        let stop = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&stop);
        let handler = ctrlc::set_handler(move || {
            if flag.swap(true, Ordering::Relaxed) {
                std::process::exit(130);
            }
        });
        if let Err(e) = handler {
            eprintln!("pathtracer: Ctrl-C will end the program without saving: {e}");
        }
        let terminal = std::io::stderr().is_terminal();
        let display = match (quiet, course, terminal) {
            (true, ..) => Display::Nothing,
            // That program shows its progress on standard output.
            (_, true, _) if !std::io::stdout().is_terminal() => Display::Nothing,
            (_, true, _) => Display::Course { shown: Mutex::new(None) },
            (.., true) => Display::Bar(bar(total)),
            _ => {
                let start = Instant::now();
                Display::Lines { start, last: Mutex::new(start) }
            }
        };
        Self { display, stop }
    }

    /// Prints a line, above what moves.
    pub(crate) fn say(&self, text: &str) {
        match &self.display {
            Display::Bar(bar) => bar.println(text),
            _ => eprintln!("{text}"),
        }
    }

    /// Removes what moves.
    pub(crate) fn finish(&self) {
        if let Display::Bar(bar) = &self.display {
            bar.finish_and_clear();
        }
    }
}

fn bar(total: u64) -> ProgressBar {
    let bar = ProgressBar::new(total);
    let style = ProgressStyle::with_template(
        "rendering {wide_bar} {percent:>3} %  {elapsed_precise}, {eta_precise} left",
    );
    if let Ok(style) = style {
        bar.set_style(style);
    }
    bar
}

impl Observer for Console {
    fn progress(&self, done: u64, total: u64) {
        let percent = done * 100 / total.max(1);
        match &self.display {
            Display::Nothing => {}
            Display::Bar(bar) => bar.set_position(done),
            Display::Lines { start, last } => {
                let Ok(mut last) = last.try_lock() else { return };
                if last.elapsed() >= LINE_EVERY {
                    *last = Instant::now();
                    let elapsed = start.elapsed().as_secs_f64();
                    let left = elapsed * (total - done.min(total)) as f64 / done.max(1) as f64;
                    eprintln!("rendering: {percent} %, {elapsed:.0} s, {left:.0} s left");
                }
            }
            Display::Course { shown } => {
                let Ok(mut shown) = shown.try_lock() else { return };
                if *shown != Some(percent) && percent < 100 {
                    *shown = Some(percent);
                    crate::course::progress(percent);
                }
            }
        }
    }

    fn cancelled(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}
