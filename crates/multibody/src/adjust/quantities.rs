//! Stiffness and damping of groups of elements.

use super::{Adjustable, Coefficient, Dimension, Slot, Target};
use crate::description::{JointKind, Spring, VehicleDescription};
use crate::error::{Error, invalid};
use crate::groups::GroupMembers;
use crate::math::Vec3;

const DIRECTIONS: [&str; 3] = ["longitudinal", "lateral", "vertical"];
const ROTATIONS: [&str; 3] = ["roll", "pitch", "yaw"];
/// Names of the axes of bushings with axes of their own.
const OWN_AXES: [&str; 3] = ["x", "y", "z"];

impl Coefficient {
    fn dimension(self) -> Dimension {
        match self {
            Self::Stiffness => Dimension::Stiffness,
            Self::Damping => Dimension::Damping,
            Self::RotationalStiffness => Dimension::RotationalStiffness,
            Self::RotationalDamping => Dimension::RotationalDamping,
        }
    }

    fn word(self) -> &'static str {
        match self {
            Self::Stiffness | Self::RotationalStiffness => "stiffness",
            Self::Damping | Self::RotationalDamping => "damping",
        }
    }
}

impl Slot {
    /// The number in a description.
    fn of<'d>(&self, description: &'d mut VehicleDescription) -> &'d mut f64 {
        match *self {
            Self::Bushing(k, coefficient, axis) => {
                let bushing = &mut description.bushings[k];
                let values = match coefficient {
                    Coefficient::Stiffness => &mut bushing.translational_stiffness,
                    Coefficient::Damping => &mut bushing.translational_damping,
                    Coefficient::RotationalStiffness => &mut bushing.rotational_stiffness,
                    Coefficient::RotationalDamping => &mut bushing.rotational_damping,
                };
                &mut values[axis]
            }
            Self::Spring(k, Coefficient::Stiffness) => &mut description.springs[k].stiffness,
            Self::Spring(k, _) => &mut description.springs[k].damping,
            Self::JointForce(k, Coefficient::Stiffness | Coefficient::RotationalStiffness) => {
                &mut description.joint_forces[k].stiffness
            }
            Self::JointForce(k, _) => &mut description.joint_forces[k].damping,
        }
    }
}

/// Quantities of all groups.
pub(super) fn adjustables(description: &VehicleDescription) -> Result<Vec<Adjustable>, Error> {
    let mut values = description.clone();
    let mut all = Vec::new();
    for (k, group) in description.groups.iter().enumerate() {
        let name = group.name.as_str();
        match description.members(group, &format!("groups[{k}]"))? {
            GroupMembers::Bushings(members) => {
                all.extend(of_bushings(&mut values, name, &members));
            }
            GroupMembers::Springs(members) => {
                for coefficient in [Coefficient::Stiffness, Coefficient::Damping] {
                    let slots = members.iter().map(|&k| Slot::Spring(k, coefficient)).collect();
                    all.push(quantity(&mut values, [name, "", "springs"], coefficient, slots));
                }
            }
            GroupMembers::JointForces(members) => {
                let joint = |k: usize| &description.joint_forces[k].joint;
                let kind = members.first().and_then(|&k| {
                    description.joints.iter().find(|j| j.name == *joint(k)).map(|j| j.kind)
                });
                let coefficients = match kind {
                    Some(JointKind::Revolute) => {
                        [Coefficient::RotationalStiffness, Coefficient::RotationalDamping]
                    }
                    _ => [Coefficient::Stiffness, Coefficient::Damping],
                };
                for coefficient in coefficients {
                    let slots = members.iter().map(|&k| Slot::JointForce(k, coefficient)).collect();
                    all.push(quantity(&mut values, [name, "", "joints"], coefficient, slots));
                }
            }
        }
    }
    Ok(all)
}

/// Quantities of a group of bushings: for each axis along or about which one of them acts, or one for all
/// axes if they are alike.
fn of_bushings(values: &mut VehicleDescription, name: &str, members: &[usize]) -> Vec<Adjustable> {
    let oriented = members.iter().any(|&k| values.bushings[k].orientation.is_some());
    let mut all = Vec::new();
    for (coefficients, words, alike) in [
        ([Coefficient::Stiffness, Coefficient::Damping], DIRECTIONS, ""),
        (
            [Coefficient::RotationalStiffness, Coefficient::RotationalDamping],
            ROTATIONS,
            "rotational",
        ),
    ] {
        let words = match alike {
            "" if oriented => OWN_AXES,
            _ => words,
        };
        let mut value =
            |k: usize, c: Coefficient, axis: usize| *Slot::Bushing(k, c, axis).of(values);
        let mut acts = [false; 3];
        let mut equal = true;
        for (&k, c) in members.iter().flat_map(|k| coefficients.map(|c| (k, c))) {
            let [x, y, z] = [0, 1, 2].map(|axis| value(k, c, axis));
            equal &= x == y && y == z;
            for (acts, v) in acts.iter_mut().zip([x, y, z]) {
                *acts |= v != 0.0;
            }
        }
        let axes: Vec<(&str, Vec<usize>)> = if acts == [true; 3] && equal {
            vec![(alike, vec![0, 1, 2])]
        } else {
            (0..3).filter(|&axis| acts[axis]).map(|axis| (words[axis], vec![axis])).collect()
        };
        for ((word, axes), c) in axes.iter().flat_map(|a| coefficients.map(|c| (a, c))) {
            let slots = members.iter().flat_map(|&k| axes.iter().map(move |&a| (k, a)));
            let slots = slots.map(|(k, axis)| Slot::Bushing(k, c, axis)).collect();
            all.push(quantity(values, [name, word, "bushings"], c, slots));
        }
    }
    all
}

fn quantity(
    values: &mut VehicleDescription,
    [group, direction, elements]: [&str; 3],
    coefficient: Coefficient,
    slots: Vec<Slot>,
) -> Adjustable {
    let found: Vec<f64> = slots.iter().map(|slot| *slot.of(values)).collect();
    let first = found.first().copied().unwrap_or(0.0);
    let factor = found.iter().any(|v| *v != first);
    let mut name = group.to_owned();
    for word in [direction, coefficient.word(), if factor { "factor" } else { "" }] {
        if !word.is_empty() {
            name = format!("{name}_{word}");
        }
    }
    let axis = if direction.is_empty() { String::new() } else { format!("{direction} ") };
    let what = format!("{axis}{}", coefficient.word());
    let description = if factor {
        format!("{group}: factor on the {what} of its {elements}, which differ in the vehicle file")
    } else {
        format!("{group}: {what} of each of its {elements}")
    };
    Adjustable {
        name,
        description,
        dimension: if factor { Dimension::Factor } else { coefficient.dimension() },
        start: if factor { 1.0 } else { first },
        min: Some(0.0),
        target: Target::Elements { slots, factor },
    }
}

/// Sets the numbers, or multiplies them. A spring keeps the force that it has in the initial pose.
pub(super) fn apply(
    description: &mut VehicleDescription,
    slots: &[Slot],
    value: f64,
    factor: bool,
) -> Result<(), Error> {
    for slot in slots {
        let before = *slot.of(description);
        let after = if factor { before * value } else { value };
        *slot.of(description) = after;
        if let Slot::Spring(k, Coefficient::Stiffness) = slot {
            keep_force(&mut description.springs[*k], before, &format!("springs[{k}]"))?;
        }
    }
    Ok(())
}

/// Changes the free length so that the force is what it was with the stiffness `before`.
fn keep_force(spring: &mut Spring, before: f64, path: &str) -> Result<(), Error> {
    let Some(free) = spring.free_length else { return Ok(()) };
    let length = (Vec3::from(spring.position_b) - Vec3::from(spring.position_a)).norm();
    let force = before * (length - free);
    let needed = length - force / spring.stiffness;
    if force == 0.0 {
        return Ok(());
    }
    if !(needed.is_finite() && needed >= 0.0) {
        let message = format!(
            "with {} N/m the spring `{}` cannot pull with the {force} N of its initial length; make it stiffer",
            spring.stiffness, spring.name
        );
        return Err(invalid(path, message));
    }
    spring.free_length = Some(needed);
    Ok(())
}
