//! Memory limit: rejects renders whose estimated memory exceeds it before they allocate.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use anyhow::{Result, ensure};
use bytesize::ByteSize;
use pathtracer::{Scene, light_groups, memory};

use crate::FAILURE;
use crate::job::MemoryPlan;

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
                    "error: reading exceeds {} of memory; allow more with --max-memory, or \
                     simplify the scene",
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

/// Memory limit of a render, and what it is compared with.
pub(crate) struct Limit {
    plan: MemoryPlan,
    /// Limit in bytes; `None` if neither the command line nor the system provides one.
    most: Option<u64>,
    /// Source of the limit, for the message.
    source: &'static str,
}

impl Limit {
    /// Takes the limit of the command line, or else the memory that is available to the program.
    pub(crate) fn new(plan: MemoryPlan) -> Self {
        if let Some(most) = plan.limit {
            memory::set_limit(most);
            return Self { plan, most: Some(most), source: "than --max-memory allows" };
        }
        let used = memory::used_bytes().unwrap_or(0);
        let most = memory::available_bytes().map(|left| left + used);
        Self { plan, most, source: "than available" }
    }

    /// Sets the size of the image, if it follows from the scene.
    ///
    /// # Errors
    /// If the image has too many pixels.
    pub(crate) fn set_resolution(&mut self, resolution: [u32; 2]) -> Result<()> {
        self.plan.resolution = Some(resolution);
        self.plan.check_pixels().map_err(anyhow::Error::msg)
    }

    /// Checks the sizes of the image and of the files of the scene, before the scene is read.
    ///
    /// # Errors
    /// If they exceed the limit.
    pub(crate) fn check_files(&self) -> Result<()> {
        let size = |path: &PathBuf| std::fs::metadata(path).map_or(0, |data| data.len());
        let files = self.plan.files.iter().map(size).sum();
        let named = self.plan.light_groups.as_ref().map_or(0, |groups| groups.named.len() + 1);
        let film = self.plan.resolution.map_or(0, |resolution| self.film_bytes(resolution, named));
        self.check(&[("the files of the scene", files), ("the film", film)])
    }

    /// Checks a scene that was read, with the tables and the film that it needs.
    ///
    /// # Errors
    /// If it exceeds the limit.
    pub(crate) fn check_scene(&self, scene: &Scene) -> Result<()> {
        let resolution = self.plan.resolution.or(scene.settings.resolution).unwrap_or_default();
        let groups = &self.plan.light_groups;
        let groups = groups.as_ref().map_or(0, |groups| light_groups::most(groups, scene));
        self.check(&[
            ("the scene", memory::used_bytes().unwrap_or(0)),
            ("its tables and tree", memory::bytes_of_tables(scene, None)),
            ("the film", self.film_bytes(resolution, groups)),
        ])
    }

    /// Bytes of the film of an image with `groups` light groups, and of its development. A cropped
    /// image needs only its rectangle.
    fn film_bytes(&self, resolution: [u32; 2], groups: usize) -> u64 {
        let [width, height] = self.plan.crop.unwrap_or(resolution).map(u64::from);
        width * height * self.plan.pixel.with_groups(groups)
    }

    fn check(&self, parts: &[(&str, u64)]) -> Result<()> {
        let sum = parts.iter().map(|(_, bytes)| bytes).sum::<u64>();
        let Some(most) = self.most else { return Ok(()) };
        let size = |bytes| ByteSize::b(bytes).display().si();
        let words: Vec<_> =
            parts.iter().map(|(name, bytes)| format!("{} for {name}", size(*bytes))).collect();
        ensure!(
            sum <= most,
            "the render requires about {} ({}), more {} ({}); render fewer pixels (-r), a simpler \
             scene, or allow more with --max-memory",
            size(sum),
            words.join(", "),
            self.source,
            size(most)
        );
        Ok(())
    }
}
