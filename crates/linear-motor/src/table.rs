//! Forces by a table: linear between points in each of its three axes.

use crate::Error;
use crate::description::ForceTable;
use crate::motor::Forces;

/// The interval of an axis that holds a value, and the fraction of it that lies below the value.
struct Place {
    index: usize,
    fraction: f64,
}

fn place(
    axis: &[f64],
    value: f64,
    quantity: &'static str,
    unit: &'static str,
) -> Result<Place, Error> {
    let [from, .., to] = axis else {
        return Err(Error::Outside { quantity, unit, value, from: f64::NAN, to: f64::NAN });
    };
    // also refuses NaN
    if !(*from..=*to).contains(&value) {
        return Err(Error::Outside { quantity, unit, value, from: *from, to: *to });
    }
    let index = axis.partition_point(|point| *point <= value).clamp(1, axis.len() - 1) - 1;
    let (a, b) = (axis[index], axis[index + 1]);
    Ok(Place { index, fraction: (value - a) / (b - a) })
}

impl ForceTable {
    /// Forces at a current, slip frequency, speed and gap. Running backwards is the mirror image of running
    /// forwards: with slip and speed reversed, the thrust is reversed and the normal force the same.
    pub(crate) fn forces(
        &self,
        current: f64,
        slip: f64,
        speed: f64,
        gap: f64,
    ) -> Result<Forces, Error> {
        let sign = if speed < 0.0 { -1.0 } else { 1.0 };
        let places = [
            place(&self.slip_frequency, sign * slip, "slip frequency", "Hz")?,
            place(&self.speed, sign * speed, "speed", "m/s")?,
            place(&self.gap, gap, "gap", "m")?,
        ];
        let scale = (current / self.current).powi(2);
        Ok(Forces {
            thrust: sign * scale * between(&self.thrust, &places),
            normal: scale * between(&self.normal, &places),
        })
    }
}

fn between(rows: &[Vec<Vec<f64>>], [slip, speed, gap]: &[Place; 3]) -> f64 {
    let mix = |a: f64, b: f64, place: &Place| a + place.fraction * (b - a);
    let along = |i: usize, j: usize| {
        let row = &rows[slip.index + i][speed.index + j];
        mix(row[gap.index], row[gap.index + 1], gap)
    };
    let across = |i: usize| mix(along(i, 0), along(i, 1), speed);
    mix(across(0), across(1), slip)
}
