//! Running other programs.

use std::{
    path::{Path, PathBuf},
    process::{Command, ExitStatus, Output, Stdio},
    thread,
    time::Duration,
};

use anyhow::{Context, Result, bail};

use crate::machine;

/// Runs a program to its end and gives what it printed. Its standard error is shown only if it fails.
pub fn output(command: &mut Command) -> Result<String> {
    let ended = ended(command)?;
    printed(command, ended)
}

/// As [`output`], but `None` of a program that was stopped because it had taken `seconds` of CPU time. Without a Unix shell there is
/// no limit.
pub fn output_within(seconds: u64, program: &Command) -> Result<Option<String>> {
    let limited = format!("ulimit -S -t {seconds} && exec \"$@\"");
    let mut command = Command::new("sh");
    command.arg("-c").arg(limited).arg("sh");
    command.arg(program.get_program()).args(program.get_args());
    command.envs(
        program
            .get_envs()
            .filter_map(|(name, value)| Some((name, value?))),
    );
    let ended = ended(&mut command)?;
    if ran_out(ended.status) {
        return Ok(None);
    }
    printed(program, ended).map(Some)
}

fn ended(command: &mut Command) -> Result<Output> {
    let ended = command.stdin(Stdio::null()).output();
    ended.with_context(|| format!("{command:?}: can't be started"))
}

fn printed(
    command: &Command,
    Output {
        status,
        stdout,
        stderr,
    }: Output,
) -> Result<String> {
    if !status.success() {
        bail!(
            "{command:?}: {status}\n{}",
            String::from_utf8_lossy(&stderr).trim_end()
        );
    }
    Ok(String::from_utf8_lossy(&stdout).into_owned())
}

/// Runs a program, whatever it prints, and watches how much memory it holds: the most, in bytes; `None` where the system does
/// not say.
pub fn peak_memory(command: &mut Command) -> Result<Option<u64>> {
    const INTERVAL: Duration = Duration::from_micros(200);
    let shown = format!("{command:?}");
    let mut child = command
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .with_context(|| format!("{shown}: can't be started"))?;
    let mut peak = None;
    loop {
        if let Some(status) = child.try_wait()? {
            if !status.success() {
                bail!("{shown}: {status}");
            }
            return Ok(peak);
        }
        peak = peak.max(machine::peak_memory_of(child.id()));
        thread::sleep(INTERVAL);
    }
}

/// Whether a program ended because its CPU time was used up.
fn ran_out(status: ExitStatus) -> bool {
    #[cfg(unix)]
    {
        use std::os::unix::process::ExitStatusExt;
        const SIGXCPU: i32 = 24;
        status.signal() == Some(SIGXCPU)
    }
    #[cfg(not(unix))]
    {
        let _ = status;
        false
    }
}

/// The root of the repository.
pub fn root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.ancestors().nth(2).unwrap_or(here).to_path_buf()
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn a_program_that_takes_too_long_is_stopped_and_others_are_heard() {
        let mut endless = Command::new("sh");
        endless.args(["-c", "while :; do :; done"]);
        assert_eq!(output_within(1, &endless).unwrap(), None);
        let mut short = Command::new("sh");
        short.args(["-c", "echo $WORD"]).env("WORD", "done");
        assert_eq!(output_within(9, &short).unwrap().as_deref(), Some("done\n"));
        let mut wrong = Command::new("sh");
        wrong.args(["-c", "exit 3"]);
        assert!(output_within(9, &wrong).is_err());
    }
}
