//! Lift loss at a lateral offset: the switch, and the fraction that is lost.

use fmi2_export::{BooleanVar, Interface, RealVar};

/// Handles of the switch and the output. They are declared last, so that the value references of all
/// other variables stay what they were.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LiftHandles {
    pub lift_loss: BooleanVar,
    pub lost_lift: RealVar,
}

impl LiftHandles {
    pub(crate) fn declare(interface: &mut Interface) -> Self {
        Self {
            lift_loss: interface
                .boolean("lift_loss")
                .parameter(false)
                .description(
                    "Whether a lateral offset costs lift and changes the flux, with the lateral force \
                     from the same co-energy; needs nonlinear and lateral_guidance. An offset of \
                     pole_width ends the run",
                )
                .done(),
            lost_lift: interface
                .real("lost_lift")
                .output()
                .nominal(0.01)
                .description(
                    "Fraction of the lift at the same current that the lateral offset costs. The force \
                     contains it with lift_loss only; without, it shows what is left out",
                )
                .done(),
        }
    }
}
