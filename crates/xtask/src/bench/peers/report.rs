//! Table of a scene, and requirements on our numbers.

use super::compare::ImageDifference;
use super::race::ResourceUse;
use crate::bench::measure::verdict;

/// Result of a renderer on a scene.
#[derive(Clone, Copy)]
pub(super) struct ReportRow {
    pub(super) name: &'static str,
    pub(super) taken: ResourceUse,
    pub(super) difference: ImageDifference,
}

/// Our modes: name, and side of the squares of pixels that reuse paths.
pub(super) const OURS: [(&str, u32); 3] =
    [("pathtracer", 1), ("pathtracer 2x2", 2), ("pathtracer 4x4", 4)];

/// Required efficiency, relative to the best peer.
const FACTOR: f64 = 2.0;
/// Required time to the first sample, relative to the fastest peer.
const START_SHARE: f64 = 0.5;
/// A peer whose mean differs by more has rendered another scene: its noise is not comparable.
const MAX_OFF: f64 = 0.01;

impl ReportRow {
    /// 1 / (relMSE · s): proportional to the number of images of a given noise per unit of time.
    fn efficiency(&self) -> f64 {
        1.0 / (self.difference.relative_mse * self.taken.cpu)
    }

    /// The same efficiency for means of squares of pixels.
    fn coarse_efficiency(&self) -> f64 {
        1.0 / (self.difference.coarse_mse * self.taken.cpu)
    }

    fn is_alike(&self) -> bool {
        self.difference.mean_ratio.iter().all(|r| (r - 1.0).abs() <= MAX_OFF)
    }
}

/// Prints our rows, those of the peers, and verdicts.
pub(super) fn print(ours: &[ReportRow], peers: &[ReportRow]) {
    let best = ours.iter().map(ReportRow::efficiency).fold(0.0, f64::max);
    println!(
        "  {:<20} {:>7} {:>7} {:>9} {:>10} {:>6} {:>9} {:>7} {:>6} {:>7} {:>20}",
        "renderer",
        "s",
        "wall s",
        "relMSE",
        "efficiency",
        "ours/",
        "of 8x8",
        "start s",
        "import",
        "MB",
        "mean over reference"
    );
    for row in ours.iter().chain(peers) {
        let ReportRow { name, taken, difference } = row;
        let [r, g, b] = difference.mean_ratio;
        println!(
            "  {name:<20} {:>7.2} {:>7.2} {:>9.6} {:>10.2} {:>6.2} {:>9.1} {:>7.2} {:>6.2} {:>7.0} \
             {r:>6.4} {g:>6.4} {b:>6.4}{}",
            taken.cpu,
            taken.wall,
            difference.relative_mse,
            row.efficiency(),
            best / row.efficiency(),
            row.coarse_efficiency(),
            taken.start,
            taken.imports,
            taken.peak_bytes * 1e-6,
            if row.is_alike() { "" } else { "  differs: not ranked" }
        );
    }
    for bar in bars(ours, peers) {
        println!("  {bar}");
    }
}

/// Requirements with their verdicts; empty without peers. Efficiency is required of each of our
/// modes, start and memory of the slowest and largest one.
fn bars(ours: &[ReportRow], peers: &[ReportRow]) -> Vec<String> {
    let best = peers.iter().filter(|p| p.is_alike()).max_by(|a, b| by(ReportRow::efficiency, a, b));
    let quick = peers.iter().min_by(|a, b| by(|p| p.taken.start, a, b));
    let bare: fn(&ReportRow) -> f64 = |row| row.taken.start - row.taken.imports;
    let bare_quick = peers.iter().min_by(|a, b| by(bare, a, b));
    let small = peers.iter().min_by(|a, b| by(|p| p.taken.peak_bytes, a, b));
    let say = |what: &str, peer: &str, ratio: f64, asked: &str, reached: bool| {
        format!("{what} {ratio:.2} times that of {peer}, asked {asked}: {}", verdict(reached))
    };
    let efficiency = best.into_iter().flat_map(|best| {
        ours.iter().map(move |row| {
            let ratio = row.efficiency() / best.efficiency();
            let what = format!("efficiency of {}", row.name);
            say(&what, best.name, ratio, "2, better 3", ratio >= FACTOR)
        })
    });
    let most = |number: fn(&ReportRow) -> f64| ours.iter().map(number).fold(0.0, f64::max);
    let start = quick.map(|quick| {
        let ratio = most(|row| row.taken.start) / quick.taken.start;
        say("start", quick.name, ratio, "at most 0.5", ratio <= START_SHARE)
    });
    let bare_start = bare_quick.map(|quick| {
        let ratio = most(bare) / bare(quick);
        say("start without imports", quick.name, ratio, "at most 0.5", ratio <= START_SHARE)
    });
    let memory = small.map(|small| {
        let ratio = most(|row| row.taken.peak_bytes) / small.taken.peak_bytes;
        say("memory", small.name, ratio, "below 1", ratio < 1.0)
    });
    efficiency.chain([start, bare_start, memory].into_iter().flatten()).collect()
}

/// Compares two rows by a number.
fn by(number: impl Fn(&ReportRow) -> f64, a: &ReportRow, b: &ReportRow) -> std::cmp::Ordering {
    number(a).total_cmp(&number(b))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(name: &'static str, cpu: f64, relative_mse: f64, mean: f64) -> ReportRow {
        let taken = ResourceUse { wall: cpu, cpu, start: cpu, imports: 0.0, peak_bytes: 1e8 * cpu };
        let difference =
            ImageDifference { relative_mse, coarse_mse: 0.1 * relative_mse, mean_ratio: [mean; 3] };
        ReportRow { name, taken, difference }
    }

    #[test]
    fn a_peer_that_shows_another_scene_is_not_ranked() {
        let ours = [row("ours", 1.0, 0.001, 1.0), row("better", 1.0, 0.0005, 1.0)];
        let peers = [row("alike", 2.0, 0.002, 1.001), row("other", 1.0, 0.0001, 1.02)];
        let said = bars(&ours, &peers);
        assert_eq!(said[0], "efficiency of ours 4.00 times that of alike, asked 2, better 3: ok");
        assert_eq!(said[1], "efficiency of better 8.00 times that of alike, asked 2, better 3: ok");
        assert_eq!(said[2], "start 1.00 times that of other, asked at most 0.5: MISSED");
        assert_eq!(said[4], "memory 1.00 times that of other, asked below 1: MISSED");
        assert_eq!(said.len(), 5);
        assert!(bars(&ours, &[]).is_empty());
    }
}
