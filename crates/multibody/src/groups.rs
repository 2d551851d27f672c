//! Elements by patterns of their names.

use std::fmt::Display;

use crate::description::{ElementGroup, VehicleDescription};
use crate::error::{Error, invalid};
use crate::names::meant;

/// The elements of a group, by their places in the description's list.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum GroupMembers {
    Bushings(Vec<usize>),
    Springs(Vec<usize>),
    JointForces(Vec<usize>),
}

/// Checks a name that becomes part of the names of variables.
pub(crate) fn check_signal_name(name: &str, path: &dyn Display) -> Result<(), Error> {
    let well_named = name.starts_with(|c: char| c.is_ascii_lowercase())
        && name.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_')
        && name.len() <= 24;
    if well_named {
        return Ok(());
    }
    let message = "it becomes part of signal names: use up to 24 lower-case letters, digits and \
                   underscores, beginning with a letter";
    Err(invalid(path, message))
}

/// Places of the items that match any of the patterns, in order. Each pattern must match one.
pub(crate) fn matching<'a>(
    patterns: &[String],
    names: impl Iterator<Item = &'a str> + Clone,
    path: &str,
    what: &str,
) -> Result<Vec<usize>, Error> {
    let mut found = Vec::new();
    for (k, pattern) in patterns.iter().enumerate() {
        let path = format!("{path}[{k}]");
        let globs = patterns::expand(pattern).map_err(|e| invalid(&path, e.to_string()))?;
        let before = found.len();
        for glob in &globs {
            let matches = names.clone().enumerate().filter(|(_, n)| patterns::matches(glob, n));
            found.extend(matches.map(|(k, _)| k));
        }
        if found.len() == before {
            let hint = meant(pattern, names.clone());
            return Err(invalid(path, format!("no {what} matches `{pattern}`{hint}")));
        }
    }
    found.sort_unstable();
    found.dedup();
    Ok(found)
}

impl VehicleDescription {
    /// The elements of a group.
    pub(crate) fn members(&self, group: &ElementGroup, path: &str) -> Result<GroupMembers, Error> {
        let ElementGroup { bushings, springs, joint_forces, .. } = group;
        match [bushings.is_empty(), springs.is_empty(), joint_forces.is_empty()] {
            [false, true, true] => {
                let names = self.bushings.iter().map(|b| b.name.as_str());
                matching(bushings, names, &format!("{path}.bushings"), "bushing")
                    .map(GroupMembers::Bushings)
            }
            [true, false, true] => {
                let names = self.springs.iter().map(|s| s.name.as_str());
                matching(springs, names, &format!("{path}.springs"), "spring")
                    .map(GroupMembers::Springs)
            }
            [true, true, false] => {
                let names = self.joint_forces.iter().map(|f| f.joint.as_str());
                let path = format!("{path}.joint_forces");
                let members = matching(joint_forces, names, &path, "joint with a force")?;
                self.check_kinds(&members, &path)?;
                Ok(GroupMembers::JointForces(members))
            }
            _ => {
                let message = "give one of `bushings`, `springs` and `joint_forces`";
                Err(invalid(path, message))
            }
        }
    }

    /// The joints of one group must be of one kind: stiffness in N/m and in N·m/rad do not compare.
    fn check_kinds(&self, members: &[usize], path: &str) -> Result<(), Error> {
        let kind = |k: usize| {
            self.joints.iter().find(|j| j.name == self.joint_forces[k].joint).map(|j| j.kind)
        };
        let first = members.first().copied().and_then(kind);
        match members.iter().find(|k| kind(**k) != first) {
            None => Ok(()),
            Some(k) => Err(invalid(
                path,
                format!(
                    "`{}` and `{}` are joints of different kinds; make a group of each kind",
                    self.joint_forces[members[0]].joint, self.joint_forces[*k].joint
                ),
            )),
        }
    }

    /// The bushings that level observed body k.
    pub(crate) fn levelling_bushings(&self, k: usize) -> Result<Vec<usize>, Error> {
        let names = self.bushings.iter().map(|b| b.name.as_str());
        let path = format!("observed[{k}].levelled_by");
        matching(&self.observed[k].levelled_by, names, &path, "bushing")
    }

    /// Checks groups, and the bodies and bushings that observed bodies name.
    pub(crate) fn check_groups(&self) -> Result<(), Error> {
        for (k, group) in self.groups.iter().enumerate() {
            let path = format!("groups[{k}]");
            check_signal_name(&group.name, &format_args!("{path}.name"))?;
            if let Some(first) = self.groups[..k].iter().position(|g| g.name == group.name) {
                let message = format!("duplicate name: also the name of groups[{first}]");
                return Err(invalid(format!("{path}.name"), message));
            }
            self.members(group, &path)?;
        }
        for (k, observed) in self.observed.iter().enumerate() {
            self.levelling_bushings(k)?;
            let (points, carriers) = (observed.points.len(), observed.point_bodies.len());
            if carriers != 0 && carriers != points {
                let message = format!("{carriers} bodies for {points} points; name one for each");
                return Err(invalid(format!("observed[{k}].point_bodies"), message));
            }
        }
        Ok(())
    }
}
