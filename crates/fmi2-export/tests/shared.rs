//! Equal instances share what `declare` makes; instances with other resources do not.

#![allow(clippy::unwrap_used, reason = "a test program")]

use std::fs;
use std::sync::atomic::{AtomicU32, Ordering};

use fmi2_export::testing::TestInstance;
use fmi2_export::{Error, Info, Interface, Model, RealVar, Resources, Step, Values};

static DECLARED: AtomicU32 = AtomicU32::new(0);

/// Shows the number in a file, whether another file is there, and the length of its instance's name.
#[derive(Clone)]
struct Shown {
    number: RealVar,
    extra: RealVar,
    length: RealVar,
    read: [f64; 2],
    name: String,
}

impl Model for Shown {
    type State = ();

    fn declare(resources: &Resources, interface: &mut Interface) -> Result<Self, Error> {
        DECLARED.fetch_add(1, Ordering::Relaxed);
        interface.describe(Info::new("shown", "Shown"));
        let mut output = |name: &str| interface.real(name).output().done();
        let [number, extra, length] = ["number", "extra", "length"].map(&mut output);
        let text = resources.read_to_string("number")?;
        let there = resources.read_if_present("extra")?.is_some();
        let read = [text.parse().map_err(Error::invalid)?, f64::from(u8::from(there))];
        let name = resources.instance_name().to_owned();
        Ok(Self { number, extra, length, read, name })
    }

    fn copied(&self, resources: &Resources) -> Option<Self> {
        Some(Self { name: resources.instance_name().to_owned(), ..self.clone() })
    }

    fn initialise(&mut self, _: &mut Values, _: f64) -> Result<(), Error> {
        Ok(())
    }

    fn outputs(&mut self, (): &(), values: &mut Values, _: f64) -> Result<(), Error> {
        values.set_real(self.number, self.read[0]);
        values.set_real(self.extra, self.read[1]);
        values.set_real(self.length, self.name.len() as f64);
        Ok(())
    }

    fn step(&mut self, (): &mut (), _: &mut Values, _: Step) -> Result<(), Error> {
        // a model that has run is not what further instances begin with
        self.read[0] = -1.0;
        Ok(())
    }
}

#[test]
fn invariant_equal_instances_are_declared_once_and_share_no_changes() {
    let folder = tempfile::tempdir().unwrap();
    let shown = |name: &str| {
        let before = DECLARED.load(Ordering::Relaxed);
        let mut unit = TestInstance::named::<Shown>(folder.path(), name).unwrap();
        // the test instance itself declares once, for the names of the variables
        let declared = DECLARED.load(Ordering::Relaxed) - before - 1;
        unit.initialize(0.0).unwrap();
        let values = ["number", "extra", "length"].map(|name| unit.real(name).unwrap());
        unit.step(0.0, 0.1).unwrap();
        (declared, values)
    };
    fs::write(folder.path().join("number"), "3").unwrap();
    assert_eq!(shown("a"), (1, [3.0, 0.0, 1.0]));
    assert_eq!(shown("long"), (0, [3.0, 0.0, 4.0]));
    // other content, and a file that was missing
    fs::write(folder.path().join("number"), "4").unwrap();
    assert_eq!(shown("a"), (1, [4.0, 0.0, 1.0]));
    fs::write(folder.path().join("extra"), "").unwrap();
    assert_eq!(shown("a"), (1, [4.0, 1.0, 1.0]));
    assert_eq!(shown("ab"), (0, [4.0, 1.0, 2.0]));
    fs::remove_file(folder.path().join("number")).unwrap();
    assert!(TestInstance::instantiate::<Shown>("a", "", folder.path().to_str().unwrap()).is_err());
}
