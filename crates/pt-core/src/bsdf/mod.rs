//! Surface scattering: the [`Lobe`] contract, the closed set of lobes, and [`Bsdf`], the lobes of
//! one surface point in world coordinates.
//!
//! To add a lobe: write `my_lobe.rs`, add one line to `lobes!` below. The laws of `laws.rs` then
//! hold it to its contract.

mod coated_conductor;
mod coated_diffuse;
mod conductor;
mod cs184;
mod dielectric;
mod diffuse;
mod diffuse_transmission;
mod eon;
pub mod fresnel;
mod fresnel_plastic;
mod hair;
#[cfg(test)]
mod laws;
mod measured;
mod metallic_roughness;
pub mod microfacet;
mod mirror;
mod multiscatter;
mod multiscatter_conductor;
mod multiscatter_dielectric;
mod orientation;
mod over_base;
mod principled;
mod refraction;
mod rough_coated_diffuse;
mod rough_dielectric;
mod rough_plastic;
mod shadowing;
mod thin_dielectric;

pub(crate) use coated_conductor::Layers;
pub use measured::{Gonioreflectometer, MeasuredTables, TabulatedLobe};
pub use metallic_roughness::emitted_through;
pub use orientation::Orientation;
use orientation::frame_of;
use pt_math::{Frame, Pdf, SolidAngle, Spectrum, Vec3};
pub use shadowing::Shadowing;

use crate::light::LightSampleContext;

/// A direction chosen by [`Lobe::sample`].
#[derive(Clone, Copy, Debug)]
pub struct BsdfSample {
    /// Sampled direction, pointing away from the surface.
    pub wi: Vec3,
    /// f(wo, wi) · |cos θi| / pdf — what the path's throughput is multiplied by.
    pub weight: Spectrum,
    /// Density of `wi`, or `None` for a Dirac delta, which has none: of a perfectly specular lobe,
    /// or the part of one that is so.
    pub pdf: Option<Pdf<SolidAngle>>,
    /// η² if the direction was refracted into a medium of relative index η, by which `weight` is
    /// divided; else 1. Since radiance gains it back on the way out, it says nothing about how
    /// much the path still matters.
    pub eta_scale: f32,
}

impl BsdfSample {
    /// A direction that was not refracted.
    #[inline(always)]
    pub fn new(wi: Vec3, weight: Spectrum, pdf: Option<Pdf<SolidAngle>>) -> Self {
        Self { wi, weight, pdf, eta_scale: 1.0 }
    }

    /// The same, refracted; see [`Self::eta_scale`].
    #[inline(always)]
    pub fn with_eta_scale(self, eta_scale: f32) -> Self {
        Self { eta_scale, ..self }
    }
}

/// Number of parameters of a stored lobe.
pub const PARAMETERS: usize = 31;

/// Some numbers, and zeros.
#[inline]
fn padded<const N: usize>(numbers: [f32; N]) -> [f32; PARAMETERS] {
    let mut p = [0.0; PARAMETERS];
    p[..N].copy_from_slice(&numbers);
    p
}

/// The spectrum that parameters have from `first` on.
#[inline(always)]
fn color(p: &[f32; PARAMETERS], first: usize) -> Spectrum {
    Spectrum::rgb(p[first], p[first + 1], p[first + 2])
}

/// Tables that lobes refer to.
#[derive(Debug, Default)]
pub struct LobeTables {
    /// Of measured materials.
    pub measured: Vec<MeasuredTables>,
}

/// One scattering lobe, in the local shading frame (+z is the normal).
///
/// Conventions, for all lobes: `wo` points to the camera side, `wi` to the light side, both away
/// from the surface; `eval` includes the cosine; `None` means "absorbed". A lobe that reflects
/// only is zero unless both directions are on the side of +z.
pub trait Lobe<'t>: Copy {
    /// True if [`Self::sample`] draws from Dirac deltas only; then `eval` and `pdf` are zero.
    const DELTA: bool;
    /// True if its functions are so short and so common that they belong into the loops of
    /// integrators. The others are called: among what a loop over lights does not change, compilers
    /// compute parts of all lobes ahead of it, whichever is there.
    const INLINE: bool = false;
    /// The parameters as numbers, the form that backends read.
    fn pack(&self) -> [f32; PARAMETERS];
    /// Inverse of [`Self::pack`]; `tables` are those to which it refers, if it refers to some.
    fn unpack(p: &[f32; PARAMETERS], tables: &'t LobeTables) -> Self;
    /// f(wo, wi) · |cos θi|; without its delta, which leaves nothing of a perfectly specular lobe.
    #[inline(always)]
    fn eval(&self, _wo: Vec3, _wi: Vec3) -> Spectrum {
        Spectrum::ZERO
    }
    /// Density with which [`Self::sample`] returns `wi`, likewise.
    #[inline(always)]
    fn pdf(&self, _wo: Vec3, _wi: Vec3) -> Pdf<SolidAngle> {
        Pdf::ZERO
    }
    /// Draws `wi` by a map from the unit square to directions, `u[0]` and `u[1]`; `u[2]` chooses
    /// the map where there are several and the choice has to wait for the other two. Fibres
    /// need all three for a direction.
    fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample>;
    /// The angle in radians by which `wo` may be turned, seen from the normal, without much change
    /// of what is reflected towards it (see [`Bsdf::is_similar_direction`]): infinite if
    /// nothing changes, 0 if light goes through or some is reflected into single directions.
    #[inline(always)]
    fn lobe_width(&self) -> f32 {
        0.0
    }
    /// Settings worth testing; the laws run on each.
    fn examples() -> Vec<Self>;
    /// True if f(wo, wi) = f(wi, wo), or f(wo, wi)/η² where light is refracted. Only the course's
    /// own models may say no, those of fibres, which do not know where on them light leaves,
    /// and what was measured.
    const RECIPROCAL: bool = true;
    /// True if it stands for all of something thin and round: light leaves on any side, whichever
    /// side the surface looks to, and normals that look away from the viewer are beyond its
    /// edge.
    const IS_FIBER: bool = false;
    /// True if light goes through the surface.
    const TRANSMITS: bool = false;
    /// True if light that goes through leaves as it came, so that what is behind is seen in its
    /// place.
    const STRAIGHT: bool = false;
    /// The share of light that goes straight on from `wo`.
    fn straight(&self, _wo: Vec3) -> Spectrum {
        Spectrum::ZERO
    }
    /// True if it scatters diffusely whatever it does not send into single directions.
    const DIFFUSE: bool = false;
}

/// A lobe as stored in the compiled scene.
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct LobeRecord {
    kind: u32,
    p: [f32; PARAMETERS],
}
const _: () = assert!(size_of::<LobeRecord>() == 128);

impl LobeRecord {
    /// The parameters, in the order in which the lobe packs them.
    pub(crate) fn parameters_mut(&mut self) -> &mut [f32; PARAMETERS] {
        &mut self.p
    }

    /// What `f` says of this lobe, in place or by a call as the lobe wants it.
    #[inline(always)]
    fn run<'t, L: Lobe<'t>, T>(&self, tables: &'t LobeTables, f: impl FnOnce(L) -> T) -> T {
        if L::INLINE { f(L::unpack(&self.p, tables)) } else { self.call(tables, f) }
    }

    #[inline(never)]
    fn call<'t, L: Lobe<'t>, T>(&self, tables: &'t LobeTables, f: impl FnOnce(L) -> T) -> T {
        f(L::unpack(&self.p, tables))
    }
}

macro_rules! lobes {
    ($($(#[$doc:meta])* $name:ident = $module:ident::$ty:ident $(<$tables:lifetime>)?),* $(,)?) => {
        $(pub use $module::$ty;)*

        #[repr(u32)]
        enum Kind { $($name),* }

        /// Any lobe: the closed set that backends match on.
        #[derive(Clone, Copy, Debug)]
        pub enum AnyLobe<'t> { $($(#[$doc])* $name($ty $(<$tables>)?)),* }

        $(impl<'t> From<$ty $(<$tables>)?> for AnyLobe<'t> {
            fn from(lobe: $ty $(<$tables>)?) -> Self { Self::$name(lobe) }
        })*

        impl LobeRecord {
            /// See [`Lobe::DELTA`].
            #[inline(always)]
            fn is_delta(&self) -> bool {
                $((self.kind == Kind::$name as u32 && <$ty as Lobe<'_>>::DELTA))||*
            }
            /// See [`Lobe::lobe_width`].
            #[inline(always)]
            fn lobe_width(&self, tables: &LobeTables) -> f32 {
                $(if self.kind == Kind::$name as u32 {
                    return self.run::<$ty, _>(tables, |lobe| lobe.lobe_width());
                })*
                0.0
            }
            /// See [`Lobe::TRANSMITS`].
            #[inline(always)]
            fn transmits(&self) -> bool {
                $((self.kind == Kind::$name as u32 && <$ty as Lobe<'_>>::TRANSMITS))||*
            }
            /// See [`Lobe::STRAIGHT`].
            #[inline(always)]
            fn is_straight(&self) -> bool {
                $((self.kind == Kind::$name as u32 && <$ty as Lobe<'_>>::STRAIGHT))||*
            }
            /// See [`Lobe::straight`].
            fn straight(&self, tables: &LobeTables, wo: Vec3) -> Spectrum {
                $(if self.kind == Kind::$name as u32 {
                    return self.run::<$ty, _>(tables, |lobe| lobe.straight(wo));
                })*
                Spectrum::ZERO
            }
            /// See [`Lobe::IS_FIBER`].
            #[inline(always)]
            fn is_fiber(&self) -> bool {
                $((self.kind == Kind::$name as u32 && <$ty as Lobe<'_>>::IS_FIBER))||*
            }
            /// See [`Lobe::DIFFUSE`].
            fn is_diffuse(&self) -> bool {
                $((self.kind == Kind::$name as u32 && <$ty as Lobe<'_>>::DIFFUSE))||*
            }
            /// Name of the lobe, as in `lobes!`.
            fn name(&self) -> &'static str {
                $(if self.kind == Kind::$name as u32 {
                    return stringify!($name);
                })*
                ""
            }
            /// See [`Lobe::eval`].
            #[inline(always)]
            fn eval(&self, tables: &LobeTables, wo: Vec3, wi: Vec3) -> Spectrum {
                $(if self.kind == Kind::$name as u32 {
                    return self.run::<$ty, _>(tables, |lobe| lobe.eval(wo, wi));
                })*
                Spectrum::ZERO
            }
            /// See [`Lobe::pdf`].
            #[inline(always)]
            fn pdf(&self, tables: &LobeTables, wo: Vec3, wi: Vec3) -> Pdf<SolidAngle> {
                $(if self.kind == Kind::$name as u32 {
                    return self.run::<$ty, _>(tables, |lobe| lobe.pdf(wo, wi));
                })*
                Pdf::ZERO
            }
            /// See [`Lobe::sample`].
            #[inline(always)]
            fn sample(&self, tables: &LobeTables, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
                $(if self.kind == Kind::$name as u32 {
                    return self.run::<$ty, _>(tables, |lobe| lobe.sample(wo, u));
                })*
                None
            }
        }

        impl<'t> AnyLobe<'t> {
            /// The stored form.
            pub fn record(&self) -> LobeRecord {
                match self {
                    $(Self::$name(l) => LobeRecord { kind: Kind::$name as u32, p: l.pack() }),*
                }
            }
            /// Inverse of [`Self::record`].
            ///
            /// # Panics
            /// On a kind that no lobe has, which only a bug can produce.
            #[inline(always)]
            pub fn from_record(r: &LobeRecord, tables: &'t LobeTables) -> Self {
                $(if r.kind == Kind::$name as u32 { return Self::$name($ty::unpack(&r.p, tables)); })*
                unreachable!("lobe kind {}", r.kind)
            }
            /// See [`Lobe::DELTA`].
            #[inline(always)]
            pub fn is_delta(&self) -> bool {
                match self { $(Self::$name(_) => <$ty as Lobe<'_>>::DELTA),* }
            }
            /// See [`Lobe::RECIPROCAL`].
            pub fn is_reciprocal(&self) -> bool {
                match self { $(Self::$name(_) => <$ty as Lobe<'_>>::RECIPROCAL),* }
            }
            /// See [`Lobe::lobe_width`].
            pub fn lobe_width(&self) -> f32 {
                match self { $(Self::$name(l) => l.lobe_width()),* }
            }
            /// See [`Lobe::TRANSMITS`].
            pub fn transmits(&self) -> bool {
                match self { $(Self::$name(_) => <$ty as Lobe<'_>>::TRANSMITS),* }
            }
            /// See [`Lobe::eval`].
            #[inline(always)]
            pub fn eval(&self, wo: Vec3, wi: Vec3) -> Spectrum {
                match self { $(Self::$name(l) => l.eval(wo, wi)),* }
            }
            /// See [`Lobe::pdf`].
            #[inline(always)]
            pub fn pdf(&self, wo: Vec3, wi: Vec3) -> Pdf<SolidAngle> {
                match self { $(Self::$name(l) => l.pdf(wo, wi)),* }
            }
            /// See [`Lobe::sample`].
            #[inline(always)]
            pub fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
                match self { $(Self::$name(l) => l.sample(wo, u)),* }
            }
            /// Example parameters of all lobes, for the laws; tables are those of
            /// [`LobeTables::examples`].
            pub fn examples() -> Vec<Self> {
                [$($ty::examples().into_iter().map(Self::$name).collect::<Vec<_>>()),*].concat()
            }
        }
    };
}

lobes! {
    /// Lambertian reflection.
    Diffuse = diffuse::Diffuse,
    /// Rough diffuse reflection.
    Eon = eon::Eon,
    /// Perfect mirror.
    Mirror = mirror::Mirror,
    /// Smooth dielectric interface.
    Dielectric = dielectric::Dielectric,
    /// Smooth interface that only refracts.
    Refraction = refraction::Refraction,
    /// Smooth metal.
    SmoothConductor = conductor::SmoothConductor,
    /// Thin pane of a dielectric.
    ThinDielectric = thin_dielectric::ThinDielectric,
    /// Rough dielectric interface.
    RoughDielectric = rough_dielectric::RoughDielectric,
    /// Rough dielectric interface that loses nothing between its facets.
    CompensatedDielectric = multiscatter_dielectric::CompensatedDielectric,
    /// Rough metal.
    RoughConductor = conductor::RoughConductor,
    /// Rough metal that loses nothing between its facets.
    CompensatedConductor = multiscatter_conductor::CompensatedConductor,
    /// Diffuse base under a smooth coat.
    CoatedDiffuse = coated_diffuse::CoatedDiffuse,
    /// Diffuse base under a rough coat.
    RoughCoatedDiffuse = rough_coated_diffuse::RoughCoatedDiffuse,
    /// Diffuse base below facets that light goes through once on each way.
    FresnelPlastic = fresnel_plastic::FresnelPlastic,
    /// Metal under a coat.
    CoatedConductor = coated_conductor::CoatedConductor,
    /// Diffuse base under a rough gloss.
    Glossy = rough_plastic::RoughPlastic,
    /// Material of many parameters.
    Principled = principled::Principled,
    /// The same of a thin sheet.
    PrincipledThin = principled::PrincipledThin,
    /// Material of metal and roughness.
    MetallicRoughness = metallic_roughness::MetallicRoughness,
    /// Lambertian reflection and transmission.
    DiffuseTransmission = diffuse_transmission::DiffuseTransmission,
    /// Fibres of hair and fur.
    Hair = hair::Hair,
    /// What was measured.
    Measured = measured::Measured<'t>,
    /// The course's glass.
    CourseGlass = cs184::Cs184Glass,
    /// The course's refraction.
    CourseRefraction = cs184::Cs184Refraction,
    /// The course's microfacet metal.
    CourseMicrofacet = cs184::Cs184Microfacet,
}

/// The scattering at one surface point, in world coordinates.
#[derive(Clone, Copy, Debug)]
pub struct Bsdf<'a> {
    frame: Frame,
    geometric_normal: Vec3,
    /// Cosine between `geometric_normal` and the normal of the frame.
    side: f32,
    shadowing: Shadowing,
    /// See [`Orientation::is_for_viewer`].
    is_for_viewer: bool,
    wo: Vec3,
    lobe: &'a LobeRecord,
    tables: &'a LobeTables,
}

impl<'a> Bsdf<'a> {
    /// The scattering of light towards `wo` (world, unit).
    ///
    /// `normal` is the shading normal and `geometric_normal` the true one, both unit and on the
    /// same side of the surface. With `two_sided` the back side scatters as the front side does.
    #[inline(always)]
    pub fn new(
        lobe: &'a LobeRecord,
        tables: &'a LobeTables,
        two_sided: bool,
        normal: Vec3,
        geometric_normal: Vec3,
        wo: Vec3,
    ) -> Self {
        let orientation = Orientation::plain(normal, None);
        Self::oriented(lobe, tables, two_sided, orientation, geometric_normal, wo)
    }

    /// [`Self::new`] with a direction along the surface.
    #[inline(always)]
    pub fn oriented(
        lobe: &'a LobeRecord,
        tables: &'a LobeTables,
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
        // Round things are not held to the plane of the surface.
        let geometric_normal = if is_fiber { frame.n } else { geometric_normal };
        let side = geometric_normal.dot(front);
        let wo = frame.to_local(wo);
        Self { frame, geometric_normal, side, shadowing, is_for_viewer, wo, lobe, tables }
    }

    /// The same with light held to the plane across another unit normal than the true one.
    #[inline]
    pub fn held_to(mut self, normal: Vec3) -> Self {
        if !self.lobe.is_fiber() {
            self.geometric_normal = normal;
            self.side = normal.dot(self.frame.n);
        }
        self
    }

    /// Returns true if only [`Self::sample`] finds its directions.
    #[inline(always)]
    pub fn is_delta(&self) -> bool {
        self.lobe.is_delta()
    }

    /// See [`Lobe::STRAIGHT`].
    pub fn is_straight(&self) -> bool {
        self.lobe.is_straight()
    }

    /// See [`Lobe::straight`].
    pub fn straight(&self) -> Spectrum {
        self.lobe.straight(self.tables, self.wo)
    }

    /// Returns true if light that [`Self::sample`] sent to `wi` (world) goes through as it came.
    #[inline]
    pub fn lets_through(&self, wi: Vec3) -> bool {
        self.lobe.is_straight() && self.frame.to_local(wi).z * self.wo.z < 0.0
    }

    /// See [`Lobe::DIFFUSE`].
    pub fn is_diffuse(&self) -> bool {
        self.lobe.is_diffuse()
    }

    /// What its lobe is called.
    pub fn lobe_name(&self) -> &'static str {
        self.lobe.name()
    }

    /// See [`Lobe::lobe_width`].
    #[inline(always)]
    pub fn lobe_width(&self) -> f32 {
        self.lobe.lobe_width(self.tables)
    }

    /// The same surface seen from the unit direction `wo` (world), on the same side; `None` where
    /// it might look otherwise, or is not seen.
    #[inline(always)]
    pub fn with_wo(&self, wo: Vec3) -> Option<Self> {
        let local = self.frame.to_local(wo);
        let is_alike = !self.is_for_viewer && local.z > MIN_COSINE && self.is_consistent(wo, local);
        is_alike.then_some(Self { wo: local, ..*self })
    }

    /// Returns true if directions that were drawn for this viewer serve another as well, to whom
    /// the same surface is `other`.
    #[inline(always)]
    pub fn is_similar_direction(&self, other: &Self) -> bool {
        serves(self.lobe.lobe_width(self.tables), self.wo, other.wo)
    }

    /// f(wo, wi) · |cos θi|.
    #[inline(always)]
    pub fn eval(&self, wi: Vec3) -> Spectrum {
        let local = self.frame.to_local(wi);
        if self.is_consistent(wi, local) {
            self.lobe.eval(self.tables, self.wo, local) * self.shadowing.visible(wi)
        } else {
            Spectrum::ZERO
        }
    }

    /// [`Self::eval`], and the density with which [`Self::sample`] returns `wi`.
    #[inline(always)]
    pub fn eval_and_pdf(&self, wi: Vec3) -> (Spectrum, Pdf<SolidAngle>) {
        let local = self.frame.to_local(wi);
        if self.is_consistent(wi, local) {
            (
                self.lobe.eval(self.tables, self.wo, local) * self.shadowing.visible(wi),
                self.lobe.pdf(self.tables, self.wo, local),
            )
        } else {
            (Spectrum::ZERO, Pdf::ZERO)
        }
    }

    /// Density with which [`Self::sample`] returns `wi`.
    #[inline(always)]
    pub fn pdf(&self, wi: Vec3) -> Pdf<SolidAngle> {
        self.lobe.pdf(self.tables, self.wo, self.frame.to_local(wi))
    }

    /// Draws a direction (world) and its weight.
    #[inline(always)]
    pub fn sample(&self, u: [f32; 3]) -> Option<BsdfSample> {
        let s = self.lobe.sample(self.tables, self.wo, u)?;
        let wi = self.frame.to_world(s.wi);
        let weight = s.weight * self.shadowing.visible(wi);
        self.is_consistent(wi, s.wi).then_some(BsdfSample { wi, weight, ..s })
    }

    /// What lights are told of this point, which is at `p`.
    #[inline(always)]
    pub fn light_sample_context(&self, p: Vec3) -> LightSampleContext {
        LightSampleContext::on_surface(p, self.frame.n, self.lobe.transmits())
    }

    /// The frame in which the lobe lives.
    #[inline(always)]
    pub fn frame(&self) -> &Frame {
        &self.frame
    }

    /// Returns true if the true surface and the shading agree on which side of it `wi` is. They
    /// differ where shading normals are interpolated; light there would leak through the
    /// surface.
    #[inline(always)]
    fn is_consistent(&self, wi: Vec3, local: Vec3) -> bool {
        wi.dot(self.geometric_normal) * local.z * self.side > 0.0
    }
}

/// Returns true if the distance of two unit directions above a surface is within its spread.
/// Towards grazing angles less will do: the normal of the facets that reflect from `wi` to `a`
/// turns by up to 1 / (2 cos θ) times as much as `a`.
#[inline(always)]
fn serves(lobe_width: f32, a: Vec3, b: Vec3) -> bool {
    let least = lobe_width * a.z.min(b.z);
    (a - b).length_squared() <= least * least
}

/// The least cosine between the direction from where a surface is seen and its shading normal.
const MIN_COSINE: f32 = 1e-3;

/// Turns the unit normal `n` just so far that `wo`, which sees the surface from its side, is not
/// below it. Where interpolated normals look away from the camera, lobes would otherwise be black.
#[inline(always)]
fn make_visible(n: Vec3, wo: Vec3) -> Vec3 {
    let cos = n.dot(wo);
    if cos >= MIN_COSINE { n } else { (n + wo * (MIN_COSINE - cos)).normalize() }
}
