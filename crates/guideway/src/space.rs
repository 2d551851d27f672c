//! Modes of lateral bending and torsion, and modes that do several things at once.

use std::f64::consts::PI;

use crate::beam::TwistModes;
use crate::check::{at_least_zero, positive};
use crate::description::{GirderDescription, TabulatedShape, TorsionDescription};
use crate::girder::{Modal, damping_ratios};
use crate::shapes::ModeShapes;
use crate::{Error, Pole, Spline};

/// Shapes of one component of motion of neighbouring modes.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Family {
    pub shapes: ModeShapes,
    /// Index of the first mode.
    pub first: usize,
    pub modes: usize,
}

impl Family {
    pub fn new(shapes: ModeShapes, first: usize, modes: usize) -> Self {
        Self { shapes, first, modes }
    }
}

/// A part with the damping ratios of the structure.
type Part = (Modal, Vec<f64>);

/// Replaces computed frequencies by given ones that are not 0.
pub(crate) fn impose(frequencies: &mut [f64], given: &[f64], path: &str) -> Result<(), Error> {
    for (n, (frequency, &imposed)) in frequencies.iter_mut().zip(given).enumerate() {
        at_least_zero(imposed, path, &format!("frequencies[{n}]"), "Hz")?;
        if imposed > 0.0 {
            *frequency = imposed;
        }
    }
    Ok(())
}

/// Lateral bending, if the girder has it.
pub(crate) fn lateral(
    given: &GirderDescription,
    pole: &Pole,
    path: &str,
) -> Result<Option<Part>, Error> {
    let Some(lateral) = &given.lateral else { return Ok(None) };
    if given.shapes.iter().flatten().any(|shape| !shape.y.is_empty()) {
        return Err(twice(path, "lateral", "y"));
    }
    let own = format!("{path}.lateral");
    let count = counted(lateral.mode_count(), &own)?;
    let beam = given.is_beam();
    let lacks = |s: &crate::description::SectionDescription| s.lateral_bending_stiffness.is_none();
    if beam && lateral.bending_stiffness.is_none() {
        let all = given.sections.iter().position(lacks);
        if all.is_some() || given.sections.is_empty() {
            return Err(Error::invalid(
                format!("{own}.bending_stiffness"),
                "missing",
                "give it (N·m²), or `lateral_bending_stiffness` of every section",
            ));
        }
    }
    for (k, support) in given.supports.iter().flatten().enumerate() {
        if support.lateral_free
            && (support.lateral_stiffness.is_some() || support.lateral_damping != 0.0)
        {
            return Err(Error::invalid(
                format!("{path}.supports[{k}].lateral_free"),
                "true, with a lateral stiffness or damping",
                "remove one of them",
            ));
        }
    }
    let seen = given.seen_from_above(lateral);
    let modal = if beam {
        Modal::beam(&seen, count, &own)?
    } else {
        Modal::sine(&seen, count, pole, &own)?
    };
    let damping = damping_ratios(&seen.damping, count, &own)?;
    Ok(Some((modal, damping)))
}

/// Torsion alone, if the girder has it and is straight.
pub(crate) fn torsion(
    given: &GirderDescription,
    pole: &Pole,
    path: &str,
) -> Result<Option<Part>, Error> {
    let Some(torsion) = &given.torsion else { return Ok(None) };
    let own = format!("{path}.torsion");
    if given.radius.is_some() {
        let idle = torsion.modes.is_some() || !torsion.frequencies.is_empty();
        if idle || !torsion.damping.is_empty() {
            return Err(Error::invalid(
                own,
                "modes, frequencies or damping of a girder with a radius",
                "give those of the girder: bending and torsion are coupled",
            ));
        }
        return Ok(None);
    }
    if given.shapes.iter().flatten().any(|shape| !shape.theta.is_empty()) {
        return Err(twice(path, "torsion", "theta"));
    }
    let count = counted(torsion.mode_count(), &own)?;
    let modal = if given.is_beam() {
        let modes = TwistModes::straight(given, torsion, count, path)?;
        of_twist(modes, &torsion.frequencies, given.length, &own)?
    } else {
        sines(given, torsion, count, pole, &own)?
    };
    let damping = if torsion.damping.is_empty() { &given.damping } else { &torsion.damping };
    Ok(Some((modal, damping_ratios(damping, count, &own)?)))
}

/// Bending and torsion of a girder that is curved in plan.
pub(crate) fn curved(given: &GirderDescription, count: usize, path: &str) -> Result<Modal, Error> {
    let Some(torsion) = &given.torsion else {
        return Err(Error::invalid(
            format!("{path}.torsion"),
            "missing",
            "a girder with a `radius` needs its `torsional_stiffness` and `polar_inertia`",
        ));
    };
    let modes = TwistModes::curved(given, torsion, count, path)?;
    of_twist(modes, &given.frequencies, given.length, path)
}

fn of_twist(modes: TwistModes, imposed: &[f64], length: f64, path: &str) -> Result<Modal, Error> {
    let count = modes.masses.len();
    let mut frequencies = modes.frequencies;
    impose(&mut frequencies, imposed, path)?;
    let twist = ModeShapes::Cubics(modes.twist);
    let (shapes, mixed) = match modes.deflection {
        Some(deflection) => (ModeShapes::Cubics(deflection), [None, Some(twist)]),
        None => (twist, [None, None]),
    };
    Ok(Modal {
        masses: modes.masses,
        frequencies,
        shapes,
        damping: modes.damping,
        wavenumber: modes.wavenumber.max(PI / length * count as f64),
        mixed,
    })
}

/// Fork supports: θₙ = sin(nπx/L), ωₙ² = (EI_w·k⁴ + GJ·k²)/(ρI_p), modal masses ρI_p·L/2.
fn sines(
    given: &GirderDescription,
    torsion: &TorsionDescription,
    count: usize,
    pole: &Pole,
    path: &str,
) -> Result<Modal, Error> {
    let inertia = torsion.polar_inertia.ok_or_else(|| {
        Error::invalid(
            format!("{path}.polar_inertia"),
            "missing",
            "give ρ·I_p per length (kg·m): the density times the sum of both second moments of area",
        )
    })?;
    positive(inertia, path, "polar_inertia", "kg·m")?;
    let warping =
        at_least_zero(torsion.warping_stiffness.unwrap_or(0.0), path, "warping_stiffness", "N·m⁴")?;
    let base = PI / given.length;
    let frequency = |n: usize| {
        let order = (n + 1) as f64;
        let value = if let Some(&imposed) = torsion.frequencies.get(n) {
            at_least_zero(imposed, path, &format!("frequencies[{n}]"), "Hz")?
        } else if let Some(stiffness) = torsion.torsional_stiffness {
            positive(stiffness, path, "torsional_stiffness", "N·m²")?;
            let k = (base * order).powi(2);
            (k * (warping * k + stiffness) / inertia).sqrt() / (2.0 * PI)
        } else if let Some(&first) = torsion.frequencies.first() {
            order * first
        } else {
            return Err(Error::invalid(
                format!("{path}.torsional_stiffness"),
                "missing",
                "give it (N·m²), or at least the first of `frequencies` (Hz)",
            ));
        };
        Ok(value)
    };
    Ok(Modal {
        masses: vec![inertia * given.length / 2.0; count],
        frequencies: (0..count).map(frequency).collect::<Result<_, Error>>()?,
        shapes: ModeShapes::sine(given.length, count, pole),
        damping: Vec::new(),
        wavenumber: base * count as f64,
        mixed: [None, None],
    })
}

fn counted(count: usize, path: &str) -> Result<usize, Error> {
    if (1..=crate::MAX_MODES).contains(&count) {
        return Ok(count);
    }
    Err(Error::invalid(
        format!("{path}.modes"),
        format!("{count} modes"),
        format!("give a count from 1 to {}, or remove `{path}`", crate::MAX_MODES),
    ))
}

fn twice(path: &str, name: &str, column: &str) -> Error {
    Error::invalid(
        format!("{path}.{name}"),
        format!("given, although `{column}` of tabulated shapes has it already"),
        format!("remove `{name}`, or the columns {column}"),
    )
}

/// Vertical deflection, lateral deflection and twist of a tabulated shape.
pub(crate) fn tables(
    shape: &TabulatedShape,
    girder: &GirderDescription,
    path: &str,
) -> Result<[Spline; 3], Error> {
    let zero = vec![0.0; shape.x.len()];
    let mut moves = false;
    let mut table = |name: &str, values: &[f64]| {
        let values = if values.is_empty() && name != "phi" { &zero } else { values };
        let spline = Spline::new(&shape.x, values, &format!("{path}.{name}"))?;
        let largest = values.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        let (first, last) = (values[0], values[values.len() - 1]);
        if !girder.elastic_ends && first.abs().max(last.abs()) > 1e-6 * largest {
            return Err(ends(path, name, first, last));
        }
        moves |= largest > 0.0;
        Ok(spline)
    };
    let splines = [table("phi", &shape.phi)?, table("y", &shape.y)?, table("theta", &shape.theta)?];
    let slack = 1e-9 * girder.length;
    let (first, last) = splines[0].range();
    if first.abs() > slack || (last - girder.length).abs() > slack {
        return Err(Error::invalid(
            format!("{path}.x"),
            format!("points from {first} m to {last} m"),
            format!("give points from 0 to the span length {} m", girder.length),
        ));
    }
    if !moves {
        return Err(ends(path, "phi", shape.phi[0], shape.phi[shape.phi.len() - 1]));
    }
    Ok(splines)
}

fn ends(path: &str, name: &str, first: f64, last: f64) -> Error {
    Error::invalid(
        format!("{path}.{name}"),
        format!("{first} and {last} at the ends"),
        format!(
            "{name} must be 0 at both ends, where the span is supported, unless `elastic_ends` is \
             true, and the shape not 0 everywhere"
        ),
    )
}
