//! Expansion of `lobes!` for the lines
//!
//! ```text
//! Diffuse = diffuse::Diffuse,
//! Measured = measured::Measured<'t>,
//! ```
//!
//! Items that the set of lobes has once stand under another name; `LobeKind` has further lobes. The
//! methods of blocks are left out, since neither lobe is in blocks.

use pt_math::{Pdf, SolidAngle, Spectrum, Vec3};

use super::diffuse::Diffuse;
use super::measured::Measured;
use super::{AnyLobe, BsdfSample, Lobe, LobeContext, LobeKind, LobeRecord};

/// `impl From<…> for LobeRecord`: the parameters of a lobe, and its number in the list.
fn diffuse_record(lobe: Diffuse) -> LobeRecord {
    LobeRecord { kind: LobeKind::Diffuse as u32, p: lobe.pack() }
}

fn measured_record(lobe: Measured<'_>) -> LobeRecord {
    LobeRecord { kind: LobeKind::Measured as u32, p: lobe.pack() }
}

/// [`LobeRecord::is_delta`]; other constants of lobes are looked up in the same way.
fn is_delta(record: &LobeRecord) -> bool {
    (record.kind == LobeKind::Diffuse as u32 && <Diffuse as Lobe<'_>>::DELTA)
        || (record.kind == LobeKind::Measured as u32 && <Measured as Lobe<'_>>::DELTA)
}

/// [`LobeRecord::eval`]. `run` inlines the first lobe, whose [`Lobe::INLINE`] is true, and calls
/// the second.
fn eval(record: &LobeRecord, context: LobeContext<'_>, wo: Vec3, wi: Vec3) -> Spectrum {
    if record.kind == LobeKind::Diffuse as u32 {
        return record.run::<Diffuse, _>(context, |lobe| lobe.eval(wo, wi));
    }
    if record.kind == LobeKind::Measured as u32 {
        return record.run::<Measured, _>(context, |lobe| lobe.eval(wo, wi));
    }
    Spectrum::ZERO
}

/// [`LobeRecord::pdf`].
fn pdf(record: &LobeRecord, context: LobeContext<'_>, wo: Vec3, wi: Vec3) -> Pdf<SolidAngle> {
    if record.kind == LobeKind::Diffuse as u32 {
        return record.run::<Diffuse, _>(context, |lobe| lobe.pdf(wo, wi));
    }
    if record.kind == LobeKind::Measured as u32 {
        return record.run::<Measured, _>(context, |lobe| lobe.pdf(wo, wi));
    }
    Pdf::ZERO
}

/// [`LobeRecord::eval_and_pdf`].
fn eval_and_pdf(
    record: &LobeRecord,
    context: LobeContext<'_>,
    wo: Vec3,
    wi: Vec3,
) -> (Spectrum, Pdf<SolidAngle>) {
    if record.kind == LobeKind::Diffuse as u32 {
        return record.run::<Diffuse, _>(context, |lobe| lobe.eval_and_pdf(wo, wi));
    }
    if record.kind == LobeKind::Measured as u32 {
        return record.run::<Measured, _>(context, |lobe| lobe.eval_and_pdf(wo, wi));
    }
    (Spectrum::ZERO, Pdf::ZERO)
}

/// [`LobeRecord::sample`].
fn sample(
    record: &LobeRecord,
    context: LobeContext<'_>,
    wo: Vec3,
    u: [f32; 3],
) -> Option<BsdfSample> {
    if record.kind == LobeKind::Diffuse as u32 {
        return record.run::<Diffuse, _>(context, |lobe| lobe.sample(wo, u));
    }
    if record.kind == LobeKind::Measured as u32 {
        return record.run::<Measured, _>(context, |lobe| lobe.sample(wo, u));
    }
    None
}

/// `AnyLobe::examples`, as records.
fn examples() -> Vec<LobeRecord> {
    let diffuse = Diffuse::examples().into_iter().map(diffuse_record);
    diffuse.chain(Measured::examples().into_iter().map(measured_record)).collect()
}

#[test]
fn the_macro_makes_what_is_written_out() {
    let (context, wo, wi) =
        (LobeContext::examples(), Vec3::new(0.6, 0.0, 0.8), Vec3::new(-0.48, 0.64, 0.6));
    let by_macro = AnyLobe::examples().into_iter();
    let by_macro = by_macro.filter(|l| matches!(l, AnyLobe::Diffuse(_) | AnyLobe::Measured(_)));
    let by_macro: Vec<_> = by_macro.map(|lobe| lobe.record()).collect();
    assert_eq!(by_macro, examples());
    for record in &by_macro {
        assert_eq!(record.is_delta(), is_delta(record));
        assert_eq!(record.eval(context, wo, wi), eval(record, context, wo, wi));
        assert_eq!(record.pdf(context, wo, wi).get(), pdf(record, context, wo, wi).get());
        let pairs = [record.eval_and_pdf(context, wo, wi), eval_and_pdf(record, context, wo, wi)];
        let [by_macro, by_hand] = pairs.map(|(f, pdf)| (f, pdf.get()));
        assert_eq!(by_macro, by_hand);
        let samples = [record.sample(context, wo, [0.3; 3]), sample(record, context, wo, [0.3; 3])];
        let [by_macro, by_hand] = samples.map(|s| s.map(|s| (s.wi, s.weight)));
        assert_eq!(by_macro, by_hand);
    }
}
