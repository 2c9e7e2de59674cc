//! What was measured of one solver, as table, summary and chart.

use evaluation::{chart::Chart, table::Table};

use super::{
    TOLERANCES,
    peers::EIGEN_PEERS,
    task::{EigenTask, SolveOutcome},
};
use crate::measure::{least, median};

pub(crate) const OURS: &str = "ours";
pub(crate) const OURS_ON_TWO: &str = "ours, 2 threads";

/// One computation, measured over the rounds.
pub(crate) struct SolveMeasurement {
    pub(crate) mesh: String,
    pub(crate) vertices: usize,
    pub(crate) task: EigenTask,
    pub(crate) solver: &'static str,
    pub(crate) outcome: SolveOutcome,
}

impl SolveMeasurement {
    /// Whether the residuals are what was asked for.
    fn converged(&self) -> bool {
        matches!(self.outcome, SolveOutcome::Done { residual, .. } if residual <= self.task.tolerance)
    }

    /// The CPU time over ours for the same task.
    fn ratio(&self, all: &[Self]) -> Option<f64> {
        let ours = |other: &&Self| other.solver == OURS && other.is_beside(self);
        let ours = all.iter().find(ours)?;
        Some(self.outcome.cpu() / ours.outcome.cpu())
    }

    fn is_beside(&self, other: &Self) -> bool {
        (&self.mesh, self.task) == (&other.mesh, other.task)
    }
}

/// A line a computation.
pub(crate) fn table(all: &[SolveMeasurement]) -> Table {
    let header = "mesh | n | pairs | tolerance | solver | CPU (s) | wall (s) | worst residual | CPU / ours";
    let mut table = Table::new("Lowest eigenpairs of S h = λ D h", header.split(" | "));
    for measured in all {
        let ratio = measured.ratio(all);
        let ratio = ratio.map_or_else(String::new, |ratio| format!("{ratio:.2}"));
        let figures = match measured.outcome {
            SolveOutcome::Done { cpu, wall, residual } => {
                let missed = match measured.converged() {
                    true => "",
                    false => ", not converged",
                };
                let residual = format!("{residual:.1e}{missed}");
                [format!("{cpu:.2}"), format!("{wall:.2}"), residual, ratio]
            }
            SolveOutcome::Stopped { after } => [
                format!("> {after:.0}"),
                String::new(),
                "stopped".into(),
                format!("> {ratio}"),
            ],
        };
        let first = [
            measured.mesh.clone(),
            measured.vertices.to_string(),
            measured.task.count.to_string(),
            format!("{:e}", measured.task.tolerance),
            measured.solver.into(),
        ];
        table.row(first.into_iter().chain(figures));
    }
    table
}

/// Medians over the tasks: how many times our CPU time each peer needs, at each tolerance; how much two threads gain.
pub(crate) fn summary(all: &[SolveMeasurement]) -> String {
    let mut text = String::new();
    for peer in &EIGEN_PEERS {
        for tolerance in TOLERANCES {
            let ratios: Vec<f64> = all
                .iter()
                .filter(|measured| measured.solver == peer.name && measured.task.tolerance == tolerance)
                .filter_map(|measured| measured.ratio(all))
                .collect();
            if !ratios.is_empty() {
                text += &format!(
                    "- {} at {tolerance:e} takes {:.1} times our CPU time (median of {} case(s); least {:.1})\n",
                    peer.name,
                    median(ratios.iter().copied()),
                    ratios.len(),
                    least(ratios.iter().copied()),
                );
            }
        }
    }
    let gains = all.iter().filter(|one| one.solver == OURS).filter_map(|one| {
        let beside = |two: &&SolveMeasurement| two.solver == OURS_ON_TWO && two.is_beside(one);
        let two = all.iter().find(beside)?;
        match (one.outcome, two.outcome) {
            (SolveOutcome::Done { wall: one, .. }, SolveOutcome::Done { wall: two, .. }) => Some(one / two),
            _ => None,
        }
    });
    text + &format!(
        "- two threads make ours {:.2} times faster by the clock (median)\n",
        median(gains)
    )
}

/// The first task, which all peers were given: ours, then the peers, the fastest first.
pub(crate) fn chart(all: &[SolveMeasurement]) -> Chart {
    let first = &all[0];
    let title = format!(
        "The {} lowest pairs of {} ({} vertices) to {:e}, one thread",
        first.task.count, first.mesh, first.vertices, first.task.tolerance
    );
    let mut chart = Chart::new(&title, "CPU seconds");
    let beside = |measured: &&SolveMeasurement| measured.is_beside(first) && measured.solver != OURS_ON_TWO;
    let mut shown: Vec<&SolveMeasurement> = all.iter().filter(beside).collect();
    shown.sort_by(|a, b| {
        let key = |measured: &SolveMeasurement| (measured.solver != OURS, measured.outcome.cpu());
        key(a).partial_cmp(&key(b)).unwrap_or(std::cmp::Ordering::Equal)
    });
    for measured in shown {
        let cpu = measured.outcome.cpu();
        let times = measured.ratio(all).filter(|_| measured.solver != OURS);
        let times = times.map_or_else(String::new, |ratio| format!(", {ratio:.1} ×"));
        let words = match measured.outcome {
            SolveOutcome::Stopped { .. } => format!("stopped at {cpu:.0} s"),
            SolveOutcome::Done { residual, .. } if !measured.converged() => {
                format!("{cpu:.1} s, residual only {residual:.0e}")
            }
            SolveOutcome::Done { .. } => format!("{cpu:.1} s{times}"),
        };
        chart.bar(measured.solver, cpu, &words, !measured.converged());
    }
    chart
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_stopped_or_missed_its_tolerance_says_so_in_table_and_chart() {
        let measured = |solver, outcome| SolveMeasurement {
            mesh: "m".into(),
            vertices: 10,
            task: EigenTask {
                count: 3,
                tolerance: 1e-6,
            },
            solver,
            outcome,
        };
        let done = |cpu, residual| SolveOutcome::Done {
            cpu,
            wall: cpu,
            residual,
        };
        let all = [
            measured(OURS, done(2.0, 1e-7)),
            measured("slow", SolveOutcome::Stopped { after: 60.0 }),
            measured("loose", done(8.0, 1e-3)),
            measured("good", done(6.0, 1e-9)),
        ];
        let table = table(&all);
        assert_eq!(table.rows[1][5..], ["> 60", "", "stopped", "> 30.00"]);
        assert_eq!(table.rows[2][7..], ["1.0e-3, not converged", "4.00"]);
        assert_eq!(table.rows[3][7..], ["1.0e-9", "3.00"]);
        let svg = chart(&all).svg();
        assert_eq!(svg.matches("stroke-dasharray").count(), 2);
        let place = |words: &str| svg.find(words).unwrap();
        assert!(place("2.0 s") < place("6.0 s, 3.0 ×"));
        assert!(place("6.0 s, 3.0 ×") < place("residual only 1e-3"));
        assert!(place("residual only 1e-3") < place("stopped at 60 s"));
    }
}
