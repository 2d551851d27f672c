//! Index patterns: one line of a scenario for a row of signals.
//!
//! `ems_[01..64].gap` means `ems_01.gap`, `ems_02.gap` … `ems_64.gap`. A number keeps the zero
//! padding of the range's first bound. Several ranges in one pattern count like nested loops, the
//! last one fastest. Anything else, brackets included (`x[1]`), is taken literally. Where names are
//! selected from a known list (`record`, plots, `--set`, `order`), `*` also matches any sequence of
//! characters. A name that exists literally takes precedence over its reading as a pattern: callers
//! look for it first.

mod nearest;

use thiserror::Error;

pub use nearest::suggest_pattern;

/// Largest number of names of one pattern; more is treated as a typing error.
pub const MAX_NAMES: usize = 1_000_000;

/// Why a pattern cannot be expanded.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum PatternError {
    /// The last number of the range is below the first.
    #[error("in \"{pattern}\" the range [{first}..{last}] runs backwards")]
    Backwards {
        /// The pattern as written.
        pattern: String,
        /// First bound as written.
        first: String,
        /// Last bound as written.
        last: String,
    },
    /// The pattern expands to more than [`MAX_NAMES`] names.
    #[error("\"{pattern}\" stands for more than {MAX_NAMES} names")]
    TooMany {
        /// The pattern as written.
        pattern: String,
    },
    /// The two sides of a connection expand to different numbers of signals.
    #[error("\"{from}\" stands for {from_count} signals and \"{to}\" for {to_count}")]
    Lengths {
        /// The source pattern.
        from: String,
        /// Number of signals it expands to.
        from_count: usize,
        /// The target pattern.
        to: String,
        /// Number of signals it expands to.
        to_count: usize,
    },
}

enum Part<'a> {
    Text(&'a str),
    Range { first: u64, last: u64, width: usize },
}

/// All names that the pattern expands to, in order.
///
/// ```
/// let names = patterns::expand("ems_[09..11].gap")?;
/// assert_eq!(names, ["ems_09.gap", "ems_10.gap", "ems_11.gap"]);
/// # Ok::<(), patterns::PatternError>(())
/// ```
///
/// # Errors
/// A range that runs backwards, or more than [`MAX_NAMES`] names.
pub fn expand(pattern: &str) -> Result<Vec<String>, PatternError> {
    let parts = split(pattern)?;
    let mut count = 1_usize;
    for part in &parts {
        if let Part::Range { first, last, .. } = part {
            count = usize::try_from(last - first)
                .ok()
                .and_then(|n| n.checked_add(1))
                .and_then(|n| count.checked_mul(n))
                .filter(|&n| n <= MAX_NAMES)
                .ok_or_else(|| PatternError::TooMany { pattern: pattern.to_owned() })?;
        }
    }
    let mut names = vec![String::new()];
    for part in &parts {
        match part {
            Part::Text(text) => names.iter_mut().for_each(|name| name.push_str(text)),
            Part::Range { first, last, width } => {
                names = names
                    .iter()
                    .flat_map(|name| {
                        (*first..=*last).map(move |n| format!("{name}{n:0width$}", width = *width))
                    })
                    .collect();
            }
        }
    }
    Ok(names)
}

/// Pairs the names of two patterns: equal numbers of names in order, or one source with all
/// targets.
///
/// # Errors
/// Different numbers of names, or a pattern that cannot be expanded.
pub fn zip(from: &str, to: &str) -> Result<Vec<(String, String)>, PatternError> {
    pair((from, expand(from)?), (to, expand(to)?))
}

/// Pairs the expansions of two patterns, as [`zip`] does.
///
/// # Errors
/// Different numbers, with more than one source.
pub fn pair<T: Clone>(
    (from, sources): (&str, Vec<T>),
    (to, targets): (&str, Vec<T>),
) -> Result<Vec<(T, T)>, PatternError> {
    match (sources.len(), targets.len()) {
        (n, m) if n == m => Ok(sources.into_iter().zip(targets).collect()),
        (1, _) => Ok(targets.into_iter().map(|target| (sources[0].clone(), target)).collect()),
        (from_count, to_count) => Err(PatternError::Lengths {
            from: from.to_owned(),
            from_count,
            to: to.to_owned(),
            to_count,
        }),
    }
}

/// Splits `instance.variable` at the first dot outside of a range.
///
/// ```
/// assert_eq!(patterns::split_port("ems_[01..64].gap.x"), Some(("ems_[01..64]", "gap.x")));
/// assert_eq!(patterns::split_port("ems_[01..64]"), None);
/// ```
#[must_use]
pub fn split_port(pattern: &str) -> Option<(&str, &str)> {
    let mut from = 0;
    loop {
        let dot = from + pattern[from..].find('.')?;
        // the range that the dot is in, if it is in one
        let open = pattern[from..dot].rfind('[').map(|at| at + from);
        let range = open.and_then(|open| {
            let close = dot + pattern[dot..].find(']')?;
            let (low, high) = pattern[open + 1..close].split_once("..")?;
            (is_digits(low) && is_digits(high)).then_some(close + 1)
        });
        match range {
            Some(end) => from = end,
            None => return Some((&pattern[..dot], &pattern[dot + 1..])),
        }
    }
}

fn is_digits(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit())
}

/// Whether the name matches the glob, in which `*` matches any sequence of characters.
#[must_use]
pub fn matches(glob: &str, name: &str) -> bool {
    let mut pieces = glob.split('*');
    let Some(first) = pieces.next() else { return false };
    let Some(mut rest) = name.strip_prefix(first) else { return false };
    let Some(last) = glob.rfind('*').map(|at| &glob[at + 1..]) else { return rest.is_empty() };
    for piece in pieces {
        match rest.find(piece) {
            Some(at) => rest = &rest[at + piece.len()..],
            None => return false,
        }
    }
    // the greedy search may have consumed the tail already, so the end is checked separately
    name.len() >= first.len() + last.len() && name.ends_with(last)
}

/// Whether the text contains a range or a star.
#[must_use]
pub fn is_pattern(text: &str) -> bool {
    text.contains('*') || split(text).is_ok_and(|parts| parts.len() > 1)
}

fn split(pattern: &str) -> Result<Vec<Part<'_>>, PatternError> {
    let mut parts = Vec::new();
    let mut rest = pattern;
    let mut literal = 0;
    while let Some(open) = rest[literal..].find('[').map(|at| at + literal) {
        let Some(range) = range_at(pattern, &rest[open + 1..])? else {
            literal = open + 1;
            continue;
        };
        if open > 0 {
            parts.push(Part::Text(&rest[..open]));
        }
        rest = &rest[open + 1 + range.1..];
        literal = 0;
        parts.push(range.0);
    }
    if !rest.is_empty() || parts.is_empty() {
        parts.push(Part::Text(rest));
    }
    Ok(parts)
}

/// Parses `01..64]` and returns the range with its length, or `None` for plain text.
fn range_at<'a>(pattern: &str, text: &str) -> Result<Option<(Part<'a>, usize)>, PatternError> {
    let Some(close) = text.find(']') else { return Ok(None) };
    let Some((low, high)) = text[..close].split_once("..") else { return Ok(None) };
    if !is_digits(low) || !is_digits(high) {
        return Ok(None);
    }
    let number = |s: &str| {
        s.parse::<u64>().map_err(|_| PatternError::TooMany { pattern: pattern.to_owned() })
    };
    let (first, last) = (number(low)?, number(high)?);
    if last < first {
        return Err(PatternError::Backwards {
            pattern: pattern.to_owned(),
            first: low.to_owned(),
            last: high.to_owned(),
        });
    }
    let width = if low.starts_with('0') { low.len() } else { 1 };
    Ok(Some((Part::Range { first, last, width }, close + 1)))
}

/// The candidate closest in spelling, if one is close enough.
#[must_use]
pub fn suggest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let lower = name.to_lowercase();
    candidates
        .into_iter()
        .map(|candidate| {
            let distance = strsim::damerau_levenshtein(&lower, &candidate.to_lowercase());
            (distance, candidate)
        })
        .filter(|(distance, candidate)| {
            *distance <= 1 + name.chars().count().max(candidate.chars().count()) / 4
        })
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, candidate)| candidate)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn analytic_ranges_keep_padding() {
        assert_eq!(expand("a_[01..03].x").unwrap(), ["a_01.x", "a_02.x", "a_03.x"]);
        assert_eq!(expand("a[8..11]").unwrap(), ["a8", "a9", "a10", "a11"]);
        assert_eq!(expand("[1..2]_[1..2]").unwrap(), ["1_1", "1_2", "2_1", "2_2"]);
        assert_eq!(expand("plain").unwrap(), ["plain"]);
        assert_eq!(expand("x[1].y[2..]").unwrap(), ["x[1].y[2..]"]);
        assert_eq!(expand("x[1]_[1..2]").unwrap(), ["x[1]_1", "x[1]_2"]);
        assert_eq!(expand("").unwrap(), [""]);
    }

    #[test]
    fn analytic_bad_ranges_are_refused() {
        assert!(matches!(expand("a_[3..1]"), Err(PatternError::Backwards { .. })));
        assert!(matches!(expand("[0..99999]_[0..99999]"), Err(PatternError::TooMany { .. })));
        assert!(matches!(
            expand("[0..99999999999999999999999]"),
            Err(PatternError::TooMany { .. })
        ));
        assert!(matches!(zip("a_[1..2]", "b_[1..3]"), Err(PatternError::Lengths { .. })));
    }

    #[test]
    fn analytic_zip_pairs_or_fans_out() {
        let pairs = zip("v.g_[1..2]", "e_[1..2].g").unwrap();
        assert_eq!(
            pairs,
            [("v.g_1".into(), "e_1.g".into()), ("v.g_2".to_owned(), "e_2.g".to_owned())]
        );
        assert_eq!(zip("v.s", "e_[1..3].s").unwrap().len(), 3);
    }

    #[test]
    fn analytic_ports_are_cut_outside_of_ranges() {
        for (pattern, expected) in [
            ("a.x", Some(("a", "x"))),
            ("a_[1..2].x", Some(("a_[1..2]", "x"))),
            ("a_[1..2]_[01..03]b.x.y[1..2]", Some(("a_[1..2]_[01..03]b", "x.y[1..2]"))),
            ("a[3..1].x", Some(("a[3..1]", "x"))),
            ("a[x.y].z", Some(("a[x", "y].z"))),
            ("a[1..].x", Some(("a[1", ".].x"))),
            ("[1..2].[3..4]", Some(("[1..2]", "[3..4]"))),
            ("ü*.x*", Some(("ü*", "x*"))),
            (".", Some(("", ""))),
            ("a_[1..2]", None),
            ("", None),
        ] {
            assert_eq!(split_port(pattern), expected, "{pattern}");
        }
    }

    #[test]
    fn analytic_globs() {
        assert!(matches("a*", "abc") && matches("*", "") && matches("a*c*e", "abcde"));
        assert!(!matches("a*c", "abcd") && !matches("ab", "abc") && !matches("ab*ba", "aba"));
        assert!(matches("ems_*.gap", "ems_01.gap") && !matches("ems_*.gap", "ems_01.gap_rate"));
        assert!(matches("a*bc", "abcbc"));
    }

    #[test]
    fn analytic_suggestions_are_close_or_absent() {
        assert_eq!(suggest("gpa", ["gap", "force"]), Some("gap"));
        assert_eq!(suggest("Y", ["u", "y"]), Some("y"));
        assert_eq!(suggest("temperature", ["gap", "force"]), None);
    }

    proptest! {
        #[test]
        fn invariant_expansion_has_the_length_of_its_range(first in 0_u64..500, count in 0_u64..500) {
            let last = first + count;
            let names = expand(&format!("u_[{first:04}..{last:04}].y")).unwrap();
            prop_assert_eq!(names.len() as u64, count + 1);
            prop_assert_eq!(names.last().unwrap(), &format!("u_{last:04}.y"));
        }

        #[test]
        fn invariant_any_text_expands_or_fails_cleanly(text in "[a-z\\[\\]\\.0-9\\*ü]{0,12}") {
            // at most three digits fit between brackets twice: a bounded expansion
            let _ = expand(&text);
            let _ = is_pattern(&text);
            let _ = split_port(&text);
            let _ = matches(&text, "abc_01.gap");
        }

        #[test]
        fn invariant_every_name_matches_itself_and_star(name in "[a-z_0-9\\.]{0,12}") {
            prop_assert!(matches(&name, &name));
            prop_assert!(matches("*", &name));
            let (head, tail) = name.split_at(name.len() / 2);
            let globbed = format!("{head}*{tail}");
            prop_assert!(matches(&globbed, &name));
        }
    }
}
