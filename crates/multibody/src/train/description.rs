//! A train in a few numbers, as the key `train` of a vehicle file gives it.

#[cfg(feature = "schema")]
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A train of equal cars. Every key may be left out; its default is the paper's train, or a plausible
/// value of our own where the paper gives none.
///
/// Places along a car are counted from its centre, forward; across from its middle; heights from the
/// magnets' side frames, whose centres of mass are at z = 0.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct TrainDescription {
    /// Number of cars, 1 to 100. Default: 2.
    #[cfg_attr(feature = "schema", schemars(range(min = 1, max = 100)))]
    pub cars: usize,
    /// Number of bogies under each car, 1 to 20. Default: 4. Each also has an equipment box above it.
    #[cfg_attr(feature = "schema", schemars(range(min = 1, max = 20)))]
    pub bogies_per_car: usize,
    /// Number of magnets on each side of a bogie, 1 to 20. Default: 4.
    #[cfg_attr(feature = "schema", schemars(range(min = 1, max = 20)))]
    pub magnets_per_side: usize,
    /// Number of air springs at each of the four corners of a bogie, 1 to 8. Default: 1.
    #[cfg_attr(feature = "schema", schemars(range(min = 1, max = 8)))]
    pub air_springs_per_corner: usize,
    /// Acceleration of gravity, downward (m/s²). Default: 9.81.
    #[cfg_attr(feature = "schema", schemars(range(min = 0.0)))]
    pub gravity: f64,
    /// Nominal air gap c0 (m). Units of magnets have their own, to be set to the same. Default: 0.008.
    #[cfg_attr(feature = "schema", schemars(extend("exclusiveMinimum" = 0)))]
    pub nominal_gap: f64,
    /// Lengths, pitches and heights. Default: those of each key.
    pub dimensions: TrainDimensions,
    /// Masses of the bodies. Default: those of each key.
    pub masses: TrainMasses,
    /// Air springs between the side frames and the sliding tables. Default: those of each key.
    pub air_spring: AirSpring,
    /// Traction rods, beside the air springs. Default: those of each key.
    pub traction_rod: TractionRod,
    /// Bushes at both ends of the anti-roll beams, which tie the two side frames of a bogie.
    /// Default: those of each key.
    pub anti_roll_end: AntiRollEnd,
    /// Springs and dampers that centre the sliding tables, which move sideways. Default: those of each key.
    pub table_centring: TableCentring,
    /// Springs and dampers in the hinges of the couplers. Default: those of each key.
    pub coupler_hinge: CouplerHinge,
    /// Spring and damper that hold each car at its nominal place along the track. Default: those of
    /// each key.
    pub drive: TrainDrive,
    /// Lets the car bodies bend and twist. Default: rigid.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub flexible_body: Option<FlexibleBody>,
}

impl Default for TrainDescription {
    fn default() -> Self {
        Self {
            cars: 2,
            bogies_per_car: 4,
            magnets_per_side: 4,
            air_springs_per_corner: 1,
            gravity: 9.81,
            nominal_gap: 0.008,
            dimensions: TrainDimensions::default(),
            masses: TrainMasses::default(),
            air_spring: AirSpring::default(),
            traction_rod: TractionRod::default(),
            anti_roll_end: AntiRollEnd::default(),
            table_centring: TableCentring::default(),
            coupler_hinge: CouplerHinge::default(),
            drive: TrainDrive::default(),
            flexible_body: None,
        }
    }
}

/// Lengths of a train, all in m.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct TrainDimensions {
    /// Length of a car body (m). Default: number of bogies times their pitch, 12.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub car_length: Option<f64>,
    /// Distance between the bodies of neighbouring cars (m). Default: 0.3.
    pub car_gap: f64,
    /// Width of a car body, for its moments of inertia (m). Default: 2.7.
    pub car_width: f64,
    /// Height of a car body from its underside to its roof, for its moments of inertia (m). Default: 2.6.
    pub car_height: f64,
    /// Height of a car body's centre of mass (m). Default: 1.6.
    pub car_centre_height: f64,
    /// Height of the cabin floor, where ride comfort is measured (m). Default: 1.0.
    pub floor_height: f64,
    /// Distance between the centres of neighbouring bogies (m). Default: 3.0.
    pub bogie_pitch: f64,
    /// Distance of magnets, side frames, tables and air springs from the middle (m). Default: 0.95.
    pub half_gauge: f64,
    /// Length of a side frame, for its moments of inertia (m). Default: 2.8.
    pub side_frame_length: f64,
    /// Distance between neighbouring magnets of a side frame (m). Default: 0.7.
    pub magnet_pitch: f64,
    /// Height of the magnets' points of force (m). Default: -0.2.
    pub magnet_height: f64,
    /// Distance of a corner's air springs and traction rod from the bogie's centre, along the track (m).
    /// Default: half the bogies' pitch less 0.2, 1.3.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub air_spring_offset: Option<f64>,
    /// Distance along the track between the air springs of one corner, if there are several (m). Default: 0.2.
    pub air_spring_pitch: f64,
    /// Height of the sliding tables (m). Default: 0.55.
    pub table_height: f64,
    /// Distance of the anti-roll beams from the bogie's centre, along the track (m). Default: 1.1.
    pub beam_offset: f64,
}

impl Default for TrainDimensions {
    fn default() -> Self {
        Self {
            car_length: None,
            car_gap: 0.3,
            car_width: 2.7,
            car_height: 2.6,
            car_centre_height: 1.6,
            floor_height: 1.0,
            bogie_pitch: 3.0,
            half_gauge: 0.95,
            side_frame_length: 2.8,
            magnet_pitch: 0.7,
            magnet_height: -0.2,
            air_spring_offset: None,
            air_spring_pitch: 0.2,
            table_height: 0.55,
            beam_offset: 1.1,
        }
    }
}

/// A struct of numbers with their defaults.
macro_rules! elements {
    ($($(#[$doc:meta])* $name:ident { $($(#[$key:meta])* $field:ident: $default:literal,)* })*) => {$(
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
        #[serde(default, deny_unknown_fields)]
        pub struct $name {
            $($(#[$key])* #[cfg_attr(feature = "schema", schemars(range(min = 0.0)))] pub $field: f64,)*
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $($field: $default,)* }
            }
        }

        impl $name {
            /// The keys with their numbers.
            pub(super) fn numbers(&self) -> Vec<(&'static str, f64)> {
                vec![$((stringify!($field), self.$field),)*]
            }
        }
    )*};
}

elements! {
    /// Air spring (table 1). Its load is not given: it follows from the car's weight.
    AirSpring {
        /// Longitudinal stiffness (N/m). Default: 140000.
        longitudinal_stiffness: 140e3,
        /// Lateral stiffness (N/m). Default: 140000.
        lateral_stiffness: 140e3,
        /// Vertical stiffness (N/m). Default: 62000.
        vertical_stiffness: 62e3,
        /// Longitudinal damping (N·s/m). Default: 1300.
        longitudinal_damping: 1300.0,
        /// Lateral damping (N·s/m). Default: 1300.
        lateral_damping: 1300.0,
        /// Vertical damping (N·s/m). Default: 1600.
        vertical_damping: 1600.0,
    }
    /// Traction rod: a bush that acts along the track only.
    TractionRod {
        /// Longitudinal stiffness (N/m). Default: 400000.
        longitudinal_stiffness: 4e5,
        /// Longitudinal damping (N·s/m). Default: 4000.
        longitudinal_damping: 4e3,
    }
    /// Bush at an end of an anti-roll beam, against rotation about all three axes.
    AntiRollEnd {
        /// Stiffness against rotation (N·m/rad). Default: 20000.
        rotational_stiffness: 2e4,
        /// Damping of rotation (N·m·s/rad). Default: 60.
        rotational_damping: 60.0,
    }
    /// Spring and damper that centre a sliding table.
    TableCentring {
        /// Stiffness (N/m). Default: 50000.
        stiffness: 5e4,
        /// Damping (N·s/m). Default: 2000.
        damping: 2e3,
    }
    /// Spring and damper in one hinge of a coupler.
    CouplerHinge {
        /// Stiffness (N·m/rad). Default: 5000.
        stiffness: 5e3,
        /// Damping (N·m·s/rad). Default: 100.
        damping: 100.0,
    }
    /// Spring and damper that hold a car at its nominal place along the track.
    TrainDrive {
        /// Stiffness (N/m). Default: 100000.
        stiffness: 1e5,
        /// Damping (N·s/m). Default: 20000.
        damping: 2e4,
    }
    /// Masses of a train's bodies, all in kg (table 1).
    TrainMasses {
        /// Car body without equipment and tables (kg). Default: 7700.
        car_body: 7700.0,
        /// One equipment box, of which each car has as many as bogies (kg). Default: 600.
        equipment: 600.0,
        /// One sliding table (kg). Default: 70.
        table: 70.0,
        /// One side frame with its magnets (kg). Default: 600.
        side_frame: 600.0,
        /// One linear induction motor, of which each side frame has one (kg). Default: 300.
        motor: 300.0,
        /// One anti-roll beam, of which each bogie has four (kg). Default: 50.
        beam: 50.0,
        /// One link of a coupler, of which there are ten between two cars (kg). Default: 40.
        coupler_link: 40.0,
    }
}

/// The first natural modes of a car body alone and free, without equipment and tables.
///
/// The body becomes a chain of rigid segments with elastic joints between them, whose stiffness follows from
/// these frequencies. Only the first bending and the first torsion mode have data behind them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct FlexibleBody {
    /// Frequency of the first vertical bending mode (Hz).
    #[cfg_attr(feature = "schema", schemars(extend("exclusiveMinimum" = 0)))]
    pub bending_frequency: f64,
    /// Frequency of the first lateral bending mode (Hz). Default: as the vertical one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "schema", schemars(extend("exclusiveMinimum" = 0)))]
    pub lateral_bending_frequency: Option<f64>,
    /// Frequency of the first torsion mode (Hz).
    #[cfg_attr(feature = "schema", schemars(extend("exclusiveMinimum" = 0)))]
    pub torsion_frequency: f64,
    /// Damping ratio of each of these modes (0 to 1). Default: 0.02.
    #[serde(default = "FlexibleBody::default_damping")]
    #[cfg_attr(feature = "schema", schemars(range(min = 0.0, max = 1.0)))]
    pub damping: f64,
    /// Number of elastic joints, an even number from 2 to 20, so that one segment is the middle. Default: 4. The
    /// car body is cut at the joints, which are at the middles of this many equal lengths.
    #[serde(default = "FlexibleBody::default_segments")]
    #[cfg_attr(feature = "schema", schemars(range(min = 2, max = 20), extend("multipleOf" = 2)))]
    pub segments: usize,
}

impl FlexibleBody {
    fn default_damping() -> f64 {
        0.02
    }

    fn default_segments() -> usize {
        4
    }
}
