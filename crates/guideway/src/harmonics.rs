//! Sums of many harmonics on an equidistant grid.
//!
//! Waves of one octave are summed on a grid that is as coarse as they allow, and interpolated to
//! the next finer grid, where the next octave joins them. Summing blocks of knots around a centre,
//! cos(θ ± δ) = cos θ cos δ ∓ sin θ sin δ needs one table of cos δ and sin δ for all blocks. This
//! costs a twentieth of summing every harmonic at every knot.

use std::f64::consts::TAU;

/// Knots per shortest wave. A quintic through value, slope and curvature at spacing d errs by
/// (Ωd)⁶/46080 of a wave's amplitude: 1.2e-9 with 32 knots per wave, its curvature by (Ωd)⁴/720: 2e-6.
/// The differences that give slope and curvature at the knots err by 3e-11 of them.
pub(crate) const KNOTS_PER_WAVE: f64 = 32.0;

/// Knots per wave on the grid where a wave is summed. From there to the next finer grid,
/// interpolation errs by 9e-13 of its amplitude.
const SUMMED_KNOTS: f64 = 16.0;

/// One harmonic a·cos(Ωx + ϕ).
#[derive(Debug, Clone, Copy)]
pub(crate) struct Harmonic {
    pub(crate) amplitude: f64,
    pub(crate) wavenumber: f64,
    pub(crate) phase: f64,
}

/// `[r, r′, r″]` of the sum r at start + i·spacing, 0 ≤ i ≤ cells. No wave may be shorter than
/// [`KNOTS_PER_WAVE`] spacings.
pub(crate) fn tabulate(
    harmonics: &[Harmonic],
    start: f64,
    spacing: f64,
    cells: usize,
) -> Vec<[f64; 3]> {
    let octaves = by_octave(harmonics, spacing);
    let mut grids = vec![Grid { start, spacing, cells }];
    for _ in 1..octaves.len() {
        grids.extend(grids.last().map(Grid::coarser));
    }
    let mut values: Vec<f64> = Vec::new();
    for (grid, octave) in grids.iter().zip(&octaves).rev() {
        values = if values.is_empty() { vec![0.0; grid.knots()] } else { grid.refine(&values) };
        grid.add(octave, &mut values);
    }
    differentiate(&values, spacing)
}

/// Harmonics by the coarsest grid that resolves them: spacing·2ᵐ for the m-th entry.
fn by_octave(harmonics: &[Harmonic], spacing: f64) -> Vec<Vec<Harmonic>> {
    let mut octaves = vec![Vec::new()];
    for &harmonic in harmonics {
        let knots = TAU / (harmonic.wavenumber * spacing);
        let m = (1..MAX_OCTAVES).take_while(|&m| knots >= SUMMED_KNOTS * f64::from(1 << m)).count();
        if octaves.len() <= m {
            octaves.resize(m + 1, Vec::new());
        }
        octaves[m].push(harmonic);
    }
    octaves
}

/// Longer waves share the coarsest grid.
const MAX_OCTAVES: i32 = 16;

/// Extra knots before and after the range for interpolation and differences: an odd knot at −j
/// needs the coarser knot −(j + 1)/2 − 7, which is within 16 for j up to 16.
const REACH: usize = 16;

/// Weights of the knots at ±1/2, ±3/2, … in Lagrange's polynomial of degree 15, in the middle.
const MIDDLE: [f64; 8] = [
    41_409_225.0 / 67_108_864.0,
    -10_735_725.0 / 67_108_864.0,
    3_864_861.0 / 67_108_864.0,
    -1_254_825.0 / 67_108_864.0,
    325_325.0 / 67_108_864.0,
    -61_425.0 / 67_108_864.0,
    7_425.0 / 67_108_864.0,
    -429.0 / 67_108_864.0,
];

/// Knots on either side of a block's centre, plus the centre itself.
const HALF_BLOCK: usize = 32;
const BLOCK: usize = 2 * HALF_BLOCK - 1;

/// Knots that are summed side by side, for the processor's vector unit.
const LANES: usize = 8;

/// Harmonics whose tables stay in the cache.
const GROUP: usize = 256;

/// Number of blocks after which phases are recomputed: rounding stays below 64·ε.
const TURNS: usize = 64;

/// Knots at start + i·spacing, −REACH ≤ i ≤ cells + REACH.
struct Grid {
    start: f64,
    spacing: f64,
    cells: usize,
}

impl Grid {
    fn knots(&self) -> usize {
        self.cells + 1 + 2 * REACH
    }

    fn coarser(&self) -> Self {
        Self { start: self.start, spacing: 2.0 * self.spacing, cells: self.cells.div_ceil(2) }
    }

    /// Values on the next coarser grid interpolated to this one: every other knot is copied, the
    /// others are interpolated from the sixteen around them.
    fn refine(&self, coarse: &[f64]) -> Vec<f64> {
        // knot i of this grid is knot (i − REACH)/2 of the range; REACH is even
        (0..self.knots())
            .map(|i| {
                let left = REACH / 2 + i / 2;
                if i % 2 == 0 {
                    return coarse[left];
                }
                (0_usize..).zip(MIDDLE).fold(0.0, |sum, (k, weight)| {
                    sum + weight * (coarse[left - k] + coarse[left + 1 + k])
                })
            })
            .collect()
    }

    /// Adds harmonics at all knots.
    fn add(&self, harmonics: &[Harmonic], values: &mut [f64]) {
        for group in harmonics.chunks(GROUP) {
            let tables = turns(group, self.spacing);
            let step: Vec<(f64, f64)> = group
                .iter()
                .map(|h| libm::sincos(h.wavenumber * self.spacing * BLOCK as f64))
                .collect();
            let mut phases = vec![(0.0, 0.0); group.len()];
            for (block, knots) in values.chunks_mut(BLOCK).enumerate() {
                if block % TURNS == 0 {
                    let centre = (block * BLOCK + HALF_BLOCK - 1) as f64 - REACH as f64;
                    let x = self.start + self.spacing * centre;
                    phases = group.iter().map(|h| h.at(x)).collect();
                }
                add_block(&phases, &tables, knots);
                for ((s, c), &(ts, tc)) in phases.iter_mut().zip(&step) {
                    (*s, *c) = (*s * tc + *c * ts, *c * tc - *s * ts);
                }
            }
        }
    }
}

impl Harmonic {
    /// a·sin(Ωx + ϕ) and a·cos(Ωx + ϕ).
    fn at(&self, x: f64) -> (f64, f64) {
        let (s, c) = libm::sincos(self.wavenumber * x + self.phase);
        (self.amplitude * s, self.amplitude * c)
    }
}

/// sin and cos of Ω·j·spacing for LANES neighbouring j, harmonic by harmonic.
type TurnTable = Vec<[[f64; LANES]; 2]>;

/// Tables for all j of half a block.
fn turns(group: &[Harmonic], spacing: f64) -> Vec<TurnTable> {
    let mut tables = vec![vec![[[0.0; LANES]; 2]; group.len()]; HALF_BLOCK / LANES];
    for (k, harmonic) in group.iter().enumerate() {
        let (ts, tc) = libm::sincos(harmonic.wavenumber * spacing);
        let (mut s, mut c) = (0.0, 1.0);
        for table in &mut tables {
            let [sines, cosines] = &mut table[k];
            for (sine, cosine) in sines.iter_mut().zip(cosines) {
                (*sine, *cosine) = (s, c);
                (s, c) = (s * tc + c * ts, c * tc - s * ts);
            }
        }
    }
    tables
}

/// Adds harmonics with the given sines and cosines at the block's centre to its knots.
fn add_block(phases: &[(f64, f64)], tables: &[TurnTable], knots: &mut [f64]) {
    for (tile, table) in tables.iter().enumerate() {
        let (mut even, mut odd) = ([0.0; LANES], [0.0; LANES]);
        for (&(s, c), [sines, cosines]) in phases.iter().zip(table) {
            for l in 0..LANES {
                even[l] += c * cosines[l];
                odd[l] += s * sines[l];
            }
        }
        for l in 0..LANES {
            let (centre, j) = (HALF_BLOCK - 1, tile * LANES + l);
            // the last block may end before its last knots, or before its centre
            if let Some(knot) = knots.get_mut(centre + j) {
                *knot += even[l] - odd[l];
            }
            if j > 0
                && let Some(knot) = knots.get_mut(centre - j)
            {
                *knot += even[l] + odd[l];
            }
        }
    }
}

/// Values with slope and curvature by central differences of tenth order, without the knots beyond
/// the range.
fn differentiate(values: &[f64], spacing: f64) -> Vec<[f64; 3]> {
    const SLOPE: [f64; 5] = [5.0 / 6.0, -5.0 / 21.0, 5.0 / 84.0, -5.0 / 504.0, 1.0 / 1260.0];
    const CENTRE: f64 = -5269.0 / 1800.0;
    const CURVATURE: [f64; 5] = [5.0 / 3.0, -5.0 / 21.0, 5.0 / 126.0, -5.0 / 1008.0, 1.0 / 3150.0];
    (REACH..values.len() - REACH)
        .map(|i| {
            let (mut slope, mut curvature) = (0.0, CENTRE * values[i]);
            for k in 0..5 {
                let (before, after) = (values[i - 1 - k], values[i + 1 + k]);
                slope += SLOPE[k] * (after - before);
                curvature += CURVATURE[k] * (after + before);
            }
            [values[i], slope / spacing, curvature / (spacing * spacing)]
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Waves of all lengths, also far longer than the grid, on grids that end within a block, at its
    /// end, and before its centre.
    #[test]
    fn analytic_sums_are_those_of_every_harmonic_at_every_knot() {
        let spacing = 0.25;
        let harmonic = |k: u32| Harmonic {
            amplitude: 1.0 / f64::from(k),
            wavenumber: TAU / (KNOTS_PER_WAVE * spacing) / f64::from(k * k),
            phase: f64::from(k),
        };
        let harmonics: Vec<Harmonic> = (1..=600).map(harmonic).collect();
        for cells in [1, 20, 42, 43, 63, 1000, 9001] {
            let table = tabulate(&harmonics, -3.0, spacing, cells);
            assert_eq!(table.len(), cells + 1);
            for (i, knot) in table.iter().enumerate().step_by(7) {
                let x = -3.0 + spacing * i as f64;
                let exact = harmonics.iter().fold([0.0; 3], |r, h| {
                    let (s, c) = h.at(x);
                    let k = h.wavenumber;
                    [r[0] + c, r[1] - k * s, r[2] - k * k * c]
                });
                // 9e-13 of the amplitudes (Σa = 7) at every other knot, which differences divide by
                // d = 0.25 and d²; 3e-11 of slope and curvature; rounding of d²: 10·ε·Σa/d²
                for ((found, exact), error) in knot.iter().zip(exact).zip([1e-11, 8e-11, 5e-10]) {
                    assert!((found - exact).abs() < error, "{cells} {i}: {found} {exact}");
                }
            }
        }
    }

    /// A sum of no harmonic is zero, and one that is too long for any grid is still summed.
    #[test]
    fn issue_no_harmonic_and_a_constant() {
        assert_eq!(tabulate(&[], 0.0, 1.0, 2), vec![[0.0; 3]; 3]);
        let constant = Harmonic { amplitude: 2.0, wavenumber: 0.0, phase: 0.0 };
        assert_eq!(tabulate(&[constant], 0.0, 1.0, 1)[1][0], 2.0);
    }
}
