//! Help, version, completions and the man page.

use crate::common::Folder;

#[test]
fn former_names_of_options_are_aliases() {
    let folder = Folder::new();
    for (former, current) in [
        ("--cell 1 1 3 2", "--crop 1 1 3 2"),
        ("--split 2", "--path-splitting 2"),
        ("--show direct", "--light-component direct"),
        ("--quality fast", "--bvh-quality fast"),
        ("-m 2 -o 0", "-m 2 --exact-depth"),
        (
            "--target-error 50% --max-spp 8 --uniform",
            "--target-error 50% --max-spp 8 --uniform-sampling",
        ),
    ] {
        let [a, b] = [former, current].map(|options| {
            let spp = if options.contains("--target-error") { "" } else { "-s 2" };
            folder.exr(&format!("{options} -r 8 6 {spp} SCENE"))
        });
        assert!(a == b, "{former} and {current} differ");
    }
    // `--receipt` is used by all of these tests; see [`Folder::exr`].
    folder.succeed("-r 8 6 -s 1 --metadata none -f a.exr SCENE");
    assert_eq!(folder.read("a.exr"), folder.exr("-r 8 6 -s 1 SCENE"));
}

#[test]
fn help_names_every_option_and_says_nothing_else() {
    let folder = Folder::new();
    for flag in ["-h", "--help"] {
        let run = folder.succeed(flag);
        assert_eq!(run.err, "");
        for name in [
            "-s, --spp <N>",
            "-l, --light-samples <N>",
            "-t, --threads <N>",
            "-m, --max-depth <N>",
            "-o, --accumulate <N>",
            "-H, --hemisphere",
            "-f, --output",
            "-r, --resolution <WIDTH> <HEIGHT>",
            "-p, --crop <X> <Y> <DX> <DY>",
            "-c, --camera-file <FILE>",
            "--camera <CAMERA>",
            "-a, --adaptive <BATCH> <TOLERANCE>",
            "-e, --environment <FILE>",
            "-b, --lens-radius <LENGTH>",
            "-d, --focal-distance <LENGTH>",
            "-D, --define <NAME=VALUE>",
            "-h, --help",
            "--cs184",
            "--integrator <NAME>",
            "--light-component <LIGHT>",
            "--bvh <BUILDER>",
            "--bvh-quality <QUALITY>",
            "--max-leaf-size <N>",
            "--filter <FILTER>",
            "--aperture-blades <N>",
            "--aperture-rotation <DEGREES>",
            "--panorama",
            "--exposure <STOPS>",
            "--tonemap <CURVE>",
            "--exr-type <TYPE>",
            "--exr-compression <METHOD>",
            "--tev <HOST:PORT>",
            "--denoise",
        ] {
            assert!(run.out.contains(name), "{flag}: {name} is missing in\n{}", run.out);
        }
    }
    assert_eq!(folder.files(), [""; 0]);
}

#[test]
fn help_names_every_integrator() {
    let help = Folder::new().succeed("--help").out;
    for known in pathtracer::INTEGRATORS {
        assert!(help.contains(known.name), "{} is missing", known.name);
    }
}

#[test]
fn version() {
    let run = Folder::new().succeed("--version");
    assert_eq!(run.out, concat!("pathtracer ", env!("CARGO_PKG_VERSION"), "\n"));
}

#[test]
fn completions_know_the_options() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let run = Folder::new().succeed(&format!("--completions {shell}"));
        assert!(run.out.contains("light-samples") && run.err.is_empty(), "{shell}");
    }
}

#[test]
fn the_man_page_knows_the_options() {
    let run = Folder::new().succeed("--man");
    assert!(run.out.contains(".TH pathtracer"), "{}", run.out);
    // Roff writes a minus sign as \-.
    assert!(run.out.contains(r"light\-samples") && run.err.is_empty());
}
