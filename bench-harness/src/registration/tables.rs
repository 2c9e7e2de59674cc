//! The draws of the registration, as tables.

use evaluation::table::Table;

use super::{
    draw::{PoseDraw, TrialDraws},
    reading::ReadingRule::{LeastSquares, Paper},
    trial::PoseTrial,
};
use crate::measure::{greatest, least, median};

/// The columns of [`figures`].
fn figure_names() -> impl Iterator<Item = &'static str> {
    let names = "median error | worst error | unmarked: worst error | least ER with the true transform | median ER | \
        most that the found one reads less | paper's rule: least ER | median ER | most less | median (s) | worst (s)";
    names.split(" | ")
}

/// What several draws of a trial say, empty where they say nothing.
fn figures(trial: PoseTrial, draws: &[&PoseDraw]) -> [String; 11] {
    type Statistic = fn(Vec<f64>) -> f64;
    let over = |of: Statistic, figure: &dyn Fn(&PoseDraw) -> Option<f64>| {
        let values: Vec<f64> = draws.iter().filter_map(|draw| figure(draw)).collect();
        (!values.is_empty()).then(|| of(values))
    };
    let small = |figure: Option<f64>| figure.map_or_else(String::new, |x| format!("{x:.1e}"));
    let rate = |figure: Option<f64>| figure.map_or_else(String::new, |x| format!("{x:.1}"));
    let fine = |figure: Option<f64>| figure.map_or_else(String::new, |x| format!("{x:.2}"));
    let error = |draw: &PoseDraw| (!trial.is_stranger()).then_some(draw.error);
    let truth = |rule| move |draw: &PoseDraw| draw.rates(rule).map(|[_, truth]| 100.0 * truth);
    let seconds = |draw: &PoseDraw| Some(draw.cpu);
    [
        small(over(median, &error)),
        small(over(greatest, &error)),
        small(over(greatest, &|draw| draw.exact_error)),
        rate(over(least, &truth(LeastSquares))),
        rate(over(median, &truth(LeastSquares))),
        fine(over(greatest, &|draw| draw.shortfall(LeastSquares))),
        rate(over(least, &truth(Paper))),
        rate(over(median, &truth(Paper))),
        fine(over(greatest, &|draw| draw.shortfall(Paper))),
        fine(over(median, &seconds)),
        fine(over(greatest, &seconds)),
    ]
}

/// The columns of [`shares`] behind the first.
const SHARES: [&str; 2] = ["share", "by the paper's rule"];

/// Right draws of all, their share, and their share by the paper's rule.
fn shares(all: &[&TrialDraws]) -> [String; 3] {
    let (right, draws) = (
        |rule| all.iter().map(|of_trial| of_trial.right(rule)).sum::<usize>(),
        all.iter().map(|of_trial| of_trial.draws.len()).sum::<usize>(),
    );
    let share = |right: usize| format!("{:.1} %", 100.0 * right as f64 / draws as f64);
    let ours = right(LeastSquares);
    [format!("{ours} of {draws}"), share(ours), share(right(Paper))]
}

/// A line a trial, over all meshes; trials without draws are left out.
pub(crate) fn by_attack(all: &[TrialDraws]) -> Table {
    let header = ["attack", "right"].into_iter().chain(SHARES);
    let mut table = Table::new("By attack", header.chain(figure_names()));
    for trial in PoseTrial::all() {
        let of_trial = all.iter().filter(|draws| draws.trial.name() == trial.name());
        let of_trial: Vec<&TrialDraws> = of_trial.collect();
        if of_trial.is_empty() {
            continue;
        }
        let draws: Vec<&PoseDraw> = of_trial.iter().flat_map(|draws| &draws.draws).collect();
        let first = [trial.name().to_string()].into_iter().chain(shares(&of_trial));
        table.row(first.chain(figures(trial, &draws)));
    }
    let total = shares(&all.iter().collect::<Vec<_>>());
    let empty = figure_names().map(|_| String::new());
    table.row(["all".to_string()].into_iter().chain(total).chain(empty));
    table
}

/// A line a mesh, a column a trial.
pub(crate) fn by_mesh(all: &[TrialDraws]) -> Table {
    let names = PoseTrial::all().map(PoseTrial::name);
    let header = ["mesh", "vertices"].into_iter().chain(names);
    let header = header.chain(["all"]).chain(SHARES);
    let mut table = Table::new("By mesh: draws that came out right", header);
    for of_mesh in all.chunk_by(|a, b| a.mesh == b.mesh) {
        let right = |trial: PoseTrial| {
            let draws = of_mesh.iter().find(|draws| draws.trial.name() == trial.name());
            draws.map_or_else(String::new, |draws| {
                format!("{} of {}", draws.right(LeastSquares), draws.draws.len())
            })
        };
        let first = [of_mesh[0].mesh.clone(), of_mesh[0].vertices.to_string()];
        let total = shares(&of_mesh.iter().collect::<Vec<_>>());
        table.row(first.into_iter().chain(PoseTrial::all().map(right)).chain(total));
    }
    table
}

/// A line for each mesh and trial.
pub(crate) fn by_mesh_and_attack(all: &[TrialDraws]) -> Table {
    let first = "mesh | vertices | attack | draws | right | right by the paper's rule | least overlap";
    let mut table = Table::new("Alignments", first.split(" | ").chain(figure_names()));
    for of_trial in all {
        let draws: Vec<&PoseDraw> = of_trial.draws.iter().collect();
        let first = [
            of_trial.mesh.clone(),
            of_trial.vertices.to_string(),
            of_trial.trial.name().to_string(),
            draws.len().to_string(),
            of_trial.right(LeastSquares).to_string(),
            of_trial.right(Paper).to_string(),
            format!("{:.4}", least(draws.iter().map(|draw| draw.overlap))),
        ];
        table.row(first.into_iter().chain(figures(of_trial.trial, &draws)));
    }
    table
}

#[cfg(test)]
mod tests {
    use super::{super::draw::tests::draw, *};

    #[test]
    fn tables_count_right_draws_and_leave_empty_what_was_not_tried() {
        let draws = |mesh: &str, trial, draws| TrialDraws {
            mesh: mesh.into(),
            vertices: 10,
            trial,
            draws,
        };
        let none = PoseTrial::all().next().unwrap();
        let all = [
            draws("a", none, vec![draw(1e-5, [1.0, 1.0]), draw(3e-5, [0.98, 0.99])]),
            draws("b", PoseTrial::Mirrored, vec![draw(1e-5, [1.0, 1.0])]),
        ];
        let attacks = by_attack(&all);
        assert_eq!(
            attacks.rows[0][..6],
            ["none", "1 of 2", "50.0 %", "50.0 %", "2.0e-5", "3.0e-5"]
        );
        assert_eq!(attacks.rows[0][6..10], ["", "99.0", "99.5", "1.00"]);
        assert_eq!(attacks.rows[2][..3], ["all", "2 of 3", "66.7 %"]);
        let meshes = by_mesh(&all);
        assert_eq!(meshes.rows[0][..4], ["a", "10", "1 of 2", ""]);
        assert_eq!(meshes.rows[1][10..13], ["1 of 1", "", "1 of 1"]);
        let single = by_mesh_and_attack(&all);
        assert_eq!(single.rows[0][3..8], ["2", "1", "1", "1.0000", "2.0e-5"]);
    }
}
