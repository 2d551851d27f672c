//! How far a co-simulated run is from the solution of the coupled equations.

use serde_json::{Value, json};

use super::{Instant, MonolithicSystem, Trajectory};
use crate::FinishedRun;

/// A signal that every magnet has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Air gap.
    Gap,
    /// Place to the left of the rail.
    Offset,
    /// Levitation force.
    Force,
    /// Lateral force on the magnet.
    LateralForce,
}

impl Quantity {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Gap, Self::Offset, Self::Force, Self::LateralForce];

    /// Name of the signal of magnet `k` (from 0) in the shipped scenarios.
    #[must_use]
    pub fn signal(self, k: usize) -> String {
        match self {
            Self::Gap => format!("vehicle.gap_{:02}", k + 1),
            Self::Offset => format!("vehicle.lateral_offset_{:02}", k + 1),
            Self::Force => format!("ems_{:02}.force", k + 1),
            Self::LateralForce => format!("ems_{:02}.lateral_force", k + 1),
        }
    }

    /// `record` of a scenario: all of them, of `magnets` magnets.
    #[must_use]
    pub fn recorded(magnets: usize) -> Value {
        let row =
            |quantity: Self| quantity.signal(0).replacen("01", &format!("[01..{magnets:02}]"), 1);
        json!({ "signals": Self::ALL.map(row) })
    }

    fn of(self, instant: &Instant) -> f64 {
        match self {
            Self::Gap => instant.gap,
            Self::Offset => instant.offset,
            Self::Force => instant.force,
            Self::LateralForce => instant.lateral_force,
        }
    }
}

impl MonolithicSystem {
    /// The value of magnet `k` (from 0) on a smooth, straight track.
    fn at_rest(&self, quantity: Quantity, k: usize) -> f64 {
        match quantity {
            Quantity::Gap => self.vehicle.nominal_gap(),
            Quantity::Force => self.loads[k],
            Quantity::Offset | Quantity::LateralForce => 0.0,
        }
    }

    /// RMS of a run's distance from the solution, over the RMS of the solution's deviation from rest, over
    /// all magnets and times.
    ///
    /// # Errors
    /// The run has no such signals, or not as often.
    pub fn error(
        &self,
        solution: &Trajectory,
        quantity: Quantity,
        run: &FinishedRun,
    ) -> Result<f64, String> {
        let columns = run.columns()?;
        self.relative(solution, quantity, |k| {
            let signal = quantity.signal(k);
            columns.get(&signal).cloned().ok_or_else(|| format!("{signal} is not recorded"))
        })
    }

    /// As [`MonolithicSystem::error`], between two solutions.
    ///
    /// # Errors
    /// They are of different times.
    pub fn doubt(
        &self,
        solution: &Trajectory,
        quantity: Quantity,
        other: &Trajectory,
    ) -> Result<f64, String> {
        let of = |k: usize| other.magnets.iter().map(|all| quantity.of(&all[k])).collect();
        self.relative(solution, quantity, |k| Ok(of(k)))
    }

    fn relative(
        &self,
        solution: &Trajectory,
        quantity: Quantity,
        other: impl Fn(usize) -> Result<Vec<f64>, String>,
    ) -> Result<f64, String> {
        let (mut error, mut size) = (0.0, 0.0);
        for k in 0..self.loads.len() {
            let (rest, other) = (self.at_rest(quantity, k), other(k)?);
            if other.len() != solution.time.len() {
                return Err(format!("{} times instead of {}", other.len(), solution.time.len()));
            }
            for (all, other) in solution.magnets.iter().zip(&other) {
                let value = quantity.of(&all[k]);
                error += (value - other).powi(2);
                size += (value - rest).powi(2);
            }
        }
        Ok((error / size).sqrt())
    }
}
