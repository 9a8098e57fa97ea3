//! Policies of compilation: physical ones by default, and those of programs whose images are
//! reproduced ([`super::compat`]).

use pt_math::{DAffine3, Vec3};
use pt_scene::{Placement, Scene};

use super::textures::SurfaceConversion;
use crate::light::{AnyLight, LightTables};
use crate::surface::EmissiveSides;

/// Interpretation of scenes where programs differ.
#[derive(Clone, Copy, Debug)]
pub struct Policies {
    /// Name of the program with this interpretation; `None` is the physical one.
    pub(super) program: Option<&'static str>,
    /// True if lengths are converted to metres.
    pub(super) uses_units: bool,
    /// True if scenes may have media.
    pub(super) media: bool,
    /// True if the shutter stays open until its closing time.
    pub(super) exposure: bool,
    /// Conversion of materials that differ; `None` for the others.
    pub(super) surface: SurfaceConversion,
    pub(super) shapes: ShapePolicies,
    pub(super) lights: LightPolicies,
    pub(super) camera: CameraPolicies,
}

/// Interpretation of shapes.
#[derive(Clone, Copy, Debug)]
pub(super) struct ShapePolicies {
    /// True if copies of meshes may be instances.
    pub(super) instancing: bool,
    /// True if stretched spheres are ellipsoids, and mirrored meshes keep their front side.
    pub(super) exact_transforms: bool,
    /// Vertex normals in place of those of files; they are interpolated without normalisation.
    pub(super) vertex_normals: Option<VertexNormals>,
    /// Sides of emissive surfaces that emit.
    pub(super) emissive_sides: EmissiveSides,
}

/// Computes a normal for each vertex from positions and triangles.
pub(super) type VertexNormals = fn(&[Vec3], &[[u32; 3]]) -> Vec<Vec3>;

/// Interpretation of lights.
#[derive(Clone, Copy, Debug)]
pub(super) struct LightPolicies {
    /// Conversion of light nodes in place of the physical one.
    pub(super) node: Option<LightConversion>,
    /// True if emissive shapes are sampled as lights; otherwise they are only visible.
    pub(super) samples_shapes: bool,
    /// True if one of many lights is chosen for each sample.
    pub(super) trees: bool,
}

/// Converts a light node with a transform to a light; the text of an error is a note on a light
/// that is left out, and `Ok(None)` a light without area.
pub(super) type LightConversion =
    fn(&pt_scene::Light, DAffine3, &mut LightTables) -> Result<Option<AnyLight>, &'static str>;

/// Interpretation of cameras.
#[derive(Clone, Copy, Debug)]
pub(super) struct CameraPolicies {
    /// Placement of cameras of the scene, in place of the author's.
    pub(super) placement: Option<Placement>,
    /// True if images of other sizes show more or less, with pixels of the same size.
    pub(super) keeps_pixel_size: bool,
    /// True if only perspective cameras are used.
    pub(super) perspective_only: bool,
    /// Image size without a request, in place of the file's.
    pub(super) resolution: Option<[u32; 2]>,
    /// Pinhole in place of the author's lens and principal point, with this default distance of
    /// the plane in focus. Clipping distances are those of the node, along rays.
    pub(super) pinhole: Option<f32>,
}

impl Policies {
    /// Interpretation by physics.
    pub const PHYSICAL: Self = Self {
        program: None,
        uses_units: true,
        media: true,
        exposure: true,
        surface: |_, _| None,
        shapes: ShapePolicies {
            instancing: true,
            exact_transforms: true,
            vertex_normals: None,
            emissive_sides: EmissiveSides::Front,
        },
        lights: LightPolicies { node: None, samples_shapes: true, trees: true },
        camera: CameraPolicies {
            placement: None,
            keeps_pixel_size: false,
            perspective_only: false,
            resolution: None,
            pinhole: None,
        },
    };

    /// Returns the number of metres in a unit of the scene.
    pub fn metres_per_unit(&self, scene: &Scene) -> f64 {
        if self.uses_units { scene.metres_per_unit } else { 1.0 }
    }

    /// Returns true for the interpretation by physics.
    pub fn is_physical(&self) -> bool {
        self.program.is_none()
    }
}

impl Default for Policies {
    fn default() -> Self {
        Self::PHYSICAL
    }
}
