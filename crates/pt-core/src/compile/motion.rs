//! Motion while the shutter is open.

use pt_bvh::MotionKey;
use pt_math::{DAffine3, DVec3};
use pt_scene::Notes;
use pt_scene::medium::MediumProperties;
use pt_scene::{Key, Motion, Object, Scene, Span};

use super::{CompileError, CompileOptions};

/// Opening and closing times of the shutter, in seconds; equal without exposure.
///
/// # Errors
/// If these are not finite, or not in this order.
pub(super) fn shutter(
    scene: &Scene,
    options: &CompileOptions,
    notes: &mut Notes,
) -> Result<[f64; 2], CompileError> {
    let camera = options.camera.as_ref().or(scene.camera());
    let [open, close] = camera.map_or([0.0; 2], |camera| camera.shutter);
    if !(open.is_finite() && close.is_finite() && open <= close) {
        let element = camera.map_or(String::new(), |camera| format!("camera \"{}\"", camera.name));
        let message = format!(
            "found a shutter from {open} s to {close} s, expected finite times, the second not \
             before the first"
        );
        let at = Span { element, ..Span::default() };
        return Err(CompileError::Value { at, message });
    }
    let is_animated = scene.objects.iter().any(|object| object.motion.is_some())
        || camera.is_some_and(|camera| camera.motion.is_some());
    if is_animated && (!options.policies.exposure || open >= close) {
        notes.push(format!(
            "moving objects are shown as at {open} s, without motion blur: the shutter time is zero"
        ));
    }
    Ok([open, if options.policies.exposure { close } else { open }])
}

/// Returns an error for media that would have to move: a grid does not move with its shape.
pub(super) fn check_media(scene: &Scene, object: &Object) -> Result<(), CompileError> {
    let interior = object.media.and_then(|sides| sides.interior);
    let medium = interior.and_then(|medium| scene.media.get(medium as usize));
    match medium.map(|medium| &medium.matter) {
        Some(MediumProperties::Heterogeneous(_)) => Err(CompileError::Value {
            at: object.at.clone(),
            message:
                "found a heterogeneous medium inside of a moving shape, expected a homogeneous \
                 medium or a static shape"
                    .into(),
        }),
        _ => Ok(()),
    }
}

/// Transforms of a node while the shutter is open, in the author's unit. Times are fractions of
/// that interval, between which the motion is linear. A single key if the node does not move.
pub(super) fn places(motion: Option<&Motion>, to_world: DAffine3, shutter: [f64; 2]) -> Vec<Key> {
    let Some(motion) = motion else { return vec![Key { time: 0.0, to_world }] };
    let mut keys = motion.knots(shutter);
    for key in &mut keys {
        key.to_world *= to_world;
    }
    keys
}

/// Transforms of an object, in metres; see [`places`].
pub(super) fn track(object: &Object, metres: f64, shutter: [f64; 2]) -> Vec<MotionKey> {
    let scale = DAffine3::from_scale(DVec3::splat(metres));
    let places = places(object.motion.as_deref(), object.to_world, shutter).into_iter();
    let knot = |key: Key| MotionKey { time: key.time as f32, to_world: scale * key.to_world };
    places.map(knot).collect()
}
