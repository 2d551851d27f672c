//! External forces and moments on the car bodies: their inputs, and their values for the physics.

use fmi2_export::{Interface, RealVar, Seed, UnitOfMeasure, Values, VariableRow};
use multibody::{ExternalLoad, VehicleModel};

/// Handles of the inputs of each observed body: force along x, y, z, moment about x, y, z.
#[derive(Debug, Clone)]
pub(crate) struct ExternalHandles(Vec<[RealVar; 6]>);

/// The inputs' values, and their course over a step. Memory only: filled before each use.
#[derive(Debug, Clone)]
pub(crate) struct ExternalLoads {
    pub now: Vec<ExternalLoad>,
    pub course: Vec<[[f64; 4]; 6]>,
}

impl ExternalHandles {
    pub fn declare(interface: &mut Interface, model: &VehicleModel) -> Self {
        let names: Vec<String> = model.observed().map(|(name, _)| name.to_owned()).collect();
        Self(names.iter().map(|name| of_body(interface, name)).collect())
    }

    /// The inputs of each observed body.
    pub fn bodies(&self) -> impl Iterator<Item = &[RealVar; 6]> {
        self.0.iter()
    }

    pub fn rows(&self) -> impl Iterator<Item = VariableRow> {
        self.0.as_flattened().iter().map(|variable| variable.row())
    }

    pub fn memory(&self) -> ExternalLoads {
        let count = self.0.len();
        ExternalLoads { now: vec![[0.0; 6]; count], course: vec![[[0.0; 4]; 6]; count] }
    }

    /// Whether the values are these.
    pub fn are(&self, loads: &[ExternalLoad], values: &Values) -> bool {
        self.0.as_flattened().iter().zip(loads.as_flattened()).all(|(v, u)| values.real(*v) == *u)
    }
}

fn of_body(interface: &mut Interface, name: &str) -> [RealVar; 6] {
    let axes = [
        ("x", "forward", "x, positive with the left side up"),
        ("y", "to the left", "y, positive with the nose down"),
        ("z", "up", "z, positive to the left"),
    ];
    let force = axes.map(|(axis, direction, _)| {
        interface
            .real(format!("{name}_external_force_{axis}"))
            .input(0.0)
            .unit(UnitOfMeasure::NEWTON)
            .nominal(1e3)
            .description(format!(
                "{name}: external force such as wind at the centre of mass of the body, {direction}"
            ))
            .done()
    });
    let moment = axes.map(|(axis, _, about)| {
        interface
            .real(format!("{name}_external_moment_{axis}"))
            .input(0.0)
            .unit(UnitOfMeasure::NEWTON_METRE)
            .nominal(1e3)
            .description(format!("{name}: external moment about {about}"))
            .done()
    });
    let ([fx, fy, fz], [mx, my, mz]) = (force, moment);
    [fx, fy, fz, mx, my, mz]
}

impl ExternalLoads {
    /// The present values.
    pub fn hold(&mut self, inputs: &ExternalHandles, values: &Values) -> &[ExternalLoad] {
        for (load, variables) in self.now.iter_mut().zip(&inputs.0) {
            *load = variables.map(|variable| values.real(variable));
        }
        &self.now
    }

    /// The components of a direction.
    pub fn seed(&mut self, inputs: &ExternalHandles, seed: &Seed) -> &[ExternalLoad] {
        for (load, variables) in self.now.iter_mut().zip(&inputs.0) {
            *load = variables.map(|variable| seed.real(variable));
        }
        &self.now
    }

    /// The polynomials over the step.
    pub fn follow(&mut self, inputs: &ExternalHandles, values: &Values) -> &[[[f64; 4]; 6]] {
        for (course, variables) in self.course.iter_mut().zip(&inputs.0) {
            *course = variables.map(|variable| *values.taylor(variable));
        }
        &self.course
    }
}
