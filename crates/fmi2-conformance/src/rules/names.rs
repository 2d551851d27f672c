//! Rules on the names of variables (FMI 2.0.5, sections 2.2.7 and 2.2.9).

use super::subject::{Subject, duplicates, table};
use fmi2_import::xml::Plain as _;

table! {
    "variable-duplicate", "2.2.7", Error, "variables have different names", twice;
    "variable-empty", "2.2.7", Error, "names of variables are not empty", empty;
    "variable-flat", "2.2.9", Error, "names have no tab or line break", flat;
    "variable-structured", "2.2.9", Error, "structured names follow the grammar", structured;
    "type-structured", "2.2.1", Warning, "with structured names, the names of types follow the grammar too", types;
    "variable-der", "2.2.9", Error, "a variable der(...) is a Real", der;
}

fn convention(subject: &Subject) -> &'static str {
    let root = subject.elements("fmiModelDescription").next();
    match root.and_then(|root| root.attr("variableNamingConvention")) {
        Some("structured") => "structured",
        _ => "flat",
    }
}

fn twice(subject: &Subject) -> Vec<String> {
    let names = subject.elements("ScalarVariable").filter_map(|node| node.attr("name"));
    duplicates(names)
        .iter()
        .map(|name| format!("the variable name \"{name}\" occurs more than once"))
        .collect()
}

fn empty(subject: &Subject) -> Vec<String> {
    subject.each_element("ScalarVariable", |node| {
        let empty = node.attr("name")?.is_empty();
        empty.then(|| "has an empty name".to_owned())
    })
}

fn flat(subject: &Subject) -> Vec<String> {
    if convention(subject) != "flat" {
        return Vec::new();
    }
    subject.each_element("ScalarVariable", |node| {
        let control = node.attr("name")?.contains(['\r', '\n', '\t']);
        control.then(|| "has a tab or a line break in its name".to_owned())
    })
}

fn structured(subject: &Subject) -> Vec<String> {
    if convention(subject) != "structured" {
        return Vec::new();
    }
    subject.each_element("ScalarVariable", |node| {
        let name = node.attr("name")?;
        (!is_structured(name)).then(|| "has a name that is not structured".to_owned())
    })
}

fn types(subject: &Subject) -> Vec<String> {
    if convention(subject) != "structured" {
        return Vec::new();
    }
    subject.each_element("SimpleType", |node| {
        let name = node.attr("name")?;
        (!is_structured(name)).then(|| "has a name that is not structured".to_owned())
    })
}

fn der(subject: &Subject) -> Vec<String> {
    if convention(subject) != "structured" {
        return Vec::new();
    }
    subject.each_element("ScalarVariable", |node| {
        let derivative = node.attr("name")?.starts_with("der(");
        let real = node.children().any(|child| child.is("Real"));
        (derivative && !real).then(|| "is named as a derivative, but is not a Real".to_owned())
    })
}

/// `name = identifier | "der(" identifier ["," number] ")"`
fn is_structured(name: &str) -> bool {
    let Some(inner) = name.strip_prefix("der(") else { return identifier(name) == Some("") };
    let Some(rest) = identifier(inner) else { return false };
    let rest = match rest.strip_prefix(',') {
        Some(order) => match after_digits(order) {
            Some(rest) => rest,
            None => return false,
        },
        None => rest,
    };
    rest == ")"
}

/// `identifier = part {"." part}`; returns the text after it.
fn identifier(text: &str) -> Option<&str> {
    let mut rest = part(text)?;
    while let Some(next) = rest.strip_prefix('.') {
        rest = part(next)?;
    }
    Some(rest)
}

/// `part = (word | quoted) ["[" number {"," number} "]"]`; returns the text after it.
fn part(text: &str) -> Option<&str> {
    let rest = match text.strip_prefix('\'') {
        Some(quoted) => after_quoted(quoted)?,
        None => {
            let head = text.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_');
            let word = |c: char| c.is_ascii_alphanumeric() || c == '_';
            head.then(|| text.trim_start_matches(word))?
        }
    };
    let Some(mut rest) = rest.strip_prefix('[') else { return Some(rest) };
    loop {
        let digits = after_digits(rest)?;
        if let Some(after) = digits.strip_prefix(']') {
            return Some(after);
        }
        rest = digits.strip_prefix(',')?;
    }
}

/// The text after one or more digits.
fn after_digits(text: &str) -> Option<&str> {
    let rest = text.trim_start_matches(|c: char| c.is_ascii_digit());
    (rest.len() < text.len()).then_some(rest)
}

/// The text after the closing quote. There must be at least one character between the quotes.
fn after_quoted(text: &str) -> Option<&str> {
    /// Characters allowed after a backslash.
    const ESCAPES: &str = "'\"?\\abfnrtv";
    /// Characters allowed between quotes, besides letters, digits and the underscore.
    const OTHERS: &str = "!#$%&()*+,-./:;<>=?@[]^{}|~ ";
    let mut characters = text.char_indices();
    while let Some((at, c)) = characters.next() {
        match c {
            '\\' => drop(characters.next().filter(|(_, c)| ESCAPES.contains(*c))?),
            '\'' => return (at > 0).then(|| &text[at + 1..]),
            '_' => {}
            c if c.is_ascii_alphanumeric() || OTHERS.contains(c) => {}
            _ => return None,
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::is_structured;

    #[test]
    fn golden_structured_names() {
        for name in [
            "x",
            "_a1.b",
            "a.b.mod[3,4].'#123'.c",
            "der(x)",
            "der(a.b[1],2)",
            "der(pipe[3,4].T[14],2)",
            "robot.axis.'motor #234'",
            r"'a\'b'",
            r#"'\"\?\\\a\b\f\n\r\t\v'"#,
            "'a b'[1].'c'",
            "'der(x'",
            "x[1].y",
            "x[0]",
            "der",
        ] {
            assert!(is_structured(name), "{name}");
        }
        for name in [
            "",
            "1x",
            "a.",
            "a b",
            "x[]",
            "x[1",
            "x[1, 2]",
            "x[-1]",
            "x[n]",
            "der(x",
            "der()",
            "der(x,)",
            "der(x,n)",
            "der(x),",
            "der(der(x))",
            "a.der(x)",
            "''",
            "a-b",
            "'a",
            "a'",
            "'a\"b'",
            "'a`b'",
            "'ä'",
            "ä",
            r"'\x'",
            r"'a\'",
            "'a''b'",
            "x.[1]",
            "x[1]y",
            " x",
        ] {
            assert!(!is_structured(name), "{name}");
        }
    }
}
