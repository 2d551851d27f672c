//! The page's section about frequency responses and margins.

use results::response::{LoopMargins, ModulusMargin, ResponseCurve, ResponseFile};
use serde::Serialize;

use crate::responses::response_figures;

/// What the page shows of response.json.
#[derive(Serialize)]
pub(crate) struct ResponseSection<'a> {
    /// Time of the operating point (s).
    time: f64,
    stable: bool,
    responses: Vec<ResponseRow<'a>>,
    loops: Vec<LoopRow<'a>>,
    sampled: Option<(f64, usize)>,
    /// Margins for the same change in all loops.
    equal: Option<&'a LoopMargins>,
    independent: Option<&'a ModulusMargin>,
    /// Name and SVG of every figure; of those that cannot be drawn, none.
    figures: Vec<(&'static str, String)>,
}

#[derive(Serialize)]
struct ResponseRow<'a> {
    from: &'a str,
    to: &'a str,
    unit: &'a str,
    peak: f64,
    frequency_hz: f64,
}

#[derive(Serialize)]
struct LoopRow<'a> {
    at: &'a str,
    margins: Option<&'a LoopMargins>,
}

impl<'a> ResponseSection<'a> {
    pub(crate) fn new(file: &'a ResponseFile) -> Self {
        let row = |it: &'a ResponseCurve| ResponseRow {
            from: &it.from,
            to: &it.to,
            unit: &it.unit,
            peak: it.peak.0,
            frequency_hz: it.peak.1,
        };
        let loops = file.loops.as_ref();
        let together = loops.and_then(|it| it.together.as_ref());
        let single = loops.iter().flat_map(|it| &it.single);
        Self {
            time: file.operating_point.time,
            stable: file.stable,
            responses: file.responses.iter().map(row).collect(),
            loops: single.map(|it| LoopRow { at: &it.at, margins: it.margins.as_ref() }).collect(),
            sampled: loops.and_then(|it| it.sampled),
            equal: together.and_then(|it| it.equal.as_ref()),
            independent: together.and_then(|it| it.independent.as_ref()),
            figures: response_figures(file).unwrap_or_default(),
        }
    }
}
