//! Regions one inside the other, each with its boundary.

use std::sync::{Arc, Mutex, PoisonError};

use faer::prelude::c64;

use crate::branch::Point;
use crate::contour::Contour;
use crate::error::MapError;
use crate::region::Region;
use crate::space::{Level, Space};
use crate::system::Controllers;

/// Damping ratios of the rays, as parts of the outermost.
const STEPS: [f64; 9] = [-1.5, -0.8, -0.4, -0.15, 0.1, 0.32, 0.55, 0.78, 1.0];
/// Zeros within this part of the outermost damping ratio of a boundary are too near to it, if there is another.
const CLOSE: f64 = 0.12;

/// Regions of growing damping ratio about the same point. The least damped zero is certain as soon as all zeros of one
/// region that contains it are known: the smaller the region, the fewer these are. A region whose boundary runs through
/// a known zero is left out.
pub struct Ladder {
    /// Modes above this frequency |s| (rad/s) are counted and followed, but not looked at for the least damping.
    pub below: f64,
    top: Arc<Contour>,
    steps: Vec<Mutex<Option<Arc<Contour>>>>,
    /// The point at which boundaries are divided first, and the zeros there.
    first: (Level, Controllers, Vec<c64>),
}

impl Ladder {
    /// Regions up to this one, with boundaries that are divided first at a point with known zeros.
    ///
    /// # Errors
    /// A response has no eigenvalues.
    pub fn new(
        region: Region,
        below: f64,
        point: Point<'_>,
        known: &[c64],
    ) -> Result<Self, MapError> {
        let top = Arc::new(Contour::new(region, point, known)?);
        let mut steps: Vec<Mutex<Option<Arc<Contour>>>> =
            STEPS.iter().map(|_| Mutex::default()).collect();
        if let Some(last) = steps.last_mut() {
            *last = Mutex::new(Some(Arc::clone(&top)));
        }
        let first = (point.level.clone(), point.controllers.clone(), known.to_vec());
        Ok(Self { below, top, steps, first })
    }

    /// The outermost boundary.
    #[must_use]
    pub fn top(&self) -> &Contour {
        &self.top
    }

    /// Number of regions.
    pub(crate) fn len(&self) -> usize {
        self.steps.len()
    }

    pub(crate) fn damping(&self, step: usize) -> f64 {
        STEPS[step] * self.top.region.damping
    }

    /// A boundary, which is computed when it is first needed. It does not depend on who needs it.
    pub(crate) fn contour(&self, step: usize, space: &Space) -> Result<Arc<Contour>, MapError> {
        let mut place = self.steps[step].lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(contour) = place.as_ref() {
            return Ok(Arc::clone(contour));
        }
        let region = Region { damping: self.damping(step), ..self.top.region };
        let point = Point { space, level: &self.first.0, controllers: &self.first.1 };
        let equal = self.top.is_diagonal();
        let contour = Arc::new(Contour::with(region, equal, point, &self.first.2)?);
        *place = Some(Arc::clone(&contour));
        Ok(contour)
    }

    /// Steps whose region contains a zero with this damping ratio, the smallest first; those that run through known
    /// zeros come last.
    pub(crate) fn around(&self, least: f64, known: &[c64]) -> Vec<usize> {
        let close = CLOSE * self.top.region.damping;
        let mut all: Vec<usize> = (0..self.len()).filter(|&k| self.damping(k) > least).collect();
        let near = |k: usize| {
            let region = Region { damping: self.damping(k), ..self.top.region };
            let away = |s: &c64| region.clearance(*s);
            (known.iter().map(away).fold(close, f64::min) / close * 8.0) as i32
        };
        // the smallest of those that run clear of all zeros, then those that run further from them
        all.sort_by_key(|&k| -near(k));
        all
    }
}
