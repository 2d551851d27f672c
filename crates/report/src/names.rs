//! All names of variables that the report knows.
//!
//! Signals with other names are drawn, but not recognised as gaps or deflections. The test below compares the
//! names with the descriptions of the units.

/// Output of the vehicle.
pub(crate) const SPEED: &str = "speed";
/// Outputs of the vehicle, one per magnet.
pub(crate) const GAP: &str = "gap";
pub(crate) const POSITION: &str = "position";
pub(crate) const LATERAL_OFFSET: &str = "lateral_offset";
/// Outputs of the vehicle for each observed body, after its name.
pub(crate) const VERTICAL_DISPLACEMENT: &str = "vertical_displacement";
pub(crate) const LATERAL_DISPLACEMENT: &str = "lateral_displacement";
pub(crate) const ROLL: &str = "roll";
pub(crate) const PITCH: &str = "pitch";
pub(crate) const YAW: &str = "yaw";
/// Input of the vehicle.
pub(crate) const SPEED_CHANGE: &str = "speed_change";
/// Parameters of the vehicle.
pub(crate) const INITIAL_POSITION: &str = "initial_position";
pub(crate) const TRAVEL_SPEED: &str = "travel_speed";

/// Outputs of the guideway, one per span.
pub(crate) const MIDSPAN: &str = "midspan_displacement";
pub(crate) const QUARTER: &str = "quarter_displacement";
pub(crate) const MIDSPAN_LATERAL: &str = "midspan_lateral";
pub(crate) const MIDSPAN_TWIST: &str = "midspan_twist";
/// Output of the guideway, one per magnet.
pub(crate) const IRREGULARITY: &str = "irregularity";
/// Parameters of the guideway.
pub(crate) const MODES: &str = "modes";
pub(crate) const POLE_LENGTH: &str = "pole_length";
pub(crate) const STIFFNESS_FACTOR: &str = "stiffness_factor";
pub(crate) const MASS_FACTOR: &str = "mass_factor";
pub(crate) const CHIRP_ON: &str = "chirp_on";
pub(crate) const CHIRP_START: &str = "chirp_start";
pub(crate) const CHIRP_END_FREQUENCY: &str = "chirp_end_frequency";
pub(crate) const IRREGULARITY_ON: &str = "irregularity_on";
pub(crate) const IRREGULARITY_AVERAGED: &str = "irregularity_averaged";
pub(crate) const IRREGULARITY_FILE: &str = "irregularity_file";
pub(crate) const IRREGULARITY_AMPLITUDE: &str = "irregularity_amplitude";
pub(crate) const IRREGULARITY_SHORTEST_WAVE: &str = "irregularity_shortest_wave";
pub(crate) const IRREGULARITY_LONGEST_WAVE: &str = "irregularity_longest_wave";
/// Parameters of the guideway, one per mode.
pub(crate) const FREQUENCY: &str = "frequency";
pub(crate) const DAMPING: &str = "damping";

/// Layout files of vehicles, their lines, and guideways, in the resources of an FMU.
pub(crate) const VEHICLE_FILE: &str = "vehicle.json";
pub(crate) const LINE_FILE: &str = "line.json";
pub(crate) const GUIDEWAY_FILE: &str = "guideway.json";

/// Variable `k` of a row of `size`, such as `gap_01` to `gap_64`: with the digits of the last one, at least 2.
pub(crate) fn numbered(row: &str, k: usize, size: usize) -> String {
    let digits = size.to_string().len().max(2);
    format!("{row}_{k:0digits$}")
}

/// The row that a numbered variable belongs to.
pub(crate) fn row(variable: &str) -> Option<&str> {
    let stem = variable.trim_end_matches(|letter: char| letter.is_ascii_digit());
    if stem.len() == variable.len() { None } else { stem.strip_suffix('_') }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use fmi2_import::description::{Causality, ModelDescription, Variable};

    use super::*;

    /// The variables in a unit's committed description. Another test compares it with the unit.
    fn variables(unit: &str) -> Vec<Variable> {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../modelDescription");
        let text = std::fs::read_to_string(folder.join(format!("{unit}.xml"))).unwrap();
        ModelDescription::parse(&text).unwrap().variables
    }

    fn assert_known(unit: &str, causality: Causality, names: &[String]) {
        let variables = variables(unit);
        for name in names {
            let there = variables.iter().any(|it| it.name == *name && it.causality == causality);
            assert!(there, "{unit} has no {causality:?} {name}, which the report needs");
        }
    }

    fn of_row(rows: &[&str], count: usize) -> Vec<String> {
        rows.iter().flat_map(|row| (1..=count).map(|k| numbered(row, k, count))).collect()
    }

    fn owned(names: &[&str]) -> Vec<String> {
        names.iter().map(|&name| name.to_owned()).collect()
    }

    /// If a name changed here or in a unit, key figures or parts of the 3D view would be missing.
    #[test]
    fn issue_signal_names_are_those_of_the_units() {
        assert_known("vehicle", Causality::Output, &of_row(&[GAP, POSITION, LATERAL_OFFSET], 64));
        let observed = [VERTICAL_DISPLACEMENT, LATERAL_DISPLACEMENT, ROLL, PITCH, YAW];
        let of_cars = ["car_1", "car_2"];
        let of_cars = of_cars.iter().flat_map(|car| observed.map(|what| format!("{car}_{what}")));
        assert_known("vehicle", Causality::Output, &of_cars.collect::<Vec<_>>());
        assert_known("vehicle", Causality::Output, &owned(&[SPEED]));
        assert_known("vehicle", Causality::Input, &owned(&[SPEED_CHANGE]));
        assert_known("vehicle", Causality::Parameter, &owned(&[INITIAL_POSITION, TRAVEL_SPEED]));
        assert_known("guideway", Causality::Output, &of_row(&[MIDSPAN, QUARTER], 3));
        assert_known("guideway", Causality::Output, &of_row(&[IRREGULARITY], 64));
        let parameters = [
            MODES,
            POLE_LENGTH,
            STIFFNESS_FACTOR,
            MASS_FACTOR,
            CHIRP_ON,
            CHIRP_START,
            CHIRP_END_FREQUENCY,
            IRREGULARITY_ON,
            IRREGULARITY_AVERAGED,
            IRREGULARITY_FILE,
            IRREGULARITY_AMPLITUDE,
            IRREGULARITY_SHORTEST_WAVE,
            IRREGULARITY_LONGEST_WAVE,
        ];
        assert_known("guideway", Causality::Parameter, &owned(&parameters));
        assert_known("guideway", Causality::Parameter, &of_row(&[FREQUENCY, DAMPING], 2));
    }

    /// The test above notices a wrong name.
    #[test]
    #[should_panic(expected = "guideway has no Output middle_displacement_01")]
    fn issue_a_signal_name_that_no_unit_has_is_found() {
        assert_known("guideway", Causality::Output, &of_row(&["middle_displacement"], 1));
    }

    #[test]
    fn analytic_numbers_and_rows() {
        assert_eq!(numbered("gap", 7, 8), "gap_07");
        assert_eq!(numbered("gap", 7, 160), "gap_007");
        assert_eq!(
            (row("gap_07"), row("gap_rate_7"), row("gap"), row("7")),
            (Some("gap"), Some("gap_rate"), None, None)
        );
    }
}
