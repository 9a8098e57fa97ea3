//! All commands of the documentation run, and have the documented results.

#[cfg(unix)]
use std::process::Command;

use pathtracer::Image;
use pathtracer::image::{SaveOptions, save};

use crate::common::{Folder, SCENE, SMALL};

const PAGES: [&str; 4] = [
    include_str!("../../../../README.md"),
    include_str!("../../../../docs/cs184.md"),
    include_str!("../../../../docs/formats.md"),
    include_str!("../../../../docs/after-the-render.md"),
];

/// Commands that do not render.
const WITHOUT_RENDER: [&str; 7] =
    ["resume", "info", "check", "convert", "develop", "denoise", "join"];

const MOTION: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/motion.xml");

/// Page whose blocks of shell code are run by a shell.
#[cfg(unix)]
const GUARANTEES: &str = include_str!("../../../../docs/guarantees.md");

/// Lines of shell code that begin with the name of the program, without it and without comments.
fn commands() -> Vec<&'static str> {
    let mut is_shell = false;
    let mut found = Vec::new();
    for line in PAGES.iter().flat_map(|page| page.lines()) {
        match line {
            "```sh" => is_shell = true,
            "```" => is_shell = false,
            _ if is_shell => found.extend(line.strip_prefix("pathtracer ")),
            _ => {}
        }
    }
    found.into_iter().map(|l| l.split('#').next().unwrap_or(l).trim()).collect()
}

/// Returns the command with fewer pixels and samples; the image contains the cell or the pixel, if
/// one is given. Commands that do not render the whole scene are unchanged.
fn reduced(command: &str) -> String {
    if WITHOUT_RENDER.iter().any(|name| command.starts_with(name)) {
        return command.to_owned();
    }
    let has_place = command.contains("-p ") || command.contains("-x ");
    let size = if has_place { ["200", "150"] } else { ["12", "9"] };
    let mut words: Vec<_> = command.split(' ').map(str::to_owned).collect();
    if command.contains("--target-") {
        words.extend(["--max-spp", "4"].map(str::to_owned));
    } else if !words.contains(&"-s".into()) {
        words.extend(["-s", "2"].map(str::to_owned));
    }
    if !words.contains(&"-r".into()) {
        words.extend(["-r", size[0], size[1]].map(str::to_owned));
    }
    for i in 1..words.len() {
        match words[i - 1].as_str() {
            "-s" => words[i] = "2".into(),
            "-r" if words[i].parse().is_ok_and(|columns: u32| columns > 320) => {
                (words[i], words[i + 1]) = (size[0].into(), size[1].into());
            }
            _ => {}
        }
    }
    words.join(" ")
}

#[test]
fn every_command_runs() {
    let folder = Folder::new();
    std::fs::copy(SCENE, folder.path("scene.dae")).unwrap();
    std::fs::create_dir(folder.path("scenes")).unwrap();
    std::fs::copy(MOTION, folder.path("scenes/motion.xml")).unwrap();
    folder.write("CBbunny.dae", SMALL);
    let vertices = "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    let header = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
                  property float z\nelement face 1\nproperty list uchar int vertex_indices\n\
                  end_header\n";
    folder.write("bunny.ply", format!("{header}{vertices}"));
    let sky = Image { width: 4, height: 2, pixels: vec![[1.0; 3]; 8].into() };
    save(&sky, &folder.path("sky.exr"), &SaveOptions::default()).unwrap();
    let commands = commands();
    assert!(commands.len() > 10, "{commands:?}");
    for command in commands {
        let run = folder.run(&reduced(command));
        let is_without_library =
            command.starts_with("denoise") && run.err.contains("Open Image Denoise is not found");
        assert!(run.code == Some(0) || is_without_library, "{run:?}");
    }
}

/// Returns the blocks of shell code of a page.
#[cfg(unix)]
fn blocks(page: &str) -> Vec<&str> {
    let after = page.split("```sh\n").skip(1);
    after.map(|rest| rest.split("```").next().unwrap_or(rest)).collect()
}

/// Returns a line with fewer pixels, if it renders; `; echo $?   # 2` becomes a test of that
/// status.
#[cfg(unix)]
fn reduced_line(line: &str) -> String {
    let (code, comment) = line.split_once('#').unwrap_or((line, ""));
    let size = match code {
        _ if ["info", "resume", "rerender", "merge"].iter().any(|name| code.contains(name)) => "",
        _ if code.contains("--target-") => "--max-spp 16",
        _ if code.contains(" -r ") => "",
        _ if code.contains("explain") => "-r 200 150 -s 2",
        _ => "-r 12 9",
    };
    let Some((command, _)) = code.split_once("; echo $?") else {
        return if code.contains("pathtracer ") { format!("{code} {size}") } else { code.into() };
    };
    format!("{command} {size} && exit 1 || test $? -eq {}", comment.trim())
}

#[cfg(unix)]
#[test]
fn the_checks_of_the_guarantees_hold() {
    let program = std::path::Path::new(env!("CARGO_BIN_EXE_pathtracer"));
    let folder = Folder::new();
    std::fs::copy(SCENE, folder.path("scene.dae")).unwrap();
    let path = std::env::var("PATH").unwrap_or_default();
    let path = format!("{}:{path}", program.parent().unwrap().display());
    let blocks = blocks(GUARANTEES);
    assert!(blocks.len() >= 8, "{blocks:?}");
    for block in blocks {
        let script: Vec<_> = block.lines().map(reduced_line).collect();
        let mut shell = Command::new("sh");
        shell.args(["-ec", &script.join("\n")]).current_dir(folder.path(""));
        let output = shell.env("PATH", &path).output().expect("a shell");
        let run = crate::common::Run::of(&output, block);
        assert_eq!(run.code, Some(0), "{script:#?}\n{run:?}");
        let hashes: Vec<_> = run.out.lines().filter(|line| line.contains("hash")).collect();
        assert!(hashes.windows(2).all(|two| two[0] == two[1]), "{run:?}");
    }
}
