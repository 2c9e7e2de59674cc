//! The one table: as Markdown and HTML for people, as CSV for programs.

use std::{fmt::Write, fs, path::Path};

use anyhow::{Context, Result};

use super::markup::escaped;

/// Rows of entries under a header, with a sentence below.
///
/// ```
/// use evaluation::table::{Entry, Measured, Table};
///
/// let mut table = Table::new("Rates", &["mesh", "rate"]);
/// table.row([Entry::from("bunny"), Measured::rates(vec![80.0, 90.0], Some(84.0)).into()]);
/// assert!(table.markdown().ends_with("| bunny | 85.0 ± 7.1 (84) |\n"));
/// ```
#[derive(Clone, Debug)]
pub struct Table {
    /// Stands above it.
    pub title: String,
    /// The columns' names.
    pub header: Vec<String>,
    /// One entry a column each.
    pub rows: Vec<Vec<Entry>>,
    note: String,
    text_columns: usize,
}

/// What stands in a cell of a table.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Entry {
    /// Words, or a number as it is to be shown.
    Text(String),
    /// A measured figure, and what was printed of it elsewhere.
    Measured(Measured),
}

/// A figure that was measured, perhaps more than once, beside a printed one.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// All that was measured; empty where nothing could be.
    pub values: Vec<f64>,
    /// What the paper prints.
    pub printed: Option<f64>,
    /// Digits behind the point.
    pub digits: usize,
    /// Whether it is a rate in per cent, of which more is better: then it stands out where it is far from the printed one.
    pub rate: bool,
    /// T₀ in the mean, where it is shown.
    pub margin: Option<f64>,
    /// How many of how many signatures were verified, where that is shown.
    pub verified: Option<[usize; 2]>,
}

/// A greater T₀ says only that there is hardly any noise.
pub const MOST_MARGIN: f64 = 999.0;

/// Points of extraction rate below the printed figure that need an explanation.
pub const TOLERATED: f64 = 5.0;

impl Measured {
    /// Measured values beside a printed one.
    pub fn new(values: Vec<f64>, printed: Option<f64>, digits: usize) -> Self {
        Self {
            values,
            printed,
            digits,
            rate: false,
            margin: None,
            verified: None,
        }
    }

    /// With T₀ beside it: the mean of what was measured, if anything was.
    pub fn with_margins(self, margins: &[f64]) -> Self {
        let mean = margins.iter().sum::<f64>() / margins.len() as f64;
        Self {
            margin: (!margins.is_empty()).then_some(mean),
            ..self
        }
    }

    /// With the number of signatures that were verified beside it, if there are any.
    pub fn with_verified(self, verified: &[bool]) -> Self {
        let count = verified.iter().filter(|verified| **verified).count();
        Self {
            verified: (!verified.is_empty()).then_some([count, verified.len()]),
            ..self
        }
    }

    /// Rates in per cent.
    pub fn rates(values: Vec<f64>, printed: Option<f64>) -> Self {
        Self {
            rate: true,
            ..Self::new(values, printed, 1)
        }
    }

    /// Of the values; none without any.
    pub fn mean(&self) -> Option<f64> {
        let count = self.values.len();
        (count > 0).then(|| self.values.iter().sum::<f64>() / count as f64)
    }

    /// The standard deviation; none of fewer than two values.
    pub fn spread(&self) -> Option<f64> {
        let mean = self.mean()?;
        let count = self.values.len();
        let squares: f64 = self.values.iter().map(|value| (value - mean).powi(2)).sum();
        (count > 1).then(|| (squares / (count - 1) as f64).sqrt())
    }

    /// A rate more than [`TOLERATED`] points below the printed one.
    pub fn falls_short(&self) -> bool {
        self.rate && self.above_printed().is_some_and(|above| -above > TOLERATED)
    }

    fn above_printed(&self) -> Option<f64> {
        Some(self.mean()? - self.printed?)
    }

    /// Mean and spread.
    fn words(&self) -> (String, Option<String>) {
        let digits = self.digits;
        let mean = self.mean().map_or("–".into(), |mean| format!("{mean:.digits$}"));
        let spread = self.spread().filter(|spread| *spread > 0.0);
        (mean, spread.map(|spread| format!("± {spread:.digits$}")))
    }

    fn markdown(&self) -> String {
        let (mean, spread) = self.words();
        let mut words = spread.map_or(mean.clone(), |spread| format!("{mean} {spread}"));
        if self.falls_short() {
            words = format!("**{words}**");
        }
        let printed = self.printed.map(|printed| printed.to_string());
        let beside: Vec<String> = printed.into_iter().chain(self.beside()).collect();
        match beside.is_empty() {
            true => words,
            false => format!("{words} ({})", beside.join(", ")),
        }
    }

    /// T₀, and how many were verified.
    fn beside(&self) -> Vec<String> {
        let margin = self.margin.map(|margin| match margin > MOST_MARGIN {
            true => format!("T₀ > {MOST_MARGIN}"),
            false => format!("T₀ {margin:.0}"),
        });
        let verified = self.verified.map(|[count, of]| format!("{count}/{of}"));
        margin.into_iter().chain(verified).collect()
    }

    fn html(&self) -> String {
        let class = match self.above_printed().filter(|_| self.rate) {
            Some(above) if -above > TOLERATED => "below",
            Some(above) if above > TOLERATED => "above",
            _ => "",
        };
        let (mean, spread) = self.words();
        let spread = spread.map_or(String::new(), |spread| format!(" <s>{spread}</s>"));
        let printed = self
            .printed
            .map_or(String::new(), |printed| format!("<i>{printed}</i>"));
        let beside: String = self
            .beside()
            .iter()
            .map(|words| format!("<b>{}</b>", escaped(words)))
            .collect();
        format!("<td class=\"{class}\">{mean}{spread}{printed}{beside}</td>")
    }
}

/// Which fields of CSV a column takes.
struct Kind {
    is_figure: bool,
    has_margin: bool,
    has_verified: bool,
}

impl Kind {
    /// Those behind the first, by name.
    fn fields(&self) -> Vec<&'static str> {
        let all = [
            ("spread", self.is_figure),
            ("paper", self.is_figure),
            ("T0", self.has_margin),
            ("verified", self.has_verified),
        ];
        all.into_iter()
            .filter_map(|(name, is_there)| is_there.then_some(name))
            .collect()
    }

    /// All of a figure.
    fn values(&self, figure: &Measured) -> Vec<String> {
        let number = |value: Option<f64>| value.map_or(String::new(), |value| value.to_string());
        let mut values: Vec<String> = [figure.mean(), figure.spread(), figure.printed]
            .map(number)
            .into();
        if self.has_margin {
            values.push(number(figure.margin));
        }
        if self.has_verified {
            let verified = figure.verified.map(|[count, of]| format!("{count}/{of}"));
            values.push(verified.unwrap_or_default());
        }
        values
    }
}

impl Entry {
    fn figure(&self) -> Option<&Measured> {
        match self {
            Self::Text(_) => None,
            Self::Measured(figure) => Some(figure),
        }
    }

    fn markdown(&self) -> String {
        match self {
            Self::Text(text) => text.clone(),
            Self::Measured(figure) => figure.markdown(),
        }
    }

    fn html(&self) -> String {
        match self {
            Self::Text(text) => format!("<td>{}</td>", escaped(text)),
            Self::Measured(figure) => figure.html(),
        }
    }
}

impl From<String> for Entry {
    fn from(text: String) -> Self {
        Self::Text(text)
    }
}

impl From<&str> for Entry {
    fn from(text: &str) -> Self {
        Self::Text(text.into())
    }
}

impl From<Measured> for Entry {
    fn from(figure: Measured) -> Self {
        Self::Measured(figure)
    }
}

impl PartialEq<&str> for Entry {
    fn eq(&self, text: &&str) -> bool {
        matches!(self, Self::Text(own) if own == text)
    }
}

impl Table {
    /// A table without rows. The first column is text, the others are numbers.
    pub fn new(title: &str, header: impl IntoIterator<Item: AsRef<str>>) -> Self {
        Self {
            title: title.into(),
            header: header.into_iter().map(|name| name.as_ref().into()).collect(),
            rows: Vec::new(),
            note: String::new(),
            text_columns: 1,
        }
    }

    /// With a sentence below it.
    pub fn note(self, note: &str) -> Self {
        Self {
            note: note.into(),
            ..self
        }
    }

    /// With so many columns of text, which come first.
    pub fn text_columns(self, count: usize) -> Self {
        Self {
            text_columns: count,
            ..self
        }
    }

    /// Adds a row.
    pub fn row(&mut self, entries: impl IntoIterator<Item = impl Into<Entry>>) {
        self.rows.push(entries.into_iter().map(Into::into).collect());
    }

    /// Title, table and note as Markdown.
    pub fn markdown(&self) -> String {
        let line = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
        let rule = (0..self.header.len()).map(|i| if i < self.text_columns { "---" } else { "--:" }.into());
        let head = line(self.header.clone()) + &line(rule.collect());
        let mut page = format!("## {}\n\n{head}", self.title);
        for row in &self.rows {
            page += &line(row.iter().map(Entry::markdown).collect());
        }
        if !self.note.is_empty() {
            let _ = writeln!(page, "\n{}", self.note);
        }
        page
    }

    /// As a section of an HTML page.
    pub fn html(&self) -> String {
        let names = self.header.iter();
        let header: String = names.map(|name| format!("<th>{}</th>", escaped(name))).collect();
        let row =
            |row: &Vec<Entry>| format!("<tr>{}</tr>\n", row.iter().map(Entry::html).collect::<String>());
        let rows: String = self.rows.iter().map(row).collect();
        format!(
            "<section><h2>{}</h2>\n<div class=\"wide\"><table>\n<thead><tr>{header}</tr></thead>\n<tbody>\n{rows}</tbody></table></div>\n<p>{}</p></section>\n",
            escaped(&self.title),
            escaped(&self.note)
        )
    }

    /// RFC 4180. A column of figures takes three fields: mean, spread, printed; and T₀ and how many were verified, where one of its figures has them.
    pub fn csv(&self) -> String {
        let kinds: Vec<Kind> = (0..self.header.len()).map(|i| self.kind(i)).collect();
        let mut lines: Vec<Vec<String>> = vec![Vec::new()];
        for (name, kind) in self.header.iter().zip(&kinds) {
            lines[0].push(name.clone());
            let more = kind.fields().into_iter().map(|field| format!("{name}: {field}"));
            lines[0].extend(more);
        }
        for row in &self.rows {
            let fields = row.iter().zip(&kinds).flat_map(|(entry, kind)| match entry {
                Entry::Text(text) => {
                    let empty = vec![String::new(); kind.fields().len()];
                    [vec![text.clone()], empty].concat()
                }
                Entry::Measured(figure) => kind.values(figure),
            });
            lines.push(fields.collect());
        }
        let quoted = |field: &String| match field.contains([',', '"', '\n']) {
            true => format!("\"{}\"", field.replace('"', "\"\"")),
            false => field.clone(),
        };
        let line = |fields: &Vec<String>| fields.iter().map(quoted).collect::<Vec<_>>().join(",") + "\n";
        lines.iter().map(line).collect()
    }

    /// What the entries of a column hold.
    fn kind(&self, column: usize) -> Kind {
        let figures = || self.rows.iter().filter_map(move |row| row.get(column)?.figure());
        Kind {
            is_figure: figures().next().is_some(),
            has_margin: figures().any(|figure| figure.margin.is_some()),
            has_verified: figures().any(|figure| figure.verified.is_some()),
        }
    }

    /// Writes the table as [CSV](Self::csv).
    pub fn write_csv(&self, path: &Path) -> Result<()> {
        fs::write(path, self.csv()).with_context(|| path.display().to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rate_stands_beside_the_printed_one_and_stands_out_where_it_is_far_below() {
        let near = Measured::rates(vec![80.0, 90.0], Some(89.9));
        assert_eq!(near.markdown(), "85.0 ± 7.1 (89.9)");
        let far = Measured::rates(vec![80.0], Some(89.9));
        assert_eq!(far.markdown(), "**80.0** (89.9)");
        assert!(far.html().contains("class=\"below\""));
        assert!(
            Measured::rates(vec![96.0], Some(89.9))
                .html()
                .contains("class=\"above\"")
        );
        assert_eq!(Measured::rates(vec![], Some(50.0)).markdown(), "– (50)");
        assert_eq!(Measured::rates(vec![50.0], None).markdown(), "50.0");
        assert_eq!(Measured::new(vec![0.25], Some(9.0), 3).markdown(), "0.250 (9)");
    }

    #[test]
    fn a_margin_and_what_was_verified_stand_behind_the_rate() {
        let figure = Measured::rates(vec![98.4], None).with_margins(&[40.0, 42.0]);
        assert_eq!(figure.markdown(), "98.4 (T₀ 41)");
        let figure = figure.with_verified(&[true, true, false]);
        assert_eq!(figure.markdown(), "98.4 (T₀ 41, 2/3)");
        assert!(figure.html().contains("<b>T₀ 41</b><b>2/3</b>"));
        let mut table = Table::new("t", &["model", "rate"]);
        table.row([
            Entry::from("a"),
            Measured::rates(vec![1.0], None).with_margins(&[]).into(),
        ]);
        table.row([Entry::from("b"), figure.into()]);
        assert_eq!(
            table.csv(),
            "model,rate,rate: spread,rate: paper,rate: T0,rate: verified\na,1,,,,\nb,98.4,,,41,2/3\n"
        );
        let clean = Measured::rates(vec![100.0], None).with_margins(&[4000.0]);
        assert_eq!(clean.markdown(), "100.0 (T₀ > 999)");
    }

    #[test]
    fn csv_has_a_field_for_each_name_whatever_stands_in_the_rows() {
        let mut table = Table::new("t", &["model", "rate"]).note("n");
        table.row([
            Entry::from("a, b"),
            Measured::rates(vec![1.0, 2.0], Some(3.0)).into(),
        ]);
        table.row(["c", "none"]);
        let csv = table.csv();
        assert_eq!(csv.lines().next(), Some("model,rate,rate: spread,rate: paper"));
        assert_eq!(csv.lines().nth(2), Some("c,none,,"));
        assert!(
            csv.lines()
                .nth(1)
                .is_some_and(|line| line.starts_with("\"a, b\",1.5,0.7"))
        );
    }

    #[test]
    fn the_note_stands_below_and_words_are_words_in_html() {
        let mut table = Table::new("a < b", &["x", "y"]).text_columns(2).note("See <c>.");
        table.row(["1", "2"]);
        assert_eq!(
            table.markdown(),
            "## a < b\n\n| x | y |\n| --- | --- |\n| 1 | 2 |\n\nSee <c>.\n"
        );
        assert!(table.html().contains("<h2>a &lt; b</h2>") && table.html().contains("<p>See &lt;c&gt;.</p>"));
    }
}
