use super::*;

fn request(keywords: &[(&str, &[&str])]) -> Result<RenderRequest, String> {
    let owned = keywords.iter().map(|(name, values)| {
        ((*name).to_owned(), values.iter().map(|value| (*value).to_owned()).collect())
    });
    RenderRequest::new(&owned.collect::<Vec<_>>())
}

fn refusal(keywords: &[(&str, &[&str])]) -> String {
    request(keywords).err().unwrap_or_else(|| panic!("{keywords:?} was accepted"))
}

#[test]
fn each_listed_option_exists() {
    for purpose in [
        Purpose::Render,
        Purpose::Save,
        Purpose::Resume,
        Purpose::Rerender,
        Purpose::Develop,
        Purpose::Denoise,
        Purpose::Join,
    ] {
        let all = keywords(purpose);
        assert_eq!(all.len(), purpose.options().len());
        assert!(all.iter().all(|keyword| !keyword.help.is_empty()), "{all:#?}");
    }
    let of = |name| keywords(Purpose::Render).into_iter().find(|k| k.name == name).unwrap();
    let kind = |name| (of(name).is_flag, of(name).values);
    assert_eq!(kind("panorama"), (true, 0));
    assert_eq!(kind("alpha"), (true, 1));
    assert_eq!(kind("spp"), (false, 1));
    assert_eq!(kind("crop"), (false, 4));
}

#[test]
fn settings_are_those_of_the_command_line() {
    let scene = pathtracer::default_scene();
    let request = request(&[
        ("spp", &["7"]),
        ("max_depth", &["3"]),
        ("resolution", &["12", "9"]),
        ("crop", &["1", "2", "3", "4"]),
        ("split", &["2"]),
        ("threads", &["3"]),
        ("hide_background", &[]),
    ]);
    let request = request.unwrap();
    assert_eq!(request.threads(), 3);
    let session = request.prepare(&scene, &SceneOrigin::default(), None).unwrap().session;
    let settings = session.settings();
    assert_eq!((settings.spp, settings.max_depth, settings.split), (7, 3, 2));
    assert_eq!(session.scene().camera.resolution, [12, 9]);
    assert_eq!(session.film().region(), pathtracer::Region { x: 1, y: 3, width: 3, height: 4 });
}

#[test]
fn one_side_follows_the_aspect_ratio() {
    let mut scene = pathtracer::default_scene();
    let prepared = |scene: &Scene, side, pixels| {
        let request = request(&[("spp", &["1"])]).unwrap().with_side(side, pixels).unwrap();
        request.prepare(scene, &SceneOrigin::default(), None)
    };
    for (of_file, side, pixels, expected) in [
        (Some([40, 30]), Side::Width, "20", [20, 15]),
        (Some([40, 30]), Side::Height, "60", [80, 60]),
        (Some([30, 40]), Side::Height, "1", [1, 1]),
        (Some([4000, 3]), Side::Width, "10", [10, 1]),
    ] {
        scene.settings.resolution = of_file;
        let PreparedRender { session, header } = prepared(&scene, side, pixels).ok().unwrap();
        assert_eq!(session.scene().camera.resolution, expected);
        let size = expected.map(|n| n.to_string());
        assert_eq!(header.command, ["--spp=1", "--resolution", &size[0], &size[1]]);
    }
    scene.settings.resolution = Some([1, 1000]);
    let message = prepared(&scene, Side::Width, "100000").err().unwrap();
    assert!(message.starts_with("resolution 100000 100000000: found too many"), "{message}");
    let wrong = request(&[]).unwrap().with_side(Side::Width, "-3").err().unwrap();
    assert_eq!(wrong, "width: found -3, expected a whole number from 1 on");
    let twice = request(&[("resolution", &["1", "2"])]).unwrap();
    let twice = twice.with_side(Side::Height, "3").err().unwrap();
    assert_eq!(twice, "height and resolution are mutually exclusive");
}

#[test]
fn refusals_name_keywords() {
    for (keywords, expected) in [
        (
            &[("max_dept", &["3"][..])][..],
            "unknown setting \"max_dept\"; did you mean \"max_depth\"?",
        ),
        (&[("zzzzzz", &[])], "unknown setting \"zzzzzz\"; known: resolution, crop,"),
        (&[("output", &["a.png"])], "unknown setting \"output\""),
        (&[("max-depth", &["3"])], "unknown setting \"max-depth\"; did you mean \"max_depth\"?"),
        (&[("spp", &["0"])], "'spp <N>'"),
        (&[("path_splitting", &["2"]), ("path_reuse", &["2"])], "path_splitting and path_reuse"),
        (&[("confidence", &["90%"])], "require target_error or target_noise"),
        (
            &[("ao_distance", &["1"])],
            "ao_distance requires integrator ao; path does not support it",
        ),
        (&[("integrator", &["pat"])], "unknown integrator \"pat\""),
    ] {
        let message = refusal(keywords);
        assert!(message.contains(expected), "{keywords:?}: {message}");
        assert!(!message.contains("--"), "{message}");
    }
}

#[test]
fn save_options_are_those_of_the_command_line() {
    let image = Image { width: 1, height: 1, pixels: vec![[4.0; 3]].into() };
    let exposure = |file: &str, value: &str| {
        let words = [("exposure".to_owned(), vec![value.to_owned()])];
        let request = SaveRequest::new(Path::new(file), &words);
        request.map(|request| request.options(&image).tone.exposure)
    };
    assert_eq!(exposure("a.png", "-1.5"), Ok(-1.5));
    assert_eq!(exposure("b/a.PNG", "auto"), Ok(auto_exposure(&image)));
    assert!(exposure("a.png", "bright").unwrap_err().contains("'exposure <STOPS>'"));
    let of_exr = exposure("a.exr", "1").unwrap_err();
    assert!(of_exr.starts_with("exposure and tonemap require a PNG image"), "{of_exr}");
    let unknown = SaveRequest::new(Path::new("a.jpg"), &[]).err().unwrap();
    assert!(unknown.contains("unknown extension"), "{unknown}");
    let words = [("spp".to_owned(), vec!["3".to_owned()])];
    let unknown = SaveRequest::new(Path::new("a.png"), &words).err().unwrap();
    assert!(unknown.starts_with("unknown setting \"spp\"; known: png_bits"), "{unknown}");
}

#[test]
fn only_options_become_keywords() {
    for (message, expected) in [
        (
            "set it with -s, as in -s 512 --samples 0..256",
            "set it with spp, as in spp 512 samples 0..256",
        ),
        ("well-known -1 - -- --X a--b e-m", "well-known -1 - -- --X a--b e-m"),
        ("--max-depth=3, (--clamp-indirect)", "max_depth=3, (clamp_indirect)"),
        ("\u{2013} -é --é", "\u{2013} -é --é"),
    ] {
        assert_eq!(in_keywords(message), expected);
    }
}
