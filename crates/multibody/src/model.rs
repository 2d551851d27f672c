//! The assembled model: immutable, shared by all evaluations.

use std::collections::BTreeMap;

use crate::block::{Factorisation, Index, Place};
use crate::composite::{Composite, Member};
use crate::description::JointKind;
use crate::elements::{Bushing, JointForce, Spring};
use crate::integrate::Scheme;
use crate::joint::Joint;
use crate::math::Vec3;
use crate::reactions::Attachments;
use crate::state::State;

/// What the vehicle consists of, before fixed joints are merged.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Counts {
    /// Bodies of the description.
    pub bodies: usize,
    /// Joints by kind.
    pub joints: BTreeMap<JointKind, usize>,
    /// Constraint equations of all joints, brackets included.
    pub equations: usize,
    /// Rank of their Jacobian; equal to `equations`, since redundant joints are refused.
    pub rank: usize,
    /// Degrees of freedom, 6·bodies − rank.
    pub degrees_of_freedom: usize,
    /// Magnets.
    pub magnets: usize,
    /// Bodies after merging.
    pub composites: usize,
    /// Constraint equations after merging.
    pub reduced_equations: usize,
    /// Groups of composites that share no joint.
    pub components: usize,
    /// Bushings, springs and joint springs.
    pub force_elements: usize,
}

/// A point on a composite body.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Anchor {
    pub body: usize,
    /// In the body's axes from its centre of mass, m.
    pub local: Vec3,
    /// In the world in the initial pose, m.
    pub start: Vec3,
}

/// Longitudinal hold at some bodies.
#[derive(Debug, Clone)]
pub(crate) struct DriveForce {
    /// Points at the described bodies' centres of mass.
    pub anchors: Vec<Anchor>,
    /// N/m.
    pub stiffness: f64,
    /// N·s/m.
    pub damping: f64,
}

/// A body whose motion is observed.
#[derive(Debug, Clone)]
pub(crate) struct Watched {
    pub name: String,
    /// Index of the described body.
    pub member: usize,
    pub points: Vec<Anchor>,
}

/// Where a joint's blocks for a and for b are stored.
pub(crate) type JointPlaces = [Option<Place>; 2];

/// Where the blocks of the saddle-point matrix are stored.
#[derive(Debug, Clone)]
pub(crate) struct Places {
    /// Diagonal block of each body; `None` where its factor is constant.
    pub bodies: Vec<Option<Index>>,
    /// Blocks (joint, a) and (joint, b); `None` for the ground.
    pub joints: Vec<JointPlaces>,
}

/// Tolerances of the closing of joints after each internal step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerances {
    /// Largest violation of a constraint equation left after a step, m or rad.
    pub position: f64,
    /// Largest rate of a constraint equation left after a step, m/s or rad/s.
    pub velocity: f64,
}

impl Default for Tolerances {
    /// 1e-11 m and m/s: a thousandth of the promised 1e-8, and well above rounding (1e-15).
    fn default() -> Self {
        Self { position: 1e-11, velocity: 1e-11 }
    }
}

/// A vehicle ready to be stepped: assembled once by [`Model::new`], never changed.
#[derive(Debug, Clone)]
pub struct Model {
    pub(crate) name: String,
    pub(crate) composites: Vec<Composite>,
    pub(crate) members: Vec<Member>,
    pub(crate) joints: Vec<Joint>,
    pub(crate) bushings: Vec<Bushing>,
    pub(crate) springs: Vec<Spring>,
    pub(crate) joint_forces: Vec<JointForce>,
    pub(crate) drive: Option<DriveForce>,
    pub(crate) magnets: Vec<Anchor>,
    pub(crate) watched: Vec<Watched>,
    pub(crate) attachments: Attachments,
    pub(crate) gravity: Vec3,
    pub(crate) nominal_gap: f64,
    /// Rows of constraint equations after merging.
    pub(crate) rows: usize,
    pub(crate) solver: Factorisation,
    pub(crate) places: Places,
    /// Group of jointed bodies that each composite belongs to.
    pub(crate) components: Vec<usize>,
    pub(crate) counts: Counts,
    pub(crate) total_mass: f64,
    pub(crate) tolerances: Tolerances,
    pub(crate) scheme: Scheme,
}

impl Model {
    /// The vehicle's name.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// What it consists of.
    #[must_use]
    pub fn counts(&self) -> &Counts {
        &self.counts
    }

    /// Mass of all bodies but those that stand for the surroundings, kg.
    #[must_use]
    pub fn total_mass(&self) -> f64 {
        self.total_mass
    }

    /// c0, m.
    #[must_use]
    pub fn nominal_gap(&self) -> f64 {
        self.nominal_gap
    }

    /// Replaces the tolerances of joint closing.
    #[must_use]
    pub fn with_tolerances(mut self, tolerances: Tolerances) -> Self {
        self.tolerances = tolerances;
        self
    }

    /// Replaces the integration scheme.
    #[must_use]
    pub fn with_scheme(mut self, scheme: Scheme) -> Self {
        self.scheme = scheme;
        self
    }

    /// Names of the composite bodies, in the order of [`State::bodies`].
    pub fn body_names(&self) -> impl Iterator<Item = &str> {
        self.composites.iter().map(|c| c.name.as_str())
    }

    /// Names of the joints that are left after merging, with their number of equations, in the
    /// order of the multipliers.
    pub fn joint_names(&self) -> impl Iterator<Item = (&str, usize)> {
        self.joints.iter().map(|j| (j.name.as_str(), j.equations()))
    }

    /// Index of the composite that a described body belongs to; `None` if there is no such body or
    /// it is fixed to the ground.
    #[must_use]
    pub fn body_index(&self, name: &str) -> Option<usize> {
        let composite = self.members.iter().find(|m| m.name == name)?.composite;
        (composite < self.composites.len()).then_some(composite)
    }

    /// Number of unknowns of eq. 9: accelerations and multipliers.
    #[must_use]
    pub fn unknowns(&self) -> usize {
        6 * self.composites.len() + self.rows
    }

    /// The pose of the description, at rest at time zero.
    #[must_use]
    pub fn initial_state(&self) -> State {
        State { time: 0.0, bodies: self.composites.iter().map(|c| c.start).collect() }
    }
}
