//! Refuses renders that need more memory than there is, before they take it.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use anyhow::{Result, ensure};
use bytesize::ByteSize;
use pathtracer::{Scene, memory};

use crate::resolve::{RenderJob, bytes_per_pixel};
use crate::{FAILURE, light_groups};

/// True if samples are taken: they are not given up for want of memory.
static RENDERING: AtomicBool = AtomicBool::new(false);

/// Ends the program when it holds more memory than it may, unless it renders: what is read may be
/// made to grow without end, and not all of it asks before.
pub(crate) fn watch() {
    const INTERVAL: Duration = Duration::from_millis(20);
    /// Bytes of the program itself, and of what is taken between two looks.
    const SLACK: u64 = 32 << 20;
    let watch = || {
        while let (Some(used), Some(limit)) = (memory::used_bytes(), memory::limit()) {
            if used > limit.saturating_add(SLACK) && !RENDERING.load(Ordering::Relaxed) {
                let size = |bytes| ByteSize::b(bytes).display().si();
                report!(
                    "pathtracer: what is read takes more memory than {}; allow more with --max-memory, or make it simpler",
                    size(limit)
                );
                std::process::exit(FAILURE.into());
            }
            std::thread::sleep(INTERVAL);
        }
    };
    // Without it, what asks before is held to the limit all the same.
    let _ = std::thread::Builder::new().name("memory".to_owned()).spawn(watch);
}

/// Says that samples are taken from now on.
pub(crate) fn begin_rendering() {
    RENDERING.store(true, Ordering::Relaxed);
}

/// How much memory a render may take.
pub(crate) struct Limit {
    /// In bytes; `None` where neither the command line nor the system says it.
    most: Option<u64>,
    /// Source of the message.
    source: &'static str,
}

impl Limit {
    /// That of the command line, or what the system has left.
    pub(crate) fn of(request: &RenderJob) -> Self {
        if let Some(most) = request.cli.max_memory {
            memory::set_limit(most.as_u64());
            return Self { most: Some(most.as_u64()), source: "than --max-memory allows" };
        }
        let used = memory::used_bytes().unwrap_or(0);
        let most = memory::available_bytes().map(|left| left + used);
        Self { most, source: "than there is now" }
    }

    /// Refuses an image of this size, and a scene in such a file: the scene itself is not read yet.
    ///
    /// # Errors
    /// If they need more.
    pub(crate) fn check_files(&self, request: &RenderJob) -> Result<()> {
        let size = |path: &Path| std::fs::metadata(path).map_or(0, |data| data.len());
        let files = request.scene().into_iter().chain(&request.cli.environment);
        let files = files.map(|path| size(path)).sum();
        let film = request.resolution.map_or(0, |resolution| {
            film_bytes(request, resolution, light_groups::least(&request.cli))
        });
        self.check(&[("the files of the scene", files), ("the film", film)])
    }

    /// Refuses a scene that is read, and will be compiled for an image of this size.
    ///
    /// # Errors
    /// If it needs more.
    pub(crate) fn check_scene(&self, request: &RenderJob, scene: &Scene) -> Result<()> {
        let resolution = request.resolution.or(scene.settings.resolution).unwrap_or_default();
        let groups = light_groups::most(&request.cli, scene);
        self.check(&[
            ("the scene", memory::used_bytes().unwrap_or(0)),
            ("its tables and tree", memory::bytes_of_tables(scene, None)),
            ("the film", film_bytes(request, resolution, groups)),
        ])
    }

    fn check(&self, parts: &[(&str, u64)]) -> Result<()> {
        let sum = parts.iter().map(|(_, bytes)| bytes).sum::<u64>();
        let Some(most) = self.most else { return Ok(()) };
        let size = |bytes| ByteSize::b(bytes).display().si();
        let words: Vec<_> =
            parts.iter().map(|(name, bytes)| format!("{} for {name}", size(*bytes))).collect();
        ensure!(
            sum <= most,
            "the render needs about {} ({}), more {} ({}); render fewer pixels (-r), a simpler scene, or allow \
             more with --max-memory",
            size(sum),
            words.join(", "),
            self.source,
            size(most)
        );
        Ok(())
    }
}

/// What the film of an image, with so many groups of lights, and its development take; a cell takes
/// less.
fn film_bytes(request: &RenderJob, [width, height]: [u32; 2], groups: usize) -> u64 {
    let [width, height] = match request.cli.cell.as_deref() {
        Some(&[_, _, dx, dy]) => [dx, dy],
        _ => [width, height],
    };
    u64::from(width) * u64::from(height) * bytes_per_pixel(&request.cli, groups)
}
