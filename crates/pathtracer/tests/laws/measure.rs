//! Rendering and comparing.

use pathtracer::{CompileOptions, Film, Scene, Session, Settings, Silent};
use pt_core::film::PixelSums;
use pt_cpu::Renderer;
use pt_math::sampler::SamplerKind;
use pt_testing::{Estimates, ZFailure, sidak, z_test};

/// Settings with independent samples: the film estimates their variance without bias, so that tests
/// have their full power.
pub(crate) fn settings(spp: u32) -> Settings {
    Settings { spp, sampler: SamplerKind::Independent, ..Settings::default() }
}

/// Renders a scene on all cores; panics if a sample is invalid.
pub(crate) fn render(scene: &Scene, options: CompileOptions, settings: Settings) -> Session {
    let mut session = Session::new(scene, options, settings).expect("the scene makes sense");
    finish(&mut session);
    session
}

/// Takes the missing samples.
pub(crate) fn finish(session: &mut Session) {
    session.render(0, 16, &Silent).expect("the settings make sense");
    let rejections = session.film().invalid_samples();
    assert_eq!(rejections.count(), 0, "no number: {:?}", rejections.first);
}

/// Returns true if rendering a scene with these settings is an error.
pub(crate) fn refuses(scene: &Scene, settings: &Settings) -> bool {
    let options = CompileOptions::default();
    let session = Session::new(scene, options, Settings::default()).expect("it compiles");
    Renderer::new(session.scene(), settings, 1, 16, false).is_err()
}

/// Mean square of the standard errors of all pixels.
pub(crate) fn noise(film: &Film) -> f64 {
    let error = |pixel: PixelSums| pixel.luminance().1.powi(2);
    film.pixels().map(error).sum::<f64>() / film.pixels().count() as f64
}

/// Luminances with their variances.
#[derive(Clone, Debug)]
pub(crate) struct Luminances {
    mean: Vec<f32>,
    variance: Vec<f32>,
}

impl Luminances {
    /// Luminances of the pixels of a film, followed by that of the whole film, which has the least
    /// noise.
    pub(crate) fn of(film: &Film) -> Self {
        let pixels: Vec<_> = film.pixels().map(|p| p.luminance()).collect();
        let n = pixels.len() as f64;
        let whole =
            pixels.iter().fold((0.0, 0.0), |s, p| (s.0 + p.0 / n, s.1 + p.1 * p.1 / (n * n)));
        let mean = pixels.iter().map(|p| p.0 as f32).chain([whole.0 as f32]).collect();
        let variance = pixels.iter().map(|p| (p.1 * p.1) as f32).chain([whole.1 as f32]).collect();
        Self { mean, variance }
    }

    /// A constant image without noise.
    fn exact(value: f64, len: usize) -> Self {
        Self { mean: vec![value as f32; len], variance: vec![0.0; len] }
    }

    /// Sum of images of independent samples.
    pub(crate) fn plus(&self, other: &Self) -> Self {
        let add = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| a + b).collect();
        Self { mean: add(&self.mean, &other.mean), variance: add(&self.variance, &other.variance) }
    }

    /// Image multiplied by a number.
    pub(crate) fn scaled(&self, factor: f32) -> Self {
        let times = |values: &[f32], factor: f32| values.iter().map(|v| v * factor).collect();
        let variance = times(&self.variance, factor * factor);
        Self { mean: times(&self.mean, factor), variance }
    }

    pub(crate) fn compare<'a>(
        &'a self,
        other: &'a Self,
        significance: f64,
    ) -> Result<(), ZFailure> {
        let estimates = |l: &'a Self| Estimates { mean: &l.mean, variance: &l.variance };
        z_test(estimates(self), estimates(other), significance)
    }

    /// Mean over all pixels, and its standard error.
    pub(crate) fn whole(&self) -> (f32, f32) {
        let last = |v: &[f32]| v.last().copied().unwrap_or(f32::NAN);
        (last(&self.mean), last(&self.variance).sqrt())
    }
}

/// Panics unless all pixels of a film, and their mean, are `want` up to noise.
pub(crate) fn assert_uniform(film: &Film, want: f64, significance: f64, what: &str) {
    let got = Luminances::of(film);
    let exact = Luminances::exact(want, got.mean.len());
    got.compare(&exact, significance).unwrap_or_else(|e| panic!("{what}: {e}"));
}

/// Panics unless two films agree up to noise.
pub(crate) fn assert_agree(a: &Film, b: &Film, significance: f64, what: &str) {
    let result = Luminances::of(a).compare(&Luminances::of(b), significance);
    result.unwrap_or_else(|e| panic!("{what}: {e}"));
}

/// Panics unless all films of independent samples agree up to noise, each with each.
pub(crate) fn assert_all_agree(films: &[(String, Film)]) {
    let pairs = films.len() * (films.len() - 1) / 2;
    for (i, (a_name, a)) in films.iter().enumerate() {
        for (b_name, b) in &films[..i] {
            assert_agree(a, b, sidak(1e-4, pairs), &format!("{a_name} and {b_name}"));
        }
    }
}
