//! Path reuse between neighbouring pixels. [Bekaert, Sbert & Halton 2002, "Accelerating Path
//! Tracing by Re-Using Paths", §3]
//!
//! The pixels of a square take their samples together. Each path has a first vertex xₖ, and a
//! second vertex yₖ in the direction sampled from the BSDF. The radiance incident at yⱼ is
//! reflected towards all first vertices, so that every xₖ receives it, and not only xⱼ:
//!
//! ```text
//! Lₖ = Σⱼ fₖ(yⱼ) Vₖⱼ Gₖⱼ Bⱼₖ / Σₘ pₘ(yⱼ) Vₘⱼ Gₘⱼ
//!     f with the cosine at x, G = cos at y / distance²
//! ```
//!
//! This is the balance heuristic over the BSDF sampling of all paths of the square. A term costs a
//! shadow ray, whereas another path costs one at each of its surfaces.
//!
//! For diffuse surfaces, Bⱼₖ is the same for all k. Other surfaces store the radiance incident from
//! each sampled direction, and evaluate the reflection for each receiver. Since these directions
//! were sampled for one viewing direction, only receivers with a similar direction take part
//! ([`Bsdf::lobe_width`]). The sums of a receiver are over these.

use arrayvec::ArrayVec;
use pt_core::bsdf::Bsdf;
use pt_core::interaction::Interaction;
use pt_core::material::EvaluatedMaterial;
use pt_core::scene::RenderScene;
use pt_math::{Ray, Spectrum, Vec3};

use super::accumulator::RadianceAccumulator;
use super::batch::Batch;
use super::observer::PathObserver;
use super::path_queue::PathState;
use super::scatterer::Scatterer;
use super::space::Space;
use super::space::shading::{ShadingPoint, SharedRadiance};
use super::{MAX_REUSE, alpha};
use crate::Tracer;

/// Maximum number of pixels of a square.
const MAX_TILE_PIXELS: usize = (MAX_REUSE * MAX_REUSE) as usize;

/// Number of rays from which on pending connections are traced.
const FLUSH_RAYS: usize = 2048;

/// Surface hit by a path.
#[derive(Clone, Copy)]
pub(super) struct SurfaceVertex {
    pub(super) at: Interaction,
    /// Evaluated material, if it is not constant.
    pub(super) materials: Option<EvaluatedMaterial>,
}

impl SurfaceVertex {
    fn bsdf<'a>(&'a self, scene: &'a RenderScene) -> Bsdf<'a> {
        scene.bsdf(&self.at, self.materials.as_ref())
    }
}

/// Radiance incident on a glossy surface.
#[derive(Clone, Copy)]
struct IncidentSample {
    /// Index of the path.
    donor: u32,
    /// Direction from which it is incident.
    wi: Vec3,
    /// Index of its partial sum.
    target: u32,
}

/// Second surface of a path, whose radiance other paths may take.
#[derive(Clone, Copy)]
struct Donor {
    vertex: SurfaceVertex,
    shared: SharedRadiance,
    /// Throughput up to the surface.
    beta: Spectrum,
    /// Density with which its direction was sampled, per area of surface.
    density: f32,
}

/// Connection of the first surface of one path with the second surface of another.
struct Connection {
    receiver: u32,
    /// Direction from the donor to the receiver.
    w: Vec3,
    /// BSDF times geometry term, f G.
    value: Spectrum,
    /// Density times geometry term, p G.
    density: f32,
    /// Transmittance between the two surfaces.
    transmittance: f32,
}

/// Donor whose connections are not traced yet.
#[derive(Clone, Copy)]
struct PendingDonor {
    /// Index of the path.
    member: u32,
    /// Number of connections.
    connections: usize,
}

/// First surface of a path that takes part in a tile.
struct Receiver<'a> {
    /// Index of the path.
    member: u32,
    at: &'a Interaction,
    bsdf: Bsdf<'a>,
}

/// Radiance shared between paths.
#[derive(Default)]
pub(super) struct Reuse {
    /// True if surfaces that are not diffuse are donors, too.
    glossy: bool,
    /// First surfaces, by path.
    receivers: Vec<Option<SurfaceVertex>>,
    donors: Vec<Option<Donor>>,
    incident: Vec<IncidentSample>,
    /// Pending donors in order.
    queue: Vec<PendingDonor>,
    connections: Vec<Connection>,
    /// Pending shadow rays, and the connection of each.
    rays: Vec<Ray>,
    traced: Vec<usize>,
    blocked: Vec<bool>,
    transmittance: Vec<f32>,
}

impl Reuse {
    pub(super) fn new(glossy: bool) -> Self {
        Self { glossy, ..Self::default() }
    }

    /// Clears everything for `n` new paths.
    pub(super) fn begin(&mut self, n: usize) {
        self.receivers.clear();
        self.receivers.resize(n, None);
        self.donors.clear();
        self.donors.resize(n, None);
        self.incident.clear();
    }

    /// Records the first surface of a path.
    pub(super) fn add_receiver(&mut self, start: u32, seen: &SurfaceVertex) {
        self.receivers[start as usize] = Some(*seen);
    }

    /// Records the second surface of a path. If other paths may use its radiance, that is
    /// accumulated separately.
    pub(super) fn add_donor(
        &mut self,
        path: &PathState,
        seen: &SurfaceVertex,
        surface: &mut ShadingPoint<impl Space>,
        accumulator: &mut RadianceAccumulator<impl PathObserver>,
    ) {
        let at = &seen.at;
        let bsdf = surface.scatterer.bsdf().and_then(|bsdf| bsdf.with_wo(at.wo));
        let lobe_width = bsdf.map_or(0.0, |bsdf| bsdf.lobe_width());
        let density = path.bsdf_pdf.map_or(0.0, |pdf| pdf.get() * geometry(at, at.wo, at.distance));
        if !(lobe_width > 0.0 && density > 0.0) {
            return;
        }
        let shared = if lobe_width == f32::INFINITY {
            SharedRadiance::Diffuse(accumulator.new_partial())
        } else {
            SharedRadiance::Glossy
        };
        if matches!(shared, SharedRadiance::Glossy) && !self.glossy {
            return;
        }
        let donor = Donor { vertex: *seen, shared, beta: path.beta, density };
        self.donors[path.start as usize] = Some(donor);
        surface.share(shared);
    }

    /// Records incident radiance at the glossy second surface of a path; returns the index of its
    /// partial sum.
    pub(super) fn add_incident_sample(
        &mut self,
        donor: u32,
        wi: Vec3,
        accumulator: &mut RadianceAccumulator<impl PathObserver>,
    ) -> u32 {
        let target = accumulator.new_partial();
        self.incident.push(IncidentSample { donor, wi, target });
        target
    }

    /// Continues a path in the direction `wi` from a surface. If that is its glossy second surface,
    /// its radiance is accumulated separately, and without the throughput of the path, which stays
    /// in `eta_scale` for Russian roulette.
    #[inline(always)]
    pub(super) fn continue_path(
        &mut self,
        surface: &ShadingPoint<impl Space>,
        path: &mut PathState,
        wi: Vec3,
        accumulator: &mut RadianceAccumulator<impl PathObserver>,
    ) {
        let (Some(SharedRadiance::Glossy), Some(pdf)) = (surface.shared, path.bsdf_pdf) else {
            return;
        };
        path.target = self.add_incident_sample(path.start, wi, accumulator);
        path.eta_scale *= path.beta.max_channel() * pdf.get();
        path.beta = Spectrum::splat(1.0 / pdf.get());
    }

    /// Connects all paths of each tile, and adds the shared radiance.
    pub(super) fn share_radiance(&mut self, batch: &mut Batch<impl PathObserver>) {
        let Batch { tracer, camera_rays, accumulator } = batch;
        accumulator.set_bounces(2);
        self.incident.sort_by_key(|part| part.donor);
        let mut first = 0;
        for group in &camera_rays.groups {
            for sample in 0..group.samples {
                let member = |pixel: u32| first + pixel * group.samples + sample;
                self.connect(tracer.scene, (0..group.pixels).map(member), accumulator);
                if self.rays.len() >= FLUSH_RAYS {
                    self.trace(tracer, accumulator);
                }
            }
            first += group.pixels * group.samples;
        }
        self.trace(tracer, accumulator);
    }

    /// Returns true if a donor has radiance other than zero.
    fn has_radiance(
        &self,
        member: u32,
        donor: &Donor,
        accumulator: &RadianceAccumulator<impl PathObserver>,
    ) -> bool {
        match donor.shared {
            SharedRadiance::Diffuse(target) => !accumulator.value(target).is_black(),
            SharedRadiance::Glossy => incident_samples(&self.incident, member)
                .iter()
                .any(|part| !accumulator.value(part.target).is_black()),
        }
    }

    /// Queues the connections between the paths of a square.
    fn connect(
        &mut self,
        scene: &RenderScene,
        members: impl Iterator<Item = u32> + Clone,
        accumulator: &RadianceAccumulator<impl PathObserver>,
    ) {
        let mut receivers = ArrayVec::<_, MAX_TILE_PIXELS>::new();
        for member in members.clone() {
            if let Some(seen) = &self.receivers[member as usize] {
                receivers.push(Receiver { member, at: &seen.at, bsdf: seen.bsdf(scene) });
            }
        }
        for member in members {
            let Some(donor) = &self.donors[member as usize] else { continue };
            if !self.has_radiance(member, donor, accumulator) {
                continue;
            }
            let own = donor.vertex.bsdf(scene);
            let before = self.connections.len();
            for receiver in &receivers {
                let is_own = receiver.member == member;
                let pair = if is_own {
                    Some(donor.own_connection(member))
                } else {
                    donor.connection(&own, receiver)
                };
                let Some(pair) = pair else { continue };
                if !is_own || scene.has_alpha {
                    self.traced.push(self.connections.len());
                    self.rays.push(receiver.at.point.spawn_at(&donor.vertex.at.point, -pair.w));
                }
                self.connections.push(pair);
            }
            let connections = self.connections.len() - before;
            self.queue.push(PendingDonor { member, connections });
        }
    }

    /// Traces the pending connections, and adds their contributions.
    fn trace(
        &mut self,
        tracer: &mut Tracer,
        accumulator: &mut RadianceAccumulator<impl PathObserver>,
    ) {
        // Scenes with motion do not support path reuse.
        let time = |_| 0.0;
        tracer.occluded(&self.rays, time, &mut self.blocked);
        alpha::shadow_transmittance(
            tracer,
            &self.rays,
            time,
            &self.blocked,
            &mut self.transmittance,
        );
        for (&pair, &share) in self.traced.iter().zip(&self.transmittance) {
            self.connections[pair].transmittance = share;
        }
        let mut pairs = &self.connections[..];
        for &PendingDonor { member, connections } in &self.queue {
            let (of_giver, others) = pairs.split_at(connections);
            pairs = others;
            let Some(donor) = &self.donors[member as usize] else { continue };
            match donor.shared {
                SharedRadiance::Diffuse(target) => {
                    share_diffuse(accumulator.value(target), of_giver, accumulator);
                }
                SharedRadiance::Glossy => {
                    let own = donor.vertex.bsdf(tracer.scene);
                    share_glossy(
                        &own,
                        incident_samples(&self.incident, member),
                        of_giver,
                        accumulator,
                    );
                }
            }
        }
        self.queue.clear();
        self.connections.clear();
        self.rays.clear();
        self.traced.clear();
    }
}

impl Donor {
    /// Connection of a donor with its own path.
    fn own_connection(&self, member: u32) -> Connection {
        let Self { beta, density, .. } = *self;
        Connection {
            receiver: member,
            w: self.vertex.at.wo,
            value: beta * density,
            density,
            transmittance: 1.0,
        }
    }

    /// Connection of a donor, whose BSDF towards its path is `own`, with another path; `None`
    /// unless the receiver is on the same side of the surface and scatters its light.
    #[inline(always)]
    fn connection(&self, own: &Bsdf, receiver: &Receiver) -> Option<Connection> {
        let &Receiver { member, at, ref bsdf } = receiver;
        let d = at.point.p - self.vertex.at.point.p;
        let distance = d.length();
        let w = d / distance;
        own.with_wo(w)?;
        let geometry = geometry(&self.vertex.at, w, distance);
        let (f, pdf) = bsdf.eval_and_pdf(-w);
        let (value, density) = (f * geometry, pdf.get() * geometry);
        (!value.is_black()).then_some(Connection {
            receiver: member,
            w,
            value,
            density,
            transmittance: 1.0,
        })
    }
}

/// Geometry term cos / distance² towards a viewer.
fn geometry(at: &Interaction, w: Vec3, distance: f32) -> f32 {
    at.point.normal.dot(w).abs() / (distance * distance)
}

/// Incident samples of a donor.
fn incident_samples(sorted: &[IncidentSample], donor: u32) -> &[IncidentSample] {
    let first = sorted.partition_point(|part| part.donor < donor);
    let count = sorted[first..].iter().take_while(|part| part.donor == donor).count();
    &sorted[first..first + count]
}

/// Adds radiance that is the same in all directions to all receivers.
fn share_diffuse(
    light: Spectrum,
    pairs: &[Connection],
    accumulator: &mut RadianceAccumulator<impl PathObserver>,
) {
    let density: f32 = pairs.iter().map(|pair| pair.density * pair.transmittance).sum();
    let light = light * (1.0 / density);
    // If surfaces coincide, even the path's own ray may be occluded.
    for pair in pairs.iter().filter(|pair| pair.transmittance > 0.0) {
        accumulator.add(pair.receiver, pair.value * pair.transmittance * light);
    }
}

/// Adds radiance that a glossy surface reflects towards each receiver.
fn share_glossy(
    own: &Bsdf,
    parts: &[IncidentSample],
    pairs: &[Connection],
    accumulator: &mut RadianceAccumulator<impl PathObserver>,
) {
    let views = pairs.iter().filter_map(|pair| Some((pair, own.with_wo(pair.w)?)));
    let views: ArrayVec<_, MAX_TILE_PIXELS> =
        views.filter(|(pair, _)| pair.transmittance > 0.0).collect();
    for (receiver, bsdf) in views.iter().filter(|(_, bsdf)| own.is_similar_direction(bsdf)) {
        let might_give = views.iter().filter(|(_, other)| other.is_similar_direction(bsdf));
        let density: f32 = might_give.map(|(pair, _)| pair.density * pair.transmittance).sum();
        let reflected = |part: &IncidentSample| bsdf.eval(part.wi) * accumulator.value(part.target);
        let light: Spectrum = parts.iter().map(reflected).sum();
        accumulator
            .add(receiver.receiver, receiver.value * (receiver.transmittance / density) * light);
    }
}
