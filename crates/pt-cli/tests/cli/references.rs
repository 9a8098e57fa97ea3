//! References that form cycles, chains and doublings, in every format: time and memory stay
//! bounded.

use std::fmt::Write;
use std::process::Command;

use crate::common::Folder;

/// Seconds of processor time, and kilobytes of address space, of which threads reserve more than
/// they use.
const LIMITS: &str = "ulimit -t 5; ulimit -v 1500000";

/// Text of a kind of item and its references in a format; `NOW` stands for an item, `PRE` for the
/// one before.
struct Kind {
    ending: &'static str,
    /// Text before all items.
    head: &'static str,
    /// The first item.
    first: &'static str,
    /// Item that refers once to the one before by `PRE`.
    one: &'static str,
    /// Item that refers twice to the one before by `PRE`.
    two: &'static str,
    /// Text after all items, which refers to the last one by `PRE`.
    tail: &'static str,
}

const MITSUBA: Kind = Kind {
    ending: "xml",
    head: "<scene version=\"3.0.0\">",
    first: "<bsdf type=\"diffuse\" id=\"i0\"/>",
    one: "<bsdf type=\"blendbsdf\" id=\"NOW\"><float name=\"weight\" value=\"0.5\"/><ref id=\"PRE\"/><ref id=\"i0\"/></bsdf>",
    two: "<bsdf type=\"blendbsdf\" id=\"NOW\"><float name=\"weight\" value=\"0.5\"/><ref id=\"PRE\"/><ref id=\"PRE\"/></bsdf>",
    tail: "<shape type=\"rectangle\"><ref id=\"PRE\"/></shape></scene>",
};
const PBRT: Kind = Kind {
    ending: "pbrt",
    head: "Camera \"perspective\" WorldBegin\n",
    first: "",
    one: "",
    two: "",
    tail: "Shape \"disk\"\n",
};
const COLLADA_SCENE: &str = "</library_nodes><library_visual_scenes><visual_scene id=\"s\"><node><instance_node url=\"#PRE\"/>\
                             </node></visual_scene></library_visual_scenes><scene><instance_visual_scene url=\"#s\"/></scene></COLLADA>";

/// Items that refer to others of their kind.
const KINDS: &[(&str, Kind)] = &[
    ("mitsuba materials", MITSUBA),
    (
        "mitsuba textures",
        Kind {
            first: "<texture type=\"checkerboard\" id=\"i0\"/>",
            one: "<texture type=\"checkerboard\" id=\"NOW\"><ref name=\"color0\" id=\"PRE\"/></texture>",
            two: "<texture type=\"checkerboard\" id=\"NOW\"><ref name=\"color0\" id=\"PRE\"/><ref name=\"color1\" id=\"PRE\"/></texture>",
            tail: "<shape type=\"rectangle\"><bsdf type=\"diffuse\"><ref name=\"reflectance\" id=\"PRE\"/></bsdf></shape></scene>",
            ..MITSUBA
        },
    ),
    (
        "mitsuba names",
        Kind {
            first: "<default name=\"i0\" value=\"true\"/>",
            one: "<default name=\"NOW\" value=\"$PRE\"/>",
            two: "<default name=\"NOW\" value=\"$PRE$PRE\"/>",
            tail: "<shape type=\"rectangle\"><boolean name=\"flip_normals\" value=\"$PRE\"/></shape></scene>",
            ..MITSUBA
        },
    ),
    (
        "mitsuba groups",
        Kind {
            first: "<shape type=\"shapegroup\" id=\"i0\"><shape type=\"rectangle\"/></shape>",
            one: "<shape type=\"shapegroup\" id=\"NOW\"><shape type=\"instance\"><ref id=\"PRE\"/></shape></shape>",
            two: "<shape type=\"shapegroup\" id=\"NOW\"><shape type=\"instance\"><ref id=\"PRE\"/></shape>\
                  <shape type=\"instance\"><ref id=\"PRE\"/></shape></shape>",
            tail: "<shape type=\"instance\"><ref id=\"PRE\"/></shape></scene>",
            ..MITSUBA
        },
    ),
    (
        "pbrt textures",
        Kind {
            first: "Texture \"i0\" \"float\" \"constant\" \"float value\" 0.5\n",
            one: "Texture \"NOW\" \"float\" \"scale\" \"texture tex\" \"PRE\" \"float scale\" 0.9\n",
            two: "Texture \"NOW\" \"float\" \"mix\" \"texture tex1\" \"PRE\" \"texture tex2\" \"PRE\"\n",
            tail: "Material \"dielectric\" \"texture roughness\" \"PRE\"\nShape \"disk\"\n",
            ..PBRT
        },
    ),
    (
        "pbrt materials",
        Kind {
            first: "MakeNamedMaterial \"i0\" \"string type\" \"diffuse\"\n",
            one: "MakeNamedMaterial \"NOW\" \"string type\" \"mix\" \"string materials\" [\"PRE\" \"i0\"] \"float amount\" 0.5\n",
            two: "MakeNamedMaterial \"NOW\" \"string type\" \"mix\" \"string materials\" [\"PRE\" \"PRE\"] \"float amount\" 0.5\n",
            tail: "NamedMaterial \"PRE\"\nShape \"disk\"\n",
            ..PBRT
        },
    ),
    (
        "pbrt objects",
        Kind {
            first: "ObjectBegin \"i0\" Shape \"disk\" ObjectEnd\n",
            one: "ObjectBegin \"NOW\" ObjectInstance \"PRE\" ObjectEnd\n",
            two: "ObjectBegin \"NOW\" ObjectInstance \"PRE\" ObjectInstance \"PRE\" ObjectEnd\n",
            tail: "ObjectInstance \"PRE\"\n",
            ..PBRT
        },
    ),
    (
        "COLLADA nodes",
        Kind {
            ending: "dae",
            head: "<COLLADA xmlns=\"http://www.collada.org/2005/11/COLLADASchema\" version=\"1.4.1\"><library_nodes>",
            first: "<node id=\"i0\"/>",
            one: "<node id=\"NOW\"><instance_node url=\"#PRE\"/></node>",
            two: "<node id=\"NOW\"><instance_node url=\"#PRE\"/><instance_node url=\"#PRE\"/></node>",
            tail: COLLADA_SCENE,
        },
    ),
    (
        "JSON materials",
        Kind {
            ending: "json",
            head: "{\"pathtracer\": 1, \"materials\": {",
            first: "\"i0\": {\"type\": \"matte\"}",
            one: ", \"NOW\": {\"type\": \"mix\", \"first\": \"PRE\", \"second\": \"i0\"}",
            two: ", \"NOW\": {\"type\": \"mix\", \"first\": \"PRE\", \"second\": \"PRE\"}",
            tail: "}, \"objects\": [{\"type\": \"sphere\", \"material\": \"PRE\"}]}",
        },
    ),
    (
        "JSON textures",
        Kind {
            ending: "json",
            head: "{\"pathtracer\": 1, \"textures\": {",
            first: "\"i0\": {\"type\": \"checkerboard\", \"colors\": [0.2, 0.8]}",
            one: ", \"NOW\": {\"type\": \"product\", \"factors\": [\"PRE\", 0.5]}",
            two: ", \"NOW\": {\"type\": \"product\", \"factors\": [\"PRE\", \"PRE\"]}",
            tail: "}, \"materials\": {\"m\": {\"type\": \"matte\", \"reflectance\": \"PRE\"}}, \
                   \"objects\": [{\"type\": \"sphere\", \"material\": \"m\"}]}",
        },
    ),
    (
        "glTF nodes",
        Kind {
            ending: "gltf",
            head: "{\"asset\": {\"version\": \"2.0\"}, \"nodes\": [",
            first: "{}",
            one: ", {\"children\": [#PRE]}",
            two: ", {\"children\": [#PRE, #PRE]}",
            tail: "], \"scenes\": [{\"nodes\": [#PRE]}]}",
        },
    ),
];

impl Kind {
    /// Returns a file with `length` items after the first, each of which refers to the one before.
    fn chain(&self, length: usize, item: &str) -> String {
        let mut text = self.head.to_owned() + self.first;
        for i in 1..=length {
            text += &referring(item, i, i - 1);
        }
        text + &referring(self.tail, 0, length)
    }

    /// Returns a file whose items form a cycle of the given length.
    fn cycle(&self, length: usize) -> String {
        let mut text = self.head.to_owned() + self.first;
        for i in 1..=length {
            text += &referring(self.one, i, if i == 1 { length } else { i - 1 });
        }
        text + &referring(self.tail, 0, length)
    }
}

/// Inserts the number of an item, and that of the item it refers to; references of COLLADA and glTF
/// follow a `#`.
fn referring(item: &str, now: usize, before: usize) -> String {
    let is_list = item.contains("#PRE") && !item.contains("url");
    let before = if is_list { before.to_string() } else { format!("i{before}") };
    let item = if is_list { item.replace("#PRE", "PRE") } else { item.to_owned() };
    item.replace("NOW", &format!("i{now}")).replace("PRE", &before)
}

/// Runs the program within limits; panics if it does not exit normally.
fn bounded(folder: &Folder, what: &str, arguments: &str) {
    let command = folder.command::<&str>(&[]);
    let program = command.get_program();
    let mut shell = Command::new("sh");
    for (name, value) in command.get_envs() {
        value.map(|value| shell.env(name, value));
    }
    shell.args(["-c", &format!("{LIMITS}; exec \"$0\" {arguments}")]).arg(program);
    let done = shell.current_dir(folder.path(".")).output().expect("a shell");
    let messages = String::from_utf8_lossy(&done.stderr).into_owned();
    assert!(
        matches!(done.status.code(), Some(0 | 1 | 2 | 4)),
        "{what}, {arguments}: {:?} {messages:.300}",
        done.status
    );
    assert!(!messages.contains("please report"), "{what}, {arguments}: {messages:.300}");
}

#[test]
fn chains_are_read_in_bounded_time_and_memory() {
    let folder = Folder::new();
    for (name, kind) in KINDS {
        // Short chains are valid if the format allows nesting of this kind.
        folder.write(&format!("a.{}", kind.ending), kind.chain(3, kind.one));
        let run = folder.run(&format!("check a.{}", kind.ending));
        let is_refused =
            ["JSON materials", "mitsuba groups", "mitsuba textures", "pbrt objects"].contains(name);
        assert_eq!(run.code == Some(2), is_refused, "{name}: {run:?}");
        for length in [100, 1000, 10_000, 100_000] {
            folder.write(&format!("a.{}", kind.ending), kind.chain(length, kind.one));
            bounded(
                &folder,
                &format!("{name}, {length} long"),
                &format!("check a.{}", kind.ending),
            );
        }
    }
}

#[test]
fn doublings_and_cycles_are_read_in_bounded_time_and_memory() {
    let folder = Folder::new();
    for (name, kind) in KINDS {
        let ending = kind.ending;
        // The scene of this film is then replaced.
        folder.write(&format!("a.{ending}"), kind.chain(0, kind.one));
        let run = folder.run(&format!("-r 4 4 -s 1 -f film.exr a.{ending} --restart"));
        assert!(matches!(run.code, Some(0 | 1)), "{name}: {run:?}");
        for (shape, text) in [
            ("doubled 40 times", kind.chain(40, kind.two)),
            ("itself", kind.cycle(1)),
            ("a circle of two", kind.cycle(2)),
            ("a circle of 1000", kind.cycle(1000)),
        ] {
            folder.write(&format!("a.{ending}"), text);
            for command in [
                format!("check a.{ending}"),
                format!("info a.{ending}"),
                format!("convert a.{ending} b.glb --force"),
                format!("explain a.{ending} -r 4 4 -s 1 -x 0 -y 0"),
                format!("-r 4 4 -s 1 -f a.png a.{ending}"),
                "resume film.exr -s 2".to_owned(),
                "rerender film.exr -f again.exr --force".to_owned(),
            ] {
                bounded(&folder, &format!("{name}, {shape}"), &command);
            }
        }
    }
}

/// Files that include each other twice, and themselves.
#[test]
fn inclusions_are_bounded() {
    let folder = Folder::new();
    for (ending, head, include, tail) in [
        ("xml", "<scene version=\"3.0.0\">", "<include filename=\"FILE\"/>", "</scene>"),
        ("pbrt", "", "Include \"FILE\"\n", ""),
    ] {
        let file = |i: usize| format!("f{i}.{ending}");
        for i in 0..40 {
            let twice = include.replace("FILE", &file(i + 1)).repeat(2);
            folder.write(&file(i), format!("{head}{twice}{tail}"));
        }
        folder.write(&file(40), format!("{head}{tail}"));
        let own = include.replace("FILE", &format!("own.{ending}"));
        folder.write(&format!("own.{ending}"), format!("{head}{own}{tail}"));
        for name in [file(0), format!("own.{ending}")] {
            bounded(&folder, "inclusions", &format!("check {name}"));
        }
    }
}

/// Nested elements: recursive readers have a limit.
#[test]
fn nesting_is_bounded() {
    let folder = Folder::new();
    for (ending, before, open, inner, close, after) in [
        ("xml", "<scene version=\"3.0.0\">", "<bsdf type=\"twosided\">", "", "</bsdf>", "</scene>"),
        (
            "pbrt",
            "Camera \"perspective\" WorldBegin\n",
            "AttributeBegin\n",
            "",
            "AttributeEnd\n",
            "",
        ),
        ("dae", "<COLLADA version=\"1.4.1\">", "<node>", "", "</node>", "</COLLADA>"),
        ("json", "{\"pathtracer\": 1, \"objects\": ", "[", "", "]", "}"),
        ("gltf", "{\"asset\": ", "[", "", "]", "}"),
    ] {
        for depth in [100, 10_000, 100_000] {
            let mut text = before.to_owned();
            let _ = write!(text, "{}{inner}{}{after}", open.repeat(depth), close.repeat(depth));
            folder.write(&format!("n.{ending}"), text);
            bounded(&folder, &format!("{depth} deep"), &format!("check n.{ending}"));
        }
    }
}

/// Small files that expand to much data: zeros, copies and morph targets without data of their own.
#[test]
fn what_is_repeated_is_bounded() {
    let folder = Folder::new();
    let zeros = r#"{"componentType": 5126, "count": 4000000, "type": "VEC3"}"#;
    let primitive = r#"{"attributes": {"POSITION": 0}}"#;
    let morphed = format!(
        r#"{{"attributes": {{"POSITION": 0}}, "targets": [{}]}}"#,
        vec![r#"{"POSITION": 0}"#; 10_000].join(", ")
    );
    for (what, primitives) in
        [("primitives", vec![primitive; 1000].join(", ")), ("targets", morphed)]
    {
        let weights = vec!["0.5"; 10_000].join(", ");
        folder.write(
            "a.gltf",
            format!(
                r#"{{"asset": {{"version": "2.0"}}, "accessors": [{zeros}], "nodes": [{{"mesh": 0}}],
                    "meshes": [{{"primitives": [{primitives}], "weights": [{weights}]}}]}}"#
            ),
        );
        bounded(&folder, what, "check a.gltf");
    }
}
