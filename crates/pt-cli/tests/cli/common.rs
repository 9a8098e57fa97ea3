//! Temporary folder in which a test runs the program, and the result of a run.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use pathtracer::image::{self, Image};

/// Scene of this repository.
pub(crate) const SCENE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/cornell.dae");

/// Options for a fast render of that scene.
pub(crate) const TINY: &str = "-r 12 9 -s 2";

/// Scene with a lamp of the course's profile, a glass ball, and a slope below a smaller lamp.
pub(crate) const SMALL: &str = include_str!("small.dae");

/// Path of a scene of the course, which is not part of the repository.
pub(crate) fn course_scene(name: &str) -> PathBuf {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/scenes/dae")).join(name)
}

/// A temporary folder.
pub(crate) struct Folder(tempfile::TempDir);

impl Folder {
    pub(crate) fn new() -> Self {
        Self(tempfile::tempdir().expect("a temporary folder"))
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Returns a command that runs the program with these arguments in the folder.
    pub(crate) fn command<S: AsRef<std::ffi::OsStr>>(&self, args: &[S]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_pathtracer"));
        command.args(args).current_dir(self.0.path());
        // The configuration of the user who runs the tests must have no effect.
        command.env("XDG_CONFIG_HOME", self.0.path()).env_remove("PATHTRACER_CONFIG");
        command.env("XDG_DATA_HOME", env!("CARGO_TARGET_TMPDIR"));
        command
    }

    /// Runs the program with arguments separated by spaces; `SCENE` stands for [`SCENE`].
    pub(crate) fn run(&self, args: &str) -> Run {
        let args: Vec<_> = args.split_whitespace().map(|a| a.replace("SCENE", SCENE)).collect();
        Run::of(&self.command(&args).output().expect("the program can be started"), &args.join(" "))
    }

    /// Runs the program as [`Self::run`] does; panics if it fails.
    pub(crate) fn succeed(&self, args: &str) -> Run {
        let run = self.run(args);
        assert_eq!(run.code, Some(0), "{run:?}");
        run
    }

    /// Returns the names of all files and folders in the folder, sorted.
    pub(crate) fn files(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.0.path()).expect("the folder is there");
        let name = |e: std::io::Result<std::fs::DirEntry>| e.expect("an entry").file_name();
        let mut names: Vec<_> =
            entries.map(|e| name(e).into_string().expect("a name in UTF-8")).collect();
        names.sort();
        names
    }

    pub(crate) fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    pub(crate) fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        std::fs::write(self.path(name), content).expect("the folder takes files");
    }

    pub(crate) fn image(&self, name: &str) -> Image {
        image::load(&self.path(name)).unwrap_or_else(|e| panic!("{e}"))
    }

    /// Returns the bytes of the EXR file that these arguments render, without provenance metadata.
    pub(crate) fn exr(&self, args: &str) -> Vec<u8> {
        self.succeed(&format!("{args} --receipt none -f rendered.exr"));
        self.read("rendered.exr")
    }
}

/// Result of running the program.
#[derive(Debug)]
pub(crate) struct Run {
    /// Arguments, for messages of tests.
    #[expect(dead_code, reason = "shown by Debug")]
    args: String,
    /// Exit status; `None` if a signal ended it.
    pub(crate) code: Option<i32>,
    /// Standard output.
    pub(crate) out: String,
    /// Standard error.
    pub(crate) err: String,
}

impl Run {
    pub(crate) fn of(output: &Output, args: &str) -> Self {
        let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).expect("UTF-8");
        Self {
            args: args.to_owned(),
            code: output.status.code(),
            out: text(&output.stdout),
            err: text(&output.stderr),
        }
    }
}
