//! `cargo xtask bench`: measurements against other programs.

mod load;
mod measure;
mod mesh;
mod peers;
mod ply;
mod python;
mod ray;
mod rays;
mod render;
mod seed;

use anyhow::Result;

/// Quantity to measure.
#[derive(clap::Subcommand)]
pub(crate) enum Bench {
    /// Time with and without a tree, against a student's program and the course's
    Seed(seed::Args),
    /// Samples and rays per second, and memory, against the course's program
    Render(render::Args),
    /// The Python module against trimesh, Open3D, Mitsuba 3, bpy, and the program
    Python(python::Args),
    /// Renders on a Ray cluster on this machine: scaling, memory of the head, costs of tasks
    Ray(ray::Args),
    /// Ray queries, tree builds and memory against Embree 4, on the same rays in the same process
    Rays(rays::Args),
    /// Reading mesh files against assimp, Mitsuba 3 and trimesh
    Load(load::Args),
    /// Time, noise and memory of whole images against Mitsuba 3, Cycles and LuxCore
    Peers(peers::Args),
}

/// Measures and prints.
///
/// # Errors
/// If something cannot be rendered or installed.
pub(crate) fn run(bench: &Bench) -> Result<()> {
    match bench {
        Bench::Seed(args) => seed::run(args),
        Bench::Render(args) => render::run(args),
        Bench::Python(args) => python::run(args),
        Bench::Ray(args) => ray::run(args),
        Bench::Rays(args) => rays::run(args),
        Bench::Load(args) => load::run(args),
        Bench::Peers(args) => peers::run(args),
    }
}
