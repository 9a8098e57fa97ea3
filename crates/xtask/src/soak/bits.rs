//! The film is a function of scene, settings, seed and version alone: not of threads, tiles,
//! vectors, trees, or processes among which the samples are divided.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail, ensure};

use crate::project::{output_folder, root, shown};

/// Scenes, each with its options.
const SCENES: [(&str, &str); 6] = [
    ("cornell.dae", "-r 64 48 -s 64 --aov albedo,normal,primitive,refused,cryptomatte_object"),
    ("mitsuba/textures.xml", "-r 64 64 -s 32"),
    ("mitsuba/fog.xml", "-r 48 48 -s 32"),
    ("mitsuba/many_lights.xml", "-r 64 64 -s 32 --path-reuse 2"),
    ("mitsuba/metals_ggx.xml", "-r 64 64 -s 32 --path-splitting 4 --light-samples 4"),
    ("motion.xml", "-r 64 48 -s 32 --filter mitchell"),
];

/// Variants that must not change any bit: the vector instructions, and options.
const VARIANTS: [(&str, &str); 12] = [
    ("", "-t 2"),
    ("", "-t 3"),
    ("", "-t 7"),
    ("", "-t 64"),
    ("", "-t 1 --tile-size 1"),
    ("", "-t 2 --tile-size 7"),
    ("", "-t 3 --tile-size 1000"),
    ("avx2", "-t 1"),
    ("avx2", "-t 7 --tile-size 5"),
    ("", "-t 2 --bvh none"),
    ("", "-t 2 --bvh mean --max-leaf-size 1"),
    ("", "-t 2 --bvh-quality high"),
];

/// Bounds, in 32nds of all samples, of the parts that are rendered by concurrent processes.
const CUTS: [u32; 5] = [0, 1, 9, 25, 32];

/// Compares the films of all variants of all scenes.
///
/// # Errors
/// If two differ, or a render fails.
pub(super) fn run(program: &Path) -> Result<()> {
    let folder = output_folder("soak")?.join("bits");
    std::fs::create_dir_all(&folder)?;
    let mut compared = 0;
    for (scene, options) in SCENES {
        let bits =
            Bits { program, folder: &folder, scene: root().join("scenes").join(scene), options };
        let want = bits.hash(&[("", "-t 1".to_owned())], "-t 1")?;
        for (simd, variant) in VARIANTS {
            let what = format!("{simd} {variant}");
            let hash = bits.hash(&[(simd, variant.to_owned())], &what)?;
            ensure!(hash == want, "{scene}: {what}: another film than with -t 1");
            compared += 1;
        }
        let spp = bits.spp()?;
        let part = |cut: &[u32]| {
            let [from, to] = [cut[0], cut[1]].map(|n| n * spp / 32);
            ("", format!("-t {} --samples {from}..{to}", 1 + cut[0] % 3))
        };
        let mut parts: Vec<_> = CUTS.windows(2).map(part).collect();
        for order in ["in order", "turned", "backwards"] {
            let hash = bits.hash(&parts, order)?;
            ensure!(hash == want, "{scene}: merged {order}: another film than that of one process");
            compared += 1;
            if order == "in order" { parts.rotate_left(1) } else { parts.reverse() }
        }
        println!("{scene}: {want}");
    }
    println!("{compared} films are those of one thread, to the bit");
    Ok(())
}

/// A scene and its options.
struct Bits<'a> {
    program: &'a Path,
    folder: &'a Path,
    scene: PathBuf,
    options: &'static str,
}

impl Bits<'_> {
    fn spp(&self) -> Result<u32> {
        let words: Vec<_> = self.options.split(' ').collect();
        let number = words.windows(2).find(|pair| pair[0] == "-s").map(|pair| pair[1]);
        Ok(number.context("the options say how many samples")?.parse()?)
    }

    /// Hash of the film that is merged from parts, each rendered by its own process.
    fn hash(&self, parts: &[(&str, String)], what: &str) -> Result<String> {
        let film = |i: usize| self.folder.join(format!("{i}.film"));
        let mut running = Vec::new();
        for (i, (simd, options)) in parts.iter().enumerate() {
            let mut command = Command::new(self.program);
            command.args(self.options.split(' ')).args(options.split(' '));
            command.args(["-q", "--restart", "-f"]).arg(film(i)).arg(&self.scene);
            if !simd.is_empty() {
                command.env("PATHTRACER_SIMD", simd);
            }
            let child = command.spawn().with_context(|| shown(&command))?;
            running.push(child);
        }
        for mut child in running {
            ensure!(child.wait()?.success(), "{what}: the render fails");
        }
        let mut whole = film(0);
        if parts.len() > 1 {
            whole = self.folder.join("whole.film");
            let mut merge = Command::new(self.program);
            merge.args(["merge", "-q", "-f"]).arg(&whole).args((0..parts.len()).map(film));
            ensure!(merge.status()?.success(), "{what}: the films cannot be merged");
        }
        let info = Command::new(self.program).args(["info", "--json"]).arg(whole).output()?;
        let receipt: serde_json::Value = serde_json::from_slice(&info.stdout)?;
        let Some(hash) = receipt["film"].as_str() else { bail!("{what}: info reports no hash") };
        Ok(hash.to_owned())
    }
}
