//! Rotations: unit quaternions (w, x, y, z), rotation vectors, and small helpers.
//!
//! Convention: the rotation matrix A(p) takes body coordinates to world coordinates, and
//! ṗ = ½ p ⊗ (0, ω) with ω in body coordinates.

use nalgebra::{Matrix3, Vector3};

/// Column of three numbers.
pub type Vec3 = Vector3<f64>;
/// Three-by-three matrix.
pub type Mat3 = Matrix3<f64>;
/// Quaternion (w, x, y, z).
pub type Quat = [f64; 4];

/// No rotation.
pub const IDENTITY: Quat = [1.0, 0.0, 0.0, 0.0];

/// p ⊗ q.
#[inline]
#[must_use]
pub fn multiply(p: Quat, q: Quat) -> Quat {
    [
        p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3],
        p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2],
        p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1],
        p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0],
    ]
}

/// The inverse of a unit quaternion.
#[inline]
#[must_use]
pub fn conjugate(p: Quat) -> Quat {
    [p[0], -p[1], -p[2], -p[3]]
}

/// The unit quaternion of a rotation matrix.
#[must_use]
pub fn from_rotation_matrix(a: &Mat3) -> Quat {
    let turn = nalgebra::UnitQuaternion::from_rotation_matrix(
        &nalgebra::Rotation3::from_matrix_unchecked(*a),
    );
    [turn.w, turn.i, turn.j, turn.k]
}

/// p / |p|.
#[inline]
#[must_use]
pub fn normalised(p: Quat) -> Quat {
    let n = 1.0 / (p[0] * p[0] + p[1] * p[1] + p[2] * p[2] + p[3] * p[3]).sqrt();
    [p[0] * n, p[1] * n, p[2] * n, p[3] * n]
}

/// A(p) of a unit quaternion: body to world.
#[inline]
#[must_use]
pub fn rotation_matrix(p: Quat) -> Mat3 {
    let [w, x, y, z] = p;
    Mat3::new(
        1.0 - 2.0 * (y * y + z * z),
        2.0 * (x * y - w * z),
        2.0 * (x * z + w * y),
        2.0 * (x * y + w * z),
        1.0 - 2.0 * (x * x + z * z),
        2.0 * (y * z - w * x),
        2.0 * (x * z - w * y),
        2.0 * (y * z + w * x),
        1.0 - 2.0 * (x * x + y * y),
    )
}

/// ṗ = ½ p ⊗ (0, ω), ω in body coordinates.
#[inline]
#[must_use]
pub fn rate(p: Quat, omega: &Vec3) -> Quat {
    let h = multiply(p, [0.0, omega.x, omega.y, omega.z]);
    [0.5 * h[0], 0.5 * h[1], 0.5 * h[2], 0.5 * h[3]]
}

/// Unit quaternion of a rotation vector: angle |θ| about θ/|θ|.
#[must_use]
pub fn from_rotation_vector(theta: &Vec3) -> Quat {
    let angle = theta.norm();
    let half = 0.5 * angle;
    // sin(x/2)/x, by its series where the quotient would lose digits
    let s = if angle < 1e-4 { 0.5 - angle * angle / 48.0 } else { half.sin() / angle };
    [half.cos(), s * theta.x, s * theta.y, s * theta.z]
}

/// Rotation vector of a unit quaternion, |θ| ≤ π.
#[inline]
#[must_use]
pub fn rotation_vector(q: Quat) -> Vec3 {
    let sign = if q[0] < 0.0 { -1.0 } else { 1.0 };
    let v = Vec3::new(sign * q[1], sign * q[2], sign * q[3]);
    let s2 = v.norm_squared();
    // 2·asin(s)/s: the series to s¹² is exact in double precision up to s = 0.05
    let factor = if s2 < 2.5e-3 {
        let c = [
            1.0 / 6.0,
            3.0 / 40.0,
            15.0 / 336.0,
            105.0 / 3456.0,
            945.0 / 42240.0,
            10395.0 / 599_040.0,
        ];
        2.0 + 2.0 * s2 * (c[0] + s2 * (c[1] + s2 * (c[2] + s2 * (c[3] + s2 * (c[4] + s2 * c[5])))))
    } else {
        let s = s2.sqrt();
        2.0 * s.atan2(sign * q[0]) / s
    };
    v * factor
}

/// J_l(θ)⁻ᵀ, the inverse transpose of the left Jacobian of the rotation vector: takes the gradient
/// of a potential in θ to the moment that it exerts.
///
/// J_l⁻ᵀ = I + ½ θ̃ + (1/θ² − (1 + cos θ)/(2 θ sin θ)) θ̃².
#[must_use]
pub fn moment_from_gradient(theta: &Vec3, gradient: &Vec3) -> Vec3 {
    let t2 = theta.norm_squared();
    let c = if t2 < 1e-3 {
        // series of the coefficient: 1/12 + θ²/720 + θ⁴/30240
        1.0 / 12.0 + t2 * (1.0 / 720.0 + t2 / 30240.0)
    } else {
        let t = t2.sqrt();
        1.0 / t2 - (1.0 + t.cos()) / (2.0 * t * t.sin())
    };
    let first = theta.cross(gradient);
    gradient + first * 0.5 + theta.cross(&first) * c
}

/// Roll, pitch, yaw in rad of a unit quaternion: yaw about z, then pitch about y, then roll about x.
#[must_use]
pub fn roll_pitch_yaw(q: Quat) -> [f64; 3] {
    let [w, x, y, z] = q;
    [
        (2.0 * (w * x + y * z)).atan2(1.0 - 2.0 * (x * x + y * y)),
        (2.0 * (w * y - z * x)).clamp(-1.0, 1.0).asin(),
        (2.0 * (w * z + x * y)).atan2(1.0 - 2.0 * (y * y + z * z)),
    ]
}

/// ã, so that ã b = a × b.
#[must_use]
pub fn cross_matrix(a: &Vec3) -> Mat3 {
    Mat3::new(0.0, -a.z, a.y, a.z, 0.0, -a.x, -a.y, a.x, 0.0)
}

/// Two unit vectors that form a right-handed frame (t1, t2, n) with the unit vector n.
#[must_use]
pub fn complement(n: &Vec3) -> (Vec3, Vec3) {
    let k = n.iamin();
    let mut e = Vec3::zeros();
    e[k] = 1.0;
    let t1 = (e - n * n[k]).normalize();
    (t1, n.cross(&t1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_rotation_vector_inverts_the_exponential() {
        for scale in [0.0, 1e-9, 1e-3, 0.09, 0.11, 1.0, 3.0] {
            let theta = Vec3::new(0.6, -0.48, 0.64) * scale;
            let back = rotation_vector(from_rotation_vector(&theta));
            // both directions round a handful of times: some 1e-15 of the angle
            assert!((back - theta).norm() <= 4e-15 * scale.max(1e-3), "{scale}: {}", back - theta);
        }
    }

    #[test]
    fn analytic_rotation_matrix_turns_as_the_quaternion_says() {
        let a = rotation_matrix(from_rotation_vector(&Vec3::new(0.0, 0.0, 0.3)));
        let x = a * Vec3::x();
        assert!((x - Vec3::new(0.3f64.cos(), 0.3f64.sin(), 0.0)).norm() < 1e-15);
    }

    #[test]
    fn invariant_moment_is_power_conjugate_to_the_rotation_vector() {
        // ω = J_l(θ) θ̇ by differences; M·ω must equal the rate of the potential gradient·θ̇
        let theta = Vec3::new(0.4, -0.7, 0.2);
        let dot = Vec3::new(0.3, 0.5, -0.8);
        let gradient = Vec3::new(1.0, 2.0, -3.0);
        let e = 1e-5;
        let q = |s: f64| from_rotation_vector(&(theta + dot * s));
        // rotation of the moving frame seen in the fixed one: q(e) ⊗ q(−e)⁻¹
        let omega = rotation_vector(multiply(q(e), conjugate(q(-e)))) / (2.0 * e);
        let power = moment_from_gradient(&theta, &gradient).dot(&omega);
        // central difference: e² ~ 1e-10 times derivatives of order one
        assert!((power - gradient.dot(&dot)).abs() < 1e-9);
    }

    #[test]
    fn analytic_roll_pitch_yaw_small_angles() {
        let q = from_rotation_vector(&Vec3::new(1e-6, 2e-6, -3e-6));
        let [roll, pitch, yaw] = roll_pitch_yaw(q);
        // second-order coupling of the three angles is 1e-11
        assert!((roll - 1e-6).abs() < 1e-11);
        assert!((pitch - 2e-6).abs() < 1e-11);
        assert!((yaw + 3e-6).abs() < 1e-11);
    }
}
