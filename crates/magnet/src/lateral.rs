//! Lateral guidance: a magnet displaced sideways is pulled back under its rail.

use std::f64::consts::FRAC_2_PI;

use crate::jet::Jet;

/// Lateral force on the magnet, in N: F_y = −F·(2/π)·(c/w)·atan(y/c).
///
/// `force` F is the levitation force (N), `gap` c > 0 the gap (m), `offset` y the displacement of
/// the magnet to the left of the rail (m), `pole_width` w the width of one pole (m). The force
/// restores: its sign is opposite to y.
///
/// This is the fringe field of two aligned rectangular poles, wide against the gap, by conformal
/// mapping: W. Brzezina and J. Langerholc, *Lift and side forces on rectangular pole pieces in two
/// dimensions*, J. Appl. Phys. 45 (1974) 1869-1872; in the form given here in P. K. Sinha,
/// *Electromagnetic Suspension: Dynamics & Control*, Peter Peregrinus (1987). Only its leading
/// term is taken: the levitation force itself keeps its value at y = 0. Two limits are known
/// without the mapping: for y ≪ c the stiffness is 2F/(πw), independent of the gap; for
/// c ≪ y ≪ w the force tends to F·c/w, the virtual work ∂W/∂y of the lost overlap, where
/// W = B²·(w − y)·l·c/(2μ₀) is a pole's co-energy and F = B²·w·l/(2μ₀) its lift.
pub fn lateral_force(force: f64, gap: f64, offset: f64, pole_width: f64) -> f64 {
    -force * FRAC_2_PI * (gap / pole_width) * (offset / gap).atan()
}

/// −∂F_y/∂y, in N/m, of [`lateral_force`]: how fast the restoring force grows with the offset.
pub fn lateral_stiffness(force: f64, gap: f64, offset: f64, pole_width: f64) -> f64 {
    -lateral_gradient(force, gap, offset, pole_width)[2]
}

/// F_y/F of [`lateral_force`] with its derivatives by gap and offset.
pub(crate) fn lateral_share(c: f64, y: f64, pole_width: f64) -> Jet {
    let factor = -FRAC_2_PI / pole_width;
    let (angle, square) = ((y / c).atan(), c * c + y * y);
    let curvature = 2.0 * factor * y / (square * square);
    Jet {
        value: factor * c * angle,
        first: [factor * (angle - c * y / square), factor * c * c / square],
        second: [-y * y * curvature, c * y * curvature, -c * c * curvature],
    }
}

/// ∂F_y/∂F, ∂F_y/∂c at constant F (N/m), and ∂F_y/∂y (N/m).
pub(crate) fn lateral_gradient(force: f64, gap: f64, offset: f64, pole_width: f64) -> [f64; 3] {
    let factor = -FRAC_2_PI / pole_width;
    let angle = (offset / gap).atan();
    let inverse = 1.0 / (gap * gap + offset * offset);
    [
        factor * gap * angle,
        factor * force * (angle - gap * offset * inverse),
        factor * force * gap * gap * inverse,
    ]
}
