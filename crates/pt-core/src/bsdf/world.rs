//! The lobe of one surface point in world coordinates.

use pt_math::{Frame, Pdf, SolidAngle, Spectrum, Vec3};

use super::orientation::frame_of;
use super::{BsdfSample, LobeContext, LobeRecord, Orientation, Shadowing};

/// The lobe at one surface point, in world coordinates.
#[derive(Clone, Copy, Debug)]
pub struct Bsdf<'a> {
    frame: Frame,
    geometric_normal: Vec3,
    /// Cosine between `geometric_normal` and the normal of the frame.
    side: f32,
    shadowing: Shadowing,
    /// See [`Orientation::is_for_viewer`].
    is_for_viewer: bool,
    pub(super) wo: Vec3,
    pub(super) lobe: &'a LobeRecord,
    pub(super) context: LobeContext<'a>,
}

impl<'a> Bsdf<'a> {
    /// Creates the BSDF for scattering towards `wo` (world, unit).
    ///
    /// `normal` is the shading normal and `geometric_normal` the true one, both unit and on the
    /// same side of the surface. With `two_sided`, the back side scatters as the front side does.
    #[inline(always)]
    pub fn new(
        lobe: &'a LobeRecord,
        context: LobeContext<'a>,
        two_sided: bool,
        normal: Vec3,
        geometric_normal: Vec3,
        wo: Vec3,
    ) -> Self {
        let orientation = Orientation::plain(normal, None);
        Self::oriented(lobe, context, two_sided, orientation, geometric_normal, wo)
    }

    /// [`Self::new`] with a tangent along the surface.
    #[inline(always)]
    pub fn oriented(
        lobe: &'a LobeRecord,
        context: LobeContext<'a>,
        two_sided: bool,
        Orientation { normal, tangent, shadowing, is_for_viewer }: Orientation,
        geometric_normal: Vec3,
        wo: Vec3,
    ) -> Self {
        let behind = wo.dot(geometric_normal) < 0.0;
        let flip = if behind { -1.0 } else { 1.0 };
        let is_fiber = lobe.is_fiber();
        let visible = if is_fiber { normal * flip } else { make_visible(normal * flip, wo) };
        let front = if behind && !two_sided { -visible } else { visible };
        let frame = frame_of(front, tangent);
        // Fibres are not bounded by the plane of the surface.
        let geometric_normal = if is_fiber { frame.n } else { geometric_normal };
        let side = geometric_normal.dot(front);
        let wo = frame.to_local(wo);
        Self { frame, geometric_normal, side, shadowing, is_for_viewer, wo, lobe, context }
    }

    /// Replaces the geometric normal, which determines the side of directions, by another unit
    /// normal. Has no effect on fibres.
    #[inline]
    pub fn held_to(mut self, normal: Vec3) -> Self {
        if !self.lobe.is_fiber() {
            self.geometric_normal = normal;
            self.side = normal.dot(self.frame.n);
        }
        self
    }

    /// Returns true if the lobe is a Dirac delta, so that only [`Self::sample`] finds its
    /// directions.
    #[inline(always)]
    pub fn is_delta(&self) -> bool {
        self.lobe.is_delta()
    }

    /// See [`Lobe::STRAIGHT`](super::Lobe::STRAIGHT).
    pub fn is_straight(&self) -> bool {
        self.lobe.is_straight()
    }

    /// See [`Lobe::straight`](super::Lobe::straight).
    pub fn straight(&self) -> Spectrum {
        self.lobe.straight(self.context, self.wo)
    }

    /// Returns true if light that [`Self::sample`] scattered to `wi` (world) was transmitted
    /// undeflected.
    #[inline]
    pub fn lets_through(&self, wi: Vec3) -> bool {
        self.lobe.is_straight() && self.frame.to_local(wi).z * self.wo.z < 0.0
    }

    /// See [`Lobe::DIFFUSE`](super::Lobe::DIFFUSE).
    pub fn is_diffuse(&self) -> bool {
        self.lobe.is_diffuse()
    }

    /// Name of the lobe.
    pub fn lobe_name(&self) -> &'static str {
        self.lobe.name()
    }

    /// See [`Lobe::lobe_width`](super::Lobe::lobe_width).
    #[inline(always)]
    pub fn lobe_width(&self) -> f32 {
        self.lobe.lobe_width(self.context)
    }

    /// The BSDF of the same surface seen from the unit direction `wo` (world) on the same side;
    /// `None` if the surface may look different from there, or is not visible.
    #[inline(always)]
    pub fn with_wo(&self, wo: Vec3) -> Option<Self> {
        let local = self.frame.to_local(wo);
        let is_alike = !self.is_for_viewer && local.z > MIN_COSINE && self.is_consistent(wo, local);
        is_alike.then_some(Self { wo: local, ..*self })
    }

    /// Returns true if directions sampled for this viewer also serve another, for whom `other` is
    /// the BSDF of the same surface.
    #[inline(always)]
    pub fn is_similar_direction(&self, other: &Self) -> bool {
        serves(self.lobe.lobe_width(self.context), self.wo, other.wo)
    }

    /// f(wo, wi) · |cos θi|.
    #[inline(always)]
    pub fn eval(&self, wi: Vec3) -> Spectrum {
        let local = self.frame.to_local(wi);
        if self.is_consistent(wi, local) {
            self.lobe.eval(self.context, self.wo, local) * self.shadowing.visible(wi)
        } else {
            Spectrum::ZERO
        }
    }

    /// [`Self::eval`] and, unless that is zero, [`Self::pdf`].
    #[inline(always)]
    pub fn eval_and_pdf(&self, wi: Vec3) -> (Spectrum, Pdf<SolidAngle>) {
        let local = self.frame.to_local(wi);
        self.seen_value(wi, local, || self.lobe.eval_and_pdf(self.context, self.wo, local))
    }

    /// Value of the surface for `wi` and its density, from those of the lobe for the local
    /// direction.
    #[inline(always)]
    pub(super) fn seen_value(
        &self,
        wi: Vec3,
        local: Vec3,
        of_lobe: impl FnOnce() -> (Spectrum, Pdf<SolidAngle>),
    ) -> (Spectrum, Pdf<SolidAngle>) {
        if !self.is_consistent(wi, local) {
            return (Spectrum::ZERO, Pdf::ZERO);
        }
        let (f, pdf) = of_lobe();
        (f * self.shadowing.visible(wi), pdf)
    }

    /// Density with which [`Self::sample`] returns `wi`.
    #[inline(always)]
    pub fn pdf(&self, wi: Vec3) -> Pdf<SolidAngle> {
        self.lobe.pdf(self.context, self.wo, self.frame.to_local(wi))
    }

    /// Samples a direction (world) and its weight.
    #[inline(always)]
    pub fn sample(&self, u: [f32; 3]) -> Option<BsdfSample> {
        self.seen_sample(self.lobe.sample(self.context, self.wo, u)?)
    }

    /// Sample of the surface from that of the lobe.
    #[inline(always)]
    pub(super) fn seen_sample(&self, s: BsdfSample) -> Option<BsdfSample> {
        let wi = self.frame.to_world(s.wi);
        let weight = s.weight * self.shadowing.visible(wi);
        self.is_consistent(wi, s.wi).then_some(BsdfSample { wi, weight, ..s })
    }

    /// See [`Lobe::TRANSMITS`](super::Lobe::TRANSMITS).
    #[inline(always)]
    pub fn transmits(&self) -> bool {
        self.lobe.transmits()
    }

    /// Frame of the lobe.
    #[inline(always)]
    pub fn frame(&self) -> &Frame {
        &self.frame
    }

    /// Returns true if `wi` is on the same side of the geometric surface and of the shading frame.
    /// The sides may differ for interpolated shading normals; light would then leak through the
    /// surface.
    #[inline(always)]
    fn is_consistent(&self, wi: Vec3, local: Vec3) -> bool {
        wi.dot(self.geometric_normal) * local.z * self.side > 0.0
    }
}

/// Returns true if the distance of two unit directions above a surface is within the lobe width.
/// The limit decreases towards grazing angles: the normal of the facets that reflect from `wi` to
/// `a` turns by up to 1 / (2 cos θ) times as much as `a`.
#[inline(always)]
pub(super) fn serves(lobe_width: f32, a: Vec3, b: Vec3) -> bool {
    let least = lobe_width * a.z.min(b.z);
    (a - b).length_squared() <= least * least
}

/// Minimum cosine between the viewing direction and the shading normal.
const MIN_COSINE: f32 = 1e-3;

/// Turns the unit normal `n` by the minimum angle for which `wo`, which is on its side of the
/// surface, is not below it. Otherwise, lobes would be black where interpolated normals face away
/// from the camera.
#[inline(always)]
fn make_visible(n: Vec3, wo: Vec3) -> Vec3 {
    let cos = n.dot(wo);
    if cos >= MIN_COSINE { n } else { (n + wo * (MIN_COSINE - cos)).normalize() }
}
