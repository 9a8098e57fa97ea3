//! The light of groups of lights in image files.

use exr::prelude::FlatSamples;

use crate::common::Folder;

/// A ball under a lamp, a bulb and a sky.
const LIGHTS: &str = r#"<scene version="3.0.0">
<sensor type="perspective"><transform name="to_world">
<lookat origin="0, 1, 4" target="0, 0, 0" up="0, 1, 0"/></transform></sensor>
<shape type="sphere" id="ball"/>
<shape type="rectangle" id="big lamp"><transform name="to_world"><rotate x="1" angle="90"/>
<translate y="3"/></transform><emitter type="area"><rgb name="radiance" value="3, 0, 0"/></emitter></shape>
<emitter type="point" id="bulb"><rgb name="intensity" value="0, 5, 0"/>
<point name="position" x="2" y="2" z="2"/></emitter>
<emitter type="constant"><rgb name="radiance" value="0, 0, 0.5"/></emitter></scene>"#;

/// The channels of an image that is not made smaller, by their names.
fn channels(folder: &Folder, name: &str) -> Vec<(String, Vec<f64>)> {
    let file = exr::prelude::read_all_flat_layers_from_file(folder.path(name)).expect("it is one");
    let channels = &file.layer_data[0].channel_data.list;
    let values = |samples: &FlatSamples| samples.values_as_f32().map(f64::from).collect();
    channels.iter().map(|c| (c.name.to_string(), values(&c.sample_data))).collect()
}

fn channel(channels: &[(String, Vec<f64>)], name: &str) -> Vec<f64> {
    let found = channels.iter().find(|(n, _)| n == name);
    found.unwrap_or_else(|| panic!("no {name} in {:?}", channels.iter().map(|c| &c.0))).1.clone()
}

/// Lights are red, green and blue, and the ball is grey.
#[test]
fn groups_are_layers_that_add_up_to_the_image() {
    let folder = Folder::new();
    folder.write("scene.xml", LIGHTS);
    let base = "-r 24 18 -s 8 scene.xml -q";
    folder.succeed(&format!("{base} -f plain.exr"));
    let plain = channels(&folder, "plain.exr");
    for (groups, layers) in [
        ("each", ["sky", "bulb", "big_lamp"]),
        ("sky,bulb,each", ["sky", "bulb", "big_lamp"]),
        ("a=bulb,each,b_2=sky", ["b_2", "a", "big_lamp"]),
    ] {
        folder.succeed(&format!("{base} --light-groups {groups} -f groups.exr"));
        let split = channels(&folder, "groups.exr");
        for (c, letter) in ["B", "G", "R"].into_iter().enumerate() {
            let whole = channel(&split, letter);
            assert_eq!(whole, channel(&plain, letter), "{groups}: the image is the same");
            let mut sum = vec![0.0; whole.len()];
            for (i, layer) in layers.into_iter().chain(["rest"]).enumerate() {
                let part = channel(&split, &format!("light_{layer}.{letter}"));
                assert_eq!(part.iter().any(|v| *v > 0.0), i == c, "{layer}.{letter}");
                sum.iter_mut().zip(part).for_each(|(sum, part)| *sum += part);
            }
            let most = whole.iter().zip(sum).map(|(a, b)| (a - b).abs() / (a + 1e-3));
            assert!(most.fold(0.0, f64::max) < 1e-5, "{groups}");
        }
    }
}

#[test]
fn groups_are_the_same_to_the_bit_however_they_come_about() {
    let folder = Folder::new();
    folder.write("scene.xml", LIGHTS);
    let all = "-r 24 18 -s 30 --receipt stable --light-groups key=bulb,each --aov cryptomatte_object scene.xml -q";
    folder.succeed(&format!("{all} -t 1 -f whole.exr"));
    let want = folder.read("whole.exr");
    folder.succeed(&format!("{all} -t 3 --tile-size 7 -f threads.exr"));
    assert!(folder.read("threads.exr") == want);
    for (name, samples) in [("a", "0..7"), ("b", "7..20"), ("c", "20..30")] {
        folder.succeed(&format!("{all} --samples {samples} -f {name}.film"));
    }
    folder.succeed("merge c.film a.film b.film -f merged.exr");
    assert!(folder.read("merged.exr") == want);
    folder.succeed(&format!("{} -f more.exr", all.replace("-s 30", "-s 10")));
    folder.succeed("resume more.exr --spp 30");
    assert!(folder.read("more.exr") == want);
    folder.succeed(&format!("{} -f once.exr", all.replace("--receipt stable", "")));
    folder.succeed("rerender once.exr");
    let other = all.replace("key=bulb,each", "each");
    folder.succeed(&format!("{other} --samples 7..20 -f other.film"));
    let run = folder.run("merge a.film other.film -f wrong.exr");
    assert_eq!(run.code, Some(2), "{run:?}");
    assert!(run.err.contains("light groups: key: bulb; each other light before"), "{run:?}");
}
