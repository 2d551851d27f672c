//! The interface table: every variable is declared once, and everything else is derived from it.

mod declaration;
mod info;
mod rules;
mod unit_of_measure;

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, HashSet};
use std::sync::Arc;

pub use declaration::Declaration;
pub use info::{DefaultExperiment, Info, Limits};
pub(crate) use unit_of_measure::BASE;
pub use unit_of_measure::{DisplayUnit, UnitOfMeasure};

use crate::Error;
use crate::per_type::{PerType, VariableType};
use crate::values::{
    Boolean, BooleanVar, BooleanVars, Integer, IntegerVar, IntegerVars, Real, RealVar, RealVars,
    StringVar, StringVars, Text, Var, Vars,
};

/// Combination of FMI's causality, variability and `initial`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum VariableRole {
    Input,
    Parameter,
    Tunable,
    CalculatedParameter,
    Output,
    Local,
    Constant,
}

/// The attributes that depend on a variable's type.
#[derive(Debug, Clone, PartialEq)]
pub enum TypeAttributes {
    Real {
        start: Option<f64>,
        min: Option<f64>,
        max: Option<f64>,
        nominal: Option<f64>,
        unit: Option<UnitOfMeasure>,
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

/// One declared variable.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct DeclaredVariable {
    pub(crate) name: String,
    pub(crate) description: String,
    pub(crate) role: VariableRole,
    /// Changes at communication points only.
    pub(crate) discrete: bool,
    /// Index into the array of its type.
    pub(crate) reference: u32,
    /// Highest order of its time derivatives that is offered; 0: none.
    pub(crate) derivatives: u32,
    /// The same for importers that interpolate, if more.
    pub(crate) interpolated: u32,
    /// Highest order of derivatives that it takes as an input.
    pub(crate) taken: u32,
    pub(crate) data: TypeAttributes,
}

impl DeclaredVariable {
    pub(crate) fn kind(&self) -> VariableType {
        match self.data {
            TypeAttributes::Real { .. } => VariableType::Real,
            TypeAttributes::Integer { .. } => VariableType::Integer,
            TypeAttributes::Boolean { .. } => VariableType::Boolean,
            TypeAttributes::Text { .. } => VariableType::Text,
        }
    }
}

/// A row of declared variables of any type, for the dependency lists. Converts from handles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct VariableRow {
    kind: VariableType,
    first: u32,
    count: u32,
}

macro_rules! row {
    ($($type:ident)*) => {$(
        impl From<Var<$type>> for VariableRow {
            fn from(one: Var<$type>) -> Self {
                Self { kind: VariableType::$type, first: one.index, count: 1 }
            }
        }
        impl From<Vars<$type>> for VariableRow {
            fn from(row: Vars<$type>) -> Self {
                Self { kind: VariableType::$type, first: row.first, count: row.count }
            }
        }
        impl Var<$type> {
            /// As a [`VariableRow`], to list variables of different kinds together.
            #[must_use]
            pub fn row(self) -> VariableRow {
                self.into()
            }
        }
        impl Vars<$type> {
            /// As a [`VariableRow`], to list variables of different kinds together.
            #[must_use]
            pub fn row(self) -> VariableRow {
                self.into()
            }
        }
    )*};
}
row!(Real Integer Boolean Text);

/// Variables that each output (by index of declaration) depends on: ascending and each once when the table
/// is finished. Outputs that depend on the same share a list.
pub(crate) type Dependencies = BTreeMap<usize, Arc<Vec<usize>>>;

/// The table of a unit's variables, filled by [`Model::declare`](crate::Model::declare).
///
/// Declaration faults (a name twice, a start value outside its range, …) are collected. They make
/// the instantiation, or the printing of the description, fail with one message that lists all of
/// them.
#[derive(Debug)]
pub struct Interface {
    pub(crate) info: Info,
    pub(crate) limits: Limits,
    pub(crate) variables: Vec<DeclaredVariable>,
    /// Per type: index in `variables` of each value reference.
    pub(crate) by_type: PerType<Vec<usize>>,
    /// How many real inputs there are.
    pub(crate) real_inputs: u32,
    pub(crate) depends: Dependencies,
    pub(crate) initially: Dependencies,
    faults: Vec<String>,
}

impl Interface {
    pub(crate) fn new() -> Self {
        Self {
            info: Info::new("", ""),
            limits: Limits::default(),
            variables: Vec::new(),
            by_type: PerType::default(),
            real_inputs: 0,
            depends: BTreeMap::new(),
            initially: BTreeMap::new(),
            faults: Vec::new(),
        }
    }

    /// Sets the unit's name, version and default experiment. Required.
    pub fn describe(&mut self, info: Info) {
        self.info = info;
    }

    /// Declares what the unit cannot do. By default it can do everything that the kit offers.
    pub fn limit(&mut self, limits: Limits) {
        self.limits = limits;
    }

    /// Changes the model's name, if it depends on the resources.
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

    /// After initialization each of `outputs` depends directly (not through a state) on all of
    /// `inputs`, and on nothing else unless further calls add it. An output without any such call
    /// counts as dependent on everything.
    ///
    /// Handles of different types are listed as `&[gap.row(), forces.row()]`.
    pub fn depends<I: Into<VariableRow> + Copy>(
        &mut self,
        outputs: impl Into<VariableRow>,
        inputs: &[I],
    ) {
        let (unknowns, knowns) = self.resolve(outputs.into(), inputs);
        add(&mut self.depends, unknowns, knowns);
    }

    /// After initialization `outputs` depend directly on no input: only on the state and time.
    pub fn independent(&mut self, outputs: impl Into<VariableRow>) {
        self.depends::<VariableRow>(outputs, &[]);
    }

    /// The k-th of `outputs` depends directly on the k-th of `inputs`, after initialization.
    pub fn depends_elementwise(
        &mut self,
        outputs: impl Into<VariableRow>,
        inputs: impl Into<VariableRow>,
    ) {
        let pairs = self.pairs(outputs.into(), inputs.into());
        for (unknown, known) in pairs {
            Arc::make_mut(self.depends.entry(unknown).or_default()).push(known);
        }
    }

    /// In initialization mode each of `unknowns` (outputs, calculated parameters) depends on all of
    /// `knowns` (inputs, parameters), and on nothing else unless further calls add it.
    pub fn initially_depends<I: Into<VariableRow> + Copy>(
        &mut self,
        unknowns: impl Into<VariableRow>,
        knowns: &[I],
    ) {
        let (unknowns, knowns) = self.resolve(unknowns.into(), knowns);
        add(&mut self.initially, unknowns, knowns);
    }

    /// In initialization mode `unknowns` depend on no input and no parameter.
    pub fn initially_independent(&mut self, unknowns: impl Into<VariableRow>) {
        self.initially_depends::<VariableRow>(unknowns, &[]);
    }

    /// In initialization mode the k-th of `unknowns` depends on the k-th of `knowns`.
    pub fn initially_depends_elementwise(
        &mut self,
        unknowns: impl Into<VariableRow>,
        knowns: impl Into<VariableRow>,
    ) {
        let pairs = self.pairs(unknowns.into(), knowns.into());
        for (unknown, known) in pairs {
            Arc::make_mut(self.initially.entry(unknown).or_default()).push(known);
        }
    }

    /// The highest order of a time derivative that any output offers.
    pub(crate) fn max_output_derivative_order(&self) -> u32 {
        let orders = self.variables.iter().map(|it| it.derivatives.max(it.interpolated));
        orders.max().unwrap_or(0)
    }

    /// Adds a fault of the model to the list that makes the instantiation fail.
    pub fn fault(&mut self, text: impl Into<String>) {
        self.faults.push(text.into());
    }

    /// Adds the indices of declaration of a row.
    fn add_indices(&mut self, row: VariableRow, indices: &mut Vec<usize>) {
        let range = row.first as usize..row.first as usize + row.count as usize;
        match self.by_type.get(row.kind).get(range) {
            Some(found) => indices.extend_from_slice(found),
            None => self.fault("a dependency names a variable that another interface declared"),
        }
    }

    fn indices(&mut self, row: VariableRow) -> Vec<usize> {
        let mut indices = Vec::with_capacity(row.count as usize);
        self.add_indices(row, &mut indices);
        indices
    }

    fn resolve<I: Into<VariableRow> + Copy>(
        &mut self,
        unknowns: VariableRow,
        knowns: &[I],
    ) -> (Vec<usize>, Vec<usize>) {
        let mut indices = Vec::new();
        for &row in knowns {
            self.add_indices(row.into(), &mut indices);
        }
        (self.indices(unknowns), indices)
    }

    fn pairs(&mut self, unknowns: VariableRow, knowns: VariableRow) -> Vec<(usize, usize)> {
        if unknowns.count != knowns.count {
            self.fault(format!(
                "elementwise dependency of {} variables on {}",
                unknowns.count, knowns.count
            ));
        }
        let (unknowns, knowns) = (self.indices(unknowns), self.indices(knowns));
        unknowns.into_iter().zip(knowns).collect()
    }

    /// Adds a variable and returns its value reference.
    fn push(&mut self, mut variable: DeclaredVariable) -> u32 {
        let index = self.variables.len();
        let table = self.by_type.get_mut(variable.kind());
        let reference = table.len() as u32;
        table.push(index);
        variable.reference = reference;
        if variable.kind() == VariableType::Real && variable.role == VariableRole::Input {
            self.real_inputs += 1;
        }
        rules::check_variable(&variable, &mut self.faults);
        self.variables.push(variable);
        reference
    }

    /// Checks the whole table once everything is declared.
    pub(crate) fn finish(mut self) -> Result<Self, Error> {
        put_in_order(&mut self.depends);
        put_in_order(&mut self.initially);
        let mut faults = std::mem::take(&mut self.faults);
        let mut names = HashSet::with_capacity(self.variables.len());
        let twice = self.variables.iter().filter(|it| !names.insert(it.name.as_str()));
        faults.extend(twice.map(|it| format!("{} is declared twice", it.name)));
        rules::check_table(&self, &mut faults);
        if faults.is_empty() {
            return Ok(self);
        }
        let name = &self.info.model_identifier;
        Err(Error::invalid(format!("invalid interface of {name:?}: {}", faults.join("; "))))
    }
}

/// Adds the same dependencies to several unknowns.
fn add(dependencies: &mut Dependencies, unknowns: Vec<usize>, knowns: Vec<usize>) {
    let knowns = Arc::new(knowns);
    for unknown in unknowns {
        match dependencies.entry(unknown) {
            Entry::Vacant(entry) => drop(entry.insert(knowns.clone())),
            Entry::Occupied(entry) => Arc::make_mut(entry.into_mut()).extend_from_slice(&knowns),
        }
    }
}

/// Makes the lists ascending, with each variable once. Neighbours often depend on the same, and share the list then.
fn put_in_order(dependencies: &mut Dependencies) {
    let (mut declared, mut ordered) = (Arc::default(), Arc::default());
    for knowns in dependencies.values_mut() {
        if !Arc::ptr_eq(knowns, &declared) && *knowns != declared {
            let mut list = Vec::clone(knowns);
            // not unstable: they are mostly runs in order already
            list.sort();
            list.dedup();
            (declared, ordered) = (knowns.clone(), Arc::new(list));
        }
        *knowns = ordered.clone();
    }
}
