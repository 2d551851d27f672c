//! Maps the unit's variables to the physics.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::PathBuf;
use std::sync::Arc;

use fmi2_export::{
    Error, Interface, Model, Motions, RealVar, Resources, Seed, Sensitivity, StateSpace, Step,
    Values,
};
use guideway::{
    Guideway, GuidewayDescription, Load, LoadChange, PointForce, RailSurface, SpanMotion, Surface,
    Workspace,
};
use serde::{Deserialize, Serialize};

use crate::kinds::prefixes;
use crate::linear;
use crate::parameters::ParameterHandles;
use crate::points::PointHandles;
use crate::rails::{self, JointOutputs, RailOutputs};
use crate::table::{self, DerivedHandles, InputHandles, OutputHandles};

/// The unit: its layout, the handles of its variables, and the guideway last built.
#[derive(Debug, Clone)]
pub struct GuidewayFmu {
    layout: GuidewayDescription,
    resources: PathBuf,
    inputs: InputHandles,
    outputs: OutputHandles,
    /// Shared, so that a step that changes the cache can use them.
    points: Arc<[PointHandles]>,
    chirp_force: RealVar,
    derived: DerivedHandles,
    parameters: ParameterHandles,
    /// A cache: rebuilt if a state belongs to other parameters.
    built: Option<Built>,
}

/// The guideway for one set of parameters, with scratch memory.
#[derive(Debug, Clone)]
struct Built {
    key: u64,
    guideway: Guideway,
    work: Workspace,
    loads: Vec<Load>,
    /// Of the chirp and the external force (m).
    place: f64,
    /// Modal accelerations, and the surface at each magnet, for what `seen` holds.
    accelerations: Vec<f64>,
    surfaces: Vec<RailSurface>,
    seen: Seen,
}

/// The state and inputs for which the surfaces were computed.
#[derive(Debug, Clone, Default)]
struct Seen {
    valid: bool,
    time: f64,
    girders: guideway::State,
    forces: Vec<f64>,
    lateral: Vec<f64>,
    positions: Vec<f64>,
    external: Option<PointForce>,
}

/// Everything that changes while stepping.
#[derive(Debug, Serialize, Deserialize)]
pub struct State {
    girders: guideway::State,
    /// Fingerprint of the parameters (and of the irregularity file) that this state belongs to.
    key: u64,
    /// Time of the state (s).
    time: f64,
    /// Rate of the speed at the end of the last step (m/s²), for derivatives of outputs.
    acceleration: f64,
}

impl Clone for State {
    fn clone(&self) -> Self {
        Self { girders: self.girders.clone(), ..*self }
    }

    fn clone_from(&mut self, source: &Self) {
        self.girders.clone_from(&source.girders);
        (self.key, self.time, self.acceleration) = (source.key, source.time, source.acceleration);
    }
}

fn caused(error: guideway::Error) -> Error {
    match error {
        // A smaller step may succeed, and the state is unchanged.
        guideway::Error::TooManySubsteps { .. } => Error::discard(error),
        error => Error::caused(&error),
    }
}

impl GuidewayFmu {
    /// The guideway that the parameters describe. Builds it unless it already exists.
    fn build(&mut self, values: &Values) -> Result<&mut Built, Error> {
        let description = self.parameters.apply(&self.layout, values)?;
        let file = self.profile_file(&description)?;
        let mut hasher = DefaultHasher::new();
        serde_json::to_string(&description).map_err(Error::invalid)?.hash(&mut hasher);
        file.hash(&mut hasher);
        let key = hasher.finish();
        if self.built.as_ref().is_none_or(|built| built.key != key) {
            let guideway = Guideway::new(&description, file.as_deref()).map_err(caused)?;
            let place = self.parameters.chirp_position(values);
            self.built = Some(Built::new(key, guideway, place));
        }
        self.built.as_mut().ok_or_else(|| Error::invalid("no guideway was built"))
    }

    /// Text of the irregularity file, if one is set.
    fn profile_file(&self, description: &GuidewayDescription) -> Result<Option<String>, Error> {
        let Some(file) = description.irregularity.file.as_ref() else { return Ok(None) };
        if !description.irregularity.on {
            return Ok(None);
        }
        // Joining an absolute path gives that path.
        let path = self.resources.join(file);
        std::fs::read_to_string(&path)
            .map(Some)
            .map_err(|source| caused(guideway::Error::ProfileFile { path, source }))
    }

    /// The guideway that a state belongs to.
    fn built_for(&mut self, state: &State, values: &Values) -> Result<&mut Built, Error> {
        if self.built.as_ref().is_none_or(|built| built.key != state.key) {
            // The state was restored into an instance with other parameters.
            self.build(values)?;
        }
        match &mut self.built {
            Some(built) if built.key == state.key => Ok(built),
            _ => Err(Error::invalid(format!(
                "at t = {} s: the guideway state belongs to another irregularity file or other \
                 parameters; restore the file, or initialize again",
                state.time
            ))),
        }
    }
}

impl Built {
    fn new(key: u64, guideway: Guideway, place: f64) -> Self {
        let (magnets, modes) = (guideway.magnets(), guideway.modes().len());
        Self {
            key,
            work: Workspace::new(&guideway),
            loads: vec![Load::default(); magnets],
            place,
            accelerations: vec![0.0; modes],
            surfaces: vec![RailSurface::default(); magnets],
            guideway,
            seen: Seen::default(),
        }
    }

    /// Forces and places at this moment.
    fn hold(&mut self, inputs: &InputHandles, values: &Values) {
        let pairs = values.reals(inputs.force).iter().zip(values.reals(inputs.position));
        for (load, (&force, &place)) in self.loads.iter_mut().zip(pairs) {
            *load = Load::standing(force, place);
        }
        if let Some(lateral) = inputs.lateral {
            for (load, &force) in self.loads.iter_mut().zip(values.reals(lateral)) {
                load.lateral[0] = force;
            }
        }
    }

    /// Forces and places as polynomials over a step.
    fn follow(&mut self, inputs: &InputHandles, values: &Values, from_speed: bool) {
        let [v, a, j, _] = *values.taylor(inputs.speed);
        let pairs = values.taylors(inputs.force).iter().zip(values.taylors(inputs.position));
        for (load, (&force, &position)) in self.loads.iter_mut().zip(pairs) {
            *load = Load { force, position, ..Load::default() };
        }
        let further = values.furthers(inputs.force).iter().zip(values.furthers(inputs.position));
        for (load, (&force, &position)) in self.loads.iter_mut().zip(further) {
            load.further = [force, position, [0.0; 2]];
        }
        for load in self.loads.iter_mut().filter(|load| from_speed && load.stands()) {
            load.position = [load.position[0], v, a, j];
        }
        if let Some(lateral) = inputs.lateral {
            for (load, &force) in self.loads.iter_mut().zip(values.taylors(lateral)) {
                load.lateral = force;
            }
            for (load, &further) in self.loads.iter_mut().zip(values.furthers(lateral)) {
                load.further[2] = further;
            }
        }
    }

    /// The external force, if there is any now.
    fn external(
        &self,
        inputs: &InputHandles,
        values: &Values,
        read: impl Fn(&Values, RealVar) -> [f64; 4],
    ) -> Option<PointForce> {
        let force = read(values, inputs.external?);
        let position = self.place;
        (force != [0.0; 4]).then_some(PointForce { position, force })
    }

    /// Computes the surfaces unless they are those of this state and these inputs already.
    fn refresh(&mut self, inputs: &InputHandles, state: &State, values: &Values) {
        let (forces, positions) = (values.reals(inputs.force), values.reals(inputs.position));
        let lateral = inputs.lateral.map_or(&[][..], |row| values.reals(row));
        let external =
            self.external(inputs, values, |values, input| [values.real(input), 0.0, 0.0, 0.0]);
        let seen = &self.seen;
        if seen.valid
            && seen.time.to_bits() == state.time.to_bits()
            && seen.girders == state.girders
            && seen.forces == forces
            && seen.lateral == lateral
            && seen.positions == positions
            && seen.external == external
        {
            return;
        }
        self.hold(inputs, values);
        let Self { guideway, work, loads, accelerations, surfaces, seen, .. } = self;
        let now = (&state.girders, state.time);
        guideway.accelerations_with(work, now, loads, external, accelerations);
        for (k, (surface, &x)) in surfaces.iter_mut().zip(positions).enumerate() {
            if guideway.rails().is_some() {
                *surface = guideway.rail(work, &state.girders, accelerations, k, x);
            } else {
                surface.vertical = guideway.surface(work, &state.girders, accelerations, x);
            }
        }
        (seen.valid, seen.time, seen.external) = (true, state.time, external);
        seen.girders.clone_from(&state.girders);
        seen.forces.clear();
        seen.forces.extend_from_slice(forces);
        seen.lateral.clear();
        seen.lateral.extend_from_slice(lateral);
        seen.positions.clear();
        seen.positions.extend_from_slice(positions);
    }

    /// Motion of the named point `k`.
    fn point(&mut self, girders: &guideway::State, k: usize) -> SpanMotion {
        self.guideway.point(&mut self.work, girders, &self.accelerations, k)
    }

    /// Vertical, lateral and twisting motion in the middle of span `k`.
    fn middle(&mut self, girders: &guideway::State, k: usize) -> [SpanMotion; 3] {
        let span = self.guideway.spans()[k];
        let x = 0.5 * self.guideway.girders()[span.girder].length();
        self.guideway.section_motion(&mut self.work, girders, &self.accelerations, k, x)
    }

    /// Motion at a quarter of span `k`.
    fn quarter(&mut self, girders: &guideway::State, k: usize) -> SpanMotion {
        self.guideway.span_motion(&mut self.work, girders, &self.accelerations, k, 0.25)
    }
}

/// Index of `output` in a row, if it belongs to the row.
fn index_in(row: fmi2_export::RealVars, output: RealVar) -> Option<usize> {
    let first = row.checked_get(0)?.value_reference();
    let k = output.value_reference().checked_sub(first)? as usize;
    (k < row.len()).then_some(k)
}

impl Model for GuidewayFmu {
    type State = State;

    fn declare(resources: &Resources, interface: &mut Interface) -> Result<Self, Error> {
        interface.describe(table::info());
        let in_layout = |error| caused(error).context("resource guideway.json");
        let mut layout =
            GuidewayDescription::from_json(&resources.read_to_string("guideway.json")?)
                .map_err(in_layout)?;
        for (girder, file) in layout.shapes_files() {
            let text = resources.read_to_string(&file)?;
            layout.set_shapes(&girder, &text).map_err(in_layout)?;
        }
        for file in layout.rail_files() {
            let text = resources.read_to_string(&file)?;
            let in_file = |error| caused(error).context(format!("resource {file}"));
            layout.set_rail_file(&file, &text).map_err(in_file)?;
        }
        if let Some(file) = &layout.irregularity.file
            && !std::path::Path::new(file).is_absolute()
        {
            // Part of the unit's GUID like the layout itself.
            resources.read(file)?;
        }
        // Only for the table: the profile is built when a simulation needs it.
        let mut bare = layout.clone();
        bare.irregularity.on = false;
        if let Some(rails) = &mut bare.rails {
            rails.irregularity.on = false;
        }
        (bare.stiffness_factor, bare.mass_factor) = (1.0, 1.0);
        let guideway = Guideway::new(&bare, None).map_err(caused)?;
        let prefixes = prefixes(&layout);
        let (magnets, spans) = (guideway.magnets(), guideway.spans().len());
        let mut inputs = InputHandles::declare(interface, magnets);
        let mut outputs = OutputHandles::declare(interface, magnets, spans);
        let mut parameters = ParameterHandles::declare(interface, &layout, &guideway, &prefixes)?;
        let derived =
            DerivedHandles::declare(interface, &layout, &guideway, &prefixes, &parameters);
        outputs.declare_dependencies(interface, &inputs, &parameters);
        let points: Arc<[_]> = PointHandles::declare(interface, &guideway, &inputs).into();
        // last, so that the variables before it keep their value references
        let chirp_force = parameters.declare_chirp_force(interface);
        if guideway.rails().is_some() {
            inputs.lateral = Some(rails::declare_forces(interface, magnets));
            outputs.rails = Some(RailOutputs::declare(interface, &guideway, &inputs, &outputs));
        }
        outputs.joints = guideway.joints().then(|| JointOutputs::declare(interface, &guideway));
        parameters.declare_rails(interface, &layout, &guideway, &prefixes, &outputs)?;
        inputs.declare_external(interface, &outputs, &points);
        let resources = resources.path().to_path_buf();
        let built = None;
        Ok(Self {
            layout,
            resources,
            inputs,
            outputs,
            points,
            chirp_force,
            derived,
            parameters,
            built,
        })
    }

    fn copied(&self, _: &Resources) -> Option<Self> {
        Some(self.clone())
    }

    fn initialise(&mut self, values: &mut Values, time: f64) -> Result<State, Error> {
        let inputs = self.inputs;
        let built = self.build(values)?;
        built.hold(&inputs, values);
        let speed = values.real(inputs.speed);
        let external =
            built.external(&inputs, values, |values, input| [values.real(input), 0.0, 0.0, 0.0]);
        let girders = built
            .guideway
            .initial_state_with(&mut built.work, &built.loads, external, speed, time)
            .map_err(caused)?;
        let state = State { girders, key: built.key, time, acceleration: 0.0 };
        if let Some(built) = &self.built {
            for (girder, kind) in built.guideway.girders().iter().zip(&self.derived.kinds) {
                kind.write(girder, values);
            }
            self.parameters.write_rails(&built.guideway, values);
        }
        Ok(state)
    }

    fn outputs(&mut self, state: &State, values: &mut Values, time: f64) -> Result<(), Error> {
        let (inputs, outputs, points) = (self.inputs, self.outputs, self.points.clone());
        let chirp_force = self.chirp_force;
        let built = self.built_for(state, values)?;
        built.refresh(&inputs, state, values);
        let force = built.guideway.chirp().map_or(0.0, |chirp| chirp.at(time));
        values.set_real(chirp_force, force);
        let speed = values.real(inputs.speed);
        let mut write = |row, of: &dyn Fn(&Surface) -> f64| {
            for (value, rail) in values.reals_mut(row).iter_mut().zip(&built.surfaces) {
                *value = of(&rail.vertical);
            }
        };
        write(outputs.displacement, &Surface::displacement);
        write(outputs.rate, &|s| s.rate(speed));
        write(outputs.deflection, &|s| s.u);
        write(outputs.irregularity, &|s| s.r);
        for k in 0..built.guideway.spans().len() {
            let y =
                built.guideway.mid_span(&mut built.work, &state.girders, &built.accelerations, k);
            values.set_real(outputs.midspan_displacement.get(k), y.displacement);
            values.set_real(outputs.midspan_velocity.get(k), y.velocity);
            values.set_real(outputs.midspan_acceleration.get(k), y.acceleration);
            let y = built.quarter(&state.girders, k);
            values.set_real(outputs.quarter_displacement.get(k), y.displacement);
        }
        if let Some(rails) = outputs.rails {
            for (k, rail) in built.surfaces.iter().enumerate() {
                values.set_real(rails.lateral_displacement.get(k), rail.lateral.displacement());
                values.set_real(rails.lateral_rate.get(k), rail.lateral.rate(speed));
            }
            for k in 0..built.guideway.spans().len() {
                rails.write_span(k, &built.middle(&state.girders, k), values);
            }
        }
        if let Some(joints) = outputs.joints {
            for k in 0..=built.guideway.spans().len() {
                let motion = built.guideway.joint(&mut built.work, &state.girders, k);
                joints.of(k, &motion).for_each(|(output, value)| values.set_real(output, value));
            }
        }
        for (k, point) in points.iter().enumerate() {
            point.write(&built.point(&state.girders, k), values);
        }
        Ok(())
    }

    fn step(&mut self, state: &mut State, values: &mut Values, step: Step) -> Result<(), Error> {
        let inputs = self.inputs;
        let from_speed = self.parameters.position_from_speed(values);
        let built = self.built_for(state, values)?;
        built.follow(&inputs, values, from_speed);
        let external = built.external(&inputs, values, |values, input| *values.taylor(input));
        built
            .guideway
            .step_with(
                &mut built.work,
                &mut state.girders,
                &built.loads,
                external,
                (step.time, step.size),
            )
            .map_err(caused)?;
        let [_, a, j, s] = *values.taylor(inputs.speed);
        state.acceleration = a + step.size * (j + 0.5 * step.size * s);
        state.time = step.end();
        Ok(())
    }

    fn prepare_derivatives(&mut self, state: &State, values: &Values) -> Result<(), Error> {
        let inputs = self.inputs;
        self.built_for(state, values)?.refresh(&inputs, state, values);
        Ok(())
    }

    /// Displacement, deflection and irregularity up to order 2, rate of order 1, and the mid-span
    /// outputs as far as they are each other's derivatives; magnets move with the input speed.
    fn output_derivative(
        &mut self,
        state: &State,
        values: &Values,
        output: RealVar,
        order: u32,
    ) -> Result<Option<f64>, Error> {
        let outputs = self.outputs;
        let (v, a) = (values.real(self.inputs.speed), state.acceleration);
        // The preparation computed the surfaces for this state and these values.
        let built = self.built.as_mut().ok_or_else(|| Error::invalid("no guideway was built"))?;
        let part = |s: &Surface, row| match row {
            0 | 1 => *s,
            2 => Surface { r: 0.0, r_x: 0.0, r_xx: 0.0, ..*s },
            _ => Surface { r: s.r, r_x: s.r_x, r_xx: s.r_xx, ..Surface::default() },
        };
        let rows = [outputs.displacement, outputs.rate, outputs.deflection, outputs.irregularity];
        for (i, row) in rows.into_iter().enumerate() {
            let Some(k) = index_in(row, output) else { continue };
            let s = part(&built.surfaces[k].vertical, i);
            return Ok(match (i, order) {
                (1, 1) => Some(s.acceleration(v, a)),
                (1, _) => None,
                (_, 1) => Some(s.rate(v)),
                (_, 2) => Some(s.acceleration(v, a)),
                _ => None,
            });
        }
        if let Some(rails) = outputs.rails {
            for (i, row) in [rails.lateral_displacement, rails.lateral_rate].into_iter().enumerate()
            {
                let Some(k) = index_in(row, output) else { continue };
                let s = built.surfaces[k].lateral;
                return Ok(match i as u32 + order {
                    1 => Some(s.rate(v)),
                    2 => Some(s.acceleration(v, a)),
                    _ => None,
                });
            }
            for (row, component) in rails.of_spans() {
                let Some(k) = index_in(row, output) else { continue };
                let y = built.middle(&state.girders, k)[component];
                return Ok(match order {
                    1 => Some(y.velocity),
                    2 => Some(y.acceleration),
                    _ => None,
                });
            }
        }
        let rows = [outputs.midspan_displacement, outputs.midspan_velocity];
        for (i, row) in rows.into_iter().enumerate() {
            let Some(k) = index_in(row, output) else { continue };
            let Built { guideway, work, accelerations, .. } = built;
            let y = guideway.mid_span(work, &state.girders, accelerations, k);
            return Ok(match i as u32 + order {
                1 => Some(y.velocity),
                2 => Some(y.acceleration),
                _ => None,
            });
        }
        if let Some(k) = index_in(outputs.quarter_displacement, output) {
            let y = built.quarter(&state.girders, k);
            return Ok(match order {
                1 => Some(y.velocity),
                2 => Some(y.acceleration),
                _ => None,
            });
        }
        let named = self.points.iter().enumerate();
        if let Some((k, own)) = named.filter_map(|(k, p)| Some((k, p.order_of(output)?))).next() {
            let y = built.point(&state.girders, k);
            return Ok(match own + order {
                1 => Some(y.velocity),
                2 => Some(y.acceleration),
                _ => None,
            });
        }
        Ok(None)
    }

    fn directional_derivative(
        &mut self,
        state: &State,
        values: &Values,
        seed: &Seed,
        result: &mut Sensitivity,
    ) -> Result<bool, Error> {
        let (inputs, outputs, points) = (self.inputs, self.outputs, self.points.clone());
        let built = self.built_for(state, values)?;
        built.refresh(&inputs, state, values);
        let speed = values.real(inputs.speed);
        let (places, faster) = (seed.reals(inputs.position), seed.real(inputs.speed));
        for (k, (rail, &dx)) in built.surfaces.iter().zip(places).enumerate() {
            let s = &rail.vertical;
            if let Some(rails) = outputs.rails {
                let s = &rail.lateral;
                result.set_real(rails.lateral_displacement.get(k), s.slope() * dx);
                let rate = s.rate_slope(speed) * dx + s.slope() * faster;
                result.set_real(rails.lateral_rate.get(k), rate);
            }
            result.set_real(outputs.displacement.get(k), s.slope() * dx);
            result.set_real(outputs.deflection.get(k), s.u_x * dx);
            result.set_real(outputs.irregularity.get(k), s.r_x * dx);
            let rate = s.rate_slope(speed) * dx + s.slope() * faster;
            result.set_real(outputs.rate.get(k), rate);
        }
        built.hold(&inputs, values);
        let lateral = inputs.lateral.map(|row| seed.reals(row));
        let changes = seed.reals(inputs.force).iter().zip(places).enumerate();
        let changes = changes.map(|(k, (&force, &place))| LoadChange {
            force,
            place,
            lateral: lateral.map_or(0.0, |all| all[k]),
        });
        // The change overwrites the accelerations, so they must be recomputed.
        built.seen.valid = false;
        let Built { guideway, work, loads, accelerations, place, .. } = built;
        guideway.acceleration_change(work, loads, changes, accelerations);
        let external = inputs.external.map_or(0.0, |input| seed.real(input));
        if external != 0.0 {
            guideway.add_acceleration_under(work, *place, external, accelerations);
        }
        for k in 0..guideway.spans().len() {
            let y = guideway.mid_span(work, &state.girders, accelerations, k);
            result.set_real(outputs.midspan_acceleration.get(k), y.acceleration);
        }
        for (k, point) in points.iter().enumerate() {
            let y = guideway.point(work, &state.girders, accelerations, k);
            result.set_real(point.acceleration, y.acceleration);
        }
        Ok(true)
    }

    fn report(
        &mut self,
        state: &State,
        values: &Values,
        request: &str,
    ) -> Result<Option<String>, Error> {
        if ![StateSpace::REQUEST, Motions::REQUEST].contains(&request) {
            return Ok(None);
        }
        let (inputs, outputs, points) = (self.inputs, self.outputs, self.points.clone());
        let chirp = self.chirp_force;
        let built = self.built_for(state, values)?;
        built.refresh(&inputs, state, values);
        built.hold(&inputs, values);
        let Built { guideway, work, loads, surfaces, place, .. } = built;
        let chirp = (chirp, *place);
        if request == Motions::REQUEST {
            return linear::motions(guideway, work).map(Some);
        }
        let handles = (&inputs, &outputs, &*points);
        linear::report(guideway, work, loads, surfaces, values, handles, chirp).map(Some)
    }
}
