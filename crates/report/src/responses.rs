//! Figures of frequency responses, loops and root loci, from response.json.

use std::f64::consts::TAU;

use figure::{PlaneLine, PlaneMark, PlanePanel, PlotError, draw_plane};
use results::response::{Curve, LoopsResult, ResponseCurve, ResponseFile, RootLocus, Together};

/// Most curves of one panel.
const CURVES: usize = 8;
/// Heights of panels in pixels.
const LOW: u32 = 300;
const SQUARE: u32 = 760;
/// A branch of a root locus that moves by less than this fraction of its size stays where it is.
const MOVES: f64 = 1e-3;
/// Branches of a root locus that come below this damping ratio set the limits of its picture.
const DAMPED: f64 = 0.5;

/// Names of the figures that a file gives, and their SVG texts.
///
/// # Errors
/// The drawing library fails.
pub fn response_figures(file: &ResponseFile) -> Result<Vec<(&'static str, String)>, PlotError> {
    let mut figures = Vec::new();
    let unstable = if file.stable { "" } else { " (the closed system is UNSTABLE)" };
    if !file.responses.is_empty() {
        figures
            .push(("response", draw_plane(&format!("Frequency response{unstable}"), &bode(file))?));
    }
    if let Some(loops) = &file.loops {
        let curves = single(loops);
        let title = |kind: &str| {
            let broken = match loops.at.as_slice() {
                [one] => one.clone(),
                all => format!("{} loops, each alone", all.len()),
            };
            format!("{kind} of L at {broken}{unstable}")
        };
        figures.push(("loop-bode", draw_plane(&title("Bode diagram"), &loop_bode(&curves))?));
        let modulus = least_modulus(loops);
        figures.push((
            "nyquist",
            draw_plane(&title("Nyquist diagram"), &[nyquist(&curves, modulus)])?,
        ));
        figures.push(("nichols", draw_plane(&title("Nichols diagram"), &[nichols(&curves)])?));
        let title = format!("Sensitivity{unstable}");
        figures.push(("sensitivity", draw_plane(&title, &[sensitivity(loops, &curves)])?));
        if let Some(together) = &loops.together {
            let title = format!("Characteristic loci of {} loops{unstable}", loops.at.len());
            let loci: Vec<(String, &Curve)> =
                together.loci.iter().map(|it| (String::new(), it)).collect();
            figures.push(("loci", draw_plane(&title, &[nyquist(&loci, equal_modulus(together))])?));
        }
    }
    if let Some(locus) = &file.root_locus {
        let (first, last) = (locus.values.first(), locus.values.last());
        let values = first.zip(last).map(|(a, b)| format!(" from {a} to {b}")).unwrap_or_default();
        let title = format!("Root locus over {}{values}", locus.parameter);
        figures.push(("root-locus", draw_plane(&title, &[root_locus(locus)])?));
    }
    Ok(figures)
}

fn amplitude(curve: &Curve) -> impl Iterator<Item = (f64, f64)> {
    let sizes = curve.real.iter().zip(&curve.imaginary).map(|(re, im)| re.hypot(*im));
    curve.frequency_hz.iter().copied().zip(sizes)
}

/// Phase in degrees without jumps. Loops begin between −360° and 0.
fn phase(curve: &Curve, of_loop: bool) -> Vec<(f64, f64)> {
    let mut phases: Vec<f64> = Vec::new();
    for (re, im) in curve.real.iter().zip(&curve.imaginary) {
        let phase = im.atan2(*re);
        let turns = match phases.last() {
            Some(before) => ((before - phase) / TAU).round(),
            None if of_loop && phase > 1e-6 => -1.0,
            None => 0.0,
        };
        phases.push(phase + TAU * turns);
    }
    curve.frequency_hz.iter().copied().zip(phases.into_iter().map(f64::to_degrees)).collect()
}

fn panel(labels: [&str; 2], lines: Vec<PlaneLine>, height: u32) -> PlanePanel {
    PlanePanel { labels: labels.map(str::to_owned), lines, height, ..PlanePanel::default() }
}

const FREQUENCY: &str = "frequency (Hz)";

fn over_frequency(label: &str, lines: Vec<PlaneLine>, log: bool) -> PlanePanel {
    PlanePanel { logarithmic: [true, log], ..panel([FREQUENCY, label], lines, LOW) }
}

/// Amplitude and phase of responses, one panel of amplitudes for each unit of measure.
fn bode(file: &ResponseFile) -> Vec<PlanePanel> {
    let mut units: Vec<&str> = file.responses.iter().map(|it| it.unit.as_str()).collect();
    units.dedup();
    let name = |it: &ResponseCurve| format!("{} → {}", it.from, it.to);
    let mut panels = Vec::new();
    for unit in units {
        let lines = file.responses.iter().filter(|it| it.unit == unit).take(CURVES);
        let lines = lines.map(|it| line(name(it), amplitude(&it.curve).collect())).collect();
        panels.push(over_frequency(&format!("amplitude ({unit})"), lines, true));
    }
    let lines = file.responses.iter().take(CURVES);
    let lines = lines.map(|it| line(name(it), phase(&it.curve, false))).collect();
    panels.push(over_frequency("phase (°)", lines, false));
    panels
}

fn line(label: String, points: Vec<(f64, f64)>) -> PlaneLine {
    PlaneLine { label, points, guide: false }
}

fn guide(points: Vec<(f64, f64)>) -> PlaneLine {
    PlaneLine { label: String::new(), points, guide: true }
}

fn single(loops: &LoopsResult) -> Vec<(String, &Curve)> {
    let drawn = loops.single.iter().filter_map(|it| Some((it.at.clone(), it.curve.as_ref()?)));
    drawn.take(CURVES).collect()
}

fn loop_bode(curves: &[(String, &Curve)]) -> Vec<PlanePanel> {
    let sizes = curves.iter().map(|(name, it)| line(name.clone(), amplitude(it).collect()));
    let phases = curves.iter().map(|(_, it)| line(String::new(), phase(it, true)));
    let ends = |height: f64| {
        let all = curves.iter().flat_map(|it| it.1.frequency_hz.iter().copied());
        let (low, high) =
            all.fold((f64::INFINITY, 0.0), |(a, b): (f64, f64), x| (a.min(x), b.max(x)));
        guide(vec![(low, height), (high, height)])
    };
    vec![
        over_frequency("|L|", sizes.chain([ends(1.0)]).collect(), true),
        over_frequency("phase of L (°)", phases.chain([ends(-180.0)]).collect(), false),
    ]
}

fn circle(centre: f64, radius: f64) -> Vec<(f64, f64)> {
    let angles = (0..=180).map(|k| f64::from(k) / 180.0 * TAU);
    angles.map(|angle| (centre + radius * angle.cos(), radius * angle.sin())).collect()
}

fn least_modulus(loops: &LoopsResult) -> Option<f64> {
    let all = loops.single.iter().filter_map(|it| Some(it.margins.as_ref()?.modulus.value));
    all.reduce(f64::min)
}

fn equal_modulus(together: &Together) -> Option<f64> {
    Some(together.equal.as_ref()?.modulus.value)
}

/// Curves around −1, with the unit circle, and the circle around −1 that they touch.
fn nyquist(curves: &[(String, &Curve)], modulus: Option<f64>) -> PlanePanel {
    let drawn = curves.iter().map(|(name, it)| {
        line(name.clone(), it.real.iter().copied().zip(it.imaginary.iter().copied()).collect())
    });
    let mut lines: Vec<PlaneLine> = drawn.collect();
    lines.push(guide(circle(0.0, 1.0)));
    lines.push(guide(vec![(-100.0, 0.0), (100.0, 0.0)]));
    lines.extend(modulus.map(|radius| guide(circle(-1.0, radius))));
    let mark = PlaneMark { at: (-1.0, 0.0), text: "−1".to_owned() };
    PlanePanel {
        limits: [Some(-4.0..2.0), Some(-2.0..2.0)],
        equal: true,
        marks: vec![mark],
        ..panel(["Re L", "Im L"], lines, SQUARE)
    }
}

/// |L| in dB over its phase between −360° and 0, with the contours |1 + L| = 0.5 and 0.25.
fn nichols(curves: &[(String, &Curve)]) -> PlanePanel {
    let mut lines: Vec<PlaneLine> = Vec::new();
    for (name, curve) in curves {
        let mut points: Vec<(f64, f64)> = Vec::new();
        for ((re, im), (_, size)) in curve.real.iter().zip(&curve.imaginary).zip(amplitude(curve)) {
            let phase = im.atan2(*re).to_degrees();
            let phase = if phase > 0.0 { phase - 360.0 } else { phase };
            if points.last().is_some_and(|before| (before.0 - phase).abs() > 180.0) {
                points.push((f64::NAN, f64::NAN));
            }
            points.push((phase, 20.0 * size.log10()));
        }
        lines.push(line(name.clone(), points));
    }
    for radius in [0.25, 0.5] {
        let points = circle(-1.0, radius).into_iter();
        let contour = points.map(|(x, y)| {
            let phase = y.atan2(x).to_degrees();
            (if phase > 0.0 { phase - 360.0 } else { phase }, 20.0 * x.hypot(y).log10())
        });
        lines.push(guide(contour.collect()));
    }
    let mark = PlaneMark { at: (-180.0, 0.0), text: "−1".to_owned() };
    PlanePanel {
        limits: [Some(-360.0..0.0), Some(-40.0..40.0)],
        marks: vec![mark],
        ..panel(["phase of L (°)", "|L| (dB)"], lines, SQUARE)
    }
}

/// |S| of every loop, and the largest singular value of S for all of them.
fn sensitivity(loops: &LoopsResult, curves: &[(String, &Curve)]) -> PlanePanel {
    let mut lines: Vec<PlaneLine> = curves
        .iter()
        .map(|(name, it)| {
            let values =
                it.real.iter().zip(&it.imaginary).map(|(re, im)| 1.0 / (1.0 + re).hypot(*im));
            line(name.clone(), it.frequency_hz.iter().copied().zip(values).collect())
        })
        .collect();
    if let Some(together) = &loops.together {
        let values = together.least_singular.iter().map(|(f, least)| (*f, 1.0 / least));
        lines.push(line("all loops at once: 1/σ(I + L)".to_owned(), values.collect()));
    }
    over_frequency("|S| = 1/|1 + L|", lines, true)
}

/// Branches above the real axis. The limits are those of the branches that oscillate and move.
fn root_locus(locus: &RootLocus) -> PlanePanel {
    let size = |it: &(f64, f64)| it.0.hypot(it.1);
    let moves = |branch: &&Vec<(f64, f64)>| {
        let Some(first) = branch.first() else { return false };
        branch.iter().any(|it| (it.0 - first.0).hypot(it.1 - first.1) > MOVES * size(it))
    };
    let damping = |it: &(f64, f64)| -it.0 / size(it).max(f64::MIN_POSITIVE);
    let weak = |branch: &&Vec<(f64, f64)>| branch.iter().any(|it| damping(it) < DAMPED);
    let interesting: Vec<&(f64, f64)> =
        locus.branches.iter().filter(moves).filter(weak).flatten().collect();
    let ends = |of: &dyn Fn(&(f64, f64)) -> f64| {
        let values = interesting.iter().map(|it| of(it));
        let (low, high) =
            values.fold((0.0_f64, 0.0_f64), |(low, high), x| (low.min(x), high.max(x)));
        let space = 0.08 * (high - low).max(1e-3);
        low - space..high + space
    };
    let hertz = |it: &(f64, f64)| it.1 / TAU;
    let (across, up) = (ends(&|it| it.0), ends(&|it| hertz(it)));
    let mut lines: Vec<PlaneLine> = vec![guide(vec![(0.0, up.start), (0.0, up.end)])];
    for ratio in [0.05_f64, 0.1, 0.2] {
        let far = 100.0 * up.end;
        lines.push(guide(vec![
            (0.0, 0.0),
            (-far * TAU * ratio / (1.0 - ratio * ratio).sqrt(), far),
        ]));
    }
    let mut marks = Vec::new();
    let points = |branch: &Vec<(f64, f64)>| branch.iter().map(|it| (it.0, hertz(it))).collect();
    for branch in locus.branches.iter().filter(moves) {
        lines.push(line(String::new(), points(branch)));
        if let Some((start, value)) = branch.first().zip(locus.values.first()) {
            let text = if weak(&branch) { format!("{value}") } else { String::new() };
            marks.push(PlaneMark { at: (start.0, hertz(start)), text });
        }
    }
    PlanePanel {
        limits: [Some(across), Some(up)],
        marks,
        ..panel(["Re λ (1/s)", "Im λ / 2π (Hz)"], lines, SQUARE)
    }
}
