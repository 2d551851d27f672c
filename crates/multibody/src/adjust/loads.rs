//! Masses of observed bodies, and loads on them.

use super::{Adjustable, Dimension, Target};
use crate::description::{Body, Inertia, Joint, JointKind, VehicleDescription};
use crate::index::ObservedIndex;
use crate::math::{Vec3, rotation_matrix};

/// Height of the box that a load fills, m.
const LOAD_HEIGHT: f64 = 1.0;
/// Smallest mass of a body (kg) and extent of a load (m).
const SMALLEST_MASS: f64 = 1e-3;
const SMALLEST_EXTENT: f64 = 1e-2;

/// A component of a load.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum LoadPart {
    Mass,
    X,
    Y,
    Z,
    Length,
    Width,
}

/// A homogeneous box that is fixed to an observed body.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Load {
    mass: f64,
    /// From the body's centre of mass, m.
    place: [f64; 3],
    /// Length and width, m.
    extent: [f64; 2],
}

/// Loads on all observed bodies, and what they and changed masses add to the weight.
pub(super) struct PlacedLoads {
    loads: Vec<Load>,
    /// By observed body: mass (kg) and its place in the world in the initial pose (m).
    pub weights: Vec<Vec<(f64, Vec3)>>,
}

/// Bodies of observed body k: itself, then its parts.
fn bodies(description: &VehicleDescription, k: ObservedIndex) -> Vec<usize> {
    let observed = &description.observed[k];
    std::iter::once(&observed.body)
        .chain(&observed.parts)
        .filter_map(|name| description.bodies.iter().position(|b| b.name == *name))
        .collect()
}

/// Quantities of all observed bodies; of two that share a body, only those of the first.
pub(super) fn adjustables(description: &VehicleDescription) -> Vec<Adjustable> {
    let mut all = Vec::new();
    let mut taken = Vec::new();
    for (k, observed) in description.observed.iter().enumerate() {
        let (name, own) = (&observed.name, bodies(description, ObservedIndex(k)));
        if own.iter().any(|body| taken.contains(body)) {
            continue;
        }
        taken.extend(&own);
        let mut add = |key: &str, dimension, start, min, target, text: &str| {
            all.push(Adjustable {
                name: format!("{name}_{key}"),
                description: format!("{name}: {text}"),
                dimension,
                start,
                min,
                target,
            });
        };
        let k = ObservedIndex(k);
        let mass = own.iter().map(|&body| description.bodies[body].mass).sum();
        let text = "mass of the body without what is attached to it; its moments of inertia change in \
                    proportion";
        add("mass", Dimension::Mass, mass, Some(SMALLEST_MASS), Target::Mass(k), text);
        let length = Dimension::Length;
        for (key, dimension, start, min, part, text) in [
            (
                "load_mass",
                Dimension::Mass,
                0.0,
                Some(0.0),
                LoadPart::Mass,
                "mass of a load that is fixed to the body, such as passengers; the magnets carry it from \
                 the start",
            ),
            (
                "load_x",
                length,
                0.0,
                None,
                LoadPart::X,
                "place of the load's centre of mass ahead of the body's, as both stand in the vehicle file",
            ),
            (
                "load_y",
                length,
                0.0,
                None,
                LoadPart::Y,
                "place of the load's centre of mass to the left of the body's",
            ),
            (
                "load_z",
                length,
                0.0,
                None,
                LoadPart::Z,
                "place of the load's centre of mass above the body's",
            ),
            (
                "load_length",
                length,
                1.0,
                Some(SMALLEST_EXTENT),
                LoadPart::Length,
                "extent of the load along the body, for its moments of inertia as a box of 1 m height",
            ),
            (
                "load_width",
                length,
                1.0,
                Some(SMALLEST_EXTENT),
                LoadPart::Width,
                "extent of the load across the body, for its moments of inertia",
            ),
        ] {
            add(key, dimension, start, min, Target::Load(k, part), text);
        }
    }
    all
}

impl PlacedLoads {
    pub fn new(description: &VehicleDescription) -> Self {
        let none = Load { mass: 0.0, place: [0.0; 3], extent: [1.0; 2] };
        let count = description.observed.len();
        Self { loads: vec![none; count], weights: vec![Vec::new(); count] }
    }

    /// Multiplies the masses of an observed body and its parts.
    pub fn scale(&mut self, k: ObservedIndex, factor: f64, description: &mut VehicleDescription) {
        for body in bodies(description, k) {
            let body = &mut description.bodies[body];
            let added = body.mass * factor - body.mass;
            self.weights[k].push((added, body.position.into()));
            body.mass *= factor;
            body.inertia = match body.inertia {
                Inertia::Principal(moments) => Inertia::Principal(moments.map(|j| j * factor)),
                Inertia::Full(rows) => Inertia::Full(rows.map(|row| row.map(|j| j * factor))),
            };
        }
    }

    pub fn set(&mut self, k: ObservedIndex, part: LoadPart, value: f64) {
        let load = &mut self.loads[k];
        match part {
            LoadPart::Mass => load.mass = value,
            LoadPart::X => load.place[0] = value,
            LoadPart::Y => load.place[1] = value,
            LoadPart::Z => load.place[2] = value,
            LoadPart::Length => load.extent[0] = value,
            LoadPart::Width => load.extent[1] = value,
        }
    }

    /// Adds the loads as bodies, each fixed to the nearest of its observed body's parts.
    pub fn add(&mut self, description: &mut VehicleDescription) {
        for (k, load) in self.loads.iter().enumerate().filter(|(_, load)| load.mass != 0.0) {
            let own = bodies(description, ObservedIndex(k));
            let Some(body) = own.first().map(|&body| &description.bodies[body]) else { continue };
            let place = Vec3::from(body.position)
                + rotation_matrix(body.attitude()) * Vec3::from(load.place);
            let distance =
                |k: usize| (Vec3::from(description.bodies[k].position) - place).norm_squared();
            let nearest = own.iter().copied().min_by(|a, b| distance(*a).total_cmp(&distance(*b)));
            let Some(carrier) = nearest else { continue };
            let (carrier, orientation) =
                (description.bodies[carrier].name.clone(), body.orientation);
            let ([a, b], c) = (load.extent, LOAD_HEIGHT);
            let moments = [b * b + c * c, a * a + c * c, a * a + b * b];
            let name = format!("{}_load", description.observed[k].name);
            self.weights[k].push((load.mass, place));
            description.bodies.push(Body {
                name: name.clone(),
                mass: load.mass,
                inertia: Inertia::Principal(moments.map(|m| load.mass / 12.0 * m)),
                position: place.into(),
                orientation,
                reference: false,
            });
            description.joints.push(Joint {
                name,
                kind: JointKind::Bracket,
                body_a: carrier,
                body_b: format!("{}_load", description.observed[k].name),
                position: Some(place.into()),
                axis: None,
                local_a: None,
                local_b: None,
                local_axis_a: None,
                local_axis_b: None,
            });
        }
    }
}
