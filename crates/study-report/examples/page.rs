//! Makes the report of a study: `cargo run -p study-report --example page FOLDER REPORT.html`.

use std::path::Path;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [folder, page] = arguments.as_slice() else {
        return Err("give the folder of a study and the file of the report".into());
    };
    let study = study_report::StudyResults::read(Path::new(folder))?;
    study_report::write(&study, None, Path::new(page))?;
    Ok(())
}
