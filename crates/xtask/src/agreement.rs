//! How closely two tables of results agree.

use std::fmt;

use anyhow::{Result, ensure};

/// How closely the signals of two tables agree.
#[derive(Debug, PartialEq)]
pub struct Agreement {
    /// Number of columns, the time included.
    columns: usize,
    /// Number of rows.
    rows: usize,
    /// Columns whose values are the same in every row.
    equal: usize,
    /// The signal that differs most.
    worst: String,
    /// The largest difference of a signal, relative to its largest value.
    pub largest: f64,
}

impl fmt::Display for Agreement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { columns, rows, equal, worst, largest } = self;
        if equal == columns {
            return write!(f, "the same bits in all {columns} columns, {rows} rows");
        }
        write!(
            f,
            "the same bits in {equal} of {columns} columns, {rows} rows; {worst} differs most, \
             by {largest:.1e} of its largest value"
        )
    }
}

/// Compares two tables: lines of numbers with commas between them, the first line the names of the columns. The
/// numbers are printed so that they read back to the same bits. An error if they have other columns or rows.
pub fn of(ours: &str, theirs: &str) -> Result<Agreement> {
    let names: Vec<&str> = ours.lines().next().unwrap_or_default().split(',').collect();
    let other: Vec<&str> = theirs.lines().next().unwrap_or_default().split(',').collect();
    ensure!(names == other, "the tables have other columns");
    let rows = ours.lines().count();
    ensure!(rows == theirs.lines().count(), "the tables have another number of rows");
    ensure!(rows > 1, "the tables are empty");
    // per column its largest value and difference, and whether all bits are the same
    let mut found = vec![(0.0_f64, 0.0_f64, true); names.len()];
    for (ours, theirs) in ours.lines().zip(theirs.lines()).skip(1) {
        let pairs = ours.split(',').zip(theirs.split(','));
        for ((x, y), (size, difference, same)) in pairs.zip(&mut found) {
            *same &= x == y;
            let (Ok(a), Ok(b)) = (x.parse::<f64>(), y.parse::<f64>()) else {
                ensure!(x == y, "one table has {x}, the other {y}");
                continue;
            };
            *size = size.max(a.abs());
            if x != y {
                let far = (a - b).abs();
                *difference = difference.max(if far.is_nan() { f64::INFINITY } else { far });
            }
        }
    }
    let relative = |&(size, difference, _): &(f64, f64, bool)| {
        if difference == 0.0 { 0.0 } else { difference / size }
    };
    let (mut worst, mut largest) = ("", 0.0);
    for (name, column) in names.iter().zip(&found) {
        if relative(column) > largest {
            (worst, largest) = (name, relative(column));
        }
    }
    let equal = found.iter().filter(|(_, _, same)| *same).count();
    Ok(Agreement { columns: names.len(), rows: rows - 1, equal, worst: worst.to_owned(), largest })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn issue_21_tables_are_compared_signal_by_signal() {
        let ours = "time,a,b\n0,1,100\n1,2,200\n";
        let same = of(ours, ours).unwrap();
        assert_eq!(same.to_string(), "the same bits in all 3 columns, 2 rows");
        let found = of(ours, "time,a,b\n0,1,100\n1,2.5,201\n").unwrap();
        assert_eq!((found.equal, found.worst.as_str(), found.largest), (1, "a", 0.25));
        for other in [
            "time,a\n0,1\n1,2\n",
            "time,a,b\n0,1,100\n",
            "time,a,c\n0,1,100\n1,2,200\n",
            "time,a,b\n0,1,100\n1,2,x\n",
        ] {
            assert!(of(ours, other).is_err(), "{other}");
        }
        assert!(of("time\n", "time\n").is_err());
    }

    #[test]
    fn issue_21_a_number_that_is_not_one_differs() {
        let found = of("a\n1\n", "a\nNaN\n").unwrap();
        assert_eq!((found.equal, found.largest), (0, f64::INFINITY));
    }
}
