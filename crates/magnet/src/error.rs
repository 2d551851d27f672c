//! Errors of a magnet's parameters, inputs and steps.

/// Why a magnet could not be built, started or stepped.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// A parameter, input or step size is outside the range in which the model is defined.
    #[error("{name} is {value}, but must be {must}")]
    OutOfRange {
        /// Name of the quantity, with its unit.
        name: &'static str,
        /// The value given.
        value: f64,
        /// The condition that it breaks.
        must: &'static str,
    },
    /// A parameter that is defined together with another one only.
    #[error("{name} is {value}, which needs {needs}")]
    Needs {
        /// Name of the parameter, with its unit.
        name: &'static str,
        /// The value given.
        value: f64,
        /// What it needs, and how to get it.
        needs: &'static str,
    },
    /// A combination that the model does not have.
    #[error("the model does not support {what}")]
    Unsupported {
        /// The combination, the reason and the remedy.
        what: &'static str,
    },
    /// The Runge-Kutta step is too long for the fastest rate in the model.
    #[error(
        "the integration step of {step} s is too long for the controller's fastest rate of \
         {rate} 1/s: take at most {longest} s, or lower the filter's cut-off frequencies"
    )]
    CoarseIntegration {
        /// The integration step, in s.
        step: f64,
        /// The fastest rate in the model, in 1/s.
        rate: f64,
        /// The longest step accepted, in s.
        longest: f64,
    },
    /// The Runge-Kutta step is too long for a sensor's noise.
    #[error(
        "{name} is {bandwidth}, which the integration step of {step} s does not resolve: take an \
         integration_step of at most {longest} s or a bandwidth of at most {highest} Hz"
    )]
    CoarseNoise {
        /// Name of the bandwidth, with its unit.
        name: &'static str,
        /// The bandwidth, in Hz.
        bandwidth: f64,
        /// The integration step, in s.
        step: f64,
        /// The longest step accepted with this bandwidth, in s.
        longest: f64,
        /// The highest bandwidth accepted with this step, in Hz.
        highest: f64,
    },
    /// A change of the lift-off or the set-down while stepping, at which the reference would jump.
    #[error(
        "at t = {time} s the {name} cannot change from {} to {}: the reference gap and the voltage \
         would jump; a time can be changed before it is reached only, and not to one that has passed",
        shown(.from), shown(.to)
    )]
    LateChange {
        /// What was changed.
        name: &'static str,
        /// Time so far, in s.
        from: Option<f64>,
        /// New time, in s.
        to: Option<f64>,
        /// Time of the change, in s.
        time: f64,
    },
    /// The magnet touches the rail: the force laws end at a gap of zero, and contact is not part
    /// of this model.
    #[error(
        "at t = {time} s the gap is {gap} m: the magnet has reached the rail, where the force law \
         ends; check the load, the gains and the step size of the coupling"
    )]
    GapClosed {
        /// Time, in s.
        time: f64,
        /// The gap, in m.
        gap: f64,
    },
    /// The magnet is so far aside that its poles no longer overlap those of the rail.
    #[error(
        "at t = {time} s the magnet is {offset} m aside of its rail, and poles of the width {width} m no \
         longer overlap: guidance is lost, and the force law ends; check the lateral load, the curve's \
         radius and the stiffness that holds the magnets in line"
    )]
    GuidanceLost {
        /// Time, in s.
        time: f64,
        /// The offset, in m.
        offset: f64,
        /// Width of a pole, in m.
        width: f64,
    },
    /// The limits switched more often within one step than a smooth input can cause.
    #[error(
        "at t = {time} s the limits on voltage and current switched more than {events} times in \
         one step of {step} s: shorten the step, or widen the limits"
    )]
    Chattering {
        /// Time, in s.
        time: f64,
        /// Step size, in s.
        step: f64,
        /// Number of switches allowed in one step.
        events: usize,
    },
}

fn shown(time: &Option<f64>) -> String {
    time.map_or_else(|| String::from("never"), |time| format!("{time} s"))
}
