//! Surface scattering: the [`Lobe`] contract, the closed set of lobes, and [`Bsdf`], the lobe of
//! one surface point in world coordinates.
//!
//! To add a lobe: write `my_lobe.rs` with its [`Lobe`] and, for tests, its `LobeLaws`, and add one
//! line to `lobes!` below. The laws of `laws.rs` then check that it fulfils its contract.

mod block;
mod coated_conductor;
mod coated_diffuse;
mod compat;
mod conductor;
mod dielectric;
mod diffuse;
mod diffuse_transmission;
mod eon;
#[cfg(test)]
mod expansion;
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
mod world;

pub(crate) use coated_conductor::Layers;
pub use measured::{Gonioreflectometer, MeasuredTables, TabulatedLobe};
pub use metallic_roughness::emitted_through;
pub use orientation::Orientation;
use std::sync::Arc;

use block::{DirectionPairs, Evaluations, SampleNumbers, Samples};
use pt_math::{Pdf, SolidAngle, Spectrum, Vec3};
pub use shadowing::Shadowing;
pub use world::Bsdf;

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
    /// divided; otherwise 1. Radiance regains this factor when the path leaves the medium, so it
    /// is no measure of the importance of the path.
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
#[derive(Clone, Debug, Default)]
pub struct LobeTables {
    /// Tables of measured materials.
    pub measured: Vec<Arc<MeasuredTables>>,
}

/// Data, beside the parameters of a lobe, on which its scattering depends.
///
/// Lobes are unpacked where they are evaluated, so that [`Lobe::unpack`] hands on what the other
/// methods need of it. A further dependency, such as wavelength or transport mode, is a field here,
/// and concerns only the lobes that read it.
#[derive(Clone, Copy, Debug)]
pub struct LobeContext<'t> {
    /// Tables of the scene.
    pub tables: &'t LobeTables,
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
    /// True if many evaluations of the lobe are computed together, which pays if its formulas have
    /// neither branches nor calls and become vector instructions. The lobe must have no Dirac
    /// deltas and no refraction, and [`Self::eval_and_pdf`] and [`Self::sample`] are inlined.
    const IN_BLOCKS: bool = false;
    /// Calls `f` with the lobe. A lobe with a choice of formulas calls it in a branch for each, so
    /// that the choice is a constant in the loop over a block.
    #[inline(always)]
    fn specialized(self, mut f: impl FnMut(Self)) {
        f(self);
    }
    /// Packs the parameters into numbers, the form that backends read.
    fn pack(&self) -> [f32; PARAMETERS];
    /// Inverse of [`Self::pack`], in the context in which the lobe is evaluated.
    fn unpack(p: &[f32; PARAMETERS], context: LobeContext<'t>) -> Self;
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
    /// [`Self::eval`] and [`Self::pdf`], for lobes where the two have much in common.
    #[inline(always)]
    fn eval_and_pdf(&self, wo: Vec3, wi: Vec3) -> (Spectrum, Pdf<SolidAngle>) {
        (self.eval(wo, wi), self.pdf(wo, wi))
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
    fn run<'t, L: Lobe<'t>, T>(&self, context: LobeContext<'t>, f: impl FnOnce(L) -> T) -> T {
        if L::INLINE { f(L::unpack(&self.p, context)) } else { self.call(context, f) }
    }

    #[inline(never)]
    fn call<'t, L: Lobe<'t>, T>(&self, context: LobeContext<'t>, f: impl FnOnce(L) -> T) -> T {
        f(L::unpack(&self.p, context))
    }
}

/// Makes the closed set of lobes from lines of a name and a type.
///
/// There is one dispatcher, the methods of [`LobeRecord`]: they compare the kind of the record with
/// that of each lobe, and unpack and evaluate the lobe whose kind it is. It is a sequence of
/// comparisons and not a `match` of an enum, so that a lobe is inlined or called as its own
/// [`Lobe::INLINE`] says. The enum of lobes, `AnyLobe`, exists in tests only: the laws have
/// examples of it, and evaluate them through their records.
///
/// The module `expansion` has what the macro makes of two lines, written out.
macro_rules! lobes {
    ($($(#[$doc:meta])* $name:ident = $module:ident::$ty:ident $(<$tables:lifetime>)?),* $(,)?) => {
        $(pub use $module::$ty;)*

        #[repr(u32)]
        enum LobeKind { $($(#[$doc])* $name),* }

        $(impl $(<$tables>)? From<$ty $(<$tables>)?> for LobeRecord {
            fn from(lobe: $ty $(<$tables>)?) -> Self {
                Self { kind: LobeKind::$name as u32, p: lobe.pack() }
            }
        })*

        impl LobeRecord {
            /// See [`Lobe::DELTA`].
            #[inline(always)]
            fn is_delta(&self) -> bool {
                $((self.kind == LobeKind::$name as u32 && <$ty as Lobe<'_>>::DELTA))||*
            }
            /// See [`Lobe::lobe_width`].
            #[inline(always)]
            fn lobe_width(&self, context: LobeContext<'_>) -> f32 {
                $(if self.kind == LobeKind::$name as u32 {
                    return self.run::<$ty, _>(context, |lobe| lobe.lobe_width());
                })*
                0.0
            }
            /// See [`Lobe::TRANSMITS`].
            #[inline(always)]
            fn transmits(&self) -> bool {
                $((self.kind == LobeKind::$name as u32 && <$ty as Lobe<'_>>::TRANSMITS))||*
            }
            /// See [`Lobe::STRAIGHT`].
            #[inline(always)]
            fn is_straight(&self) -> bool {
                $((self.kind == LobeKind::$name as u32 && <$ty as Lobe<'_>>::STRAIGHT))||*
            }
            /// See [`Lobe::straight`].
            fn straight(&self, context: LobeContext<'_>, wo: Vec3) -> Spectrum {
                $(if self.kind == LobeKind::$name as u32 {
                    return self.run::<$ty, _>(context, |lobe| lobe.straight(wo));
                })*
                Spectrum::ZERO
            }
            /// See [`Lobe::IS_FIBER`].
            #[inline(always)]
            fn is_fiber(&self) -> bool {
                $((self.kind == LobeKind::$name as u32 && <$ty as Lobe<'_>>::IS_FIBER))||*
            }
            /// See [`Lobe::DIFFUSE`].
            fn is_diffuse(&self) -> bool {
                $((self.kind == LobeKind::$name as u32 && <$ty as Lobe<'_>>::DIFFUSE))||*
            }
            /// Name of the lobe in `lobes!`.
            fn name(&self) -> &'static str {
                $(if self.kind == LobeKind::$name as u32 {
                    return stringify!($name);
                })*
                ""
            }
            /// See [`Lobe::eval`].
            #[inline(always)]
            fn eval(&self, context: LobeContext<'_>, wo: Vec3, wi: Vec3) -> Spectrum {
                $(if self.kind == LobeKind::$name as u32 {
                    return self.run::<$ty, _>(context, |lobe| lobe.eval(wo, wi));
                })*
                Spectrum::ZERO
            }
            /// See [`Lobe::pdf`].
            #[inline(always)]
            fn pdf(&self, context: LobeContext<'_>, wo: Vec3, wi: Vec3) -> Pdf<SolidAngle> {
                $(if self.kind == LobeKind::$name as u32 {
                    return self.run::<$ty, _>(context, |lobe| lobe.pdf(wo, wi));
                })*
                Pdf::ZERO
            }
            /// See [`Lobe::eval_and_pdf`].
            #[inline(always)]
            fn eval_and_pdf(
                &self,
                context: LobeContext<'_>,
                wo: Vec3,
                wi: Vec3,
            ) -> (Spectrum, Pdf<SolidAngle>) {
                $(if self.kind == LobeKind::$name as u32 {
                    return self.run::<$ty, _>(context, |lobe| lobe.eval_and_pdf(wo, wi));
                })*
                (Spectrum::ZERO, Pdf::ZERO)
            }
            /// See [`Lobe::sample`].
            #[inline(always)]
            fn sample(&self, context: LobeContext<'_>, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
                $(if self.kind == LobeKind::$name as u32 {
                    return self.run::<$ty, _>(context, |lobe| lobe.sample(wo, u));
                })*
                None
            }
            /// See [`Lobe::IN_BLOCKS`].
            #[inline(always)]
            pub fn is_in_blocks(&self) -> bool {
                $((self.kind == LobeKind::$name as u32 && <$ty as Lobe<'_>>::IN_BLOCKS))||*
            }
            /// [`Lobe::eval_and_pdf`] of a block, if the lobe is in blocks.
            fn eval_and_pdf_each(
                &self,
                context: LobeContext<'_>,
                pairs: &DirectionPairs,
                values: &mut Evaluations,
            ) {
                $(if <$ty as Lobe<'_>>::IN_BLOCKS && self.kind == LobeKind::$name as u32 {
                    return pairs.evaluate($ty::unpack(&self.p, context), values);
                })*
            }
            /// [`Lobe::sample`] of a block, if the lobe is in blocks.
            fn sample_each(
                &self,
                context: LobeContext<'_>,
                numbers: &SampleNumbers,
                samples: &mut Samples,
            ) {
                $(if <$ty as Lobe<'_>>::IN_BLOCKS && self.kind == LobeKind::$name as u32 {
                    return numbers.sample($ty::unpack(&self.p, context), samples);
                })*
            }
        }

        /// Any lobe, with its parameters.
        #[cfg(test)]
        #[derive(Clone, Copy, Debug)]
        enum AnyLobe<'t> { $($name($ty $(<$tables>)?)),* }

        $(#[cfg(test)]
        impl<'t> From<$ty $(<$tables>)?> for AnyLobe<'t> {
            fn from(lobe: $ty $(<$tables>)?) -> Self { Self::$name(lobe) }
        })*

        #[cfg(test)]
        impl<'t> AnyLobe<'t> {
            /// Converts the lobe to its stored form.
            fn record(&self) -> LobeRecord {
                match self { $(Self::$name(lobe) => (*lobe).into()),* }
            }
            /// Inverse of [`Self::record`].
            fn from_record(r: &LobeRecord, context: LobeContext<'t>) -> Self {
                $(if r.kind == LobeKind::$name as u32 { return Self::$name($ty::unpack(&r.p, context)); })*
                unreachable!("lobe kind {}", r.kind)
            }
            /// Properties of the lobe.
            fn laws(&self) -> &dyn laws::LobeLaws {
                match self { $(Self::$name(lobe) => lobe),* }
            }
            /// Example parameters of all lobes; they refer to the tables of
            /// [`LobeTables::examples`].
            fn examples() -> Vec<Self> {
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
    /// Smooth dielectric interface with Schlick's approximation, of another program.
    SchlickGlass = compat::SchlickGlass,
    /// Smooth interface that only refracts, with radiance multiplied by η², of another program.
    EtaSquaredRefraction = compat::EtaSquaredRefraction,
    /// Beckmann metal with a simplified Fresnel term, of another program.
    SimplifiedConductor = compat::SimplifiedConductor,
}
