//! Where loops are broken in a coupled system.
//!
//! A loop is broken at a signal: what others receive of it becomes an input, and the signal itself is
//! what returns. Three kinds of signals can be broken:
//!
//! - an output inside its unit, if the unit's linearisation has an input of the same name: what adds to
//!   it. So the voltage of a magnet with its controller inside;
//! - an output that is connected, for everything that receives it;
//! - an input that is connected, for this input alone.

use linear::{LinearSystem, Open, Port};

use crate::error::ResponseError;
use crate::model::Model;
use linear::Quantity;

/// A signal at which a loop is broken.
#[derive(Debug, Clone, PartialEq)]
pub struct BreakPoint {
    /// The signal, `instance.variable`.
    pub name: Quantity,
    /// Inputs that receive it, with the factors of their connections.
    to: Vec<(Port, f64)>,
    /// Outputs whose sum it is.
    from: Vec<(Port, f64)>,
}

impl BreakPoint {
    /// The signal of this name, `instance.variable`.
    ///
    /// # Errors
    /// There is none, or no loop goes through it.
    pub fn new(system: &LinearSystem, name: &str) -> Result<Self, ResponseError> {
        let named = || name.to_owned();
        let (input, output) = (system.input(name), system.output(name));
        match (input, output) {
            (Ok(input), Ok(output)) => Ok(Self {
                name: system.output_name(output),
                to: vec![(input, 1.0)],
                from: vec![(output, 1.0)],
            }),
            (_, Ok(output)) => {
                let fed = system.connections.iter().filter(|it| it.from == output);
                let to: Vec<(Port, f64)> = fed.map(|it| (it.to, it.factor)).collect();
                if to.is_empty() {
                    return Err(ResponseError::NotFed { name: named() });
                }
                Ok(Self { name: system.output_name(output), to, from: vec![(output, 1.0)] })
            }
            (Ok(input), _) => {
                let feeding = system.connections.iter().filter(|it| it.to == input);
                let from: Vec<(Port, f64)> = feeding.map(|it| (it.from, it.factor)).collect();
                if from.is_empty() {
                    return Err(ResponseError::NotConnected { name: named() });
                }
                Ok(Self { name: system.input_name(input), to: vec![(input, 1.0)], from })
            }
            (Err(_), Err(error)) => Err(error.into()),
        }
    }
}

/// The loop transfer functions L of loops that are all broken, of the sign with which the closed loops are
/// singular where det(I + L) = 0.
///
/// # Errors
/// An algebraic loop has no solution.
pub fn loops(system: &LinearSystem, points: &[BreakPoint]) -> Result<Model, ResponseError> {
    let inputs: Vec<Port> = points.iter().flat_map(|it| it.to.iter().map(|to| to.0)).collect();
    let outputs: Vec<Port> = points.iter().flat_map(|it| it.from.iter().map(|it| it.0)).collect();
    let all = system.open(&Open { cut: Vec::new(), inputs, outputs })?;
    let all = Model::from(&all);
    // what adds to a signal reaches all that receive it
    let joined = |factors: &dyn Fn(&BreakPoint) -> Vec<f64>| {
        let mut first = 0;
        let mut rows = Vec::new();
        for point in points {
            let factors = factors(point);
            let places: Vec<(usize, f64)> =
                factors.iter().enumerate().map(|(k, factor)| (first + k, *factor)).collect();
            first += factors.len();
            rows.push(places);
        }
        rows
    };
    let to = joined(&|point| point.to.iter().map(|it| it.1).collect());
    let from = joined(&|point| point.from.iter().map(|it| it.1).collect());
    let (n, m) = (all.a.nrows(), points.len());
    let sum = |list: &[(usize, f64)], of: &dyn Fn(usize) -> f64| -> f64 {
        list.iter().map(|&(k, factor)| factor * of(k)).sum()
    };
    let closed = Model {
        b: faer::Mat::from_fn(n, m, |i, j| sum(&to[j], &|k| all.b[(i, k)])),
        c: faer::Mat::from_fn(m, n, |i, j| sum(&from[i], &|k| all.c[(k, j)])),
        d: faer::Mat::from_fn(m, m, |i, j| sum(&from[i], &|k| sum(&to[j], &|l| all.d[(k, l)]))),
        ..all
    };
    closed.opened().ok_or_else(|| {
        let names: Vec<&str> = points.iter().map(|it| it.name.name.as_str()).collect();
        ResponseError::Algebraic { at: names.join(", ") }
    })
}
