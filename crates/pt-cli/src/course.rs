//! The console lines of the university course's program, printed under `--cs184`.

use std::io::{IsTerminal, Write};
use std::path::Path;

use pathtracer::course::course_log;
use pathtracer::{Session, Statistics};

/// Printed before the environment map is read.
pub(crate) fn loading_environment(path: &Path) {
    print_line!("[PathTracer] Loading environment map {}", path.display());
}

/// Printed before the scene is read.
pub(crate) fn input(path: &Path) {
    report!("[PathTracer] Input scene file: {}", path.display());
    if !path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("dae")) {
        return;
    }
    report!("[COLLADA Parser] Loading COLLADA file...");
    report!("[COLLADA Parser] Loading scene...");
    // Errors of the file are reported when the scene is loaded.
    let log = pathtracer::file::read(path).ok().and_then(|bytes| course_log(&bytes, path).ok());
    for line in log.into_iter().flatten() {
        report!("{line}");
    }
}

/// Printed after a camera file was read.
pub(crate) fn camera_loaded(path: &Path) {
    print_line!("[Camera] Loaded settings from {}", path.display());
}

/// Printed after the environment map is prepared.
pub(crate) fn environment_ready() {
    print_line!(
        "[PathTracer] Initializing environment light...Saving out probability_debug image for \
         debug."
    );
    print_line!("done.");
}

/// Printed before rendering.
pub(crate) fn built(session: &Session, threads: usize) {
    let (geometry, bvh) = session.build_times();
    let primitives = session.scene().shapes.primitive_surface.len();
    report!("[PathTracer] Rendering using {threads} threads");
    print_line!("[PathTracer] Collecting primitives... Done! ({:.4} sec)", geometry.as_secs_f64());
    print_line!(
        "[PathTracer] Building BVH from {primitives} primitives... Done! ({:.4} sec)",
        bvh.as_secs_f64()
    );
}

/// Printed while rendering, on a terminal.
pub(crate) fn progress(percent: u64) {
    let mut out = std::io::stdout();
    // Errors of a progress line are ignored.
    let _ = write!(out, "\r[PathTracer] Rendering... {percent}%").and_then(|()| out.flush());
}

/// Printed after rendering.
pub(crate) fn rendered(s: &Statistics) {
    let seconds = s.time.as_secs_f64();
    let rays = s.rays.max(1) as f64;
    let mut out = std::io::stdout();
    // Progress, which the next line overwrites, is shown on terminals only.
    if out.is_terminal() {
        let _ = out.write_all(b"\r");
    }
    print_line!("[PathTracer] Rendering... 100%! ({seconds:.4}s)");
    print_line!("[PathTracer] BVH traced {} rays.", s.rays);
    print_line!(
        "[PathTracer] Average speed {:.4} million rays per second.",
        s.rays as f64 / seconds.max(1e-9) * 1e-6
    );
    print_line!("[PathTracer] Averaged {:.6} intersection tests per ray.", s.tests as f64 / rays);
}

/// Printed after the image is written.
pub(crate) fn saved(path: &Path, cell: bool) {
    report!("[PathTracer] Saving to file: {}... Done!", path.display());
    print_line!("[PathTracer] {} completed.", if cell { "Cell job" } else { "Job" });
}
