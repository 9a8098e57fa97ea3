//! Lobes on surfaces in world space: frames, sides, and shading normals that differ from the true
//! normals.

use pt_math::{Pdf, Vec3};
use pt_testing::Random;

use super::{AnyLobe, all_lobes, close, unit_3d};
use crate::bsdf::{Bsdf, LobeContext, LobeRecord, Orientation, Shadowing};

/// A true normal, and a shading normal up to about 40 degrees from it.
fn normals(random: &mut Random) -> (Vec3, Vec3) {
    let true_normal = random.direction();
    (true_normal, (true_normal + random.in_cube() * 0.5).normalize())
}

/// Runs a law at random surface points for every lobe.
fn at_surfaces(law: impl Fn(&AnyLobe, bool, [Vec3; 3], &mut Random)) {
    for lobe in all_lobes() {
        let mut random = Random::new(7);
        for i in 0..200 {
            let (true_normal, normal) = normals(&mut random);
            let wo = random.direction();
            law(&lobe, i % 2 == 0, [normal, true_normal, wo], &mut random);
        }
    }
}

fn bsdf(lobe: &LobeRecord, two_sided: bool, [normal, true_normal, wo]: [Vec3; 3]) -> Bsdf<'_> {
    Bsdf::new(lobe, LobeContext::examples(), two_sided, normal, true_normal, wo)
}

/// The BSDF with a shadowing relief.
fn shadowed(lobe: &LobeRecord, [normal, true_normal, wo]: [Vec3; 3]) -> Bsdf<'_> {
    let shadowing = Shadowing::new(true_normal, normal);
    let orientation = Orientation { shadowing, ..Orientation::plain(normal, None) };
    Bsdf::oriented(lobe, LobeContext::examples(), true, orientation, true_normal, wo)
}

/// Lobes that do not transmit never carry light through the true surface, for any shading normal;
/// those that transmit cross it exactly when they do so in their own frame.
#[test]
fn light_does_not_leak_through_surfaces() {
    at_surfaces(|lobe, two_sided, v, random| {
        let record = lobe.record();
        let b = bsdf(&record, two_sided, v);
        let [_, true_normal, wo] = v;
        let crosses = |wi: Vec3| wi.dot(true_normal) * wo.dot(true_normal) < 0.0;
        for _ in 0..20 {
            let wi = random.direction();
            if crosses(wi) && !lobe.transmits() {
                assert!(b.eval(wi).is_black(), "{lobe:?} {v:?} {wi}");
            }
            let Some(s) = b.sample(unit_3d(random)) else { continue };
            assert!((s.wi.length() - 1.0).abs() < 1e-5, "{lobe:?} {v:?}: {s:?}");
            assert!(lobe.transmits() || !crosses(s.wi), "{lobe:?} {v:?}: {s:?}");
        }
    });
}

/// weight · pdf = eval in world space as in the local frame, with and without a shadowing relief.
#[test]
fn weight_times_pdf_is_eval_in_the_world() {
    at_surfaces(|lobe, two_sided, v, random| {
        let record = lobe.record();
        let (plain, shadowed) = (bsdf(&record, two_sided, v), shadowed(&record, v));
        for i in 0..40 {
            let b = if i % 2 == 0 { plain } else { shadowed };
            let Some(s) = b.sample(unit_3d(random)) else { continue };
            let Some(pdf) = s.pdf else { continue };
            // Grazing light: the half vector is accurate to 2⁻²³ / 2 cos θ only, and facets vary
            // within α. For an error of 1 % in the density, cos θ is at least 2⁻²³ / 0.01 α; the
            // minimum α is 0.001.
            if b.wo.z.abs() < 0.012 {
                continue;
            }
            let (f, p) = (b.eval(s.wi), b.pdf(s.wi).get());
            let both = b.eval_and_pdf(s.wi);
            assert_eq!(both.0, f, "{lobe:?} {v:?}: {s:?}");
            assert!(f.is_black() || both.1.get() == p, "{lobe:?} {v:?}: {s:?} {p}");
            assert!((p - pdf.get()).abs() <= 0.02 * p, "{lobe:?} {v:?}: {s:?} {p}");
            assert!(close(f, s.weight * pdf.get(), 0.02), "{lobe:?} {v:?}: {s:?} {f:?}");
        }
    });
}

/// The back of a two-sided surface is its front with both normals flipped; the back of a one-sided
/// surface is black, unless it transmits.
#[test]
fn sides_are_those_of_the_true_normal() {
    at_surfaces(|lobe, _, [normal, true_normal, wo], random| {
        let behind = wo.dot(true_normal) < 0.0;
        let record = lobe.record();
        let turned = bsdf(&record, true, [-normal, -true_normal, wo]);
        let (two, one) = (
            bsdf(&record, true, [normal, true_normal, wo]),
            bsdf(&record, false, [normal, true_normal, wo]),
        );
        let (wi, u) = (random.direction(), unit_3d(random));
        assert!(close(two.eval(wi), turned.eval(wi), 1e-3), "{lobe:?} {wo} {wi}");
        if behind && !lobe.transmits() {
            assert!(one.eval(wi).is_black() && one.sample(u).is_none(), "{lobe:?} {wo} {wi}");
        }
    });
}

/// With a shadowing relief, directions are sampled as without it, and each weight is multiplied by
/// the visible fraction of the light: at most 1, so that no lobe scatters more than without.
#[test]
fn shadowing_takes_light_away_and_moves_none() {
    at_surfaces(|lobe, _, v, random| {
        let [normal, true_normal, _] = v;
        let record = lobe.record();
        let (plain, shadowed) = (bsdf(&record, true, v), shadowed(&record, v));
        let shadowing = Shadowing::new(true_normal, normal);
        let u = unit_3d(random);
        match (plain.sample(u), shadowed.sample(u)) {
            (Some(a), Some(b)) => {
                let share = shadowing.visible(a.wi);
                assert!((0.0..=1.0).contains(&share), "{lobe:?} {v:?} {share}");
                let pdfs = [a.pdf, b.pdf].map(|pdf| pdf.map(Pdf::get));
                assert_eq!((a.wi, pdfs[0]), (b.wi, pdfs[1]), "{lobe:?} {v:?}");
                assert_eq!(a.weight * share, b.weight, "{lobe:?} {v:?}");
            }
            (a, b) => assert!(a.is_none() && b.is_none(), "{lobe:?} {v:?}"),
        }
    });
}
