//! Force and coil: eqs 1 and 2 and the laws that they linearise.

use crate::parameters::{Law, MagnetParameters};

/// Permeability of free space μ₀ = 4π·10⁻⁷ H/m (table 2).
pub const MU_0: f64 = 4e-7 * std::f64::consts::PI;

/// The electromagnet's constants and its two laws.
///
/// Nonlinear, with the flux linkage λ = L(c)·i:
/// F = K·(i/c)², L(c) = 2K/c, v = R·i + d(L·i)/dt, where K = μ₀AN²/4. So F = λ²/(4K).
///
/// Linear about (i₀, c₀): F = F_s + kᵢ·Δi − k_c·Δc (eq. 1, attraction positive) and
/// dΔi/dt = (k_c/kᵢ)·dΔc/dt − (R/L₀)·Δi + Δv/L₀ (eq. 2).
///
/// In both laws the force depends only on the flux linkage λ, which follows Faraday's law λ' = v −
/// R·i: with Δλ = L₀·(Δi − (k_c/kᵢ)·Δc), eqs 1 and 2 read F = F_s + (kᵢ/L₀)·Δλ and Δλ' = Δv − R·Δi.
/// They are integrated in this form. The gap's rate cancels, so gap and gap rate need not be
/// consistent: where they are, the equations are the same; where a master extrapolates them over a
/// step with an error, the current follows the gap and no error remains.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Electromagnet {
    /// K = μ₀AN²/4, in N·m²/A².
    pub constant: f64,
    /// Resistance R, in Ω.
    pub resistance: f64,
    /// Nominal gap c₀, in m.
    pub nominal_gap: f64,
    /// Inductance L₀ = μ₀N²A/(2c₀) at the nominal gap, in H.
    pub inductance: f64,
    /// kᵢ = μ₀N²A·i₀/(2c₀²), force per current, in N/A.
    pub current_stiffness: f64,
    /// k_c = μ₀N²A·i₀²/(2c₀³), loss of force per gap, in N/m.
    pub gap_stiffness: f64,
    /// F₀ = μ₀AN²/4·(i₀/c₀)², in N: the nonlinear law's force at (i₀, c₀). The linear law uses the
    /// static force F_s instead.
    pub nominal_force: f64,
    law: Law,
}

impl Electromagnet {
    /// The constants of eqs 1 and 2 from table 2's data.
    pub fn new(parameters: &MagnetParameters) -> Self {
        let MagnetParameters {
            turns,
            pole_area,
            resistance,
            nominal_gap,
            operating_current,
            law,
            ..
        } = *parameters;
        let constant = MU_0 * pole_area * turns * turns / 4.0;
        let ratio = operating_current / nominal_gap;
        let inductance = 2.0 * constant / nominal_gap;
        let current_stiffness = inductance * ratio;
        Self {
            constant,
            resistance,
            nominal_gap,
            inductance,
            current_stiffness,
            gap_stiffness: current_stiffness * ratio,
            nominal_force: constant * ratio * ratio,
            law,
        }
    }

    /// Which law holds.
    pub fn law(&self) -> Law {
        self.law
    }

    /// Current c·√(F/K) that holds the force `force` (N) at the gap `gap` (m) by the nonlinear
    /// law, in A. NaN for a negative force: a magnet cannot push.
    pub fn equilibrium_current(&self, force: f64, gap: f64) -> f64 {
        gap * (force / self.constant).sqrt()
    }

    /// Levitation force, in N, at the gap `gap` (m), the current `operating + deviation` (A) and
    /// the static force `static_force` (N, linear law only).
    pub fn force(&self, gap: f64, operating: f64, deviation: f64, static_force: f64) -> f64 {
        match self.law {
            Law::Linear => {
                static_force + self.current_stiffness * deviation
                    - self.gap_stiffness * (gap - self.nominal_gap)
            }
            Law::Nonlinear => {
                let density = (operating + deviation) / gap;
                self.constant * density * density
            }
        }
    }

    /// Levitation force, in N, for the flux linkage λ_op + Δλ (Wb); `static_force` (N) counts in
    /// the linear law only.
    pub fn force_of_flux(&self, operating: f64, flux_deviation: f64, static_force: f64) -> f64 {
        match self.law {
            Law::Linear => static_force + self.current_stiffness / self.inductance * flux_deviation,
            Law::Nonlinear => {
                let flux = self.inductance * operating + flux_deviation;
                flux * flux / (4.0 * self.constant)
            }
        }
    }

    /// Δi, in A, for the flux linkage λ_op + Δλ (Wb) at the gap `gap` (m); λ_op = L₀·i_op is the
    /// flux linkage of the operating current `operating` (A) at the nominal gap.
    pub fn current_of_flux(&self, gap: f64, operating: f64, flux_deviation: f64) -> f64 {
        let deviation = gap - self.nominal_gap;
        match self.law {
            Law::Linear => {
                flux_deviation / self.inductance
                    + self.gap_stiffness / self.current_stiffness * deviation
            }
            Law::Nonlinear => {
                flux_deviation / self.inductance_at(gap) + operating * deviation / self.nominal_gap
            }
        }
    }

    /// Δλ, in Wb, for the current i_op + Δi (A) at the gap `gap` (m): the inverse of
    /// [`Electromagnet::current_of_flux`].
    pub fn flux_of_current(&self, gap: f64, operating: f64, deviation: f64) -> f64 {
        let opening = gap - self.nominal_gap;
        match self.law {
            Law::Linear => {
                self.inductance
                    * (deviation - self.gap_stiffness / self.current_stiffness * opening)
            }
            Law::Nonlinear => {
                self.inductance_at(gap) * (deviation - operating * opening / self.nominal_gap)
            }
        }
    }

    /// ∂i/∂c at constant flux linkage, in A/m: k_c/kᵢ, or i/c.
    pub fn current_by_gap(&self, gap: f64, current: f64) -> f64 {
        match self.law {
            Law::Linear => self.gap_stiffness / self.current_stiffness,
            Law::Nonlinear => current / gap,
        }
    }

    /// Partial derivatives of the force: (∂F/∂c in N/m, ∂F/∂i in N/A).
    pub fn force_gradient(&self, gap: f64, current: f64) -> (f64, f64) {
        match self.law {
            Law::Linear => (-self.gap_stiffness, self.current_stiffness),
            Law::Nonlinear => {
                let per_current = 2.0 * self.constant * current / (gap * gap);
                (-per_current * current / gap, per_current)
            }
        }
    }

    /// Inductance L, in H, that the voltage sees: L₀ in the linear law, 2K/c in the other.
    pub fn inductance_at(&self, gap: f64) -> f64 {
        match self.law {
            Law::Linear => self.inductance,
            Law::Nonlinear => 2.0 * self.constant / gap,
        }
    }

    /// di/dt in A/s (eq. 2, or its nonlinear form) for the total voltage `voltage` = R·i_op + Δv.
    pub fn current_rate(&self, gap: f64, gap_rate: f64, current: f64, voltage: f64) -> f64 {
        (voltage - self.resistance * current) / self.inductance_at(gap)
            + self.current_by_gap(gap, current) * gap_rate
    }
}
