//! Settings of a render: those of the command line, completed by the scene file and the defaults.

use pathtracer::{
    Adaptive, Aov, Clamp, DirectLight, Filter, LightGroups, RenderHints, SamplerKind, Scene,
    Settings, Target, denoise,
};

use crate::opacity::Opacity;
use crate::policies::{CompatPolicies, DefaultSettings};

/// Settings of the command line; `None` is decided by the scene file or the defaults.
pub(crate) struct SettingsRequest {
    pub(crate) policies: &'static CompatPolicies,
    pub(crate) spp: Option<u32>,
    /// Number of samples for which the points of the sampler are generated, if it differs.
    pub(crate) layout: Option<u32>,
    pub(crate) light_samples: u32,
    pub(crate) max_depth: Option<u32>,
    /// Numbers of interactions of the light that is shown; `None` is the maximum depth only.
    pub(crate) bounces: Option<(u32, u32)>,
    pub(crate) integrator: Option<String>,
    /// Distance in units of the scene; infinite if it is unlimited.
    pub(crate) ao_distance: f32,
    pub(crate) direct: Option<DirectLight>,
    pub(crate) clamp: Clamp,
    pub(crate) reuse: u32,
    pub(crate) split: u32,
    pub(crate) adaptive: Option<Adaptive>,
    pub(crate) target: Option<Target>,
    pub(crate) sampler: SamplerKind,
    pub(crate) seed: u32,
    pub(crate) filter: Option<Filter>,
    pub(crate) channels: ChannelRequest,
    pub(crate) light_groups: Option<LightGroups>,
}

impl SettingsRequest {
    /// Settings for a scene.
    pub(crate) fn for_scene(&self, scene: &Scene) -> Settings {
        let file = &scene.settings;
        let policies = self.policies;
        let defaults = policies.settings.clone().unwrap_or_else(|| DefaultSettings::of_file(file));
        let metres = policies.scene.metres_per_unit(scene);
        let max_depth = self.max_depth.unwrap_or(defaults.max_depth);
        let (min_bounce, max_bounce) = self.bounces.unwrap_or((max_depth, max_depth));
        Settings {
            spp: self.spp.unwrap_or(defaults.spp),
            layout: self.layout,
            light_samples: self.light_samples,
            max_depth,
            straight_is_free: file.straight_is_free,
            min_bounce,
            max_bounce,
            integrator: self.integrator.as_deref().unwrap_or(defaults.integrator).into(),
            ao_distance: self.ao_distance * metres as f32,
            direct: self.direct.unwrap_or(defaults.direct),
            roulette: match self.bounces {
                Some(_) => defaults.roulette,
                None => defaults.roulette_at_depth,
            },
            clamp: self.clamp,
            reuse: self.reuse,
            split: self.split,
            adaptive: self.adaptive,
            target: self.target,
            sampler: self.sampler,
            seed: self.seed,
            filter: self.filter.unwrap_or(defaults.filter),
            region: None,
            aovs: self.channels.aovs(file),
            hidden: self.channels.opacity.hidden(file.hidden, policies.transparency),
            light_groups: self.light_groups.clone(),
        }
    }
}

/// Channels of the image besides its colours.
pub(crate) struct ChannelRequest {
    pub(crate) listed: Vec<Aov>,
    pub(crate) opacity: Opacity,
    /// True if the AOVs that denoising needs are added.
    pub(crate) denoise: bool,
    /// True if the format has room for them.
    pub(crate) has_room: bool,
    /// True if the image may have an alpha channel.
    pub(crate) transparency: bool,
}

impl ChannelRequest {
    /// AOVs: those of the command line, or else of the scene file if the image has room for them;
    /// with denoising, also those that it needs.
    pub(crate) fn aovs(&self, file: &RenderHints) -> Vec<Aov> {
        let of_file = || file.aovs.iter().filter_map(|name| Aov::from_name(name));
        let asked = if self.leaves_out(file) {
            Vec::new()
        } else if self.listed.is_empty() {
            of_file().collect()
        } else {
            self.listed.clone()
        };
        let of_colors = self.opacity.channel(&self.listed, file, self.transparency);
        let besides = asked.into_iter().filter(|aov| *aov != Aov::Alpha);
        self.with_denoising(of_colors.into_iter().chain(besides).collect())
    }

    /// Returns true if the scene file requests AOVs for which the image has no room.
    pub(crate) fn leaves_out(&self, file: &RenderHints) -> bool {
        file.aovs.iter().any(|name| *name != Aov::Alpha.name()) && !self.has_room
    }

    /// AOVs that the film has without a request of the scene file.
    pub(crate) fn of_command_line(&self) -> Vec<Aov> {
        let mut kept = self.with_denoising(self.listed.clone());
        kept.extend(self.opacity.channel(&self.listed, &RenderHints::default(), self.transparency));
        kept.dedup();
        kept
    }

    /// Adds the AOVs that denoising needs, if it is requested.
    fn with_denoising(&self, mut aovs: Vec<Aov>) -> Vec<Aov> {
        let missing = denoise::NEEDED.into_iter().filter(|_| self.denoise);
        let missing: Vec<_> = missing.filter(|aov| !aovs.contains(aov)).collect();
        aovs.extend(missing);
        aovs
    }
}
