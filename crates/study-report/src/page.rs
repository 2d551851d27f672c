//! The page of a study: its data, in the template of single reports.

use std::path::Path;

use report::embed::{ArrayRef, Arrays, html as escape, script_json};
use report::page::{SHARED_SCRIPTS, SHARED_STYLE, assemble};
use serde::Serialize;
use serde_json::Value;

use crate::columns::{Column, ColumnKind, ColumnValues};
use crate::sensitivity::{self, Index, Indices, Level};
use crate::settings::Settings;
use crate::study_results::StudyResults;

const STYLE: &str = include_str!("../assets/study.css");
/// Scripts in the order in which they run, after those that are shared.
const SCRIPTS: [&str; 12] = [
    include_str!("../assets/points.js"),
    include_str!("../assets/picture.js"),
    include_str!("../assets/head.js"),
    include_str!("../assets/fit.js"),
    include_str!("../assets/contour.js"),
    include_str!("../assets/map.js"),
    include_str!("../assets/effects.js"),
    include_str!("../assets/quantiles.js"),
    include_str!("../assets/pareto.js"),
    include_str!("../assets/relations.js"),
    include_str!("../assets/table.js"),
    include_str!("../assets/study.js"),
];
/// Name of the figure that is 1 at points that did not reach their end.
const LOST: &str = "ended early or failed";

#[derive(Serialize)]
struct PageData<'a> {
    version: &'static str,
    title: String,
    folder: String,
    study: &'a Value,
    points: ArrayRef,
    columns: Vec<ColumnData<'a>>,
    /// texts of the statuses that occur, and the index of each point's
    statuses: Vec<&'a str>,
    status: ArrayRef,
    verdicts: Vec<&'a str>,
    verdict: ArrayRef,
    reached: ArrayRef,
    /// index of each point's setting
    setting: ArrayRef,
    /// paths of reports by the index of the point
    reports: Vec<(usize, String)>,
    messages: &'a [(u64, String)],
    effects: Vec<Effects>,
}

#[derive(Serialize)]
struct ColumnData<'a> {
    name: &'a str,
    title: &'a str,
    unit: &'a str,
    kind: &'static str,
    limits: [Option<f64>; 2],
    values: ArrayRef,
    texts: Option<&'a [String]>,
}

/// Effects of all factors on one figure.
#[derive(Serialize)]
struct Effects {
    /// title of the figure, and its column if it has one
    figure: String,
    column: Option<usize>,
    factors: Vec<usize>,
    /// levels of each factor: value, mean, deviation, count
    main: Vec<Vec<[f64; 4]>>,
    indices: Option<IndexData>,
    /// how the indices were computed, or why there are none
    method: String,
}

/// First-order and total index of a factor, and their intervals.
type IndexPair = ([f64; 2], [Option<[f64; 2]>; 2]);

#[derive(Serialize)]
struct IndexData {
    factors: Vec<IndexPair>,
    seeds: Option<f64>,
}

/// Makes the page. `path` is where it will be written: links to single reports are relative to its folder.
#[must_use]
pub fn html(study: &StudyResults, title: Option<&str>, path: &Path) -> String {
    let mut arrays = Arrays::default();
    let title = title.map_or_else(|| study.title(), str::to_owned);
    let settings = Settings::of(study);
    let (statuses, status) = coded(&study.status);
    let (verdicts, verdict) = coded(&study.limits);
    let mut setting = vec![0.0; study.points.len()];
    #[expect(clippy::cast_precision_loss, reason = "far below 2^53 points")]
    for (place, points) in settings.points.iter().enumerate() {
        points.iter().for_each(|&point| setting[point] = place as f64);
    }
    #[expect(clippy::cast_precision_loss, reason = "far below 2^53 points")]
    let numbers: Vec<f64> = study.points.iter().map(|&it| it as f64).collect();
    let data = PageData {
        version: env!("CARGO_PKG_VERSION"),
        title: title.clone(),
        folder: study.folder.display().to_string(),
        study: &study.study,
        points: arrays.f64(&numbers),
        columns: study.columns.iter().map(|it| column(it, &mut arrays)).collect(),
        status: arrays.u8(&status),
        statuses,
        verdict: arrays.u8(&verdict),
        verdicts,
        reached: arrays.f64(&study.reached),
        setting: arrays.f64(&setting),
        reports: links(study, path),
        messages: &study.messages,
        effects: effects(study, &settings),
    };
    // plain data can always be printed
    let text = script_json(&data).unwrap_or_default();
    let styles = [SHARED_STYLE, STYLE].concat();
    let scripts = [SHARED_SCRIPTS.concat(), SCRIPTS.concat()].concat();
    assemble(&escape(&title), &styles, &text, &arrays, "", &scripts)
}

fn column<'a>(it: &'a Column, arrays: &mut Arrays) -> ColumnData<'a> {
    #[expect(clippy::cast_precision_loss, reason = "far below 2^53 texts")]
    let (values, texts) = match &it.values {
        ColumnValues::Numbers(values) => (arrays.f64(values), None),
        ColumnValues::Texts(texts, places) => {
            let places: Vec<f64> = places.iter().map(|&it| it as f64).collect();
            (arrays.f64(&places), Some(texts.as_slice()))
        }
    };
    let kind = match it.kind {
        ColumnKind::Factor => "factor",
        ColumnKind::Seeds => "seeds",
        ColumnKind::Figure => "figure",
    };
    ColumnData {
        name: &it.name,
        title: &it.title,
        unit: &it.unit,
        kind,
        limits: it.limits,
        values,
        texts,
    }
}

/// The texts that occur, and the index of each; at most 256.
fn coded(texts: &[String]) -> (Vec<&str>, Vec<u8>) {
    let mut known: Vec<&str> = Vec::new();
    let mut places = Vec::with_capacity(texts.len());
    for text in texts {
        let place = known.iter().position(|it| it == text).unwrap_or_else(|| {
            known.push(text);
            known.len() - 1
        });
        places.push(u8::try_from(place).unwrap_or(u8::MAX));
    }
    (known, places)
}

/// Reports of single points, relative to the folder of the page where it is the study's, otherwise absolute.
fn links(study: &StudyResults, path: &Path) -> Vec<(usize, String)> {
    let absolute = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let folder = absolute(&study.folder);
    let beside = absolute(path).parent().is_some_and(|it| it == folder);
    let link = |report: &String| {
        if beside { report.clone() } else { folder.join(report).display().to_string() }
    };
    let known = study.reports.iter().enumerate();
    known.filter_map(|(k, report)| Some((k, link(report.as_ref()?)))).collect()
}

fn effects(study: &StudyResults, settings: &Settings) -> Vec<Effects> {
    let lost: Vec<f64> = (0..study.points.len())
        .map(|point| if study.ended_well(point) { 0.0 } else { 1.0 })
        .collect();
    let mut figures: Vec<(String, Option<usize>, Vec<f64>)> = Vec::new();
    for (k, column) in study.columns.iter().enumerate() {
        if let (ColumnKind::Figure, ColumnValues::Numbers(values)) = (column.kind, &column.values) {
            figures.push((column.title.clone(), Some(k), values.clone()));
        }
    }
    if lost.contains(&0.0) && lost.contains(&1.0) {
        figures.push((LOST.to_owned(), None, lost));
    }
    let of = |(figure, column, values): (String, Option<usize>, Vec<f64>)| {
        let means = settings.means(&values);
        let main = (0..settings.factors.len()).map(|d| {
            let factor: Vec<f64> = settings.values.iter().map(|row| row[d]).collect();
            #[expect(clippy::cast_precision_loss, reason = "far below 2^53 points")]
            let level = |it: Level| [it.value, it.mean, it.deviation, it.count as f64];
            sensitivity::main_effect(&factor, &means).into_iter().map(level).collect()
        });
        let main = main.collect();
        let (indices, method) = match sensitivity::indices(study, settings, &values) {
            Ok(Indices { factors, method, seeds }) => {
                let index =
                    |it: Index| ([it.first, it.total], [it.first_interval, it.total_interval]);
                let factors = factors.into_iter().map(index).collect();
                (Some(IndexData { factors, seeds }), method)
            }
            Err(why) => (None, format!("There are no Sobol indices: {why}.")),
        };
        Effects { figure, column, factors: settings.factors.clone(), main, indices, method }
    };
    figures.into_iter().map(of).collect()
}

#[cfg(test)]
mod tests {
    use crate::study_results::tests::study;

    /// Names and texts of a study stay texts: the page has only the elements of its template.
    #[test]
    fn issue_hostile_names_add_no_elements() {
        let hostile = "</script><script>alert(1)</script><!-- {{data}} {{scripts}}";
        let json =
            serde_json::json!({"title": hostile, "description": hostile, "factors": {hostile: {}}});
        let table =
            format!("point,\"{hostile}\",status,f\n1,{hostile},finished,2\n2,b,{hostile},3\n");
        let (folder, evil) = study(&json.to_string(), &table);
        let evil = super::html(&evil, None, &folder.path().join("r.html"));
        let (_folder, plain) = study("{}", "point,x,status,f\n1,1,finished,2\n");
        let plain = super::html(&plain, None, &folder.path().join("r.html"));
        for tag in ["<script", "</script", "<!--", "<title", "<style"] {
            let count = |text: &str| text.matches(tag).count();
            assert_eq!(count(&evil), count(&plain), "{tag}");
        }
        assert!(!evil.contains("alert(1)<"));
    }

    #[test]
    fn issue_studies_without_points_factors_or_figures_have_a_page() {
        for table in
            ["point,status\n", "point,x,status\n1,2,failed\n", "point,s,status,f\n1,2,finished,\n"]
        {
            let (folder, it) = study("{}", table);
            assert!(super::html(&it, Some("T"), folder.path()).ends_with("</html>\n"), "{table}");
        }
    }
}
