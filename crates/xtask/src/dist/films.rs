//! Films of the programs of the distribution: all must be the same, to the bit.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};

use super::emulator::Emulator;
use crate::project::{output_folder, root, shown, succeed};

/// Scenes, each with its options: a COLLADA file with other channels; a glTF file with images and
/// the layers of its material; a medium with emission from a grid, and measured materials, of
/// pbrt-v4; textures, hair and a sky of Mitsuba; motion.
const SCENES: [(&str, &str); 8] = [
    ("cornell.dae", "-r 64 48 -s 16 --aov albedo,normal,depth"),
    ("gltf/materials.gltf", "-r 64 48 -s 16"),
    ("pbrt/fire.pbrt", "-r 48 48 -s 8"),
    ("pbrt/measured.pbrt", "-r 32 32 -s 4"),
    ("mitsuba/hair.xml", "-r 32 32 -s 4"),
    ("mitsuba/textures.xml", "-r 48 48 -s 8"),
    ("motion.xml", "-r 48 36 -s 8 --filter mitchell"),
    ("mitsuba/sunsky_evening.xml", "-r 48 36 -s 8"),
];

/// Program of the distribution, and its emulator if necessary.
pub(super) struct Program {
    name: String,
    path: PathBuf,
    emulator: Option<Emulator>,
}

impl Program {
    pub(super) fn native(name: &str, path: PathBuf) -> Self {
        Self { name: name.to_owned(), path, emulator: None }
    }

    pub(super) fn emulated(name: &str, path: PathBuf, emulator: &Emulator) -> Self {
        Self { name: name.to_owned(), path, emulator: Some(emulator.clone()) }
    }

    fn command(&self) -> Command {
        match &self.emulator {
            Some(emulator) => emulator.command(&self.path),
            None => Command::new(&self.path),
        }
    }

    /// Hash of the film that the program renders of a scene.
    fn hash(&self, scene: &str, options: &str, film: &Path) -> Result<String> {
        let mut render = self.command();
        render.args(options.split(' ')).args(["-q", "--restart", "-f"]).arg(film);
        succeed(render.arg(root().join("scenes").join(scene)))?;
        let mut info = self.command();
        info.args(["info", "--json"]).arg(film);
        let output = info.output().with_context(|| shown(&info))?;
        let receipt: serde_json::Value =
            serde_json::from_slice(&output.stdout).with_context(|| shown(&info))?;
        let hash =
            receipt["film"].as_str().with_context(|| format!("{}: no hash", shown(&info)))?;
        Ok(hash.to_owned())
    }
}

/// Compares the films of all programs with those of the first.
///
/// # Errors
/// If two differ, or a render fails.
pub(super) fn compare(programs: &[Program]) -> Result<()> {
    let folder = output_folder("dist-films")?;
    let mut differences = Vec::new();
    for (scene, options) in SCENES {
        let mut wanted = None;
        for (i, program) in programs.iter().enumerate() {
            let hash = program.hash(scene, options, &folder.join(format!("{i}.film")))?;
            println!("{hash}  {scene}  {}", program.name);
            if *wanted.get_or_insert_with(|| hash.clone()) != hash {
                differences.push(format!("{scene} by {}", program.name));
            }
        }
    }
    ensure!(
        differences.is_empty(),
        "films differ from those of the {}: {}",
        programs[0].name,
        differences.join(", ")
    );
    Ok(())
}
