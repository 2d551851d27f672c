//! Size, axes and limits of a figure.

use std::ops::Range;

/// Pixels per millimetre of SVG: 96 per inch.
const PIXELS: f64 = 96.0 / 25.4;

/// How a figure is drawn. By default as wide as a page, with linear axes over everything.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FigureStyle {
    /// Width and height (mm) of the whole figure, whose letters then have 8 to 9 points.
    pub size: Option<(f64, f64)>,
    /// Limits of the horizontal axis.
    pub across: Option<Range<f64>>,
    /// Limits of the vertical axes, of the panels with this label or of all others.
    pub up: Vec<(Option<String>, Range<f64>)>,
    /// Whether the horizontal axis is logarithmic.
    pub log_across: bool,
    /// Whether the vertical axes are logarithmic.
    pub log_up: bool,
}

impl FigureStyle {
    /// Limits of the vertical axis of the panel with a label.
    pub(crate) fn limits(&self, label: &str) -> Option<Range<f64>> {
        let own = self.up.iter().find(|(name, _)| name.as_deref() == Some(label));
        let found = own.or_else(|| self.up.iter().find(|(name, _)| name.is_none()));
        found.map(|(_, range)| range.clone())
    }

    pub(crate) fn layout(&self) -> Layout {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a length of paper"
        )]
        let pixels = |length: f64| (length * PIXELS).round().max(1.0) as u32;
        match self.size {
            None => Layout::PAGE,
            Some((width, height)) => {
                Layout { width: pixels(width), height: Some(pixels(height)), ..Layout::PAPER }
            }
        }
    }
}

/// Lengths of a figure in pixels.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Layout {
    pub(crate) width: u32,
    /// Height of the whole figure, otherwise as its panels need.
    pub(crate) height: Option<u32>,
    pub(crate) title: u32,
    pub(crate) title_font: u32,
    /// Width of the labels of the vertical axis.
    pub(crate) labels: u32,
    /// Height of the labels of the horizontal axis, with and without its name.
    pub(crate) below: [u32; 2],
    pub(crate) font: u32,
    pub(crate) axis_font: u32,
    pub(crate) margin: u32,
    pub(crate) right_margin: u32,
}

impl Layout {
    const PAGE: Self = Self {
        width: 1100,
        height: None,
        title: 44,
        title_font: 20,
        labels: 84,
        below: [46, 26],
        font: 13,
        axis_font: 15,
        margin: 8,
        right_margin: 24,
    };
    const PAPER: Self = Self {
        title: 26,
        title_font: 13,
        labels: 58,
        below: [38, 20],
        font: 11,
        axis_font: 12,
        margin: 4,
        right_margin: 14,
        ..Self::PAGE
    };
}
