//! Completions, manual pages, and what a terminal is sent.

#![allow(clippy::unwrap_used)] // in the helpers of tests, too

use crate::common::Folder;

const COMMANDS: [&str; 11] = [
    "keygen",
    "embed",
    "verify",
    "stamp",
    "dispute",
    "align",
    "compare",
    "inspect",
    "spectrum",
    "partition",
    "completions",
];

#[test]
fn completions_know_every_command_in_every_shell() {
    let folder = Folder::empty();
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let script = folder.done(&format!("completions {shell}")).out;
        for command in COMMANDS {
            assert!(script.contains(command), "{shell}: {command}");
        }
        assert!(
            script.contains("dispute") && script.contains("stamp-roots"),
            "{shell}"
        );
    }
    folder.refused(
        "completions tcsh",
        &["tcsh", "bash, elvish, fish, powershell, zsh"],
    );
    #[cfg(target_os = "linux")]
    if let Ok(mut bash) = std::process::Command::new("bash")
        .args(["-n"])
        .stdin(std::process::Stdio::piped())
        .spawn()
    {
        let script = folder.done("completions bash").out;
        std::io::Write::write_all(&mut bash.stdin.take().unwrap(), script.as_bytes()).unwrap();
        assert!(bash.wait().unwrap().success());
    }
}

#[test]
fn every_command_has_a_manual_page() {
    let folder = Folder::empty();
    folder.done("man share/man1");
    let whole = folder.text("share/man1/sigmark.1");
    for command in COMMANDS {
        assert!(whole.contains(&format!("sigmark\\-{command}(1)")), "{command}");
        let page = folder.text(&format!("share/man1/sigmark-{command}.1"));
        for section in [".SH NAME", ".SH SYNOPSIS", ".SH OPTIONS", ".SH EXAMPLES"] {
            // The steps of stamp have options, it has none itself but --help.
            assert!(page.contains(section), "{command}: {section}");
        }
        assert!(page.is_ascii(), "{command}");
    }
    let step = folder.text("share/man1/sigmark-stamp-attach.1");
    assert!(step.contains("\\-\\-json"), "{step}");
    assert!(!whole.contains("sigmark\\-man(1)"));
    folder.refused("man share/man1", &["exists already", "--force"]);
    folder.done("man share/man1 --force");

    let names = std::fs::read_dir(folder.path("share/man1")).unwrap();
    for page in names.map(|entry| entry.unwrap().path()) {
        let mut groff = std::process::Command::new("groff");
        // Where there is no groff there is nobody to complain.
        if let Ok(output) = groff.args(["-man", "-Tutf8", "-ww", "-z"]).arg(&page).output() {
            assert!(
                output.status.success() && output.stderr.is_empty(),
                "{}: {output:?}",
                page.display()
            );
        }
    }
}

#[test]
fn nothing_but_text_goes_into_a_pipe() {
    let folder = Folder::with_signed_model();
    for line in [
        "--help",
        "embed --help",
        "",
        "embd",
        "inspect model.ply",
        "verify signed.ply --certificate signed.ply.cert.json",
        "spectrum model.ply -k 200",
        "completions fish",
    ] {
        let run = folder.run(line);
        assert!(
            !run.out.contains('\x1b') && !run.err.contains('\x1b'),
            "sigmark {line}: {run:?}"
        );
        assert!(
            !run.out.contains('\r') && !run.err.contains('\r'),
            "sigmark {line}: {run:?}"
        );
    }
}

/// What is sent to a terminal by a command line.
#[cfg(target_os = "linux")]
fn on_a_terminal(folder: &Folder, line: &str, no_colour: bool) -> Option<String> {
    let mut command = std::process::Command::new("script");
    let line = format!("{} {line}", env!("CARGO_BIN_EXE_sigmark"));
    command
        .args(["-qec", &line, "/dev/null"])
        .current_dir(folder.path(""))
        .stdin(std::process::Stdio::null());
    command
        .env("TERM", "xterm-256color")
        .env_remove("NO_COLOR")
        .env_remove("CLICOLOR")
        .env_remove("CLICOLOR_FORCE");
    if no_colour {
        command.env("NO_COLOR", "1");
    }
    // Not every system has script.
    Some(String::from_utf8_lossy(&command.output().ok()?.stdout).into_owned())
}

/// Whether a text sets a colour or another look: ESC [ … m.
#[cfg(target_os = "linux")]
fn is_coloured(text: &str) -> bool {
    text.split("\x1b[").skip(1).any(|rest| {
        let end = rest.find(|c: char| !(c.is_ascii_digit() || c == ';'));
        end.is_some_and(|end| rest[end..].starts_with('m'))
    })
}

#[cfg(target_os = "linux")]
#[test]
fn a_terminal_has_colours_and_a_bar_unless_it_asks_for_none() {
    let folder = Folder::empty();
    folder.write_mesh(
        "large.ply",
        &mesh::shapes::bumpy_sphere(6, 1),
        mesh_io::Precision::Single,
    );
    folder.done("keygen -o owner.pem");
    let Some(help) = on_a_terminal(&folder, "--help", false) else {
        return;
    };
    assert!(is_coloured(&help), "{help:?}");
    let help = on_a_terminal(&folder, "--help", true).unwrap();
    assert!(help.contains("keygen") && !is_coloured(&help), "{help:?}");
    let embed = "embed large.ply -o signed.ply -k owner.pem --force --patches 2 --threads 1";
    let bar = on_a_terminal(&folder, embed, false).unwrap();
    assert!(
        bar.contains(" %  ") && bar.contains("Signed large.ply"),
        "{bar:?}"
    );
    let bar = on_a_terminal(&folder, embed, true).unwrap();
    assert!(bar.contains("Signed large.ply") && !is_coloured(&bar), "{bar:?}");
}
