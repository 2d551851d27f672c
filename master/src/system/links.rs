//! Connections from outputs to inputs: types, units of measurement, sums.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use super::{InstanceIndex, Link, Port, Result, System, SystemError, VariableIndex};
use fmi2_import::description::{Causality, Conversion, Type};
use scenario::{Connection, Scenario};

impl System {
    pub(super) fn connect(&mut self, scenario: &Scenario) -> Result<()> {
        // for each input with a source: the source, and the connection and target that it belongs to
        let mut fed: HashMap<Port, (Port, (usize, usize))> = HashMap::new();
        for (k, connection) in scenario.connections.iter().enumerate() {
            let place = format!("connections[{k}]");
            for (n, target) in connection.to.as_slice().iter().enumerate() {
                for (m, (source, factor)) in connection.from.terms().enumerate() {
                    for (from, to) in self.pairs(&place, source, target)? {
                        let link = self.link(&place, from, to, connection, (m, factor))?;
                        match fed.get(&to) {
                            // terms of one sum
                            Some((_, of)) if *of == (k, n) && m > 0 => {}
                            Some(&(first, _)) => {
                                let (to, first) = (self.port_name(to), self.port_name(first));
                                return Err(SystemError::DrivenTwice { place, to, first });
                            }
                            None => {
                                fed.insert(to, (from, (k, n)));
                            }
                        }
                        self.links.push(link);
                    }
                }
            }
        }
        Ok(())
    }

    /// One term of a connection, given by its position and factor.
    fn link(
        &mut self,
        place: &str,
        from: Port,
        to: Port,
        connection: &Connection,
        (term, factor): (usize, f64),
    ) -> Result<Link> {
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
        let both_real = source.kind == Type::Real && target.kind == Type::Real;
        if connection.from.terms().nth(1).is_some() && target.kind != Type::Real {
            let (place, to, kind) = (place.to_owned(), self.port_name(to), target.kind);
            return Err(SystemError::NotLinear { place, to, kind });
        }
        let converted = if both_real && !connection.ignore_units {
            self.conversion(place, from, to)?
        } else {
            Conversion::IDENTITY
        };
        let all = factor * connection.factor.unwrap_or(1.0);
        let added = connection.offset.filter(|_| term == 0).unwrap_or(0.0);
        let linear =
            Conversion { factor: all * converted.factor, offset: all * converted.offset + added };
        let transfer = match &connection.map {
            Some(table) if linear == Conversion::IDENTITY || target.kind == Type::Real => {
                self.items(place, from, to, Some(table))?
            }
            _ => self.transfer(place, from, to, linear)?,
        };
        let Connection { extrapolation, kinks, .. } = *connection;
        if kinks && !both_real {
            let (place, to) = (place.to_owned(), self.port_name(to));
            return Err(SystemError::NoKinks { place, from: self.port_name(from), to });
        }
        Ok(Link { from, to, transfer, extrapolation, kinks })
    }

    /// The map from the output's unit of measurement to the input's.
    fn conversion(&self, place: &str, from: Port, to: Port) -> Result<Conversion> {
        let (source, target) = (self.variable(from), self.variable(to));
        // a variable without a unit of measurement accepts any
        let (Some(a), Some(b)) = (&source.unit, &target.unit) else {
            return Ok(Conversion::IDENTITY);
        };
        let base = |port: Port| {
            let description = self.instances[port.instance].description();
            description.unit_of(port.variable.0).and_then(|unit| unit.base.as_ref())
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

    /// Every input must have a source or a start value; that value is sent.
    pub(super) fn check_inputs(&mut self) -> Result<()> {
        let fed: HashSet<Port> = self.links.iter().map(|link| link.to).collect();
        for instance in (0..self.instances.len()).map(InstanceIndex) {
            let package = Arc::clone(&self.instances[instance].package);
            let description = package.description();
            for variable in description.with_causality(Causality::Input).map(VariableIndex) {
                let port = Port { instance, variable };
                let setup = &mut self.instances[instance];
                if fed.contains(&port) || setup.inputs.contains_key(&variable) {
                    continue;
                }
                match &description.variables[variable].start {
                    Some(value) => {
                        setup.inputs.insert(variable, value.clone());
                    }
                    None => {
                        return Err(SystemError::Unconnected { input: self.port_name(port) });
                    }
                }
            }
        }
        Ok(())
    }
}
