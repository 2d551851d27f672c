//! The unit's parameters: the numbers of the layout that studies vary.

use fmi2_export::{
    BooleanVar, Error, IntegerVar, Interface, RealVar, StringVar, UnitOfMeasure, Values,
    VariableRow,
};
use guideway::description::{GuidewayDescription, InitialDeflection};
use guideway::{Guideway, MAX_FORCES, RUN_OUT};

use crate::kinds::{KindHandles, factor};
use crate::rails::RailParameters;
use crate::table::OutputHandles;

/// Handles of the parameters. Their start values are those of the layout.
#[derive(Debug, Clone)]
pub(crate) struct ParameterHandles {
    modes: IntegerVar,
    /// Of each kind of span.
    kinds: Vec<KindHandles>,
    stiffness_factor: RealVar,
    mass_factor: RealVar,
    pole_length: RealVar,
    forces_per_magnet: IntegerVar,
    initial_state: IntegerVar,
    position_from_speed: BooleanVar,
    irregularity: IrregularityHandles,
    chirp: ChirpHandles,
    /// Declared last.
    rails: Option<RailParameters>,
}

#[derive(Debug, Clone, Copy)]
struct IrregularityHandles {
    on: BooleanVar,
    averaged: BooleanVar,
    file: StringVar,
    seed: IntegerVar,
    amplitude: RealVar,
    shortest_wave: RealVar,
    longest_wave: RealVar,
    start: RealVar,
    end: RealVar,
    fade_length: RealVar,
}

#[derive(Debug, Clone, Copy)]
struct ChirpHandles {
    on: BooleanVar,
    amplitude: RealVar,
    position: RealVar,
    start: RealVar,
    end_frequency: RealVar,
}

/// The unit of A in S(Ω) = A/Ω²: m²/(rad/m) times (rad/m)².
const AMPLITUDE: UnitOfMeasure = UnitOfMeasure::new("m.rad").m(1).rad(1);

impl ParameterHandles {
    pub(crate) fn declare(
        interface: &mut Interface,
        layout: &GuidewayDescription,
        guideway: &Guideway,
        prefixes: &[String],
    ) -> Result<Self, Error> {
        let most = guideway.girders().iter().map(|g| g.vertical_modes().len()).max().unwrap_or(1);
        let most = i32::try_from(most).map_err(Error::invalid)?;
        let modes = interface
            .integer("modes")
            .parameter(most)
            .min(1)
            .max(most)
            .description("Number of modes per span, the lowest ones")
            .done();
        let kinds = layout
            .girders
            .values()
            .zip(guideway.girders())
            .zip(prefixes)
            .map(|((given, girder), prefix)| KindHandles::declare(interface, given, girder, prefix))
            .collect();
        Ok(Self {
            modes,
            kinds,
            stiffness_factor: factor(
                interface,
                "stiffness_factor".to_owned(),
                layout.stiffness_factor,
                "Factor on the stiffness of all spans; frequencies change by its root",
            ),
            mass_factor: factor(
                interface,
                "mass_factor".to_owned(),
                layout.mass_factor,
                "Factor on the mass of all spans; frequencies change by its inverse root",
            ),
            pole_length: length(
                interface,
                "pole_length",
                layout.pole.length,
                "Pole length over which a magnet's force is spread",
            ),
            forces_per_magnet: interface
                .integer("forces_per_magnet")
                .parameter(i32::try_from(layout.pole.forces).map_err(Error::invalid)?)
                .min(1)
                .max(MAX_FORCES as i32)
                .description("Discrete forces per magnet, at Gauss points of the pole length")
                .done(),
            initial_state: interface
                .integer("initial_state")
                .parameter(initial_to_number(layout.initial))
                .min(0)
                .max(2)
                .description(
                    "0 undeformed; 1 static deflection at rest; 2 static deflection with the rate \
                     of rolling loads",
                )
                .done(),
            position_from_speed: interface
                .boolean("position_from_speed")
                .parameter(true)
                .description(
                    "Magnets whose position comes without derivatives move with the input speed \
                     within a step",
                )
                .done(),
            irregularity: IrregularityHandles::declare(interface, layout, guideway)?,
            chirp: ChirpHandles::declare(interface, layout, guideway),
            rails: None,
        })
    }

    /// Declares those of a layout with rails; `outputs` depend on them.
    pub(crate) fn declare_rails(
        &mut self,
        interface: &mut Interface,
        layout: &GuidewayDescription,
        guideway: &Guideway,
        prefixes: &[String],
        outputs: &OutputHandles,
    ) -> Result<(), Error> {
        self.rails = RailParameters::declare(interface, layout, guideway, prefixes)?;
        if let Some(rails) = &self.rails {
            interface.initially_depends(outputs.irregularity, &rails.of_irregularity());
        }
        Ok(())
    }

    /// Writes what a guideway with rails computes from its parameters.
    pub(crate) fn write_rails(&self, guideway: &Guideway, values: &mut Values) {
        if let Some(rails) = &self.rails {
            rails.write(guideway, values);
        }
    }

    /// Parameters that the modal masses of the kind `k` of span depend on.
    pub(crate) fn of_modal_mass(&self, k: usize) -> Vec<VariableRow> {
        let mut rows = vec![self.mass_factor.row(), self.modes.row()];
        rows.extend(self.kinds[k].of_modal_mass());
        rows
    }

    /// Where the chirp force acts (m), whether it is on or not.
    pub(crate) fn chirp_position(&self, values: &Values) -> f64 {
        values.real(self.chirp.position)
    }

    /// Declares the chirp force as an output.
    pub(crate) fn declare_chirp_force(&self, interface: &mut Interface) -> RealVar {
        let force = interface
            .real("chirp_force")
            .output()
            .unit(UnitOfMeasure::NEWTON)
            .nominal(1e4)
            .description("Chirp force now, down positive; 0 while it is off")
            .done();
        interface.independent(force);
        interface.initially_depends(force, &self.chirp.of_force());
        force
    }

    pub(crate) fn position_from_speed(&self, values: &Values) -> bool {
        values.boolean(self.position_from_speed)
    }

    /// Parameters that the irregularity at a position depends on.
    pub(crate) fn of_irregularity(&self) -> Vec<VariableRow> {
        let i = &self.irregularity;
        vec![
            self.pole_length.row(),
            i.on.row(),
            i.averaged.row(),
            i.file.row(),
            i.seed.row(),
            i.amplitude.row(),
            i.shortest_wave.row(),
            i.longest_wave.row(),
            i.start.row(),
            i.end.row(),
            i.fade_length.row(),
        ]
    }

    /// The layout with the parameters' values in it.
    pub(crate) fn apply(
        &self,
        layout: &GuidewayDescription,
        values: &Values,
    ) -> Result<GuidewayDescription, Error> {
        let mut d = layout.clone();
        let modes = usize::try_from(values.integer(self.modes)).map_err(Error::invalid)?;
        for (girder, kind) in d.girders.values_mut().zip(&self.kinds) {
            kind.apply(girder, modes, values);
        }
        d.stiffness_factor = values.real(self.stiffness_factor);
        d.mass_factor = values.real(self.mass_factor);
        d.pole.length = values.real(self.pole_length);
        d.pole.forces =
            usize::try_from(values.integer(self.forces_per_magnet)).map_err(Error::invalid)?;
        d.initial = match values.integer(self.initial_state) {
            0 => InitialDeflection::Undeformed,
            1 => InitialDeflection::Static,
            2 => InitialDeflection::QuasiStatic,
            n => return Err(Error::invalid(format!("initial_state {n}: give 0, 1 or 2"))),
        };
        self.irregularity.apply(&mut d, values)?;
        self.chirp.apply(&mut d, values);
        if let Some(rails) = &self.rails {
            rails.apply(&mut d, values)?;
        }
        Ok(d)
    }
}

fn initial_to_number(initial: InitialDeflection) -> i32 {
    match initial {
        InitialDeflection::Undeformed => 0,
        InitialDeflection::Static => 1,
        InitialDeflection::QuasiStatic => 2,
    }
}

fn length(interface: &mut Interface, name: &str, start: f64, text: &str) -> RealVar {
    interface.real(name).parameter(start).unit(UnitOfMeasure::METRE).description(text).done()
}

impl IrregularityHandles {
    fn declare(
        interface: &mut Interface,
        layout: &GuidewayDescription,
        guideway: &Guideway,
    ) -> Result<Self, Error> {
        let given = &layout.irregularity;
        let track = guideway.track();
        let seed = i32::try_from(given.seed).map_err(|error| {
            Error::invalid(format!("irregularity.seed {}: {error}", given.seed))
        })?;
        Ok(Self {
            on: interface
                .boolean("irregularity_on")
                .parameter(given.on)
                .description("Irregularity of the track surface")
                .done(),
            averaged: interface
                .boolean("irregularity_averaged")
                .parameter(given.averaged)
                .description(
                    "Each magnet feels the mean over its pole, as of the deflection; false: the \
                     value at its centre",
                )
                .done(),
            file: interface
                .string("irregularity_file")
                .parameter(given.file.clone().unwrap_or_default())
                .description(
                    "CSV file with two columns x, z in m, absolute or in the unit's resources; \
                     empty: random profile",
                )
                .done(),
            seed: interface
                .integer("irregularity_seed")
                .parameter(seed)
                .min(0)
                .description("Seed of the random profile")
                .done(),
            amplitude: interface
                .real("irregularity_amplitude")
                .parameter(given.amplitude)
                .min(0.0)
                .unit(AMPLITUDE)
                .description(
                    "A of the one-sided PSD A/W^2 in m2/(rad/m), W the wavenumber in rad/m",
                )
                .done(),
            shortest_wave: length(
                interface,
                "irregularity_shortest_wave",
                given.shortest_wave,
                "Shortest wavelength",
            ),
            longest_wave: length(
                interface,
                "irregularity_longest_wave",
                given.longest_wave,
                "Longest wavelength",
            ),
            start: length(
                interface,
                "irregularity_start",
                given.start.unwrap_or(track.0),
                "Where the irregularity begins to fade in",
            ),
            end: length(
                interface,
                "irregularity_end",
                given.end.unwrap_or(track.1 + RUN_OUT),
                "Where the irregularity has faded out",
            ),
            fade_length: length(
                interface,
                "irregularity_fade_length",
                given.fade_length,
                "Length of fade-in and fade-out",
            ),
        })
    }

    fn apply(&self, d: &mut GuidewayDescription, values: &Values) -> Result<(), Error> {
        let file = values.string(self.file);
        let i = &mut d.irregularity;
        i.on = values.boolean(self.on);
        i.averaged = values.boolean(self.averaged);
        i.file = (!file.is_empty()).then(|| file.to_owned());
        i.seed = u64::try_from(values.integer(self.seed)).map_err(Error::invalid)?;
        i.amplitude = values.real(self.amplitude);
        i.shortest_wave = values.real(self.shortest_wave);
        i.longest_wave = values.real(self.longest_wave);
        i.start = Some(values.real(self.start));
        i.end = Some(values.real(self.end));
        i.fade_length = values.real(self.fade_length);
        Ok(())
    }
}

impl ChirpHandles {
    fn declare(
        interface: &mut Interface,
        layout: &GuidewayDescription,
        guideway: &Guideway,
    ) -> Self {
        let given = &layout.chirp;
        Self {
            on: interface
                .boolean("chirp_on")
                .parameter(given.on)
                .description("Chirp force A sin(pi (t - t0)^2)")
                .done(),
            amplitude: interface
                .real("chirp_amplitude")
                .parameter(given.amplitude)
                .unit(UnitOfMeasure::NEWTON)
                .description("Amplitude of the chirp force, down positive")
                .done(),
            position: length(
                interface,
                "chirp_position",
                given.position.unwrap_or(guideway.middle()),
                "Where the chirp force acts",
            ),
            start: interface
                .real("chirp_start")
                .parameter(given.start)
                .unit(UnitOfMeasure::SECOND)
                .description("Start t0 of the chirp")
                .done(),
            end_frequency: interface
                .real("chirp_end_frequency")
                .parameter(given.end_frequency)
                .min(0.0)
                .unit(UnitOfMeasure::HERTZ)
                .description("Frequency at which the chirp ends, at the last zero before")
                .done(),
        }
    }

    /// What the force depends on, apart from time.
    fn of_force(&self) -> [VariableRow; 4] {
        [self.on.row(), self.amplitude.row(), self.start.row(), self.end_frequency.row()]
    }

    fn apply(&self, d: &mut GuidewayDescription, values: &Values) {
        d.chirp.on = values.boolean(self.on);
        d.chirp.amplitude = values.real(self.amplitude);
        d.chirp.position = Some(values.real(self.position));
        d.chirp.start = values.real(self.start);
        d.chirp.end_frequency = values.real(self.end_frequency);
    }
}
