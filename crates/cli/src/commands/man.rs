use std::{fs, path::PathBuf};

use anyhow::{Context, Result};
use clap::{Command, CommandFactory};
use clap_mangen::{
    Man as Page,
    roff::{Roff, roman},
};

use crate::{
    Answer,
    args::{Arguments, Man},
    files::{self, Output},
};

pub(crate) fn run(arguments: &Man) -> Result<Answer> {
    let folder = &arguments.folder;
    fs::create_dir_all(folder).with_context(|| {
        format!(
            "{}: this folder can't be made; choose another, or allow it with chmod",
            folder.display()
        )
    })?;
    let mut command = Arguments::command().disable_help_subcommand(true);
    command.build();
    let pages: Vec<(PathBuf, Vec<u8>)> = pages(&command)?
        .into_iter()
        .map(|(name, page)| (folder.join(name), page))
        .collect();
    for (path, _) in &pages {
        files::check_free(path, arguments.force)?;
    }
    let outputs: Vec<Output<'_>> = pages
        .iter()
        .map(|(path, page)| Output::public((path, page)))
        .collect();
    files::write_together(&outputs, arguments.force)?;
    Ok(Answer::Yes)
}

/// The page of a command and those of the commands in it, by the names of their files.
fn pages(command: &Command) -> Result<Vec<(String, Vec<u8>)>> {
    let source = concat!("sigmark ", env!("CARGO_PKG_VERSION"));
    let page = Page::new(command.clone()).manual("Sigmark").source(source);
    let mut text = Vec::new();
    page.render_title(&mut text)?;
    page.render_name_section(&mut text)?;
    page.render_synopsis_section(&mut text)?;
    page.render_description_section(&mut text)?;
    page.render_options_section(&mut text)?;
    if command.has_subcommands() {
        page.render_subcommands_section(&mut text)?;
    }
    details(
        &command
            .get_after_help()
            .map(ToString::to_string)
            .unwrap_or_default(),
    )
    .to_writer(&mut text)?;
    let mut pages = vec![(page.get_filename(), in_ascii(&text))];
    for inner in command.get_subcommands().filter(|inner| !inner.is_hide_set()) {
        pages.append(&mut self::pages(inner)?);
    }
    Ok(pages)
}

/// Other letters by their numbers, so that every formatter reads them, whatever it takes a file's encoding for.
fn in_ascii(text: &[u8]) -> Vec<u8> {
    let letter = |c: char| match c {
        c if c.is_ascii() => c.to_string(),
        c => format!("\\[u{:04X}]", u32::from(c)),
    };
    String::from_utf8_lossy(text)
        .chars()
        .map(letter)
        .collect::<String>()
        .into_bytes()
}

/// What stands below the options in the help: examples, and the rest. Indented lines stay as they are.
fn details(help: &str) -> Roff {
    let mut roff = Roff::new();
    let mut in_notes = false;
    for paragraph in help
        .split("\n\n")
        .filter(|paragraph| !paragraph.trim().is_empty())
    {
        let (head, _) = paragraph.split_once('\n').unwrap_or((paragraph, ""));
        let is_example = head == "Example:" || head == "A first session:";
        if is_example {
            roff.control("SH", ["EXAMPLES"]);
        } else if !in_notes {
            in_notes = true;
            roff.control("SH", ["NOTES"]);
        } else {
            roff.control("PP", []);
        }
        let mut in_code = false;
        for line in paragraph.lines().skip(usize::from(is_example)) {
            if line.starts_with("  ") != in_code {
                in_code = !in_code;
                roff.control(if in_code { "nf" } else { "fi" }, []);
            }
            roff.text([roman(line)]);
        }
        if in_code {
            roff.control("fi", []);
        }
    }
    roff
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_are_told_by_their_numbers() {
        assert_eq!(in_ascii("α × ©".as_bytes()), b"\\[u03B1] \\[u00D7] \\[u00A9]");
    }

    #[test]
    fn examples_keep_their_lines() {
        let roff = details("Example:\n  sigmark a \\\n      b\n\nMore.\nAnd more.\n\nLast.").render();
        let body = &roff[roff.find(".SH").unwrap()..];
        assert_eq!(
            body,
            ".SH EXAMPLES\n.nf\n  sigmark a \\\\\n      b\n.fi\n.SH NOTES\nMore.\nAnd more.\n.PP\nLast.\n"
        );
    }
}
