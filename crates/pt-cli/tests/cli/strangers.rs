//! Films and images of strangers: their commands are data.

use std::net::TcpListener;
use std::os::unix::process::ExitStatusExt;
use std::process::Stdio;
use std::time::Duration;

use crate::common::{Folder, TINY};

/// A scene that names a file outside of its own folder.
const OUTSIDE: &str = r#"<scene version="3.0.0"><shape type="obj"><string name="filename" value="../outside.obj"/></shape></scene>"#;

#[test]
fn commands_of_films_write_no_other_files_and_call_nobody() {
    let folder = Folder::new();
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("an address");
    folder.succeed(&format!("{TINY} -f out.exr --tev {address} --summary-json told.json SCENE"));
    drop(listener.accept().expect("the render connects"));
    listener.set_nonblocking(true).expect("a socket");
    folder.write("told.json", "of the user");
    for command in ["resume out.exr -s 4", "rerender out.exr"] {
        let run = folder.succeed(command);
        let named = "its command has --summary-json, --tev, not taken from a file";
        assert!(run.err.contains(named), "{run:?}");
        assert!(listener.accept().is_err(), "{command} connects");
        assert_eq!(folder.read("told.json"), b"of the user", "{command}");
    }
}

#[test]
fn commands_of_films_allow_no_folders() {
    let folder = Folder::new();
    std::fs::create_dir(folder.path("inner")).expect("there is room");
    folder.write("inner/scene.xml", OUTSIDE);
    folder.write("outside.obj", "v 0 0 5\nv 1 0 5\nv 0 1 5\nf 1 2 3\n");
    for (name, option) in [("a.exr", "--allow-outside"), ("b.exr", "--allow-folder .")] {
        folder.succeed(&format!("{TINY} -f {name} {option} inner/scene.xml"));
        for command in [format!("resume {name} -s 4"), format!("rerender {name}")] {
            let run = folder.run(&command);
            assert_eq!(run.code, Some(2), "{run:?}");
            let word = option.trim_end_matches(" .");
            assert!(run.err.contains(&format!("its command has {word}, not taken")), "{run:?}");
            let run = folder.succeed(&format!("{command} {option}"));
            assert!(!run.err.contains("not taken"), "{run:?}");
        }
    }
}

#[test]
fn names_do_not_command_the_terminal() {
    let folder = Folder::new();
    let name = "\u{1b}]0;owned\u{7}";
    folder.write("a.obj", format!("mtllib {name}.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"));
    folder.run(&format!("{TINY} -f out.exr a.obj --camera fit"));
    std::fs::rename(folder.path("out.exr"), folder.path("moved.exr")).expect("a file");
    for command in [
        "check a.obj",
        "info a.obj",
        "info a.obj --json",
        "info moved.exr",
        "-f b.png a.obj",
        "explain a.obj -x 0 -y 0",
    ] {
        let run = folder.run(command);
        let text = run.out.clone() + &run.err;
        assert!(!text.contains(['\u{1b}', '\u{7}']), "{run:?}");
    }
    let run = folder.run("check a.obj");
    assert!(run.out.contains(r"\u001b]0;owned\u0007"), "{run:?}");
}

/// With a standard error or output that takes nothing, all commands end, with the status that they have otherwise.
#[test]
fn closed_and_full_pipes_end_nothing_badly() {
    let folder = Folder::new();
    folder.succeed(&format!("{TINY} -f out.exr SCENE"));
    let scene = crate::common::SCENE;
    let lines = [
        format!("-r 12 9 -s 2 -f a.png {scene}"),
        format!("-r 12 9 -s 2 --progress json -f a.png {scene}"),
        format!("--cs184 -r 12 9 -f a.png {scene}"),
        "missing.dae".to_owned(),
        "--no-such-option".to_owned(),
        "info out.exr".to_owned(),
        "resume out.exr -s 4".to_owned(),
        "rerender out.exr --force".to_owned(),
        format!("check {scene}"),
        format!("explain {scene} -r 12 9 -s 2 -x 1 -y 1"),
        format!("convert {scene} scene.json --force"),
        "--help".to_owned(),
    ];
    for line in lines {
        let args: Vec<_> = line.split(' ').collect();
        let usual = folder.run(&line).code;
        for round in 0..6 {
            let mut command = folder.command(&args);
            let (reader, writer) = std::io::pipe().expect("a pipe");
            drop(reader);
            command.stdin(Stdio::null()).stderr(writer.try_clone().expect("a handle"));
            command.stdout(if round % 2 == 0 { Stdio::from(writer) } else { Stdio::null() });
            if round == 5 {
                let full = std::fs::File::options().write(true).open("/dev/full");
                command.stderr(full.expect("a full disk"));
            }
            let mut child = command.spawn().expect("the program can be started");
            let mut status = None;
            for _ in 0..600 {
                status = child.try_wait().expect("a child");
                if status.is_some() {
                    break;
                }
                std::thread::sleep(Duration::from_millis(50));
            }
            let Some(status) = status else {
                let _ = child.kill();
                panic!("{line}: hangs");
            };
            assert_eq!((status.code(), status.signal()), (usual, None), "{line}");
        }
    }
}

/// A text that could not be printed is an error.
#[test]
fn a_full_standard_output_is_an_error() {
    let folder = Folder::new();
    for line in ["--help", "--version", "check --help", "check missing.dae"] {
        let args: Vec<_> = line.split(' ').collect();
        let full = std::fs::File::options().write(true).open("/dev/full").expect("a full disk");
        let run = folder.command(&args).stdout(full).output().expect("the program can be started");
        assert_eq!(run.status.code(), Some(2), "{line}");
        assert!(String::from_utf8_lossy(&run.stderr).contains("cannot print"), "{line}");
    }
}
