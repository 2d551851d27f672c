//! Pictures of the readings: the table at a glance, and figure 14.

use std::fmt::Write as _;

use anyhow::Result;
use figure::{FigureLine, FigurePanel, draw_over};

use super::{
    catalogue::Track,
    dataset::Dataset,
    judge::CLAIMS,
    text::{Judged, best, letter},
};
use crate::{claims::Verdict, runs::FREQUENCIES};

const ROW: usize = 22;
const CELL: usize = 30;
const LEFT: usize = 490;
const TOP: usize = 300;

/// Readings × claims, coloured by verdict.
pub fn overview(all: &[Judged]) -> String {
    let (width, height) = (LEFT + CLAIMS.len() * CELL + 210, TOP + all.len() * ROW + 50);
    let mut svg = format!(
        "<svg width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" \
         xmlns=\"http://www.w3.org/2000/svg\" font-family=\"sans-serif\" font-size=\"13\">\n\
         <rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>\n"
    );
    for (k, claim) in CLAIMS.iter().enumerate() {
        let (x, y) = (LEFT + k * CELL + CELL / 2 + 5, TOP - 8);
        let _ = writeln!(
            svg,
            "<text x=\"{x}\" y=\"{y}\" transform=\"rotate(-52 {x} {y})\">{} {}</text>",
            letter(k),
            claim.paper
        );
    }
    let counts = LEFT + CLAIMS.len() * CELL + 14;
    let _ =
        writeln!(svg, "<text x=\"{counts}\" y=\"{}\">agrees</text>", TOP + all.len() * ROW + 18);
    let best = best(all, false);
    for (k, judged) in all.iter().enumerate() {
        let y = TOP + k * ROW;
        let weight = if best.contains(&k) { "bold" } else { "normal" };
        let _ = writeln!(
            svg,
            "<text x=\"{}\" y=\"{}\" text-anchor=\"end\" font-weight=\"{weight}\">{} ({})</text>",
            LEFT - 8,
            y + 16,
            judged.reading.name,
            k + 1
        );
        for (c, verdict) in judged.verdicts.iter().enumerate() {
            let x = LEFT + c * CELL;
            let colour = match verdict {
                Verdict::Agrees => "#0072b2",
                Verdict::InPart => "#9ecae1",
                Verdict::Differs => "#eeeeee",
            };
            let _ = writeln!(
                svg,
                "<rect x=\"{x}\" y=\"{y}\" width=\"{}\" height=\"{}\" fill=\"{colour}\"/>",
                CELL - 2,
                ROW - 2
            );
        }
        let _ = writeln!(
            svg,
            "<text x=\"{counts}\" y=\"{}\" font-weight=\"{weight}\">{}</text>",
            y + 16,
            judged.counts().0
        );
    }
    let y = TOP + all.len() * ROW + 18;
    for (k, (colour, label)) in
        [("#0072b2", "agrees"), ("#9ecae1", "in part"), ("#eeeeee", "does not agree")]
            .iter()
            .enumerate()
    {
        let x = LEFT + k * 110;
        let _ = writeln!(
            svg,
            "<rect x=\"{x}\" y=\"{}\" width=\"14\" height=\"14\" fill=\"{colour}\"/><text x=\"{}\" y=\"{y}\">{label}</text>",
            y - 12,
            x + 20
        );
    }
    svg + "</svg>\n"
}

/// Largest gap deviations, over that of the 5 Hz girder, by the girder's first frequency; one line per reading of the magnets or girders.
pub fn girders(all: &[Judged], dataset: &Dataset) -> Result<String> {
    let mut panels = [0, 4].map(|first| FigurePanel {
        ylabel: format!(
            "gap over that at 5 Hz, by {}",
            if first == 0 { "stiffness" } else { "mass" }
        ),
        lines: Vec::new(),
    });
    // the single changes of magnets and girders
    let alone = all.iter().filter(|Judged { reading: it, .. }| {
        let still = !it.moving_girders && it.track == Track::Shipped;
        still && !it.at_bogies && it.force == 37.5 && it.train == 37.5
    });
    for Judged { reading, .. } in alone {
        let cases = reading.girders();
        let rows = cases.iter().map(|it| dataset.row(it.study.name(), &it.name));
        let rows = rows.collect::<Result<Vec<_>>>()?;
        if rows.iter().any(|it| !it.finished()) {
            continue;
        }
        for (panel, rows) in panels.iter_mut().zip(rows.chunks(4)) {
            let first = rows[0].gap.unwrap_or(f64::NAN);
            let points = FREQUENCIES
                .iter()
                .zip(rows)
                .filter_map(|(f, row)| Some((f64::from(*f), row.gap? / first)))
                .collect();
            panel.lines.push(FigureLine { label: reading.name.to_owned(), points });
        }
    }
    let title =
        "Figure 14 by reading: largest gap deviation under the chirp, over that of the 5 Hz girder";
    Ok(draw_over(title, "first frequency of the bare girder (Hz)", &panels)?)
}
