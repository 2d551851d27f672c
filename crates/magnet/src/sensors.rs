//! What the controller measures: gap and acceleration with noise, bias, resolution and failures.

use serde::{Deserialize, Serialize};

use crate::{
    Error,
    noise::{Knots, Noise},
    parameters::{finite, positive},
};

/// Both sensors of a magnet. The coil always sees the true gap.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Sensors {
    /// Gap, in m.
    pub gap: Sensor,
    /// Acceleration, in m/s².
    pub acceleration: Sensor,
}

/// One sensor: reading = true value + bias + noise, rounded to the resolution.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Sensor {
    /// Constant error.
    pub bias: f64,
    /// Noise.
    pub noise: Noise,
    /// Resolution q. If positive, the sensor is read at the controller's samples: its reading is
    /// rounded to a multiple of q and kept until the next sample. Needs a sampled controller.
    pub resolution: f64,
    /// Its failure.
    pub failure: SensorFailure,
}

/// Failure of a sensor.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SensorFailure {
    /// Whether the sensor has failed, whatever the time.
    pub failed: bool,
    /// Time from which on it has failed, in s.
    pub time: Option<f64>,
    /// What a failed sensor reads.
    pub reading: FailedReading,
}

/// What a failed sensor reads.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum FailedReading {
    /// The value at the instant of the failure.
    Last,
    /// This value: zero, or the end of the range of an open circuit.
    Value(f64),
}

/// What of the sensors changes while stepping.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Readings {
    /// Readings of failed sensors, of gap (m) and acceleration (m/s²).
    pub(crate) failed: [Option<f64>; 2],
    /// Rounded readings of the last sample.
    pub(crate) sampled: [f64; 2],
}

impl Readings {
    /// Readings of gap and acceleration at the start, without noise.
    pub(crate) fn first(&self) -> [f64; 2] {
        std::array::from_fn(|k| self.failed[k].unwrap_or(self.sampled[k]))
    }
}

/// Caches of both sensors' noise.
#[derive(Debug, Clone, Default)]
pub(crate) struct SensorKnots([Knots; 2]);

/// Names of the quantities in messages.
const GAP: [&str; 5] = [
    "noise of the gap sensor (m)",
    "bandwidth of the gap sensor's noise (Hz)",
    "bias of the gap sensor (m)",
    "resolution of the gap sensor (m)",
    "reading of the failed gap sensor (m)",
];
const ACCELERATION: [&str; 5] = [
    "noise of the acceleration sensor (m/s²)",
    "bandwidth of the acceleration sensor's noise (Hz)",
    "bias of the acceleration sensor (m/s²)",
    "resolution of the acceleration sensor (m/s²)",
    "reading of the failed acceleration sensor (m/s²)",
];

impl Sensors {
    pub(crate) fn check(&self, sampled: bool) -> Result<(), Error> {
        self.gap.check(&GAP, sampled)?;
        self.acceleration.check(&ACCELERATION, sampled)
    }

    /// Whether an integration in steps of `step` (s) resolves the noise. A sensor with a resolution
    /// is read at samples only, where any noise has its value.
    pub(crate) fn check_step(&self, step: f64) -> Result<(), Error> {
        for (sensor, [_, bandwidth, ..]) in self.both().into_iter().zip([GAP, ACCELERATION]) {
            if sensor.is_analog() {
                sensor.noise.check_step(bandwidth, step)?;
            }
        }
        Ok(())
    }

    pub(crate) fn both(&self) -> [&Sensor; 2] {
        [&self.gap, &self.acceleration]
    }

    /// Instants of failures, in s.
    pub(crate) fn instants(&self) -> [Option<f64>; 2] {
        self.both().map(|sensor| sensor.failure.time)
    }

    /// Readings of gap (m) and acceleration (m/s²) with their rates, for the true `values` and
    /// `rates` at `time` (s).
    pub(crate) fn read(
        &self,
        memory: &Readings,
        time: f64,
        values: [f64; 2],
        rates: [f64; 2],
        knots: &SensorKnots,
    ) -> [[f64; 2]; 2] {
        let sensors = self.both();
        std::array::from_fn(|k| {
            if let Some(constant) = memory.failed[k] {
                return [constant, 0.0];
            }
            if sensors[k].resolution > 0.0 {
                return [memory.sampled[k], 0.0];
            }
            sensors[k].analog(time, values[k], rates[k], &knots.0[k])
        })
    }

    /// Takes the readings of a sample.
    pub(crate) fn sample(
        &self,
        memory: &mut Readings,
        time: f64,
        values: [f64; 2],
        knots: &SensorKnots,
    ) {
        for (k, sensor) in self.both().into_iter().enumerate() {
            if sensor.resolution > 0.0 {
                let [value, _] = sensor.analog(time, values[k], 0.0, &knots.0[k]);
                memory.sampled[k] = sensor.round(value);
            }
        }
    }

    /// Starts with readings without noise.
    pub(crate) fn start(&self, time: f64, values: [f64; 2]) -> Readings {
        let mut memory = Readings::default();
        for (k, sensor) in self.both().into_iter().enumerate() {
            memory.sampled[k] = sensor.round(values[k] + sensor.bias);
            memory.failed[k] = sensor.failure.at(time).map(|it| it.or(memory.sampled[k]));
        }
        memory
    }

    /// Sensors fail, or work again. `values` are the true ones.
    pub(crate) fn switch(
        &self,
        memory: &mut Readings,
        time: f64,
        values: [f64; 2],
        knots: &SensorKnots,
    ) {
        for (k, sensor) in self.both().into_iter().enumerate() {
            memory.failed[k] = sensor.failure.at(time).map(|reading| {
                // of a sensor that has failed before, the same again
                let [last, _] = self.read(memory, time, values, [0.0; 2], knots)[k];
                reading.or(last)
            });
        }
    }
}

impl Sensor {
    fn check(&self, names: &[&'static str; 5], sampled: bool) -> Result<(), Error> {
        let [noise, bandwidth, bias, resolution, reading] = *names;
        self.noise.check(noise, bandwidth)?;
        finite(bias, self.bias)?;
        if let FailedReading::Value(value) = self.failure.reading {
            finite(reading, value)?;
        }
        if self.resolution == 0.0 {
            return Ok(());
        }
        positive(resolution, self.resolution)?;
        if sampled {
            return Ok(());
        }
        Err(Error::Needs {
            name: resolution,
            value: self.resolution,
            needs: "a sampled controller, at whose samples readings are rounded: set sample_time \
                    to the interval of the converter",
        })
    }

    fn analog(&self, time: f64, value: f64, rate: f64, knots: &Knots) -> [f64; 2] {
        let [noise, noise_rate] = self.noise.at(time, knots);
        [value + self.bias + noise, rate + noise_rate]
    }

    fn round(&self, value: f64) -> f64 {
        if self.resolution > 0.0 {
            (value / self.resolution).round() * self.resolution
        } else {
            value
        }
    }

    /// Whether its reading follows the true value between samples.
    pub(crate) fn is_analog(&self) -> bool {
        self.resolution == 0.0
    }
}

impl SensorFailure {
    /// What the sensor reads if it has failed at `time` (s).
    fn at(&self, time: f64) -> Option<FailedReading> {
        let failed = self.failed || self.time.is_some_and(|begin| time >= begin);
        failed.then_some(self.reading)
    }
}

impl FailedReading {
    fn or(self, last: f64) -> f64 {
        match self {
            Self::Last => last,
            Self::Value(value) => value,
        }
    }
}
