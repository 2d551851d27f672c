//! Mode shapes under a magnet, as a table over its place.

/// What a magnet sees of one mode, and what its force does to that mode, with their slopes.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Sight {
    /// Displacement of the track per modal displacement (1).
    pub sight: f64,
    /// Its slope (1/m).
    pub sight_slope: f64,
    /// Modal acceleration per force of the magnet (1/kg).
    pub push: f64,
    /// Its slope (1/(kg·m)).
    pub push_slope: f64,
}

/// Samples at equal distances, with cubic Hermite interpolation between them. The magnet feels nothing outside.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ShapeTable {
    /// Place of the first sample (m from the beginning of the period).
    pub from: f64,
    /// Distance of the samples (m).
    pub cell: f64,
    /// Number of modes.
    pub modes: usize,
    /// All modes at the first place, then at the next one.
    pub samples: Vec<Sight>,
}

impl ShapeTable {
    /// Calls `see(mode, sight)` for every mode that a magnet at this place may feel.
    pub fn at(&self, place: f64, mut see: impl FnMut(usize, Sight)) {
        let cells = (self.samples.len() / self.modes.max(1)).saturating_sub(1);
        let at = (place - self.from) / self.cell;
        if !(at >= 0.0 && at <= cells as f64) || cells == 0 {
            return;
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 … cells")]
        let k = (at as usize).min(cells - 1);
        let t = at - k as f64;
        let (left, right) = self.samples[k * self.modes..(k + 2) * self.modes].split_at(self.modes);
        for (n, (a, b)) in left.iter().zip(right).enumerate() {
            let cubic = |y0: f64, s0: f64, y1: f64, s1: f64| {
                let (c2, c3) = self.higher(y0, s0, y1, s1);
                let value = y0 + t * (self.cell * s0 + t * (c2 + t * c3));
                (value, s0 + t * (2.0 * c2 + 3.0 * t * c3) / self.cell)
            };
            let (sight, sight_slope) = cubic(a.sight, a.sight_slope, b.sight, b.sight_slope);
            let (push, push_slope) = cubic(a.push, a.push_slope, b.push, b.push_slope);
            see(n, Sight { sight, sight_slope, push, push_slope });
        }
    }

    /// Coefficients of t² and t³ of the cubic with these values and slopes at both ends.
    fn higher(&self, y0: f64, s0: f64, y1: f64, s1: f64) -> (f64, f64) {
        let (rise, m0, m1) = (y1 - y0, self.cell * s0, self.cell * s1);
        (3.0 * rise - 2.0 * m0 - m1, m0 + m1 - 2.0 * rise)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sine over 25 m in cells of 1 m: the cubic's error is below (kh)⁴/384 = 6e-7.
    #[test]
    fn analytic_a_sine_is_interpolated_between_samples() {
        let k = std::f64::consts::PI / 25.0;
        let sample = |x: f64| Sight {
            sight: (k * x).sin(),
            sight_slope: k * (k * x).cos(),
            push: -(k * x).sin(),
            push_slope: -k * (k * x).cos(),
        };
        let samples = (0..=25).map(|i| sample(f64::from(i))).collect();
        let table = ShapeTable { from: 0.0, cell: 1.0, modes: 1, samples };
        for x in [0.0, 0.5, 7.3, 24.9, 25.0] {
            let mut seen = 0;
            table.at(x, |_, it| {
                seen += 1;
                assert!((it.sight - (k * x).sin()).abs() < 7e-7, "{x}");
                assert!((it.push_slope + k * (k * x).cos()).abs() < 7e-6, "{x}");
            });
            assert_eq!(seen, 1);
        }
        table.at(25.1, |_, _| panic!("outside"));
        table.at(-0.1, |_, _| panic!("outside"));
    }
}
