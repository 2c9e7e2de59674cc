//! How somebody else comes to the same answer: commands to be typed.

use std::path::Path;

use crate::{
    args::{Profile, Verify},
    claims::{Claim, ReadFile},
};

/// The lines that `sha256sum -c` reads.
pub(super) fn checksums<'a>(files: impl IntoIterator<Item = &'a ReadFile>) -> String {
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
pub(super) fn command(arguments: &Verify, claim: &Claim, suspects: &[&Path]) -> String {
    let mut words = vec!["sigmark".into(), "verify".into()];
    words.extend(suspects.iter().map(|path| quoted(path)));
    let mut option = |name: &str, path: Option<&Path>| {
        words.extend(path.map(|path| format!("\\\n    {name} {}", quoted(path))));
    };
    option("--certificate", Some(&arguments.certificate));
    option("--original", Some(&claim.original_path));
    option("--public-key", arguments.public_key.as_deref());
    option("--stamp-roots", arguments.stamp_roots.as_deref());
    if arguments.dispute {
        words.push("--dispute".into());
    }
    if arguments.profile == Some(Profile::Paper) {
        words.push("--profile paper".into());
    }
    if arguments.p_bound != 1e-6 {
        words.push(format!("--p-bound {:e}", arguments.p_bound));
    }
    words.join(" ")
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
