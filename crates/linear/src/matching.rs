//! Which multipliers of the stepped system belong to which eigenvalue.
//!
//! A mode with the eigenvalue λ that is stepped without error has the multiplier z = exp(λh), and its
//! conjugate if λ is not real. So λ = (ln z + 2πik)/h, and k cannot be seen in z: a mode above 1/(2h)
//! looks like one below it. Every eigenvalue is compared with the branch that is nearest to it, of z or of
//! its conjugate. Below 1/(2h) this is the principal one.

use std::f64::consts::{PI, TAU};

use faer::prelude::c64;

use super::eigen::upper;

/// Smaller multipliers decay within a step and belong to no mode.
const GONE: f64 = 1e-8;
/// Largest |ln z + 2πik − λh| at which a multiplier belongs to a mode: a factor e in size, or a radian.
const FARTHEST: f64 = 1.0;

/// The multipliers of the stepped system, sorted by what causes them.
pub struct Matched {
    /// The eigenvalue as stepped (1/s) of every mode; none if no multiplier belongs to it.
    pub stepped: Vec<Option<c64>>,
    /// Size of the largest multiplier that belongs to no mode; 0 without one.
    pub own: f64,
}

/// Finds the multipliers of each eigenvalue λ (Im λ ≥ 0, one of each conjugate pair): nearest first.
pub fn matched(values: &[c64], multipliers: &[c64], step: f64) -> Matched {
    let multipliers: Vec<Multiplier> = multipliers
        .iter()
        .filter(|z| z.norm() > GONE)
        .map(|z| Multiplier { z: *z, root: z.ln() / step })
        .collect();
    let modes: Vec<Mode> = values.iter().map(|value| Mode { value: *value, step }).collect();
    let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
    for (i, mode) in modes.iter().enumerate() {
        for (j, multiplier) in multipliers.iter().enumerate() {
            let distance = mode.stepped(multiplier).and_then(|root| mode.distance(root));
            pairs.extend(distance.map(|distance| (distance, i, j)));
        }
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)).then(a.2.cmp(&b.2)));
    let mut stepped = vec![None; modes.len()];
    let mut free = vec![true; multipliers.len()];
    for (_, i, j) in pairs {
        if stepped[i].is_some() || !free[j] {
            continue;
        }
        let (mode, multiplier) = (&modes[i], &multipliers[j]);
        let mut root = mode.stepped(multiplier);
        if mode.takes_two(multiplier) {
            let others = multipliers.iter().enumerate().filter(|(k, _)| *k != j && free[*k]);
            let Some((k, second)) = multiplier.second(others) else { continue };
            if multiplier.is_real() {
                let other = mode.stepped(second).filter(|it| mode.distance(*it).is_some());
                let Some(other) = other else { continue };
                root = root.map(|root| (root + other) / 2.0);
            }
            free[k] = false;
        }
        free[j] = false;
        stepped[i] = root;
    }
    let rest = multipliers.iter().zip(free).filter(|(_, free)| *free);
    Matched { stepped, own: rest.map(|(it, _)| it.z.norm()).fold(0.0, f64::max) }
}

/// A multiplier.
struct Multiplier {
    z: c64,
    /// ln z/h, the principal branch.
    root: c64,
}

impl Multiplier {
    fn is_real(&self) -> bool {
        self.z.im == 0.0
    }

    /// Real for modes below 1/(2h). A double real multiplier that rounding has split into a pair counts
    /// as two real ones.
    fn decays_only(&self) -> bool {
        upper(self.root).is_some_and(|root| root.im == 0.0)
    }

    /// The multiplier that belongs to the same oscillation: the conjugate one, or the nearest real one of
    /// the same sign.
    fn second<'a>(
        &self,
        others: impl Iterator<Item = (usize, &'a Self)>,
    ) -> Option<(usize, &'a Self)> {
        let wanted = self.z.conj();
        let alike = |it: &Self| {
            if self.is_real() {
                it.is_real() && it.z.re * self.z.re > 0.0
            } else {
                it.z.im * self.z.im < 0.0
            }
        };
        others
            .filter(|(_, it)| alike(it))
            .min_by(|(_, a), (_, b)| (a.z - wanted).norm().total_cmp(&(b.z - wanted).norm()))
    }
}

/// An eigenvalue of the continuous system, one of each conjugate pair.
struct Mode {
    value: c64,
    step: f64,
}

impl Mode {
    /// Whether its frequency exceeds 1/(2h).
    fn folds(&self) -> bool {
        self.value.im * self.step > PI
    }

    /// The eigenvalue that this multiplier would give it. None for one of each conjugate pair of
    /// multipliers, and for a negative multiplier of a mode that does not oscillate.
    fn stepped(&self, multiplier: &Multiplier) -> Option<c64> {
        let root = c64::new(multiplier.root.re, multiplier.root.im.abs());
        if multiplier.z.re < 0.0 && multiplier.is_real() {
            return (self.value.im > 0.0).then(|| self.nearest(root));
        }
        if !self.folds() {
            return upper(multiplier.root);
        }
        (multiplier.z.im >= 0.0).then(|| self.nearest(root))
    }

    /// The branch of the root or its conjugate that is nearest to the eigenvalue.
    fn nearest(&self, root: c64) -> c64 {
        let turn = TAU / self.step;
        let branch = |im: f64| c64::new(root.re, im + ((self.value.im - im) / turn).round() * turn);
        let (plain, conjugate) = (branch(root.im), branch(-root.im));
        let far = |it: c64| (it - self.value).norm();
        if far(conjugate) < far(plain) { conjugate } else { plain }
    }

    /// Distance of an eigenvalue as stepped (1/s), unless it is too far off to belong to the mode.
    fn distance(&self, stepped: c64) -> Option<f64> {
        let distance = (stepped - self.value).norm();
        (distance < self.value.norm().min(FARTHEST / self.step)).then_some(distance)
    }

    /// Whether a second multiplier belongs to the mode together with this one. (Below 1/(2h) an oscillation
    /// may turn into two decays, each with a mode of its own.)
    fn takes_two(&self, multiplier: &Multiplier) -> bool {
        let oscillates = self.value.im > 0.0;
        let decays = multiplier.decays_only();
        (!multiplier.is_real() && !decays) || (oscillates && (self.folds() || !decays))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A pair of damping ratio ζ.
    fn pair(frequency: f64, damping: f64) -> c64 {
        let size = TAU * frequency;
        c64::new(-damping * size, size * (1.0 - damping * damping).sqrt())
    }

    /// exp(λh) of all, conjugates included.
    fn stepped_exactly(values: &[c64], step: f64) -> Vec<c64> {
        let both = |value: &c64| match value.im {
            0.0 => vec![c64::new((value.re * step).exp(), 0.0)],
            _ => vec![(value * step).exp(), (value.conj() * step).exp()],
        };
        values.iter().flat_map(both).collect()
    }

    fn errors(values: &[c64], found: &Matched) -> Vec<f64> {
        let error = |(value, stepped): (&c64, &Option<c64>)| {
            stepped.map_or(f64::INFINITY, |it| (it - value).norm() / value.norm())
        };
        values.iter().zip(&found.stepped).map(error).collect()
    }

    /// Modes of a girder that are stepped without error keep their eigenvalues at every step, far above
    /// 1/(2h) too, and exactly where one falls on 1/(2h) or 1/h and its two multipliers are real. Only a
    /// multiplier that is no mode's is left to the coupling.
    #[test]
    fn analytic_exact_steps_leave_no_error_above_the_nyquist_frequency() {
        let mut values: Vec<c64> = (1..=6).map(|k| pair(9.0429 * f64::from(k * k), 0.01)).collect();
        values.push(c64::new(-10.0, 0.0));
        let mut steps = vec![0.0005, 0.001, 0.005, 0.0123, 0.02, 0.05];
        steps.extend(values[..6].iter().flat_map(|it| [PI / it.im, TAU / it.im, 3.0 * PI / it.im]));
        for step in steps {
            let mut multipliers = stepped_exactly(&values, step);
            multipliers.push(c64::new(-0.3, 0.0));
            multipliers.push(c64::new(1e-12, 0.0));
            let found = matched(&values, &multipliers, step);
            for (value, error) in values.iter().zip(errors(&values, &found)) {
                assert!(error < 1e-9, "{step}: {value}: {error:e}");
            }
            assert_eq!(found.own, 0.3, "{step}");
        }
    }

    /// Rounding splits the real double multiplier of a mode at 1/(2h) into two real ones: both are its own.
    #[test]
    fn issue_both_real_multipliers_of_a_mode_at_the_nyquist_frequency_are_its_own() {
        let (value, step) = (pair(100.0, 0.01), 0.005);
        for im in [value.im, PI / step, TAU / step] {
            let value = c64::new(value.re, im);
            let z = (value * step).exp().re;
            let two = [c64::new(z * (1.0 + 1e-9), 0.0), c64::new(z * (1.0 - 1e-9), -0.0)];
            let found = matched(&[value], &two, step);
            assert!(errors(&[value], &found)[0] < 1e-4, "{im}");
            assert_eq!(found.own, 0.0, "{im}");
        }
    }

    /// An oscillation has two multipliers, so a single negative one is the coupling's, and so is one that
    /// differs by more than a factor e.
    #[test]
    fn issue_a_single_negative_multiplier_belongs_to_no_oscillation() {
        let step = 0.005;
        let filter = c64::new(-500.7, 865.6);
        let found = matched(&[filter], &[c64::new(-0.06, 0.0)], step);
        assert!(found.stepped[0].is_none());
        assert_eq!(found.own, 0.06);
        let value = pair(226.0, 0.01);
        let weak = (value * step).exp() * 0.3;
        let found = matched(&[value], &[weak, weak.conj()], step);
        assert!(found.stepped[0].is_none());
        assert_eq!(found.own, weak.norm());
    }

    /// Multipliers that the coupling has moved are still matched with their own modes, where ln z/h alone
    /// would give them to modes of lower frequency.
    #[test]
    fn issue_moved_multipliers_of_folded_modes_stay_with_them() {
        let step = 0.005;
        let values = [pair(55.0, 0.03), pair(226.0, 0.01), pair(325.5, 0.01)];
        let moved = values.map(|value| value + c64::new(-2.0, 3.0));
        let found = matched(&values, &stepped_exactly(&moved, step), step);
        for (stepped, wanted) in found.stepped.iter().zip(moved) {
            assert!(stepped.is_some_and(|it| (it - wanted).norm() < 1e-8), "{stepped:?} {wanted}");
        }
        assert_eq!(found.own, 0.0);
    }
}
