//! Options of `maglev report` for figures.

use std::ops::Range;

use clap::Args;
use report::pictures::{PictureOptions, PictureTitles};

/// How figures are drawn (--format svg,png).
#[derive(Args)]
#[command(next_help_heading = "Figures (--format svg,png)")]
pub struct FigureArguments {
    /// Width and height of each figure in mm, such as 90x60; its letters then have 8 to 9 points.
    #[arg(long, value_name = "WIDTHxHEIGHT", value_parser = size)]
    size: Option<(f64, f64)>,
    /// Limits of the time axis in s, such as 20..30.
    #[arg(long, value_name = "A..B", value_parser = limits, allow_hyphen_values = true)]
    time: Option<Range<f64>>,
    /// Limits of the frequency axis in Hz.
    #[arg(long, value_name = "A..B", value_parser = limits)]
    frequency: Option<Range<f64>>,
    /// Limits of values over time: of all panels, or of that with a label: 'air gap (mm)=6..10'.
    #[arg(long, value_name = "[LABEL=]A..B", value_parser = panel_limits, allow_hyphen_values = true)]
    values: Vec<PanelLimit>,
    /// Limits of the amplitudes of spectra, as for --values.
    #[arg(long, value_name = "[LABEL=]A..B", value_parser = panel_limits)]
    amplitudes: Vec<PanelLimit>,
    /// Logarithmic axes of spectra, separated by commas.
    #[arg(long, value_name = "AXES", value_delimiter = ',')]
    log: Vec<LogAxis>,
    /// Leave out the titles of figures.
    #[arg(long, conflicts_with = "title")]
    no_title: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum LogAxis {
    Frequency,
    Amplitude,
}

type PanelLimit = (Option<String>, Range<f64>);

impl FigureArguments {
    /// The first option that was given, by its name.
    pub fn given(&self) -> Option<&'static str> {
        let given = [
            ("--size", self.size.is_some()),
            ("--time", self.time.is_some()),
            ("--frequency", self.frequency.is_some()),
            ("--values", !self.values.is_empty()),
            ("--amplitudes", !self.amplitudes.is_empty()),
            ("--log", !self.log.is_empty()),
            ("--no-title", self.no_title),
        ];
        given.into_iter().find(|(_, given)| *given).map(|(name, _)| name)
    }

    /// The options, with the title of --title.
    pub fn options(&self, title: Option<&str>) -> PictureOptions {
        let titles = match title {
            Some(text) => PictureTitles::Text(text.to_owned()),
            None if self.no_title => PictureTitles::Off,
            None => PictureTitles::Plots,
        };
        PictureOptions {
            titles,
            size: self.size,
            time: self.time.clone(),
            frequency: self.frequency.clone(),
            values: self.values.clone(),
            amplitudes: self.amplitudes.clone(),
            log_frequency: self.log.contains(&LogAxis::Frequency),
            log_amplitude: self.log.contains(&LogAxis::Amplitude),
        }
    }
}

/// Parses `90x60`.
fn size(text: &str) -> Result<(f64, f64), String> {
    let read = || {
        let (width, height) = text.split_once('x')?;
        let side = |text: &str| text.trim().parse().ok().filter(|it| (20.0..=2000.0).contains(it));
        Some((side(width)?, side(height)?))
    };
    read().ok_or_else(|| "give width and height from 20 to 2000 mm, such as 90x60".to_owned())
}

/// Parses `2..5.5`.
fn limits(text: &str) -> Result<Range<f64>, String> {
    let read = || {
        let (start, end) = text.split_once("..")?;
        let number = |text: &str| text.trim().parse::<f64>().ok().filter(|it| it.is_finite());
        Some(number(start)?..number(end)?)
    };
    let range = read().ok_or("give two numbers, such as 2..5.5")?;
    if range.start < range.end {
        Ok(range)
    } else {
        Err("the first limit is not below the second".to_owned())
    }
}

/// Parses `2..5` and `LABEL=2..5`. The label may contain equals signs.
fn panel_limits(text: &str) -> Result<PanelLimit, String> {
    match text.rsplit_once('=') {
        Some((label, range)) => Ok((Some(label.to_owned()), limits(range)?)),
        None => Ok((None, limits(text)?)),
    }
}
