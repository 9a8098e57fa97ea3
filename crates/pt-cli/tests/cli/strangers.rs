//! Untrusted films and images: their commands are data.

use std::net::TcpListener;

use crate::common::{Folder, TINY};

/// Scene that references a file outside of its own folder.
const OUTSIDE: &str = r#"<scene version="3.0.0"><shape type="obj"><string name="filename" value="../outside.obj"/></shape></scene>"#;

#[test]
fn commands_of_films_write_no_other_files_and_call_nobody() {
    let folder = Folder::new();
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("an address");
    folder
        .succeed(&format!("{TINY} -f out.exr --tev {address} --summary-json reported.json SCENE"));
    drop(listener.accept().expect("the render connects"));
    listener.set_nonblocking(true).expect("a socket");
    folder.write("reported.json", "of the user");
    for command in ["resume out.exr -s 4", "rerender out.exr"] {
        let run = folder.succeed(command);
        let named = "the options --summary-json, --tev of its command are ignored in files";
        assert!(run.err.contains(named), "{run:?}");
        assert!(listener.accept().is_err(), "{command} connects");
        assert_eq!(folder.read("reported.json"), b"of the user", "{command}");
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
            assert!(
                run.err.contains(&format!("the options {word} of its command are ignored")),
                "{run:?}"
            );
            let run = folder.succeed(&format!("{command} {option}"));
            assert!(!run.err.contains("are ignored in files"), "{run:?}");
        }
    }
}

/// A moved film is untrusted: its command reads files in its own folder, and others only if they
/// are allowed.
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
        &pathtracer::Image { width: 1, height: 1, pixels: vec![[1.0; 3]].into() },
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
            // In the folder where it was made, it is resumed.
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
                "outside of its folder, and the file was not created here by this program";
            assert!(run.err.contains(expected), "{run:?}");
            let allowed =
                folder.run(&format!("{command} there/{name}.exr{more} --allow-folder {home}"));
            assert!(matches!(allowed.code, Some(0 | 1)), "{allowed:?}");
        }
    }
    // Beside its scene it needs no option.
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

/// Events of the file system in some folders: files that were opened, read, written or created.
#[cfg(target_os = "linux")]
struct Watch(rustix::fd::OwnedFd);

#[cfg(target_os = "linux")]
impl Watch {
    fn of(folders: &[std::path::PathBuf]) -> Self {
        use rustix::fs::inotify::{self, CreateFlags, WatchFlags};
        let watch = inotify::init(CreateFlags::NONBLOCK).expect("a watch");
        for folder in folders {
            inotify::add_watch(&watch, folder, WatchFlags::ALL_EVENTS).expect("a folder");
        }
        Self(watch)
    }

    fn seen(&self) -> Vec<String> {
        let mut buffer = [std::mem::MaybeUninit::uninit(); 4096];
        let mut reader = rustix::fs::inotify::Reader::new(&self.0, &mut buffer);
        let mut seen = Vec::new();
        while let Ok(event) = reader.next() {
            seen.push(format!("{:?} {:?}", event.file_name(), event.events()));
        }
        seen
    }
}

/// A moved film made with every option that names a file, a folder or an address: commands on it
/// open no other files, and do not connect.
#[cfg(target_os = "linux")]
#[test]
fn nothing_outside_is_opened_for_films_of_strangers() {
    let folder = Folder::new();
    let names = ["home", "home/more", "reported", "there"];
    for name in names {
        std::fs::create_dir(folder.path(name)).expect("there is room");
    }
    folder.write("home/scene.dae", std::fs::read(crate::common::SCENE).expect("a scene"));
    let camera = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fuzz/seeds/course.camera");
    folder.write("home/view.txt", std::fs::read(camera).expect("camera settings"));
    pathtracer::image::save(
        &pathtracer::Image { width: 1, height: 1, pixels: vec![[1.0; 3]].into() },
        &folder.path("home/sky.exr"),
        &pathtracer::image::SaveOptions::default(),
    )
    .expect("there is room");
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("an address");
    let at = |name: &str| folder.path(name).display().to_string();
    for (name, home, reported) in
        [("a", at("home"), at("reported")), ("b", "home".into(), "reported".into())]
    {
        let made = [
            (format!("{name}.exr"), ""),
            (format!("{name}0.film"), "--samples 0..1"),
            (format!("{name}1.film"), "--samples 1..2"),
        ];
        for (file, more) in &made {
            folder.succeed(&format!(
                "-r 12 9 -s 2 --receipt full -e {home}/sky.exr -c {home}/view.txt --allow-folder {home}/more \
                 --summary-json {reported}/{file}.json --tev {address} {more} -f {home}/{file} {home}/scene.dae"
            ));
            drop(listener.accept().expect("the render connects"));
        }
        for file in made.map(|(file, _)| file).into_iter().chain([format!("{name}.exr.film")]) {
            let [from, to] = ["home", "there"].map(|f| folder.path(&format!("{f}/{file}")));
            std::fs::rename(from, to).expect("a film");
        }
        listener.set_nonblocking(true).expect("a socket");
        let watch = Watch::of(&["home", "home/more", "reported"].map(|name| folder.path(name)));
        for command in [
            format!("resume there/{name}.exr -s 4"),
            format!("rerender there/{name}.exr"),
            format!("info there/{name}.exr"),
            format!("info there/{name}.exr.film"),
            format!("merge there/{name}0.film there/{name}1.film -f there/m{name}.exr"),
            format!("resume there/m{name}.exr -s 4"),
            format!("rerender there/m{name}.exr"),
        ] {
            let run = folder.run(&command);
            let is_of_scene = command.starts_with("re");
            assert_eq!(run.code, Some(if is_of_scene { 2 } else { 0 }), "{run:?}");
            assert_eq!(watch.seen(), Vec::<String>::new(), "{command}");
            assert!(listener.accept().is_err(), "{command} connects");
        }
        // Files in allowed folders are read, and the watch reports that.
        folder.run(&format!("resume there/{name}.exr -s 4 --allow-folder {}", at("home")));
        assert!(watch.seen().iter().any(|event| event.contains("scene.dae")));
        listener.set_nonblocking(false).expect("a socket");
    }
}
