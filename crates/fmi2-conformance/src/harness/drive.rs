//! Ordinary runs: initialization, steps with moving inputs, reading all variables.

use std::ffi::CString;

use fmi2_sys::{fmi2Status as Status, fmi2Type};
use serde::{Deserialize, Serialize};

use super::bench::{Bench, RealInput};
use super::raw::{Making, Raw, ok};
use super::{Stop, fault};
use fmi2_import::description::{Causality, Type};
use fmi2_import::per_type::CType;

/// Values of variables, bit for bit.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct ReadValues {
    /// Bits of the Reals: a NaN equals itself, and 0 differs from -0.
    reals: Vec<u64>,
    integers: Vec<i32>,
    booleans: Vec<i32>,
    strings: Vec<Option<Vec<u8>>>,
}

impl ReadValues {
    /// The Reals as numbers.
    pub(crate) fn numbers(&self) -> Vec<f64> {
        self.reals.iter().map(|bits| f64::from_bits(*bits)).collect()
    }

    pub(crate) fn booleans(&self) -> &[i32] {
        &self.booleans
    }

    /// The first difference to other values of the same list, in words.
    pub(crate) fn differs(&self, other: &Self, bench: &Bench, of: &ReadList) -> Option<String> {
        let name = |kind, reference| {
            bench.description().name_of(kind, reference).unwrap_or("?").to_owned()
        };
        let reals = self.reals.iter().zip(&other.reals).zip(&of.reals);
        if let Some(((a, b), &reference)) = reals.into_iter().find(|((a, b), _)| a != b) {
            let (a, b) = (f64::from_bits(*a), f64::from_bits(*b));
            return Some(format!("{} is {a:?} instead of {b:?}", name(CType::Real, reference)));
        }
        let integers = self.integers.iter().zip(&other.integers).zip(&of.integers);
        let booleans = self.booleans.iter().zip(&other.booleans).zip(&of.booleans);
        let pairs =
            integers.map(|it| (CType::Integer, it)).chain(booleans.map(|it| (CType::Boolean, it)));
        for (kind, ((a, b), &reference)) in pairs {
            if a != b {
                return Some(format!("{} is {a} instead of {b}", name(kind, reference)));
            }
        }
        let strings = self.strings.iter().zip(&other.strings).zip(&of.strings);
        strings
            .into_iter()
            .find(|((a, b), _)| a != b)
            .map(|(_, &reference)| format!("{} has another text", name(CType::String, reference)))
    }
}

/// Value references to read, by type.
#[derive(Debug, Clone, Default)]
pub(crate) struct ReadList {
    pub(crate) reals: Vec<u32>,
    pub(crate) integers: Vec<u32>,
    pub(crate) booleans: Vec<u32>,
    pub(crate) strings: Vec<u32>,
}

impl ReadList {
    fn of(
        bench: &Bench,
        test: impl Fn(&fmi2_import::description::Variable) -> bool + Copy,
    ) -> Self {
        Self {
            reals: bench.references(Type::Real, test),
            integers: bench.references(Type::Integer, test),
            booleans: bench.references(Type::Boolean, test),
            strings: bench.references(Type::String, test),
        }
    }

    /// All variables.
    pub(crate) fn all(bench: &Bench) -> Self {
        Self::of(bench, |_| true)
    }

    /// The outputs, which can be read in initialization mode too.
    pub(crate) fn outputs(bench: &Bench) -> Self {
        Self::of(bench, |variable| variable.causality == Causality::Output)
    }
}

/// Value of an input at a communication point. Each input moves a little, in a pattern of its own.
pub(crate) fn moved(input: &RealInput, index: usize, step: usize) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "0 to 4")]
    let pattern = ((step * 7 + index * 3) % 5) as f64;
    input.start + input.small * pattern / 4.0
}

impl Bench {
    /// Correct arguments of `fmi2Instantiate`.
    pub(crate) fn making(&self, name: &str) -> Making {
        Making {
            name: CString::new(name).ok(),
            guid: CString::new(self.description().guid.as_str()).ok(),
            location: CString::new(self.package().resource_location()).ok(),
            kind: fmi2Type::fmi2CoSimulation,
            logging: false,
        }
    }

    /// A new instance.
    pub(crate) fn instance(&self, name: &str) -> Result<Raw<'_>, Stop> {
        Raw::make(self, &self.making(name)).map_err(|records| {
            let said: Vec<String> = records.into_iter().map(|record| record.text).collect();
            Stop::Fault(format!("fmi2Instantiate returned null; messages: {said:?}"))
        })
    }

    /// A new instance, ready to step.
    pub(crate) fn initialized(&self, name: &str) -> Result<Raw<'_>, Stop> {
        let unit = self.instance(name)?;
        unit.initialize()?;
        Ok(unit)
    }
}

impl Raw<'_> {
    pub(crate) fn setup_default(&self) -> Status {
        self.setup(self.bench().start(), None)
    }

    /// From instantiated to step mode.
    pub(crate) fn initialize(&self) -> Result<(), Stop> {
        ok(self.setup_default(), "fmi2SetupExperiment")?;
        ok(self.enter_initialization(), "fmi2EnterInitializationMode")?;
        ok(self.exit_initialization(), "fmi2ExitInitializationMode")
    }

    /// Sets the Real inputs for a communication point.
    pub(crate) fn move_inputs(&self, inputs: &[RealInput], step: usize) -> Result<(), Stop> {
        if inputs.is_empty() {
            return Ok(());
        }
        let references: Vec<u32> = inputs.iter().map(|input| input.reference).collect();
        let values: Vec<f64> =
            inputs.iter().enumerate().map(|(index, input)| moved(input, index, step)).collect();
        ok(self.set_real(&references, &values), "fmi2SetReal of inputs")
    }

    /// Steps from communication points `from` to `to` with moving inputs.
    pub(crate) fn run(&self, from: usize, to: usize) -> Result<(), Stop> {
        let bench = self.bench();
        let inputs = bench.inputs();
        for step in from..to {
            self.move_inputs(&inputs, step)?;
            ok(self.do_step(bench.time(step), bench.size(step)), "fmi2DoStep")?;
        }
        Ok(())
    }

    /// Steps as [`Raw::run`] does, and reads all variables after each step.
    pub(crate) fn record(&self, from: usize, to: usize) -> Result<Vec<ReadValues>, Stop> {
        let all = ReadList::all(self.bench());
        (from..to)
            .map(|step| {
                self.run(step, step + 1)?;
                self.read(&all)
            })
            .collect()
    }

    /// Reads the variables of a list.
    pub(crate) fn read(&self, of: &ReadList) -> Result<ReadValues, Stop> {
        let mut reals = vec![0.0; of.reals.len()];
        let mut integers = vec![0; of.integers.len()];
        let mut booleans = vec![0; of.booleans.len()];
        let mut strings = Vec::new();
        if !reals.is_empty() {
            ok(self.get_real(&of.reals, &mut reals), "fmi2GetReal")?;
        }
        if !integers.is_empty() {
            ok(self.get_integer(&of.integers, &mut integers), "fmi2GetInteger")?;
        }
        if !booleans.is_empty() {
            ok(self.get_boolean(&of.booleans, &mut booleans), "fmi2GetBoolean")?;
        }
        if !of.strings.is_empty() {
            let (status, texts) = self.get_string(&of.strings);
            ok(status, "fmi2GetString")?;
            strings = texts;
        }
        let reals = reals.into_iter().map(f64::to_bits).collect();
        Ok(ReadValues { reals, integers, booleans, strings })
    }
}

/// Ends the check with a finding if two records differ.
pub(crate) fn same(
    bench: &Bench,
    got: &[ReadValues],
    wanted: &[ReadValues],
    what: &str,
) -> Result<(), Stop> {
    let all = ReadList::all(bench);
    for (step, (a, b)) in got.iter().zip(wanted).enumerate() {
        if let Some(text) = a.differs(b, bench, &all) {
            return fault(format!("{what}: after step {} {text}", step + 1));
        }
    }
    Ok(())
}

/// A C string. A text with a zero byte becomes empty; XML cannot contain one.
pub(crate) fn c_string(text: &str) -> CString {
    CString::new(text).unwrap_or_default()
}
