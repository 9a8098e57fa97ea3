//! Colours with alpha.

use pt_image::{BitDepth, Precision, SaveOptions, load, load_rgba_raw, save};
use pt_scene::image::Image;

use crate::folder;

/// Premultiplied colours, and files with colours and alpha.
#[test]
fn colours_have_an_opacity_straight_in_png_and_premultiplied_in_exr() {
    let folder = folder();
    let alpha = vec![1.0, 0.5, 0.25, 0.0, 1.25, -0.25];
    let light = [0.5, 0.25, 0.125, 0.75, 0.5, 0.5];
    let pixels = light.map(|v| [v, 0.5 * v, 0.0]).to_vec();
    let image = Image { width: 3, height: 2, pixels: pixels.clone().into() };
    for (png_bits, highest) in [(BitDepth::Eight, 255.0), (BitDepth::Sixteen, 65_535.0)] {
        let path = folder.path().join("a.png");
        let options = SaveOptions { alpha: Some(alpha.clone()), png_bits, ..Default::default() };
        save(&image, &path, &options).unwrap();
        // The stored value of the first three is 0.5 in each, of the fifth 0.4, and 0 where alpha
        // is 0.
        let stored = load_rgba_raw(&path).unwrap();
        let straight = [0.5, 0.5, 0.5, 0.0, 0.4, 0.0].map(|v| [v, 0.5 * v, 0.0]);
        for (got, want) in load(&path).unwrap().pixels.iter().zip(straight) {
            for c in 0..3 {
                // Half a level of the sRGB curve, whose slope is at most 2.3 there.
                assert!((got[c] - want[c]).abs() <= 2.3 * 0.5 / highest + 1e-6, "{got:?} {want:?}");
            }
        }
        let levels = alpha.iter().map(|a: &f32| (a.clamp(0.0, 1.0) * highest).round() / highest);
        assert_eq!(stored.alpha, Some(levels.collect()));
    }
    let path = folder.path().join("a.exr");
    for (exr_type, is_half) in [(Precision::Float, false), (Precision::Half, true)] {
        let options = SaveOptions { alpha: Some(alpha.clone()), exr_type, ..Default::default() };
        save(&image, &path, &options).unwrap();
        let stored = load_rgba_raw(&path).unwrap();
        assert_eq!(stored.image.pixels, pixels);
        assert_eq!(stored.alpha.as_ref(), Some(&alpha));
        let file = exr::prelude::read_all_flat_layers_from_file(&path).unwrap();
        let channels = &file.layer_data[0].channel_data.list;
        let names: Vec<_> = channels.iter().map(|c| c.name.to_string()).collect();
        assert_eq!(names, ["A", "B", "G", "R"]);
        let samples = channels.iter().map(|c| &c.sample_data);
        let halves = samples.filter(|s| matches!(s, exr::prelude::FlatSamples::F16(_))).count();
        assert_eq!(halves, if is_half { 4 } else { 0 });
    }
    let wrong = SaveOptions { alpha: Some(vec![1.0; 5]), ..Default::default() };
    assert!(save(&image, &path, &wrong).unwrap_err().to_string().contains("5 pixels"));
}
