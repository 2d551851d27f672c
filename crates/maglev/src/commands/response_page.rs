//! What `maglev response` prints.

use std::fmt::Write as _;

use results::response::{
    Direction, LoopMargins, LoopsResult, ModulusMargin, ResponseFile, RootLocus, Together,
};

use super::table::table;

/// Most loops in the table, those with the least modulus margin first.
const SHOWN: usize = 12;
/// Most crossings of a root locus that are listed.
const CROSSINGS: usize = 20;

// writing to a String cannot fail, so the results of writeln! are dropped
pub fn page(file: &ResponseFile) -> String {
    let mut text = String::new();
    let time = file.operating_point.time;
    let _ = writeln!(text, "linearised at    t = {time} s, the start of the scenario");
    let state = if file.stable {
        "stable at this operating point"
    } else {
        "UNSTABLE at this operating point"
    };
    let _ = writeln!(text, "closed system    {state}");
    for (rate, frequency) in &file.growing {
        let _ =
            writeln!(text, "                 a mode at {frequency:.4} Hz grows with {rate:.4} 1/s");
    }
    if !file.responses.is_empty() {
        if !file.stable {
            text += "\nThe responses below are those of an unstable system: no run shows them.\n";
        }
        let head = ["from", "to", "largest amplitude", "at Hz", "lowest frequency"];
        let rows = file.responses.iter().map(|it| {
            let (peak, frequency) = it.peak;
            let first = it.curve.real.first().zip(it.curve.imaginary.first());
            let first = first.map(|(re, im)| re.hypot(*im)).unwrap_or_default();
            vec![
                it.from.clone(),
                it.to.clone(),
                format!("{peak:.4e} {}", it.unit),
                format!("{frequency:.4}"),
                format!("{first:.4e}"),
            ]
        });
        let head = head.map(str::to_owned).to_vec();
        text += "\n";
        text += &table(std::iter::once(head).chain(rows), &[2, 3, 4]);
    }
    if let Some(loops) = &file.loops {
        text += "\n";
        text += &of_loops(loops);
    }
    if let Some(locus) = &file.root_locus {
        text += "\n";
        text += &of_locus(locus);
    }
    text
}

fn of_loops(loops: &LoopsResult) -> String {
    let mut text = String::new();
    let places = match loops.at.as_slice() {
        [one] => one.clone(),
        [first, .., last] => format!("{} signals, {first} … {last}", loops.at.len()),
        [] => String::new(),
    };
    let _ = writeln!(text, "loops broken at  {places}");
    if let Some((period, delay)) = loops.sampled {
        let _ = writeln!(
            text,
            "                 sampled: values are held for {period} s and act {delay} samples later"
        );
    }
    let count = match loops.encirclements {
        None => "not counted: poles on the border of stability, or too steep a curve".to_owned(),
        Some(turns) => format!("{:.0}", turns + 0.0),
    };
    let _ = writeln!(
        text,
        "Nyquist          {} growing poles with the loops broken, {} with them closed; clockwise turns: {count}",
        loops.open_growing, loops.closed_growing
    );
    let expected = loops.closed_growing as f64 - loops.open_growing as f64;
    if loops.encirclements.is_some_and(|turns| (turns - expected).abs() > 0.1) {
        let _ = writeln!(
            text,
            "                 WARNING: {expected} turns are expected. The curve is not resolved; do not rely \
             on the margins."
        );
    }
    if !loops.stable {
        text += "\nThe closed loops are unstable: there are no margins. Gains at which a mode would be on the border:\n";
        for it in loops.single.iter().take(SHOWN) {
            let list: Vec<String> =
                it.critical.iter().map(|(f, gain)| format!("×{gain:.4} ({f:.4} Hz)")).collect();
            let list = if list.is_empty() { "none".to_owned() } else { list.join(", ") };
            let _ = writeln!(text, "  {}: {list}", it.at);
        }
        return text;
    }
    let mut single: Vec<(&str, &LoopMargins)> =
        loops.single.iter().filter_map(|it| Some((it.at.as_str(), it.margins.as_ref()?))).collect();
    single.sort_by(|a, b| a.1.modulus.value.total_cmp(&b.1.modulus.value));
    let _ = match single.len() {
        1 => writeln!(text),
        n if n > SHOWN => writeln!(
            text,
            "\nEach loop broken alone, the others closed; the {SHOWN} of {n} with the least modulus margin:"
        ),
        _ => writeln!(text, "\nEach loop broken alone, the others closed:"),
    };
    let mut rows = vec![head()];
    rows.extend(single.iter().take(SHOWN).map(|(name, margins)| row(name, margins)));
    if let Some(equal) = loops.together.as_ref().and_then(|it| it.equal.as_ref()) {
        rows.push(row("the same change in all loops", equal));
    }
    text += &table(rows, &[]);
    if let Some(together) = &loops.together {
        text += &of_all(together, loops.at.len());
    }
    text
}

fn head() -> Vec<String> {
    ["", "gain ×", "at Hz", "phase", "at Hz", "delay", "at Hz", "modulus", "at Hz", "largest |S|"]
        .map(str::to_owned)
        .to_vec()
}

fn row(name: &str, margins: &LoopMargins) -> Vec<String> {
    let hertz = |f: Option<f64>| f.map_or_else(|| "-".to_owned(), |f| format!("{f:.3}"));
    let LoopMargins { gain_up, gain_down, phase, delay, modulus } = margins;
    let both = |down: String, up: String| format!("{down} … {up}");
    let factor =
        |it: Option<f64>, none: &str| it.map_or_else(|| none.to_owned(), |it| format!("{it:.3}"));
    let sense = |it: Direction| if it == Direction::Lead { " lead" } else { "" };
    vec![
        name.to_owned(),
        both(factor(gain_down.map(|it| it.factor), "0"), factor(gain_up.map(|it| it.factor), "∞")),
        both(hertz(gain_down.map(|it| it.frequency_hz)), hertz(gain_up.map(|it| it.frequency_hz))),
        phase.map_or_else(
            || "-".to_owned(),
            |it| format!("{:.2}°{}", it.degrees, sense(it.direction)),
        ),
        hertz(phase.map(|it| it.frequency_hz)),
        delay.map_or_else(|| "-".to_owned(), |it| format!("{:.4} ms", 1e3 * it.seconds)),
        hertz(delay.map(|it| it.frequency_hz)),
        format!("{:.4}", modulus.value),
        hertz(modulus.frequency_hz),
        format!("{:.3}", 1.0 / modulus.value),
    ]
}

fn of_all(together: &Together, count: usize) -> String {
    let Some(independent) = &together.independent else { return String::new() };
    let (low, high) = independent.gains();
    let ModulusMargin { value, frequency_hz } = independent;
    let at = frequency_hz.map(|f| format!(" at {f:.3} Hz")).unwrap_or_default();
    format!(
        "\nDifferent changes in the {count} loops at once: least σ(I + L) = {value:.4}{at}, largest σ(S) = {:.3}.\n\
         Stable at least for gains from ×{low:.3} to ×{high:.3}, or phases within ±{:.2}°, chosen for each loop.\n",
        1.0 / value,
        independent.phase()
    )
}

fn of_locus(locus: &RootLocus) -> String {
    let mut text = String::new();
    let (first, last) = (locus.values.first().copied(), locus.values.last().copied());
    let _ = writeln!(
        text,
        "root locus       {} eigenvalues over {} from {} to {}",
        locus.branches.len(),
        locus.parameter,
        first.unwrap_or_default(),
        last.unwrap_or_default()
    );
    let rates = |k: usize| {
        let values = locus.branches.iter().filter_map(move |branch| branch.get(k));
        values.map(|it| it.0).fold(f64::NEG_INFINITY, f64::max)
    };
    let best = (0..locus.values.len()).min_by(|a, b| rates(*a).total_cmp(&rates(*b)));
    if let Some(k) = best {
        let _ = writeln!(
            text,
            "                 decays fastest at {}: every mode by {:.4} 1/s or more",
            locus.values[k],
            -rates(k)
        );
    }
    if locus.crossings.is_empty() {
        text += "                 no eigenvalue crosses the imaginary axis\n";
    }
    for (value, frequency) in locus.crossings.iter().take(CROSSINGS) {
        let _ = writeln!(
            text,
            "                 an eigenvalue crosses the imaginary axis near {value:.4}, {frequency:.4} Hz"
        );
    }
    if locus.crossings.len() > CROSSINGS {
        let _ = writeln!(text, "                 … and {} more", locus.crossings.len() - CROSSINGS);
    }
    text
}
