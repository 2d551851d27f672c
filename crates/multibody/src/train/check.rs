//! Checks of a train's numbers before its bodies are made.

use super::description::{FlexibleBody, TrainDescription};
use crate::check::check_sizes;
use crate::error::{Error, invalid};
use crate::numbers::{finite, not_negative};

/// Key of a vehicle file under which a train stands.
pub(crate) const KEY: &str = "train";

fn at(key: &str) -> String {
    format!("{KEY}.{key}")
}

fn count(value: usize, most: usize, key: &str, what: &str) -> Result<(), Error> {
    if (1..=most).contains(&value) {
        return Ok(());
    }
    Err(invalid(at(key), format!("a train has 1 to {most} {what}, not {value}")))
}

fn positive(value: f64, key: &str, unit: &str) -> Result<(), Error> {
    if value.is_finite() && value > 0.0 {
        return Ok(());
    }
    Err(invalid(at(key), format!("must be positive, but is {value} {unit}")))
}

impl TrainDescription {
    /// Checks all numbers.
    ///
    /// # Errors
    /// [`Error::Invalid`] with the JSON path of the first fault in a vehicle file.
    pub fn check(&self) -> Result<(), Error> {
        count(self.cars, 100, "cars", "cars")?;
        count(self.bogies_per_car, 20, "bogies_per_car", "bogies per car")?;
        count(self.magnets_per_side, 20, "magnets_per_side", "magnets on each side of a bogie")?;
        let springs = self.air_springs_per_corner;
        count(springs, 8, "air_springs_per_corner", "air springs at each corner of a bogie")?;
        not_negative(&[self.gravity], &at("gravity"))?;
        positive(self.nominal_gap, "nominal_gap", "m")?;
        self.check_dimensions()?;
        self.check_masses()?;
        self.check_elements()?;
        self.flexible_body.as_ref().map_or(Ok(()), check_flexible)?;
        let bogies = self.cars * self.bogies_per_car;
        check_sizes(self.body_count(), 2 * bogies * self.magnets_per_side, KEY)
    }

    /// Number of bodies: the track, car bodies, equipment, tables, bogies, coupler links.
    fn body_count(&self) -> usize {
        let segments = self.flexible_body.as_ref().map_or(1, |body| body.segments + 1);
        let car = segments
            + self.bogies_per_car
            + 2 * (self.bogies_per_car + 1)
            + 8 * self.bogies_per_car;
        1 + self.cars * car + 10 * (self.cars - 1)
    }

    fn check_dimensions(&self) -> Result<(), Error> {
        let d = &self.dimensions;
        for (value, key) in [
            (self.car_length(), "car_length"),
            (d.car_gap, "car_gap"),
            (d.car_width, "car_width"),
            (d.car_height, "car_height"),
            (d.bogie_pitch, "bogie_pitch"),
            (d.half_gauge, "half_gauge"),
            (d.side_frame_length, "side_frame_length"),
            (d.magnet_pitch, "magnet_pitch"),
            (self.air_spring_offset(), "air_spring_offset"),
            (d.air_spring_pitch, "air_spring_pitch"),
            (d.beam_offset, "beam_offset"),
        ] {
            positive(value, &format!("dimensions.{key}"), "m")?;
        }
        for (value, key) in [
            (d.car_centre_height, "car_centre_height"),
            (d.floor_height, "floor_height"),
            (d.magnet_height, "magnet_height"),
            (d.table_height, "table_height"),
        ] {
            finite(&[value], &at(&format!("dimensions.{key}")))?;
        }
        if self.beam_half_span() <= 0.0 {
            let message = format!(
                "the anti-roll beams, which end 0.2 m inside the side frames, have no length left with {} m",
                d.half_gauge
            );
            return Err(invalid(at("dimensions.half_gauge"), message));
        }
        Ok(())
    }

    fn check_masses(&self) -> Result<(), Error> {
        let all = self.masses.numbers();
        all.iter().try_for_each(|(key, value)| positive(*value, &format!("masses.{key}"), "kg"))
    }

    fn check_elements(&self) -> Result<(), Error> {
        for (key, numbers) in [
            ("air_spring", self.air_spring.numbers()),
            ("traction_rod", self.traction_rod.numbers()),
            ("anti_roll_end", self.anti_roll_end.numbers()),
            ("table_centring", self.table_centring.numbers()),
            ("coupler_hinge", self.coupler_hinge.numbers()),
            ("drive", self.drive.numbers()),
        ] {
            for (name, value) in numbers {
                not_negative(&[value], &at(&format!("{key}.{name}")))?;
            }
        }
        positive(self.air_spring.vertical_stiffness, "air_spring.vertical_stiffness", "N/m")
    }
}

fn check_flexible(body: &FlexibleBody) -> Result<(), Error> {
    for (value, key) in [
        (body.bending_frequency, "bending_frequency"),
        (body.lateral_bending_frequency.unwrap_or(1.0), "lateral_bending_frequency"),
        (body.torsion_frequency, "torsion_frequency"),
    ] {
        positive(value, &format!("flexible_body.{key}"), "Hz")?;
    }
    if !(0.0..=1.0).contains(&body.damping) {
        let message = format!("a damping ratio is between 0 and 1, but this is {}", body.damping);
        return Err(invalid(at("flexible_body.damping"), message));
    }
    if !(2..=20).contains(&body.segments) || !body.segments.is_multiple_of(2) {
        let message = format!(
            "must be an even number from 2 to 20, so that one segment is the middle, but is {}",
            body.segments
        );
        return Err(invalid(at("flexible_body.segments"), message));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn invariant_bodies_are_counted_before_they_are_made() {
        let flexible = FlexibleBody {
            bending_frequency: 9.0,
            lateral_bending_frequency: None,
            torsion_frequency: 12.0,
            damping: 0.02,
            segments: 6,
        };
        for (cars, bogies_per_car, flexible_body) in
            [(1, 1, None), (3, 4, None), (2, 3, Some(flexible))]
        {
            let train = TrainDescription {
                cars,
                bogies_per_car,
                flexible_body,
                ..TrainDescription::default()
            };
            assert_eq!(train.body_count(), train.expand().unwrap().bodies.len());
        }
    }
}
