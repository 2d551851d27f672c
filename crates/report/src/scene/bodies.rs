//! The parts of the vehicle: groups of bodies that move together, their boxes, and links between them.

use std::collections::BTreeMap;

use multibody::{Body, Inertia, Joint, JointKind, VehicleDescription};
use serde::Serialize;

/// Groups of bodies, and the shapes on them.
#[derive(Debug, Serialize)]
pub(super) struct DrawnBodies {
    /// Groups of bodies that move together.
    pub groups: Vec<BodyGroup>,
    /// Boxes on the groups.
    pub boxes: Vec<BodyBox>,
    /// Bars between two groups: anti-roll beams, couplers.
    pub rods: Vec<DrawnLink>,
    /// Springs between two groups.
    pub springs: Vec<DrawnLink>,
    /// The magnets, in the order of the signals.
    pub magnets: Vec<DrawnMagnet>,
}

/// Bodies that move together.
#[derive(Debug, Serialize)]
pub(super) struct BodyGroup {
    /// Name of its observed body, or of its leading body.
    pub name: String,
    pub kind: GroupKind,
    /// Centre of mass (m) of the leading body, about which the group rotates.
    pub center: [f64; 3],
}

/// Which signals a group moves with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum GroupKind {
    /// The recorded motion of an observed body.
    Car,
    /// The gaps of its magnets.
    Frame,
}

/// A box on a group.
#[derive(Debug, Serialize)]
pub(super) struct BodyBox {
    pub name: String,
    pub group: usize,
    /// Whether it is the group's leading body.
    pub lead: bool,
    /// Centre (m).
    pub center: [f64; 3],
    /// Lengths (m) along x, y, z.
    pub size: [f64; 3],
}

/// A rod or a spring between two groups.
#[derive(Debug, Serialize)]
pub(super) struct DrawnLink {
    pub name: String,
    pub ends: [LinkEnd; 2],
    /// Thickness (m).
    pub thickness: f64,
}

/// A point (m) on a group.
#[derive(Debug, Clone, Copy, Serialize)]
pub(super) struct LinkEnd {
    pub group: usize,
    pub position: [f64; 3],
}

/// A magnet on a group.
#[derive(Debug, Serialize)]
pub(super) struct DrawnMagnet {
    pub group: usize,
    /// Position (m).
    pub position: [f64; 3],
}

impl DrawnBodies {
    /// Sorts the bodies of a vehicle.
    ///
    /// Each observed body and each body with magnets starts a group, which grows over brackets and
    /// translational joints. Bodies that other joints connect to two groups become rods between them.
    pub(super) fn new(layout: &VehicleDescription) -> Self {
        let index: BTreeMap<&str, usize> =
            layout.bodies.iter().enumerate().map(|(k, body)| (body.name.as_str(), k)).collect();
        let (groups, leads, mut member) = lead(layout, &index);
        let pairs: Vec<(usize, usize, &Joint)> = layout
            .joints
            .iter()
            .filter_map(|it| Some((*index.get(&*it.body_a)?, *index.get(&*it.body_b)?, it)))
            .collect();
        let fixed = |joint: &Joint, kind| joint.kind == kind;
        for kind in [JointKind::Bracket, JointKind::Translational] {
            spread(&mut member, pairs.iter().filter(|it| fixed(it.2, kind)).map(|it| (it.0, it.1)));
        }
        let rods = rods(layout, &pairs, &mut member);
        let mut boxes = Vec::new();
        for (k, body) in layout.bodies.iter().enumerate() {
            let Some(group) = member[k].filter(|_| !body.reference) else { continue };
            let lead = leads[group] == k;
            let (name, center, size) = (body.name.clone(), body.position, size(body));
            boxes.push(BodyBox { name, group, lead, center, size });
        }
        let springs = springs(layout, &index, &member);
        let magnets = layout.magnets.iter().filter_map(|it| {
            let group = member[*index.get(&*it.body)?]?;
            Some(DrawnMagnet { group, position: it.position })
        });
        Self { groups, boxes, rods, springs, magnets: magnets.collect() }
    }
}

/// The groups, their leading bodies, and the group of each body, as far as it is known.
fn lead(
    layout: &VehicleDescription,
    index: &BTreeMap<&str, usize>,
) -> (Vec<BodyGroup>, Vec<usize>, Vec<Option<usize>>) {
    let carriers = layout.magnets.iter().map(|it| (&it.body, &it.body, GroupKind::Frame));
    let observed = layout.observed.iter().map(|it| (&it.body, &it.name, GroupKind::Car));
    let (mut groups, mut leads) = (Vec::new(), Vec::new());
    let mut member = vec![None; layout.bodies.len()];
    for (body, name, kind) in carriers.chain(observed) {
        let Some(&k) = index.get(body.as_str()) else { continue };
        if member[k].is_none() {
            member[k] = Some(groups.len());
            groups.push(BodyGroup { name: name.clone(), kind, center: layout.bodies[k].position });
            leads.push(k);
        }
    }
    (groups, leads, member)
}

/// Adds bodies without a group to the group of their neighbour until nothing changes.
fn spread(member: &mut [Option<usize>], pairs: impl Iterator<Item = (usize, usize)> + Clone) {
    let mut changed = true;
    while changed {
        changed = false;
        for (a, b) in pairs.clone() {
            match (member[a], member[b]) {
                (Some(group), None) => (member[b], changed) = (Some(group), true),
                (None, Some(group)) => (member[a], changed) = (Some(group), true),
                _ => {}
            }
        }
    }
}

/// Chains of bodies without a group: one that ends on two groups becomes a rod, one that ends on a single
/// group joins it.
fn rods(
    layout: &VehicleDescription,
    pairs: &[(usize, usize, &Joint)],
    member: &mut [Option<usize>],
) -> Vec<DrawnLink> {
    let mut chain: Vec<Option<usize>> = vec![None; layout.bodies.len()];
    let mut rods = Vec::new();
    for start in 0..layout.bodies.len() {
        if member[start].is_some() || chain[start].is_some() || layout.bodies[start].reference {
            continue;
        }
        chain[start] = Some(start);
        let free = |&(a, b): &(usize, usize)| member[a].is_none() && member[b].is_none();
        spread(&mut chain, pairs.iter().map(|it| (it.0, it.1)).filter(free));
        let ends = ends(layout, pairs, member, &chain, start);
        let other = ends.iter().find(|end| end.group != ends[0].group);
        let body = &layout.bodies[start];
        if let Some(&other) = other {
            let thickness = size(body).into_iter().fold(f64::INFINITY, f64::min);
            rods.push(DrawnLink { name: body.name.clone(), ends: [ends[0], other], thickness });
        } else if let Some(end) = ends.first() {
            let mine = (0..member.len()).filter(|&k| chain[k] == Some(start));
            mine.for_each(|k| member[k] = Some(end.group));
        }
    }
    rods
}

/// Joints between groups and the chain that begins with body `start`.
fn ends(
    layout: &VehicleDescription,
    pairs: &[(usize, usize, &Joint)],
    member: &[Option<usize>],
    chain: &[Option<usize>],
    start: usize,
) -> Vec<LinkEnd> {
    let mut ends = Vec::new();
    for &(a, b, joint) in pairs {
        let (mine, other) = if chain[a] == Some(start) { (a, b) } else { (b, a) };
        if chain[mine] == Some(start)
            && let Some(group) = member[other]
        {
            let position = joint.position.unwrap_or(layout.bodies[mine].position);
            ends.push(LinkEnd { group, position });
        }
    }
    ends
}

/// Springs, and bushings that carry vertical load, from the top of the lower body to the bottom of the upper
/// one.
fn springs(
    layout: &VehicleDescription,
    index: &BTreeMap<&str, usize>,
    member: &[Option<usize>],
) -> Vec<DrawnLink> {
    let find = |name: &str| Some((*index.get(name)?, member[*index.get(name)?]?));
    let mut links = Vec::new();
    for bushing in layout.bushings.iter().filter(|it| it.translational_stiffness[2] > 0.0) {
        let (Some((a, at_a)), Some((b, at_b))) = (find(&bushing.body_a), find(&bushing.body_b))
        else {
            continue;
        };
        let (a, b) = (&layout.bodies[a], &layout.bodies[b]);
        let side = if a.position[2] < b.position[2] { 0.5 } else { -0.5 };
        let [x, y, _] = bushing.position;
        let end = |body: &Body, group, side: f64| {
            let z = body.position[2] + side * size(body)[2];
            LinkEnd { group, position: [x, y, z] }
        };
        if at_a != at_b {
            let ends = [end(a, at_a, side), end(b, at_b, -side)];
            links.push(DrawnLink { name: bushing.name.clone(), ends, thickness: 0.22 });
        }
    }
    for spring in &layout.springs {
        if let (Some((_, a)), Some((_, b))) = (find(&spring.body_a), find(&spring.body_b)) {
            let ends = [
                LinkEnd { group: a, position: spring.position_a },
                LinkEnd { group: b, position: spring.position_b },
            ];
            links.push(DrawnLink { name: spring.name.clone(), ends, thickness: 0.12 });
        }
    }
    links
}

/// Lengths (m) of the uniform box that has a body's mass and moments of inertia:
/// a² = 6·(Iy + Iz − Ix)/m and so on.
fn size(body: &Body) -> [f64; 3] {
    let moments = match body.inertia {
        Inertia::Principal(moments) => moments,
        Inertia::Full(rows) => [rows[0][0], rows[1][1], rows[2][2]],
    };
    let sum: f64 = moments.iter().sum();
    moments.map(|it| (6.0 * (sum - 2.0 * it) / body.mass).max(0.0).sqrt().max(0.02))
}

#[cfg(test)]
mod tests {
    use super::*;
    use multibody::train;

    #[test]
    fn analytic_the_size_of_a_uniform_box_follows_from_its_inertia() {
        let bodies = DrawnBodies::new(&train::two_car());
        let car = bodies.boxes.iter().find(|it| it.name == "car_1").unwrap();
        // written as the moments of a box of 12 m x 2.7 m x 2.6 m, to 9 decimals
        for (length, expected) in car.size.iter().zip([12.0, 2.7, 2.6]) {
            assert!((length - expected).abs() < 1e-6, "{:?}", car.size);
        }
    }

    #[test]
    fn invariant_every_body_of_the_train_has_its_place() {
        let layout = train::two_car();
        let bodies = DrawnBodies::new(&layout);
        let count = |kind| bodies.groups.iter().filter(|it| it.kind == kind).count();
        assert_eq!((count(GroupKind::Frame), count(GroupKind::Car)), (16, 2));
        // cars, equipment, tables, frames and motors; the reference body of the guideway is not drawn
        assert_eq!(bodies.boxes.len(), 2 + 8 + 20 + 16 + 16);
        // anti-roll beams, and two chains of coupler links
        assert_eq!(bodies.rods.len(), 32 + 2);
        assert_eq!((bodies.springs.len(), bodies.magnets.len()), (32, 64));
        let group = |name: &str| bodies.groups.iter().position(|it| it.name == name).unwrap();
        let coupler = bodies.rods.iter().find(|it| it.name.starts_with("coupler")).unwrap();
        assert_eq!(coupler.ends.map(|end| end.group), [group("car_1"), group("car_2")]);
        for (magnet, given) in bodies.magnets.iter().zip(&layout.magnets) {
            assert_eq!(bodies.groups[magnet.group].name, given.body);
        }
        for spring in &bodies.springs {
            let [low, high] = spring.ends;
            assert!(low.position[2] < high.position[2], "{spring:?}");
            assert_ne!(low.group, high.group);
        }
    }

    #[test]
    fn invariant_one_magnet_is_one_frame() {
        let bodies = DrawnBodies::new(&train::one_magnet());
        assert_eq!((bodies.groups.len(), bodies.boxes.len()), (1, 1));
        assert_eq!(bodies.groups[0].kind, GroupKind::Frame);
        assert!(bodies.rods.is_empty() && bodies.springs.is_empty());
    }
}
