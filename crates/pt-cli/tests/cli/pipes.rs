//! Standard output and error that are closed, full or slow.

use std::fs::File;
use std::io::{PipeReader, Read};
use std::os::unix::process::ExitStatusExt;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::Duration;

use crate::common::{Folder, SCENE, TINY};

/// States of standard output and standard error.
#[derive(Clone, Copy, Debug)]
enum Way {
    /// The readers of both are closed.
    Gone,
    /// The reader of standard error is closed, and standard output is discarded.
    ErrorsGone,
    /// The reader takes the first bytes of both, as `head` does.
    Head,
    /// The reader takes a byte at a time.
    Slow,
    /// Both are on a full disk.
    Full,
    /// Both are closed.
    Closed,
}

const WAYS: [Way; 6] = [Way::Gone, Way::ErrorsGone, Way::Head, Way::Slow, Way::Full, Way::Closed];

/// Number of runs of each command with each state; more in `cargo xtask soak pipes`.
fn rounds() -> u32 {
    std::env::var("PT_PIPES").ok().and_then(|n| n.parse().ok()).unwrap_or(1)
}

fn full() -> File {
    File::options().write(true).open("/dev/full").expect("a full disk")
}

impl Way {
    /// Starts a command of the program, and reads its output as this state requires.
    fn start(self, folder: &Folder, args: &[&str]) -> Child {
        let mut command = folder.command(args);
        command.stdin(Stdio::null());
        let (reader, writer) = std::io::pipe().expect("a pipe");
        let both = || [(); 2].map(|()| Stdio::from(writer.try_clone().expect("a handle")));
        let [out, errors] = match self {
            Self::Gone | Self::Head | Self::Slow => both(),
            Self::ErrorsGone => [Stdio::null(), both().into_iter().next().expect("two")],
            Self::Full => [Stdio::from(full()), Stdio::from(full())],
            Self::Closed => {
                let mut shell = Command::new("sh");
                shell.args(["-c", "exec \"$0\" \"$@\" >&- 2>&-"]).arg(command.get_program());
                shell.args(args).current_dir(command.get_current_dir().expect("a folder"));
                for (name, value) in command.get_envs() {
                    value.map(|value| shell.env(name, value));
                }
                shell.stdin(Stdio::null());
                command = shell;
                [Stdio::null(), Stdio::null()]
            }
        };
        command.stdout(out).stderr(errors);
        drop(writer);
        let child = command.spawn().expect("the program can be started");
        // Closes the copies of the writer in the command.
        drop(command);
        self.read(reader);
        child
    }

    fn read(self, mut reader: PipeReader) {
        let byte = &mut [0];
        match self {
            Self::Head => {
                for _ in 0..150 {
                    if !matches!(reader.read(byte), Ok(1)) {
                        break;
                    }
                }
            }
            Self::Slow => drop(std::thread::spawn(move || {
                let byte = &mut [0];
                while matches!(reader.read(byte), Ok(1)) {
                    std::thread::sleep(Duration::from_micros(200));
                }
            })),
            Self::Gone | Self::ErrorsGone | Self::Full | Self::Closed => {}
        }
    }
}

/// Waits for the end of a process; returns `None` if it does not end within half a minute.
fn end(child: &mut Child) -> Option<ExitStatus> {
    for _ in 0..3000 {
        if let Some(status) = child.try_wait().expect("a child") {
            return Some(status);
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    child.kill().expect("a child that runs");
    None
}

/// All commands end, with their usual status, or with that of an error if requested text cannot be
/// printed.
#[test]
fn all_commands_end_whatever_becomes_of_what_they_print() {
    let folder = Folder::new();
    folder.succeed(&format!("{TINY} -f out.exr SCENE"));
    for part in ["0..1", "1..2"] {
        folder.succeed(&format!("-r 12 9 -s 2 --samples {part} -f {}.film SCENE", &part[..1]));
    }
    let printed = [
        "info out.exr".to_owned(),
        format!("info {SCENE}"),
        format!("check {SCENE}"),
        format!("explain {SCENE} -r 12 9 -s 2 -x 1 -y 1"),
        "--help".to_owned(),
        "resume --help".to_owned(),
        "--version".to_owned(),
    ];
    let written = [
        format!("-r 12 9 -s 2 -f a.png {SCENE}"),
        format!("-r 12 9 -s 2 --progress json -f a.png {SCENE}"),
        format!("-r 12 9 -s 2 --integrator mlt -f a.png {SCENE}"),
        format!("--cs184 -r 12 9 -f a.png {SCENE}"),
        "missing.dae".to_owned(),
        "--no-such-option".to_owned(),
        "resume out.exr -s 4".to_owned(),
        "merge 0.film 1.film -f merged.exr --force".to_owned(),
        "rerender out.exr --force".to_owned(),
        format!("convert {SCENE} scene.json --force"),
    ];
    let is_printed = [vec![true; printed.len()], vec![false; written.len()]].concat();
    for (line, is_printed) in printed.iter().chain(&written).zip(is_printed) {
        let args: Vec<_> = line.split(' ').collect();
        let usual = folder.run(line).code;
        for way in WAYS.into_iter().cycle().take(WAYS.len() * rounds() as usize) {
            let cannot_print = is_printed && matches!(way, Way::Full);
            let wanted = if cannot_print { Some(2) } else { usual };
            let mut child = way.start(&folder, &args);
            let Some(status) = end(&mut child) else { panic!("{line}, {way:?}: hangs") };
            let found = (status.code(), status.signal());
            assert_eq!(found, (wanted, None), "{line}, {way:?}");
        }
    }
}

/// Text that cannot be printed is an error.
#[test]
fn a_full_standard_output_is_an_error() {
    let folder = Folder::new();
    for line in ["--help", "--version", "check --help", "check missing.dae"] {
        let args: Vec<_> = line.split(' ').collect();
        let run =
            folder.command(&args).stdout(full()).output().expect("the program can be started");
        assert_eq!(run.status.code(), Some(2), "{line}");
        assert!(String::from_utf8_lossy(&run.stderr).contains("cannot print"), "{line}");
    }
}
