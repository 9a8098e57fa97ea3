//! Transforms: a matrix, or a list of steps in order of application.

use pt_math::{DAffine3, DMat3, DVec3};
use serde_json::{Value, json};

use super::codec::{FieldCodec, JsonCodec};
use super::context::{JsonReader, JsonWriter};
use super::node::JsonNode;
use super::number::{ANY, numbers, vector, vector_schema};
use super::printer::Out;
use super::schema::Schemas;
use crate::LoadError;
use crate::shared::transform::{look_at, rotate};

/// Keys of the steps of a transform.
const STEPS: [&str; 5] = ["translate", "rotate", "scale", "look_at", "matrix"];

impl JsonCodec for DAffine3 {
    fn read(node: &JsonNode<'_>, _: &mut JsonReader<'_>) -> Result<Self, LoadError> {
        if node.value().as_array().is_none() {
            return step(node);
        }
        let steps = node.list("steps of a transform")?;
        let all = steps.iter().try_fold(Self::IDENTITY, |all, node| Ok(step(node)? * all))?;
        check(all, node)
    }

    /// Writes scaling and translation if these are exact, and a matrix otherwise.
    fn write(&self, _: &mut JsonWriter<'_>) -> Result<Out, String> {
        let diagonal = self.matrix3.to_cols_array_2d();
        let scale = DVec3::new(diagonal[0][0], diagonal[1][1], diagonal[2][2]);
        let steps = [("scale", scale, DVec3::ONE), ("translate", self.translation, DVec3::ZERO)];
        let composed = Self::from_translation(self.translation) * Self::from_scale(scale);
        if !same_bits(&composed, self) {
            return matrix_of(self);
        }
        let kept = steps.into_iter().filter(|(_, value, default)| value != default);
        let steps = kept.map(|(name, value, _)| {
            Ok(Out::Object(vec![(name.to_owned(), numbers(&value.to_array())?)]))
        });
        let mut steps = steps.collect::<Result<Vec<_>, String>>()?;
        Ok(if steps.len() == 1 { steps.remove(0) } else { Out::List(steps) })
    }

    fn schema(schemas: &mut Schemas) -> Value {
        let step = schemas.define("Step", |_| {
            let three = vector_schema(&json!({"type": "number"}), 3);
            let number = json!({"type": "number"});
            let row = vector_schema(&number, 4);
            let object = |properties: Value, required: &str| {
                json!({
                    "type": "object", "properties": properties, "required": [required],
                    "additionalProperties": false
                })
            };
            json!({"anyOf": [
                object(json!({"translate": three}), "translate"),
                object(json!({"rotate": number, "axis": three}), "rotate"),
                object(json!({"scale": {"anyOf": [number, three]}}), "scale"),
                object(json!({"look_at": three, "from": three, "up": three}), "look_at"),
                object(json!({"matrix": {"type": "array", "items": row, "minItems": 3, "maxItems": 4}}), "matrix"),
            ]})
        });
        json!({"anyOf": [step, {"type": "array", "items": step}]})
    }
}

/// Returns true if both are bitwise equal, including the signs of zeros.
fn same_bits(a: &DAffine3, b: &DAffine3) -> bool {
    a.to_cols_array().map(f64::to_bits) == b.to_cols_array().map(f64::to_bits)
}

fn matrix_of(transform: &DAffine3) -> Result<Out, String> {
    let DAffine3 { matrix3, translation } = transform;
    let row = |i: usize| {
        numbers(&[matrix3.x_axis[i], matrix3.y_axis[i], matrix3.z_axis[i], translation[i]])
    };
    let rows = (0..3).map(row).collect::<Result<_, _>>()?;
    Ok(Out::Object(vec![("matrix".to_owned(), Out::List(rows))]))
}

/// Reads an invertible step.
fn step(node: &JsonNode<'_>) -> Result<DAffine3, LoadError> {
    check(any_step(node)?, node)
}

/// Reads a step.
fn any_step(node: &JsonNode<'_>) -> Result<DAffine3, LoadError> {
    let three =
        |node: &JsonNode<'_>| vector::<f64, 3>(node, &ANY, "[x, y, z]").map(DVec3::from_array);
    let mut keys = node.keys()?;
    let found = STEPS.map(|name| keys.take(name));
    let transform = match &found {
        [Some(by), None, None, None, None] => DAffine3::from_translation(three(by)?),
        [None, Some(degrees), None, None, None] => {
            let axis = keys.take("axis").map_or(Ok(DVec3::Y), |axis| three(&axis))?;
            if axis.try_normalize().is_none() {
                return Err(node.error("found a zero rotation axis, expected a non-zero axis"));
            }
            rotate(axis, ANY.number(degrees)?)
        }
        [None, None, Some(by), None, None] => DAffine3::from_scale(match by.digits() {
            Some(_) => DVec3::splat(ANY.number(by)?),
            None => three(by)?,
        }),
        [None, None, None, Some(target), None] => {
            let from = keys.take("from").map_or(Ok(DVec3::ZERO), |from| three(&from))?;
            let up = keys.take("up").map_or(Ok(DVec3::Y), |up| three(&up))?;
            look(from, three(target)?, up).ok_or_else(|| {
                node.error("found eye, target and \"up\" that do not span a plane")
            })?
        }
        [None, None, None, None, Some(rows)] => matrix(rows)?,
        _ => {
            let expected = format!("one of {} in each step", STEPS.join(", "));
            return Err(node.unexpected(&expected));
        }
    };
    keys.finish()?;
    Ok(transform)
}

/// Returns a node with −z towards the target, as for cameras and lights, and +y up.
fn look(from: DVec3, target: DVec3, up: DVec3) -> Option<DAffine3> {
    let DAffine3 { matrix3, translation } = look_at(from, target, up)?;
    let turned = DMat3::from_cols(-matrix3.x_axis, matrix3.y_axis, -matrix3.z_axis);
    Some(DAffine3::from_mat3_translation(turned, translation))
}

/// Reads the rows of a matrix; the last one, which is constant, is optional.
fn matrix(node: &JsonNode<'_>) -> Result<DAffine3, LoadError> {
    let expected = "3 or 4 rows of 4 numbers";
    let rows = node.list(expected)?;
    let rows: Vec<_> = rows
        .iter()
        .map(|row| vector::<f64, 4>(row, &ANY, "4 numbers"))
        .collect::<Result<_, _>>()?;
    let affine = match rows.as_slice() {
        [a, b, c] | [a, b, c, [0.0, 0.0, 0.0, 1.0]] => [a, b, c],
        [_, _, _, _] => {
            return Err(node.error(
                "found a last row other than 0, 0, 0, 1; only affine transforms are supported",
            ));
        }
        _ => return Err(node.unexpected(expected)),
    };
    let column = |c: usize| DVec3::from_array(affine.map(|row| row[c]));
    let linear = DMat3::from_cols(column(0), column(1), column(2));
    Ok(DAffine3::from_mat3_translation(linear, column(3)))
}

/// Checks that a transform is invertible.
fn check(transform: DAffine3, node: &JsonNode<'_>) -> Result<DAffine3, LoadError> {
    let determinant = transform.matrix3.determinant();
    if transform.is_finite() && determinant != 0.0 && determinant.is_finite() {
        return Ok(transform);
    }
    Err(node.error(
        "found a transform that flattens space or is not finite, expected an invertible one",
    ))
}

/// Codec of the transform from the world to the space of a texture, which may be singular.
pub(super) struct ToTexture;

impl FieldCodec<DAffine3> for ToTexture {
    fn read(&self, node: &JsonNode<'_>, _: &mut JsonReader<'_>) -> Result<DAffine3, LoadError> {
        let all = if node.value().as_array().is_none() {
            any_step(node)?
        } else {
            let steps = node.list("steps of a transform")?;
            steps.iter().try_fold(DAffine3::IDENTITY, |all, node| {
                Ok::<_, LoadError>(any_step(node)? * all)
            })?
        };
        if all.is_finite() {
            Ok(all)
        } else {
            Err(node.error("found a transform that is not finite, expected finite numbers"))
        }
    }

    fn write(&self, value: &DAffine3, cx: &mut JsonWriter<'_>) -> Result<Out, String> {
        value.write(cx)
    }

    fn schema(&self, schemas: &mut Schemas) -> Value {
        DAffine3::schema(schemas)
    }
}

/// Codec of the transform from (u, v, 1) of a surface to those of a texture: steps, or a matrix of
/// 3 × 3 numbers.
pub(super) struct OfTexture;

impl FieldCodec<DMat3> for OfTexture {
    fn read(&self, node: &JsonNode<'_>, _: &mut JsonReader<'_>) -> Result<DMat3, LoadError> {
        if node.value().as_array().is_none() {
            return texture_step(node);
        }
        let steps = node.list("steps of a transform")?;
        steps.iter().try_fold(DMat3::IDENTITY, |all, node| Ok(texture_step(node)? * all))
    }

    fn write(&self, value: &DMat3, _: &mut JsonWriter<'_>) -> Result<Out, String> {
        let rows = value.transpose().to_cols_array_2d();
        let rows = rows.iter().map(|row| numbers(row)).collect::<Result<_, _>>()?;
        Ok(Out::Object(vec![("matrix".to_owned(), Out::List(rows))]))
    }

    fn schema(&self, schemas: &mut Schemas) -> Value {
        let step = schemas.define("TextureStep", |_| {
            let number = json!({"type": "number"});
            let two = vector_schema(&number, 2);
            let object = |name: &str, value: Value| {
                json!({
                    "type": "object", "properties": {name: value}, "required": [name],
                    "additionalProperties": false
                })
            };
            json!({"anyOf": [
                object("translate", two.clone()),
                object("rotate", number.clone()),
                object("scale", json!({"anyOf": [number, two]})),
                object("matrix", vector_schema(&vector_schema(&number, 3), 3)),
            ]})
        });
        json!({"anyOf": [step, {"type": "array", "items": step}]})
    }
}

fn texture_step(node: &JsonNode<'_>) -> Result<DMat3, LoadError> {
    const STEPS: [&str; 4] = ["translate", "rotate", "scale", "matrix"];
    let two = |node: &JsonNode<'_>| vector::<f64, 2>(node, &ANY, "[u, v]");
    let mut keys = node.keys()?;
    let found = STEPS.map(|name| keys.take(name));
    let step = match &found {
        [Some(by), None, None, None] => DMat3::from_translation(two(by)?.into()),
        [None, Some(degrees), None, None] => rotate(DVec3::Z, ANY.number(degrees)?).matrix3,
        [None, None, Some(by), None] => DMat3::from_scale(match by.digits() {
            Some(_) => [ANY.number(by)?; 2].into(),
            None => two(by)?.into(),
        }),
        [None, None, None, Some(rows)] => {
            let expected = "3 rows of 3 numbers";
            let read = rows.list(expected)?;
            let read: Vec<[f64; 3]> =
                read.iter().map(|row| vector(row, &ANY, "3 numbers")).collect::<Result<_, _>>()?;
            let rows: [[f64; 3]; 3] = read.try_into().map_err(|_| rows.unexpected(expected))?;
            DMat3::from_cols_array_2d(&rows).transpose()
        }
        _ => {
            let expected = format!("one of {} in each step", STEPS.join(", "));
            return Err(node.unexpected(&expected));
        }
    };
    keys.finish()?;
    if step.is_finite() {
        Ok(step)
    } else {
        Err(node.error("found a transform that is not finite, expected finite numbers"))
    }
}
