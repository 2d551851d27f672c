//! The list of readings.

use super::catalogue::{Girder, MASS, Magnet, Reading, Track, mass_of};

/// As shipped.
const SHIPPED: Reading = Reading {
    name: "as shipped",
    argument: "Table 2's 24 A in the coefficients of eqs 1 and 2; table 3's 22,000 as a weight in N/m³; the force at \
               mid-span, the place of section 3.1; figure 12's deflection at mid-span, as section 3.3 says.",
    magnet: Magnet::Linear(24.0),
    girder: Girder::Mass(MASS),
    force: 37.5,
    train: 37.5,
    at_bogies: false,
    moving_girders: false,
    track: Track::Shipped,
    in_text: true,
};

/// All readings; the first one is the shipped one.
pub fn readings() -> Vec<Reading> {
    vec![
        SHIPPED,
        Reading {
            name: "14.353 A",
            argument: "Section 2.2 calls F_0 of eq. 1 the static force at the operating point: this current gives the load \
                   of 64 magnets, 5.8 kN. Against it: table 2.",
            magnet: Magnet::Linear(14.353),
            ..SHIPPED
        },
        Reading {
            name: "16 A",
            argument: "Between the currents that the text supports. It carries 47.2 t on 64 magnets, the train with \
                   9 t of passengers.",
            magnet: Magnet::Linear(16.0),
            ..SHIPPED
        },
        Reading {
            name: "20.3 A",
            argument: "The current at which 32 magnets of table 2 carry the 38 t of table 1, or 64 magnets 76 t. Against it: table 2, \
                   and eight magnets per bogie in section 2.1.",
            magnet: Magnet::Linear(20.298),
            ..SHIPPED
        },
        Reading {
            name: "28 A",
            argument: "Nothing in the text. It would carry 145 t on 64 magnets, or the 38 t of table 1 on 17.",
            magnet: Magnet::Linear(28.0),
            in_text: false,
            ..SHIPPED
        },
        Reading {
            name: "32 A",
            argument: "Nothing in the text. It would carry 189 t on 64 magnets, or the 38 t of table 1 on 13.",
            magnet: Magnet::Linear(32.0),
            in_text: false,
            ..SHIPPED
        },
        Reading {
            name: "nonlinear law",
            argument: "Section 2.2: a precise analysis would need it. Against it: the same sentence goes on to the linear law, \
                   and eqs 1 and 2 are linear.",
            magnet: Magnet::Nonlinear,
            ..SHIPPED
        },
        Reading {
            name: "32 magnets",
            argument: "Table 2 for a pair of neighbouring magnets with one controller, so that each of the 64 has half the force. \
                   Against it: eight magnets per bogie in section 2.1, each with feedback.",
            magnet: Magnet::Half(24.0),
            ..SHIPPED
        },
        Reading {
            name: "gains in units",
            argument: "Eq. 3 takes acceleration, velocity, position and gap, which eq. 4 estimates 0.25, 2.5 and 250 times \
                   as large: the gains of table 2 might belong to the quantities themselves, in SI units. \
                   Against it: the static stiffness is then negative, and every run ends at once.",
            magnet: Magnet::GainsInUnits,
            ..SHIPPED
        },
        Reading {
            name: "2,336 kg/m",
            argument: "The mass with which table 3's E, I = 0.64673 m⁴ and L give its 7.1 Hz. Against it: 22,000 is then not \
                   used at all.",
            girder: Girder::Mass(mass_of(0.64673)),
            ..SHIPPED
        },
        Reading {
            name: "3,746 kg/m",
            argument: "The same with table 3's other inertia, 1.037 m⁴, which stands without a name.",
            girder: Girder::Mass(mass_of(1.037)),
            ..SHIPPED
        },
        Reading {
            name: "one elastic bearing",
            argument: "Table 3's f2/f1 is 3.507, and figure 4 is a finite element model's: a beam on rigid bearings has 4. One \
                   bearing of 4.12·10⁸ N/m and 1.28 times table 3's E·I give both frequencies.",
            girder: Girder::OneBearing,
            ..SHIPPED
        },
        Reading {
            name: "two elastic bearings",
            argument: "As before, with two equal bearings of 7.00·10⁸ N/m and 1.30 times E·I.",
            girder: Girder::TwoBearings,
            ..SHIPPED
        },
        Reading {
            name: "force 1.5 m off mid-span",
            argument: "The force beside the middle, where a shaker finds room: the second mode has its node in the middle, and \
                   figure 12 shows it. Against it: section 3.1 names mid-span.",
            force: 36.0,
            ..SHIPPED
        },
        Reading {
            name: "force at a quarter",
            argument: "The same at a quarter of the span, where the second mode is largest.",
            force: 31.25,
            ..SHIPPED
        },
        Reading {
            name: "train off mid-span",
            argument: "The text does not say where the train stands: here the middle of the rear car is over mid-span.",
            train: 43.65,
            ..SHIPPED
        },
        Reading {
            name: "deflection at the bogies",
            argument: "Section 3.3 says of figure 12 that it shows the deflection \"of each bogie\": the girder under each bogie.",
            at_bogies: true,
            ..SHIPPED
        },
        Reading {
            name: "figure 14 moving",
            argument: "Section 3.3 does not say what excites the girders of figure 14. In the crossing the gaps are those of the \
                   irregularity, and differ by less than 1 %.",
            moving_girders: true,
            ..SHIPPED
        },
        Reading {
            name: "waves to 5 cm, mean",
            argument: "Figure 16 shows frequencies up to the second mode's, and at 5 km/h 25 Hz is a wave of 5.6 cm. \
                   Figure 6 has no scale of wavelengths in the text.",
            track: Track::ShortWaves,
            ..SHIPPED
        },
        Reading {
            name: "waves to 5 cm, at centres",
            argument: "The same, and the air gap is detected at a point (section 2.4), not over the pole.",
            track: Track::AtCentres,
            ..SHIPPED
        },
        Reading {
            name: "steps at the joints",
            argument: "Girders meet at joints; the text does not mention them. Here each meets the next with a step of 1 mm, \
                   and there is no other irregularity.",
            track: Track::Joints,
            ..SHIPPED
        },
        Reading {
            name: "chirp in the crossing",
            argument: "Section 3.3 refers to figure 11, the crossing, for the excitation (perhaps a slip for figure 9), and \
                   section 3.1 introduces the force for all simulations.",
            track: Track::Chirp,
            ..SHIPPED
        },
        Reading {
            name: "chirp in the crossing from mid-span",
            argument: "The same; the text does not say where the crossing begins. Here the train begins on the first girder, so \
                   that it is over mid-span when the chirp passes 7 Hz.",
            track: Track::ChirpFromMiddle,
            ..SHIPPED
        },
        // combinations
        Reading {
            name: "force off, at the bogies",
            argument: "The choices for figure 12 together.",
            force: 36.0,
            at_bogies: true,
            ..SHIPPED
        },
        Reading {
            name: "one bearing, at the bogies",
            argument: "The second mode of one elastic bearing answers to a force at mid-span, where section 3.1 puts it.",
            girder: Girder::OneBearing,
            at_bogies: true,
            ..SHIPPED
        },
        Reading {
            name: "one bearing, force off, at the bogies, chirp in the crossing",
            argument: "The choices for the second mode together, the force in the crossing as far off mid-span as at the \
                   standstill, away from the mode's node.",
            girder: Girder::OneBearing,
            force: 39.0,
            at_bogies: true,
            track: Track::Chirp,
            ..SHIPPED
        },
        Reading {
            name: "force off, at the bogies, chirp in the crossing",
            argument: "The same on rigid bearings.",
            force: 36.0,
            at_bogies: true,
            track: Track::Chirp,
            ..SHIPPED
        },
        Reading {
            name: "28 A, force off, at the bogies, chirp in the crossing",
            argument: "The same at the current that gives figure 14; nothing in the text supports it.",
            magnet: Magnet::Linear(28.0),
            force: 36.0,
            at_bogies: true,
            track: Track::Chirp,
            in_text: false,
            ..SHIPPED
        },
        Reading {
            name: "28 A, force off, at the bogies, chirp in the crossing from mid-span",
            argument: "The same with the other beginning of the crossing.",
            magnet: Magnet::Linear(28.0),
            force: 36.0,
            at_bogies: true,
            track: Track::ChirpFromMiddle,
            in_text: false,
            ..SHIPPED
        },
        Reading {
            name: "nonlinear law, waves to 5 cm at centres",
            argument: "The law of the loaded magnet on the track with short waves.",
            magnet: Magnet::Nonlinear,
            track: Track::AtCentres,
            ..SHIPPED
        },
        Reading {
            name: "nonlinear law, force off, at the bogies, waves to 5 cm at centres",
            argument: "The same with the choices for figure 12.",
            magnet: Magnet::Nonlinear,
            force: 36.0,
            at_bogies: true,
            track: Track::AtCentres,
            ..SHIPPED
        },
        Reading {
            name: "28 A, waves to 5 cm at centres",
            argument: "The current that gives figure 14 on the track with short waves; nothing in the text supports it.",
            magnet: Magnet::Linear(28.0),
            track: Track::AtCentres,
            in_text: false,
            ..SHIPPED
        },
    ]
}
