//! How somebody else comes to the same answer: commands to be typed.

use std::path::{Path, PathBuf};

use super::html::Html;
use crate::{
    args::{Profile, Trace, Verify},
    claims::{Claim, ReadFile},
};

/// How somebody else repeats a command on these files.
pub(super) fn steps<'a>(files: impl IntoIterator<Item = &'a ReadFile>, command: String) -> Html {
    let sums = format!("sha256sum -c <<'FILES'\n{}FILES", checksums(files));
    let version = format!(
        "sigmark --version        # this page was made by sigmark {}",
        env!("CARGO_PKG_VERSION")
    );
    let pre = |text: String| Html::text(text).within("pre", None);
    let step = |text: &'static str, command: Html| Html::markup(text).and(command).within("li", None);
    let steps: Html = [
        step("The same program:", pre(version)),
        step(
            "The same files (on a Mac, <code>shasum -a 256 -c</code>):",
            pre(sums),
        ),
        step("The same question:", pre(command)),
    ]
    .into_iter()
    .collect();
    let place = "In the folder in which it was done, or with other paths to the same files:";
    let note = "The answer and all numbers come out the same, on any number of processors.";
    Html::markup("How to repeat this")
        .within("h2", None)
        .and(Html::markup(place).within("p", None))
        .and(steps.within("ol", None))
        .and(Html::markup(note).within("p", Some("note")))
}

/// The lines that `sha256sum -c` reads.
fn checksums<'a>(files: impl IntoIterator<Item = &'a ReadFile>) -> String {
    files.into_iter().map(|file| checksum(file) + "\n").collect()
}

fn checksum(file: &ReadFile) -> String {
    let name = file.path.display().to_string();
    // As sha256sum itself writes names that would break its lines.
    let escaped = name
        .replace('\\', "\\\\")
        .replace('\n', "\\n")
        .replace('\r', "\\r");
    let mark = if escaped == name { "" } else { "\\" };
    format!("{mark}{}  {escaped}", hex(&file.sha256))
}

pub(super) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// The command that was given, with every file by its name.
pub(super) fn verify(arguments: &Verify, claim: &Claim, suspects: &[&Path]) -> String {
    let mut words = begun("verify", suspects);
    words.extend(option("--certificate", [&arguments.certificate]));
    words.extend(option("--original", [&claim.original_path]));
    words.extend(option("--public-key", &arguments.public_key));
    words.extend(option("--stamp-roots", &arguments.stamp_roots));
    if arguments.dispute {
        words.push("--dispute".into());
    }
    if arguments.profile == Some(Profile::Paper) {
        words.push("--profile paper".into());
    }
    if arguments.p_bound != 1e-6 {
        words.push(format!("--p-bound {:e}", arguments.p_bound));
    }
    words.extend(arguments.enough.map(|p| format!("--enough {p:e}")));
    words.join(" ")
}

/// The command that was given, likewise.
pub(super) fn trace(arguments: &Trace, suspects: &[&Path]) -> String {
    let mut words = begun("trace", suspects);
    words.extend(option("--original", [&arguments.original]));
    let certificates = arguments.certificates.iter();
    words.extend(certificates.filter_map(|path| option("--certificates", [path])));
    words.extend(option("--public-key", &arguments.public_key));
    if arguments.p_bound != 1e-5 {
        words.push(format!("--p-bound {:e}", arguments.p_bound));
    }
    words.join(" ")
}

fn begun(command: &str, suspects: &[&Path]) -> Vec<String> {
    let words = ["sigmark".into(), command.into()];
    words
        .into_iter()
        .chain(suspects.iter().map(|path| quoted(path)))
        .collect()
}

/// An option with its paths, in a line of its own; none without.
fn option<'a>(name: &str, paths: impl IntoIterator<Item = &'a PathBuf>) -> Option<String> {
    let paths: Vec<String> = paths.into_iter().map(|path| quoted(path)).collect();
    (!paths.is_empty()).then(|| format!("\\\n    {name} {}", paths.join(" ")))
}

/// A path as one word of a shell, which is no option.
fn quoted(path: &Path) -> String {
    let mut text = path.display().to_string();
    if text.starts_with('-') {
        text.insert_str(0, "./");
    }
    let is_plain = |c: char| c.is_alphanumeric() || "/._-+,:@%=".contains(c);
    match !text.is_empty() && text.chars().all(is_plain) {
        true => text,
        false => format!("'{}'", text.replace('\'', r"'\''")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_one_word_of_a_shell() {
        for (path, word) in [
            ("models/a.obj", "models/a.obj"),
            ("my model.obj", "'my model.obj'"),
            ("it's; rm -rf $HOME", r"'it'\''s; rm -rf $HOME'"),
            ("-o.obj", "./-o.obj"),
        ] {
            assert_eq!(quoted(Path::new(path)), word);
        }
    }

    #[test]
    fn checksums_are_lines_that_sha256sum_reads() {
        let file = ReadFile::of(Path::new("a\\b.obj"), b"");
        let empty = "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855";
        assert_eq!(checksums([&file]), format!("\\{empty}  a\\\\b.obj\n"));
    }
}
