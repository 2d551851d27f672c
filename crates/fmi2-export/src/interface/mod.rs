//! The interface table: every variable is declared once, and everything else follows from it.

mod declaration;
mod info;
mod rules;
mod unit;

use std::collections::{BTreeMap, BTreeSet, HashMap};

pub use declaration::Declaration;
pub use info::{Experiment, Info};
pub(crate) use unit::BASE;
pub use unit::{DisplayUnit, Unit};

use crate::Error;
use crate::values::{
    Boolean, BooleanVar, BooleanVars, Integer, IntegerVar, IntegerVars, Real, RealVar, RealVars,
    StringVar, StringVars, Text, Var, Vars,
};

/// FMI's causality together with variability and `initial`, as far as a unit needs them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Role {
    Input,
    Parameter,
    Tunable,
    CalculatedParameter,
    Output,
    Local,
    Constant,
}

/// What depends on a variable's type.
#[derive(Debug, Clone, PartialEq)]
pub enum Data {
    Real {
        start: Option<f64>,
        min: Option<f64>,
        max: Option<f64>,
        nominal: Option<f64>,
        unit: Option<Unit>,
        display: Option<&'static str>,
    },
    Integer {
        start: Option<i32>,
        min: Option<i32>,
        max: Option<i32>,
    },
    Boolean {
        start: Option<bool>,
    },
    Text {
        start: Option<String>,
    },
}

/// FMI's four types, as indices of per-type arrays.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) enum Type {
    Real = 0,
    Integer = 1,
    Boolean = 2,
    Text = 3,
}

impl Type {
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Real => "Real",
            Self::Integer => "Integer",
            Self::Boolean => "Boolean",
            Self::Text => "String",
        }
    }
}

/// One declared variable.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Variable {
    pub(crate) name: String,
    pub(crate) description: String,
    pub(crate) role: Role,
    /// Changes at communication points only.
    pub(crate) discrete: bool,
    /// Index into the array of its type.
    pub(crate) reference: u32,
    /// Up to which order its time derivatives are on offer; 0: none.
    pub(crate) derivatives: u32,
    pub(crate) data: Data,
}

impl Variable {
    pub(crate) fn kind(&self) -> Type {
        match self.data {
            Data::Real { .. } => Type::Real,
            Data::Integer { .. } => Type::Integer,
            Data::Boolean { .. } => Type::Boolean,
            Data::Text { .. } => Type::Text,
        }
    }
}

/// A row of declared variables of any type, for the dependency lists. Handles convert into it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Row {
    kind: Type,
    first: u32,
    count: u32,
}

macro_rules! row {
    ($($type:ident)*) => {$(
        impl From<Var<$type>> for Row {
            fn from(one: Var<$type>) -> Self {
                Self { kind: Type::$type, first: one.index, count: 1 }
            }
        }
        impl From<Vars<$type>> for Row {
            fn from(row: Vars<$type>) -> Self {
                Self { kind: Type::$type, first: row.first, count: row.count }
            }
        }
        impl Var<$type> {
            /// As a [`Row`], to list variables of different kinds together.
            #[must_use]
            pub fn row(self) -> Row {
                self.into()
            }
        }
        impl Vars<$type> {
            /// As a [`Row`], to list variables of different kinds together.
            #[must_use]
            pub fn row(self) -> Row {
                self.into()
            }
        }
    )*};
}
row!(Real Integer Boolean Text);

/// Per output (by index of declaration) the variables that it depends on.
pub(crate) type Dependencies = BTreeMap<usize, BTreeSet<usize>>;

/// The table of a unit's variables, filled by [`Model::declare`](crate::Model::declare).
///
/// Declaration faults (a name twice, a start value outside its range, …) are collected and end
/// the instantiation, or the printing of the description, with one message that lists them all.
#[derive(Debug)]
pub struct Interface {
    pub(crate) info: Info,
    pub(crate) variables: Vec<Variable>,
    /// Per type: index in `variables` of each value reference.
    pub(crate) by_type: [Vec<usize>; 4],
    /// How many real inputs there are.
    pub(crate) real_inputs: u32,
    pub(crate) depends: Dependencies,
    pub(crate) initially: Dependencies,
    names: HashMap<String, usize>,
    faults: Vec<String>,
}

impl Interface {
    pub(crate) fn new() -> Self {
        Self {
            info: Info::new("", ""),
            variables: Vec::new(),
            by_type: Default::default(),
            real_inputs: 0,
            depends: BTreeMap::new(),
            initially: BTreeMap::new(),
            names: HashMap::new(),
            faults: Vec::new(),
        }
    }

    /// Says what the unit is. Required.
    pub fn describe(&mut self, info: Info) {
        self.info = info;
    }

    /// Changes the model's name, where it follows from the resources.
    pub fn set_model_name(&mut self, name: impl Into<String>) {
        self.info.model_name = name.into();
    }

    /// Begins the declaration of a real variable.
    pub fn real(&mut self, name: impl Into<String>) -> Declaration<'_, Real, RealVar> {
        Declaration::new(self, name.into(), None)
    }

    /// Begins the declaration of `count` real variables `name_01`, `name_02`, … (three digits from
    /// 100 variables on). A `{k}` in the description becomes the number.
    pub fn reals(
        &mut self,
        name: impl Into<String>,
        count: usize,
    ) -> Declaration<'_, Real, RealVars> {
        Declaration::new(self, name.into(), Some(count))
    }

    /// Begins the declaration of an integer variable.
    pub fn integer(&mut self, name: impl Into<String>) -> Declaration<'_, Integer, IntegerVar> {
        Declaration::new(self, name.into(), None)
    }

    /// Begins the declaration of a row of integer variables, named as by [`Interface::reals`].
    pub fn integers(
        &mut self,
        name: impl Into<String>,
        count: usize,
    ) -> Declaration<'_, Integer, IntegerVars> {
        Declaration::new(self, name.into(), Some(count))
    }

    /// Begins the declaration of a boolean variable.
    pub fn boolean(&mut self, name: impl Into<String>) -> Declaration<'_, Boolean, BooleanVar> {
        Declaration::new(self, name.into(), None)
    }

    /// Begins the declaration of a row of boolean variables, named as by [`Interface::reals`].
    pub fn booleans(
        &mut self,
        name: impl Into<String>,
        count: usize,
    ) -> Declaration<'_, Boolean, BooleanVars> {
        Declaration::new(self, name.into(), Some(count))
    }

    /// Begins the declaration of a string variable.
    pub fn string(&mut self, name: impl Into<String>) -> Declaration<'_, Text, StringVar> {
        Declaration::new(self, name.into(), None)
    }

    /// Begins the declaration of a row of string variables, named as by [`Interface::reals`].
    pub fn strings(
        &mut self,
        name: impl Into<String>,
        count: usize,
    ) -> Declaration<'_, Text, StringVars> {
        Declaration::new(self, name.into(), Some(count))
    }

    /// After initialization each of `outputs` depends directly (without a state between) on all of
    /// `inputs`, and beyond further such calls on nothing else. An output of which nothing is said
    /// depends on everything, as far as an importer can know.
    ///
    /// Handles of different types are listed as `&[gap.row(), forces.row()]`.
    pub fn depends<I: Into<Row> + Copy>(&mut self, outputs: impl Into<Row>, inputs: &[I]) {
        let (unknowns, knowns) = self.resolve(outputs.into(), inputs);
        for unknown in unknowns {
            self.depends.entry(unknown).or_default().extend(&knowns);
        }
    }

    /// After initialization `outputs` depend directly on no input: only on the state and time.
    pub fn independent(&mut self, outputs: impl Into<Row>) {
        self.depends::<Row>(outputs, &[]);
    }

    /// The k-th of `outputs` depends directly on the k-th of `inputs`, after initialization.
    pub fn depends_elementwise(&mut self, outputs: impl Into<Row>, inputs: impl Into<Row>) {
        let pairs = self.pairs(outputs.into(), inputs.into());
        for (unknown, known) in pairs {
            self.depends.entry(unknown).or_default().insert(known);
        }
    }

    /// In initialization mode each of `unknowns` (outputs, calculated parameters) depends on all
    /// of `knowns` (inputs, parameters), and beyond further such calls on nothing else.
    pub fn initially_depends<I: Into<Row> + Copy>(
        &mut self,
        unknowns: impl Into<Row>,
        knowns: &[I],
    ) {
        let (unknowns, knowns) = self.resolve(unknowns.into(), knowns);
        for unknown in unknowns {
            self.initially.entry(unknown).or_default().extend(&knowns);
        }
    }

    /// In initialization mode `unknowns` depend on no input and no parameter.
    pub fn initially_independent(&mut self, unknowns: impl Into<Row>) {
        self.initially_depends::<Row>(unknowns, &[]);
    }

    /// In initialization mode the k-th of `unknowns` depends on the k-th of `knowns`.
    pub fn initially_depends_elementwise(
        &mut self,
        unknowns: impl Into<Row>,
        knowns: impl Into<Row>,
    ) {
        let pairs = self.pairs(unknowns.into(), knowns.into());
        for (unknown, known) in pairs {
            self.initially.entry(unknown).or_default().insert(known);
        }
    }

    /// The highest order of a time derivative that any output offers.
    pub(crate) fn max_output_derivative_order(&self) -> u32 {
        self.variables.iter().map(|variable| variable.derivatives).max().unwrap_or(0)
    }

    /// Adds a fault of the model's own to the list that ends the instantiation.
    pub fn fault(&mut self, text: impl Into<String>) {
        self.faults.push(text.into());
    }

    /// Indices of declaration of a row.
    fn indices(&mut self, row: Row) -> Vec<usize> {
        let table = &self.by_type[row.kind as usize];
        let range = row.first as usize..row.first as usize + row.count as usize;
        if let Some(indices) = table.get(range) {
            return indices.to_vec();
        }
        self.fault("a dependency names a variable that another interface declared");
        Vec::new()
    }

    fn resolve<I: Into<Row> + Copy>(
        &mut self,
        unknowns: Row,
        knowns: &[I],
    ) -> (Vec<usize>, Vec<usize>) {
        let knowns = knowns.iter().flat_map(|&row| self.indices(row.into())).collect();
        (self.indices(unknowns), knowns)
    }

    fn pairs(&mut self, unknowns: Row, knowns: Row) -> Vec<(usize, usize)> {
        if unknowns.count != knowns.count {
            self.fault(format!(
                "element by element dependency of {} variables on {}",
                unknowns.count, knowns.count
            ));
        }
        let (unknowns, knowns) = (self.indices(unknowns), self.indices(knowns));
        unknowns.into_iter().zip(knowns).collect()
    }

    /// Takes up a variable and returns its value reference.
    fn push(&mut self, mut variable: Variable) -> u32 {
        let index = self.variables.len();
        let table = &mut self.by_type[variable.kind() as usize];
        let reference = table.len() as u32;
        table.push(index);
        variable.reference = reference;
        if variable.kind() == Type::Real && variable.role == Role::Input {
            self.real_inputs += 1;
        }
        rules::check_variable(&variable, &mut self.faults);
        if self.names.insert(variable.name.clone(), index).is_some() {
            self.faults.push(format!("{} is declared twice", variable.name));
        }
        self.variables.push(variable);
        reference
    }

    /// Checks the whole table once everything is declared.
    pub(crate) fn finish(mut self) -> Result<Self, Error> {
        let mut faults = std::mem::take(&mut self.faults);
        rules::check_table(&self, &mut faults);
        if faults.is_empty() {
            return Ok(self);
        }
        let name = &self.info.model_identifier;
        Err(Error::invalid(format!("the interface of {name:?} is faulty: {}", faults.join("; "))))
    }
}
