//! The console lines of the university course's program, printed under `--cs184`.

use std::io::{IsTerminal, Write};
use std::path::Path;

use pathtracer::course::course_log;
use pathtracer::{Session, Statistics};

/// Before the environment map is read.
pub(crate) fn loading_environment(path: &Path) {
    println!("[PathTracer] Loading environment map {}", path.display());
}

/// Before the scene is read.
pub(crate) fn input(path: &Path) {
    eprintln!("[PathTracer] Input scene file: {}", path.display());
    if !path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("dae")) {
        return;
    }
    eprintln!("[COLLADA Parser] Loading COLLADA file...");
    eprintln!("[COLLADA Parser] Loading scene...");
    // What is wrong with the file is told when it is read to be rendered.
    let log = std::fs::read(path).ok().and_then(|bytes| course_log(&bytes, path).ok());
    for line in log.into_iter().flatten() {
        eprintln!("{line}");
    }
}

/// After a camera file was read.
pub(crate) fn camera_loaded(path: &Path) {
    println!("[Camera] Loaded settings from {}", path.display());
}

/// After the environment map is ready.
pub(crate) fn environment_ready() {
    println!(
        "[PathTracer] Initializing environment light...Saving out probability_debug image for \
         debug."
    );
    println!("done.");
}

/// Before rendering.
pub(crate) fn built(session: &Session, threads: usize) {
    let (geometry, bvh) = session.build_times();
    let primitives = session.scene().shapes.primitive_surface.len();
    eprintln!("[PathTracer] Rendering using {threads} threads");
    println!("[PathTracer] Collecting primitives... Done! ({:.4} sec)", geometry.as_secs_f64());
    println!(
        "[PathTracer] Building BVH from {primitives} primitives... Done! ({:.4} sec)",
        bvh.as_secs_f64()
    );
}

/// While rendering, on a terminal.
pub(crate) fn progress(percent: u64) {
    print!("\r[PathTracer] Rendering... {percent}%");
    // Nothing is lost if a progress line does not arrive.
    let _ = std::io::stdout().flush();
}

/// After rendering.
pub(crate) fn rendered(s: &Statistics) {
    let seconds = s.time.as_secs_f64();
    let rays = s.rays.max(1) as f64;
    // Nothing is there to be written over if no progress was shown.
    let start = if std::io::stdout().is_terminal() { "\r" } else { "" };
    println!("{start}[PathTracer] Rendering... 100%! ({seconds:.4}s)");
    println!("[PathTracer] BVH traced {} rays.", s.rays);
    println!(
        "[PathTracer] Average speed {:.4} million rays per second.",
        s.rays as f64 / seconds.max(1e-9) * 1e-6
    );
    println!("[PathTracer] Averaged {:.6} intersection tests per ray.", s.tests as f64 / rays);
}

/// After the image is written.
pub(crate) fn saved(path: &Path, cell: bool) {
    eprintln!("[PathTracer] Saving to file: {}... Done!", path.display());
    println!("[PathTracer] {} completed.", if cell { "Cell job" } else { "Job" });
}
