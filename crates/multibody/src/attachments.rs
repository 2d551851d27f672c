//! The described bodies that joints and elements act on. Merging loses this information, and the
//! reactions of brackets need it.

use std::fmt::Display;

use crate::description::{JointKind, VehicleDescription};
use crate::error::Error;
use crate::index::MemberIndex;
use crate::math::{Mat3, Vec3};
use crate::names::BodyNames;
use crate::sides::joint_sides;

/// A described body, by its index; `None` is the ground.
pub(crate) type End = Option<MemberIndex>;

/// A fixed joint that was merged away.
#[derive(Debug, Clone)]
pub(crate) struct Bracket {
    pub name: String,
    pub ends: [End; 2],
    /// In the world in the initial pose, m.
    pub point: Vec3,
}

/// The described bodies that joints and elements act on. Merging loses this information, and the
/// reactions of brackets need it.
#[derive(Debug, Clone)]
pub(crate) struct Attachments {
    pub masses: Vec<f64>,
    /// In the bodies' own axes, kg·m².
    pub inertias: Vec<Mat3>,
    pub brackets: Vec<Bracket>,
    pub joints: Vec<[End; 2]>,
    pub bushings: Vec<[End; 2]>,
    pub springs: Vec<[End; 2]>,
    pub drive: Vec<MemberIndex>,
    pub magnets: Vec<MemberIndex>,
}

impl Attachments {
    pub fn new(description: &VehicleDescription, names: &BodyNames) -> Result<Self, Error> {
        let bodies = &description.bodies;
        let mut brackets = Vec::new();
        let mut joints = Vec::new();
        for (k, joint) in description.joints.iter().enumerate() {
            let path = format_args!("joints[{k}]");
            let (a, b) = names.pair(&joint.body_a, &joint.body_b, &path)?;
            if joint.kind == JointKind::Bracket {
                let point = joint_sides(joint, bodies, names, &path)?.point_b;
                brackets.push(Bracket { name: joint.name.clone(), ends: [a, b], point });
            } else {
                joints.push([a, b]);
            }
        }
        let pair =
            |a: &str, b: &str, path: &dyn Display| names.pair(a, b, path).map(|(a, b)| [a, b]);
        let bushings = description.bushings.iter();
        let springs = description.springs.iter();
        let driven = description.drive.iter().flat_map(|drive| &drive.bodies);
        Ok(Self {
            masses: bodies.iter().map(|b| b.mass).collect(),
            inertias: bodies.iter().map(|b| b.inertia.matrix()).collect(),
            brackets,
            joints,
            bushings: bushings
                .map(|b| pair(&b.body_a, &b.body_b, &"bushings"))
                .collect::<Result<_, _>>()?,
            springs: springs
                .map(|s| pair(&s.body_a, &s.body_b, &"springs"))
                .collect::<Result<_, _>>()?,
            drive: driven.map(|b| names.moving(b, &"drive.bodies")).collect::<Result<_, _>>()?,
            magnets: description
                .magnets
                .iter()
                .map(|m| names.moving(&m.body, &"magnets"))
                .collect::<Result<_, _>>()?,
        })
    }

    /// The bodies connected to `start` by brackets other than `cut`, and whether the ground is
    /// among them.
    pub fn side(&self, start: End, cut: usize) -> (Vec<bool>, bool) {
        let ground = self.masses.len();
        let index = |end: End| end.map_or(ground, |member| member.0);
        let mut inside = vec![false; ground + 1];
        inside[index(start)] = true;
        let mut grown = true;
        while grown {
            grown = false;
            for (k, bracket) in self.brackets.iter().enumerate() {
                let [a, b] = bracket.ends.map(index);
                if k != cut && inside[a] != inside[b] {
                    (inside[a], inside[b], grown) = (true, true, true);
                }
            }
        }
        let grounded = inside[ground];
        (inside, grounded)
    }
}
