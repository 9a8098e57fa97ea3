//! Materials as written by their authors.

mod metallic_roughness;
mod principled;

use std::sync::Arc;

pub use metallic_roughness::{CoatNormals, MetallicRoughness};
pub use principled::{Principled, PrincipledThin};

use crate::hair;
use crate::measured::Measurements;
use crate::texture::{Color, NormalOrBump, Scalar};

/// A named material: scattering, emission and opacity of a surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Name in the file.
    pub name: String,
    /// Scattering of the surface.
    pub surface: Surface,
    /// Radiance emitted from the front side (the side from which the corners of a triangle are
    /// counter-clockwise); zero for none.
    pub emission: Color,
    /// True if the emission is invisible to rays: it illuminates surfaces and media, but neither
    /// camera rays nor scattered rays that hit the surface see it.
    pub hidden_emission: bool,
    /// Opacity, from 0 to 1; the remaining fraction of the light passes through undisturbed.
    pub opacity: Scalar,
}

/// Lists the kinds of surfaces once; each is a struct of this module.
///
/// `surfaces!(then)` is `then! { Diffuse, RoughDiffuse, … }`, a call of another macro with the
/// list.
/// Code for each kind, such as the enum [`Surface`], is made from this list, so that a new kind
/// for which a part is missing does not compile.
///
/// ```
/// macro_rules! names {
///     ($($name:ident),*) => { [$(stringify!($name)),*] };
/// }
/// // names! { Diffuse, RoughDiffuse, … }
/// let names = pt_scene::surfaces!(names);
/// assert_eq!(names[..2], ["Diffuse", "RoughDiffuse"]);
/// ```
#[macro_export]
macro_rules! surfaces {
    ($then:ident) => {
        $then! {
            Diffuse, RoughDiffuse, Mirror, Glass, ThinGlass, Refraction, Conductor, CoatedDiffuse, RoughCoatedDiffuse, FresnelPlastic,
            CoatedConductor, Plastic, Principled, PrincipledThin, MetallicRoughness, DiffuseTransmission, Hair, Measured, Black, Mix, TwoSided, SurfaceDetail
        }
    };
}

/// Makes the enum of surfaces. `surface_enum! { Diffuse, Mirror }` is
///
/// ```text
/// pub enum Surface {
///     /// See [`Diffuse`].
///     Diffuse(Diffuse),
///     /// See [`Mirror`].
///     Mirror(Mirror),
/// }
/// impl Surface {
///     pub fn kind(&self) -> &'static str {
///         match self {
///             Self::Diffuse(_) => "Diffuse",
///             Self::Mirror(_) => "Mirror",
///         }
///     }
/// }
/// impl From<Diffuse> for Surface { … }
/// impl From<Mirror> for Surface { … }
/// ```
macro_rules! surface_enum {
    ($($name:ident),*) => {
        /// Scattering of a surface: one of the structs of this module.
        #[derive(Clone, Debug, PartialEq)]
        pub enum Surface {
            $(#[doc = concat!("See [`", stringify!($name), "`].")] $name($name)),*
        }
        impl Surface {
            /// Returns the name of the kind, which is that of its struct.
            pub fn kind(&self) -> &'static str {
                match self {
                    $(Self::$name(_) => stringify!($name)),*
                }
            }
        }
        $(impl From<$name> for Surface {
            fn from(s: $name) -> Self { Self::$name(s) }
        })*
    };
}
surfaces!(surface_enum);

impl Surface {
    /// Returns true if rays that arrive at the back pass through undisturbed; see
    /// [`Hair::two_sided`](Hair::two_sided).
    pub fn culls_backfaces(&self) -> bool {
        match self {
            Self::Hair(hair) => !hair.two_sided,
            Self::Mix(mix) => mix.first.culls_backfaces() || mix.second.culls_backfaces(),
            Self::SurfaceDetail(embossed) => embossed.surface.culls_backfaces(),
            _ => false,
        }
    }

    /// Returns true if the surface, or one that it contains, transmits light anywhere.
    pub fn transmits(&self) -> bool {
        match self {
            Self::Glass(_)
            | Self::ThinGlass(_)
            | Self::Refraction(_)
            | Self::PrincipledThin(_)
            | Self::DiffuseTransmission(_)
            | Self::Hair(_) => true,
            Self::Diffuse(_)
            | Self::RoughDiffuse(_)
            | Self::Mirror(_)
            | Self::Conductor(_)
            | Self::CoatedDiffuse(_)
            | Self::RoughCoatedDiffuse(_)
            | Self::FresnelPlastic(_)
            | Self::CoatedConductor(_)
            | Self::Plastic(_)
            | Self::Measured(_)
            | Self::Black(_) => false,
            Self::Principled(principled) => principled.transmits(),
            Self::MetallicRoughness(look) => look.transmits(),
            Self::Mix(mix) => mix.first.transmits() || mix.second.transmits(),
            Self::TwoSided(sides) => sides.front.transmits() || sides.back.transmits(),
            Self::SurfaceDetail(embossed) => embossed.surface.transmits(),
        }
    }

    /// Returns the field that states whether the back side scatters as the front side does. `None`
    /// for kinds that have none: those with the same scattering on both sides or with a different
    /// one on each, and those that contain other surfaces.
    pub fn two_sided_mut(&mut self) -> Option<&mut bool> {
        match self {
            Self::Diffuse(surface) => Some(&mut surface.two_sided),
            Self::RoughDiffuse(surface) => Some(&mut surface.two_sided),
            Self::Conductor(surface) => Some(&mut surface.two_sided),
            Self::CoatedDiffuse(surface) => Some(&mut surface.two_sided),
            Self::RoughCoatedDiffuse(surface) => Some(&mut surface.two_sided),
            Self::FresnelPlastic(surface) => Some(&mut surface.two_sided),
            Self::CoatedConductor(surface) => Some(&mut surface.two_sided),
            Self::Plastic(surface) => Some(&mut surface.two_sided),
            Self::Principled(surface) => Some(&mut surface.two_sided),
            Self::MetallicRoughness(surface) => Some(&mut surface.two_sided),
            Self::Hair(surface) => Some(&mut surface.two_sided),
            Self::Measured(surface) => Some(&mut surface.two_sided),
            Self::Mirror(_)
            | Self::Glass(_)
            | Self::ThinGlass(_)
            | Self::Refraction(_)
            | Self::PrincipledThin(_)
            | Self::DiffuseTransmission(_)
            | Self::Black(_)
            | Self::Mix(_)
            | Self::TwoSided(_)
            | Self::SurfaceDetail(_) => None,
        }
    }
}

/// Distribution of microfacet slopes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Distribution {
    /// Normal distribution of slopes. [Beckmann & Spizzichino 1963]
    Beckmann,
    /// Distribution with long tails. [Trowbridge & Reitz 1975; GGX by Walter et al. 2007]
    Ggx,
}

/// Correlation of shadowing (towards the light) and masking (towards the viewer).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Masking {
    /// Correlated by the height of the facet. [Heitz 2014, eq. 99]
    Correlated,
    /// Uncorrelated: darker, and the model of Mitsuba 3.
    Separable,
}

/// Microfacets of a rough surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Roughness {
    /// Roughness α > 0 (for Beckmann: root mean square slope times √2) in the directions of
    /// increasing texture coordinates u and v.
    pub alpha: [Scalar; 2],
    /// Distribution of microfacet slopes.
    pub distribution: Distribution,
    /// Masking and shadowing of microfacets.
    pub masking: Masking,
    /// True if multiple scattering between facets is included, so that no energy is lost. Metals
    /// support it also with two roughnesses, glass only with one.
    pub multiple_scattering: bool,
}

impl Roughness {
    /// Creates facets of Beckmann's distribution with correlated masking.
    pub fn beckmann(alpha: f32) -> Self {
        Self {
            alpha: [alpha.into(), alpha.into()],
            distribution: Distribution::Beckmann,
            masking: Masking::Correlated,
            multiple_scattering: false,
        }
    }
}

/// Lambertian reflection.
#[derive(Clone, Debug, PartialEq)]
pub struct Diffuse {
    /// Albedo, each channel in [0, 1].
    pub reflectance: Color,
    /// True if the back side reflects as well; otherwise it is black.
    pub two_sided: bool,
}

/// Diffuse reflection of a surface with V-shaped cavities, with energy-preserving interreflection.
/// [Portsmouth, Kutz & Hill 2025, "EON: A Practical Energy-Preserving Rough Diffuse BRDF"]
#[derive(Clone, Debug, PartialEq)]
pub struct RoughDiffuse {
    /// Albedo of the walls of the cavities, each channel in [0, 1].
    pub reflectance: Color,
    /// Roughness from 0, which is Lambertian, to 1.
    pub roughness: Scalar,
    /// True if the back side reflects as well; otherwise it is black.
    pub two_sided: bool,
}

/// A perfect mirror, on both sides.
#[derive(Clone, Debug, PartialEq)]
pub struct Mirror {
    /// Reflectance, each channel in [0, 1].
    pub reflectance: Color,
}

/// An interface between two dielectrics, smooth or rough: Fresnel reflection and refraction.
#[derive(Clone, Debug, PartialEq)]
pub struct Glass {
    /// Tint of reflected light; 1 is physical.
    pub reflectance: Color,
    /// Tint of transmitted light; 1 is physical.
    pub transmittance: Color,
    /// Index of refraction of the back side over that of the front side (the side of the normal).
    pub ior: f32,
    /// Microfacets; `None` is a smooth interface.
    pub roughness: Option<Roughness>,
}

/// A dielectric pane that is so thin that it does not displace transmitted rays.
#[derive(Clone, Debug, PartialEq)]
pub struct ThinGlass {
    /// Tint of reflected light; 1 is physical.
    pub reflectance: Color,
    /// Tint of transmitted light; 1 is physical.
    pub transmittance: Color,
    /// Index of refraction of the pane over that around it.
    pub ior: f32,
}

/// A smooth interface that transmits all light and reflects none (total internal reflection is
/// black).
#[derive(Clone, Debug, PartialEq)]
pub struct Refraction {
    /// Tint of transmitted light.
    pub transmittance: Color,
    /// Index of refraction of the back side over that of the front side.
    pub ior: f32,
}

/// A smooth or rough metal with the complex index of refraction η + ik.
#[derive(Clone, Debug, PartialEq)]
pub struct Conductor {
    /// Real part η of the index of refraction, per channel.
    pub eta: [f32; 3],
    /// Imaginary part k, per channel.
    pub k: [f32; 3],
    /// Tint; 1 is physical.
    pub reflectance: Color,
    /// Microfacets; `None` is a smooth metal.
    pub roughness: Option<Roughness>,
    /// True if the back side reflects as well; otherwise it is black.
    pub two_sided: bool,
}

/// A diffuse base under a smooth dielectric coat.
#[derive(Clone, Debug, PartialEq)]
pub struct CoatedDiffuse {
    /// Albedo of the base.
    pub diffuse: Color,
    /// Tint of the reflection of the coat; 1 is physical.
    pub specular: Color,
    /// Index of refraction of the coat over that above it.
    pub ior: f32,
    /// True if light that is internally reflected by the coat is tinted by the base again, as in
    /// reality.
    pub nonlinear: bool,
    /// True if the back side reflects as well; otherwise it is black.
    pub two_sided: bool,
}

/// A diffuse base under a rough dielectric coat. Multiple scattering between facets of the coat is
/// lost.
#[derive(Clone, Debug, PartialEq)]
pub struct RoughCoatedDiffuse {
    /// Albedo of the base.
    pub diffuse: Color,
    /// Tint of the reflection of the coat; 1 is physical.
    pub specular: Color,
    /// Index of refraction of the coat over that above it; values below 1 are clamped to 1.
    pub ior: f32,
    /// Roughness α > 0 of the coat, as in [`Roughness::alpha`].
    pub alpha: f32,
    /// Distribution of microfacet slopes. Masking is [`Masking::Separable`].
    pub distribution: Distribution,
    /// True if light that is internally reflected by the coat is tinted by the base again, as in
    /// reality.
    pub nonlinear: bool,
    /// True if the back side reflects as well; otherwise it is black.
    pub two_sided: bool,
}

/// A diffuse base below dielectric facets, which light crosses once on its way in and once on its
/// way out; internal reflection at the surface is lost. [Baek et al. 2018, "Simultaneous
/// Acquisition of Polarimetric SVBRDF and Normals", without polarization]
#[derive(Clone, Debug, PartialEq)]
pub struct FresnelPlastic {
    /// Albedo of the base.
    pub diffuse: Color,
    /// Tint of the reflection of the facets; 1 is physical.
    pub specular: Color,
    /// Index of refraction over that above the surface; values below 1 are clamped to 1.
    pub ior: f32,
    /// Microfacets. Multiple scattering between them is lost, also with
    /// [`Roughness::multiple_scattering`].
    pub roughness: Roughness,
    /// True if the back side reflects as well; otherwise it is black.
    pub two_sided: bool,
}

/// A metal under a dielectric coat, both with GGX facets.
#[derive(Clone, Debug, PartialEq)]
pub struct CoatedConductor {
    /// Real part η of the metal's index of refraction over that above the coat, per channel.
    pub eta: [f32; 3],
    /// Imaginary part k of the metal's index of refraction over the index above the coat, per
    /// channel.
    pub k: [f32; 3],
    /// Roughness α of the metal, as in [`Roughness::alpha`]; 0 is smooth.
    pub alpha: f32,
    /// Index of refraction of the coat over that above it; values below 1 are clamped to 1.
    pub ior: f32,
    /// Roughness α of the coat; 0 is smooth.
    pub coat_alpha: f32,
    /// Optical thickness t of the coat by absorption: at normal incidence, it transmits e⁻ᵗ. 0 is
    /// clear.
    pub thickness: f32,
    /// True if the back side reflects as well; otherwise it is black.
    pub two_sided: bool,
}

/// A diffuse base with a glossy reflection, for the Phong and Blinn materials of modelling tools.
#[derive(Clone, Debug, PartialEq)]
pub struct Plastic {
    /// Albedo of the base.
    pub diffuse: Color,
    /// Reflectance of the glossy part at normal incidence.
    pub specular: Color,
    /// Roughness α of the glossy part (Beckmann).
    pub alpha: f32,
    /// True if the back side reflects as well; otherwise it is black.
    pub two_sided: bool,
}

/// A thin sheet with diffuse reflection and transmission, equal on both sides, such as leaves and
/// paper without their gloss.
#[derive(Clone, Debug, PartialEq)]
pub struct DiffuseTransmission {
    /// Diffuse reflectance, each channel in [0, 1].
    pub reflectance: Color,
    /// Diffuse transmittance, each channel in [0, 1]; no channel of the sum of both exceeds 1.
    pub transmittance: Color,
}

/// Fibres of hair or fur, which are so thin that light leaves them where it enters: closed tubes of
/// meshes, or ribbons. Their axis is the direction of increasing texture coordinate u, from the
/// root to the tip. [Chiang et al. 2016, "A Practical and Controllable Hair and Fur Model for
/// Production Path Tracing"]
#[derive(Clone, Debug, PartialEq)]
pub struct Hair {
    /// Pigment, which determines the absorption.
    pub pigment: Pigment,
    /// Index of refraction over that around the fibres, at least 1.
    pub ior: f32,
    /// Longitudinal roughness, from 0 to 1. Both roughnesses are clamped to at least 0.02.
    pub roughness: f32,
    /// Azimuthal roughness, from 0 to 1.
    pub azimuthal_roughness: f32,
    /// Tilt angle of the scales of the fibre, in degrees.
    pub scale_angle: f32,
    /// True if the back side scatters as the front side does, as needed for ribbons. Otherwise rays
    /// pass through the back side, so that light that enters the front of a closed tube leaves it.
    pub two_sided: bool,
}

/// Specification of the absorption of hair fibres.
#[derive(Clone, Debug, PartialEq)]
pub enum Pigment {
    /// Absorption that gives hair this colour, each channel in [0, 1].
    Reflectance(Color),
    /// Absorption of a fibre of radius 1, per channel.
    Absorption([f32; 3]),
    /// Concentrations of eumelanin, which is brown, and pheomelanin, which is red: 8 and 0 is black
    /// hair, 1.3 and 0 brown, 0.3 and 0 blond, 0 and 1 red.
    Melanin([f32; 2]),
}

impl Default for Hair {
    /// Brown hair.
    fn default() -> Self {
        Self {
            pigment: Pigment::Melanin([1.3, 0.0]),
            ior: 1.55,
            roughness: 0.3,
            azimuthal_roughness: 0.3,
            scale_angle: 2.0,
            two_sided: false,
        }
    }
}

impl Hair {
    /// Returns the colour of hair that consists of these fibres.
    pub fn color(&self) -> Color {
        let of = |absorption| hair::color(absorption, self.azimuthal_roughness).into();
        match &self.pigment {
            Pigment::Reflectance(color) => color.clone(),
            Pigment::Absorption(absorption) => of(*absorption),
            Pigment::Melanin(concentrations) => of(hair::melanin(*concentrations)),
        }
    }
}

/// Measured reflection. If it is anisotropic, its orientation follows the direction of increasing
/// texture coordinate u.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// Tables of the measurement.
    pub measurements: Arc<Measurements>,
    /// True if the back side reflects as well; otherwise it is black.
    pub two_sided: bool,
}

/// A surface that absorbs all light.
#[derive(Clone, Debug, PartialEq)]
pub struct Black;

/// A blend of two surfaces.
#[derive(Clone, Debug, PartialEq)]
pub struct Mix {
    /// Surface for the weight 0.
    pub first: Box<Surface>,
    /// Surface for the weight 1.
    pub second: Box<Surface>,
    /// Weight of the second surface, from 0 to 1.
    pub amount: Scalar,
}

/// Two surfaces, one for each side.
#[derive(Clone, Debug, PartialEq)]
pub struct TwoSided {
    /// Surface of the front, the side of the normal.
    pub front: Box<Surface>,
    /// Surface of the back, which is seen from its own front.
    pub back: Box<Surface>,
}

/// A surface with details finer than its shape, given by a normal map or a bump map.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceDetail {
    /// Scattering of the surface.
    pub surface: Box<Surface>,
    /// Perturbation of the normals.
    pub relief: NormalOrBump,
    /// True if steep relief reduces light at grazing angles, as shadowing by facets would, so that
    /// light fades out before the terminator of the shape. In nested reliefs, only the outermost
    /// one with this flag shadows. [Conty Estevez, Lecocq & Stein 2019, "A Microfacet-Based
    /// Shadowing Function to Solve the Bump Terminator Problem"]
    pub shadowing: bool,
    /// Shading where the perturbed normal is averted from the viewer.
    pub averted: Averted,
    /// True if the relief of the back is the mirror image of that of the front: bumps are bumps on
    /// both sides. Otherwise bumps of the front are dents of the back.
    pub mirrored: bool,
}

impl SurfaceDetail {
    /// Creates a surface without shadowing, with bent normals, and with the relief of the front
    /// inverted on the back.
    pub fn new(surface: impl Into<Box<Surface>>, relief: NormalOrBump) -> Self {
        let surface = surface.into();
        Self { surface, relief, shadowing: false, averted: Averted::Bent, mirrored: false }
    }
}

/// Shading of a relief whose normal is averted from the viewer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Averted {
    /// The normal is bent until it just faces the viewer.
    #[default]
    Bent,
    /// The normal is rotated by half a turn about that of the shape, as in Mitsuba.
    Turned,
    /// Black.
    Black,
}
