//! Records the signals of a simulation in memory, in SI base units.

use master::simulation::to_base;
use master::{Setup, Simulation};
use results::{NOT_DUE, RecordedColumn, Table};

/// A signal with its values.
pub struct Recorded {
    pub name: String,
    pub unit: Option<String>,
    pub values: Values,
}

/// Values of a signal, one per row.
#[derive(Clone)]
pub enum Values {
    /// [`NOT_DUE`] in rows at which the signal was not due.
    Numbers(Vec<f64>),
    /// None in rows at which the signal was not due.
    Texts(Vec<Option<String>>),
}

/// What has been recorded so far.
pub struct Recording {
    columns: Vec<RecordedColumn>,
    conversions: Vec<(f64, f64)>,
    /// number of the step after which a row was taken
    steps: Vec<u64>,
    time: Vec<f64>,
    values: Vec<Values>,
}

impl Recording {
    pub fn new(setup: &Setup) -> Self {
        let columns = setup.selection().columns(setup.system());
        let ports = setup.selection().recorded();
        let empty = |it: &RecordedColumn| match it.is_text {
            true => Values::Texts(Vec::new()),
            false => Values::Numbers(Vec::new()),
        };
        Self {
            conversions: ports.map(|port| to_base(setup.system(), port)).collect(),
            values: columns.iter().map(empty).collect(),
            columns,
            steps: Vec::new(),
            time: Vec::new(),
        }
    }

    /// Adds a row for the present communication point, if a signal is due there. `last`: all are due at the end of a
    /// run that ends early.
    pub fn take(&mut self, simulation: &Simulation<'_>, last: bool) {
        let done = simulation.done();
        let due = |column: &RecordedColumn| done.is_multiple_of(column.stride);
        if self.steps.last() == Some(&done) || !(last || self.columns.iter().any(due)) {
            return;
        }
        self.steps.push(done);
        self.time.push(simulation.time());
        for (k, (column, values)) in self.columns.iter().zip(&mut self.values).enumerate() {
            let due = last || due(column);
            match values {
                Values::Numbers(values) if due => {
                    let (factor, offset) = self.conversions[k];
                    let value = factor * simulation.value(k) + offset;
                    // a text has one NaN only, and so does a results folder
                    values.push(if value.is_nan() { f64::NAN } else { value });
                }
                Values::Numbers(values) => values.push(NOT_DUE),
                Values::Texts(values) => {
                    let text = simulation.text(k).filter(|_| due);
                    values.push(text.map(|it| it.to_string_lossy().into_owned()));
                }
            }
        }
    }

    /// Forgets the rows after a step, for a simulation that goes back.
    pub fn rewind(&mut self, done: u64) {
        let rows = self.steps.partition_point(|step| *step <= done);
        self.steps.truncate(rows);
        self.time.truncate(rows);
        for values in &mut self.values {
            match values {
                Values::Numbers(values) => values.truncate(rows),
                Values::Texts(values) => values.truncate(rows),
            }
        }
    }

    /// Works on the signals that are numbers, as a table.
    pub fn with_table<T>(&mut self, work: impl FnOnce(&Table) -> T) -> T {
        let mut table = Table { time: std::mem::take(&mut self.time), ..Table::default() };
        for (column, values) in self.columns.iter().zip(&mut self.values) {
            if let Values::Numbers(values) = values {
                table.names.push(column.name.clone());
                table.columns.push(std::mem::take(values));
            }
        }
        let found = work(&table);
        let mut columns = table.columns.into_iter();
        for values in &mut self.values {
            if let Values::Numbers(values) = values {
                *values = columns.next().unwrap_or_default();
            }
        }
        self.time = table.time;
        found
    }

    /// The times and columns, as copies.
    pub fn columns(&self) -> (Vec<f64>, Vec<Recorded>) {
        (self.time.clone(), self.named(self.values.clone()))
    }

    /// The times and columns. The recording is empty after that.
    pub fn take_columns(&mut self) -> (Vec<f64>, Vec<Recorded>) {
        self.steps.clear();
        let empty = self.values.iter().map(|values| match values {
            Values::Numbers(_) => Values::Numbers(Vec::new()),
            Values::Texts(_) => Values::Texts(Vec::new()),
        });
        let empty = empty.collect();
        let values = std::mem::replace(&mut self.values, empty);
        (std::mem::take(&mut self.time), self.named(values))
    }

    fn named(&self, values: Vec<Values>) -> Vec<Recorded> {
        let named = self.columns.iter().zip(values);
        named
            .map(|(it, values)| Recorded { name: it.name.clone(), unit: it.unit.clone(), values })
            .collect()
    }
}
