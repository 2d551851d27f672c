//! Parameters of each kind of girder.

use fmi2_export::{Interface, RealVar, RealVars, UnitOfMeasure, Values, VariableRow};
use guideway::Girder;
use guideway::description::{GirderDescription, GuidewayDescription};

/// Names of the kinds of span in front of their parameters: empty if there is only one kind.
pub(crate) fn prefixes(layout: &GuidewayDescription) -> Vec<String> {
    let alone = layout.girders.len() == 1;
    layout.girders.keys().map(|n| if alone { String::new() } else { format!("{n}_") }).collect()
}

/// Parameters of one kind.
#[derive(Debug, Clone, Copy)]
pub(crate) struct KindHandles {
    /// Of the modes.
    frequency: RealVars,
    damping: RealVars,
    /// On stiffness and mass; with a single kind those of the guideway serve.
    factors: Option<[RealVar; 2]>,
    /// Of a kind whose modes are computed with beam elements.
    beam: Option<BeamHandles>,
}

#[derive(Debug, Clone, Copy)]
struct BeamHandles {
    beam_stiffness: RealVar,
    support_stiffness: RealVar,
    support_damping: RealVar,
}

/// A factor as a parameter.
pub(crate) fn factor(interface: &mut Interface, name: String, start: f64, text: &str) -> RealVar {
    interface
        .real(name)
        .parameter(start)
        .min(1e-6)
        .max(1e6)
        .unit(UnitOfMeasure::ONE)
        .description(text)
        .done()
}

impl KindHandles {
    pub(crate) fn declare(
        interface: &mut Interface,
        given: &GirderDescription,
        girder: &Girder,
        prefix: &str,
    ) -> Self {
        let count = girder.vertical_modes().len();
        let computed = given.is_beam();
        let imposed = |n: usize| given.frequencies.get(n).copied().unwrap_or(0.0);
        let starts: Vec<f64> = if computed {
            (0..count).map(imposed).collect()
        } else {
            girder.frequencies()[..count].to_vec()
        };
        let frequency = interface
            .reals(format!("{prefix}frequency"), count)
            .parameter(0.0)
            .starts(starts)
            .min(0.0)
            .unit(UnitOfMeasure::HERTZ)
            .description(if computed {
                "Imposed natural frequency of mode {k}, before stiffness_factor and mass_factor; 0: as computed"
            } else {
                "Natural frequency of mode {k}, before stiffness_factor and mass_factor"
            })
            .done();
        let damping = interface
            .reals(format!("{prefix}damping"), count)
            .parameter(0.0)
            .starts(girder.structural_damping()[..count].iter().copied())
            .min(0.0)
            .unit(UnitOfMeasure::ONE)
            .display("%")
            .description(if computed {
                "Damping ratio of mode {k}, without dampers of supports"
            } else {
                "Damping ratio of mode {k}"
            })
            .done();
        let factors = (!prefix.is_empty()).then(|| {
            let kind = prefix.trim_end_matches('_');
            [
                factor(
                    interface,
                    format!("{prefix}stiffness_factor"),
                    given.stiffness_factor,
                    &format!(
                        "Factor on the stiffness of spans of kind {kind}, times stiffness_factor"
                    ),
                ),
                factor(
                    interface,
                    format!("{prefix}mass_factor"),
                    given.mass_factor,
                    &format!("Factor on the mass of spans of kind {kind}, times mass_factor"),
                ),
            ]
        });
        let beam = computed.then(|| BeamHandles {
            beam_stiffness: factor(
                interface,
                format!("{prefix}beam_stiffness_factor"),
                1.0,
                "Factor on bending and shear stiffness of the beam, not on its supports",
            ),
            support_stiffness: factor(
                interface,
                format!("{prefix}support_stiffness_factor"),
                1.0,
                "Factor on the stiffness of elastic bearings and piers",
            ),
            support_damping: interface
                .real(format!("{prefix}support_damping_factor"))
                .parameter(1.0)
                .min(0.0)
                .max(1e6)
                .unit(UnitOfMeasure::ONE)
                .description("Factor on the damping of bearings and piers")
                .done(),
        });
        Self { frequency, damping, factors, beam }
    }

    /// Puts the parameters' values into the description; `modes` is the largest number of modes.
    pub(crate) fn apply(&self, girder: &mut GirderDescription, modes: usize, values: &Values) {
        girder.modes = Some(girder.mode_count().min(modes));
        girder.frequencies = values.reals(self.frequency).to_vec();
        girder.damping = values.reals(self.damping).to_vec();
        if let Some([stiffness, mass]) = self.factors {
            girder.stiffness_factor = values.real(stiffness);
            girder.mass_factor = values.real(mass);
        }
        if let Some(beam) = &self.beam {
            girder.scale_beam_stiffness(values.real(beam.beam_stiffness));
            girder.scale_supports(
                values.real(beam.support_stiffness),
                values.real(beam.support_damping),
            );
        }
    }

    /// Parameters of this kind that its modal masses depend on.
    pub(crate) fn of_modal_mass(&self) -> Vec<VariableRow> {
        let mut rows: Vec<VariableRow> = self.factors.iter().map(|f| f[1].row()).collect();
        if let Some(beam) = &self.beam {
            rows.extend([beam.beam_stiffness.row(), beam.support_stiffness.row()]);
        }
        rows
    }
}

/// Values of one kind that are computed from its parameters.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DerivedKind {
    modal_mass: RealVars,
    /// Frequencies and damping ratios with all factors and supports, of computed modes.
    computed: Option<[RealVars; 2]>,
}

impl DerivedKind {
    pub(crate) fn declare(
        interface: &mut Interface,
        given: &GirderDescription,
        girder: &Girder,
        prefix: &str,
        mass_depends_on: &[VariableRow],
    ) -> Self {
        let count = girder.vertical_modes().len();
        let modal_mass = interface
            .reals(format!("{prefix}modal_mass"), count)
            .calculated_parameter()
            .unit(UnitOfMeasure::KILOGRAM)
            .nominal(1e4)
            .description("Modal mass of mode {k}, with mass_factor; 0 for modes left out")
            .done();
        interface.initially_depends(modal_mass, mass_depends_on);
        let computed = given.is_beam().then(|| {
            let mut row = |name: &str, unit, text: &str| {
                interface
                    .reals(format!("{prefix}{name}"), count)
                    .calculated_parameter()
                    .unit(unit)
                    .description(text)
                    .done()
            };
            [
                row(
                    "natural_frequency",
                    UnitOfMeasure::HERTZ,
                    "Natural frequency of mode {k}, with supports and all factors; 0 for modes left out",
                ),
                row(
                    "damping_ratio",
                    UnitOfMeasure::ONE,
                    "Damping ratio of mode {k}, with dampers of supports; 0 for modes left out",
                ),
            ]
        });
        Self { modal_mass, computed }
    }

    /// Writes the values of a girder that may have fewer modes than were declared.
    pub(crate) fn write(&self, girder: &Girder, values: &mut Values) {
        let mut fill = |row, of: &dyn Fn(&guideway::GirderMode) -> f64| {
            let row = values.reals_mut(row);
            row.fill(0.0);
            for (value, mode) in row.iter_mut().zip(girder.vertical_modes()) {
                *value = of(mode);
            }
        };
        fill(self.modal_mass, &|mode| mode.mass);
        if let Some([frequency, damping]) = self.computed {
            fill(frequency, &guideway::GirderMode::frequency);
            fill(damping, &|mode| mode.zeta);
        }
    }
}
