//! Sparse matrices by rows.

/// One entry of a sparse matrix: row, column, value.
pub type Entry = (usize, usize, f64);

/// A sparse matrix by rows.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Rows {
    entries: Vec<Vec<(usize, f64)>>,
}

impl Rows {
    /// From the nonzero entries, each in one of `count` rows.
    #[must_use]
    pub fn new(count: usize, entries: &[Entry]) -> Self {
        let mut rows = vec![Vec::new(); count];
        for &(i, j, value) in entries {
            rows[i].push((j, value));
        }
        Self { entries: rows }
    }

    /// The rows in that order; `None` is a row of zeros.
    #[must_use]
    pub fn chosen(&self, order: &[Option<usize>]) -> Self {
        let row = |k: &Option<usize>| k.map(|k| self.entries[k].clone()).unwrap_or_default();
        Self { entries: order.iter().map(row).collect() }
    }

    /// The same with other column numbers; columns without a place are left out.
    #[must_use]
    pub fn renumbered(&self, place: impl Fn(usize) -> Option<usize>) -> Self {
        let entries = self
            .entries
            .iter()
            .map(|row| row.iter().filter_map(|&(j, x)| Some((place(j)?, x))).collect())
            .collect();
        Self { entries }
    }

    /// Number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Whether there are no rows.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// The entries of one row: column, value. A column may occur more than once: its entries add up.
    #[must_use]
    pub fn row(&self, row: usize) -> &[(usize, f64)] {
        &self.entries[row]
    }

    /// Row times vector.
    #[must_use]
    pub fn times(&self, row: usize, x: impl Fn(usize) -> f64) -> f64 {
        self.entries[row].iter().map(|&(j, value)| value * x(j)).sum()
    }

    /// Every entry: row, column, value.
    pub fn iter(&self) -> impl Iterator<Item = Entry> + '_ {
        self.entries
            .iter()
            .enumerate()
            .flat_map(|(i, row)| row.iter().map(move |&(j, value)| (i, j, value)))
    }
}
