//! Every plugin of Mitsuba is supported, or rejected with a reason.

use pt_formats::parse;

use crate::folder;

/// Plugins that are rejected, for the reasons in docs/formats.md.
const REFUSED: [(&str, &str); 7] = [
    ("bsdf", "measured_polarized"),
    ("emitter", "directionalarea"),
    ("film", "specfilm"),
    ("integrator", "depth"),
    ("integrator", "stokes"),
    ("integrator", "volprim_rf_basic"),
    ("shape", "blender"),
];

/// A scene that uses an object without any parameters.
fn scene(tag: &str, kind: &str) -> String {
    let object = format!("<{tag} type=\"{kind}\"/>");
    let used = match tag {
        "bsdf" => format!("<shape type=\"cube\">{object}</shape>"),
        "emitter" if kind == "area" => format!("<shape type=\"cube\">{object}</shape>"),
        "film" | "sampler" => format!("<sensor type=\"perspective\">{object}</sensor>"),
        "rfilter" => {
            format!("<sensor type=\"perspective\"><film type=\"hdrfilm\">{object}</film></sensor>")
        }
        "texture" => format!(
            "<shape type=\"cube\"><bsdf type=\"diffuse\"><texture name=\"reflectance\" type=\"{kind}\"/></bsdf>\
             </shape>"
        ),
        "medium" | "phase" | "volume" => {
            let inside = match tag {
                "phase" => object,
                "volume" => format!("<volume name=\"sigma_t\" type=\"{kind}\"/>"),
                _ => String::new(),
            };
            let medium = if tag == "medium" { kind } else { "heterogeneous" };
            format!(
                "<shape type=\"cube\"><medium name=\"interior\" type=\"{medium}\">{inside}</medium></shape>"
            )
        }
        _ => object,
    };
    format!("<scene version=\"3.0.0\">{used}</scene>")
}

/// Returns the error of an object, if it is not accepted as it is.
fn refusal(tag: &str, kind: &str) -> Option<String> {
    let path = folder("mitsuba").join("good").join("test.xml");
    parse(scene(tag, kind).as_bytes(), &path).err().map(|error| error.to_string())
}

fn plugins() -> Vec<(String, String)> {
    let text = include_str!("../../../../scenes/mitsuba/plugins.txt");
    let rows = text.lines().filter(|line| !line.starts_with('#'));
    let pair = |line: &str| {
        let (tag, kind) = line.split_once(' ').expect("an element and a type");
        (tag.to_owned(), kind.to_owned())
    };
    rows.map(pair).collect()
}

#[test]
fn every_plugin_is_read_or_refused_with_a_reason() {
    let plugins = plugins();
    assert!(plugins.len() >= 100, "{}", plugins.len());
    for (tag, kind) in &plugins {
        let message = refusal(tag, kind).unwrap_or_default();
        let is_refused = REFUSED.contains(&(tag.as_str(), kind.as_str()));
        let unsupported = format!("unsupported {tag} type \"{kind}\"");
        if is_refused {
            assert!(message.contains(&format!("{unsupported}: ")), "{tag} {kind}: {message}");
        } else {
            // Plugins with required parameters name them.
            assert!(!message.contains(&unsupported), "{tag} {kind}: {message}");
        }
    }
    for (tag, kind) in REFUSED {
        assert!(plugins.iter().any(|(t, k)| (t.as_str(), k.as_str()) == (tag, kind)), "{kind}");
    }
}

/// A type that does not exist is not reported as a rejected plugin.
#[test]
fn what_is_no_plugin_is_said_to_be_unknown() {
    let message = refusal("bsdf", "diffus").expect("it is unknown");
    assert!(message.contains("did you mean \"diffuse\""), "{message}");
}
