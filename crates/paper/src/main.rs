//! Writes `docs/paper.md`: every number of sections 3.2 to 3.4 of the paper beside the one computed here,
//! with the figures. `cargo xtask paper` builds what this program runs, and starts it.

// A program that reports its progress on the terminal.
#![allow(clippy::print_stderr)]

mod claims;
mod figures;
mod measure;
mod numbers;
mod page;
mod readings;
mod runs;

use std::{
    env, fs,
    path::{Path, PathBuf},
    time::Instant,
};

use anyhow::{Context, Result};
use clap::Parser;

use self::{numbers::Numbers, readings::Dataset};

/// Runs the scenarios of the paper's figures, and writes docs/paper.md with its numbers and figures
#[derive(Parser)]
#[command(name = "paper")]
struct Arguments {
    /// Use the results of the previous run instead of running the scenarios
    #[arg(long)]
    keep_results: bool,
    /// Run the study of readings in place of the figures' scenarios, and write its dataset and the page
    #[arg(long, conflicts_with = "keep_results")]
    readings: bool,
    /// Write the tables of points of that study only
    #[arg(long)]
    points: bool,
}

fn main() -> Result<()> {
    let start = Instant::now();
    let arguments = Arguments::parse();
    if arguments.points {
        return readings::write_tables();
    }
    if arguments.readings {
        let dataset = readings::run_all()?;
        write(&Dataset::file(), dataset.text()?)?;
        return finish(&Numbers::committed()?, &dataset, figures::of_readings(&dataset)?);
    }
    if !arguments.keep_results {
        runs::run_all()?;
    }
    let numbers = Numbers::measured()?;
    write(&Numbers::file(), serde_json::to_string_pretty(&numbers)? + "\n")?;
    let dataset = Dataset::committed()?;
    finish(&numbers, &dataset, figures::draw(&numbers, &dataset)?)?;
    eprintln!("{:.0} s", start.elapsed().as_secs_f64());
    Ok(())
}

/// Writes pictures and page.
fn finish(numbers: &Numbers, dataset: &Dataset, pictures: Vec<(&str, String)>) -> Result<()> {
    for (name, svg) in pictures {
        write(&root().join("docs/paper").join(name), svg)?;
    }
    // The page comes last: it may be refused, and the numbers are then needed to see why.
    write(&page_file(), page::page(numbers, dataset)?)
}

/// The root folder of the workspace.
fn root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.ancestors().nth(2).unwrap_or(here).to_path_buf()
}

/// Cargo's target folder; `CARGO_TARGET_DIR` may move it.
fn target_dir() -> PathBuf {
    root().join(env::var_os("CARGO_TARGET_DIR").unwrap_or_else(|| "target".into()))
}

fn page_file() -> PathBuf {
    root().join("docs/paper.md")
}

fn write(file: &PathBuf, content: String) -> Result<()> {
    let folder = file.parent().context("a file has a folder")?;
    fs::create_dir_all(folder)?;
    fs::write(file, content).with_context(|| format!("writing {}", file.display()))?;
    eprintln!("wrote {}", file.display());
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The page says what the committed numbers bear, and nothing else.
    #[test]
    fn golden_the_page_is_that_of_its_numbers() {
        let page =
            page::page(&Numbers::committed().unwrap(), &Dataset::committed().unwrap()).unwrap();
        let committed = fs::read_to_string(page_file()).unwrap().replace("\r\n", "\n");
        assert!(committed == page, "stale; run: cargo xtask paper");
    }

    /// Whatever reason a number carries, the page is refused when the number changes so much.
    #[test]
    fn issue_numbers_that_bear_no_reason_are_refused() {
        let good = Numbers::committed().unwrap();
        let dataset = Dataset::committed().unwrap();
        let refused = |change: fn(&mut Numbers)| {
            let mut numbers = good.clone();
            change(&mut numbers);
            page::page(&numbers, &dataset).unwrap_err().to_string()
        };
        assert!(refused(|it| it.low_speed.gap_rms = 8.1e-3).contains("RMS of the air gaps"));
        assert!(refused(|it| it.standstill.modes.clear()).contains("7 Hz"));
        assert!(refused(|it| it.standstill.gap_second.size = 1e-3).contains("25 Hz"));
        assert!(refused(|it| it.low_speed.gap_rms_fast = 1e-3).contains("spectrum grows"));
    }

    /// A verdict follows from the numbers.
    #[test]
    fn issue_verdicts_flip_with_the_numbers() {
        let mut numbers = Numbers::committed().unwrap();
        let verdict = |numbers: &Numbers| claims::verification(numbers).unwrap()[0].verdict;
        assert_eq!(verdict(&numbers), claims::Verdict::Agrees);
        numbers.low_speed.deflections = [3.56e-3; 3];
        assert_eq!(verdict(&numbers), claims::Verdict::Differs);
    }
}
