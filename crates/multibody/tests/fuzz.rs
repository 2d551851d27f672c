//! Vehicle files damaged at random: whatever stands in a file, reading it ends with a vehicle that
//! can be stepped, or with a typed error that names a place in this file.
#![allow(clippy::unwrap_used, clippy::panic)] // helpers outside the test functions

use multibody::{Error, LoadCourse, VehicleModel, train};
use serde_json::{Value, json};

/// What the files are made from.
const SEED: &str = include_str!("corpus/everything.json");

/// SplitMix64: the same damage on each run.
struct Dice(u64);

impl Dice {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() % n.max(1) as u64) as usize
    }

    fn number(&mut self) -> Value {
        const STRANGE: [f64; 14] = [
            0.0,
            -0.0,
            1.0,
            -1.0,
            5e-324,
            1e-300,
            1e-12,
            1e12,
            1e150,
            1e300,
            -1e300,
            f64::MAX,
            0.5,
            3.0,
        ];
        match self.below(4) {
            0 => json!(self.next() as i64),
            1 => json!((self.next() as f64 / u64::MAX as f64 - 0.5) * 4.0),
            // any bit pattern; infinities and NaN become null
            2 => json!(f64::from_bits(self.next())),
            _ => json!(STRANGE[self.below(STRANGE.len())]),
        }
    }

    fn value(&mut self) -> Value {
        const WORDS: [&str; 12] = [
            "",
            "ground",
            "sledge",
            "ball",
            "arm",
            "slide",
            "socket",
            "bracket",
            "revolute",
            "spherical",
            "translational",
            "ß\u{0}\u{202e}",
        ];
        match self.below(8) {
            0 => Value::Null,
            1 => json!(self.below(2) == 0),
            2 => json!([]),
            3 => json!({}),
            4 => json!([self.number(), self.number(), self.number()]),
            5 | 6 => json!(WORDS[self.below(WORDS.len())]),
            _ => self.number(),
        }
    }
}

/// All places in a value, as JSON pointers.
fn places(value: &Value, here: &str, found: &mut Vec<String>) {
    found.push(here.to_owned());
    match value {
        Value::Array(items) => {
            for (k, item) in items.iter().enumerate() {
                places(item, &format!("{here}/{k}"), found);
            }
        }
        Value::Object(fields) => {
            for (key, item) in fields {
                places(item, &format!("{here}/{key}"), found);
            }
        }
        _ => {}
    }
}

/// Changes one place in the tree.
fn damage(value: &mut Value, dice: &mut Dice) {
    let mut found = Vec::new();
    places(value, "", &mut found);
    let other = value.pointer(&found[dice.below(found.len())]).unwrap().clone();
    let Some(place) = value.pointer_mut(&found[dice.below(found.len())]) else { return };
    match (dice.below(8), &mut *place) {
        (0, Value::Array(items)) if !items.is_empty() => {
            items.remove(dice.below(items.len()));
        }
        (1, Value::Array(items)) if !items.is_empty() => {
            let again = items[dice.below(items.len())].clone();
            items.insert(dice.below(items.len() + 1), again);
        }
        (2, Value::Array(items)) if items.len() > 1 => {
            let (i, k) = (dice.below(items.len()), dice.below(items.len()));
            items.swap(i, k);
        }
        (0 | 1, Value::Object(fields)) if !fields.is_empty() => {
            let key = fields.keys().nth(dice.below(fields.len())).unwrap().clone();
            fields.remove(&key);
        }
        (2, Value::Object(fields)) => {
            fields.insert("colour".to_owned(), other);
        }
        // most often a number by a number, which comes furthest
        (_, Value::Number(_)) if dice.below(8) > 0 => *place = dice.number(),
        (3, _) => *place = other,
        _ => *place = dice.value(),
    }
}

/// A damaged file: its tree changed, or its bytes.
fn file(dice: &mut Dice, seeds: &[Value]) -> String {
    let mut value = seeds[dice.below(seeds.len())].clone();
    for _ in 0..=dice.below(3) {
        damage(&mut value, dice);
    }
    let mut text = value.to_string().into_bytes();
    if dice.below(4) == 0 {
        const BYTES: &[u8] = b"0123456789-+.eE[]{},:\"ntu\\ \xef";
        for _ in 0..=dice.below(3) {
            let at = dice.below(text.len());
            match dice.below(4) {
                0 => text.truncate(at),
                1 => text.insert(at, BYTES[dice.below(BYTES.len())]),
                2 if !text.is_empty() => {
                    text.remove(at);
                }
                _ if !text.is_empty() => text[at] = BYTES[dice.below(BYTES.len())],
                _ => {}
            }
        }
    }
    String::from_utf8_lossy(&text).into_owned()
}

/// Whether a path such as `bodies[3].mass` leads to a place in the file. The last key may be missing.
fn leads_somewhere(path: &str, value: &Value) -> bool {
    if path == "$" {
        return true;
    }
    let mut here = value;
    let keys: Vec<&str> = path.split(['.', '[', ']']).filter(|key| !key.is_empty()).collect();
    for (n, key) in keys.iter().enumerate() {
        let next = match here {
            Value::Array(items) => key.parse::<usize>().ok().and_then(|k| items.get(k)),
            Value::Object(fields) => fields.get(*key),
            _ => None,
        };
        match next {
            Some(next) => here = next,
            None => return n + 1 == keys.len(),
        }
    }
    true
}

/// What became of a file.
#[derive(Debug, Default)]
struct Tally {
    unreadable: usize,
    invalid: usize,
    redundant: usize,
    stepped: usize,
    stopped: usize,
}

fn try_file(text: &str, tally: &mut Tally) {
    let model = match VehicleModel::from_json(text) {
        Ok(model) => model,
        Err(error) => {
            let said = error.to_string();
            match error {
                Error::Read { path, message } => {
                    tally.unreadable += 1;
                    assert!(!path.is_empty() && !message.is_empty(), "{said}\n{text}");
                }
                Error::Invalid { path, message } => {
                    tally.invalid += 1;
                    let value: Value = serde_json::from_str(text).unwrap();
                    assert!(leads_somewhere(&path, &value), "{said}\n{text}");
                    assert!(!message.is_empty(), "{said}\n{text}");
                }
                Error::Redundant(found) => {
                    tally.redundant += 1;
                    for one in found {
                        assert!(text.contains(&one.joint) || text.contains('\\'), "{said}\n{text}");
                    }
                }
                _ => panic!("no error of a file: {said}\n{text}"),
            }
            return;
        }
    };
    let mut ws = model.workspace();
    let mut state = model.initial_state();
    let none = vec![[0.0; 4]; model.counts().magnets];
    let course = LoadCourse { vertical: &none, lateral: &none };
    match model.step(&mut state, 1e-3, 1e-3, &course, &mut ws) {
        Ok(()) => {
            tally.stepped += 1;
            let finite = state.bodies.iter().all(|b| {
                b.position.iter().chain(b.velocity.iter()).all(|x| x.is_finite())
                    && b.angular_velocity.iter().chain(b.attitude.iter()).all(|x| x.is_finite())
            });
            assert!(finite, "not finite after a step: {text}");
        }
        Err(error) => {
            tally.stopped += 1;
            assert!(!error.to_string().is_empty());
        }
    }
}

fn fuzz(executions: usize, start: u64) -> Tally {
    let small = serde_json::to_value(train::one_magnet()).unwrap();
    let seeds = [serde_json::from_str(SEED).unwrap(), small];
    let mut dice = Dice(start);
    let mut tally = Tally::default();
    for _ in 0..executions {
        let text = file(&mut dice, &seeds);
        let before = dice.0;
        let outcome = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            try_file(&text, &mut tally);
        }));
        assert!(outcome.is_ok(), "dice at {before:#x}; the file:\n{text}");
    }
    tally
}

#[test]
fn invariant_the_seed_is_a_vehicle() {
    let model = VehicleModel::from_json(SEED).unwrap();
    assert_eq!(model.counts().degrees_of_freedom, 5 * 6 - 6 - 5 - 6 - 5 - 3);
    let mut tally = Tally::default();
    try_file(SEED, &mut tally);
    assert_eq!(tally.stepped, 1);
}

#[test]
fn invariant_damaged_files_end_in_a_vehicle_or_a_message() {
    let tally = fuzz(10_000, 1);
    // all ways out were taken
    let Tally { unreadable, invalid, redundant, stepped, stopped } = tally;
    assert!(unreadable.min(invalid).min(redundant).min(stepped).min(stopped) > 0, "{tally:?}");
}

/// `FUZZ_EXECUTIONS=1000000 FUZZ_START=7 cargo test --release -p multibody --test fuzz -- --ignored
/// --nocapture`
#[test]
#[ignore = "takes about a minute"]
fn invariant_a_million_damaged_files() {
    let setting = |name: &str| std::env::var(name).ok().and_then(|text| text.parse::<u64>().ok());
    let executions = setting("FUZZ_EXECUTIONS").unwrap_or(1_000_000);
    let tally = fuzz(executions as usize, setting("FUZZ_START").unwrap_or(2));
    println!("{executions} files: {tally:?}");
}
