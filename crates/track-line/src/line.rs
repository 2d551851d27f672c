//! The assembled line.

use nalgebra::{Matrix3, Vector3};

use crate::Error;
use crate::cell::{Cell, LENGTH};
use crate::description::LineDescription;
use crate::frame::{Frame, Meeting};
use crate::profile::AngleProfile;

/// Steps of Newton's method for the foot of a point; three reach rounding for a train's length.
const STEPS: usize = 20;
/// A last step of at most this length (m) is taken by series: it loses (κ·1e-5)³/6 of the axes, and Newton's
/// method κ·1e-10 m of the foot.
const SHORT: f64 = 1e-5;
/// Difference up to which curvatures (1/m), slopes and cants (rad) are the same: rounding of radii and of
/// angles that are sums over pieces.
const ALIKE: f64 = 1e-12;
/// Smallest stretch, the fraction of the radius of curvature that is left below a point.
const LEAST_STRETCH: f64 = 0.1;

/// A line ready to be asked for frames: made once by [`Line::new`], never changed. Arc lengths are
/// positions along the track.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    name: String,
    start: f64,
    /// From s = 0 of the description on.
    cells: Vec<Cell>,
    /// The frame where the last piece ends.
    end: Frame,
}

impl Line {
    /// Checks and assembles a line.
    ///
    /// # Errors
    /// [`Error::Invalid`].
    pub fn new(description: &LineDescription) -> Result<Self, Error> {
        description.check()?;
        let heading = AngleProfile::of_pieces(&description.plan);
        let slope = AngleProfile::of_pieces(&description.elevation);
        let cant = AngleProfile::of_cant(&description.cant);
        let mut knots: Vec<f64> =
            heading.knots().chain(slope.knots()).chain(cant.knots()).collect();
        knots.sort_by(f64::total_cmp);
        // knots that are meant to coincide do so but for rounding
        knots.dedup_by(|b, a| *b - *a < 1e-9);
        let mut cells: Vec<Cell> = Vec::new();
        let mut place = Vector3::zeros();
        for (from, to) in knots.iter().zip(knots.iter().skip(1)) {
            let count = ((to - from) / LENGTH).ceil().max(1.0);
            for k in 0..count as usize {
                let at = |k: usize| from + (to - from) * (k as f64 / count);
                let (start, end) = (at(k), if k + 1 == count as usize { *to } else { at(k + 1) });
                let middle = 0.5 * (start + end);
                let angles = [heading.about(middle), slope.about(middle), cant.about(middle)];
                let cell = Cell::new(start, middle, angles, &place);
                place = cell.position(end);
                cells.push(cell);
            }
        }
        let last = knots.last().copied().unwrap_or(0.0);
        let angles = [heading.about(last), slope.about(last), cant.about(last)];
        let end = Cell::new(last, last, angles, &place).frame(last);
        Ok(Self { name: description.name.clone(), start: description.start, cells, end })
    }

    /// The line's name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Where the line begins and where its last piece ends, m.
    pub fn extent(&self) -> [f64; 2] {
        [self.start, self.start + self.end.s]
    }

    /// The frame at an arc length, m.
    pub fn frame(&self, s: f64) -> Frame {
        let along = s - self.start;
        let mut frame = if along < 0.0 {
            straight_on(&Frame::level(), along)
        } else if along >= self.end.s {
            straight_on(&self.end, along)
        } else {
            let k = self.cells.partition_point(|cell| cell.start <= along).saturating_sub(1);
            self.cells.get(k).map_or(self.end, |cell| cell.frame(along))
        };
        frame.s = s;
        frame
    }

    /// The foot of the point `origin.position + origin.axes·offset`, near the arc length `guess`.
    ///
    /// # Errors
    /// [`Error::NoPlace`].
    pub fn meet(
        &self,
        origin: &Frame,
        offset: &Vector3<f64>,
        guess: f64,
    ) -> Result<Meeting, Error> {
        let mut s = guess;
        for _ in 0..STEPS {
            let frame = self.frame(s);
            // differences of positions lose no digits far from the line's start
            let apart = origin.axes * offset - (frame.position - origin.position);
            let across = frame.axes.tr_mul(&apart);
            let meeting = Meeting { frame, across: Vector3::new(0.0, across.y, across.z) };
            let stretch = meeting.stretch();
            if stretch.is_nan() || stretch < LEAST_STRETCH {
                break;
            }
            let step = across.x / stretch;
            if step.abs() <= SHORT {
                return Ok(moved(&meeting, &apart, step));
            }
            s += step;
        }
        let point = origin.position + origin.axes * offset;
        Err(Error::NoPlace { x: point.x, y: point.y, z: point.z, near: s })
    }

    /// Whether the line is straight, level and without cant between two arc lengths, m.
    pub fn is_plain(&self, from: f64, to: f64) -> bool {
        let [start, end] = self.extent();
        let inner =
            self.cells.iter().map(|cell| start + cell.middle).filter(|s| from < *s && *s < to);
        let plain = |s: f64| {
            let Frame { axes, curvature, .. } = self.frame(s);
            curvature == Vector3::zeros() && axes[(2, 0)] == 0.0 && axes[(2, 1)] == 0.0
        };
        let mut ends =
            [from, to].into_iter().chain([start, end].into_iter().filter(|s| from < *s && *s < to));
        ends.all(plain) && inner.into_iter().all(plain)
    }
}

impl Line {
    /// Whether curvature, slope and cant are constant between two arc lengths, m.
    pub fn is_uniform(&self, from: f64, to: f64) -> bool {
        let [start, end] = self.extent();
        let first = self.frame(from);
        let uniform = |s: f64| {
            let frame = self.frame(s);
            let bend = (frame.curvature - first.curvature).amax() < ALIKE;
            let tilt = (frame.axes.row(2) - first.axes.row(2)).amax() < ALIKE;
            bend && tilt && frame.curvature_rate.amax() < ALIKE
        };
        let inner = self.cells.iter().map(|cell| start + cell.middle);
        let mut places = [from, to, start, end].into_iter().chain(inner);
        places.all(|s| s < from || s > to || uniform(s))
    }
}

impl Frame {
    /// The frame of a straight, level line at its origin.
    pub fn level() -> Self {
        Self {
            s: 0.0,
            position: Vector3::zeros(),
            axes: Matrix3::identity(),
            curvature: Vector3::zeros(),
            curvature_rate: Vector3::zeros(),
        }
    }
}

fn straight_on(frame: &Frame, s: f64) -> Frame {
    let tangent = frame.axes.column(0);
    Frame {
        position: frame.position + tangent * (s - frame.s),
        curvature: Vector3::zeros(),
        curvature_rate: Vector3::zeros(),
        ..*frame
    }
}

/// A meeting whose foot moves by the last short step, by the series of the frame to second order.
fn moved(meeting: &Meeting, apart: &Vector3<f64>, step: f64) -> Meeting {
    let Frame { s, position, axes, curvature, curvature_rate } = meeting.frame;
    let half = 0.5 * step;
    let bend = curvature.cross(&Vector3::x()) * half;
    let ahead = axes * ((Vector3::x() + bend) * step);
    let turn = (curvature + curvature_rate * half).cross_matrix() * step;
    let turned = axes * (Matrix3::identity() + turn + turn * turn * 0.5);
    let across = turned.tr_mul(&(apart - ahead));
    Meeting {
        frame: Frame {
            s: s + step,
            position: position + ahead,
            axes: turned,
            curvature: curvature + curvature_rate * step,
            curvature_rate,
        },
        across: Vector3::new(0.0, across.y, across.z),
    }
}
