//! `cargo xtask paper`: the paper's figures as we compute them, and a page with every number of its
//! sections 3.2 to 3.4 beside ours.

mod claims;
mod figures;
mod measure;
mod numbers;
mod page;
mod runs;

use std::{fs, path::PathBuf, time::Instant};

use anyhow::{Context, Result};

use self::numbers::Numbers;
use crate::{
    package::{self, Order},
    workspace,
};

fn page_file() -> PathBuf {
    workspace::root().join("docs/paper.md")
}

/// Runs all scenarios, measures, judges, draws and writes. With `keep` the results of the last time
/// are taken.
pub fn paper(keep: bool) -> Result<()> {
    let start = Instant::now();
    if !keep {
        package::package(&Order::default())?;
        workspace::run(
            workspace::cargo(),
            &["build", "--release", "--quiet", "--package", "maglev-cli"],
        )?;
        runs::run_all()?;
    }
    let numbers = Numbers::measured()?;
    write(&Numbers::file(), serde_json::to_string_pretty(&numbers)? + "\n")?;
    for (name, svg) in figures::draw(&numbers)? {
        write(&workspace::root().join("docs/paper").join(name), svg)?;
    }
    // last, for it may refuse: the numbers are then there to be looked at
    write(&page_file(), page::page(&numbers)?)?;
    eprintln!("{:.0} s", start.elapsed().as_secs_f64());
    Ok(())
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
        let page = page::page(&Numbers::committed().unwrap()).unwrap();
        let committed = fs::read_to_string(page_file()).unwrap().replace("\r\n", "\n");
        assert!(committed == page, "stale; run: cargo xtask paper");
    }

    /// Whatever reason a number carries, the page is refused when the number changes so much.
    #[test]
    fn issue_numbers_that_bear_no_reason_are_refused() {
        let good = Numbers::committed().unwrap();
        let refused = |change: fn(&mut Numbers)| {
            let mut numbers = good.clone();
            change(&mut numbers);
            page::page(&numbers).unwrap_err().to_string()
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
