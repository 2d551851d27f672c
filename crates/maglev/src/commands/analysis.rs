//! What commands share that compute for long, but run nothing: threads, progress, files.

use std::path::{Path, PathBuf};

use indicatif::{ProgressBar, ProgressStyle};
use maglev::Error;
use maps::Watch;
use results::write_whole;

/// As many threads as were asked for, or as the machine has cores.
pub fn threads(asked: Option<u16>) -> usize {
    asked.map_or_else(|| std::thread::available_parallelism().map_or(1, usize::from), usize::from)
}

/// A bar on the terminal; nothing where stderr is not one.
pub struct Bar(ProgressBar);

impl Bar {
    /// With a template of `indicatif`.
    pub fn new(template: &str) -> Self {
        let bar = ProgressBar::new(0);
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        Self(bar)
    }

    /// Takes it from the terminal.
    pub fn close(&self) {
        self.0.finish_and_clear();
    }
}

impl Watch for Bar {
    fn stage(&self, text: &str) {
        self.0.set_message(text.to_owned());
    }

    fn progress(&self, done: usize, all: usize) {
        self.0.set_length(all as u64);
        self.0.set_position(done as u64);
    }
}

/// A folder for files that appear complete or not at all.
pub struct Files<'a>(&'a Path);

impl<'a> Files<'a> {
    /// Creates the folder if it does not exist.
    pub fn new(folder: &'a Path) -> Result<Self, Error> {
        std::fs::create_dir_all(folder).map_err(failed(folder.to_owned()))?;
        Ok(Self(folder))
    }

    /// Writes a file.
    pub fn write(&self, name: &str, content: &[u8]) -> Result<(), Error> {
        let path = self.0.join(name);
        write_whole(&path, content).map_err(failed(path))
    }

    /// Writes a picture as NAME.svg, and as NAME.png with so many pixels for each of its own.
    pub fn picture(
        &self,
        name: &str,
        svg: Result<String, figure::PlotError>,
        scale: f32,
    ) -> Result<(), Error> {
        let file = format!("{name}.svg");
        let svg = svg.map_err(|source| Error::Plot { file: file.clone(), source })?;
        self.write(&file, svg.as_bytes())?;
        let file = format!("{name}.png");
        let pixels = report::pictures::png(&svg, scale);
        let pixels = pixels.map_err(|message| Error::Pixels { file: file.clone(), message })?;
        self.write(&file, &pixels)
    }
}

fn failed(path: PathBuf) -> impl FnOnce(std::io::Error) -> Error {
    move |source| Error::Write { path, source }
}
