//! `<transform>`, and `<animation>` with keyframes.

use pt_math::{DAffine3, DVec3};
use pt_scene::{Key, Motion};

use super::{MitsubaReader, XmlDocument, XmlNode, value};
use crate::LoadError;
use crate::shared::number::number;
use crate::shared::transform::{look_at, matrix, perpendicular, rotate};

impl MitsubaReader {
    /// Returns the product of the steps of a transform, which are applied in order.
    pub(super) fn transform<'a>(
        &mut self,
        document: &'a XmlDocument<'a>,
        node: XmlNode<'a>,
    ) -> Result<DAffine3, LoadError> {
        let mut product = DAffine3::IDENTITY;
        for step in node.children().filter(XmlNode::is_element) {
            product = self.step(document, step)? * product;
            if !product.is_finite() {
                return Err(document.error(step, "found a transform that is not finite"));
            }
        }
        Ok(product)
    }

    /// Reads a step of a transform.
    fn step<'a>(
        &mut self,
        document: &'a XmlDocument<'a>,
        node: XmlNode<'a>,
    ) -> Result<DAffine3, LoadError> {
        const VECTOR: [&str; 4] = ["value", "x", "y", "z"];
        let error = |message: &str| document.error(node, message);
        match node.tag_name().name() {
            "translate" => {
                let vector = self.attributes(document, node, &[], &VECTOR)?.vector(0.0)?;
                Ok(DAffine3::from_translation(vector))
            }
            "scale" => {
                let vector = self.attributes(document, node, &[], &VECTOR)?.vector(1.0)?;
                Ok(DAffine3::from_scale(vector))
            }
            "rotate" => self.rotation(document, node),
            "lookat" => {
                let attributes = self.attributes(document, node, &["origin", "target"], &["up"])?;
                let point = |name| {
                    let numbers = attributes.parse(name, value::three)?;
                    Ok(DVec3::from_array(numbers.unwrap_or_default()))
                };
                let (origin, target, up) = (point("origin")?, point("target")?, point("up")?);
                let up = if up == DVec3::ZERO { perpendicular(target - origin) } else { up };
                look_at(origin, target, up)
                    .ok_or_else(|| error("found origin, target and up direction on one line"))
            }
            "matrix" => {
                let attributes = self.attributes(document, node, &["value"], &[])?;
                let parse = |text: &str| matrix(&value::numbers(text)?);
                Ok(attributes.parse("value", parse)?.unwrap_or(DAffine3::IDENTITY))
            }
            tag => {
                let known = ["translate", "scale", "rotate", "lookat", "matrix"];
                let list = known.join(", ");
                Err(error(&format!("unknown transform step <{tag}>; supported: {list}")))
            }
        }
    }

    fn rotation<'a>(
        &mut self,
        document: &'a XmlDocument<'a>,
        node: XmlNode<'a>,
    ) -> Result<DAffine3, LoadError> {
        const UNIT_TOLERANCE: f64 = 1e-4; // axes are written with a few digits
        let attributes = self.attributes(document, node, &["angle"], &["value", "x", "y", "z"])?;
        let axis = attributes.vector(0.0)?;
        let angle = attributes.parse("angle", number)?.unwrap_or_default();
        if axis == DVec3::ZERO {
            return Err(
                document.error(node, "found a zero rotation axis, expected a non-zero axis")
            );
        }
        if (axis.length() - 1.0).abs() > UNIT_TOLERANCE {
            let message = "found an axis that is not of unit length; it is normalized, where \
                           Mitsuba 3.9 scales and shears";
            self.tree.warnings.push(document.warning(node, message));
        }
        Ok(rotate(axis, angle))
    }

    /// Reads an `<animation>` with a `<transform time="…">` for each key, as in Mitsuba 0.6.
    pub(super) fn animation<'a>(
        &mut self,
        document: &'a XmlDocument<'a>,
        node: XmlNode<'a>,
    ) -> Result<Motion, LoadError> {
        let (mut keys, mut nodes) = (Vec::new(), vec![]);
        for child in node.children().filter(XmlNode::is_element) {
            if child.tag_name().name() != "transform" {
                let message = "expected <transform time=\"…\"> in an <animation>";
                return Err(document.error(child, message));
            }
            let attributes = self.attributes(document, child, &["time"], &["name"])?;
            let time = attributes.parse("time", number)?.unwrap_or_default();
            keys.push(Key { time, to_world: self.transform(document, child)? });
            nodes.push(child);
        }
        Motion::new(keys).map_err(|error| {
            let at = nodes.get(error.key).copied().unwrap_or(node);
            document.error(at, error.message)
        })
    }
}
