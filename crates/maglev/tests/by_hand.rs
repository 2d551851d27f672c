//! The library's example, run on a unit: stepping by hand.

#![allow(clippy::unwrap_used, reason = "a test program")]

mod support;

use std::process::Command;

use support::Bench;

/// z = gain·u with u = 1, and y integrates b's input. Inputs are held over a step (the gain jumps
/// between steps), or interpolated between its ends: the gain of 3 counts from the step after 0.5 s.
#[test]
fn analytic_the_example_steps_and_tunes_a_unit() {
    let bench = Bench::new();
    // cargo builds the examples beside this test
    let mut program = std::env::current_exe().unwrap();
    program.pop();
    program.pop();
    program.push("examples/by_hand");
    let output = Command::new(&program).arg(bench.path("unit.fmu")).output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let rows: Vec<Vec<f64>> = text
        .lines()
        .map(|line| line.split(' ').map(|word| word.parse().unwrap()).collect())
        .collect();
    assert_eq!(rows.len(), 10);
    assert_eq!((rows[4][0], rows[4][1]), (0.5, 1.0));
    assert_eq!((rows[5][0], rows[5][1]), (0.6, 3.0));
    // until 0.5 s the integral of 1, exact; printed with 6 decimals
    assert!((rows[4][2] - 0.5).abs() < 1e-6, "{text}");
    // after the jump has passed, 0.3 more per step; the jump's own step lies between 0.1 and 0.3
    let last = rows[9][2] - rows[8][2];
    assert!((last - 0.3).abs() < 2e-6, "{text}");
    let jump = rows[5][2] - rows[4][2];
    assert!((0.1 - 1e-6..=0.3 + 1e-6).contains(&jump), "{text}");
}
