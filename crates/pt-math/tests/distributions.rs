//! Laws of tabulated distributions: frequencies of the results, and results that never occur.

use pt_math::distribution::{AliasTable, Piecewise2D};
use pt_testing::{Chi2, Random, chi2_square};

/// Largest number below 1 that a sampler returns.
const LAST: f32 = 1.0 - 1.0 / 16_777_216.0;

/// Lists of weights with all special cases.
fn weight_lists() -> Vec<Vec<f32>> {
    let mut random = Random::new(2);
    let mut mixed = |n: usize, zeros: f32| -> Vec<f32> {
        let weight = |r: &mut Random| if r.unit() < zeros { 0.0 } else { r.unit().powi(8) };
        let mut list: Vec<_> = (0..n).map(|_| weight(&mut random)).collect();
        list[n / 2] = 1.0;
        list
    };
    vec![
        vec![3.0],
        vec![1.0, 3.0],
        vec![0.0, 0.0, 1.0, 0.0],
        vec![f32::NAN, 2.0, -1.0, f32::INFINITY, 6.0, f32::NEG_INFINITY],
        vec![1e-30, 1e30, 1.0, f32::MIN_POSITIVE],
        vec![f32::MAX, f32::MAX, f32::MAX],
        mixed(100, 0.0),
        mixed(1000, 0.9),
    ]
}

/// Usable weights, normalized.
fn shares(weights: &[f32]) -> Vec<f64> {
    let usable = |w: f32| if w > 0.0 && w.is_finite() { f64::from(w) } else { 0.0 };
    let total: f64 = weights.iter().map(|&w| usable(w)).sum();
    weights.iter().map(|&w| usable(w) / total).collect()
}

#[test]
fn indices_are_chosen_by_their_shares() {
    const POINTS: usize = 1 << 20;
    for weights in weight_lists() {
        let table = AliasTable::new(&weights).unwrap();
        let n = weights.len();
        let (mut counts, mut rests) = (vec![0u32; n], vec![0f64; n]);
        for i in 0..POINTS {
            let (chosen, p, rest) = table.sample((i as f32 + 0.5) / POINTS as f32);
            assert!(p > 0.0 && p == table.probability(chosen) && (0.0..1.0).contains(&rest));
            counts[chosen] += 1;
            rests[chosen] += f64::from(rest);
        }
        for (i, share) in shares(&weights).into_iter().enumerate() {
            assert!((f64::from(table.probability(i)) - share).abs() <= 1e-7 * share + 1e-45);
            // The points that choose i lie in at most n intervals, each with a count within one
            // point.
            let count = f64::from(counts[i]);
            let most = n as f64 + 1e-6 * POINTS as f64;
            assert!((count - share * POINTS as f64).abs() <= most, "{i} of {n}");
            if count > 0.0 {
                // In each interval the remapped number runs uniformly through [0, 1), up to half a
                // point at either end.
                assert!((rests[i] / count - 0.5).abs() <= most / count, "{i} of {n}");
            }
        }
    }
}

#[test]
fn the_ends_of_the_interval_choose_too() {
    for weights in weight_lists() {
        let table = AliasTable::new(&weights).unwrap();
        for u in [0.0, LAST] {
            let (i, p, rest) = table.sample(u);
            assert!(p > 0.0 && shares(&weights)[i] > 0.0 && (0.0..1.0).contains(&rest));
        }
    }
}

#[test]
fn without_a_weight_there_is_no_table() {
    for weights in [&[] as &[f32], &[0.0, -1.0], &[f32::NAN], &[f32::INFINITY, 0.0]] {
        assert!(AliasTable::new(weights).is_none(), "{weights:?}");
        assert!(Piecewise2D::new(weights, weights.len(), 1).is_none(), "{weights:?}");
    }
    assert!(Piecewise2D::new(&[1.0; 6], 2, 4).is_none());
    assert!(Piecewise2D::new(&[1.0; 6], 0, 0).is_none());
    assert!(AliasTable::new(&[1.0]).unwrap().probability(1) == 0.0);
}

/// Grids (values, width, height) with empty rows, columns and corners.
fn grids() -> Vec<(Vec<f32>, usize, usize)> {
    let mut random = Random::new(4);
    let mut sparse = |width: usize, height: usize, zeros: f32| {
        let mut values: Vec<_> = (0..width * height)
            .map(|_| if random.unit() < zeros { 0.0 } else { random.unit() })
            .collect();
        let middle = (height / 2) * width + width / 3;
        values[middle] = 1.0;
        values[..width].fill(0.0);
        values[(height - 1) * width..].fill(0.0);
        values[middle] = 5.0;
        (values, width, height)
    };
    vec![
        (vec![2.0], 1, 1),
        (vec![0.0, 1.0, 0.0, 0.0], 4, 1),
        (vec![0.0, 0.0, 0.5, 3.0], 1, 4),
        (vec![1.0, f32::NAN, f32::INFINITY, -2.0, 1e-30, 1.0], 3, 2),
        sparse(7, 5, 0.3),
        sparse(33, 17, 0.9),
        sparse(100, 61, 0.0),
    ]
}

#[test]
fn points_follow_their_density() {
    let grids = grids();
    for (i, (values, width, height)) in grids.iter().enumerate() {
        let table = Piecewise2D::new(values, *width, *height).unwrap();
        let name = format!("grid {i}");
        let config = Chi2 { bins: [30, 40], ..Chi2::new(&name).one_of(grids.len()) };
        chi2_square(|u| Some(table.sample(u).0), |p| table.pdf(p), &config).unwrap();
    }
}

#[test]
fn points_lie_in_cells_of_the_density_returned() {
    for (values, width, height) in grids() {
        let table = Piecewise2D::new(&values, width, height).unwrap();
        let mut random = Random::new(6);
        let ends = [[0.0, 0.0], [LAST, LAST], [0.0, LAST], [LAST, 0.0], [0.5, 0.5]];
        let points = ends.into_iter().chain((0..100_000).map(|_| random.unit_2d()));
        for u in points {
            let ([x, y], pdf) = table.sample(u);
            assert!((0.0..1.0).contains(&x) && (0.0..1.0).contains(&y));
            assert_eq!(table.pdf([x, y]), pdf);
            let cell = |t: f32, n: usize| (t * n as f32) as usize;
            let value = values[cell(y, height) * width + cell(x, width)];
            assert!(value > 0.0 && value.is_finite() && pdf > 0.0, "{u:?}");
        }
    }
}

#[test]
fn cumulative_shares_on_the_point_choose_the_cell_behind() {
    // Fractions of ¼, ½ and ¼ around empty cells: each boundary is a number that u takes exactly.
    let table = Piecewise2D::new(&[1.0, 0.0, 2.0, 0.0, 0.0, 1.0, 0.0], 7, 1).unwrap();
    let cell = |u: f32| (table.sample([u, 0.5]).0[0] * 7.0) as usize;
    assert_eq!([0.0, 0.25, 0.75].map(cell), [0, 2, 5]);
    assert_eq!([0.25f32.next_down(), 0.75f32.next_down(), LAST].map(cell), [0, 2, 5]);
}

#[test]
fn the_density_has_a_mean_of_one() {
    for (values, width, height) in grids() {
        let table = Piecewise2D::new(&values, width, height).unwrap();
        let middle = |i: usize, n: usize| (i as f32 + 0.5) / n as f32;
        let cells = (0..width * height)
            .map(|i| f64::from(table.pdf([middle(i % width, width), middle(i / width, height)])));
        assert!((cells.sum::<f64>() / (width * height) as f64 - 1.0).abs() < 1e-6);
    }
}
