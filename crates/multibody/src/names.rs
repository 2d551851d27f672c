//! Bodies by name, with a hint where a name is unknown.

use std::collections::HashMap;
use std::fmt::Display;

use crate::description::{Body, GROUND};
use crate::error::{Error, invalid};
use crate::index::MemberIndex;

/// Bodies by name, `ground` as `None`.
pub(crate) struct BodyNames<'a>(HashMap<&'a str, MemberIndex>);

impl<'a> BodyNames<'a> {
    pub fn new(bodies: &'a [Body]) -> Self {
        Self(bodies.iter().enumerate().map(|(k, b)| (b.name.as_str(), MemberIndex(k))).collect())
    }

    /// Index of the named body, `None` for the ground.
    pub fn find(&self, name: &str, path: &dyn Display) -> Result<Option<MemberIndex>, Error> {
        if name == GROUND {
            return Ok(None);
        }
        self.0.get(name).map(|k| Some(*k)).ok_or_else(|| {
            let known = self.0.keys().copied().chain([GROUND]);
            invalid(path, format!("there is no body `{name}`{}", meant(name, known)))
        })
    }

    /// Index of the named body, which must not be the ground.
    pub fn moving(&self, name: &str, path: &dyn Display) -> Result<MemberIndex, Error> {
        self.find(name, path)?
            .ok_or_else(|| invalid(path, "the ground is not allowed here; name a body"))
    }

    /// The two ends of a joint or element, which must differ.
    pub fn pair(
        &self,
        a: &str,
        b: &str,
        path: &dyn Display,
    ) -> Result<(Option<MemberIndex>, Option<MemberIndex>), Error> {
        let first = self.find(a, &format_args!("{path}.body_a"))?;
        let second = self.find(b, &format_args!("{path}.body_b"))?;
        if first == second {
            return Err(invalid(
                path,
                format!("both ends are on `{a}`; name two different bodies"),
            ));
        }
        Ok((first, second))
    }
}

/// A hint with the known name that is closest in spelling, if one is close enough.
pub(crate) fn meant<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> String {
    // long names are not searched: nobody types them by hand
    let near = |other: &str| (other.len() <= 64).then(|| distance(name, other));
    let found = if name.len() > 64 {
        None
    } else {
        known
            .filter_map(|other| near(other).map(|d| (d, other)))
            .min()
            .filter(|(d, _)| 3 * d <= name.chars().count())
    };
    found.map_or_else(String::new, |(_, other)| format!("; did you mean `{other}`?"))
}

/// Levenshtein distance: letters to insert, delete or replace.
fn distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let exchanged = diagonal + usize::from(x != *y);
            diagonal = row[j + 1];
            row[j + 1] = exchanged.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}
