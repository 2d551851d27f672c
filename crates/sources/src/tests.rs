use std::fs;

use scenario::SignalOverTime;

use super::*;

fn source(text: &str) -> Source {
    Source::new(&serde_json::from_str::<SignalOverTime>(text).unwrap()).unwrap()
}

/// Derivatives of all formulas by differences of the next lower one.
#[test]
fn analytic_derivatives_are_those_of_the_value() {
    for (text, times) in [
        (r#"{"type":"ramp","start":1,"end":3,"from":2,"to":7}"#, [0.5, 1.7, 4.0]),
        (r#"{"type":"pulse","start":1,"end":3,"height":5,"base":1}"#, [0.5, 1.3, 2.6]),
        (r#"{"type":"sine","amplitude":2,"frequency":1.5,"phase":0.3,"mean":4}"#, [-1.0, 0.2, 2.0]),
        (r#"{"type":"chirp","amplitude":2,"from":1,"to":3,"start":0.5,"end":4}"#, [0.2, 1.0, 3.0]),
        (
            r#"{"type":"table","times":[0,1,3,4],"values":[1,4,2,0],"interpolation":"cubic"}"#,
            [0.4, 1.7, 3.2],
        ),
        (r#"{"type":"table","times":[0,1,3],"values":[1,4,2]}"#, [0.4, 1.7, 5.0]),
        (r#"{"type":"noise","rms":2,"interval":0.25,"seed":3}"#, [0.4, 1.7, 5.1]),
    ] {
        let it = source(text);
        for time in times {
            let (d, p) = (1e-5, it.at(time));
            let (before, after) = (it.at(time - d), it.at(time + d));
            for k in 0..3 {
                let difference = (after[k] - before[k]) / (2.0 * d);
                let error = (difference - p[k + 1]).abs();
                assert!(error < 1e-5 * (1.0 + p[k + 1].abs()), "{text} {time} {k}: {error}");
            }
        }
    }
}

#[test]
fn analytic_points_are_interpolated_as_documented() {
    let table = |interpolation: &str| {
        let points = r#""times":[0,1,3],"values":[0,1,9]"#;
        source(&format!(r#"{{"type":"table",{points},"interpolation":"{interpolation}"}}"#))
    };
    let value = |it: &Source, time: f64| it.at(time)[0];
    let (linear, hold, cubic) = (table("linear"), table("hold"), table("cubic"));
    assert_eq!([-1.0, 0.5, 2.0, 4.0].map(|t| value(&linear, t)), [0.0, 0.5, 5.0, 9.0]);
    assert_eq!([-1.0, 0.5, 1.0, 2.9, 3.0].map(|t| value(&hold, t)), [0.0, 0.0, 1.0, 1.0, 9.0]);
    // exact for the parabola t²
    for time in [0.25, 0.5, 1.5, 2.75] {
        assert!((value(&cubic, time) - time * time).abs() < 1e-12, "{time}");
    }
    // over a step with points inside: through both ends
    let [y, slope, ..] = linear.course(0.5, 1.0, 1e-9);
    assert_eq!((y, y + slope), (0.5, 3.0));
    let [y, slope, second, third] = cubic.course(0.5, 1.0, 1e-9);
    assert!((y + slope + second / 2.0 + third / 6.0 - 2.25).abs() < 1e-12);
    // a jump within a step takes effect at its end, one that is nearly at its beginning there
    assert_eq!(hold.course(0.5, 1.0, 1e-6)[0], 0.0);
    assert_eq!(hold.course(1.0 - 1e-9, 0.5, 1e-6)[0], 1.0);
    assert_eq!(hold.course(0.5, 0.5, 1e-6)[0], 0.0);
}

#[test]
fn analytic_breaks_are_jumps_and_ends_of_formulas() {
    let breaks = |text: &str| {
        let all = source(text).breaks(0.0, 5.0).unwrap();
        all.iter().map(|it| (it.time, it.jump)).collect::<Vec<_>>()
    };
    assert_eq!(breaks(r#"{"type":"step","time":2,"after":1}"#), [(2.0, true)]);
    assert_eq!(breaks(r#"{"type":"step","time":5,"after":1}"#), []);
    assert_eq!(breaks(r#"{"type":"step","time":2,"before":1,"after":1}"#), []);
    assert_eq!(breaks(r#"{"type":"ramp","start":1,"end":9,"to":1}"#), [(1.0, false)]);
    let sine = r#"{"type":"sine","amplitude":1,"frequency":1,"start":1,"phase":PHASE}"#;
    assert_eq!(breaks(&sine.replace("PHASE", "0")), [(1.0, false)]);
    assert_eq!(breaks(&sine.replace("PHASE", "1")), [(1.0, true)]);
    let table = r#"{"type":"table","times":[0,1,2,3],"values":[1,1,4,2],"interpolation":"hold"}"#;
    assert_eq!(breaks(table), [(2.0, true), (3.0, true)]);
    let noise = r#"{"type":"noise","rms":1,"interval":2,"interpolation":"hold"}"#;
    assert_eq!(breaks(noise), [(0.0, true), (2.0, true), (4.0, true)]);
    let often = source(r#"{"type":"noise","rms":1,"interval":1e-9,"interpolation":"hold"}"#);
    assert!(matches!(often.breaks(0.0, 5.0), Err(SourceError::TooMany)));
}

/// Mean, variance and correlation of neighbours of 40,000 values.
#[test]
fn analytic_noise_has_its_statistics_and_its_seed() {
    let noise = |seed: u32| {
        let text = format!(
            r#"{{"type":"noise","rms":3,"interval":0.1,"mean":1,"seed":{seed},"interpolation":"hold"}}"#
        );
        let it = source(&text);
        (0..40_000).map(|n| it.at(f64::from(n) * 0.1)[0] - 1.0).collect::<Vec<_>>()
    };
    let values = noise(1);
    let mean = |list: &mut dyn Iterator<Item = f64>| list.sum::<f64>() / 40_000.0;
    assert!(mean(&mut values.iter().copied()).abs() < 0.06);
    let variance = mean(&mut values.iter().map(|x| x * x));
    assert!((variance / 9.0 - 1.0).abs() < 0.03, "{variance}");
    assert!(mean(&mut values.windows(2).map(|pair| pair[0] * pair[1])).abs() < 0.18);
    assert_eq!(values, noise(1));
    assert_ne!(values[..10], noise(2)[..10]);
}

#[test]
fn refusal_files_say_where_they_are_wrong() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("track.csv");
    let read = |content: &str, column: &str| {
        fs::write(&path, content).unwrap();
        let signal =
            serde_json::json!({ "type": "csv", "file": path, "column": column, "delay": 1 });
        Source::new(&serde_json::from_value::<SignalOverTime>(signal).unwrap())
    };
    let good = read("\u{feff}time, y\n0, 2\n1,\n2, 6\n", "y").unwrap();
    assert_eq!(good.at(2.0)[0], 4.0, "a row without a value is left out, times are delayed");
    for (content, column, parts) in [
        ("time,height\n0,1\n", "heigth", ["no column \"heigth\"", "did you mean \"height\"?"]),
        ("time,y\n0,1\n0,2\n", "y", ["line 3", "not after the one before"]),
        ("time,y\n0,1\n1,NaN\n", "y", ["line 3", "\"NaN\" is not a finite number"]),
        ("time,y\n0,1,5\n", "y", ["line 2", "3 fields under a header of 2"]),
        ("time,y\nx,1\n", "y", ["line 2, column \"time\"", "\"x\""]),
        ("time,y\n0,\n", "y", ["no values", "\"y\""]),
    ] {
        let error = read(content, column).unwrap_err().to_string();
        assert!(parts.iter().all(|part| error.contains(part)), "{error}");
    }
    let missing = r#"{"type":"csv","file":"no/where.csv","column":"y"}"#;
    let error = Source::new(&serde_json::from_str::<SignalOverTime>(missing).unwrap()).unwrap_err();
    assert!(error.to_string().contains("cannot read no/where.csv") && error.help().is_some());
}

/// Two columns of 32-bit and 64-bit floats with a null, and a text, compressed as pandas does.
fn parquet_file(path: &std::path::Path, times: &[f64]) {
    use parquet::basic::Compression;
    use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, FloatType};
    use parquet::file::properties::WriterProperties;
    use parquet::file::writer::SerializedFileWriter;
    use parquet::schema::parser::parse_message_type;

    let schema =
        "message m { OPTIONAL FLOAT y; REQUIRED BYTE_ARRAY note (UTF8); REQUIRED DOUBLE time; }";
    let schema = parse_message_type(schema).unwrap().into();
    let snappy = WriterProperties::builder().set_compression(Compression::SNAPPY).build();
    let file = fs::File::create(path).unwrap();
    let mut writer = SerializedFileWriter::new(file, schema, snappy.into()).unwrap();
    // two groups of rows
    for times in [&times[..2], &times[2..]] {
        let mut group = writer.next_row_group().unwrap();
        let mut column = group.next_column().unwrap().unwrap();
        let levels: Vec<i16> = (0..times.len()).map(|k| i16::from(k != 1)).collect();
        let values: Vec<f32> = times.iter().map(|t| *t as f32 * 2.0).collect();
        let present: Vec<f32> =
            values.iter().zip(&levels).filter(|(_, level)| **level == 1).map(|it| *it.0).collect();
        column.typed::<FloatType>().write_batch(&present, Some(&levels), None).unwrap();
        column.close().unwrap();
        let mut column = group.next_column().unwrap().unwrap();
        let notes = vec![ByteArray::from("n"); times.len()];
        column.typed::<ByteArrayType>().write_batch(&notes, None, None).unwrap();
        column.close().unwrap();
        let mut column = group.next_column().unwrap().unwrap();
        column.typed::<DoubleType>().write_batch(times, None, None).unwrap();
        column.close().unwrap();
        group.close().unwrap();
    }
    writer.close().unwrap();
}

#[test]
fn analytic_parquet_files_are_read_as_csv_files_are() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("track.parquet");
    let read = |column: &str| {
        let signal = serde_json::json!({ "type": "parquet", "file": path, "column": column,
            "factor": 3, "delay": 1 });
        Source::new(&serde_json::from_value::<SignalOverTime>(signal).unwrap())
    };
    parquet_file(&path, &[0.0, 1.0, 2.0, 4.0, 8.0]);
    let it = read("y").unwrap();
    // the rows at 1 and 4 have no value
    for (time, value) in [(0.0, 0.0), (1.0, 0.0), (2.0, 6.0), (3.0, 12.0), (6.0, 30.0), (9.0, 48.0)]
    {
        assert!((it.at(time)[0] - value).abs() < 1e-12, "{time}");
    }
    assert!(it.checksum() != 0);
    for (column, part) in [
        ("x", "no column \"x\"; its columns: y, note, time"),
        ("note", "row 1, column \"note\": \"\"n\"\" is not a finite number"),
    ] {
        let error = read(column).unwrap_err().to_string();
        assert!(error.contains(part), "{error}");
    }
    parquet_file(&path, &[0.0, 1.0, 2.0, 2.5, 2.0]);
    let error = read("y").unwrap_err().to_string();
    assert!(error.contains("row 5: the time 3 s is not after"), "{error}");
    fs::write(&path, "time,y\n0,1\n").unwrap();
    let error = read("y").unwrap_err();
    assert!(error.to_string().contains("as Parquet") && error.help().unwrap().contains("csv"));
    fs::remove_file(&path).unwrap();
    let error = read("y").unwrap_err();
    assert!(error.to_string().contains("cannot read") && error.help().is_some());
}
