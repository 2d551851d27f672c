//! Which states are coupled with other units at the point of linearisation.
//!
//! A state influences another one directly where the coupled matrix has an entry. Ordered by the strongly
//! connected components of that graph, the matrix is block triangular, so its eigenvalues are those of the
//! components. A component with states of only one unit therefore has modes of that unit alone.

use faer::Mat;
use indexmap::IndexSet;
use results::modes::{CoupledParts, UncoupledStates};

use super::eigen::balanced;
use super::unit::LinearUnit;
use master::graph::Graph;

/// Entries below this fraction of the largest in their row and column, after balancing, are rounding
/// errors.
const NOTHING: f64 = 1e-13;

/// The units with such states, in their order; none if there is only one unit.
pub(super) fn apart(matrix: &Mat<f64>, units: &[LinearUnit]) -> Vec<UncoupledStates> {
    if units.iter().filter(|unit| !unit.states.is_empty()).count() < 2 {
        return Vec::new();
    }
    let owners: Vec<usize> =
        units.iter().enumerate().flat_map(|(k, unit)| vec![k; unit.states.len()]).collect();
    let mut alone = vec![false; owners.len()];
    for component in influences(matrix).components() {
        let own = component.iter().all(|&state| owners[state] == owners[component[0]]);
        component.iter().for_each(|&state| alone[state] = own);
    }
    let mut first = 0;
    let mut found = Vec::new();
    for unit in units {
        let of = unit.states.len();
        let mine = &alone[first..first + of];
        first += of;
        let states: Vec<String> = unit
            .states
            .iter()
            .zip(mine)
            .filter(|(_, alone)| **alone)
            .map(|(name, _)| name.clone())
            .collect();
        if !states.is_empty() {
            found.push(UncoupledStates { instance: unit.name.clone(), of, states });
        }
    }
    found
}

/// The named parts of units, and which of them are coupled. Only units all of whose states name a part
/// have any.
pub(super) fn parts(units: &[LinearUnit], apart: &[UncoupledStates]) -> Vec<CoupledParts> {
    let part = |state: &str| state.split_once(", ").map(|(part, _)| part.to_owned());
    let mut found = Vec::new();
    if units.iter().filter(|unit| !unit.states.is_empty()).count() < 2 {
        return found;
    }
    for unit in units.iter().filter(|unit| !unit.states.is_empty()) {
        let Some(parts) = unit.states.iter().map(|it| part(it)).collect::<Option<Vec<_>>>() else {
            continue;
        };
        let alone = apart.iter().find(|it| it.instance == unit.name);
        let is_alone = |state: &String| alone.is_some_and(|it| it.states.contains(state));
        let coupled: IndexSet<String> = unit
            .states
            .iter()
            .zip(&parts)
            .filter(|(state, _)| !is_alone(state))
            .map(|(_, part)| part.clone())
            .collect();
        let all: IndexSet<String> = parts.into_iter().collect();
        let rest = all.into_iter().filter(|part| !coupled.contains(part)).collect();
        let instance = unit.name.clone();
        found.push(CoupledParts { instance, coupled: coupled.into_iter().collect(), apart: rest });
    }
    found
}

/// A graph with an edge from each state to the states whose rates depend on it.
fn influences(matrix: &Mat<f64>) -> Graph {
    let matrix = balanced(matrix).matrix;
    let n = matrix.nrows();
    let (mut rows, mut columns) = (vec![0.0_f64; n], vec![0.0_f64; n]);
    for i in 0..n {
        for j in 0..n {
            let size = matrix[(i, j)].abs();
            rows[i] = rows[i].max(size);
            columns[j] = columns[j].max(size);
        }
    }
    let mut graph = Graph::new(n);
    for i in 0..n {
        for j in 0..n {
            let size = matrix[(i, j)].abs();
            if size > NOTHING * rows[i].max(columns[j]) {
                graph.edge(j, i);
            }
        }
    }
    graph
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unit(instance: &str, states: &[&str]) -> LinearUnit {
        let states = states.iter().map(|it| (*it).to_owned()).collect();
        LinearUnit { name: instance.to_owned(), states, ..LinearUnit::default() }
    }

    /// Two oscillators: coupled by springs both are in every mode; with one direction only, or with an
    /// entry at the level of rounding, the modes are those of each alone.
    #[test]
    fn issue_units_without_a_loop_between_them_are_not_coupled() {
        let units = [unit("a", &["x", "v"]), unit("b", &["x", "v"])];
        let system = |ab: f64, ba: f64| {
            let rows = [
                [0.0, 1.0, 0.0, 0.0],
                [-4.0, -0.1, ab, 0.0],
                [0.0, 0.0, 0.0, 1.0],
                [ba, 0.0, -9.0, -0.2],
            ];
            Mat::from_fn(4, 4, |i, j| rows[i][j])
        };
        let found = |ab, ba| apart(&system(ab, ba), &units);
        assert_eq!(found(1.0, 1.0), []);
        for (ab, ba) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1e-17)] {
            let both = found(ab, ba);
            assert_eq!(both.len(), 2, "{ab} {ba}");
            assert!(both.iter().all(UncoupledStates::entirely));
            assert_eq!((both[1].instance.as_str(), both[1].of), ("b", 2));
        }
    }

    /// A part of b that a does not reach is named; the rest of b is coupled.
    #[test]
    fn issue_states_that_no_other_unit_reaches_are_named() {
        let units = [unit("a", &["x"]), unit("b", &["near", "far"])];
        let rows = [[-1.0, 0.5, 0.0], [0.5, -1.0, 0.0], [0.0, 0.0, 1.0]];
        let found = apart(&Mat::from_fn(3, 3, |i, j| rows[i][j]), &units);
        assert_eq!(
            found,
            [UncoupledStates { instance: "b".to_owned(), of: 2, states: vec!["far".to_owned()] }]
        );
        assert!(!found[0].entirely());
        // a single unit cannot be coupled
        let alone = Mat::from_fn(1, 1, |_, _| -1.0);
        assert_eq!(apart(&alone, &units[..1]), []);
    }
}
