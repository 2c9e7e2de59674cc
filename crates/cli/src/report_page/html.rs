//! HTML that can't be broken by what it quotes: text becomes [`Html`] by being escaped, and in no other way.

use std::fmt::{self, Write};

use base64::{Engine, engine::general_purpose::STANDARD as BASE64};

use crate::report::steers;

/// A piece of a page, well-formed by itself.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Html(String);

impl Html {
    /// Markup of our own, which quotes nothing.
    pub(super) fn markup(markup: &'static str) -> Self {
        Self(markup.into())
    }

    /// A text of ours, or one that a number was put into.
    pub(super) fn text(text: impl AsRef<str>) -> Self {
        let mut html = String::new();
        for c in text.as_ref().chars() {
            match c {
                '&' => html.push_str("&amp;"),
                '<' => html.push_str("&lt;"),
                '>' => html.push_str("&gt;"),
                '"' => html.push_str("&quot;"),
                '\'' => html.push_str("&#39;"),
                // Elements stand in lines of their own, texts in theirs.
                '\n' => html.push('\n'),
                c if steers(c) => html.push('\u{fffd}'),
                c => html.push(c),
            }
        }
        Self(html)
    }

    /// A text from a file, or a file's name: it can't change the direction or the look of what stands around it.
    pub(super) fn foreign(text: impl AsRef<str>) -> Self {
        Self::text(text).within("bdi", None)
    }

    /// A number of many digits, which may be broken between groups of them.
    pub(super) fn digits(digits: &str) -> Self {
        let groups: Vec<String> = digits
            .as_bytes()
            .chunks(8)
            .map(|group| Self::text(String::from_utf8_lossy(group)).0)
            .collect();
        Self(groups.join("<wbr>")).within("code", None)
    }

    /// 10ⁿ.
    pub(super) fn power_of_ten(exponent: i32) -> Self {
        let sign = if exponent < 0 { "\u{2212}" } else { "" };
        Self(format!("10<sup>{sign}{}</sup>", exponent.abs()))
    }

    /// A picture that is in the page itself.
    pub(super) fn picture(png: &[u8], class: &'static str, what: &str) -> Self {
        let data = BASE64.encode(png);
        let Self(what) = Self::text(what);
        Self(format!(
            "<img class=\"{class}\" src=\"data:image/png;base64,{data}\" alt=\"{what}\">"
        ))
    }

    /// This inside an element.
    pub(super) fn within(self, element: &'static str, class: Option<&'static str>) -> Self {
        match class {
            Some(class) => Self(format!("<{element} class=\"{class}\">{self}</{element}>")),
            None => Self(format!("<{element}>{self}</{element}>")),
        }
    }

    /// This inside an element that links lead to.
    pub(super) fn named(self, element: &'static str, anchor: usize) -> Self {
        Self(format!("<{element} id=\"suspect-{anchor}\">{self}</{element}>"))
    }

    /// A link to what is [named](Self::named) so.
    pub(super) fn link(self, anchor: usize) -> Self {
        Self(format!("<a href=\"#suspect-{anchor}\">{self}</a>"))
    }

    pub(super) fn push(&mut self, other: &Self) {
        self.0.push_str(&other.0);
    }

    /// Both, one behind the other.
    pub(super) fn and(mut self, other: Self) -> Self {
        self.push(&other);
        self
    }
}

impl fmt::Display for Html {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl FromIterator<Html> for Html {
    fn from_iter<I: IntoIterator<Item = Html>>(pieces: I) -> Self {
        let mut all = Self::default();
        pieces.into_iter().for_each(|piece| all.push(&piece));
        all
    }
}

/// A table of two columns: what, and how it is.
#[derive(Default)]
pub(super) struct Facts(Vec<Html>);

impl Facts {
    pub(super) fn add(&mut self, what: &'static str, how: Html) {
        let head = Html::markup(what).within("th", None);
        self.0.push(head.and(how.within("td", None)).within("tr", None));
    }

    pub(super) fn table(self) -> Html {
        self.0
            .into_iter()
            .collect::<Html>()
            .within("table", Some("facts"))
    }
}

/// A table with a line of headings.
pub(super) fn table(class: &'static str, heads: &[&'static str], rows: Vec<Vec<Html>>) -> Html {
    let row = |cells: Vec<Html>, element| -> Html {
        let cells: Html = cells.into_iter().map(|cell| cell.within(element, None)).collect();
        cells.within("tr", None)
    };
    let heads = row(heads.iter().map(|head| Html::markup(head)).collect(), "th").within("thead", None);
    let rows: Html = rows.into_iter().map(|cells| row(cells, "td")).collect();
    heads.and(rows.within("tbody", None)).within("table", Some(class))
}

/// The whole file: a page that loads nothing and runs nothing.
pub(super) fn document(title: &Html, style: &'static str, body: &Html) -> String {
    let mut html = String::new();
    // Writing into memory does not fail.
    let _ = write!(
        html,
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; style-src 'unsafe-inline'\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<meta name=\"color-scheme\" content=\"light dark\">\n\
         <title>{title}</title>\n<style>\n{style}</style>\n</head>\n<body>\n{body}\n</body>\n</html>\n"
    );
    html
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_text_becomes_markup() {
        let evil = "<script>alert('x')</script> & \"quotes\"";
        let html = Html::foreign(evil).to_string();
        assert_eq!(
            html,
            "<bdi>&lt;script&gt;alert(&#39;x&#39;)&lt;/script&gt; &amp; &quot;quotes&quot;</bdi>"
        );
        let alt = Html::picture(b"png", "view", "\"><script>").to_string();
        assert!(alt.ends_with("alt=\"&quot;&gt;&lt;script&gt;\">"), "{alt}");
    }

    #[test]
    fn texts_from_outside_change_neither_direction_nor_lines_around_them() {
        assert_eq!(
            Html::text("a\u{202e}b\u{7}c\u{200b}").to_string(),
            "a\u{fffd}b\u{fffd}c\u{fffd}"
        );
        assert_eq!(Html::text("注文 № 4711 «é»").to_string(), "注文 № 4711 «é»");
    }

    #[test]
    fn long_numbers_are_copied_whole_and_broken_between_groups() {
        assert_eq!(
            Html::digits("0123456789abcdef").to_string(),
            "<code>01234567<wbr>89abcdef</code>"
        );
        assert_eq!(Html::power_of_ten(-12).to_string(), "10<sup>\u{2212}12</sup>");
    }
}
