//! Printed results, and requirements.

use super::super::measure::verdict;
use super::input::TriangleMesh;
use super::race::{Builds, COMPETITORS, QueryKind, Rates, Who};
use super::sets::RaySetKind;

/// Measurements on a mesh.
pub(super) struct MeshMeasurements {
    pub(super) name: &'static str,
    /// Rates of nearest hits and of occlusion.
    pub(super) sets: Vec<(RaySetKind, [Rates; 2])>,
    pub(super) builds: Builds,
}

/// Embree's queries of single rays, on its trees of medium and of high quality, without flags.
const SINGLE: [Who; 2] = [Who::Single, Who::High];
/// All of Embree's queries on these trees.
const DEFAULT: [Who; 6] =
    [Who::Single, Who::Eight, Who::Sixteen, Who::High, Who::HighEight, Who::HighSixteen];
const QUERIES: [(QueryKind, &str); 2] =
    [(QueryKind::Closest, "closest hit"), (QueryKind::Any, "occlusion")];

/// Our single queries over the better of Embree's on both trees.
fn single(rates: &Rates) -> f64 {
    rates.of(Who::Ours) / rates.best(&SINGLE)
}

/// Our single queries over Embree's robust mode.
fn robust(rates: &Rates) -> f64 {
    rates.of(Who::Ours) / rates.of(Who::Robust)
}

/// Our batches over the best of Embree's single rays and packets on both trees.
fn batch(rates: &Rates) -> f64 {
    rates.of(Who::OursBatch) / rates.best(&DEFAULT)
}

/// Prints times and memory of the builds of a mesh.
pub(super) fn print_builds(mesh: &TriangleMesh, builds: &Builds) {
    let triangles = mesh.triangles.len() as f64;
    let ms = |seconds: [f64; 2]| {
        let [one, two] = seconds.map(|s| s * 1e3);
        format!("{one:.1} / {two:.1} ms")
    };
    println!(
        "  build with 1 / 2 threads: Embree medium {}, high {}, ours {}",
        ms(builds.medium),
        ms(builds.high),
        ms(builds.ours)
    );
    let [theirs, ours] = builds.bytes.map(|bytes| bytes / triangles);
    println!("  bytes per triangle: Embree {theirs:.1}, ours {ours:.1}");
}

/// Prints the headings of the table of rates.
pub(super) fn print_heading() {
    let heads = COMPETITORS.map(|(_, head)| format!("{head:>8}")).concat();
    println!("  Mrays/s, 1 thread    {heads}   ours/single  ours/robust  batch/best");
}

/// Prints one line of rates for nearest hits, and one for occlusion.
pub(super) fn print_rates(kind: RaySetKind, rates: &[Rates; 2]) {
    for ((_, query), rates) in QUERIES.iter().zip(rates) {
        let cells = COMPETITORS.map(|(who, _)| format!("{:>8.2}", rates.of(who))).concat();
        let [single, robust, batch] = [single, robust, batch].map(|ratio| ratio(rates));
        println!(
            "  {:<8} {query:<12}{cells}   {single:>11.2}  {robust:>11.2}  {batch:>10.2}",
            kind.name()
        );
    }
}

/// Ratio of ours to theirs with a requirement, which each mesh and the median have to reach.
struct Bar {
    name: &'static str,
    ratio: fn(&Rates) -> f64,
    asked: f64,
}

const BARS: [Bar; 3] = [
    Bar { name: "single rays", ratio: single, asked: 1.0 },
    Bar { name: "single rays / robust mode", ratio: robust, asked: 1.25 },
    Bar { name: "batches / best", ratio: batch, asked: 1.2 },
];

const KINDS: [RaySetKind; 4] =
    [RaySetKind::Primary, RaySetKind::Bounce, RaySetKind::Shadow, RaySetKind::Random];

/// Prints the ratios over all meshes, each with its requirement.
pub(super) fn print_summary(outcomes: &[MeshMeasurements]) {
    println!("\nours / theirs over {} meshes:", outcomes.len());
    println!("  {:<46} least; median, mean, and mean without the least and the greatest", "");
    for bar in &BARS {
        for (query, name) in QUERIES {
            for kind in KINDS {
                let of_mesh = |outcome: &MeshMeasurements| {
                    let rates = outcome.sets.iter().find(|(set, _)| *set == kind)?.1;
                    Some((outcome.name, (bar.ratio)(&rates[query as usize])))
                };
                let each: Vec<_> = outcomes.iter().filter_map(of_mesh).collect();
                let what = format!("{}, {}, {name}", bar.name, kind.name());
                print_bar(&what, &each, bar.asked);
            }
        }
    }
    let each = |ratio: fn(&Builds) -> f64| -> Vec<_> {
        outcomes.iter().map(|o| (o.name, ratio(&o.builds))).collect()
    };
    print_bar("build, 2 threads / medium", &each(|b| b.medium[1] / b.ours[1]), 1.0);
    print_bar("Embree's bytes / ours", &each(|b| b.bytes[0] / b.bytes[1]), 1.0);
}

fn print_bar(what: &str, each: &[(&str, f64)], asked: f64) {
    let mut sorted = each.to_vec();
    sorted.sort_by(|a, b| a.1.total_cmp(&b.1));
    let Some(&(name, least)) = sorted.first() else { return };
    let ratios: Vec<_> = sorted.iter().map(|&(_, ratio)| ratio).collect();
    let median = median(&ratios);
    let inner = if ratios.len() > 2 { &ratios[1..ratios.len() - 1] } else { &ratios[..] };
    let reached = verdict(least >= asked && median >= asked);
    println!(
        "  {what:<46} {least:>5.2} {name:<11} {median:>5.2}  {:>5.2}  {:>5.2}, asked {asked:.2}: \
         {reached}",
        geometric_mean(&ratios),
        geometric_mean(inner)
    );
}

/// Median of ratios in ascending order; the geometric mean of the middle two of an even number.
fn median(sorted: &[f64]) -> f64 {
    let middle = sorted.len() / 2;
    if sorted.len() % 2 == 1 {
        sorted[middle]
    } else {
        geometric_mean(&sorted[middle - 1..=middle])
    }
}

/// Geometric mean; NaN without any.
fn geometric_mean(ratios: &[f64]) -> f64 {
    (ratios.iter().map(|ratio| ratio.ln()).sum::<f64>() / ratios.len() as f64).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_are_between_the_middle_two() {
        assert_eq!(median(&[0.5, 2.0, 9.0]), 2.0);
        assert!((median(&[0.5, 2.0, 8.0, 9.0]) - 4.0).abs() < 1e-12);
        assert!(geometric_mean(&[]).is_nan());
    }
}
