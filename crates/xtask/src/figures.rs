//! `cargo xtask figures`: the figures of a report on the university course's program.

use std::path::Path;
use std::process::Command;
use std::time::Instant;

use anyhow::Result;

use crate::project::{COURSE_MODES, build_program, course_scene, output_folder, shown, succeed};

/// Options of the figures.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Take a sixteenth of the samples per pixel
    #[arg(long)]
    quick: bool,
    /// Only the figure of this number
    #[arg(long, value_name = "NUMBER")]
    figure: Option<u32>,
}

/// Images of one command line of the report.
struct Figure {
    number: u32,
    /// Arguments in front of the scene; `X` is replaced by each of the values.
    command: &'static str,
    values: &'static [&'static str],
    scene: &'static str,
}

const fn figure(
    number: u32,
    command: &'static str,
    values: &'static [&'static str],
    scene: &'static str,
) -> Figure {
    Figure { number, command, values, scene }
}

const BUNNY: &str = "sky/CBbunny.dae";
const SPHERES: &str = "sky/CBspheres_lambertian.dae";
/// The report gives no command for its images of normals.
const NORMALS: &str = "-t 8 -s 4 --integrator normals -r 800 600 -f X.png";
const ONCE: &[&str] = &[""];

/// All figures with renderings. If several images share a command, the views are distinguished by
/// `--light-component`, and light sampling by omitting `-H`.
const FIGURES: &[Figure] = &[
    figure(3, NORMALS, &["cube"], "simple/cube.dae"),
    figure(3, NORMALS, &["teapot"], "meshedit/teapot.dae"),
    figure(3, NORMALS, &["banana"], "keenan/banana.dae"),
    figure(3, NORMALS, &["CBspheres"], SPHERES),
    figure(4, NORMALS, &["cow"], "meshedit/cow.dae"),
    figure(4, NORMALS, &["maxplanck"], "meshedit/maxplanck.dae"),
    figure(4, NORMALS, &["CBbunny"], BUNNY),
    figure(4, NORMALS, &["building"], "keenan/building.dae"),
    figure(5, "-t 8 -s 1 -l X -H -f CBbunny_H_1_X.png -r 480 360", &["1", "4", "16", "64"], BUNNY),
    figure(6, "-t 8 -s 16 -l 8 -H -f CBbunny_H_16_8_hemisphere.png -r 480 360", ONCE, BUNNY),
    figure(6, "-t 8 -s 16 -l 8 -f CBbunny_H_16_8_light.png -r 480 360", ONCE, BUNNY),
    figure(
        7,
        "-t 8 -s 64 -l 16 -m 5 -r 480 360 -f X.png --light-component X",
        &["direct", "indirect", "global"],
        SPHERES,
    ),
    figure(
        8,
        "-t 8 -s 16 -l 8 -H -f -m X CBbunny_mX_.png -r 480 360",
        &["0", "1", "2", "3", "100"],
        BUNNY,
    ),
    figure(9, "-t 8 -s X -l 4 -m 5 -r 480 360 -f spheresX.png", &["1", "2", "4", "16"], SPHERES),
    figure(10, "-t 8 -s 2048 -a 64 0.05 -l 1 -m 5 -r 480 360 -f bunny.png", ONCE, BUNNY),
];

/// Renders the figures, once with the program's defaults and once as the course's program does.
///
/// # Errors
/// If one cannot be rendered.
pub(crate) fn run(args: &Args) -> Result<()> {
    if course_scene(BUNNY).is_none() {
        println!("skipped: ../shared/scenes/dae not found; the scenes are not ours to bring along");
        return Ok(());
    }
    let program = build_program()?;
    let wanted = |f: &&Figure| args.figure.is_none_or(|number| number == f.number);
    let mut count = 0;
    for (name, mode) in COURSE_MODES {
        let folder = output_folder(&format!("figures/{name}"))?;
        for figure in FIGURES.iter().filter(wanted) {
            count += render(figure, &program, mode, &folder, args.quick)?;
        }
        println!("images are in {}", folder.display());
    }
    anyhow::ensure!(count > 0, "the report has no figure of this number that is rendered");
    Ok(())
}

/// Renders one figure; returns the number of images.
fn render(
    figure: &Figure,
    program: &Path,
    mode: Option<&str>,
    folder: &Path,
    quick: bool,
) -> Result<usize> {
    let Some(scene) = course_scene(figure.scene) else {
        println!("skipped: figure {}: {} not found", figure.number, figure.scene);
        return Ok(0);
    };
    for value in figure.values {
        let line = figure.command.replace('X', value);
        let mut command = Command::new(program);
        command.current_dir(folder).arg("-q").args(mode).args(words(&line, quick)).arg(&scene);
        let start = Instant::now();
        succeed(&mut command)?;
        let seconds = start.elapsed().as_secs_f64();
        println!("figure {:>2}  {seconds:>6.1} s  {}", figure.number, shown(&command));
    }
    Ok(figure.values.len())
}

/// Words of a command line, with fewer samples per pixel if `quick` is true.
fn words(line: &str, quick: bool) -> Vec<String> {
    let mut words: Vec<String> = line.split_whitespace().map(str::to_owned).collect();
    let spp = words.iter().position(|w| w == "-s").map(|i| i + 1).filter(|_| quick);
    if let Some(word) = spp.and_then(|i| words.get_mut(i))
        && let Ok(spp) = word.parse::<u32>()
    {
        *word = (spp / 16).max(1).to_string();
    }
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quick_takes_a_sixteenth_of_the_samples_and_at_least_one() {
        assert_eq!(words("-t 8 -s 64 -l 16", true), ["-t", "8", "-s", "4", "-l", "16"]);
        assert_eq!(words("-s 2 -f a.png", true)[1], "1");
        assert_eq!(words("-s 64", false)[1], "64");
    }

    #[test]
    fn every_image_has_a_name_of_its_own() {
        let line = |f: &Figure, x: &str| f.command.replace('X', x);
        let png = |l: String| l.split(' ').find(|w| w.contains(".png")).map(str::to_owned);
        let all = FIGURES.iter().flat_map(|f| f.values.iter().map(move |x| png(line(f, x))));
        let mut names: Vec<_> = all.collect();
        let count = names.len();
        names.sort();
        names.dedup();
        assert!(names.len() == count && names.iter().all(Option::is_some), "{names:?}");
    }
}
