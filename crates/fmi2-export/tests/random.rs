//! Random sequences of calls, sensible and not: nothing crashes, every status is one of the six,
//! refused calls change nothing, and a replay gives the same. `RANDOM_CALLS` says how many calls.

#![allow(clippy::unwrap_used, reason = "a test program")]

mod common;

use common::{Everything, NONE};
use fmi2_export::ffi;
use fmi2_export::sys::*;
use fmi2_export::testing::TestInstance;
use proptest::prelude::*;

#[derive(Debug, Clone)]
enum Action {
    Setup(f64, Option<f64>),
    Enter,
    Exit,
    Terminate,
    Reset,
    GetReal(Vec<u32>),
    SetReal(u32, f64),
    SetInteger(u32, i32),
    SetBoolean(u32, i32),
    SetString(u32, String),
    GetString(u32),
    InputDerivative(u32, i32, f64),
    OutputDerivative(u32, i32),
    Directional(u32, u32, f64),
    Step(f64),
    StepFrom(f64, f64),
    Cancel,
    Status(u32),
    Logging(bool),
    Save,
    Restore,
    Free,
    Serialize,
    Deserialize(usize, u8),
}

fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        8 => -10.0..10.0,
        1 => any::<f64>(),
        1 => prop_oneof![Just(f64::NAN), Just(f64::INFINITY), Just(0.0), Just(1e300)],
    ]
}

fn action() -> impl Strategy<Value = Action> {
    let reference = || prop_oneof![9 => 0..16_u32, 1 => any::<u32>()];
    prop_oneof![
        1 => (number(), proptest::option::of(number())).prop_map(|(a, b)| Action::Setup(a, b)),
        4 => Just(Action::Enter),
        4 => Just(Action::Exit),
        1 => Just(Action::Terminate),
        1 => Just(Action::Reset),
        4 => proptest::collection::vec(reference(), 0..4).prop_map(Action::GetReal),
        4 => (reference(), number()).prop_map(|(a, b)| Action::SetReal(a, b)),
        1 => (0..4_u32, -1..10_i32).prop_map(|(a, b)| Action::SetInteger(a, b)),
        1 => (0..4_u32, any::<i32>()).prop_map(|(a, b)| Action::SetBoolean(a, b)),
        1 => (0..4_u32, "[^\0]{0,8}").prop_map(|(a, b)| Action::SetString(a, b)),
        1 => reference().prop_map(Action::GetString),
        2 => (reference(), -1..5_i32, number()).prop_map(|(a, b, c)| Action::InputDerivative(a, b, c)),
        1 => (reference(), -1..4_i32).prop_map(|(a, b)| Action::OutputDerivative(a, b)),
        1 => (reference(), reference(), number()).prop_map(|(a, b, c)| Action::Directional(a, b, c)),
        6 => (0.001..0.3).prop_map(Action::Step),
        1 => (number(), number()).prop_map(|(a, b)| Action::StepFrom(a, b)),
        1 => Just(Action::Cancel),
        1 => any::<u32>().prop_map(Action::Status),
        1 => any::<bool>().prop_map(Action::Logging),
        2 => Just(Action::Save),
        2 => Just(Action::Restore),
        1 => Just(Action::Free),
        1 => Just(Action::Serialize),
        1 => (any::<usize>(), any::<u8>()).prop_map(|(a, b)| Action::Deserialize(a, b)),
    ]
}

/// An importer that keeps time and one saved state.
struct Importer {
    unit: TestInstance,
    saved: fmi2FMUstate,
    bytes: Vec<u8>,
}

impl Importer {
    fn new() -> Self {
        let unit = TestInstance::new::<Everything>(NONE).unwrap();
        Self { unit, saved: std::ptr::null_mut(), bytes: Vec::new() }
    }

    fn time(&self) -> f64 {
        let (mut time, kind) = (0.0, fmi2StatusKind::fmi2LastSuccessfulTime);
        // SAFETY: the component is alive, here and below; all arrays have the lengths stated.
        unsafe { ffi::get_real_status(self.unit.component(), kind, &raw mut time) };
        time
    }

    /// Does it; returns the status and a digest of the numbers that came out.
    fn act(&mut self, action: &Action) -> (fmi2Status, u64) {
        let c = self.unit.component();
        let mut out = [0.0_f64; 4];
        // SAFETY: see above.
        let status = unsafe {
            match action {
                Action::Setup(start, stop) => {
                    let (defined, stop) = (i32::from(stop.is_some()), stop.unwrap_or(0.0));
                    ffi::setup_experiment(c, 0, 0.0, *start, defined, stop)
                }
                Action::Enter => ffi::enter_initialization_mode(c),
                Action::Exit => ffi::exit_initialization_mode(c),
                Action::Terminate => ffi::terminate(c),
                Action::Reset => ffi::reset(c),
                Action::GetReal(vr) => ffi::get_real(c, vr.as_ptr(), vr.len(), out.as_mut_ptr()),
                Action::SetReal(vr, value) => ffi::set_real(c, vr, 1, value),
                Action::SetInteger(vr, value) => ffi::set_integer(c, vr, 1, value),
                Action::SetBoolean(vr, value) => ffi::set_boolean(c, vr, 1, value),
                Action::SetString(vr, text) => {
                    let text = std::ffi::CString::new(text.as_str()).unwrap();
                    ffi::set_string(c, vr, 1, &text.as_ptr())
                }
                Action::GetString(vr) => {
                    let mut text = std::ptr::null();
                    let status = ffi::get_string(c, vr, 1, &raw mut text);
                    if status == fmi2Status::fmi2OK {
                        out[0] = core::ffi::CStr::from_ptr(text).to_bytes().len() as f64;
                    }
                    status
                }
                Action::InputDerivative(vr, order, value) => {
                    ffi::set_real_input_derivatives(c, vr, 1, order, value)
                }
                Action::OutputDerivative(vr, order) => {
                    ffi::get_real_output_derivatives(c, vr, 1, order, out.as_mut_ptr())
                }
                Action::Directional(unknown, known, seed) => {
                    ffi::get_directional_derivative(c, unknown, 1, known, 1, seed, out.as_mut_ptr())
                }
                Action::Step(size) => ffi::do_step(c, self.time(), *size, 0),
                Action::StepFrom(time, size) => ffi::do_step(c, *time, *size, 1),
                Action::Cancel => ffi::cancel_step(c),
                Action::Status(kind) => {
                    ffi::get_real_status(c, fmi2StatusKind(*kind), out.as_mut_ptr())
                }
                Action::Logging(on) => {
                    ffi::set_debug_logging(c, i32::from(*on), 0, std::ptr::null())
                }
                Action::Save => ffi::get_fmu_state(c, &raw mut self.saved),
                Action::Restore => ffi::set_fmu_state(c, self.saved),
                Action::Free => ffi::free_fmu_state(c, &raw mut self.saved),
                Action::Serialize => {
                    let mut size = 0;
                    let status = ffi::serialized_fmu_state_size(c, self.saved, &raw mut size);
                    if status != fmi2Status::fmi2OK {
                        return (status, 0);
                    }
                    self.bytes = vec![0; size];
                    let bytes = self.bytes.as_mut_ptr().cast();
                    ffi::serialize_fmu_state(c, self.saved, bytes, size)
                }
                Action::Deserialize(place, mask) => {
                    let mut bytes = self.bytes.clone();
                    if !bytes.is_empty() {
                        let place = place % bytes.len();
                        bytes[place] ^= mask;
                    }
                    let pointer = bytes.as_ptr().cast();
                    ffi::deserialize_fmu_state(c, pointer, bytes.len(), &raw mut self.saved)
                }
            }
        };
        let digest = out.iter().fold(0, |sum: u64, value| sum.rotate_left(7) ^ value.to_bits());
        (status, digest)
    }

    /// Everything that the instance is, where it may be looked at.
    fn state(&mut self) -> Option<Vec<u8>> {
        self.unit.serialize().ok()
    }
}

impl Drop for Importer {
    fn drop(&mut self) {
        // SAFETY: both come from the unit; freeing is allowed in every mode.
        unsafe { ffi::free_fmu_state(self.unit.component(), &raw mut self.saved) };
    }
}

/// Sequences for `RANDOM_CALLS` calls: 30 on average, on each of two instances.
fn sequences() -> u32 {
    std::env::var("RANDOM_CALLS").map_or(2000, |calls| calls.parse::<u32>().unwrap() / 60)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: sequences(), ..ProptestConfig::default() })]

    #[test]
    fn invariant_any_sequence_of_calls_is_survived_and_repeatable(
        actions in proptest::collection::vec(action(), 1..60),
    ) {
        let (mut one, mut two) = (Importer::new(), Importer::new());
        for action in &actions {
            let before = one.state();
            let (status, digest) = one.act(action);
            prop_assert!(status.0 <= fmi2Status::fmi2Fatal.0);
            let stepping = matches!(action, Action::Step(_) | Action::StepFrom(..));
            // Looking may compute what was pending, and so may a refusal after it.
            let looking = matches!(
                action,
                Action::GetReal(_) | Action::GetString(_) | Action::OutputDerivative(..)
                    | Action::Directional(..) | Action::Exit
            );
            if status == fmi2Status::fmi2Error && !stepping && !looking {
                // A panic makes the state unreadable; everything else leaves it as it was.
                let after = one.state();
                prop_assert!(after.is_none() || after == before, "{action:?}");
            }
            prop_assert_eq!(two.act(action), (status, digest));
            one.unit.messages();
            two.unit.messages();
        }
        prop_assert_eq!(one.state(), two.state());
    }
}
