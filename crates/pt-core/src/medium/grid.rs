//! A heterogeneous medium, whose density is given by a grid or by noise.

use std::ops::ControlFlow;

use pt_math::sampler::RngStream;
use pt_math::{Ray, Spectrum, Vec3, trig};

use super::cloud::Cloud;
use super::emission::MediumEmission;
use super::homogeneous::balanced;
use super::majorant::Majorants;
use super::{MediumSample, Phase};
use crate::medium::field::WorldGrid;

/// Single-scattering albedo, the fraction of the extinction that is scattered.
#[derive(Clone, Debug)]
pub enum Albedo {
    /// Constant albedo.
    Constant(Spectrum),
    /// Albedo given by a grid.
    Field(WorldGrid),
}

/// Extinction as a function of position.
#[derive(Clone, Debug)]
pub enum Density {
    /// Extinction given by a grid of one channel, or of three.
    Field(WorldGrid),
    /// Extinction given by noise.
    Cloud(Cloud),
}

/// Heterogeneous medium in a box.
#[derive(Clone, Debug)]
pub struct GridMedium {
    extinction: Density,
    /// Factor from the density to the extinction per metre.
    scale: f32,
    albedo: Albedo,
    emission: Option<MediumEmission>,
    majorants: Majorants,
}

impl Density {
    /// Returns true if all channels are equal.
    fn is_grey(&self) -> bool {
        match self {
            Self::Field(field) => field.grid.channels == 1,
            Self::Cloud(Cloud { color, .. }) => *color == Spectrum::ONE,
        }
    }

    /// First channel of the density at a point of the unit cube.
    #[inline]
    fn number(&self, p: Vec3) -> f32 {
        match self {
            Self::Field(field) => field.number(p, 0),
            Self::Cloud(cloud) => cloud.at(p),
        }
    }

    /// All channels of the density at a point of the unit cube.
    #[inline]
    fn channels(&self, p: Vec3) -> Spectrum {
        match self {
            Self::Field(field) => field.channels(p),
            Self::Cloud(cloud) => cloud.color * cloud.at(p),
        }
    }

    /// Transforms a point from world space to the unit cube.
    fn to_unit(&self, p: Vec3) -> Vec3 {
        let (Self::Field(WorldGrid { corner, to_unit, .. })
        | Self::Cloud(Cloud { corner, to_unit, .. })) = self;
        *to_unit * (p - *corner)
    }

    /// Transforms a direction from world space to the unit cube.
    fn to_unit_direction(&self, d: Vec3) -> Vec3 {
        let (Self::Field(WorldGrid { to_unit, .. }) | Self::Cloud(Cloud { to_unit, .. })) = self;
        *to_unit * d
    }
}

impl Albedo {
    /// Albedo at a point in world space.
    fn at(&self, p: Vec3) -> Spectrum {
        match self {
            Self::Constant(albedo) => *albedo,
            Self::Field(field) => field.color(field.to_unit(p)),
        }
    }
}

impl GridMedium {
    /// Creates a medium; `scale` is the factor from `extinction` to extinction per metre.
    pub fn new(
        extinction: Density,
        scale: f32,
        albedo: Albedo,
        emission: Option<MediumEmission>,
    ) -> Self {
        let majorants = match &extinction {
            Density::Field(field) => Majorants::new(&field.grid),
            Density::Cloud(cloud) => Majorants::of_cloud(cloud),
        };
        Self { extinction, scale, albedo, emission, majorants }
    }

    /// Returns true if the medium emits light.
    pub(super) fn emits(&self) -> bool {
        self.emission.is_some()
    }

    /// Samples a distance by delta tracking with local majorants, for a path with throughput
    /// `beta`.
    pub fn sample(
        &self,
        ray: &Ray,
        phase: &Phase,
        beta: Spectrum,
        stream: &mut RngStream,
    ) -> MediumSample {
        if matches!(self.albedo, Albedo::Constant(albedo) if albedo.is_black()) {
            return MediumSample::Transmitted { weight: self.transmittance(ray, phase, stream) };
        }
        let (found, weight) = if self.is_grey() {
            (self.collide_grey(ray, phase, stream), Spectrum::ONE)
        } else {
            self.collide_colored((ray, phase), beta, stream, |_, _| ())
        };
        let Some(t) = found else { return MediumSample::Transmitted { weight } };
        MediumSample::Scattered { t, weight: weight * self.albedo.at(ray.at(t)) }
    }

    /// Estimates the emitted radiance that reaches the start of a ray from its interval, for a path
    /// with throughput `beta`: the sum over collisions of σa Le over the majorant, each weighted by
    /// the transmittance estimate. Its mean is ∫ T σa Le dt. [Novák et al. 2018, "Monte Carlo
    /// methods for volumetric light transport simulation", §5.3: by collisions]
    pub fn emitted(
        &self,
        ray: &Ray,
        phase: &Phase,
        beta: Spectrum,
        stream: &mut RngStream,
    ) -> Spectrum {
        let Some(emission) = &self.emission else { return Spectrum::ZERO };
        let emission = |t: f32| {
            let p = ray.at(t);
            (Spectrum::ONE - self.albedo.at(p)) * emission.at(p)
        };
        let mut sum = Spectrum::ZERO;
        if self.is_grey() {
            self.collide((ray, phase), stream, |p, t, majorant, choice| {
                let share = self.share(p, majorant);
                sum += emission(t) * share;
                choice < share
            });
            return sum;
        }
        self.collide_colored((ray, phase), beta, stream, |t, weighted| {
            sum += weighted * emission(t);
        });
        sum
    }

    /// Estimates the transmittance by ratio tracking: the product of 1 − σt / majorant over the
    /// tentative collisions. [Novák, Selle & Jarosz 2014, "Residual Ratio Tracking for Estimating
    /// Attenuation in Participating Media"]
    pub fn transmittance(&self, ray: &Ray, phase: &Phase, stream: &mut RngStream) -> Spectrum {
        if self.is_grey() {
            let mut product = 1.0;
            self.collide((ray, phase), stream, |p, _, majorant, _| {
                product *= 1.0 - self.share(p, majorant);
                product == 0.0
            });
            return Spectrum::splat(product);
        }
        let mut product = Spectrum::ONE;
        self.collide((ray, phase), stream, |p, _, majorant, _| {
            product *= Spectrum::ONE - self.shares(p, majorant);
            product.is_black()
        });
        product
    }

    #[inline]
    fn is_grey(&self) -> bool {
        self.extinction.is_grey()
    }

    /// Density at a point of the unit cube, relative to the majorant.
    #[inline]
    fn share(&self, p: Vec3, majorant: f32) -> f32 {
        (self.extinction.number(p) / majorant).min(1.0)
    }

    /// Density of all channels at a point of the unit cube, relative to the majorant.
    #[inline]
    fn shares(&self, p: Vec3, majorant: f32) -> Spectrum {
        self.extinction.channels(p).map(|density| (density / majorant).min(1.0))
    }

    /// Delta tracking: a collision scatters with the probability extinction / majorant. [Woodcock
    /// et al. 1965; Novák et al. 2018, "Monte Carlo methods for volumetric light transport
    /// simulation", §5.1.2]
    fn collide_grey(&self, ray: &Ray, phase: &Phase, stream: &mut RngStream) -> Option<f32> {
        self.collide((ray, phase), stream, |p, _, majorant, choice| {
            choice < self.share(p, majorant)
        })
    }

    /// Delta tracking with one majorant for all channels.
    ///
    /// A collision scatters with the mean probability of the channels, weighted by their fractions
    /// of the remaining throughput. The density is therefore the mean of those of the channels over
    /// the whole path, and the weight of each channel, extinction over density, is at most the
    /// inverse of its initial fraction. [Miller, Georgiev & Jarosz 2019, "A null-scattering path
    /// integral formulation of light transport", §5.1, by the balance heuristic; Kutz et al. 2017,
    /// "Spectral and Decomposition Tracking for Rendering Heterogeneous Volumes", §4.3]
    ///
    /// `see` is called for each collision, with its ray parameter, and the weight before it times
    /// extinction / majorant.
    fn collide_colored(
        &self,
        (ray, phase): (&Ray, &Phase),
        beta: Spectrum,
        stream: &mut RngStream,
        mut see: impl FnMut(f32, Spectrum),
    ) -> (Option<f32>, Spectrum) {
        let sum = |spectrum: Spectrum| spectrum.to_array().iter().sum::<f32>();
        let share = beta / sum(beta);
        let mut weight = Spectrum::ONE;
        let found = self.collide((ray, phase), stream, |p, t, majorant, choice| {
            let shares = self.shares(p, majorant);
            let scattered = weight * shares;
            see(t, scattered);
            let is_scattered = choice < sum(share * scattered);
            let left = if is_scattered { scattered } else { weight - scattered };
            weight = balanced(left, share);
            is_scattered || weight.is_black()
        });
        (found, weight)
    }

    /// Visits the tentative collisions of a ray by the local majorants, until `stop` returns true;
    /// returns the ray parameter of that collision, or `None` at the end of the interval.
    ///
    /// `stop` gets the point in the unit cube, the ray parameter, the majorant (divided by the
    /// relative projected area of flakes), and a random number from [0, 1).
    fn collide(
        &self,
        (ray, phase): (&Ray, &Phase),
        stream: &mut RngStream,
        mut stop: impl FnMut(Vec3, f32, f32, f32) -> bool,
    ) -> Option<f32> {
        let origin = self.extinction.to_unit(ray.origin);
        let direction = self.extinction.to_unit_direction(ray.direction);
        let local = Ray { origin, direction, ..*ray };
        let axis = ray.direction.normalize();
        let area = match phase {
            Phase::Same(phase) => phase.area(axis),
            Phase::Flakes(flakes) => flakes.most(),
        };
        // Extinction per unit of the ray parameter.
        let scale = self.scale * ray.direction.length() * area;
        let found = self.majorants.walk(&local, |[from, to], majorant| {
            let per_t = majorant * scale;
            let depth = (to - from) * per_t;
            // Optical depths are added instead of ray parameters, so that the loop ends even if the
            // steps are smaller than the resolution of single precision.
            let mut passed = 0.0;
            loop {
                let [u, choice] = stream.next_2d();
                passed -= trig::ln(1.0 - u);
                if passed >= depth {
                    return ControlFlow::Continue(());
                }
                let t = from + passed / per_t;
                let majorant = match phase {
                    Phase::Same(_) => majorant,
                    // A smaller projected area of flakes makes more of the collisions null
                    // collisions.
                    Phase::Flakes(flakes) => majorant / flakes.share(ray.at(t), axis),
                };
                if stop(local.at(t), t, majorant, choice) {
                    return ControlFlow::Break(t);
                }
            }
        });
        found.break_value()
    }
}
