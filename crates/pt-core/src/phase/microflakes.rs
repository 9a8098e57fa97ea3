//! Flat particles with a preferred orientation.

use std::f64::consts::PI;

use pt_math::{DMat3, DVec3, Frame, Pdf, SolidAngle, Vec3, trig};

use super::PhaseFunction;

/// SGGX microflakes: mirrors whose normals are distributed as those of the ellipsoid x ᵀ S⁻¹ x = 1.
/// [Heitz, Dupuy, Crassin & Dachsbacher 2015, "The SGGX Microflake Distribution", §3 and §4]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Microflakes {
    /// The symmetric, positive definite matrix S: σ(ω)² = ωᵀ S ω.
    matrix: DMat3,
    inverse: DMat3,
    /// √|S|.
    root: f64,
}

impl Microflakes {
    /// Creates microflakes from S = (xx, yy, zz, xy, xz, yz); `None` if it is not positive
    /// definite.
    pub fn new(entries: [f32; 6]) -> Option<Self> {
        let [xx, yy, zz, xy, xz, yz] = entries.map(f64::from);
        let matrix = DMat3::from_cols_array(&[xx, xy, xz, xy, yy, yz, xz, yz, zz]);
        let determinant = matrix.determinant();
        let is_definite = xx > 0.0 && xx * yy - xy * xy > 0.0 && determinant > 0.0;
        let inverse = matrix.inverse();
        (is_definite && inverse.is_finite()).then(|| Self {
            matrix,
            inverse,
            root: determinant.sqrt(),
        })
    }

    /// Upper bound of σ: the root of a bound on the greatest eigenvalue, which is at most the
    /// trace, and at most the greatest sum of a row's absolute values.
    pub fn greatest_area(&self) -> f32 {
        let m = &self.matrix;
        let rows = [m.x_axis, m.y_axis, m.z_axis].map(|row| row.abs().element_sum());
        let trace = m.x_axis.x + m.y_axis.y + m.z_axis.z;
        rows.into_iter().fold(0.0, f64::max).min(trace).sqrt() as f32
    }

    /// D(ω) = 1 / (π √|S| (ωᵀ S⁻¹ ω)²).
    fn normals(&self, normal: DVec3) -> f64 {
        let stretch = normal.dot(self.inverse * normal);
        1.0 / (PI * self.root * stretch * stretch)
    }

    /// Samples a visible normal, with the density ⟨ωo, ω⟩ D(ω) / σ(ωo): a point of the visible part
    /// of the ellipsoid, which is an affine image of the unit sphere seen from ωo.
    fn visible_normal(&self, wo: Vec3, [u, v]: [f32; 2]) -> DVec3 {
        let frame = Frame::from_normal(wo);
        let [k, j, i] = [frame.s, frame.t, frame.n].map(Vec3::as_dvec3);
        let entry = |a: DVec3, b: DVec3| a.dot(self.matrix * b);
        let (jj, ii) = (entry(j, j), entry(i, i));
        let (kj, ki, ji) = (entry(k, j), entry(k, i), entry(j, i));
        // S = L Lᵀ with the pole of the sphere at ωo; the columns are those of the root of S in
        // this frame.
        let pole = ii.sqrt();
        let minor = (jj * ii - ji * ji).sqrt();
        let on_k = DVec3::new(self.root / minor, 0.0, 0.0);
        let on_j = DVec3::new((kj * ii - ki * ji) / (pole * minor), minor / pole, 0.0);
        let on_i = DVec3::new(ki, ji, ii) / pole;
        let (sin, cos) = trig::sin_cos_tau(v);
        let radius = f64::from(u.sqrt());
        let height = f64::from((1.0 - u).max(0.0)).sqrt();
        let p = on_k * (radius * f64::from(cos)) + on_j * (radius * f64::from(sin)) + on_i * height;
        (k * p.x + j * p.y + i * p.z).normalize()
    }
}

impl PhaseFunction for Microflakes {
    /// p = D(ωh) / (4 σ(ωo)), with ωh the half vector.
    fn pdf(&self, wo: Vec3, wi: Vec3) -> Pdf<SolidAngle> {
        // For opposite directions, any normal perpendicular to them is a half vector.
        let halfway = (wo.as_dvec3() + wi.as_dvec3())
            .try_normalize()
            .unwrap_or_else(|| Frame::from_normal(wo).s.as_dvec3());
        Pdf::new((self.normals(halfway) / (4.0 * f64::from(self.area(wo)))) as f32)
    }

    fn sample(&self, wo: Vec3, u: [f32; 2]) -> Vec3 {
        let (normal, out) = (self.visible_normal(wo, u), wo.as_dvec3());
        (normal * (2.0 * normal.dot(out)) - out).normalize().as_vec3()
    }

    /// σ(ω) = √(ωᵀ S ω).
    fn area(&self, w: Vec3) -> f32 {
        let w = w.as_dvec3();
        w.dot(self.matrix * w).sqrt() as f32
    }

    fn examples() -> Vec<Self> {
        let flakes = [0.15, 0.25, 0.9, 0.02, -0.1, 0.2];
        let fibres = [0.6, 0.55, 0.08, 0.1, 0.02, -0.05];
        [[1.0, 1.0, 1.0, 0.0, 0.0, 0.0], flakes, fibres].map(|s| Self::new(s).unwrap()).to_vec()
    }
}

#[cfg(test)]
mod tests {
    use pt_testing::Random;

    use super::*;

    /// σ(ω) is the mean of |cos| to the normals: ∫ ⟨ω, ω'⟩ D(ω') dω'. [Heitz et al. 2015, eq. 4]
    #[test]
    fn areas_are_what_the_normals_project_to() {
        const N: u32 = 200_000;
        for flakes in Microflakes::examples() {
            for w in [Vec3::Z, Vec3::new(0.6, 0.0, -0.8), Vec3::new(-0.48, 0.64, 0.6)] {
                let mut random = Random::new(9);
                let projected = |_| {
                    let normal = random.direction().as_dvec3();
                    4.0 * PI * normal.dot(w.as_dvec3()).max(0.0) * flakes.normals(normal)
                };
                let mean = (0..N).map(projected).sum::<f64>() / f64::from(N);
                let want = f64::from(flakes.area(w));
                assert!((mean / want - 1.0).abs() < 0.02, "{flakes:?} {w}: {mean}, {want}");
                assert!(flakes.area(w) <= flakes.greatest_area() * (1.0 + 1e-6));
            }
        }
    }

    #[test]
    fn only_positive_definite_matrices_are_flakes() {
        for entries in [
            [0.0, 1.0, 1.0, 0.0, 0.0, 0.0],
            [1.0, 1.0, -1.0, 0.0, 0.0, 0.0],
            [1.0, 1.0, 1.0, 1.0, 0.0, 0.0],
            [f32::NAN, 1.0, 1.0, 0.0, 0.0, 0.0],
        ] {
            assert_eq!(Microflakes::new(entries), None, "{entries:?}");
        }
    }
}
