//! Explanations as text, at most a hundred columns wide.

use std::fmt::Write as _;

use pathtracer::Session;
use pathtracer::explain::{
    Contribution, Explanation, Fireflies, Firefly, LightPath, LightSource, NameLookup,
    PathExpression, Sample, SampledLight, ScatterEvent, ScatterSample, ScatterSite, Trace, Vertex,
    expression,
};

use super::words::{advice, cause, number, numbers, paragraph, path, percent, source, thing};

/// Path types with a smaller fraction of both the mean and the variance are summed in one row.
const MIN_SHARE: f64 = 0.01;

/// Formats the explanation of a pixel.
pub(super) fn explanation(
    names: NameLookup,
    session: &Session,
    explanation: &Explanation,
) -> String {
    let mut text = head(session, explanation);
    text += &types(explanation);
    text += &paths(names, explanation);
    text += &fireflies(names, session, explanation);
    text
}

fn head(session: &Session, explanation: &Explanation) -> String {
    let Explanation { pixel: [x, y], samples, mean, luminance, variance, rejected, .. } =
        explanation;
    let [width, height] = session.scene().camera.resolution;
    let n = samples.len().max(1) as f64;
    let deviation = variance.sqrt();
    let relative = |x: f64| {
        let share = x / luminance;
        if share.is_finite() { format!(" ({} of the mean)", percent(share)) } else { String::new() }
    };
    let mut text = format!(
        "pixel     column {x}, row {y} of {width} x {height}; samples {} to {}\n",
        samples.start,
        samples.end.saturating_sub(1)
    );
    let [r, g, b] = mean.map(number);
    // Writing to a string cannot fail.
    let _ = writeln!(text, "mean      {r} {g} {b}, luminance {}", number(*luminance));
    let noise = format!(
        "standard deviation of a sample {}{}, of the mean of {n} independent ones {}{}",
        number(deviation),
        relative(deviation),
        number(deviation / n.sqrt()),
        relative(deviation / n.sqrt())
    );
    text += &paragraph("noise     ", &noise);
    if rejected.count() > 0 {
        text += &paragraph("rejected  ", &format!("samples counted as black: {rejected}"));
    }
    text
}

fn types(explanation: &Explanation) -> String {
    let Explanation { samples, types, together, .. } = explanation;
    if types.is_empty() {
        return "\nNo light reaches this pixel.\n".into();
    }
    let mut text = String::from(
        "\nPath types, from the light to the eye: L light, D diffuse, G glossy, S specular, V \
         volume, E eye\n",
    );
    let row = |name: &str, [mean, share, variance, found]: [String; 4]| {
        let row = format!("  {name:<28}{mean:>12}{share:>12}{variance:>15}{found:>18}");
        format!("{}\n", row.trim_end())
    };
    let header = ["mean", "of mean", "of variance", "in samples"].map(str::to_owned);
    text += &row("type", header);
    let is_shown = |t: &&PathExpression| t.share_of_mean.max(t.share_of_variance) >= MIN_SHARE;
    let (shown, others): (Vec<_>, Vec<_>) = types.iter().partition(is_shown);
    for of_type in shown {
        let PathExpression { expression, luminance, share_of_mean, share_of_variance, .. } =
            of_type;
        let found = format!("{} of {}", of_type.samples, samples.len());
        let [mean, variance] = [*share_of_mean, *share_of_variance].map(percent);
        text += &row(expression, [number(*luminance), mean, variance, found]);
    }
    if !others.is_empty() {
        let sum = |of: fn(&PathExpression) -> f64| others.iter().map(|t| of(t)).sum::<f64>();
        let [mean, variance] =
            [sum(|t| t.share_of_mean), sum(|t| t.share_of_variance)].map(percent);
        let name =
            if others.len() == 1 { "1 other".into() } else { format!("{} others", others.len()) };
        text += &row(&name, [number(sum(|t| t.luminance)), mean, variance, String::new()]);
    }
    if types.len() > 1 {
        let none = String::new;
        text += &row("covariance of the types", [none(), none(), percent(*together), none()]);
    }
    text
}

fn paths(names: NameLookup, explanation: &Explanation) -> String {
    let mut text = String::new();
    let whole = explanation.luminance * explanation.samples.len() as f64;
    for (i, bright) in explanation.brightest.iter().enumerate() {
        if i == 0 {
            text += "\nBrightest paths, from the eye to the light; lengths in metres\n";
        }
        let LightPath { luminance, trace, .. } = bright;
        let kind = trace.contributions.first().map(|c| expression(trace, c)).unwrap_or_default();
        text += &path(i + 1, bright, &kind, luminance / whole);
        text += &followed(names, trace, false);
    }
    text
}

/// Formats a path, beginning at the camera: with all of its contributions if `is_whole`, or else
/// with those of a brightest path, which has one.
fn followed(names: NameLookup, trace: &Trace, is_whole: bool) -> String {
    let mut text = line("eye", &place(trace.eye.to_array()));
    text += &hits(names, trace, 0);
    // If the path ends with a light sample, the scattering at its last vertex is not shown.
    let is_sampled = !is_whole && trace.contributions.iter().any(|c| c.source.is_sampled());
    for (i, vertex) in trace.vertices.iter().enumerate() {
        let ends = is_sampled && i + 1 == trace.vertices.len();
        text += &self::vertex(names, i + 1, vertex, vertex.event(ends));
        let departure = vertex.scatter.filter(|_| !ends);
        text += &light_samples(names, trace, i + 1);
        text += &departure
            .map_or(String::new(), |departure| line("scatter", &scatter_sample(&departure)));
        text += &hits(names, trace, i + 1);
    }
    text
}

/// Light samples taken at the vertex with the number `vertices`.
fn light_samples(names: NameLookup, trace: &Trace, vertices: usize) -> String {
    let here = |c: &&Contribution| c.vertices == vertices && c.source.is_sampled();
    trace.contributions.iter().filter(here).map(|c| contribution(names, c)).collect()
}

/// Emission hit by rays that leave the vertex with the number `vertices`; 0 is the camera.
fn hits(names: NameLookup, trace: &Trace, vertices: usize) -> String {
    let here = |c: &&Contribution| c.vertices == vertices && !c.source.is_sampled();
    trace.contributions.iter().filter(here).map(|c| contribution(names, c)).collect()
}

fn line(label: &str, text: &str) -> String {
    paragraph(&format!("   {label:<8}"), text)
}

fn place(p: [f32; 3]) -> String {
    format!("at {}", numbers(p))
}

fn vertex(names: NameLookup, number: usize, vertex: &Vertex, event: ScatterEvent) -> String {
    let (letter, what) = match (event, vertex.site) {
        (_, ScatterSite::Medium { phase }) => ("V", format!("a medium, {phase}")),
        (event, ScatterSite::Surface { primitive, lobe, .. }) => {
            let letter = match event {
                ScatterEvent::Diffuse => "D",
                ScatterEvent::Specular => "S",
                ScatterEvent::Glossy | ScatterEvent::Volume => "G",
            };
            (letter, format!("{}, {lobe}", thing(&names.primitive(primitive))))
        }
    };
    let throughput = numbers(vertex.throughput.to_array());
    let text = format!("{}, {what}; throughput {throughput}", place(vertex.p.to_array()));
    line(&format!("{number}. {letter}"), &text)
}

fn scatter_sample(departure: &ScatterSample) -> String {
    let ScatterSample { pdf, weight, survival, .. } = departure;
    let pdf = pdf.map_or("single direction".into(), |pdf| {
        format!("density {} / sr", number(f64::from(pdf.get())))
    });
    let survival = survival.map_or(String::new(), |q| {
        format!(", survival probability {} (Russian roulette)", number(f64::from(q)))
    });
    format!("{pdf}, weight {}{survival}", numbers(weight.to_array()))
}

/// Formats a contribution: its light, how it was sampled or hit, and its value.
fn contribution(names: NameLookup, contribution: &Contribution) -> String {
    let from = source(names, &contribution.source);
    let (label, how) = match &contribution.source {
        LightSource::Emitter { p, radiance, weight, .. } => {
            let radiance = numbers(radiance.to_array());
            let weight = number(f64::from(*weight));
            let at = place(p.to_array());
            ("hits", format!("{from} {at}, radiance {radiance}, MIS weight {weight}"))
        }
        LightSource::Sky { direction, radiance, weight } => {
            let radiance = numbers(radiance.to_array());
            let (direction, weight) = (numbers(direction.to_array()), number(f64::from(*weight)));
            (
                "hits",
                format!(
                    "{from} in the direction {direction}, radiance {radiance}, MIS weight {weight}"
                ),
            )
        }
        LightSource::Medium { radiance, .. } => {
            ("hits", format!("{from} along the ray, radiance {}", numbers(radiance.to_array())))
        }
        LightSource::Light(light) => ("samples", format!("{from}{}", sampled(light))),
        LightSource::Hemisphere { direction, pdf, samples } => {
            let direction = numbers(direction.to_array());
            let pdf = number(f64::from(pdf.get()));
            let of = one_of(*samples);
            ("samples", format!("{from}, {direction}, density {pdf} / sr{of}"))
        }
    };
    let value = numbers(contribution.value.to_array());
    let clamped = if contribution.clamped > 0.0 {
        format!(" (clamped by luminance {})", number(f64::from(contribution.clamped)))
    } else {
        String::new()
    };
    line(label, &format!("{how}; contribution {value}{clamped}"))
}

fn sampled(light: &SampledLight) -> String {
    let SampledLight { chosen, distance, radiance, pdf, weight, samples, .. } = light;
    let mut text = String::new();
    if let Some(chosen) = chosen {
        let probability = number(f64::from(chosen.probability));
        let _ = write!(text, ", selection probability {probability}");
    }
    if distance.is_finite() {
        let _ = write!(text, ", distance {}", number(f64::from(*distance)));
    }
    let radiance = numbers(radiance.to_array());
    let _ = match pdf {
        Some(pdf) => {
            write!(text, ", radiance {radiance}, density {} / sr", number(f64::from(pdf.get())))
        }
        None => write!(text, ", irradiance {radiance}"),
    };
    let _ = write!(text, ", MIS weight {}", number(f64::from(*weight)));
    text + &one_of(*samples)
}

fn one_of(samples: u32) -> String {
    if samples > 1 { format!(", one of {samples}") } else { String::new() }
}

fn fireflies(names: NameLookup, session: &Session, explanation: &Explanation) -> String {
    let Fireflies { ordinary, share_of_mean, share_of_variance, all } = &explanation.fireflies;
    let rule = format!(
        "more than {} times as bright as the mean of the others, with more than {} of the variance",
        Fireflies::TIMES,
        percent(Fireflies::SHARE)
    );
    let label = "Fireflies: ";
    if all.is_empty() {
        return format!("\n{}", paragraph(label, &format!("none. No sample is {rule}.")));
    }
    let text = format!(
        "{} of {} samples, each {rule}. Together {} of the mean and {} of the variance; mean \
         luminance of the others: {}.",
        all.len(),
        explanation.samples.len(),
        percent(*share_of_mean),
        percent(*share_of_variance),
        number(*ordinary)
    );
    let mut text = format!("\n{}", paragraph(label, &text));
    // Fireflies with the same path type and cause are grouped.
    let mut groups: Vec<(String, String, Vec<&Firefly>)> = Vec::new();
    for firefly in all {
        let trace = &firefly.sample.trace;
        let kind = expression(trace, &trace.contributions[firefly.contribution]);
        let cause = cause(names, firefly);
        match groups.iter_mut().find(|group| group.0 == kind && group.1 == cause) {
            Some((.., members)) => members.push(firefly),
            None => groups.push((kind, cause, vec![firefly])),
        }
    }
    for (kind, cause, members) in &groups {
        for firefly in members {
            let label = format!("  sample {}: ", firefly.sample.number);
            text += &paragraph(&label, &member(firefly, kind, *ordinary));
        }
        text += &paragraph("    cause: ", cause);
        text += &paragraph("    remedies: ", &advice(session, explanation, members[0]));
    }
    text
}

/// Formats a firefly; `kind` is the path type of its largest contribution.
fn member(firefly: &Firefly, kind: &str, ordinary: f64) -> String {
    let &Firefly { luminance, share_of_variance, share_of_sample, .. } = firefly;
    let times = if ordinary > 0.0 {
        format!("{} times as bright as the others", number(luminance / ordinary))
    } else {
        "the others are black".into()
    };
    format!(
        "luminance {}, {times}, {} of the variance; {} of it by {kind}",
        number(luminance),
        percent(share_of_variance),
        percent(share_of_sample)
    )
}

/// Formats one sample of a pixel completely.
pub(super) fn sample(names: NameLookup, [x, y]: [u32; 2], sample: &Sample) -> String {
    let Sample { number, trace, weight, radiance, fault } = sample;
    let radiance = numbers(radiance.to_array());
    let mut text = paragraph(
        &format!("sample {number} of column {x}, row {y}: "),
        &format!("radiance {radiance}"),
    );
    if *weight != 1.0 {
        let weight = self::number(f64::from(*weight));
        let _ = writeln!(text, "Weight of the reconstruction filter: {weight}.");
    }
    if let Some(fault) = fault {
        let _ = writeln!(text, "Rejected and counted as black: {fault}.");
    }
    text + &followed(names, trace, true)
}
