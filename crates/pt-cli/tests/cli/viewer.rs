//! Display of the image in a viewer while it is rendered; a socket that reads all packets takes the
//! place of tev.

use std::io::Read;
use std::net::{TcpListener, TcpStream};
use std::process::{Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use crate::common::{Folder, Run, SCENE, TINY};

/// Image that the viewer shows.
#[derive(Debug, PartialEq)]
struct Shown {
    name: String,
    width: usize,
    height: usize,
    bits: Vec<u32>,
}

/// Remaining bytes of a packet.
struct Packet<'a>(&'a [u8]);

impl Packet<'_> {
    fn bytes<const N: usize>(&mut self) -> [u8; N] {
        let (bytes, rest) = self.0.split_first_chunk().expect("the packet is long enough");
        self.0 = rest;
        *bytes
    }

    fn whole(&mut self) -> usize {
        usize::try_from(i32::from_le_bytes(self.bytes())).expect("not negative")
    }

    fn text(&mut self) -> String {
        let end = self.0.iter().position(|b| *b == 0).expect("texts end with a NUL");
        let text = String::from_utf8(self.0[..end].to_vec()).expect("UTF-8");
        self.0 = &self.0[end + 1..];
        text
    }

    fn channels(&mut self) {
        assert_eq!([self.text(), self.text(), self.text()], ["R", "G", "B"]);
    }
}

/// Reads and applies one packet; returns `None` if the connection is closed.
fn follow(stream: &mut TcpStream, shown: &mut Option<Shown>) -> Option<()> {
    let mut length = [0; 4];
    stream.read_exact(&mut length).ok()?;
    let mut bytes = vec![0; u32::from_le_bytes(length) as usize - 4];
    stream.read_exact(&mut bytes).expect("the whole packet comes");
    let mut packet = Packet(&bytes);
    let [about, grabs_focus] = packet.bytes();
    let name = packet.text();
    match about {
        4 => {
            assert!(shown.is_none() && grabs_focus == 1, "one image, that is looked at");
            let [width, height, channels] = [packet.whole(), packet.whole(), packet.whole()];
            assert_eq!(channels, 3);
            packet.channels();
            *shown = Some(Shown { name, width, height, bits: vec![1; 3 * width * height] });
        }
        6 => {
            let shown = shown.as_mut().expect("there is an image");
            assert_eq!((grabs_focus, &name), (0, &shown.name));
            assert_eq!(packet.whole(), 3);
            packet.channels();
            let [x, y, width, height] = [(); 4].map(|()| packet.whole());
            assert!(x == 0 && width == shown.width && y + height <= shown.height && height > 0);
            let layout = [(); 6].map(|()| i64::from_le_bytes(packet.bytes()));
            assert_eq!(layout, [0, 1, 2, 3, 3, 3]);
            for bits in &mut shown.bits[3 * y * width..][..3 * height * width] {
                *bits = u32::from_le_bytes(packet.bytes());
            }
        }
        _ => panic!("packets of the kind {about} are not sent"),
    }
    assert!(packet.0.is_empty(), "the packet has a tail of {} bytes", packet.0.len());
    Some(())
}

/// Accepts a connection like a viewer, and sends a message for every packet. The thread returns the
/// image shown at the end.
fn listen() -> (String, Receiver<()>, std::thread::JoinHandle<Shown>) {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("an address").to_string();
    let (received, packets) = channel();
    let viewer = std::thread::spawn(move || {
        let (mut stream, _) = listener.accept().expect("the program connects");
        let mut shown = None;
        while follow(&mut stream, &mut shown).is_some() {
            // The test may have dropped the receiver.
            let _ = received.send(());
        }
        shown.expect("an image was shown")
    });
    (address, packets, viewer)
}

fn is_as_written(shown: &Shown, folder: &Folder, name: &str) {
    let image = folder.image(name);
    let wanted: Vec<_> = image.pixels.as_flattened().iter().map(|v| v.to_bits()).collect();
    let size = (image.width as usize, image.height as usize);
    assert_eq!((shown.width, shown.height, shown.name.as_str()), (size.0, size.1, name));
    assert!(shown.bits == wanted, "the viewer shows another image than the file has");
}

/// 70 rows are sent in two packets.
#[test]
fn the_last_picture_is_the_image_to_the_bit() {
    let folder = Folder::new();
    let (address, _packets, viewer) = listen();
    let run = folder.succeed(&format!("-r 30 70 -s 3 --tev {address} -f out.exr SCENE"));
    assert!(!run.err.contains("warning"), "{run:?}");
    is_as_written(&viewer.join().expect("all packets are right"), &folder, "out.exr");
}

/// A render that would take days is stopped after the viewer has received updates.
#[test]
#[cfg(unix)]
fn the_image_is_shown_while_it_is_rendered() {
    let folder = Folder::new();
    let (address, packets, viewer) = listen();
    let args = ["-r", "16", "12", "-s", "100000000", "--tev", &address, "-f", "out.exr", SCENE];
    let child =
        folder.command(&args).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    // Creation of the image, its initial state, and two updates.
    for _ in 0..4 {
        packets.recv_timeout(Duration::from_mins(1)).expect("pictures come");
    }
    let kill = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(kill.success());
    let run = Run::of(&child.wait_with_output().unwrap(), "");
    assert_eq!(run.code, Some(130), "{run:?}");
    is_as_written(&viewer.join().expect("all packets are right"), &folder, "out.exr");
}

#[test]
fn a_viewer_that_is_not_there_or_goes_away_stops_nothing() {
    let folder = Folder::new();
    let wanted = folder.exr(&format!("{TINY} SCENE"));
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("an address");
    let gone = std::thread::spawn(move || drop(listener.accept().expect("the program connects")));
    let run = folder.succeed(&format!("-r 200 150 -s 40 --tev {address} -f big.exr SCENE"));
    gone.join().expect("it came");
    assert_eq!(run.err.matches(" the viewer at ").count(), 1, "{run:?}");
    // No viewer listens at this address any more.
    let run = folder.succeed(&format!("{TINY} --receipt none --tev {address} -f out.exr SCENE"));
    assert_eq!(run.err.matches("warning: --tev").count(), 1, "{run:?}");
    assert!(run.err.contains("the render continues without it"), "{run:?}");
    assert_eq!(folder.read("out.exr"), wanted);
}
