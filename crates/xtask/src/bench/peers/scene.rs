//! Scenes for all renderers: their contents, and files for the different programs.

use std::fmt::Write as _;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use pt_image::SaveOptions;
use pt_math::Vec3;
use serde_json::{Value, json};

use super::environment;
use crate::bench::ply;

/// Scene to be rendered. +y is up, colours are linear Rec. 709, images are square.
pub(super) struct PeerScene {
    pub(super) camera: PeerCamera,
    /// True if the environment map is [`environment::pixels`].
    pub(super) sky: bool,
    pub(super) meshes: Vec<PeerMesh>,
}

/// A pinhole camera with +y up.
pub(super) struct PeerCamera {
    pub(super) eye: Vec3,
    pub(super) look: Vec3,
    /// Horizontal and vertical field of view.
    pub(super) fov_degrees: f32,
}

/// Flat-shaded triangles of one material, counter-clockwise as seen from outside.
pub(super) struct PeerMesh {
    pub(super) name: String,
    pub(super) surface: PeerSurface,
    pub(super) positions: Vec<Vec3>,
    pub(super) triangles: Vec<[u32; 3]>,
}

/// Material of a mesh.
#[derive(Clone, Copy)]
pub(super) enum PeerSurface {
    /// Lambertian, with this albedo.
    Diffuse([f32; 3]),
    /// Conductor with GGX microfacets.
    Metal { alpha: f32, eta: [f32; 3], k: [f32; 3] },
    /// Black, and emitting this radiance on the outside.
    Emission([f32; 3]),
}

impl PeerMesh {
    /// Creates a mesh without triangles.
    pub(super) fn new(name: impl Into<String>, surface: PeerSurface) -> Self {
        Self { name: name.into(), surface, positions: Vec::new(), triangles: Vec::new() }
    }

    /// Adds triangles, whose indices start from 0.
    #[must_use]
    pub(super) fn with(mut self, positions: Vec<Vec3>, triangles: &[[u32; 3]]) -> Self {
        let base = self.positions.len() as u32;
        self.positions.extend(positions);
        self.triangles.extend(triangles.iter().map(|t| t.map(|corner| base + corner)));
        self
    }
}

/// Paths of the files of a scene.
pub(super) struct SceneFiles {
    /// Description for programs that build the scene piece by piece.
    pub(super) json: PathBuf,
    /// File in Mitsuba's format.
    pub(super) xml: PathBuf,
    /// Hash of the contents of the scene.
    pub(super) mark: u64,
}

impl PeerScene {
    /// Number of triangles.
    pub(super) fn triangles(&self) -> usize {
        self.meshes.iter().map(|m| m.triangles.len()).sum()
    }

    /// Writes the scene for all programs into a folder, which is created if necessary.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub(super) fn write(&self, folder: &Path) -> Result<SceneFiles> {
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
        let mut hasher = DefaultHasher::new();
        for mesh in &self.meshes {
            let path = folder.join(mesh.file());
            let triangles = mesh.triangles.iter().copied();
            ply::write(&path, mesh.positions.iter().map(Vec3::to_array), triangles)?;
            hash(&path, &mut hasher)?;
        }
        if self.sky {
            let path = folder.join(SKY);
            pt_image::save(&environment::pixels(), &path, &SaveOptions::default())?;
            hash(&path, &mut hasher)?;
        }
        let files = [("scene.json", self.json().to_string()), ("scene.xml", self.xml())];
        let [json, xml] = files.map(|(name, text)| {
            let path = folder.join(name);
            text.hash(&mut hasher);
            std::fs::write(&path, text).with_context(|| path.display().to_string()).map(|()| path)
        });
        Ok(SceneFiles { json: json?, xml: xml?, mark: hasher.finish() })
    }

    fn json(&self) -> Value {
        let PeerCamera { eye, look, fov_degrees } = self.camera;
        let mesh = |m: &PeerMesh| {
            let surface = match m.surface {
                PeerSurface::Diffuse(albedo) => json!({"diffuse": albedo}),
                PeerSurface::Metal { alpha, eta, k } => {
                    json!({"metal": {"alpha": alpha, "eta": eta, "k": k}})
                }
                PeerSurface::Emission(radiance) => json!({"emission": radiance}),
            };
            json!({"name": m.name, "ply": m.file(), "surface": surface})
        };
        json!({
            "camera": {"eye": eye.to_array(), "look": look.to_array(), "fov_degrees": fov_degrees},
            "sky": self.sky.then_some(SKY),
            "meshes": self.meshes.iter().map(mesh).collect::<Vec<_>>(),
        })
    }

    fn xml(&self) -> String {
        let PeerCamera { eye, look, fov_degrees } = self.camera;
        let [eye, look] = [eye, look].map(|v| triple(v.to_array()));
        let mut xml = format!(
            r#"<scene version="3.0.0">
  <default name="res" value="512"/>
  <default name="spp" value="64"/>
  <default name="max_depth" value="6"/>
  <default name="rr_depth" value="5"/>
  <default name="sampler" value="multijitter"/>
  <integrator type="path">
    <integer name="max_depth" value="$max_depth"/>
    <integer name="rr_depth" value="$rr_depth"/>
  </integrator>
  <sensor type="perspective">
    <float name="fov" value="{fov_degrees}"/>
    <float name="near_clip" value="0.001"/>
    <float name="far_clip" value="1000"/>
    <transform name="to_world"><lookat origin="{eye}" target="{look}" up="0, 1, 0"/></transform>
    <sampler type="$sampler"><integer name="sample_count" value="$spp"/></sampler>
    <film type="hdrfilm">
      <integer name="width" value="$res"/>
      <integer name="height" value="$res"/>
      <string name="pixel_format" value="rgb"/>
      <string name="component_format" value="float32"/>
      <rfilter type="box"/>
    </film>
  </sensor>
"#
        );
        if self.sky {
            let line = format!(
                "  <emitter type=\"envmap\"><string name=\"filename\" value=\"{SKY}\"/></emitter>\n"
            );
            xml.push_str(&line);
        }
        for mesh in &self.meshes {
            mesh.add_xml(&mut xml);
        }
        xml.push_str("</scene>\n");
        xml
    }
}

/// File name of the environment map of a scene.
const SKY: &str = "sky.exr";

impl PeerMesh {
    fn file(&self) -> String {
        format!("{}.ply", self.name)
    }

    fn add_xml(&self, xml: &mut String) {
        let (bsdf, emitter) = match self.surface {
            PeerSurface::Diffuse(albedo) => (diffuse(albedo), String::new()),
            PeerSurface::Metal { alpha, eta, k } => (
                format!(
                    "<bsdf type=\"roughconductor\"><string name=\"distribution\" value=\"ggx\"/>\
                     <float name=\"alpha\" value=\"{alpha}\"/><rgb name=\"eta\" value=\"{}\"/>\
                     <rgb name=\"k\" value=\"{}\"/></bsdf>",
                    triple(eta),
                    triple(k)
                ),
                String::new(),
            ),
            PeerSurface::Emission(radiance) => (
                diffuse([0.0; 3]),
                format!(
                    "    <emitter type=\"area\"><rgb name=\"radiance\" value=\"{}\"/></emitter>\n",
                    triple(radiance)
                ),
            ),
        };
        // Writing to a string never fails.
        let _ = write!(
            xml,
            "  <shape type=\"ply\">\n    <string name=\"filename\" value=\"{}\"/>\n    \
             <boolean name=\"face_normals\" value=\"true\"/>\n    {bsdf}\n{emitter}  </shape>\n",
            self.file()
        );
    }
}

fn diffuse(albedo: [f32; 3]) -> String {
    let albedo = triple(albedo);
    format!("<bsdf type=\"diffuse\"><rgb name=\"reflectance\" value=\"{albedo}\"/></bsdf>")
}

fn triple([x, y, z]: [f32; 3]) -> String {
    format!("{x}, {y}, {z}")
}

/// Adds the contents of a file to a hash.
fn hash(path: &Path, hasher: &mut DefaultHasher) -> Result<()> {
    std::fs::read(path).with_context(|| path.display().to_string())?.hash(hasher);
    Ok(())
}
