//! The command line read, and what is wrong with it said in one line.

use std::ffi::OsString;

use clap::{CommandFactory, Parser, error::ErrorKind};

use crate::{args::Arguments, report};

/// The arguments; or, where there is nothing to run, the exit code: help was shown, or the command line is wrong.
pub(crate) fn parse(command_line: &[OsString]) -> Result<Arguments, u8> {
    Arguments::try_parse_from(command_line).map_err(|error| match error.kind() {
        ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => {
            // A reader that went away has read enough.
            let _ = error.print();
            0
        }
        ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
            let _ = error.print();
            2
        }
        _ => {
            let (words, help) = (in_one_line(&error.to_string()), help_of(command_line));
            report::failure(&anyhow::anyhow!("{words}; see `{help}`"));
            2
        }
    })
}

/// What shows the help of the command that was asked for, or of one of its commands.
fn help_of(command_line: &[OsString]) -> String {
    let (mut command, mut words) = (Arguments::command(), String::from("sigmark "));
    for word in command_line.iter().skip(1) {
        let Some(next) = command.find_subcommand(word).cloned() else {
            break;
        };
        words += &format!("{} ", next.get_name());
        command = next;
    }
    words + "--help"
}

/// What the parser says in paragraphs, without its usage and its pointer to the help.
fn in_one_line(message: &str) -> String {
    let end = ["\n\nUsage:", "\n\nFor more information"]
        .iter()
        .filter_map(|mark| message.find(mark))
        .min()
        .unwrap_or(message.len());
    let paragraphs: Vec<String> = message[..end]
        .trim_start_matches("error: ")
        .split("\n\n")
        .map(|paragraph| {
            let mut lines = paragraph.lines().map(str::trim);
            let first = lines.next().unwrap_or_default();
            let rest: Vec<&str> = lines.collect();
            if rest.is_empty() {
                first.into()
            } else {
                format!("{first} {}", rest.join(", "))
            }
        })
        .collect();
    paragraphs.join("; ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Arguments::command().debug_assert();
    }

    /// The words of an example: up to a comment, what it is piped into, or what is left out.
    fn words(example: &str) -> Vec<String> {
        let end = ["  ", " # ", " > ", " >> ", " …"]
            .iter()
            .filter_map(|mark| example.find(mark))
            .min();
        let (mut words, mut is_quoted) = (vec![String::new()], false);
        for c in example[..end.unwrap_or(example.len())].chars() {
            match c {
                '"' => is_quoted = !is_quoted,
                ' ' if !is_quoted => words.push(String::new()),
                c => words.last_mut().unwrap().push(c),
            }
        }
        words
    }

    #[test]
    fn every_example_in_the_help_is_a_command_line() {
        let mut commands = vec![Arguments::command()];
        let mut tried = 0;
        while let Some(command) = commands.pop() {
            commands.extend(command.get_subcommands().cloned());
            let help = command
                .get_after_help()
                .map(ToString::to_string)
                .unwrap_or_default();
            assert!(
                !help.is_empty() || command.get_name() == "help",
                "{} has no example",
                command.get_name()
            );
            let help = help.replace("\\\n      ", "");
            for example in help
                .lines()
                .filter_map(|line| line.strip_prefix("  "))
                .filter(|line| line.starts_with("sigmark "))
            {
                if let Err(error) = Arguments::try_parse_from(words(example)) {
                    panic!("{example}: {error}");
                }
                tried += 1;
            }
        }
        assert!(tried >= 20, "{tried}");
    }

    #[test]
    fn the_parsers_paragraphs_become_one_line() {
        let message = "error: the following required arguments were not provided:\n  --output <FILE>\n  --key <PEM>\n\n\
                       Usage: sigmark embed <MODEL>\n\nFor more information, try '--help'.\n";
        assert_eq!(
            in_one_line(message),
            "the following required arguments were not provided: --output <FILE>, --key <PEM>"
        );
        let message = "error: unrecognized subcommand 'embd'\n\n  tip: a similar subcommand exists: 'embed'\n\nUsage: sigmark <COMMAND>\n";
        assert_eq!(
            in_one_line(message),
            "unrecognized subcommand 'embd'; tip: a similar subcommand exists: 'embed'"
        );
    }
}
