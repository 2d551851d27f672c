//! Carries values from outputs to inputs, in the order of their dependencies.

use std::collections::{BTreeMap, HashMap};
use std::ffi::CString;

use super::levels::Level;
use crate::system::{InstanceIndex, Link, Port, System, Transfer, VariableIndex};
use fmi2_import::description::{Causality, Type};
use fmi2_import::instance::{FmuError, Instance};

/// A value on its way.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Transported {
    Real(f64),
    Integer(i32),
    Boolean(i32),
    String(CString),
}

impl Transported {
    /// As a number; false is 0, true is 1.
    fn number(&self) -> f64 {
        match self {
            Self::Real(x) => *x,
            Self::Integer(x) => f64::from(*x),
            Self::Boolean(x) => f64::from(u8::from(*x != 0)),
            Self::String(_) => 0.0,
        }
    }
}

/// Instances in initialization mode, and the values known so far.
pub(super) struct Solver<'a> {
    pub(super) system: &'a System,
    pub(super) instances: &'a mut [Instance],
    start: f64,
    pub(super) values: HashMap<Port, Transported>,
    /// the connections of each output, and of each input
    pub(super) targets: HashMap<Port, Vec<&'a Link>>,
    pub(super) sources: HashMap<Port, Vec<&'a Link>>,
}

/// Values to set, per instance.
pub(super) type Sets = BTreeMap<InstanceIndex, Vec<(VariableIndex, Transported)>>;

impl<'a> Solver<'a> {
    pub(super) fn new(system: &'a System, instances: &'a mut [Instance], start: f64) -> Self {
        let mut targets: HashMap<Port, Vec<&Link>> = HashMap::new();
        let mut sources: HashMap<Port, Vec<&Link>> = HashMap::new();
        for link in &system.links {
            targets.entry(link.from).or_default().push(link);
            sources.entry(link.to).or_default().push(link);
        }
        Self { system, instances, start, values: HashMap::new(), targets, sources }
    }

    /// Adds the values of the inputs that an output feeds, as far as they are known now.
    pub(super) fn pass_on(&self, output: Port, sets: &mut Sets) -> Result<(), FmuError> {
        for link in self.targets.get(&output).into_iter().flatten() {
            let set = (link.to.variable, self.input(link.to)?);
            sets.entry(link.to.instance).or_default().push(set);
        }
        Ok(())
    }

    /// An input's value: the sum over its known sources.
    fn input(&self, to: Port) -> Result<Transported, FmuError> {
        let mut sum = 0.0;
        for link in self.sources.get(&to).into_iter().flatten() {
            let Some(value) = self.values.get(&link.from) else { continue };
            match (&link.transfer, value) {
                (Transfer::Linear(it), value) => {
                    sum += it.factor * value.number() + it.offset;
                }
                (Transfer::Whole, Transported::Boolean(value)) => {
                    return Ok(Transported::Integer(i32::from(*value != 0)));
                }
                (Transfer::Items(items), Transported::Integer(value)) => {
                    let found = items.iter().find(|(from, _)| from == value);
                    return match found {
                        Some((_, to)) => Ok(Transported::Integer(*to)),
                        None => {
                            let target = self.system.port_name(to);
                            let unit = &self.instances[link.from.instance];
                            Err(unit.no_item(link.from.variable.0, *value, &target, self.start))
                        }
                    };
                }
                (Transfer::Table(_), Transported::Boolean(it)) => {
                    return Ok(Transported::Boolean(link.transfer.replace(i32::from(*it != 0))));
                }
                (_, Transported::Integer(it)) => {
                    return Ok(Transported::Integer(link.transfer.replace(*it)));
                }
                (_, value) => return Ok(value.clone()),
            }
        }
        Ok(Transported::Real(sum))
    }

    /// Values of all outputs, without Strings; true is 1.
    pub(super) fn numbers(&self) -> HashMap<Port, f64> {
        let numbers = self.values.iter().filter(|(_, it)| !matches!(it, Transported::String(_)));
        numbers.map(|(&port, it)| (port, it.number())).collect()
    }

    /// Reads the outputs of a level, sets the inputs that they feed, and returns the largest change
    /// relative to the tolerance.
    pub(super) fn transport(&mut self, level: &Level, tolerance: f64) -> Result<f64, FmuError> {
        let mut largest = 0.0;
        let mut sets = Sets::new();
        let mut read = Vec::new();
        for (&instance, variables) in &level.reads {
            for (variable, value) in self.read(instance, variables)? {
                let port = Port { instance, variable };
                largest = f64::max(largest, self.change(port, &value, tolerance).0);
                self.values.insert(port, value);
                read.push(port);
            }
        }
        for port in read {
            self.pass_on(port, &mut sets)?;
        }
        for (instance, values) in sets {
            self.write(instance, &values)?;
        }
        Ok(largest)
    }

    /// Change of a signal, relative to the tolerance and absolute.
    pub(super) fn change(&self, port: Port, new: &Transported, tolerance: f64) -> (f64, f64) {
        match (self.values.get(&port), new) {
            (Some(Transported::Real(old)), Transported::Real(new)) => {
                let scale = new.abs().max(1e-3 * self.system.nominal(port));
                let change = (new - old).abs();
                (change / (tolerance * scale), change)
            }
            (Some(old), new) if old == new => (0.0, 0.0),
            _ => (f64::INFINITY, f64::INFINITY),
        }
    }

    fn read(
        &mut self,
        instance: InstanceIndex,
        variables: &[VariableIndex],
    ) -> Result<Vec<(VariableIndex, Transported)>, FmuError> {
        let description = self.system.instances[instance].description();
        let of = |kinds: &[Type]| -> (Vec<VariableIndex>, Vec<u32>) {
            variables
                .iter()
                .filter(|&&variable| kinds.contains(&description.variables[variable].kind))
                .map(|&variable| (variable, description.variables[variable].value_reference))
                .unzip()
        };
        let unit = &mut self.instances[instance];
        let mut read = Vec::with_capacity(variables.len());
        let (indices, references) = of(&[Type::Real]);
        let mut reals = vec![0.0; references.len()];
        unit.get_real(&references, &mut reals)?;
        for (&variable, &value) in indices.iter().zip(&reals) {
            if !value.is_finite() {
                return Err(unit.not_finite(variable.0, value, self.start).into());
            }
            read.push((variable, Transported::Real(value)));
        }
        let (indices, references) = of(&[Type::Integer, Type::Enumeration]);
        let mut integers = vec![0; references.len()];
        unit.get_integer(&references, &mut integers)?;
        read.extend(indices.into_iter().zip(integers.into_iter().map(Transported::Integer)));
        let (indices, references) = of(&[Type::Boolean]);
        let mut booleans = vec![0; references.len()];
        unit.get_boolean(&references, &mut booleans)?;
        read.extend(indices.into_iter().zip(booleans.into_iter().map(Transported::Boolean)));
        let (indices, references) = of(&[Type::String]);
        for (variable, reference) in indices.into_iter().zip(references) {
            read.push((variable, Transported::String(unit.get_string(reference)?)));
        }
        Ok(read)
    }

    pub(super) fn write(
        &mut self,
        instance: InstanceIndex,
        values: &[(VariableIndex, Transported)],
    ) -> Result<(), FmuError> {
        let description = self.system.instances[instance].description();
        let unit = &mut self.instances[instance];
        let (mut references, mut reals) = (Vec::new(), Vec::new());
        for (variable, value) in values {
            debug_assert_eq!(description.variables[*variable].causality, Causality::Input);
            let reference = description.variables[*variable].value_reference;
            match value {
                Transported::Real(value) => {
                    references.push(reference);
                    reals.push(*value);
                }
                Transported::Integer(value) => unit.set_integer(&[reference], &[*value])?,
                Transported::Boolean(value) => unit.set_boolean(&[reference], &[*value])?,
                Transported::String(value) => unit.set_string(reference, value)?,
            }
        }
        unit.set_real(&references, &reals)
    }
}
