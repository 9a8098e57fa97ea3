//! Light groups in image files.

use exr::prelude::FlatSamples;

use crate::common::Folder;

/// Ball under a lamp, a bulb and a constant environment.
const LIGHTS: &str = r#"<scene version="3.0.0">
<sensor type="perspective"><transform name="to_world">
<lookat origin="0, 1, 4" target="0, 0, 0" up="0, 1, 0"/></transform></sensor>
<shape type="sphere" id="ball"/>
<shape type="rectangle" id="big lamp"><transform name="to_world"><rotate x="1" angle="90"/>
<translate y="3"/></transform><emitter type="area"><rgb name="radiance" value="3, 0, 0"/></emitter></shape>
<emitter type="point" id="bulb"><rgb name="intensity" value="0, 5, 0"/>
<point name="position" x="2" y="2" z="2"/></emitter>
<emitter type="constant"><rgb name="radiance" value="0, 0, 0.5"/></emitter></scene>"#;

/// Channels of an image, by their names.
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
    for (samples, groups, layers) in [
        ("-s 8", "each", ["sky", "bulb", "big_lamp"]),
        ("-s 8", "sky,bulb,each", ["sky", "bulb", "big_lamp"]),
        ("-s 64 -a 8 0.2", "a=bulb,each,b_2=sky", ["b_2", "a", "big_lamp"]),
        ("-s 7 --aov half_a,half_b", "each", ["sky", "bulb", "big_lamp"]),
        ("--target-error 6%", "each", ["sky", "bulb", "big_lamp"]),
    ] {
        let base = format!("-r 24 18 {samples} scene.xml -q");
        folder.succeed(&format!("{base} -f plain.exr"));
        let plain = channels(&folder, "plain.exr");
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

/// Names that are long, that equal names of other layers, or that differ only in characters that
/// layer names cannot contain.
#[test]
fn layers_have_names_of_their_own_whatever_lights_are_called() {
    let folder = Folder::new();
    let long = "a lamp of the hall that hangs above the third table to the left".to_owned();
    let names = [long.as_str(), "rest", "a b", "a_b", "ü", "R"];
    let bulb = |name: &str| {
        let position = "<point name=\"position\" y=\"2\"/>";
        format!("<emitter type=\"point\" id=\"{name}\">{position}</emitter>\n")
    };
    let bulbs: String = names.into_iter().map(bulb).collect();
    let sky = "<emitter type=\"constant\">";
    folder.write("scene.xml", LIGHTS.replace(sky, &format!("{bulbs}{sky}")));
    folder.succeed("-r 8 6 -s 1 scene.xml -q --light-groups each --aov half_a -f out.exr");
    let channels = channels(&folder, "out.exr");
    let layer = |name: &str| channel(&channels, &format!("light_{name}.R"));
    for name in [&long.replace(' ', "_"), "rest_2", "a_b", "a_b_2", "_", "R"] {
        assert!(layer(name).iter().any(|v| *v > 0.0), "{name}");
    }
    assert!(layer("rest").iter().all(|v| *v == 0.0));
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
    for samples in ["-s 30", "-s 64 -a 8 0.2", "--target-error 6%"] {
        let args = all.replace("-s 30", samples).replace("--receipt stable", "").replace("-q", "");
        folder.succeed(&format!("{args} -f once.exr"));
        let again = folder.succeed("rerender once.exr -t 3 --force");
        assert!(again.err.contains("is the same to the bit"), "{samples}: {again:?}");
    }
    let other = all.replace("key=bulb,each", "each");
    folder.succeed(&format!("{other} --samples 7..20 -f other.film"));
    let run = folder.run("merge a.film other.film -f wrong.exr");
    assert_eq!(run.code, Some(2), "{run:?}");
    assert!(run.err.contains("light groups: key: bulb; each other light before"), "{run:?}");
}
