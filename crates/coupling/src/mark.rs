//! A communication point to which all units can return.

use super::control::{Control, ControlMark};
use super::exchange::{Exchange, ExchangeState};
use super::power::PowerMeter;
use super::unit::{MARK, Unit};
use results::summary::PowerReport;

/// A communication point: states of the units, signals between them, step control, and energy so far. What algorithms
/// remember to converge faster is not part of it.
#[derive(Default)]
pub struct Mark {
    exchange: ExchangeState,
    control: Option<ControlMark>,
    power: PowerReport,
}

impl Mark {
    /// Marks the present point. All units must be able to save their states.
    ///
    /// # Errors
    /// A unit fails.
    pub fn set<U: Unit>(
        &mut self,
        exchange: &Exchange,
        control: Option<&Control>,
        power: &PowerMeter,
        units: &mut [U],
    ) -> Result<(), U::Error> {
        for unit in units {
            unit.save(MARK)?;
        }
        self.exchange.clone_from(exchange.state());
        self.control = control.map(Control::mark);
        self.power = power.mark();
        Ok(())
    }

    /// Returns to the point that was last marked.
    ///
    /// # Errors
    /// A unit fails.
    pub fn restore<U: Unit>(
        &self,
        exchange: &mut Exchange,
        control: Option<&mut Control>,
        power: &mut PowerMeter,
        units: &mut [U],
    ) -> Result<(), U::Error> {
        for unit in units {
            unit.restore(MARK)?;
        }
        // it fits: it is a state of this exchange
        let _ = exchange.restore(&self.exchange);
        if let (Some(control), Some(mark)) = (control, self.control) {
            control.return_to(mark);
        }
        power.return_to(self.power);
        Ok(())
    }
}
