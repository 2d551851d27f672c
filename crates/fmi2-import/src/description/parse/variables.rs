//! The variables, with the attributes that they inherit from declared types.

use std::collections::{HashMap, HashSet};

use roxmltree::Node;

use crate::xml::Plain as _;

use super::types::Types;
use super::{DescriptionError, Reader, Result, children, type_of};
use crate::description::{
    Causality, Initial, Severity, Type, UnitOfMeasure, Value, Variability, Variable,
};

impl<'a> Reader<'a> {
    pub(super) fn variables(
        &mut self,
        root: Node<'a, 'a>,
        types: &Types<'a>,
    ) -> Result<Vec<Variable>> {
        children(root, "ModelVariables", "ScalarVariable")
            .map(|node| self.variable(node, types))
            .collect()
    }

    fn variable(&mut self, node: Node<'a, 'a>, types: &Types<'a>) -> Result<Variable> {
        self.note_unknown(
            node,
            &[
                "name",
                "valueReference",
                "description",
                "causality",
                "variability",
                "initial",
                "canHandleMultipleSetPerTimeInstant",
            ],
        );
        let name = self.required(node, "name")?.to_owned();
        let Some((kind, element)) =
            node.children().find_map(|child| type_of(child).map(|kind| (kind, child)))
        else {
            return Err(DescriptionError::NoType { name, line: self.line(node) });
        };
        let declared = self.declared(&name, element, types);
        // an attribute of the variable overrides that of its type
        let place = |attribute| match declared {
            Some(declared) if element.attr(attribute).is_none() => declared,
            _ => element,
        };
        let causality = self.causality(node);
        let variability = self.variability(node, kind);
        let given = self.initial(node);
        let value_reference = self
            .number(node, "valueReference", "a non-negative integer")?
            .ok_or_else(|| self.missing(node, "valueReference"))?;
        let text = |attribute| place(attribute).attr(attribute).map(str::to_owned);
        Ok(Variable {
            value_reference,
            kind,
            causality,
            variability,
            initial: given.or_else(|| default_initial(causality, variability)),
            initial_given: given.is_some(),
            start: self.start(element, kind),
            unit: text("unit"),
            display_unit: text("displayUnit"),
            min: self.optional(place("min"), "min", "a number"),
            max: self.optional(place("max"), "max", "a number"),
            nominal: self.optional(place("nominal"), "nominal", "a number"),
            relative_quantity: self
                .boolean(place("relativeQuantity"), "relativeQuantity")
                .unwrap_or(false),
            declared_type: element.attr("declaredType").map(str::to_owned),
            description: node.attr("description").map(str::to_owned),
            derivative_of: self
                .optional::<usize>(element, "derivative", "the index of a variable")
                .and_then(|index| index.checked_sub(1)),
            name,
        })
    }

    /// The declared type of a variable, if it is defined and of the same kind.
    fn declared(
        &mut self,
        name: &str,
        element: Node<'a, 'a>,
        types: &Types<'a>,
    ) -> Option<Node<'a, 'a>> {
        let wanted = element.attr("declaredType")?;
        let declared = types.get(wanted).copied();
        let fits = declared.is_some_and(|it| it.tag_name().name() == element.tag_name().name());
        if !fits {
            let why = declared.map_or("not defined", |_| "of another kind");
            let message = format!("variable \"{name}\" has the type \"{wanted}\", which is {why}");
            self.note("declared-type", Severity::Error, message);
        }
        declared.filter(|_| fits)
    }

    fn start(&mut self, element: Node<'a, 'a>, kind: Type) -> Option<Value> {
        let text = element.attr("start")?;
        match kind {
            Type::Real => self.optional(element, "start", "a number").map(Value::Real),
            Type::Integer | Type::Enumeration => {
                self.optional(element, "start", "an integer").map(Value::Integer)
            }
            Type::Boolean => self.boolean(element, "start").map(Value::Boolean),
            Type::String => Some(Value::String(text.to_owned())),
        }
    }

    fn causality(&mut self, node: Node<'a, 'a>) -> Causality {
        match node.attr("causality") {
            None | Some("local") => Causality::Local,
            Some("parameter") => Causality::Parameter,
            Some("calculatedParameter") => Causality::CalculatedParameter,
            Some("input") => Causality::Input,
            Some("output") => Causality::Output,
            Some("independent") => Causality::Independent,
            Some(_) => {
                let error = self.invalid(node, "causality", "a causality of FMI 2.0");
                self.ignored(&error).unwrap_or(Causality::Local)
            }
        }
    }

    fn variability(&mut self, node: Node<'a, 'a>, kind: Type) -> Variability {
        // the default of the standard is continuous, which only a Real can be
        let default =
            if kind == Type::Real { Variability::Continuous } else { Variability::Discrete };
        match node.attr("variability") {
            None => default,
            Some("constant") => Variability::Constant,
            Some("fixed") => Variability::Fixed,
            Some("tunable") => Variability::Tunable,
            Some("discrete") => Variability::Discrete,
            Some("continuous") => Variability::Continuous,
            Some(_) => {
                let error = self.invalid(node, "variability", "a variability of FMI 2.0");
                self.ignored(&error).unwrap_or(default)
            }
        }
    }

    fn initial(&mut self, node: Node<'a, 'a>) -> Option<Initial> {
        match node.attr("initial")? {
            "exact" => Some(Initial::Exact),
            "approx" => Some(Initial::Approx),
            "calculated" => Some(Initial::Calculated),
            _ => {
                let error = self.invalid(node, "initial", "exact, approx or calculated");
                self.ignored(&error)
            }
        }
    }

    /// Reports units of measure that are not defined. A blank name means that there is none.
    pub(super) fn undefined_units(&mut self, variables: &mut [Variable], units: &[UnitOfMeasure]) {
        let defined: HashSet<&str> = units.iter().map(|unit| unit.name.as_str()).collect();
        for variable in variables {
            let Some(unit) = variable.unit.as_deref().filter(|it| !defined.contains(it)) else {
                continue;
            };
            let nameless = unit.trim().is_empty();
            let taken = if nameless {
                "it is ignored"
            } else {
                "it can be connected only to a unit with the same name"
            };
            let name = &variable.name;
            let message = format!(
                "variable \"{name}\" has the unit \"{unit}\", which is not defined; {taken}"
            );
            if nameless {
                variable.unit = None;
            }
            self.note("unit-defined", Severity::Warning, message);
        }
    }

    pub(super) fn index(&self, variables: &[Variable]) -> Result<HashMap<String, usize>> {
        let mut by_name = HashMap::with_capacity(variables.len());
        let root = self.document.root_element();
        for (index, variable) in variables.iter().enumerate() {
            if by_name.insert(variable.name.clone(), index).is_some() {
                let node = children(root, "ModelVariables", "ScalarVariable").nth(index);
                return Err(DescriptionError::Duplicate {
                    name: variable.name.clone(),
                    line: node.map_or(0, |node| self.line(node)),
                });
            }
        }
        Ok(by_name)
    }
}

/// The standard's default for `initial` (FMI 2.0.5, section 2.2.7).
fn default_initial(causality: Causality, variability: Variability) -> Option<Initial> {
    match causality {
        Causality::Input | Causality::Independent => None,
        Causality::Parameter => Some(Initial::Exact),
        Causality::CalculatedParameter => Some(Initial::Calculated),
        Causality::Output | Causality::Local if variability == Variability::Constant => {
            Some(Initial::Exact)
        }
        Causality::Output | Causality::Local => Some(Initial::Calculated),
    }
}
