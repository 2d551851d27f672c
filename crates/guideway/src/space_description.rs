//! Lateral bending and torsion of a kind of span, as data.

#[cfg(feature = "schema")]
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::description::{
    GirderDescription, PierDescription, SectionDescription, SupportDescription,
};

/// Lateral bending of a girder: modes of its own beside those of vertical bending.
///
/// They are sines, or computed with beam elements if those of vertical bending are.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "LateralBending"))]
#[serde(deny_unknown_fields)]
pub struct LateralDescription {
    /// Number of modes, the lowest ones. Default: one per given frequency, but at least 2.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub modes: Option<usize>,
    /// Lateral bending stiffness E·I of the section's other axis (N·m²). Required for beam elements unless
    /// every section has its own. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bending_stiffness: Option<f64>,
    /// Undamped natural frequencies (Hz), first mode first. With beam elements 0 keeps the computed
    /// frequency. Default: computed with `bending_stiffness`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub frequencies: Vec<f64>,
    /// Damping ratios (1), first mode first; the last one serves further modes. Default: those of
    /// vertical bending.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub damping: Vec<f64>,
}

/// Torsion of a girder about its shear centre: modes of its own, or what couples bending to twist if the
/// girder is curved in plan.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "Torsion"))]
#[serde(deny_unknown_fields)]
pub struct TorsionDescription {
    /// Number of modes, the lowest ones; not for girders with a `radius`, whose modes are counted by the
    /// girder's. Default: one per given frequency, but at least 2.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub modes: Option<usize>,
    /// Torsional stiffness G·J (N·m²), J the torsion constant. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub torsional_stiffness: Option<f64>,
    /// Warping stiffness E·I_w (N·m⁴). Default 0: closed sections hardly warp.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub warping_stiffness: Option<f64>,
    /// Polar mass moment of inertia per length ρ·I_p (kg·m) about the shear centre. Required unless every
    /// section has its own. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub polar_inertia: Option<f64>,
    /// Undamped natural frequencies (Hz), first mode first. With beam elements 0 keeps the computed
    /// frequency. Default: computed, ω² = (EI_w·k⁴ + GJ·k²)/(ρI_p) with k = nπ/L.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub frequencies: Vec<f64>,
    /// Damping ratios (1), first mode first; the last one serves further modes. Default: those of
    /// vertical bending.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub damping: Vec<f64>,
}

/// Number of modes: the given one, or one per frequency but at least 2.
fn count(modes: Option<usize>, frequencies: &[f64]) -> usize {
    modes.unwrap_or(frequencies.len().max(2))
}

impl LateralDescription {
    /// Number of modes: the given one or its default.
    #[must_use]
    pub fn mode_count(&self) -> usize {
        count(self.modes, &self.frequencies)
    }
}

impl TorsionDescription {
    /// Number of modes: the given one or its default.
    #[must_use]
    pub fn mode_count(&self) -> usize {
        count(self.modes, &self.frequencies)
    }
}

impl GirderDescription {
    /// Whether it bends laterally, twists, or has tabulated shapes that do.
    #[must_use]
    pub fn is_spatial(&self) -> bool {
        let tabulated = |all: &Vec<crate::description::TabulatedShape>| {
            all.iter().any(|shape| !shape.y.is_empty() || !shape.theta.is_empty())
        };
        self.lateral.is_some()
            || self.torsion.is_some()
            || self.radius.is_some()
            || self.shapes.as_ref().is_some_and(tabulated)
            || self.components.iter().any(|c| *c != crate::description::ShapeComponent::Z)
    }

    /// The girder seen from above: its lateral bending as that of a girder that bends vertically.
    pub(crate) fn seen_from_above(&self, lateral: &LateralDescription) -> Self {
        let from_above = |support: &SupportDescription| SupportDescription {
            name: support.name.clone(),
            x: support.x,
            stiffness: support.lateral_stiffness,
            damping: support.lateral_damping,
            pier: support.pier.and_then(|pier| {
                Some(PierDescription {
                    mass: pier.lateral_mass.unwrap_or(pier.mass),
                    stiffness: pier.lateral_stiffness?,
                    damping: pier.lateral_damping,
                    ..PierDescription::default()
                })
            }),
            ..SupportDescription::default()
        };
        let section = |section: &SectionDescription| SectionDescription {
            name: section.name.clone(),
            length: section.length,
            mass_per_length: section.mass_per_length,
            bending_stiffness: section.lateral_bending_stiffness,
            ..SectionDescription::default()
        };
        let holding = |all: &Vec<SupportDescription>| {
            all.iter().filter(|s| !s.lateral_free).map(from_above).collect()
        };
        let damping = if lateral.damping.is_empty() { &self.damping } else { &lateral.damping };
        Self {
            note: String::new(),
            length: self.length,
            modes: Some(lateral.mode_count()),
            mass_per_length: self.mass_per_length,
            bending_stiffness: lateral.bending_stiffness,
            shear_stiffness: None,
            rotary_inertia: None,
            sections: self.sections.iter().map(section).collect(),
            supports: self.supports.as_ref().map(holding),
            hinges: self.hinges.clone(),
            elements: self.elements,
            frequencies: lateral.frequencies.clone(),
            damping: damping.clone(),
            shapes: None,
            shapes_file: None,
            components: Vec::new(),
            modal_masses: Vec::new(),
            elastic_ends: false,
            stiffness_factor: self.stiffness_factor,
            mass_factor: self.mass_factor,
            lateral: None,
            torsion: None,
            radius: None,
        }
    }
}
