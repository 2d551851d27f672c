//! A communication step of an instance.

use crate::instance::ExportedInstance;
use crate::model::Step;
use crate::state::InstanceMode;
use crate::{Error, ErrorKind};

/// Tolerance between a communication point and the end of the last step: rounding of an importer
/// that accumulates steps, negligible compared with the step.
fn slack(time: f64, size: f64) -> f64 {
    (1e-6 * size).max(8.0 * f64::EPSILON * time.abs())
}

impl ExportedInstance {
    pub(crate) fn do_step(&mut self, time: f64, size: f64) -> Result<(), Error> {
        let slack = slack(time, size);
        let end = time + size;
        let past_stop = self.progress.stop.is_some_and(|stop| end > stop + slack);
        let expected = (time - self.progress.time).abs() <= slack;
        // NaN fails every one of these comparisons.
        let sound = size > 0.0 && end > time && end.is_finite() && expected;
        if !sound || past_stop {
            return Err(self.wrong_step(time, size));
        }
        self.advance(Step { time, size }).map_err(|error| {
            if error.kind() == ErrorKind::Terminated {
                self.progress.ended = true;
                self.progress.mode = InstanceMode::StepFailed;
                return error;
            }
            if error.kind() != ErrorKind::Discard {
                self.progress.mode = InstanceMode::Error;
                return error;
            }
            if self.progress.time == end {
                // The step is complete but its outputs are not, so the step cannot be undone.
                self.progress.mode = InstanceMode::Error;
                return Error::invalid(error);
            }
            self.progress.mode = InstanceMode::StepFailed;
            error
        })
    }

    fn advance(&mut self, step: Step) -> Result<(), Error> {
        self.tell_parameters()?;
        let stepped = self.model.step(&mut self.values, step);
        self.take_messages();
        stepped?;
        self.progress.time = step.end();
        if self.progress.derivatives_set {
            self.extrapolate_inputs(step.size);
        }
        self.model.outputs(&mut self.values, step.end())?;
        self.check_finite()?;
        self.progress.outputs_stale = false;
        Ok(())
    }

    /// Sets each input to the end of its polynomial and forgets the derivatives.
    fn extrapolate_inputs(&mut self, h: f64) {
        let inputs = self.table.real_inputs.iter();
        for (&reference, taylor) in inputs.zip(&mut self.values.taylor) {
            let [u, first, second, third] = *taylor;
            let end = u + h * (first + h / 2.0 * (second + h / 3.0 * third));
            self.values.arrays.reals[reference as usize] = end;
            *taylor = [end, 0.0, 0.0, 0.0];
        }
        if std::mem::take(&mut self.values.has_further) {
            let inputs = self.table.real_inputs.iter().zip(&mut self.values.further);
            for ((&reference, further), taylor) in inputs.zip(&mut self.values.taylor) {
                let [fourth, fifth] = std::mem::take(further);
                taylor[0] += h * h * h * h / 24.0 * (fourth + h / 5.0 * fifth);
                self.values.arrays.reals[reference as usize] = taylor[0];
            }
        }
        self.progress.derivatives_set = false;
    }

    #[cold]
    fn wrong_step(&self, time: f64, size: f64) -> Error {
        let now = self.progress.time;
        let expected = (time - now).abs() <= slack(time, size);
        let moves = time + size > time;
        let text = if size <= 0.0 || !size.is_finite() {
            format!("communication step size {size} s is not greater than 0")
        } else if !expected {
            format!(
                "communication point {time} s is not the time of the instance, t = {now} s; \
                 steps must be consecutive, unless a saved state is set first"
            )
        } else if !moves {
            format!("communication step size {size} s vanishes by rounding at t = {time} s")
        } else {
            let stop = self.progress.stop.unwrap_or(f64::INFINITY);
            format!("the step from {time} s by {size} s ends after the stop time {stop} s")
        };
        Error::invalid(text)
    }
}
