//! Accelerated fixed-point iterations of a linear map.

use coupling::acceleration::Accelerator;
use scenario::algorithm::Acceleration;

/// A linear map of spectral radius beyond one, for which plain iteration diverges.
fn image(x: &[f64]) -> Vec<f64> {
    vec![-3.0 * x[0] + 0.5 * x[1] + 1.0, 0.2 * x[0] + 0.4 * x[1] - 2.0, 0.1 * x[2]]
}

fn iterations(kind: Acceleration) -> Option<usize> {
    let scales = [1.0, 10.0, 0.1];
    let mut accelerator = Accelerator::new(kind, 1.0, 3);
    let mut x = vec![1.0, -1.0, 0.5];
    accelerator.begin();
    (1..100).find(|_| {
        let image = image(&x);
        let residual = image.iter().zip(&x).map(|(g, x)| (g - x).abs()).fold(0.0, f64::max);
        accelerator.next(&mut x, &image, &scales);
        residual < 1e-10
    })
}

/// Three unknowns: three differences, so the fifth image at the latest agrees; one more is
/// allowed for rounding.
#[test]
fn analytic_anderson_solves_a_linear_problem_in_as_many_steps_as_unknowns() {
    let count = iterations(Acceleration::Anderson);
    assert!(count.is_some_and(|count| count <= 6), "{count:?}");
}

#[test]
fn analytic_acceleration_converges_where_plain_iteration_diverges() {
    assert_eq!(iterations(Acceleration::None), None);
    assert!(iterations(Acceleration::Aitken).is_some());
}
