//! The law of contact between a magnet and the rail.
//!
//! A stop touches the rail from below at a small gap, a skid lands on it from above at a large one.
//! With the depth d of the contact (the gap beyond the one at which it touches), the normal force is
//! that of Hunt and Crossley (1975) with the exponent 1 of two flat faces,
//!
//! N = k d (1 + χ ḋ) for d > 0, never negative,
//!
//! which starts and ends at zero, never pulls, and loses energy in proportion to depth. A free mass
//! that hits with the speed v leaves with e v, where χ v − ln(1 + χ v) = −χ e v − ln(1 − χ e v): for
//! small χ v, e = 1 − 2/3 χ v. Stiffness and mass do not matter. Friction opposes sliding with the
//! velocity s by μ N s/√(s² + s₀²), Coulomb's law smoothed below the slip speed s₀.
//!
//! K. H. Hunt, F. R. E. Crossley: Coefficient of restitution interpreted as damping in vibroimpact,
//! Journal of Applied Mechanics 42 (1975), 440-445.

use crate::math::Vec3;

/// The law of one kind of contact, at every magnet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactLaw {
    /// Air gap at which it touches, m.
    pub gap: f64,
    /// k, N/m.
    pub stiffness: f64,
    /// χ, s/m.
    pub damping: f64,
    /// μ.
    pub friction: f64,
}

impl ContactLaw {
    /// N at the depth d (m) that grows by ḋ (m/s).
    #[must_use]
    pub fn normal(&self, depth: f64, rate: f64) -> f64 {
        if depth > 0.0 {
            (self.stiffness * depth * (1.0 + self.damping * rate)).max(0.0)
        } else {
            0.0
        }
    }

    /// ∂N/∂d (N/m) and ∂N/∂ḋ (N·s/m); zeros without contact.
    #[must_use]
    pub fn slopes(&self, depth: f64, rate: f64) -> [f64; 2] {
        let factor = 1.0 + self.damping * rate;
        if depth > 0.0 && factor > 0.0 {
            [self.stiffness * factor, self.stiffness * self.damping * depth]
        } else {
            [0.0; 2]
        }
    }

    /// e: speed of a free mass after the impact by its speed before it (m/s).
    #[must_use]
    pub fn restitution(&self, speed: f64) -> f64 {
        let hit = self.damping * speed;
        if hit.abs() < 1e-6 {
            // the next term of the series is of the size of hit²
            return 1.0 - 2.0 / 3.0 * hit.max(0.0);
        }
        let work = hit - hit.ln_1p();
        // −x − ln(1 − x) = work has one root in [0, 1); it is convex, and increases
        let (mut low, mut high) = (0.0_f64, 1.0_f64);
        for _ in 0..200 {
            let x = 0.5 * (low + high);
            if x <= low || x >= high {
                break;
            }
            if -x - (-x).ln_1p() < work { low = x } else { high = x }
        }
        low / hit
    }
}

/// Stops and skids that are in force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// The stop, which pushes the magnet down where the gap is smaller than its own.
    pub stop: Option<ContactLaw>,
    /// The skid, which carries the magnet where the gap is larger than its own.
    pub skid: Option<ContactLaw>,
    /// s₀, m/s.
    pub slip_speed: f64,
}

/// One magnet relative to the rail.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Clearance {
    /// c, m.
    pub gap: f64,
    /// ċ, m/s.
    pub rate: f64,
}

/// One contact of a magnet: the law, its depth and rate, and the direction of its normal force on the
/// magnet (up positive).
#[derive(Debug, Clone, Copy)]
pub(crate) struct Touch {
    pub law: ContactLaw,
    pub depth: f64,
    pub rate: f64,
    pub up: f64,
}

impl Touch {
    pub fn normal(&self) -> f64 {
        self.law.normal(self.depth, self.rate)
    }
}

impl Contact {
    /// Whether anything is in force.
    #[must_use]
    pub fn any(&self) -> bool {
        self.stop.is_some() || self.skid.is_some()
    }

    /// Largest k and largest k χ of stop and skid.
    pub(crate) fn stiffest(&self) -> (f64, f64) {
        let laws = self.stop.iter().chain(&self.skid);
        laws.fold((0.0, 0.0), |(k, c), law| {
            (law.stiffness.max(k), (law.stiffness * law.damping).max(c))
        })
    }

    /// The contacts in force at a clearance, touching or not: first the stop, then the skid.
    pub(crate) fn at(&self, clearance: Clearance) -> impl Iterator<Item = Touch> + use<> {
        let Clearance { gap, rate } = clearance;
        let stop = self.stop.map(|law| Touch { law, depth: law.gap - gap, rate: -rate, up: -1.0 });
        let skid = self.skid.map(|law| Touch { law, depth: gap - law.gap, rate, up: 1.0 });
        stop.into_iter().chain(skid)
    }

    /// Force on the magnet (world axes, N) at a clearance, with the velocity (x, y) at which it slides
    /// along the rail (m/s).
    pub(crate) fn force(&self, clearance: Clearance, slip: [f64; 2]) -> Vec3 {
        let (mut up, mut friction) = (0.0, 0.0);
        for touch in self.at(clearance) {
            let normal = touch.normal();
            up += touch.up * normal;
            friction += touch.law.friction * normal;
        }
        let drag = -friction * self.per_slip(slip);
        Vec3::new(drag * slip[0], drag * slip[1], up)
    }

    /// 1/√(s² + s₀²), s/m.
    pub(crate) fn per_slip(&self, [x, y]: [f64; 2]) -> f64 {
        1.0 / (x * x + y * y + self.slip_speed * self.slip_speed).sqrt()
    }

    /// Change of [`Contact::force`] with the gap (N/m) and with its rate (N·s/m).
    pub(crate) fn force_slopes(&self, clearance: Clearance, slip: [f64; 2]) -> [Vec3; 2] {
        let per_slip = self.per_slip(slip);
        let mut slopes = [Vec3::zeros(); 2];
        for touch in self.at(clearance) {
            // depth and its rate change with the gap by the sign of `up`
            let by = touch.law.slopes(touch.depth, touch.rate).map(|slope| slope * touch.up);
            let drag = -touch.law.friction * per_slip;
            let direction = Vec3::new(drag * slip[0], drag * slip[1], touch.up);
            slopes[0] += direction * by[0];
            slopes[1] += direction * by[1];
        }
        slopes
    }

    /// Change of [`Contact::force`] with the velocity (y) at which the magnet slides sideways, N·s/m.
    pub(crate) fn force_by_side_slip(&self, clearance: Clearance, slip: [f64; 2]) -> Vec3 {
        let friction: f64 =
            self.at(clearance).map(|touch| touch.law.friction * touch.normal()).sum();
        let per_slip = self.per_slip(slip);
        let [x, y] = slip.map(|s| s * per_slip);
        Vec3::new(friction * per_slip * x * y, -friction * per_slip * (1.0 - y * y), 0.0)
    }

    /// Whether stop, nominal gap and skid are in this order. The error names the side.
    ///
    /// # Errors
    /// The side (`stop` or `skid`) and the message.
    pub fn check_gaps(&self, nominal_gap: f64) -> Result<(), (&'static str, String)> {
        if let Some(stop) = self.stop.filter(|stop| stop.gap >= nominal_gap) {
            let message = format!(
                "the stop at {} m would touch at the nominal gap of {nominal_gap} m; it must be smaller",
                stop.gap
            );
            return Err(("stop", message));
        }
        if let Some(skid) = self.skid.filter(|skid| skid.gap <= nominal_gap) {
            let message = format!(
                "the skid at {} m would touch at the nominal gap of {nominal_gap} m; it must be larger",
                skid.gap
            );
            return Err(("skid", message));
        }
        Ok(())
    }
}
