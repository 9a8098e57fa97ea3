//! Times of the functions that every path calls many times: `cargo bench -p pt-math`.
//!
//! Each is called with inputs unknown to the compiler, and the results are used. The minimum of
//! several runs is printed, since other work on the machine only adds time.

use std::hint::black_box;
use std::time::Instant;

use pt_math::sampler::{LANES, Sampler, SamplerBlocks, SamplerConfig, SamplerKind};
use pt_math::{trig, warp};
use pt_testing::Random;

const CALLS: u32 = 1 << 14;
const RUNS: u32 = 1000;

/// Prints nanoseconds per call of `f`, whose argument is the number of the call.
fn time(name: &str, mut f: impl FnMut(u32) -> f32) {
    let run = |f: &mut dyn FnMut() -> f32| {
        let start = Instant::now();
        black_box(f());
        start.elapsed().as_secs_f64() * 1e9 / f64::from(CALLS)
    };
    let mut all = || (0..CALLS).map(|i| f(black_box(i))).sum();
    let best = (0..RUNS).map(|_| run(&mut all)).fold(f64::INFINITY, f64::min);
    println!("{name:32} {best:6.2} ns");
}

fn main() {
    let mut random = Random::new(1);
    let numbers: Vec<f32> = (0..=CALLS).map(|_| random.unit()).collect();
    let unit = |i: u32| numbers[i as usize];
    let point = |i: u32| [unit(i), unit(i + 1)];
    time("a number from the table", unit);
    for (name, kind) in SamplerKind::NAMES {
        let set = SamplerConfig { kind, seed: 1, spp: 64 };
        time(&format!("{name}: new and a 2-D point"), |i| {
            let [x, y] = Sampler::new(set, [i & 127, i >> 7], 5).next_2d();
            x + y
        });
        let mut sampler = Sampler::new(set, [2, 3], 4);
        time(&format!("{name}: 2-D point"), |_| {
            let [x, y] = sampler.next_2d();
            x + y
        });
        time(&format!("{name}: 1-D number"), |_| sampler.next_1d());
        let mut blocks = SamplerBlocks::new(set);
        blocks.refill([([2, 3], 0..LANES as u32)].into_iter());
        time(&format!("{name}: {LANES} 2-D points at once"), |i| {
            let [x, y] = blocks.parts(0, 0..LANES as u32).points(i);
            x[i as usize % LANES] + y[i as usize % LANES]
        });
    }
    time("sin_cos_tau", |i| {
        let (s, c) = trig::sin_cos_tau(unit(i));
        s + c
    });
    time("exp", |i| trig::exp(20.0 * unit(i) - 10.0));
    time("ln", |i| trig::ln(unit(i) + 1e-3));
    time("powf", |i| trig::powf(unit(i), 1.0 / 2.4));
    time("cosine_hemisphere", |i| warp::cosine_hemisphere(point(i)).element_sum());
    time("uniform_cone", |i| warp::uniform_cone(point(i), 0.1).element_sum());
    time("uniform_triangle", |i| warp::uniform_triangle(point(i))[0]);
}
