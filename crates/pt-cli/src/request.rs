//! Renders of scenes in memory, with the options of the command line as keywords.
//!
//! A keyword is the long name of an option with underscores, such as `max_depth` for `--max-depth`.
//! Values are those of the command line, and messages name keywords in place of options.

use std::path::Path;
use std::time::Duration;

use clap::{Arg, Command, CommandFactory, FromArgMatches};
use pathtracer::film_file::FilmHeader;
use pathtracer::image::{Image, SaveOptions, auto_exposure};
use pathtracer::provenance::Provenance;
use pathtracer::{CompileOptions, CompiledScene, Hierarchies, Scene, Session, suggestions};

use crate::args::Cli;
use crate::commands::render;
use crate::film_header::film_header;
use crate::job::{OutputJob, RenderJob};
use crate::keywords::{in_keywords, underscored};
use crate::limits::Limit;
use crate::origin::SceneOrigin;
use crate::resolve::{EarlierRun, resolve};
use crate::{message, parse, provenance};

/// Purpose of keywords.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// The render of a scene in memory.
    Render,
    /// The development of an image, and its file.
    Save,
    /// The continuation of a render.
    Resume,
    /// The second render of an image.
    Rerender,
    /// The development of image files.
    Develop,
    /// The denoising of image files.
    Denoise,
    /// The union of images of parts.
    Join,
}

impl Purpose {
    /// Identifiers of the options; the others are about the terminal, films, or the reading of
    /// scenes.
    fn options(self) -> &'static [&'static str] {
        match self {
            Self::Render => RENDER,
            Self::Resume => &[
                "spp",
                "threads",
                "time_limit",
                "checkpoint_every",
                "allow_outside",
                "allow_folder",
            ],
            Self::Rerender => &["output", "force", "threads", "allow_outside", "allow_folder"],
            Self::Develop => &[
                "layer",
                "cell",
                "resize",
                "png_bits",
                "exposure",
                "tonemap",
                "exr_type",
                "exr_compression",
                "alpha",
            ],
            Self::Denoise => &["threads", "png_bits", "exposure", "tonemap"],
            Self::Join => &["allow_gaps", "png_bits", "exposure", "tonemap"],
            Self::Save => {
                &["png_bits", "exposure", "tonemap", "exr_type", "exr_compression", "receipt"]
            }
        }
    }

    /// Name of the command with the options; `None` for a render.
    pub(crate) fn name_of_command(self) -> Option<&'static str> {
        match self {
            Self::Render | Self::Save => None,
            Self::Resume => Some("resume"),
            Self::Rerender => Some("rerender"),
            Self::Develop => Some("develop"),
            Self::Denoise => Some("denoise"),
            Self::Join => Some("join"),
        }
    }

    /// Command with the options.
    fn command(self) -> Command {
        let Some(name) = self.name_of_command() else { return Cli::command() };
        let all = crate::command_args::Command::command();
        all.find_subcommand(name).cloned().unwrap_or_default()
    }

    pub(crate) fn applies(self, arg: &Arg) -> bool {
        self.options().contains(&arg.get_id().as_str())
    }
}

const RENDER: &[&str] = &[
    "resolution",
    "cell",
    "alpha",
    "hide_background",
    "hide_emitters",
    "spp",
    "light_samples",
    "max_depth",
    "exact_depth",
    "direct",
    "adaptive",
    "target_error",
    "target_noise",
    "uniform",
    "confidence",
    "max_spp",
    "time_limit",
    "clamp",
    "clamp_indirect",
    "path_reuse",
    "split",
    "sampler",
    "filter",
    "seed",
    "integrator",
    "ao_distance",
    "show",
    "aov",
    "light_groups",
    "environment",
    "environment_layout",
    "camera_file",
    "lens_radius",
    "aperture_blades",
    "aperture_rotation",
    "panorama",
    "smooth_shadows",
    "focal_distance",
    "threads",
    "bvh",
    "quality",
    "max_leaf_size",
    "tile_size",
];

/// An option as a keyword.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Keyword {
    /// Name, such as `max_depth`.
    pub name: String,
    /// One paragraph of help.
    pub help: String,
    /// True if the option may stand without a value.
    pub is_flag: bool,
    /// Maximum number of values: 0 for a flag without them, 1 for lists with commas.
    pub values: usize,
}

/// Returns the keywords of a purpose, in the order of the program's help.
pub fn keywords(purpose: Purpose) -> Vec<Keyword> {
    let command = purpose.command();
    command.get_arguments().filter(|arg| purpose.applies(arg)).map(keyword).collect()
}

fn keyword(arg: &Arg) -> Keyword {
    let takes_value = arg.get_action().takes_values();
    let range = arg.get_num_args().unwrap_or_else(|| usize::from(takes_value).into());
    Keyword {
        name: underscored(arg.get_long().unwrap_or_default()),
        help: in_keywords(&arg.get_help().map(ToString::to_string).unwrap_or_default()),
        is_flag: range.min_values() == 0,
        values: range.max_values(),
    }
}

/// Keywords with their values, which are words of the command line; a flag needs none.
pub type Words = [(String, Vec<String>)];

/// Resolves the keywords of a purpose for an image file, which is not written. Options in the
/// message are written as keywords.
fn resolved(purpose: Purpose, keywords: &Words, file: &str) -> Result<RenderJob, String> {
    job(purpose, keywords, file).map_err(|message| in_keywords(&message))
}

fn job(purpose: Purpose, keywords: &Words, file: &str) -> Result<RenderJob, String> {
    let command = Cli::command();
    let mut words = ["pathtracer", "-q", "-f", file].map(String::from).to_vec();
    words.extend(arguments(purpose, keywords)?);
    let matches = command.try_get_matches_from(words);
    let cli = matches.and_then(|matches| Cli::from_arg_matches(&matches));
    let cli = cli.map_err(|error| message::of_parser(&error))?;
    resolve(cli, Vec::new(), EarlierRun::default())
}

/// Arguments of the command line for the keywords of a purpose.
///
/// # Errors
/// A message if a keyword is unknown.
pub(crate) fn arguments(purpose: Purpose, keywords: &Words) -> Result<Vec<String>, String> {
    let command = purpose.command();
    let mut words = Vec::new();
    for (name, values) in keywords {
        let option = option(&command, purpose, name)?;
        match values.as_slice() {
            [] => words.push(option),
            [value] => words.push(format!("{option}={value}")),
            several => {
                words.push(option);
                words.extend(several.iter().cloned());
            }
        }
    }
    Ok(words)
}

/// The file of an image in memory.
pub struct SaveRequest {
    output: OutputJob,
    /// Arguments of the command line for the keywords.
    arguments: Vec<String>,
}

impl SaveRequest {
    /// Resolves keywords of [`Purpose::Save`]. The extension of the file is that of PNG or OpenEXR.
    ///
    /// # Errors
    /// A message if a keyword or a value is invalid, or does not apply to the format.
    pub fn new(file: &Path, keywords: &Words) -> Result<Self, String> {
        let extension = file.extension().unwrap_or_default().to_string_lossy();
        let output = resolved(Purpose::Save, keywords, &format!("image.{extension}"))?.output;
        let output = OutputJob { path: file.to_owned(), ..output };
        Ok(Self { output, arguments: arguments(Purpose::Save, keywords)? })
    }

    /// Options of the file of an image, without metadata.
    pub fn options(&self, image: &Image) -> SaveOptions {
        let mut options = self.output.save.clone();
        if self.output.auto_exposure {
            options.tone.exposure = auto_exposure(image);
        }
        options
    }

    /// Metadata of the file of an image with this provenance.
    pub fn metadata(&self, provenance: &Provenance) -> Vec<(String, String)> {
        let of_file = provenance::of_file(provenance, &self.output.path, &self.arguments);
        provenance::metadata(self.output.metadata, &of_file)
    }
}

/// A side of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The number of columns.
    Width,
    /// The number of rows.
    Height,
}

impl Side {
    /// Name of the keyword.
    fn name(self) -> &'static str {
        match self {
            Self::Width => "width",
            Self::Height => "height",
        }
    }

    /// Size of an image with this side and about the aspect ratio of another image.
    fn resolution(self, side: u32, [width, height]: [u32; 2]) -> [u32; 2] {
        let scaled = |to: u32, from: u32| {
            let pixels = f64::from(side) * f64::from(to) / f64::from(from);
            (pixels.round() as u32).max(1)
        };
        match self {
            Self::Width => [side, scaled(height, width)],
            Self::Height => [scaled(width, height), side],
        }
    }
}

/// A render of a scene in memory.
pub struct RenderRequest {
    job: RenderJob,
    /// Arguments of the command line for the keywords.
    arguments: Vec<String>,
    /// Requested side of the image; the other one follows from the aspect ratio of the scene.
    side: Option<(Side, u32)>,
}

/// A compiled scene with the header of its film.
pub struct PreparedRender {
    /// The compiled scene.
    pub session: Session,
    /// Header of the film, without a seal, and with the arguments of the program that renders the
    /// same image.
    pub header: FilmHeader,
}

impl RenderRequest {
    /// Resolves keywords of [`Purpose::Render`].
    ///
    /// # Errors
    /// A message if a keyword or a value is invalid, or keywords exclude each other.
    pub fn new(keywords: &Words) -> Result<Self, String> {
        // The format has room for all channels.
        let job = resolved(Purpose::Render, keywords, "image.exr")?;
        let arguments = arguments(Purpose::Render, keywords)?;
        Ok(Self { job, arguments, side: None })
    }

    /// Sets one side of the image; the other one follows from the aspect ratio of the scene.
    ///
    /// # Errors
    /// A message if the value is no number of pixels, or the keywords contain the resolution.
    pub fn with_side(mut self, side: Side, pixels: &str) -> Result<Self, String> {
        let name = side.name();
        if self.job.memory.resolution.is_some() {
            return Err(format!("{name} and resolution are mutually exclusive"));
        }
        let expected = |_| format!("{name}: found {pixels}, expected a whole number from 1 on");
        self.side = Some((side, parse::pixels(pixels).map_err(expected)?));
        Ok(self)
    }

    /// Uses hierarchies of another compilation of the same scene; see
    /// [`CompileOptions::hierarchies`].
    #[must_use]
    pub fn with_hierarchies(mut self, known: Hierarchies) -> Self {
        self.job.compile.options.hierarchies = known;
        self
    }

    /// Number of threads.
    pub fn threads(&self) -> usize {
        self.job.schedule.threads
    }

    /// Width and height of a tile in pixels.
    pub fn tile_size(&self) -> u32 {
        self.job.schedule.tile_size
    }

    /// Duration after which the render stops.
    pub fn time_limit(&self) -> Option<Duration> {
        self.job.schedule.time_limit
    }

    /// Compiles a scene with these options. What has not changed since an earlier compilation is
    /// taken over.
    ///
    /// # Errors
    /// A message if the scene is invalid or needs more memory than there is, or if a file of the
    /// options cannot be read.
    pub fn prepare(
        self,
        scene: &Scene,
        origin: &SceneOrigin,
        earlier: Option<CompiledScene>,
    ) -> Result<PreparedRender, String> {
        self.prepared(scene, origin, earlier).map_err(|error| in_keywords(&format!("{error:#}")))
    }

    fn prepared(
        self,
        scene: &Scene,
        origin: &SceneOrigin,
        earlier: Option<CompiledScene>,
    ) -> anyhow::Result<PreparedRender> {
        let Self { job, mut arguments, side } = self;
        let RenderJob { mode, mut input, mut compile, memory, .. } = job;
        (input.scene, input.load) = (origin.file.clone(), origin.options.clone());
        compile.options.placement = origin.placement;
        let mut limit = Limit::new(memory);
        limit.check_files()?;
        let complete = |options: &mut CompileOptions| {
            if let Some((side, pixels)) = side {
                let size = side.resolution(pixels, pathtracer::resolution(scene, options));
                limit.set_resolution(size)?;
                options.resolution = Some(size);
                let [width, height] = size.map(|n| n.to_string());
                arguments.extend(["--resolution".into(), width, height]);
            }
            limit.check_scene(scene)
        };
        let scene_and_sources = (scene, origin.sources.as_slice(), earlier);
        let (session, sources) =
            render::compile_in_memory(scene_and_sources, &input, compile, mode, complete)?;
        arguments.extend(origin.arguments());
        let header = film_header(&input, &session, &sources, &scene.missing, arguments);
        Ok(PreparedRender { session, header })
    }
}

/// Option of the command line with the name of a keyword.
fn option(command: &Command, purpose: Purpose, keyword: &str) -> Result<String, String> {
    let long = keyword.replace('_', "-");
    let is_named = |arg: &Arg| {
        arg.get_long() == Some(&long)
            || arg.get_all_aliases().is_some_and(|all| all.contains(&long.as_str()))
    };
    let mut all = command.get_arguments().filter(|arg| purpose.applies(arg));
    if !keyword.contains('-') && all.any(is_named) {
        return Ok(format!("--{long}"));
    }
    let known = keywords(purpose);
    let mut names = known.iter().map(|keyword| keyword.name.as_str());
    if let Some(near) = suggestions(keyword, names.clone()).first() {
        return Err(format!("unknown setting {keyword:?}; did you mean {near:?}?"));
    }
    let all = names.by_ref().collect::<Vec<_>>().join(", ");
    Err(format!("unknown setting {keyword:?}; known: {all}"))
}

#[cfg(test)]
mod tests {
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
            (
                &[("max-depth", &["3"])],
                "unknown setting \"max-depth\"; did you mean \"max_depth\"?",
            ),
            (&[("spp", &["0"])], "'spp <N>'"),
            (
                &[("path_splitting", &["2"]), ("path_reuse", &["2"])],
                "path_splitting and path_reuse",
            ),
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
}
