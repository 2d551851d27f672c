//! The region in which all zeros must be known, and its boundary.

use std::f64::consts::PI;

use faer::prelude::c64;

/// Re s > −σ − τ |Im s|, to the right of two rays that start at −σ, up to a radius.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Region {
    /// σ (1/s), above 0.
    pub sigma: f64,
    /// Damping ratio of the rays; τ follows from it. Negative: only what grows fast is inside.
    pub damping: f64,
    /// Radius (rad/s) of the arc that closes the region.
    pub radius: f64,
}

impl Region {
    fn tangent(&self) -> f64 {
        self.damping / (1.0 - self.damping * self.damping).sqrt()
    }

    /// Whether s is inside.
    #[must_use]
    pub fn contains(&self, s: c64) -> bool {
        self.beyond_rays(s) && (s + self.sigma).norm() < self.corner().norm()
    }

    fn beyond_rays(&self, s: c64) -> bool {
        s.re > -self.sigma - self.tangent() * s.im.abs()
    }

    fn scale(&self) -> f64 {
        2.0 * self.sigma
    }

    /// Length of the ray, in powers of e but for its start.
    pub(crate) fn reach(&self) -> f64 {
        (self.radius / self.scale()).asinh()
    }

    /// Where the ray meets the arc, from the start of the ray.
    fn corner(&self) -> c64 {
        c64::new(-self.radius * self.tangent(), self.radius)
    }

    /// Distance of s to the rays, as a difference of damping ratios.
    pub(crate) fn clearance(&self, s: c64) -> f64 {
        (s.re + self.sigma + self.tangent() * s.im.abs()).abs() / s.norm().max(self.sigma)
    }

    /// Whether s is inside or near, up to that damping ratio more.
    #[must_use]
    pub fn near(&self, s: c64, margin: f64) -> bool {
        let wider = Self {
            damping: self.damping + margin,
            sigma: 2.0 * self.sigma,
            radius: (1.0 + margin) * self.radius,
        };
        wider.contains(s)
    }

    /// The upper half of the boundary: t from 0 to 1 is the ray, from the real axis outward; 1 to 2 the arc back to the
    /// real axis.
    #[must_use]
    pub fn boundary(&self, t: f64) -> c64 {
        let corner = self.corner();
        if t <= 1.0 {
            // short steps near the real axis, long ones far out
            let omega =
                if t < 1.0 { self.scale() * (t * self.reach()).sinh() } else { self.radius };
            return c64::new(-self.sigma - self.tangent() * omega, omega);
        }
        let (size, angle) = (corner.norm(), corner.arg());
        let angle = if t < 2.0 { angle * (2.0 - t) } else { 0.0 };
        debug_assert!(angle <= PI);
        c64::from_polar(size, angle) - self.sigma
    }
}
