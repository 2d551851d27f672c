//! Torsion of a straight girder, and vertical bending with torsion of one that is curved in plan.
//!
//! Strains of a girder whose axis has the radius R (positive to the left), w up, θ positive if it lifts
//! the left side: curvature κ = w″ − θ/R, twist per length τ = θ′ + w′/R. Energies ½∫EI·κ² + GJ·τ² +
//! EI_w·τ′² dx and ½∫ρA·ẇ² + ρI·ẇ′² + ρI_p·θ̇² dx. Source: Vlasov, *Thin-Walled Elastic Beams*, chapter XI;
//! Culver, *Journal of the Structural Division* ASCE 93 (1967) 379.
//!
//! θ is cubic in each element: Hermite's functions of θ and θ′ at both nodes. With warping stiffness
//! neighbours share θ′; without it each element has its own, so that concentrated torques and changes of
//! section may break the slope. In both cases frequencies converge with at least the fourth power of
//! the elements' length.

use std::f64::consts::PI;

use nalgebra::DMatrix;

use super::element::Element;
use super::mesh::{Mesh, Spring};
use super::{assemble, damping_of, eigen, polynomials};
use crate::Error;
use crate::check::{at_least_zero, positive};
use crate::cubics::PiecewiseCubics;
use crate::description::{GirderDescription, TorsionDescription};
use crate::pole::gauss_legendre;

/// Least elements per mode.
const ELEMENTS_PER_MODE: usize = 4;

/// Modes with twist, the lowest first.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TwistModes {
    /// Vertical deflection (1), if the girder is curved.
    pub deflection: Option<PiecewiseCubics>,
    /// Twist: of a straight girder scaled to at most 1, of a curved one in rad/m.
    pub twist: PiecewiseCubics,
    /// Modal masses: kg·m², of a curved girder kg.
    pub masses: Vec<f64>,
    /// Undamped natural frequencies (Hz).
    pub frequencies: Vec<f64>,
    /// Modal damping matrix of supports, row by row.
    pub damping: Vec<f64>,
    /// Largest wavenumber (rad/m) of waves of torsion or bending at the highest frequency.
    pub wavenumber: f64,
}

/// Torsional properties of an element.
#[derive(Debug, Clone, Copy)]
struct Section {
    stiffness: f64,
    warping: f64,
    inertia: f64,
}

/// Elements with the freedoms of twist.
struct TwistMesh {
    mesh: Mesh,
    sections: Vec<Section>,
    /// θ and θ′ at the left end of each element, then at its right end; `None` is held at 0.
    freedoms: Vec<[Option<usize>; 4]>,
    /// θ of the nodes that can twist.
    twists: Vec<usize>,
    springs: Vec<Spring>,
    size: usize,
    /// 1/R (1/m), if the deflection is part of the modes.
    curvature: Option<f64>,
}

impl TwistModes {
    /// Torsion of a straight girder.
    pub fn straight(
        given: &GirderDescription,
        torsion: &TorsionDescription,
        count: usize,
        path: &str,
    ) -> Result<Self, Error> {
        Self::of(&TwistMesh::new(given, torsion, count, None, path)?, count, path)
    }

    /// Bending and torsion of a curved girder.
    pub fn curved(
        given: &GirderDescription,
        torsion: &TorsionDescription,
        count: usize,
        path: &str,
    ) -> Result<Self, Error> {
        let radius = given.radius.unwrap_or(f64::NAN);
        // false for NaN as well
        let wide = radius.abs() >= 0.5 * given.length && radius.is_finite();
        if !wide {
            return Err(Error::invalid(
                format!("{path}.radius"),
                format!("{radius} m for a girder of {} m", given.length),
                "give a finite radius of at least half the length, positive to the left, or leave it out",
            ));
        }
        let soft = given.shear_stiffness.is_some()
            || given.sections.iter().any(|s| s.shear_stiffness.is_some());
        if soft || !given.hinges.is_empty() || given.shapes.is_some() {
            return Err(Error::invalid(
                format!("{path}.radius"),
                "given together with shear_stiffness, hinges or shapes",
                "remove them: curved elements are rigid in shear and have no hinges",
            ));
        }
        let mesh = TwistMesh::new(given, torsion, count, Some(1.0 / radius), path)?;
        Self::of(&mesh, count, path)
    }

    fn of(all: &TwistMesh, count: usize, path: &str) -> Result<Self, Error> {
        let (stiffness, mass) = all.matrices();
        let (vectors, squares) = eigen(stiffness, &mass).ok_or_else(|| {
            Error::invalid(
                format!("{path}.torsion"),
                "the modes cannot be computed: supports do not hold the girder, or stiffnesses and \
                 masses are too far apart for double precision",
                "check supports and units (N·m², kg·m, N·m/rad)",
            )
        })?;
        let mut shapes = DMatrix::zeros(all.size, count);
        let mut masses = Vec::new();
        for (n, square) in squares[..count].iter().enumerate() {
            let scale = all.scale(vectors.column(n).as_slice());
            shapes.set_column(n, &(vectors.column(n) * scale));
            masses.push(scale * scale / square);
        }
        let highest = squares[count - 1];
        let waves = all.mesh.elements.iter().zip(&all.sections).map(|(e, s)| {
            let torsion = (highest * s.inertia / s.stiffness).sqrt();
            let bending = (highest * e.mass / e.bending).sqrt().sqrt();
            if all.curvature.is_some() { torsion.max(bending) } else { torsion }
        });
        let mut dampers = all.springs.clone();
        if all.curvature.is_some() {
            dampers.extend(&all.mesh.springs);
        }
        Ok(Self {
            deflection: all.curvature.map(|_| polynomials(&all.mesh, &shapes)),
            twist: all.twist(&shapes),
            masses,
            frequencies: squares[..count].iter().map(|w| w.sqrt() / (2.0 * PI)).collect(),
            damping: damping_of(&dampers, &shapes),
            wavenumber: waves.fold(0.0, f64::max),
        })
    }
}

impl TwistMesh {
    fn new(
        given: &GirderDescription,
        torsion: &TorsionDescription,
        count: usize,
        curvature: Option<f64>,
        path: &str,
    ) -> Result<Self, Error> {
        let mesh = Mesh::new(given, path)?;
        let elements = mesh.elements.len();
        if ELEMENTS_PER_MODE * count > elements {
            return Err(Error::invalid(
                format!("{path}.torsion.modes"),
                format!("{count} modes of {elements} elements"),
                "give fewer modes, or more `elements`",
            ));
        }
        let sections = sections(given, torsion, &mesh, path)?;
        let warps = sections.iter().filter(|s| s.warping > 0.0).count();
        if warps != 0 && warps != elements {
            return Err(Error::invalid(
                format!("{path}.torsion.warping_stiffness"),
                "0 for a part of the girder only",
                "give every section a warping stiffness, or none",
            ));
        }
        let size = if curvature.is_some() { mesh.size } else { 0 };
        let mut all = Self {
            mesh,
            sections,
            freedoms: vec![[None; 4]; elements],
            twists: Vec::new(),
            springs: Vec::new(),
            size,
            curvature,
        };
        all.number(given, warps > 0, path)?;
        Ok(all)
    }

    fn add(&mut self) -> usize {
        self.size += 1;
        self.size - 1
    }

    /// Numbers the freedoms of twist, and adds the supports.
    fn number(&mut self, given: &GirderDescription, warps: bool, path: &str) -> Result<(), Error> {
        let length = given.length;
        let ends = [0.0, length];
        let supports = given.supports.as_deref();
        let places: Vec<f64> =
            supports.map_or(ends.to_vec(), |all| all.iter().map(|s| s.x).collect());
        let mut held = false;
        for node in 0..self.mesh.nodes.len() {
            let x = self.mesh.nodes[node];
            let at = places.iter().position(|place| (place - x).abs() <= 1e-9 * length);
            let support = at.and_then(|k| Some((k, &supports?[k])));
            let (rigid, spring) = match (at, support) {
                (None, _) => (false, None),
                (Some(_), None) => (true, None),
                (_, Some((k, s))) => check_support(s, &format!("{path}.supports[{k}]"))?,
            };
            held |= rigid || spring.is_some();
            let twist = if rigid { None } else { Some(self.add()) };
            self.twists.extend(twist);
            if let (Some(from), Some((stiffness, damping))) = (twist, spring) {
                self.springs.push(Spring { from, to: None, stiffness, damping });
            }
            let shared = warps.then(|| self.add());
            if let Some(left) = node.checked_sub(1) {
                let slope = shared.unwrap_or_else(|| self.add());
                (self.freedoms[left][2], self.freedoms[left][3]) = (twist, Some(slope));
            }
            if node < self.freedoms.len() {
                let slope = shared.unwrap_or_else(|| self.add());
                (self.freedoms[node][0], self.freedoms[node][1]) = (twist, Some(slope));
            }
        }
        if held {
            return Ok(());
        }
        Err(Error::invalid(
            format!("{path}.supports"),
            "the girder can twist at all of them",
            "remove `torsion_free` at one",
        ))
    }

    /// Stiffness and mass.
    fn matrices(&self) -> (DMatrix<f64>, DMatrix<f64>) {
        let (mut stiffness, mut mass) =
            (DMatrix::zeros(self.size, self.size), DMatrix::zeros(self.size, self.size));
        if self.curvature.is_some() {
            let (k, m) = assemble(&self.mesh);
            stiffness.view_mut((0, 0), k.shape()).copy_from(&k);
            mass.view_mut((0, 0), m.shape()).copy_from(&m);
        }
        let bend = self.curvature.unwrap_or(0.0);
        for (e, (element, section)) in self.mesh.elements.iter().zip(&self.sections).enumerate() {
            let mut at = [None; 8];
            if self.curvature.is_some() {
                at[..4].copy_from_slice(&self.mesh.of_element(e)[..4]);
            }
            at[4..].copy_from_slice(&self.freedoms[e]);
            for (point, weight) in gauss_legendre(4) {
                let x = 0.5 * element.length * (1.0 + point);
                let by = 0.5 * element.length * weight;
                let f = strains(element, x, bend);
                for (i, a) in at.iter().zip(&f) {
                    for (j, b) in at.iter().zip(&f) {
                        let (Some(i), Some(j)) = (*i, *j) else { continue };
                        // the straight beam's part is in the mesh already
                        let bent = a.curvature * b.curvature - a.straight * b.straight;
                        stiffness[(i, j)] += by
                            * (element.bending * bent
                                + section.stiffness * a.twist * b.twist
                                + section.warping * a.warp * b.warp);
                        mass[(i, j)] += by * section.inertia * a.theta * b.theta;
                    }
                }
            }
        }
        for spring in &self.springs {
            stiffness[(spring.from, spring.from)] += spring.stiffness;
        }
        (stiffness, mass)
    }

    /// The factor that makes the largest motion 1: of a straight girder the twist, of a curved one the
    /// deflection, or the twist times the radius of gyration if that is larger. Positive where the motion
    /// first exceeds half of it.
    fn scale(&self, vector: &[f64]) -> f64 {
        let gyration = match (self.curvature, self.sections.first(), self.mesh.elements.first()) {
            (Some(_), Some(section), Some(element)) => (section.inertia / element.mass).sqrt(),
            _ => 1.0,
        };
        let deflections = self.mesh.deflections.iter().filter(|_| self.curvature.is_some());
        let motions: Vec<f64> = deflections
            .map(|&i| vector[i])
            .chain(self.twists.iter().map(|&i| gyration * vector[i]))
            .collect();
        let largest = motions.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        let clear = motions.iter().find(|v| v.abs() > 0.5 * largest);
        clear.map_or(1.0, |v| v.signum()) / largest
    }

    fn twist(&self, shapes: &DMatrix<f64>) -> PiecewiseCubics {
        let mut coefficients = Vec::new();
        for (element, at) in self.mesh.elements.iter().zip(&self.freedoms) {
            for n in 0..shapes.ncols() {
                let [a, v, b, w] = at.map(|i| i.map_or(0.0, |i| shapes[(i, n)]));
                let h = element.length;
                let rise = (b - a) / h;
                coefficients.push([
                    a,
                    v,
                    (3.0 * rise - 2.0 * v - w) / h,
                    (v + w - 2.0 * rise) / (h * h),
                ]);
            }
        }
        PiecewiseCubics::new(self.mesh.nodes.clone(), coefficients, shapes.ncols())
    }
}

/// What one freedom at 1 gives at a place.
#[derive(Debug, Clone, Copy, Default)]
struct Strain {
    /// w″ alone.
    straight: f64,
    /// w″ − θ/R.
    curvature: f64,
    /// θ′ + w′/R.
    twist: f64,
    /// θ″ + w″/R.
    warp: f64,
    theta: f64,
}

/// Of w, w′ at both nodes, then θ, θ′ at both nodes; `bend` is 1/R.
fn strains(element: &Element, x: f64, bend: f64) -> [Strain; 8] {
    let h = element.length;
    let s = x / h;
    let value = [
        1.0 + s * s * (2.0 * s - 3.0),
        h * s * (1.0 + s * (s - 2.0)),
        s * s * (3.0 - 2.0 * s),
        h * s * s * (s - 1.0),
    ];
    let slope = [
        6.0 * s * (s - 1.0) / h,
        1.0 + s * (3.0 * s - 4.0),
        6.0 * s * (1.0 - s) / h,
        s * (3.0 * s - 2.0),
    ];
    let second = [
        (12.0 * s - 6.0) / (h * h),
        (6.0 * s - 4.0) / h,
        (6.0 - 12.0 * s) / (h * h),
        (6.0 * s - 2.0) / h,
    ];
    let mut all = [Strain::default(); 8];
    for k in 0..4 {
        all[k] = Strain {
            straight: second[k],
            curvature: second[k],
            twist: slope[k] * bend,
            warp: second[k] * bend,
            theta: 0.0,
        };
        all[4 + k] = Strain {
            straight: 0.0,
            curvature: -value[k] * bend,
            twist: slope[k],
            warp: second[k],
            theta: value[k],
        };
    }
    all
}

/// Whether a support holds the twist, or its spring and damper.
type Hold = (bool, Option<(f64, f64)>);

fn check_support(
    support: &crate::description::SupportDescription,
    path: &str,
) -> Result<Hold, Error> {
    let damping = at_least_zero(support.torsional_damping, path, "torsional_damping", "N·m·s/rad")?;
    if support.torsion_free {
        if support.torsional_stiffness.is_some() || damping != 0.0 {
            return Err(Error::invalid(
                format!("{path}.torsion_free"),
                "true, with a torsional stiffness or damping",
                "remove one of them",
            ));
        }
        return Ok((false, None));
    }
    let Some(stiffness) = support.torsional_stiffness else {
        if damping != 0.0 {
            return Err(Error::invalid(
                format!("{path}.torsional_damping"),
                format!("{damping} N·m·s/rad of a fork, which does not twist"),
                "give `torsional_stiffness` (N·m/rad), or remove it",
            ));
        }
        return Ok((true, None));
    };
    let stiffness = positive(stiffness, path, "torsional_stiffness", "N·m/rad")?;
    Ok((false, Some((stiffness, damping))))
}

/// Torsional properties of every element.
fn sections(
    given: &GirderDescription,
    torsion: &TorsionDescription,
    mesh: &Mesh,
    path: &str,
) -> Result<Vec<Section>, Error> {
    let needed = |value: Option<f64>, at: &str, name: &str, unit: &str| {
        let value = value.ok_or_else(|| {
            Error::invalid(
                format!("{at}.{name}"),
                "missing",
                format!("give it ({unit}), for this section or in `torsion`"),
            )
        })?;
        positive(value, at, name, unit)
    };
    let mut end = 0.0;
    let mut all = Vec::new();
    let own = crate::description::SectionDescription { length: given.length, ..Default::default() };
    let list = if given.sections.is_empty() { std::slice::from_ref(&own) } else { &given.sections };
    for (k, section) in list.iter().enumerate() {
        let at = match given.sections.len() {
            0 => format!("{path}.torsion"),
            _ => format!("{path}.sections[{k}]"),
        };
        let stiffness = section.torsional_stiffness.or(torsion.torsional_stiffness);
        let inertia = section.polar_inertia.or(torsion.polar_inertia);
        let warping = section.warping_stiffness.or(torsion.warping_stiffness).unwrap_or(0.0);
        end += section.length;
        all.push((
            end,
            Section {
                stiffness: needed(stiffness, &at, "torsional_stiffness", "N·m²")?,
                warping: at_least_zero(warping, &at, "warping_stiffness", "N·m⁴")?,
                inertia: needed(inertia, &at, "polar_inertia", "kg·m")?,
            },
        ));
    }
    let of = |ends: &[f64]| {
        let middle = 0.5 * (ends[0] + ends[1]);
        let found = all.iter().find(|(end, _)| middle < *end).or(all.last());
        found.map(|(_, section)| *section)
    };
    Ok(mesh.nodes.windows(2).filter_map(of).collect())
}
