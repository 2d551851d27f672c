//! Models that wrap something with a state of its own, and units that cannot do everything.

#![allow(clippy::unwrap_used, reason = "a test program")]

use fmi2_export::testing::TestInstance;
use fmi2_export::{Error, Info, Interface, Limits, Model, RealVar, Resources, Step, Values};
use serde::{Deserialize, Serialize};

/// A counter of steps that the model keeps itself; the state only gets it when it is saved.
struct Wrapped {
    count: RealVar,
    stop: RealVar,
    steps: u32,
    ends: Option<f64>,
    messages: Vec<String>,
}

#[derive(Clone, Serialize, Deserialize)]
struct Saved(Option<u32>);

impl Model for Wrapped {
    type State = Saved;

    fn declare(_: &Resources, interface: &mut Interface) -> Result<Self, Error> {
        interface.describe(Info::new("wrapped", "Wrapped"));
        let count = interface.real("count").output().done();
        let stop = interface.real("stop").output().done();
        Ok(Self { count, stop, steps: 0, ends: None, messages: Vec::new() })
    }

    fn experiment(&mut self, _: f64, stop: Option<f64>, _: Option<f64>) {
        self.ends = stop;
    }

    fn initialise(&mut self, _: &mut Values, _: f64) -> Result<Saved, Error> {
        self.steps = 0;
        self.messages.push("begins".to_owned());
        Ok(Saved(None))
    }

    fn outputs(&mut self, _: &Saved, values: &mut Values, _: f64) -> Result<(), Error> {
        values.set_real(self.count, f64::from(self.steps));
        values.set_real(self.stop, self.ends.unwrap_or(-1.0));
        Ok(())
    }

    fn step(&mut self, state: &mut Saved, _: &mut Values, _: Step) -> Result<(), Error> {
        self.steps += 1;
        state.0 = None;
        self.messages.push(format!("step {}", self.steps));
        Ok(())
    }

    fn saving(&mut self, state: &mut Saved) -> Result<(), Error> {
        state.0 = Some(self.steps);
        Ok(())
    }

    fn restored(&mut self, state: &mut Saved, _: &mut Values) -> Result<(), Error> {
        self.steps = state.0.ok_or_else(|| Error::invalid("the saved state is incomplete"))?;
        Ok(())
    }

    fn messages(&mut self) -> Vec<String> {
        std::mem::take(&mut self.messages)
    }
}

fn stepped<M: Model>(steps: u32) -> TestInstance {
    let mut one = TestInstance::new::<M>("").unwrap();
    one.initialize(0.0).unwrap();
    for k in 0..steps {
        one.step(f64::from(k), 1.0).unwrap();
    }
    one
}

#[test]
fn invariant_what_a_model_wraps_is_saved_and_restored() {
    let mut one = stepped::<Wrapped>(3);
    one.save().unwrap();
    one.step(3.0, 1.0).unwrap();
    assert_eq!(one.real("count").unwrap(), 4.0);
    one.restore().unwrap();
    one.step(3.0, 1.0).unwrap();
    assert_eq!(one.real("count").unwrap(), 4.0);
    let bytes = one.serialize().unwrap();
    // a new instance that was never initialised
    let mut other = TestInstance::new::<Wrapped>("").unwrap();
    other.deserialize(&bytes).unwrap();
    other.step(4.0, 1.0).unwrap();
    assert_eq!(other.real("count").unwrap(), 5.0);
}

#[test]
fn issue_messages_of_the_model_reach_the_log_with_events() {
    let mut one = stepped::<Wrapped>(2);
    let texts: Vec<String> = one.messages().into_iter().map(|it| it.text).collect();
    for part in ["begins", "step 1", "step 2"] {
        assert!(texts.iter().any(|it| it == part), "{texts:?}");
    }
    // no stop time was set up
    assert_eq!(one.real("stop").unwrap(), -1.0);
}

/// Counts how often it was initialised, and how often it began.
struct Counted {
    initialised: RealVar,
    begun: RealVar,
    calls: [f64; 2],
}

impl Model for Counted {
    type State = ();

    fn declare(_: &Resources, interface: &mut Interface) -> Result<Self, Error> {
        interface.describe(Info::new("counted", "Counted"));
        interface.real("p").parameter(0.0).done();
        let [initialised, begun] =
            ["initialised", "begun"].map(|name| interface.real(name).output().done());
        Ok(Self { initialised, begun, calls: [0.0; 2] })
    }

    fn initialise(&mut self, _: &mut Values, _: f64) -> Result<(), Error> {
        self.calls[0] += 1.0;
        Ok(())
    }

    fn begins(&mut self, (): &mut ()) -> Result<(), Error> {
        self.calls[1] += 1.0;
        Ok(())
    }

    fn outputs(&mut self, (): &(), values: &mut Values, _: f64) -> Result<(), Error> {
        values.set_real(self.initialised, self.calls[0]);
        values.set_real(self.begun, self.calls[1]);
        Ok(())
    }

    fn step(&mut self, (): &mut (), _: &mut Values, _: Step) -> Result<(), Error> {
        Ok(())
    }
}

#[test]
fn invariant_a_model_begins_once_however_often_it_is_initialised() {
    let mut one = TestInstance::new::<Counted>("").unwrap();
    one.enter_initialization(0.0).unwrap();
    for k in 1..=3 {
        one.set_real("p", f64::from(k)).unwrap();
        assert_eq!(one.real("initialised").unwrap(), f64::from(k));
        assert_eq!(one.real("begun").unwrap(), 0.0);
    }
    one.exit_initialization().unwrap();
    one.step(0.0, 1.0).unwrap();
    assert_eq!(one.real("begun").unwrap(), 1.0);
    assert_eq!(one.real("initialised").unwrap(), 3.0);
}

/// A unit that can do nothing beyond the plain step.
struct Limited;

impl Model for Limited {
    type State = ();

    fn declare(_: &Resources, interface: &mut Interface) -> Result<Self, Error> {
        interface.describe(Info::new("limited", "Limited"));
        let why = Some("the part inside cannot".to_owned());
        interface.limit(Limits {
            variable_step: why.clone(),
            states: why.clone(),
            directional: why.clone(),
            instances: why.clone(),
            alone: why,
        });
        interface.real("u").input(0.0).done();
        interface.real("y").output().done();
        Ok(Self)
    }

    fn initialise(&mut self, _: &mut Values, _: f64) -> Result<(), Error> {
        Ok(())
    }

    fn outputs(&mut self, (): &(), _: &mut Values, _: f64) -> Result<(), Error> {
        Ok(())
    }

    fn step(&mut self, (): &mut (), _: &mut Values, _: Step) -> Result<(), Error> {
        Ok(())
    }
}

#[test]
fn refusal_missing_capabilities_are_declared_and_give_their_reason() {
    let text = fmi2_export::describe::<Limited>(&Resources::new("")).unwrap();
    for attribute in [
        "canHandleVariableCommunicationStepSize=\"false\"",
        "canGetAndSetFMUstate=\"false\"",
        "canSerializeFMUstate=\"false\"",
        "providesDirectionalDerivative=\"false\"",
        "canBeInstantiatedOnlyOncePerProcess=\"true\"",
        "needsExecutionTool=\"true\"",
    ] {
        assert!(text.contains(attribute), "{attribute}: {text}");
    }
    let mut one = stepped::<Limited>(1);
    let refused = one.save().unwrap_err().to_string();
    assert!(refused.contains("cannot save its state: the part inside cannot"), "{refused}");
    let refused = one.derivative("y", "u").unwrap_err().to_string();
    assert!(refused.contains("directional derivatives: the part inside cannot"), "{refused}");
    one.step(1.0, 1.0).unwrap();
}
