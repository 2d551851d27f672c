//! Spectra of what disturbs the controllers: noise of sensors and irregularity of the track.

use std::f64::consts::{PI, TAU};

use faer::prelude::c64;
use fmi2_import::description::Value;
use linear::{LinearSystem, Port};
use maps::Twin;
use master::Setup;

use crate::error::TuneError;
use crate::file::{Irregularity, SensorNoise};

/// f_b·Δ of the noise of the unit `ems`, where sinc⁸(f·Δ) is one half.
const HALF_POWER: f64 = 0.227_512;
/// ∫ sinc⁸(u) du over all u.
const AREA: f64 = 151.0 / 315.0;

/// sin(πu)/(πu).
fn sinc(u: f64) -> f64 {
    let x = PI * u;
    if x.abs() < 1e-8 { 1.0 } else { x.sin() / x }
}

/// One-sided density of a sensor's noise (its unit squared per Hz): S₀·sinc⁸(f·Δ) with Δ = 0.2275/f_b, and the
/// variance S₀·(151/315)/(2Δ).
pub(crate) fn density(noise: &SensorNoise, frequency_hz: f64) -> f64 {
    let spacing = HALF_POWER / noise.bandwidth;
    let low = match (noise.density, noise.rms) {
        (Some(root), _) => root * root,
        (None, rms) => rms.unwrap_or(0.0).powi(2) * 2.0 * spacing / AREA,
    };
    low * sinc(frequency_hz * spacing).powi(8)
}

/// The irregularity under the magnets, moving with the train.
#[derive(Debug, Clone)]
pub(crate) struct Track {
    pub speed: f64,
    amplitude: f64,
    /// Shortest and longest wave (m).
    waves: (f64, f64),
    /// Length over which a magnet feels the mean (m); 0 for none.
    pole: f64,
    /// Inputs that it adds to: position of the magnet (m), whether it is the rate, factor of the connection.
    acts: Vec<(f64, bool, f64)>,
    pub ports: Vec<Port>,
}

impl Track {
    /// From the one instance of the scenario that has the parameters of our guideway.
    pub fn find(
        setup: &Setup,
        given: &Irregularity,
    ) -> Result<(usize, f64, (f64, f64), f64), TuneError> {
        let all = &setup.system().instances;
        let missing = || {
            TuneError::value(
                "irregularity",
                "no instance has the parameter irregularity_amplitude, as the unit guideway has",
            )
        };
        let k = all
            .iter()
            .position(|it| it.find("irregularity_amplitude").is_some())
            .ok_or_else(missing)?;
        let it = &all[k];
        let value = |name: &str| -> Option<Value> {
            let variable = it.find(name)?;
            let own = it.parameters.get(&variable).cloned();
            own.or_else(|| it.description().variables[variable.0].start.clone())
        };
        let real = |name: &str| match value(name) {
            Some(Value::Real(x)) => Ok(x),
            _ => Err(TuneError::value(
                "irregularity",
                format!("{} has no Real parameter {name}", it.name),
            )),
        };
        let amplitude = match given.amplitude {
            Some(amplitude) => amplitude,
            None => real("irregularity_amplitude")?,
        };
        let averaged = !matches!(value("irregularity_averaged"), Some(Value::Boolean(false)));
        let pole = if averaged { real("pole_length")? } else { 0.0 };
        let waves = (real("irregularity_shortest_wave")?, real("irregularity_longest_wave")?);
        Ok((k, amplitude, waves, pole))
    }

    /// Where it acts: what the guideway's outputs `displacement_NN` and `rate_NN` feed, with the magnets' positions.
    pub fn new(
        system: &LinearSystem,
        (unit, amplitude, waves, pole): (usize, f64, (f64, f64), f64),
        given: &Irregularity,
        guideway: &Twin<'_>,
        setup: &Setup,
    ) -> Result<Self, TuneError> {
        let variables = &setup.system().instances[unit].description().variables;
        let position = |number: &str| {
            let name = format!("position_{number}");
            guideway
                .inputs()
                .find(|(variable, _)| variables[variable.0].name == name)
                .map(|it| it.1)
        };
        let mut track = Self {
            speed: given.speed,
            amplitude,
            waves,
            pole,
            acts: Vec::new(),
            ports: Vec::new(),
        };
        for it in system.connections.iter().filter(|it| it.from.unit == unit) {
            let name = &system.units[unit].outputs[it.from.index].name;
            let (number, rate) =
                match (name.strip_prefix("displacement_"), name.strip_prefix("rate_")) {
                    (Some(number), _) => (number, false),
                    (_, Some(number)) => (number, true),
                    _ => continue,
                };
            let Some(x) = position(number) else { continue };
            track.acts.push((x, rate, it.factor));
            track.ports.push(it.to);
        }
        if track.acts.is_empty() {
            return Err(TuneError::value(
                "irregularity",
                format!(
                    "{} has no connected outputs displacement_NN and inputs position_NN",
                    system.units[unit].name
                ),
            ));
        }
        Ok(track)
    }

    /// One-sided density over time (m²/Hz): S(Ω)·2π/v with Ω = 2πf/v.
    pub fn density(&self, frequency_hz: f64) -> f64 {
        let (first, last) = self.band();
        if !(first..=last).contains(&frequency_hz) {
            return 0.0;
        }
        let omega = TAU * frequency_hz / self.speed;
        self.amplitude / (omega * omega) * TAU / self.speed
    }

    /// Lowest and highest frequency (Hz).
    pub fn band(&self) -> (f64, f64) {
        (self.speed / self.waves.1, self.speed / self.waves.0)
    }

    /// A wave of amplitude 1 at the inputs: every magnet meets it with its own delay, averaged over its pole.
    pub fn wave(&self, frequency_hz: f64) -> Vec<c64> {
        let omega = TAU * frequency_hz;
        let mean = sinc(frequency_hz / self.speed * self.pole);
        let act = |&(x, rate, factor): &(f64, bool, f64)| {
            let value = c64::from_polar(mean * factor, omega * x / self.speed);
            if rate { value * c64::new(0.0, omega) } else { value }
        };
        self.acts.iter().map(act).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The integral of the density is the square of the r.m.s., and white noise of the same density has it too.
    #[test]
    fn analytic_noise_has_its_variance_and_its_density() {
        let noise = SensorNoise { rms: Some(2.0), density: None, bandwidth: 50.0 };
        let step = 0.01;
        let sum: f64 =
            (0..200_000).map(|k| density(&noise, (f64::from(k) + 0.5) * step) * step).sum();
        assert!((sum - 4.0).abs() < 1e-5, "{sum}");
        assert!((density(&noise, 50.0) / density(&noise, 0.0) - 0.5).abs() < 1e-4);
        let given = SensorNoise { rms: None, density: Some(0.3), bandwidth: 50.0 };
        assert!((density(&given, 0.0) - 0.09).abs() < 1e-12);
    }

    /// ∫ A/Ω² dΩ between the waves is the variance of the profile, at any speed.
    #[test]
    fn analytic_irregularity_has_the_variance_of_its_profile() {
        let track = |speed| Track {
            speed,
            amplitude: 7e-7,
            waves: (0.5, 50.0),
            pole: 0.65,
            acts: vec![(3.0, false, 1.0), (3.0, true, 1.0)],
            ports: Vec::new(),
        };
        for speed in [1.4, 27.0] {
            let track = track(speed);
            let (first, last) = track.band();
            let n = 200_000;
            let at = |k: usize| first * (last / first).powf((k as f64 + 0.5) / n as f64);
            let width = (last / first).ln() / n as f64;
            let sum: f64 = (0..n).map(|k| track.density(at(k)) * at(k) * width).sum();
            let exact = 7e-7 * (50.0 - 0.5) / TAU;
            assert!((sum / exact - 1.0).abs() < 1e-6, "{sum} {exact}");
            assert_eq!((track.density(0.99 * first), track.density(1.01 * last)), (0.0, 0.0));
            // the rate is the derivative, and a wave as long as the pole has no mean
            let wave = track.wave(2.0);
            assert!((wave[1] / wave[0] - c64::new(0.0, TAU * 2.0)).norm() < 1e-9);
            assert!(track.wave(speed / 0.65)[0].norm() < 1e-12);
        }
    }
}
