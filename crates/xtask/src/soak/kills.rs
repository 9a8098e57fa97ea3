//! Renders that are killed produce the same image as others.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use pt_testing::Random;

use super::Args;
use crate::project::{output_folder, root};

/// Renders of about half a second to two, of different kinds: names, and their options.
const RENDERS: [(&str, &str); 6] = [
    ("sobol", "-r 80 60 -s 500 -t 1"),
    ("two threads", "-r 120 90 -s 500 -t 2 --tile-size 7"),
    ("adaptive", "-r 80 60 -s 900 -t 1 -a 32 0.03"),
    ("error target", "-r 80 60 -t 2 --target-error 9%"),
    ("path reuse", "-r 60 45 -s 400 -t 2 --path-reuse 4"),
    (
        "other channels",
        "-r 60 45 -s 400 -t 1 --sampler zsobol --aov albedo,cryptomatte_object,primitive",
    ),
];

/// Number of kills between lines of progress.
const LINE_EVERY: u32 = 100;

/// Statistics of the kills.
#[derive(Default)]
struct Tally {
    kills: u32,
    renders: u32,
    /// Number of newest films that were damaged on purpose.
    damaged: u32,
    /// Number of times that the previous film replaced one that could not be read.
    fell_back: u32,
    /// Number of kills after which there was a film to resume from.
    kept: u32,
}

/// Kills renders at random instants, sometimes damages the newest of two films, and resumes until
/// they are finished; each image must equal that of an uninterrupted render.
pub(super) fn run(program: &Path, args: &Args) -> Result<()> {
    let mut random = Random::new(args.seed);
    let mut tally = Tally::default();
    let start = Instant::now();
    let folder = output_folder("soak")?;
    let wants = RENDERS.iter().map(|(name, options)| {
        let render = Render::new(program, &folder, options)?;
        let begin = Instant::now();
        ensure!(render.command().status()?.success(), "{name}: the render fails");
        Ok((render.image()?, begin.elapsed()))
    });
    let wants = wants.collect::<Result<Vec<_>>>()?;
    let mut reported = 0;
    while tally.kills < args.kills {
        let i = random.below(RENDERS.len());
        let (name, options) = RENDERS[i];
        let render = Render::new(program, &folder, options)?;
        let image = killed(&render, wants[i].1, &mut random, &mut tally)
            .with_context(|| format!("{name}, after {} kills", tally.kills))?;
        tally.renders += 1;
        if tally.kills / LINE_EVERY > reported {
            reported = tally.kills / LINE_EVERY;
            let (kills, seconds) = (tally.kills, start.elapsed().as_secs_f64());
            let left = seconds * f64::from(args.kills.saturating_sub(kills)) / f64::from(kills);
            println!("{kills} of {} kills, {seconds:.0} s, {left:.0} s left", args.kills);
        }
        ensure!(
            image == wants[i].0,
            "{name}: another image than that of a render that nobody stopped; see {}",
            folder.display()
        );
    }
    println!(
        "{} kills of {} renders in {:.0} s: every image is that of a render that nobody stopped\n\
         {} times there were samples to go on from; {} newest films were damaged, {} times the one \
         before took their place",
        tally.kills,
        tally.renders,
        start.elapsed().as_secs_f64(),
        tally.kept,
        tally.damaged,
        tally.fell_back
    );
    Ok(())
}

/// A render into its own folder.
struct Render<'a> {
    program: &'a Path,
    folder: PathBuf,
    options: Vec<String>,
}

impl<'a> Render<'a> {
    /// Creates the render in an empty folder.
    fn new(program: &'a Path, folder: &Path, options: &str) -> Result<Self> {
        let folder = folder.join("killed");
        if folder.is_dir() {
            fs::remove_dir_all(&folder)?;
        }
        fs::create_dir_all(&folder)?;
        let scene = root().join("scenes/cornell.dae");
        let fixed = ["-q", "--metadata", "stable", "--checkpoint-every", "0.03", "-f", "out.exr"]
            .map(str::to_owned);
        let options = options.split(' ').map(str::to_owned);
        let options = options.chain(fixed).chain([scene.display().to_string()]).collect();
        Ok(Self { program, folder, options })
    }

    fn command(&self) -> Command {
        let mut command = Command::new(self.program);
        command.args(&self.options).current_dir(&self.folder).stderr(Stdio::piped());
        command
    }

    fn film(&self) -> PathBuf {
        self.folder.join("out.exr.film")
    }

    fn before(&self) -> PathBuf {
        self.folder.join("out.exr.film.old")
    }

    fn image(&self) -> Result<Vec<u8>> {
        Ok(fs::read(self.folder.join("out.exr"))?)
    }
}

/// Starts a render repeatedly, and kills it at a random instant of its total time, until one ends
/// by itself. Returns its image.
fn killed(
    render: &Render,
    whole: Duration,
    random: &mut Random,
    tally: &mut Tally,
) -> Result<Vec<u8>> {
    loop {
        let mut child = render.command().spawn()?;
        sleep(whole.mul_f32(0.5 * random.unit()));
        child.kill().context("it cannot be killed")?;
        let output = child.wait_with_output()?;
        let reported = String::from_utf8_lossy(&output.stderr);
        tally.fell_back += u32::from(reported.contains("the previous film is used"));
        if ended(output.status) {
            ensure!(output.status.success(), "it fails: {reported}");
            return render.image();
        }
        tally.kills += 1;
        tally.kept += u32::from(render.film().is_file() || render.before().is_file());
        if random.below(4) == 0 && render.before().is_file() {
            tally.damaged += u32::from(damage(&render.film(), random)?);
        }
    }
}

/// Returns true if a process ended by itself.
fn ended(status: ExitStatus) -> bool {
    status.code().is_some()
}

/// Damages a file: overwrites a part, truncates it, or changes a bit. Returns true if there was a
/// file.
fn damage(film: &Path, random: &mut Random) -> Result<bool> {
    if !film.is_file() {
        return Ok(false);
    }
    let mut bytes = fs::read(film)?;
    if bytes.is_empty() {
        return Ok(false);
    }
    let place = random.below(bytes.len());
    match random.below(3) {
        0 => bytes.truncate(place),
        1 => bytes[place..].fill(0),
        _ => bytes[place] ^= 1 << random.below(8),
    }
    fs::write(film, bytes)?;
    Ok(true)
}
