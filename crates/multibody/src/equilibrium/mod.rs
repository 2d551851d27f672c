//! Static equilibrium with the magnets at the nominal gap below the track.
//!
//! A vehicle that is held by given forces has no unique equilibrium. So each magnet-carrying body
//! is held by equal stiff springs K at its magnets, acting on the rigid-body fit of the magnets'
//! deviations from their places below the track, d = P (z_target − z) with P the orthogonal
//! projection on motions of a rigid body (heave, pitch, roll, as far as the magnets can distinguish
//! them). The magnets' loads follow by L ← L + K d (augmented Lagrangian) until d vanishes. The
//! remaining loads are linear along each rigid body, hence of least norm where the body is
//! statically indeterminate. On a curved track the body sits at the least-squares fit.
//!
//! The law of guidance gives each magnet's lateral force for its load. This force is part of Q and
//! its stiffness part of H, so it changes the result: it holds a vehicle whose loads on the left
//! and on the right differ.
//!
//! Each iteration is one Newton step in poses and multipliers, H δ + Φ_qᵀ λ = Q, Φ_q δ = −Φ, where
//! H holds the elastic stiffness of all elements, K, and σ M. H leaves out the geometric stiffness
//! of the loads, which is smaller than the elastic one wherever the vehicle is stable at all, and
//! so stays positive definite; σ M (pseudo-transient) holds everything that nothing else holds,
//! such as the lateral place of a train without guidance, without changing where the iteration
//! ends, since it acts on δ only. Such a place is found only for a symmetric vehicle, which does
//! not have to move sideways.

mod holding;
mod search;
mod skids;
mod statics;

pub use holding::{Equilibrium, Guidance, Holding, Rails};

use self::search::Search;
pub(crate) use self::statics::Statics;
use crate::error::Error;
use crate::loads::ExternalLoad;
use crate::model::VehicleModel;
use crate::way::Travel;
use crate::workspace::Workspace;

impl VehicleModel {
    /// Finds the static equilibrium with the magnets at the nominal gap below a track whose surface
    /// is at the heights `track` (m, one per magnet, up positive), without guidance forces.
    ///
    /// # Errors
    /// [`Error::Equilibrium`] if nothing holds the vehicle, [`Error::Argument`] for a wrong length,
    /// [`Error::Singular`].
    pub fn equilibrium(
        &self,
        track: &[f64],
        holding: &Holding,
        ws: &mut Workspace,
    ) -> Result<Equilibrium, Error> {
        self.guided_equilibrium(track, holding, &|_, _, _| [0.0; 2], ws)
    }

    /// Like [`VehicleModel::equilibrium`], with lateral guidance forces of the magnets by the law
    /// `guidance`.
    ///
    /// # Errors
    /// As [`VehicleModel::equilibrium`].
    pub fn guided_equilibrium(
        &self,
        track: &[f64],
        holding: &Holding,
        guidance: Guidance,
        ws: &mut Workspace,
    ) -> Result<Equilibrium, Error> {
        self.loaded_equilibrium(track, holding, guidance, &[], ws)
    }

    /// Like [`VehicleModel::guided_equilibrium`], under external forces and moments on the observed
    /// bodies: one entry per observed body, or none at all.
    ///
    /// # Errors
    /// As [`VehicleModel::equilibrium`].
    pub fn loaded_equilibrium(
        &self,
        track: &[f64],
        holding: &Holding,
        guidance: Guidance,
        external: &[ExternalLoad],
        ws: &mut Workspace,
    ) -> Result<Equilibrium, Error> {
        self.railed_equilibrium(
            &Rails { height: track, side: &[] },
            holding,
            guidance,
            external,
            ws,
        )
    }

    /// Like [`VehicleModel::loaded_equilibrium`], below rails that lie aside as well: the law of guidance
    /// sees the offset of each magnet from its rail.
    ///
    /// # Errors
    /// As [`VehicleModel::equilibrium`].
    pub fn railed_equilibrium(
        &self,
        rails: &Rails,
        holding: &Holding,
        guidance: Guidance,
        external: &[ExternalLoad],
        ws: &mut Workspace,
    ) -> Result<Equilibrium, Error> {
        self.carried_equilibrium(None, rails, holding, guidance, external, ws)
    }

    /// Like [`VehicleModel::railed_equilibrium`], on the line, at a place and a speed: the equilibrium of
    /// steady motion, in which the forces balance the inertia of bodies that the line carries along. Where
    /// curvature, slope or cant change below the vehicle, it is quasi-steady: every body has the inertia
    /// of one that keeps its place relative to the line where it is. The bodies' velocities are those of
    /// this motion, as far as joints allow. Without a travel it is the equilibrium of a straight track.
    ///
    /// # Errors
    /// As [`VehicleModel::equilibrium`]; [`Error::OffLine`], and [`Error::Unguided`] in a curve that is too
    /// tight.
    pub fn carried_equilibrium(
        &self,
        travel: Option<Travel>,
        rails: &Rails,
        holding: &Holding,
        guidance: Guidance,
        external: &[ExternalLoad],
        ws: &mut Workspace,
    ) -> Result<Equilibrium, Error> {
        let Rails { height: track, side } = *rails;
        ws.touch.set(None);
        ws.acceleration = 0.0;
        self.follow_line(travel, ws);
        let mut state = self.placed(travel)?;
        let sides = if side.is_empty() { track.len() } else { side.len() };
        self.check_lengths(&state, [track.len(), sides, external.len()])?;
        if let Some(k) = side.iter().position(|y| !y.is_finite()) {
            let what = format!("the lateral displacement of the track at magnet {}", k + 1);
            return Err(Error::NotFinite { what, time: 0.0 });
        }
        if let Some(k) = track.iter().position(|z| !z.is_finite()) {
            let what = format!("the track's height at magnet {}", k + 1);
            return Err(Error::NotFinite { what, time: 0.0 });
        }
        let statics = self.static_problem(holding, ws)?;
        let mut search = Search {
            model: self,
            holding,
            track: track.to_vec(),
            side,
            guidance,
            external: &[],
            loads: vec![0.0; track.len()],
            forces: vec![0.0; track.len()],
            lateral: vec![0.0; track.len()],
            restoring: vec![0.0; track.len()],
            astray: None,
            factors: vec![0.0; statics.analysis.factorisation.storage],
            statics: &statics,
        };
        if ws.way.is_some() {
            // in a curve, bodies that no guidance holds would go far astray
            let weight =
                self.gravity.norm() * self.composites.iter().map(|it| it.mass).sum::<f64>();
            search.loads.fill(weight / track.len().max(1) as f64);
        }
        let loads = search.loads.clone();
        if external.as_flattened().iter().all(|u| *u == 0.0) {
            return search.run(&mut state, ws);
        }
        // the law of guidance holds against wind only where the magnets carry the weight, so the search
        // begins where the vehicle rests without wind, if it does
        if search.run(&mut state, ws).is_err() {
            state = self.placed(travel)?;
            search.loads.copy_from_slice(&loads);
        }
        search.external = external;
        search.run(&mut state, ws)
    }
}
