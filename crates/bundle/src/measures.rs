//! Units of measure of all units inside, as one list.

use bundle_table::Measure;
use fmi2_import::description::UnitOfMeasure;

/// Units of measure with unique names.
#[derive(Default)]
pub(crate) struct Measures(pub(crate) Vec<Measure>);

impl Measures {
    /// The place of a unit of measure; `None` if it has no definition, so that a name alone is left. A name with another
    /// definition gets the name of the FMU added.
    pub(crate) fn place(&mut self, measure: &UnitOfMeasure, fmu: &str) -> Option<usize> {
        let base = measure.base.as_ref()?;
        let mut exponents = [0; 8];
        for (small, exponent) in exponents.iter_mut().zip(base.exponents) {
            *small = i8::try_from(exponent).ok()?;
        }
        let mut new = Measure {
            name: measure.name.clone(),
            exponents,
            factor: base.factor,
            offset: base.offset,
            displays: Vec::new(),
        };
        let same = |it: &Measure| {
            (it.exponents, it.factor, it.offset) == (new.exponents, new.factor, new.offset)
        };
        let place = match self.0.iter().position(|it| it.name == new.name) {
            Some(place) if same(&self.0[place]) => place,
            Some(_) => {
                new.name = format!("{} ({fmu})", measure.name);
                let known = self.0.iter().position(|it| it.name == new.name);
                known.unwrap_or_else(|| self.push(new))
            }
            None => self.push(new),
        };
        let displays = &mut self.0[place].displays;
        for display in &measure.display_units {
            if !displays.iter().any(|it| it.0 == display.0) {
                displays.push(display.clone());
            }
        }
        Some(place)
    }

    fn push(&mut self, measure: Measure) -> usize {
        self.0.push(measure);
        self.0.len() - 1
    }
}
