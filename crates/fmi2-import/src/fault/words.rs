//! Parts of the messages of faults.

use fmi2_sys::fmi2Status as Status;

use super::Loss;
use crate::activity::Activity;
use crate::logger::Message;
use crate::signal::signal_name;

pub(super) fn at(time: Option<f64>) -> String {
    time.map(|time| format!(" at {time} s")).unwrap_or_default()
}

pub(super) fn lost(how: &Loss, call: Activity, time: Option<f64>) -> String {
    let at = at(time);
    match how {
        Loss::Crashed { signal } => {
            format!(" crashed: signal {signal} ({}) in {call}{at}", signal_name(*signal))
        }
        Loss::Exited { code } => format!(" ended its process with status {code} in {call}{at}"),
        Loss::TimedOut { limit } => {
            format!(" was ended: {call}{at} took longer than {} s", limit.as_secs_f64())
        }
        Loss::GivenUp => format!(" was ended: {call}{at} had not returned"),
        Loss::Broken { why } => {
            format!(": the connection to its process broke in {call}{at}: {why}")
        }
    }
}

pub(super) fn about(variables: &[String]) -> String {
    if variables.is_empty() { String::new() } else { format!(" for {}", variables.join(", ")) }
}

/// What the FMU logged: the first of its most severe messages, since these name the cause, or the last
/// ones if none is severe.
pub(super) fn logged(messages: &[Message]) -> String {
    const SHOWN: usize = 3;
    let severity = |message: &Message| match message.status {
        Status::fmi2OK => 0,
        Status::fmi2Warning => 1,
        _ => 2,
    };
    let highest = messages.iter().map(severity).max().unwrap_or(0);
    let mut shown: Vec<&str> = messages
        .iter()
        .filter(|message| severity(message) == highest)
        .map(|message| message.text.as_str())
        .collect();
    if highest == 0 {
        shown.drain(..shown.len().saturating_sub(SHOWN));
    }
    let more = match shown.len().saturating_sub(SHOWN) {
        0 => String::new(),
        more => format!("; and {more} more like these"),
    };
    shown.truncate(SHOWN);
    if shown.is_empty() {
        String::new()
    } else {
        format!("; it logged: {}{more}", shown.join("; "))
    }
}
