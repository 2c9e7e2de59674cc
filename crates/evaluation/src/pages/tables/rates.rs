//! What is read: under attacks (Tables 4 and 5), where it falls short of the paper, and where nothing was written.

use baselines::{AlgorithmId, DetectorId};

use super::{marks::measured, table};
use crate::{
    attacks::{self, Attack},
    output::table::{Entry, Measured, Table},
    plan,
    results::{Column, Outcome, Results},
    study::{metrics, product::VERIFIER},
};

/// The rates of an attack beside the printed one.
fn beside_printed(outcome: &Outcome, column: &Column, attack: &Attack, detector: &DetectorId) -> Measured {
    let printed = outcome.model.printed_rate(&column.algorithm, attack);
    let comparable = *detector == DetectorId::PAPER;
    let rates = Measured::rates(column.rates(attack, detector), printed.filter(|_| comparable));
    if comparable {
        return rates;
    }
    let verified: Vec<bool> = match *detector == VERIFIER {
        true => column
            .rated(attack, detector)
            .map(|(_, rated)| rated.verified)
            .collect(),
        false => Vec::new(),
    };
    rates
        .with_margins(&column.margins(attack, detector))
        .with_verified(&verified)
}

/// Table 4 or 5, and tables like them: a row for each model, algorithm and detector.
pub(super) fn robustness(results: &Results, title: &str, note: &str, attacks: &[Attack]) -> Table {
    let figures = || metrics::figures().filter(|figure| figure.printed.is_some());
    let mut header = vec!["model", "algorithm"];
    header.extend(figures().map(|figure| figure.header));
    header.extend(attacks.iter().map(|attack| attack.name.as_str()));
    let mut table = table(title, note, &header);
    for (outcome, column) in results.columns() {
        let tried = plan::attacks_on(&column.algorithm, &outcome.model);
        let tried = tried.into_iter().any(|attack| attacks.contains(attack));
        if !tried || column.trials.is_empty() {
            continue;
        }
        for detector in column.detectors() {
            let printed = outcome.printed(column).filter(|_| detector == DetectorId::PAPER);
            let first = [outcome.title().into(), column.title(&detector).into()].into_iter();
            let figures = figures().map(|figure| measured(figure, column, printed));
            let rate = |attack| beside_printed(outcome, column, attack, &detector).into();
            table.row(first.chain(figures).chain(attacks.iter().map(rate)));
        }
    }
    table
}

/// Cells of the paper's algorithms that fall short, with what tells why.
pub(super) fn shortfalls(results: &Results) -> Table {
    let note = "In the true pose: read with the transform that the attack left, in place of the one that was found; what is gained there is lost by alignment. By least squares: \
                the same meshes read by the other detector; what is gained there is lost by subtracting coefficients. By MeshLab: under its decimation to as many \
                triangles; what is gained there is the decimator's. What none of them regains was taken by the attack from this mesh. \
                Vertices: how many the suspect has; unseen: the share of the original's vertices without a sample.";
    let header = "model | algorithm | attack | rate | in the true pose | by least squares | by MeshLab | rests on | vertices | unseen";
    let title = "Cells more than five points below the printed ones";
    let mut table = table(title, note, header.split(" | "));
    let paper = DetectorId::PAPER;
    for (outcome, column) in results.columns() {
        for attack in plan::all_attacks(&outcome.model) {
            let found = beside_printed(outcome, column, attack, &paper);
            let rated: Vec<_> = column.rated(attack, &paper).collect();
            let Some((first, _)) = rated.first().filter(|_| found.falls_short()) else {
                continue;
            };
            let in_true_pose = rated.iter().filter_map(|(_, rated)| rated.rate_in_true_pose);
            let by_meshlab = attacks::tables().meshlab.iter();
            let by_meshlab = by_meshlab
                .filter(|other| other.instead_of.as_ref() == Some(&attack.name))
                .flat_map(|other| column.rates(other, &paper));
            let alone = |values| Entry::from(Measured::new(values, None, 1));
            table.row([
                outcome.title().into(),
                column.name.as_str().into(),
                attack.name.as_str().into(),
                found.into(),
                alone(in_true_pose.map(|rate| 100.0 * rate).collect()),
                alone(column.rates(attack, &DetectorId::LEAST_SQUARES)),
                alone(by_meshlab.collect()),
                first.cell.basis.as_str().into(),
                first.cell.vertices.to_string().into(),
                format!("{:.1} %", 100.0 * first.cell.missing).into(),
            ]);
        }
    }
    table
}

/// What is read where nothing was written.
pub(super) fn controls(results: &Results) -> Table {
    let note = "Unmarked: the original under every attack, read as if it were marked. Strangers: every mesh, marked or not, compared with signatures that are not in it. Both must lie around 50 %, \
                and for 324 bits only one in a thousand beyond 59 %. Where RBFs lie above it on unmarked meshes, it is because the paper aligns and resamples on the marked mesh: \
                samples along its normals bear some of the mark themselves.";
    let header = "algorithm | read from | meshes | mean (%) | greatest (%)";
    let title = "Controls: what is read where nothing was written";
    let mut table = table(title, note, header.split(" | "));
    let mut rows: Vec<(&AlgorithmId, DetectorId, String)> = Vec::new();
    for (_, column) in results.columns() {
        for detector in column.detectors() {
            let mut known = rows.iter().map(|(algorithm, detector, _)| (*algorithm, detector));
            if !known.any(|known| known == (&column.algorithm, &detector)) {
                let title = column.title(&detector);
                rows.push((&column.algorithm, detector, title));
            }
        }
    }
    for (algorithm, detector, title) in &rows {
        let columns = results.columns().map(|(_, column)| column);
        let columns = columns.filter(|column| column.algorithm == **algorithm);
        let trials: Vec<_> = columns.flat_map(|column| &column.trials).collect();
        let unmarked = trials.iter().filter(|trial| !trial.target.is_marked);
        let unmarked = unmarked.flat_map(|trial| trial.rated(detector));
        let unmarked: Vec<f64> = unmarked.map(|rated| rated.rate).collect();
        let strangers = trials.iter().flat_map(|trial| trial.rated(detector));
        let strangers = strangers
            .flat_map(|rated| rated.strangers.iter().copied())
            .collect();
        for (what, rates) in [("unmarked", unmarked), ("strangers", strangers)] {
            if rates.is_empty() {
                continue;
            }
            let rates: Vec<f64> = rates.iter().map(|rate| 100.0 * rate).collect();
            let greatest = rates.iter().copied().fold(0.0, f64::max);
            let count = rates.len();
            table.row([
                title.as_str().into(),
                what.into(),
                count.to_string().into(),
                Measured::new(vec![rates.iter().sum::<f64>() / count as f64], None, 2).into(),
                Entry::from(Measured::new(vec![greatest], None, 2)),
            ]);
        }
    }
    table
}
