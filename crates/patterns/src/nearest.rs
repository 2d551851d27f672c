//! The pattern that was probably meant by one that matches nothing.

/// The pattern with its spelling corrected by the name that fits it best, if one is close enough to be meant. Stars
/// stay where they are.
///
/// ```
/// let names = ["ems_01", "ems_02", "vehicle"];
/// assert_eq!(patterns::suggest_pattern("esm_*", names).as_deref(), Some("ems_*"));
/// assert_eq!(patterns::suggest_pattern("wheel_*", names), None);
/// ```
#[must_use]
pub fn suggest_pattern<'a>(
    pattern: &str,
    names: impl IntoIterator<Item = &'a str>,
) -> Option<String> {
    let pattern: Vec<char> = pattern.chars().collect();
    let letters = pattern.iter().filter(|c| **c != '*').count();
    let corrected = names.into_iter().map(|name| correct(&pattern, name));
    // not so far that nothing of what was written remains
    let close = corrected.filter(|(edits, _)| *edits <= 1 + letters / 4 && *edits < letters);
    close.min_by_key(|(edits, _)| *edits).map(|(_, text)| text)
}

/// The fewest edits that make the pattern match the name, and the pattern after them.
///
/// An edit inserts, removes or replaces a character, or swaps two neighbours; upper and lower case are the same. A star
/// matches any run of characters. `fewest[i][j]` is for the pattern from `i` on and the name from `j` on.
fn correct(pattern: &[char], name: &str) -> (usize, String) {
    let name: Vec<char> = name.chars().collect();
    let mut fewest = vec![vec![0; name.len() + 1]; pattern.len() + 1];
    for i in (0..=pattern.len()).rev() {
        for j in (0..=name.len()).rev() {
            let best = edits(&pattern[i..], &name[j..])
                .map(|it| it.cost + fewest[i + it.taken][j + it.given]);
            fewest[i][j] = best.min().unwrap_or(0);
        }
    }
    let (mut i, mut j, mut text) = (0, 0, String::new());
    while let Some(edit) = edits(&pattern[i..], &name[j..])
        .find(|it| it.cost + fewest[i + it.taken][j + it.given] == fewest[i][j])
    {
        // a star is written when the pattern leaves it behind
        match pattern.get(i) {
            Some('*') if edit.taken == 1 => text.push('*'),
            Some('*') => {}
            _ => text.extend(&name[j..j + edit.given]),
        }
        (i, j) = (i + edit.taken, j + edit.given);
    }
    (fewest[0][0], text)
}

/// One step of the comparison.
struct Edit {
    /// Characters of the pattern that it takes.
    taken: usize,
    /// Characters of the name that it gives.
    given: usize,
    cost: usize,
}

/// The edits that are possible before what is left of a pattern and a name, cheap ones first; none at the end of both.
fn edits(pattern: &[char], name: &[char]) -> impl Iterator<Item = Edit> {
    let same = |a: &char, b: &char| a == b || a.to_lowercase().eq(b.to_lowercase());
    let star = pattern.first() == Some(&'*');
    let pair = pattern.first().zip(name.first());
    let swapped = matches!((pattern, name), ([a, b, ..], [c, d, ..]) if same(a, d) && same(b, c));
    let edit = |possible: bool, taken, given, cost| possible.then_some(Edit { taken, given, cost });
    [
        edit(star, 1, 0, 0),
        edit(star && !name.is_empty(), 0, 1, 0),
        pair.filter(|_| !star).map(|(a, b)| Edit {
            taken: 1,
            given: 1,
            cost: usize::from(!same(a, b)),
        }),
        edit(swapped && !star && pattern[1] != '*', 2, 2, 1),
        edit(!star && !pattern.is_empty(), 1, 0, 1),
        edit(!star && !name.is_empty(), 0, 1, 1),
    ]
    .into_iter()
    .flatten()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const INSTANCES: [&str; 4] = ["ems_01", "ems_64", "guideway", "vehicle"];
    const VARIABLES: [&str; 4] = ["gain_gap", "gain_rate", "front_left_force", "x[1]"];

    #[test]
    fn analytic_the_nearest_name_corrects_a_pattern_around_its_stars() {
        for (pattern, corrected) in [
            ("esm_*", Some("ems_*")),
            ("EMS_*", Some("ems_*")),
            ("es_*", Some("ems_*")),
            ("emms_0*", Some("ems_0*")),
            ("*hicel", Some("*hicle")),
            ("v*hikle", Some("v*hicle")),
            ("wheel_*", None),
            ("x*", None),
            ("*", Some("*")),
        ] {
            let expected = corrected.filter(|it| *it != "*");
            assert_eq!(suggest_pattern(pattern, INSTANCES).as_deref(), expected, "{pattern}");
        }
        for (pattern, corrected) in [
            ("gian_gap", Some("gain_gap")),
            ("gain_*p_", Some("gain_*p")),
            ("frnt*froce", Some("front*force")),
            ("gain_gaps*", Some("gain_gap*")),
            ("temperature*", None),
        ] {
            assert_eq!(suggest_pattern(pattern, VARIABLES).as_deref(), corrected, "{pattern}");
        }
    }

    proptest! {
        #[test]
        fn invariant_a_corrected_pattern_matches(pattern in "[a-c*_]{0,6}", name in "[a-cü_]{0,6}") {
            let (edits, text) = correct(&pattern.chars().collect::<Vec<_>>(), &name);
            prop_assert!(crate::matches(&text, &name), "{pattern} {name} {text}");
            prop_assert_eq!(edits == 0, crate::matches(&pattern, &name));
        }
    }
}
