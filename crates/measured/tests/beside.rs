//! Records beside signals whose difference is known.

#![allow(clippy::unwrap_used, clippy::panic, clippy::result_large_err, reason = "a test program")]

use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

use measured::{MeasuredError, Offset, Record, RecordSpec, Units, align, as_run, compare, section};
use results::Table;

/// 20 s of a decaying oscillation of 4 Hz and 8 mm, which begins smoothly at 2 s.
fn signal(time: f64) -> f64 {
    let t = time - 2.0;
    if t < 0.0 {
        return 0.0;
    }
    8e-3 * (1.0 - (-(3.0 * t).powi(3)).exp()) * (-0.3 * t).exp() * (TAU * 4.0 * t).sin()
}

fn run() -> Table {
    let time: Vec<f64> = (0..=2000).map(|k| f64::from(k) * 0.01).collect();
    let columns = vec![time.iter().map(|it| signal(*it)).collect()];
    Table { names: vec!["girder.w".to_owned()], time, columns }
}

fn signals() -> Vec<(String, Option<String>)> {
    vec![("girder.w".to_owned(), Some("m".to_owned()))]
}

fn file(folder: &Path, text: &str) -> PathBuf {
    let path = folder.join("bridge.csv");
    std::fs::write(&path, text).unwrap();
    path
}

/// A record in mm, every 7 ms from 1.2345 s of the run on, with a clock that begins at 0 and 0.1 mm of a sine of 30 Hz.
fn record(folder: &Path) -> PathBuf {
    let mut text = "t (ms),w (mm)\n".to_owned();
    for k in 0..2000 {
        let time = f64::from(k) * 0.007;
        let value = 1e3 * signal(time + 1.2345) + 0.1 * (TAU * 30.0 * time).sin();
        text += &format!("{},{value}\n", 1e3 * time);
    }
    file(folder, &text)
}

fn spec(path: &Path, offset: Offset) -> RecordSpec {
    let mut spec = RecordSpec::of_file(path);
    spec.columns.push("w (mm)=girder.w".parse::<measured::MapEntry>().unwrap().0);
    spec.time = "t (ms)".to_owned();
    spec.offset = offset;
    spec
}

/// The difference is the sine of 0.1 mm: RMS 0.1/√2 mm, peak 0.1 mm; the coherence falls at 30 Hz alone.
#[test]
fn analytic_figures_of_a_known_difference() {
    let folder = tempfile::tempdir().unwrap();
    let spec = spec(&record(folder.path()), Offset::Given(1.2345));
    let record = Record::load(&spec, &signals(), &Units::default()).unwrap();
    assert_eq!(record.columns[0].file_unit.as_deref(), Some("mm"));
    let run = run();
    let found =
        compare(&record, ("run", &run), align(&record, &run, spec.offset).unwrap()).unwrap();
    let it = &found.signals[0];
    // the cubic between two values of the run, 25 to a period, is wrong by some 1e-3 of 8 mm
    assert!((it.rms_error - 1e-4 / 2_f64.sqrt()).abs() < 1e-6, "{}", it.rms_error);
    assert!((it.peak_error.abs() - 1e-4).abs() < 3e-5, "{}", it.peak_error);
    assert!(it.mean_error.abs() < 1e-6 && it.correlation.unwrap() > 0.999);
    let spread = it.measured.iter().map(|w| w * w).sum::<f64>() / it.samples as f64;
    assert!((it.relative_rms_error.unwrap() - it.rms_error / spread.sqrt()).abs() < 1e-3);
    let spectra = it.spectra.as_ref().unwrap();
    assert!((spectra.peak_measured.unwrap() - 4.0).abs() < 0.05);
    assert!((spectra.peak_run.unwrap() - 4.0).abs() < 0.05);
    let at = |frequency: f64| (frequency / spectra.resolution).round() as usize;
    assert!(spectra.coherence[at(4.0)] > 0.999 && spectra.coherence[at(30.0)] < 0.7);
    assert!(spectra.mean_coherence > 0.99, "{}", spectra.mean_coherence);
    let page = section(&[found]);
    assert_eq!((page.figures.len(), page.tables.len()), (3, 2));
    assert!(
        page.notes.iter().any(|it| it.text.contains("1.2345 s were added")),
        "{:?}",
        page.notes
    );
    let beside = as_run(&record, 1.2345);
    assert_eq!(beside.table.names, ["girder.w"]);
    assert!((beside.table.time[0] - 1.2345).abs() < 1e-12 && beside.table.columns[0].len() == 2000);
}

#[test]
fn analytic_the_offset_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let spec = spec(&record(folder.path()), Offset::Find);
    let record = Record::load(&spec, &signals(), &Units::default()).unwrap();
    let alignment = align(&record, &run(), spec.offset).unwrap();
    // a tenth of the interval of the run
    assert!((alignment.offset - 1.2345).abs() < 1e-3, "{alignment:?}");
    let found = alignment.found.unwrap();
    assert!(found.correlation > 0.99, "{found:?}");
}

/// Parquet, columns by their names, no unit: said, and taken as that of the signal.
#[test]
fn issue_columns_without_unit_are_taken_as_the_signals_and_reported() {
    let folder = tempfile::tempdir().unwrap();
    let text: String = (0..=1000).fold("time,girder.w,other\n".to_owned(), |text, k| {
        let time = f64::from(k) * 0.02;
        text + &format!("{time},{},7\n", signal(time))
    });
    let path = file(folder.path(), &text);
    let spec = RecordSpec::of_file(&path);
    let record = Record::load(&spec, &signals(), &Units::default()).unwrap();
    let run = run();
    let found =
        compare(&record, ("run", &run), align(&record, &run, spec.offset).unwrap()).unwrap();
    assert_eq!((found.signals.len(), found.signals[0].rms_error), (1, 0.0));
    let page = section(&[found]);
    assert!(
        page.notes.iter().any(|it| it.warning && it.text.contains("has no unit")),
        "{:?}",
        page.notes
    );
}

#[test]
fn refusal_records_that_do_not_fit_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = record(folder.path());
    let load = |spec: &RecordSpec| Record::load(spec, &signals(), &Units::default());
    let texts =
        |error: MeasuredError| error.chain().join(": ") + " | " + error.help().unwrap_or("");
    let mut wrong = spec(&path, Offset::Given(0.0));
    wrong.columns[0].unit = Some("kN".to_owned());
    let text = texts(load(&wrong).unwrap_err());
    assert!(text.contains("column \"w (mm)\"") && text.contains("kN is kg.m.s-2"), "{text}");
    wrong.columns[0].unit = Some("furlong".to_owned());
    assert!(texts(load(&wrong).unwrap_err()).contains("furlong is not defined"));
    let mut wrong = spec(&path, Offset::Given(0.0));
    wrong.columns[0].signal = "girder.v".to_owned();
    let text = texts(load(&wrong).unwrap_err());
    assert!(text.contains("did you mean \"girder.w\"?"), "{text}");
    let mut wrong = spec(&path, Offset::Given(0.0));
    wrong.columns.push(wrong.columns[0].clone());
    assert!(texts(load(&wrong).unwrap_err()).contains("two columns"));
    let mut wrong = spec(&path, Offset::Given(0.0));
    wrong.columns[0].column = "v".to_owned();
    assert!(texts(load(&wrong).unwrap_err()).contains("has no column \"v\""));
    wrong.columns.clear();
    let text = texts(load(&wrong).unwrap_err());
    assert!(text.contains("t (ms), w (mm)") && text.contains("--map"), "{text}");
    let mut wrong = spec(&path, Offset::Given(0.0));
    wrong.file = folder.path().join("none.csv");
    assert!(texts(load(&wrong).unwrap_err()).contains("none.csv"));
    // outside of the run
    let far = spec(&path, Offset::Given(100.0));
    let loaded = load(&far).unwrap();
    let alignment = align(&loaded, &run(), far.offset).unwrap();
    let text = texts(compare(&loaded, ("run", &run()), alignment).unwrap_err());
    assert!(
        text.contains("from 100 to 113.993 s, the run from 0 to 20 s") && text.contains("--offset"),
        "{text}"
    );
    // nothing in common with the run
    let flat = file(
        folder.path(),
        &(0..500).fold("time,girder.w\n".to_owned(), |text, k| {
            text + &format!("{},{}\n", f64::from(k) * 0.02, f64::from((k * 7919) % 101))
        }),
    );
    let mut spec = RecordSpec::of_file(&flat);
    spec.offset = Offset::Find;
    let loaded = load(&spec).unwrap();
    let text = texts(align(&loaded, &run(), spec.offset).unwrap_err());
    assert!(text.contains("best correlation coefficient is 0."), "{text}");
    let constant = file(
        folder.path(),
        &(0..500).fold("time,girder.w\n".to_owned(), |text, k| {
            text + &format!("{},1\n", f64::from(k) * 0.02)
        }),
    );
    spec.file = constant;
    let loaded = load(&spec).unwrap();
    assert!(texts(align(&loaded, &run(), spec.offset).unwrap_err()).contains("variance"));
}
