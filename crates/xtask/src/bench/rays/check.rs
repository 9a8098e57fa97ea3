//! Comparison of the hits before any timing, with a decision about disagreements.
//!
//! The referee has no tolerance for rounding, so either may be judged wrong although it does as
//! specified: we place the outer edge of a sheet by rounded vertices, and Embree accepts a hit at
//! t = 0.

use anyhow::{Result, ensure};
use pt_bvh::Bvh;
use pt_math::Ray;
use rayon::prelude::*;

use super::embree::{self, EmbreeScene, Single};
use super::input::TriangleMesh;
use super::referee::{self, Claim};

/// Maximum number of disputed rays of a set that are judged, spread over all.
const MAX_JUDGED: usize = 2000;

/// Distance from the origin of a ray that counts as near, relative to the diagonal of the bounds.
const NEAR: f64 = 1e-3;

/// Result of a comparison.
#[derive(Debug, Default, PartialEq)]
pub(super) struct HitComparison {
    /// Number of rays on which the two disagree.
    pub(super) disputed: usize,
    /// Number of disputed rays that the referee judged.
    pub(super) judged: usize,
    /// Number of judged rays on which ours is wrong.
    pub(super) ours_wrong: usize,
    /// Number of those on which the correct hit is closer to the origin than [`NEAR`].
    pub(super) ours_near: usize,
    /// Number of judged rays on which Embree's robust mode is wrong.
    pub(super) theirs_wrong: usize,
}

/// Results of both for a ray: the nearest hit, and occlusion.
struct Answers {
    ours: (Claim, bool),
    theirs: (Claim, bool),
}

/// Compares our hits with those of Embree's robust mode on every ray, both nearest hits and
/// occlusion.
///
/// # Errors
/// If our four kinds of queries disagree with each other.
pub(super) fn compare(
    mesh: &TriangleMesh,
    bvh: &Bvh,
    robust: &EmbreeScene,
    rays: &[Ray],
) -> Result<HitComparison> {
    let ours = ours(bvh, rays)?;
    let single: Vec<Single> = rays.iter().map(embree::single).collect();
    let (mut hits, mut occluded) = (Vec::new(), Vec::new());
    robust.intersect(&single, |hit| hits.push(hit.map(|h| (h.t, h.primitive))));
    robust.occluded(&single, |hit| occluded.push(hit));
    let theirs = hits.into_iter().zip(occluded);
    let disputes: Vec<(&Ray, Answers)> = rays
        .iter()
        .zip(ours.into_iter().zip(theirs).map(|(ours, theirs)| Answers { ours, theirs }))
        .filter(|(_, a)| !referee::agree(a.ours.0, a.theirs.0) || a.ours.1 != a.theirs.1)
        .collect();
    Ok(judge(mesh, &disputes))
}

/// Our results for each ray.
fn ours(bvh: &Bvh, rays: &[Ray]) -> Result<Vec<(Claim, bool)>> {
    let (mut hits, mut occluded) = (Vec::new(), Vec::new());
    bvh.intersect_batch(rays, &mut hits);
    bvh.occluded_batch(rays, &mut occluded);
    for ((ray, hit), &any) in rays.iter().zip(&hits).zip(&occluded) {
        let same = bvh.intersect(ray) == *hit && hit.is_some() == any && bvh.occluded(ray) == any;
        ensure!(same, "our own queries disagree on {ray:?}");
    }
    let claims = hits.iter().map(|hit| hit.map(|h| (h.t, h.primitive)));
    Ok(claims.zip(occluded).collect())
}

fn judge(mesh: &TriangleMesh, disputes: &[(&Ray, Answers)]) -> HitComparison {
    let step = disputes.len().div_ceil(MAX_JUDGED).max(1);
    let near = NEAR * f64::from(mesh.bounds().diagonal().length());
    let judged: Vec<[bool; 3]> = disputes
        .par_iter()
        .step_by(step)
        .map(|(ray, answers)| {
            let truth = referee::nearest(mesh, ray);
            let wrong = |(claim, any): (Claim, bool)| {
                !referee::right(claim, truth) || any != truth.is_some()
            };
            let [ours, theirs] = [answers.ours, answers.theirs].map(wrong);
            [ours, theirs, ours && truth.is_some_and(|(t, _)| t < near)]
        })
        .collect();
    let count = |what: usize| judged.iter().filter(|found| found[what]).count();
    HitComparison {
        disputed: disputes.len(),
        judged: judged.len(),
        ours_wrong: count(0),
        theirs_wrong: count(1),
        ours_near: count(2),
    }
}

impl std::fmt::Display for HitComparison {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} disputed", self.disputed)?;
        if self.judged < self.disputed {
            write!(f, ", only {} of them judged", self.judged)?;
        }
        write!(f, ", ours wrong on {}", self.ours_wrong)?;
        if self.ours_near > 0 {
            write!(f, " ({} by a hit next to the origin)", self.ours_near)?;
        }
        write!(f, ", Embree robust on {}", self.theirs_wrong)
    }
}

#[cfg(test)]
mod tests {
    use pt_bvh::BuildOptions;
    use pt_math::Vec3;

    use super::super::shapes;
    use super::*;

    #[test]
    fn the_referee_reports_who_is_wrong() {
        let mesh = shapes::blob(8);
        let bvh = Bvh::build(mesh.geometry(), &BuildOptions::default()).unwrap();
        let rays: Vec<_> = (0..9)
            .map(|i| Ray::new(Vec3::new(0.1 * i as f32 - 0.4, 0.05, 5.0), -Vec3::Z))
            .collect();
        let ours = ours(&bvh, &rays).unwrap();
        assert!(ours.iter().all(|(claim, any)| claim.is_some() && *any));
        let missed = |ours| Answers { ours, theirs: (None, false) };
        let disputes: Vec<_> = rays.iter().zip(ours.into_iter().map(missed)).collect();
        let verdict = judge(&mesh, &disputes);
        assert_eq!(
            verdict,
            HitComparison { disputed: 9, judged: 9, ours_wrong: 0, ours_near: 0, theirs_wrong: 9 }
        );
    }
}
