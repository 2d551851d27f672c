//! Names of variables in a bundle.

use std::collections::HashSet;

/// Longest name that every importer accepts.
const LONGEST: usize = 55;

/// A text as an identifier: anything but letters and digits becomes `_`.
pub(crate) fn identifier(text: &str) -> String {
    let mut name = String::with_capacity(text.len());
    for c in text.chars() {
        if c.is_ascii_alphanumeric() {
            name.push(c);
        } else if !name.ends_with('_') {
            name.push('_');
        }
    }
    let name = name.trim_matches('_');
    match name.chars().next() {
        None => "unnamed".to_owned(),
        Some(c) if c.is_ascii_digit() => format!("_{name}"),
        Some(_) => name.to_owned(),
    }
}

/// Whether a name that the user gives can be used.
pub(crate) fn is_valid(name: &str) -> bool {
    let mut letters = name.chars();
    let head = letters.next().is_some_and(|c| c.is_ascii_alphabetic() || c == '_');
    head && name.len() <= LONGEST && letters.all(|c| c.is_ascii_alphanumeric() || c == '_')
}

/// What a row of instances is called, such as `ems` for `ems_[01..64]`.
pub(crate) fn stem(pattern: &str) -> String {
    let mut text = String::new();
    let mut rest = pattern;
    while let Some((before, after)) = rest.split_once('[') {
        text.push_str(before.trim_end_matches('_'));
        rest = after.split_once(']').map_or("", |(_, after)| after);
    }
    text.push_str(rest);
    identifier(&text)
}

/// Names that are used already.
#[derive(Default)]
pub(crate) struct Names(HashSet<String>);

impl Names {
    /// Uses a name; false if it is used already.
    pub(crate) fn take(&mut self, name: &str) -> bool {
        self.0.insert(name.to_owned())
    }

    /// Uses a name that is like the text: shortened, and numbered if it is used already.
    pub(crate) fn like(&mut self, text: &str) -> String {
        let mut name = identifier(text);
        name.truncate(LONGEST);
        let mut number = 1;
        let mut candidate = name.clone();
        while !self.take(&candidate) {
            number += 1;
            let end = format!("_{number}");
            candidate = name.clone();
            candidate.truncate(LONGEST - end.len());
            candidate += &end;
        }
        candidate
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_names_are_identifiers() {
        assert_eq!(identifier("vehicle.car_1[2].x"), "vehicle_car_1_2_x");
        assert_eq!(identifier("1st-unit"), "_1st_unit");
        assert_eq!(identifier("..."), "unnamed");
        assert_eq!(stem("ems_[01..64]"), "ems");
        assert_eq!(stem("car_[1..2]_bogie_[1..4]"), "car_bogie");
        assert_eq!(stem("vehicle"), "vehicle");
    }

    #[test]
    fn invariant_names_are_unique_and_short() {
        let mut names = Names::default();
        let long = "x".repeat(80);
        let all: Vec<String> = (0..12).map(|_| names.like(&long)).collect();
        assert!(all.iter().all(|it| is_valid(it)), "{all:?}");
        assert_eq!(all.iter().collect::<HashSet<_>>().len(), 12);
        assert_eq!(names.like("a.b"), "a_b");
        assert_eq!(names.like("a b"), "a_b_2");
    }
}
