//! All points of a grid: along one column from row to row, and from there along the rows, on several threads.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::branch::Point;
use crate::error::MapError;
use crate::explore::{Cell, Followed};
use crate::ladder::Ladder;
use crate::space::{Level, Space};
use crate::system::Controllers;

/// The system at each point of a grid.
pub trait Grid: Sync {
    /// Number of columns.
    fn columns(&self) -> usize;
    /// Number of rows.
    fn rows(&self) -> usize;
    /// The attached part at a column and row, in the survey's space.
    fn level(&self, column: usize, row: usize) -> &Level;
    /// The controllers of the ports at a column and row.
    fn controllers(&self, column: usize, row: usize) -> Controllers;
    /// Whether the row is known already.
    fn is_done(&self, row: usize) -> bool;
    /// Takes a finished row, from any thread. `false` stops the survey.
    fn done(&self, row: usize, cells: Vec<Cell>) -> bool;
}

/// Computes a grid from zeros known at a place near `start` (column, row).
///
/// # Errors
/// Eigenvalues do not converge.
pub fn survey(
    space: &Space,
    ladder: &Ladder,
    grid: &dyn Grid,
    start: (usize, usize),
    followed: &Followed,
    threads: usize,
) -> Result<(), MapError> {
    let point =
        |column: usize, row: usize, use_: &mut dyn FnMut(Point<'_>) -> Result<Cell, MapError>| {
            let controllers = grid.controllers(column, row);
            use_(Point { space, level: grid.level(column, row), controllers: &controllers })
        };
    let (column, row) = start;
    // the column first: zeros at the head of every row
    let mut heads: Vec<Option<Followed>> = vec![None; grid.rows()];
    let mut cells: Vec<Option<Cell>> = vec![None; grid.rows()];
    let up: Vec<usize> = (row..grid.rows()).collect();
    let down: Vec<usize> = (0..row).rev().collect();
    for way in [up, down] {
        let mut now = heads[row].clone().unwrap_or_else(|| followed.clone());
        for row in way {
            let cell = point(column, row, &mut |point| ladder.explore(point, &mut now))?;
            heads[row] = Some(now.clone());
            cells[row] = Some(cell);
        }
    }
    let next = AtomicUsize::new(0);
    let failure: Mutex<Option<MapError>> = Mutex::new(None);
    let work = || {
        loop {
            let row = next.fetch_add(1, Ordering::Relaxed);
            let (Some(Some(head)), Some(Some(first))) = (heads.get(row), cells.get(row)) else {
                return;
            };
            if grid.is_done(row) {
                continue;
            }
            let mut all = vec![*first; grid.columns()];
            let right: Vec<usize> = (column + 1..grid.columns()).collect();
            let left: Vec<usize> = (0..column).rev().collect();
            for way in [right, left] {
                let mut now = head.clone();
                for column in way {
                    match point(column, row, &mut |point| ladder.explore(point, &mut now)) {
                        Ok(cell) => all[column] = cell,
                        Err(error) => {
                            if let Ok(mut failure) = failure.lock() {
                                failure.get_or_insert(error);
                            }
                            next.store(usize::MAX / 2, Ordering::Relaxed);
                            return;
                        }
                    }
                }
            }
            if !grid.done(row, all) {
                next.store(usize::MAX / 2, Ordering::Relaxed);
                return;
            }
        }
    };
    if threads <= 1 {
        work();
    } else {
        std::thread::scope(|scope| {
            (0..threads).for_each(|_| {
                scope.spawn(work);
            });
        });
    }
    match failure.into_inner() {
        Ok(Some(error)) => Err(error),
        _ => Ok(()),
    }
}
