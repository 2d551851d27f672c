//! A discrete model of a unit that reports nothing of its inside, identified from steps that are made from a
//! saved state.

use faer::Mat;
use fmi2_import::description::{Causality, ModelDescription, Type, Variable};
use fmi2_import::instance::{FmuError, Instance, StateId};

use super::error::LinearError;
use super::identified::Identified;
use super::unit::Quantity;

/// Steps of each response.
const STEPS: usize = 1001;
/// Which responses are compared: close ones for fast motions, far ones for slow motions.
const OFFSETS: [usize; 27] = [
    0, 1, 2, 3, 4, 5, 6, 7, 8, 10, 13, 16, 20, 25, 31, 39, 49, 61, 76, 95, 119, 149, 186, 233, 291,
    364, 455,
];
/// Steps after which the inputs of the comparison change, in its second half.
const SLOW: usize = 50;
/// Change of an input, as a share of its size.
const SMALL: f64 = 1e-4;
/// Singular values below this share of the largest are noise.
const NOISE: f64 = 1e-7;
/// A model with a smaller relative error is accepted.
const CLOSE: f64 = 1e-4;
/// An input that is smaller than this share of its nominal value counts as zero.
const ROUNDED: f64 = 1e-6;
/// Responses that are smaller than this share of the output are rounding errors.
const FLOOR: f64 = 1e-9;
/// Responses of an output that are smaller than this share of its largest one do not count.
const UNSEEN: f64 = 1e-6;
/// Multiples of the communication step that are tried: a sampled unit repeats itself after some steps.
const MULTIPLES: [usize; 7] = [1, 2, 3, 4, 5, 8, 10];
/// Communication steps that an identification may make from the start.
pub const IDENTIFYING_STEPS: u32 = STEPS as u32 * 10;
/// Most rows or columns of the Hankel matrix.
const LARGEST: usize = 2000;

/// An identified unit.
#[derive(Debug, Clone)]
pub struct UnitSteps {
    /// Real inputs.
    pub inputs: Vec<Quantity>,
    /// Real outputs, at the end of a step.
    pub outputs: Vec<Quantity>,
    /// The model.
    pub model: Identified,
    /// Its step (s): a multiple of the communication step.
    pub step: f64,
    /// Root mean square of the error over that of the response, for other changes than those of the
    /// identification; the worst pair of input and output.
    pub error: f64,
}

impl UnitSteps {
    /// Identifies a unit about its current state. The state is the same afterwards.
    ///
    /// # Errors
    /// The unit cannot save its state, has too many variables, or a call fails.
    pub fn of(instance: &mut Instance, time: f64, step: f64) -> Result<Self, LinearError> {
        let name = instance.name().to_owned();
        let refused = |why: String| LinearError::Unidentified { instance: name.clone(), why };
        let description = instance.package().description();
        if !description.co_simulation.can_get_and_set_fmu_state {
            return Err(refused("it cannot save and restore its state".to_owned()));
        }
        let (inputs, outputs) =
            (reals(description, Causality::Input), reals(description, Causality::Output));
        if inputs.is_empty() || outputs.is_empty() {
            return Err(refused("it has no Real inputs, or no Real outputs".to_owned()));
        }
        let blocks = OFFSETS.len();
        if inputs.len().max(outputs.len()) * blocks > LARGEST {
            return Err(refused(format!(
                "it has {} inputs and {} outputs; at most {} of each are identified",
                inputs.len(),
                outputs.len(),
                LARGEST / blocks
            )));
        }
        let quantity = |it: &Port| it.quantity.clone();
        let (named_inputs, named_outputs) =
            (inputs.iter().map(quantity).collect(), outputs.iter().map(quantity).collect());
        let call = |source| LinearError::Steps { instance: name.clone(), source };
        let saved = instance.save_state(None).map_err(call)?;
        let mut rig = Rig { instance, inputs, outputs, saved, time, step, rest: Vec::new() };
        let found = rig.best();
        rig.instance.restore_state(saved).map_err(call)?;
        rig.instance.free_state(saved).map_err(call)?;
        let (model, multiple, error) = found.map_err(|it| match it {
            Failure::Call(source) => call(source),
            Failure::Linear(error) => error,
        })?;
        Ok(Self {
            inputs: named_inputs,
            outputs: named_outputs,
            model,
            step: multiple as f64 * step,
            error,
        })
    }
}

/// Why an identification failed.
enum Failure {
    Call(FmuError),
    Linear(LinearError),
}

impl From<FmuError> for Failure {
    fn from(error: FmuError) -> Self {
        Self::Call(error)
    }
}

/// One variable.
struct Port {
    reference: u32,
    quantity: Quantity,
    nominal: f64,
}

fn reals(description: &ModelDescription, causality: Causality) -> Vec<Port> {
    let wanted = |it: &&Variable| it.kind == Type::Real && it.causality == causality;
    let port = |it: &Variable| Port {
        reference: it.value_reference,
        quantity: Quantity { name: it.name.clone(), unit: it.unit.clone() },
        nominal: it.nominal.unwrap_or(1.0),
    };
    description.variables.iter().filter(wanted).map(port).collect()
}

/// Makes steps from the saved state.
struct Rig<'a> {
    instance: &'a mut Instance,
    inputs: Vec<Port>,
    outputs: Vec<Port>,
    saved: StateId,
    time: f64,
    step: f64,
    /// Inputs at the saved state.
    rest: Vec<f64>,
}

impl Rig<'_> {
    /// The model of the smallest multiple of the step that fits, or else of the one that fits best.
    fn best(&mut self) -> Result<(Identified, usize, f64), Failure> {
        let references: Vec<u32> = self.inputs.iter().map(|it| it.reference).collect();
        self.rest = vec![0.0; references.len()];
        self.instance.get_real(&references, &mut self.rest)?;
        let mut best: Option<(Identified, usize, f64)> = None;
        for multiple in MULTIPLES {
            let (model, error) = self.identify(multiple)?;
            if best.as_ref().is_none_or(|it| error < it.2) {
                best = Some((model, multiple, error));
            }
            if error < CLOSE {
                break;
            }
        }
        let none = Failure::Linear(LinearError::Eigenvalues);
        best.ok_or(none)
    }

    /// Change of input j that counts as small.
    fn small(&self, j: usize) -> f64 {
        let (size, nominal) = (self.rest[j].abs(), self.inputs[j].nominal.abs());
        // an input at rest may be a rounding error
        SMALL * if size > ROUNDED * nominal { size } else { nominal }
    }

    fn identify(&mut self, multiple: usize) -> Result<(Identified, f64), Failure> {
        let (p, m) = (self.outputs.len(), self.inputs.len());
        // responses to small changes, both ways, so that curvature cancels
        let mut responses = vec![Mat::<f64>::zeros(p, m); STEPS];
        let mut outputs = vec![0.0_f64; p];
        for j in 0..m {
            let small = self.small(j);
            let pulse = |sign: f64| {
                move |k: usize, i: usize| {
                    if k == 0 && i == j { sign * small } else { 0.0 }
                }
            };
            let up = self.run(multiple, &pulse(1.0))?;
            let down = self.run(multiple, &pulse(-1.0))?;
            for ((response, up), down) in responses.iter_mut().zip(up).zip(down) {
                for i in 0..p {
                    response[(i, j)] = (up[i] - down[i]) / 2.0;
                    outputs[i] = outputs[i].max(up[i].abs());
                }
            }
        }
        // outputs of equal size; those that do not respond become zero
        let sizes: Vec<f64> = (0..p)
            .map(|i| {
                let row = responses
                    .iter()
                    .map(|it| it.row(i).iter().fold(0.0, |m: f64, x| m.max(x.abs())));
                let size = row.fold(0.0, f64::max);
                if size > FLOOR * outputs[i] { size } else { f64::INFINITY }
            })
            .collect();
        for response in &mut responses {
            for (i, size) in sizes.iter().enumerate() {
                response.row_mut(i).iter_mut().for_each(|x| *x /= size);
            }
        }
        let mut model = Identified::new(&responses, &OFFSETS, NOISE).map_err(Failure::Linear)?;
        let error = self.error(&model, multiple, &sizes)?;
        for j in 0..m {
            let small = self.small(j);
            model.b.col_mut(j).iter_mut().for_each(|x| *x /= small);
            model.d.col_mut(j).iter_mut().for_each(|x| *x /= small);
        }
        for (i, &size) in sizes.iter().enumerate() {
            // what does not respond is zero already
            let size = if size.is_finite() { size } else { 0.0 };
            model.c.row_mut(i).iter_mut().for_each(|x| *x *= size);
            model.d.row_mut(i).iter_mut().for_each(|x| *x *= size);
        }
        Ok((model, error))
    }

    /// Outputs at the end of each step with changes of the inputs by step and input.
    fn run(
        &mut self,
        multiple: usize,
        change: &dyn Fn(usize, usize) -> f64,
    ) -> Result<Vec<Vec<f64>>, FmuError> {
        self.instance.restore_state(self.saved)?;
        let inputs: Vec<u32> = self.inputs.iter().map(|it| it.reference).collect();
        let outputs: Vec<u32> = self.outputs.iter().map(|it| it.reference).collect();
        let mut all = Vec::with_capacity(STEPS);
        for k in 0..STEPS {
            let values: Vec<f64> =
                self.rest.iter().enumerate().map(|(j, rest)| rest + change(k, j)).collect();
            self.instance.set_real(&inputs, &values)?;
            for part in 0..multiple {
                let done = (k * multiple + part) as f64;
                self.instance.do_step(self.time + done * self.step, self.step)?;
            }
            let mut values = vec![0.0; outputs.len()];
            self.instance.get_real(&outputs, &mut values)?;
            all.push(values);
        }
        Ok(all)
    }

    /// Compares model and unit for inputs that jump at random, first in every step, then rarely.
    fn error(
        &mut self,
        model: &Identified,
        multiple: usize,
        sizes: &[f64],
    ) -> Result<f64, FmuError> {
        let m = self.inputs.len();
        let small: Vec<f64> = (0..m).map(|j| self.small(j)).collect();
        // a fixed sequence between -1 and 1
        let random = |k: usize, j: usize| {
            let k = if k < STEPS / 2 { k } else { STEPS + k / SLOW };
            let x = (12.9898 * (k + 1) as f64 + 78.233 * (j + 1) as f64).sin() * 43_758.545;
            2.0 * (x - x.floor()) - 1.0
        };
        let mut worst: f64 = 0.0;
        for input in 0..m {
            let alone = |k: usize, j: usize| if j == input { random(k, j) } else { 0.0 };
            let up = self.run(multiple, &|k, j| small[j] * alone(k, j))?;
            let down = self.run(multiple, &|k, j| -small[j] * alone(k, j))?;
            let mut state = Mat::<f64>::zeros(model.a.nrows(), 1);
            // of each output: squares of error and response, and its size
            let mut sums = vec![(0.0, 0.0, 0.0_f64); sizes.len()];
            for (k, (up, down)) in up.iter().zip(&down).enumerate() {
                let change = Mat::from_fn(m, 1, |j, _| alone(k, j));
                let output = &model.c * &state + &model.d * &change;
                state = &model.a * &state + &model.b * &change;
                for (i, (error, signal, size)) in sums.iter_mut().enumerate() {
                    let real = (up[i] - down[i]) / 2.0 / sizes[i];
                    *error += (real - output[(i, 0)]).powi(2);
                    *signal += real * real;
                    *size = size.max(up[i].abs() / sizes[i]);
                }
            }
            for (error, signal, size) in sums {
                // the largest response of each output to an impulse is 1
                let floor = (FLOOR * size).max(UNSEEN) * (STEPS as f64).sqrt();
                worst = worst.max(error.sqrt() / signal.sqrt().max(floor));
            }
        }
        Ok(worst)
    }
}
