//! Session: a compiled scene, its settings, and its film.

use std::sync::Arc;
use std::time::Duration;

use pt_core::film::{Aov, aov, groups};
use pt_core::settings::{Settings, Target};
use pt_core::target::Evaluation;
use pt_core::{
    CompileError, CompileOptions, Earlier, Film, Hierarchies, Kept, Observer, Region, RenderScene,
    compile, compile_camera, compile_edited, develop,
};
use pt_cpu::{Feature, LightGroups, Outcome, RenderError, RenderStatistics, Renderer};
use pt_scene::image::{Channel, Image};
use pt_scene::{Hint, Notes, Placement, Scene};

use crate::cryptomatte::{self, MatteNames};
use crate::fingerprint::{self, FingerprintEntry};
use crate::{light_groups, unlit, view};

/// A compiled scene, from which sessions of this scene and of edited ones are made. Clones share
/// it.
#[derive(Clone)]
pub struct CompiledScene(pub(crate) Earlier);

impl CompiledScene {
    /// Returns true if a scene has the objects that were compiled, at the same places in memory:
    /// then [`Session::edited`] moves no shapes.
    pub fn has_objects_of(&self, scene: &Scene) -> bool {
        self.0.kept.has_objects_of(scene)
    }

    /// Hierarchies for [`CompileOptions::hierarchies`], with which the same scene is compiled
    /// elsewhere.
    pub fn hierarchies(&self) -> Hierarchies {
        Hierarchies::of(&self.0.scene)
    }
}

/// A compiled scene, its settings, and its film. Keeps the lists of the [`Scene`] in memory, too.
pub struct Session {
    scene: Arc<RenderScene>,
    /// Record of the compilation.
    kept: Kept,
    settings: Settings,
    film: Film,
    /// Notes about the scene, other than about its view.
    scene_notes: Notes,
    /// All notes.
    notes: Notes,
    /// Times at which the shutter opens and closes, in seconds.
    shutter: [f64; 2],
    geometry_time: Duration,
    bvh_time: Duration,
    counts_tests: bool,
    /// Everything that the samples depend on besides scene, version and region.
    entries: Vec<FingerprintEntry>,
    names: MatteNames,
    light_groups: Option<LightGroups>,
}

impl Session {
    /// Compiles a scene; [`CompileOptions::compensated`] and
    /// [`CompileOptions::texture_coordinates`] follow from the settings.
    ///
    /// # Errors
    /// If the scene is inconsistent, or the region of the settings is outside of the image.
    pub fn new(
        scene: &Scene,
        options: CompileOptions,
        settings: Settings,
    ) -> Result<Self, CompileError> {
        Self::with(None, scene, options, settings)
    }

    /// Creates the session that [`Self::new`] creates, bit for bit, and compiles only what differs
    /// from an earlier scene: meshes, images and other large parts are taken over if they are the
    /// same ones in memory, as in an edited clone of the earlier [`Scene`]. Shapes are moved in
    /// place if nothing else uses the earlier compilation.
    ///
    /// ```
    /// use pathtracer::{CompileOptions, Session, Settings};
    ///
    /// let scene = pathtracer::default_scene();
    /// let options = || CompileOptions { resolution: Some([40, 30]), ..Default::default() };
    /// let session = Session::new(&scene, options(), Settings::default())?;
    /// let mut edited = scene.clone();
    /// edited.objects[3].to_world.translation.x += 0.1;
    /// let earlier = session.compiled();
    /// let moved = Session::edited(earlier, &edited, options(), Settings::default())?;
    /// # let _ = moved;
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn edited(
        earlier: CompiledScene,
        scene: &Scene,
        options: CompileOptions,
        settings: Settings,
    ) -> Result<Self, CompileError> {
        Self::with(Some(earlier), scene, options, settings)
    }

    fn with(
        earlier: Option<CompiledScene>,
        scene: &Scene,
        mut options: CompileOptions,
        settings: Settings,
    ) -> Result<Self, CompileError> {
        options.compensated = pt_cpu::uses_mis_compensation(&settings);
        options.texture_coordinates = settings.aovs.contains(&Aov::Uv);
        let entries = fingerprint::entries(&options, &settings);
        let unlit = unlit::note(scene).filter(|_| options.environment.is_none());
        let placement = options.placement;
        let names = MatteNames::of(scene, &settings.aovs);
        let compiled = match earlier {
            Some(CompiledScene(earlier)) => compile_edited(scene, options, earlier)?,
            None => compile(scene, options)?,
        };
        let region = Region::full(compiled.scene.camera.resolution);
        let light_groups = settings.light_groups.as_ref();
        let light_groups = light_groups
            .map(|wanted| light_groups::resolve(wanted, scene, &compiled.scene))
            .transpose()
            .map_err(CompileError::LightGroups)?;
        let groups = light_groups.as_ref().map_or(&[][..], LightGroups::names);
        let mut session = Self {
            scene: Arc::new(compiled.scene),
            kept: compiled.kept,
            film: settings.film(region).with_light_groups(groups),
            scene_notes: compiled.notes,
            notes: Notes::default(),
            shutter: compiled.shutter,
            geometry_time: compiled.geometry_time,
            bvh_time: compiled.bvh_time,
            counts_tests: false,
            entries,
            names,
            light_groups,
            settings,
        };
        session.warn_ignored_media();
        if let Some(unlit) = unlit {
            session.scene_notes.push(unlit);
            session.scene_notes.suggest(Hint::AddEnvironment);
            session.scene_notes.suggest(Hint::ShowNormals);
        }
        session.set_notes(scene, placement, &compiled.camera_notes);
        if let Some(region) = session.settings.region {
            session.restrict(region)?;
        }
        Ok(session)
    }

    /// Replaces the camera, and discards the samples so far: the session is then the one that
    /// [`Session::new`] creates for this scene and these arguments. Of the scene, only the cameras
    /// may differ from the one of this session; of the options, only those of the camera, besides
    /// the environment, which is kept and is ignored here; of the settings, any but the integrator,
    /// the estimator of direct light, AOVs and light groups.
    ///
    /// Returns false, without a change, if the camera has another shutter: then the scene has to be
    /// compiled anew.
    ///
    /// # Errors
    /// If the camera is invalid, or the region of the settings is outside of the image. The session
    /// is then unchanged.
    pub fn set_camera(
        &mut self,
        scene: &Scene,
        options: &CompileOptions,
        settings: Settings,
    ) -> Result<bool, CompileError> {
        let resolution = pt_core::resolution(scene, options);
        let region = settings.region.unwrap_or_else(|| Region::full(resolution));
        if !region.is_inside(resolution) {
            return Err(CompileError::Region { region, resolution });
        }
        let of_camera = Arc::make_mut(&mut self.scene);
        let Some(notes) = compile_camera(scene, options, self.shutter, of_camera)? else {
            return Ok(false);
        };
        self.entries = fingerprint::with_environment_of(
            fingerprint::entries(options, &settings),
            std::mem::take(&mut self.entries),
        );
        self.settings = settings;
        self.film = self.empty_film(region);
        self.set_notes(scene, options.placement, &notes);
        Ok(true)
    }

    /// Collects the notes about the scene, its camera and its view.
    fn set_notes(&mut self, scene: &Scene, placement: Option<Placement>, of_camera: &Notes) {
        let mut notes = self.scene_notes.clone();
        notes.append(of_camera);
        let placed = placement.or(scene.camera().map(|camera| camera.placement));
        if placed != Some(Placement::Fit)
            && let Some(misplaced) = view::note(scene, &self.scene)
        {
            notes.push(misplaced);
            notes.suggest(Hint::FitCamera);
        }
        self.notes = notes;
    }

    /// Adds a note if the scene has media that the integrator does not support.
    fn warn_ignored_media(&mut self) {
        let name = &self.settings.integrator;
        let sees = pt_cpu::integrator::by_name(name)
            .is_none_or(|integrator| integrator.supports(Feature::Media));
        if !sees && !self.scene.media.is_empty() {
            let note = format!("the scene has media, which the integrator {name} ignores");
            self.scene_notes.push(note);
            self.scene_notes.suggest(Hint::UseIntegrator("volpath"));
        }
    }

    /// Restricts the render to a region, and discards the samples so far.
    ///
    /// # Errors
    /// If the region is not inside the image.
    pub fn restrict(&mut self, region: Region) -> Result<(), CompileError> {
        let resolution = self.scene.camera.resolution;
        if !region.is_inside(resolution) {
            return Err(CompileError::Region { region, resolution });
        }
        self.settings.region = Some(region);
        self.film = self.empty_film(region);
        Ok(())
    }

    /// Creates an empty film of a region with the channels of the settings.
    fn empty_film(&self, region: Region) -> Film {
        self.settings.film(region).with_light_groups(self.film.light_groups())
    }

    /// Begins with the sample number `first`, and discards the samples so far; the earlier samples
    /// belong to another film.
    ///
    /// # Panics
    /// If the film has half buffers, which begin with their first samples.
    pub fn start_at(&mut self, first: u32) {
        assert!(!self.film.has_half_buffers(), "halves begin with their first sample");
        self.film = self.empty_film(self.film.region()).starting_at(first);
    }

    /// Returns everything that the samples depend on besides the scene and the version of the
    /// program, as text.
    pub fn identity(&self) -> Vec<FingerprintEntry> {
        let of_pixels = fingerprint::of_pixels(self.scene.camera.resolution, self.film.region());
        of_pixels.into_iter().chain(self.entries.iter().cloned()).collect()
    }

    /// Replaces the samples so far with those of a film, from which the render resumes.
    ///
    /// # Panics
    /// If the film has another region or other channels.
    pub fn go_on_from(&mut self, film: Film) {
        assert_eq!(film.region(), self.film.region(), "a film of the same pixels");
        assert!(film.has_same_layout(&self.film), "a film that keeps the same");
        self.film = film;
    }

    /// Also counts intersection tests of primitives, at a small cost.
    pub fn count_tests(&mut self) {
        self.counts_tests = true;
    }

    /// Takes the missing samples on `threads` threads (0: one per core), which share tiles of
    /// `tile_size`² pixels. Neither number changes the image.
    ///
    /// # Errors
    /// If the integrator is unknown, the filter is invalid, or threads cannot be started.
    pub fn render(
        &mut self,
        threads: usize,
        tile_size: u32,
        observer: &dyn Observer,
    ) -> Result<(Outcome, RenderStatistics), RenderError> {
        let Self { scene, settings, light_groups, counts_tests, film, .. } = self;
        let machine = (threads, tile_size, *counts_tests);
        Ok(renderer(scene, settings, light_groups.as_ref(), machine)?.render(film, observer))
    }

    /// Returns true if the further samples of a pixel depend on its samples so far: with an error
    /// target, half buffers or a tolerance. Then a part of the film is continued, and put back
    /// ([`Film::part`], [`Film::put_back`]); otherwise, films of different samples of the same
    /// pixels are merged ([`Film::merge`]).
    pub fn is_continued(&self) -> bool {
        self.settings.in_halves() || self.settings.adaptive.is_some()
    }

    /// Creates an empty film of a rectangle whose samples begin with number `first`.
    pub fn film_from(&self, region: Region, first: u32) -> Film {
        let film = self.empty_film(region);
        if first > 0 { film.starting_at(first) } else { film }
    }

    /// Takes the samples that a film of some pixels of the image lacks and whose numbers, in each
    /// half buffer if there are two, are below `end`. An error target is not evaluated: samples are
    /// those of the plan of the film.
    ///
    /// # Errors
    /// As [`Self::render`].
    ///
    /// # Panics
    /// If the film has other channels than the one of the session.
    pub fn advance(
        &self,
        film: &mut Film,
        end: u32,
        (threads, tile_size): (usize, u32),
        observer: &dyn Observer,
    ) -> Result<(Outcome, RenderStatistics), RenderError> {
        assert!(film.has_same_layout(&self.film), "a film that keeps the same");
        let Self { scene, settings, light_groups, counts_tests, .. } = self;
        let machine = (threads, tile_size, *counts_tests);
        Ok(renderer(scene, settings, light_groups.as_ref(), machine)?.advance(film, end, observer))
    }

    /// Plans the samples of the next round of a render with an error target: the first ones, or, if
    /// those planned so far are taken, further ones. Returns false if no more are needed, and
    /// without an error target.
    ///
    /// # Errors
    /// As [`Self::render`].
    pub fn plan_round(&mut self, threads: usize) -> Result<bool, RenderError> {
        let Self { scene, settings, light_groups, film, .. } = self;
        let machine = (threads, 16, false);
        Ok(renderer(scene, settings, light_groups.as_ref(), machine)?.plan_round(film))
    }

    /// The samples so far, to which those of other sessions are added.
    pub fn film_mut(&mut self) -> &mut Film {
        &mut self.film
    }

    /// The compiled scene, for [`Self::edited`].
    pub fn compiled(&self) -> CompiledScene {
        CompiledScene(Earlier { scene: Arc::clone(&self.scene), kept: self.kept.clone() })
    }

    /// The compiled scene.
    pub fn scene(&self) -> &RenderScene {
        &self.scene
    }

    /// Names of the objects and materials that the film counts.
    pub fn names(&self) -> &MatteNames {
        &self.names
    }

    /// The settings.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Returns the samples so far.
    pub fn into_film(self) -> Film {
        self.film
    }

    /// The samples so far.
    pub fn film(&self) -> &Film {
        &self.film
    }

    /// Evaluates the error target for the samples so far or, without a target, the error of half
    /// buffers. Returns `None` without half buffers, or if a half of a pixel has no samples.
    pub fn look(&self) -> Option<Evaluation> {
        self.settings.target.unwrap_or(Target::NONE).evaluate(&self.film, self.settings.reuse)
    }

    /// Notes about the scene.
    pub fn notes(&self) -> &[String] {
        self.notes.lines()
    }

    /// Remedies for what the notes describe.
    pub fn hints(&self) -> &[Hint] {
        self.notes.hints()
    }

    /// Wall-clock times of collecting the shapes and of building the hierarchy.
    pub fn build_times(&self) -> (Duration, Duration) {
        (self.geometry_time, self.bvh_time)
    }

    /// The image so far: mean radiance, linear Rec. 709.
    pub fn image(&self) -> Image {
        let Region { width, height, .. } = self.film.region();
        Image { width, height, pixels: develop::radiance(&self.film).into() }
    }

    /// The image so far with alpha, by which colours are premultiplied; alpha is 1 if the settings
    /// do not contain [`Aov::Alpha`]. Rows are from the top.
    pub fn rgba(&self) -> Vec<[f32; 4]> {
        develop::rgba(&self.film)
    }

    /// The requested AOVs, mattes and light groups, as channels of the image.
    pub fn channels(&self) -> Vec<Channel> {
        let mattes = cryptomatte::channels(&self.film, &self.names);
        let groups = groups::channels(&self.film);
        aov::channels(&self.film).into_iter().chain(mattes).chain(groups).collect()
    }

    /// Samples taken per pixel as colours, from blue (none) to red (all), over the whole image.
    pub fn rate_image(&self) -> (u32, u32, Vec<[u8; 3]>) {
        let [width, height] = self.scene.camera.resolution;
        let r = self.film.region();
        let rates = develop::sampling_rate(&self.film, self.settings.spp);
        let mut all = vec![develop::rate_color(0.0); width as usize * height as usize];
        for (row, y) in rates.chunks_exact(r.width as usize).zip(r.y..) {
            let start = y as usize * width as usize + r.x as usize;
            all[start..start + row.len()].copy_from_slice(row);
        }
        (width, height, all)
    }
}

/// Creates a renderer with a number of threads, the size of their tiles, and true if tests are
/// counted.
fn renderer<'a>(
    scene: &'a RenderScene,
    settings: &'a Settings,
    groups: Option<&'a LightGroups>,
    (threads, tile_size, counts_tests): (usize, u32, bool),
) -> Result<Renderer<'a>, RenderError> {
    let renderer = Renderer::new(scene, settings, threads, tile_size, counts_tests)?;
    match groups {
        Some(groups) => renderer.with_light_groups(groups),
        None => Ok(renderer),
    }
}
