//! Loads on rails, and what magnets meet there.
//!
//! A load with the levitation force F and the lateral force H on the magnet, on the rail at s·b (s = ±1)
//! and height h, acts on the shear centre with −(F, H, s·b·F − h·H) in the components (z, y, θ): with the
//! same numbers the motion of the rail follows from the components, z + s·b·θ vertically and y − h·θ
//! laterally. So the power of the forces at the rails is the power that the modes receive.

use crate::propagator::{NODES, nodes};
use crate::shapes::{ShapeRow, sines_at_nodes};
use crate::{
    Girder, Guideway, Load, LoadChange, Rails, Span, SpanMotion, State, Surface, Workspace,
};

/// Components of the motion of a cross-section: vertical, lateral, twist.
const COMPONENTS: usize = 3;

/// The rail under a magnet.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RailSurface {
    /// Vertical: bending plus twist times half-gauge, and irregularity; up positive.
    pub vertical: Surface,
    /// Lateral: bending minus twist times height, and alignment; left positive.
    pub lateral: Surface,
}

/// Kink and step of the track at a joint: the girder behind it minus that before it, of the deflection.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct JointMotion {
    /// Vertical kink (rad), positive if the track turns upward.
    pub kink: f64,
    /// Vertical step (m), up positive.
    pub step: f64,
    /// Lateral kink of the rails (rad), positive if they turn left.
    pub lateral_kink: f64,
    /// Lateral step of the rails (m), left positive.
    pub lateral_step: f64,
    /// Step of the twist (rad).
    pub twist_step: f64,
}

/// Shapes of each component at one place.
#[derive(Debug, Clone)]
pub(crate) struct ComponentRows {
    rows: [ShapeRow; COMPONENTS],
    point: ShapeRow,
    /// Whether the first row serves all components: sines of the same girder.
    shared: bool,
}

impl ComponentRows {
    pub fn new(modes: usize) -> Self {
        let row = ShapeRow::with_modes(modes);
        Self { rows: [row.clone(), row.clone(), row.clone()], point: row, shared: false }
    }

    fn of(&self, component: usize) -> &ShapeRow {
        &self.rows[if self.shared { 0 } else { component }]
    }
}

/// The filter of the longest row of sines, if all components are sines.
fn common_filter(girder: &Girder) -> Option<&[f64]> {
    let mut longest: &[f64] = &[];
    for (shapes, ..) in (0..COMPONENTS).filter_map(|k| girder.component(k)) {
        let filter = shapes.sine_filter()?;
        longest = if filter.len() > longest.len() { filter } else { longest };
    }
    Some(longest)
}

/// Calls `see(i, component, φ, slope, curvature)` for every mode of a span and component that it has.
fn each(
    span: &Span,
    girder: &Girder,
    rows: &ComponentRows,
    mut see: impl FnMut(usize, usize, f64, f64, f64),
) {
    for k in 0..COMPONENTS {
        let Some((_, first, modes)) = girder.component(k) else { continue };
        let row = rows.of(k);
        for n in 0..modes {
            see(span.first_mode + first + n, k, row.value[n], row.slope[n], row.curvature[n]);
        }
    }
}

impl Rails {
    /// The load on the shear centre in the components (z, y, θ), without its sign.
    fn wrench(&self, side: f64, force: f64, lateral: f64) -> [f64; COMPONENTS] {
        [force, lateral, side * self.half_gauge() * force - self.height() * lateral]
    }
}

impl Guideway {
    /// Calls `visit(span, girder, rows)` for every span that the pole centred at x touches, with the
    /// means of its shapes over the pole, 0 beyond the span.
    fn under_rails(
        &self,
        x: f64,
        rows: &mut ComponentRows,
        mut visit: impl FnMut(&Span, &Girder, &ComponentRows),
    ) {
        let (from, to) = (x - self.reach(), x + self.reach());
        if let Some(span) = self.span_at(from)
            && to <= span.end
        {
            let girder = &self.girders()[span.girder];
            rows.shared = common_filter(girder).is_some();
            if rows.shared {
                let longest = (0..COMPONENTS).filter_map(|k| girder.component(k));
                if let Some((shapes, ..)) = longest.max_by_key(|(_, _, modes)| *modes) {
                    shapes.under_pole(x - span.start, self.pole(), &mut rows.rows[0]);
                }
            } else {
                for k in 0..COMPONENTS {
                    let Some((shapes, ..)) = girder.component(k) else { continue };
                    shapes.under_pole(x - span.start, self.pole(), &mut rows.rows[k]);
                }
            }
            visit(span, girder, rows);
            return;
        }
        // across a joint or an end of the guideway
        rows.shared = false;
        let first = self.spans().partition_point(|s| s.end <= from);
        for span in self.spans()[first..].iter().take_while(|s| s.start < to) {
            let girder = &self.girders()[span.girder];
            for k in 0..COMPONENTS {
                let Some((shapes, _, modes)) = girder.component(k) else { continue };
                let ComponentRows { rows, point, .. } = rows;
                if shapes.spread_evenly() && self.pole().length() > 0.0 {
                    shapes.under_pole(x - span.start, self.pole(), &mut rows[k]);
                    continue;
                }
                let row = &mut rows[k];
                for list in [&mut row.value, &mut row.slope, &mut row.curvature] {
                    list[..modes].fill(0.0);
                }
                for &(offset, share) in self.pole().points() {
                    let place = x + offset;
                    if place >= span.start && place < span.end {
                        shapes.at(place - span.start, point);
                        for n in 0..modes {
                            row.value[n] += share * point.value[n];
                            row.slope[n] += share * point.slope[n];
                            row.curvature[n] += share * point.curvature[n];
                        }
                    }
                }
            }
            visit(span, girder, rows);
        }
    }

    /// Adds the static state under the loads, with the rate of loads that move slowly.
    pub(crate) fn rest_on_rails(
        &self,
        rails: &Rails,
        work: &mut Workspace,
        loads: &[Load],
        speed: f64,
        state: &mut State,
    ) {
        for (k, load) in loads.iter().enumerate() {
            let wrench = rails.wrench(rails.side(k), load.force[0], load.lateral[0]);
            self.under_rails(load.position[0], &mut work.rows, |span, girder, rows| {
                each(span, girder, rows, |i, component, value, slope, _| {
                    let flexibility = wrench[component] / self.modes()[i].stiffness();
                    state.q[i] -= flexibility * value;
                    state.v[i] -= flexibility * speed * slope;
                });
            });
        }
    }

    /// Adds the modal forces of the loads at the nodes of a sub-step.
    pub(crate) fn add_loads_on_rails(
        &self,
        rails: &Rails,
        work: &mut Workspace,
        loads: &[Load],
        begin: f64,
        h: f64,
    ) {
        let times = nodes().map(|node| begin + node * h);
        let Workspace { forces, rows, .. } = work;
        for (k, load) in loads.iter().enumerate() {
            let side = rails.side(k);
            let places = times.map(|tau| load.position_at(tau));
            let wrenches =
                times.map(|tau| rails.wrench(side, load.force_at(tau), load.lateral_at(tau)));
            if let Some((span, girder, filter)) = self.sines_of_all(&places) {
                let local = places.map(|x| x - span.start);
                let parts: [_; COMPONENTS] = std::array::from_fn(|k| {
                    let (_, first, modes) = girder.component(k).unwrap_or((girder.shapes(), 0, 0));
                    (span.first_mode + first, modes, wrenches.map(|w| w[k]))
                });
                sines_at_nodes(girder.length(), local, filter, |n, phi| {
                    for (first, modes, by) in &parts {
                        if n < *modes {
                            let modal = &mut forces[first + n];
                            *modal = std::array::from_fn(|j| modal[j] - by[j] * phi[j]);
                        }
                    }
                });
                continue;
            }
            let standing = load.position[1..] == [0.0; 3];
            for (j, x) in places.into_iter().enumerate() {
                // a standing load meets the same shapes at all nodes
                let at = if standing { 0..NODES } else { j..j + 1 };
                if standing && j > 0 {
                    break;
                }
                self.under_rails(x, rows, |span, girder, rows| {
                    each(span, girder, rows, |i, component, value, _, _| {
                        for j in at.clone() {
                            forces[i][j] -= wrenches[j][component] * value;
                        }
                    });
                });
            }
        }
    }

    /// The span, its girder and the filter of its longest row of modes, if poles centred at all of
    /// `places` are entirely on it and all its modes are sines.
    fn sines_of_all(&self, places: &[f64; NODES]) -> Option<(&Span, &Girder, &[f64])> {
        let span = self.span_at(places[0] - self.reach())?;
        let girder = &self.girders()[span.girder];
        let filter = common_filter(girder)?;
        let inside = |x: &f64| x - self.reach() >= span.start && x + self.reach() <= span.end;
        places.iter().all(inside).then_some((span, girder, filter))
    }

    /// Adds the modal forces of the loads now.
    pub(crate) fn add_forces_on_rails(
        &self,
        rails: &Rails,
        work: &mut Workspace,
        loads: &[Load],
        forces: &mut [f64],
    ) {
        for (k, load) in loads.iter().enumerate() {
            let wrench = rails.wrench(rails.side(k), load.force[0], load.lateral[0]);
            self.under_rails(load.position[0], &mut work.rows, |span, girder, rows| {
                each(span, girder, rows, |i, component, value, _, _| {
                    forces[i] -= wrench[component] * value;
                });
            });
        }
    }

    /// Adds how the modal accelerations change with one load, number `k`.
    pub(crate) fn change_on_rails(
        &self,
        rails: &Rails,
        work: &mut Workspace,
        (k, load): (usize, &Load),
        by: LoadChange,
        change: &mut [f64],
    ) {
        let side = rails.side(k);
        let more = rails.wrench(side, by.force, by.lateral);
        let wrench = rails.wrench(side, load.force[0], load.lateral[0]);
        self.under_rails(load.position[0], &mut work.rows, |span, girder, rows| {
            each(span, girder, rows, |i, component, value, slope, _| {
                let push = more[component] * value + wrench[component] * slope * by.place;
                change[i] -= push / self.modes()[i].mass;
            });
        });
    }

    /// The rail that magnet `k` (from 0), centred at x, meets; `accelerations` is the result of
    /// [`accelerations`](Self::accelerations). Without rails it is the surface in the middle of the
    /// track, and there is no lateral motion.
    pub fn rail(
        &self,
        work: &mut Workspace,
        state: &State,
        accelerations: &[f64],
        k: usize,
        x: f64,
    ) -> RailSurface {
        let Some(rails) = self.rails() else {
            let vertical = self.surface(work, state, accelerations, x);
            return RailSurface { vertical, lateral: Surface::default() };
        };
        let side = rails.side(k);
        let mut parts = [Surface::default(); COMPONENTS];
        self.under_rails(x, &mut work.rows, |span, girder, rows| {
            each(span, girder, rows, |i, component, value, slope, curvature| {
                let (s, q, v) = (&mut parts[component], state.q[i], state.v[i]);
                s.u += q * value;
                s.u_x += q * slope;
                s.u_xx += q * curvature;
                s.u_t += v * value;
                s.u_tx += v * slope;
                s.u_tt += accelerations[i] * value;
            });
        });
        let [z, y, twist] = parts;
        let mut vertical = z.plus(&twist, side * rails.half_gauge());
        let mut lateral = y.plus(&twist, -rails.height());
        if let Some(profile) = self.profile() {
            [vertical.r, vertical.r_x, vertical.r_xx] = profile.at(x);
        }
        let [up, left] = rails.irregularity(side, x);
        vertical.r += up[0];
        vertical.r_x += up[1];
        vertical.r_xx += up[2];
        [lateral.r, lateral.r_x, lateral.r_xx] = left;
        RailSurface { vertical, lateral }
    }

    /// Vertical motion, lateral motion and twist (rad) of the shear centre of span `k` (from 0) at x m from
    /// its start.
    pub fn section_motion(
        &self,
        work: &mut Workspace,
        state: &State,
        accelerations: &[f64],
        k: usize,
        x: f64,
    ) -> [SpanMotion; 3] {
        let span = self.spans()[k];
        let girder = &self.girders()[span.girder];
        std::array::from_fn(|component| {
            let mut y = SpanMotion::default();
            let Some((shapes, first, modes)) = girder.component(component) else { return y };
            shapes.at(x, &mut work.row);
            for n in 0..modes {
                let (i, phi) = (span.first_mode + first + n, work.row.value[n]);
                y.displacement += phi * state.q[i];
                y.velocity += phi * state.v[i];
                y.acceleration += phi * accelerations[i];
            }
            y
        })
    }

    /// Kink and step at joint `k` of the track: 0 is the start of the first span, the last one the end of
    /// the last span. The ground beyond both is straight.
    pub fn joint(&self, work: &mut Workspace, state: &State, k: usize) -> JointMotion {
        let height = self.rails().map_or(0.0, Rails::height);
        let mut motion = JointMotion::default();
        for (index, sign) in [(k.checked_sub(1), -1.0), (Some(k), 1.0)] {
            let Some(span) = index.and_then(|index| self.spans().get(index)) else { continue };
            let girder = &self.girders()[span.girder];
            let x = if sign < 0.0 { girder.length() } else { 0.0 };
            for component in 0..COMPONENTS {
                let Some((shapes, first, modes)) = girder.component(component) else { continue };
                shapes.at(x, &mut work.row);
                let (mut value, mut slope) = (0.0, 0.0);
                for n in 0..modes {
                    let q = sign * state.q[span.first_mode + first + n];
                    value += q * work.row.value[n];
                    slope += q * work.row.slope[n];
                }
                match component {
                    0 => (motion.step, motion.kink) = (motion.step + value, motion.kink + slope),
                    1 => {
                        motion.lateral_step += value;
                        motion.lateral_kink += slope;
                    }
                    _ => {
                        motion.twist_step += value;
                        motion.lateral_step -= height * value;
                        motion.lateral_kink -= height * slope;
                    }
                }
            }
        }
        motion
    }
}

impl Surface {
    /// The deflection plus `by` times another one.
    fn plus(&self, other: &Self, by: f64) -> Self {
        Self {
            u: self.u + by * other.u,
            u_x: self.u_x + by * other.u_x,
            u_xx: self.u_xx + by * other.u_xx,
            u_t: self.u_t + by * other.u_t,
            u_tx: self.u_tx + by * other.u_tx,
            u_tt: self.u_tt + by * other.u_tt,
            ..*self
        }
    }
}
