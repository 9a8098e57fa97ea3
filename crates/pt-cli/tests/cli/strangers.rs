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

/// A film that is moved is one of a stranger: it reads what lies in its own folder, and nothing else unless that is allowed.
#[test]
fn films_that_are_moved_read_nothing_elsewhere() {
    let folder = Folder::new();
    for name in ["home", "there"] {
        std::fs::create_dir(folder.path(name)).expect("there is room");
    }
    let home = folder.path("home").display().to_string();
    let scene = std::fs::read(crate::common::SCENE).expect("it is there");
    folder.write("home/scene.dae", &scene);
    let sky = folder.path("home/sky.exr");
    pathtracer::image::save(
        &pathtracer::Image { width: 1, height: 1, pixels: vec![[1.0; 3]] },
        &sky,
        &pathtracer::image::SaveOptions::default(),
    )
    .expect("there is room");
    for (name, inputs) in [
        ("a", format!("{home}/scene.dae")),
        ("b", "home/scene.dae".to_owned()),
        ("c", format!("-e {home}/sky.exr home/scene.dae")),
        ("d", "there/../home/scene.dae".to_owned()),
    ] {
        for command in ["resume", "rerender"] {
            let made = format!("{TINY} --receipt full -f home/{name}.exr {inputs}");
            folder.succeed(&made);
            // Where it was made, it goes on.
            let more = if command == "resume" { " -s 3" } else { " --force" };
            let run = folder.run(&format!("{command} home/{name}.exr{more}"));
            assert!(matches!(run.code, Some(0 | 1)), "{run:?}");
            folder.succeed(&format!("{made} --restart"));
            for ending in ["exr", "exr.film"] {
                let to = folder.path(&format!("there/{name}.{ending}"));
                std::fs::rename(folder.path(&format!("home/{name}.{ending}")), to).expect("a film");
            }
            let run = folder.run(&format!("{command} there/{name}.exr{more}"));
            assert_eq!(run.code, Some(2), "{run:?}");
            let expected =
                "which is not in its folder, and this program did not make it here for you";
            assert!(run.err.contains(expected), "{run:?}");
            let allowed =
                folder.run(&format!("{command} there/{name}.exr{more} --allow-folder {home}"));
            assert!(matches!(allowed.code, Some(0 | 1)), "{allowed:?}");
        }
    }
    // Beside its scene it needs nothing else.
    std::fs::copy(folder.path("home/scene.dae"), folder.path("there/scene.dae")).expect("a scene");
    std::fs::create_dir(folder.path("third")).expect("there is room");
    let mut run = folder.command(&"-r 12 9 -s 2 -f e.exr scene.dae".split(' ').collect::<Vec<_>>());
    run.current_dir(folder.path("there"));
    assert!(run.status().expect("the program can be started").success());
    for name in ["e.exr", "e.exr.film", "scene.dae"] {
        std::fs::rename(
            folder.path(&format!("there/{name}")),
            folder.path(&format!("third/{name}")),
        )
        .expect("a file");
    }
    folder.succeed("resume third/e.exr -s 4");
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
