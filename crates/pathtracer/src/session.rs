//! A scene, how to render it, and what is rendered of it.

use std::time::Duration;

use pt_core::film::{Aov, aov, groups};
use pt_core::settings::{Settings, Target};
use pt_core::target::Evaluation;
use pt_core::{
    CompileError, CompileOptions, Film, Observer, Region, RenderScene, compile, develop,
};
use pt_cpu::{Feature, LightGroups, Outcome, RenderError, Renderer, Statistics};
use pt_scene::image::{Channel, Image};
use pt_scene::{Placement, Scene};

use crate::cryptomatte::{self, Names};
use crate::fingerprint::{self, Entry};
use crate::{light_groups, unlit, view};

/// A scene, how to render it, and what is rendered of it.
pub struct Session {
    scene: RenderScene,
    settings: Settings,
    film: Film,
    notes: Vec<String>,
    geometry_time: Duration,
    bvh_time: Duration,
    counts_tests: bool,
    /// What the samples depend on besides scene, version and pixels.
    entries: Vec<Entry>,
    names: Names,
    light_groups: Option<LightGroups>,
}

impl Session {
    /// Compiles a scene; [`CompileOptions::compensated`] and
    /// [`CompileOptions::texture_coordinates`] follow from the settings.
    ///
    /// # Errors
    /// If the scene is inconsistent, or the region of the settings lies outside of the image.
    pub fn new(
        scene: &Scene,
        mut options: CompileOptions,
        settings: Settings,
    ) -> Result<Self, CompileError> {
        options.compensated = pt_cpu::uses_mis_compensation(&settings);
        options.texture_coordinates = settings.aovs.contains(&Aov::Uv);
        let entries = fingerprint::entries(&options, &settings);
        let unlit = unlit::note(scene).filter(|_| options.environment.is_none());
        let placed = options.placement.or(scene.camera().map(|camera| camera.placement));
        let names = Names::of(scene, &settings.aovs);
        let compiled = compile(scene, options)?;
        let region = Region::full(compiled.scene.camera.resolution);
        let light_groups = settings.light_groups.as_ref();
        let light_groups = light_groups
            .map(|wanted| light_groups::resolve(wanted, scene, &compiled.scene))
            .transpose()
            .map_err(CompileError::LightGroups)?;
        let groups = light_groups.as_ref().map_or(&[][..], LightGroups::names);
        let mut session = Self {
            scene: compiled.scene,
            film: settings.film(region).with_light_groups(groups),
            notes: compiled.notes,
            geometry_time: compiled.geometry_time,
            bvh_time: compiled.bvh_time,
            counts_tests: false,
            entries,
            names,
            light_groups,
            settings,
        };
        session.warn_ignored_media();
        session.notes.extend(unlit);
        if placed != Some(Placement::Fit) {
            session.notes.extend(view::note(scene, &session.scene));
        }
        if let Some(region) = session.settings.region {
            session.restrict(region)?;
        }
        Ok(session)
    }

    /// Notes that there are media which the integrator does not see.
    fn warn_ignored_media(&mut self) {
        let name = &self.settings.integrator;
        let sees = pt_cpu::integrator::by_name(name)
            .is_none_or(|integrator| integrator.supports(Feature::Media));
        if !sees && !self.scene.media.is_empty() {
            self.notes.push(format!(
                "the scene has media, which the integrator {name} leaves out; --integrator volpath \
                 renders them"
            ));
        }
    }

    /// Renders only these pixels, from the first sample.
    ///
    /// # Errors
    /// If they are not all in the image.
    pub fn restrict(&mut self, region: Region) -> Result<(), CompileError> {
        let resolution = self.scene.camera.resolution;
        if !region.is_inside(resolution) {
            return Err(CompileError::Region { region, resolution });
        }
        self.settings.region = Some(region);
        self.film = self.empty_film(region);
        Ok(())
    }

    /// A film without samples that keeps what the settings ask for, of these pixels.
    fn empty_film(&self, region: Region) -> Film {
        self.settings.film(region).with_light_groups(self.film.light_groups())
    }

    /// Leaves the samples before number `first` to another film, and those so far.
    ///
    /// # Panics
    /// If there are two halves, which begin with their first samples.
    pub fn start_at(&mut self, first: u32) {
        assert!(!self.film.has_half_buffers(), "halves begin with their first sample");
        self.film = self.empty_film(self.film.region()).starting_at(first);
    }

    /// All that the samples depend on besides the scene and the version of the program, in words.
    pub fn identity(&self) -> Vec<Entry> {
        let of_pixels = fingerprint::of_pixels(self.scene.camera.resolution, self.film.region());
        of_pixels.into_iter().chain(self.entries.iter().cloned()).collect()
    }

    /// Takes the place of the samples so far, to go on from there.
    ///
    /// # Panics
    /// If it has other pixels, or keeps something else.
    pub fn go_on_from(&mut self, film: Film) {
        assert_eq!(film.region(), self.film.region(), "a film of the same pixels");
        assert!(film.has_same_layout(&self.film), "a film that keeps the same");
        self.film = film;
    }

    /// Also counts tests of single primitives, which costs a little.
    pub fn count_tests(&mut self) {
        self.counts_tests = true;
    }

    /// Takes the samples that are missing, on `threads` threads (0: one per core) that share
    /// tiles of `tile_size`² pixels. Neither number changes the image.
    ///
    /// # Errors
    /// If the integrator is unknown, the filter makes no sense, or threads cannot be started.
    pub fn render(
        &mut self,
        threads: usize,
        tile_size: u32,
        observer: &dyn Observer,
    ) -> Result<(Outcome, Statistics), RenderError> {
        let counts = self.counts_tests;
        let mut renderer = Renderer::new(&self.scene, &self.settings, threads, tile_size, counts)?;
        if let Some(groups) = &self.light_groups {
            renderer = renderer.with_light_groups(groups)?;
        }
        Ok(renderer.render(&mut self.film, observer))
    }

    /// The compiled scene.
    pub fn scene(&self) -> &RenderScene {
        &self.scene
    }

    /// The names of what the film counts.
    pub fn names(&self) -> &Names {
        &self.names
    }

    /// How it is rendered.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The samples so far.
    pub fn film(&self) -> &Film {
        &self.film
    }

    /// What the error target finds of the samples so far, or one that asks for nothing if they are
    /// in halves without one. `None` without halves, or without samples of each half of each
    /// pixel.
    pub fn look(&self) -> Option<Evaluation> {
        self.settings.target.unwrap_or(Target::NONE).evaluate(&self.film, self.settings.reuse)
    }

    /// Notes about the scene.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Wall-clock times of collecting the shapes and of building the hierarchy.
    pub fn build_times(&self) -> (Duration, Duration) {
        (self.geometry_time, self.bvh_time)
    }

    /// The image so far: mean radiance, linear Rec. 709.
    pub fn image(&self) -> Image {
        let Region { width, height, .. } = self.film.region();
        Image { width, height, pixels: develop::radiance(&self.film) }
    }

    /// The image so far with its coverage, by which colours are multiplied already (premultiplied
    /// alpha); 1 where the settings do not ask for [`Aov::Alpha`]. In rows from the top.
    pub fn rgba(&self) -> Vec<[f32; 4]> {
        develop::rgba(&self.film)
    }

    /// What the settings ask for besides light and its coverage, as channels of the image.
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
