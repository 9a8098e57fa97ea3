//! Guarantees of renders with an error target: the true error, measured against a converged image,
//! is below the target as often as promised; and they take fewer samples than a render with equally
//! many for all pixels.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};
use serde_json::Value;

use crate::project::{output_folder, root};

/// Scenes, each with its options, its target, and the samples of the converged image that serves as
/// the truth.
const SCENES: [(&str, &str, f64, u32); 5] = [
    ("cornell.dae", "-r 64 48", 0.06, 131_072),
    ("mitsuba/spot.xml", "-r 64 64", 0.004, 65_536),
    ("mitsuba/sunsky_evening.xml", "-r 48 48", 0.015, 65_536),
    ("mitsuba/environment.xml", "-r 48 48", 0.004, 65_536),
    ("mitsuba/fog.xml", "-r 40 40", 0.04, 65_536),
];

/// Number of renders of each scene, with different seeds.
const SEEDS: u32 = 40;

/// Requested confidence.
const CONFIDENCE: f64 = 0.95;

/// Number of seeds with which the samples of uniform renders are determined.
const SOME: u32 = 8;

/// Maximum fraction of the samples of a render without adaptive sampling, and the minimum number of
/// scenes that achieve it.
const FEWER: (f64, usize) = (0.7, 3);

/// A scene that is rendered in different ways.
struct Subject<'a> {
    program: &'a Path,
    image: PathBuf,
    scene: PathBuf,
    options: &'a str,
}

/// Image in linear light, and the summary of the render.
type ImageAndSummary = (Vec<[f32; 3]>, Value);

impl Subject<'_> {
    fn render(&self, options: &str) -> Result<ImageAndSummary> {
        let json = self.image.with_extension("json");
        let mut command = Command::new(self.program);
        command.args(self.options.split(' ')).args(options.split(' '));
        command.args(["-q", "--checkpoint-every", "0", "--metadata", "none", "--summary-json"]);
        command.arg(&json).arg("-f").arg(&self.image).arg(&self.scene);
        let status = command.status()?;
        ensure!(status.success(), "{}: the render fails", self.scene.display());
        let summary = serde_json::from_str(&std::fs::read_to_string(&json)?)?;
        Ok((pt_image::load_raw(&self.image)?.pixels.into_vec(), summary))
    }

    /// Minimum number of samples per pixel with which a uniform render has an error of at most
    /// `target`, by the same measure and with the same confidence, if the number of samples is
    /// known in advance and the error is evaluated once; to 1 %.
    fn known_samples(&self, target: f64, seed: u32) -> Result<u32> {
        let is_enough = |spp: u32| -> Result<bool> {
            let options = format!("-s {spp} --seed {seed} --aov half_a,half_b");
            Ok(number(&self.render(&options)?.1, "error_at_most")? <= target)
        };
        let mut enough = 16;
        while !is_enough(enough)? {
            enough *= 2;
        }
        let mut too_few = enough / 2;
        while enough - too_few > (enough / 100).max(1) {
            let middle = u32::midpoint(too_few, enough);
            *(if is_enough(middle)? { &mut enough } else { &mut too_few }) = middle;
        }
        Ok(enough)
    }
}

fn number(summary: &Value, name: &str) -> Result<f64> {
    summary[name].as_f64().with_context(|| format!("the summary has no number \"{name}\""))
}

/// Relative root mean square error of an image, as displayed on a screen with white level 1.
fn true_error(pixels: &[[f32; 3]], truth: &[[f32; 3]]) -> f64 {
    let shown = |image: &[[f32; 3]]| -> Vec<f64> {
        image.as_flattened().iter().map(|v| f64::from(v.clamp(0.0, 1.0))).collect()
    };
    let (pixels, truth) = (shown(pixels), shown(truth));
    let error: f64 = pixels.iter().zip(&truth).map(|(a, b)| (a - b).powi(2)).sum();
    (error / truth.iter().map(|v| v * v).sum::<f64>()).sqrt()
}

/// Renders all scenes, and compares.
///
/// # Errors
/// If more renders than allowed exceed their target, too few need fewer samples, or a render fails.
pub(super) fn run(program: &Path) -> Result<()> {
    let folder = output_folder("soak")?;
    let (mut within, mut in_interval, mut all, mut fewer) = (0, 0, 0, 0);
    for (scene, options, target, converged) in SCENES {
        let subject = Subject {
            program,
            image: folder.join("target.exr"),
            scene: root().join("scenes").join(scene),
            options,
        };
        let options = format!("-s {converged} --seed 1000000 --aov half_a,half_b");
        let (truth, summary) = subject.render(&options)?;
        let of_truth = number(&summary, "error")?;
        let pixels = truth.len() as f64;
        let (mut good, mut reported, mut samples, mut worst) = (0, 0, 0.0, 0.0f64);
        let to_target =
            |seed| format!("--target-error {target} --confidence {CONFIDENCE} --seed {seed}");
        for seed in 0..SEEDS {
            let options = to_target(seed);
            let (image, summary) = subject.render(&options)?;
            let error = true_error(&image, &truth);
            let [least, most] =
                ["error_at_least", "error_at_most"].map(|name| number(&summary, name));
            good += u32::from(error <= target);
            reported += u32::from((least?..=most?).contains(&error));
            worst = worst.max(error / target);
            samples += number(&summary, "samples")? / pixels / f64::from(SEEDS);
        }
        let mean_of_some = |samples: &dyn Fn(u32) -> Result<f64>| -> Result<f64> {
            Ok((0..SOME).map(samples).sum::<Result<f64>>()? / f64::from(SOME))
        };
        let known = mean_of_some(&|seed| Ok(subject.known_samples(target, seed)?.into()))?;
        let uniform = mean_of_some(&|seed| {
            let (_, summary) =
                subject.render(&format!("{} --uniform-sampling", to_target(seed)))?;
            Ok(number(&summary, "samples")? / pixels)
        })?;
        println!(
            "{scene}: error at most {:.2} % in {good} of {SEEDS} (the worst {worst:.3} of it), in the interval in {reported}; \
             {samples:.0} samples per pixel, {:.2} of the {uniform:.0} with --uniform-sampling, {:.2} of the {known:.0} with \
             which a single look would do, if one knew them before; the truth is off by {:.3} %",
            100.0 * target,
            samples / uniform,
            samples / known,
            100.0 * of_truth
        );
        (within, in_interval, all) = (within + good, in_interval + reported, all + SEEDS);
        fewer += usize::from(samples <= FEWER.0 * known);
    }
    println!(
        "{within} of {all} renders are as good as was asked for, {in_interval} in the interval that they reported; fewer \
         samples in {fewer} of {} scenes",
        SCENES.len()
    );
    ensure!(f64::from(within) >= CONFIDENCE * f64::from(all), "too many are worse");
    ensure!(f64::from(in_interval) >= CONFIDENCE * f64::from(all), "too many are outside");
    ensure!(fewer >= FEWER.1, "adaptive sampling helps too little");
    Ok(())
}
