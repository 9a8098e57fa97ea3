//! Texts (metadata) in image files.

use std::fs;
use std::io::Cursor;

use pt_image::{CODECS, ImageError, SaveOptions, save};

use crate::{folder, picture};

pub(crate) fn texts() -> Vec<(String, String)> {
    let pairs = [("scene", "Cornell box"), ("spp", "64"), ("seed", "7"), ("note", "höher ≥ 3 ☀")];
    pairs.map(|(k, v)| (k.to_owned(), v.to_owned())).to_vec()
}

#[test]
fn metadata_are_in_the_files() {
    let folder = folder();
    let options = SaveOptions { metadata: texts(), ..Default::default() };
    let path = folder.path().join("a.png");
    save(&picture(4, 3), &path, &options).unwrap();
    let reader = png::Decoder::new(Cursor::new(fs::read(&path).unwrap())).read_info().unwrap();
    let info = reader.info();
    let plain: Vec<_> =
        info.uncompressed_latin1_text.iter().map(|t| (&t.keyword, &t.text)).collect();
    let expected: Vec<_> = options.metadata[..3].iter().map(|(k, v)| (k, v)).collect();
    assert_eq!(plain, expected);
    assert_eq!(info.utf8_text[0].get_text().unwrap(), options.metadata[3].1);

    let path = folder.path().join("a.exr");
    save(&picture(4, 3), &path, &options).unwrap();
    let meta = exr::meta::MetaData::read_from_file(&path, true).unwrap();
    let header = &meta.headers[0];
    for (key, value) in &options.metadata {
        let name = exr::meta::attribute::Text::from_slice_unchecked(key.as_bytes());
        let found = header.own_attributes.other[&name].to_text().unwrap();
        assert_eq!(found.as_slice(), value.as_bytes());
    }
    assert!(header.shared_attributes.chromaticities.is_some());
}

#[test]
fn metadata_are_read_as_they_were_written() {
    let folder = folder();
    let options = SaveOptions { metadata: texts(), ..Default::default() };
    let mut want = options.metadata.clone();
    want.sort();
    for codec in CODECS.iter().filter(|codec| codec.write.is_some()) {
        let path = folder.path().join("a").with_extension(codec.extensions[0]);
        save(&picture(4, 3), &path, &options).unwrap();
        let mut found = pt_image::metadata(&path).unwrap();
        found.sort();
        assert_eq!(found, want, "{}", codec.name);
        let whole = fs::read(&path).unwrap();
        for end in 0..whole.len() {
            fs::write(&path, &whole[..end]).unwrap();
            // Some truncated files still contain all texts; the others are an error.
            let _ = pt_image::metadata(&path);
        }
    }
    assert!(pt_image::metadata(&folder.path().join("a.hdr")).is_err());
}

#[test]
fn same_image_gives_the_same_bytes() {
    let folder = folder();
    let metadata = (0..40).map(|i| (format!("key{i}"), i.to_string())).collect();
    let options = SaveOptions { metadata, ..Default::default() };
    let writers = CODECS.iter().filter(|codec| codec.write.is_some());
    for extension in writers.flat_map(|codec| codec.extensions) {
        let write = |name: &str| {
            let path = folder.path().join(name).with_extension(extension);
            save(&picture(20, 40), &path, &options).unwrap();
            fs::read(path).unwrap()
        };
        assert_eq!(write("first"), write("second"), "{extension}");
    }
}

#[test]
fn metadata_that_do_not_fit_are_refused() {
    let folder = folder();
    for (extension, key) in
        [("png", ""), ("png", "☀"), ("png", "a\nb"), ("exr", ""), ("exr", "a\0")]
    {
        let path = folder.path().join("a").with_extension(extension);
        let metadata = vec![(key.to_owned(), "x".to_owned())];
        let error = save(&picture(2, 2), &path, &SaveOptions { metadata, ..Default::default() });
        assert!(matches!(error, Err(ImageError::Refused { .. })), "{extension} {key:?}");
        assert!(!path.exists());
    }
}
