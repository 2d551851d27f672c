//! One kind of span with its modes: shapes, modal masses, stiffnesses, damping.

use std::f64::consts::PI;

use crate::description::{GirderDescription, TabulatedShape};
use crate::propagator::NODES;
use crate::{Error, GirderMode, Pole, Spline};

/// Most modes of one span.
pub const MAX_MODES: usize = 200;

/// φₙ and its first two derivatives at one place, one entry per mode.
#[derive(Debug, Clone, Default)]
pub(crate) struct ShapeRow {
    pub value: Vec<f64>,
    pub slope: Vec<f64>,
    pub curvature: Vec<f64>,
}

impl ShapeRow {
    pub fn with_modes(modes: usize) -> Self {
        let zeros = vec![0.0; modes];
        Self { value: zeros.clone(), slope: zeros.clone(), curvature: zeros }
    }
}

#[derive(Debug, Clone, PartialEq)]
enum ModeShapes {
    /// φₙ = sin(nπx/L); `filter[n-1]` is the ratio of its mean under a pole that is entirely on the
    /// span to its value at the pole's centre: Σ wₗ cos(nπsₗ/L).
    Sine { filter: Vec<f64> },
    /// Splines through tabulated points.
    Tables(Vec<Spline>),
}

/// A kind of span, checked and ready for use.
#[derive(Debug, Clone, PartialEq)]
pub struct Girder {
    length: f64,
    /// Natural frequencies (Hz) before the factors on stiffness and mass.
    frequencies: Vec<f64>,
    modes: Vec<GirderMode>,
    shapes: ModeShapes,
    /// Largest wavenumber of a mode shape (rad/m).
    wavenumber: f64,
}

impl Girder {
    /// Checks a description and computes the modal quantities; `path` names it in errors. Factors
    /// on stiffness K and mass M do not change the damping ratios.
    pub(crate) fn new(
        given: &GirderDescription,
        factors: (f64, f64),
        pole: &Pole,
        path: &str,
    ) -> Result<Self, Error> {
        positive(given.length, path, "length", "m")?;
        if !(1..=MAX_MODES).contains(&given.modes) {
            return Err(Error::invalid(
                format!("{path}.modes"),
                format!("{} modes", given.modes),
                format!("give a count from 1 to {MAX_MODES}"),
            ));
        }
        let frequencies = (1..=given.modes)
            .map(|n| frequency(given, n, path))
            .collect::<Result<Vec<_>, Error>>()?;
        let modes = (1..=given.modes)
            .map(|n| {
                let (stiffness_factor, mass_factor) = factors;
                let root = (stiffness_factor / mass_factor).sqrt();
                Ok(GirderMode {
                    mass: mass_factor * modal_mass(given, n, path)?,
                    omega: 2.0 * PI * root * frequencies[n - 1],
                    zeta: damping_ratio(given, n, path)?,
                })
            })
            .collect::<Result<Vec<_>, Error>>()?;
        let base = PI / given.length;
        let shapes = match &given.shapes {
            None => ModeShapes::Sine {
                filter: (1..=given.modes).map(|n| pole.filter(base * n as f64)).collect(),
            },
            Some(tables) => ModeShapes::Tables(
                (0..given.modes)
                    .map(|n| table(&tables[n], given.length, &format!("{path}.shapes[{n}]")))
                    .collect::<Result<_, _>>()?,
            ),
        };
        let wavenumber = base * given.modes as f64;
        Ok(Self { length: given.length, frequencies, modes, shapes, wavenumber })
    }

    /// Span length L (m).
    pub fn length(&self) -> f64 {
        self.length
    }

    /// Natural frequencies of the modes (Hz) before the factors on stiffness and mass.
    pub fn frequencies(&self) -> &[f64] {
        &self.frequencies
    }

    /// The modes, first one first.
    pub fn modes(&self) -> &[GirderMode] {
        &self.modes
    }

    /// Largest wavenumber of a mode shape (rad/m), nπ/L.
    pub(crate) fn wavenumber(&self) -> f64 {
        self.wavenumber
    }

    /// φₙ(x) at a single place, 0 ≤ x ≤ L.
    pub(crate) fn shape_at(&self, x: f64, row: &mut ShapeRow) {
        match &self.shapes {
            ModeShapes::Sine { .. } => self.sines(x, None, row),
            ModeShapes::Tables(splines) => {
                for (n, spline) in splines.iter().enumerate() {
                    [row.value[n], row.slope[n], row.curvature[n]] = spline.at(x);
                }
            }
        }
    }

    /// Σ wₗ φₙ(x + sₗ) for a pole centred at x that is entirely on the span.
    pub(crate) fn shape_under_pole(&self, x: f64, pole: &Pole, row: &mut ShapeRow) {
        match &self.shapes {
            ModeShapes::Sine { filter } => self.sines(x, Some(filter), row),
            ModeShapes::Tables(splines) => {
                for (n, spline) in splines.iter().enumerate() {
                    let mut sum = [0.0; 3];
                    for &(offset, share) in pole.points() {
                        let s = spline.at(x + offset);
                        sum = std::array::from_fn(|i| sum[i] + share * s[i]);
                    }
                    [row.value[n], row.slope[n], row.curvature[n]] = sum;
                }
            }
        }
    }

    /// The pole filter of sine modes.
    pub(crate) fn sine_filter(&self) -> Option<&[f64]> {
        match &self.shapes {
            ModeShapes::Sine { filter } => Some(filter),
            ModeShapes::Tables(_) => None,
        }
    }

    /// `see(n, filterₙ·sin((n+1)πxⱼ/L))` at several places close together: one sine and cosine in
    /// their middle, rotated to each place.
    pub(crate) fn sines_at_nodes(
        &self,
        places: [f64; NODES],
        filter: &[f64],
        mut see: impl FnMut(usize, [f64; NODES]),
    ) {
        let base = PI / self.length;
        let middle = 0.5 * (places[0] + places[NODES - 1]);
        let (sm, cm) = libm::sincos(base * middle);
        let turn = places.map(|x| small_sincos(base * (x - middle)));
        let s1: [f64; NODES] = std::array::from_fn(|j| sm * turn[j].1 + cm * turn[j].0);
        let c1: [f64; NODES] = std::array::from_fn(|j| cm * turn[j].1 - sm * turn[j].0);
        let (mut s, mut c) = (s1, c1);
        for (n, w) in filter.iter().enumerate() {
            see(n, s.map(|s| w * s));
            for j in 0..NODES {
                (s[j], c[j]) = (s[j] * c1[j] + c[j] * s1[j], c[j] * c1[j] - s[j] * s1[j]);
            }
        }
    }

    /// sin(nθ) and its derivatives for θ = πx/L, by rotating a unit vector n times by θ.
    fn sines(&self, x: f64, filter: Option<&[f64]>, row: &mut ShapeRow) {
        let base = PI / self.length;
        let (s1, c1) = libm::sincos(base * x);
        let (mut s, mut c) = (s1, c1);
        for n in 0..self.modes.len() {
            let k = base * (n + 1) as f64;
            let w = filter.map_or(1.0, |f| f[n]);
            row.value[n] = w * s;
            row.slope[n] = w * k * c;
            row.curvature[n] = -w * k * k * s;
            (s, c) = (s * c1 + c * s1, c * c1 - s * s1);
        }
    }
}

/// Sine and cosine, by their series for angles within a sub-step: the first terms left out are
/// (1/8)¹¹/11! = 3e-18 and (1/8)¹⁰/10! = 3e-16.
fn small_sincos(a: f64) -> (f64, f64) {
    if a.abs() > 0.125 {
        return libm::sincos(a);
    }
    let b = a * a;
    let s = 1.0 - b / 6.0 * (1.0 - b / 20.0 * (1.0 - b / 42.0 * (1.0 - b / 72.0)));
    let c = 1.0 - b / 2.0 * (1.0 - b / 12.0 * (1.0 - b / 30.0 * (1.0 - b / 56.0)));
    (a * s, c)
}

fn positive(value: f64, path: &str, name: &str, unit: &str) -> Result<f64, Error> {
    if value > 0.0 && value.is_finite() {
        return Ok(value);
    }
    Err(Error::invalid(
        format!("{path}.{name}"),
        format!("{value} {unit}"),
        "give a positive finite value",
    ))
}

fn modal_mass(given: &GirderDescription, n: usize, path: &str) -> Result<f64, Error> {
    if let Some(tables) = &given.shapes {
        let table = tables.get(n - 1).ok_or_else(|| {
            Error::invalid(
                format!("{path}.shapes"),
                format!("{} mode shapes for {} modes", tables.len(), given.modes),
                "give one table per mode or fewer modes",
            )
        })?;
        return positive(table.modal_mass, path, &format!("shapes[{}].modal_mass", n - 1), "kg");
    }
    let density = given.mass_per_length.ok_or_else(|| {
        Error::invalid(
            format!("{path}.mass_per_length"),
            "missing",
            "give the mass per length (kg/m), or mode shapes with modal masses",
        )
    })?;
    Ok(positive(density, path, "mass_per_length", "kg/m")? * given.length / 2.0)
}

fn frequency(given: &GirderDescription, n: usize, path: &str) -> Result<f64, Error> {
    let order = n as f64;
    let value = if let Some(&imposed) = given.frequencies.get(n - 1) {
        imposed
    } else if let (Some(stiffness), Some(density)) =
        (given.bending_stiffness, given.mass_per_length)
    {
        positive(stiffness, path, "bending_stiffness", "N·m²")?;
        0.5 * PI * (order / given.length).powi(2) * (stiffness / density).sqrt()
    } else if let Some(&first) = given.frequencies.first() {
        order * order * first
    } else {
        return Err(Error::invalid(
            format!("{path}.frequencies"),
            "empty",
            "give at least the first frequency (Hz), or bending_stiffness with mass_per_length",
        ));
    };
    if value >= 0.0 && value.is_finite() {
        return Ok(value);
    }
    Err(Error::invalid(
        format!("{path}.frequencies[{}]", n - 1),
        format!("{value} Hz"),
        "give a finite frequency of at least 0",
    ))
}

fn damping_ratio(given: &GirderDescription, n: usize, path: &str) -> Result<f64, Error> {
    let at = (n - 1).min(given.damping.len().saturating_sub(1));
    let value = *given.damping.get(at).ok_or_else(|| {
        Error::invalid(
            format!("{path}.damping"),
            "empty",
            "give at least one damping ratio (0 for an undamped span)",
        )
    })?;
    if value >= 0.0 && value.is_finite() {
        return Ok(value);
    }
    Err(Error::invalid(
        format!("{path}.damping[{at}]"),
        format!("{value}"),
        "give a finite ratio of at least 0",
    ))
}

fn table(given: &TabulatedShape, length: f64, path: &str) -> Result<Spline, Error> {
    let spline = Spline::new(&given.x, &given.phi, path)?;
    let slack = 1e-9 * length;
    let (first, last) = spline.range();
    if first.abs() > slack || (last - length).abs() > slack {
        return Err(Error::invalid(
            format!("{path}.x"),
            format!("points from {first} m to {last} m"),
            format!("give points from 0 to the span length {length} m"),
        ));
    }
    let largest = given.phi.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    let ends = given.phi[0].abs().max(given.phi[given.phi.len() - 1].abs());
    if ends > 1e-6 * largest || largest == 0.0 {
        return Err(Error::invalid(
            format!("{path}.phi"),
            format!("{} and {} at the ends", given.phi[0], given.phi[given.phi.len() - 1]),
            "phi must be 0 at both ends, where the span is supported, and not 0 everywhere",
        ));
    }
    Ok(spline)
}
