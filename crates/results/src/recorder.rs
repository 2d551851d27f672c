//! A table in memory that grows during a run.

use crate::table::NOT_DUE;
use crate::{RecordedColumn, Table};

/// Collects the values of a run as the [`Table`] that reading its results.csv would give, bit for bit.
pub struct TableRecorder {
    table: Table,
    /// of each column of the table: its place among all signals, and its stride
    columns: Vec<(usize, u64)>,
    /// the strides of all signals without duplicates
    distinct: Vec<u64>,
}

impl TableRecorder {
    /// An empty table. String signals are left out.
    #[must_use]
    pub fn new(columns: &[RecordedColumn]) -> Self {
        let mut distinct: Vec<u64> = columns.iter().map(|column| column.stride).collect();
        distinct.sort_unstable();
        distinct.dedup();
        if distinct.is_empty() {
            distinct.push(1);
        }
        let numbers = columns.iter().enumerate().filter(|(_, column)| !column.is_text);
        let names = numbers.clone().map(|(_, column)| column.name.clone()).collect();
        let columns: Vec<_> = numbers.map(|(k, column)| (k, column.stride)).collect();
        let values = vec![Vec::new(); columns.len()];
        Self { table: Table { names, time: Vec::new(), columns: values }, columns, distinct }
    }

    /// Whether any signal is due at communication point `n`.
    #[inline]
    #[must_use]
    pub fn is_due(&self, n: u64) -> bool {
        self.distinct.iter().any(|&stride| n.is_multiple_of(stride))
    }

    /// Takes the values of all signals at communication point `n`, in the order of the columns.
    #[inline]
    pub fn take(&mut self, n: u64, time: f64, values: &[f64]) {
        if !self.is_due(n) {
            return;
        }
        self.table.time.push(time);
        for (column, &(place, stride)) in self.table.columns.iter_mut().zip(&self.columns) {
            let value = values.get(place).copied().filter(|_| n.is_multiple_of(stride));
            // a text has one NaN only
            column.push(match value {
                Some(value) if value.is_nan() => f64::NAN,
                value => value.unwrap_or(NOT_DUE),
            });
        }
    }

    /// The table.
    #[must_use]
    pub fn finish(self) -> Table {
        self.table
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TableWriter;

    #[test]
    fn invariant_the_table_in_memory_is_the_one_that_is_read() {
        let column = |name: &str, stride, is_text| RecordedColumn {
            name: name.into(),
            unit: None,
            stride,
            is_text,
        };
        let columns = [column("a.x", 2, false), column("a.s", 1, true), column("b,y", 3, false)];
        let folder = tempfile::tempdir().unwrap();
        let mut writer = TableWriter::create(folder.path(), &columns).unwrap();
        let mut recorder = TableRecorder::new(&columns);
        for n in 0..100_u64 {
            let (x, time) = ((n as f64 * 0.7).sin() / 3.0, n as f64 * 0.1);
            let odd = [f64::NAN, f64::from_bits(0xfff8_0000_0000_0dee), -0.0, f64::INFINITY];
            let values = [x, f64::NAN, odd.get(n as usize / 3).copied().unwrap_or(1e-300 * x)];
            writer.take(n, time, &values, |_| Some(c"t")).unwrap();
            recorder.take(n, time, &values);
        }
        writer.finish().unwrap();
        let (read, kept) = (Table::read(folder.path()).unwrap().unwrap(), recorder.finish());
        assert_eq!((&read.names, read.time.len()), (&kept.names, kept.time.len()));
        let bits = |it: &Table| -> Vec<u64> {
            it.time.iter().chain(it.columns.iter().flatten()).map(|x| x.to_bits()).collect()
        };
        assert_eq!(bits(&read), bits(&kept));
    }
}
