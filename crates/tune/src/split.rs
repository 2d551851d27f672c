//! A linearised scenario as the units that are tuned, each with one force, and everything else.

use faer::Mat;
use linear::{LinearSystem, LinearUnit, Open, Port, Quantity, Rows, StateSpace};
use maps::{factor, largest};

use crate::error::TuneError;

/// Equal to rounding.
const EQUAL: f64 = 1e-12;
/// Relative change of what a unit passes on without states up to which it is due to its operating point, and left out:
/// the lateral stiffness of a magnet on a bent girder follows its force. A new start shows what that does.
const UNCHANGED: f64 = 0.25;

/// Which units are tuned, and how they are connected to the rest.
#[derive(Debug, Clone)]
pub(crate) struct Split {
    /// The units that are tuned.
    pub units: Vec<usize>,
    /// Their inputs that matter.
    pub channels: Vec<usize>,
    /// Names of these inputs.
    pub names: Vec<String>,
    /// Their connected output with the largest response to their states.
    force: usize,
    /// The signal at which loops are broken.
    pub broken: Option<Broken>,
    /// Whether all units are equal.
    pub equal: bool,
    /// What each unit passes on from its measurements to its force without a state between, as the rest of the system
    /// has it.
    start: Vec<Vec<f64>>,
}

/// Where loops are broken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Broken {
    /// Inside the units, at an output to which an input adds: the voltage of a magnet with its controller.
    Inside { output: usize, input: usize },
    /// At the one connected output of the units: the voltage of a controller in a unit of its own. The controller may
    /// pass on measurements at once, by factors that depend on its parameters.
    Outside,
}

/// ẋ = A x + B e + b w, f = C x + F e + φ w, v = V x + D e + d w: from the measurements e and what adds to the broken
/// signal to the force and the broken signal. The rest of the system has F₀ e of the start, so that only F − F₀ is
/// left for the loop.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Law {
    pub a: Mat<f64>,
    pub b: Mat<f64>,
    pub force: Vec<f64>,
    /// F.
    pub force_direct: Vec<f64>,
    /// F − F₀.
    pub force_change: Vec<f64>,
    /// φ.
    pub force_added: f64,
    pub signal: Vec<f64>,
    pub direct: Vec<f64>,
    pub added: Vec<f64>,
    pub added_direct: f64,
}

fn row(rows: &Rows, k: usize, width: usize) -> Vec<f64> {
    let mut all = vec![0.0; width];
    rows.row(k).iter().for_each(|&(j, value)| all[j] += value);
    all
}

impl Split {
    /// Finds out how units are connected to the rest.
    pub fn new(system: &LinearSystem, units: Vec<usize>) -> Result<Self, TuneError> {
        let all = &system.units;
        let first = &all[units[0]];
        let wrong = |unit: &LinearUnit, problem: &str| TuneError::Units {
            instance: unit.name.clone(),
            problem: problem.to_owned(),
        };
        let n = first.states.len();
        let state = |unit: &LinearUnit, output: usize| row(&unit.c, output, unit.states.len());
        let force = (0..first.connected_outputs)
            .max_by(|&a, &b| largest(&state(first, a)).total_cmp(&largest(&state(first, b))));
        let Some(force) = force.filter(|&it| largest(&state(first, it)) > 0.0) else {
            return Err(wrong(first, "it has no states that reach a connected output"));
        };
        let inside = first.outputs.iter().enumerate().find_map(|(output, it)| {
            let input = first.inputs.iter().position(|input| input.name == it.name)?;
            Some(Broken::Inside { output, input })
        });
        let acts = |it: &usize| largest(&state(first, *it)) > 0.0;
        let one = (0..first.connected_outputs).filter(acts).count() == 1;
        let broken = inside.or_else(|| one.then_some(Broken::Outside));
        let mut channels: Vec<usize> = Vec::new();
        for &k in &units {
            let unit = &all[k];
            let shape = |unit: &LinearUnit| {
                (
                    unit.states.len(),
                    unit.connected_inputs,
                    unit.connected_outputs,
                    unit.inputs.len(),
                )
            };
            if shape(unit) != shape(first) {
                return Err(wrong(
                    unit,
                    &format!("it has other inputs, outputs or states than {}", first.name),
                ));
            }
            let main = state(unit, force);
            if (0..unit.connected_outputs).any(|it| factor(&state(unit, it), &main).is_none()) {
                return Err(wrong(
                    unit,
                    "its states act by several outputs on their own; only units with one force can be tuned",
                ));
            }
            let by_signal = match broken {
                Some(Broken::Inside { output, .. }) => unit.d.row(output),
                Some(Broken::Outside) => unit.d.row(force),
                None => &[],
            };
            let reached =
                unit.b.iter().map(|(_, j, value)| (j, value)).chain(by_signal.iter().copied());
            for (j, value) in reached {
                if value != 0.0 && j < unit.connected_inputs && !channels.contains(&j) {
                    channels.push(j);
                }
            }
        }
        channels.sort_unstable();
        let names = channels.iter().map(|&j| first.inputs[j].name.clone()).collect();
        let start = vec![vec![0.0; channels.len()]; units.len()];
        let mut split = Self { units, channels, names, force, broken, equal: true, start };
        split.start = split.units.iter().map(|&k| split.force_direct(&all[k])).collect();
        let law = split.law(0, first);
        let near = |a: &Mat<f64>, b: &Mat<f64>| (a - b).norm_max() <= EQUAL * a.norm_max().max(1.0);
        split.equal = n > 0
            && split.units.iter().enumerate().all(|(place, &k)| {
                let other = split.law(place, &all[k]);
                near(&law.a, &other.a)
                    && near(&law.b, &other.b)
                    && law.force == other.force
                    && law.force_direct == other.force_direct
            });
        Ok(split)
    }

    /// From the measurements to the force, without a state between; none if the loop is broken inside the unit: then what
    /// a unit passes on is not its controller's answer.
    fn force_direct(&self, unit: &LinearUnit) -> Vec<f64> {
        if self.broken != Some(Broken::Outside) {
            return vec![0.0; self.channels.len()];
        }
        let direct = row(&unit.d, self.force, unit.inputs.len());
        self.channels.iter().map(|&j| direct[j]).collect()
    }

    /// The law of one of the units, by its place among them.
    pub fn law(&self, place: usize, unit: &LinearUnit) -> Law {
        let (n, c) = (unit.states.len(), self.channels.len());
        let mut b = Mat::zeros(n, unit.inputs.len());
        unit.b.iter().for_each(|(i, j, value)| b[(i, j)] += value);
        let mut law = Law {
            a: unit.matrix(),
            b: Mat::from_fn(n, c, |i, j| b[(i, self.channels[j])]),
            force: row(&unit.c, self.force, n),
            force_direct: self.force_direct(unit),
            force_change: Vec::new(),
            force_added: 0.0,
            signal: vec![0.0; n],
            direct: vec![0.0; c],
            added: vec![0.0; n],
            added_direct: 0.0,
        };
        law.force_change = law
            .force_direct
            .iter()
            .zip(&self.start[place])
            .map(|(now, start)| now - start)
            .collect();
        match self.broken {
            Some(Broken::Inside { output, input }) => {
                let direct = row(&unit.d, output, unit.inputs.len());
                law.signal = row(&unit.c, output, n);
                law.direct = self.channels.iter().map(|&j| direct[j]).collect();
                law.added = (0..n).map(|i| b[(i, input)]).collect();
                law.added_direct = direct[input];
            }
            Some(Broken::Outside) => {
                law.signal.clone_from(&law.force);
                law.direct.clone_from(&law.force_direct);
                law.force_added = 1.0;
            }
            None => {}
        }
        law
    }

    /// The output at which loops are broken.
    pub fn broken_output(&self) -> Option<usize> {
        self.broken.map(|it| match it {
            Broken::Inside { output, .. } => output,
            Broken::Outside => self.force,
        })
    }

    /// Checks that what units pass on without states does not depend on the parameters, but for the law.
    pub fn check_feedthrough(
        &self,
        before: &LinearUnit,
        after: &LinearUnit,
    ) -> Result<(), TuneError> {
        let signal = self.broken_output();
        for output in (0..before.connected_outputs).filter(|it| Some(*it) != signal) {
            let width = before.inputs.len();
            let (a, b) = (row(&before.d, output, width), row(&after.d, output, width));
            let change = a.iter().zip(&b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            if change > UNCHANGED * largest(&a).max(largest(&b)) {
                return Err(TuneError::Units {
                    instance: before.name.clone(),
                    problem: format!(
                        "a parameter changes how {} follows an input at once, without a state between",
                        before.outputs[output].name
                    ),
                });
            }
        }
        Ok(())
    }

    /// Everything else, and what the units pass on without states: from their forces and further inputs to their
    /// measurements, channel by channel.
    pub fn rest(&self, system: &LinearSystem, further: &[Port]) -> Result<StateSpace, TuneError> {
        let mut still = system.clone();
        let mut open = Open::default();
        let mut shown: Vec<Vec<Port>> = vec![Vec::new(); self.channels.len()];
        for &k in &self.units {
            let unit = &system.units[k];
            let state = |output| row(&unit.c, output, unit.states.len());
            let main = state(self.force);
            let by: Vec<f64> = (0..unit.connected_outputs)
                .map(|output| factor(&state(output), &main).unwrap_or(0.0))
                .collect();
            let (input, output) = freeze(&mut still.units[k], &by, &self.channels);
            open.inputs.push(Port { unit: k, index: input });
            for (list, index) in shown.iter_mut().zip(output..) {
                list.push(Port { unit: k, index });
            }
        }
        open.inputs.extend_from_slice(further);
        open.outputs = shown.concat();
        Ok(still.open(&open)?)
    }
}

/// Takes the states out of a unit. It gets an input that adds to its outputs by these factors, and outputs that show
/// some of its inputs. Returns the input and the first of the outputs.
fn freeze(unit: &mut LinearUnit, by: &[f64], shown: &[usize]) -> (usize, usize) {
    let first = (unit.inputs.len(), unit.outputs.len());
    let connected = unit.connected_outputs;
    let mut d: Vec<(usize, usize, f64)> = unit.d.iter().filter(|it| it.0 < connected).collect();
    d.extend(by.iter().enumerate().map(|(output, &factor)| (output, first.0, factor)));
    d.extend(shown.iter().enumerate().map(|(k, &input)| (first.1 + k, input, 1.0)));
    let extra = |name: &str| Quantity { name: name.to_owned(), unit: None };
    unit.inputs.push(extra("force of its states"));
    unit.outputs.extend(shown.iter().map(|_| extra("measurement")));
    unit.states.clear();
    unit.a = Rows::new(0, &[]);
    unit.b = Rows::new(0, &[]);
    unit.c = Rows::new(unit.outputs.len(), &[]);
    unit.d = Rows::new(unit.outputs.len(), &d);
    first
}
