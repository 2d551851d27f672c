//! What a layout with rails or joints adds: declared last, so that other variables keep their references.

use fmi2_export::{
    BooleanVar, Error, IntegerVar, Interface, RealVar, RealVars, UnitOfMeasure, Values, VariableRow,
};
use guideway::description::GuidewayDescription;
use guideway::{Girder, GirderPart, Guideway, JointMotion, SpanMotion};

use crate::table::{InputHandles, OutputHandles};

/// Outputs of the rails under the magnets, and of the shear centre in the middle of spans.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RailOutputs {
    pub lateral_displacement: RealVars,
    pub lateral_rate: RealVars,
    pub midspan_lateral: RealVars,
    pub midspan_twist: RealVars,
}

/// Kinks and steps at joints.
#[derive(Debug, Clone, Copy)]
pub(crate) struct JointOutputs {
    kink: RealVars,
    step: RealVars,
    /// Lateral kink and step, and the step of the twist.
    lateral: Option<[RealVars; 3]>,
}

/// Parameters of the rails and of each kind of girder beside them.
#[derive(Debug, Clone)]
pub(crate) struct RailParameters {
    half_gauge: RealVar,
    height: RealVar,
    irregular: BooleanVar,
    seed: IntegerVar,
    /// Kind by kind, of lateral bending and torsion: frequencies and damping ratios.
    kinds: Vec<[Option<PartHandles>; 2]>,
}

#[derive(Debug, Clone, Copy)]
struct PartHandles {
    frequency: RealVars,
    damping: RealVars,
    /// Frequencies with supports and all factors.
    natural: RealVars,
}

fn row(
    interface: &mut Interface,
    name: &str,
    count: usize,
    order: u32,
    unit: UnitOfMeasure,
    text: &str,
) -> RealVars {
    interface
        .reals(name, count)
        .output()
        .derivatives(order)
        .unit(unit)
        .nominal(1e-3)
        .description(text)
        .done()
}

/// Declares the lateral forces.
pub(crate) fn declare_forces(interface: &mut Interface, magnets: usize) -> RealVars {
    interface
        .reals("lateral_force", magnets)
        .input(0.0)
        .takes(5)
        .unit(UnitOfMeasure::NEWTON)
        .nominal(1e3)
        .description("Lateral force on magnet {k}, left positive; it pushes its rail to the right")
        .done()
}

impl RailOutputs {
    pub(crate) fn declare(
        interface: &mut Interface,
        guideway: &Guideway,
        inputs: &InputHandles,
        outputs: &OutputHandles,
    ) -> Self {
        let (magnets, spans) = (guideway.magnets(), guideway.spans().len());
        let metre = UnitOfMeasure::METRE;
        let all = Self {
            lateral_displacement: row(
                interface,
                "lateral_displacement",
                magnets,
                2,
                metre,
                "Rail at magnet {k}: lateral deflection, twist times height, and alignment; left positive",
            ),
            lateral_rate: row(
                interface,
                "lateral_rate",
                magnets,
                1,
                UnitOfMeasure::METRE_PER_SECOND,
                "Lateral rate of the rail as magnet {k}, moving along it, sees it; left positive",
            ),
            midspan_lateral: row(
                interface,
                "midspan_lateral",
                spans,
                2,
                metre,
                "Lateral deflection of the shear centre in the middle of span {k}, left positive",
            ),
            midspan_twist: row(
                interface,
                "midspan_twist",
                spans,
                2,
                UnitOfMeasure::RADIAN,
                "Twist in the middle of span {k}, positive if it lifts the left rail",
            ),
        };
        for at_magnet in [all.lateral_displacement, all.lateral_rate] {
            interface.depends_elementwise(at_magnet, inputs.position);
        }
        interface.depends(all.lateral_rate, &[inputs.speed]);
        interface.independent(all.midspan_lateral);
        interface.independent(all.midspan_twist);
        if let Some(lateral) = inputs.lateral
            && guideway.girders().iter().any(Girder::mixes)
        {
            interface.depends(outputs.midspan_acceleration, &[lateral]);
        }
        all
    }

    /// The rows that are motions of the middle of spans, with the component of each.
    pub(crate) fn of_spans(&self) -> [(RealVars, usize); 2] {
        [(self.midspan_lateral, 1), (self.midspan_twist, 2)]
    }

    /// Sets the outputs of span `k`.
    pub(crate) fn write_span(&self, k: usize, motion: &[SpanMotion; 3], values: &mut Values) {
        for (row, component) in self.of_spans() {
            values.set_real(row.get(k), motion[component].displacement);
        }
    }
}

impl JointOutputs {
    pub(crate) fn declare(interface: &mut Interface, guideway: &Guideway) -> Self {
        let joints = guideway.spans().len() + 1;
        let (metre, radian) = (UnitOfMeasure::METRE, UnitOfMeasure::RADIAN);
        let mut joint = |name: &str, unit, text: &str| {
            let text =
                format!("{text} at joint {{k}}, the first being the start of the first span");
            let all = row(interface, name, joints, 0, unit, &text);
            interface.independent(all);
            all
        };
        Self {
            kink: joint("joint_kink", radian, "Vertical kink of the track, upward positive,"),
            step: joint("joint_step", metre, "Vertical step of the track, upward positive,"),
            lateral: guideway.rails().map(|_| {
                [
                    joint(
                        "joint_lateral_kink",
                        radian,
                        "Lateral kink of the rails, left positive,",
                    ),
                    joint("joint_lateral_step", metre, "Lateral step of the rails, left positive,"),
                    joint("joint_twist_step", radian, "Step of the twist"),
                ]
            }),
        }
    }

    /// The outputs of joint `k` with their values.
    pub(crate) fn of(
        &self,
        k: usize,
        motion: &JointMotion,
    ) -> impl Iterator<Item = (RealVar, f64)> {
        let lateral = [motion.lateral_kink, motion.lateral_step, motion.twist_step];
        let own = [(self.kink, motion.kink), (self.step, motion.step)];
        let lateral =
            self.lateral.map(|rows| std::array::from_fn::<_, 3, _>(|i| (rows[i], lateral[i])));
        own.into_iter()
            .chain(lateral.into_iter().flatten())
            .map(move |(row, value)| (row.get(k), value))
    }
}

impl PartHandles {
    fn declare(
        interface: &mut Interface,
        girder: &Girder,
        part: GirderPart,
        computed: bool,
        imposed: &[f64],
        prefix: &str,
    ) -> Option<Self> {
        let range = girder.part(part);
        if range.is_empty() {
            return None;
        }
        let (name, count) = (part.prefix().trim_end(), range.len());
        let what = match part {
            GirderPart::Lateral => "lateral mode",
            _ => "torsional mode",
        };
        let starts: Vec<f64> = if computed {
            (0..count).map(|n| imposed.get(n).copied().unwrap_or(0.0)).collect()
        } else {
            girder.frequencies()[range.clone()].to_vec()
        };
        let zero = if computed { "; 0: as computed" } else { "" };
        let text = format!(
            "Natural frequency of {what} {{k}}, before stiffness_factor and mass_factor{zero}"
        );
        let frequency = interface
            .reals(format!("{prefix}{name}_frequency"), count)
            .parameter(0.0)
            .starts(starts)
            .min(0.0)
            .unit(UnitOfMeasure::HERTZ)
            .description(text)
            .done();
        let damping = interface
            .reals(format!("{prefix}{name}_damping"), count)
            .parameter(0.0)
            .starts(girder.structural_damping()[range].iter().copied())
            .min(0.0)
            .unit(UnitOfMeasure::ONE)
            .display("%")
            .description(format!("Damping ratio of {what} {{k}}, without dampers of supports"))
            .done();
        let natural = interface
            .reals(format!("{prefix}{name}_natural_frequency"), count)
            .calculated_parameter()
            .unit(UnitOfMeasure::HERTZ)
            .description(format!(
                "Natural frequency of {what} {{k}}, with supports and all factors"
            ))
            .done();
        Some(Self { frequency, damping, natural })
    }
}

impl RailParameters {
    pub(crate) fn declare(
        interface: &mut Interface,
        layout: &GuidewayDescription,
        guideway: &Guideway,
        prefixes: &[String],
    ) -> Result<Option<Self>, Error> {
        let Some(rails) = &layout.rails else { return Ok(None) };
        let mut length = |name: &str, start, text: &str| {
            let metre = UnitOfMeasure::METRE;
            interface.real(name).parameter(start).unit(metre).description(text).done()
        };
        let half_gauge = length(
            "half_gauge",
            rails.half_gauge,
            "Distance of each rail from the middle of the track",
        );
        let height =
            length("rail_height", rails.height, "Height of the rails over the shear centre");
        let irregular = interface
            .boolean("rail_irregularity_on")
            .parameter(rails.irregularity.on)
            .description("Irregularity of each rail, beside that of the track")
            .done();
        let seed = i32::try_from(rails.irregularity.seed).map_err(|error| {
            Error::invalid(format!("rails.irregularity.seed {}: {error}", rails.irregularity.seed))
        })?;
        let seed = interface
            .integer("rail_irregularity_seed")
            .parameter(seed)
            .min(0)
            .description("Seed of the random irregularity of the rails")
            .done();
        let kinds = layout.girders.values().zip(guideway.girders()).zip(prefixes);
        let kinds = kinds
            .map(|((given, girder), prefix)| {
                let computed = given.is_beam();
                let lateral = given.lateral.as_ref().map_or(&[][..], |l| &l.frequencies);
                let torsion = given.torsion.as_ref().map_or(&[][..], |t| &t.frequencies);
                [(GirderPart::Lateral, lateral), (GirderPart::Torsion, torsion)].map(
                    |(part, imposed)| {
                        PartHandles::declare(interface, girder, part, computed, imposed, prefix)
                    },
                )
            })
            .collect();
        Ok(Some(Self { half_gauge, height, irregular, seed, kinds }))
    }

    /// What the irregularity at a magnet depends on beside that of the track.
    pub(crate) fn of_irregularity(&self) -> [VariableRow; 2] {
        [self.irregular.row(), self.seed.row()]
    }

    /// Puts the parameters' values into the description.
    pub(crate) fn apply(&self, d: &mut GuidewayDescription, values: &Values) -> Result<(), Error> {
        if let Some(rails) = &mut d.rails {
            rails.half_gauge = values.real(self.half_gauge);
            rails.height = values.real(self.height);
            rails.irregularity.on = values.boolean(self.irregular);
            rails.irregularity.seed =
                u64::try_from(values.integer(self.seed)).map_err(Error::invalid)?;
        }
        for (girder, [lateral, torsion]) in d.girders.values_mut().zip(&self.kinds) {
            if let (Some(given), Some(own)) = (&mut girder.lateral, lateral) {
                given.modes = Some(own.frequency.len());
                given.frequencies = values.reals(own.frequency).to_vec();
                given.damping = values.reals(own.damping).to_vec();
            }
            if let (Some(given), Some(own)) = (&mut girder.torsion, torsion) {
                given.modes = Some(own.frequency.len());
                given.frequencies = values.reals(own.frequency).to_vec();
                given.damping = values.reals(own.damping).to_vec();
            }
        }
        Ok(())
    }

    /// Writes the natural frequencies.
    pub(crate) fn write(&self, guideway: &Guideway, values: &mut Values) {
        for (girder, kind) in guideway.girders().iter().zip(&self.kinds) {
            for (part, own) in [GirderPart::Lateral, GirderPart::Torsion].into_iter().zip(kind) {
                let Some(own) = own else { continue };
                let modes = &girder.modes()[girder.part(part)];
                for (value, mode) in values.reals_mut(own.natural).iter_mut().zip(modes) {
                    *value = mode.frequency();
                }
            }
        }
    }
}
