//! Statuses that calls return and log messages carry.

pub use fmi2_sys::fmi2Status;
use fmi2_sys::fmi2Status as Status;

/// The status that is displayed with this name: `fmi2OK` … `fmi2Pending`, `unknown status 77`.
#[must_use]
pub fn status_with_name(name: &str) -> Option<Status> {
    let known = (Status::fmi2OK.0..=Status::fmi2Pending.0).map(Status);
    let unknown = || name.strip_prefix("unknown status ")?.parse().ok().map(Status);
    known.into_iter().find(|status| status.name() == name).or_else(unknown)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn invariant_statuses_are_found_by_their_names() {
        for number in [0, 1, 2, 3, 4, 5, 6, 77, u32::MAX] {
            assert_eq!(status_with_name(&Status(number).to_string()), Some(Status(number)));
        }
        assert_eq!(status_with_name("fmi2Good"), None);
    }
}
