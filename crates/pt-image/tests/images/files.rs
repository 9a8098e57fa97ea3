//! Image files with all channels and texts.

use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Layer, LayerAttributes, SmallVec, Text,
    WritableImage,
};
use pt_image::{Compression, ImageFile, Precision, SaveOptions, load_file, save};
use pt_scene::image::{Channel, Samples};

use crate::{folder, picture};

/// An EXR file that is written again as it was read has the same bytes.
#[test]
fn exr_files_are_written_again_as_they_were_read() {
    let folder = folder();
    let channel =
        |name: &str, samples, half_suffices| Channel { name: name.into(), samples, half_suffices };
    for (exr_type, exr_compression) in
        [(Precision::Float, Compression::Piz), (Precision::Half, Compression::Zips)]
    {
        let options = SaveOptions {
            exr_type,
            exr_compression,
            alpha: Some((0..12).map(|i| i as f32 / 16.0).collect()),
            channels: vec![
                channel("noisy.R", Samples::Real(vec![0.25; 12]), true),
                channel("depth.Z", Samples::Real(vec![1e9; 12]), false),
                channel("object.id", Samples::Whole((0..12).collect()), false),
            ],
            metadata: vec![("Software".into(), "x".into()), ("author".into(), "Ω".into())],
            ..SaveOptions::default()
        };
        let (first, second) = (folder.path().join("a.exr"), folder.path().join("b.exr"));
        save(&picture(4, 3), &first, &options).expect("it is written");
        let ImageFile { image, options: read, frame } = load_file(&first).expect("it is read");
        assert_eq!((frame, read.metadata.len(), read.channels.len()), (None, 2, 3));
        save(&image, &second, &read).expect("it is written again");
        let [first, second] = [first, second].map(|path| std::fs::read(path).expect("a file"));
        assert!(first == second, "{exr_type:?}");
    }
}

/// Parts with the data window of the colours are layers with their names; others are left out.
#[test]
fn parts_of_exr_files_are_layers() {
    let part = |name: Option<&str>, size: (usize, usize), channels: &[&str], value: f32| {
        let plane =
            |name: &&str| AnyChannel::new(*name, FlatSamples::F32(vec![value; size.0 * size.1]));
        let attributes =
            LayerAttributes { layer_name: name.map(Text::from), ..LayerAttributes::default() };
        let channels = AnyChannels::sort(channels.iter().map(plane).collect());
        Layer::new(size, attributes, Encoding::UNCOMPRESSED, channels)
    };
    let parts = [
        part(Some("beauty"), (2, 1), &["R", "G", "B"], 1.0),
        part(Some("depth"), (2, 1), &["Z"], 2.0),
        part(Some("id"), (2, 1), &["id.X"], 3.0),
        part(Some("small"), (1, 1), &["Y"], 4.0),
    ];
    let window = exr::prelude::IntegerBounds::from_dimensions((2, 1));
    let attributes = exr::prelude::ImageAttributes::new(window);
    let file =
        exr::image::Image::from_layers(attributes, parts.into_iter().collect::<SmallVec<_>>());
    let folder = folder();
    let path = folder.path().join("a.exr");
    file.write().non_parallel().to_file(&path).expect("it is written");
    let read = load_file(&path).expect("it is read");
    assert_eq!(read.image.pixels, [[1.0; 3]; 2]);
    let found: Vec<_> =
        read.options.channels.iter().map(|c| (c.name.as_str(), &c.samples)).collect();
    let (depth, id) = (Samples::Real(vec![2.0; 2]), Samples::Real(vec![3.0; 2]));
    assert_eq!(found, [("depth.Z", &depth), ("id.X", &id)]);
}

/// Colours of PNG files are straight, those of a read file premultiplied.
#[test]
fn colours_are_premultiplied() {
    let folder = folder();
    let path = folder.path().join("a.png");
    let alpha = vec![0.0, 1.0, 0.2, 0.6];
    let image = picture(2, 2);
    let options = SaveOptions { alpha: Some(alpha.clone()), ..SaveOptions::default() };
    let pixels = image.pixels.iter().zip(&alpha).map(|(p, a)| p.map(|v| v.min(1.0) * a));
    let premultiplied = pt_scene::image::Image { pixels: pixels.collect(), ..image };
    save(&premultiplied, &path, &options).expect("it is written");
    let read = load_file(&path).expect("it is read");
    assert_eq!(read.options.alpha, Some(alpha));
    for (found, expected) in read.image.pixels.iter().zip(&premultiplied.pixels) {
        let near = found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 0.005);
        assert!(near, "{found:?}, expected {expected:?}");
    }
}
