//! From connections to the lists of a step: the variables that every instance sends and reads, and how
//! each signal is represented.

use std::collections::HashMap;
use std::sync::Arc;

use super::coupling_setup::CouplingSetup;
use super::loops::CutLoops;
use super::story::{DrivenInput, Driver};
use crate::participant::{ExchangedVariables, ItemCheck};
use crate::system::{InstanceSetup, Link, Port, System, Transfer, VariableIndex};
use coupling::{
    BooleanLink, HeldLink, Input, InputIndex, IntegerLink, Links, OutputIndex, RealLink, Whole,
    WholeLink, WholeOutput,
};
use fmi2_import::description::{Conversion, Type};
use scenario::Scenario;

/// All connections, sorted by instance.
pub(super) struct Wiring<'a> {
    scenario: &'a Scenario,
    system: &'a System,
    coupling: &'a CouplingSetup,
    pub(super) variables: Vec<ExchangedVariables>,
    pub(super) links: Vec<Links>,
    /// per driven input, its position and the highest derivative that it takes
    pub(super) given: Vec<(InputIndex, usize)>,
    cut: CutLoops,
    /// positions of outputs and Real inputs in their lists
    places: HashMap<Port, usize>,
}

impl<'a> Wiring<'a> {
    pub(super) fn new(
        scenario: &'a Scenario,
        system: &'a System,
        coupling: &'a CouplingSetup,
        inputs: &[DrivenInput],
    ) -> Self {
        let variables = |setup: &InstanceSetup| {
            let one_call = setup.description().derivatives.is_some();
            ExchangedVariables { one_call, ..ExchangedVariables::default() }
        };
        let mut wiring = Self {
            scenario,
            system,
            coupling,
            variables: system.instances.iter().map(variables).collect(),
            links: vec![Links::default(); system.instances.len()],
            given: Vec::with_capacity(inputs.len()),
            cut: CutLoops::of(&coupling.loops),
            places: HashMap::new(),
        };
        for link in &system.links {
            wiring.connect(link);
        }
        for input in inputs {
            wiring.drive(input);
        }
        wiring.find_direct();
        wiring
    }

    /// Adds one connection to the lists of both ends.
    fn connect(&mut self, link: &Link) {
        let (from, to) = (link.from, link.to);
        match &link.transfer {
            Transfer::Linear(linear) if self.system.variable(from).kind == Type::Real => {
                self.connect_reals(link, *linear);
            }
            Transfer::Linear(Conversion { factor, offset }) => {
                let input = self.real_input(to, 0);
                let from = self.whole_output(from);
                let link = WholeLink { input, from, factor: *factor, offset: *offset };
                self.links[to.instance].wholes.push(link);
            }
            table if self.system.variable(to).kind == Type::Boolean => {
                let WholeOutput { unit, output, .. } = self.whole_output(from);
                self.variables[to.instance].inputs.booleans.push(to.variable);
                let map = Some([table.replace(0), table.replace(1)]).filter(|it| *it != [0, 1]);
                let link = BooleanLink { from: HeldLink { unit, output }, map };
                self.links[to.instance].booleans.push(link);
            }
            Transfer::Whole => self.connect_integers(link, None),
            Transfer::Items(items) | Transfer::Table(items) => {
                self.connect_integers(link, Some(items));
            }
            Transfer::Same => {
                let outputs = &mut self.variables[from.instance].outputs.strings;
                let output = place(&mut self.places, from, outputs);
                self.links[from.instance].string_outputs = outputs.len();
                self.variables[to.instance].inputs.strings.push(to.variable);
                let unit = from.instance.into();
                self.links[to.instance].strings.push(HeldLink { unit, output });
            }
        }
    }

    fn connect_reals(&mut self, link: &Link, linear: Conversion) {
        let (from, to) = (link.from, link.to);
        let source = self.system.instances[from.instance].description();
        let held = self.system.is_held(link);
        let slow = self.system.instances[to.instance].every > 1;
        let schedule = &self.coupling.schedule;
        let interpolates = schedule.interpolates(from.instance.into(), to.instance.into());
        let chosen = link.extrapolation.or(self.scenario.algorithm.extrapolation).map(usize::from);
        let cut = chosen.is_none() && self.cut.contain(link);
        let own = if cut { Some(0) } else { link.extrapolation.map(usize::from) };
        let degree = own.unwrap_or(self.scenario.algorithm.degree());
        // in a loop that is cut, the newest known value is held
        let interpolates = interpolates && !cut;
        let six = interpolates && self.coupling.is_of_order_six(from.instance);
        let taken = self.system.instances[to.instance].input_derivatives_of(to.variable, six);
        let useful = if interpolates { degree.max(1) } else { degree };
        let wanted = match self.scenario.algorithm.derivatives && !held {
            true if six => source.interpolation_order(from.variable.0).min(2),
            true => useful.min(source.output_derivative_order(from.variable.0)),
            false => 0,
        };
        // interpolation may be cubic (Hermite) for any degree of the extrapolation
        let ahead = interpolates && !slow;
        let order = match ahead {
            _ if held => 0,
            true if six && wanted > 1 => 5,
            true if wanted > 0 => 3,
            true => degree.max(1),
            false => degree,
        };
        // a unit with larger steps extrapolates the interpolated polynomial
        let limit = match (ahead, held) {
            (_, true) => 0,
            (true, false) => taken,
            (false, false) => taken.min(degree),
        };
        if order > taken {
            let known = &mut self.variables[to.instance].wanted_order;
            *known = order.max(*known);
        }
        let output = self.real_output(from, wanted);
        self.links[from.instance].bends |= six;
        let cubic = &mut self.variables[from.instance].cubic;
        if six && ahead && wanted == 1 && !cubic.contains(&from.variable) {
            cubic.push(from.variable);
        }
        let input = self.real_input(to, limit);
        let steps = self.system.instances[to.instance].steps;
        self.links[to.instance].reals.push(RealLink {
            input,
            unit: from.instance.into(),
            output,
            factor: linear.factor,
            offset: linear.offset,
            // a unit with steps of its own gets the whole polynomial and reduces it
            limit: if !cut && (slow || steps > 1) { if six { 5 } else { 3 } } else { limit },
            degree: own,
            held,
            kinks: link.kinks && !held,
        });
    }

    /// Adds an input that follows a signal over time.
    fn drive(&mut self, driven: &DrivenInput) {
        let port = driven.port;
        let setup = &self.system.instances[port.instance];
        // signals of a scenario are cubics
        let (held, free) =
            (driven.is_held(self.system), matches!(driven.driver, Driver::Outside(..)));
        let taken = if held { 0 } else { setup.input_derivatives_of(port.variable, free) };
        let whole = setup.every > 1 || setup.steps > 1;
        let input = self.real_input(port, taken);
        self.links[port.instance].given.push(input);
        // a unit with steps of its own gets the whole polynomial and reduces it
        let most = if free { 5 } else { 3 };
        self.given.push((input, if whole { most } else { taken }));
    }

    fn connect_integers(&mut self, link: &Link, items: Option<&Arc<[(i32, i32)]>>) {
        let to = link.to;
        let from = self.whole_output(link.from);
        if let (Some(items), Transfer::Items(_)) = (items, &link.transfer) {
            self.variables[link.from.instance].items.push(ItemCheck {
                output: from.output.0,
                variable: link.from.variable,
                items: Arc::clone(items),
                target: self.system.port_name(to),
            });
        }
        self.variables[to.instance].inputs.integers.push(to.variable);
        let link = IntegerLink { from, items: items.cloned() };
        self.links[to.instance].integers.push(link);
    }

    /// Position of a Real output; its derivatives are read up to that order.
    fn real_output(&mut self, port: Port, wanted: usize) -> OutputIndex {
        let outputs = &mut self.variables[port.instance].outputs.reals;
        let place = *self.places.entry(port).or_insert_with(|| {
            outputs.push((port.variable, 0));
            outputs.len() - 1
        });
        outputs[place].1 = outputs[place].1.max(wanted);
        OutputIndex(place)
    }

    /// Position of a Real input; its derivatives are sent up to that order.
    fn real_input(&mut self, port: Port, limit: usize) -> InputIndex {
        let inputs = &mut self.variables[port.instance].inputs.reals;
        let place = *self.places.entry(port).or_insert_with(|| {
            inputs.push((port.variable, 0));
            inputs.len() - 1
        });
        inputs[place].1 = inputs[place].1.max(limit);
        InputIndex(place)
    }

    fn whole_output(&mut self, port: Port) -> WholeOutput {
        let outputs = &mut self.variables[port.instance].outputs;
        let links = &mut self.links[port.instance];
        let unit = port.instance.into();
        if self.system.variable(port).kind == Type::Boolean {
            let output = place(&mut self.places, port, &mut outputs.booleans);
            links.boolean_outputs = outputs.booleans.len();
            WholeOutput { unit, output, kind: Whole::Boolean }
        } else {
            let output = place(&mut self.places, port, &mut outputs.integers);
            links.integer_outputs = outputs.integers.len();
            WholeOutput { unit, output, kind: Whole::Integer }
        }
    }

    /// Finds the sizes of the Real outputs, and the inputs that each depends on directly.
    fn find_direct(&mut self) {
        for (instance, setup) in self.system.indexed() {
            let ExchangedVariables { inputs, outputs, .. } = &self.variables[instance];
            let mut kinds: HashMap<VariableIndex, Input> = HashMap::new();
            let reals = inputs.reals.iter().map(|(variable, _)| variable);
            kinds.extend(reals.enumerate().map(|(k, &it)| (it, Input::Real(InputIndex(k)))));
            for (list, kind) in [
                (&inputs.integers, Input::Integer as fn(InputIndex) -> Input),
                (&inputs.booleans, Input::Boolean),
                (&inputs.strings, Input::String),
            ] {
                kinds.extend(list.iter().enumerate().map(|(k, &it)| (it, kind(InputIndex(k)))));
            }
            let links = &mut self.links[instance];
            for &(variable, _) in &outputs.reals {
                links.sizes.push(self.coupling.size(self.system, Port { instance, variable }));
                let direct = setup.description().step_dependencies(variable.0).into_iter();
                let direct = direct.filter_map(|it| kinds.get(&VariableIndex(it)).copied());
                links.direct.push(direct.collect());
            }
        }
    }
}

/// Position of an output in its list; it is appended if new.
fn place(
    places: &mut HashMap<Port, usize>,
    port: Port,
    list: &mut Vec<VariableIndex>,
) -> OutputIndex {
    OutputIndex(*places.entry(port).or_insert_with(|| {
        list.push(port.variable);
        list.len() - 1
    }))
}
