//! Summary of a render, as text and as JSON.

use std::path::Path;
use std::time::Duration;

use anyhow::Result;
use pathtracer::{Clamp, Evaluation, Outcome, RenderStatistics, Session};

/// Summary of a render.
pub(crate) struct Summary<'a> {
    pub(crate) session: &'a Session,
    pub(crate) statistics: RenderStatistics,
    pub(crate) progress: Outcome,
    pub(crate) threads: usize,
    /// Number of missing files of the scene.
    pub(crate) missing: usize,
    /// Wall-clock time of reading files.
    pub(crate) load: Duration,
    /// Processor time of rendering on all threads, in seconds, if the system provides it.
    pub(crate) cpu: Option<f64>,
}

impl Summary<'_> {
    /// Prints the summary to standard error.
    pub(crate) fn print(&self) {
        let s = &self.statistics;
        let seconds = s.time.as_secs_f64().max(1e-9);
        let (geometry, bvh) = self.session.build_times();
        let scene = self.session.scene();
        let [triangles, spheres] = scene.shape_counts();
        let placed = match scene.instance_count() {
            0 => String::new(),
            n => format!(", {}", count(n, "placed shape")),
        };
        let [w, h] = scene.camera.resolution;
        report!(
            "scene     {}, {}, {}{placed}; read in {:.3} s, BVH built in {:.3} s",
            count(triangles, "triangle"),
            count(spheres, "sphere"),
            count(scene.light_count, "light"),
            (self.load + geometry).as_secs_f64(),
            bvh.as_secs_f64()
        );
        report!(
            "rendered  {w} x {h}, {:.1} samples per pixel, in {seconds:.2} s on {}{}",
            self.session.film().samples() as f64 / self.session.film().region().area() as f64,
            count(self.threads, "thread"),
            if self.progress == Outcome::Cancelled { " (stopped)" } else { "" }
        );
        report!(
            "speed     {:.2} million samples/s, {}, {:.2} million rays/s",
            s.samples as f64 / seconds * 1e-6,
            count(s.rays as usize, "ray"),
            s.rays as f64 / seconds * 1e-6
        );
        if let Some(error) = error(self.session) {
            report!("error     {error}");
        }
        if self.session.settings().clamp != Clamp::NONE {
            report!("clamped   {:.3} % of the light was cut off", self.clamped_percent());
        }
        let textures = scene.materials.textures.bytes() as f64 * 1e-6;
        let textures =
            if textures > 0.0 { format!(", {textures:.1} MB of textures") } else { String::new() };
        if let Some(bytes) = pathtracer::memory::peak_bytes() {
            report!("memory    {:.1} MB at most{textures}", bytes as f64 * 1e-6);
        }
    }

    /// Percentage of the luminance of all samples that --clamp removed.
    fn clamped_percent(&self) -> f64 {
        let (kept, removed) = self.session.film().luminance();
        if removed > 0.0 { 100.0 * removed / (kept + removed) } else { 0.0 }
    }

    /// Writes the summary to a file as a JSON object of numbers; values that are not available are
    /// null.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub(crate) fn write_json(&self, path: &Path) -> Result<()> {
        let s = &self.statistics;
        let (geometry, bvh) = self.session.build_times();
        let scene = self.session.scene();
        let [triangles, spheres] = scene.shape_counts();
        let look = self.session.look();
        let measured = look.as_ref();
        let number = |v: Option<f64>| v.map_or("null".to_owned(), |v| v.to_string());
        let fields = [
            ("triangles", triangles.to_string()),
            ("spheres", spheres.to_string()),
            ("placed_shapes", scene.instance_count().to_string()),
            ("motion", u8::from(scene.is_animated()).to_string()),
            ("lights", scene.light_count.to_string()),
            ("texture_bytes", scene.materials.textures.bytes().to_string()),
            ("threads", self.threads.to_string()),
            ("samples", s.samples.to_string()),
            ("rays", s.rays.to_string()),
            ("missing_files", self.missing.to_string()),
            ("refused_samples", self.session.film().invalid_samples().count().to_string()),
            ("error", number(measured.map(|look| look.measured.error))),
            ("error_at_least", number(measured.map(|look| look.measured.lower))),
            ("error_at_most", number(measured.map(|look| look.measured.upper))),
            ("noise", number(measured.map(|look| look.noise))),
            ("clamped_percent", self.clamped_percent().to_string()),
            ("load_seconds", (self.load + geometry).as_secs_f64().to_string()),
            ("bvh_seconds", bvh.as_secs_f64().to_string()),
            ("render_seconds", s.time.as_secs_f64().to_string()),
            ("render_cpu_seconds", number(self.cpu)),
            ("peak_bytes", number(pathtracer::memory::peak_bytes().map(|b| b as f64))),
        ];
        let lines: Vec<_> = fields.iter().map(|(k, v)| format!("  \"{k}\": {v}")).collect();
        let text = format!("{{\n{}\n}}\n", lines.join(",\n"));
        Ok(pathtracer::write_atomically(path, text.as_bytes())?)
    }
}

/// Formats a number with a noun in the singular or plural.
pub(crate) fn count(n: usize, thing: &str) -> String {
    format!("{n} {thing}{}", if n == 1 { "" } else { "s" })
}

/// Processor time that all threads of the process have used so far, in seconds, or `None` if the
/// system does not provide it. [proc_pid_stat(5), fields 14 and 15]
pub(crate) fn cpu_seconds() -> Option<f64> {
    /// Unit of these fields, which is constant for user programs on Linux.
    const TICKS_PER_SECOND: f64 = 100.0;
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    // The second field is the name of the program, which may contain anything.
    let (_, after_name) = stat.rsplit_once(')')?;
    let mut fields = after_name.split_ascii_whitespace().skip(11);
    let mut ticks = || fields.next()?.parse::<u64>().ok();
    Some((ticks()? + ticks()?) as f64 / TICKS_PER_SECOND)
}

/// Formats the measured error, as in "0.960 % of the displayed image (0.930 to 0.990)"; few samples
/// may have no upper bound.
fn words(look: &Evaluation) -> String {
    let [error, least, most] = look.measured.to_array().map(|share| 100.0 * share);
    let most = if most.is_finite() { format!("{most:.3}") } else { "unbounded".into() };
    format!("{error:.3} % of the displayed image ({least:.3} to {most})")
}

/// Line of the summary with the measured and the requested error, or `None` without half buffers.
pub(crate) fn error(session: &Session) -> Option<String> {
    let look = session.look()?;
    let Some(target) = &session.settings().target else { return Some(words(&look)) };
    let asked = [("", target.error), ("noise ", target.noise)]
        .into_iter()
        .filter_map(|(name, share)| Some(format!("{name}{} %", 100.0 * share?)))
        .collect::<Vec<_>>();
    let noise = target.noise.map(|_| format!(", noise {:.3} % of white", 100.0 * look.noise));
    Some(format!(
        "{}{}; asked for: {} with a confidence of {} %",
        words(&look),
        noise.unwrap_or_default(),
        asked.join(" and "),
        100.0 * target.confidence
    ))
}

/// Returns true if an error target was missed.
pub(crate) fn is_missed(session: &Session) -> bool {
    session.settings().target.is_some() && !session.look().is_some_and(|look| look.is_met())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn processor_time_grows_with_work() {
        let Some(before) = cpu_seconds() else { return };
        let start = std::time::Instant::now();
        while cpu_seconds() == Some(before) {
            assert!(start.elapsed() < Duration::from_mins(1), "no time passes");
        }
        assert!(cpu_seconds() > Some(before));
    }

    #[test]
    fn one_thing_is_no_things() {
        assert_eq!(count(1, "ray"), "1 ray");
        assert_eq!(count(0, "ray"), "0 rays");
    }
}
