//! What the paper claims in sections 3.2 to 3.4, and whether a reading gives it.

use anyhow::Result;

use super::{
    catalogue::Reading,
    dataset::{Dataset, Row},
};
use crate::claims::{NEAR_LARGEST, STANDS_OUT, Verdict, trend};

/// A claim and its criterion.
#[derive(Debug, Clone, Copy)]
pub struct Claim {
    /// Section and figures.
    pub place: &'static str,
    /// What the paper reports, in our words.
    pub paper: &'static str,
    /// When a reading agrees.
    pub criterion: &'static str,
}

const fn new(place: &'static str, paper: &'static str, criterion: &'static str) -> Claim {
    Claim { place, paper, criterion }
}

/// All claims.
pub const CLAIMS: [Claim; 13] = [
    new(
        "3.2, fig. 11",
        "deflection of 3.5 mm at mid-span",
        "3.45 to 3.55 mm; in part: to 3.75 mm, for 3.7 mm was measured",
    ),
    new(
        "3.2",
        "gap RMS of 8.01 mm",
        "8.005 to 8.015 mm; in part: to 8.025 mm, for 8.02 mm was measured",
    ),
    new(
        "3.3, fig. 12",
        "gaps and deflection dominant at 7 s",
        "the largest of either between 6 and 8 s; in part: of one of them",
    ),
    new(
        "3.3, fig. 12",
        "gaps dominant at 25 s",
        "from 22 to 28 s 1.5 times those from 15 to 20 s, and largest within 1 s of 25 s",
    ),
    new(
        "3.3, fig. 12",
        "deflection dominant at 25 s",
        "from 22 to 28 s 1.5 times that from 15 to 20 s",
    ),
    new(
        "3.3, fig. 13",
        "the gaps' spectrum has the girder's two frequencies",
        "a peak within 1 Hz of 7.1 Hz and one within 2 % of 24.9 Hz; in part: one of them",
    ),
    new("3.3, fig. 14", "gaps fall from 5 to 8 Hz, by stiffness", FALLS),
    new("3.3, fig. 14", "deflection falls from 5 to 8 Hz, by stiffness", FALLS),
    new("3.3, fig. 14", "gaps fall from 5 to 8 Hz, by mass", FALLS),
    new("3.3, fig. 14", "deflection falls from 5 to 8 Hz, by mass", FALLS),
    new(
        "3.4, fig. 15",
        "vibration largest near the largest deflection",
        "the deflection is then 85 % of the largest in all spans",
    ),
    new(
        "3.4, fig. 16",
        "the gaps' spectrum grows at the first frequency",
        "density around 7.6 Hz 1.5 times that beside it",
    ),
    new(
        "3.4, fig. 16",
        "the gaps' spectrum grows at the second frequency",
        "density at 24 to 26 Hz 1.5 times that without the girders' second mode",
    ),
];

const FALLS: &str = "each smaller than the one before; in part: that of 5 Hz the largest";

/// The verdicts on all claims for a reading.
pub fn judge(reading: &Reading, dataset: &Dataset) -> Result<[Verdict; 13]> {
    let find = |case: super::case::Case| dataset.row(case.study.name(), &case.name);
    let standstill = find(reading.standstill())?;
    let girders = reading.girders().into_iter().map(find).collect::<Result<Vec<_>>>()?;
    let crossing = find(reading.crossing())?;
    let one_mode = reading.one_mode().map(find).transpose()?;
    let (stiffness, mass) = girders.split_at(4);
    Ok([
        deflection(crossing),
        rms(crossing),
        seven(standstill, reading.at_bogies),
        gaps_at_25(standstill),
        deflection_at_25(standstill, reading.at_bogies),
        two_peaks(standstill),
        falls(stiffness, |it| it.gap),
        falls(stiffness, |it| it.middle),
        falls(mass, |it| it.gap),
        falls(mass, |it| it.middle),
        near_largest(crossing),
        first(crossing),
        second(crossing, one_mode),
    ])
}

fn of(agrees: Option<bool>) -> Verdict {
    if agrees == Some(true) { Verdict::Agrees } else { Verdict::Differs }
}

/// Both, one, or none.
fn both(one: bool, other: bool) -> Verdict {
    match (one, other) {
        (true, true) => Verdict::Agrees,
        (false, false) => Verdict::Differs,
        _ => Verdict::InPart,
    }
}

/// Near the simulated value, or between it and the measured one.
fn near(value: Option<f64>, [simulated, measured]: [f64; 2], half: f64) -> Verdict {
    match value {
        Some(value) if (value - simulated).abs() < half => Verdict::Agrees,
        Some(value) if value > simulated && value < measured + half => Verdict::InPart,
        _ => Verdict::Differs,
    }
}

fn deflection(crossing: &Row) -> Verdict {
    near(crossing.deflection.filter(|_| crossing.finished()), [3.5e-3, 3.7e-3], 0.05e-3)
}

fn rms(crossing: &Row) -> Verdict {
    near(crossing.gap_rms.filter(|_| crossing.finished()), [8.01e-3, 8.02e-3], 0.005e-3)
}

fn seven(row: &Row, at_bogies: bool) -> Verdict {
    let near = |time: Option<f64>| row.finished() && time.is_some_and(|it| (it - 7.0).abs() < 1.0);
    both(near(row.gap_time), near(if at_bogies { row.bogie_time } else { row.middle_time }))
}

fn stands_out(there: Option<f64>, beside: Option<f64>) -> Option<bool> {
    Some(there? > STANDS_OUT * beside?)
}

fn gaps_at_25(row: &Row) -> Verdict {
    let near = row.gap_second_time.is_some_and(|it| (it - 25.0).abs() < 1.0);
    of(stands_out(row.gap_second, row.gap_between).map(|it| it && near && row.finished()))
}

fn deflection_at_25(row: &Row, at_bogies: bool) -> Verdict {
    let out = if at_bogies {
        stands_out(row.bogie_second, row.bogie_between)
    } else {
        stands_out(row.middle_second, row.middle_between)
    };
    of(out.map(|it| it && row.finished()))
}

fn two_peaks(row: &Row) -> Verdict {
    let has = |near: fn(f64) -> bool| {
        row.finished() && row.peaks.split(' ').filter_map(|it| it.parse().ok()).any(near)
    };
    both(has(|f| (f - 7.1).abs() < 1.0), has(|f| (f / 24.9 - 1.0).abs() < 0.02))
}

fn falls(rows: &[&Row], size: fn(&Row) -> Option<f64>) -> Verdict {
    let sizes: Option<Vec<f64>> =
        rows.iter().map(|it| size(it).filter(|_| it.finished())).collect();
    sizes.map_or(Verdict::Differs, |sizes| trend(&sizes))
}

fn near_largest(crossing: &Row) -> Verdict {
    of(crossing.share.map(|it| crossing.finished() && it > NEAR_LARGEST))
}

/// Whether anything excites the girders: a thousandth of the gaps' whole deviation is nothing.
fn excited(crossing: &Row) -> bool {
    let deviation = crossing.gap_rms.map(|rms| (rms.powi(2) - 8e-3_f64.powi(2)).max(0.0).sqrt());
    crossing.finished()
        && crossing.gap_fast.zip(deviation).is_some_and(|(fast, all)| fast > 1e-3 * all)
}

fn first(crossing: &Row) -> Verdict {
    of(crossing.gap_hump.map(|it| excited(crossing) && it > STANDS_OUT))
}

fn second(crossing: &Row, one_mode: Option<&Row>) -> Verdict {
    let without = one_mode.filter(|it| it.finished()).and_then(|it| it.gap_at_second);
    of(stands_out(crossing.gap_at_second, without).map(|it| it && excited(crossing)))
}

/// How many claims agree, and how many in part.
pub fn counts(verdicts: &[Verdict; 13]) -> (usize, usize) {
    let count = |verdict| verdicts.iter().filter(|it| **it == verdict).count();
    (count(Verdict::Agrees), count(Verdict::InPart))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::readings::list::readings;

    /// Verdicts follow from the rows: a number beyond a criterion changes the verdict on its claim, and no other.
    #[test]
    fn issue_verdicts_flip_with_the_dataset() {
        let good = Dataset::committed().unwrap();
        let shipped = readings()[0];
        let before = judge(&shipped, &good).unwrap();
        let changed = |case: super::super::case::Case, change: fn(&mut Row)| {
            let mut dataset = good.clone();
            let found = dataset.rows.iter_mut().find(|it| it.case == case.name);
            change(found.unwrap());
            let after = judge(&shipped, &dataset).unwrap();
            (0..13).filter(|&k| after[k] != before[k]).collect::<Vec<_>>()
        };
        assert_eq!(changed(shipped.crossing(), |it| it.deflection = Some(3.6e-3)), [0]);
        assert_eq!(changed(shipped.crossing(), |it| it.gap_rms = Some(8.02e-3)), [1]);
        assert_eq!(changed(shipped.crossing(), |it| it.share = Some(0.5)), [10]);
        assert_eq!(changed(shipped.standstill(), |it| it.gap_time = Some(8.5)), [2]);
        assert_eq!(changed(shipped.standstill(), |it| it.peaks = "7 25".to_owned()), [5]);
        let eight_by_stiffness = shipped.girders()[3].clone();
        assert_eq!(changed(eight_by_stiffness.clone(), |it| it.gap = Some(0.5e-3)), [6]);
        // a run that does not reach its end gives nothing
        let ended = changed(eight_by_stiffness, |it| it.status = "terminated".to_owned());
        assert_eq!(ended, [6, 7]);
    }

    #[test]
    fn analytic_verdicts_of_one_and_of_both() {
        assert_eq!(both(true, true), Verdict::Agrees);
        assert_eq!(both(true, false), Verdict::InPart);
        assert_eq!(both(false, false), Verdict::Differs);
        assert_eq!(stands_out(Some(1.6), Some(1.0)), Some(true));
        assert_eq!(stands_out(Some(1.4), Some(1.0)), Some(false));
        assert_eq!(stands_out(None, Some(1.0)), None);
    }
}
