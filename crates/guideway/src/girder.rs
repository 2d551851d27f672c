//! One kind of span with its modes: shapes, modal masses, stiffnesses, damping.

use std::f64::consts::PI;

use crate::beam::BeamModes;
use crate::check::{at_least_zero, positive};
use crate::cubics::PiecewiseCubics;
use crate::description::{GirderDescription, TabulatedShape};
use crate::shapes::{ModeShapes, ShapeRow};
use crate::{Error, GirderMode, Pole, Spline};

/// Most modes of one span.
pub const MAX_MODES: usize = 200;

/// A kind of span, checked and ready for use.
#[derive(Debug, Clone, PartialEq)]
pub struct Girder {
    length: f64,
    /// Natural frequencies (Hz) before the factors on stiffness and mass.
    frequencies: Vec<f64>,
    /// Damping ratios of the structure, without dampers of supports.
    structural: Vec<f64>,
    modes: Vec<GirderMode>,
    coupling: Option<DampingCoupling>,
    shapes: ModeShapes,
    /// Largest wavenumber of a mode shape (rad/m).
    wavenumber: f64,
}

/// How dampers of supports couple the modes: q̈ᵢ also has −Σⱼ cᵢⱼ·q̇ⱼ, j ≠ i.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct DampingCoupling {
    /// cᵢⱼ (1/s) row by row, 0 on the diagonal, which is in the modes' damping ratios.
    rates: Vec<f64>,
    modes: usize,
}

impl DampingCoupling {
    /// From the rates of `modes` modes, row by row.
    pub fn new(rates: Vec<f64>, modes: usize) -> Self {
        Self { rates, modes }
    }

    /// The row of mode i.
    pub fn row(&self, i: usize) -> &[f64] {
        &self.rates[i * self.modes..(i + 1) * self.modes]
    }
}

/// What the three sources of modes have in common.
struct Modal {
    masses: Vec<f64>,
    frequencies: Vec<f64>,
    shapes: ModeShapes,
    /// Modal damping matrix of supports (N·s/m), row by row; empty without supports.
    damping: Vec<f64>,
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
        check_sources(given, path)?;
        let count = given.mode_count();
        if !(1..=MAX_MODES).contains(&count) {
            return Err(Error::invalid(
                format!("{path}.modes"),
                format!("{count} modes"),
                format!("give a count from 1 to {MAX_MODES}"),
            ));
        }
        for (name, value) in
            [("stiffness_factor", given.stiffness_factor), ("mass_factor", given.mass_factor)]
        {
            if !(value > 0.0 && value.is_finite()) {
                return Err(Error::invalid(
                    format!("{path}.{name}"),
                    format!("{value}"),
                    "give a positive finite factor",
                ));
            }
        }
        let modal = match &given.shapes {
            _ if given.is_beam() => Modal::beam(given, count, path)?,
            Some(tables) => Modal::tables(given, tables, count, path)?,
            None => Modal::sine(given, count, pole, path)?,
        };
        let structural = (1..=count)
            .map(|n| damping_ratio(given, n, path))
            .collect::<Result<Vec<_>, Error>>()?;
        let stiffness_factor = factors.0 * given.stiffness_factor;
        let mass_factor = factors.1 * given.mass_factor;
        let root = (stiffness_factor / mass_factor).sqrt();
        let modes = (0..count)
            .map(|n| {
                // what dampers of supports add, before the factors, which keep damping ratios
                let critical = 4.0 * PI * modal.frequencies[n] * modal.masses[n];
                let added = modal.damping.get(n * (count + 1)).map_or(0.0, |c| c / critical);
                GirderMode {
                    mass: mass_factor * modal.masses[n],
                    omega: 2.0 * PI * root * modal.frequencies[n],
                    zeta: structural[n] + added,
                }
            })
            .collect();
        let coupling = modal.coupling(root);
        let Modal { frequencies, shapes, wavenumber, .. } = modal;
        let length = given.length;
        Ok(Self { length, frequencies, structural, modes, coupling, shapes, wavenumber })
    }

    /// Span length L (m).
    pub fn length(&self) -> f64 {
        self.length
    }

    /// Natural frequencies of the modes (Hz) before the factors on stiffness and mass.
    pub fn frequencies(&self) -> &[f64] {
        &self.frequencies
    }

    /// Damping ratios of the structure (1): those of the description, without dampers of supports.
    pub fn structural_damping(&self) -> &[f64] {
        &self.structural
    }

    /// The modes, first one first, with all factors and the dampers of supports.
    pub fn modes(&self) -> &[GirderMode] {
        &self.modes
    }

    /// The coupling of the modes by dampers of supports, if there are any.
    pub(crate) fn coupling(&self) -> Option<&DampingCoupling> {
        self.coupling.as_ref()
    }

    /// How the accelerations of the modes change with the rate of mode `j`: −2ζⱼωⱼ for itself, and
    /// for others what dampers of supports couple (1/s).
    pub fn damping_rates(&self, j: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let mode = &self.modes[j];
        let coupled = move |i: usize| self.coupling.as_ref().map_or(0.0, |c| -c.row(i)[j]);
        let own = -2.0 * mode.zeta * mode.omega;
        (0..self.modes.len()).map(move |i| (i, if i == j { own } else { coupled(i) }))
    }

    /// Largest wavenumber of a mode shape (rad/m).
    pub(crate) fn wavenumber(&self) -> f64 {
        self.wavenumber
    }

    /// The mode shapes.
    pub(crate) fn shapes(&self) -> &ModeShapes {
        &self.shapes
    }

    /// φₙ(x) at a single place, 0 ≤ x ≤ L.
    pub(crate) fn shape_at(&self, x: f64, row: &mut ShapeRow) {
        self.shapes.at(x, row);
    }
}

impl Modal {
    fn sine(
        given: &GirderDescription,
        count: usize,
        pole: &Pole,
        path: &str,
    ) -> Result<Self, Error> {
        let frequencies = imposed_frequencies(given, count, path)?;
        let density = given.mass_per_length.ok_or_else(|| {
            Error::invalid(
                format!("{path}.mass_per_length"),
                "missing",
                "give the mass per length (kg/m), or mode shapes with modal masses",
            )
        })?;
        let mass = positive(density, path, "mass_per_length", "kg/m")? * given.length / 2.0;
        let base = PI / given.length;
        Ok(Self {
            masses: vec![mass; count],
            frequencies,
            shapes: ModeShapes::sine(given.length, count, pole),
            damping: Vec::new(),
            wavenumber: base * count as f64,
        })
    }

    fn tables(
        given: &GirderDescription,
        tables: &[TabulatedShape],
        count: usize,
        path: &str,
    ) -> Result<Self, Error> {
        let frequencies = imposed_frequencies(given, count, path)?;
        if tables.len() < count {
            return Err(Error::invalid(
                format!("{path}.shapes"),
                format!("{} mode shapes for {count} modes", tables.len()),
                "give one table per mode or fewer modes",
            ));
        }
        let tables = &tables[..count];
        let mut masses = Vec::new();
        let mut splines = Vec::new();
        for (n, given_shape) in tables.iter().enumerate() {
            let name = format!("shapes[{n}].modal_mass");
            masses.push(positive(given_shape.modal_mass, path, &name, "kg")?);
            splines.push(table(given_shape, given, &format!("{path}.shapes[{n}]"))?);
        }
        let shapes = if given.elastic_ends {
            ModeShapes::Cubics(PiecewiseCubics::of_splines(&splines, given.length))
        } else {
            ModeShapes::Tables(splines)
        };
        let wavenumber = PI / given.length * count as f64;
        Ok(Self { masses, frequencies, shapes, damping: Vec::new(), wavenumber })
    }

    fn beam(given: &GirderDescription, count: usize, path: &str) -> Result<Self, Error> {
        let beam = BeamModes::new(given, count, path)?;
        let mut frequencies = beam.frequencies;
        for (n, (frequency, &imposed)) in frequencies.iter_mut().zip(&given.frequencies).enumerate()
        {
            at_least_zero(imposed, path, &format!("frequencies[{n}]"), "Hz")?;
            if imposed > 0.0 {
                *frequency = imposed;
            }
        }
        Ok(Self {
            masses: beam.masses,
            frequencies,
            shapes: ModeShapes::Cubics(beam.shapes),
            damping: beam.damping,
            wavenumber: beam.wavenumber.max(PI / given.length * count as f64),
        })
    }

    /// The coupling by dampers of supports; `root` is the factor on all frequencies, which damping
    /// matrices follow so that damping ratios stay.
    fn coupling(&self, root: f64) -> Option<DampingCoupling> {
        let modes = self.masses.len();
        let rate = |k: usize| {
            let (i, j) = (k / modes, k % modes);
            if i == j { 0.0 } else { root * self.damping[k] / self.masses[i] }
        };
        let rates: Vec<f64> = (0..self.damping.len()).map(rate).collect();
        rates.iter().any(|&r| r != 0.0).then(|| DampingCoupling::new(rates, modes))
    }
}

/// Refuses keys that would have no effect.
fn check_sources(given: &GirderDescription, path: &str) -> Result<(), Error> {
    let fail = |name: &str, found: &str, remedy: &str| {
        Err(Error::invalid(format!("{path}.{name}"), found, remedy))
    };
    if let Some(file) = &given.shapes_file {
        let found = format!("the content of `{file}` was not passed");
        return fail("shapes_file", &found, "read the file and pass its text");
    }
    if !given.modal_masses.is_empty() {
        return fail(
            "modal_masses",
            "given without shapes_file",
            "give them with `shapes_file`; each item of `shapes` has its own modal_mass",
        );
    }
    if given.shapes.is_some() && given.is_beam() {
        return fail(
            "shapes",
            "given together with supports, sections, hinges, shear_stiffness, rotary_inertia or \
             elements, from which shapes are computed",
            "remove one or the other",
        );
    }
    if given.elastic_ends && given.shapes.is_none() {
        return fail(
            "elastic_ends",
            "true without tabulated shapes",
            "remove it, or give `shapes` or `shapes_file`; computed shapes move where supports do",
        );
    }
    Ok(())
}

fn imposed_frequencies(
    given: &GirderDescription,
    count: usize,
    path: &str,
) -> Result<Vec<f64>, Error> {
    (1..=count).map(|n| frequency(given, n, path)).collect()
}

fn frequency(given: &GirderDescription, n: usize, path: &str) -> Result<f64, Error> {
    let order = n as f64;
    let value = if let Some(&imposed) = given.frequencies.get(n - 1) {
        imposed
    } else if let (Some(stiffness), Some(density)) =
        (given.bending_stiffness, given.mass_per_length)
    {
        positive(stiffness, path, "bending_stiffness", "N·m²")?;
        positive(density, path, "mass_per_length", "kg/m")?;
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

fn table(shape: &TabulatedShape, girder: &GirderDescription, path: &str) -> Result<Spline, Error> {
    let length = girder.length;
    let spline = Spline::new(&shape.x, &shape.phi, path)?;
    let slack = 1e-9 * length;
    let (first, last) = spline.range();
    if first.abs() > slack || (last - length).abs() > slack {
        return Err(Error::invalid(
            format!("{path}.x"),
            format!("points from {first} m to {last} m"),
            format!("give points from 0 to the span length {length} m"),
        ));
    }
    let largest = shape.phi.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    let ends = shape.phi[0].abs().max(shape.phi[shape.phi.len() - 1].abs());
    let held = girder.elastic_ends || ends <= 1e-6 * largest;
    if !held || largest == 0.0 {
        return Err(Error::invalid(
            format!("{path}.phi"),
            format!("{} and {} at the ends", shape.phi[0], shape.phi[shape.phi.len() - 1]),
            "phi must be 0 at both ends, where the span is supported, unless `elastic_ends` is \
             true, and not 0 everywhere",
        ));
    }
    Ok(spline)
}
