//! The builder for the declaration of one variable or of a row of variables.

use super::{DeclaredVariable, Interface, TypeAttributes, UnitOfMeasure, VariableRole};
use crate::description::INPUT_DERIVATIVES;
use crate::values::{Boolean, Integer, NO_SLOT, Real, Text, Var, Vars};

pub(crate) mod sealed {
    use super::{Draft, TypeAttributes, Var, Vars};

    /// Properties of a type that a declaration uses.
    pub trait Declarable: Copy {
        const SELF: Self;
        type Value: Clone + std::fmt::Debug;
        fn data(draft: &Draft<Self>, start: Option<Self::Value>) -> TypeAttributes;
    }

    /// A handle that `done` can return.
    pub trait Handle<T> {
        fn new(first: u32, count: u32, slot: u32) -> Self;
    }

    impl<T: Declarable> Handle<T> for Var<T> {
        fn new(first: u32, _: u32, slot: u32) -> Self {
            Self { index: first, slot, of: T::SELF }
        }
    }

    impl<T: Declarable> Handle<T> for Vars<T> {
        fn new(first: u32, count: u32, slot: u32) -> Self {
            Self { first, count, slot, of: T::SELF }
        }
    }
}

impl sealed::Declarable for Real {
    const SELF: Self = Self;
    type Value = f64;
    fn data(draft: &Draft<Self>, start: Option<f64>) -> TypeAttributes {
        let Draft { min, max, nominal, unit, display, .. } = *draft;
        TypeAttributes::Real { start, min, max, nominal, unit, display }
    }
}

impl sealed::Declarable for Integer {
    const SELF: Self = Self;
    type Value = i32;
    fn data(draft: &Draft<Self>, start: Option<i32>) -> TypeAttributes {
        TypeAttributes::Integer { start, min: draft.min, max: draft.max }
    }
}

impl sealed::Declarable for Boolean {
    const SELF: Self = Self;
    type Value = bool;
    fn data(_: &Draft<Self>, start: Option<bool>) -> TypeAttributes {
        TypeAttributes::Boolean { start }
    }
}

impl sealed::Declarable for Text {
    const SELF: Self = Self;
    type Value = String;
    fn data(_: &Draft<Self>, start: Option<String>) -> TypeAttributes {
        TypeAttributes::Text { start }
    }
}

/// A declaration under construction.
#[doc(hidden)]
pub struct Draft<T: sealed::Declarable> {
    name: String,
    /// `None` for a single variable.
    count: Option<usize>,
    role: Option<VariableRole>,
    discrete: bool,
    derivatives: u32,
    interpolated: u32,
    taken: u32,
    description: String,
    start: Option<T::Value>,
    starts: Option<Vec<T::Value>>,
    min: Option<T::Value>,
    max: Option<T::Value>,
    nominal: Option<f64>,
    unit: Option<UnitOfMeasure>,
    display: Option<&'static str>,
}

/// The declaration of one variable or of a row; takes effect when [`Declaration::done`] is called.
///
/// Set the role of the variable first (`input`, `parameter`, `tunable`, `calculated_parameter`,
/// `output`, `local` or `constant`), then everything else.
#[must_use = "a declaration takes effect when `done` is called"]
pub struct Declaration<'i, T: sealed::Declarable, H> {
    interface: &'i mut Interface,
    draft: Draft<T>,
    handle: std::marker::PhantomData<H>,
}

impl<'i, T: sealed::Declarable, H: sealed::Handle<T>> Declaration<'i, T, H> {
    pub(super) fn new(interface: &'i mut Interface, name: String, count: Option<usize>) -> Self {
        let draft = Draft {
            name,
            count,
            role: None,
            discrete: false,
            derivatives: 0,
            interpolated: 0,
            taken: u32::from(INPUT_DERIVATIVES),
            description: String::new(),
            start: None,
            starts: None,
            min: None,
            max: None,
            nominal: None,
            unit: None,
            display: None,
        };
        Self { interface, draft, handle: std::marker::PhantomData }
    }

    fn role(mut self, role: VariableRole, start: Option<T::Value>) -> Self {
        if self.draft.role.is_some() {
            let text = format!("{} is declared with two roles", self.draft.name);
            self.interface.fault(text);
        }
        self.draft.role = Some(role);
        self.draft.start = start;
        self
    }

    /// An input with its start value. Real inputs are continuous unless [`Declaration::discrete`].
    pub fn input(self, start: impl Into<T::Value>) -> Self {
        self.role(VariableRole::Input, Some(start.into()))
    }

    /// A parameter that is fixed after initialization.
    pub fn parameter(self, start: impl Into<T::Value>) -> Self {
        self.role(VariableRole::Parameter, Some(start.into()))
    }

    /// A parameter that may be changed between steps.
    pub fn tunable(self, start: impl Into<T::Value>) -> Self {
        self.role(VariableRole::Tunable, Some(start.into()))
    }

    /// A value that is computed from parameters in initialization mode and then stays constant.
    pub fn calculated_parameter(self) -> Self {
        self.role(VariableRole::CalculatedParameter, None)
    }

    /// An output, calculated by the model.
    pub fn output(self) -> Self {
        self.role(VariableRole::Output, None)
    }

    /// A value for inspection that is not meant to be connected.
    pub fn local(self) -> Self {
        self.role(VariableRole::Local, None)
    }

    /// A number that never changes.
    pub fn constant(self, value: impl Into<T::Value>) -> Self {
        self.role(VariableRole::Constant, Some(value.into()))
    }

    /// The variable changes at communication points only. Inputs, outputs and locals that are not
    /// real are always discrete.
    pub fn discrete(mut self) -> Self {
        self.draft.discrete = true;
        self
    }

    /// Start values element by element, instead of one start value for all.
    pub fn starts(mut self, starts: impl IntoIterator<Item = T::Value>) -> Self {
        self.draft.starts = Some(starts.into_iter().collect());
        self
    }

    /// One sentence that describes the variable, with sign and frame. In a row, `{k}` becomes the
    /// number.
    pub fn description(mut self, text: impl Into<String>) -> Self {
        self.draft.description = text.into();
        self
    }

    /// Ends the declaration and returns the handle.
    pub fn done(self) -> H {
        let Self { interface, draft, .. } = self;
        let count = draft.count.unwrap_or(1);
        let role = draft.role.unwrap_or_else(|| {
            interface.fault(format!(
                "{} needs one of input, output, parameter, tunable, calculated_parameter, local \
                 and constant",
                draft.name
            ));
            VariableRole::Local
        });
        if let Some(starts) = &draft.starts
            && (starts.len() != count || draft.start.is_none())
        {
            let text =
                format!("{}: {} start values for {count} variables", draft.name, starts.len());
            interface.fault(text);
        }
        let kind = T::data(&draft, None);
        let first = match kind {
            TypeAttributes::Real { .. } => interface.by_type.reals.len(),
            TypeAttributes::Integer { .. } => interface.by_type.integers.len(),
            TypeAttributes::Boolean { .. } => interface.by_type.booleans.len(),
            TypeAttributes::Text { .. } => interface.by_type.strings.len(),
        };
        let is_real_input =
            matches!(kind, TypeAttributes::Real { .. }) && role == VariableRole::Input;
        let slot = if is_real_input { interface.real_inputs } else { NO_SLOT };
        interface.variables.reserve(count);
        let description: Vec<&str> = match draft.count {
            None => vec![&draft.description],
            Some(_) => draft.description.split("{k}").collect(),
        };
        for k in 0..count {
            interface.push(element(&draft, role, k, &description));
        }
        H::new(first as u32, count as u32, slot)
    }
}

/// The `k`-th variable (from zero) of a declaration, with its number between the pieces of the description.
fn element<T: sealed::Declarable>(
    draft: &Draft<T>,
    role: VariableRole,
    k: usize,
    description: &[&str],
) -> DeclaredVariable {
    let (name, description) = match draft.count {
        None => (draft.name.clone(), draft.description.clone()),
        Some(count) => {
            let digits = (count.max(1).ilog10() as usize + 1).max(2);
            let number = (k + 1).to_string();
            let zeros = "0".repeat(digits.saturating_sub(number.len()));
            ([&draft.name, "_", &zeros, &number].concat(), description.join(&number))
        }
    };
    let own = draft.starts.as_ref().and_then(|starts| starts.get(k).cloned());
    let data = T::data(draft, own.or_else(|| draft.start.clone()));
    let continuous = matches!(data, TypeAttributes::Real { .. });
    DeclaredVariable {
        name,
        description,
        role,
        discrete: draft.discrete || !continuous,
        reference: 0,
        derivatives: draft.derivatives,
        interpolated: draft.interpolated,
        taken: draft.taken,
        data,
    }
}

impl<H> Declaration<'_, Real, H> {
    /// The unit of measure.
    pub fn unit(mut self, unit: UnitOfMeasure) -> Self {
        self.draft.unit = Some(unit);
        self
    }

    /// The unit for displaying values: one of the display units of the unit of measure.
    pub fn display(mut self, name: &'static str) -> Self {
        self.draft.display = Some(name);
        self
    }

    /// Highest order of [`Model::output_derivative`](crate::Model::output_derivative) for this
    /// output; default 0.
    pub fn derivatives(mut self, order: u32) -> Self {
        self.draft.derivatives = order;
        self
    }

    /// Highest order of [`Model::output_derivative`](crate::Model::output_derivative) for this
    /// output if the importer interpolates it between both ends of a step and asks for more than
    /// [`derivatives`](Self::derivatives), because what they cost is not worth it for extrapolation.
    pub fn interpolated(mut self, order: u32) -> Self {
        self.draft.interpolated = order;
        self
    }

    /// Highest order of derivatives that this input takes, 3 to 5; default 3. The model must use
    /// [`Values::further`](crate::Values::further) then.
    pub fn takes(mut self, order: u32) -> Self {
        self.draft.taken = order;
        self
    }

    /// The nominal value, greater than 0; scales finite differences and tolerances.
    pub fn nominal(mut self, nominal: f64) -> Self {
        self.draft.nominal = Some(nominal);
        self
    }

    /// Smallest value. Setting a parameter below it is an error.
    pub fn min(mut self, min: f64) -> Self {
        self.draft.min = Some(min);
        self
    }

    /// Largest value. Setting a parameter above it is an error.
    pub fn max(mut self, max: f64) -> Self {
        self.draft.max = Some(max);
        self
    }
}

impl<H> Declaration<'_, Integer, H> {
    /// Smallest value. Setting a parameter below it is an error.
    pub fn min(mut self, min: i32) -> Self {
        self.draft.min = Some(min);
        self
    }

    /// Largest value. Setting a parameter above it is an error.
    pub fn max(mut self, max: i32) -> Self {
        self.draft.max = Some(max);
        self
    }
}
