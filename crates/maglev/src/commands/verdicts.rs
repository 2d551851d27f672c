//! Tables of figures and verdicts.

use criteria::{Outcome, Verdict};

use super::table::table;

/// The title, with the number of signals if there are several.
fn title(verdict: &Verdict) -> String {
    match verdict.judged {
        0 | 1 => verdict.title.clone(),
        count => format!("{} ({count})", verdict.title),
    }
}

/// Figures with limits, margins, verdicts and sources, and below them the sentences on what needs one.
pub fn text(verdicts: &[Verdict]) -> String {
    let bounded = verdicts.iter().any(|it| it.outcome != Outcome::NoLimit);
    let head = ["", "figure", "limit", "margin", "", "source"].map(str::to_owned).to_vec();
    let row = |it: &Verdict| {
        let cells = [
            title(it),
            it.figure(),
            it.limit(),
            if it.outcome == Outcome::NoLimit { String::new() } else { it.margin_text() },
            it.outcome.word().to_owned(),
            it.source.clone(),
        ];
        if bounded { cells.to_vec() } else { cells[..2].to_vec() }
    };
    let rows = bounded.then_some(head).into_iter().chain(verdicts.iter().map(row));
    let mut text = table(rows, &[1, 2, 3]);
    let sentences: Vec<String> = verdicts.iter().filter_map(Verdict::sentence).collect();
    for sentence in sentences {
        text += &format!("{sentence}\n");
    }
    text
}
