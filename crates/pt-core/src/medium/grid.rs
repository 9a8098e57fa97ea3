//! A medium that is not the same everywhere: its density is given by a grid, or by noise.

use std::ops::ControlFlow;
use std::sync::Arc;

use pt_math::sampler::RngStream;
use pt_math::{FloatExt, Mat3, Ray, Spectrum, Vec3, trig};
use pt_scene::medium::{Grid, GridFilter};

use super::cloud::Cloud;
use super::emission::MediumEmission;
use super::homogeneous::balanced;
use super::majorant::Majorants;
use super::{MediumSample, Phase};

/// A grid in the world.
#[derive(Clone, Debug)]
pub struct Field {
    /// The numbers.
    pub grid: Arc<Grid>,
    /// The corner in the world of the cube that the grid fills, from which its numbers run.
    pub corner: Vec3,
    /// From differences to the corner to the unit cube.
    pub to_unit: Mat3,
    /// Interpolation between cell centres.
    pub filter: GridFilter,
}

/// The share of extinction that is scattered.
#[derive(Clone, Debug)]
pub enum Albedo {
    /// The same everywhere.
    Constant(Spectrum),
    /// By a grid.
    Field(Field),
}

/// Extinction by its place.
#[derive(Clone, Debug)]
pub enum Density {
    /// By a grid of one channel, or of three.
    Field(Field),
    /// By noise.
    Cloud(Cloud),
}

/// Extinction in a box, and none outside of it.
#[derive(Clone, Debug)]
pub struct GridMedium {
    extinction: Density,
    /// What its numbers are multiplied by to be per metre.
    scale: f32,
    albedo: Albedo,
    emission: Option<MediumEmission>,
    majorants: Majorants,
}

impl Field {
    /// The cells between which a point of the unit cube lies along an axis, and how far it is from
    /// the first to the second.
    #[inline]
    fn neighbours(&self, axis: usize, x: f32) -> ([usize; 2], f32) {
        let count = self.grid.resolution[axis];
        let most = (count - 1) as f32;
        let x = x * count as f32;
        match self.filter {
            GridFilter::Nearest => ([x.clamp(0.0, most) as usize; 2], 0.0),
            GridFilter::Trilinear => {
                let x = (x - 0.5).clamp(0.0, most);
                let first = x as usize;
                ([first, (first + 1).min(count as usize - 1)], x - first as f32)
            }
        }
    }

    /// Channel `c` at a point of the unit cube, beyond which it is as at its walls.
    #[inline]
    pub(super) fn number(&self, p: Vec3, c: usize) -> f32 {
        let [nx, ny, _] = self.grid.resolution.map(|n| n as usize);
        let ([x0, x1], fx) = self.neighbours(0, p.x);
        let (ys, fy) = self.neighbours(1, p.y);
        let (zs, fz) = self.neighbours(2, p.z);
        let channels = self.grid.channels as usize;
        let row = |y: usize, z: usize| {
            let at = |x: usize| self.grid.values[((z * ny + y) * nx + x) * channels + c];
            at(x0).lerp(at(x1), fx)
        };
        let plane = |z: usize| row(ys[0], z).lerp(row(ys[1], z), fy);
        plane(zs[0]).lerp(plane(zs[1]), fz)
    }

    /// Three channels at a point of the unit cube.
    #[inline]
    fn channels(&self, p: Vec3) -> Spectrum {
        Spectrum::rgb(self.number(p, 0), self.number(p, 1), self.number(p, 2))
    }

    /// A grid in coordinates in which it fills the unit cube.
    pub fn on_unit_cube(grid: Arc<Grid>, filter: GridFilter) -> Self {
        Self { grid, corner: Vec3::ZERO, to_unit: Mat3::IDENTITY, filter }
    }

    /// How the numbers grow along the axes of the unit cube, between jumps.
    pub(crate) fn slopes(&self, p: Vec3) -> [Spectrum; 3] {
        if self.filter == GridFilter::Nearest {
            return [Spectrum::ZERO; 3];
        }
        std::array::from_fn(|axis| {
            let count = self.grid.resolution[axis] as f32;
            let ([first, second], _) = self.neighbours(axis, p[axis]);
            let middle = |i: usize| {
                let mut at = p;
                at[axis] = (i as f32 + 0.5) / count;
                self.color(at)
            };
            // Beyond the middles of the outermost cells, all is the same.
            let is_between = (0.5..=count - 0.5).contains(&(p[axis] * count));
            let grown = if is_between { middle(second) - middle(first) } else { Spectrum::ZERO };
            grown * count
        })
    }

    /// A point of the world in the unit cube.
    pub(super) fn to_unit(&self, p: Vec3) -> Vec3 {
        self.to_unit * (p - self.corner)
    }

    /// Likewise, if it is there.
    pub(super) fn within(&self, p: Vec3) -> Option<Vec3> {
        let p = self.to_unit(p);
        (p.min_element() >= 0.0 && p.max_element() <= 1.0).then_some(p)
    }

    /// The numbers at a point of the unit cube, the same for all channels if there is one.
    pub(crate) fn color(&self, p: Vec3) -> Spectrum {
        if self.grid.channels == 3 { self.channels(p) } else { Spectrum::splat(self.number(p, 0)) }
    }
}

impl Density {
    /// Returns true if all channels are the same.
    fn is_grey(&self) -> bool {
        match self {
            Self::Field(field) => field.grid.channels == 1,
            Self::Cloud(Cloud { color, .. }) => *color == Spectrum::ONE,
        }
    }

    /// The first channel at a point of the unit cube.
    #[inline]
    fn number(&self, p: Vec3) -> f32 {
        match self {
            Self::Field(field) => field.number(p, 0),
            Self::Cloud(cloud) => cloud.at(p),
        }
    }

    /// All channels there.
    #[inline]
    fn channels(&self, p: Vec3) -> Spectrum {
        match self {
            Self::Field(field) => field.channels(p),
            Self::Cloud(cloud) => cloud.color * cloud.at(p),
        }
    }

    /// A point of the world in the unit cube.
    fn to_unit(&self, p: Vec3) -> Vec3 {
        let (Self::Field(Field { corner, to_unit, .. })
        | Self::Cloud(Cloud { corner, to_unit, .. })) = self;
        *to_unit * (p - *corner)
    }

    /// A direction of the world there.
    fn to_unit_direction(&self, d: Vec3) -> Vec3 {
        let (Self::Field(Field { to_unit, .. }) | Self::Cloud(Cloud { to_unit, .. })) = self;
        *to_unit * d
    }
}

impl Albedo {
    /// At a point of the world.
    fn at(&self, p: Vec3) -> Spectrum {
        match self {
            Self::Constant(albedo) => *albedo,
            Self::Field(field) => field.color(field.to_unit(p)),
        }
    }
}

impl GridMedium {
    /// Extinction by a grid or by noise, times a number to be per metre.
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

    /// Returns true if it emits light.
    pub(super) fn glows(&self) -> bool {
        self.emission.is_some()
    }

    /// Distances by the majorant of each part of the grid, for a path with throughput `beta`.
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

    /// The light that comes to the start of a ray from all of its interval, for a path with
    /// throughput `beta`: the sum over collisions of σa Le over the majorant, each weighted by
    /// what gets from there to the start. Its mean is ∫ T σa Le dt. [Novák et al. 2018, "Monte
    /// Carlo methods for volumetric light transport simulation", §5.3: by collisions]
    pub fn emitted(
        &self,
        ray: &Ray,
        phase: &Phase,
        beta: Spectrum,
        stream: &mut RngStream,
    ) -> Spectrum {
        let Some(emission) = &self.emission else { return Spectrum::ZERO };
        let glow = |t: f32| {
            let p = ray.at(t);
            (Spectrum::ONE - self.albedo.at(p)) * emission.at(p)
        };
        let mut sum = Spectrum::ZERO;
        if self.is_grey() {
            self.collide((ray, phase), stream, |p, t, majorant, choice| {
                let share = self.share(p, majorant);
                sum += glow(t) * share;
                choice < share
            });
            return sum;
        }
        self.collide_colored((ray, phase), beta, stream, |t, weighted| sum += weighted * glow(t));
        sum
    }

    /// The product of 1 − σt / majorant at all distances that [`Self::sample`] would draw until the
    /// end, whose mean is the transmittance. [ratio tracking: Novák, Selle & Jarosz
    /// 2014, "Residual Ratio Tracking for Estimating Attenuation in Participating Media"]
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

    /// The density at a point of the unit cube over the majorant there.
    #[inline]
    fn share(&self, p: Vec3, majorant: f32) -> f32 {
        (self.extinction.number(p) / majorant).min(1.0)
    }

    /// The same of all channels.
    #[inline]
    fn shares(&self, p: Vec3, majorant: f32) -> Spectrum {
        self.extinction.channels(p).map(|density| (density / majorant).min(1.0))
    }

    /// Light is scattered with the probability that the extinction is of the majorant. [Woodcock et
    /// al. 1965; Novák et al. 2018, "Monte Carlo methods for volumetric light transport
    /// simulation", §5.1.2]
    fn collide_grey(&self, ray: &Ray, phase: &Phase, stream: &mut RngStream) -> Option<f32> {
        self.collide((ray, phase), stream, |p, _, majorant, choice| {
            choice < self.share(p, majorant)
        })
    }

    /// The same by one majorant of all channels; light is scattered with the mean of their
    /// probabilities, each by its share of what is left of the throughput. So the density is
    /// the mean of those of the channels for the whole of the way, and the weight, the
    /// extinction over the density for each, is at most the inverse of the share that the
    /// channel has at first. [Miller, Georgiev & Jarosz 2019, "A null-scattering path integral
    /// formulation of light transport", §5.1, by the balance heuristic; Kutz et al. 2017,
    /// "Spectral and Decomposition Tracking for Rendering Heterogeneous Volumes", §4.3]
    ///
    /// `see` is told of each collision, by where it is on the ray, and the weight before it times
    /// the share of the majorant that is extinction.
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

    /// Goes through the collisions that there would be if all of a part of the grid were as dense
    /// as its densest place, until `stop` says so of one, by where it is in the unit cube and
    /// on the ray, the majorant there (over the share of flakes that is seen) and a number from
    /// [0, 1).
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
        // Per unit of the ray's parameter.
        let scale = self.scale * ray.direction.length() * area;
        let found = self.majorants.walk(&local, |[from, to], majorant| {
            let per_t = majorant * scale;
            let depth = (to - from) * per_t;
            // Depths are added up, not places, so that there is an end even where the steps are
            // smaller than what single precision tells apart.
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
                    // Where less of the flakes is seen, more of the majorant is nothing.
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
