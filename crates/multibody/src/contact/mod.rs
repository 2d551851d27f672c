//! Contact of the magnets with the rail: mechanical stops, landing skids, friction.

mod description;
mod events;
mod forces;
mod law;
mod stepping;
mod track;

pub use description::{ContactDescription, ContactSide, MAX_CONTACT_STIFFNESS, MIN_SLIP_SPEED};
pub use forces::ContactPower;
pub use law::{Contact, ContactLaw};
pub use track::{TrackContact, TrackCourse};

pub(crate) use stepping::mobility;
pub(crate) use track::ContactScratch;
