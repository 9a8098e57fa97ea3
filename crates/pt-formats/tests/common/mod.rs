//! Components shared by the tests of several formats: their folders of files, damage, and
//! invariants of scenes.
//!
//! The errors of a bad file are in a file beside it, as are the missing files and warnings of a
//! good one, if there are any. `PT_WRITE_EXPECTED=1 cargo test` rewrites those; review the
//! difference before keeping it.

use std::path::{Path, PathBuf};

use pt_formats::{FORMATS, LoadError, LoadOptions};
use pt_scene::{Color, Geometry, Mesh, Projection, Scene, Shared};
pub(crate) use pt_testing::without_panics;

/// Returns the folder of the files of a format.
pub(crate) fn folder(format: &str) -> PathBuf {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/formats")).join(format)
}

/// Returns the files of a format with an extension, in order.
pub(crate) fn files(format: &str, kind: &str, ending: &str) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder(format).join(kind)).expect("the folder exists");
    let mut files: Vec<_> = entries.map(|e| e.expect("a readable entry").path()).collect();
    files.retain(|f| f.extension().is_some_and(|e| e == ending));
    files.sort();
    assert!(!files.is_empty());
    files
}

/// Parses bytes as the content of a file, which may refer to other folders.
pub(crate) fn parse(bytes: &[u8], path: &Path) -> Result<Scene, LoadError> {
    let ending = path.extension().and_then(|e| e.to_str()).expect("an ending");
    let format = FORMATS.iter().find(|f| f.extensions.contains(&ending)).expect("a format");
    format.parse(bytes, path, &LoadOptions { allow_outside: true, ..LoadOptions::default() })
}

/// Compares messages with the expected ones beside the file, or writes these if requested.
fn check_expected(file: &Path, found: &str) {
    let root = file.parent().expect("a folder").to_string_lossy().into_owned();
    let found = found.replace(&format!("{root}/"), "").replace(&root, ".");
    let expected = file.with_extension("expected");
    if std::env::var_os("PT_WRITE_EXPECTED").is_some() {
        if found.is_empty() {
            std::fs::remove_file(&expected).ok();
        } else {
            std::fs::write(&expected, &found).expect("a writable folder");
        }
    }
    let wanted = std::fs::read_to_string(&expected).unwrap_or_default();
    assert_eq!(found, wanted, "{}", file.display());
}

/// Checks that bad files are rejected with the error beside them.
pub(crate) fn check_bad_files(format: &str, ending: &str) {
    let mut accepted = Vec::new();
    for file in files(format, "bad", ending) {
        let bytes = std::fs::read(&file).expect("a readable file");
        match parse(&bytes, &file) {
            Ok(_) => accepted.push(file),
            Err(error) => check_expected(&file, &format!("{error}\n")),
        }
    }
    assert!(accepted.is_empty(), "{accepted:#?}");
}

/// Checks that good files are read with the warnings beside them.
pub(crate) fn check_good_files(format: &str, ending: &str) {
    for file in files(format, "good", ending) {
        let bytes = std::fs::read(&file).expect("a readable file");
        let scene = parse(&bytes, &file).unwrap_or_else(|error| panic!("{error}"));
        check_invariants(&scene);
        let missing = scene.missing.iter().map(|missing| format!("missing: {missing}\n"));
        let warnings = scene.warnings.iter().map(|warning| format!("{warning}\n"));
        check_expected(&file, &missing.chain(warnings).collect::<String>());
    }
}

/// Checks that truncated and damaged good files are read or rejected without a panic.
pub(crate) fn check_robustness(format: &str, ending: &str, rounds: usize) {
    let all: Vec<_> = files(format, "good", ending)
        .into_iter()
        .map(|file| (std::fs::read(&file).expect("a readable file"), file))
        .collect();
    without_panics(|| {
        for (bytes, file) in &all {
            for length in 0..bytes.len() {
                if let Ok(scene) = parse(&bytes[..length], file) {
                    check_invariants(&scene);
                }
            }
        }
    });
    check_damage(&all, rounds);
}

/// Checks that damaged files are read or rejected without a panic, in at least this number of
/// rounds and that of [`most_rounds`].
pub(crate) fn check_damage(all: &[(Vec<u8>, PathBuf)], rounds: usize) {
    check_damage_with(all, rounds, parse);
}

/// Does the same as [`check_damage`], with a reader for damaged bytes that need not be those of the
/// scene itself.
pub(crate) fn check_damage_with(
    all: &[(Vec<u8>, PathBuf)],
    rounds: usize,
    read_damaged: impl Fn(&[u8], &Path) -> Result<Scene, LoadError>,
) {
    let mut random = Random(0x9E37_79B9_7F4A_7C15 ^ mutation_seed());
    let mut read = 0;
    let rounds = most_rounds(rounds, all.len());
    without_panics(|| {
        for round in 0..rounds {
            let (bytes, file) = &all[round % all.len()];
            let mut bytes = bytes.clone();
            for _ in 0..=random.below(3) {
                damage(&mut bytes, &mut random);
            }
            if let Ok(scene) = read_damaged(&bytes, file) {
                check_invariants(&scene);
                read += 1;
            }
        }
    });
    // Damage that is always detected, or never, would be no test.
    assert!(read > rounds / 100 && read < rounds, "{read} of {rounds} were read");
}

/// Returns the number of rounds, but at least 200 per file, or the value of the variable
/// `PT_MUTATIONS`, which `cargo xtask soak mutations` sets.
pub(crate) fn most_rounds(rounds: usize, files: usize) -> usize {
    rounds.max(files * number_in("PT_MUTATIONS").unwrap_or(200))
}

/// Returns the seed of the damage: the number in `PT_MUTATION_SEED`, or 0.
pub(crate) fn mutation_seed() -> u64 {
    number_in("PT_MUTATION_SEED").unwrap_or(0) as u64
}

/// Returns the number in an environment variable.
fn number_in(variable: &str) -> Option<usize> {
    let text = std::env::var(variable).ok()?;
    Some(text.parse().unwrap_or_else(|_| panic!("{variable} is {text:?}; expected a whole number")))
}

/// Generator of pseudo-random indices (xorshift64*).
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 33) as usize % n.max(1)
    }
}

/// Applies flipped bits, changed bytes, missing and repeated pieces, or extreme words.
fn damage(bytes: &mut Vec<u8>, random: &mut Random) {
    const NASTY: [&str; 14] = [
        "-1",
        "0",
        "4294967295",
        "18446744073709551615",
        "1e308",
        "nan",
        "inf",
        "-0",
        "",
        "$x",
        "<",
        "\"",
        "/",
        "é",
    ];
    if bytes.is_empty() {
        return;
    }
    let at = random.below(bytes.len());
    let end = at + random.below((bytes.len() - at).min(60));
    match random.below(6) {
        0 => bytes[at] ^= 1 << random.below(8),
        1 => bytes[at] = random.below(256) as u8,
        2 => drop(bytes.drain(at..end)),
        3 => {
            let piece = bytes[at..end].to_vec();
            let to = random.below(bytes.len());
            bytes.splice(to..to, piece);
        }
        4 => bytes.truncate(at),
        _ => {
            let is_word = |b: &u8| b.is_ascii_alphanumeric() || b"-.+_".contains(b);
            let from = bytes[..at].iter().rposition(|b| !is_word(b)).map_or(0, |i| i + 1);
            let to = bytes[at..].iter().position(|b| !is_word(b)).map_or(bytes.len(), |i| at + i);
            bytes.splice(from..to, NASTY[random.below(NASTY.len())].bytes());
        }
    }
}

/// Checks the invariants of scenes.
pub(crate) fn check_invariants(scene: &Scene) {
    for object in &scene.objects {
        assert!(object.to_world.is_finite() && object.to_world.matrix3.determinant() != 0.0);
        for material in object.materials.iter().flatten() {
            assert!((*material as usize) < scene.materials.len());
        }
        let sides = object.media.unwrap_or_default();
        let media = sides.interior.iter().chain(&sides.exterior);
        assert!(media.into_iter().all(|medium| (*medium as usize) < scene.media.len()));
        match &object.geometry {
            Geometry::Sphere { radius } => assert!(*radius != 0.0 && radius.is_finite()),
            Geometry::Mesh(mesh) => check_mesh(mesh, object.materials.len()),
            Geometry::Points { points, radius } => {
                let count = points.positions.len();
                assert!(count > 0 && radius.is_none_or(|radius| radius > 0.0));
                assert!(points.positions.as_flattened().iter().all(|x| x.is_finite()));
                assert!(points.colors.as_ref().is_none_or(|colors| colors.len() == count));
                assert!(points.segments.as_flattened().iter().all(|end| (*end as usize) < count));
            }
        }
    }
    for material in &scene.materials {
        let Color::Value(emission) = material.emission else { continue };
        assert!(emission.iter().all(|x| *x >= 0.0 && x.is_finite()));
    }
    for camera in &scene.cameras {
        assert!(camera.to_world.is_finite());
        match camera.projection {
            Projection::Perspective { x_fov, y_fov } => {
                assert!([x_fov, y_fov].iter().all(|fov| 0.0 < *fov && *fov < 180.0));
            }
            Projection::Orthographic { half_width, half_height } => {
                assert!([half_width, half_height].iter().all(|x| 0.0 < *x && x.is_finite()));
            }
            Projection::Panorama => {}
        }
        assert!(0.0 < camera.near && camera.near < camera.far);
    }
    assert!(scene.lights.iter().all(|light| light.to_world.is_finite()));
    assert_eq!(scene.settings.filter.map_or(Ok(()), |filter| filter.check()), Ok(()));
}

fn check_mesh(mesh: &Mesh, slots: usize) {
    let below = |indices: &[[u32; 3]], count: usize| {
        indices.as_flattened().iter().all(|i| (*i as usize) < count)
    };
    let triangles = mesh.triangles.len();
    assert!(triangles > 0 && below(&mesh.triangles, mesh.positions.len()));
    assert!(mesh.positions.as_flattened().iter().all(|x| x.is_finite()));
    let mut next = 0;
    for part in &mesh.submeshes {
        assert_eq!(part.triangles.start, next);
        assert!((part.slot as usize) < slots);
        next = part.triangles.end;
    }
    assert_eq!(next as usize, triangles);
    let check = |count: usize, indices: Option<&Shared<[u32; 3]>>| match indices {
        Some(indices) => assert!(indices.len() == triangles && below(indices, count)),
        None => assert_eq!(count, mesh.positions.len()),
    };
    if let Some(normals) = &mesh.normals {
        check(normals.values.len(), normals.indices.as_ref());
        assert!(normals.values.as_flattened().iter().all(|x| x.is_finite()));
    }
    if let Some(uvs) = &mesh.uvs {
        check(uvs.values.len(), uvs.indices.as_ref());
    }
    if let Some(colors) = &mesh.colors {
        check(colors.values.len(), colors.indices.as_ref());
        assert!(colors.values.as_flattened().iter().all(|x| x.is_finite()));
    }
}
