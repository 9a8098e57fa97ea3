//! `pathtracer info` of a scene: its contents.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::process::ExitCode;

use anyhow::{Context, Result};
use bytesize::ByteSize;
use pathtracer::LoadResult;
use pathtracer::scene_stats::{Item, SceneStats};

use super::render;
use crate::command_args::Info;
use crate::message::WithHints;
use crate::output;

/// Maximum number of names that are listed of each kind.
const MAX_NAMES: usize = 20;

/// Prints the contents of a scene.
///
/// # Errors
/// If it cannot be read or rendered.
pub(crate) fn run(info: &Info) -> Result<ExitCode> {
    let reading = pathtracer::read_with(&info.file, &info.loading.options(false));
    render::warn_missing(&reading.missing);
    let LoadResult { scene, hints, sources, .. } = reading;
    let scene = scene.map_err(|error| WithHints { error, hints })?;
    let inventory = SceneStats::of(&scene, &sources)
        .with_context(|| format!("{} cannot be rendered", info.file.display()))?;
    let text = if info.json {
        serde_json::to_string_pretty(&inventory).context("it cannot be written as JSON")? + "\n"
    } else {
        text(&inventory)
    };
    output::print(&text)
}

fn text(inventory: &SceneStats) -> String {
    let mut text = String::new();
    let mut line = |name: &str, value: &str| {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{name:<20}{value}");
    };
    line("scene", &inventory.name);
    line("metres per unit", &inventory.metres_per_unit.to_string());
    let c = &inventory.counts;
    let objects = format!(
        "{}: {} of meshes, {} of them instances, {} spheres, {} of points; {} move",
        c.objects,
        c.objects - c.spheres - c.clouds,
        c.instances,
        c.spheres,
        c.clouds,
        c.moving
    );
    line("objects", &objects);
    let meshes = format!("{} of {} vertices and {} triangles", c.meshes, c.vertices, c.triangles);
    line("meshes", &meshes);
    line("triangles placed", &c.triangles_placed.to_string());
    if c.clouds > 0 {
        line("points placed", &format!("{}, and {} segments", c.points, c.segments));
    }
    let bounds = inventory.bounds.map(|[low, high]| {
        let point = |p: [f64; 3]| p.map(|x| format!("{x:.6}")).join(" ");
        format!("{} to {}", point(low), point(high))
    });
    line("bounds", &bounds.unwrap_or("nothing is placed".into()));
    let m = &inventory.memory;
    for (name, bytes) in [
        ("memory of meshes", m.meshes),
        ("of textures", m.textures),
        ("of grids", m.grids),
        ("of tables and tree", m.tables),
    ] {
        line(name, &ByteSize::b(bytes).display().si().to_string());
    }
    for (name, items) in [
        ("materials", &inventory.materials),
        ("lights", &inventory.lights),
        ("media", &inventory.media),
        ("cameras", &inventory.cameras),
    ] {
        line(name, &items.len().to_string());
        for (kind, names) in by_kind(items) {
            line("", &format!("{} {kind}: {}", names.len(), listed(&names)));
        }
    }
    line("emissive materials", &c.emissive_materials.to_string());
    for Item { name, kind } in &inventory.settings {
        line(name, kind);
    }
    for Item { name, kind } in &inventory.files {
        line("file", &format!("{name} {kind}"));
    }
    text
}

/// Groups the names of items by kind.
fn by_kind(items: &[Item]) -> BTreeMap<&str, Vec<&str>> {
    let mut kinds: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for Item { name, kind } in items {
        kinds.entry(kind).or_default().push(name);
    }
    kinds
}

/// Joins names, up to [`MAX_NAMES`] of them.
fn listed(names: &[&str]) -> String {
    let mut shown: Vec<_> =
        names.iter().take(MAX_NAMES).map(|name| format!("\"{name}\"")).collect();
    if let Some(more) = names.len().checked_sub(MAX_NAMES).filter(|more| *more > 0) {
        shown.push(format!("… and {more} more"));
    }
    shown.join(", ")
}
