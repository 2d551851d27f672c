//! The location of the resources (FMI 2.0.5, section 2.1.5).

use std::fs;
use std::path::Path;

use crate::harness::bench::Bench;
use crate::harness::drive::{c_string, same};
use crate::harness::raw::Raw;
use crate::harness::{CheckResult, Stop, fault, table};
use fmi2_import::package::file_uri;

table! {
    "location-forms", "2.1.5", Error, "all forms of file URIs are accepted: file:/, file:///, file://localhost/, escaped characters", forms;
    "location-odd", "2.1.5", Warning, "a wrong, null or empty resource location does not crash", odd;
}

fn forms(bench: &Bench) -> CheckResult {
    let own = bench.package().resource_location();
    let path = own.trim_start_matches("file://").to_owned();
    let wanted = bench.initialized("usual")?.record(0, 2)?;
    let Ok(folder) = tempfile::tempdir() else { return fault("cannot make a temporary folder") };
    let odd = folder.path().join("a folder 100% ü #1 [x]").join("resources");
    let copied = fs::create_dir_all(&odd).and_then(|()| copy(&bench.package().resources(), &odd));
    if let Err(error) = copied {
        return fault(format!("cannot copy the resources: {error}"));
    }
    for location in [
        format!("file:{path}"),
        format!("file://localhost{path}"),
        format!("file://{path}/"),
        file_uri(&odd),
    ] {
        bench.part(&format!("resource location {location}"));
        let mut making = bench.making("unit");
        making.location = Some(c_string(&location));
        let Ok(unit) = Raw::make(bench, &making) else {
            bench.find(format!("fmi2Instantiate refused the resource location {location}"));
            continue;
        };
        match unit.initialize().and_then(|()| unit.record(0, 2)) {
            Ok(record) => same(bench, &record, &wanted, &format!("with the location {location}"))?,
            Err(Stop::Fault(text)) => bench.find(format!("with the location {location}: {text}")),
            Err(skip) => return Err(skip),
        }
    }
    Ok(())
}

fn copy(from: &Path, to: &Path) -> std::io::Result<()> {
    if !from.is_dir() {
        return Ok(());
    }
    for entry in fs::read_dir(from)? {
        let entry = entry?;
        let target = to.join(entry.file_name());
        if entry.file_type()?.is_dir() {
            fs::create_dir_all(&target)?;
            copy(&entry.path(), &target)?;
        } else {
            fs::copy(entry.path(), target)?;
        }
    }
    Ok(())
}

fn odd(bench: &Bench) -> CheckResult {
    for location in [
        None,
        Some(""),
        Some("file:///no/such/folder/resources"),
        Some("file:///%zz%"),
        Some("https://example.org/resources"),
        Some("no uri at all"),
    ] {
        bench.part(&format!("resource location {location:?}"));
        let mut making = bench.making("unit");
        making.location = location.map(c_string);
        // an FMU without its resources may refuse any call
        if let Ok(unit) = Raw::make(bench, &making)
            && unit.initialize().is_ok()
        {
            let _ = unit.run(0, 2);
        }
    }
    bench.initialized("afterwards")?.run(0, 2)
}
