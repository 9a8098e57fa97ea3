//! Orthonormal frames.

use glam::Vec3;

/// Right-handed orthonormal frame; local +z is the normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Tangent, local +x.
    pub s: Vec3,
    /// Bitangent, local +y.
    pub t: Vec3,
    /// Normal, local +z.
    pub n: Vec3,
}

impl Frame {
    /// Creates a frame around the unit vector `n`, continuous except where n.z changes sign. [Duff
    /// et al. 2017, "Building an Orthonormal Basis, Revisited", listing 3]
    #[inline]
    pub fn from_normal(n: Vec3) -> Self {
        let sign = 1f32.copysign(n.z);
        let a = -1.0 / (sign + n.z);
        let b = n.x * n.y * a;
        Self {
            s: Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
            t: Vec3::new(b, sign + n.y * n.y * a, -n.y),
            n,
        }
    }

    /// Creates a frame around the unit vector `n` whose +x is the component of `tangent`
    /// perpendicular to it; an arbitrary frame if that is zero.
    #[inline]
    pub fn from_normal_and_tangent(n: Vec3, tangent: Vec3) -> Self {
        let across = tangent - n * n.dot(tangent);
        match across.try_normalize() {
            Some(s) => Self { s, t: n.cross(s), n },
            None => Self::from_normal(n),
        }
    }

    /// Transforms from world to local coordinates.
    #[inline]
    pub fn to_local(&self, v: Vec3) -> Vec3 {
        Vec3::new(v.dot(self.s), v.dot(self.t), v.dot(self.n))
    }

    /// Transforms from local to world coordinates.
    #[inline]
    pub fn to_world(&self, v: Vec3) -> Vec3 {
        self.s * v.x + self.t * v.y + self.n * v.z
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_orthonormal_and_right_handed() {
        let normals = [Vec3::X, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z, Vec3::new(0.6, -0.48, -0.64)];
        let tangent = Vec3::new(3.0, 0.5, 1e-3);
        let turned = normals.map(|n| Frame::from_normal_and_tangent(n, tangent));
        for f in turned {
            assert!(f.s.dot(tangent) > 0.0 && f.t.dot(tangent).abs() < 1e-6);
        }
        let unturned = Frame::from_normal_and_tangent(Vec3::Y, Vec3::Y * -2.0);
        for f in normals.map(Frame::from_normal).into_iter().chain(turned).chain([unturned]) {
            let n = f.n;
            assert!(f.s.dot(f.t).abs() < 1e-6 && f.s.dot(n).abs() < 1e-6);
            assert!((f.s.cross(f.t) - n).length() < 1e-6, "{n}");
            let v = Vec3::new(0.1, 2.0, -3.0);
            assert!((f.to_world(f.to_local(v)) - v).length() < 1e-5);
        }
    }
}
