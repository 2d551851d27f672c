//! FMI variables that the units `ems` and `controller` share, declared once.
//!
//! [`gains`] of eq. 3, [`filter`] of eq. 4, [`estimates`] of eq. 5: same names, units and
//! descriptions in both units.
#![forbid(unsafe_code)]

/// Gains k₁ … k₅ of eq. 3.
pub mod gains {
    use fmi2_export::{Interface, RealVar, UnitOfMeasure, Values};
    use magnet::Gains;

    /// Declares k₁ … k₅, in eq. 3's order, as tunable parameters.
    pub fn declare(interface: &mut Interface, start: &Gains) -> [RealVar; 5] {
        let mut gain = |name: &'static str, start: f64, text: &'static str| {
            interface.real(name).tunable(start).unit(UnitOfMeasure::VOLT).description(text).done()
        };
        [
            gain(
                "gain_acceleration",
                start.acceleration,
                "Gain k1 on the estimated acceleration y3",
            ),
            gain("gain_velocity", start.velocity, "Gain k2 on the estimated velocity y4"),
            gain("gain_position", start.position, "Gain k3 on the estimated position y5"),
            gain(
                "gain_gap_velocity",
                start.gap_velocity,
                "Gain k4 on the estimated gap velocity y2",
            ),
            gain("gain_gap", start.gap, "Gain k5 on the estimated gap y1"),
        ]
    }

    /// The gains now.
    pub fn read(values: &Values, gains: &[RealVar; 5]) -> Gains {
        let [acceleration, velocity, position, gap_velocity, gap] =
            gains.map(|gain| values.real(gain));
        Gains { acceleration, velocity, position, gap_velocity, gap }
    }
}

/// Design of the filter of eq. 4.
pub mod filter {
    use fmi2_export::{Interface, RealVar, UnitOfMeasure, Values};
    use magnet::FilterDesign;

    /// Declares gap cut-off and damping, velocity cut-off and damping, and position cut-off.
    pub fn declare(interface: &mut Interface, start: &FilterDesign) -> [RealVar; 5] {
        let mut design =
            |name: &'static str, start: f64, unit: UnitOfMeasure, text: &'static str| {
                interface.real(name).parameter(start).unit(unit).min(0.0).description(text).done()
            };
        let rate = UnitOfMeasure::RADIAN_PER_SECOND;
        [
            design(
                "filter_gap_cutoff",
                start.gap_cutoff,
                rate,
                "Cut-off frequency of the low-pass on the gap (eq. 4: 1000 rad/s)",
            ),
            design(
                "filter_gap_damping",
                start.gap_damping,
                UnitOfMeasure::ONE,
                "Damping ratio of the low-pass on the gap (eq. 4: 0.5)",
            ),
            design(
                "filter_velocity_cutoff",
                start.velocity_cutoff,
                rate,
                "Frequency above which the velocity is integrated from the acceleration and below \
                 which it is the gap's rate (eq. 4: 10 rad/s)",
            ),
            design(
                "filter_velocity_damping",
                start.velocity_damping,
                UnitOfMeasure::ONE,
                "Damping ratio of the velocity filter (eq. 4: 0.5)",
            ),
            design(
                "filter_position_cutoff",
                start.position_cutoff,
                rate,
                "Frequency above which the position is integrated from the velocity and below \
                 which it is the gap (eq. 4: 10 rad/s)",
            ),
        ]
    }

    /// The design now.
    pub fn read(values: &Values, filter: &[RealVar; 5]) -> FilterDesign {
        let [gap_cutoff, gap_damping, velocity_cutoff, velocity_damping, position_cutoff] =
            filter.map(|variable| values.real(variable));
        FilterDesign { gap_cutoff, gap_damping, velocity_cutoff, velocity_damping, position_cutoff }
    }
}

/// Estimates y₁ … y₅ of eq. 5.
pub mod estimates {
    use fmi2_export::{Interface, RealVar, UnitOfMeasure};

    /// Declares the scaled estimates in eq. 5's order, each with its first derivative.
    pub fn declare(interface: &mut Interface) -> [RealVar; 5] {
        let mut estimate = |name: &'static str, text: &'static str| {
            let output = interface.real(name).output().derivatives(1);
            output.unit(UnitOfMeasure::ONE).nominal(0.1).description(text).done()
        };
        [
            estimate("estimate_gap", "Estimate y1 of eq. 5: 250/m times the gap's deviation"),
            estimate("estimate_gap_velocity", "Estimate y2 of eq. 5: 2.5 s/m times the gap's rate"),
            estimate(
                "estimate_acceleration",
                "Estimate y3 of eq. 5: 0.25 s2/m times the magnet's acceleration, positive downward",
            ),
            estimate(
                "estimate_velocity",
                "Estimate y4 of eq. 5: 2.5 s/m times the magnet's velocity, positive downward",
            ),
            estimate(
                "estimate_position",
                "Estimate y5 of eq. 5: 250/m times the magnet's position, positive downward",
            ),
        ]
    }
}
