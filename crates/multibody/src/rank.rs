//! Rank of the joints' equations: which of them repeat what others already fix.
//!
//! That is a question of geometry. Masses, inertias and the unit of length must not change the
//! answer, so Φ_q is scaled with the geometry alone: the motion of a body is the velocity of the
//! middle of its joints, and its angular velocity times its size, the distance of the farthest joint
//! from that middle. Every equation is divided by its norm. Then entries of all sizes of bodies are
//! of order one.
//!
//! The scaled Φ_q is reduced body by body: orthogonal transformations of the rows that involve a
//! body clear all but at most six of them in its columns. The others pass to the remaining bodies. A
//! row that is left without bodies is a combination of equations that vanishes: multipliers that
//! cancel on every body, a state of self-stress. Orthogonal transformations keep the singular values,
//! which elimination with M⁻¹ would square.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{DMatrix, DVector};

use crate::joint::{JacobianRow, JointConstraint};
use crate::math::Vec3;
use crate::state::Kinematics;

/// What is left of rows of norm one when they count as dependent. The sides of a joint may be apart
/// by [`crate::MEETING_TOLERANCE`], so repeated joints need not repeat each other to the last digit.
const DEPENDENT: f64 = 1e-5;
/// Components of a self-stress below this fraction of the largest are rounding.
const NO_SHARE: f64 = 1e-6;
/// Distances below this fraction of the coordinates are rounding.
const COINCIDENT: f64 = 1e-9;

/// A state of self-stress: forces of the joints that cancel on every body.
#[derive(Debug, Clone)]
pub(crate) struct Dependency {
    /// The last joint that takes a share in it, and in no other reported self-stress with the same
    /// equation.
    pub joint: usize,
    /// Multipliers of each joint that takes a share.
    pub multipliers: BTreeMap<usize, DVector<f64>>,
}

/// Reference point and size of a body.
#[derive(Clone, Copy)]
struct Extent {
    middle: Vec3,
    size: f64,
}

/// Rows that involve the same bodies, six columns for each body.
struct Front {
    rows: Vec<usize>,
    bodies: Vec<usize>,
    matrix: DMatrix<f64>,
}

/// An orthogonal transformation of rows.
struct Turn {
    rows: Vec<usize>,
    matrix: DMatrix<f64>,
}

/// Finds the dependencies among the joints' equations in the pose of `kin` (the ground last), in the
/// order of the joints. A matrix that is not finite has none.
pub(crate) fn dependencies(joints: &[JointConstraint], kin: &[Kinematics]) -> Vec<Dependency> {
    let bodies = kin.len() - 1;
    let extents = extents(joints, kin);
    let mut norms = Vec::new();
    let mut reduction = Reduction::new(bodies);
    for joint in joints {
        let front = front(joint, kin, &extents, &mut norms);
        reduction.add(front);
    }
    if !norms.iter().all(|norm: &f64| norm.is_finite() && *norm > 0.0) {
        return Vec::new();
    }
    let mut stresses = reduction.run(norms.len());
    let last = separate(&mut stresses);
    let mut found: Vec<(usize, DVector<f64>)> = last.into_iter().zip(stresses).collect();
    found.sort_by_key(|(row, _)| *row);
    found.iter().map(|(row, stress)| dependency(*row, stress, joints, &norms)).collect()
}

fn dependency(
    last: usize,
    stress: &DVector<f64>,
    joints: &[JointConstraint],
    norms: &[f64],
) -> Dependency {
    let largest = stress.amax();
    let mut multipliers = BTreeMap::new();
    for (k, joint) in joints.iter().enumerate() {
        let share = stress.rows(joint.row, joint.equations());
        if share.amax() > NO_SHARE * largest {
            let of_unscaled = |r: usize, _| share[r] / norms[joint.row + r];
            multipliers.insert(k, DVector::from_fn(joint.equations(), of_unscaled));
        }
    }
    let joint = joints.iter().rposition(|joint| joint.row <= last).unwrap_or(0);
    Dependency { joint, multipliers }
}

/// The joint's points on a and b. The equations of a translational joint hold at b's point.
fn points(joint: &JointConstraint, kin: &[Kinematics]) -> [Vec3; 2] {
    let (a, b) = (&kin[joint.a], &kin[joint.b]);
    let point_b = b.r + b.turn(&joint.point_b);
    let on_b = joint.kind == crate::JointKind::Translational;
    [if on_b { point_b } else { a.r + a.turn(&joint.point_a) }, point_b]
}

/// Middle and size of each body. A body whose joints are at one point has no size of its own; it
/// takes that of its largest neighbour, or one where there is none.
fn extents(joints: &[JointConstraint], kin: &[Kinematics]) -> Vec<Extent> {
    let bodies = kin.len() - 1;
    let mut places: Vec<Vec<Vec3>> = vec![Vec::new(); bodies];
    let ends = |joint: &JointConstraint| [joint.a.0, joint.b.0];
    for joint in joints {
        for (body, point) in ends(joint).into_iter().zip(points(joint, kin)) {
            if body < bodies {
                places[body].push(point);
            }
        }
    }
    let mut extents: Vec<Extent> = places
        .iter()
        .map(|places| {
            let middle = places.iter().sum::<Vec3>() / places.len().max(1) as f64;
            let size = places.iter().map(|p| (p - middle).norm()).fold(0.0, f64::max);
            let coordinates = places.iter().map(|p| p.amax()).fold(0.0, f64::max);
            Extent { middle, size: if size > COINCIDENT * coordinates { size } else { 0.0 } }
        })
        .collect();
    loop {
        let mut news = vec![0.0_f64; bodies];
        for joint in joints {
            let [a, b] = ends(joint);
            if a < bodies && b < bodies {
                news[a] = news[a].max(extents[b].size);
                news[b] = news[b].max(extents[a].size);
            }
        }
        let mut changed = false;
        for (extent, size) in extents.iter_mut().zip(news) {
            if extent.size == 0.0 && size > 0.0 {
                (extent.size, changed) = (size, true);
            }
        }
        if !changed {
            break;
        }
    }
    for extent in extents.iter_mut().filter(|extent| extent.size == 0.0) {
        extent.size = 1.0;
    }
    extents
}

/// The joint's equations, scaled; appends their norms.
fn front(
    joint: &JointConstraint,
    kin: &[Kinematics],
    extents: &[Extent],
    norms: &mut Vec<f64>,
) -> Front {
    let n = joint.equations();
    let (mut rows_a, mut rows_b) = ([JacobianRow::default(); 6], [JacobianRow::default(); 6]);
    joint.jacobian(kin, &mut rows_a[..n], &mut rows_b[..n]);
    let sides: Vec<(usize, &[JacobianRow])> = [(joint.a.0, &rows_a), (joint.b.0, &rows_b)]
        .into_iter()
        .filter(|(body, _)| *body < extents.len())
        .map(|(body, rows)| (body, &rows[..n]))
        .collect();
    let mut matrix = DMatrix::zeros(n, 6 * sides.len());
    for (k, (body, rows)) in sides.iter().enumerate() {
        let (Extent { middle, size }, kin) = (extents[*body], &kin[*body]);
        for (r, row) in rows.iter().enumerate() {
            let force = Vec3::new(row[0], row[1], row[2]);
            let moment = kin.turn(&Vec3::new(row[3], row[4], row[5]));
            let moment = (moment + (kin.r - middle).cross(&force)) / size;
            for c in 0..3 {
                matrix[(r, 6 * k + c)] = force[c];
                matrix[(r, 6 * k + 3 + c)] = moment[c];
            }
        }
    }
    for mut row in matrix.row_iter_mut() {
        let norm = row.norm();
        row /= norm;
        norms.push(norm);
    }
    let rows = (joint.row..joint.row + n).collect();
    Front { rows, bodies: sides.into_iter().map(|(body, _)| body).collect(), matrix }
}

/// The reduction in progress.
struct Reduction {
    fronts: Vec<Option<Front>>,
    /// The fronts that involve each body.
    of_body: Vec<BTreeSet<usize>>,
    turns: Vec<Turn>,
    /// Rows without bodies.
    empty: Vec<usize>,
}

impl Reduction {
    fn new(bodies: usize) -> Self {
        let of_body = vec![BTreeSet::new(); bodies];
        Self { fronts: Vec::new(), of_body, turns: Vec::new(), empty: Vec::new() }
    }

    fn add(&mut self, front: Front) {
        if front.bodies.is_empty() {
            self.empty.extend(front.rows);
            return;
        }
        for &body in &front.bodies {
            self.of_body[body].insert(self.fronts.len());
        }
        self.fronts.push(Some(front));
    }

    /// The other bodies in the fronts of a body.
    fn neighbours(&self, body: usize) -> BTreeSet<usize> {
        let fronts = self.of_body[body].iter().filter_map(|&k| self.fronts[k].as_ref());
        fronts.flat_map(|front| &front.bodies).copied().filter(|k| *k != body).collect()
    }

    /// Clears all bodies, those with fewest neighbours first, and returns the self-stresses by row.
    fn run(mut self, rows: usize) -> Vec<DVector<f64>> {
        let mut degrees: Vec<usize> =
            (0..self.of_body.len()).map(|k| self.neighbours(k).len()).collect();
        let mut left: BTreeSet<(usize, usize)> = degrees.iter().copied().zip(0..).collect();
        while let Some((_, body)) = left.pop_first() {
            for neighbour in self.clear(body) {
                left.remove(&(degrees[neighbour], neighbour));
                degrees[neighbour] = self.neighbours(neighbour).len();
                left.insert((degrees[neighbour], neighbour));
            }
        }
        let stress = |&row: &usize| {
            let mut stress = DVector::zeros(rows);
            stress[row] = 1.0;
            for Turn { rows, matrix } in self.turns.iter().rev() {
                let part = DVector::from_iterator(rows.len(), rows.iter().map(|r| stress[*r]));
                for (value, r) in matrix.tr_mul(&part).iter().zip(rows) {
                    stress[*r] = *value;
                }
            }
            stress
        };
        self.empty.iter().map(stress).collect()
    }

    /// Clears the columns of a body in all rows but those that its motion needs, and returns its
    /// neighbours.
    fn clear(&mut self, body: usize) -> BTreeSet<usize> {
        let neighbours = self.neighbours(body);
        let bodies: Vec<usize> = std::iter::once(body).chain(neighbours.iter().copied()).collect();
        let mut fronts = Vec::new();
        for k in std::mem::take(&mut self.of_body[body]) {
            for neighbour in &neighbours {
                self.of_body[*neighbour].remove(&k);
            }
            fronts.extend(self.fronts[k].take());
        }
        let rows: Vec<usize> = fronts.iter().flat_map(|front| &front.rows).copied().collect();
        if rows.is_empty() {
            return neighbours;
        }
        let mut own = DMatrix::zeros(rows.len(), 6);
        let mut others = DMatrix::zeros(rows.len(), 6 * neighbours.len());
        let mut first = 0;
        for front in &fronts {
            for (k, at) in front.bodies.iter().enumerate() {
                let block = front.matrix.columns(6 * k, 6);
                let place = bodies.iter().position(|b| b == at).unwrap_or(0);
                let (target, column) =
                    if place == 0 { (&mut own, 0) } else { (&mut others, 6 * (place - 1)) };
                target.view_mut((first, column), block.shape()).copy_from(&block);
            }
            first += front.rows.len();
        }
        let factors = own.col_piv_qr();
        let r = factors.r();
        let needed = (0..r.nrows()).take_while(|&k| r[(k, k)] > DEPENDENT).count();
        factors.q_tr_mul(&mut others);
        let mut turn = DMatrix::identity(rows.len(), rows.len());
        factors.q_tr_mul(&mut turn);
        let left = rows.len() - needed;
        if left > 0 {
            let matrix = others.rows(needed, left).into_owned();
            let bodies = bodies[1..].to_vec();
            self.add(Front { rows: rows[needed..].to_vec(), bodies, matrix });
            self.turns.push(Turn { rows, matrix: turn });
        }
        neighbours
    }
}

/// Combines the vectors so that each has a last component of its own, and returns these: the
/// equations that follow from those before them.
fn separate(vectors: &mut [DVector<f64>]) -> Vec<usize> {
    let mut last: Vec<usize> = Vec::new();
    for row in (0..vectors.first().map_or(0, DVector::len)).rev() {
        let done = last.len();
        if done == vectors.len() {
            break;
        }
        for vector in &mut vectors[done..] {
            *vector /= vector.amax();
        }
        let size = |k: &usize| vectors[*k][row].abs();
        let best = (done..vectors.len()).max_by(|a, b| size(a).total_cmp(&size(b)));
        let Some(best) = best.filter(|k| size(k) > NO_SHARE) else { continue };
        vectors.swap(done, best);
        let unit = &vectors[done] / vectors[done][row];
        for (k, vector) in vectors.iter_mut().enumerate() {
            if k == done {
                vector.copy_from(&unit);
            } else {
                let factor = vector[row];
                vector.axpy(-factor, &unit, 1.0);
            }
        }
        last.push(row);
    }
    last
}
