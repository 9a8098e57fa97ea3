//! Graphics state: transforms and attributes that apply to subsequent directives.

use std::rc::Rc;

use pt_math::{DAffine3, DMat3, DVec3};

use super::color_space::ColorSpace;
use super::entity::Entity;
use super::parameter::ParsedParameter;
use super::types::{MaterialName, MediumInterface};
use crate::pbrt::types::Moving;

/// Graphics state.
#[derive(Clone)]
pub(super) struct GraphicsState {
    /// Current transformation matrix, from object space to the world.
    pub(super) ctm: Moving,
    /// True for each of the two transforms that directives change.
    pub(super) active: [bool; 2],
    pub(super) reverses: bool,
    pub(super) material: MaterialName,
    /// Area light of subsequent shapes.
    pub(super) area_light: Option<Rc<Entity>>,
    pub(super) media: Rc<MediumInterface>,
    pub(super) color_space: ColorSpace,
    pub(super) defaults: AttributeDefaults,
}

/// Default parameters that `Attribute` sets for subsequent directives.
#[derive(Clone, Default)]
pub(super) struct AttributeDefaults {
    pub(super) shape: Rc<[ParsedParameter]>,
    pub(super) light: Rc<[ParsedParameter]>,
    pub(super) material: Rc<[ParsedParameter]>,
    pub(super) medium: Rc<[ParsedParameter]>,
    pub(super) texture: Rc<[ParsedParameter]>,
}

/// Targets of `Attribute`.
pub(super) const TARGETS: [&str; 5] = ["shape", "light", "material", "medium", "texture"];

impl AttributeDefaults {
    /// Returns the defaults of one of [`TARGETS`]; `None` for any other name.
    pub(super) fn of(&mut self, target: &str) -> Option<&mut Rc<[ParsedParameter]>> {
        match target {
            "shape" => Some(&mut self.shape),
            "light" => Some(&mut self.light),
            "material" => Some(&mut self.material),
            "medium" => Some(&mut self.medium),
            "texture" => Some(&mut self.texture),
            _ => None,
        }
    }
}

impl GraphicsState {
    pub(super) fn new() -> Self {
        Self {
            ctm: [DAffine3::IDENTITY; 2],
            active: [true; 2],
            reverses: false,
            material: MaterialName::Anonymous(0),
            area_light: None,
            media: Rc::default(),
            color_space: ColorSpace::SRGB,
            defaults: AttributeDefaults::default(),
        }
    }

    /// Changes the active transforms.
    pub(super) fn change(&mut self, change: impl Fn(DAffine3) -> DAffine3) {
        for (ctm, is_active) in self.ctm.iter_mut().zip(self.active) {
            if is_active {
                *ctm = change(*ctm);
            }
        }
    }
}

/// Converts 16 numbers in column-major order to a transform.
///
/// # Errors
/// If it is not affine.
pub(super) fn matrix(numbers: &[f64; 16]) -> Result<DAffine3, String> {
    let (columns, _) = numbers.as_chunks::<4>();
    let last_row: [f64; 4] = std::array::from_fn(|c| columns[c][3]);
    if last_row[..3] != [0.0; 3] || last_row[3] == 0.0 {
        return Err(
            "found a matrix that is not affine, expected 0, 0, 0 and 1 as the last of each four \
             numbers"
                .to_owned(),
        );
    }
    let column = |c: usize| DVec3::new(columns[c][0], columns[c][1], columns[c][2]) / last_row[3];
    Ok(DAffine3::from_mat3_translation(
        DMat3::from_cols(column(0), column(1), column(2)),
        column(3),
    ))
}

/// Returns true if a transform mirrors space.
pub(super) fn mirrors(map: &DAffine3) -> bool {
    map.matrix3.determinant() < 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn matrices_are_written_by_columns() {
        let numbers =
            [0.0, 1.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 5.0, 6.0, 7.0, 1.0];
        let map = matrix(&numbers).expect("affine");
        assert_eq!(map.transform_point3(DVec3::X), DVec3::new(5.0, 7.0, 7.0));
        assert!(!mirrors(&map) && mirrors(&DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0))));
        let mut doubled = numbers;
        doubled[15] = 2.0;
        assert_eq!(matrix(&doubled).expect("affine").translation, DVec3::new(2.5, 3.0, 3.5));
        doubled[3] = 1.0;
        assert!(matrix(&doubled).is_err());
    }
}
