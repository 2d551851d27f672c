//! The order of compared runs.

use std::cmp::Ordering;

use results::RunResults;

/// Puts runs whose folders come in alphabetical order, as from `gain-*`, into the order of the numbers in their
/// names: 2 before 10. Any other order was chosen by hand and stays.
pub fn order(runs: &mut [RunResults]) {
    let name = |run: &RunResults| run.folder.display().to_string();
    // shells sort by bytes or, in most languages, without regard to capitals
    let letters = runs.is_sorted_by_key(|run| name(run).to_lowercase());
    if letters || runs.is_sorted_by_key(name) {
        runs.sort_by(|a, b| natural(&name(a), &name(b)));
    }
}

/// Compares texts with the numbers in them as numbers. `1.5` is a number, and the minus in `a-5` is not a sign.
#[must_use]
pub fn natural(a: &str, b: &str) -> Ordering {
    let (mut a, mut b) = (a, b);
    loop {
        let order = match (number(a), number(b)) {
            (Some((x, rest_a)), Some((y, rest_b))) => {
                (a, b) = (rest_a, rest_b);
                x.total_cmp(&y)
            }
            _ => {
                let (mut left, mut right) = (a.chars(), b.chars());
                match (left.next(), right.next()) {
                    (None, None) => return Ordering::Equal,
                    (x, y) => {
                        (a, b) = (left.as_str(), right.as_str());
                        x.cmp(&y)
                    }
                }
            }
        };
        if order != Ordering::Equal {
            return order;
        }
    }
}

/// The number at the start of a text, and the rest.
fn number(text: &str) -> Option<(f64, &str)> {
    let digits = |text: &str| text.bytes().take_while(u8::is_ascii_digit).count();
    let whole = digits(text);
    if whole == 0 {
        return None;
    }
    let part = text[whole..].strip_prefix('.').map_or(0, digits);
    let end = if part > 0 { whole + 1 + part } else { whole };
    text[..end].parse().ok().map(|value| (value, &text[end..]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn runs(names: &[&str]) -> (tempfile::TempDir, Vec<RunResults>) {
        let folder = tempfile::tempdir().unwrap();
        let read = |name: &&str| {
            let path = folder.path().join(name);
            std::fs::create_dir_all(&path).unwrap();
            std::fs::write(path.join("summary.json"), "{}").unwrap();
            RunResults::read(&path).unwrap()
        };
        let list = names.iter().map(read).collect();
        (folder, list)
    }

    fn ordered(names: &[&str]) -> Vec<String> {
        let (_folder, mut runs) = runs(names);
        order(&mut runs);
        runs.iter().map(RunResults::name).collect()
    }

    #[test]
    fn issue_runs_of_a_pattern_are_in_the_order_of_their_numbers() {
        assert_eq!(ordered(&["v-1", "v-10", "v-2", "v-2.5"]), ["v-1", "v-2", "v-2.5", "v-10"]);
        assert_eq!(ordered(&["A10", "a2", "B1"]), ["A10", "B1", "a2"]);
    }

    #[test]
    fn issue_an_order_chosen_by_hand_stays() {
        assert_eq!(ordered(&["usual", "v-10", "soft"]), ["usual", "v-10", "soft"]);
    }

    #[test]
    fn analytic_numbers_in_texts_are_compared_as_numbers() {
        assert_eq!(natural("a-007", "a-7"), Ordering::Equal);
        for (less, more) in
            [("a", "a1"), ("a9b", "a10a"), ("1.25", "1.5"), ("x", "y1"), ("ä2", "ä10")]
        {
            assert_eq!(natural(less, more), Ordering::Less, "{less}, {more}");
        }
    }
}
