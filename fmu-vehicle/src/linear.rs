//! The report `linear`: small motions about the current state, from forces to gaps.

use fmi2_export::{Error, Motions, RealVars, StateSpace, Values};
use multibody::math::Vec3;
use multibody::{AppliedForces, Linearisation, MagnetSprings, VehicleModel};
use nalgebra::{Cholesky, DMatrix, Dyn};

use crate::contact::{ContactHandles, check_linear};
use crate::external::ExternalHandles;
use crate::state::State;
use crate::table::{InputHandles, OutputHandles, SidewaysHandles};

/// Handles of the variables that the report names.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Handles<'a> {
    pub inputs: &'a InputHandles,
    pub outputs: &'a OutputHandles,
    pub contact: &'a ContactHandles,
    pub external: &'a ExternalHandles,
    pub sideways: &'a SidewaysHandles,
}

/// Linearises about a vehicle at rest in the travelling frame, on a line the frame that turns with it: x = (y, ẏ), the reduced coordinates and
/// their rates, with ÿ = M⁻¹(Jᵀf − C ẏ − K y) and J the magnets' shapes.
pub(crate) fn report(
    model: &VehicleModel,
    state: &State,
    values: &Values,
    handles: &Handles,
) -> Result<String, Error> {
    let Handles { inputs, outputs, contact, external, sideways } = *handles;
    let linear = linearised(model, state, values, handles)?;
    let (journey, state) = (state.journey, &state.vehicle);
    let track = contact.track(values, (inputs, sideways), journey.speed);
    let slopes: Vec<[Vec3; 2]> = model
        .magnets()
        .map(|k| track.map_or([Vec3::zeros(); 2], |track| model.contact_slopes(state, k, &track)))
        .collect();
    let shapes = MagnetShapes::new(model, state, &linear)?;
    let mut system = StateSpace::default();
    shapes.write_states(&mut system, inputs);
    let rows = shapes.write_outputs(&mut system, inputs, outputs);
    shapes.write_contact(&mut system, contact.force, &slopes, rows);
    let pushed = model.external_shapes(state, &linear);
    shapes.write_external(&mut system, external, &linear, &pushed, rows)?;
    let side = system.inputs(sideways.displacement);
    for k in 0..shapes.magnets {
        system.d(rows.offset + k, side + k, -1.0);
    }
    if let Some(track) = track {
        let side_rate = system.inputs(sideways.rate);
        for k in model.magnets() {
            let slope = model.contact_side_slope(state, k, &track);
            shapes.write_push(&mut system, k.0, &slope, side_rate + k.0, rows.down);
        }
    }
    system.to_json()
}

/// The equations of motion about the state.
fn linearised(
    model: &VehicleModel,
    state: &State,
    values: &Values,
    handles: &Handles,
) -> Result<Linearisation, Error> {
    let Handles { inputs, contact, external, sideways, .. } = *handles;
    let (journey, state) = (state.journey, &state.vehicle);
    let track = contact.track(values, (inputs, sideways), journey.speed);
    check_linear(model, state, track.as_ref()).map_err(|e| e.context("the report linear"))?;
    let mut memory = external.memory();
    let forces = AppliedForces {
        magnets: inputs.loads(values),
        external: memory.hold(external, values),
        acceleration: journey.acceleration,
    };
    let (springs, mut work) = (MagnetSprings::default(), model.workspace());
    model
        .linearise_in_contact(state, forces, &springs, track.as_ref(), &mut work)
        .map_err(|e| Error::caused(&e).context("the report linear"))
}

/// The report `motions`: displacements of the bodies' centres of mass in the axes of the travelling frame
/// and rotations in body axes, by the states of the report `linear`.
pub(crate) fn motions(
    model: &VehicleModel,
    state: &State,
    values: &Values,
    handles: &Handles,
) -> Result<String, Error> {
    let linear = linearised(model, state, values, handles)?;
    let mut motions = Motions::default();
    for (body, name) in model.body_names().enumerate() {
        for (axis, direction) in ["x", "y", "z", "rx", "ry", "rz"].into_iter().enumerate() {
            let unit = if axis < 3 { "m" } else { "rad" };
            let motion = motions.motion(name, direction, None, unit);
            for (state, &value) in linear.basis.row(6 * body + axis).iter().enumerate() {
                motions.by(motion, state, value);
            }
        }
    }
    motions.to_json()
}

/// Indices of the magnets' accelerations among the outputs, and of the track among the inputs.
#[derive(Debug, Clone, Copy)]
struct Rows {
    down: usize,
    offset: usize,
    track: usize,
    track_rate: usize,
}

/// Matrices of the equations of motion and of the magnets' displacements.
struct MagnetShapes {
    dof: usize,
    magnets: usize,
    /// Changes of the magnets' places per reduced coordinate.
    along: DMatrix<f64>,
    side: DMatrix<f64>,
    up: DMatrix<f64>,
    /// Displacements of the magnets up, along their levitation forces; on a line a little different.
    lift: DMatrix<f64>,
    /// Slopes of the magnets' accelerations, down positive, with coordinates and rates.
    down: [DMatrix<f64>; 2],
    /// −M⁻¹K, −M⁻¹C.
    by_place: DMatrix<f64>,
    by_rate: DMatrix<f64>,
    /// M⁻¹Jᵀ.
    by_force: DMatrix<f64>,
    by_lateral: DMatrix<f64>,
    by_longitudinal: DMatrix<f64>,
    speed: DMatrix<f64>,
}

impl MagnetShapes {
    fn new(
        model: &VehicleModel,
        state: &multibody::State,
        linear: &Linearisation,
    ) -> Result<Self, Error> {
        let [along, side, up] = by_axis(&model.magnet_places(state, linear));
        let [push, pull, lift] = by_axis(&model.magnet_shapes(state, linear));
        let factors = factors(linear)?;
        let speed = model.speed_shape(state, linear);
        let by_place = -factors.solve(&linear.stiffness);
        let by_rate = -factors.solve(&linear.damping);
        let down = match &linear.magnet_accelerations {
            None => [-&up * &by_place, -&up * &by_rate],
            Some([place, rate]) => [-place, -rate],
        };
        Ok(Self {
            dof: linear.degrees_of_freedom(),
            magnets: up.nrows(),
            by_place,
            by_rate,
            by_force: factors.solve(&lift.transpose()),
            by_lateral: factors.solve(&pull.transpose()),
            by_longitudinal: factors.solve(&push.transpose()),
            along,
            side,
            up,
            lift,
            down,
            speed: DMatrix::from_row_slice(1, speed.len(), speed.as_slice()),
        })
    }

    fn write_states(&self, system: &mut StateSpace, inputs: &InputHandles) {
        for kind in ["place", "rate"] {
            for j in 1..=self.dof {
                system.state(format!("{kind} {j}"));
            }
        }
        let force = system.inputs(inputs.force);
        let lateral = system.inputs(inputs.lateral_force);
        for i in 0..self.dof {
            system.a(i, self.dof + i, 1.0);
            for j in 0..self.dof {
                system.a(self.dof + i, j, self.by_place[(i, j)]);
                system.a(self.dof + i, self.dof + j, self.by_rate[(i, j)]);
            }
            for k in 0..self.magnets {
                system.b(self.dof + i, force + k, self.by_force[(i, k)]);
                system.b(self.dof + i, lateral + k, self.by_lateral[(i, k)]);
            }
        }
    }

    fn write_outputs(
        &self,
        system: &mut StateSpace,
        inputs: &InputHandles,
        outputs: &OutputHandles,
    ) -> Rows {
        let track = system.inputs(inputs.track_displacement);
        let track_rate = system.inputs(inputs.track_rate);
        let rates = self.dof;
        let gap = rows(system, outputs.gap, &-&self.up, 0);
        let gap_rate = rows(system, outputs.gap_rate, &-&self.up, rates);
        for k in 0..self.magnets {
            system.d(gap + k, track + k, 1.0);
            system.d(gap_rate + k, track_rate + k, 1.0);
        }
        let down = rows(system, outputs.acceleration, &self.down[0], 0);
        write(system, down, &self.down[1], rates);
        // the forces are the first inputs, in this order
        let by_loads = [(0, &self.by_force), (self.magnets, &self.by_lateral)];
        for (first, by_load) in by_loads {
            let feed = -&self.lift * by_load;
            for k in 0..self.magnets {
                for j in 0..self.magnets {
                    system.d(down + k, first + j, feed[(k, j)]);
                }
            }
        }
        let offset = rows(system, outputs.lateral_offset, &self.side, 0);
        rows(system, outputs.position, &self.along, 0);
        system.outputs(outputs.static_load);
        let speed = system.output(outputs.speed);
        write(system, speed, &self.speed, rates);
        Rows { down, offset, track, track_rate }
    }

    /// External forces and moments on the observed bodies, which `pushed` moves and turns.
    fn write_external(
        &self,
        system: &mut StateSpace,
        external: &ExternalHandles,
        linear: &Linearisation,
        pushed: &DMatrix<f64>,
        rows: Rows,
    ) -> Result<(), Error> {
        let by_load = factors(linear)?.solve(&pushed.transpose());
        let down = -&self.lift * &by_load;
        for (k, variable) in external.bodies().flatten().enumerate() {
            let input = system.input(*variable);
            for i in 0..self.dof {
                system.b(self.dof + i, input, by_load[(i, k)]);
            }
            for i in 0..self.magnets {
                system.d(rows.down + i, input, down[(i, k)]);
            }
        }
        Ok(())
    }

    /// A force on magnet k, along, left and up, by a unit of an input.
    fn write_push(
        &self,
        system: &mut StateSpace,
        k: usize,
        force: &Vec3,
        input: usize,
        first_down: usize,
    ) {
        let pushed = self.by_longitudinal.column(k) * force.x
            + self.by_lateral.column(k) * force.y
            + self.by_force.column(k) * force.z;
        let down = -&self.lift * &pushed;
        for (i, value) in pushed.iter().enumerate() {
            system.b(self.dof + i, input, *value);
        }
        for (i, value) in down.iter().enumerate() {
            system.d(first_down + i, input, *value);
        }
    }

    /// Forces of stops and skids: their slopes with gap and gap rate are already in the equations of
    /// motion, as far as the magnets move; the track moves them as well.
    fn write_contact(
        &self,
        system: &mut StateSpace,
        force: RealVars,
        slopes: &[[Vec3; 2]],
        rows: Rows,
    ) {
        let output = system.outputs(force);
        for (k, by) in slopes.iter().enumerate() {
            let inputs = [rows.track + k, rows.track_rate + k];
            for ((slope, input), first) in by.iter().zip(inputs).zip([0, self.dof]) {
                self.write_push(system, k, slope, input, rows.down);
                for j in 0..self.dof {
                    system.c(output + k, first + j, -slope.z * self.up[(k, j)]);
                }
                system.d(output + k, input, slope.z);
            }
        }
    }
}

/// Rows along, to the left and up.
fn by_axis(all: &DMatrix<f64>) -> [DMatrix<f64>; 3] {
    [0, 1, 2]
        .map(|axis| DMatrix::from_fn(all.nrows() / 3, all.ncols(), |k, j| all[(3 * k + axis, j)]))
}

/// Factors of the reduced mass matrix.
fn factors(linear: &Linearisation) -> Result<Cholesky<f64, Dyn>, Error> {
    linear.mass.clone().cholesky().ok_or_else(|| {
        Error::invalid("the report linear: the reduced mass matrix is not positive definite")
    })
}

/// Adds a row of outputs y = matrix · x from state `first` on.
fn rows(system: &mut StateSpace, row: RealVars, matrix: &DMatrix<f64>, first: usize) -> usize {
    let output = system.outputs(row);
    write(system, output, matrix, first);
    output
}

fn write(system: &mut StateSpace, output: usize, matrix: &DMatrix<f64>, first: usize) {
    for i in 0..matrix.nrows() {
        for j in 0..matrix.ncols() {
            system.c(output + i, first + j, matrix[(i, j)]);
        }
    }
}
