//! Checks that the types of a scenario cannot express: ranges and multiples.

use std::path::Path;
use std::time::Duration;

use crate::events::Span;
use crate::{InstanceSettings, Recorded, Scenario, ScenarioError};

impl Scenario {
    /// Checks that values are within their ranges, and that intervals are whole numbers of steps.
    ///
    /// # Errors
    /// The first value that is not.
    pub fn check(&self) -> Result<(), ScenarioError> {
        let range = |what: &str, value: String, range| ScenarioError::Range {
            what: what.to_owned(),
            value,
            range,
        };
        self.experiment.steps()?;
        for entry in 0..self.record.signals.len().max(1) {
            self.stride(entry)?;
        }
        let mut tolerances = vec![("experiment.tolerance".to_owned(), self.experiment.tolerance)];
        for (name, instance) in &self.instances {
            if instance.steps == 0 {
                let what = format!("instances.{name}.steps");
                return Err(range(&what, "0".to_owned(), "a whole number from 1"));
            }
            self.check_every(name, instance)?;
            let tolerance = instance.tolerance;
            tolerances.push((format!("instances.{name}.tolerance"), tolerance));
        }
        for (name, instance) in &self.instances {
            if let Some(order) = instance.input_derivatives.filter(|order| *order > 3) {
                let what = format!("instances.{name}.input_derivatives");
                return Err(range(&what, order.to_string(), "from 0 to 3"));
            }
        }
        if self.record.format.is_empty() {
            return Err(range("record.format", "empty".to_owned(), "csv, parquet or both"));
        }
        let positive = "a positive number";
        for (what, value) in tolerances {
            if let Some(value) = value.filter(|&value| !(value > 0.0 && value.is_finite())) {
                return Err(range(&what, value.to_string(), positive));
            }
        }
        for (what, value) in [
            ("checkpoint.every", self.checkpoint.map(|it| it.every)),
            ("real_time", self.real_time),
            ("accuracy_over", self.accuracy_over),
        ] {
            if let Some(value) = value.filter(|&value| !(value > 0.0 && value.is_finite())) {
                return Err(range(what, value.to_string(), positive));
            }
        }
        if let Some(value) = self.accuracy.filter(|&value| !(value > 0.0 && value < 1.0)) {
            return Err(range("accuracy", value.to_string(), "between 0 and 1, both exclusive"));
        }
        if self.accuracy_over.is_some() && self.accuracy.is_none() {
            return Err(range("accuracy_over", "set".to_owned(), "only together with accuracy"));
        }
        if let Some((what, value, allowed)) = self.algorithm.out_of_range() {
            return Err(range(what, value, allowed));
        }
        for (k, connection) in self.connections.iter().enumerate() {
            if let Some(degree) = connection.extrapolation.filter(|degree| *degree > 3) {
                let what = format!("connections[{k}].extrapolation");
                return Err(range(&what, degree.to_string(), "from 0 to 3"));
            }
            if connection.from.terms().next().is_none() {
                let what = format!("connections[{k}].from");
                return Err(range(&what, "empty".to_owned(), "a list of at least one source"));
            }
            let factors = connection.from.terms().map(|term| term.1);
            let numbers = factors.chain(connection.factor).chain(connection.offset);
            if let Some(number) = numbers.into_iter().find(|number| !number.is_finite()) {
                let what = format!("connections[{k}]: factor or offset");
                return Err(range(&what, number.to_string(), "a finite number"));
            }
        }
        self.check_story()?;
        let tolerance = self.initialization.tolerance;
        if !(tolerance > 0.0 && tolerance < 1.0) {
            let value = tolerance.to_string();
            return Err(range(
                "initialization.tolerance",
                value,
                "between 0 and 1, both exclusive",
            ));
        }
        let limits = [
            ("isolation.step_timeout", self.isolation.step_timeout),
            ("isolation.call_timeout", self.isolation.call_timeout),
        ];
        for (what, limit) in limits {
            if let Some(limit) = limit
                && !Duration::try_from_secs_f64(limit).is_ok_and(|it| !it.is_zero())
            {
                return Err(range(what, limit.to_string(), "a positive number of seconds"));
            }
        }
        for (k, plot) in self.plots.iter().enumerate() {
            let name = Path::new(&plot.file);
            let plain = name.file_name().is_some_and(|only| only == name.as_os_str());
            if !plain || name.extension().is_none_or(|end| end != "svg") {
                let what = format!("plots[{k}].file");
                return Err(range(
                    &what,
                    plot.file.clone(),
                    "a file name without a folder that ends in .svg",
                ));
            }
            for (j, panel) in plot.panels.iter().enumerate() {
                if !panel.scale.is_finite() || panel.scale == 0.0 {
                    let what = format!("plots[{k}].panels[{j}].scale");
                    let value = panel.scale.to_string();
                    return Err(range(&what, value, "a finite number other than 0"));
                }
            }
        }
        for (k, point) in self.ride_quality.iter().enumerate() {
            if let Some((what, value, allowed)) = point.out_of_range() {
                return Err(range(&format!("ride_quality[{k}].{what}"), value, allowed));
            }
        }
        self.check_metrics()
    }

    /// Checks inputs over time, events and stop conditions.
    fn check_story(&self) -> Result<(), ScenarioError> {
        let span = Span::of(&self.experiment);
        let numbered = |list: &str, k: usize| format!("{list}[{k}]");
        let inputs = self.inputs.iter().enumerate();
        let inputs = inputs.map(|(k, it)| (numbered("inputs", k), it.out_of_range()));
        let events = self.events.iter().enumerate();
        let events = events.map(|(k, it)| (numbered("events", k), it.out_of_range(span)));
        let stops = self.stop_when.iter().enumerate();
        let stops = stops.map(|(k, it)| (numbered("stop_when", k), it.out_of_range(span)));
        for (place, fault) in inputs.chain(events).chain(stops) {
            if let Some((key, value, range)) = fault {
                return Err(ScenarioError::Range { what: format!("{place}.{key}"), value, range });
            }
        }
        Ok(())
    }

    /// Checks that a run is a whole number of the steps of an instance with `every`.
    fn check_every(&self, name: &str, instance: &InstanceSettings) -> Result<(), ScenarioError> {
        let InstanceSettings { every, steps, .. } = *instance;
        let refuse =
            |why: String| Err(ScenarioError::Every { instance: name.to_owned(), every, why });
        let count = self.experiment.steps()?;
        match every {
            0 => refuse("it must be at least 1".to_owned()),
            1 => Ok(()),
            _ if steps > 1 => refuse(format!("\"steps\" is {steps}, but one of the two must be 1")),
            _ if self.algorithm.variable.is_some() => {
                refuse("it needs equal steps, but algorithm.variable varies them".to_owned())
            }
            _ if !count.is_multiple_of(every.into()) => refuse(format!(
                "the {count} communication steps of the run are not a multiple of it"
            )),
            _ => Ok(()),
        }
    }

    /// Number of steps between two recorded values of the signals in an entry of `record.signals`.
    ///
    /// # Errors
    /// The interval is not a multiple of the step.
    pub fn stride(&self, entry: usize) -> Result<u64, ScenarioError> {
        let step = self.experiment.step;
        let (place, interval) = match self.record.signals.get(entry) {
            Some(Recorded::Group(group)) => {
                (format!("record.signals[{entry}].interval"), group.interval)
            }
            _ => match self.record.interval {
                Some(interval) => ("record.interval".to_owned(), interval),
                None => return Ok(1),
            },
        };
        let count = (interval / step).round();
        let fits =
            (1.0..9e15).contains(&count) && (count * step - interval).abs() <= 1e-9 * interval;
        if !fits {
            return Err(ScenarioError::Interval { place, interval, step });
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "1 to 9e15")]
        Ok(count as u64)
    }

    /// Number of steps between two checkpoints, if there are any.
    #[must_use]
    pub fn checkpoint_stride(&self) -> Option<u64> {
        let count = (self.checkpoint?.every / self.experiment.step).round().clamp(1.0, 9e15);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "1 to 9e15")]
        Some(count as u64)
    }
}
