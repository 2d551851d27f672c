//! Forces by the one-dimensional field theory with end effects.
//!
//! With x from the front edge of the winding to its rear, the sheet enters at x = 0, moves at v in +x and
//! leaves at x = L = 2pτ. The winding is the current sheet Re J₁ e^{j(ωt − kx)}, J₁ = 3√2·W·k_w·I/(pτ). The
//! field B across the gap and the sheet's current J₂ follow from Ampère's law around a slice of the gap and
//! from the field in the moving sheet (E its electric field as the primary sees it, A the vector potential),
//!
//! g B′/μ₀ = J₁e^{−jkx} + J₂,   J₂ = σ(E + vB),   E = −jωA,   B = −A′,
//!
//! with σ the sheet's conductance per square. So B″ − av B′ − jωa B = −jkμ₀J₁/g·e^{−jkx}, a = μ₀σ/g. Its
//! solution is the travelling wave of a long motor and two more, which entry and exit cause:
//!
//! B = B_s e^{−jkx} + C₁ e^{γ₁(x−L)} + C₂ e^{γ₂x},   γ = av/2 ± √((av/2)² + jωa),
//! B_s = jμ₀J₁/(kg)/(1 + jG),   G = μ₀σ(ω − kv)/(gk²).
//!
//! Before the entry B ~ e^{γ₁x}, behind the exit B ~ e^{γ₂x}; B and J₂ are continuous (the core reaches beyond
//! its winding). This is the theory of S. Yamamura, *Theory of Linear Induction Motors* (1979), chapters 2 and
//! 3. Thrust and normal force on the vehicle, with w the core's width:
//!
//! F = ½w Re∫J₁e^{−jkx}B* dx,   N = w/4μ₀ ∫(|B|² − μ₀²|J₂|²) dx.
//!
//! N is Maxwell's stress on the surface of the reaction plate: attraction of the irons less the repulsion of
//! the currents. It counts below the winding; F is the force on the winding.
//!
//! Two refinements. In a gap that is not short against the pole pitch the field is that of Laplace's equation:
//! with tanh(kg)/k for g and J₁/cosh(kg) for J₁ the wave of a long motor is the exact one at the sheet. And the
//! sheet's currents must turn at its sides: σ is its conductance times the factor of R. L. Russell and K. H.
//! Norsworthy, *Eddy currents and wall losses in screened-rotor induction motors*, Proc. IEE 105A (1958),
//!
//! 1 − tanh(kw/2)/(kw/2·(1 + tanh(kw/2)·tanh(kc))),   c the sheet's overhang.

use std::f64::consts::{PI, SQRT_2, TAU};

use nalgebra::Complex;

use crate::description::FieldDescription;
use crate::motor::{Feed, Forces};

type C = Complex<f64>;

/// μ₀, H/m.
const MU_0: f64 = 4e-7 * PI;
const J: C = C { re: 0.0, im: 1.0 };
const ZERO: C = C { re: 0.0, im: 0.0 };
/// Below this product of exponent and length the integral of an exponential is taken by its series: the next
/// term is below rounding.
const SHORT: f64 = 1e-5;

/// The motor by field theory.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Field {
    /// Wave number k, 1/m.
    wave: f64,
    /// Length L of the winding, m.
    length: f64,
    /// Width w, m.
    width: f64,
    /// Amplitude of the current sheet per current, 1/m.
    per_current: f64,
    /// Conductance σ of the sheet per square, with the edges' factor, S.
    sheet: f64,
    thickness: f64,
    carter: f64,
}

/// Inductance and resistance of the equivalent circuit of a long motor, for one phase.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Circuit {
    /// Magnetising inductance, H.
    pub magnetising: f64,
    /// Resistance of the reaction plate, referred to the primary, Ω. It carries the current of the branch
    /// R/s parallel to the inductance.
    pub secondary: f64,
}

/// Powers of the fundamental wave, W.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Powers {
    /// From the primary into the gap.
    pub input: f64,
    /// Of the thrust.
    pub mechanical: f64,
    /// Heat of the sheet, below the motor, before and behind it.
    pub loss: f64,
}

/// The gap as the field sees it.
#[derive(Debug, Clone, Copy)]
struct Gap {
    /// tanh(kg)/k, m.
    length: f64,
    /// J₁/cosh(kg) per current, 1/m.
    per_current: f64,
}

/// The field of an operating point.
struct Solution {
    /// J₁, A/m.
    sheet: C,
    /// Exponents −jk, γ₁, γ₂.
    exponents: [C; 3],
    /// Where each wave has its amplitude.
    origins: [f64; 3],
    /// B of the three waves, T.
    field: [C; 3],
    /// J₂ of the three waves, A/m.
    current: [C; 3],
    /// J₂ at entry and exit, A/m.
    ends: [C; 2],
}

impl Field {
    /// The motor of checked data and a pole pitch (m).
    #[must_use]
    pub fn new(data: &FieldDescription, pole_pitch: f64) -> Self {
        let wave = PI / pole_pitch;
        let pairs = f64::from(data.pole_pairs);
        let half = 0.5 * wave * data.width;
        let edge = half.tanh();
        let factor = 1.0 - edge / (half * (1.0 + edge * (wave * data.overhang).tanh()));
        Self {
            wave,
            length: 2.0 * pairs * pole_pitch,
            width: data.width,
            per_current: 3.0 * SQRT_2 * data.turns * data.winding_factor / (pairs * pole_pitch),
            sheet: factor * data.sheet_thickness / data.sheet_resistivity,
            thickness: data.sheet_thickness,
            carter: data.carter_factor,
        }
    }

    fn gap(&self, clearance: f64) -> Gap {
        let phase = self.wave * self.carter * (clearance + self.thickness);
        Gap { length: phase.tanh() / self.wave, per_current: self.per_current / phase.cosh() }
    }

    /// The equivalent circuit of a long motor at a clearance (m): thrust
    /// 3I²·k·ω_s·L²R/(R² + ω_s²L²) at the slip frequency ω_s.
    #[must_use]
    pub fn circuit(&self, clearance: f64) -> Circuit {
        let gap = self.gap(clearance);
        let magnetising = self.width * self.length * MU_0 * gap.per_current.powi(2)
            / (6.0 * self.wave.powi(2) * gap.length);
        let secondary = magnetising * gap.length * self.wave.powi(2) / (MU_0 * self.sheet);
        Circuit { magnetising, secondary }
    }

    /// Slip speed ω_s/k above which the currents' repulsion exceeds the irons' attraction in a long motor:
    /// 1/(μ₀σ), m/s.
    #[must_use]
    pub fn balance_speed(&self) -> f64 {
        1.0 / (MU_0 * self.sheet)
    }

    /// Forces at a speed (m/s) and a clearance above 0 (m).
    #[must_use]
    pub fn forces(&self, feed: Feed, speed: f64, clearance: f64) -> Forces {
        let solution = self.solve(feed, speed, clearance);
        let products = solution.products(self.length);
        let attraction = form(&solution.field, &solution.field, &products);
        let repulsion = MU_0 * MU_0 * form(&solution.current, &solution.current, &products);
        Forces {
            thrust: self.thrust(&solution, &products),
            normal: self.width / (4.0 * MU_0) * (attraction - repulsion),
        }
    }

    fn thrust(&self, solution: &Solution, products: &[[C; 3]; 3]) -> f64 {
        let winding = [solution.sheet, ZERO, ZERO];
        0.5 * self.width * form(&winding, &solution.field, products)
    }

    /// Powers at a speed (m/s) and a clearance above 0 (m). Input and loss are computed independently: input =
    /// mechanical + loss holds for the exact field only.
    #[must_use]
    pub fn powers(&self, feed: Feed, speed: f64, clearance: f64) -> Powers {
        let solution = self.solve(feed, speed, clearance);
        let products = solution.products(self.length);
        let winding = [solution.sheet, ZERO, ZERO];
        let half = 0.5 * self.width;
        let mechanical = speed * self.thrust(&solution, &products);
        let below = form(&solution.current, &solution.current, &products);
        let [entry, exit] = solution.ends;
        let [_, rising, falling] = solution.exponents;
        // ∫|J₂|² of the tails e^{γ₁x} before and e^{γ₂x} behind
        let tail = |current: C, rate: f64| {
            if current == ZERO { 0.0 } else { current.norm_sqr() / (2.0 * rate.abs()) }
        };
        Powers {
            // −½Re∫E J₁*, with E = J₂/σ − vB
            input: mechanical - half / self.sheet * form(&solution.current, &winding, &products),
            mechanical,
            loss: half / self.sheet * (below + tail(entry, rising.re) + tail(exit, falling.re)),
        }
    }

    fn solve(&self, feed: Feed, speed: f64, clearance: f64) -> Solution {
        let Self { wave: k, length, sheet, .. } = *self;
        let gap = self.gap(clearance);
        let omega = TAU * feed.frequency;
        let a = MU_0 * sheet / gap.length;
        let slip = a * (omega - k * speed) / k;
        let winding = C::from(gap.per_current * feed.current);
        let wave = J * MU_0 * winding / (k * gap.length) / (1.0 + J * slip / k);
        // the root that cancels follows from the product γ₁γ₂ = −jωa
        let middle = 0.5 * a * speed;
        let root = (C::from(middle * middle) + J * omega * a).sqrt();
        let product = -J * omega * a;
        let (rising, falling) = if middle >= 0.0 {
            let rising = root + middle;
            (rising, if rising == ZERO { ZERO } else { product / rising })
        } else {
            let falling = C::from(middle) - root;
            (product / falling, falling)
        };
        let apart = rising - falling;
        let turn = (-J * k * length).exp();
        let (behind, ahead) = if apart.norm() > 1e-9 {
            (turn * wave * (slip + falling) / apart, -wave * (slip + rising) / apart)
        } else {
            // a direct current at rest
            (turn * wave * -0.5, wave * -0.5)
        };
        let exponents = [-J * k, rising, falling];
        let field = [wave, behind, ahead];
        let to_current = gap.length / MU_0;
        let mut current = [0, 1, 2].map(|i| field[i] * exponents[i] * to_current);
        current[0] -= winding;
        let entry = wave + behind * (-rising * length).exp() + ahead;
        let exit = wave * turn + behind + ahead * (falling * length).exp();
        Solution {
            sheet: winding,
            exponents,
            origins: [0.0, length, 0.0],
            field,
            current,
            ends: [entry * rising * to_current, exit * falling * to_current],
        }
    }
}

impl Solution {
    /// ∫ e^{γᵢ(x−xᵢ)}·e^{γⱼ*(x−xⱼ)} dx over the winding.
    fn products(&self, length: f64) -> [[C; 3]; 3] {
        // the waves at both ends: at most 1, so that nothing overflows
        let at = |x: f64| -> [C; 3] {
            std::array::from_fn(|i| (self.exponents[i] * (x - self.origins[i])).exp())
        };
        let (start, end) = (at(0.0), at(length));
        std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                let rate = self.exponents[i] + self.exponents[j].conj();
                let over = rate * length;
                let first = start[i] * start[j].conj();
                if over.norm() < SHORT {
                    first * length * (1.0 + over * (0.5 + over / 6.0))
                } else {
                    (end[i] * end[j].conj() - first) / rate
                }
            })
        })
    }
}

/// Re ∫ u v* of two sums of the waves.
fn form(u: &[C; 3], v: &[C; 3], products: &[[C; 3]; 3]) -> f64 {
    let mut sum = 0.0;
    for i in 0..3 {
        for j in 0..3 {
            sum += (u[i] * v[j].conj() * products[i][j]).re;
        }
    }
    sum
}
