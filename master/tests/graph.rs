//! Components of directed graphs.

#![allow(clippy::unwrap_used, reason = "a test program")]

use master::graph::Graph;
use proptest::prelude::*;

#[test]
fn analytic_components_of_a_small_graph() {
    let mut graph = Graph::new(5);
    for (from, to) in [(0, 1), (1, 2), (2, 1), (2, 3), (4, 4)] {
        graph.edge(from, to);
    }
    let components = graph.components();
    assert_eq!(components.len(), 4);
    let place = |node| components.iter().position(|c| c.contains(&node)).unwrap();
    assert!(place(0) < place(1) && place(1) == place(2) && place(2) < place(3));
    assert!(graph.is_loop(&[1, 2]) && graph.is_loop(&[4]) && !graph.is_loop(&[0]));
}

proptest! {
    #[test]
    fn invariant_components_are_in_topological_order(
        edges in proptest::collection::vec((0_usize..12, 0_usize..12), 0..40)
    ) {
        let mut graph = Graph::new(12);
        for &(from, to) in &edges {
            graph.edge(from, to);
        }
        let components = graph.components();
        let mut place = [usize::MAX; 12];
        for (k, component) in components.iter().enumerate() {
            for &node in component {
                place[node] = k;
            }
        }
        prop_assert!(place.iter().all(|&k| k != usize::MAX));
        for (from, to) in edges {
            prop_assert!(place[from] <= place[to]);
        }
        let ranks = graph.ranked();
        prop_assert_eq!(ranks.len(), 12);
    }
}
