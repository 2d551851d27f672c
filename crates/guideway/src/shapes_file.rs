//! Mode shapes from a text file, as finite element programmes write tables.

use crate::check::positive;
use crate::contradictions::check_distinct;
use crate::cubics::PiecewiseCubics;
use crate::description::{GirderDescription, GuidewayDescription, ShapeComponent, TabulatedShape};
use crate::{Error, Spline};

impl GuidewayDescription {
    /// Kinds of girder whose shapes are in a file: name of the kind and of its file.
    #[must_use]
    pub fn shapes_files(&self) -> Vec<(String, String)> {
        let of = |(name, girder): (&String, &GirderDescription)| {
            let file = girder.shapes_file.as_ref()?;
            Some((name.clone(), file.strip_prefix("./").unwrap_or(file).to_owned()))
        };
        self.girders.iter().filter_map(of).collect()
    }

    /// Replaces `shapes_file` of a kind of girder by the file's content.
    ///
    /// # Errors
    /// A line that cannot be used, components that do not fit, or modal masses that are missing or invalid.
    pub fn set_shapes(&mut self, girder: &str, text: &str) -> Result<(), Error> {
        let Some(kind) = self.girders.get_mut(girder) else { return Ok(()) };
        let path = format!("girders.{girder}");
        let file = kind.shapes_file.take().unwrap_or_default();
        if kind.shapes.is_some() {
            return Err(Error::invalid(
                format!("{path}.shapes_file"),
                "given together with `shapes`",
                "remove one of them",
            ));
        }
        let columns = read(text, &file)?;
        let components = match &kind.components[..] {
            [] => vec![ShapeComponent::Z],
            given => given.to_vec(),
        };
        let twice = (1..components.len()).any(|k| components[..k].contains(&components[k]));
        if twice || (columns.len() - 1) % components.len() != 0 {
            return Err(Error::invalid(
                format!("{path}.components"),
                format!("{components:?} for {} columns after x in `{file}`", columns.len() - 1),
                "name each of y, z and theta at most once, and give that many columns per mode",
            ));
        }
        let x = &columns[0];
        let modes: Vec<&[Vec<f64>]> = columns[1..].chunks(components.len()).collect();
        let masses = masses(kind, x, &modes, &components, &path)?;
        // a mode's columns one after the other
        let all: Vec<Vec<f64>> = modes.iter().map(|mode| mode.concat()).collect();
        let slices: Vec<&[f64]> = all.iter().map(Vec::as_slice).collect();
        let column = |n: usize| format!("{path}.shapes_file, column {}", n * components.len() + 2);
        check_distinct(&slices, |_, _| true, column)?;
        let table = |(mode, &modal_mass): (&&[Vec<f64>], &f64)| {
            let of = |component| {
                let k = components.iter().position(|c| *c == component)?;
                mode.get(k).cloned()
            };
            TabulatedShape {
                modal_mass,
                x: x.clone(),
                phi: of(ShapeComponent::Z).unwrap_or_else(|| vec![0.0; x.len()]),
                y: of(ShapeComponent::Y).unwrap_or_default(),
                theta: of(ShapeComponent::Theta).unwrap_or_default(),
            }
        };
        kind.shapes = Some(modes.iter().zip(&masses).map(table).collect());
        kind.modal_masses.clear();
        kind.components.clear();
        Ok(())
    }
}

/// The given modal masses, or the integrals of the mass per length times φ².
fn masses(
    kind: &GirderDescription,
    x: &[f64],
    modes: &[&[Vec<f64>]],
    components: &[ShapeComponent],
    path: &str,
) -> Result<Vec<f64>, Error> {
    let count = modes.len();
    if !kind.modal_masses.is_empty() {
        if kind.modal_masses.len() != count {
            return Err(Error::invalid(
                format!("{path}.modal_masses"),
                format!(
                    "{} masses for {count} {}",
                    kind.modal_masses.len(),
                    if components.len() == 1 { "columns of shapes" } else { "shapes" }
                ),
                "give one per shape",
            ));
        }
        for (n, &mass) in kind.modal_masses.iter().enumerate() {
            positive(mass, path, &format!("modal_masses[{n}]"), "kg")?;
        }
        return Ok(kind.modal_masses.clone());
    }
    if components != [ShapeComponent::Z] {
        return Err(Error::invalid(
            format!("{path}.modal_masses"),
            "missing",
            "give the modal masses (kg) of shapes with y or theta, as the other program has them",
        ));
    }
    let Some(density) = kind.mass_per_length else {
        return Err(Error::invalid(
            format!("{path}.modal_masses"),
            "missing",
            "give the modal masses (kg), or mass_per_length (kg/m) to compute them with",
        ));
    };
    positive(density, path, "mass_per_length", "kg/m")?;
    positive(kind.length, path, "length", "m")?;
    let path = format!("{path}.shapes_file");
    let splines = modes
        .iter()
        .flat_map(|mode| mode.iter())
        .map(|phi| Spline::new(x, phi, &path))
        .collect::<Result<Vec<_>, _>>()?;
    let squares = PiecewiseCubics::of_splines(&splines, kind.length).squares();
    if let Some(n) = squares.iter().position(|&square| square == 0.0) {
        return Err(Error::invalid(
            path,
            format!("phi_{} is 0 everywhere", n + 1),
            "remove the column, or write it with more digits",
        ));
    }
    Ok(squares.into_iter().map(|s| density * s).collect())
}

/// Columns x, φ₁, φ₂ … of the text; at least two, equally many in every line, x increasing. Before them may be a heading
/// and further lines without any number, such as one of units.
fn read(text: &str, file: &str) -> Result<Vec<Vec<f64>>, Error> {
    let mut columns: Vec<Vec<f64>> = Vec::new();
    let mut first = true;
    for (index, line) in text.lines().enumerate() {
        let line = line.trim().trim_start_matches('\u{feff}');
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let fail = |found: String| {
            Err(Error::ShapesLine { file: file.to_owned(), line: index + 1, found })
        };
        let fields = || line.split([',', ';', '\t', ' ']).filter(|field| !field.is_empty());
        let number = |field: &str| field.parse::<f64>().ok().filter(|v| v.is_finite());
        let numbers: Option<Vec<f64>> = fields().map(number).collect();
        let heading = std::mem::replace(&mut first, false)
            || columns.is_empty() && fields().all(|field| field.parse::<f64>().is_err());
        let Some(numbers) = numbers else {
            if heading {
                continue;
            }
            return fail(format!("`{line}` has a field that is not a finite number"));
        };
        if numbers.len() < 2 {
            return fail(format!("`{line}` is only one column"));
        }
        if columns.is_empty() {
            columns = vec![Vec::new(); numbers.len()];
        }
        if numbers.len() != columns.len() {
            return fail(format!("{} columns, {} before", numbers.len(), columns.len()));
        }
        if let Some(before) = columns[0].last().filter(|&&before| numbers[0] <= before) {
            return fail(format!("x = {} does not exceed {before}", numbers[0]));
        }
        for (column, number) in columns.iter_mut().zip(numbers) {
            column.push(number);
        }
    }
    match columns.first() {
        Some(x) if x.len() >= 2 => Ok(columns),
        _ => Err(Error::ShapesLine {
            file: file.to_owned(),
            line: text.lines().count(),
            found: "the file ends with fewer than two rows of numbers".to_owned(),
        }),
    }
}
