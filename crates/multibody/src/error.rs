//! Errors of the description, of the assembly and of the simulation.

use std::fmt::Display;

use thiserror::Error;

use crate::index::MagnetIndex;

/// An error of this crate.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum Error {
    /// The description is not readable as JSON of the expected shape.
    #[error("vehicle description, at `{path}`: {message}")]
    Read {
        /// JSON path of the place, for example `bodies[3].mass`.
        path: String,
        /// The reader's message with line and column.
        message: String,
    },
    /// The description is readable but invalid.
    #[error("vehicle description, at `{path}`: {message}")]
    Invalid {
        /// JSON path of the place.
        path: String,
        /// What is wrong and how to fix it.
        message: String,
    },
    /// Some constraint equations follow from the others.
    #[error(
        "{} constraint equation(s) are redundant; replace a joint by a softer one or by a bushing: {}",
        .0.len(),
        .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ")
    )]
    Redundant(Vec<Redundancy>),
    /// The mechanism passed through a position in which its constraints become dependent.
    #[error(
        "the constraints become dependent at t = {time} s: joint `{joint}` has no pivot left in \
         equation {row}: the parts have been driven to a position in which the joints lock or come apart; \
         if this comes during the run, forces are too large for the stiffnesses of the vehicle file, or \
         internal steps (max_step) too long for them"
    )]
    Singular {
        /// Simulated time in s.
        time: f64,
        /// The joint (or body) whose pivot vanished.
        joint: String,
        /// The joint's equation, counted from 0.
        row: usize,
    },
    /// Something about the line that the vehicle travels along.
    #[error("vehicle on a line: {0}")]
    Line(String),
    /// A point of the vehicle has left its line.
    #[error(
        "at t = {time} s: {cause}; the curve is too tight for the vehicle, or the vehicle has left it"
    )]
    OffLine {
        /// Simulated time in s.
        time: f64,
        /// What was not found.
        cause: track_line::Error,
    },
    /// The search for an equilibrium ended with a magnet where the law of its lateral guidance has ended.
    #[error(
        "no equilibrium: it would leave magnet {} {:.1} mm {} of its rail, where its lateral guidance has \
         ended; the curve is too tight for the vehicle, or the force from the side too large",
        .magnet.0 + 1,
        1e3 * .offset.abs(),
        if *.offset > 0.0 { "to the left" } else { "to the right" },
    )]
    Unguided {
        /// The magnet.
        magnet: MagnetIndex,
        /// Its lateral offset, m.
        offset: f64,
    },
    /// Something about the vehicle's linear motors.
    #[error("motors: {0}")]
    Motors(String),
    /// A motor cannot work as the vehicle holds it.
    #[error("motor {number} at t = {time} s: {cause}")]
    Motor {
        /// Simulated time in s.
        time: f64,
        /// The motor, counted from 1.
        number: usize,
        /// What is wrong.
        cause: linear_motor::Error,
    },
    /// A value is not finite.
    #[error("{what} is not finite at t = {time} s")]
    NotFinite {
        /// The quantity.
        what: String,
        /// Simulated time in s.
        time: f64,
    },
    /// The projection on the constraints did not converge.
    #[error(
        "the joints cannot be closed at t = {time} s: joint `{joint}` stays open by {residual:e} \
         (m, rad or their rates) after {iterations} corrections; take a smaller internal step"
    )]
    Projection {
        /// Simulated time in s.
        time: f64,
        /// The joint with the largest violation.
        joint: String,
        /// Largest violation of a constraint equation (m, rad or per second).
        residual: f64,
        /// Corrections tried.
        iterations: usize,
    },
    /// No static equilibrium was found.
    #[error(
        "no static equilibrium after {iterations} iterations: the largest acceleration left is \
         {acceleration:e} {}, {component} of `{body}` (unbalanced by {unbalanced:e} {}), and the magnets \
         are off their gap by {deviation:e} m; every body must be held by magnets, springs or joints, \
         and magnet-carrying bodies that are tied rigidly to each other must be able to follow the \
         track{}",
        if component.contains("about") { "rad/s²" } else { "m/s²" },
        if component.contains("about") { "N·m" } else { "N" },
        if *guided { "" } else {
            "; nothing holds the vehicle sideways: without lateral guidance, a vehicle with different \
             loads on the left and on the right has no stable position"
        },
    )]
    Equilibrium {
        /// Iterations done.
        iterations: usize,
        /// The body with the largest acceleration component left; one of those that brackets tie together.
        body: String,
        /// Which component, for example `along y` or `about x`: world axes along, body axes about.
        component: &'static str,
        /// The largest acceleration component left, m/s² or rad/s².
        acceleration: f64,
        /// Force or moment that it takes, N or N·m.
        unbalanced: f64,
        /// Whether a law of guidance holds the magnets sideways.
        guided: bool,
        /// Largest fitted deviation of a magnet from its place, in m.
        deviation: f64,
    },
    /// While the equilibrium was sought, a body left its place.
    #[error(
        "no static equilibrium: `{body}` leaves its place, by {moved:.2} {}, {component}, while it is \
         sought; springs and joints do not hold it there, or are too soft for its mass and load: check the \
         stiffnesses (air springs, anti-roll ends, bushes), the masses and the place of the load, and that \
         every bogie has magnets enough to hold it",
        if component.contains("about") { "rad" } else { "m" },
    )]
    Unheld {
        /// The body.
        body: String,
        /// Which component of its motion: world axes along, body axes about.
        component: &'static str,
        /// How far it went before the search ended, m or rad.
        moved: f64,
    },
    /// No static equilibrium on the skids was found.
    #[error(
        "no static equilibrium on the skids after {iterations} iterations: the largest acceleration left \
         is {acceleration:e} {}, {component} of `{body}`; every body must be held by skids, springs or \
         joints, and nothing but the drive may have to hold the vehicle along the track or sideways: \
         friction does not hold a body at rest",
        if component.contains("about") { "rad/s²" } else { "m/s²" },
    )]
    Landing {
        /// Iterations done.
        iterations: usize,
        /// The body with the largest acceleration component left.
        body: String,
        /// Which component, for example `along y` or `about x`: world axes along, body axes about.
        component: &'static str,
        /// The largest acceleration component left, m/s² or rad/s².
        acceleration: f64,
    },
    /// The eigenvalue problem of a linearisation has no answer.
    #[error(
        "{}",
        .eigenvalue.map_or_else(
            || "the eigenvalues of the linearised equations could not be found".to_owned(),
            |(re, im)| format!("there is no mode shape for the eigenvalue {re} {im:+}i 1/s"),
        )
    )]
    Eigenvalues {
        /// The eigenvalue (real and imaginary part, 1/s) whose shape was asked for.
        eigenvalue: Option<(f64, f64)>,
    },
    /// An argument has the wrong length or value.
    #[error("{what}: expected {expected}, got {found}")]
    Argument {
        /// The argument.
        what: &'static str,
        /// What is needed.
        expected: String,
        /// What was given.
        found: String,
    },
}

/// One dependence among the constraint equations: a state of self-stress.
#[derive(Debug, Clone, PartialEq)]
pub struct Redundancy {
    /// The joint that is reported: the last one that is not independent.
    pub joint: String,
    /// The direction that this joint constrains a second time, for example `translation along
    /// (0.00, 1.00, 0.00)`.
    pub direction: String,
    /// The other joints that carry force in the self-stress.
    pub together_with: Vec<String>,
}

impl Display for Redundancy {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "joint `{}`: {}", self.joint, self.direction)?;
        if !self.together_with.is_empty() {
            write!(f, " is already fixed by {}", self.together_with.join(", "))?;
        }
        Ok(())
    }
}

/// An [`Error::Invalid`].
pub(crate) fn invalid(path: impl Display, message: impl Into<String>) -> Error {
    Error::Invalid { path: path.to_string(), message: message.into() }
}

impl Error {
    /// The error with the name of the quantity whose value caused it.
    pub(crate) fn caused_by(self, quantity: &str) -> Self {
        match self {
            Self::Invalid { path, message } => {
                Self::Invalid { path, message: format!("{quantity}: {message}") }
            }
            other => other,
        }
    }
}
