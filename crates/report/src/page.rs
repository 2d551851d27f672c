//! The page: the template, filled with data, styles and scripts.

use results::RunResults;
use serde::Serialize;

use crate::data::RunData;
use crate::detail::Detail;
use crate::embed::{Arrays, html as escape, script_json};
use crate::scene;
use crate::section::Section;
use crate::title::distinct_names;

const TEMPLATE: &str = include_str!("../assets/report.html");
const STYLES: [&str; 3] = [
    include_str!("../assets/vendor/uPlot.min.css"),
    include_str!("../assets/report.css"),
    include_str!("../assets/scene/scene.css"),
];
const UPLOT: &str = include_str!("../assets/vendor/uPlot.iife.min.js");
/// Scripts in the order in which they run, in one scope.
const SCRIPTS: [&str; 24] = [
    include_str!("../assets/base.js"),
    include_str!("../assets/print.js"),
    include_str!("../assets/axis.js"),
    include_str!("../assets/labels.js"),
    include_str!("../assets/chart.js"),
    include_str!("../assets/history.js"),
    include_str!("../assets/tables.js"),
    include_str!("../assets/summary.js"),
    include_str!("../assets/compared.js"),
    include_str!("../assets/verdicts.js"),
    include_str!("../assets/fourier.js"),
    include_str!("../assets/responses.js"),
    include_str!("../assets/sections.js"),
    include_str!("../assets/spectra.js"),
    include_str!("../assets/spectrogram.js"),
    include_str!("../assets/track.js"),
    include_str!("../assets/scene/course.js"),
    include_str!("../assets/scene/model.js"),
    include_str!("../assets/scene/track.js"),
    include_str!("../assets/scene/train.js"),
    include_str!("../assets/scene/stage.js"),
    include_str!("../assets/scene/side.js"),
    include_str!("../assets/scene/view.js"),
    include_str!("../assets/report.js"),
];

/// Data of the page.
#[derive(Serialize)]
struct PageData<'a> {
    version: &'static str,
    /// the title that the reader chose
    title: Option<&'a str>,
    three: Option<scene::ThreeLibrary>,
    runs: Vec<RunData<'a>>,
    sections: &'a [Section],
}

/// Makes the page. Without a title it is called by what ran.
#[must_use]
pub fn html(runs: &[RunResults], title: Option<&str>, sections: &[Section]) -> String {
    let mut arrays = Arrays::default();
    let names = distinct_names(runs);
    let runs_data: Vec<_> = runs
        .iter()
        .zip(names)
        .map(|(run, name)| RunData::new(run, name, Detail::of(runs.len()), &mut arrays))
        .collect();
    let three = runs_data.iter().any(RunData::has_scene);
    let data = PageData {
        version: env!("CARGO_PKG_VERSION"),
        title,
        three: three.then(|| scene::ThreeLibrary::new(&mut arrays)),
        runs: runs_data,
        sections,
    };
    // plain data can always be printed
    let text = script_json(&data).unwrap_or_default();
    let first = || data.runs.first().map(|run| run.title().to_owned());
    let title = escape(&title.map(str::to_owned).or_else(first).unwrap_or_default());
    assemble(&title, &STYLES.concat(), &text, &arrays, UPLOT, &SCRIPTS.concat())
}

/// Scripts that other pages share: data, elements, numbers, colours; print; sortable tables.
pub const SHARED_SCRIPTS: [&str; 3] = [SCRIPTS[0], SCRIPTS[1], include_str!("../assets/tables.js")];
/// The styles that other pages share.
pub const SHARED_STYLE: &str = STYLES[1];

/// Puts the parts of a page into the template. The title is HTML, the data is the JSON of
/// [`script_json`]; the scripts run in one scope, after the library.
#[must_use]
pub fn assemble(
    title: &str,
    styles: &str,
    data: &str,
    arrays: &Arrays,
    library: &str,
    scripts: &str,
) -> String {
    let scripts = format!("(async () => {{\n\"use strict\";\n{scripts}}})();");
    fill(&[
        ("title", title),
        ("styles", styles),
        ("data", data),
        ("arrays", &arrays.pack()),
        ("uplot", library),
        ("scripts", &scripts),
    ])
}

/// Replaces the placeholders of the template, which occur in this order. Inserted texts are not searched.
fn fill(places: &[(&str, &str)]) -> String {
    let mut page = String::new();
    let mut rest = TEMPLATE;
    for (name, text) in places {
        let place = format!("{{{{{name}}}}}");
        if let Some((before, after)) = rest.split_once(place.as_str()) {
            page.push_str(before);
            page.push_str(text);
            rest = after;
        }
    }
    page.push_str(rest);
    page
}

#[cfg(test)]
mod tests {
    use super::*;

    fn page(files: &[(&str, &str)]) -> String {
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in files {
            std::fs::write(folder.path().join(name), text).unwrap();
        }
        html(&[RunResults::read(folder.path()).unwrap()], None, &[])
    }

    /// Names and texts of a run stay texts: the page has only the elements of its template.
    #[test]
    fn issue_hostile_names_add_no_elements() {
        let hostile = "</script><script>alert(1)</script><!-- {{data}} {{scripts}}";
        let summary = serde_json::json!({"title": hostile, "status": "failed",
            "error": {"causes": [hostile], "help": hostile}, "signals": {hostile: {"unit": hostile}}});
        let scenario = serde_json::json!({"plots": [{"title": hostile, "panels": [
            {"ylabel": hostile, "signals": [hostile], "labels": [hostile]}]}]});
        let hostile_page = page(&[
            ("summary.json", &summary.to_string()),
            ("scenario-as-run.json", &scenario.to_string()),
            ("results.csv", &format!("time,\"{hostile}\"\n0,1\n1,2\n")),
        ]);
        let harmless = page(&[("results.csv", "time,a.x\n0,1\n1,2\n")]);
        for tag in ["<script", "</script", "<!--", "<title", "<style"] {
            let count = |text: &str| text.matches(tag).count();
            assert_eq!(count(&hostile_page), count(&harmless), "{tag}");
        }
        assert!(!hostile_page.contains("alert(1)<"));
    }

    #[test]
    fn issue_runs_without_an_end_rows_or_names_have_a_page() {
        for files in [
            vec![("results.csv.partial", "time,a.x\n0,1\n1,")],
            vec![("results.csv", "time\n")],
            vec![("results.csv", "time,a.x\n")],
            vec![("summary.json", "{\"status\": \"failed\"}")],
            vec![("results.csv", "time,a.x,b.y\n0,NaN,inf\n1,,-inf\n2,1e300,3\n")],
        ] {
            assert!(page(&files).ends_with("</html>\n"), "{files:?}");
        }
    }

    /// The files are those in the table of libraries, unchanged.
    #[test]
    fn golden_libraries_of_others_are_as_published() {
        use sha2::{Digest as _, Sha256};
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/vendor");
        let table = std::fs::read_to_string(format!("{folder}/README.md")).unwrap();
        let rows = table.lines().filter_map(|line| {
            let cells: Vec<&str> = line.split('|').map(str::trim).collect();
            cells
                .get(5)
                .filter(|it| it.len() == 64)
                .map(|it| (cells[1].to_owned(), (*it).to_owned()))
        });
        let rows: std::collections::BTreeMap<String, String> = rows.collect();
        for file in std::fs::read_dir(folder).unwrap() {
            let name = file.unwrap().file_name().into_string().unwrap();
            if name == "README.md" || name.ends_with("LICENSE") {
                continue;
            }
            let digest = Sha256::digest(std::fs::read(format!("{folder}/{name}")).unwrap());
            let digest: String = digest.iter().map(|byte| format!("{byte:02x}")).collect();
            assert_eq!(rows.get(&name), Some(&digest), "{name}");
        }
        assert!(rows.len() >= 5);
    }
}
