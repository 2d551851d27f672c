//! Motion over time: the recorded signals at the frames of the view.

use multibody::VehicleDescription;
use serde::Serialize;

use super::Channel;
use super::bodies::{DrawnBodies, GroupKind};
use crate::embed::{ArrayRef, Arrays};
use crate::layout_fmu::LayoutFmu;
use crate::names::{self, numbered};
use results::Table;

/// Rows of the table that the view shows.
#[derive(Debug)]
pub(super) struct ViewFrames(Vec<usize>);

impl ViewFrames {
    /// At most so many rows (at least 2) at about equal distances in time, including the first and the last.
    pub(super) fn choose(time: &[f64], most: usize) -> Self {
        let Some(last) = time.len().checked_sub(1) else { return Self(Vec::new()) };
        if time.len() <= most {
            return Self((0..=last).collect());
        }
        let (begin, end) = (time[0], time[last]);
        let mut rows: Vec<usize> = (0..most)
            .map(|k| begin + (end - begin) * k as f64 / (most - 1) as f64)
            .map(|t| nearest(time, t))
            .collect();
        rows.dedup();
        Self(rows)
    }

    /// Whether nothing is recorded.
    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    fn pick<'a>(&'a self, values: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
        self.0.iter().map(|&row| values[row])
    }
}

/// Row with the nearest time.
fn nearest(time: &[f64], t: f64) -> usize {
    let after = time.partition_point(|&it| it < t).min(time.len() - 1);
    let before = after.saturating_sub(1);
    if t - time[before] < time[after] - t { before } else { after }
}

/// The recorded signals, and the arrays and notes of the page.
pub(super) struct SignalSource<'a> {
    pub table: &'a Table,
    pub frames: &'a ViewFrames,
    pub arrays: &'a mut Arrays,
    pub missing: &'a mut Vec<String>,
}

impl SignalSource<'_> {
    /// A signal at the frames. Rows at which it was not due have its last value.
    pub(super) fn signal(&self, name: &str) -> Option<Vec<f64>> {
        let values = self.table.column(name)?;
        let first = values.iter().copied().find(|it| !it.is_nan())?;
        let mut held = first;
        let whole: Vec<f64> = values
            .iter()
            .map(|&value| {
                held = if value.is_nan() { held } else { value };
                held
            })
            .collect();
        Some(self.frames.pick(&whole).collect())
    }

    /// Embeds a signal at the frames.
    fn channel(&mut self, name: &str) -> Channel {
        self.signal(name).map(|values| self.arrays.f32(&values))
    }

    /// Times of the frames.
    pub(super) fn time(&self) -> Vec<f64> {
        self.frames.pick(&self.table.time).collect()
    }
}

/// The motion of everything but the girders.
#[derive(Debug, Serialize)]
pub(super) struct RecordedMotion {
    /// Times of the frames (s).
    time: ArrayRef,
    /// Position along the track (m) of x = 0 in the vehicle file.
    position: ArrayRef,
    /// Air gap of each magnet (m).
    gaps: Vec<Channel>,
    /// Smallest and largest position (m).
    #[serde(skip)]
    pub travel: (f64, f64),
    /// Displacement of each group from its position in the vehicle file.
    poses: Vec<Pose>,
}

/// Displacement of a group from its position in the vehicle file, as far as it is recorded. The page computes
/// the displacement that follows from the gaps.
#[derive(Debug, Default, Serialize)]
struct Pose {
    /// m, left positive
    lateral: Channel,
    /// m, up positive
    vertical: Channel,
    /// rad, left side up
    roll: Channel,
    /// rad, nose down
    pitch: Channel,
    /// rad, turning left
    yaw: Channel,
}

impl RecordedMotion {
    pub(super) fn new(
        vehicle: &LayoutFmu<'_>,
        layout: &VehicleDescription,
        bodies: &DrawnBodies,
        source: &mut SignalSource<'_>,
    ) -> Self {
        let time = source.time();
        let position = travelled(vehicle, layout, source, &time);
        let finite = || position.iter().copied().filter(|it| it.is_finite());
        let travel = (finite().fold(f64::MAX, f64::min), finite().fold(f64::MIN, f64::max));
        let position = source.arrays.f32(&position);
        let gaps: Vec<Channel> = (1..=layout.magnets.len())
            .map(|k| {
                source.channel(&vehicle.variable(&numbered(names::GAP, k, layout.magnets.len())))
            })
            .collect();
        let unknown = gaps.iter().filter(|it| it.is_none()).count();
        if unknown > 0 {
            source.missing.push(format!(
                "{unknown} of {} gaps are not recorded: those magnets are grey and keep the nominal gap",
                gaps.len()
            ));
        }
        let poses = bodies
            .groups
            .iter()
            .enumerate()
            .map(|(g, group)| match group.kind {
                GroupKind::Car => car(vehicle, &group.name, source),
                GroupKind::Frame => frame(vehicle, layout, bodies, g, source),
            })
            .collect();
        note_missing_motion(bodies, &poses, source.missing);
        Self { time: source.arrays.f64(&time), position, gaps, travel, poses }
    }
}

/// Position along the track of x = 0 in the vehicle file, from the recorded position of any magnet, or from
/// initial position and travel speed.
fn travelled(
    vehicle: &LayoutFmu<'_>,
    layout: &VehicleDescription,
    source: &mut SignalSource<'_>,
    time: &[f64],
) -> Vec<f64> {
    for (k, magnet) in layout.magnets.iter().enumerate() {
        let name = vehicle.variable(&numbered(names::POSITION, k + 1, layout.magnets.len()));
        if let Some(values) = source.signal(&name) {
            return values.iter().map(|x| x - magnet.position[0]).collect();
        }
    }
    let start = vehicle.parameter(names::INITIAL_POSITION).unwrap_or(0.0);
    let speed = vehicle.parameter(names::TRAVEL_SPEED).unwrap_or(0.0);
    let changes = vehicle.is_mentioned(names::SPEED_CHANGE);
    if speed != 0.0 || changes {
        let name = vehicle.variable(&format!("{}_NN", names::POSITION));
        let though = if changes { ", though its speed changes" } else { "" };
        source
            .missing
            .push(format!("no {name} is recorded: the train moves with travel_speed{though}"));
    }
    let begin = source.table.time.first().copied().unwrap_or(0.0);
    time.iter().map(|t| start + speed * (t - begin)).collect()
}

/// Motion of an observed body.
fn car(vehicle: &LayoutFmu<'_>, name: &str, source: &mut SignalSource<'_>) -> Pose {
    let mut channel = |what: &str| source.channel(&vehicle.variable(&format!("{name}_{what}")));
    Pose {
        lateral: channel(names::LATERAL_DISPLACEMENT),
        vertical: channel(names::VERTICAL_DISPLACEMENT),
        roll: channel(names::ROLL),
        pitch: channel(names::PITCH),
        yaw: channel(names::YAW),
    }
}

/// Lateral motion and yaw of a frame, from a line fitted to the lateral offsets of its magnets.
fn frame(
    vehicle: &LayoutFmu<'_>,
    layout: &VehicleDescription,
    bodies: &DrawnBodies,
    group: usize,
    source: &mut SignalSource<'_>,
) -> Pose {
    let mut offsets = Vec::new();
    for (k, magnet) in bodies.magnets.iter().enumerate().filter(|(_, it)| it.group == group) {
        let name = vehicle.variable(&numbered(names::LATERAL_OFFSET, k + 1, layout.magnets.len()));
        if let Some(values) = source.signal(&name) {
            offsets.push((magnet.position[0] - bodies.groups[group].center[0], values));
        }
    }
    let Some((_, first)) = offsets.first() else { return Pose::default() };
    let n = offsets.len() as f64;
    let middle = offsets.iter().map(|(x, _)| x).sum::<f64>() / n;
    let spread = offsets.iter().map(|(x, _)| (x - middle).powi(2)).sum::<f64>();
    let (mut lateral, mut yaw) = (vec![0.0; first.len()], vec![0.0; first.len()]);
    for i in 0..first.len() {
        let mean = offsets.iter().map(|(_, y)| y[i]).sum::<f64>() / n;
        let moment = offsets.iter().map(|(x, y)| (x - middle) * y[i]).sum::<f64>();
        yaw[i] = if spread > 0.0 { moment / spread } else { 0.0 };
        lateral[i] = mean - yaw[i] * middle;
    }
    let yaw = (spread > 0.0).then(|| source.arrays.f32(&yaw));
    Pose { lateral: Some(source.arrays.f32(&lateral)), yaw, ..Pose::default() }
}

fn note_missing_motion(bodies: &DrawnBodies, poses: &Vec<Pose>, missing: &mut Vec<String>) {
    let of = |kind| bodies.groups.iter().zip(poses).filter(move |(it, _)| it.kind == kind);
    for (group, pose) in of(GroupKind::Car) {
        let parts = [
            (names::VERTICAL_DISPLACEMENT, pose.vertical),
            (names::LATERAL_DISPLACEMENT, pose.lateral),
            (names::ROLL, pose.roll),
            (names::PITCH, pose.pitch),
            (names::YAW, pose.yaw),
        ];
        let absent: Vec<String> = parts
            .iter()
            .filter(|(_, channel)| channel.is_none())
            .map(|(what, _)| format!("{}_{what}", group.name))
            .collect();
        if !absent.is_empty() {
            missing.push(format!("not recorded, so drawn at rest: {}", absent.join(", ")));
        }
    }
    if of(GroupKind::Frame).any(|(_, pose)| pose.lateral.is_none()) {
        missing.push(
            "lateral motion of the bogies is drawn only where lateral_offset_NN is recorded"
                .to_owned(),
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn invariant_frames_are_even_in_time_and_hold_both_ends() {
        // twice as many rows in the first half
        let time: Vec<f64> = (0..20_000)
            .map(|k| f64::from(k) * 1e-3)
            .chain((0..=10_000).map(|k| 20.0 + f64::from(k) * 2e-3))
            .collect();
        let frames = ViewFrames::choose(&time, 3000);
        assert_eq!(frames.0.len(), 3000);
        assert_eq!((frames.0[0], frames.0[2999]), (0, time.len() - 1));
        let picked: Vec<f64> = frames.pick(&time).collect();
        let step = 40.0 / 2999.0;
        // each within half a row of its place
        assert!(picked.windows(2).all(|w| (w[1] - w[0] - step).abs() <= 2.001e-3));
        assert_eq!(ViewFrames::choose(&time[..50], 3000).0, (0..50).collect::<Vec<_>>());
        assert!(ViewFrames::choose(&[], 3000).is_empty());
    }
}
