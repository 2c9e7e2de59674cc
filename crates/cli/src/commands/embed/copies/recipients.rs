//! Lists of recipients, and the folder that each copy lies in.

use std::{collections::HashMap, path::Path};

use anyhow::{Result, anyhow, bail};
use csv::{ReaderBuilder, StringRecord, Trim};
use sha2::{Digest, Sha256};

use crate::{
    files::{self, Text},
    report,
};

/// The header of the column to take.
const COLUMN: &str = "recipient";

/// Separators that spreadsheets write. Where no header tells which, there is one column, whose names may hold any but the first.
const SEPARATORS: [u8; 3] = [b',', b';', b'\t'];

/// Of a recipient's name as much stands in that of the folder.
const LONGEST: usize = 40;

/// Names that are devices on Windows, some with a digit behind them.
const DEVICES: [&str; 6] = ["con", "prn", "aux", "nul", "com", "lpt"];

/// Whom a copy is for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Recipient {
    pub(super) name: String,
    /// The line of the list.
    line: usize,
}

impl Recipient {
    /// The name of the folder of this recipient's copy. It depends on nobody else, so that a list can grow or be sorted anew: a name that is good
    /// for a folder on every system is taken as it is, what is left of any other gets digits of its hash.
    pub(super) fn folder(&self) -> String {
        let kept = readable(&self.name);
        if kept == self.name && kept.is_ascii() && !is_device(&kept) {
            return kept;
        }
        let digits = Sha256::digest(self.name.as_bytes());
        let digits: String = digits.iter().take(4).map(|byte| format!("{byte:02x}")).collect();
        match kept.is_empty() {
            true => digits,
            false => format!("{kept}-{digits}"),
        }
    }
}

/// Letters and digits in lower case, with a dash for all between them.
fn readable(name: &str) -> String {
    let mut kept = String::new();
    for c in name.chars().flat_map(char::to_lowercase) {
        if c.is_alphanumeric() || c == '_' {
            kept.push(c);
        } else if !kept.is_empty() && !kept.ends_with('-') {
            kept.push('-');
        }
    }
    let kept: String = kept.chars().take(LONGEST).collect();
    kept.trim_end_matches('-').into()
}

fn is_device(name: &str) -> bool {
    DEVICES.contains(&name.trim_end_matches(|c: char| c.is_ascii_digit()))
}

/// Reads a list: a column with the header "recipient", or one column without a header. Of several without one, the first row would be a recipient, and the column a guess.
pub(super) fn read(path: &Path) -> Result<Vec<Recipient>> {
    let text = files::read_text(path, Text::Recipients)?;
    let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
    let list = List { path, text };
    let recipients = list.recipients()?;
    if recipients.is_empty() {
        bail!(
            "{}: names no recipient; write one in each line, or a column with the header {COLUMN}",
            path.display()
        );
    }
    list.check_apart(&recipients)?;
    Ok(recipients)
}

struct List<'a> {
    path: &'a Path,
    text: &'a str,
}

impl List<'_> {
    fn recipients(&self) -> Result<Vec<Recipient>> {
        let (separator, column) = self.header();
        if column.is_none() {
            self.check_one_column()?;
        }
        let (mut recipients, mut fields) = (Vec::new(), None);
        for row in self.rows(separator).records() {
            let row = row.map_err(|error| anyhow!("{}: is no CSV file ({error})", self.path.display()))?;
            if row.iter().all(str::is_empty) {
                continue;
            }
            let line = self.line_of(&row);
            let is_header = fields.is_none() && column.is_some();
            self.check_fields(&row, line, *fields.get_or_insert(row.len()))?;
            if !is_header {
                recipients.push(self.recipient(&row, line, column.unwrap_or(0))?);
            }
        }
        Ok(recipients)
    }

    /// What separates fields, and which column has the header, if there is one.
    fn header(&self) -> (u8, Option<usize>) {
        let found = SEPARATORS.into_iter().find_map(|separator| {
            let mut rows = self.rows(separator).into_records().map_while(Result::ok);
            let first = rows.find(|row| !row.iter().all(str::is_empty))?;
            let column = first
                .iter()
                .position(|field| field.eq_ignore_ascii_case(COLUMN))?;
            Some((separator, Some(column)))
        });
        found.unwrap_or((SEPARATORS[0], None))
    }

    fn check_one_column(&self) -> Result<()> {
        for separator in SEPARATORS {
            let mut rows = self.rows(separator).into_records().map_while(Result::ok);
            let first = rows.find(|row| !row.iter().all(str::is_empty));
            if let Some(first) = first.filter(|first| first.len() > 1) {
                bail!(
                    "{}, line {}: has {} fields, and none is the header {COLUMN}; write that above the column to take, or put a name with {} in it in double quotes",
                    self.path.display(),
                    self.line_of(&first),
                    first.len(),
                    match separator {
                        b',' => "a comma",
                        b';' => "a semicolon",
                        _ => "a tab",
                    }
                );
            }
        }
        Ok(())
    }

    fn rows(&self, separator: u8) -> csv::Reader<&[u8]> {
        let mut rows = ReaderBuilder::new();
        rows.has_headers(false)
            .flexible(true)
            .trim(Trim::All)
            .delimiter(separator)
            .from_reader(self.text.as_bytes())
    }

    /// A row with more fields than the first has a separator that was not meant as one.
    fn check_fields(&self, row: &StringRecord, line: usize, first: usize) -> Result<()> {
        if row.len() > first {
            bail!(
                "{}, line {line}: has {} fields where the first line has {first}; put what has a comma in it in double quotes",
                self.path.display(),
                row.len()
            );
        }
        Ok(())
    }

    fn recipient(&self, row: &StringRecord, line: usize, column: usize) -> Result<Recipient> {
        let name = row.get(column).unwrap_or_default();
        let path = self.path.display();
        if name.is_empty() {
            bail!("{path}, line {line}: names no recipient; write one into it, or take the line out");
        }
        if name.chars().any(char::is_control) {
            bail!(
                "{path}, line {line}: {} has control characters or a line break in it; take them out",
                report::printable(name)
            );
        }
        Ok(Recipient {
            name: name.into(),
            line,
        })
    }

    /// Nobody stands twice, and no two have one folder.
    fn check_apart(&self, recipients: &[Recipient]) -> Result<()> {
        let (mut names, mut folders) = (HashMap::new(), HashMap::new());
        let path = self.path.display();
        for recipient in recipients {
            let Recipient { name, line } = recipient;
            if let Some(before) = names.insert(name.as_str(), line) {
                bail!(
                    "{path}, line {line}: {name} stands in line {before} already; take one out, or tell the two apart"
                );
            }
            if let Some(before) = folders.insert(recipient.folder(), line) {
                bail!(
                    "{path}, line {line}: the copy of {name} would lie in the same folder as that of line {before}; change one name a little"
                );
            }
        }
        Ok(())
    }

    /// The line in which a row begins: a reader counts empty lines before it to the row.
    fn line_of(&self, row: &StringRecord) -> usize {
        let begin = row.position().map_or(0, |position| position.byte() as usize);
        let is_break = |byte: &u8| matches!(byte, b'\n' | b'\r');
        let bytes = self.text.as_bytes();
        let skipped = bytes[begin..].iter().take_while(|byte| is_break(byte)).count();
        let before = &bytes[..begin + skipped];
        1 + before.iter().filter(|&&byte| byte == b'\n').count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn list(text: &str) -> Result<Vec<Recipient>> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("list.csv");
        std::fs::write(&path, text).unwrap();
        read(&path)
    }

    fn named(text: &str) -> Vec<(String, usize)> {
        let recipients = list(text).unwrap().into_iter();
        recipients.map(|Recipient { name, line }| (name, line)).collect()
    }

    #[test]
    fn a_list_is_a_column_with_a_header_or_the_first_of_all() {
        let wanted = [("Anna", 2), ("Museum, Berlin", 4)].map(|(name, line)| (name.to_string(), line));
        for text in [
            "Recipient\nAnna\n\n\"Museum, Berlin\"\n",
            "\u{feff}recipient\r\n Anna \r\n\r\n\"Museum, Berlin\"",
            "order,\"recipient\",note\n1,Anna\n ,,\n2,\"Museum, Berlin\",x\n",
            "order;recipient;note\n1;Anna\n;;\n2;Museum, Berlin;x\n",
            "\"Order, Year\",\" recipient \"\n1,Anna\n\n2,\"Museum, Berlin\"\n",
            "\nAnna\n \t \n\"Museum, Berlin\"\n",
        ] {
            assert_eq!(named(text), wanted, "{text}");
        }
        assert_eq!(named("\"注文; 4711\"\nb; c\n")[0].0, "注文; 4711");
    }

    #[test]
    fn what_can_be_meant_in_two_ways_is_refused_with_its_line() {
        let table = [
            ("\n \n", "names no recipient"),
            ("recipient\n", "names no recipient"),
            ("a\nb\n\n a\n", "line 4: a stands in line 1 already"),
            (
                "recipient\nMuseum, Berlin\n",
                "line 2: has 2 fields where the first line has 1",
            ),
            ("n,recipient\n1,a\n2,\n", "line 3: names no recipient"),
            (
                "\nbuyer,email\nAnna,a@x\n",
                "line 2: has 2 fields, and none is the header",
            ),
            ("Name;E-Mail\nAnna;a@x\n", "a name with a semicolon in it"),
            ("Name\tE-Mail\nAnna\ta@x\n", "a name with a tab in it"),
            ("a\n\"b\nc\"\n", "line 2: b\u{fffd}c has control characters"),
            ("a\nb\x1b[2J\n", "line 2: b\u{fffd}[2J has control characters"),
        ];
        for (text, words) in table {
            let error = list(text).unwrap_err().to_string();
            assert!(
                error.contains("list.csv") && error.contains(words),
                "{text:?}: {error}"
            );
        }
    }

    #[test]
    fn folders_are_readable_safe_and_depend_on_nobody_else() {
        let folder = |name: &str| {
            Recipient {
                name: name.into(),
                line: 1,
            }
            .folder()
        };
        assert_eq!(folder("order-4711"), "order-4711");
        assert!(folder("Museum, Berlin").starts_with("museum-berlin-"));
        assert!(folder("注文 4711").starts_with("注文-4711-"));
        let unsafe_ones = [
            "order 4711",
            "Order-4711",
            "../4711",
            "index.csv",
            "a/b",
            "a\\b",
            "con",
            "com1",
            ".",
            "..",
            "-rf",
            "…",
            "a ",
            "é",
        ];
        for name in unsafe_ones {
            let folder = folder(name);
            assert_ne!(folder, name);
            assert!(
                folder.chars().all(|c| c.is_alphanumeric() || c == '-'),
                "{folder}"
            );
            assert!(!folder.starts_with('-'), "{folder}");
        }
        assert!(folder(&"x".repeat(1000)).len() <= LONGEST + 9);
        assert_ne!(folder("Anna"), folder("ANNA"));
    }
}
