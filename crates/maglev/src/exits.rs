//! The C library's functions that end a process without a word. A unit that calls them would end the
//! run with the status of its choice, and 0 would look like success. Functions of the program come
//! before those of the C library when a unit's library is linked at run time, so units find these.
//!
//! `exit` and `quick_exit` call registered functions, which report it ([`fmi2_import::witness`]); a unit
//! that makes the system call itself is stopped by nobody but a [worker](fmi2_import::isolate).

use std::ffi::c_int;

/// Ends the process.
#[unsafe(no_mangle)]
extern "C" fn _exit(status: c_int) -> ! {
    fmi2_import::witness::exit_at_once(status)
}

/// Ends the process: the name of `_exit` in C99.
#[unsafe(no_mangle)]
extern "C" fn _Exit(status: c_int) -> ! {
    fmi2_import::witness::exit_at_once(status)
}
