//! Frames of the line, and where a point meets it.

use nalgebra::{Matrix3, Vector3};

/// The line at an arc length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// Arc length, m.
    pub s: f64,
    /// p, m.
    pub position: Vector3<f64>,
    /// R: the axes t (along), n (left) and b (up) as columns.
    pub axes: Matrix3<f64>,
    /// κ in the axes of the frame, rad/m: dR/ds = R·\[κ\]ₓ.
    pub curvature: Vector3<f64>,
    /// dκ/ds, rad/m².
    pub curvature_rate: Vector3<f64>,
}

/// Where a point meets the line: its foot, and its coordinates across it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Meeting {
    /// The line at the foot.
    pub frame: Frame,
    /// Coordinates of the point in the axes of the frame, m: 0 along, left, up.
    pub across: Vector3<f64>,
}

impl Meeting {
    /// Arc length by which the point itself moves per arc length of its foot: 1 + κ_y z − κ_z y.
    pub fn stretch(&self) -> f64 {
        let (k, y) = (&self.frame.curvature, &self.across);
        1.0 + k.y * y.z - k.z * y.y
    }

    /// Rates (ṡ, ẏ, ż) of the point's coordinates for its velocity in the axes of the frame, m/s.
    pub fn rates(&self, velocity: &Vector3<f64>) -> Vector3<f64> {
        let along = velocity.x / self.stretch();
        let roll = along * self.frame.curvature.x;
        Vector3::new(along, velocity.y + roll * self.across.z, velocity.z - roll * self.across.y)
    }

    /// Second derivatives of the point's coordinates for its velocity and its acceleration in the axes of
    /// the frame, m/s².
    pub fn accelerations(
        &self,
        velocity: &Vector3<f64>,
        acceleration: &Vector3<f64>,
    ) -> Vector3<f64> {
        let (k, k1, at) = (&self.frame.curvature, &self.frame.curvature_rate, &self.across);
        let rates = self.rates(velocity);
        let along = rates.x;
        // rates of the velocity's components in the turning axes
        let seen = acceleration - k.cross(velocity) * along;
        let stretch_rate = along * (k1.y * at.z - k1.z * at.y) + k.y * rates.z - k.z * rates.y;
        let along_rate = (seen.x - along * stretch_rate) / self.stretch();
        let roll = along * k.x;
        let roll_rate = along_rate * k.x + along * along * k1.x;
        Vector3::new(
            along_rate,
            seen.y + roll_rate * at.z + roll * rates.z,
            seen.z - roll_rate * at.y - roll * rates.y,
        )
    }
}
