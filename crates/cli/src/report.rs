//! What people and programs read: results on standard output, failures on standard error.

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
    // Where standard error is closed or full, the exit code alone has to say it.
    let _ = writeln!(io::stderr(), "sigmark: {}", printable(&message));
}

/// A text from a file or a file's name without what could break the line or steer the terminal.
pub(crate) fn printable(text: &str) -> String {
    text.chars()
        .map(|c| if c.is_control() { '\u{fffd}' } else { c })
        .collect()
}

/// Prints one JSON object in a line.
pub(crate) fn json(value: &impl serde::Serialize) -> Result<()> {
    let text = serde_json::to_string(value).context("the report can't be written as JSON")?;
    print(&(text + "\n"))
}

/// Prints lines for people.
pub(crate) fn lines(lines: &[String]) -> Result<()> {
    let lines: Vec<String> = lines.iter().map(|line| printable(line) + "\n").collect();
    print(&lines.concat())
}

/// Prints; a reader that has closed its end is no error.
fn print(text: &str) -> Result<()> {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        other => other.context("the report can't be written to standard output, but the work is done"),
    }
}

/// A line of a report for people: what, then how it is.
pub(crate) fn field(name: &str, value: impl std::fmt::Display) -> String {
    format!("  {name:<14} {value}")
}

/// Seconds of each stage as a JSON object.
pub(crate) fn seconds_json(seconds: &[(&'static str, f64)]) -> Value {
    let members = seconds
        .iter()
        .map(|&(name, value)| (name.to_string(), value.into()));
    members.collect::<Map<_, _>>().into()
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
    fn a_text_from_outside_can_neither_break_the_line_nor_steer_the_terminal() {
        assert_eq!(
            printable("a\nb\x1b[2Jc\r\u{9b}"),
            "a\u{fffd}b\u{fffd}[2Jc\u{fffd}\u{fffd}"
        );
        assert_eq!(
            printable("© 2026 «Studio», 注文 4711"),
            "© 2026 «Studio», 注文 4711"
        );
    }

    #[test]
    fn thousands_stand_apart() {
        assert_eq!(grouped(7), "7");
        assert_eq!(grouped(1_081_445).replace('\u{202f}', " "), "1 081 445");
        assert_eq!(counted(1, "patch", "patches"), "1 patch");
    }
}
