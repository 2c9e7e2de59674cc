//! What people and programs read: results on standard output, failures on standard error.

use std::io::{self, Write};

use anyhow::{Context, Result};
use serde_json::{Map, Value};

/// Prints what failed.
pub(crate) fn failure(error: &anyhow::Error) {
    // Where standard error is closed or full, the exit code alone has to say it.
    let _ = writeln!(io::stderr(), "sigmark: {}", in_one_line(error));
}

/// Says what was done otherwise than one might think, in one line.
pub(crate) fn warning(text: &str) {
    // As for a failure; what is written stands, whoever reads of it.
    let _ = writeln!(io::stderr(), "sigmark: {}", printable(text));
}

/// Every cause in one line, a cause that the one before it quotes already left out.
pub(crate) fn in_one_line(error: &anyhow::Error) -> String {
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
    printable(&message)
}

/// A text from a file or a file's name without what could break the line or steer the terminal.
pub(crate) fn printable(text: &str) -> String {
    text.chars()
        .map(|c| if steers(c) { '\u{fffd}' } else { c })
        .collect()
}

/// A text of a stranger's in quotation marks, which it can't end, nor fill the screen with blanks and more words.
pub(crate) fn quoted(text: &str) -> String {
    const LONGEST: usize = 200;
    let words: Vec<&str> = text.split_whitespace().collect();
    let one_line = words.join(" ");
    let mut shown: String = one_line.chars().take(LONGEST).collect();
    if shown.len() < one_line.len() {
        shown.push('\u{2026}');
    }
    let inner = |c: char| match c {
        '\u{201c}' | '\u{201d}' | '"' => '\'',
        c => c,
    };
    format!("\u{201c}{}\u{201d}", shown.chars().map(inner).collect::<String>())
}

/// Characters that are not seen, but change what is: controls, and what turns the direction of writing.
pub(crate) fn steers(c: char) -> bool {
    c.is_control()
        || matches!(c, '\u{61c}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{2069}' | '\u{feff}')
}

/// A report for people.
pub(crate) struct Lines(Vec<String>);

impl Lines {
    pub(crate) fn new(headline: impl Into<String>) -> Self {
        Self(vec![headline.into()])
    }

    pub(crate) fn line(&mut self, text: impl Into<String>) {
        self.0.push(text.into());
    }

    /// A line that says what, then how it is.
    pub(crate) fn field(&mut self, name: &str, value: impl std::fmt::Display) {
        self.0.push(format!("  {name:<14} {value}"));
    }
}

/// Prints what programs read, one JSON object in a line, or what people do. A reader that has closed its end is no error.
pub(crate) fn print(json: bool, object: &Value, lines: &Lines) -> Result<()> {
    let text = match json {
        true => format!("{object}\n"),
        false => lines.0.iter().map(|line| printable(line) + "\n").collect(),
    };
    write(text.as_bytes())
}

/// Writes to standard output. A reader that has closed its end is no error.
pub(crate) fn write(text: &[u8]) -> Result<()> {
    let mut out = io::stdout().lock();
    match out.write_all(text).and_then(|()| out.flush()) {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        other => other.context("the report can't be written to standard output, but the work is done"),
    }
}

/// How long each stage took.
pub(crate) type Seconds = [(&'static str, f64)];

/// Seconds of each stage as a JSON object.
pub(crate) fn seconds_json(seconds: &Seconds) -> Value {
    let members = seconds
        .iter()
        .map(|&(name, value)| (name.to_string(), value.into()));
    members.collect::<Map<_, _>>().into()
}

/// Seconds of each stage that took any, for people.
pub(crate) fn seconds_text(seconds: &Seconds) -> String {
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

/// "a, b and c".
pub(crate) fn listed(things: &[String]) -> String {
    match things {
        [] => String::new(),
        [only] => only.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_from_outside_stays_in_its_quotation_marks() {
        assert_eq!(
            quoted("Anna\u{201d} and \u{201c}Bert"),
            "\u{201c}Anna' and 'Bert\u{201d}"
        );
        assert_eq!(quoted("Anna  \t  key  x"), "\u{201c}Anna key x\u{201d}");
        assert_eq!(quoted(&"\u{e9}".repeat(1000)).chars().count(), 203);
    }

    #[test]
    fn a_text_from_outside_can_neither_break_the_line_nor_steer_the_terminal() {
        assert_eq!(
            printable("a\nb\x1b[2Jc\r\u{9b}"),
            "a\u{fffd}b\u{fffd}[2Jc\u{fffd}\u{fffd}"
        );
        assert_eq!(
            printable("a\u{202e}b\u{2028}c\u{200b}d\u{feff}"),
            "a\u{fffd}b\u{fffd}c\u{fffd}d\u{fffd}"
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
