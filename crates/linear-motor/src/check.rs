//! Checks of a motor file.

use crate::Error;
use crate::description::{FieldDescription, ForceTable, MotorDescription};
use crate::error::invalid;

/// Bounds of lengths, m.
const LENGTHS: [f64; 2] = [1e-5, 10.0];

impl MotorDescription {
    /// Checks all values, and that the motor has one law.
    ///
    /// # Errors
    /// [`Error::Invalid`] for the first fault.
    pub fn check(&self) -> Result<(), Error> {
        if self.bodies.is_empty() {
            return Err(invalid("bodies", "name at least one body, such as `*_motor_*`"));
        }
        if self.offset.iter().any(|x| !x.is_finite() || x.abs() > LENGTHS[1]) {
            return Err(invalid("offset", "three lengths of up to 10 m are needed"));
        }
        length("pole_pitch", self.pole_pitch)?;
        // the field decays with exp(-π·gap/pitch): more is millimetres in place of metres
        within("nominal_gap", self.nominal_gap, [LENGTHS[0], self.pole_pitch], "m")?;
        within("slip_frequency", self.slip_frequency, [1e-3, 1e4], "Hz")?;
        within("max_current", self.max_current, [1e-3, 1e6], "A")?;
        within("phase_resistance", self.phase_resistance, [0.0, 1e6], "Ω")?;
        match (&self.field, &self.table) {
            (Some(field), None) => field.check(),
            (None, Some(table)) => table.check(self.slip_frequency, self.nominal_gap),
            (Some(_), Some(_)) => Err(invalid("table", "give `field` or `table`, not both")),
            (None, None) => Err(invalid("field", "the law is missing: give `field` or `table`")),
        }
    }
}

impl FieldDescription {
    fn check(&self) -> Result<(), Error> {
        if !(1..=1000).contains(&self.pole_pairs) {
            let text = format!("{} is not a number of pole pairs from 1 to 1000", self.pole_pairs);
            return Err(invalid("field.pole_pairs", text));
        }
        length("field.width", self.width)?;
        within("field.overhang", self.overhang, [0.0, LENGTHS[1]], "m")?;
        within("field.turns", self.turns, [0.1, 1e6], "turns")?;
        within("field.winding_factor", self.winding_factor, [1e-3, 1.0], "")?;
        within("field.carter_factor", self.carter_factor, [1.0, 10.0], "")?;
        within("field.sheet_thickness", self.sheet_thickness, [LENGTHS[0], 0.1], "m")?;
        within("field.sheet_resistivity", self.sheet_resistivity, [1e-10, 1e-3], "Ω·m")
    }
}

impl ForceTable {
    fn check(&self, slip: f64, gap: f64) -> Result<(), Error> {
        within("table.current", self.current, [1e-3, 1e6], "A")?;
        axis("table.slip_frequency", &self.slip_frequency)?;
        axis("table.speed", &self.speed)?;
        axis("table.gap", &self.gap)?;
        if self.speed[0] != 0.0 {
            return Err(invalid("table.speed[0]", "the speeds begin with 0"));
        }
        if self.gap[0] <= 0.0 {
            return Err(invalid("table.gap[0]", "a gap is above 0"));
        }
        for (path, rows) in [("table.thrust", &self.thrust), ("table.normal", &self.normal)] {
            self.check_rows(path, rows)?;
        }
        let covers = |axis: &[f64], value: f64| {
            axis.first().is_some_and(|first| *first <= value)
                && axis.last().is_some_and(|last| value <= *last)
        };
        for value in [-slip, slip] {
            if !covers(&self.slip_frequency, value) {
                return Err(invalid(
                    "table.slip_frequency",
                    format!(
                        "{value} Hz is not between its points, but the traction control needs it (`slip_frequency`)"
                    ),
                ));
            }
        }
        if !covers(&self.gap, gap) {
            return Err(invalid(
                "table.gap",
                format!("the nominal gap of {gap} m is not between its points"),
            ));
        }
        Ok(())
    }

    fn check_rows(&self, path: &str, rows: &[Vec<Vec<f64>>]) -> Result<(), Error> {
        let wrong = |path: String, found: usize, needed: usize, axis: &str| {
            let text = format!("{found} entries, but `{axis}` has {needed} points");
            (found != needed).then(|| invalid(path, text))
        };
        let lengths = [self.slip_frequency.len(), self.speed.len(), self.gap.len()];
        if let Some(error) = wrong(path.into(), rows.len(), lengths[0], "slip_frequency") {
            return Err(error);
        }
        for (i, row) in rows.iter().enumerate() {
            let path = format!("{path}[{i}]");
            if let Some(error) = wrong(path.clone(), row.len(), lengths[1], "speed") {
                return Err(error);
            }
            for (j, row) in row.iter().enumerate() {
                let path = format!("{path}[{j}]");
                if let Some(error) = wrong(path.clone(), row.len(), lengths[2], "gap") {
                    return Err(error);
                }
                if let Some(k) = row.iter().position(|x| !x.is_finite()) {
                    return Err(invalid(format!("{path}[{k}]"), "a force must be finite"));
                }
            }
        }
        Ok(())
    }
}

fn axis(path: &str, points: &[f64]) -> Result<(), Error> {
    if points.len() < 2 {
        return Err(invalid(path, "at least two points are needed"));
    }
    if let Some(k) = points.iter().position(|x| !x.is_finite()) {
        return Err(invalid(format!("{path}[{k}]"), "a point must be finite"));
    }
    match points.windows(2).position(|pair| pair[1] <= pair[0]) {
        None => Ok(()),
        Some(k) => Err(invalid(
            format!("{path}[{}]", k + 1),
            format!("{} is not above {}: points ascend", points[k + 1], points[k]),
        )),
    }
}

fn length(path: &str, value: f64) -> Result<(), Error> {
    within(path, value, LENGTHS, "m")
}

fn within(path: &str, value: f64, [least, most]: [f64; 2], unit: &str) -> Result<(), Error> {
    if (least..=most).contains(&value) {
        return Ok(());
    }
    let space = if unit.is_empty() { "" } else { " " };
    Err(invalid(
        path,
        format!("{value}{space}{unit} is not between {least} and {most}{space}{unit}"),
    ))
}
