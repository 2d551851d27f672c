//! Connections: from an output to an input of the same type, units of measurement converted.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use super::{Link, Port, Result, System, SystemError};
use crate::description::{Causality, Conversion};
use crate::pattern;
use crate::scenario::Scenario;

impl System {
    pub(super) fn connect(&mut self, scenario: &Scenario) -> Result<()> {
        let mut fed: HashMap<Port, Port> = HashMap::new();
        for (k, connection) in scenario.connections.iter().enumerate() {
            let place = format!("connections[{k}]");
            for target in connection.to.as_slice() {
                let pairs = pattern::zip(&connection.from, target)
                    .map_err(|source| SystemError::Pattern { place: place.clone(), source })?;
                for (from, to) in pairs {
                    let from = self.port(&place, &from)?;
                    let to = self.port(&place, &to)?;
                    let link = Link {
                        extrapolation: connection.extrapolation,
                        ..self.link(&place, from, to, connection.ignore_units)?
                    };
                    if let Some(&first) = fed.get(&to) {
                        let (to, first) = (self.port_name(to), self.port_name(first));
                        return Err(SystemError::DrivenTwice { place, to, first });
                    }
                    fed.insert(to, from);
                    self.links.push(link);
                }
            }
        }
        Ok(())
    }

    fn link(&self, place: &str, from: Port, to: Port, ignore_units: bool) -> Result<Link> {
        let (source, target) = (self.variable(from), self.variable(to));
        let wrong = |port, causality, wanted| SystemError::Causality {
            place: place.to_owned(),
            port: self.port_name(port),
            causality,
            wanted,
        };
        if source.causality != Causality::Output {
            return Err(wrong(from, source.causality, "an output"));
        }
        if target.causality != Causality::Input {
            return Err(wrong(to, target.causality, "an input"));
        }
        if source.kind != target.kind {
            return Err(SystemError::Type {
                place: place.to_owned(),
                from: self.port_name(from),
                from_type: source.kind,
                to: self.port_name(to),
                to_type: target.kind,
            });
        }
        let conversion =
            if ignore_units { Conversion::IDENTITY } else { self.conversion(place, from, to)? };
        Ok(Link { from, to, conversion, extrapolation: None })
    }

    /// The map from the output's unit of measurement to the input's.
    fn conversion(&self, place: &str, from: Port, to: Port) -> Result<Conversion> {
        let (source, target) = (self.variable(from), self.variable(to));
        // a variable without a unit takes any
        let (Some(a), Some(b)) = (&source.unit, &target.unit) else {
            return Ok(Conversion::IDENTITY);
        };
        let base = |port: Port| {
            let description = self.instances[port.instance].description();
            description.unit_of(port.variable).and_then(|unit| unit.base.as_ref())
        };
        let mut conversion =
            Conversion::between((a, base(from)), (b, base(to))).map_err(|mismatch| {
                SystemError::Unit {
                    place: place.to_owned(),
                    from: self.port_name(from),
                    to: self.port_name(to),
                    source: mismatch,
                }
            })?;
        if source.relative_quantity || target.relative_quantity {
            conversion.offset = 0.0;
        }
        Ok(conversion)
    }

    /// Every input must have a source or a start value, which is sent.
    pub(super) fn check_inputs(&mut self) -> Result<()> {
        let fed: HashSet<Port> = self.links.iter().map(|link| link.to).collect();
        for instance in 0..self.instances.len() {
            let package = Arc::clone(&self.instances[instance].package);
            let description = package.description();
            for variable in description.with_causality(Causality::Input) {
                let port = Port { instance, variable };
                let plan = &mut self.instances[instance];
                if fed.contains(&port) || plan.inputs.iter().any(|(index, _)| *index == variable) {
                    continue;
                }
                match &description.variables[variable].start {
                    Some(value) => plan.inputs.push((variable, value.clone())),
                    None => {
                        return Err(SystemError::Unconnected { input: self.port_name(port) });
                    }
                }
            }
        }
        Ok(())
    }
}
