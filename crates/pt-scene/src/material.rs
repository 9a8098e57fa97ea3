//! Materials as their authors write them.

mod metallic_roughness;

use std::sync::Arc;

use crate::hair;
use crate::measured::Measurements;
use crate::texture::{Color, NormalOrBump, Scalar};
pub use metallic_roughness::{CoatNormals, MetallicRoughness};

/// A named material: how a surface scatters, and whether it glows.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Name in the file.
    pub name: String,
    /// How it scatters.
    pub surface: Surface,
    /// Radiance emitted from the front side (the side on which the corners of a triangle run
    /// counter-clockwise); zero for none.
    pub emission: Color,
    /// True if nobody sees what it emits: it lights surfaces and media, but rays that meet it find
    /// nothing of it, neither from the camera nor from mirrors.
    pub hidden_emission: bool,
    /// The share of the surface that is there, from 0 to 1: light goes on through the rest as if
    /// there were nothing.
    pub opacity: Scalar,
}

/// Lists the kinds of surface once; each is a struct of this module.
///
/// Calls `$then! { … }` with `Name(Type)` lines, so that whoever lowers materials matches on the
/// same list.
#[macro_export]
macro_rules! surfaces {
    ($then:ident) => {
        $then! {
            Diffuse, RoughDiffuse, Mirror, Glass, ThinGlass, Refraction, Conductor, CoatedDiffuse, RoughCoatedDiffuse, FresnelPlastic,
            CoatedConductor, Plastic, Principled, PrincipledThin, MetallicRoughness, DiffuseTransmission, Hair, Measured, Black, Mix, TwoSided, SurfaceDetail
        }
    };
}

macro_rules! surface_enum {
    ($($name:ident),*) => {
        /// How a surface scatters: one of the structs of this module.
        #[derive(Clone, Debug, PartialEq)]
        pub enum Surface {
            $(#[doc = concat!("See [`", stringify!($name), "`].")] $name($name)),*
        }
        impl Surface {
            /// The name of its kind, which is that of its struct.
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

/// How the slopes of microfacets are distributed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Distribution {
    /// Normally. [Beckmann & Spizzichino 1963]
    Beckmann,
    /// With long tails. [Trowbridge & Reitz 1975; GGX by Walter et al. 2007]
    Ggx,
}

/// Correlation of shadowing (towards the light) with masking (towards the viewer).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Masking {
    /// By the height of the facet. [Heitz 2014, eq. 99]
    Correlated,
    /// No: darker, and what Mitsuba 3 does.
    Separable,
}

/// The microfacets of a rough surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Roughness {
    /// Roughness α > 0 (for Beckmann: root mean square slope times √2) in the directions in which
    /// the texture coordinates u and v grow.
    pub alpha: [Scalar; 2],
    /// Distribution of microfacet slopes.
    pub distribution: Distribution,
    /// Masking and shadowing of microfacets.
    pub masking: Masking,
    /// True if light that one facet sends to another is followed on, and so not lost. Metals do so
    /// with two roughnesses too, glass with one.
    pub multiple_scattering: bool,
}

impl Roughness {
    /// Facets of Beckmann's distribution that hide each other by their heights.
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
    /// True if the back side reflects too; otherwise it is black.
    pub two_sided: bool,
}

/// Diffuse reflection of a surface with V-shaped cavities, that loses no light between them.
/// [Portsmouth, Kutz & Hill 2025, "EON: A Practical Energy-Preserving Rough Diffuse BRDF"]
#[derive(Clone, Debug, PartialEq)]
pub struct RoughDiffuse {
    /// Albedo of the walls of the cavities, each channel in [0, 1].
    pub reflectance: Color,
    /// Roughness from 0, which is Lambertian, to 1.
    pub roughness: Scalar,
    /// True if the back side reflects too; otherwise it is black.
    pub two_sided: bool,
}

/// A perfect mirror, on both sides.
#[derive(Clone, Debug, PartialEq)]
pub struct Mirror {
    /// Share of light reflected, each channel in [0, 1].
    pub reflectance: Color,
}

/// An interface between two dielectrics, smooth or rough: Fresnel reflection and refraction.
#[derive(Clone, Debug, PartialEq)]
pub struct Glass {
    /// Tint of what is reflected; 1 is physical.
    pub reflectance: Color,
    /// Tint of what is transmitted; 1 is physical.
    pub transmittance: Color,
    /// Index of refraction of the back side over that of the front side (the side of the normal).
    pub ior: f32,
    /// Microfacets; `None` is a smooth interface.
    pub roughness: Option<Roughness>,
}

/// A pane of a dielectric that is so thin that it does not shift what is seen through it.
#[derive(Clone, Debug, PartialEq)]
pub struct ThinGlass {
    /// Tint of what is reflected; 1 is physical.
    pub reflectance: Color,
    /// Tint of what is transmitted; 1 is physical.
    pub transmittance: Color,
    /// Index of refraction of the pane over that around it.
    pub ior: f32,
}

/// A smooth interface that refracts all light and reflects none (total reflection is black).
#[derive(Clone, Debug, PartialEq)]
pub struct Refraction {
    /// Tint of what is transmitted.
    pub transmittance: Color,
    /// Index of refraction of the back side over that of the front side.
    pub ior: f32,
}

/// A metal, smooth or rough, by its complex index of refraction η + ik.
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
    /// True if the back side reflects too; otherwise it is black.
    pub two_sided: bool,
}

/// A diffuse base under a smooth coat of a dielectric.
#[derive(Clone, Debug, PartialEq)]
pub struct CoatedDiffuse {
    /// Albedo of the base.
    pub diffuse: Color,
    /// Tint of what the coat reflects; 1 is physical.
    pub specular: Color,
    /// Index of refraction of the coat over that above it.
    pub ior: f32,
    /// True if light that the coat throws back is coloured again by the base, as it would be in
    /// nature.
    pub nonlinear: bool,
    /// True if the back side reflects too; otherwise it is black.
    pub two_sided: bool,
}

/// A diffuse base under a rough coat of a dielectric. Light that meets a second facet of the coat
/// is lost.
#[derive(Clone, Debug, PartialEq)]
pub struct RoughCoatedDiffuse {
    /// Albedo of the base.
    pub diffuse: Color,
    /// Tint of what the coat reflects; 1 is physical.
    pub specular: Color,
    /// Index of refraction of the coat over that above it, at least 1: less is taken for 1.
    pub ior: f32,
    /// Roughness α > 0 of the coat, as in [`Roughness::alpha`].
    pub alpha: f32,
    /// How the slopes of facets are distributed. They hide each other as [`Masking::Separable`]
    /// says.
    pub distribution: Distribution,
    /// True if light that the coat throws back is coloured again by the base, as it would be in
    /// nature.
    pub nonlinear: bool,
    /// True if the back side reflects too; otherwise it is black.
    pub two_sided: bool,
}

/// A diffuse base below facets of a dielectric that light goes through once on each way; what the
/// surface throws back to the base is lost. [Baek et al. 2018, "Simultaneous Acquisition of
/// Polarimetric SVBRDF and Normals", without polarization]
#[derive(Clone, Debug, PartialEq)]
pub struct FresnelPlastic {
    /// Albedo of the base.
    pub diffuse: Color,
    /// Tint of what the facets reflect; 1 is physical.
    pub specular: Color,
    /// Index of refraction over that above the surface, at least 1: less is taken for 1.
    pub ior: f32,
    /// The facets. Light that one reflects to another is lost, also with
    /// [`Roughness::multiple_scattering`].
    pub roughness: Roughness,
    /// True if the back side reflects too; otherwise it is black.
    pub two_sided: bool,
}

/// A metal under a coat of a dielectric, of facets of GGX.
#[derive(Clone, Debug, PartialEq)]
pub struct CoatedConductor {
    /// Real part η of the metal's index of refraction over that above the coat, per channel.
    pub eta: [f32; 3],
    /// Imaginary part k, per channel.
    pub k: [f32; 3],
    /// Roughness α of the metal, as in [`Roughness::alpha`]; 0 is smooth.
    pub alpha: f32,
    /// Index of refraction of the coat over that above it, at least 1: less is taken for 1.
    pub ior: f32,
    /// Roughness α of the coat; 0 is smooth.
    pub coat_alpha: f32,
    /// Thickness of the coat in mean free paths of light that it absorbs: straight through, e⁻ᵗ is
    /// left. 0 is clear.
    pub thickness: f32,
    /// True if the back side reflects too; otherwise it is black.
    pub two_sided: bool,
}

/// A diffuse base with a gloss: what phong and blinn materials of modelling tools become.
#[derive(Clone, Debug, PartialEq)]
pub struct Plastic {
    /// Albedo of the base.
    pub diffuse: Color,
    /// Reflectance of the gloss at normal incidence.
    pub specular: Color,
    /// Roughness α of the gloss (Beckmann).
    pub alpha: f32,
    /// True if the back side reflects too; otherwise it is black.
    pub two_sided: bool,
}

/// The material of many parameters that artists think in: a diffuse base with sheen, facets that
/// reflect as a dielectric or a metal or let light through, and a clear coat. Numbers are in
/// [0, 1]. [Burley 2012, "Physically Based Shading at Disney"; Burley 2015, "Extending the Disney
/// BRDF to a BSDF with Integrated Subsurface Scattering"; as Mitsuba 3 has it]
#[derive(Clone, Debug, PartialEq)]
pub struct Principled {
    /// Colour of the base, the metal, and of light that goes through (its square root at each
    /// surface).
    pub base_color: Color,
    /// √α of the facets, which are those of GGX.
    pub roughness: Scalar,
    /// How much longer highlights are along the direction in which u grows than across it.
    pub anisotropic: Scalar,
    /// Share of metal.
    pub metallic: Scalar,
    /// Share of what is not metal that light goes through.
    pub spec_trans: Scalar,
    /// Index of refraction of the back side over that of the front side.
    pub ior: f32,
    /// How much of the base's tint the reflection of a dielectric has.
    pub spec_tint: Scalar,
    /// Amount of sheen.
    pub sheen: Scalar,
    /// Fraction of the base's tint in the sheen.
    pub sheen_tint: Scalar,
    /// From a diffuse surface to light that is scattered under it.
    pub flatness: Scalar,
    /// Amount of clear coat.
    pub clearcoat: Scalar,
    /// From a satin coat to a glossy one.
    pub clearcoat_gloss: Scalar,
    /// True if the back side reflects as the front does; else it lets light through or is black.
    pub two_sided: bool,
}

impl Default for Principled {
    /// A grey dielectric of index 1.5 and roughness ½, without anything else.
    fn default() -> Self {
        let none = || Scalar::Value(0.0);
        Self {
            base_color: [0.5; 3].into(),
            roughness: 0.5.into(),
            anisotropic: none(),
            metallic: none(),
            spec_trans: none(),
            ior: 1.5,
            spec_tint: none(),
            sheen: none(),
            sheen_tint: none(),
            flatness: none(),
            clearcoat: none(),
            clearcoat_gloss: none(),
            two_sided: false,
        }
    }
}

impl Principled {
    /// Returns true if light goes through it anywhere.
    pub fn transmits(&self) -> bool {
        self.spec_trans != Scalar::Value(0.0)
    }
}

/// [`Principled`] for sheets so thin that light leaves them where it came in, such as paper, leaves
/// and frosted panes: a diffuse part that reflects light and lets it through, and facets that do
/// so. It is the same from both sides. Numbers are from 0 to 1 where nothing else is said.
/// [Burley 2015, "Extending the Disney BRDF to a BSDF with Integrated Subsurface Scattering", §5;
/// as Mitsuba 3 has it]
#[derive(Clone, Debug, PartialEq)]
pub struct PrincipledThin {
    /// Colour of what is diffuse, and of light that facets let through.
    pub base_color: Color,
    /// √α of the facets that reflect, which are those of GGX; those of light that goes through are
    /// smoother where the index is below 2.08.
    pub roughness: Scalar,
    /// How much longer highlights are along the direction in which u grows than across it.
    pub anisotropic: Scalar,
    /// Share of facets; the rest is diffuse.
    pub spec_trans: Scalar,
    /// Index of refraction of the sheet over that around it, above 0.
    pub ior: f32,
    /// How much of the base's tint the reflection of facets has.
    pub spec_tint: Scalar,
    /// Amount of sheen.
    pub sheen: Scalar,
    /// Fraction of the base's tint in the sheen.
    pub sheen_tint: Scalar,
    /// From a diffuse surface to light that is scattered under it.
    pub flatness: Scalar,
    /// From 0, all that is diffuse is reflected, to 2, all goes through.
    pub diff_trans: Scalar,
}

impl Default for PrincipledThin {
    /// Grey and diffuse, of index 1.5 and roughness ½ where there are facets.
    fn default() -> Self {
        let none = || Scalar::Value(0.0);
        Self {
            base_color: [0.5; 3].into(),
            roughness: 0.5.into(),
            anisotropic: none(),
            spec_trans: none(),
            ior: 1.5,
            spec_tint: none(),
            sheen: none(),
            sheen_tint: none(),
            flatness: none(),
            diff_trans: none(),
        }
    }
}

/// A thin sheet that scatters light diffusely to both sides, the same from both, such as leaves and
/// paper without their gloss.
#[derive(Clone, Debug, PartialEq)]
pub struct DiffuseTransmission {
    /// Share of light that is reflected, each channel in [0, 1].
    pub reflectance: Color,
    /// Share of light that goes through, each channel in [0, 1]; no channel of both together
    /// exceeds 1.
    pub transmittance: Color,
}

/// Fibres of hair or fur, which are so thin that light leaves them where it came in: closed tubes
/// of meshes, or ribbons. They are along the direction in which the texture coordinate u grows,
/// from the root to the tip. [Chiang et al. 2016, "A Practical and Controllable Hair and Fur Model
/// for Production Path Tracing"]
#[derive(Clone, Debug, PartialEq)]
pub struct Hair {
    /// What colours them.
    pub pigment: Pigment,
    /// Index of refraction over that around them, at least 1.
    pub ior: f32,
    /// Roughness along the fibre from 0 to 1; below 0.02 it is taken for that, as is the other
    /// one.
    pub roughness: f32,
    /// Roughness around the fibre from 0 to 1.
    pub azimuthal_roughness: f32,
    /// Angle in degrees by which the scales of the fibre are raised.
    pub scale_angle: f32,
    /// True if the back side scatters as the front side does, as ribbons need it. Else there is no
    /// back side, so that light which goes through the front of a closed tube leaves it.
    pub two_sided: bool,
}

/// What colours fibres.
#[derive(Clone, Debug, PartialEq)]
pub enum Pigment {
    /// Whatever gives many of them together this colour, each channel in [0, 1].
    Reflectance(Color),
    /// What a fibre of radius 1 absorbs, per channel.
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
    /// The colour that many fibres have together.
    pub fn color(&self) -> Color {
        let of = |absorption| hair::color(absorption, self.azimuthal_roughness).into();
        match &self.pigment {
            Pigment::Reflectance(color) => color.clone(),
            Pigment::Absorption(absorption) => of(*absorption),
            Pigment::Melanin(concentrations) => of(hair::melanin(*concentrations)),
        }
    }
}

/// Reflection as it was measured; it is turned with the direction in which the texture coordinate u
/// grows, if it is not the same all around.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// What was measured.
    pub measurements: Arc<Measurements>,
    /// True if the back side reflects too; otherwise it is black.
    pub two_sided: bool,
}

/// Absorbs everything.
#[derive(Clone, Debug, PartialEq)]
pub struct Black;

/// Two surfaces of which each point has a share.
#[derive(Clone, Debug, PartialEq)]
pub struct Mix {
    /// Where the share is 0.
    pub first: Box<Surface>,
    /// Where the share is 1.
    pub second: Box<Surface>,
    /// The share of the second, from 0 to 1.
    pub amount: Scalar,
}

impl Surface {
    /// Returns true if rays that come to the back of it go on as if there were nothing; see
    /// [`Hair::two_sided`].
    pub fn has_no_back(&self) -> bool {
        match self {
            Self::Hair(hair) => !hair.two_sided,
            Self::Mix(mix) => mix.first.has_no_back() || mix.second.has_no_back(),
            Self::SurfaceDetail(embossed) => embossed.surface.has_no_back(),
            _ => false,
        }
    }
}

/// Two surfaces, of which each shows on one side.
#[derive(Clone, Debug, PartialEq)]
pub struct TwoSided {
    /// Seen from the front, the side of the normal.
    pub front: Box<Surface>,
    /// Seen from behind, where it is what its own front would be.
    pub back: Box<Surface>,
}

/// A surface with a relief that is finer than its shape.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceDetail {
    /// What it is made of.
    pub surface: Box<Surface>,
    /// How its normals differ from those of the shape.
    pub relief: NormalOrBump,
    /// True if less light arrives where the relief is steep and the light low, as facets would
    /// shadow it; so light fades before it ends where the shape turns away from it. Of reliefs
    /// in reliefs, the outermost that shadows does so. [Conty Estevez, Lecocq & Stein 2019, "A
    /// Microfacet-Based Shadowing Function to Solve the Bump Terminator Problem"]
    pub shadowing: bool,
    /// What is seen where its normals look away from the viewer.
    pub averted: Averted,
    /// True if the relief from behind is the mirror image of that in front: what is raised is
    /// raised on both sides. Else what is raised in front is a dent behind.
    pub mirrored: bool,
}

impl SurfaceDetail {
    /// A surface with a relief that shadows nothing, bends normals to the viewer and goes through
    /// to the back.
    pub fn new(surface: impl Into<Box<Surface>>, relief: NormalOrBump) -> Self {
        let surface = surface.into();
        Self { surface, relief, shadowing: false, averted: Averted::Bent, mirrored: false }
    }
}

/// What is seen of a relief where its normal looks away from the viewer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Averted {
    /// The surface with the normal that is just turned enough.
    #[default]
    Bent,
    /// The surface with the normal after half a turn about that of the shape, as in Mitsuba.
    Turned,
    /// Nothing.
    Black,
}
