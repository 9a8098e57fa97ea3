//! Client of the viewer tev, which shows the image while it is rendered.
//!
//! tev receives packets: their length in bytes including the length itself, in four bytes; their
//! type, in one byte; and their content. Numbers are little-endian, texts end with a NUL.
//! [Müller, "tev", include/tev/Ipc.h]

use std::io::{self, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, channel, sync_channel};
use std::time::{Duration, Instant};

use pathtracer::image::Image;

/// Time between two images.
pub(crate) const EVERY: Duration = Duration::from_secs(1);

/// Timeout of connecting to a viewer, and of sending a packet.
const PATIENCE: Duration = Duration::from_secs(5);

/// Number of rows per packet; a packet is sent if one of its rows has changed.
const ROWS: usize = 64;

/// Types of packets.
const CREATE_IMAGE: u8 = 4;
const UPDATE_IMAGE: u8 = 6; // its third version

/// Connection to a viewer. A separate thread sends the images: a slow viewer misses some, and does
/// not delay the render.
pub(crate) struct Viewer {
    address: String,
    pictures: SyncSender<Image>,
    /// Receives the result of the thread once, when it ends.
    end: Receiver<io::Result<()>>,
    gone: bool,
}

impl Viewer {
    /// Connects to a viewer at HOST:PORT, which shows the image under this name.
    ///
    /// # Errors
    /// A warning if no viewer accepts the connection.
    pub(crate) fn connect(address: &str, name: &str) -> Result<Self, String> {
        let stream = connect(address).map_err(|error| {
            format!(
                "--tev {address}: no viewer responds ({error}); start tev first, which listens at \
                 127.0.0.1:14158; the render continues without it"
            )
        })?;
        let (pictures, to_send) = sync_channel(1);
        let (ended, end) = channel();
        let name = name.to_owned();
        std::thread::spawn(move || {
            // The receiver is dropped if the render has ended without waiting.
            let _ = ended.send(send_all(stream, &name, &to_send));
        });
        Ok(Self { address: address.to_owned(), pictures, end, gone: false })
    }

    /// Queues an image, unless the previous one is still waiting. Returns a warning, once, if the
    /// connection was closed.
    pub(crate) fn show(&mut self, picture: Image) -> Option<String> {
        if self.gone
            || !matches!(self.pictures.try_send(picture), Err(TrySendError::Disconnected(_)))
        {
            return None;
        }
        self.gone = true;
        let error = match self.end.recv_timeout(PATIENCE) {
            Ok(Err(error)) => error.to_string(),
            _ => "it accepts no more data".to_owned(),
        };
        Some(format!(
            "lost connection to the viewer at {}: {error}; the image is not shown any more",
            self.address
        ))
    }

    /// Sends the last image, and waits until it is sent. Returns a warning if that fails.
    pub(crate) fn finish(mut self, mut picture: Image) -> Option<String> {
        let deadline = Instant::now() + 2 * PATIENCE;
        while !self.gone && Instant::now() < deadline {
            match self.pictures.try_send(picture) {
                Err(TrySendError::Full(back)) => picture = back,
                Err(TrySendError::Disconnected(back)) => return self.show(back),
                Ok(()) => {
                    drop(self.pictures);
                    let left = deadline.saturating_duration_since(Instant::now());
                    let error = match self.end.recv_timeout(left) {
                        Ok(Ok(())) => return None,
                        Ok(Err(error)) => error.to_string(),
                        Err(_) => "timeout".to_owned(),
                    };
                    return Some(format!(
                        "the viewer at {} did not receive the last image: {error}",
                        self.address
                    ));
                }
            }
            std::thread::sleep(Duration::from_millis(10));
        }
        let is_news = !self.gone;
        is_news.then(|| {
            format!("the viewer at {} did not receive the last image: timeout", self.address)
        })
    }
}

fn connect(address: &str) -> io::Result<TcpStream> {
    let mut error = io::Error::new(io::ErrorKind::NotFound, "unknown host");
    for address in address.to_socket_addrs()? {
        match TcpStream::connect_timeout(&address, PATIENCE) {
            Ok(stream) => {
                stream.set_write_timeout(Some(PATIENCE))?;
                stream.set_nodelay(true)?;
                return Ok(stream);
            }
            Err(reason) => error = reason,
        }
    }
    Err(error)
}

/// Sends images until the channel is closed; of several waiting images only the last.
fn send_all(mut viewer: impl Write, name: &str, pictures: &Receiver<Image>) -> io::Result<()> {
    let mut shown: Option<Image> = None;
    while let Ok(mut picture) = pictures.recv() {
        while let Ok(newer) = pictures.try_recv() {
            picture = newer;
        }
        send(&mut viewer, name, shown.as_ref(), &picture)?;
        shown = Some(picture);
    }
    viewer.flush()
}

/// Sends an image: completely the first time, and then the packets of rows that have changed.
fn send(
    viewer: &mut impl Write,
    name: &str,
    shown: Option<&Image>,
    picture: &Image,
) -> io::Result<()> {
    if shown.is_none() {
        viewer.write_all(&creation(name, picture))?;
    }
    let bits =
        |rows: &[[f32; 3]]| rows.as_flattened().iter().map(|v| v.to_bits()).collect::<Vec<_>>();
    let width = picture.width as usize;
    for (i, rows) in picture.pixels.chunks(ROWS * width).enumerate() {
        let before = shown.map(|s| &s.pixels[i * ROWS * width..][..rows.len()]);
        if before.is_none_or(|before| bits(before) != bits(rows)) {
            viewer.write_all(&update(name, picture.width, i * ROWS, rows))?;
        }
    }
    Ok(())
}

/// Returns the packet that creates an image of this name and size, and selects it in the viewer.
fn creation(name: &str, picture: &Image) -> Vec<u8> {
    let mut packet = begin(CREATE_IMAGE, true, name);
    for number in [picture.width, picture.height, 3] {
        packet.extend(number.to_le_bytes());
    }
    packet.extend(b"R\0G\0B\0");
    end(packet)
}

/// Returns the packet that updates whole rows from `first` on: the channels, the rectangle, the
/// offset of each channel among the numbers and its stride, as 64-bit integers, and the numbers.
fn update(name: &str, width: u32, first: usize, rows: &[[f32; 3]]) -> Vec<u8> {
    let mut packet = begin(UPDATE_IMAGE, false, name);
    packet.extend(3_u32.to_le_bytes());
    packet.extend(b"R\0G\0B\0");
    let height = (rows.len() / width as usize) as u32;
    for number in [0, first as u32, width, height] {
        packet.extend(number.to_le_bytes());
    }
    for number in [0_i64, 1, 2, 3, 3, 3] {
        packet.extend(number.to_le_bytes());
    }
    packet.extend(rows.as_flattened().iter().flat_map(|v| v.to_le_bytes()));
    end(packet)
}

/// Begins a packet, with a placeholder for its length.
fn begin(about: u8, grabs_focus: bool, name: &str) -> Vec<u8> {
    let mut packet = vec![0, 0, 0, 0, about, u8::from(grabs_focus)];
    packet.extend(name.bytes().filter(|byte| *byte != 0));
    packet.push(0);
    packet
}

fn end(mut packet: Vec<u8>) -> Vec<u8> {
    let length = packet.len() as u32;
    packet[..4].copy_from_slice(&length.to_le_bytes());
    packet
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packets_are_those_of_the_protocol() {
        let picture =
            Image { width: 2, height: 1, pixels: vec![[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]].into() };
        let created = creation("a.exr", &picture);
        let wanted =
            [b"\x1e\0\0\0\x04\x01a.exr\0\x02\0\0\0\x01\0\0\0\x03\0\0\0".as_slice(), b"R\0G\0B\0"];
        assert_eq!(created, wanted.concat());
        let updated = update("b", 2, 7, &picture.pixels);
        let mut wanted = b"\x6a\0\0\0\x06\0b\0\x03\0\0\0R\0G\0B\0".to_vec();
        wanted.extend([0_i32, 7, 2, 1].iter().flat_map(|v| v.to_le_bytes()));
        wanted.extend([0_i64, 1, 2, 3, 3, 3].iter().flat_map(|v| v.to_le_bytes()));
        wanted.extend([1.0_f32, 2.0, 3.0, 4.0, 5.0, 6.0].iter().flat_map(|v| v.to_le_bytes()));
        assert_eq!(updated, wanted);
    }

    /// One of 130 rows changes, which are sent in three packets.
    #[test]
    fn only_rows_that_change_are_sent_again() {
        let mut picture = Image { width: 1, height: 130, pixels: vec![[f32::NAN; 3]; 130].into() };
        let sent = |shown: Option<&Image>, picture: &Image| {
            let mut bytes = Vec::new();
            send(&mut bytes, "x", shown, picture).expect("memory takes everything");
            bytes
        };
        let rows = |first: usize, rows: &[[f32; 3]]| update("x", 1, first, rows);
        let before = picture.clone();
        let all = [
            creation("x", &picture),
            rows(0, &picture.pixels[..64]),
            rows(64, &picture.pixels[..64]),
        ];
        assert_eq!(sent(None, &picture), [all.concat(), rows(128, &picture.pixels[..2])].concat());
        assert!(
            sent(Some(&before), &picture).is_empty(),
            "what is no number does not change either"
        );
        picture.pixels[129][2] = 1.0;
        assert_eq!(sent(Some(&before), &picture), rows(128, &picture.pixels[128..]));
    }
}
