//! Tables of all kinds, and those that do not fit.

use super::*;

fn enumeration(items: &[(&str, i32)]) -> Enumeration {
    let items = items.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
    Enumeration { name: "E".to_owned(), items }
}

fn table(json: &str) -> Table {
    serde_json::from_str(json).unwrap()
}

fn plain(table: &Table, from: End<'_>, to: End<'_>) -> Result<Pairs, TableError> {
    pairs(Some(table), from, to).map(|it| it.0)
}

const INTEGER: End<'static> = (Type::Integer, None);
const BOOLEAN: End<'static> = (Type::Boolean, None);

#[test]
fn analytic_entries_by_name_and_number() {
    let (a, b) = (
        enumeration(&[("off", 1), ("on", 2), ("same", 3)]),
        enumeration(&[("same", 7), ("standby", 8), ("run", 9)]),
    );
    let (from, to) = ((Type::Enumeration, Some(&a)), (Type::Enumeration, Some(&b)));
    // what is not listed passes by name
    let found = plain(&table(r#"{ "off": "standby", "2": 9 }"#), from, to).unwrap();
    assert_eq!(found, [(1, 8), (2, 9), (3, 7)]);
    let found = plain(&table(r#"{ "12": "run" }"#), INTEGER, to).unwrap();
    assert_eq!(found, [(7, 7), (8, 8), (9, 9), (12, 9)]);
    let found = plain(&table(r#"{ "on": -1 }"#), from, INTEGER).unwrap();
    assert_eq!(found, [(2, -1)]);
    let found = plain(&table(r#"{ "true": false, "false": true }"#), BOOLEAN, BOOLEAN).unwrap();
    assert_eq!(found, [(0, 1), (1, 0)]);
}

#[test]
fn refusal_entries_that_do_not_fit() {
    let e = enumeration(&[("off", 1), ("on", 2)]);
    let items = (Type::Enumeration, Some(&e));
    for (text, from, to, part) in [
        (r#"{ "off": 3 }"#, items, items, "3 is not a value of the input"),
        (r#"{ "of": 1 }"#, items, items, "\"of\" is not a value of the output"),
        (r#"{ "off": "1" }"#, items, items, "\"1\" is not a value of the input"),
        (r#"{ "off": 1, "1": 2 }"#, items, items, "two entries for the value 1"),
        (r#"{ "1": true }"#, INTEGER, INTEGER, "true is not a value of the input"),
        (r#"{ "1.5": 1 }"#, INTEGER, INTEGER, "\"1.5\" is not a value of the output"),
        (r#"{ "1": true }"#, BOOLEAN, BOOLEAN, "\"1\" is not a value of the output"),
        (r#"{ "1": 2 }"#, INTEGER, (Type::Real, None), "not for Integer to Real"),
        (r#"{ "true": 2 }"#, BOOLEAN, INTEGER, "not for Boolean to Integer"),
    ] {
        let error = plain(&table(text), from, to).unwrap_err().to_string();
        assert!(error.contains(part), "{text}: {error}");
    }
}
