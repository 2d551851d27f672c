//! Where a train's parts are.

use super::description::TrainDescription;

pub(super) const SIDES: [(&str, f64); 2] = [("left", 1.0), ("right", -1.0)];
pub(super) const X: [f64; 3] = [1.0, 0.0, 0.0];
pub(super) const Y: [f64; 3] = [0.0, 1.0, 0.0];
pub(super) const Z: [f64; 3] = [0.0, 0.0, 1.0];
/// Links of one of the two chains of a coupler.
pub(super) const LINKS: usize = 5;
/// How far inside the side frames the anti-roll beams end, m.
const BEAM_INSET: f64 = 0.2;
/// How much the anti-roll beams slant in plan.
const BEAM_SLANT_DEGREES: f64 = 8.0;

impl TrainDescription {
    /// Length of a car body, m.
    #[must_use]
    pub fn car_length(&self) -> f64 {
        let dimensions = &self.dimensions;
        dimensions.car_length.unwrap_or(self.bogies_per_car as f64 * dimensions.bogie_pitch)
    }

    /// Distance between the centres of neighbouring cars, m.
    #[must_use]
    pub fn car_pitch(&self) -> f64 {
        self.car_length() + self.dimensions.car_gap
    }

    /// Distance of the air springs from a bogie's centre, m.
    #[must_use]
    pub fn air_spring_offset(&self) -> f64 {
        let dimensions = &self.dimensions;
        dimensions.air_spring_offset.unwrap_or(0.5 * dimensions.bogie_pitch - 0.2)
    }

    /// Half length of an anti-roll beam in y, m.
    pub(super) fn beam_half_span(&self) -> f64 {
        self.dimensions.half_gauge - BEAM_INSET
    }

    /// Displacement in x of a beam's end by its slant, m.
    pub(super) fn beam_slant(&self) -> f64 {
        self.beam_half_span() * BEAM_SLANT_DEGREES.to_radians().tan()
    }

    /// Place of car c (from 0, front first): x = 0 is the middle of the train.
    pub(super) fn car_centre(&self, c: usize) -> f64 {
        (0.5 * (self.cars as f64 - 1.0) - c as f64) * self.car_pitch()
    }

    /// Place of bogie b (from 0, front first) from its car's centre.
    pub(super) fn bogie_offset(&self, b: usize) -> f64 {
        self.dimensions.bogie_pitch * (0.5 * (self.bogies_per_car as f64 - 1.0) - b as f64)
    }

    /// Place of the pair of tables k from its car's centre: before, between and behind the bogies.
    pub(super) fn station_offset(&self, k: usize) -> f64 {
        self.dimensions.bogie_pitch * (0.5 * self.bogies_per_car as f64 - k as f64)
    }

    /// Place of magnet k of a side frame from the bogie's centre.
    pub(super) fn magnet_offset(&self, k: usize) -> f64 {
        self.dimensions.magnet_pitch * (0.5 * (self.magnets_per_side as f64 - 1.0) - k as f64)
    }

    /// Places of the corners' air springs from the bogie's centre, front first.
    pub(super) fn corners(&self) -> [f64; 2] {
        [self.air_spring_offset(), -self.air_spring_offset()]
    }

    /// Places of the air springs of one corner from the corner, front first.
    pub(super) fn corner_springs(&self) -> impl Iterator<Item = f64> + use<> {
        let (count, pitch) = (self.air_springs_per_corner, self.dimensions.air_spring_pitch);
        (0..count).map(move |k| pitch * (0.5 * (count as f64 - 1.0) - k as f64))
    }
}
