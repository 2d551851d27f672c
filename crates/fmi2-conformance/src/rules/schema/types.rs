//! Types of attributes in the schema, and which values they allow.

use fmi2_import::xml::{number, trim, words};

/// Type of an attribute's value.
#[derive(Clone, Copy)]
pub(super) enum Kind {
    Text,
    Real,
    Integer,
    Unsigned,
    Boolean,
    Date,
    /// A list of variable indices.
    Indices,
    OneOf(&'static [&'static str]),
    /// A list of words out of these.
    ManyOf(&'static [&'static str]),
}

/// Whether a value has the type. The error is what it should be.
pub(super) fn fits(kind: Kind, value: &str) -> Result<(), String> {
    let (fits, expected) = match kind {
        Kind::Text => (true, String::new()),
        Kind::Real => (real(trim(value)), "a number".to_owned()),
        Kind::Integer => (number::<i32>(value).is_some(), "a whole number of 32 bits".to_owned()),
        Kind::Unsigned => (unsigned(value), "a whole number from 0 to 4294967295".to_owned()),
        Kind::Boolean => (
            ["true", "false", "1", "0"].contains(&trim(value)),
            "a Boolean: true, false, 1 or 0".to_owned(),
        ),
        Kind::Date => (date(value), "a date and time such as 2026-01-31T12:00:00Z".to_owned()),
        Kind::Indices => (words(value).all(unsigned), "a list of indices".to_owned()),
        // a normalizedString keeps the blanks around it
        Kind::OneOf(known) => (known.contains(&value), format!("one of {}", known.join(", "))),
        Kind::ManyOf(known) => {
            let all = words(value).all(|word| known.contains(&word));
            (all, format!("a list of {}", known.join(", ")))
        }
    };
    if fits { Ok(()) } else { Err(expected) }
}

fn unsigned(text: &str) -> bool {
    number::<u32>(text).is_some()
}

/// A number as XML schema's `double`: that knows INF and NaN, but not `inf`, `nan` or `infinity`.
fn real(text: &str) -> bool {
    let digits = text.strip_prefix(['+', '-']).unwrap_or(text);
    match digits {
        "INF" => !text.starts_with('+'),
        "NaN" => text == digits,
        _ => !digits.starts_with(|c: char| c.is_alphabetic()) && text.parse::<f64>().is_ok(),
    }
}

/// `YYYY-MM-DDThh:mm:ss`, with fractions and a zone if one likes, on a day that the calendar has.
fn date(text: &str) -> bool {
    read_date(text).is_some()
}

fn read_date(text: &str) -> Option<()> {
    let (day, time) = text.strip_prefix('-').unwrap_or(text).split_once('T')?;
    let mut parts = day.split('-');
    let mut part = || parts.next();
    let (year, month, day) = (part()?, digits(part()?, 2)?, digits(part()?, 2)?);
    let long = year.len() > 4 && !year.starts_with('0');
    let century_and_year = digits(year.get(year.len().checked_sub(4)?..)?, 4)?;
    let named = long || year.len() == 4 && century_and_year > 0;
    let all_digits = year.bytes().all(|b| b.is_ascii_digit());
    let sound = named && all_digits && (1..=days(century_and_year, month)).contains(&day);
    (sound && part().is_none()).then_some(())?;
    let at = time.find(['Z', '+', '-']).unwrap_or(time.len());
    (clock(&time[..at])? && zone(&time[at..])?).then_some(())
}

/// `hh:mm:ss` with fractions; 24:00:00 ends a day.
fn clock(text: &str) -> Option<bool> {
    let mut parts = text.splitn(3, ':');
    let (hour, minute) = (digits(parts.next()?, 2)?, digits(parts.next()?, 2)?);
    let seconds = parts.next()?;
    let (second, fraction) = seconds.split_once('.').unwrap_or((seconds, "0"));
    let second = digits(second, 2)?;
    let numeric = !fraction.is_empty() && fraction.bytes().all(|b| b.is_ascii_digit());
    let whole = fraction.bytes().all(|b| b == b'0');
    let midnight = hour == 24 && minute == 0 && second == 0 && whole;
    Some(numeric && minute < 60 && second < 60 && (hour < 24 || midnight))
}

/// Nothing, `Z`, or a difference of up to 14 hours.
fn zone(text: &str) -> Option<bool> {
    if text.is_empty() || text == "Z" {
        return Some(true);
    }
    let (hours, minutes) = text.strip_prefix(['+', '-'])?.split_once(':')?;
    let (hours, minutes) = (digits(hours, 2)?, digits(minutes, 2)?);
    Some(minutes < 60 && hours * 60 + minutes <= 14 * 60)
}

/// A number of exactly so many digits.
fn digits(text: &str, count: usize) -> Option<u32> {
    let fits = text.len() == count && text.bytes().all(|b| b.is_ascii_digit());
    if fits { text.parse().ok() } else { None }
}

/// Days of a month; the leap years recur every 400 years, so that the last four digits decide.
fn days(year: u32, month: u32) -> u32 {
    let leap = year.is_multiple_of(4) && !year.is_multiple_of(100) || year.is_multiple_of(400);
    match month {
        2 => 28 + u32::from(leap),
        4 | 6 | 9 | 11 => 30,
        1..=12 => 31,
        _ => 0,
    }
}

#[cfg(test)]
mod tests {
    use super::{date, real};

    #[test]
    fn golden_dates_are_those_of_the_calendar() {
        for text in [
            "2024-02-29T00:00:00Z",
            "2000-02-29T23:59:59.999",
            "2026-01-31T12:00:00+01:00",
            "2026-12-31T24:00:00Z",
            "-0001-01-01T00:00:00Z",
            "12020-01-01T00:00:00-14:00",
        ] {
            assert!(date(text), "{text}");
        }
        for text in [
            "2024-13-45T00:00:00Z",
            "2023-02-30T00:00:00Z",
            "2023-02-29T00:00:00Z",
            "1900-02-29T00:00:00Z",
            "2026-04-31T00:00:00Z",
            "2026-00-01T00:00:00Z",
            "2026-01-00T00:00:00Z",
            "2026-01-01T24:00:01Z",
            "2026-01-01T00:60:00Z",
            "2026-01-01T00:00:60Z",
            "2026-01-01T00:00:00.Z",
            "2026-01-01T00:00Z",
            "2026-01-01T00:00:00+14:01",
            "2026-01-01T00:00:00+1:00",
            "2026-01-01",
            "0000-01-01T00:00:00Z",
            "02026-01-01T00:00:00Z",
            "26-01-01T00:00:00Z",
            "2026-1-01T00:00:00Z",
            "2026-01-01-01T00:00:00Z",
            "é026-01-01T00:00:00Z",
            "",
        ] {
            assert!(!date(text), "{text}");
        }
    }

    #[test]
    fn golden_numbers_are_those_of_the_schema() {
        for text in ["1", "1.", ".5", "-1e-5", "+1", "1E5", "INF", "-INF", "NaN"] {
            assert!(real(text), "{text}");
        }
        for text in ["", ".", "1e", "+INF", "-NaN", "nan", "inf", "infinity", "1_0", "0x1", "1,0"] {
            assert!(!real(text), "{text}");
        }
    }
}
