//! Contact as data of the vehicle file: mechanical stops and landing skids.

#[cfg(feature = "schema")]
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::law::{Contact, ContactLaw};
use crate::error::{Error, invalid};
use crate::numbers::{finite, not_negative};

/// Largest stiffness of a stop or a skid, N/m. A body of 10 kg on it needs internal steps of 1e-6 s.
pub const MAX_CONTACT_STIFFNESS: f64 = 1e11;
/// Smallest slip speed, m/s. Friction is the stiffer, the smaller it is.
pub const MIN_SLIP_SPEED: f64 = 1e-4;

/// Mechanical stops and landing skids at every magnet. What the file leaves out is available with the
/// values of [`ContactDescription::default`], switched off.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ContactDescription {
    /// The stop, which touches the rail from below where the gap closes. Default: the standard one,
    /// switched off.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stop: Option<ContactSide>,
    /// The skid, which lands on the rail where the gap opens. Default: the standard one, switched off.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub skid: Option<ContactSide>,
    /// Speed of sliding at which friction reaches 71 % of its full value (m/s). Default: 0.01.
    #[serde(default = "slip_speed")]
    pub slip_speed: f64,
}

/// Data of a stop or a skid at one magnet.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ContactSide {
    /// Whether it is in force. Default: true.
    #[serde(default = "yes")]
    pub on: bool,
    /// Air gap at which it touches (m).
    pub gap: f64,
    /// Stiffness k of N = k d (1 + χ ḋ) (N/m).
    pub stiffness: f64,
    /// Damping χ of N = k d (1 + χ ḋ) (s/m). Default: 0.
    #[serde(default)]
    pub damping: f64,
    /// Coefficient of friction μ (1). Default: 0.
    #[serde(default)]
    pub friction: f64,
}

fn yes() -> bool {
    true
}

fn slip_speed() -> f64 {
    0.01
}

impl Default for ContactDescription {
    /// The standard data, switched off.
    fn default() -> Self {
        Self { stop: Some(STOP), skid: Some(SKID), slip_speed: slip_speed() }
    }
}

/// Standard stop: a steel face with a thin lining, 1 mm from the rail.
const STOP: ContactSide =
    ContactSide { on: false, gap: 0.001, stiffness: 1e8, damping: 10.0, friction: 0.3 };
/// Standard skid: a lined shoe that lands 8 mm below the nominal gap of 8 mm.
const SKID: ContactSide =
    ContactSide { on: false, gap: 0.016, stiffness: 2e7, damping: 10.0, friction: 0.3 };

impl ContactDescription {
    /// The stop, or the standard one, switched off.
    #[must_use]
    pub fn stop(&self) -> ContactSide {
        self.stop.unwrap_or(STOP)
    }

    /// The skid, or the standard one, switched off.
    #[must_use]
    pub fn skid(&self) -> ContactSide {
        self.skid.unwrap_or(SKID)
    }

    /// The laws that are in force.
    #[must_use]
    pub fn contact(&self) -> Contact {
        Contact { stop: self.stop().law(), skid: self.skid().law(), slip_speed: self.slip_speed }
    }

    /// Checks numbers and gaps.
    pub(crate) fn check(&self, nominal_gap: f64) -> Result<(), Error> {
        for (side, path) in [(self.stop, "contact.stop"), (self.skid, "contact.skid")] {
            if let Some(side) = side {
                side.check(path)?;
            }
        }
        finite(&[self.slip_speed], &"contact.slip_speed")?;
        if self.slip_speed < MIN_SLIP_SPEED {
            let message =
                format!("must be at least {MIN_SLIP_SPEED} m/s, but is {}", self.slip_speed);
            return Err(invalid("contact.slip_speed", message));
        }
        self.contact()
            .check_gaps(nominal_gap)
            .map_err(|(side, message)| invalid(format!("contact.{side}.gap"), message))
    }
}

impl ContactSide {
    /// The law, if it is in force.
    #[must_use]
    pub fn law(&self) -> Option<ContactLaw> {
        self.on.then_some(ContactLaw {
            gap: self.gap,
            stiffness: self.stiffness,
            damping: self.damping,
            friction: self.friction,
        })
    }

    fn check(&self, path: &str) -> Result<(), Error> {
        not_negative(&[self.gap], &format!("{path}.gap"))?;
        not_negative(&[self.damping], &format!("{path}.damping"))?;
        not_negative(&[self.friction], &format!("{path}.friction"))?;
        let stiffness = self.stiffness;
        if !(stiffness > 0.0 && stiffness <= MAX_CONTACT_STIFFNESS) {
            let message = format!(
                "must be above 0 and at most {MAX_CONTACT_STIFFNESS:e} N/m, but is {stiffness}"
            );
            return Err(invalid(format!("{path}.stiffness"), message));
        }
        Ok(())
    }
}
