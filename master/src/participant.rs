//! An instance as coupling algorithms see it: fixed lists of what is sent and read in each step.

use std::sync::OnceLock;
use std::time::{Duration, Instant};

use crate::coupling::{Inputs, Outputs, Unit};
use crate::description::Type;
use crate::instance::{Instance, UnitError};

/// Every so many steps are timed: reading the clock costs as much as a small unit's step. A prime,
/// so that it does not beat with a unit's own rhythm.
const TIMED: u64 = 7;

/// Wall time of an instance, extrapolated from every seventh step.
#[derive(Debug, Clone, Copy, Default)]
pub struct Timing {
    timed: u64,
    sent: u64,
    now: bool,
    stepping: Duration,
    exchanging: Duration,
}

/// Seconds that a timed section of no content seems to take: the clock's own part.
fn clock_cost() -> f64 {
    static COST: OnceLock<f64> = OnceLock::new();
    *COST.get_or_init(|| {
        let shortest = (0..200).map(|_| Instant::now().elapsed()).min();
        shortest.unwrap_or_default().as_secs_f64()
    })
}

impl Timing {
    fn scaled(&self, time: Duration, sections: u64) -> f64 {
        if self.timed == 0 {
            return 0.0;
        }
        #[expect(clippy::cast_precision_loss, reason = "counts of steps")]
        let (timed, sent, sections) = (self.timed as f64, self.sent as f64, sections as f64);
        let net = time.as_secs_f64() - timed * sections * clock_cost();
        net.max(0.0) * sent / timed
    }

    /// Seconds in `fmi2DoStep`.
    #[must_use]
    pub fn step_seconds(&self) -> f64 {
        self.scaled(self.stepping, 1)
    }

    /// Seconds in the calls that set inputs and get outputs.
    #[must_use]
    pub fn exchange_seconds(&self) -> f64 {
        self.scaled(self.exchanging, 2)
    }

    fn begin_step(&mut self) {
        self.now = self.sent.is_multiple_of(TIMED);
        self.sent += 1;
        self.timed += u64::from(self.now);
    }

    #[inline]
    fn begin(&self) -> Option<Instant> {
        self.now.then(Instant::now)
    }
}

/// What one instance exchanges; variables by their index in the description.
#[derive(Debug, Clone, Default)]
pub struct Traffic {
    /// Connected Real inputs, and the highest derivative to send for each.
    pub real_inputs: Vec<(usize, usize)>,
    /// Connected Integer and Enumeration inputs.
    pub integer_inputs: Vec<usize>,
    /// Connected Boolean inputs.
    pub boolean_inputs: Vec<usize>,
    /// Connected String inputs.
    pub string_inputs: Vec<usize>,
    /// Real outputs that feed inputs, and the highest derivative to read of each.
    pub real_outputs: Vec<(usize, usize)>,
    /// Integer and Enumeration outputs that feed inputs.
    pub integer_outputs: Vec<usize>,
    /// Boolean outputs that feed inputs.
    pub boolean_outputs: Vec<usize>,
    /// String outputs that feed inputs.
    pub string_outputs: Vec<usize>,
    /// Variables to read besides, for recording.
    pub watched: Vec<usize>,
}

/// An instance with its traffic laid out flat.
pub struct Participant {
    instance: Instance,
    traffic: Traffic,
    timing: Timing,
    real_inputs: Vec<u32>,
    input_values: Vec<f64>,
    derivative_inputs: Vec<u32>,
    derivative_orders: Vec<i32>,
    derivative_values: Vec<f64>,
    integer_inputs: Vec<u32>,
    boolean_inputs: Vec<u32>,
    string_inputs: Vec<u32>,
    // outputs that feed inputs come first, then what is only watched
    reals: Vec<usize>,
    real_references: Vec<u32>,
    real_values: Vec<f64>,
    integers: Vec<usize>,
    integer_references: Vec<u32>,
    integer_values: Vec<i32>,
    booleans: Vec<usize>,
    boolean_references: Vec<u32>,
    boolean_values: Vec<i32>,
    strings: Vec<u32>,
    output_references: Vec<u32>,
    output_orders: Vec<i32>,
    output_derivatives: Vec<f64>,
}

/// Where a watched variable is found in its participant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Slot {
    /// Position among the Reals.
    Real(usize),
    /// Position among the Integers.
    Integer(usize),
    /// Position among the Booleans.
    Boolean(usize),
}

impl Participant {
    /// Lays out the traffic of an instance.
    #[must_use]
    pub fn new(instance: Instance, traffic: Traffic) -> Self {
        let variables = &instance.package().description().variables;
        let reference = |&variable: &usize| variables[variable].value_reference;
        let references = |list: &[usize]| -> Vec<u32> { list.iter().map(reference).collect() };
        let with_watched = |outputs: Vec<usize>, kinds: &[Type]| {
            let mut list = outputs;
            for &variable in &traffic.watched {
                if kinds.contains(&variables[variable].kind) && !list.contains(&variable) {
                    list.push(variable);
                }
            }
            list
        };
        let feeding = traffic.real_outputs.iter().map(|&(variable, _)| variable).collect();
        let reals = with_watched(feeding, &[Type::Real]);
        let integers =
            with_watched(traffic.integer_outputs.clone(), &[Type::Integer, Type::Enumeration]);
        let booleans = with_watched(traffic.boolean_outputs.clone(), &[Type::Boolean]);
        let mut participant = Self {
            real_inputs: traffic
                .real_inputs
                .iter()
                .map(|(variable, _)| reference(variable))
                .collect(),
            input_values: vec![0.0; traffic.real_inputs.len()],
            derivative_inputs: Vec::new(),
            derivative_orders: Vec::new(),
            derivative_values: Vec::new(),
            integer_inputs: references(&traffic.integer_inputs),
            boolean_inputs: references(&traffic.boolean_inputs),
            string_inputs: references(&traffic.string_inputs),
            real_references: references(&reals),
            real_values: vec![0.0; reals.len()],
            integer_references: references(&integers),
            integer_values: vec![0; integers.len()],
            boolean_references: references(&booleans),
            boolean_values: vec![0; booleans.len()],
            strings: references(&traffic.string_outputs),
            output_references: Vec::new(),
            output_orders: Vec::new(),
            output_derivatives: Vec::new(),
            reals,
            integers,
            booleans,
            instance,
            traffic,
            timing: Timing::default(),
        };
        participant.lay_out_derivatives();
        participant
    }

    fn lay_out_derivatives(&mut self) {
        let variables = &self.instance.package().description().variables;
        let flat = |list: &[(usize, usize)]| -> (Vec<u32>, Vec<i32>) {
            list.iter()
                .flat_map(|&(variable, highest)| {
                    let reference = variables[variable].value_reference;
                    (1..=3).take(highest).map(move |order| (reference, order))
                })
                .unzip()
        };
        (self.derivative_inputs, self.derivative_orders) = flat(&self.traffic.real_inputs);
        (self.output_references, self.output_orders) = flat(&self.traffic.real_outputs);
        self.derivative_values = vec![0.0; self.derivative_inputs.len()];
        self.output_derivatives = vec![0.0; self.output_references.len()];
    }

    /// Finds out which output derivatives the unit gives, up to those wanted, and keeps to them.
    /// Call at the start of stepping. Returns the orders on offer per Real output.
    ///
    /// # Errors
    /// Only a fatal one: an output whose derivative is refused is taken from history instead.
    pub fn probe_outputs(&mut self) -> Result<Vec<usize>, UnitError> {
        let mut outputs = std::mem::take(&mut self.traffic.real_outputs);
        for (variable, highest) in &mut outputs {
            let reference =
                self.instance.package().description().variables[*variable].value_reference;
            let wanted = std::mem::take(highest);
            for order in (1..=3).take(wanted) {
                let mut value = [f64::NAN];
                let answer =
                    self.instance.get_real_output_derivatives(&[reference], &[order], &mut value);
                self.instance.still_alive()?;
                if answer.is_err() || !value[0].is_finite() {
                    break;
                }
                *highest += 1;
            }
        }
        let offered = outputs.iter().map(|(_, highest)| *highest).collect();
        self.traffic.real_outputs = outputs;
        self.lay_out_derivatives();
        Ok(offered)
    }

    /// Finds out up to which order the unit takes input derivatives, by sending zeros, and keeps
    /// to it. Call after the outputs at the start have been read. Returns the order per Real input.
    ///
    /// # Errors
    /// Only a fatal one.
    pub fn probe_inputs(&mut self) -> Result<Vec<usize>, UnitError> {
        let wanted = self.traffic.real_inputs.iter().map(|(_, highest)| *highest).max();
        let mut accepted = 0;
        for order in (1..=3).take(wanted.unwrap_or(0)) {
            let references: Vec<u32> = self
                .traffic
                .real_inputs
                .iter()
                .zip(&self.real_inputs)
                .filter(|((_, highest), _)| i32::try_from(*highest).is_ok_and(|h| h >= order))
                .map(|(_, &reference)| reference)
                .collect();
            let orders = vec![order; references.len()];
            let zeros = vec![0.0; references.len()];
            let answer = self.instance.set_real_input_derivatives(&references, &orders, &zeros);
            self.instance.still_alive()?;
            if answer.is_err() {
                break;
            }
            accepted += 1;
        }
        for (_, highest) in &mut self.traffic.real_inputs {
            *highest = (*highest).min(accepted);
        }
        self.lay_out_derivatives();
        Ok(self.traffic.real_inputs.iter().map(|(_, highest)| *highest).collect())
    }

    /// Where its wall time went.
    #[must_use]
    pub fn timing(&self) -> &Timing {
        &self.timing
    }

    /// The instance itself.
    #[must_use]
    pub fn instance(&self) -> &Instance {
        &self.instance
    }

    /// The instance itself.
    pub fn instance_mut(&mut self) -> &mut Instance {
        &mut self.instance
    }

    /// Where a watched variable's value is found.
    #[must_use]
    pub fn slot(&self, variable: usize) -> Option<Slot> {
        let place = |list: &[usize]| list.iter().position(|&it| it == variable);
        place(&self.reals)
            .map(Slot::Real)
            .or_else(|| place(&self.integers).map(Slot::Integer))
            .or_else(|| place(&self.booleans).map(Slot::Boolean))
    }

    /// A watched variable's latest value; true counts as 1.
    #[inline]
    #[must_use]
    pub fn value(&self, slot: Slot) -> f64 {
        match slot {
            Slot::Real(k) => self.real_values[k],
            Slot::Integer(k) => f64::from(self.integer_values[k]),
            Slot::Boolean(k) => f64::from(u8::from(self.boolean_values[k] != 0)),
        }
    }
}

impl Unit for Participant {
    type Error = UnitError;

    fn send(&mut self, inputs: &Inputs) -> Result<(), UnitError> {
        self.timing.begin_step();
        let mut at = 0;
        for (k, (_, highest)) in self.traffic.real_inputs.iter().enumerate() {
            let p = inputs.reals[k];
            self.input_values[k] = p[0];
            // at most three: a loop is faster than a call to copy memory
            for (value, derivative) in self.derivative_values[at..].iter_mut().zip(&p[1..=*highest])
            {
                *value = *derivative;
            }
            at += highest;
        }
        let begin = self.timing.begin();
        let instance = &mut self.instance;
        instance.set_real(&self.real_inputs, &self.input_values)?;
        instance.set_integer(&self.integer_inputs, &inputs.integers)?;
        instance.set_boolean(&self.boolean_inputs, &inputs.booleans)?;
        for (&reference, text) in self.string_inputs.iter().zip(&inputs.strings) {
            instance.set_string(reference, text)?;
        }
        instance.set_real_input_derivatives(
            &self.derivative_inputs,
            &self.derivative_orders,
            &self.derivative_values,
        )?;
        if let Some(begin) = begin {
            self.timing.exchanging += begin.elapsed();
        }
        Ok(())
    }

    fn step(&mut self, time: f64, size: f64) -> Result<(), UnitError> {
        let begin = self.timing.begin();
        self.instance.do_step(time, size)?;
        if let Some(begin) = begin {
            self.timing.stepping += begin.elapsed();
        }
        Ok(())
    }

    fn receive(&mut self, time: f64, outputs: &mut Outputs) -> Result<(), UnitError> {
        let begin = self.timing.begin();
        self.get_all(outputs)?;
        if let Some(begin) = begin {
            self.timing.exchanging += begin.elapsed();
        }
        // 0·x is zero unless x is NaN or infinite: one sum tells of all values
        let suspicious: f64 = self.real_values.iter().map(|x| x * 0.0).sum();
        if suspicious != 0.0
            && let Some(k) = self.real_values.iter().position(|x| !x.is_finite())
        {
            return Err(self.instance.not_finite(self.reals[k], self.real_values[k], time).into());
        }
        let mut derivatives = self.output_derivatives.iter();
        for (k, &(variable, highest)) in self.traffic.real_outputs.iter().enumerate() {
            let point = &mut outputs.reals[k];
            point[0] = self.real_values[k];
            for (place, &value) in point[1..=highest].iter_mut().zip(&mut derivatives) {
                if !value.is_finite() {
                    return Err(self.instance.not_finite(variable, value, time).into());
                }
                *place = value;
            }
        }
        let feeding = outputs.integers.len();
        outputs.integers.copy_from_slice(&self.integer_values[..feeding]);
        let feeding = outputs.booleans.len();
        outputs.booleans.copy_from_slice(&self.boolean_values[..feeding]);
        Ok(())
    }
}

impl Participant {
    fn get_all(&mut self, outputs: &mut Outputs) -> Result<(), UnitError> {
        let instance = &mut self.instance;
        instance.get_real(&self.real_references, &mut self.real_values)?;
        instance.get_real_output_derivatives(
            &self.output_references,
            &self.output_orders,
            &mut self.output_derivatives,
        )?;
        instance.get_integer(&self.integer_references, &mut self.integer_values)?;
        instance.get_boolean(&self.boolean_references, &mut self.boolean_values)?;
        for (text, &reference) in outputs.strings.iter_mut().zip(&self.strings) {
            *text = instance.get_string(reference)?;
        }
        Ok(())
    }
}
