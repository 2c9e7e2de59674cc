//! What fuzzing did, run by run, and the page that adds it up.

use std::{collections::BTreeMap, fmt, fs, fs::OpenOptions, io::Write, path::PathBuf};

use anyhow::{Context, Result};
use evaluation::{machine, process::root, table::Table};
use fuzzing::TARGETS;

const HEADER: &str = "target,commit,CPU seconds,inputs tried,edges,inputs kept,found";

/// One run of a target.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Run {
    target: String,
    commit: String,
    /// The processor's time, in seconds.
    pub(super) cpu_seconds: f64,
    /// How many inputs were tried.
    tried: u64,
    /// How many places of the program were reached.
    edges: u64,
    /// How many inputs are kept because each reached something new.
    kept: u64,
    /// Whether something broke.
    pub(super) found: bool,
}

impl Run {
    /// What libFuzzer's words say of a run of what was built at a commit; none where its last line is missing, or where it ended early and kept no
    /// input as the reason.
    pub(super) fn of(
        target: &str,
        commit: String,
        cpu_seconds: f64,
        said: &str,
        success: bool,
    ) -> Option<Self> {
        // It names the file of a slow input, too, and goes on.
        let found = !success && said.contains("Test unit written to");
        if !success && !found {
            return None;
        }
        // "#2097152 DONE   cov: 4021 ft: 15123 corp: 3034/1204Kb lim: 8192 exec/s: 3472 rss: 612Mb"; where it broke, "NEW" or "pulse".
        let last = said
            .lines()
            .rfind(|line| line.starts_with('#') && line.contains(" cov: "))?;
        let after = |name: &str| {
            let rest = last.split_once(name)?.1.trim_start();
            let digits = rest
                .find(|letter: char| !letter.is_ascii_digit())
                .unwrap_or(rest.len());
            rest[..digits].parse().ok()
        };
        Some(Self {
            target: target.into(),
            commit,
            cpu_seconds,
            tried: after("#")?,
            edges: after("cov:")?,
            kept: after("corp:")?,
            found,
        })
    }

    fn line(&self) -> String {
        let found = u8::from(self.found);
        format!(
            "{},{},{:.0},{},{},{},{found}",
            self.target, self.commit, self.cpu_seconds, self.tried, self.edges, self.kept
        )
    }

    fn parsed(line: &str) -> Option<Self> {
        let fields: Vec<_> = line.split(',').collect();
        let [target, commit, cpu_seconds, tried, edges, kept, found] = fields[..] else {
            return None;
        };
        Some(Self {
            target: target.into(),
            commit: commit.into(),
            cpu_seconds: cpu_seconds.parse().ok()?,
            tried: tried.parse().ok()?,
            edges: edges.parse().ok()?,
            kept: kept.parse().ok()?,
            found: found != "0",
        })
    }
}

impl fmt::Display for Run {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let found = if self.found {
            "something was found"
        } else {
            "nothing was found"
        };
        write!(
            formatter,
            "{}: {} inputs in {:.0} s of CPU, {} edges, {} inputs kept; {found}",
            self.target, self.tried, self.cpu_seconds, self.edges, self.kept
        )
    }
}

/// Adds a run to the record, and writes the page anew. Several programs may do so at once: a line is written in one piece.
pub(super) fn add(run: &Run) -> Result<()> {
    let path = list();
    let mut line = run.line() + "\n";
    if !path.exists() {
        line = format!("{HEADER}\n{line}");
    }
    let context = || path.display().to_string();
    let mut file = OpenOptions::new()
        .create(true)
        .append(true)
        .open(&path)
        .with_context(context)?;
    file.write_all(line.as_bytes()).with_context(context)?;
    let text = fs::read_to_string(&path).with_context(context)?;
    let runs: Vec<_> = text.lines().filter_map(Run::parsed).collect();
    fs::write(root().join("results/fuzzing.md"), page(&runs)).context("results/fuzzing.md")
}

fn list() -> PathBuf {
    root().join("results/fuzzing.csv")
}

fn page(runs: &[Run]) -> String {
    let header = [
        "target",
        "CPU minutes",
        "since something was found",
        "inputs tried (million)",
        "edges reached",
        "found",
        "commits",
    ];
    let mut table = Table::new("Readers of strangers' files under libFuzzer", header).text_columns(1);
    for target in TARGETS {
        let of: Vec<_> = runs.iter().filter(|run| run.target == target.name).collect();
        // The sum of nothing is -0.
        let minutes = |runs: &[&Run]| runs.iter().fold(0.0, |sum, run| sum + run.cpu_seconds / 60.0);
        let after_last = of.iter().rposition(|run| run.found).map_or(0, |last| last + 1);
        let tried: u64 = of.iter().map(|run| run.tried).sum();
        let edges = of.iter().map(|run| run.edges).max().unwrap_or(0);
        let found = of.iter().filter(|run| run.found).count();
        let mut commits = BTreeMap::new();
        for run in &of {
            *commits.entry(&run.commit[..]).or_insert(0.0) += run.cpu_seconds / 60.0;
        }
        let commits: Vec<_> = commits
            .iter()
            .map(|(commit, minutes)| format!("{commit} ({minutes:.0})"))
            .collect();
        table.row([
            target.name.to_owned(),
            format!("{:.0}", minutes(&of)),
            format!("{:.0}", minutes(&of[after_last..])),
            format!("{:.1}", tried as f64 / 1e6),
            edges.to_string(),
            found.to_string(),
            commits.join(", "),
        ]);
    }
    format!(
        "# Fuzzing\n\nWritten by `cargo xtask fuzz --record --minutes N --assets DIR`, run by run, and added up: every target of \
         [crates/fuzzing](../crates/fuzzing/src/lib.rs) begins with its seeds and the small files of a folder of assets, and goes on with what it \
         found to be new, under AddressSanitizer. An input breaks a target when a reader panics, takes {} MiB for one allocation or {} s, or what \
         must hold of its answer does not. Minutes are the processor's, by the commit that was fuzzed. The last run was on: {}.\n\n{}",
        super::ALLOCATION_MIB,
        super::SECONDS,
        machine::description(),
        table.markdown()
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_of_a_run_are_understood_and_written_down() {
        let said = "INFO: Seed: 1\n#2\tINITED cov: 10 ft: 11 corp: 1/1b exec/s: 0 rss: 40Mb\n\
                    #2097152\tDONE   cov: 4021 ft: 15123 corp: 3034/1204Kb lim: 8192 exec/s: 3472 rss: 612Mb\nstat::average_exec_per_sec: 3\n";
        let run = Run::of("obj", "c0ffee".into(), 599.6, said, true).unwrap();
        assert_eq!(
            (run.tried, run.edges, run.kept, run.found),
            (2_097_152, 4021, 3034, false)
        );
        let read = Run::parsed(&run.line()).unwrap();
        assert_eq!(
            read,
            Run {
                cpu_seconds: 600.0,
                ..run
            }
        );
        assert_eq!(
            Run::of("obj", String::new(), 1.0, "error: no such command: `fuzz`", false),
            None
        );
    }

    #[test]
    fn only_an_input_that_was_kept_is_a_finding() {
        let said = "#4096\tpulse  cov: 12 ft: 13 corp: 5/9b exec/s: 9 rss: 40Mb\n";
        let kept = format!("{said}artifact_prefix='artifacts/'; Test unit written to artifacts/crash-12\n");
        assert!(Run::of("obj", String::new(), 1.0, &kept, false).unwrap().found);
        assert!(!Run::of("obj", String::new(), 1.0, &kept, true).unwrap().found);
        assert_eq!(
            Run::of("obj", String::new(), 1.0, said, false),
            None,
            "killed from outside"
        );
    }

    #[test]
    fn the_page_adds_up() {
        let run = |commit: &str, cpu_seconds, found| Run {
            target: "ply".into(),
            commit: commit.into(),
            cpu_seconds,
            tried: 1_500_000,
            edges: 7,
            kept: 5,
            found,
        };
        let page = page(&[
            run("a", 600.0, false),
            run("b", 300.0, true),
            run("a", 600.0, false),
        ]);
        assert!(
            page.contains("| ply | 25 | 10 | 4.5 | 7 | 1 | a (20), b (5) |"),
            "{page}"
        );
        assert!(page.contains("| obj | 0 | 0 | 0.0 | 0 | 0 |  |"), "{page}");
    }
}
