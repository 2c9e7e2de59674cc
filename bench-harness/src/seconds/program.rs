//! The program `sigmark` in a process of its own: what it says, how long it takes, how much memory it holds.

use std::{
    env::{self, consts::EXE_SUFFIX},
    fs,
    path::PathBuf,
    process::{Command, Output, Stdio},
    sync::atomic::{AtomicBool, Ordering},
    thread,
    time::{Duration, Instant},
};

use anyhow::{Context, Result, bail, ensure};
use evaluation::{machine, sources};
use serde::{Deserialize, Serialize};

use crate::measure::median;

/// With so many threads it runs everywhere, so that machines can be compared.
pub(super) const THREADS: usize = 2;

/// The program as it was built.
pub(super) struct Sigmark {
    path: PathBuf,
}

/// What the program prints as JSON, as far as it is shown.
#[derive(Deserialize)]
pub(super) struct Report {
    /// Of a verification.
    pub(super) outcome: Option<String>,
    pub(super) extraction_rate: Option<f64>,
    /// Of an embedding.
    pub(super) patches: Option<usize>,
    /// Of a verification, where the program says it.
    pub(super) patches_read: Option<usize>,
}

/// What a run of the program took.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Spent {
    /// Seconds from its beginning to its end.
    pub(super) wall: f64,
    /// Seconds of user and system time of all threads; none where the system does not say.
    pub(super) cpu: Option<f64>,
    /// The most memory that it held, in bytes; none where the system does not say.
    pub(super) memory: Option<u64>,
}

impl Sigmark {
    /// The program that was built into the same folder as this one.
    pub(super) fn beside_this_program() -> Result<Self> {
        let path = env::current_exe()?.with_file_name(format!("sigmark{EXE_SUFFIX}"));
        ensure!(
            path.is_file(),
            "{}: is not there; make it with `cargo build --release -p sigmark-cli`",
            path.display()
        );
        Ok(Self { path })
    }

    /// Of its bytes.
    pub(super) fn digest(&self) -> Result<String> {
        let bytes = fs::read(&self.path).with_context(|| self.path.display().to_string())?;
        Ok(sources::digest(&bytes))
    }

    /// A command of the program, such as `verify`, to which its own arguments are added.
    pub(super) fn command(&self, name: &str) -> Command {
        let mut command = Command::new(&self.path);
        command.arg(name);
        command
    }
}

/// Runs a command that takes a number of threads, so many times. Reports are alike; the last is given.
pub(super) fn run(command: &mut Command, rounds: usize) -> Result<(Report, Spent)> {
    command.args(["--json", "--threads", &THREADS.to_string()]);
    let (report, first) = run_once(command)?;
    let mut spent = vec![first];
    for _ in 1..rounds {
        spent.push(run_once(command)?.1);
    }
    Ok((report, Spent::over(&spent)))
}

fn run_once(command: &mut Command) -> Result<(Report, Spent)> {
    let (output, spent) = watched(command)?;
    // The answer no is an answer.
    if !matches!(output.status.code(), Some(0 | 1)) {
        let said = String::from_utf8_lossy(&output.stderr);
        bail!("{command:?}: {}\n{}", output.status, said.trim_end());
    }
    let report = serde_json::from_slice(&output.stdout).with_context(|| format!("{command:?}"))?;
    Ok((report, spent))
}

/// Runs a program to its end. No other child process may end meanwhile: its seconds would be among these.
fn watched(command: &mut Command) -> Result<(Output, Spent)> {
    // The most that was held until now is what the system tells, so that only the last of these is lost.
    const INTERVAL: Duration = Duration::from_millis(5);
    let (begin, before) = (Instant::now(), machine::cpu_of_children());
    let child = command
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn();
    let child = child.with_context(|| format!("{command:?}: can't be started"))?;
    let (process, is_over) = (child.id(), AtomicBool::new(false));
    let most_memory = || {
        let mut most = None;
        while !is_over.load(Ordering::Relaxed) {
            most = most.max(machine::peak_memory_of(process));
            thread::sleep(INTERVAL);
        }
        most
    };
    thread::scope(|scope| {
        let watcher = scope.spawn(most_memory);
        let output = child.wait_with_output();
        let wall = begin.elapsed().as_secs_f64();
        is_over.store(true, Ordering::Relaxed);
        let cpu = before
            .zip(machine::cpu_of_children())
            .map(|(before, after)| after - before);
        let memory = watcher.join().unwrap_or_default();
        Ok((output?, Spent { wall, cpu, memory }))
    })
}

impl Spent {
    /// The medians of the seconds, and the most memory of any round.
    fn over(rounds: &[Self]) -> Self {
        let cpu: Option<Vec<f64>> = rounds.iter().map(|spent| spent.cpu).collect();
        Self {
            wall: median(rounds.iter().map(|spent| spent.wall)),
            cpu: cpu.map(median),
            memory: rounds.iter().filter_map(|spent| spent.memory).max(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(target_os = "linux")]
    #[test]
    fn a_program_is_heard_and_its_seconds_and_its_memory_are_known() {
        let mut busy = Command::new("sh");
        let (output, spent) = watched(busy.args(["-c", "ulimit -S -t 1; while :; do :; done"])).unwrap();
        assert!(!output.status.success());
        assert!(spent.wall > 0.9 && spent.cpu.unwrap() > 0.9, "{spent:?}");
        assert!(spent.memory.unwrap() > 100_000, "{spent:?}");
        let (output, _) = watched(Command::new("sh").args(["-c", "echo done"])).unwrap();
        assert_eq!(output.stdout, b"done\n");
    }

    #[test]
    fn of_many_rounds_there_are_the_middle_times_and_the_most_memory() {
        let spent = |wall, cpu, memory| Spent { wall, cpu, memory };
        let rounds = [
            spent(3.0, Some(5.0), Some(7)),
            spent(1.0, Some(2.0), Some(9)),
            spent(2.0, Some(4.0), None),
        ];
        assert_eq!(Spent::over(&rounds), spent(2.0, Some(4.0), Some(9)));
        assert_eq!(
            Spent::over(&[rounds[0], spent(1.0, None, None)]),
            spent(2.0, None, Some(7))
        );
    }
}
