//! The line that the vehicle travels along: a resource, what the start needs of it, and its outputs.

use fmi2_export::{Error, Interface, RealVar, Resources, UnitOfMeasure, Values};
use multibody::{Travel, VehicleModel};
use track_line::{Line, LineDescription};

use crate::journey::Journey;
use crate::state::State;

/// Name of the resource; without it the track is straight.
const FILE: &str = "line.json";
/// Metres of straight track before and behind the outermost magnets that make a start one on straight
/// track.
const MARGIN: f64 = 2.0;

const PER_METRE: UnitOfMeasure = UnitOfMeasure::new("1/m").m(-1);

/// Handles of the outputs that only a vehicle on a line has.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LineHandles {
    curvature: RealVar,
    slope: RealVar,
    cant: RealVar,
}

/// The line of the resources, if there is one.
pub(crate) fn read(resources: &Resources) -> Result<Option<Line>, Error> {
    let Some(bytes) = resources.read_if_present(FILE)? else { return Ok(None) };
    let text = String::from_utf8(bytes)
        .map_err(|_| Error::invalid(format!("resource {FILE}: not UTF-8; save it as UTF-8")))?;
    let failed = |e: track_line::Error| Error::caused(&e).context(format_args!("resource {FILE}"));
    let description = LineDescription::from_json(&text).map_err(failed)?;
    Line::new(&description).map(Some).map_err(failed)
}

/// The vehicle on the line, if there is one.
pub(crate) fn place(model: VehicleModel, line: Option<&Line>) -> Result<VehicleModel, Error> {
    let Some(line) = line else { return Ok(model) };
    model
        .with_line(line.clone())
        .map_err(|e| Error::caused(&e).context(format_args!("resource {FILE}")))
}

/// The travel of a journey at a time.
pub(crate) fn travel(model: &VehicleModel, journey: &Journey, time: f64) -> Option<Travel> {
    model.line().map(|_| Travel { place: journey.place_at(time), speed: journey.speed })
}

impl LineHandles {
    /// Declares the outputs of a vehicle on a line.
    pub fn declare(interface: &mut Interface, line: Option<&Line>) -> Option<Self> {
        line?;
        let mut output = |name: &str, unit: UnitOfMeasure, nominal: f64, text: &str| {
            let output = interface.real(name).output().unit(unit).nominal(nominal);
            output.description(text.to_owned()).done()
        };
        Some(Self {
            curvature: output(
                "line_curvature",
                PER_METRE,
                1e-3,
                "Curvature of the line in plan at x = 0 of the vehicle, left positive",
            ),
            slope: output(
                "line_slope",
                UnitOfMeasure::RADIAN,
                1e-2,
                "Slope of the line at x = 0 of the vehicle, rising positive",
            ),
            cant: output(
                "line_cant",
                UnitOfMeasure::RADIAN,
                1e-2,
                "Cant of the line at x = 0 of the vehicle, left side up positive",
            ),
        })
    }

    /// The outputs, which depend on the place along the track.
    pub fn rows(&self) -> [RealVar; 3] {
        [self.curvature, self.slope, self.cant]
    }

    /// Writes the outputs.
    pub fn write(&self, model: &VehicleModel, place: f64, values: &mut Values) {
        let Some(line) = model.line() else { return };
        let frame = line.frame(place);
        let (along, up) = (frame.axes.column(0), frame.axes.row(2));
        let level = along.x.hypot(along.y);
        // the heading's rate along the line, by the length in plan
        let turning = (frame.axes * frame.curvature).z / level;
        values.set_real(self.curvature, turning);
        values.set_real(self.slope, along.z.atan2(level));
        values.set_real(self.cant, up[1].atan2(up[2]));
    }
}

/// Whether the line is straight and level below the whole vehicle.
fn is_plain(model: &VehicleModel, line: &Line, place: f64) -> bool {
    let [from, to] = below(model, place);
    line.is_plain(from, to)
}

/// The part of the line that is below the vehicle, m, with a margin.
fn below(model: &VehicleModel, place: f64) -> [f64; 2] {
    let start = model.initial_state();
    let places = model.magnets().map(|k| model.magnet(&start, k).position.x);
    let (from, to) = places.fold((0.0_f64, 0.0_f64), |(a, b), x| (a.min(x), b.max(x)));
    [place + from - MARGIN, place + to + MARGIN]
}

/// The travel for which an equilibrium is sought: none where the line is straight, level and without cant
/// below the whole vehicle, as on a straight track.
pub(crate) fn curved(model: &VehicleModel, travel: Option<Travel>) -> Option<Travel> {
    let line = model.line()?;
    travel.filter(|travel| !is_plain(model, line, travel.place))
}

/// Refuses a start on the skids in a curve: without forces of the magnets, nothing holds the vehicle sideways
/// there, because friction is none at rest.
pub(crate) fn check_start(
    model: &VehicleModel,
    travel: Option<Travel>,
    landed: bool,
) -> Result<(), Error> {
    let Some(travel) = curved(model, travel).filter(|_| landed) else { return Ok(()) };
    Err(Error::invalid(format!(
        "start_on_skids at {} m: the line is not straight, level and without cant below the vehicle, and on \
         its skids, without guidance, it has no equilibrium sideways; start there in levitation, with \
         contact_skid_on, and let the magnets set it down",
        travel.place
    )))
}

/// A state for a linearisation, if it is another one: where the line is straight and level below the vehicle,
/// it is that of a straight track.
///
/// Small motions of a vehicle that moves have constant coefficients only where the line is uniform.
pub(crate) fn steady(model: &VehicleModel, state: &State) -> Result<Option<State>, Error> {
    let Some((line, travel)) = model.line().zip(state.vehicle.travel) else { return Ok(None) };
    if !is_plain(model, line, travel.place) {
        let [from, to] = below(model, travel.place);
        if travel.speed == 0.0 || line.is_uniform(from, to) {
            return Ok(None);
        }
        return Err(Error::invalid(format!(
            "a linearisation of a vehicle in motion needs a line whose curvature, slope and cant are constant \
             below it, and those of `{}` change between {from:.3} m and {to:.3} m: small motions have \
             coefficients that change with time there; take a place inside a circle, or the speed 0",
            line.name()
        )));
    }
    let mut state = state.clone();
    state.vehicle.travel = None;
    Ok(Some(state))
}
