//! Explanations as a table: a row for each contribution.

use pathtracer::Session;
use pathtracer::explain::{
    Contribution, Explanation, Firefly, LightPath, NameLookup, Sample, Trace, expression,
};
use serde_json::{Value, json};

use super::json::{source_value, vertex_value};
use super::words::{advice, cause, source};

/// Rows of the brightest paths of a pixel, in descending order.
pub(super) fn explanation(
    names: NameLookup,
    session: &Session,
    explanation: &Explanation,
) -> Vec<Value> {
    let whole = explanation.luminance * explanation.samples.len() as f64;
    let row = |path: &LightPath| {
        let LightPath { sample, luminance, trace } = path;
        let contribution = trace.contributions.first()?;
        let mut row = row(names, trace, contribution);
        row["sample"] = json!(sample);
        row["luminance"] = json!(luminance);
        row["share"] = json!(luminance / whole);
        if let Some(firefly) = firefly_of(path, explanation) {
            row["cause"] = json!(cause(names, firefly));
            row["remedies"] = json!(advice(session, explanation, firefly));
        }
        Some(row)
    };
    explanation.brightest.iter().filter_map(row).collect()
}

/// Firefly whose largest contribution is that of a path.
fn firefly_of<'e>(path: &LightPath, explanation: &'e Explanation) -> Option<&'e Firefly> {
    let contribution = path.trace.contributions.first()?;
    explanation.fireflies.all.iter().find(|firefly| {
        let largest = &firefly.sample.trace.contributions[firefly.contribution];
        firefly.sample.number == path.sample
            && largest.vertices == contribution.vertices
            && largest.value == contribution.value
    })
}

/// Rows of all contributions of a sample.
pub(super) fn sample(names: NameLookup, sample: &Sample) -> Vec<Value> {
    let Sample { number, trace, weight, fault, .. } = sample;
    let luminance_of =
        |contribution: &Contribution| f64::from(contribution.value.luminance() * weight);
    let whole: f64 = trace.contributions.iter().map(luminance_of).sum();
    let row = |contribution: &Contribution| {
        let mut row = row(names, trace, contribution);
        let luminance = luminance_of(contribution);
        row["sample"] = json!(number);
        row["luminance"] = json!(luminance);
        row["share"] = json!(luminance / whole);
        row["refused"] = json!(fault.map(|fault| fault.to_string()));
        row
    };
    trace.contributions.iter().map(row).collect()
}

/// Row of a contribution, without what depends on the other ones.
fn row(names: NameLookup, trace: &Trace, contribution: &Contribution) -> Value {
    let of_source = source_value(names, &contribution.source);
    let item = of_source.get("surface").or(of_source.get("light")).unwrap_or(&Value::Null);
    let [r, g, b] = contribution.value.to_array();
    let radiance = &of_source["radiance"];
    let vertices = trace.vertices.iter().take(contribution.vertices);
    json!({
        "sample": null,
        "type": expression(trace, contribution),
        "luminance": null,
        "share": null,
        "r": r,
        "g": g,
        "b": b,
        "clamped": (contribution.clamped > 0.0).then_some(contribution.clamped),
        "vertices": contribution.vertices,
        "source": of_source["kind"],
        "light": source(names, &contribution.source),
        "object": item["object"],
        "material": item["material"],
        "is_light_sample": contribution.source.is_sampled(),
        "radiance_r": radiance[0],
        "radiance_g": radiance[1],
        "radiance_b": radiance[2],
        "mis_weight": of_source["weight"],
        "pdf": of_source["pdf"],
        "distance": of_source["distance"],
        "selection_probability": of_source["chosen"]["probability"],
        "light_samples": of_source["samples"],
        "path": vertices.map(|vertex| vertex_value(names, vertex)).collect::<Vec<_>>(),
        "cause": null,
        "remedies": null,
        "refused": null,
    })
}
