//! Evaluation of procedural patterns. [Pharr, Jakob & Humphreys, "Physically Based Rendering", 3rd
//! ed., §10.5–10.6]

use pt_math::noise::{NoiseValue, Octaves, ValueAndGradient};
use pt_math::{Spectrum, Vec2, Vec3, trig};
use pt_scene::texture::{Marble, Noise, Procedural};

/// Numbers of octaves of the waves, and of the noise that is their height.
const WAVES: [u32; 2] = [6, 3];
/// Frequency of the height of waves relative to that of the waves.
const CALM: f32 = 0.1;
const RADIUS: f32 = 0.35;

/// Returns true if the octaves of a pattern depend on the width of the footprint.
pub(crate) fn has_octaves(pattern: Procedural) -> bool {
    match pattern {
        Procedural::Fbm(_)
        | Procedural::Wrinkled(_)
        | Procedural::Windy
        | Procedural::Marble(_) => true,
        Procedural::Checkerboard3d(_) | Procedural::Dots(_) => false,
    }
}

/// Returns the colour of a pattern at a point, with a footprint of this width; 0 for a point.
pub(crate) fn color(pattern: Procedural, p: Vec3, width: f32) -> Spectrum {
    match pattern {
        Procedural::Checkerboard3d([same, other]) => {
            let high = (p - p.floor()).cmpgt(Vec3::splat(0.5));
            if high.bitmask().count_ones().is_multiple_of(2) { same } else { other }.into()
        }
        Procedural::Dots([inside, outside]) => {
            if is_in_dot(p.truncate()) { inside } else { outside }.into()
        }
        Procedural::Fbm(noise) => Spectrum::splat(octaves(noise).seen_within(width).fbm(p)),
        Procedural::Wrinkled(noise) => {
            Spectrum::splat(octaves(noise).seen_within(width).turbulence(p))
        }
        Procedural::Windy => {
            let [waves, wind] = windy::<f32>(p, width);
            Spectrum::splat(wind * waves)
        }
        Procedural::Marble(Marble { noise, variation }) => {
            let bend: f32 = octaves(noise).seen_within(width).fbm(p);
            let layer = p.y + variation * bend;
            stone(layer).0
        }
    }
}

/// Returns the three channels of the colour with their gradients, which are 0 at jumps.
pub(crate) fn sloped(pattern: Procedural, p: Vec3, width: f32) -> [ValueAndGradient; 3] {
    match pattern {
        Procedural::Checkerboard3d(_) | Procedural::Dots(_) => color(pattern, p, width)
            .to_array()
            .map(|value| ValueAndGradient { value, slope: Vec3::ZERO }),
        Procedural::Fbm(noise) => [octaves(noise).seen_within(width).fbm(p); 3],
        Procedural::Wrinkled(noise) => [octaves(noise).seen_within(width).turbulence(p); 3],
        Procedural::Windy => {
            let [waves, wind] = windy::<ValueAndGradient>(p, width);
            let slope = waves.slope * wind.value + wind.slope * waves.value;
            [ValueAndGradient { value: wind.value * waves.value, slope }; 3]
        }
        Procedural::Marble(Marble { noise, variation }) => {
            let bend: ValueAndGradient = octaves(noise).seen_within(width).fbm(p);
            let slope = Vec3::Y + bend.slope * variation;
            let (color, grows) = stone(p.y + variation * bend.value);
            let channel =
                |c: usize| ValueAndGradient { value: color.0[c], slope: slope * grows.0[c] };
            [channel(0), channel(1), channel(2)]
        }
    }
}

fn octaves(noise: Noise) -> Octaves {
    Octaves::new(noise.octaves.min(Noise::MAX_OCTAVES), noise.roughness.clamp(0.0, 2.0))
}

/// Returns true if a point is in a dot. Each square around integer coordinates has a dot or none,
/// by noise, which also displaces the dot. The three noise values are taken at unrelated points.
fn is_in_dot(at: Vec2) -> bool {
    let cell = (at + 0.5).floor();
    let noise = |x: f32, y: f32| <f32 as NoiseValue>::at((cell + Vec2::new(x, y)).extend(0.5));
    if noise(0.5, 0.5) <= 0.0 {
        return false;
    }
    let middle = cell + Vec2::new(noise(1.5, 2.8), noise(4.5, 9.8)) * (0.5 - RADIUS);
    (at - middle).length_squared() < RADIUS * RADIUS
}

/// Returns the waves, and their height.
fn windy<T: NoiseValue>(p: Vec3, width: f32) -> [T; 2] {
    let [waves, wind] = WAVES.map(|count| Octaves::new(count, 0.5));
    let wind: T = wind.seen_within(width * CALM).fbm(p * CALM);
    [waves.seen_within(width).fbm(p), wind.abs().stretched(CALM)]
}

/// Colours of stone: control points of cubic Bézier curves, each of which begins one point after
/// the one before.
const STONE: [[f32; 3]; 9] = [
    [0.58, 0.58, 0.6],
    [0.58, 0.58, 0.6],
    [0.58, 0.58, 0.6],
    [0.5, 0.5, 0.5],
    [0.6, 0.59, 0.58],
    [0.58, 0.58, 0.6],
    [0.58, 0.58, 0.6],
    [0.2, 0.2, 0.33],
    [0.58, 0.58, 0.6],
];
const CURVES: usize = STONE.len() - 3;
const BRIGHTNESS: f32 = 1.5;

/// Returns the colour of layers of stone, and its derivative along them.
fn stone(layer: f32) -> (Spectrum, Spectrum) {
    let (sin, cos) = if layer.is_finite() { trig::sin_cos(layer) } else { (0.0, 1.0) };
    let along = (0.5 + 0.5 * sin) * CURVES as f32;
    let curve = (along as usize).min(CURVES - 1);
    let t = along - curve as f32;
    let points: [Vec3; 4] = std::array::from_fn(|i| Vec3::from(STONE[curve + i]));
    // De Casteljau's algorithm.
    let [a, b, c] = [0, 1, 2].map(|i| points[i].lerp(points[i + 1], t));
    let (d, e) = (a.lerp(b, t), b.lerp(c, t));
    let grows = (e - d) * (3.0 * CURVES as f32 * 0.5 * cos);
    (Spectrum(d.lerp(e, t) * BRIGHTNESS), Spectrum(grows * BRIGHTNESS))
}

#[cfg(test)]
mod tests {
    use pt_math::DVec3;

    use super::*;

    fn all() -> [Procedural; 6] {
        let two = [[0.1, 0.2, 0.3], [1.0; 3]];
        let noise = Noise { octaves: 8, roughness: 0.5 };
        [
            Procedural::Checkerboard3d(two),
            Procedural::Dots(two),
            Procedural::Fbm(noise),
            Procedural::Wrinkled(noise),
            Procedural::Windy,
            Procedural::Marble(Marble { noise, variation: 0.7 }),
        ]
    }

    fn points(count: u32) -> impl Iterator<Item = Vec3> {
        (0..count).map(|i| {
            let turns = DVec3::new(0.819_172_5, 0.671_043_6, 0.549_700_5) * f64::from(i);
            ((turns - turns.floor()) * 40.0 - 20.0).as_vec3()
        })
    }

    /// A cube of side ½ at every lattice point, by floors of the coordinates.
    #[test]
    fn cubes_alternate_along_each_axis() {
        let cubes = Procedural::Checkerboard3d([[1.0; 3], [0.0; 3]]);
        for p in points(500) {
            let odd = (p * 2.0).floor().to_array().iter().map(|c| *c as i32).sum::<i32>() % 2 != 0;
            let want = if odd { Spectrum::ZERO } else { Spectrum::ONE };
            assert_eq!(color(cubes, p, 0.0), want, "{p}");
        }
    }

    /// Dots have the area of a circle of their radius, cover the middle of their square, and do not
    /// leave it.
    #[test]
    fn dots_are_circles_in_some_of_the_squares() {
        const COUNT: u32 = 400_000;
        const SIDE: u16 = 240;
        let dots = Procedural::Dots([[1.0; 3], [0.0; 3]]);
        let is_inside = |p: &Vec3| color(dots, *p, 0.0) == Spectrum::ONE;
        let square = |i: u16| Vec3::new(f32::from(i % SIDE), f32::from(i / SIDE), 0.3) - 120.0;
        let with_dot = (0..SIDE * SIDE).map(square).filter(is_inside).count();
        let squares = with_dot as f64 / f64::from(SIDE * SIDE);
        assert!((0.38..0.41).contains(&squares), "{squares}");
        let spread = points(COUNT).map(|p| p * Vec3::new(6.0, 6.0, 1.0));
        let share = spread.filter(is_inside).count() as f64 / f64::from(COUNT);
        let want = squares * std::f64::consts::PI * 0.35 * 0.35;
        assert!((share - want).abs() < 0.004, "{share} for {want}");
        let edges = points(2000).map(|p| Vec3::new(p.x.floor() + 0.5, p.y, 0.0));
        for p in edges {
            let near = color(dots, p + Vec3::X * 0.01, 0.0) == Spectrum::ONE;
            assert!(!near, "a dot touches the edge of its square at {p}");
        }
    }

    /// At all points and for all widths; repeated evaluations agree.
    #[test]
    fn patterns_are_finite_and_bounded_everywhere() {
        let hostile = [0.0, -0.5, 1e-40, 3e9, -1e30, f32::MAX];
        for pattern in all() {
            let lattice = hostile
                .iter()
                .flat_map(|x| hostile.iter().flat_map(|y| hostile.map(|z| Vec3::new(*x, *y, z))));
            for p in lattice.chain(points(200)) {
                for width in [0.0, 1e-3, 0.3, 1e30, f32::INFINITY] {
                    let found = color(pattern, p, width);
                    assert!(
                        found.0.abs().max_element() <= 2.2,
                        "{pattern:?} {p} {width}: {found:?}"
                    );
                    assert_eq!(found, color(pattern, p, width));
                    let sloped = sloped(pattern, p, width);
                    assert!(sloped.iter().all(|c| c.slope.is_finite()), "{pattern:?} {p}");
                    assert_eq!(sloped.map(|c| c.value), found.to_array());
                }
            }
        }
    }

    /// For continuous patterns, except for creases and the joints of the curves of stone.
    #[test]
    fn slopes_are_differences() {
        const STEP: f32 = 1e-3;
        let noise = Noise { octaves: 2, roughness: 0.5 };
        let marble = Marble { noise, variation: 0.7 };
        let patterns = [Procedural::Windy, Procedural::Marble(marble), Procedural::Fbm(noise)];
        for pattern in patterns {
            let mut bad = 0;
            for p in points(300) {
                let slopes = sloped(pattern, p, 0.0).map(|c| c.slope);
                for (axis, unit) in Vec3::AXES.into_iter().enumerate() {
                    let [a, b] = [unit, -unit].map(|step| color(pattern, p + step * STEP, 0.0).0);
                    let difference = (a - b) / (2.0 * STEP);
                    let slope = Vec3::from(slopes.map(|s| s[axis]));
                    bad += u32::from((difference - slope).abs().max_element() > 0.05);
                }
            }
            assert!(bad <= 20, "{pattern:?}: {bad} of 900");
        }
    }

    /// Means are exported to programs that lack these patterns.
    #[test]
    fn means_are_about_the_stated_ones() {
        for pattern in all() {
            let sum: Vec3 = points(20_000).map(|p| color(pattern, p, 0.0).0).sum();
            let mean = sum / 20_000.0;
            let stated = Vec3::from(pattern.mean());
            assert!((mean - stated).abs().max_element() < 0.06, "{pattern:?}: {mean}");
        }
    }
}
