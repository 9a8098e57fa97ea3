//! Words, numbers and paragraphs of explanations.

use pathtracer::explain::{
    Cause, Explanation, Fireflies, Firefly, LightPath, LightSource, NameLookup, ScatterSite,
    SceneItem,
};
use pathtracer::{DirectLight, Feature, Session, integrator};

/// Maximum width of lines.
pub(super) const WIDTH: usize = 100;

/// Formats a number with four digits.
pub(super) fn number(x: f64) -> String {
    let magnitude = x.abs();
    if x == 0.0 {
        "0".into()
    } else if !(1e-3..1e5).contains(&magnitude) {
        format!("{x:.3e}")
    } else if magnitude < 1.0 {
        format!("{x:.4}")
    } else {
        let digits = [1e1, 1e2, 1e3].iter().filter(|&&limit| magnitude < limit).count();
        format!("{x:.digits$}")
    }
}

/// No-break space, at which a [`paragraph`] is not wrapped.
const TIE: &str = "\u{a0}";

/// Formats several numbers, on one line of a [`paragraph`].
pub(super) fn numbers<const N: usize>(all: [f32; N]) -> String {
    all.map(|x| number(f64::from(x))).join(TIE)
}

/// Formats a fraction as a percentage.
pub(super) fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

/// Wraps a paragraph that begins with `first`; further lines are indented by its width.
pub(super) fn paragraph(first: &str, text: &str) -> String {
    let indent = first.chars().count();
    let mut lines = first.to_owned();
    let mut width = indent;
    for (i, word) in text.split(' ').enumerate() {
        let length = word.chars().count();
        if i > 0 && width + 1 + length > WIDTH {
            lines += "\n";
            lines += &" ".repeat(indent);
            width = indent;
        } else if i > 0 {
            lines += " ";
            width += 1;
        }
        lines += word;
        width += length;
    }
    lines.replace(TIE, " ") + "\n"
}

/// Describes an item of the scene: its name, kind and material.
pub(super) fn thing(thing: &SceneItem) -> String {
    let SceneItem { kind, object, material } = thing;
    let object = object.as_ref().map_or("shape of a light".into(), |name| format!("\"{name}\""));
    let material = material.as_ref().map_or(String::new(), |name| format!(" of \"{name}\""));
    format!("{object} ({kind}{material})")
}

/// Describes the light source of a contribution.
pub(super) fn source(names: NameLookup, source: &LightSource) -> String {
    match source {
        LightSource::Emitter { primitive, .. } => thing(&names.primitive(*primitive)),
        LightSource::Sky { .. } => "the sky".into(),
        LightSource::Medium { medium, .. } => match names.medium(*medium) {
            "" => "an emissive medium".into(),
            name => format!("\"{name}\" (emissive medium)"),
        },
        LightSource::Light(light) => {
            let SceneItem { kind, object, .. } = names.light(light);
            let object = object.map_or(String::new(), |name| format!(" \"{name}\""));
            format!("{kind}{object}")
        }
        LightSource::Hemisphere { .. } => "a random direction of the hemisphere".into(),
    }
}

/// Describes the cause of a firefly.
pub(super) fn cause(names: NameLookup, firefly: &Firefly) -> String {
    let trace = &firefly.sample.trace;
    let Some(bright) = trace.contributions.get(firefly.contribution) else { return String::new() };
    let light = source(names, &bright.source);
    let at = |vertex: usize| match trace.vertices.get(vertex).map(|vertex| vertex.site) {
        Some(ScatterSite::Surface { primitive, .. }) => thing(&names.primitive(primitive)),
        _ => "a point in a medium".into(),
    };
    match firefly.cause {
        Cause::SeenLight => format!(
            "{light} is visible in a part of the pixel, directly or through mirrors or glass, so \
             that only some samples hit it."
        ),
        Cause::Caustic { vertex } => format!(
            "caustic. Light of {light} reaches {1} through {0}. Light samples do not pass mirrors \
             or glass, so that only few BSDF samples find this light, each with a large \
             contribution.",
            at(vertex + 1),
            at(vertex)
        ),
        Cause::Unsampled if bright.source.is_sampled() => {
            "uniform samples of the hemisphere: few of them hit a light, each with a large \
             contribution."
                .into()
        }
        Cause::Unsampled => format!(
            "{light} is not sampled as a light. Only few BSDF samples hit it, each with a large \
             contribution."
        ),
        Cause::Throughput { vertex, weight, times } => format!(
            "path throughput, {} times the mean. Its largest factor is that of vertex {}, {}: {}. \
             Important directions are sampled too rarely there, or Russian roulette ends most \
             paths.",
            number(times),
            vertex + 1,
            at(vertex),
            number(weight)
        ),
        Cause::Radiance { times } => format!(
            "radiance of {light}, {} times the mean of such paths{}.",
            number(times),
            near(&bright.source)
        ),
        Cause::Choice { probability, times } => format!(
            "selection of {light} with the small probability {}; its reciprocal is {} times the \
             mean.",
            number(f64::from(probability)),
            number(times)
        ),
        Cause::Density { times } => format!(
            "density of the direction to {light}: its weighted reciprocal is {} times the mean{}.",
            number(times),
            near(&bright.source)
        ),
        Cause::Scattering { times } => format!(
            "scattering of the light of {light} by {}, {} times the mean: its lobe is narrow, and \
             light samples ignore it.",
            at(bright.vertices.wrapping_sub(1)),
            number(times)
        ),
        Cause::Several => "several factors that are large together.".into(),
    }
}

/// Distance of a sampled light as a clause, or nothing for other sources.
fn near(source: &LightSource) -> String {
    match source {
        LightSource::Light(light) if light.distance.is_finite() => {
            format!("; distance {} m", number(f64::from(light.distance)))
        }
        _ => String::new(),
    }
}

/// Describes the options that reduce a firefly.
pub(super) fn advice(session: &Session, explanation: &Explanation, firefly: &Firefly) -> String {
    let settings = session.settings();
    let mut all = vec!["more samples (-s)".to_owned()];
    match firefly.cause {
        Cause::SeenLight => all.push("a wider --filter".into()),
        Cause::Caustic { .. } => {
            all.push("a larger light of the same power".into());
            all.push("rough mirrors or glass, which light samples reach".into());
        }
        Cause::Throughput { .. }
            if settings.integrator == "path" && !session.scene().is_animated() =>
        {
            all.push("--path-reuse 4".into());
        }
        Cause::Radiance { .. } | Cause::Choice { .. } | Cause::Density { .. } => {
            all.push(format!("more samples of each light (-l {})", 4 * settings.light_samples));
        }
        Cause::Scattering { .. } | Cause::Unsampled if settings.direct != DirectLight::Mis => {
            all.push("--direct mis".into());
        }
        _ => {}
    }
    let clamps = integrator::by_name(&settings.integrator)
        .is_some_and(|integrator| integrator.supports(Feature::Clamp));
    if clamps && firefly.cause != Cause::SeenLight {
        all.push(clamp(explanation, firefly));
    }
    let last = all.pop().unwrap_or_default();
    if all.is_empty() { last } else { format!("{}; or {last}", all.join("; ")) }
}

/// Describes clamping at the luminance of [`Fireflies::TIMES`] ordinary samples, and the energy
/// that it removes from this pixel.
fn clamp(explanation: &Explanation, firefly: &Firefly) -> String {
    let Explanation { fireflies, luminance, samples, .. } = explanation;
    let limit = Fireflies::TIMES * fireflies.ordinary;
    let limit = if limit > 0.0 { limit } else { *luminance };
    let is_indirect = firefly.sample.trace.contributions[firefly.contribution].vertices >= 2;
    let option = if is_indirect { "--clamp-indirect" } else { "--clamp" };
    let cut = |f: &Firefly| (f.luminance * f.share_of_sample - limit).max(0.0);
    let lost: f64 = fireflies.all.iter().map(cut).sum();
    format!(
        "{option} {}, which removes {} of the light of this pixel from its fireflies",
        number(limit),
        percent(lost / (luminance * samples.len() as f64))
    )
}

/// Formats the heading of a path.
pub(super) fn path(number: usize, path: &LightPath, kind: &str, of_pixel: f64) -> String {
    let LightPath { sample, luminance, .. } = path;
    format!(
        "{number}. {kind} in sample {sample}: luminance {} ({} of the pixel)\n",
        self::number(*luminance),
        percent(of_pixel)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_four_digits() {
        for (x, text) in [
            (0.0, "0"),
            (0.012_345, "0.0123"),
            (1.23456, "1.235"),
            (-12.3456, "-12.35"),
            (123.456, "123.5"),
            (1234.56, "1235"),
            (123_456.0, "1.235e5"),
            (0.000_123_4, "1.234e-4"),
        ] {
            assert_eq!(number(x), text);
        }
    }

    #[test]
    fn paragraphs_fit_into_their_width() {
        let text = ["word"; 100].join(" ");
        let lines = paragraph("  cause  ", &text);
        assert!(lines.lines().count() > 5 && lines.lines().all(|line| line.len() <= WIDTH));
        assert!(lines.lines().skip(1).all(|line| line.starts_with("         word")));
    }
}
