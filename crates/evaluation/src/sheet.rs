//! A table whose figures stand beside printed ones: as Markdown, as HTML, as CSV.

use std::fmt::Write;

use crate::{markup::escaped, table::csv};

/// What stands in a cell of a table.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Entry {
    Text(String),
    /// A measured figure, and what the paper prints.
    Figure(Figure),
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Figure {
    /// One for each signature; empty where none could be measured.
    pub(crate) values: Vec<f64>,
    pub(crate) printed: Option<f64>,
    pub(crate) digits: usize,
    /// Whether more is better: then a figure far below the printed one stands out.
    pub(crate) rate: bool,
}

/// Points of extraction rate below the printed figure that need an explanation.
pub(crate) const TOLERATED: f64 = 5.0;

impl Figure {
    pub(crate) fn mean(&self) -> Option<f64> {
        let count = self.values.len();
        (count > 0).then(|| self.values.iter().sum::<f64>() / count as f64)
    }

    /// The standard deviation over signatures; none of fewer than two.
    pub(crate) fn spread(&self) -> Option<f64> {
        let mean = self.mean()?;
        let count = self.values.len();
        let squares: f64 = self.values.iter().map(|value| (value - mean).powi(2)).sum();
        (count > 1).then(|| (squares / (count - 1) as f64).sqrt())
    }

    /// A rate more than [`TOLERATED`] points below the printed one.
    pub(crate) fn falls_short(&self) -> bool {
        let below = self
            .printed
            .zip(self.mean())
            .map(|(printed, mean)| printed - mean);
        self.rate && below.is_some_and(|below| below > TOLERATED)
    }

    fn words(&self) -> String {
        let digits = self.digits;
        let mut words = self.mean().map_or("–".into(), |mean| format!("{mean:.digits$}"));
        if let Some(spread) = self.spread().filter(|spread| *spread > 0.0) {
            let _ = write!(words, " ± {spread:.digits$}");
        }
        words
    }
}

impl Entry {
    fn markdown(&self) -> String {
        match self {
            Self::Text(text) => text.clone(),
            Self::Figure(figure) => {
                let words = figure.words();
                let words = if figure.falls_short() {
                    format!("**{words}**")
                } else {
                    words
                };
                match figure.printed {
                    Some(printed) => format!("{words} ({printed})"),
                    None => words,
                }
            }
        }
    }

    fn html(&self) -> String {
        match self {
            Self::Text(text) => format!("<td>{}</td>", escaped(text)),
            Self::Figure(figure) => {
                let class = match (figure.rate, figure.printed.zip(figure.mean())) {
                    (true, _) if figure.falls_short() => "below",
                    (true, Some((printed, mean))) if mean > printed + TOLERATED => "above",
                    _ => "",
                };
                let mean = figure
                    .mean()
                    .map_or("–".into(), |mean| format!("{mean:.0$}", figure.digits));
                let spread = figure.spread().filter(|spread| *spread > 0.0);
                let spread = spread.map_or(String::new(), |spread| {
                    format!(" <s>± {spread:.0$}</s>", figure.digits)
                });
                let printed = figure
                    .printed
                    .map_or(String::new(), |printed| format!("<i>{printed}</i>"));
                format!("<td class=\"{class}\">{mean}{spread}{printed}</td>")
            }
        }
    }
}

/// Rows of entries under a header, with a sentence below.
#[derive(Clone, Debug)]
pub(crate) struct Sheet {
    pub(crate) title: String,
    pub(crate) note: String,
    pub(crate) header: Vec<String>,
    pub(crate) rows: Vec<Vec<Entry>>,
}

impl Sheet {
    pub(crate) fn new(title: &str, note: &str, header: &[&str]) -> Self {
        Self {
            title: title.into(),
            note: note.into(),
            header: header.iter().map(|&name| name.into()).collect(),
            rows: Vec::new(),
        }
    }

    pub(crate) fn markdown(&self) -> String {
        let line = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
        let rule = self.header.iter().enumerate();
        let rule = rule
            .map(|(i, _)| if i < 2 { "---" } else { "--:" }.into())
            .collect();
        let rows = self
            .rows
            .iter()
            .map(|row| line(row.iter().map(Entry::markdown).collect()));
        format!(
            "## {}\n\n{}{}{}\n{}\n",
            self.title,
            line(self.header.clone()),
            line(rule),
            rows.collect::<String>(),
            self.note
        )
    }

    pub(crate) fn html(&self) -> String {
        let header: String = self
            .header
            .iter()
            .map(|name| format!("<th>{}</th>", escaped(name)))
            .collect();
        let rows: String = self
            .rows
            .iter()
            .map(|row| format!("<tr>{}</tr>\n", row.iter().map(Entry::html).collect::<String>()))
            .collect();
        format!(
            "<section><h2>{}</h2>\n<div class=\"wide\"><table>\n<thead><tr>{header}</tr></thead>\n<tbody>\n{rows}</tbody></table></div>\n<p>{}</p></section>\n",
            escaped(&self.title),
            escaped(&self.note)
        )
    }

    /// RFC 4180. A figure takes three fields: mean, spread, printed.
    pub(crate) fn csv(&self) -> String {
        let figures: Vec<bool> = (0..self.header.len())
            .map(|i| {
                self.rows
                    .iter()
                    .any(|row| matches!(row.get(i), Some(Entry::Figure(_))))
            })
            .collect();
        let mut fields: Vec<Vec<String>> = vec![Vec::new()];
        for (name, &figure) in self.header.iter().zip(&figures) {
            fields[0].push(name.clone());
            if figure {
                fields[0].extend([format!("{name}: spread"), format!("{name}: paper")]);
            }
        }
        let number = |value: Option<f64>| value.map_or(String::new(), |value| value.to_string());
        for row in &self.rows {
            let mut line = Vec::new();
            for (entry, &figure) in row.iter().zip(&figures) {
                match entry {
                    Entry::Text(text) => {
                        line.push(text.clone());
                        line.extend(vec![String::new(); if figure { 2 } else { 0 }]);
                    }
                    Entry::Figure(figure) => {
                        line.extend([figure.mean(), figure.spread(), figure.printed].map(number));
                    }
                }
            }
            fields.push(line);
        }
        csv(&fields)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figure(values: &[f64], printed: Option<f64>) -> Figure {
        Figure {
            values: values.to_vec(),
            printed,
            digits: 1,
            rate: true,
        }
    }

    #[test]
    fn a_rate_stands_beside_the_printed_one_and_stands_out_where_it_is_far_below() {
        let near = Entry::Figure(figure(&[80.0, 90.0], Some(89.9)));
        assert_eq!(near.markdown(), "85.0 ± 7.1 (89.9)");
        let far = Entry::Figure(figure(&[80.0], Some(89.9)));
        assert_eq!(far.markdown(), "**80.0** (89.9)");
        assert!(far.html().contains("class=\"below\""));
        assert_eq!(Entry::Figure(figure(&[], Some(50.0))).markdown(), "– (50)");
        assert_eq!(Entry::Figure(figure(&[50.0], None)).markdown(), "50.0");
    }

    #[test]
    fn csv_has_a_field_for_each_name_whatever_stands_in_the_rows() {
        let mut sheet = Sheet::new("t", "n", &["model", "rate"]);
        sheet.rows.push(vec![
            Entry::Text("a, b".into()),
            Entry::Figure(figure(&[1.0, 2.0], Some(3.0))),
        ]);
        sheet
            .rows
            .push(vec![Entry::Text("c".into()), Entry::Text("none".into())]);
        let csv = sheet.csv();
        assert_eq!(csv.lines().next(), Some("model,rate,rate: spread,rate: paper"));
        assert_eq!(csv.lines().nth(2), Some("c,none,,"));
        assert!(
            csv.lines()
                .nth(1)
                .is_some_and(|line| line.starts_with("\"a, b\",1.5,0.7"))
        );
    }
}
