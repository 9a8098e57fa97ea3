//! `<medium>` with its `<phase>` and its `<volume>`s.

use std::collections::HashMap;
use std::sync::Arc;

use pt_math::{DAffine3, DMat3};
use pt_scene::medium::{
    Grid, GridFilter, Heterogeneous, MediumEmission, MediumProperties, Phase, PhaseBlend,
    PlacedGrid, Volume,
};
use pt_scene::{Medium, Sides, Warning};

use super::object::{ColorRole, MitsubaObject, ObjectTree, Parameters, error, unsupported};
use super::value::numbers;
use super::volume::{Grids, VolumeField};
use crate::LoadError;
use crate::shared::names::quote;

const KINDS: [&str; 2] = ["heterogeneous", "homogeneous"];
const PHASES: [&str; 6] = ["blendphase", "hg", "isotropic", "rayleigh", "sggx", "tabphase"];
/// Maximum number of phase functions of a medium, each counted once per reference.
const MAX_PHASES: usize = 32;

/// Cache of the media of a scene and their grids.
pub(super) struct MitsubaMediumCache<'t> {
    tree: &'t ObjectTree,
    pub(super) made: Vec<Medium>,
    /// Medium indices by object index.
    known: HashMap<usize, u32>,
    grids: Grids,
    pub(super) warnings: Vec<Warning>,
}

impl<'t> MitsubaMediumCache<'t> {
    pub(super) fn new(tree: &'t ObjectTree) -> Self {
        let (made, warnings) = (Vec::new(), Vec::new());
        Self { tree, made, known: HashMap::new(), grids: Grids::default(), warnings }
    }

    /// Returns the media on both sides of a shape, if it has any.
    pub(super) fn sides(&mut self, shape: &MitsubaObject) -> Result<Option<Sides>, LoadError> {
        let (mut interior, mut exterior) = (None, None);
        for child in &shape.children {
            let index = self.tree.target(child)?;
            if self.tree.objects[index].tag != "medium" {
                continue;
            }
            let side = match child.name.as_str() {
                "interior" => &mut interior,
                "exterior" => &mut exterior,
                name => {
                    let message = format!(
                        "unknown side {} of a shape; expected name=\"interior\" or \
                         name=\"exterior\"",
                        quote(name)
                    );
                    return Err(error(&child.at, message));
                }
            };
            if side.is_some() {
                let message = format!("duplicate {} medium; expected at most one", child.name);
                return Err(error(&child.at, message));
            }
            *side = Some(self.get(index)?);
        }
        let sides = Sides { interior, exterior };
        Ok((sides != Sides::default()).then_some(sides))
    }

    /// Returns the medium around a sensor, if there is one.
    pub(super) fn around(&mut self, sensor: &MitsubaObject) -> Result<Option<u32>, LoadError> {
        let mut media = Vec::new();
        for child in &sensor.children {
            media.push(self.tree.target(child)?);
        }
        let medium = self.tree.only(&media, "medium")?;
        medium.map(|index| self.get(index)).transpose()
    }

    /// Returns the index of the medium of an object.
    fn get(&mut self, index: usize) -> Result<u32, LoadError> {
        if let Some(&known) = self.known.get(&index) {
            return Ok(known);
        }
        let object = &self.tree.objects[index];
        let children = self.tree.children(object, &["phase", "volume"])?;
        let phase = self.tree.only(&children, "phase")?;
        let mut left = MAX_PHASES;
        let phase = phase.map(|i| self.phase_of(&self.tree.objects[i], &mut left));
        let phase = phase.transpose()?;
        let mut parameters = Parameters::new(object);
        parameters.pass_over(&["sample_emitters", "has_spectral_extinction"]);
        let extinction =
            self.field(object, &mut parameters, "sigma_t", ColorRole::Extinction, 1.0)?;
        let albedo = self.field(object, &mut parameters, "albedo", ColorRole::Share, 0.75)?;
        let scale = parameters.float("scale")?.unwrap_or(1.0) as f32;
        if scale < 0.0 {
            let message = format!("found \"scale\" = {scale}, expected a number of at least 0");
            return Err(parameters.refuse("scale", message));
        }
        let matter = match object.kind.as_str() {
            "homogeneous" => homogeneous(&parameters, extinction, scale, albedo)?,
            "heterogeneous" => self.heterogeneous(object, extinction, scale, albedo),
            _ => return Err(unsupported(object, &KINDS)),
        };
        parameters.finish()?;
        self.refuse_others(object)?;
        let (name, at) = (object.name().to_owned(), object.at.clone());
        let phase = phase.unwrap_or_default();
        self.made.push(Medium { name, matter, phase, at });
        let number = self.made.len() as u32 - 1;
        self.known.insert(index, number);
        Ok(number)
    }

    /// Reads a spatially varying value: a parameter or a volume.
    fn field(
        &mut self,
        medium: &MitsubaObject,
        parameters: &mut Parameters<'_>,
        name: &'static str,
        role: ColorRole,
        default: f64,
    ) -> Result<VolumeField, LoadError> {
        for child in &medium.children {
            let index = self.tree.target(child)?;
            if child.name == name && self.tree.objects[index].tag == "volume" {
                if parameters.find(name).is_some() {
                    let message = format!(
                        "found a <volume> and a value for {}, expected one of them",
                        quote(name)
                    );
                    return Err(error(&child.at, message));
                }
                return self.grids.volume(self.tree, &self.tree.objects[index], role);
            }
        }
        let color = parameters.color(name, role, default)?;
        Ok(VolumeField::Constant(color, DAffine3::IDENTITY))
    }

    /// Creates a heterogeneous medium. A constant extinction is confined to its box, as in Mitsuba.
    fn heterogeneous(
        &mut self,
        object: &MitsubaObject,
        extinction: VolumeField,
        scale: f32,
        albedo: VolumeField,
    ) -> MediumProperties {
        let extinction = match extinction {
            VolumeField::Constant([r, g, b], to_world) => {
                let is_grey = r == g && g == b;
                let grid = if is_grey { Grid::uniform(r) } else { Grid::uniform_color([r, g, b]) };
                PlacedGrid { grid: Arc::new(grid), to_world, filter: GridFilter::Nearest }
            }
            VolumeField::Grid(placed) => placed,
        };
        if is_turned(extinction.to_world.matrix3) {
            let message = "rotated grid: its boundary is the rotated box; Mitsuba uses the \
                           axis-aligned box around it";
            self.warnings.push(Warning { at: object.at.clone(), message: message.to_owned() });
        }
        let albedo = match albedo {
            VolumeField::Constant(albedo, _) => Volume::Constant(albedo),
            VolumeField::Grid(placed) => Volume::Grid(placed),
        };
        let emission = MediumEmission::Constant([0.0; 3]);
        MediumProperties::Heterogeneous(Box::new(Heterogeneous {
            extinction,
            scale,
            albedo,
            emission,
        }))
    }

    /// Reads a phase function. `left` is the number of phase functions that are still allowed.
    fn phase_of(&mut self, object: &MitsubaObject, left: &mut usize) -> Result<Phase, LoadError> {
        let tree = self.tree;
        let too_many =
            || error(&object.at, format!("the medium has more than {MAX_PHASES} phase functions"));
        *left = left.checked_sub(1).ok_or_else(too_many)?;
        let inside: &[&str] = match object.kind.as_str() {
            "blendphase" => &["phase"],
            "sggx" => &["volume"],
            _ => &[],
        };
        let children = tree.children(object, inside)?;
        let mut parameters = Parameters::new(object);
        let phase = match object.kind.as_str() {
            "blendphase" => {
                let [first, second] = children.as_slice() else {
                    let message = format!("expected two <phase>, found {}", children.len());
                    return Err(error(&object.at, message));
                };
                let share = parameters.float("weight")?.unwrap_or(0.5) as f32;
                if !(0.0..=1.0).contains(&share) {
                    let message =
                        format!("found \"weight\" = {share}, expected a number from 0 to 1");
                    return Err(parameters.refuse("weight", message));
                }
                let first = self.phase_of(&tree.objects[*first], left)?;
                let second = self.phase_of(&tree.objects[*second], left)?;
                Phase::Blend(Box::new(PhaseBlend { first, second, amount: share }))
            }
            "isotropic" => Phase::Isotropic,
            "rayleigh" => Phase::Rayleigh,
            "hg" => {
                let g = parameters.float("g")?.unwrap_or(0.8) as f32;
                if !(-1.0 < g && g < 1.0) {
                    let message =
                        format!("found \"g\" = {g}, expected a number above -1 and below 1");
                    return Err(parameters.refuse("g", message));
                }
                Phase::HenyeyGreenstein { g }
            }
            "sggx" => {
                let [volume] = children.as_slice() else {
                    let message = "expected one <volume name=\"S\"> with six numbers in each cell";
                    return Err(error(&object.at, message));
                };
                let matrices = self.grids.matrices(tree, &tree.objects[*volume])?;
                Phase::Microflakes { matrices }
            }
            "tabphase" => Phase::Table { values: table(&mut parameters)? },
            _ => return Err(unsupported(object, &PHASES)),
        };
        parameters.finish()?;
        Ok(phase)
    }

    /// Rejects volumes that are not supported.
    fn refuse_others(&self, medium: &MitsubaObject) -> Result<(), LoadError> {
        for child in &medium.children {
            let is_volume = self.tree.objects[self.tree.target(child)?].tag == "volume";
            if is_volume && !matches!(child.name.as_str(), "sigma_t" | "albedo") {
                let message = format!(
                    "unsupported <volume name={}>; supported: sigma_t, albedo",
                    quote(&child.name)
                );
                return Err(error(&child.at, message));
            }
        }
        Ok(())
    }
}

fn homogeneous(
    parameters: &Parameters<'_>,
    extinction: VolumeField,
    scale: f32,
    albedo: VolumeField,
) -> Result<MediumProperties, LoadError> {
    let constant = |field, name| match field {
        VolumeField::Constant(color, _) => Ok(color),
        VolumeField::Grid(_) => {
            let message =
                "a grid requires the medium type \"heterogeneous\", found \"homogeneous\"";
            Err(parameters.refuse(name, message))
        }
    };
    let extinction = constant(extinction, "sigma_t")?.map(|sigma| sigma * scale);
    let albedo = constant(albedo, "albedo")?;
    Ok(MediumProperties::Homogeneous { extinction, albedo, emission: [0.0; 3] })
}

/// Reads the values of a phase function at equal steps of the cosine.
fn table(parameters: &mut Parameters<'_>) -> Result<Vec<f32>, LoadError> {
    const EXPECTED: &str = "expected two or more numbers from 0 up, not all of them 0, at equal \
                            steps of the cosine from -1 to 1";
    let text = parameters.text("values")?.unwrap_or_default();
    let refuse = |found: &str| parameters.refuse("values", format!("{found}; {EXPECTED}"));
    let values = numbers(text).map_err(|message| refuse(&message))?;
    if let Some(bad) = values.iter().find(|v| **v < 0.0) {
        return Err(refuse(&format!("found {bad}")));
    }
    if values.len() < 2 || values.iter().all(|v| *v as f32 == 0.0) {
        return Err(refuse(&format!("found {}", quote(text))));
    }
    Ok(values.into_iter().map(|v| v as f32).collect())
}

/// Returns true if the axes of a box are not aligned with those of the world.
fn is_turned(axes: DMat3) -> bool {
    const TOLERANCE: f64 = 1e-6; // turns by quarters are rounded
    let is_along_one =
        |axis: pt_math::DVec3| axis.abs().max_element() >= (1.0 - TOLERANCE) * axis.length();
    ![axes.x_axis, axes.y_axis, axes.z_axis].into_iter().all(is_along_one)
}
