//! The whole magnet: force, coil, filter and control law.

use crate::{
    Error,
    conditions::Seen,
    control_law::ControlLaw,
    electromagnet::Electromagnet,
    exact::{CoilSystem, Key, LinearMagnet, LinearSystem},
    filter::{ACCELERATION_SCALE, Filter, POSITION_SCALE},
    inputs::{Direct, MagnetInputs},
    lift_loss::{LiftLoss, Place},
    parameters::{Law, MagnetParameters, positive},
    state::{Hold, State},
};

/// One magnet with its controller, ready to step. It never changes.
#[derive(Debug, Clone, PartialEq)]
pub struct Magnet {
    parameters: MagnetParameters,
    electromagnet: Electromagnet,
    filter: Filter,
    control_law: ControlLaw,
    linear: LinearMagnet,
    exact: bool,
    conditioned: bool,
    lift_loss: Option<LiftLoss>,
}

impl Magnet {
    /// Builds a magnet.
    ///
    /// # Errors
    /// The first fault that [`MagnetParameters::check`] finds.
    pub fn new(parameters: MagnetParameters) -> Result<Self, Error> {
        parameters.check()?;
        let electromagnet = Electromagnet::new(&parameters);
        let filter = Filter::new(&parameters.filter);
        let control_law = ControlLaw::new(&parameters.control.gains, &filter);
        let coil = CoilSystem::new(&electromagnet);
        let linear = LinearMagnet {
            system: linearise(&coil, &filter, &control_law),
            coil,
            key: key(&parameters, &electromagnet),
            nominal_gap: electromagnet.nominal_gap,
        };
        let exact = parameters.is_exact();
        let conditioned = !parameters.conditions.none();
        let width = parameters.pole_width.filter(|_| parameters.lift_loss);
        let lift_loss = width.map(|width| LiftLoss::new(electromagnet.constant, width));
        Ok(Self {
            parameters,
            electromagnet,
            filter,
            control_law,
            linear,
            exact,
            conditioned,
            lift_loss,
        })
    }

    /// The parameters of the magnet.
    pub fn parameters(&self) -> &MagnetParameters {
        &self.parameters
    }

    /// Constants and laws of force and coil.
    pub fn electromagnet(&self) -> &Electromagnet {
        &self.electromagnet
    }

    /// Matrices of the filter.
    pub fn filter(&self) -> &Filter {
        &self.filter
    }

    /// The linear system of eqs 1-5 about (i₀, c₀). For the nonlinear law it is the linearisation
    /// about the operating point if `operating_current` is that point's current.
    pub fn linear_system(&self) -> &LinearSystem {
        &self.linear.system
    }

    /// Eqs 1 and 2 alone about (i₀, c₀): what is left with an external controller. For the nonlinear
    /// law as [`Magnet::linear_system`].
    pub fn coil_system(&self) -> &CoilSystem {
        &self.linear.coil
    }

    /// Whether steps are exact: linear law, no limits, continuous controller, no conditions.
    pub fn is_exact(&self) -> bool {
        self.exact
    }

    /// Whether there are [`Conditions`](crate::Conditions).
    pub(crate) fn is_conditioned(&self) -> bool {
        self.conditioned
    }

    /// The law of lift loss, if it holds.
    pub fn lift_loss(&self) -> Option<&LiftLoss> {
        self.lift_loss.as_ref()
    }

    /// Whether the controller is sampled.
    pub(crate) fn is_sampled(&self) -> bool {
        self.parameters.control.sampling.is_some()
    }

    /// Fastest rate in the filter, in 1/s: the limit for [`MagnetParameters::integration_step`].
    pub fn fastest_rate(&self) -> f64 {
        self.parameters.filter.fastest_rate()
    }

    pub(crate) fn linear_magnet(&self) -> &LinearMagnet {
        &self.linear
    }

    /// ∂Δv/∂q̈ and ∂Δv/∂(voltage command) of a continuous controller.
    pub(crate) fn feed_through(&self) -> (f64, f64) {
        if self.parameters.external_controller {
            (0.0, 1.0)
        } else {
            (self.control_law.by_acceleration, 0.0)
        }
    }

    /// Total voltage that eq. 3, or a controller outside, asks for, in V, before any limit: the
    /// reference's, R·i_op at rest, and Δv.
    #[inline]
    pub(crate) fn command(&self, x: &[f64; 5], seen: &Seen) -> f64 {
        seen.base + self.deviation(x, seen.direct)
    }

    /// Δv of eq. 3 for filter states x, or of a controller outside, in V.
    #[inline]
    pub(crate) fn deviation(&self, x: &[f64; 5], direct: Direct) -> f64 {
        if self.parameters.external_controller {
            direct.command
        } else {
            self.control_law.voltage(x, direct.acceleration)
        }
    }

    /// Total voltage within the limits that a continuous controller would apply now, in V.
    pub(crate) fn demand(&self, state: &State, seen: &Seen) -> f64 {
        let command = self.command(&state.filter, seen);
        self.parameters.limits.clamp_voltage(command)
    }

    /// Flux Δλ (Wb) and current i (A) of a state at a place. A current limiter keeps the
    /// current where it is when the gap moves, and the flux gives way.
    #[inline]
    pub(crate) fn flux_and_current(&self, state: &State, place: Place) -> (f64, f64) {
        let operating = state.operating_current;
        let flux = state.flux_deviation;
        let current = self.current_of_flux(place, operating, flux);
        let limited = if self.is_off(state) {
            self.parameters.limits.freewheeling(current)
        } else {
            self.parameters.limits.clamp_current(current)
        };
        if limited == current {
            return (flux, current);
        }
        (self.flux_of_current(place, operating, limited), limited)
    }

    /// Total current i, in A, of a state at the gap `gap` (m), centred below the rail.
    pub fn current(&self, state: &State, gap: f64) -> f64 {
        self.flux_and_current(state, Place { gap, offset: 0.0 }).1
    }

    /// Total current i, in A, for the flux linkage λ_op + Δλ (Wb).
    #[inline]
    pub(crate) fn current_of_flux(&self, place: Place, operating: f64, flux: f64) -> f64 {
        match &self.lift_loss {
            None => operating + self.electromagnet.current_of_flux(place.gap, operating, flux),
            Some(law) => self.total_flux(operating, flux) / law.inductance(place),
        }
    }

    /// Δλ, in Wb, of a total current (A).
    pub(crate) fn flux_of_current(&self, place: Place, operating: f64, current: f64) -> f64 {
        let coil = &self.electromagnet;
        match &self.lift_loss {
            None => coil.flux_of_current(place.gap, operating, current - operating),
            Some(law) => law.inductance(place) * current - coil.inductance * operating,
        }
    }

    /// λ_op + Δλ, in Wb.
    pub(crate) fn total_flux(&self, operating: f64, flux: f64) -> f64 {
        self.electromagnet.inductance * operating + flux
    }

    /// di/dt in A/s for a total voltage, with the gap and the offset and their rates.
    pub(crate) fn current_rate(
        &self,
        [gap, gap_rate]: [f64; 2],
        [offset, offset_rate]: [f64; 2],
        current: f64,
        voltage: f64,
    ) -> f64 {
        let coil = &self.electromagnet;
        let Some(law) = &self.lift_loss else {
            return coil.current_rate(gap, gap_rate, current, voltage);
        };
        let per_flux = law.reluctance(Place { gap, offset });
        let moved = per_flux.by_gap * gap_rate + per_flux.by_offset * offset_rate;
        per_flux.value * (voltage - coil.resistance * current) + moved * current / per_flux.value
    }

    /// Refuses an offset at which lift loss has no law.
    pub(crate) fn check_offset(&self, offset: f64, time: f64) -> Result<(), Error> {
        match &self.lift_loss {
            Some(law) if offset.abs() >= law.limit() => {
                Err(Error::GuidanceLost { time, offset, width: law.limit() })
            }
            _ => Ok(()),
        }
    }

    /// The state to start from at `time` (s): the filter at [`Filter::rest`], and in the coil the
    /// current of rest at that gap, Δi = Δv/R with the voltage that the resting gap alone asks for,
    /// within the limits.
    ///
    /// At the nominal gap this is the operating point, F = F_s. A gap that deviates by Δc gives, in
    /// the linear law, ΔF = (kᵢ·(k₃ + k₅)·250/R − k_c)·Δc: the static stiffness of the levitation.
    /// A gap rate and an acceleration set the filter only: they do not last as long as the coil's
    /// time constant L₀/R (0.75 s), and the current that they would settle at would detach a magnet
    /// that starts moving along a slope. So with an external controller Δi = (Δv − Δv_t)/R, where the
    /// transient voltage Δv_t is what the rate adds to Δv; the filter is zero.
    ///
    /// # Errors
    /// Inputs that are not finite, a closed gap, or (nonlinear law) a static force that no current
    /// carries because it is not positive.
    pub fn initialise(&self, inputs: &MagnetInputs, time: f64) -> Result<State, Error> {
        inputs.check()?;
        self.check_offset(inputs.lateral_offset, time)?;
        let operating_current = self.operating_current(inputs)?;
        let mut state = State {
            filter: [0.0; 5],
            flux_deviation: 0.0,
            operating_current,
            hold: Hold::new(time, 0.0),
            time,
            condition: self.first_condition(time, [inputs.gap, inputs.acceleration])?,
        };
        let seen = self.seen_at_rest(&state, inputs);
        let voltage = if self.parameters.external_controller {
            inputs.voltage_command - inputs.transient_voltage
        } else {
            let Seen { deviation, direct, .. } = seen;
            state.filter = self.filter.rest(deviation, inputs.gap_rate, direct.acceleration);
            self.control_law.voltage(&self.filter.rest(deviation, 0.0, 0.0), 0.0)
        };
        state.flux_deviation = if self.starts_without_current(&state.condition) {
            -self.electromagnet.inductance * operating_current
        } else {
            let current = self.resting_current(voltage, operating_current);
            match &self.lift_loss {
                None => self.electromagnet.flux_of_current(inputs.gap, operating_current, current),
                Some(_) => {
                    let total = operating_current + current;
                    self.flux_of_current(inputs.place(), operating_current, total)
                }
            }
        };
        state.hold = Hold::new(time, self.demand(&state, &seen));
        Ok(state)
    }

    /// Δi, in A, that the coil settles at when Δv stays at `voltage` (V).
    fn resting_current(&self, voltage: f64, operating_current: f64) -> f64 {
        let resistance = self.electromagnet.resistance;
        let limits = &self.parameters.limits;
        if limits.none() {
            return voltage / resistance;
        }
        let total = limits.clamp_voltage(resistance * operating_current + voltage);
        limits.clamp_current(total / resistance) - operating_current
    }

    fn operating_current(&self, inputs: &MagnetInputs) -> Result<f64, Error> {
        match self.parameters.law {
            Law::Linear => Ok(self.parameters.operating_current),
            Law::Nonlinear => {
                let MagnetInputs { static_force, lateral_offset: offset, .. } = *inputs;
                positive("static force (N) of the nonlinear law", static_force)?;
                let gap = self.electromagnet.nominal_gap;
                Ok(match &self.lift_loss {
                    None => self.electromagnet.equilibrium_current(static_force, gap),
                    Some(law) => law.equilibrium_current(Place { gap, offset }, static_force),
                })
            }
        }
    }
}

fn linearise(coil: &CoilSystem, filter: &Filter, law: &ControlLaw) -> LinearSystem {
    let mut a = [[0.0; 6]; 6];
    let mut b = [[0.0; 2]; 6];
    for (i, (row, inputs)) in filter.a.iter().zip(&filter.b).enumerate() {
        a[i][..5].copy_from_slice(row);
        b[i] = [POSITION_SCALE * inputs[0], ACCELERATION_SCALE * inputs[1]];
    }
    a[5][..5].copy_from_slice(&law.by_state);
    a[5][5] = coil.a;
    b[5] = [coil.b[0], law.by_acceleration];
    LinearSystem { a, b, force_by_state: [0.0, 0.0, 0.0, 0.0, 0.0, coil.force_by_flux] }
}

fn key(parameters: &MagnetParameters, magnet: &Electromagnet) -> Key {
    let f = &parameters.filter;
    let k = &parameters.control.gains;
    [
        f.gap_cutoff,
        f.gap_damping,
        f.velocity_cutoff,
        f.velocity_damping,
        f.position_cutoff,
        k.acceleration,
        k.velocity,
        k.position,
        k.gap_velocity,
        k.gap,
        magnet.inductance,
        magnet.resistance,
        magnet.gap_stiffness / magnet.current_stiffness,
    ]
}
