//! Every command of the documentation runs.

use pathtracer::Image;
use pathtracer::image::{SaveOptions, save};

use crate::common::{Folder, SCENE, SMALL};

const PAGES: [&str; 3] = [
    include_str!("../../../../README.md"),
    include_str!("../../../../docs/cs184.md"),
    include_str!("../../../../docs/formats.md"),
];

const MOTION: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/motion.xml");

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

/// The same words with fewer pixels and samples; an image that has the cell or the pixel, if there is one. What goes
/// on does so with the size of before, and what is looked at stays as it is.
fn reduced(command: &str) -> String {
    if ["resume", "info", "check", "convert"].iter().any(|name| command.starts_with(name)) {
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
        words.extend(["-r", "12", "9"].map(str::to_owned));
    }
    for i in 1..words.len() {
        match words[i - 1].as_str() {
            "-s" => words[i] = "2".into(),
            "-r" => (words[i], words[i + 1]) = (size[0].into(), size[1].into()),
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
    let sky = Image { width: 4, height: 2, pixels: vec![[1.0; 3]; 8] };
    save(&sky, &folder.path("sky.exr"), &SaveOptions::default()).unwrap();
    let commands = commands();
    assert!(commands.len() > 10, "{commands:?}");
    for command in commands {
        folder.succeed(&reduced(command));
    }
}
