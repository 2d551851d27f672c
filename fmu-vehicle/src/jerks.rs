//! Rates of the magnets' accelerations, computed once per communication point.

use fmi2_export::Values;
use multibody::{
    AppliedForces, Contact, Error, ExternalLoad, Loads, MagnetIndex, MovingTrack, TrackContact,
    VehicleModel, Workspace,
};

use crate::contact::{ContactHandles, RailHandles};
use crate::external::ExternalHandles;
use crate::journey::Journey;
use crate::state::{LoadBends, LoadRates, State};

/// Rates of the magnets' accelerations (down positive), with what they were computed for.
#[derive(Debug, Clone)]
pub(crate) struct Jerks {
    known: bool,
    state: multibody::State,
    journey: Option<Journey>,
    force: Vec<f64>,
    lateral: Vec<f64>,
    force_rate: Vec<f64>,
    lateral_rate: Vec<f64>,
    external: Vec<ExternalLoad>,
    external_rate: Vec<ExternalLoad>,
    rail: Rail,
    jerk: Vec<f64>,
    /// Their second derivatives, and whether they are known too.
    snap: Vec<f64>,
    bent: bool,
    bends: LoadBends,
    /// Whether they were asked for at the last communication point: then they are computed with the rates.
    wanted: bool,
}

/// The rail for which the rates were computed; only the laws without contact.
#[derive(Debug, Clone, Default)]
struct Rail {
    contact: Option<Contact>,
    speed: f64,
    height: Vec<f64>,
    rate: Vec<f64>,
    acceleration: Vec<f64>,
    side_rate: Vec<f64>,
    side_acceleration: Vec<f64>,
}

impl Rail {
    fn is(&self, track: Option<&TrackContact>, [acceleration, sideways]: [&[f64]; 2]) -> bool {
        let Some(track) = track else { return self.contact.is_none() };
        self.contact == Some(track.contact)
            && self.speed.to_bits() == track.speed.to_bits()
            && self.height == track.height
            && self.rate == track.rate
            && self.acceleration == acceleration
            && self.side_rate == track.side_rate
            && self.side_acceleration == sideways
    }

    fn remember(&mut self, track: Option<&TrackContact>, [acceleration, sideways]: [&[f64]; 2]) {
        self.contact = track.map(|track| track.contact);
        let Some(track) = track else { return };
        self.speed = track.speed;
        for (kept, now) in [
            (&mut self.height, track.height),
            (&mut self.rate, track.rate),
            (&mut self.acceleration, acceleration),
            (&mut self.side_rate, track.side_rate),
            (&mut self.side_acceleration, sideways),
        ] {
            kept.clear();
            kept.extend_from_slice(now);
        }
    }
}

impl Jerks {
    pub fn new(model: &VehicleModel) -> Self {
        let zero = || vec![0.0; model.counts().magnets];
        Self {
            known: false,
            state: model.initial_state(),
            journey: None,
            force: zero(),
            lateral: zero(),
            force_rate: zero(),
            lateral_rate: zero(),
            external: vec![[0.0; 6]; model.observed().count()],
            external_rate: vec![[0.0; 6]; model.observed().count()],
            rail: Rail::default(),
            jerk: zero(),
            snap: zero(),
            bent: false,
            bends: LoadRates::zero(model.counts().magnets, model.observed().count()).bends,
            wanted: false,
        }
    }

    /// Discards rates of another state or other inputs. A comparison costs more than reading one
    /// rate, so it is done once for all rates that are read together.
    pub fn check(
        &mut self,
        state: &State,
        values: &Values,
        rails: RailHandles,
        contact: &ContactHandles,
        external: &ExternalHandles,
    ) {
        // what feeds motors is not compared
        self.known = self.known
            && state.rates.motors.is_empty()
            && self.force == values.reals(rails.0.force)
            && self.lateral == values.reals(rails.0.lateral_force)
            && self.force_rate == state.rates.force
            && self.lateral_rate == state.rates.lateral_force
            && external.are(&self.external, values)
            && self.external_rate == state.rates.external
            && self.rail.is(
                contact.track(values, rails, state.journey.speed).as_ref(),
                [&state.rates.track_rate, &state.rates.side_rate],
            )
            && self.journey.is_some_and(|it| it.alike(&state.journey))
            && self.state == state.vehicle;
        self.bent = self.bent && self.known && self.bends == state.rates.bends;
    }

    /// Computes the rates of all magnets, and their second derivatives if they are `bent`, if necessary.
    pub fn find(
        &mut self,
        model: &VehicleModel,
        state: &State,
        forces: &AppliedForces,
        track: Option<&TrackContact>,
        [work, probe]: [&mut Workspace; 2],
        bent: bool,
    ) -> Result<(), Error> {
        self.wanted |= bent;
        if !self.known || (bent && !self.bent) {
            let bent = self.wanted && state.vehicle.travel.is_none();
            let magnets =
                Loads { vertical: &state.rates.force, lateral: &state.rates.lateral_force };
            let rates = AppliedForces {
                magnets,
                external: &state.rates.external,
                acceleration: state.journey.jerk,
            };
            let LoadRates { track_rate, side_rate, bends: ends, .. } = &state.rates;
            let rails = [&track_rate[..], side_rate];
            let moving = track.map(|track| MovingTrack {
                track,
                acceleration: track_rate,
                side_acceleration: side_rate,
                jerk: &ends.track_rate,
                side_jerk: &ends.side_rate,
            });
            if bent {
                let magnets = Loads { vertical: &ends.force, lateral: &ends.lateral_force };
                let (external, acceleration) = (&ends.external[..], state.journey.snap);
                let bends = AppliedForces { magnets, external, acceleration };
                let loads = [*forces, rates, bends];
                model.snaps_in_contact(&state.vehicle, loads, moving, [work, probe])?;
                for (k, snap) in self.snap.iter_mut().enumerate() {
                    *snap = -model.magnet_snap(work, probe, MagnetIndex(k)).z;
                }
                self.bends.clone_from(ends);
            } else {
                model.jerks_in_contact(&state.vehicle, *forces, rates, moving, [work, probe])?;
            }
            self.bent = bent;
            for (k, jerk) in self.jerk.iter_mut().enumerate() {
                *jerk = -model.magnet_jerk(work, probe, MagnetIndex(k)).z;
            }
            self.remember(state, forces);
            self.rail.remember(track, rails);
        }
        Ok(())
    }

    /// Rate of the acceleration of magnet k (down positive).
    pub fn jerk(&self, k: usize) -> f64 {
        self.jerk[k]
    }

    /// Second derivative of the acceleration of magnet k (down positive).
    pub fn snap(&self, k: usize) -> f64 {
        self.snap[k]
    }

    fn remember(&mut self, state: &State, forces: &AppliedForces) {
        self.known = true;
        self.journey = Some(state.journey);
        self.state.clone_from(&state.vehicle);
        self.force.copy_from_slice(forces.magnets.vertical);
        self.lateral.copy_from_slice(forces.magnets.lateral);
        self.external.copy_from_slice(forces.external);
        self.external_rate.copy_from_slice(&state.rates.external);
        self.force_rate.copy_from_slice(&state.rates.force);
        self.lateral_rate.copy_from_slice(&state.rates.lateral_force);
    }
}
