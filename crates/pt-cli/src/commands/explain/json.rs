//! Explanations as JSON.

use pathtracer::Session;
use pathtracer::explain::{
    Cause, Contribution, Explanation, Fireflies, Firefly, LightPath, LightRef, LightSource,
    NameLookup, PathExpression, Sample, SampledLight, ScatterEvent, ScatterSite, SceneItem, Trace,
    Vertex, expression,
};
use serde_json::{Value, json};

use super::words::{advice, cause};

/// Formats the explanation of a pixel.
pub(super) fn explanation(
    names: NameLookup,
    session: &Session,
    explanation: &Explanation,
) -> String {
    let Explanation { pixel, samples, mean, luminance, variance, rejected, .. } = explanation;
    let Fireflies { ordinary, share_of_mean, share_of_variance, all } = &explanation.fireflies;
    let firefly = |firefly: &Firefly| {
        let mut value = sample_value(names, &firefly.sample);
        value["luminance"] = json!(firefly.luminance);
        value["share_of_variance"] = json!(firefly.share_of_variance);
        value["contribution"] = json!(firefly.contribution);
        value["share_of_sample"] = json!(firefly.share_of_sample);
        value["cause"] = cause_value(firefly.cause);
        value["cause_in_words"] = json!(cause(names, firefly));
        value["what_helps"] = json!(advice(session, explanation, firefly));
        value
    };
    print(&json!({
        "pixel": pixel,
        "resolution": session.scene().camera.resolution,
        "samples": { "first": samples.start, "count": samples.len() },
        "mean": mean,
        "luminance": luminance,
        "variance": variance,
        "rejected": rejected.count(),
        "types": explanation.types.iter().map(type_value).collect::<Vec<_>>(),
        "together": explanation.together,
        "brightest": explanation.brightest.iter().map(|p| path_value(names, p)).collect::<Vec<_>>(),
        "fireflies": {
            "ordinary": ordinary,
            "share_of_mean": share_of_mean,
            "share_of_variance": share_of_variance,
            "all": all.iter().map(firefly).collect::<Vec<_>>(),
        },
    }))
}

/// Formats one sample of a pixel completely.
pub(super) fn sample(names: NameLookup, pixel: [u32; 2], sample: &Sample) -> String {
    let mut value = sample_value(names, sample);
    value["pixel"] = json!(pixel);
    print(&value)
}

fn print(value: &Value) -> String {
    format!("{value:#}\n")
}

fn type_value(of_type: &PathExpression) -> Value {
    json!({
        "expression": of_type.expression,
        "samples": of_type.samples,
        "luminance": of_type.luminance,
        "share_of_mean": of_type.share_of_mean,
        "variance": of_type.variance,
        "share_of_variance": of_type.share_of_variance,
    })
}

fn path_value(names: NameLookup, path: &LightPath) -> Value {
    let mut value = trace_value(names, &path.trace);
    value["sample"] = json!(path.sample);
    value["luminance"] = json!(path.luminance);
    value
}

fn sample_value(names: NameLookup, sample: &Sample) -> Value {
    let mut value = trace_value(names, &sample.trace);
    value["sample"] = json!(sample.number);
    value["weight"] = json!(sample.weight);
    value["radiance"] = json!(sample.radiance.to_array());
    value["refused"] = json!(sample.fault.map(|fault| fault.to_string()));
    value
}

fn trace_value(names: NameLookup, trace: &Trace) -> Value {
    let vertices = trace.vertices.iter().map(|v| vertex_value(names, v));
    let contributions = trace.contributions.iter().map(|c| contribution_value(names, trace, c));
    json!({
        "eye": trace.eye.to_array(),
        "direction": trace.direction.to_array(),
        "vertices": vertices.collect::<Vec<_>>(),
        "contributions": contributions.collect::<Vec<_>>(),
    })
}

fn thing_value(thing: &SceneItem) -> Value {
    json!({ "kind": thing.kind, "object": thing.object, "material": thing.material })
}

pub(super) fn vertex_value(names: NameLookup, vertex: &Vertex) -> Value {
    let place = match vertex.site {
        ScatterSite::Surface { primitive, lobe, .. } => json!({
            "surface": thing_value(&names.primitive(primitive)),
            "primitive": primitive,
            "lobe": lobe,
        }),
        ScatterSite::Medium { phase } => json!({ "phase": phase }),
    };
    let event = match vertex.event(false) {
        ScatterEvent::Diffuse => "D",
        ScatterEvent::Glossy => "G",
        ScatterEvent::Specular => "S",
        ScatterEvent::Volume => "V",
    };
    json!({
        "p": vertex.p.to_array(),
        "place": place,
        "throughput": vertex.throughput.to_array(),
        "departure": vertex.scatter.map(|departure| json!({
            "event": event,
            "direction": departure.direction.to_array(),
            "pdf": departure.pdf.map(|pdf| f64::from(pdf.get())),
            "weight": departure.weight.to_array(),
            "survival": departure.survival,
        })),
    })
}

fn contribution_value(names: NameLookup, trace: &Trace, contribution: &Contribution) -> Value {
    json!({
        "expression": expression(trace, contribution),
        "vertices": contribution.vertices,
        "value": contribution.value.to_array(),
        "removed": contribution.clamped,
        "source": source_value(names, &contribution.source),
    })
}

pub(super) fn source_value(names: NameLookup, source: &LightSource) -> Value {
    match source {
        LightSource::Emitter { p, primitive, radiance, weight, is_sampled } => json!({
            "kind": "emitter",
            "surface": thing_value(&names.primitive(*primitive)),
            "primitive": primitive,
            "p": p.to_array(),
            "radiance": radiance.to_array(),
            "weight": weight,
            "is_sampled": is_sampled,
        }),
        LightSource::Sky { direction, radiance, weight } => json!({
            "kind": "sky",
            "direction": direction.to_array(),
            "radiance": radiance.to_array(),
            "weight": weight,
        }),
        LightSource::Medium { medium, direction, radiance } => json!({
            "kind": "medium_emission",
            "medium": names.medium(*medium),
            "direction": direction.to_array(),
            "radiance": radiance.to_array(),
        }),
        LightSource::Light(light) => light_value(names, light),
        LightSource::Hemisphere { direction, pdf, samples } => json!({
            "kind": "hemisphere",
            "direction": direction.to_array(),
            "pdf": pdf.get(),
            "samples": samples,
        }),
    }
}

fn light_value(names: NameLookup, light: &SampledLight) -> Value {
    let (moves, number) = match light.light {
        LightRef::Static(number) => (false, number),
        LightRef::Animated(number) => (true, number),
    };
    json!({
        "kind": "light",
        "light": thing_value(&names.light(light)),
        "number": number,
        "moves": moves,
        "chosen": light.chosen.map(|chosen| json!({
            "number": chosen.number,
            "probability": chosen.probability,
        })),
        "direction": light.direction.to_array(),
        "distance": light.distance.is_finite().then_some(light.distance),
        "radiance": light.radiance.to_array(),
        "pdf": light.pdf.map(|pdf| f64::from(pdf.get())),
        "weight": light.weight,
        "samples": light.samples,
    })
}

fn cause_value(cause: Cause) -> Value {
    match cause {
        Cause::SeenLight => json!({ "kind": "seen light" }),
        Cause::Caustic { vertex } => json!({ "kind": "caustic", "vertex": vertex }),
        Cause::Unsampled => json!({ "kind": "light that is not sampled" }),
        Cause::Throughput { vertex, weight, times } => {
            json!({ "kind": "throughput", "vertex": vertex, "weight": weight, "times": times })
        }
        Cause::Radiance { times } => json!({ "kind": "radiance", "times": times }),
        Cause::Choice { probability, times } => {
            json!({ "kind": "choice", "probability": probability, "times": times })
        }
        Cause::Density { times } => json!({ "kind": "density", "times": times }),
        Cause::Scattering { times } => json!({ "kind": "scattering", "times": times }),
        Cause::Several => json!({ "kind": "several" }),
    }
}
