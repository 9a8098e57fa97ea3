//! Scenes with media.

use crate::common::{Folder, TINY};

/// A ball of absorbing fog in front of a constant environment, with the integrator of the file.
fn fog(integrator: &str) -> String {
    let medium = "<medium type=\"homogeneous\" name=\"interior\"><float name=\"albedo\" value=\"0\"/>\
                  <float name=\"sigma_t\" value=\"9\"/></medium>";
    let ball = format!("<shape type=\"sphere\"><bsdf type=\"null\"/>{medium}</shape>");
    let sky = "<emitter type=\"constant\"/>";
    let camera = "<sensor type=\"perspective\"><float name=\"fov\" value=\"5\"/><transform \
                  name=\"to_world\"><lookat origin=\"0 0 5\" target=\"0 0 0\" up=\"0 1 0\"/>\
                  </transform></sensor>";
    format!("<scene version=\"3.0.0\">{integrator}{camera}{ball}{sky}</scene>")
}

/// The integrator of the file is used unless the command line names another; an integrator without
/// media prints a note with the one that supports them.
#[test]
fn a_file_chooses_its_integrator() {
    let folder = Folder::new();
    folder.write("volpath.xml", fog("<integrator type=\"volpath\"/>"));
    folder.write("path.xml", fog("<integrator type=\"path\"/>"));
    for (args, is_dark) in [
        ("volpath.xml", true),
        ("path.xml", false),
        ("--integrator path volpath.xml", false),
        ("--integrator volpath path.xml", true),
    ] {
        let run = folder.succeed(&format!("{TINY} -f out.exr {args}"));
        let image = folder.image("out.exr");
        assert_eq!(image.pixels.iter().all(|p| p[0] < 1e-6), is_dark, "{args}: {run:?}");
        let reported = run.err.matches("--integrator volpath renders them").count();
        assert_eq!(reported, usize::from(!is_dark), "{args}: {run:?}");
    }
}

#[test]
fn estimators_that_media_do_not_have_are_refused() {
    let folder = Folder::new();
    folder.write("volpath.xml", fog("<integrator type=\"volpath\"/>"));
    for args in ["-H", "--direct cosine"] {
        let run = folder.run(&format!("{TINY} {args} volpath.xml"));
        assert_eq!(run.code, Some(2), "{run:?}");
        assert!(run.err.contains("--direct mis and --direct light"), "{run:?}");
    }
    folder.succeed(&format!("{TINY} --direct light --clamp 3 volpath.xml"));
}
