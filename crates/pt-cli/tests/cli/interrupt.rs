//! Ctrl-C ends a render early, and its samples are kept.

#![cfg(target_os = "linux")]

use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::common::{Folder, Run, SCENE};

/// Returns true if the process handles SIGINT, signal 2, already. [proc_pid_status(5), SigCgt]
fn listens(child: &Child) -> bool {
    let status = std::fs::read_to_string(format!("/proc/{}/status", child.id()));
    let mask = status.ok().and_then(|s| {
        let line = s.lines().find_map(|l| l.strip_prefix("SigCgt:"))?;
        u64::from_str_radix(line.trim(), 16).ok()
    });
    mask.is_some_and(|m| m & 0b10 != 0)
}

/// Waits until a running process satisfies a condition.
fn wait_until(child: &mut Child, is_so: impl Fn(&Child) -> bool) {
    let start = Instant::now();
    while !is_so(child) {
        assert!(child.try_wait().unwrap().is_none(), "ended on its own");
        assert!(start.elapsed() < Duration::from_mins(1), "nothing comes of it");
        sleep(Duration::from_millis(5));
    }
}

fn interrupt(child: &Child) {
    let kill = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(kill.success());
}

fn interrupted(args: &[&str], folder: &Folder) -> Run {
    let mut command = folder.command(args);
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let start = Instant::now();
    wait_until(&mut child, listens);
    sleep(Duration::from_secs(1));
    interrupt(&child);
    let output = child.wait_with_output().unwrap();
    assert!(start.elapsed() < Duration::from_mins(1), "did not stop soon");
    Run::of(&output, &args.join(" "))
}

#[test]
fn an_interrupted_render_leaves_the_image_so_far() {
    let folder = Folder::new();
    let args = ["-r", "16", "12", "-s", "100000000", "-t", "1", "-f", "out.png", SCENE];
    let run = interrupted(&args, &folder);
    assert_eq!(run.code, Some(130), "{run:?}");
    assert!(run.err.contains("stopped early") && run.err.contains("saved out.png"), "{run:?}");
    assert_eq!(folder.files(), ["out.png", "out.png.film"]);
    let image = folder.image("out.png");
    assert_eq!((image.width, image.height), (16, 12));
    assert!(image.pixels.iter().flatten().any(|v| *v > 0.0), "nothing but black");
}

/// Batches are long, so that the second signal arrives before the first one has ended the render.
#[test]
fn a_second_interruption_ends_at_once_and_leaves_the_last_film() {
    let folder = Folder::new();
    let args = ["-r", "16", "12", "-s", "1000000", "-l", "4096", "-t", "1", "-f", "out.exr"];
    let args = [&args[..], &["--checkpoint-every", "0.01", SCENE]].concat();
    let mut command = folder.command(&args);
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    wait_until(&mut child, |_| folder.path("out.exr.film").is_file());
    interrupt(&child);
    // The process may have ended by then.
    let _ = Command::new("kill").args(["-INT", &child.id().to_string()]).output();
    let start = Instant::now();
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert!(start.elapsed() < Duration::from_secs(20), "did not end at once");
    let reported = folder.succeed("info out.exr.film").out;
    assert!(reported.contains("not finished"), "{reported}");
}
