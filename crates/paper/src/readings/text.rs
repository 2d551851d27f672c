//! The section of `docs/paper.md` on readings.

use std::{fmt::Write as _, ops::Range};

use anyhow::{Result, ensure};

use super::{
    Reading,
    dataset::{Dataset, Row},
    judge::{CLAIMS, counts, judge},
    list::readings,
};
use crate::claims::Verdict;

/// A reading with its verdicts.
pub struct Judged {
    /// The reading.
    pub reading: Reading,
    /// On each claim.
    pub verdicts: [Verdict; 13],
}

impl Judged {
    /// How many claims agree, and how many in part.
    pub fn counts(&self) -> (usize, usize) {
        counts(&self.verdicts)
    }
}

/// All readings with their verdicts.
pub fn judged(dataset: &Dataset) -> Result<Vec<Judged>> {
    let one =
        |reading: Reading| judge(&reading, dataset).map(|verdicts| Judged { reading, verdicts });
    readings().into_iter().map(one).collect()
}

/// Those that agree with most claims, and among them with most in part; of all, or without
/// those for whose values nothing in the text speaks.
pub fn best(all: &[Judged], in_text: bool) -> Vec<usize> {
    let counted = || (0..all.len()).filter(|&k| all[k].reading.in_text || !in_text);
    let most = counted().map(|k| all[k].counts()).max().unwrap_or_default();
    counted().filter(|&k| all[k].counts() == most).collect()
}

/// Numbers of the readings, from 1, that agree with a claim.
fn agreeing(all: &[Judged], claim: usize, verdict: Verdict) -> Vec<usize> {
    (0..all.len()).filter(|&k| all[k].verdicts[claim] == verdict).map(|k| k + 1).collect()
}

/// `1, 3 to 5, 9`.
fn list(numbers: &[usize]) -> String {
    let mut parts: Vec<String> = Vec::new();
    let mut rest = numbers;
    while let Some(&first) = rest.first() {
        let run = rest.iter().enumerate().take_while(|(k, n)| **n == first + k).count();
        let last = first + run - 1;
        parts.push(match run {
            1 => first.to_string(),
            2 => format!("{first}, {last}"),
            _ => format!("{first} to {last}"),
        });
        rest = &rest[run..];
    }
    if parts.is_empty() { "none".to_owned() } else { parts.join(", ") }
}

/// For which readings claims hold, as a sentence after the verdicts on the shipped reading.
pub fn holds(all: &[Judged], claims: Range<usize>) -> String {
    let one = |k: usize| {
        let readings = list(&agreeing(all, k, Verdict::Agrees));
        format!("{} ({}): {readings}", letter(k), CLAIMS[k].paper)
    };
    let parts: Vec<_> = claims.map(one).collect();
    format!(
        "\nFor which [readings](#which-reading-agrees-with-most-of-it) this holds: {}.\n",
        parts.join("; ")
    )
}

const HEAD: &str = "
## Which reading agrees with most of it

The verdicts above hold for one reading of the paper. Here each choice that its text leaves open is varied, alone and
in combinations, and every claim of sections 3.2 to 3.4 is judged by the same criterion. No value was fitted to a
picture: each reading is argued from the text, and the argument says what speaks against it. The study is
`examples/studies/readings.json` and three files beside it; its dataset, one row per run, is
[readings.csv](paper/readings.csv), from which this section follows. `cargo xtask paper` does not run it again:

```sh
cargo xtask readings    # some ten minutes on two idle cores; continues where it was stopped
```

Standstills have steps of 2 ms and end at 30 s, girders of figure 14 at 14 s, crossings have steps of 5 ms. Lengths are those of
the recorded values.

![Readings and claims](paper/readings.svg)
";

/// Refuses a dataset that no longer bears what the page says of it in its own words.
fn check(all: &[Judged]) -> Result<()> {
    let verdict = |name: &str, claim: usize| {
        all.iter().find(|it| it.reading.name == name).map(|it| it.verdicts[claim])
    };
    let agrees = |name: &str, claims: &[usize]| {
        claims.iter().all(|claim| verdict(name, *claim) == Some(Verdict::Agrees))
    };
    let differs = |name: &str, claims: &[usize]| {
        claims.iter().all(|claim| verdict(name, *claim) == Some(Verdict::Differs))
    };
    let still = all.iter().filter(|it| !it.reading.at_bogies);
    let still = still.map(|it| it.verdicts[4]).all(|it| it == Verdict::Differs);
    let chirp = "force off, at the bogies, chirp in the crossing";
    for (holds, what) in [
        (agrees("28 A", &[6, 8]) && agrees("32 A", &[6, 8]), "28 and 32 A give figure 14's gaps"),
        (!agrees("as shipped", &[6]) && differs("as shipped", &[8]), "24 A does not"),
        (
            differs("nonlinear law", &[6, 8]) && differs("14.353 A", &[6, 8]),
            "the law of the load goes the other way",
        ),
        (
            agrees("force off, at the bogies", &[3, 4])
                && differs("force 1.5 m off mid-span", &[4])
                && agrees("force at a quarter", &[3]),
            "1.5 m off mid-span is enough for 25 Hz, but not at mid-span",
        ),
        (still, "mid-span moves at 25 Hz in no reading"),
        (
            differs("one bearing, at the bogies", &[3, 4]),
            "one bearing does not stand out with the force at mid-span",
        ),
        (
            agrees("nonlinear law, waves to 5 cm at centres", &[11])
                && differs("waves to 5 cm, at centres", &[11])
                && differs("28 A, waves to 5 cm at centres", &[11]),
            "short waves show the first frequency with the nonlinear law only",
        ),
        (
            agrees(chirp, &[11]) && differs(chirp, &[10]),
            "a chirp in the crossing shows it, and moves the largest vibration",
        ),
        (
            best(all, false).iter().all(|&k| {
                all[k].reading.name == "28 A, force off, at the bogies, chirp in the crossing"
            }),
            "the best reading is that of the scenarios",
        ),
    ] {
        ensure!(
            holds,
            "the dataset no longer supports \"{what}\"; update crates/paper/src/page.rs"
        );
    }
    Ok(())
}

/// The whole section.
pub fn section(dataset: &Dataset, all: &[Judged]) -> Result<String> {
    check(all)?;
    let mut text = String::from(HEAD);
    result(&mut text, all)?;
    claims(&mut text, all)?;
    table(&mut text, all)?;
    arguments(&mut text, all)?;
    figure_14(&mut text, dataset, all)?;
    Ok(text)
}

fn claims(text: &mut String, all: &[Judged]) -> Result<()> {
    text.push_str(
        "\nThe claims, and the readings (numbers of the next tables) for which they hold:\n\n\
         | | section | claim | agrees if | readings that agree | in part |\n|---|---|---|---|---|---|\n",
    );
    for (k, claim) in CLAIMS.iter().enumerate() {
        let letter = letter(k);
        let [agrees, in_part] = [Verdict::Agrees, Verdict::InPart].map(|it| agreeing(all, k, it));
        let agrees = if agrees.is_empty() { "**none**".to_owned() } else { list(&agrees) };
        let in_part = if in_part.is_empty() { "–".to_owned() } else { list(&in_part) };
        writeln!(
            text,
            "| {letter} | {} | {} | {} | {agrees} | {in_part} |",
            claim.place, claim.paper, claim.criterion
        )?;
    }
    Ok(())
}

/// The letter of a claim.
pub fn letter(k: usize) -> char {
    char::from(b'A' + u8::try_from(k).unwrap_or(0))
}

fn table(text: &mut String, all: &[Judged]) -> Result<()> {
    text.push_str("\n● agrees, ◐ in part, · does not agree:\n\n| | reading |");
    for k in 0..CLAIMS.len() {
        write!(text, " {} |", letter(k))?;
    }
    text.push_str(" agrees | in part |\n|---|---|");
    text.push_str(&"---|".repeat(CLAIMS.len() + 2));
    for (k, judged) in all.iter().enumerate() {
        write!(text, "\n| {} | {} |", k + 1, judged.reading.name)?;
        for verdict in judged.verdicts {
            let sign = match verdict {
                Verdict::Agrees => '●',
                Verdict::InPart => '◐',
                Verdict::Differs => '·',
            };
            write!(text, " {sign} |")?;
        }
        let (agrees, in_part) = judged.counts();
        write!(text, " {agrees} | {in_part} |")?;
    }
    text.push('\n');
    Ok(())
}

fn arguments(text: &mut String, all: &[Judged]) -> Result<()> {
    text.push_str(
        "\nWhat each reading changes of the first one, and what speaks for it and against it:\n\n\
         | | reading | argument |\n|---|---|---|\n",
    );
    for (k, Judged { reading, .. }) in all.iter().enumerate() {
        writeln!(text, "| {} | {} | {} |", k + 1, reading.name, reading.argument)?;
    }
    Ok(())
}

fn result(text: &mut String, all: &[Judged]) -> Result<()> {
    let names = |numbers: &[usize]| {
        let name = |&k: &usize| format!("{} ({})", k + 1, all[k].reading.name);
        numbers.iter().map(name).collect::<Vec<_>>().join("; ")
    };
    let missed = |k: usize| {
        let missed = |c: &usize| all[k].verdicts[*c] == Verdict::Differs;
        (0..CLAIMS.len()).filter(missed).map(|c| letter(c).to_string()).collect::<Vec<_>>()
    };
    for (what, in_text) in [
        ("The reading that agrees with most", false),
        ("Without 28 and 32 A, for which nothing in the text speaks", true),
    ] {
        let winners = best(all, in_text);
        let first = winners.first().copied().unwrap_or(0);
        let (agrees, in_part) = all[first].counts();
        writeln!(
            text,
            "\n**{what}:** {}. {agrees} of {} claims agree, {in_part} in part; it misses {}.",
            names(&winners),
            CLAIMS.len(),
            missed(first).join(", ")
        )?;
    }
    let (agrees, in_part) = all[0].counts();
    write!(text, "\nAs shipped, {agrees} agree and {in_part} in part.")?;
    let none = (0..CLAIMS.len()).filter(|&c| agreeing(all, c, Verdict::Agrees).is_empty());
    let none: Vec<_> = none.map(|c| format!("{} ({})", letter(c), CLAIMS[c].paper)).collect();
    let none = if none.is_empty() { "nothing".to_owned() } else { none.join("; ") };
    writeln!(
        text,
        "\n\n**What none of them gives:** {none}. No reading gives at once: {}.",
        apart(all)
    )?;
    let whole = all.iter().any(|it| it.counts().0 == CLAIMS.len());
    let answer = if whole { "A reading gives all of it." } else { "No reading gives all of it." };
    writeln!(text, "{answer}")?;
    Ok(())
}

/// Pairs of claims of which each is given by some reading, and both by none.
fn apart(all: &[Judged]) -> String {
    let gives = |it: &Judged, claim: usize| it.verdicts[claim] == Verdict::Agrees;
    let some = |claim: usize| all.iter().any(|it| gives(it, claim));
    let mut pairs = Vec::new();
    for a in 0..CLAIMS.len() {
        for b in a + 1..CLAIMS.len() {
            if some(a) && some(b) && !all.iter().any(|it| gives(it, a) && gives(it, b)) {
                pairs.push(format!("{} and {}", letter(a), letter(b)));
            }
        }
    }
    if pairs.is_empty() { "nothing".to_owned() } else { pairs.join(", ") }
}

fn figure_14(text: &mut String, dataset: &Dataset, all: &[Judged]) -> Result<()> {
    text.push_str(
        "\nFigure 14 by reading: the largest gap deviation (mm) for girders of 5, 6, 7 and 8 Hz, and the coupled mode of \
         the 7.1 Hz girder\nthat has most of the girder in it.\n\n![Figure 14 by reading](paper/readings-girders.svg)\n\n\
         | | reading | coupled mode | its damping | by stiffness | by mass |\n|---|---|---|---|---|---|\n",
    );
    let mut seen: Vec<Vec<String>> = Vec::new();
    for (k, Judged { reading, .. }) in all.iter().enumerate() {
        let cases = reading.girders();
        let names: Vec<String> = cases.iter().map(|it| it.name.clone()).collect();
        if seen.contains(&names) {
            continue;
        }
        let rows = cases.iter().map(|it| dataset.row(it.study.name(), &it.name));
        let rows = rows.collect::<Result<Vec<_>>>()?;
        let mode = Reading { force: 37.5, train: 37.5, ..*reading }.standstill();
        let mode = dataset.row(mode.study.name(), &mode.name)?;
        let shown = |value: Option<f64>, digits: usize| {
            value.map_or("–".to_owned(), |it| format!("{it:.digits$}"))
        };
        writeln!(
            text,
            "| {} | {} | {} | {} | {} | {} |",
            k + 1,
            reading.name,
            mode.mode_frequency.map_or("–".to_owned(), |it| format!("{it:.2} Hz")),
            shown(mode.mode_damping, 4),
            sizes(&rows[..4]),
            sizes(&rows[4..])
        )?;
        seen.push(names);
    }
    Ok(())
}

fn sizes(rows: &[&Row]) -> String {
    let size = |row: &&Row| match row.gap.filter(|_| row.finished()) {
        Some(gap) => format!("{:.3}", gap * 1e3),
        None => "ends".to_owned(),
    };
    rows.iter().map(size).collect::<Vec<_>>().join(" / ")
}
