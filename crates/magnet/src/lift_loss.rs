//! Lift loss at a lateral offset: force, lateral force and flux linkage from one co-energy.
//!
//! W'(i, c, y) = ½·L(c, y)·i² with L = (2K/c)·G and K = μ₀AN²/4, where
//!
//! G(c, y) = 1 − (2/πw)·[y·atan(y/c) − (c/2)·ln(1 + y²/c²)].
//!
//! Its derivatives are the textbook's law of a magnet whose poles of the width w are aside by y:
//!
//! F = −∂W'/∂c = K·(i/c)²·[1 − (2y/πw)·atan(y/c)],
//! F_y = ∂W'/∂y = −K·(i/c)²·(2c/πw)·atan(y/c),
//! λ = ∂W'/∂i = L·i.
//!
//! W. Brzezina and J. Langerholc, J. Appl. Phys. 45 (1974) 1869-1872, by conformal mapping; in this form
//! in P. K. Sinha, *Electromagnetic Suspension: Dynamics & Control*, Peter Peregrinus (1987). Their
//! constant gain of the fringe field at y = 0, 2c/(πw), is left out, so that a centred magnet is that of
//! [`Law::Nonlinear`](crate::Law::Nonlinear). The mapping is of one pair of edges that do not see each
//! other: it holds for offsets below the pole's width and loses its meaning there, where the poles no
//! longer overlap.
//!
//! Roll of a magnet is not part of the law: an angle φ opens one edge of a pole by wφ/2 and closes the
//! other, which changes the force by (wφ/2c)² of it, 8e-5 at 5 mrad.

use std::f64::consts::FRAC_2_PI;

use crate::jet::Jet;

/// The law for one magnet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LiftLoss {
    /// K, in N·m²/A².
    constant: f64,
    /// w, in m.
    pole_width: f64,
}

/// Where a magnet is below its rail.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Gap c, in m.
    pub gap: f64,
    /// Displacement y of the magnet to the left of the rail, in m.
    pub offset: f64,
}

/// A quantity at a place with its derivatives by gap and offset.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slopes {
    /// The quantity.
    pub value: f64,
    /// By the gap, per m.
    pub by_gap: f64,
    /// By the offset, per m.
    pub by_offset: f64,
}

impl LiftLoss {
    /// The law for K = μ₀AN²/4 (N·m²/A²) and poles of the width w (m).
    pub fn new(constant: f64, pole_width: f64) -> Self {
        Self { constant, pole_width }
    }

    /// Offset at and beyond which the poles do not overlap and the law ends, in m.
    pub fn limit(&self) -> f64 {
        self.pole_width
    }

    /// Fraction of the lift at the same current that an offset costs: (2y/πw)·atan(y/c).
    pub fn fraction(&self, place: Place) -> f64 {
        lost_lift(place.gap, place.offset, self.pole_width)
    }

    /// Inductance L, in H.
    pub fn inductance(&self, place: Place) -> f64 {
        2.0 * self.constant * self.spread(place) / place.gap
    }

    /// Levitation force, in N, of a current (A).
    pub fn force_of_current(&self, place: Place, current: f64) -> f64 {
        let density = current / place.gap;
        self.constant * density * density * (1.0 - self.fraction(place))
    }

    /// Lateral force on the magnet, in N, of a current (A).
    pub fn lateral_of_current(&self, place: Place, current: f64) -> f64 {
        let density = current / place.gap;
        self.constant * density * density * place.gap * self.spread_by_offset(place)
    }

    /// Levitation force, in N, of a flux linkage (Wb).
    pub fn force_of_flux(&self, place: Place, flux: f64) -> f64 {
        self.force_of_current(place, flux / self.inductance(place))
    }

    /// Lateral force on the magnet, in N, of a flux linkage (Wb).
    pub fn lateral_of_flux(&self, place: Place, flux: f64) -> f64 {
        self.lateral_of_current(place, flux / self.inductance(place))
    }

    /// Current, in A, that holds a force (N).
    pub fn equilibrium_current(&self, place: Place, force: f64) -> f64 {
        place.gap * (force / (self.constant * (1.0 - self.fraction(place)))).sqrt()
    }

    /// Current per flux linkage, 1/L, with its derivatives, in 1/H.
    pub fn reluctance(&self, place: Place) -> Slopes {
        (self.gap(place) / self.spread_jet(place)).slopes(0.5 / self.constant)
    }

    /// The levitation force with its derivatives at constant current (A).
    pub fn force_at_current(&self, place: Place, current: f64) -> Slopes {
        self.per_current(place).slopes(self.constant * current * current)
    }

    /// The lateral force with its derivatives at constant current (A).
    pub fn lateral_at_current(&self, place: Place, current: f64) -> Slopes {
        let shape = self.slope_jet(place) / self.gap(place);
        shape.slopes(self.constant * current * current)
    }

    /// The levitation force with its derivatives at constant flux linkage (Wb).
    pub fn force_at_flux(&self, place: Place, flux: f64) -> Slopes {
        self.per_flux(place).slopes(flux * flux / (4.0 * self.constant))
    }

    /// The lateral force with its derivatives at constant flux linkage (Wb).
    pub fn lateral_at_flux(&self, place: Place, flux: f64) -> Slopes {
        let spread = self.spread_jet(place);
        let shape = self.gap(place) * self.slope_jet(place) / (spread * spread);
        shape.slopes(flux * flux / (4.0 * self.constant))
    }

    /// First and second derivative in time of the levitation force while the place moves, at constant
    /// current (A).
    pub(crate) fn rates_at_current(&self, place: Place, motion: &Motion, i: f64) -> [f64; 2] {
        let [_, first, second] = self.per_current(place).course(motion);
        let scale = self.constant * i * i;
        [scale * first, scale * second]
    }

    /// First and second derivative in time of the levitation force while the place moves and the flux
    /// linkage follows its value and its two derivatives (Wb, V, V/s).
    pub(crate) fn rates_of_flux(
        &self,
        place: Place,
        motion: &Motion,
        [flux, rate, bend]: [f64; 3],
    ) -> [f64; 2] {
        let [p, p1, p2] = self.per_flux(place).course(motion);
        let scale = 1.0 / (4.0 * self.constant);
        let (square, square1) = (flux * flux, 2.0 * flux * rate);
        let square2 = 2.0 * (rate * rate + flux * bend);
        [
            scale * (square1 * p + square * p1),
            scale * (square2 * p + 2.0 * square1 * p1 + square * p2),
        ]
    }

    /// G.
    fn spread(&self, Place { gap, offset }: Place) -> f64 {
        let ratio = offset / gap;
        let lost = offset * ratio.atan() - 0.5 * gap * (ratio * ratio).ln_1p();
        1.0 - FRAC_2_PI / self.pole_width * lost
    }

    /// ∂G/∂y, in 1/m.
    fn spread_by_offset(&self, Place { gap, offset }: Place) -> f64 {
        -FRAC_2_PI / self.pole_width * (offset / gap).atan()
    }

    fn gap(&self, place: Place) -> Jet {
        Jet { value: place.gap, first: [1.0, 0.0], second: [0.0; 3] }
    }

    /// F/(K·i²) = (1 − (2y/πw)·atan(y/c))/c².
    fn per_current(&self, place: Place) -> Jet {
        self.lift_jet(place) / (self.gap(place) * self.gap(place))
    }

    /// 4K·F/λ² = (1 − (2y/πw)·atan(y/c))/G².
    fn per_flux(&self, place: Place) -> Jet {
        let spread = self.spread_jet(place);
        self.lift_jet(place) / (spread * spread)
    }

    /// 1 − (2y/πw)·atan(y/c).
    fn lift_jet(&self, place: Place) -> Jet {
        let Place { gap: c, offset: y } = place;
        let (q, square) = (FRAC_2_PI / self.pole_width, c * c + y * y);
        Jet {
            value: 1.0 - self.fraction(place),
            first: [q * y * y / square, -q * ((y / c).atan() + y * c / square)],
            second: [
                -2.0 * q * y * y * c / (square * square),
                2.0 * q * y * c * c / (square * square),
                -2.0 * q * c * c * c / (square * square),
            ],
        }
    }

    /// G with its derivatives.
    fn spread_jet(&self, place: Place) -> Jet {
        let Place { gap: c, offset: y } = place;
        let (q, square) = (FRAC_2_PI / self.pole_width, c * c + y * y);
        let ratio = y / c;
        Jet {
            value: self.spread(place),
            first: [0.5 * q * (ratio * ratio).ln_1p(), self.spread_by_offset(place)],
            second: [-q * y * y / (c * square), q * y / square, -q * c / square],
        }
    }

    /// ∂G/∂y.
    fn slope_jet(&self, place: Place) -> Jet {
        let Place { gap: c, offset: y } = place;
        let Jet { first: [_, value], second: [_, by_gap, by_offset], .. } = self.spread_jet(place);
        let square = c * c + y * y;
        let scale = FRAC_2_PI / self.pole_width / (square * square);
        let second = [-2.0 * c * y, c * c - y * y, 2.0 * c * y].map(|it| scale * it);
        Jet { value, first: [by_gap, by_offset], second }
    }

    /// F_y/F.
    pub(crate) fn lateral_share(&self, place: Place) -> Jet {
        self.gap(place) * self.slope_jet(place) / self.lift_jet(place)
    }
}

/// How a place moves: rates (m/s) and their rates (m/s²) of gap and offset.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Motion {
    pub rates: [f64; 2],
    pub bends: [f64; 2],
}

impl Jet {
    fn slopes(&self, scale: f64) -> Slopes {
        let [by_gap, by_offset] = self.first;
        Slopes { value: scale * self.value, by_gap: scale * by_gap, by_offset: scale * by_offset }
    }

    /// Value, rate and its rate along a motion.
    pub(crate) fn course(&self, motion: &Motion) -> [f64; 3] {
        let ([c, y], [cc, cy, yy]) = (self.first, self.second);
        let ([u, v], [du, dv]) = (motion.rates, motion.bends);
        let bend = c * du + y * dv + cc * u * u + 2.0 * cy * u * v + yy * v * v;
        [self.value, c * u + y * v, bend]
    }
}

/// Fraction of the lift at the same current that an offset costs, (2y/πw)·atan(y/c), for a gap c, an
/// offset y and poles of the width w (m): [`LiftLoss`]. For y ≪ c it is 2y²/(πwc), of second order, so
/// the linear law has none.
pub fn lost_lift(gap: f64, offset: f64, pole_width: f64) -> f64 {
    FRAC_2_PI / pole_width * offset * (offset / gap).atan()
}

/// Derivatives of [`lost_lift`] by gap and offset, in 1/m.
pub(crate) fn lost_lift_slopes(gap: f64, offset: f64, pole_width: f64) -> [f64; 2] {
    let [by_gap, by_offset] = LiftLoss::new(1.0, pole_width).lift_jet(Place { gap, offset }).first;
    [-by_gap, -by_offset]
}

/// Lateral force (N) on a magnet that lifts `force` (N) with lift loss, and −∂F_y/∂y at constant lift
/// (N/m): F_y = −F·(2c/πw)·atan(y/c)/(1 − (2y/πw)·atan(y/c)). NaN where the law ends.
pub fn lateral_force_with_loss(force: f64, gap: f64, offset: f64, pole_width: f64) -> [f64; 2] {
    let place = Place { gap, offset };
    let law = LiftLoss::new(1.0, pole_width);
    if offset.abs() >= law.limit() || law.fraction(place) >= 1.0 {
        return [f64::NAN; 2];
    }
    let ratio = law.lateral_share(place);
    [force * ratio.value, -force * ratio.first[1]]
}
