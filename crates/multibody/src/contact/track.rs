//! The rail at the magnets: at an instant, over a step, and as an evaluation remembers it.

use super::law::{Clearance, Contact};
use crate::loads::polynomial;
use crate::math::Vec3;
use crate::state::BodyState;

/// The rail at the magnets at an instant, one entry per magnet.
#[derive(Debug, Clone, Copy)]
pub struct TrackContact<'a> {
    /// Stops and skids.
    pub contact: Contact,
    /// Speed of the travelling frame along the track, m/s.
    pub speed: f64,
    /// Height of the track's surface, m, up positive.
    pub height: &'a [f64],
    /// Its rate as the moving magnet sees it, m/s.
    pub rate: &'a [f64],
    /// Rate of the rail's lateral displacement as the moving magnet sees it, m/s, left positive; an empty
    /// list means zeros.
    pub side_rate: &'a [f64],
}

/// The rail at one magnet.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RailPoint {
    pub height: f64,
    pub rate: f64,
    pub side_rate: f64,
    /// Speed of the travelling frame, m/s.
    pub speed: f64,
}

impl TrackContact<'_> {
    pub(crate) fn at(&self, k: usize) -> RailPoint {
        RailPoint {
            height: self.height[k],
            rate: self.rate[k],
            side_rate: self.side_rate.get(k).copied().unwrap_or(0.0),
            speed: self.speed,
        }
    }
}

/// The rail over a step: polynomials in the time τ since its start, u + u' τ + u'' τ²/2 + u''' τ³/6.
#[derive(Debug, Clone, Copy)]
pub struct TrackCourse<'a> {
    /// Stops and skids.
    pub contact: Contact,
    /// Speed of the travelling frame along the track, m/s.
    pub speed: [f64; 4],
    /// Height of the track's surface, m, up positive. Where no derivative is given, the height follows
    /// its rate.
    pub height: &'a [[f64; 4]],
    /// Its rate as the moving magnet sees it, m/s.
    pub rate: &'a [[f64; 4]],
    /// Rate of the rail's lateral displacement as the moving magnet sees it, m/s, left positive; an empty
    /// list means zeros.
    pub side_rate: &'a [[f64; 4]],
}

impl TrackCourse<'_> {
    /// The rail at magnet k after the time t.
    pub(crate) fn at(&self, k: usize, t: f64) -> RailPoint {
        RailPoint {
            height: self.height_at(k, t),
            rate: self.rate_at(k, t),
            side_rate: self.side_rate_at(k, t),
            speed: self.speed_at(t),
        }
    }

    /// Height of the track at magnet k after the time t.
    fn height_at(&self, k: usize, t: f64) -> f64 {
        let height = &self.height[k];
        if height[1..] == [0.0; 3] {
            let [v, a, j, _] = self.rate[k];
            polynomial(&[height[0], v, a, j], t)
        } else {
            polynomial(height, t)
        }
    }

    /// Speed of the frame.
    pub(crate) fn speed_at(&self, t: f64) -> f64 {
        polynomial(&self.speed, t)
    }

    /// Rate of the height.
    fn rate_at(&self, k: usize, t: f64) -> f64 {
        polynomial(&self.rate[k], t)
    }

    fn side_rate_at(&self, k: usize, t: f64) -> f64 {
        self.side_rate.get(k).map_or(0.0, |rate| polynomial(rate, t))
    }
}

/// What an evaluation remembers of the rail, and scratch memory of a step.
#[derive(Debug, Clone)]
pub(crate) struct ContactScratch {
    /// Stops and skids in force; none without contact.
    pub contact: Option<Contact>,
    pub speed: f64,
    pub height: Vec<f64>,
    pub rate: Vec<f64>,
    pub side_rate: Vec<f64>,
    /// Force on each magnet, of the last evaluation with contact; on a line in its axes at the magnet.
    pub force: Vec<Vec3>,
    /// Clearances at the start and at the end of an internal step.
    pub before: Vec<Clearance>,
    pub after: Vec<Clearance>,
    /// Bodies at the start of an internal step that may be repeated.
    pub start: Vec<BodyState>,
    /// Velocities of sliding at the end of an internal step, m/s.
    pub slip: Vec<[f64; 2]>,
    /// Sums by body, for the size of internal steps: stiffness, damping, friction and damping of an impact
    /// by mass.
    pub rates: Vec<[f64; 4]>,
    /// The same of stiffness and damping of an impact, of contacts that a step meets.
    pub open: Vec<[f64; 2]>,
    /// Largest vertical force of the rail on each magnet in the stages of an internal step, N.
    pub push: Vec<f64>,
}

impl ContactScratch {
    pub fn new(magnets: usize, start: Vec<BodyState>) -> Self {
        Self {
            contact: None,
            speed: 0.0,
            height: vec![0.0; magnets],
            rate: vec![0.0; magnets],
            side_rate: vec![0.0; magnets],
            force: vec![Vec3::zeros(); magnets],
            before: vec![Clearance::default(); magnets],
            after: vec![Clearance::default(); magnets],
            slip: vec![[0.0; 2]; magnets],
            rates: vec![[0.0; 4]; start.len()],
            open: vec![[0.0; 2]; start.len()],
            push: vec![0.0; magnets],
            start,
        }
    }

    /// Takes over the rail of an instant.
    pub fn set(&mut self, track: Option<&TrackContact>) {
        let track = track.filter(|track| track.contact.any());
        self.contact = track.map(|track| track.contact);
        if let Some(track) = track {
            self.speed = track.speed;
            self.height.copy_from_slice(track.height);
            self.rate.copy_from_slice(track.rate);
            for (k, rate) in self.side_rate.iter_mut().enumerate() {
                *rate = track.side_rate.get(k).copied().unwrap_or(0.0);
            }
        }
    }

    /// Takes over the rail of a step at the time t after its start.
    pub fn follow(&mut self, course: &TrackCourse, t: f64) {
        self.speed = course.speed_at(t);
        for (k, (height, rate)) in self.height.iter_mut().zip(&mut self.rate).enumerate() {
            *height = course.height_at(k, t);
            *rate = course.rate_at(k, t);
            self.side_rate[k] = course.side_rate_at(k, t);
        }
    }

    /// The rail at magnet k.
    pub fn rail(&self, k: usize) -> RailPoint {
        RailPoint {
            height: self.height[k],
            rate: self.rate[k],
            side_rate: self.side_rate[k],
            speed: self.speed,
        }
    }

    /// Whether this is exactly the rail that an evaluation remembers.
    pub fn same(&self, track: Option<&TrackContact>) -> bool {
        let Some(track) = track.filter(|track| track.contact.any()) else {
            return self.contact.is_none();
        };
        let same = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits());
        self.contact == Some(track.contact)
            && self.speed.to_bits() == track.speed.to_bits()
            && same(&self.height, track.height)
            && same(&self.rate, track.rate)
            && if track.side_rate.is_empty() {
                self.side_rate.iter().all(|rate| *rate == 0.0)
            } else {
                same(&self.side_rate, track.side_rate)
            }
    }
}
