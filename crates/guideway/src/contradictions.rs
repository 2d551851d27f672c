//! Values of a layout file that can be computed with, but contradict each other: slips of the one who wrote it.

use std::f64::consts::PI;

use crate::Error;
use crate::description::{GirderDescription, GuidewayDescription, TabulatedShape};

/// Most by which a given frequency may differ from that of the given stiffness. Beyond it the modes of a simply supported
/// girder come in another order.
const MAX_RATIO: f64 = 4.0;

impl GuidewayDescription {
    /// Refuses contradictions. Parameters of a unit may go further, on purpose.
    ///
    /// # Errors
    /// [`Error::Invalid`] with the path of the value.
    pub(crate) fn check_contradictions(&self) -> Result<(), Error> {
        for (name, girder) in &self.girders {
            let path = format!("girders.{name}");
            if self.girders.len() > 1 && !is_identifier(name) {
                return Err(Error::invalid(
                    path,
                    format!("the name `{name}`"),
                    "variables of the unit begin with it: use letters, digits and underscores, a letter first",
                ));
            }
            check_frequencies(girder, &path)?;
            check_damping(girder, &path)?;
            check_rotary_inertia(girder, &path)?;
            if let Some(shapes) = &girder.shapes {
                let all = |s: &TabulatedShape| {
                    let part =
                        |p: &[f64]| if p.is_empty() { vec![0.0; s.x.len()] } else { p.to_vec() };
                    [s.phi.clone(), part(&s.y), part(&s.theta)].concat()
                };
                let all: Vec<Vec<f64>> = shapes.iter().map(all).collect();
                let columns: Vec<&[f64]> = all.iter().map(Vec::as_slice).collect();
                let same_points = |i: usize, j: usize| shapes[i].x == shapes[j].x;
                check_distinct(&columns, same_points, |n| format!("{path}.shapes[{n}].phi"))?;
            }
        }
        Ok(())
    }
}

fn is_identifier(name: &str) -> bool {
    let mut letters = name.chars();
    letters.next().is_some_and(|c| c.is_ascii_alphabetic() || c == '_')
        && letters.all(|c| c.is_ascii_alphanumeric() || c == '_')
}

fn check_frequencies(girder: &GirderDescription, path: &str) -> Result<(), Error> {
    if girder.shapes.is_some() || girder.shapes_file.is_some() {
        // each has its own shape, whatever the order
        return Ok(());
    }
    // 0 stands for a computed frequency
    let given = || girder.frequencies.iter().enumerate().filter(|(_, f)| **f > 0.0);
    for ((_, before), (n, frequency)) in given().zip(given().skip(1)) {
        if frequency < before {
            return Err(Error::invalid(
                format!("{path}.frequencies[{n}]"),
                format!("{frequency} Hz after {before} Hz"),
                "give the frequencies in ascending order, first mode first",
            ));
        }
    }
    let (Some(stiffness), Some(density)) = (girder.bending_stiffness, girder.mass_per_length)
    else {
        return Ok(());
    };
    if girder.is_beam() {
        return Ok(());
    }
    for (n, &frequency) in given() {
        let order = (n + 1) as f64;
        let computed = 0.5 * PI * (order / girder.length).powi(2) * (stiffness / density).sqrt();
        let ratio = frequency / computed;
        // not a number: refused later, with its reason
        if !ratio.is_nan() && !(1.0 / MAX_RATIO..=MAX_RATIO).contains(&ratio) {
            return Err(Error::invalid(
                format!("{path}.frequencies[{n}]"),
                format!(
                    "{frequency} Hz, but bending_stiffness and mass_per_length give {computed:.3e} Hz"
                ),
                "correct one of them, or remove bending_stiffness",
            ));
        }
    }
    Ok(())
}

fn check_damping(girder: &GirderDescription, path: &str) -> Result<(), Error> {
    match girder.damping.iter().position(|&ratio| ratio >= 1.0) {
        Some(n) => Err(Error::invalid(
            format!("{path}.damping[{n}]"),
            format!("{}", girder.damping[n]),
            "give a damping ratio below 1; 1 % is 0.01",
        )),
        None => Ok(()),
    }
}

/// The radius of gyration of a cross-section is below the girder's length.
fn check_rotary_inertia(girder: &GirderDescription, path: &str) -> Result<(), Error> {
    let sections = girder.sections.iter().enumerate().map(|(k, section)| {
        (format!("{path}.sections[{k}]"), section.rotary_inertia, section.mass_per_length)
    });
    let own = (path.to_owned(), girder.rotary_inertia, girder.mass_per_length);
    for (path, rotary, mass) in std::iter::once(own).chain(sections) {
        let (Some(rotary), Some(mass)) = (rotary, mass.or(girder.mass_per_length)) else {
            continue;
        };
        let radius = (rotary / mass).sqrt();
        if radius > girder.length {
            return Err(Error::invalid(
                format!("{path}.rotary_inertia"),
                format!(
                    "{rotary} kg·m, with {mass} kg/m a radius of gyration of {radius:.3e} m, longer than the girder"
                ),
                "give the density times the second moment of area of the cross-section",
            ));
        }
    }
    Ok(())
}

/// Refuses shapes that are multiples of each other: one mode would count twice.
pub(crate) fn check_distinct(
    columns: &[&[f64]],
    same_points: impl Fn(usize, usize) -> bool,
    path: impl Fn(usize) -> String,
) -> Result<(), Error> {
    for (j, b) in columns.iter().enumerate() {
        let same = columns[..j]
            .iter()
            .enumerate()
            .position(|(i, a)| a.len() == b.len() && same_points(i, j) && are_multiples(a, b));
        if let Some(i) = same {
            return Err(Error::invalid(
                path(j),
                format!("the same shape as that of mode {}, apart from a factor", i + 1),
                "remove one of them, with its frequency, damping and modal mass",
            ));
        }
    }
    Ok(())
}

/// Whether b = c·a to the digits of a table.
fn are_multiples(a: &[f64], b: &[f64]) -> bool {
    let largest = a.iter().zip(b).max_by(|x, y| x.0.abs().total_cmp(&y.0.abs()));
    let Some((&peak, &other)) = largest.filter(|(peak, _)| **peak != 0.0) else { return false };
    let limit = 1e-6 * other.abs();
    limit > 0.0 && a.iter().zip(b).all(|(a, b)| (b - a / peak * other).abs() <= limit)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(girder: &str) -> Result<GuidewayDescription, String> {
        let text = format!(
            r#"{{"girders": {{"g": {{"length": 30, "mass_per_length": 2100, {girder}}}}},
                "spans": [{{"girder": "g"}}], "magnets": 1}}"#
        );
        GuidewayDescription::from_json(&text).map_err(|error| error.to_string())
    }

    #[test]
    fn refusal_of_contradictions_has_path_and_reason() {
        for (girder, parts) in [
            (
                r#""frequencies": [17, 4.8], "damping": [0.01]"#,
                ["girders.g.frequencies[1]", "4.8 Hz after 17 Hz"],
            ),
            (
                r#""frequencies": [6, 0, 5], "damping": [0.01], "elements": 60"#,
                ["girders.g.frequencies[2]", "ascending"],
            ),
            (
                r#""frequencies": [4.8], "damping": [0.01], "bending_stiffness": 1e20"#,
                ["girders.g.frequencies[0]", "give 3.809e5 Hz"],
            ),
            (
                r#""frequencies": [4.8], "damping": [0.01, 1.5]"#,
                ["girders.g.damping[1]", "below 1"],
            ),
            (
                r#""bending_stiffness": 2e10, "damping": [0.01], "rotary_inertia": 1e9"#,
                ["girders.g.rotary_inertia", "longer than the girder"],
            ),
            (
                r#""frequencies": [4.8, 17], "damping": [0.01], "shapes": [
                    {"modal_mass": 1, "x": [0, 15, 30], "phi": [0, 1, 0]},
                    {"modal_mass": 1, "x": [0, 15, 30], "phi": [0, -2, 0]}]"#,
                ["girders.g.shapes[1].phi", "the same shape as that of mode 1"],
            ),
        ] {
            let message = read(girder).unwrap_err();
            assert!(parts.iter().all(|part| message.contains(part)), "{message}");
        }
        // tables have an order of their own, and 0 stands for a computed frequency
        read(
            r#""frequencies": [17, 4.8], "damping": [0.99], "shapes": [
            {"modal_mass": 1, "x": [0, 15, 30], "phi": [0, 1, 0]},
            {"modal_mass": 1, "x": [0, 10, 30], "phi": [0, 1, 0]}]"#,
        )
        .unwrap();
        read(r#""frequencies": [5, 0, 50], "damping": [0.01], "elements": 60"#).unwrap();
    }

    #[test]
    fn refusal_of_kinds_whose_names_cannot_begin_variables() {
        let kind = r#"{"length": 30, "mass_per_length": 1, "frequencies": [5], "damping": [0]}"#;
        let text = |name: &str| {
            format!(
                r#"{{"girders": {{"a": {kind}, "{name}": {kind}}}, "spans": [], "magnets": 1}}"#
            )
        };
        let message = GuidewayDescription::from_json(&text("a b")).unwrap_err().to_string();
        assert!(
            message.contains("girders.a b") && message.contains("letters, digits"),
            "{message}"
        );
        GuidewayDescription::from_json(&text("b_2")).unwrap();
    }
}
