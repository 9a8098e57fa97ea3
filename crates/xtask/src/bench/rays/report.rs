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

/// Embree's default modes of queries.
const DEFAULT: [Who; 3] = [Who::Single, Who::Eight, Who::Sixteen];
const PACKETS: [Who; 2] = [Who::Eight, Who::Sixteen];
const QUERIES: [(QueryKind, &str); 2] =
    [(QueryKind::Closest, "closest hit"), (QueryKind::Any, "occlusion")];

/// Ratios: our single queries to Embree's default, the same to Embree's robust mode, and our
/// batches to Embree's best.
fn ratios(rates: &Rates) -> [f64; 3] {
    let single = rates.of(Who::Ours);
    [
        single / rates.of(Who::Single),
        single / rates.of(Who::Robust),
        rates.of(Who::OursBatch) / rates.best(&DEFAULT),
    ]
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
        let [default, robust, batch] = ratios(rates);
        println!(
            "  {:<8} {query:<12}{cells}   {default:>11.2}  {robust:>11.2}  {batch:>10.2}",
            kind.name()
        );
    }
}

/// Requirement on rates: a ratio of ours to theirs, as a geometric mean over meshes.
struct Bar {
    what: &'static str,
    kinds: &'static [RaySetKind],
    query: QueryKind,
    ratio: fn(&Rates) -> f64,
    asked: f64,
}

const ALL: &[RaySetKind] =
    &[RaySetKind::Primary, RaySetKind::Bounce, RaySetKind::Shadow, RaySetKind::Random];

const fn bar(
    what: &'static str,
    (kinds, query): (&'static [RaySetKind], QueryKind),
    ratio: fn(&Rates) -> f64,
    asked: f64,
) -> Bar {
    Bar { what, kinds, query, ratio, asked }
}

const BARS: [Bar; 9] = [
    bar("single / Embree single, closest hit", (ALL, QueryKind::Closest), |r| ratios(r)[0], 1.0),
    bar("single / Embree robust, closest hit", (ALL, QueryKind::Closest), |r| ratios(r)[1], 1.25),
    bar("single / Embree single, occlusion", (ALL, QueryKind::Any), |r| ratios(r)[0], 1.0),
    bar(
        "batch / best, bounce, closest hit",
        (&[RaySetKind::Bounce], QueryKind::Closest),
        best,
        1.2,
    ),
    bar("batch / best, bounce, occlusion", (&[RaySetKind::Bounce], QueryKind::Any), best, 1.2),
    bar(
        "batch / best, random, closest hit",
        (&[RaySetKind::Random], QueryKind::Closest),
        best,
        1.2,
    ),
    bar("batch / best, random, occlusion", (&[RaySetKind::Random], QueryKind::Any), best, 1.2),
    bar(
        "batch / packets, primary, closest hit",
        (&[RaySetKind::Primary], QueryKind::Closest),
        packets,
        1.0,
    ),
    bar(
        "batch / packets, primary, occlusion",
        (&[RaySetKind::Primary], QueryKind::Any),
        packets,
        1.0,
    ),
];

/// Minimum ratio for each mesh, whatever the mean.
const WORST: f64 = 0.9;

fn best(rates: &Rates) -> f64 {
    ratios(rates)[2]
}

fn packets(rates: &Rates) -> f64 {
    rates.of(Who::OursBatch) / rates.best(&PACKETS)
}

impl Bar {
    /// Geometric mean over the kinds of rays; NaN without any.
    fn on(&self, outcome: &MeshMeasurements) -> f64 {
        let of_kind = outcome.sets.iter().filter(|(kind, _)| self.kinds.contains(kind));
        geometric_mean(of_kind.map(|(_, rates)| (self.ratio)(&rates[self.query as usize])))
    }
}

/// Prints means over all meshes, each with its requirement.
pub(super) fn print_summary(outcomes: &[MeshMeasurements]) {
    println!("\ngeometric means over {} meshes, ours / theirs:", outcomes.len());
    let mut all = Vec::new();
    for bar in &BARS {
        let each: Vec<_> = outcomes.iter().map(|o| (o.name, bar.on(o))).collect();
        print_bar(bar.what, &each, bar.asked);
        all.extend(each);
    }
    if let Some((name, worst)) = least(&all) {
        let reached = verdict(worst >= WORST);
        println!("  worst mesh of all these: {worst:.2} ({name}), asked {WORST:.2}: {reached}");
    }
    let each = |ratio: fn(&Builds) -> f64| -> Vec<_> {
        outcomes.iter().map(|o| (o.name, ratio(&o.builds))).collect()
    };
    let speed = each(|b| b.medium[1] / b.ours[1]);
    print_bar("build speed / Embree medium, 2 threads", &speed, 1.0);
    let memory = each(|b| b.bytes[0] / b.bytes[1]);
    print_bar("Embree's bytes / ours", &memory, 1.0);
}

fn print_bar(what: &str, each: &[(&str, f64)], asked: f64) {
    let mean = geometric_mean(each.iter().map(|&(_, ratio)| ratio));
    let Some((name, worst)) = least(each) else { return };
    println!(
        "  {what:<40} {mean:>5.2}, asked {asked:.2}: {:<6}  least {worst:.2} ({name})",
        verdict(mean >= asked)
    );
}

/// Minimum of some ratios; NaN (not measured) is ignored.
fn least<'a>(each: &[(&'a str, f64)]) -> Option<(&'a str, f64)> {
    each.iter().copied().filter(|(_, ratio)| !ratio.is_nan()).min_by(|a, b| a.1.total_cmp(&b.1))
}

/// Geometric mean of the numbers that are not NaN; NaN without any.
fn geometric_mean(numbers: impl Iterator<Item = f64>) -> f64 {
    let logs: Vec<f64> = numbers.filter(|n| !n.is_nan()).map(f64::ln).collect();
    (logs.iter().sum::<f64>() / logs.len() as f64).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_leave_out_what_was_not_measured() {
        assert!((geometric_mean([2.0, f64::NAN, 8.0].into_iter()) - 4.0).abs() < 1e-12);
        assert!(geometric_mean(std::iter::empty()).is_nan());
        let each = [("a", 1.5), ("b", f64::NAN), ("c", 0.5)];
        assert_eq!(least(&each), Some(("c", 0.5)));
    }
}
