//! The interface table in the form that the C functions use: flat arrays by value reference.

use std::ops::Range;

use uuid::Uuid;

use crate::interface::{Interface, TypeAttributes, VariableRole};
use crate::per_type::{PerType, VariableType};
use crate::state::InstanceMode;
use crate::values::{CText, NO_SLOT, Values};
use crate::{Error, Model, Resources};

/// Data needed to set a real variable, in one cache line with its neighbours.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RealSettingRule {
    /// Range of permitted values; both bounds are finite, so that NaN and Inf are outside.
    pub(crate) low: f64,
    pub(crate) high: f64,
    /// Place among the Taylor coefficients, or [`NO_SLOT`].
    pub(crate) slot: u32,
    /// Modes in which it may be set, as bits of [`InstanceMode`].
    pub(crate) settable: u8,
    /// Highest derivative that the importer may set; 0 but for continuous inputs.
    pub(crate) highest: u8,
    /// Setting it may change the state before the first step, or outputs afterwards.
    pub(crate) tunable: bool,
    /// Is an output.
    pub(crate) output: bool,
}

/// Data needed to set an integer, boolean or string variable.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SettingRule {
    pub(crate) low: i32,
    pub(crate) high: i32,
    pub(crate) settable: u8,
    pub(crate) tunable: bool,
}

/// The interface table of one instance, compiled to flat arrays. It never changes.
#[derive(Debug)]
pub(crate) struct VariableTable {
    pub(crate) interface: Interface,
    pub(crate) guid: Uuid,
    /// Data needed to set a variable, by value reference.
    pub(crate) rules:
        PerType<Vec<RealSettingRule>, Vec<SettingRule>, Vec<SettingRule>, Vec<SettingRule>>,
    /// Highest order of time derivatives that is offered, by value reference of the reals.
    pub(crate) derivatives: Vec<u32>,
    /// Value references of the real inputs, by slot.
    pub(crate) real_inputs: Vec<u32>,
    /// Value references of all real variables that the model computes, as ranges.
    pub(crate) computed: Vec<Range<usize>>,
    pub(crate) start: Values,
}

impl VariableTable {
    /// Calls the model's declarations and compiles them.
    pub(crate) fn declare<M: Model>(resources: &Resources) -> Result<(M, Self), Error> {
        let mut interface = Interface::new();
        let model = M::declare(resources, &mut interface)?;
        let interface = interface.finish()?;
        let guid = crate::description::guid(&interface, resources);
        Ok((model, Self::compile(interface, guid)))
    }

    fn compile(interface: Interface, guid: Uuid) -> Self {
        let mut table = Self {
            guid,
            rules: PerType::default(),
            derivatives: Vec::with_capacity(interface.by_type.reals.len()),
            real_inputs: Vec::with_capacity(interface.real_inputs as usize),
            computed: Vec::new(),
            start: Values::default(),
            interface,
        };
        let interface = std::mem::replace(&mut table.interface, Interface::new());
        for variable in &interface.variables {
            let settable = settable(variable.role);
            let tunable = variable.role == VariableRole::Tunable;
            let bounded = matches!(variable.role, VariableRole::Parameter | VariableRole::Tunable);
            match &variable.data {
                TypeAttributes::Real { start, min, max, .. } => {
                    let is_input = variable.role == VariableRole::Input;
                    let rule = RealSettingRule {
                        low: min.filter(|_| bounded).unwrap_or(f64::MIN),
                        high: max.filter(|_| bounded).unwrap_or(f64::MAX),
                        slot: if is_input { table.real_inputs.len() as u32 } else { NO_SLOT },
                        settable,
                        highest: if is_input && !variable.discrete {
                            variable.taken as u8
                        } else {
                            0
                        },
                        tunable,
                        output: variable.role == VariableRole::Output,
                    };
                    table.derivatives.push(variable.derivatives.max(variable.interpolated));
                    table.push_real(rule, start.unwrap_or(0.0), settable == 0 && start.is_none());
                }
                TypeAttributes::Integer { start, min, max } => {
                    let low = min.filter(|_| bounded).unwrap_or(i32::MIN);
                    let high = max.filter(|_| bounded).unwrap_or(i32::MAX);
                    table.rules.integers.push(SettingRule { low, high, settable, tunable });
                    table.start.arrays.integers.push(start.unwrap_or(0));
                }
                TypeAttributes::Boolean { start } => {
                    table.rules.booleans.push(SettingRule { low: 0, high: 0, settable, tunable });
                    table.start.arrays.booleans.push(start.unwrap_or(false));
                }
                TypeAttributes::Text { start } => {
                    table.rules.strings.push(SettingRule { low: 0, high: 0, settable, tunable });
                    let text = start.as_deref().and_then(CText::new);
                    table.start.arrays.strings.push(text.unwrap_or_else(CText::empty));
                }
            }
        }
        table.interface = interface;
        table
    }

    fn push_real(&mut self, rule: RealSettingRule, start: f64, computed: bool) {
        let reference = self.rules.reals.len();
        if rule.slot != NO_SLOT {
            self.real_inputs.push(reference as u32);
            self.start.taylor.push([start, 0.0, 0.0, 0.0]);
            self.start.further.push([0.0; 2]);
        }
        if computed {
            match self.computed.last_mut() {
                Some(last) if last.end == reference => last.end += 1,
                _ => self.computed.push(reference..reference + 1),
            }
        }
        self.rules.reals.push(rule);
        self.start.arrays.reals.push(start);
    }

    /// Rules of the variables of a type that is not real.
    pub(crate) fn other_rules(&self, kind: VariableType) -> &[SettingRule] {
        match kind {
            VariableType::Real => &[],
            VariableType::Integer => &self.rules.integers,
            VariableType::Boolean => &self.rules.booleans,
            VariableType::Text => &self.rules.strings,
        }
    }

    /// Name of a variable, for messages.
    pub(crate) fn name(&self, kind: VariableType, reference: usize) -> &str {
        self.interface
            .by_type
            .get(kind)
            .get(reference)
            .map_or("(no such variable)", |&index| &self.interface.variables[index].name)
    }

    /// Role of a variable, for messages.
    pub(crate) fn role(&self, kind: VariableType, reference: usize) -> Option<VariableRole> {
        let index = *self.interface.by_type.get(kind).get(reference)?;
        Some(self.interface.variables[index].role)
    }

    /// Nominal value of a real variable, 1 if none is declared.
    pub(crate) fn nominal(&self, reference: usize) -> f64 {
        let index = self.interface.by_type.reals[reference];
        match self.interface.variables[index].data {
            TypeAttributes::Real { nominal: Some(nominal), .. } => nominal,
            _ => 1.0,
        }
    }

    /// The first computed value that is not finite.
    #[inline]
    pub(crate) fn not_finite(&self, values: &Values) -> Option<usize> {
        for range in &self.computed {
            // v·0 is NaN exactly for what is not finite, and a sum of zeros vectorises.
            let sum = values.arrays.reals[range.clone()].iter().fold(0.0, |sum, v| sum + v * 0.0);
            if sum != 0.0 {
                return range.clone().find(|&k| !values.arrays.reals[k].is_finite());
            }
        }
        None
    }

    /// Whether deserialized values have this table's shape.
    pub(crate) fn fits(&self, values: &Values) -> bool {
        let start = &self.start;
        values.arrays.reals.len() == start.arrays.reals.len()
            && values.arrays.integers.len() == start.arrays.integers.len()
            && values.arrays.booleans.len() == start.arrays.booleans.len()
            && values.arrays.strings.len() == start.arrays.strings.len()
            && values.taylor.len() == start.taylor.len()
            && values.further.len() == start.further.len()
            && values.arrays.strings.iter().all(CText::is_well_formed)
    }
}

/// Modes in which a variable may be set. Inputs may already be set while instantiated, because FMPy
/// and fmuCheck do so; everything that has a start value may be set before the experiment is set
/// up, because OMSimulator does so.
fn settable(role: VariableRole) -> u8 {
    let before = InstanceMode::Instantiated.bit() | InstanceMode::Initialization.bit();
    match role {
        VariableRole::Input | VariableRole::Tunable => before | InstanceMode::Step.bit(),
        VariableRole::Parameter => before,
        VariableRole::CalculatedParameter
        | VariableRole::Output
        | VariableRole::Local
        | VariableRole::Constant => 0,
    }
}
