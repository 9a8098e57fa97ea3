//! Directives that change transforms.

use pt_math::{DAffine3, DVec3};

use super::super::arguments::{active, numbers, text};
use super::super::position::TokenPosition;
use super::super::state::matrix;
use super::super::token::Tokens;
use super::PbrtReader;
use crate::LoadError;
use crate::shared::names::{did_you_mean, quote};
use crate::shared::transform::{look_at, rotate};

impl PbrtReader {
    /// Processes a directive that changes the current transform.
    pub(super) fn transform(
        &mut self,
        word: &str,
        tokens: &mut Tokens<'_>,
        at: &TokenPosition,
    ) -> Result<(), LoadError> {
        let finite = |map: DAffine3| {
            if map.is_finite() {
                Ok(map)
            } else {
                Err(at.error("found a transform that is not finite"))
            }
        };
        match word {
            "Identity" => self.state.change(|_| DAffine3::IDENTITY),
            "Translate" => {
                let step = DAffine3::from_translation(DVec3::from_array(numbers(tokens, at)?));
                self.state.change(|ctm| ctm * step);
            }
            "Scale" => {
                let step = DAffine3::from_scale(DVec3::from_array(numbers(tokens, at)?));
                self.state.change(|ctm| ctm * step);
            }
            "Rotate" => {
                let [angle, x, y, z] = numbers(tokens, at)?;
                let axis = DVec3::new(x, y, z);
                if axis.try_normalize().is_none() {
                    return Err(at.error(
                        "found a zero rotation axis, expected an angle and a non-zero axis",
                    ));
                }
                let step = rotate(axis, angle);
                self.state.change(|ctm| ctm * step);
            }
            "LookAt" => {
                let n: [f64; 9] = numbers(tokens, at)?;
                let [eye, target, up] = [0, 3, 6].map(|i| DVec3::new(n[i], n[i + 1], n[i + 2]));
                let Some(node) = look_at(eye, target, up) else {
                    return Err(
                        at.error("found eye, target and up direction of LookAt on one line")
                    );
                };
                let step = node.inverse();
                self.state.change(|ctm| ctm * step);
            }
            "Transform" | "ConcatTransform" => {
                let map = matrix(&numbers(tokens, at)?).map_err(|message| at.error(message))?;
                let replaces = word == "Transform";
                self.state.change(|ctm| if replaces { map } else { ctm * map });
            }
            "CoordinateSystem" => {
                let name = text(tokens, at)?;
                self.systems.insert(name, self.state.ctm);
            }
            "CoordSysTransform" => {
                let name = text(tokens, at)?;
                let Some(system) = self.systems.get(&name) else {
                    let hint = did_you_mean(&name, self.systems.keys().map(String::as_str));
                    return Err(
                        at.error(format!("undefined coordinate system {}{hint}", quote(&name)))
                    );
                };
                self.state.ctm = *system;
            }
            "ActiveTransform" => self.state.active = active(tokens, at)?,
            _ => self.times(tokens, at)?,
        }
        self.state.ctm.into_iter().try_for_each(|ctm| finite(ctm).map(drop))
    }

    fn times(&mut self, tokens: &mut Tokens<'_>, at: &TokenPosition) -> Result<(), LoadError> {
        let times: [f64; 2] = numbers(tokens, at)?;
        if self.in_world {
            return Err(at.error("found TransformTimes after WorldBegin, expected before"));
        }
        if times[0] >= times[1] {
            return Err(at.error("expected TransformTimes with an end after the start"));
        }
        self.world.times = times;
        Ok(())
    }
}
