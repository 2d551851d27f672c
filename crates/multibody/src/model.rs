//! The assembled model: immutable, shared by all evaluations.

use crate::anchor::{Anchor, DriveForce, WatchedBody};
use crate::attachments::Attachments;
use crate::block::Factorisation;
use crate::composite::{Composite, Member};
use crate::contact::ContactDescription;
use crate::counts::VehicleCounts;
use crate::elements::{BushingElement, JointForceElement, SpringElement};
use crate::index::{BodyIndex, ComponentIndex, MagnetIndex};
use crate::joint::JointConstraint;
use crate::math::Vec3;
use crate::motors::Motors;
use crate::places::BlockPlaces;
use crate::scheme::Scheme;
use crate::state::State;
use track_line::Line;

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

/// A vehicle ready to be stepped: assembled once by [`VehicleModel::new`], never changed.
#[derive(Debug, Clone)]
pub struct VehicleModel {
    pub(crate) name: String,
    pub(crate) composites: Vec<Composite>,
    pub(crate) members: Vec<Member>,
    pub(crate) joints: Vec<JointConstraint>,
    pub(crate) bushings: Vec<BushingElement>,
    pub(crate) springs: Vec<SpringElement>,
    pub(crate) joint_forces: Vec<JointForceElement>,
    pub(crate) drive: Option<DriveForce>,
    pub(crate) magnets: Vec<Anchor>,
    /// Acceleration per force at each magnet of its body without joints, along x, y and z, 1/kg.
    pub(crate) mobilities: Vec<[f64; 3]>,
    pub(crate) contact: ContactDescription,
    pub(crate) watched: Vec<WatchedBody>,
    pub(crate) attachments: Attachments,
    pub(crate) gravity: Vec3,
    pub(crate) nominal_gap: f64,
    /// Rows of constraint equations after merging.
    pub(crate) rows: usize,
    pub(crate) solver: Factorisation,
    pub(crate) places: BlockPlaces,
    /// Group of jointed bodies that each composite belongs to.
    pub(crate) components: Vec<ComponentIndex>,
    pub(crate) counts: VehicleCounts,
    pub(crate) total_mass: f64,
    pub(crate) tolerances: Tolerances,
    pub(crate) scheme: Scheme,
    /// Internal step above which stages may keep factors, s.
    pub(crate) keeps_above: f64,
    /// The line that it travels along; none on a straight track.
    pub(crate) line: Option<Line>,
    /// Its linear motors; none without a motor file.
    pub(crate) motors: Option<Motors>,
}

impl VehicleModel {
    /// The vehicle's name.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// What it consists of.
    #[must_use]
    pub fn counts(&self) -> &VehicleCounts {
        &self.counts
    }

    /// Mass of all bodies except those that represent the surroundings, kg.
    #[must_use]
    pub fn total_mass(&self) -> f64 {
        self.total_mass
    }

    /// c0, m.
    #[must_use]
    pub fn nominal_gap(&self) -> f64 {
        self.nominal_gap
    }

    /// Stops and skids of the description, or the standard ones, switched off.
    #[must_use]
    pub fn contact(&self) -> &ContactDescription {
        &self.contact
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
    pub fn body_index(&self, name: &str) -> Option<BodyIndex> {
        let composite = self.members.iter().find(|m| m.name == name)?.composite;
        (composite != self.ground()).then_some(composite)
    }

    /// The index that means the ground wherever a body is expected.
    pub(crate) fn ground(&self) -> BodyIndex {
        BodyIndex(self.composites.len())
    }

    /// The magnets, in the order of the description.
    pub fn magnets(&self) -> impl ExactSizeIterator<Item = MagnetIndex> + use<> {
        (0..self.magnets.len()).map(MagnetIndex)
    }

    /// Number of unknowns of eq. 9: accelerations and multipliers.
    #[must_use]
    pub fn unknowns(&self) -> usize {
        6 * self.composites.len() + self.rows
    }

    /// The pose of the description, at rest at time zero.
    #[must_use]
    pub fn initial_state(&self) -> State {
        let bodies = self.composites.iter().map(|c| c.start).collect();
        State { time: 0.0, bodies, travel: None }
    }
}
