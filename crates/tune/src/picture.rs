//! Pictures of a tuning.

use figure::{PlaneLine, PlaneMark, PlanePanel, PlotError, draw_plane};

use crate::result::TuneResult;

/// The front of damping against modulus margin, with the values before and after.
///
/// # Errors
/// The drawing library fails.
pub fn front_picture(result: &TuneResult) -> Result<String, PlotError> {
    let [before, after] = result.worst();
    let points: Vec<(f64, f64)> = result.front.iter().map(|it| (it.modulus, it.damping)).collect();
    let all = || points.iter().copied().chain([&before, &after].map(|it| (it.modulus, it.damping)));
    let top = all().map(|it| it.1).fold(0.05, f64::max) * 1.12;
    let bottom = all().map(|it| it.1).fold(0.0, f64::min);
    let right = (all().map(|it| it.0).fold(0.0, f64::max) + 0.08).min(1.0);
    let limit = result.constraints.modulus.map(|it| PlaneLine {
        label: String::new(),
        points: vec![(it, bottom), (it, top)],
        guide: true,
    });
    let mut lines = vec![PlaneLine { label: "best found".to_owned(), points, guide: false }];
    lines.extend(limit);
    let mark = |at: (f64, f64), text: &str| PlaneMark { at, text: text.to_owned() };
    draw_plane(
        &result.title,
        &[PlanePanel {
            labels: ["least modulus margin".to_owned(), "least damping ratio".to_owned()],
            limits: [Some(0.0..right), Some(bottom..top)],
            lines,
            marks: vec![
                mark((before.modulus, before.damping), "before"),
                mark((after.modulus, after.damping), "after"),
            ],
            height: 420,
            ..PlanePanel::default()
        }],
    )
}
