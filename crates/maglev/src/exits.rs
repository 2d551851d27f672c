//! Replacements for the C library's functions that end a process at once. A unit that calls them would
//! end the run with any exit status, and 0 would look like success. The dynamic linker resolves a
//! unit's symbols in the program before the C library, so units call these functions.
//!
//! `exit` and `quick_exit` call registered functions, which report it ([`fmi2_import::witness`]). Only a
//! [worker](fmi2_import::isolate) protects against a unit that makes the system call itself.

use std::ffi::c_int;

/// Ends the process.
#[unsafe(no_mangle)]
extern "C" fn _exit(status: c_int) -> ! {
    fmi2_import::witness::exit_at_once(status)
}

/// The C99 name of `_exit`.
#[unsafe(no_mangle)]
extern "C" fn _Exit(status: c_int) -> ! {
    fmi2_import::witness::exit_at_once(status)
}
