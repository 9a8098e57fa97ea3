//! Surface scattering: the [`Lobe`] contract, the closed set of lobes, and [`Bsdf`], the lobe of
//! one surface point in world coordinates.
//!
//! To add a lobe: write `my_lobe.rs`, and add one line to `lobes!` below. The laws of `laws.rs`
//! then check that it fulfils its contract.

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
    /// f(wo, wi) · |cos θi| / pdf: the factor of the path's throughput.
    pub weight: Spectrum,
    /// Density of `wi`, or `None` for a Dirac delta, which may be the whole lobe or a part of it.
    pub pdf: Option<Pdf<SolidAngle>>,
    /// η² if the direction was refracted into a medium of relative index η, by which `weight` is
    /// divided; otherwise 1. Radiance regains this factor when the path leaves the medium, so it is
    /// no measure of the importance of the path.
    pub eta_scale: f32,
}

impl BsdfSample {
    /// Creates a sample that was not refracted.
    #[inline(always)]
    pub fn new(wi: Vec3, weight: Spectrum, pdf: Option<Pdf<SolidAngle>>) -> Self {
        Self { wi, weight, pdf, eta_scale: 1.0 }
    }

    /// Sets the [`Self::eta_scale`] of a refracted direction.
    #[inline(always)]
    pub fn with_eta_scale(self, eta_scale: f32) -> Self {
        Self { eta_scale, ..self }
    }
}

/// Maximum number of parameters of a stored lobe.
pub const PARAMETERS: usize = 31;

/// Pads packed parameters with zeros.
#[inline]
fn padded<const N: usize>(numbers: [f32; N]) -> [f32; PARAMETERS] {
    let mut p = [0.0; PARAMETERS];
    p[..N].copy_from_slice(&numbers);
    p
}

/// The spectrum that begins at parameter `first`.
#[inline(always)]
fn color(p: &[f32; PARAMETERS], first: usize) -> Spectrum {
    Spectrum::rgb(p[first], p[first + 1], p[first + 2])
}

/// Tables to which lobes refer.
#[derive(Debug, Default)]
pub struct LobeTables {
    /// Tables of measured materials.
    pub measured: Vec<MeasuredTables>,
}

/// One scattering lobe, in the local shading frame (+z is the normal).
///
/// Conventions of all lobes: `wo` points to the camera side, `wi` to the light side, both away from
/// the surface; `eval` includes the cosine; `None` means "absorbed". A lobe without transmission is
/// zero unless both directions are on the side of +z.
pub trait Lobe<'t>: Copy {
    /// True if [`Self::sample`] samples Dirac deltas only; then `eval` and `pdf` are zero.
    const DELTA: bool;
    /// True if the functions of the lobe are so short and so common that they are inlined into the
    /// loops of integrators. The others are called: otherwise, compilers hoist loop-invariant parts
    /// of all lobes out of a loop over lights, whichever lobe is evaluated.
    const INLINE: bool = false;
    /// Packs the parameters into numbers, the form that backends read.
    fn pack(&self) -> [f32; PARAMETERS];
    /// Inverse of [`Self::pack`], for a lobe that refers to `tables`, if to any.
    fn unpack(p: &[f32; PARAMETERS], tables: &'t LobeTables) -> Self;
    /// f(wo, wi) · |cos θi| without Dirac deltas; zero for a perfectly specular lobe.
    #[inline(always)]
    fn eval(&self, _wo: Vec3, _wi: Vec3) -> Spectrum {
        Spectrum::ZERO
    }
    /// Density with which [`Self::sample`] returns `wi`, without Dirac deltas.
    #[inline(always)]
    fn pdf(&self, _wo: Vec3, _wi: Vec3) -> Pdf<SolidAngle> {
        Pdf::ZERO
    }
    /// Samples `wi` by a map from the unit square, `u[0]` and `u[1]`, to directions. `u[2]` selects
    /// the map if there are several and the choice depends on the other two. Hair needs all three
    /// numbers for a direction.
    fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample>;
    /// Angle in radians, seen from the normal, by which `wo` may change without much change of the
    /// lobe (see [`Bsdf::is_similar_direction`]): infinite for no change, 0 for lobes with
    /// transmission or Dirac deltas.
    #[inline(always)]
    fn lobe_width(&self) -> f32 {
        0.0
    }
    /// Example parameters for the laws.
    fn examples() -> Vec<Self>;
    /// True if f(wo, wi) = f(wi, wo), or f(wo, wi)/η² for refraction. It may be false only for the
    /// models of the course, for hair, which does not determine the offset at which light leaves,
    /// and for measured materials.
    const RECIPROCAL: bool = true;
    /// True if the lobe represents all of a thin fibre: light leaves on any side, regardless of the
    /// orientation of the surface, and normals that face away from the viewer are beyond its edge.
    const IS_FIBER: bool = false;
    /// True if the surface transmits light.
    const TRANSMITS: bool = false;
    /// True if transmitted light is not deflected, so that objects behind the surface are seen in
    /// place.
    const STRAIGHT: bool = false;
    /// Transmittance of undeflected light from `wo`.
    fn straight(&self, _wo: Vec3) -> Spectrum {
        Spectrum::ZERO
    }
    /// True if all scattering except into Dirac deltas is diffuse.
    const DIFFUSE: bool = false;
}

/// A lobe in the compiled scene.
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct LobeRecord {
    kind: u32,
    p: [f32; PARAMETERS],
}
const _: () = assert!(size_of::<LobeRecord>() == 128);

impl LobeRecord {
    /// Parameters in the order of [`Lobe::pack`].
    pub(crate) fn parameters_mut(&mut self) -> &mut [f32; PARAMETERS] {
        &mut self.p
    }

    /// Calls `f` with the lobe, inlined or not according to [`Lobe::INLINE`].
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
            /// Name of the lobe in `lobes!`.
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
            /// Converts the lobe to its stored form.
            pub fn record(&self) -> LobeRecord {
                match self {
                    $(Self::$name(l) => LobeRecord { kind: Kind::$name as u32, p: l.pack() }),*
                }
            }
            /// Inverse of [`Self::record`].
            ///
            /// # Panics
            /// If no lobe has this kind, which only a bug can cause.
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
            /// Example parameters of all lobes, for the laws; they refer to the tables of
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
    /// Rough dielectric interface with multiple scattering.
    CompensatedDielectric = multiscatter_dielectric::CompensatedDielectric,
    /// Rough metal.
    RoughConductor = conductor::RoughConductor,
    /// Rough metal with multiple scattering.
    CompensatedConductor = multiscatter_conductor::CompensatedConductor,
    /// Diffuse base under a smooth coat.
    CoatedDiffuse = coated_diffuse::CoatedDiffuse,
    /// Diffuse base under a rough coat.
    RoughCoatedDiffuse = rough_coated_diffuse::RoughCoatedDiffuse,
    /// Diffuse base below a rough dielectric interface that light crosses once in each direction.
    FresnelPlastic = fresnel_plastic::FresnelPlastic,
    /// Metal under a coat.
    CoatedConductor = coated_conductor::CoatedConductor,
    /// Diffuse base under a rough specular layer.
    Glossy = rough_plastic::RoughPlastic,
    /// Principled material.
    Principled = principled::Principled,
    /// Principled material of thin sheets.
    PrincipledThin = principled::PrincipledThin,
    /// Metallic-roughness material of glTF.
    MetallicRoughness = metallic_roughness::MetallicRoughness,
    /// Lambertian reflection and transmission.
    DiffuseTransmission = diffuse_transmission::DiffuseTransmission,
    /// Fibres of hair and fur.
    Hair = hair::Hair,
    /// Measured material.
    Measured = measured::Measured<'t>,
    /// The course's glass.
    CourseGlass = cs184::Cs184Glass,
    /// The course's refraction.
    CourseRefraction = cs184::Cs184Refraction,
    /// The course's microfacet metal.
    CourseMicrofacet = cs184::Cs184Microfacet,
}

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
    wo: Vec3,
    lobe: &'a LobeRecord,
    tables: &'a LobeTables,
}

impl<'a> Bsdf<'a> {
    /// Creates the BSDF for scattering towards `wo` (world, unit).
    ///
    /// `normal` is the shading normal and `geometric_normal` the true one, both unit and on the
    /// same side of the surface. With `two_sided`, the back side scatters as the front side does.
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

    /// [`Self::new`] with a tangent along the surface.
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
        // Fibres are not bounded by the plane of the surface.
        let geometric_normal = if is_fiber { frame.n } else { geometric_normal };
        let side = geometric_normal.dot(front);
        let wo = frame.to_local(wo);
        Self { frame, geometric_normal, side, shadowing, is_for_viewer, wo, lobe, tables }
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

    /// See [`Lobe::STRAIGHT`].
    pub fn is_straight(&self) -> bool {
        self.lobe.is_straight()
    }

    /// See [`Lobe::straight`].
    pub fn straight(&self) -> Spectrum {
        self.lobe.straight(self.tables, self.wo)
    }

    /// Returns true if light that [`Self::sample`] scattered to `wi` (world) was transmitted
    /// undeflected.
    #[inline]
    pub fn lets_through(&self, wi: Vec3) -> bool {
        self.lobe.is_straight() && self.frame.to_local(wi).z * self.wo.z < 0.0
    }

    /// See [`Lobe::DIFFUSE`].
    pub fn is_diffuse(&self) -> bool {
        self.lobe.is_diffuse()
    }

    /// Name of the lobe.
    pub fn lobe_name(&self) -> &'static str {
        self.lobe.name()
    }

    /// See [`Lobe::lobe_width`].
    #[inline(always)]
    pub fn lobe_width(&self) -> f32 {
        self.lobe.lobe_width(self.tables)
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

    /// Samples a direction (world) and its weight.
    #[inline(always)]
    pub fn sample(&self, u: [f32; 3]) -> Option<BsdfSample> {
        let s = self.lobe.sample(self.tables, self.wo, u)?;
        let wi = self.frame.to_world(s.wi);
        let weight = s.weight * self.shadowing.visible(wi);
        self.is_consistent(wi, s.wi).then_some(BsdfSample { wi, weight, ..s })
    }

    /// Context of light samples for this point at `p`.
    #[inline(always)]
    pub fn light_sample_context(&self, p: Vec3) -> LightSampleContext {
        LightSampleContext::on_surface(p, self.frame.n, self.lobe.transmits())
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
fn serves(lobe_width: f32, a: Vec3, b: Vec3) -> bool {
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
