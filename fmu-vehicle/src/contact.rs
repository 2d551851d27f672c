//! Stops and skids: parameters, checks, and the contact force as an output.

use fmi2_export::{
    BooleanVar, Error, Interface, RealVar, RealVars, UnitOfMeasure, Values, VariableRow,
};
use multibody::{
    Contact, ContactLaw, ContactSide, MAX_CONTACT_STIFFNESS, MIN_SLIP_SPEED, State, TrackContact,
    TrackCourse, VehicleModel,
};

use crate::table::{InputHandles, SidewaysHandles};

const SECOND_PER_METRE: UnitOfMeasure = UnitOfMeasure::new("s/m").s(1).m(-1);
/// Small motions are not linear where a magnet is as close as this to touching or leaving the rail, m:
/// five times the displacements by which the equations are linearised.
const MARGIN: f64 = 5e-5;

/// Handles of the parameters of a stop or a skid.
#[derive(Debug, Clone, Copy)]
struct SideHandles {
    on: BooleanVar,
    gap: RealVar,
    stiffness: RealVar,
    damping: RealVar,
    friction: RealVar,
}

/// Handles of all that concerns contact.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ContactHandles {
    stop: SideHandles,
    skid: SideHandles,
    slip_speed: RealVar,
    start_on_skids: BooleanVar,
    /// The output `contact_force_NN`.
    pub force: RealVars,
}

/// Handles of the rails that the magnets meet: heights and rates, lateral displacements and rates.
pub(crate) type RailHandles<'a> = (&'a InputHandles, &'a SidewaysHandles);

impl SideHandles {
    fn declare(
        interface: &mut Interface,
        side: &str,
        data: &ContactSide,
        [on, gap]: [&str; 2],
    ) -> Self {
        let name = |what: &str| format!("contact_{side}_{what}");
        Self {
            on: interface.boolean(name("on")).parameter(data.on).description(on).done(),
            gap: interface
                .real(name("gap"))
                .parameter(data.gap)
                .unit(UnitOfMeasure::METRE)
                .display("mm")
                .min(0.0)
                .description(gap)
                .done(),
            stiffness: interface
                .real(name("stiffness"))
                .parameter(data.stiffness)
                .unit(UnitOfMeasure::NEWTON_PER_METRE)
                .min(1.0)
                .max(MAX_CONTACT_STIFFNESS)
                .description(format!(
                    "Stiffness k of a {side}, with the depth d of the contact: normal force k d (1 + chi d')"
                ))
                .done(),
            damping: interface
                .real(name("damping"))
                .parameter(data.damping)
                .unit(SECOND_PER_METRE)
                .min(0.0)
                .description(format!(
                    "Damping chi of a {side}: an impact at the slow speed v returns 1 - 2/3 chi v of it"
                ))
                .done(),
            friction: interface
                .real(name("friction"))
                .parameter(data.friction)
                .min(0.0)
                .description(format!("Coefficient of friction between a {side} and the rail"))
                .done(),
        }
    }

    fn rows(&self) -> [VariableRow; 5] {
        let Self { on, gap, stiffness, damping, friction } = self;
        [on.row(), gap.row(), stiffness.row(), damping.row(), friction.row()]
    }

    fn law(&self, values: &Values) -> Option<ContactLaw> {
        values.boolean(self.on).then(|| ContactLaw {
            gap: values.real(self.gap),
            stiffness: values.real(self.stiffness),
            damping: values.real(self.damping),
            friction: values.real(self.friction),
        })
    }
}

impl ContactHandles {
    /// Declares the parameters and the output.
    pub fn declare(interface: &mut Interface, model: &VehicleModel) -> Self {
        let data = model.contact();
        Self {
            stop: SideHandles::declare(
                interface,
                "stop",
                &data.stop(),
                [
                    "Whether the magnets have mechanical stops, which touch the rail from below where the \
                     gap closes",
                    "Gap at which a stop touches the rail; smaller than the nominal gap",
                ],
            ),
            skid: SideHandles::declare(
                interface,
                "skid",
                &data.skid(),
                [
                    "Whether the magnets have landing skids, which carry the vehicle on the rail where \
                     the gap opens",
                    "Gap at which a skid lands on the rail; larger than the nominal gap",
                ],
            ),
            slip_speed: interface
                .real("contact_slip_speed")
                .parameter(data.slip_speed)
                .unit(UnitOfMeasure::METRE_PER_SECOND)
                .min(MIN_SLIP_SPEED)
                .description(
                    "Speed of sliding at which friction reaches 71 % of its full value; at rest there is \
                     none",
                )
                .done(),
            start_on_skids: interface
                .boolean("start_on_skids")
                .parameter(false)
                .description(
                    "Start in equilibrium on the skids, without forces of the magnets; static_load stays \
                     the load at the nominal gap",
                )
                .done(),
            force: interface
                .reals("contact_force", model.counts().magnets)
                .output()
                .derivatives(1)
                .unit(UnitOfMeasure::NEWTON)
                .nominal(5e3)
                .description(
                    "Force of stop and skid on magnet {k}, up positive as the magnet's force: a skid on \
                     the rail gives a positive one; the guideway takes the opposite",
                )
                .done(),
        }
    }

    /// Parameters on which a start depends.
    pub fn rows(&self) -> Vec<VariableRow> {
        let own = [self.slip_speed.row(), self.start_on_skids.row()];
        [&self.stop.rows()[..], &self.skid.rows(), &own].concat()
    }

    /// Stops and skids in force.
    fn contact(&self, values: &Values) -> Contact {
        Contact {
            stop: self.stop.law(values),
            skid: self.skid.law(values),
            slip_speed: values.real(self.slip_speed),
        }
    }

    /// Stops and skids, and whether to start on the skids, at a speed along the track.
    pub fn start(
        &self,
        model: &VehicleModel,
        values: &Values,
        speed: f64,
    ) -> Result<(Contact, bool), Error> {
        let contact = self.contact(values);
        contact
            .check_gaps(model.nominal_gap())
            .map_err(|(side, message)| Error::invalid(format!("contact_{side}_gap: {message}")))?;
        let landed = values.boolean(self.start_on_skids);
        if landed && contact.skid.is_none() {
            return Err(Error::invalid(
                "start_on_skids: there are no skids to stand on; set contact_skid_on",
            ));
        }
        if landed && speed != 0.0 {
            return Err(Error::invalid(format!(
                "start_on_skids: a vehicle that slides on its skids at {speed} m/s is not in equilibrium; \
                 set travel_speed to 0, and speed_change at the start"
            )));
        }
        Ok((contact, landed))
    }

    /// The rail at this moment; none without stops and skids.
    pub fn track<'a>(
        &self,
        values: &'a Values,
        rails: RailHandles,
        speed: f64,
    ) -> Option<TrackContact<'a>> {
        let contact = self.contact(values);
        contact.any().then(|| TrackContact {
            contact,
            speed,
            height: values.reals(rails.0.track_displacement),
            rate: values.reals(rails.0.track_rate),
            side_rate: values.reals(rails.1.rate),
        })
    }

    /// The rail over a step; none without stops and skids.
    pub fn course<'a>(
        &self,
        values: &'a Values,
        rails: RailHandles,
        speed: [f64; 4],
    ) -> Option<TrackCourse<'a>> {
        let contact = self.contact(values);
        contact.any().then(|| TrackCourse {
            contact,
            speed,
            height: values.taylors(rails.0.track_displacement),
            rate: values.taylors(rails.0.track_rate),
            side_rate: values.taylors(rails.1.rate),
        })
    }

    /// Writes the output.
    pub fn write(
        &self,
        model: &VehicleModel,
        state: &crate::state::State,
        rails: RailHandles,
        values: &mut Values,
    ) {
        for k in model.magnets() {
            let force = self
                .track(values, rails, state.journey.speed)
                .map_or(0.0, |track| model.contact_force(&state.vehicle, k, &track).z);
            values.set_real(self.force.get(k.0), force);
        }
    }
}

/// Refuses to linearise where a magnet is about to touch or to leave the rail.
pub(crate) fn check_linear(
    model: &VehicleModel,
    state: &State,
    track: Option<&TrackContact>,
) -> Result<(), Error> {
    match track.and_then(|track| model.near_touch(state, track, MARGIN)) {
        None => Ok(()),
        Some(k) => Err(Error::invalid(format!(
            "magnet {} is within {MARGIN} m of touching or leaving the rail: small motions about this \
             state are not linear",
            k.0 + 1
        ))),
    }
}
