//! A car body as one rigid body or as a chain of rigid segments with elastic joints (rigid finite segments).
//!
//! The body is divided into n equal lengths; in the middle of each is a spherical joint with springs and
//! dampers against relative rotation. So there are n + 1 rigid segments, half as long at both ends, and one
//! of them is the middle. All joints have the same stiffness, as in a uniform beam.
//!
//! With the joints' angles φ and the rigid-body motions r, the free chain has the energy
//! ½ (ṙ, φ̇)ᵀ M (ṙ, φ̇) + ½ k φᵀφ. Free means no force on r, which leaves S φ̈ + k φ = 0 with the Schur
//! complement S = M_φφ − M_φr M_rr⁻¹ M_rφ. The lowest frequency ω belongs to the largest eigenvalue σ of S,
//! so k = ω² σ; and c = 2 ζ k/ω damps this mode by ζ.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, SymmetricEigen};

use super::description::{FlexibleBody, TrainDescription};

/// A segment: a part of a car's length.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Segment {
    pub name: String,
    /// From and to, from the car's centre, front first, m.
    pub front: f64,
    pub rear: f64,
}

impl Segment {
    pub fn length(&self) -> f64 {
        self.front - self.rear
    }

    pub fn centre(&self) -> f64 {
        0.5 * (self.front + self.rear)
    }
}

/// Stiffness (N·m/rad) and damping (N·m·s/rad) of each joint about x, y and z.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Flexure {
    pub stiffness: [f64; 3],
    pub damping: [f64; 3],
}

/// The segments of car c, front first; a rigid car is one.
pub(super) fn segments(train: &TrainDescription, c: usize) -> Vec<Segment> {
    let (name, length) = (format!("car_{}", c + 1), train.car_length());
    let Some(flexible) = &train.flexible_body else {
        return vec![Segment { name, front: 0.5 * length, rear: -0.5 * length }];
    };
    let n = flexible.segments;
    let cut = |k: usize| length * (0.5 - (k as f64 + 0.5) / n as f64);
    (0..=n)
        .map(|k| Segment {
            // the middle one stands for the car
            name: if 2 * k == n { name.clone() } else { format!("{name}_segment_{}", k + 1) },
            front: if k == 0 { 0.5 * length } else { cut(k - 1) },
            rear: if k == n { -0.5 * length } else { cut(k) },
        })
        .collect()
}

/// The segment at a place from the car's centre. At a cut it is the one nearer to the middle.
pub(super) fn segment_at(segments: &[Segment], x: f64) -> &str {
    // a nanometre is no distance, but rounding
    let inside = |s: &&Segment| x <= s.front + 1e-9 && x >= s.rear - 1e-9;
    let nearest = |a: &&Segment, b: &&Segment| a.centre().abs().total_cmp(&b.centre().abs());
    let beyond =
        |a: &&Segment, b: &&Segment| (a.centre() - x).abs().total_cmp(&(b.centre() - x).abs());
    let found = segments.iter().filter(inside).min_by(nearest);
    found.or_else(|| segments.iter().min_by(beyond)).map_or("", |s| s.name.as_str())
}

/// Stiffness and damping of the joints between these segments of one car body.
pub(super) fn flexure(
    train: &TrainDescription,
    flexible: &FlexibleBody,
    segments: &[Segment],
) -> Flexure {
    let (width, height) = (train.dimensions.car_width, train.dimensions.car_height);
    let density = train.masses.car_body / train.car_length();
    let mass = |s: &Segment| density * s.length();
    let box_moment = |s: &Segment, a: f64, b: f64| mass(s) / 12.0 * (a * a + b * b);
    let parts = |depth: f64| -> Vec<[f64; 3]> {
        segments.iter().map(|s| [mass(s), box_moment(s, s.length(), depth), s.centre()]).collect()
    };
    let cuts: Vec<f64> = segments.iter().skip(1).map(|s| s.front).collect();
    let lateral = flexible.lateral_bending_frequency.unwrap_or(flexible.bending_frequency);
    let twists: Vec<f64> = segments.iter().map(|s| box_moment(s, width, height)).collect();
    let all = [
        (flexible.torsion_frequency, largest_inertia_of_torsion(&twists)),
        (flexible.bending_frequency, largest_inertia_of_bending(&parts(height), &cuts)),
        (lateral, largest_inertia_of_bending(&parts(width), &cuts)),
    ];
    Flexure {
        stiffness: all.map(|(f, inertia)| (TAU * f).powi(2) * inertia),
        damping: all.map(|(f, inertia)| 2.0 * flexible.damping * TAU * f * inertia),
    }
}

/// σ of bending. Segments as mass, moment of inertia and place; the joints' places, front first.
fn largest_inertia_of_bending(parts: &[[f64; 3]], cuts: &[f64]) -> f64 {
    let shapes = |[_, _, x]: [f64; 3], k: usize| -> Vec<[f64; 2]> {
        let rigid = [[1.0, 0.0], [x, 1.0]];
        // behind a joint, its angle turns and moves the segment
        let bent =
            cuts.iter().enumerate().map(|(j, cut)| if k > j { [x - cut, 1.0] } else { [0.0, 0.0] });
        rigid.into_iter().chain(bent).collect()
    };
    let size = cuts.len() + 2;
    let mut inertia = DMatrix::zeros(size, size);
    for (k, part) in parts.iter().enumerate() {
        let motion = shapes(*part, k);
        inertia += DMatrix::from_fn(size, size, |r, c| {
            part[0] * motion[r][0] * motion[c][0] + part[1] * motion[r][1] * motion[c][1]
        });
    }
    largest_of_complement(&inertia, 2)
}

/// σ of torsion. Moments of inertia of the segments about the car's axis.
fn largest_inertia_of_torsion(moments: &[f64]) -> f64 {
    let size = moments.len();
    let inertia = DMatrix::from_fn(size, size, |r, c| {
        // column 0 turns all segments, column j those behind joint j
        moments.iter().skip(r.max(c)).sum::<f64>()
    });
    largest_of_complement(&inertia, 1)
}

/// Largest eigenvalue of the Schur complement that is left without the first `rigid` coordinates.
fn largest_of_complement(inertia: &DMatrix<f64>, rigid: usize) -> f64 {
    let elastic = inertia.nrows() - rigid;
    let coupling = inertia.view((0, rigid), (rigid, elastic)).into_owned();
    let free = inertia.view((0, 0), (rigid, rigid)).into_owned();
    let own = inertia.view((rigid, rigid), (elastic, elastic)).into_owned();
    // positive definite: segments have mass
    let carried =
        free.cholesky().map_or_else(|| DMatrix::zeros(rigid, elastic), |f| f.solve(&coupling));
    let complement = own - coupling.tr_mul(&carried);
    SymmetricEigen::new((&complement + complement.transpose()) * 0.5).eigenvalues.max()
}
