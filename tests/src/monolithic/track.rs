//! The guideway's part: girders with or without rails, or rigid ground.

use guideway::{Guideway, Load, RailSurface, SpanMotion};

use super::told;

/// The girders at one instant.
pub(super) struct Girders {
    guideway: Guideway,
    work: guideway::Workspace,
    pub state: guideway::State,
    /// q̈ of the last [`Track::accelerate`].
    pub accelerations: Vec<f64>,
}

/// What the magnets are below; no girders are rigid ground.
pub(super) struct Track(Option<Girders>);

impl Track {
    pub fn new(description: Option<&guideway::GuidewayDescription>) -> Result<Self, String> {
        let Some(description) = description else { return Ok(Self(None)) };
        let guideway = Guideway::new(description, None).map_err(told)?;
        let zeros = vec![0.0; guideway.modes().len()];
        Ok(Self(Some(Girders {
            work: guideway::Workspace::new(&guideway),
            state: guideway::State { q: zeros.clone(), v: zeros.clone() },
            accelerations: zeros,
            guideway,
        })))
    }

    /// The girders, unless the ground is rigid.
    pub fn girders(&self) -> Option<&Girders> {
        self.0.as_ref()
    }

    /// Number of modes of all girders.
    pub fn modes(&self) -> usize {
        self.0.as_ref().map_or(0, |girders| girders.state.q.len())
    }

    /// Sets q and q̇, of equal length.
    pub fn set(&mut self, state: &[f64]) {
        if let Some(girders) = &mut self.0 {
            let (q, v) = state.split_at(girders.state.q.len());
            girders.state.q.copy_from_slice(q);
            girders.state.v.copy_from_slice(v);
        }
    }

    /// Bends the girders as they are at the start under loads that move with a speed.
    pub fn rest(&mut self, loads: &[Load], speed: f64) -> Result<(), String> {
        let Some(girders) = &mut self.0 else { return Ok(()) };
        girders.state =
            girders.guideway.initial_state(&mut girders.work, loads, speed, 0.0).map_err(told)?;
        Ok(())
    }

    /// q̈ under the loads.
    pub fn accelerate(&mut self, loads: &[Load], t: f64) {
        let Some(Girders { guideway, work, state, accelerations }) = &mut self.0 else { return };
        guideway.accelerations(work, state, loads, t, accelerations);
    }

    /// The rail at magnet `k` at x; its accelerations are not of this instant.
    pub fn rail(&mut self, k: usize, x: f64) -> RailSurface {
        self.0.as_mut().map_or_else(RailSurface::default, |girders| {
            let Girders { guideway, work, state, accelerations } = girders;
            guideway.rail(work, state, accelerations, k, x)
        })
    }

    /// Vertical motion, lateral motion and twist (m, rad) of the middle of every span.
    pub fn midspans(&mut self) -> Vec<[f64; 3]> {
        let Some(Girders { guideway, work, state, accelerations }) = &mut self.0 else {
            return Vec::new();
        };
        let middle = |k: usize| {
            let half = 0.5 * guideway.girders()[guideway.spans()[k].girder].length();
            let motion = guideway.section_motion(work, state, accelerations, k, half);
            motion.map(|SpanMotion { displacement, .. }| displacement)
        };
        (0..guideway.spans().len()).map(middle).collect()
    }
}
