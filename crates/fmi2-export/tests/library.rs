//! The example as a shared library, loaded as an importer does.
//!
//! Needs `examples/dahlquist.rs` built, which `cargo test` does unless told to build one test only.

#![allow(clippy::unwrap_used, reason = "a test program")]

use core::ffi::c_char;
use std::ffi::{CStr, CString};
use std::path::PathBuf;
use std::ptr::null_mut;

use fmi2_export::sys::*;
use libloading::Library;

/// `target/<profile>/examples/` beside `target/<profile>/deps/`, where this program is.
fn library() -> PathBuf {
    let name = format!("{}dahlquist{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    let program = std::env::current_exe().unwrap();
    let path = program.parent().unwrap().parent().unwrap().join("examples").join(name);
    assert!(path.is_file(), "{} is missing: run `cargo build --examples`", path.display());
    path
}

type Describe = unsafe extern "C" fn(*const c_char, *mut c_char, usize) -> usize;

fn describe(library: &Library) -> String {
    // SAFETY: the symbol has this type; the arrays have the lengths stated.
    unsafe {
        let describe = library.get::<Describe>(b"fmi2_export_describe\0").unwrap();
        let length = describe(c"none".as_ptr(), null_mut(), 0);
        let mut buffer = vec![0_u8; length];
        assert_eq!(describe(c"none".as_ptr(), buffer.as_mut_ptr().cast(), length), length);
        String::from_utf8(buffer).unwrap()
    }
}

#[test]
fn golden_the_readme_shows_the_example_which_is_short() {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    let example = std::fs::read_to_string(folder.join("examples/dahlquist.rs")).unwrap();
    let code: String = example
        .lines()
        .skip_while(|line| !line.starts_with("use "))
        .fold(String::new(), |code, line| code + line + "\n");
    assert!(code.contains("impl Model for Dahlquist") && code.lines().count() < 60);
    let readme = std::fs::read_to_string(folder.join("README.md")).unwrap();
    assert!(readme.contains(&format!("```rust\n{code}```")), "the README shows another example");
}

#[test]
fn golden_all_34_functions_are_there() {
    // SAFETY: our own library, without initialisers.
    let library = unsafe { Library::new(library()) }.unwrap();
    let names = "GetTypesPlatform GetVersion SetDebugLogging Instantiate FreeInstance \
        SetupExperiment EnterInitializationMode ExitInitializationMode Terminate Reset GetReal \
        GetInteger GetBoolean GetString SetReal SetInteger SetBoolean SetString GetFMUstate \
        SetFMUstate FreeFMUstate SerializedFMUstateSize SerializeFMUstate DeSerializeFMUstate \
        GetDirectionalDerivative SetRealInputDerivatives GetRealOutputDerivatives DoStep \
        CancelStep GetStatus GetRealStatus GetIntegerStatus GetBooleanStatus GetStringStatus";
    let names: Vec<_> = names.split_whitespace().collect();
    assert_eq!(names.len(), 34);
    for name in names {
        let symbol = format!("fmi2{name}\0");
        // SAFETY: only looked up.
        assert!(unsafe { library.get::<fn()>(symbol.as_bytes()) }.is_ok(), "{symbol}");
    }
}

/// ẋ = −k·(x − u) with u = 1 + 2t from x(0) = 3: x = u − 2/k + (2 + 2/k)·e^(−kt).
#[test]
fn analytic_the_loaded_example_steps_exactly() {
    // SAFETY: our own library, without initialisers.
    let library = unsafe { Library::new(library()) }.unwrap();
    let xml = describe(&library);
    let document = roxmltree::Document::parse(&xml).unwrap();
    let guid = CString::new(document.root_element().attribute("guid").unwrap()).unwrap();
    let callbacks = fmi2CallbackFunctions {
        logger: None,
        allocateMemory: None,
        freeMemory: None,
        stepFinished: None,
        componentEnvironment: null_mut(),
    };
    macro_rules! call {
        ($name:literal $type:ident ($($argument:expr),*)) => {{
            let symbol = library.get::<$type>(concat!("fmi2", $name, "\0").as_bytes()).unwrap();
            (*symbol).unwrap()($($argument),*)
        }};
    }
    // SAFETY: the symbols have the header's types, everything lives through the calls.
    unsafe {
        assert_eq!(CStr::from_ptr(call!("GetVersion" fmi2GetVersionTYPE ())), c"2.0");
        let c = call!("Instantiate" fmi2InstantiateTYPE (
            c"one".as_ptr(), fmi2Type::fmi2CoSimulation, guid.as_ptr(), std::ptr::null(),
            &raw const callbacks, 0, 0
        ));
        assert!(!c.is_null());
        let k = 1.5;
        call!("SetReal" fmi2SetRealTYPE (c, [0, 1, 2].as_ptr(), 3, [k, 3.0, 1.0].as_ptr()));
        call!("SetupExperiment" fmi2SetupExperimentTYPE (c, 0, 0.0, 0.0, 0, 0.0));
        call!("EnterInitializationMode" fmi2EnterInitializationModeTYPE (c));
        call!("ExitInitializationMode" fmi2ExitInitializationModeTYPE (c));
        let mut x = 0.0;
        for step in 0..16 {
            let t = f64::from(step) * 0.125;
            let slope = call!("SetRealInputDerivatives" fmi2SetRealInputDerivativesTYPE (
                c, [2].as_ptr(), 1, [1].as_ptr(), [2.0].as_ptr()
            ));
            assert_eq!(slope, fmi2Status::fmi2OK);
            let status = call!("DoStep" fmi2DoStepTYPE (c, t, 0.125, 1));
            assert_eq!(status, fmi2Status::fmi2OK);
            call!("GetReal" fmi2GetRealTYPE (c, [3].as_ptr(), 1, &raw mut x));
            let end = t + 0.125;
            let exact = 1.0 + 2.0 * end - 2.0 / k + (2.0 + 2.0 / k) * (-k * end).exp();
            // Exact steps: some ε of numbers up to 5 per step, damped by the equation.
            assert!((x - exact).abs() < 1e-14, "{x} {exact}");
        }
        call!("FreeInstance" fmi2FreeInstanceTYPE (c));
    }
}
