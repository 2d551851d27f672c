//! One kind of span with its modes: shapes, modal masses, stiffnesses, damping.

use std::f64::consts::PI;

use crate::beam::BeamModes;
use crate::check::positive;
use crate::cubics::PiecewiseCubics;
use crate::description::{GirderDescription, TabulatedShape};
use crate::shapes::{ModeShapes, ShapeRow};
use crate::space::{self, Family};
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
    /// Number of modes of each part: [`GirderPart`].
    parts: [usize; 3],
    /// Vertical deflection of the modes of the first part.
    shapes: ModeShapes,
    /// Lateral deflection of the modes that have one.
    lateral: Option<Family>,
    /// Twist of the modes that have one.
    twist: Option<Family>,
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

/// Groups of modes of a girder, in their order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GirderPart {
    /// Vertical bending; with tables or a radius also modes that bend laterally and twist at the same time.
    Vertical,
    /// Lateral bending alone.
    Lateral,
    /// Torsion alone; their coordinates are in rad, their modal masses in kg·m².
    Torsion,
}

impl GirderPart {
    /// All of them, in order.
    pub const ALL: [Self; 3] = [Self::Vertical, Self::Lateral, Self::Torsion];

    /// What stands before "mode 1" in names.
    pub fn prefix(self) -> &'static str {
        match self {
            Self::Vertical => "",
            Self::Lateral => "lateral ",
            Self::Torsion => "torsion ",
        }
    }
}

/// What the sources of modes have in common.
pub(crate) struct Modal {
    pub masses: Vec<f64>,
    pub frequencies: Vec<f64>,
    /// What the part is named after: vertical or lateral deflection, or twist.
    pub shapes: ModeShapes,
    /// Modal damping matrix of supports (N·s/m), row by row; empty without supports.
    pub damping: Vec<f64>,
    pub wavenumber: f64,
    /// Lateral deflection and twist of the same modes, if they have them.
    pub mixed: [Option<ModeShapes>; 2],
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
            _ if given.radius.is_some() => space::curved(given, count, path)?,
            _ if given.is_beam() => Modal::beam(given, count, path)?,
            Some(tables) => Modal::tables(given, tables, count, path)?,
            None => Modal::sine(given, count, pole, path)?,
        };
        let mut all = vec![(modal, damping_ratios(&given.damping, count, path)?)];
        all.extend(space::lateral(given, pole, path)?);
        let lateral = all.len() - 1;
        all.extend(space::torsion(given, pole, path)?);
        let counts: Vec<usize> = all.iter().map(|(modal, _)| modal.masses.len()).collect();
        let total: usize = counts.iter().sum();
        if total > MAX_MODES {
            return Err(Error::invalid(
                format!("{path}.modes"),
                format!("{total} modes with those of lateral bending and torsion"),
                format!("give at most {MAX_MODES} in all"),
            ));
        }
        let parts = [
            count,
            if lateral == 1 { counts[1] } else { 0 },
            counts.get(lateral + 1).copied().unwrap_or(0),
        ];
        let stiffness_factor = factors.0 * given.stiffness_factor;
        let mass_factor = factors.1 * given.mass_factor;
        let root = (stiffness_factor / mass_factor).sqrt();
        let mode = |(modal, structural): &(Modal, Vec<f64>), n: usize| {
            // what dampers of supports add, before the factors, which keep damping ratios
            let critical = 4.0 * PI * modal.frequencies[n] * modal.masses[n];
            let own = modal.damping.get(n * (modal.masses.len() + 1));
            let added = own.map_or(0.0, |c| c / critical);
            GirderMode {
                mass: mass_factor * modal.masses[n],
                omega: 2.0 * PI * root * modal.frequencies[n],
                zeta: structural[n] + added,
            }
        };
        let modes = all.iter().flat_map(|p| (0..p.1.len()).map(move |n| mode(p, n))).collect();
        let coupling = coupling(&all, root);
        let wavenumber = all.iter().map(|(modal, _)| modal.wavenumber).fold(0.0, f64::max);
        let frequencies = all.iter().flat_map(|(modal, _)| modal.frequencies.clone()).collect();
        let structural = all.iter().flat_map(|(_, damping)| damping.clone()).collect();
        let mut all = all.into_iter().map(|(modal, _)| modal);
        let Some(Modal { shapes, mixed: [y, theta], .. }) = all.next() else {
            return Err(Error::invalid(format!("{path}.modes"), "none", "give at least one"));
        };
        let [mut lateral, mut twist] = [y, theta].map(|s| s.map(|s| Family::new(s, 0, count)));
        for (part, family) in [(1, &mut lateral), (2, &mut twist)] {
            if parts[part] > 0 {
                let first = parts[..part].iter().sum();
                *family = all.next().map(|modal| Family::new(modal.shapes, first, parts[part]));
            }
        }
        let length = given.length;
        Ok(Self {
            length,
            frequencies,
            structural,
            modes,
            coupling,
            parts,
            shapes,
            lateral,
            twist,
            wavenumber,
        })
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

    /// The modes that deflect vertically at the shear centre: those of the part [`GirderPart::Vertical`].
    pub fn vertical_modes(&self) -> &[GirderMode] {
        &self.modes[..self.parts[0]]
    }

    /// Indices of the modes of a part.
    pub fn part(&self, part: GirderPart) -> std::ops::Range<usize> {
        let first = self.parts[..part as usize].iter().sum();
        first..first + self.parts[part as usize]
    }

    /// The part of mode `n` (from 0), and its number within the part, from 1.
    pub fn place_of(&self, n: usize) -> (GirderPart, usize) {
        let of = |part: GirderPart| Some((part, n.checked_sub(self.part(part).start)? + 1));
        let found = GirderPart::ALL.into_iter().filter(|p| self.part(*p).contains(&n)).find_map(of);
        found.unwrap_or((GirderPart::Vertical, n + 1))
    }

    /// Whether one mode does several things at once: those of tables, or of a girder with a radius.
    pub fn mixes(&self) -> bool {
        [&self.lateral, &self.twist].into_iter().flatten().any(|family| family.first == 0)
    }

    /// Whether any mode bends laterally or twists.
    pub fn is_spatial(&self) -> bool {
        self.lateral.is_some() || self.twist.is_some()
    }

    /// Shapes of a component of motion, the first mode that has it, and how many do: 0 vertical, 1 lateral,
    /// 2 twist.
    pub(crate) fn component(&self, k: usize) -> Option<(&ModeShapes, usize, usize)> {
        let family = match k {
            0 => return Some((&self.shapes, 0, self.parts[0])),
            1 => self.lateral.as_ref()?,
            _ => self.twist.as_ref()?,
        };
        Some((&family.shapes, family.first, family.modes))
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

    /// Whether the force of a pole is spread evenly for any component of motion.
    pub(crate) fn spread_evenly(&self) -> bool {
        (0..3).filter_map(|k| self.component(k)).any(|(shapes, ..)| shapes.spread_evenly())
    }

    /// Vertical deflections of the modes of the first part.
    pub(crate) fn shapes(&self) -> &ModeShapes {
        &self.shapes
    }

    /// φₙ(x) at a single place, 0 ≤ x ≤ L.
    pub(crate) fn shape_at(&self, x: f64, row: &mut ShapeRow) {
        self.shapes.at(x, row);
    }
}

impl Modal {
    pub(crate) fn sine(
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
            mixed: [None, None],
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
        let mut splines: [Vec<Spline>; 3] = Default::default();
        for (n, given_shape) in tables.iter().enumerate() {
            let name = format!("shapes[{n}].modal_mass");
            masses.push(positive(given_shape.modal_mass, path, &name, "kg")?);
            let tables = space::tables(given_shape, given, &format!("{path}.shapes[{n}]"))?;
            splines.iter_mut().zip(tables).for_each(|(all, own)| all.push(own));
        }
        let has =
            |of: &dyn Fn(&TabulatedShape) -> &Vec<f64>| tables.iter().any(|t| !of(t).is_empty());
        let mixed = [has(&|t| &t.y), has(&|t| &t.theta)];
        let [z, y, theta] = splines.map(|splines| {
            if given.elastic_ends {
                ModeShapes::Cubics(PiecewiseCubics::of_splines(&splines, given.length))
            } else {
                ModeShapes::Tables(splines)
            }
        });
        let wavenumber = PI / given.length * count as f64;
        let mixed = [mixed[0].then_some(y), mixed[1].then_some(theta)];
        Ok(Self { masses, frequencies, shapes: z, damping: Vec::new(), wavenumber, mixed })
    }

    pub(crate) fn beam(given: &GirderDescription, count: usize, path: &str) -> Result<Self, Error> {
        let beam = BeamModes::new(given, count, path)?;
        let mut frequencies = beam.frequencies;
        space::impose(&mut frequencies, &given.frequencies, path)?;
        Ok(Self {
            masses: beam.masses,
            frequencies,
            shapes: ModeShapes::Cubics(beam.shapes),
            damping: beam.damping,
            wavenumber: beam.wavenumber.max(PI / given.length * count as f64),
            mixed: [None, None],
        })
    }
}

/// The coupling by dampers of supports, part by part; `root` is the factor on all frequencies, which
/// damping matrices follow so that damping ratios stay.
fn coupling(all: &[(Modal, Vec<f64>)], root: f64) -> Option<DampingCoupling> {
    let total: usize = all.iter().map(|(modal, _)| modal.masses.len()).sum();
    let (mut rates, mut first) = (vec![0.0; total * total], 0);
    for (modal, _) in all {
        let modes = modal.masses.len();
        for (k, damping) in modal.damping.iter().enumerate() {
            let (i, j) = (k / modes, k % modes);
            if i != j {
                rates[(first + i) * total + first + j] = root * damping / modal.masses[i];
            }
        }
        first += modes;
    }
    rates.iter().any(|&r| r != 0.0).then(|| DampingCoupling::new(rates, total))
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
    if !given.components.is_empty() {
        return fail("components", "given without shapes_file", "remove it, or give `shapes_file`");
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

/// One ratio per mode; beyond the list its last entry.
pub(crate) fn damping_ratios(given: &[f64], count: usize, path: &str) -> Result<Vec<f64>, Error> {
    let ratio = |n: usize| {
        let at = n.min(given.len().saturating_sub(1));
        let value = *given.get(at).ok_or_else(|| {
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
    };
    (0..count).map(ratio).collect()
}
