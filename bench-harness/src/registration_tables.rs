//! The draws of the registration, as tables.

use std::fs;

use anyhow::{Context, Result};

use crate::{
    measure::{greatest, median},
    registration::{Cell, Draw, EXACT, LOST_RATE, RIGHT_POSE, Rule, Trial, VARIANTS, code, trials},
};
use evaluation::{machine, process::root, python::Python, sources, table::Table};

impl Cell {
    fn right(&self, rule: Rule) -> usize {
        let right = |draw: &&Draw| draw.is_right(self.trial, rule);
        self.draws.iter().filter(right).count()
    }
}

/// A cell in words.
pub(crate) fn line(cell: &Cell) -> String {
    let draws = || cell.draws.iter();
    format!(
        "{}, {}: {} of {} right, error {:.1e} (worst {:.1e}), {:.2} s (worst {:.2})",
        cell.mesh,
        cell.trial.name(),
        cell.right(Rule::LeastSquares),
        cell.draws.len(),
        median(draws().map(|draw| draw.error)),
        greatest(draws().map(|draw| draw.error)),
        median(draws().map(|draw| draw.cpu)),
        greatest(draws().map(|draw| draw.cpu)),
    )
}

/// Right draws of all draws, empty where there are none.
fn right_of_all<'a>(cells: impl Iterator<Item = &'a Cell>) -> String {
    let (mut right, mut all) = (0, 0);
    for cell in cells {
        right += cell.right(Rule::LeastSquares);
        all += cell.draws.len();
    }
    if all == 0 {
        String::new()
    } else {
        format!("{right} of {all}")
    }
}

/// By how many points the true transform reads more than the found one.
fn shortfall(draw: &Draw, rule: Rule) -> Option<f64> {
    draw.rates(rule).map(|[found, truth]| 100.0 * (truth - found))
}

/// What several draws say, empty where they say nothing.
struct Summary([String; 11]);

impl Summary {
    const HEADER: [&'static str; 11] = [
        "median error",
        "worst error",
        "unmarked: worst error",
        "least ER with the true transform",
        "median ER",
        "most that the found one reads less",
        "paper's rule: least ER",
        "median ER",
        "most less",
        "median (s)",
        "worst (s)",
    ];

    fn of(trial: Trial, draws: &[&Draw]) -> Self {
        let stranger = matches!(trial, Trial::Stranger);
        let of =
            |f: &dyn Fn(&Draw) -> Option<f64>| -> Vec<f64> { draws.iter().filter_map(|d| f(d)).collect() };
        let shown = |values: Vec<f64>, number: &dyn Fn(Vec<f64>) -> String| {
            if values.is_empty() {
                String::new()
            } else {
                number(values)
            }
        };
        let errors = of(&|draw| (!stranger).then_some(draw.error));
        let rates = |rule: Rule| {
            let truths = of(&|draw| draw.rates(rule).map(|[_, truth]| 100.0 * truth));
            [
                shown(truths.clone(), &|v| {
                    format!("{:.1}", -greatest(v.into_iter().map(|x| -x)))
                }),
                shown(truths, &|v| format!("{:.1}", median(v))),
                shown(of(&|draw| shortfall(draw, rule)), &|v| {
                    format!("{:.2}", greatest(v))
                }),
            ]
        };
        let [least, middle, less] = rates(Rule::LeastSquares);
        let [paper_least, paper_middle, paper_less] = rates(Rule::Paper);
        let seconds = of(&|draw| Some(draw.cpu));
        Self([
            shown(errors.clone(), &|v| format!("{:.1e}", median(v))),
            shown(errors, &|v| format!("{:.1e}", greatest(v))),
            shown(of(&|draw| draw.exact_error), &|v| format!("{:.1e}", greatest(v))),
            least,
            middle,
            less,
            paper_least,
            paper_middle,
            paper_less,
            shown(seconds.clone(), &|v| format!("{:.2}", median(v))),
            shown(seconds, &|v| format!("{:.2}", greatest(v))),
        ])
    }
}

pub(crate) fn by_attack(cells: &[Cell]) -> Table {
    let header: Vec<&str> = ["attack", "right", "share", "by the paper's rule"]
        .into_iter()
        .chain(Summary::HEADER)
        .collect();
    let mut table = Table::new("By attack", &header);
    for trial in trials() {
        let rows: Vec<&Cell> = cells
            .iter()
            .filter(|cell| cell.trial.name() == trial.name())
            .collect();
        let draws: Vec<&Draw> = rows.iter().flat_map(|cell| &cell.draws).collect();
        if draws.is_empty() {
            continue;
        }
        let Summary(figures) = Summary::of(trial, &draws);
        let first = std::iter::once(trial.name().to_string()).chain(shares(&rows));
        table.row(first.chain(figures));
    }
    let all: Vec<&Cell> = cells.iter().collect();
    let empty = Summary::HEADER.map(|_| String::new());
    table.row(
        std::iter::once("all".to_string())
            .chain(shares(&all))
            .chain(empty),
    );
    table
}

/// Right draws, their share, and their share by the paper's rule.
fn shares(cells: &[&Cell]) -> [String; 3] {
    let all: usize = cells.iter().map(|cell| cell.draws.len()).sum();
    let right = |rule: Rule| cells.iter().map(|cell| cell.right(rule)).sum::<usize>();
    let share = |right: usize| format!("{:.1} %", 100.0 * right as f64 / all as f64);
    let ours = right(Rule::LeastSquares);
    [format!("{ours} of {all}"), share(ours), share(right(Rule::Paper))]
}

pub(crate) fn by_mesh(cells: &[Cell]) -> Table {
    let names = trials().map(Trial::name);
    let header: Vec<&str> = ["mesh", "vertices"]
        .into_iter()
        .chain(names)
        .chain(["all", "share", "by the paper's rule"])
        .collect();
    let mut table = Table::new("By mesh: draws that came out right", &header);
    let mut meshes: Vec<(&str, usize)> = cells
        .iter()
        .map(|cell| (cell.mesh.as_str(), cell.vertices))
        .collect();
    meshes.dedup();
    for (mesh, vertices) in meshes {
        let of = |trial: Trial| {
            let same = |cell: &&Cell| cell.mesh == mesh && cell.trial.name() == trial.name();
            right_of_all(cells.iter().filter(same))
        };
        let whole: Vec<&Cell> = cells.iter().filter(|cell| cell.mesh == mesh).collect();
        let first = [mesh.to_string(), vertices.to_string()].into_iter();
        table.row(first.chain(trials().map(of)).chain(shares(&whole)));
    }
    table
}

pub(crate) fn all(cells: &[Cell]) -> Table {
    let first = [
        "mesh",
        "vertices",
        "attack",
        "draws",
        "right",
        "right by the paper's rule",
        "least overlap",
    ];
    let header: Vec<&str> = first.into_iter().chain(Summary::HEADER).collect();
    let mut table = Table::new("Alignments", &header);
    for cell in cells {
        let draws: Vec<&Draw> = cell.draws.iter().collect();
        let Summary(figures) = Summary::of(cell.trial, &draws);
        let overlap = -greatest(draws.iter().map(|draw| -draw.overlap));
        let first = [
            cell.mesh.clone(),
            cell.vertices.to_string(),
            cell.trial.name().to_string(),
            draws.len().to_string(),
            cell.right(Rule::LeastSquares).to_string(),
            cell.right(Rule::Paper).to_string(),
            format!("{overlap:.4}"),
        ];
        table.row(first.into_iter().chain(figures));
    }
    table
}

/// The page and its CSV file.
pub(crate) fn write(cells: &[Cell], attacks: &Python, peers: &str) -> Result<()> {
    let results = root().join("results");
    fs::create_dir_all(&results).with_context(|| results.display().to_string())?;
    all(cells).write_csv(&results.join("registration.csv"))?;
    let page = format!(
        "# Registration\n\nWritten by `cargo xtask bench registration`. Every original is marked as `sigmark embed` does it by default: with P-256, whose signatures have 512 bits. \
         The suspect is attacked, then rotated at random, scaled by 0.01 to 100 and shifted by up to ten diagonals. Of crops and noise, {VARIANTS} variants are used in turn; mirrored \
         copies are of each attack in turn. A run can be ended early and go on later: the tables count the draws that are finished.\n\n\
         A draw is right when the suspect is reported as aligned, mirrored or not as it is, lies within {RIGHT_POSE} of where it belongs, and least squares, by which `sigmark verify` reads \
         such marks from surfaces, reads no more than {:.1} points less of the bits with the transform that was found than with the true one. Least squares leaves a small misalignment free; the paper's rule, \
         which does not, is the stricter judge of a pose, and the share that is right by it stands beside. Where geometry is unchanged, the unmarked suspect must also come back to {EXACT:e} of the diagonal. \
         For the paper's rule, found transforms are bettered in view of the mark before bits are read, as `sigmark verify` does it for marks of the paper's profile. With another model in the suspect's place, a draw is right when it is \
         reported as not aligned.\n\n\
         Errors are root mean square distances of the suspect's vertices from where they belong, over the original's diagonal, as the alignment found them. The mark is part of the suspect, \
         and smoothing and simplification change the surface by more than a mark does: there the pose that fits best is not the one before the attack. Rates are percentages of bits. \
         Seconds are CPU seconds of an alignment on one thread, the original being prepared once. Single meshes are in [registration.csv](registration.csv).\n\n{}\n{}\n{peers}{}, {}; {}. Code {}, sources' digest {}.\n",
        100.0 * LOST_RATE,
        by_attack(cells).markdown(),
        by_mesh(cells).markdown(),
        machine::description(),
        attacks.versions()?,
        machine::load(),
        sources::commit(),
        code()?,
    );
    let path = results.join("registration.md");
    fs::write(&path, page).with_context(|| path.display().to_string())?;
    println!("\nwritten: {}", path.display());
    Ok(())
}
