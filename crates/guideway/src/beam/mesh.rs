//! A girder divided into beam elements: nodes, freedoms, supports.

use super::element::{AT_NODES, Element, FREEDOMS};
use crate::Error;
use crate::check::{at_least_zero, bounded, positive, unique_names};
use crate::description::{GirderDescription, SectionDescription, SupportDescription};

/// Most beam elements of a girder, and of one that is soft in shear, whose elements have more freedoms:
/// the eigenvalue problem is dense.
const MAX_ELEMENTS: [usize; 2] = [200, 100];
/// Least elements per mode.
const ELEMENTS_PER_MODE: usize = 4;
/// Places closer than this fraction of the length are the same.
const SAME: f64 = 1e-9;
/// Least distance between different places, as a fraction of the length: shorter elements would spoil
/// the accuracy of the long ones.
const APART: f64 = 1e-3;

/// Indices of freedoms; `None` is held at 0.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct NodeFreedoms {
    /// Deflection.
    pub deflection: Option<usize>,
    /// Rotation of the element on the left, and of that on the right: different only at a hinge.
    pub rotation: [Option<usize>; 2],
}

/// A spring and a damper between a freedom and another one, or the ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Spring {
    pub from: usize,
    pub to: Option<usize>,
    pub stiffness: f64,
    pub damping: f64,
}

/// A girder as elements, springs and masses.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Mesh {
    /// Places of the nodes (m from the girder's start).
    pub nodes: Vec<f64>,
    /// Between each node and the next.
    pub elements: Vec<Element>,
    pub freedoms: Vec<NodeFreedoms>,
    /// First freedom inside each element, if there are any.
    inside: Vec<Option<usize>>,
    pub springs: Vec<Spring>,
    /// Piers: freedom and mass (kg).
    pub masses: Vec<(usize, f64)>,
    /// Number of freedoms.
    pub size: usize,
    /// Freedoms that are deflections, of nodes and piers.
    pub deflections: Vec<usize>,
}

impl Mesh {
    /// Divides a girder; `path` names it in errors.
    pub fn new(given: &GirderDescription, path: &str) -> Result<Self, Error> {
        let length = positive(given.length, path, "length", "m")?;
        let sections = sections(given, path)?;
        let supports = supports(given, path)?;
        hinges(given, &supports, path)?;
        super::rigid::check(given, &supports, path)?;
        let count = element_count(given, path)?;
        let mut mesh = Self::default();
        let places = places(given, &sections, &supports, path)?;
        for ends in places.windows(2) {
            let part = ends[1] - ends[0];
            let middle = 0.5 * (ends[0] + ends[1]);
            let section = sections.iter().find(|s| middle < s.end).or(sections.last());
            let Some(section) = section else { continue };
            let pieces = (count as f64 * part / length).round().max(2.0);
            for k in 0..pieces as usize {
                mesh.nodes.push(ends[0] + part * k as f64 / pieces);
                mesh.elements.push(section.element(part / pieces));
            }
        }
        mesh.nodes.push(length);
        mesh.number(given, &supports, length);
        Ok(mesh)
    }

    /// Freedoms of an element.
    pub fn of_element(&self, e: usize) -> [Option<usize>; FREEDOMS] {
        let (left, right) = (self.freedoms[e], self.freedoms[e + 1]);
        let [i, j, k] = [0, 1, 2].map(|n| self.inside[e].map(|first| first + n));
        [left.deflection, left.rotation[1], right.deflection, right.rotation[0], i, j, k]
    }

    /// The node at a place, which is one of those where the girder was divided.
    fn node_at(&self, x: f64, length: f64) -> usize {
        let next = self.nodes.partition_point(|&node| node < x - SAME * length);
        next.min(self.nodes.len() - 1)
    }

    fn add(&mut self) -> usize {
        self.size += 1;
        self.size - 1
    }

    /// Numbers the freedoms, and adds the supports.
    fn number(&mut self, given: &GirderDescription, supports: &[SupportDescription], length: f64) {
        let hinges: Vec<usize> = given.hinges.iter().map(|&x| self.node_at(x, length)).collect();
        let held: Vec<usize> = supports.iter().map(|s| self.node_at(s.x, length)).collect();
        for node in 0..self.nodes.len() {
            let support = held.iter().position(|&at| at == node).map(|k| &supports[k]);
            let rigid = support.is_some_and(|s| s.stiffness.is_none() && s.pier.is_none());
            let clamped = support.is_some_and(|s| s.clamped);
            let mut free = NodeFreedoms::default();
            if !rigid {
                let deflection = self.add();
                self.deflections.push(deflection);
                free.deflection = Some(deflection);
            }
            if !clamped {
                let left = self.add();
                let right = if hinges.contains(&node) { self.add() } else { left };
                free.rotation = [Some(left), Some(right)];
            }
            self.freedoms.push(free);
            if let Some(support) = support {
                self.support(support, free);
            }
            if let Some(element) = self.elements.get(node) {
                let inside = (element.shear > 0.0).then_some(self.size);
                self.size += inside.map_or(0, |_| FREEDOMS - AT_NODES);
                self.inside.push(inside);
            }
        }
    }

    fn support(&mut self, support: &SupportDescription, free: NodeFreedoms) {
        if let (Some(from), true) = (free.rotation[0], support.rotational_stiffness > 0.0) {
            let stiffness = support.rotational_stiffness;
            self.springs.push(Spring { from, to: None, stiffness, damping: 0.0 });
        }
        let Some(from) = free.deflection else { return };
        let top = match (support.stiffness, support.pier) {
            (Some(stiffness), pier) => {
                let to = pier.map(|_| self.add());
                self.deflections.extend(to);
                self.springs.push(Spring { from, to, stiffness, damping: support.damping });
                to
            }
            // a rigid bearing: the pier moves with the girder
            (None, Some(_)) => Some(from),
            (None, None) => None,
        };
        if let (Some(top), Some(pier)) = (top, support.pier) {
            self.masses.push((top, pier.mass));
            let (stiffness, damping) = (pier.stiffness, pier.damping);
            self.springs.push(Spring { from: top, to: None, stiffness, damping });
        }
    }
}

/// A section, checked.
#[derive(Debug, Clone, Copy)]
struct Section {
    /// Where it ends (m).
    end: f64,
    mass: f64,
    bending: f64,
    shear: Option<f64>,
    rotary: f64,
}

impl Section {
    fn element(&self, length: f64) -> Element {
        let shear = self.shear.map_or(0.0, |s| 12.0 * self.bending / (s * length * length));
        Element { length, bending: self.bending, mass: self.mass, rotary: self.rotary, shear }
    }
}

fn sections(given: &GirderDescription, path: &str) -> Result<Vec<Section>, Error> {
    let whole = [SectionDescription { length: given.length, ..SectionDescription::default() }];
    let list = if given.sections.is_empty() { &whole[..] } else { &given.sections[..] };
    unique_names(list.iter().map(|s| s.name.as_deref()), &format!("{path}.sections"))?;
    let mut end = 0.0;
    let mut checked = Vec::new();
    for (k, section) in list.iter().enumerate() {
        let at = if given.sections.is_empty() {
            path.to_owned()
        } else {
            format!("{path}.sections[{k}]")
        };
        end += positive(section.length, &at, "length", "m")?;
        let needed = |own: Option<f64>, common: Option<f64>, name: &str, unit: &str| {
            let Some(value) = own.or(common) else {
                return Err(Error::invalid(
                    format!("{at}.{name}"),
                    "missing",
                    format!("give it ({unit}), for this section or for the whole girder"),
                ));
            };
            positive(value, if own.is_some() { &at } else { path }, name, unit)
        };
        let mass =
            needed(section.mass_per_length, given.mass_per_length, "mass_per_length", "kg/m")?;
        let bending = needed(
            section.bending_stiffness,
            given.bending_stiffness,
            "bending_stiffness",
            "N·m²",
        )?;
        let shear = match (section.shear_stiffness, given.shear_stiffness) {
            (None, None) => None,
            (own, common) => Some(needed(own, common, "shear_stiffness", "N")?),
        };
        let rotary = section.rotary_inertia.or(given.rotary_inertia).unwrap_or(0.0);
        at_least_zero(rotary, &at, "rotary_inertia", "kg·m")?;
        checked.push(Section { end, mass, bending, shear, rotary });
    }
    if (end - given.length).abs() > SAME * given.length {
        return Err(Error::invalid(
            format!("{path}.sections"),
            format!("the sections are {end} m long, the girder {} m", given.length),
            "make their lengths add up to that of the girder",
        ));
    }
    Ok(checked)
}

fn supports(given: &GirderDescription, path: &str) -> Result<Vec<SupportDescription>, Error> {
    let Some(list) = &given.supports else {
        let rigid = |x| SupportDescription { x, ..SupportDescription::default() };
        return Ok(vec![rigid(0.0), rigid(given.length)]);
    };
    let path = format!("{path}.supports");
    unique_names(list.iter().map(|s| s.name.as_deref()), &path)?;
    let mut before: Option<f64> = None;
    for (k, support) in list.iter().enumerate() {
        let at = format!("{path}[{k}]");
        bounded(support.x, given.length, &at, "x")?;
        if before.is_some_and(|x| support.x <= x) {
            return Err(Error::invalid(
                format!("{at}.x"),
                format!(
                    "{} m does not exceed {} m of the support before",
                    support.x,
                    list[k - 1].x
                ),
                "list the supports in the order of their places, each place once",
            ));
        }
        before = Some(support.x);
        check_support(support, &at)?;
    }
    Ok(list.clone())
}

fn check_support(support: &SupportDescription, at: &str) -> Result<(), Error> {
    if let Some(stiffness) = support.stiffness {
        if !(stiffness > 0.0 && stiffness.is_finite()) {
            return Err(Error::invalid(
                format!("{at}.stiffness"),
                format!("{stiffness} N/m"),
                "give a positive finite value, or leave it out for a rigid bearing",
            ));
        }
    } else if support.damping != 0.0 {
        return Err(Error::invalid(
            format!("{at}.damping"),
            format!("{} N·s/m of a rigid bearing, which does not move", support.damping),
            "give the bearing's `stiffness` (N/m), or remove `damping`",
        ));
    }
    at_least_zero(support.damping, at, "damping", "N·s/m")?;
    at_least_zero(support.rotational_stiffness, at, "rotational_stiffness", "N·m/rad")?;
    if support.clamped && support.rotational_stiffness > 0.0 {
        return Err(Error::invalid(
            format!("{at}.clamped"),
            "true, with a rotational_stiffness",
            "remove one of them: a clamped girder does not rotate",
        ));
    }
    if let Some(pier) = &support.pier {
        let at = format!("{at}.pier");
        if pier.mass == 0.0 {
            return Err(Error::invalid(
                format!("{at}.mass"),
                "0 kg",
                "give a positive mass, or remove `pier` and give as `stiffness` of the support that \
                 of bearing and pier in series",
            ));
        }
        positive(pier.mass, &at, "mass", "kg")?;
        positive(pier.stiffness, &at, "stiffness", "N/m")?;
        at_least_zero(pier.damping, &at, "damping", "N·s/m")?;
    }
    Ok(())
}

fn hinges(
    given: &GirderDescription,
    supports: &[SupportDescription],
    path: &str,
) -> Result<(), Error> {
    for (k, &x) in given.hinges.iter().enumerate() {
        let at = format!("{path}.hinges[{k}]");
        let inside = x > APART * given.length && x < (1.0 - APART) * given.length;
        if !inside || given.hinges[..k].iter().any(|&before| x <= before) {
            return Err(Error::invalid(
                at,
                format!("{x} m"),
                format!("give increasing places inside the girder, 0 to {} m", given.length),
            ));
        }
        let turned = |s: &&SupportDescription| {
            (s.x - x).abs() <= SAME * given.length && (s.clamped || s.rotational_stiffness > 0.0)
        };
        if supports.iter().any(|s| turned(&s)) {
            return Err(Error::invalid(
                at,
                format!("{x} m, where a support holds the girder's rotation"),
                "move the hinge, or let the girder rotate on this support",
            ));
        }
    }
    Ok(())
}

fn element_count(given: &GirderDescription, path: &str) -> Result<usize, Error> {
    let modes = given.mode_count();
    let soft = given.shear_stiffness.is_some()
        || given.sections.iter().any(|section| section.shear_stiffness.is_some());
    let most = MAX_ELEMENTS[usize::from(soft)];
    let least = ELEMENTS_PER_MODE * modes.max(1);
    if least > most {
        return Err(Error::invalid(
            format!("{path}.modes"),
            format!("{modes} modes of a girder with at most {most} elements"),
            format!("give at most {} modes", most / ELEMENTS_PER_MODE),
        ));
    }
    let count = given.elements.unwrap_or((10 * modes).clamp(40, most));
    if (least..=most).contains(&count) {
        return Ok(count);
    }
    Err(Error::invalid(
        format!("{path}.elements"),
        format!("{count} elements for {modes} modes"),
        format!("give {least} to {most}, at least {ELEMENTS_PER_MODE} per mode, or fewer modes"),
    ))
}

/// Places where the girder must be divided, from 0 to its length.
fn places(
    given: &GirderDescription,
    sections: &[Section],
    supports: &[SupportDescription],
    path: &str,
) -> Result<Vec<f64>, Error> {
    let length = given.length;
    let named = sections.iter().map(|s| (s.end, "the end of a section"));
    let named = named.chain(supports.iter().map(|s| (s.x, "a support")));
    let named = named.chain(given.hinges.iter().map(|&x| (x, "a hinge")));
    let mut all: Vec<(f64, &str)> = [(0.0, "the girder's start"), (length, "the girder's end")]
        .into_iter()
        .chain(named)
        .collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut places: Vec<(f64, &str)> = Vec::new();
    for (x, what) in all {
        match places.last() {
            Some(&(before, _)) if x - before <= SAME * length => {}
            Some(&(before, other)) if x - before < APART * length => {
                return Err(Error::invalid(
                    path,
                    format!("{other} at {before} m and {what} at {x} m are too close"),
                    format!("put them at the same place, or at least {} m apart", APART * length),
                ));
            }
            _ => places.push((x, what)),
        }
    }
    let mut places: Vec<f64> = places.into_iter().map(|(x, _)| x).collect();
    if let Some(last) = places.last_mut() {
        *last = length;
    }
    Ok(places)
}
