//! Results folders of single points.

use std::path::Path;

use maglev::run::{Job, Unobserved};
use report::ReportError;
use results::RunResults;
use scenario::Scenario;
use study::worker::RunKeeper;

/// Runs points once more, with all that `maglev run` writes.
pub struct Keeper;

impl RunKeeper for Keeper {
    fn keep(&self, scenario: &Scenario, name: &str, folder: &Path) -> Result<(), String> {
        let ran = Job { scenario, name, folder }.run(&mut Unobserved);
        if let Err(error) = &ran
            && !folder.exists()
        {
            return Err(error.chain().join(": "));
        }
        let report = folder.join(results::REPORT);
        let made = RunResults::read(folder)
            .map_err(ReportError::from)
            .and_then(|run| report::write(&[run], &report));
        made.map_err(|error| error.chain().join(": "))
    }
}
