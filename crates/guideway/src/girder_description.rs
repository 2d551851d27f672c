//! One kind of span as data.

#[cfg(feature = "schema")]
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// One kind of span: its modes, or what they are computed from.
///
/// The modes come from one of three sources.
/// - **Sine**, the default: a simply supported girder of constant section, φₙ = sin(nπx/L) with the
///   modal masses ρA·L/2. Mode n takes `frequencies[n-1]`; beyond the list
///   fₙ = (π/2)(n/L)²·√(EI/ρA) with `bending_stiffness`, or without it n²·f₁.
/// - **Tables**: `shapes` or `shapes_file` give the shapes, `frequencies` their frequencies.
/// - **Beam elements**, if any of `supports`, `sections`, `hinges`, `shear_stiffness`,
///   `rotary_inertia`, `elements` and `radius` is given: shapes, masses and frequencies are computed.
///   `frequencies` then replaces the computed ones where it is not 0.
///
/// Mode n has the damping ratio `damping[n-1]`; beyond the list its last entry.
///
/// These modes bend the girder vertically. `lateral` and `torsion` add modes that bend it laterally and twist it;
/// with a `radius`, or tables of y and theta, one mode does several at once.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "Girder"))]
#[serde(deny_unknown_fields)]
pub struct GirderDescription {
    /// Remarks. Default: empty.
    #[serde(default)]
    pub note: String,
    /// Length L (m) from the girder's start to its end; of a continuous girder over all its fields.
    pub length: f64,
    /// Number of modes, the lowest ones. Default: one per table; else one per given frequency, but at
    /// least 2, with beam elements at least 4 and 3 per field between supports.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub modes: Option<usize>,
    /// Mass per length ρA (kg/m). Required unless tables come with modal masses, or every section
    /// has its own. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mass_per_length: Option<f64>,
    /// Bending stiffness E·I (N·m²). Sine modes: for frequencies beyond the given ones. Required for
    /// beam elements unless every section has its own. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bending_stiffness: Option<f64>,
    /// Shear stiffness κ·G·A (N), κ the shear correction factor: a Timoshenko beam. Default: rigid in
    /// shear.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shear_stiffness: Option<f64>,
    /// Rotary inertia ρI per length (kg·m). Default 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotary_inertia: Option<f64>,
    /// Sections of constant properties from the start of the girder to its end. Default: one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub sections: Vec<SectionDescription>,
    /// Supports by their place. Default: rigid bearings at both ends.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub supports: Option<Vec<SupportDescription>>,
    /// Places (m from the girder's start) of hinges, which carry shear but no moment. A row of simply
    /// supported spans that share elastic piers is one girder with a hinge over each inner pier. Default:
    /// none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub hinges: Vec<f64>,
    /// Number of beam elements over the whole girder, at least 4 per mode and at most 200, or 100 with a
    /// shear stiffness. Default: 10 per mode, at least 40. The relative error of the frequency of mode n
    /// is about (πn/elements)⁴/1440.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "schema", schemars(range(min = 4, max = 200)))]
    pub elements: Option<usize>,
    /// Undamped natural frequencies (Hz), first mode first, from a modal test or another program. With
    /// beam elements 0 keeps the computed frequency; an imposed one changes the modal stiffness. Default:
    /// computed with `bending_stiffness`.
    #[serde(default)]
    pub frequencies: Vec<f64>,
    /// Damping ratios of the structure (1), first mode first; at least one, each below 1. 0 is undamped. Dampers of
    /// supports add to it.
    pub damping: Vec<f64>,
    /// Mode shapes as tables, at least one per mode. Default: sine.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shapes: Option<Vec<TabulatedShape>>,
    /// Mode shapes as a CSV file beside the layout file: columns x (m), φ₁, φ₂ … (1), rows from 0 to L.
    /// Heading lines before the numbers and lines that begin with # are skipped. Columns are separated by comma,
    /// semicolon, tab or blanks; decimals have points. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shapes_file: Option<String>,
    /// What the columns of `shapes_file` after x are, mode by mode: ["y", "z", "theta"] for three columns per mode.
    /// Default: "z" alone, the vertical deflection.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub components: Vec<ShapeComponent>,
    /// Modal masses (kg) of the shapes in `shapes_file` as they are scaled there. Default: the integral
    /// of `mass_per_length` times φ².
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub modal_masses: Vec<f64>,
    /// Whether tabulated shapes may move at the girder's ends, as on elastic bearings. The track then
    /// has a step there. Default no: φ must be 0 at both ends.
    #[serde(default, skip_serializing_if = "is_false")]
    pub elastic_ends: bool,
    /// Factor on all modal stiffnesses of this kind; frequencies change by its root. Default 1.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub stiffness_factor: f64,
    /// Factor on all modal masses of this kind; frequencies change by its inverse root. Default 1.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub mass_factor: f64,
    /// Lateral bending. Default: rigid.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lateral: Option<crate::description::LateralDescription>,
    /// Torsion. Default: rigid.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub torsion: Option<crate::description::TorsionDescription>,
    /// Radius in plan (m) of the girder's axis, positive in a curve to the left. Bending and torsion are then coupled,
    /// and computed together by curved beam elements with `torsion`. Default: straight.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radius: Option<f64>,
}

fn one() -> f64 {
    1.0
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "the form that serde asks for")]
fn is_one(value: &f64) -> bool {
    *value == 1.0
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "the form that serde asks for")]
fn is_false(value: &bool) -> bool {
    !*value
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "the form that serde asks for")]
fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

/// A component of a tabulated mode shape.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum ShapeComponent {
    /// Lateral displacement of the shear centre (1), left positive.
    Y,
    /// Vertical displacement of the shear centre (1), up positive.
    Z,
    /// Twist (rad/m), positive if it lifts the left rail.
    Theta,
}

/// A mode shape given at points, interpolated by natural cubic splines.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "Shape"))]
#[serde(deny_unknown_fields)]
pub struct TabulatedShape {
    /// Modal mass ∫ρA·φ² dx (kg) for φ as scaled here.
    pub modal_mass: f64,
    /// Points along the span (m), from 0 to L.
    pub x: Vec<f64>,
    /// φ there (1), vertical, up positive; 0 at both ends unless `elastic_ends` is true.
    pub phi: Vec<f64>,
    /// Lateral displacement of the shear centre there (1), left positive. Default: 0 everywhere.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub y: Vec<f64>,
    /// Twist about the shear centre there (rad/m), positive if it lifts the left rail. Default: 0 everywhere.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub theta: Vec<f64>,
}

/// A part of a girder with constant properties. What it leaves out is that of the girder.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "Section"))]
#[serde(deny_unknown_fields)]
pub struct SectionDescription {
    /// Name, for patches. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Length (m). The lengths of all sections add up to the girder's.
    pub length: f64,
    /// Mass per length (kg/m). Default: the girder's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mass_per_length: Option<f64>,
    /// Bending stiffness E·I (N·m²). Default: the girder's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bending_stiffness: Option<f64>,
    /// Shear stiffness κ·G·A (N). Default: the girder's, or rigid in shear.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shear_stiffness: Option<f64>,
    /// Rotary inertia ρI per length (kg·m). Default: the girder's, or 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotary_inertia: Option<f64>,
    /// Lateral bending stiffness (N·m²). Default: that of the girder's `lateral`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lateral_bending_stiffness: Option<f64>,
    /// Torsional stiffness G·J (N·m²). Default: that of the girder's `torsion`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub torsional_stiffness: Option<f64>,
    /// Warping stiffness E·I_w (N·m⁴). Default: that of the girder's `torsion`, or 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub warping_stiffness: Option<f64>,
    /// Polar mass moment of inertia per length (kg·m). Default: that of the girder's `torsion`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub polar_inertia: Option<f64>,
}

/// A support of a girder: a bearing on the ground, or on a pier that stands on the ground.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "Support"))]
#[serde(deny_unknown_fields)]
pub struct SupportDescription {
    /// Name, for patches. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Place (m from the girder's start), 0 to L.
    pub x: f64,
    /// Vertical stiffness of the bearing (N/m). Default: rigid.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "schema", schemars(extend("exclusiveMinimum" = 0)))]
    pub stiffness: Option<f64>,
    /// Vertical damping of the bearing (N·s/m). Default 0.
    #[serde(default, skip_serializing_if = "is_zero")]
    #[cfg_attr(feature = "schema", schemars(range(min = 0)))]
    pub damping: f64,
    /// Rotational stiffness between girder and ground (N·m/rad). Default 0: free to rotate.
    #[serde(default, skip_serializing_if = "is_zero")]
    #[cfg_attr(feature = "schema", schemars(range(min = 0)))]
    pub rotational_stiffness: f64,
    /// Whether the girder cannot rotate here. Default no.
    #[serde(default, skip_serializing_if = "is_false")]
    pub clamped: bool,
    /// Pier under the bearing. Default: the bearing stands on rigid ground.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pier: Option<PierDescription>,
    /// Lateral stiffness of the bearing (N/m). Default: rigid.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "schema", schemars(extend("exclusiveMinimum" = 0)))]
    pub lateral_stiffness: Option<f64>,
    /// Lateral damping of the bearing (N·s/m). Default 0.
    #[serde(default, skip_serializing_if = "is_zero")]
    #[cfg_attr(feature = "schema", schemars(range(min = 0)))]
    pub lateral_damping: f64,
    /// Whether the girder can slide sideways here. Default no.
    #[serde(default, skip_serializing_if = "is_false")]
    pub lateral_free: bool,
    /// Stiffness against twist (N·m/rad) of bearings and pier in series. Default: rigid, a fork.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "schema", schemars(extend("exclusiveMinimum" = 0)))]
    pub torsional_stiffness: Option<f64>,
    /// Damping against twist (N·m·s/rad). Default 0.
    #[serde(default, skip_serializing_if = "is_zero")]
    #[cfg_attr(feature = "schema", schemars(range(min = 0)))]
    pub torsional_damping: f64,
    /// Whether the girder can twist here, as on a single bearing. Default no.
    #[serde(default, skip_serializing_if = "is_false")]
    pub torsion_free: bool,
}

/// A pier as a mass on a spring and a damper. A pier without mass is no pier: give the stiffness of
/// bearing and pier in series as that of the bearing.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "Pier"))]
#[serde(deny_unknown_fields)]
pub struct PierDescription {
    /// Mass that moves with the top of the pier (kg).
    #[cfg_attr(feature = "schema", schemars(extend("exclusiveMinimum" = 0)))]
    pub mass: f64,
    /// Vertical stiffness of pier and foundation (N/m).
    #[cfg_attr(feature = "schema", schemars(extend("exclusiveMinimum" = 0)))]
    pub stiffness: f64,
    /// Vertical damping of pier and foundation (N·s/m). Default 0.
    #[serde(default, skip_serializing_if = "is_zero")]
    #[cfg_attr(feature = "schema", schemars(range(min = 0)))]
    pub damping: f64,
    /// Lateral stiffness of the pier's top (N/m). Default: rigid.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "schema", schemars(extend("exclusiveMinimum" = 0)))]
    pub lateral_stiffness: Option<f64>,
    /// Mass that moves laterally with the top of the pier (kg). Default: `mass`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "schema", schemars(extend("exclusiveMinimum" = 0)))]
    pub lateral_mass: Option<f64>,
    /// Lateral damping of pier and foundation (N·s/m). Default 0.
    #[serde(default, skip_serializing_if = "is_zero")]
    #[cfg_attr(feature = "schema", schemars(range(min = 0)))]
    pub lateral_damping: f64,
}

impl GirderDescription {
    /// Whether the modes are computed with beam elements.
    #[must_use]
    pub fn is_beam(&self) -> bool {
        self.supports.is_some()
            || !self.sections.is_empty()
            || !self.hinges.is_empty()
            || self.shear_stiffness.is_some()
            || self.rotary_inertia.is_some()
            || self.elements.is_some()
            || self.radius.is_some()
    }

    /// Number of modes: the given one or its default.
    #[must_use]
    pub fn mode_count(&self) -> usize {
        let fields = self.supports.as_ref().map_or(1, |all| all.len().saturating_sub(1));
        self.modes.unwrap_or_else(|| match &self.shapes {
            Some(tables) => tables.len(),
            None if self.is_beam() => self.frequencies.len().max(4).max(3 * fields),
            None => self.frequencies.len().max(2),
        })
    }

    /// Multiplies bending, shear and torsional stiffness of the beam, and of all its sections.
    pub fn scale_beam_stiffness(&mut self, factor: f64) {
        let sections = self.sections.iter_mut().flat_map(|section| {
            [
                &mut section.bending_stiffness,
                &mut section.shear_stiffness,
                &mut section.lateral_bending_stiffness,
                &mut section.torsional_stiffness,
                &mut section.warping_stiffness,
            ]
        });
        let own = [&mut self.bending_stiffness, &mut self.shear_stiffness];
        let lateral = self.lateral.iter_mut().map(|l| &mut l.bending_stiffness);
        let torsion = self
            .torsion
            .iter_mut()
            .flat_map(|t| [&mut t.torsional_stiffness, &mut t.warping_stiffness]);
        for value in sections.chain(own).chain(lateral).chain(torsion).flatten() {
            *value *= factor;
        }
    }

    /// Multiplies all stiffnesses and all dampings of bearings and piers.
    pub fn scale_supports(&mut self, stiffness: f64, damping: f64) {
        for support in self.supports.iter_mut().flatten() {
            support.stiffness = support.stiffness.map(|k| k * stiffness);
            support.rotational_stiffness *= stiffness;
            support.damping *= damping;
            support.lateral_stiffness = support.lateral_stiffness.map(|k| k * stiffness);
            support.lateral_damping *= damping;
            support.torsional_stiffness = support.torsional_stiffness.map(|k| k * stiffness);
            support.torsional_damping *= damping;
            if let Some(pier) = &mut support.pier {
                pier.stiffness *= stiffness;
                pier.damping *= damping;
                pier.lateral_stiffness = pier.lateral_stiffness.map(|k| k * stiffness);
                pier.lateral_damping *= damping;
            }
        }
    }
}
