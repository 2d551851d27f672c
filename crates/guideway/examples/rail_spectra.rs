//! Draws the realised spectra and the coherence of two rails beside their targets, the picture of
//! docs/girders-3d.md:
//! `cargo run --release -p guideway --example rail_spectra > docs/rail-spectra.svg`

use std::error::Error;
use std::io::Write;

use figure::{PlaneLine, PlanePanel};
use guideway::{Guideway, GuidewayDescription, Rails};

#[path = "../tests/support/spectra.rs"]
mod spectra;
use spectra::{LINES, spectra};

/// Ω_s/√2 of the German spectra of cross level (rad/m).
const CORNER: f64 = 0.438 * std::f64::consts::FRAC_1_SQRT_2;

/// A target over Ω.
type Target<'a> = &'a dyn Fn(f64) -> f64;

fn rails(psd: &str) -> Result<Rails, guideway::Error> {
    let text = format!(
        r#"{{ "girders": {{"g": {{"length": 25, "mass_per_length": 1, "frequencies": [6], "damping": [0]}}}},
            "spans": [{{"girder": "g"}}], "magnets": 8,
            "rails": {{"irregularity": {{"on": true, "start": 0, "end": 26300, "fade_length": 1,
              "averaged": false, "vertical": {{"psd": {psd}, "shortest_wave": 1, "lines": {LINES},
              "coherence": {{"corner": {CORNER}}}}}}}}} }}"#
    );
    let guideway = Guideway::new(&GuidewayDescription::from_json(&text)?, None)?;
    Ok(guideway.rails().cloned().unwrap_or_else(|| unreachable!("the layout has rails")))
}

fn german(amplitude: f64) -> impl Fn(f64) -> f64 {
    let square = |x: f64| x * x;
    move |k| amplitude * square(0.8246) / ((k * k + square(0.0206)) * (k * k + square(0.8246)))
}

fn line(label: &str, points: Vec<(f64, f64)>, guide: bool) -> PlaneLine {
    PlaneLine { label: label.to_owned(), points, guide }
}

fn main() -> Result<(), Box<dyn Error>> {
    let (low, high) = (german(4.032e-7), german(1.080e-6));
    let inverse = |k: f64| 7e-7 / (k * k);
    let forms: [(&str, &str, Target); 3] = [
        ("German, high", r#"{"form": "german-high"}"#, &high),
        ("German, low", r#"{"form": "german-low"}"#, &low),
        ("7e-7/W²", r#"{"form": "inverse-square", "amplitude": 7e-7}"#, &inverse),
    ];
    let coherency = |k: f64| 1.0 / (1.0 + (k / CORNER).powi(2));
    let waves: Vec<f64> = (0..200).map(|i| 0.126 * 50f64.powf(f64::from(i) / 199.0)).collect();
    let (mut density, mut coherence) = (Vec::new(), Vec::new());
    for (name, psd, target) in forms {
        let found = spectra(&rails(psd)?, 0, 20.0, &|k| [target(k), target(k) * coherency(k)]);
        let left = found.iter().map(|band| (band[0], band[1])).collect();
        density.push(line(&format!("{name}: left rail"), left, false));
        density.push(line("", waves.iter().map(|&k| (k, target(k))).collect(), true));
        if name == "German, low" {
            let of = |band: &[f64; 6]| (band[0], band[3].powi(2) / (band[1] * band[2]));
            coherence.push(line("left and right rail", found.iter().map(of).collect(), false));
        }
    }
    let target = waves.iter().map(|&k| (k, coherency(k).powi(2))).collect();
    coherence.push(line("", target, true));
    let across = "wavenumber W (rad/m); grey: target".to_owned();
    let panel = |label: &str, log, lines, height| PlanePanel {
        labels: [across.clone(), label.to_owned()],
        logarithmic: [true, log],
        limits: [Some(0.12..7.0), None],
        lines,
        height,
        ..PlanePanel::default()
    };
    let panels =
        [panel("PSD (m²/(rad/m))", true, density, 360), panel("coherence", false, coherence, 240)];
    let svg = figure::draw_plane("Realised irregularity of two rails, 26 km", &panels)?;
    std::io::stdout().write_all(svg.as_bytes())?;
    Ok(())
}
