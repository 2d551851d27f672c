//! Messages of FMUs to the logger (FMI 2.0.5, sections 2.1.3 and 2.1.5).

use std::ffi::CString;

use crate::harness::bench::Bench;
use crate::harness::drive::c_string;
use crate::harness::log::{InstanceLog, LogMessage};
use crate::harness::raw::{Raw, ok};
use crate::harness::{CheckResult, Stop, skip, table};
use fmi2_import::description::Type;

table! {
    "logger-caller", "2.1.5", Error, "messages have the caller's environment and the instance's name", caller;
    "logger-category", "2.2.4", Warning, "the category of a message is not null and is declared in LogCategories", category;
    "logger-off", "2.1.5", Warning, "an ordinary run without debug logging logs nothing", off;
    "logger-format", "2.1.5", Error, "texts of the caller are not used as format strings", format;
    "logger-error", "2.1.3", Warning, "an error comes with a message", error;
    "logger-control", "2.1.5", Error, "the declared log categories can be switched on and off", control;
}

/// All messages of an instance with debug logging in a run with some errors.
fn provoke(bench: &Bench, name: &str) -> Result<Vec<LogMessage>, Stop> {
    let mut making = bench.making(name);
    making.logging = true;
    let mut records = Vec::new();
    match Raw::make(bench, &making) {
        Ok(unit) => {
            unit.initialize()?;
            unit.run(0, 2)?;
            unit.do_step(bench.time(2), -1.0);
            unit.reset();
            unit.get_real(&[u32::MAX], &mut [0.0]);
            records.extend(unit.logged());
        }
        Err(said) => records.extend(said),
    }
    making.guid = Some(c_string("{another}"));
    if let Err(said) = Raw::make(bench, &making) {
        records.extend(said);
    }
    Ok(records)
}

fn caller(bench: &Bench) -> CheckResult {
    InstanceLog::take_stray();
    let records = provoke(bench, "the caller's name")?;
    let stray = InstanceLog::take_stray();
    if stray > 0 {
        bench.find(format!("{stray} messages have another componentEnvironment"));
    }
    let other = records.iter().find(|it| it.instance.as_deref() != Some("the caller's name"));
    if let Some(record) = other {
        let (name, text) = (&record.instance, &record.text);
        bench.find(format!("a message has the instance name {name:?}: {text:?}"));
    }
    if let Some(record) = records.iter().find(|it| !(0..=5).contains(&it.status)) {
        bench.find(format!("a message has the status {}", record.status));
    }
    Ok(())
}

fn category(bench: &Bench) -> CheckResult {
    let declared = &bench.description().log_categories;
    for record in provoke(bench, "unit")? {
        match record.category {
            None => {
                bench.find(format!("a message has no category: {:?}", record.text));
                return Ok(());
            }
            Some(category) if !declared.is_empty() && !declared.contains(&category) => {
                bench.find(format!(
                    "the category \"{category}\" of a message is not declared: {:?}",
                    record.text
                ));
                return Ok(());
            }
            Some(_) => {}
        }
    }
    Ok(())
}

fn off(bench: &Bench) -> CheckResult {
    let unit = bench.initialized("unit")?;
    unit.run(0, 4)?;
    unit.terminate();
    let records = unit.logged();
    if let Some(first) = records.first() {
        let count = records.len();
        bench
            .find(format!("{count} messages without debug logging; the first is {:?}", first.text));
    }
    Ok(())
}

fn format(bench: &Bench) -> CheckResult {
    const TRAP: &str = "100%s%d%n";
    let mut making = bench.making(&format!("unit {TRAP}"));
    making.logging = true;
    let mut records = Vec::new();
    match Raw::make(bench, &making) {
        Ok(unit) => {
            unit.initialize()?;
            unit.debug_logging(true, &[c_string(TRAP)]);
            let text = bench.references(Type::String, |it| {
                it.causality == fmi2_import::description::Causality::Input
            });
            if let Some(&reference) = text.first() {
                unit.set_string(&[reference], &[c_string(TRAP)]);
            }
            unit.do_step(bench.time(0), -1.0);
            records.extend(unit.logged());
        }
        Err(said) => records.extend(said),
    }
    making.guid = Some(c_string(TRAP));
    if let Err(said) = Raw::make(bench, &making) {
        records.extend(said);
    }
    for record in records {
        if record.format.as_deref().is_some_and(|format| format.contains("%s%d%n")) {
            bench.find(format!(
                "a text of the caller is used as the format string of a message: {:?}; %n in it writes to memory",
                record.format.unwrap_or_default()
            ));
            return Ok(());
        }
    }
    Ok(())
}

fn error(bench: &Bench) -> CheckResult {
    let unit = bench.initialized("unit")?;
    ok(unit.debug_logging(true, &[]), "fmi2SetDebugLogging")?;
    unit.logged();
    unit.get_real(&[u32::MAX], &mut [0.0]);
    if unit.logged().is_empty() {
        bench.find("an unknown value reference was refused without a message");
    }
    Ok(())
}

fn control(bench: &Bench) -> CheckResult {
    let categories: Vec<CString> =
        bench.description().log_categories.iter().map(|name| c_string(name)).collect();
    let unit = bench.initialized("unit")?;
    for on in [true, false] {
        ok(unit.debug_logging(on, &[]), &format!("fmi2SetDebugLogging({on}) of all categories"))?;
        if !categories.is_empty() {
            let what = format!("fmi2SetDebugLogging({on}) of the declared categories");
            ok(unit.debug_logging(on, &categories), &what)?;
        }
    }
    if categories.is_empty() {
        return skip("no log categories are declared; switching all messages on and off works");
    }
    unit.run(0, 2)
}
