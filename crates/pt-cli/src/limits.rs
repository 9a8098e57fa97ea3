//! Memory limit: rejects renders whose estimated memory exceeds it before they allocate.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use anyhow::{Result, ensure};
use bytesize::ByteSize;
use pathtracer::{Scene, memory};

use crate::resolve::{RenderJob, bytes_per_pixel};
use crate::{FAILURE, light_groups};

/// True while rendering: samples are not discarded when the limit is exceeded.
static RENDERING: AtomicBool = AtomicBool::new(false);

/// Starts a thread that ends the program if it exceeds the memory limit before rendering. Malformed
/// input can make readers allocate without bound, and not all of their allocations are checked in
/// advance.
pub(crate) fn watch() {
    const INTERVAL: Duration = Duration::from_millis(20);
    /// Bytes of the program itself, and of allocations within an interval.
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
    // Without the thread, allocations that are checked in advance still obey the limit.
    let _ = std::thread::Builder::new().name("memory".to_owned()).spawn(watch);
}

/// Marks the start of rendering, which [`watch`] does not end.
pub(crate) fn begin_rendering() {
    RENDERING.store(true, Ordering::Relaxed);
}

/// Memory limit of a render.
pub(crate) struct Limit {
    /// Limit in bytes; `None` if neither the command line nor the system provides one.
    most: Option<u64>,
    /// Source of the limit, for the message.
    source: &'static str,
}

impl Limit {
    /// Returns the limit of the command line, or else the memory that is available to the program.
    pub(crate) fn of(request: &RenderJob) -> Self {
        if let Some(most) = request.cli.max_memory {
            memory::set_limit(most.as_u64());
            return Self { most: Some(most.as_u64()), source: "than --max-memory allows" };
        }
        let used = memory::used_bytes().unwrap_or(0);
        let most = memory::available_bytes().map(|left| left + used);
        Self { most, source: "than there is now" }
    }

    /// Checks the sizes of the image and of the files of the scene, before the scene is read.
    ///
    /// # Errors
    /// If they exceed the limit.
    pub(crate) fn check_files(&self, request: &RenderJob) -> Result<()> {
        let size = |path: &Path| std::fs::metadata(path).map_or(0, |data| data.len());
        let files = request.scene().into_iter().chain(&request.cli.environment);
        let files = files.map(|path| size(path)).sum();
        let film = request.resolution.map_or(0, |resolution| {
            film_bytes(request, resolution, light_groups::least(&request.cli))
        });
        self.check(&[("the files of the scene", files), ("the film", film)])
    }

    /// Checks a scene that was read, with the tables and the film that it needs.
    ///
    /// # Errors
    /// If it exceeds the limit.
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

/// Bytes of the film of an image with `groups` light groups, and of its development. A cropped
/// image needs only its cell.
fn film_bytes(request: &RenderJob, [width, height]: [u32; 2], groups: usize) -> u64 {
    let [width, height] = match request.cli.cell.as_deref() {
        Some(&[_, _, dx, dy]) => [dx, dy],
        _ => [width, height],
    };
    u64::from(width) * u64::from(height) * bytes_per_pixel(&request.cli, groups)
}
