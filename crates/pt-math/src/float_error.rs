//! Bounds of floating-point error.

/// Half the distance from 1 to the next `f32`.
pub const EPSILON: f32 = f32::EPSILON * 0.5;

/// γₙ = nε / (1 − nε): the relative error of a chain of `n` roundings is at most γₙ.
/// [Higham 2002, lemma 3.1]
pub const fn gamma(n: u32) -> f32 {
    let e = n as f32 * EPSILON;
    e / (1.0 - e)
}
