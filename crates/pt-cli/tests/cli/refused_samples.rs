//! Invalid samples are rejected and reported.

use crate::common::Folder;

/// A ball in front of an environment that is too bright for a film; only some pixels show the
/// environment.
const TOO_BRIGHT: &str = r#"<scene version="3.0.0">
    <default name="sky" value="1e30"/>
    <sensor type="perspective">
        <float name="fov" value="40"/>
        <transform name="to_world"><lookat origin="0, 0, 4" target="0, 0, 0" up="0, 1, 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="6"/></film>
    </sensor>
    <emitter type="constant"><rgb name="radiance" value="$sky"/></emitter>
    <shape type="sphere">
        <bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf>
    </shape>
</scene>"#;

#[test]
fn samples_that_are_no_light_are_reported_and_strict_renders_fail() {
    let folder = Folder::new();
    folder.write("bright.xml", TOO_BRIGHT);
    let args = "bright.xml -s 2 -D sky=2e30 -f out.exr --aov refused";
    let run = folder.succeed(args);
    assert!(run.err.contains("samples were refused and count as black"), "{run:?}");
    assert!(run.err.contains("column 0, row 0, sample 0: too large"), "{run:?}");
    let quoted = args.replace("sky=2e30", "'sky=2e30'");
    let again = format!("pathtracer explain {quoted} -x 0 -y 0 --sample 0");
    assert!(run.err.contains(&again), "{run:?}");
    let reported = folder.succeed(&format!("explain {args} -x 0 -y 0 --sample 0")).out;
    assert!(reported.contains("Rejected and counted as black: too large."), "{reported}");
    let reported = folder.succeed(&format!("explain {args} -x 0 -y 0")).out;
    assert!(reported.contains("mean      0 0 0, luminance 0"), "{reported}");
    assert!(reported.contains("samples counted as black: 2 too large"), "{reported}");
    let image = folder.image("out.exr");
    assert!(image.pixels.iter().flatten().all(|&l| l == 0.0), "nothing of them is in the image");
    let run = folder.succeed("info out.exr");
    assert!(run.out.contains("too large"), "{run:?}");

    let run = folder.run(&format!("{args} --strict --restart -q"));
    assert_eq!(run.code, Some(3), "{run:?}");
    assert!(run.err.contains("samples were refused"), "even with -q: {run:?}");
    let run = folder.succeed("bright.xml -s 2 -D sky=2 -f sound.exr --strict");
    assert!(!run.err.contains("refused"), "{run:?}");
}

#[test]
fn the_command_that_is_reported_after_more_samples_has_their_number() {
    let folder = Folder::new();
    folder.write("bright.xml", TOO_BRIGHT);
    let args = "bright.xml -s 2 -D sky=2e30 -f out.exr";
    folder.succeed(args);
    for spp in [4, 6] {
        let run = folder.succeed(&format!("resume out.exr --spp {spp}"));
        let again = format!("pathtracer explain bright.xml -s {spp} -D 'sky=2e30' -f out.exr -x 0");
        assert!(run.err.contains(&again), "{run:?}");
    }
    let run = folder.succeed("info out.exr");
    assert!(run.out.contains("-s 6"), "{run:?}");
    folder.succeed("rerender out.exr");
}
