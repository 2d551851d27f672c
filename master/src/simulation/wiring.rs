//! Connections laid out: what every instance sends and reads in a step, and how each signal is
//! represented.

use std::collections::HashMap;
use std::sync::Arc;

use super::loops::Cuts;
use super::plan::Layout;
use crate::coupling::{Input, IntegerLink, Links, RealLink, Whole, WholeLink, WholeOutput};
use crate::participant::{ItemCheck, Traffic};
use crate::system::{Link, Plan, Port, System, Transfer};
use fmi2_import::description::{Conversion, Type};
use scenario::Scenario;

/// All connections, laid out per instance.
pub(super) struct Wiring<'a> {
    scenario: &'a Scenario,
    system: &'a System,
    layout: &'a Layout,
    pub(super) traffic: Vec<Traffic>,
    pub(super) links: Vec<Links>,
    cuts: Cuts,
    /// places of outputs and Real inputs in their lists
    places: HashMap<Port, usize>,
}

impl<'a> Wiring<'a> {
    pub(super) fn new(scenario: &'a Scenario, system: &'a System, layout: &'a Layout) -> Self {
        let n = system.instances.len();
        let traffic = |plan: &Plan| {
            let one_call = plan.description().derivatives.is_some();
            Traffic { one_call, ..Traffic::default() }
        };
        let mut wiring = Self {
            scenario,
            system,
            layout,
            traffic: system.instances.iter().map(traffic).collect(),
            links: vec![Links::default(); n],
            cuts: Cuts::of(&layout.loops),
            places: HashMap::new(),
        };
        for link in &system.links {
            wiring.connect(link);
        }
        wiring.find_direct();
        wiring
    }

    /// Enters one connection into the traffic of both ends.
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
            Transfer::Whole => self.connect_integers(link, None),
            Transfer::Items(items) => self.connect_integers(link, Some(items)),
            Transfer::Same if self.system.variable(from).kind == Type::Boolean => {
                let (unit, output, _) = self.whole_output(from);
                self.traffic[to.instance].boolean_inputs.push(to.variable);
                self.links[to.instance].booleans.push((unit, output));
            }
            Transfer::Same => {
                let outputs = &mut self.traffic[from.instance].string_outputs;
                let output = place(&mut self.places, from, outputs);
                self.links[from.instance].string_outputs = outputs.len();
                self.traffic[to.instance].string_inputs.push(to.variable);
                self.links[to.instance].strings.push((from.instance, output));
            }
        }
    }

    fn connect_reals(&mut self, link: &Link, linear: Conversion) {
        let (from, to) = (link.from, link.to);
        let source = self.system.instances[from.instance].description();
        let taken = self.system.instances[to.instance].input_derivative_order();
        let held = self.system.is_held(link);
        let slow = self.system.instances[to.instance].every > 1;
        let interpolates = self.layout.blueprint.interpolates(from.instance, to.instance);
        let chosen = link.extrapolation.or(self.scenario.algorithm.extrapolation).map(usize::from);
        let cut = chosen.is_none() && self.cuts.contain(link);
        let own = if cut { Some(0) } else { link.extrapolation.map(usize::from) };
        let degree = own.unwrap_or(self.scenario.algorithm.degree());
        // in a loop that is cut, inputs are held: the newest value that is known
        let interpolates = interpolates && !cut;
        let useful = if interpolates { degree.max(1) } else { degree };
        let wanted = if self.scenario.algorithm.derivatives && !held {
            useful.min(source.output_derivative_order(from.variable))
        } else {
            0
        };
        // interpolation may be cubic (Hermite) whatever the extrapolation's degree
        let ahead = interpolates && !slow;
        let order = match ahead {
            _ if held => 0,
            true if wanted > 0 => 3,
            true => degree.max(1),
            false => degree,
        };
        // one with larger steps goes beyond what is interpolated
        let limit = match (ahead, held) {
            (_, true) => 0,
            (true, false) => taken,
            (false, false) => taken.min(degree),
        };
        let known = &mut self.traffic[to.instance].wanted_order;
        *known = order.max(*known);
        let output = self.real_output(from, wanted);
        let input = self.real_input(to, limit);
        let steps = self.system.instances[to.instance].steps;
        self.links[to.instance].reals.push(RealLink {
            input,
            unit: from.instance,
            output,
            factor: linear.factor,
            offset: linear.offset,
            // a unit with steps of its own gets the whole polynomial and takes its part
            limit: if !cut && (slow || steps > 1) { 3 } else { limit },
            degree: own,
            held,
        });
    }

    fn connect_integers(&mut self, link: &Link, items: Option<&Arc<[(i32, i32)]>>) {
        let to = link.to;
        let from = self.whole_output(link.from);
        if let Some(items) = items {
            self.traffic[link.from.instance].items.push(ItemCheck {
                output: from.1,
                variable: link.from.variable,
                items: Arc::clone(items),
                target: self.system.port_name(to),
            });
        }
        self.traffic[to.instance].integer_inputs.push(to.variable);
        let link = IntegerLink { from, items: items.cloned() };
        self.links[to.instance].integers.push(link);
    }

    /// Place of a Real output, of which derivatives up to that order are read.
    fn real_output(&mut self, port: Port, wanted: usize) -> usize {
        let outputs = &mut self.traffic[port.instance].real_outputs;
        let place = *self.places.entry(port).or_insert_with(|| {
            outputs.push((port.variable, 0));
            outputs.len() - 1
        });
        outputs[place].1 = outputs[place].1.max(wanted);
        place
    }

    /// Place of a Real input, which takes derivatives up to that order.
    fn real_input(&mut self, port: Port, limit: usize) -> usize {
        let inputs = &mut self.traffic[port.instance].real_inputs;
        let place = *self.places.entry(port).or_insert_with(|| {
            inputs.push((port.variable, 0));
            inputs.len() - 1
        });
        inputs[place].1 = inputs[place].1.max(limit);
        place
    }

    fn whole_output(&mut self, port: Port) -> WholeOutput {
        let traffic = &mut self.traffic[port.instance];
        let links = &mut self.links[port.instance];
        if self.system.variable(port).kind == Type::Boolean {
            let output = place(&mut self.places, port, &mut traffic.boolean_outputs);
            links.boolean_outputs = traffic.boolean_outputs.len();
            (port.instance, output, Whole::Boolean)
        } else {
            let output = place(&mut self.places, port, &mut traffic.integer_outputs);
            links.integer_outputs = traffic.integer_outputs.len();
            (port.instance, output, Whole::Integer)
        }
    }

    /// The sizes of the Real outputs, and the inputs that each depends on directly.
    fn find_direct(&mut self) {
        for (instance, traffic) in self.traffic.iter().enumerate() {
            let description = self.system.instances[instance].description();
            let mut inputs: HashMap<usize, Input> = HashMap::new();
            let reals = traffic.real_inputs.iter().map(|(variable, _)| variable);
            inputs.extend(reals.enumerate().map(|(k, &it)| (it, Input::Real(k))));
            let integers = traffic.integer_inputs.iter().enumerate();
            inputs.extend(integers.map(|(k, &it)| (it, Input::Integer(k))));
            let booleans = traffic.boolean_inputs.iter().enumerate();
            inputs.extend(booleans.map(|(k, &it)| (it, Input::Boolean(k))));
            let strings = traffic.string_inputs.iter().enumerate();
            inputs.extend(strings.map(|(k, &it)| (it, Input::String(k))));
            let links = &mut self.links[instance];
            for &(variable, _) in &traffic.real_outputs {
                links.sizes.push(self.layout.size(self.system, Port { instance, variable }));
                let direct = description.step_dependencies(variable);
                let direct = direct.iter().filter_map(|input| inputs.get(input).copied());
                links.direct.push(direct.collect());
            }
        }
    }
}

/// Place of an output in its list, appended if new.
fn place(places: &mut HashMap<Port, usize>, port: Port, list: &mut Vec<usize>) -> usize {
    *places.entry(port).or_insert_with(|| {
        list.push(port.variable);
        list.len() - 1
    })
}
