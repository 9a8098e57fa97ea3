//! Hostile files, which would exhaust memory, take unbounded time, or block when they are opened.

use std::fmt::Write as _;
use std::fs::File;
use std::io::{Seek, SeekFrom, Write};
use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};

use flate2::Compression;
use flate2::write::ZlibEncoder;

use crate::common::{Folder, SCENE, TINY};

fn chunk(kind: [u8; 4], data: &[u8]) -> Vec<u8> {
    let mut crc = flate2::Crc::new();
    crc.update(&kind);
    crc.update(data);
    let length = (data.len() as u32).to_be_bytes();
    [&length, kind.as_slice(), data, &crc.sum().to_be_bytes()].concat()
}

/// Returns a black PNG file.
fn png(width: u32, height: u32) -> Vec<u8> {
    let mut packed = ZlibEncoder::new(Vec::new(), Compression::best());
    let row = vec![0; 1 + 3 * width as usize];
    for _ in 0..height {
        packed.write_all(&row).expect("there is room");
    }
    let size = [width.to_be_bytes(), height.to_be_bytes()].concat();
    let header = [size.as_slice(), &[8, 2, 0, 0, 0]].concat();
    let pixels = packed.finish().expect("there is room");
    let chunks =
        [chunk(*b"IHDR", &header), chunk(*b"IDAT", &pixels), chunk(*b"IEND", &[])].concat();
    [b"\x89PNG\r\n\x1a\n".as_slice(), &chunks].concat()
}

/// Peak memory of a render, from its summary.
fn peak(folder: &Folder, arguments: &str) -> f64 {
    let run = folder.run(&format!("{TINY} --summary-json summary.json {arguments}"));
    assert!(matches!(run.code, Some(0 | 4)), "{run:?}");
    let summary: serde_json::Value =
        serde_json::from_slice(&folder.read("summary.json")).expect("JSON");
    summary["peak_bytes"].as_f64().expect("a number on Linux")
}

/// Each image file has 200 kB, and its pixels take 430 MB.
#[test]
fn pictures_ask_for_memory_before_they_take_it() {
    let folder = Folder::new();
    let mut materials = String::new();
    let mut faces = String::new();
    let picture = png(6000, 6000);
    for i in 0..4 {
        folder.write(&format!("p{i}.png"), &picture);
        let _ = writeln!(materials, "newmtl m{i}\nmap_Kd p{i}.png");
        let _ = writeln!(faces, "usemtl m{i}\nf 1/1 2/1 3/1");
    }
    folder.write("a.mtl", materials);
    folder.write("a.obj", format!("mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\n{faces}"));
    for limit in ["--max-memory 300MB", "--limit memory=300MB"] {
        let bytes = peak(&folder, &format!("-f out.png {limit} a.obj"));
        assert!(bytes < 150e6, "{limit}: {bytes}");
    }
    let run = folder.run(&format!("{TINY} -f out.png --max-memory 300MB a.obj"));
    assert!(run.err.contains("p3.png: it needs 864 MB of memory, and "), "{run:?}");
    assert!(
        run.err.contains("of at most 300 MB are in use")
            && run.err.contains("help: --max-memory SIZE"),
        "{run:?}"
    );
}

#[test]
fn pipes_and_devices_are_refused_at_once() {
    let folder = Folder::new();
    for name in ["p.obj", "p.exr", "p.png", "p.film", "p.json", "p.txt"] {
        let made = std::process::Command::new("mkfifo").arg(folder.path(name)).status();
        assert!(made.is_ok_and(|status| status.success()));
    }
    folder.write(
        "a.gltf",
        r#"{"asset": {"version": "2.0"}, "buffers": [{"uri": "p.obj", "byteLength": 1}]}"#,
    );
    let regular = "it is a pipe or a device, and no regular file";
    let written = "it is a pipe; expected the name of a file";
    for (arguments, expected) in [
        (format!("{TINY} -f o.png p.obj"), regular),
        (format!("{TINY} -e p.exr {SCENE}"), regular),
        (format!("{TINY} -c p.txt {SCENE}"), regular),
        (format!("{TINY} -f p.png {SCENE}"), written),
        (format!("{TINY} --summary-json p.json {SCENE}"), written),
        ("info p.film".to_owned(), regular),
        ("info p.png".to_owned(), regular),
        ("info p.obj".to_owned(), regular),
        ("rerender p.png".to_owned(), regular),
        ("merge -f m.png p.film p.film".to_owned(), regular),
        ("check p.obj".to_owned(), regular),
        ("convert p.obj a.json".to_owned(), regular),
        ("explain p.obj -x 0 -y 0".to_owned(), regular),
        ("check a.gltf".to_owned(), "not a regular file"),
    ] {
        let run = folder.run(&arguments);
        assert!(matches!(run.code, Some(2 | 4)), "{run:?}");
        assert!((run.err.clone() + &run.out).contains(expected), "{run:?}");
    }
}

/// Sparse files, which take no room on a disk, are rejected in constant memory.
#[test]
fn files_of_holes_are_not_held_in_memory() {
    let folder = Folder::new();
    let sparse = |name: &str, begin: &[u8], length: u64| {
        let mut file = File::create(folder.path(name)).expect("there is room");
        file.write_all(begin).expect("there is room");
        file.seek(SeekFrom::Start(length - 1)).expect("there is room");
        file.write_all(&[0]).expect("there is room");
    };
    let about = b"pathtracer film 7\n\x02\0\0\0\0\0\0\0{}";
    sparse("whole.film", about, 1 << 30);
    sparse("none.film", b"", 1 << 32);
    let text =
        [b"\x89PNG\r\n\x1a\n".as_slice(), &png(1, 1)[8..33], b"\x7f\xff\xff\0tEXtpathtracer\0"];
    sparse("text.png", &text.concat(), 1 << 31);
    for (arguments, expected) in [
        ("info whole.film", "checksum mismatch"),
        ("info none.film", "is not a film"),
        ("info text.png", "limits are exceeded"),
    ] {
        let command = folder.command::<&str>(&[]);
        // Kilobytes of address space, which also contains the stacks of the threads.
        let limited = format!("ulimit -v 800000; exec \"$0\" {arguments}");
        let mut shell = std::process::Command::new("sh");
        shell.args(["-c", &limited]).arg(command.get_program()).current_dir(folder.path("."));
        let done = shell.output().expect("a shell");
        let messages = String::from_utf8_lossy(&done.stderr).into_owned();
        assert_eq!(done.status.code(), Some(2), "{messages}");
        assert!(messages.contains(expected), "{arguments}: {messages}");
    }
}

/// Image of 1024 × 1024 pixels that is processed 3,000 times.
#[test]
fn pictures_of_many_scans_are_refused() {
    let folder = Folder::new();
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/seeds/progressive.jpg");
    let bytes = std::fs::read(fixtures).expect("it is there");
    let start = bytes.windows(2).position(|mark| mark == [0xFF, 0xDA]).expect("a scan");
    let end = bytes.len() - 2;
    let scans = bytes[start..end].repeat(3000);
    folder.write("a.jpg", [&bytes[..start], &scans, &bytes[end..]].concat());
    folder.write("a.mtl", "newmtl m\nmap_Kd a.jpg\n");
    folder.write(
        "a.obj",
        "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl m\nf 1/1 2/1 3/1\n",
    );
    let run = folder.run("check a.obj");
    assert!(run.out.contains("expected at most 200 scans"), "{run:?}");
}

/// File of 20 kB that would be tessellated into 40 million triangles.
#[test]
fn what_will_be_made_is_counted_before() {
    let folder = Folder::new();
    let surface = "Shape \"loopsubdiv\" \"integer levels\" 10 \"integer indices\" [0 1 2 1 3 2] \"point3 P\" [0 0 0 1 0 0 0 1 0 1 1 0]\n";
    folder.write("a.pbrt", "Camera \"perspective\" WorldBegin\n".to_owned() + &surface.repeat(200));
    let start = Instant::now();
    let run = folder.run("check a.pbrt --limit triangles=1000000");
    assert_eq!(run.code, Some(2), "{run:?}");
    assert!(run.out.contains("limit of 1000000 triangles"), "{run:?}");
    assert!(start.elapsed() < Duration::from_secs(30), "none is made");
}

#[test]
fn two_programs_do_not_write_one_image() {
    let folder = Folder::new();
    let long = format!("-r 64 64 -s 1000000 -f out.png {SCENE}");
    let mut first = folder.command(&long.split(' ').collect::<Vec<_>>());
    let mut first = first.stderr(Stdio::null()).spawn().expect("the program can be started");
    let start = Instant::now();
    while !folder.path("out.png.lock").exists() {
        assert!(start.elapsed() < Duration::from_mins(1), "it does not begin");
        std::thread::sleep(Duration::from_millis(10));
    }
    let run = folder.run(&format!("{TINY} -f out.png {SCENE}"));
    assert_eq!(run.code, Some(2), "{run:?}");
    let expected = format!("out.png: locked by another pathtracer (process {})", first.id());
    assert!(run.err.contains(&expected), "{run:?}");
    first.kill().and_then(|()| first.wait()).expect("a child");
    // A lock file of a killed process does not lock.
    folder.succeed(&format!("{TINY} -f out.png {SCENE}"));
    assert!(!folder.path("out.png.lock").exists());
}
