//! A magnet with lift loss as a linear system about its state, at any lateral offset.

use crate::inputs::MagnetInputs;
use crate::state::State;
use crate::system::Magnet;

/// Coil and forces about a state, with lift loss: λ' = Δv − R·(i − i_op), forces of the flux linkage λ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AsideSystem {
    /// ∂λ'/∂λ, in 1/s.
    pub by_flux: f64,
    /// ∂λ'/∂c and ∂λ'/∂y, in V/m.
    pub by_place: [f64; 2],
    /// ∂F/∂λ of the levitation force, in N/Wb.
    pub force_by_flux: f64,
    /// The same of the lateral force.
    pub lateral_by_flux: f64,
    /// ∂i/∂λ, in 1/H.
    pub current_by_flux: f64,
}

impl Magnet {
    /// The magnet about a state with lift loss; none without lift loss. The partial derivatives by gap and offset at
    /// constant flux are in [`Magnet::partials`].
    pub fn aside(&self, state: &State, inputs: &MagnetInputs) -> Option<AsideSystem> {
        let law = self.lift_loss()?;
        let place = inputs.place();
        let (flux, _) = self.flux_and_current(state, place);
        let total = self.total_flux(state.operating_current, flux);
        let (resistance, per_flux) = (self.electromagnet().resistance, law.reluctance(place));
        Some(AsideSystem {
            by_flux: -resistance * per_flux.value,
            by_place: [per_flux.by_gap, per_flux.by_offset]
                .map(|slope| -resistance * slope * total),
            // both forces are proportional to the square of the flux
            force_by_flux: 2.0 * law.force_of_flux(place, total) / total,
            lateral_by_flux: 2.0 * law.lateral_of_flux(place, total) / total,
            current_by_flux: per_flux.value,
        })
    }
}
