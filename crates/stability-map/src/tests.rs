//! Random systems, compared with all their eigenvalues.

use faer::Mat;
use faer::prelude::c64;

use crate::*;

/// Numbers between −1 and 1 that are the same on every machine.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        // Knuth's linear congruential generator
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    fn matrix(&mut self, rows: usize, columns: usize) -> Mat<f64> {
        let mut all = Mat::zeros(rows, columns);
        for i in 0..rows {
            for j in 0..columns {
                all[(i, j)] = self.next();
            }
        }
        all
    }
}

/// A body of `dof` coordinates on springs, carried by `loops` magnets through fewer combinations, over a girder of two
/// modes. `free` coordinates have no springs of their own.
fn train(dof: usize, loops: usize, rank: usize, free: usize, seed: u64) -> (Plant, Attached) {
    let mut random = Random(seed);
    let shape = random.matrix(loops, rank) * random.matrix(rank, dof);
    let n = 2 * dof;
    let mut a = Mat::zeros(n, n);
    let couple = random.matrix(dof, dof);
    for i in 0..dof {
        a[(i, dof + i)] = 1.0;
        let omega = 3.0 + 4.0 * i as f64;
        if i >= free {
            a[(dof + i, i)] -= omega * omega;
            a[(dof + i, dof + i)] -= 0.2 * omega;
        }
        for j in free..dof {
            // symmetric, so that there is no flutter
            let by = 0.3 * (couple[(i, j)] + couple[(j, i)]);
            if i >= free {
                a[(dof + i, j)] -= by;
            }
        }
    }
    let mut by_force = Mat::zeros(n, loops);
    for i in 0..dof {
        for k in 0..loops {
            // forces pull up, gaps open downward
            by_force[(dof + i, k)] = -shape[(k, i)];
        }
    }
    let mut gap = Mat::zeros(loops, n);
    for k in 0..loops {
        for i in 0..dof {
            gap[(k, i)] = shape[(k, i)];
        }
    }
    let down = Mat::from_fn(loops, n, |k, j| {
        (0..dof).map(|i| shape[(k, i)] * a[(dof + i, j)]).sum::<f64>()
    });
    let feed = Mat::from_fn(loops, loops, |k, j| {
        (0..dof).map(|i| shape[(k, i)] * by_force[(dof + i, j)]).sum::<f64>()
    });
    let modes = random.matrix(loops, 2);
    let (mut ga, mut gb, mut gc) = (Mat::zeros(4, 4), Mat::zeros(4, loops), Mat::zeros(loops, 4));
    for (m, omega) in [(0, 11.0), (1, 31.0)] {
        ga[(m, 2 + m)] = 1.0;
        ga[(2 + m, m)] = -omega * omega;
        ga[(2 + m, 2 + m)] = -0.02 * omega;
        for k in 0..loops {
            gb[(2 + m, k)] = -0.05 * modes[(k, m)];
            gc[(k, m)] = modes[(k, m)];
        }
    }
    let nothing = |rows, columns| Mat::<f64>::zeros(rows, columns);
    let plant = Plant {
        a,
        by_force,
        by_attached: nothing(n, loops),
        channels: vec![
            Output {
                by_state: gap,
                by_force: nothing(loops, loops),
                by_attached: Mat::identity(loops, loops),
            },
            Output { by_state: down, by_force: feed, by_attached: nothing(loops, loops) },
        ],
        to_attached: Output {
            by_state: nothing(loops, n),
            by_force: Mat::identity(loops, loops),
            by_attached: nothing(loops, loops),
        },
    };
    (plant, Attached { a: ga, b: gb, c: gc })
}

/// A force from gap and acceleration through two lags: ẋ₁ = ω(e − x₁), ẋ₂ = ω(p e + d ω(e − x₁) + q ë − x₂), f = x₂.
fn controller(p: f64, d: f64, q: f64) -> Controller {
    let omega = 60.0;
    let a = [[-omega, 0.0], [-d * omega * omega, -omega]];
    let b = [[omega, 0.0], [omega * (p + d * omega), omega * q]];
    Controller {
        a: Mat::from_fn(2, 2, |i, j| a[i][j]),
        b: Mat::from_fn(2, 2, |i, j| b[i][j]),
        c: vec![0.0, 1.0],
        d: vec![0.0, 0.0],
    }
}

fn eigenvalues(matrix: &Mat<f64>) -> Vec<c64> {
    matrix.eigenvalues().unwrap()
}

/// Largest distance from one of `all` that `wanted` accepts to the nearest of `others`, relative.
fn apart(all: &[c64], others: &[c64], wanted: impl Fn(c64) -> bool) -> f64 {
    let nearest = |s: c64| others.iter().map(|o| (o - s).norm()).fold(f64::INFINITY, f64::min);
    all.iter().filter(|s| wanted(**s)).map(|s| nearest(*s) / s.norm().max(1e-2)).fold(0.0, f64::max)
}

const REGION: Region = Region { sigma: 0.05, damping: 0.03, radius: 3e4 };

/// The reduced system has the eigenvalues of the whole one, apart from controllers that close no loop.
#[test]
fn analytic_the_reduced_loop_has_the_eigenvalues_of_the_whole_system() {
    for seed in 1..6 {
        let (plant, attached) = train(6, 10, 4, 1, seed);
        let space = Space::new(&plant, &attached, true).unwrap();
        assert_eq!(space.size(&space.level(&attached).unwrap()), 6 + 4);
        let equal = Controllers::Equal(controller(40.0, 8.0, 0.1), 10);
        let all = eigenvalues(&whole(&plant, &attached, &equal).unwrap());
        let level = space.level(&attached).unwrap();
        let controllers = space.controllers(&equal);
        let reduced = eigenvalues(&space.whole(&level, &controllers).unwrap());
        assert!(apart(&reduced, &all, |_| true) < 1e-6);
        // the lags themselves are what is left out
        assert!(apart(&all, &reduced, |s| (s + 60.0).norm() > 1.0) < 1e-6);
    }
}

/// Zeros, count and least damping on a grid of two gains: those of all eigenvalues at every point. The count is exact
/// on both sides of the boundary and with zeros anywhere near it.
#[test]
fn analytic_followed_and_counted_zeros_are_the_eigenvalues_of_the_region() {
    let (mut unstable, mut certain) = (0, 0);
    for seed in 1..9 {
        let (plant, attached) = train(5, 8, 3, 1, seed);
        let equal = |k: usize| {
            let p = 20.0 + 15.0 * k as f64;
            Controllers::Equal(controller(p, 0.012 * p - 0.002 * (k as f64) * p, 0.05), 8)
        };
        let space = Space::new(&plant, &attached, true).unwrap();
        let level = space.level(&attached).unwrap();
        let at = |k: usize| space.controllers(&equal(k));
        let first = at(0);
        let point = Point { space: &space, level: &level, controllers: &first };
        let ladder = Ladder::new(REGION, f64::INFINITY, point, &[]).unwrap();
        let start = ladder.top();
        let values = eigenvalues(&space.whole(&level, &first).unwrap());
        let mut followed = Followed::start(REGION, point, &values);
        assert!(start.is_diagonal() && start.misfit() < 1e-9, "{}", start.misfit());
        for k in 0..12 {
            let controllers = at(k);
            let point = Point { space: &space, level: &level, controllers: &controllers };
            let cell = ladder.explore(point, &mut followed).unwrap();
            let all = eigenvalues(&whole(&plant, &attached, &equal(k)).unwrap());
            if cell.evidence == Evidence::Growing {
                // a mode grows for certain, but not all are known
                let known = all.iter().any(|s| (s - cell.s).norm() < 1e-6 * cell.s.norm());
                assert!(known && cell.s.re > 0.0, "seed {seed}, {k}");
                unstable += 1;
                continue;
            }
            let inside: Vec<c64> = all.iter().copied().filter(|s| REGION.contains(*s)).collect();
            // the count without any zero known is the number of eigenvalues inside
            let counted = start.count(point, &[]).unwrap();
            assert_eq!(counted, Count::Unknown(inside.len() as i64), "seed {seed}, {k}");
            let growing = all.iter().filter(|s| s.re > 0.0 && s.im >= 0.0).count();
            assert_eq!(cell.growing > 0, growing > 0, "seed {seed}, {k}");
            assert!(cell.growing <= growing, "seed {seed}, {k}");
            unstable += usize::from(growing > 0);
            if cell.inside {
                let least = inside.iter().map(|s| damping(*s)).fold(f64::INFINITY, f64::min);
                assert!((cell.damping() - least).abs() < 1e-7);
                certain += usize::from(cell.evidence == Evidence::Counted);
            }
        }
    }
    assert!(unstable > 0 && unstable < 96, "{unstable}");
    assert!(certain > 20, "{certain}");
}

/// Controllers that differ: no diagonalisation, the same results.
#[test]
fn analytic_different_controllers_are_counted_by_factorisation() {
    let (plant, attached) = train(5, 6, 3, 1, 3);
    let each = |k: usize| {
        let of = |j: usize| {
            let p = (20.0 + 15.0 * k as f64) * (1.0 + 0.1 * j as f64);
            controller(p, 0.02 * p, 0.05)
        };
        Controllers::Each((0..6).map(of).collect())
    };
    let space = Space::new(&plant, &attached, false).unwrap();
    let level = space.level(&attached).unwrap();
    let first = each(0);
    let point = Point { space: &space, level: &level, controllers: &first };
    let ladder = Ladder::new(REGION, f64::INFINITY, point, &[]).unwrap();
    let contour = ladder.top();
    assert!(!contour.is_diagonal());
    let values = eigenvalues(&space.whole(&level, &first).unwrap());
    let mut followed = Followed::start(REGION, point, &values);
    for k in 0..10 {
        let controllers = each(k);
        let point = Point { space: &space, level: &level, controllers: &controllers };
        let cell = ladder.explore(point, &mut followed).unwrap();
        let all = eigenvalues(&whole(&plant, &attached, &controllers).unwrap());
        let inside: Vec<c64> = all.iter().copied().filter(|s| REGION.contains(*s)).collect();
        assert_eq!(contour.count(point, &[]).unwrap(), Count::Unknown(inside.len() as i64));
        assert_eq!(cell.growing > 0, all.iter().any(|s| s.re > 0.0));
    }
}

/// A known zero that is none, and one that is missing, change the count.
#[test]
fn invariant_a_missing_zero_and_a_false_one_are_noticed() {
    let (plant, attached) = train(5, 8, 3, 1, 2);
    let space = Space::new(&plant, &attached, true).unwrap();
    let level = space.level(&attached).unwrap();
    let controllers = space.controllers(&Controllers::Equal(controller(60.0, 1.0, 0.05), 8));
    let point = Point { space: &space, level: &level, controllers: &controllers };
    let contour = Contour::new(REGION, point, &[]).unwrap();
    let values = eigenvalues(&space.whole(&level, &controllers).unwrap());
    let mut known = Followed::start(REGION, point, &values).known();
    known.retain(|s| REGION.contains(*s));
    assert_eq!(contour.count(point, &known).unwrap(), Count::Unknown(0));
    known.push(c64::new(0.3, 17.0));
    assert_eq!(contour.count(point, &known).unwrap(), Count::Unknown(-2));
    known.pop();
    let last = known.pop().unwrap();
    let missing = if last.im == 0.0 { 1 } else { 2 };
    assert_eq!(contour.count(point, &known).unwrap(), Count::Unknown(missing));
}

/// Attached parts with the same spaces share one plant; another place needs another space.
#[test]
fn invariant_levels_that_do_not_fit_are_refused() {
    let (plant, attached) = train(5, 8, 3, 1, 2);
    let space = Space::new(&plant, &attached, true).unwrap();
    let mut stiffer = attached.clone();
    stiffer.a[(2, 0)] *= 2.0;
    let heavier = Attached { b: &attached.b * 0.5, ..attached.clone() };
    assert!(space.level(&stiffer).is_some() && space.level(&heavier).is_some());
    let mut elsewhere = attached.clone();
    elsewhere.b[(2, 0)] += 0.01;
    assert!(space.level(&elsewhere).is_none());
    let there = space.again(&plant, &elsewhere).unwrap();
    assert!(there.level(&elsewhere).is_some());
}

/// Walks that start elsewhere, and threads, do not change a bit of the result.
#[test]
fn invariant_a_map_has_the_same_bits_on_one_thread_and_on_two() {
    struct Rows<'a>(&'a Level, Vec<Vec<Controllers>>, std::sync::Mutex<Vec<Vec<Cell>>>);
    impl Grid for Rows<'_> {
        fn columns(&self) -> usize {
            self.1[0].len()
        }
        fn rows(&self) -> usize {
            self.1.len()
        }
        fn level(&self, _: usize, _: usize) -> &Level {
            self.0
        }
        fn controllers(&self, column: usize, row: usize) -> Controllers {
            self.1[row][column].clone()
        }
        fn is_done(&self, _: usize) -> bool {
            false
        }
        fn done(&self, row: usize, cells: Vec<Cell>) -> bool {
            self.2.lock().unwrap()[row] = cells;
            true
        }
    }
    let (plant, attached) = train(5, 8, 3, 1, 2);
    let space = Space::new(&plant, &attached, true).unwrap();
    let level = space.level(&attached).unwrap();
    let at = |p: usize, d: usize| {
        let p = 30.0 + 12.0 * p as f64;
        let one = controller(p, 0.012 * p - 0.001 * d as f64 * p, 0.05);
        space.controllers(&Controllers::Equal(one, 8))
    };
    let all: Vec<Vec<Controllers>> = (0..6).map(|d| (0..12).map(|p| at(p, d)).collect()).collect();
    let run = |threads: usize| {
        let grid = Rows(&level, all.clone(), std::sync::Mutex::new(vec![Vec::new(); 6]));
        let first = at(0, 0);
        let point = Point { space: &space, level: &level, controllers: &first };
        let values = eigenvalues(&space.whole(&level, &first).unwrap());
        let followed = Followed::start(REGION, point, &values);
        let ladder = Ladder::new(REGION, f64::INFINITY, point, &followed.known()).unwrap();
        survey(&space, &ladder, &grid, (0, 0), &followed, threads).unwrap();
        grid.2.into_inner().unwrap()
    };
    assert_eq!(run(1), run(2));
}
