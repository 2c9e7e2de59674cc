//! What people and programs read: results on standard output, failures on standard error.
#![allow(clippy::print_stdout, clippy::print_stderr)]

use std::io::{self, Write};

use anyhow::{Context, Result};
use serde_json::{Map, Value};

/// Prints what failed: every cause in one line, a cause that the one before it quotes already left out.
pub(crate) fn failure(error: &anyhow::Error) {
    let mut message = String::new();
    for cause in error.chain() {
        let cause = cause.to_string();
        if message.contains(&cause) {
            continue;
        }
        if !message.is_empty() {
            message.push_str(": ");
        }
        message.push_str(&cause);
    }
    eprintln!("sigmark: {message}");
}

/// Prints one JSON object in a line.
pub(crate) fn json(value: &impl serde::Serialize) -> Result<()> {
    lines(&[serde_json::to_string(value).context("the report can't be written as JSON")?])
}

/// Prints lines; a reader that has closed its end is no error.
pub(crate) fn lines(lines: &[String]) -> Result<()> {
    let mut out = io::stdout().lock();
    let written = lines
        .iter()
        .try_for_each(|line| writeln!(out, "{line}"))
        .and_then(|()| out.flush());
    match written {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        other => other.context("standard output can't be written"),
    }
}

/// A line of a report for people: what, then how it is.
pub(crate) fn field(name: &str, value: impl std::fmt::Display) -> String {
    format!("  {name:<14} {value}")
}

/// Seconds of each stage as a JSON object; a stage that came twice counts together.
pub(crate) fn seconds_json(seconds: &[(&'static str, f64)]) -> Value {
    let mut map = Map::new();
    for (name, value) in seconds {
        let sum = map.get(*name).and_then(Value::as_f64).unwrap_or(0.0) + value;
        map.insert((*name).into(), sum.into());
    }
    map.into()
}

/// Seconds of each stage that took any, for people.
pub(crate) fn seconds_text(seconds: &[(&'static str, f64)]) -> String {
    let total: f64 = seconds.iter().map(|(_, value)| value).sum();
    let parts: Vec<String> = seconds
        .iter()
        .filter(|(_, value)| *value >= 0.01)
        .map(|(name, value)| format!("{name} {value:.2}"))
        .collect();
    match parts.as_slice() {
        [] => format!("{total:.2} s"),
        parts => format!("{total:.2} s ({})", parts.join(", ")),
    }
}

/// A whole number with its thousands apart: 34 834.
pub(crate) fn grouped(number: usize) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push('\u{202f}');
        }
        text.push(digit);
    }
    text
}

/// "1 patch", "5 patches".
pub(crate) fn counted(number: usize, one: &str, many: &str) -> String {
    format!("{} {}", grouped(number), if number == 1 { one } else { many })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thousands_stand_apart() {
        assert_eq!(grouped(7), "7");
        assert_eq!(grouped(1_081_445).replace('\u{202f}', " "), "1 081 445");
        assert_eq!(counted(1, "patch", "patches"), "1 patch");
    }
}
