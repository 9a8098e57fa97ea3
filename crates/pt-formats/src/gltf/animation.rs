//! Animations: transforms of nodes and weights of morph targets at a time. [glTF 2.0, §3.11 and
//! app. C]

use pt_scene::Hint;
use std::collections::HashMap;

use pt_math::DQuat;

use super::GltfReader;
use super::item::Item;
use super::keys::{AnimatedProperty, Interpolation, KeyframeTrack};
use super::transform::quaternion;
use crate::LoadError;

/// Animated properties of a node; `None` means that a property keeps the value of the node itself.
#[derive(Clone, Debug, Default)]
pub(super) struct Pose {
    pub(super) translation: Option<[f64; 3]>,
    pub(super) rotation: Option<DQuat>,
    pub(super) scale: Option<[f64; 3]>,
    pub(super) weights: Option<Vec<f64>>,
}

impl Pose {
    fn moves_node(&self) -> bool {
        self.translation.is_some() || self.rotation.is_some() || self.scale.is_some()
    }
}

impl<'a> GltfReader<'a> {
    /// Evaluates all animations at the requested time; returns an empty map if no time is
    /// requested. If two channels have the same target, the first one is used.
    pub(super) fn read_poses(&mut self) -> Result<HashMap<usize, Pose>, LoadError> {
        let mut poses = HashMap::new();
        let Some(time) = self.context.options().time else {
            if self.root.count("animations")? > 0 {
                let root = self.root.clone();
                self.warn(&root, "animations are not applied; the scene is in its rest pose");
                self.context.suggest(Hint::SetTime);
            }
            return Ok(poses);
        };
        let animations = self.root.children("animations")?;
        if animations.is_empty() {
            let root = self.root.clone();
            self.warn(&root, "a time was given for a scene without animations");
        }
        for animation in animations {
            for channel in animation.children("channels")? {
                let done = self.channel(&animation, &channel, time, &mut poses);
                self.context.ok_or_report(done)?;
            }
        }
        Ok(poses)
    }

    /// Evaluates a channel at a time and stores the value in the pose of its node.
    fn channel(
        &mut self,
        animation: &Item<'a>,
        channel: &Item<'a>,
        time: f64,
        poses: &mut HashMap<usize, Pose>,
    ) -> Result<(), LoadError> {
        let missing = || channel.error("missing \"target\"");
        let target = channel.child("target")?.ok_or_else(missing)?;
        let Some(index) = target.whole("node")? else {
            self.warn(&target, "missing \"node\"; the channel is ignored");
            return Ok(());
        };
        let node = self.root.member("nodes", index, &target, "node")?;
        let sampler =
            animation.member("samplers", channel.needed("sampler")?, channel, "sampler")?;
        let pose = poses.entry(index).or_default();
        let path = target.text("path")?.unwrap_or_default();
        let is_free = match path {
            "translation" => pose.translation.is_none(),
            "rotation" => pose.rotation.is_none(),
            "scale" => pose.scale.is_none(),
            "weights" => pose.weights.is_none(),
            _ => {
                let message = "expected translation, rotation, scale or weights";
                return Err(target.refuse("path", message));
            }
        };
        if !is_free {
            let message =
                format!("duplicate animation of the {path} of this node; the first one is used");
            self.warn(&target, message);
            return Ok(());
        }
        let kind = match path {
            "rotation" => AnimatedProperty::Rotation,
            "weights" => AnimatedProperty::Weights,
            _ => AnimatedProperty::Vector,
        };
        let value = self.keys(&sampler, kind)?.at(time);
        match (path, value.as_slice()) {
            ("translation", &[x, y, z]) => pose.translation = Some([x, y, z]),
            ("scale", &[x, y, z]) => pose.scale = Some([x, y, z]),
            ("rotation", &[x, y, z, w]) => {
                let zero =
                    || sampler.refuse("output", "found a zero rotation, expected unit quaternions");
                pose.rotation = Some(quaternion([x, y, z, w]).ok_or_else(zero)?);
            }
            _ => pose.weights = Some(value),
        }
        if pose.moves_node() && node.has("matrix") {
            let message =
                "found a matrix of an animated node, expected translation, rotation and scale";
            return Err(node.refuse("matrix", message));
        }
        Ok(())
    }

    /// Reads the keys of a sampler.
    fn keys(
        &mut self,
        sampler: &Item<'a>,
        kind: AnimatedProperty,
    ) -> Result<KeyframeTrack, LoadError> {
        let interpolation = match sampler.text("interpolation")?.unwrap_or("LINEAR") {
            "STEP" => Interpolation::Step,
            "LINEAR" => Interpolation::Linear,
            "CUBICSPLINE" => Interpolation::CubicSpline,
            _ => {
                return Err(sampler.refuse("interpolation", "expected LINEAR, STEP or CUBICSPLINE"));
            }
        };
        let width = match kind {
            AnimatedProperty::Vector => 3,
            AnimatedProperty::Rotation => 4,
            AnimatedProperty::Weights => 1,
        };
        let input = self.accessors.numbers(sampler, "input", &[1])?;
        let output = self.accessors.numbers(sampler, "output", &[width])?;
        let (Some(input), Some(output)) = (input, output) else {
            return Err(sampler.error("missing \"input\" or \"output\""));
        };
        let (times, values) = (input.values, output.values);
        if times.is_empty() || !times.is_sorted_by(|a, b| a < b) {
            return Err(sampler.refuse("input", "expected increasing times"));
        }
        let count = values.len();
        let all = times.len() * interpolation.parts();
        KeyframeTrack::new(times, values, kind, interpolation).ok_or_else(|| {
            let message = format!(
                "found {count} numbers, expected the same number for each of {all} elements"
            );
            sampler.refuse("output", message)
        })
    }
}
