//! The tables in `results/` are made again from the published cells.

use std::{collections::HashMap, fs};

use baselines::DetectorId;

use super::{illustrations, tables};
use crate::{
    attacks,
    models::cast,
    output::table::Table,
    plan,
    process::root,
    results::{Column, Outcome, Results, Trial},
    study::{
        Cell, Mark, Rated, Step, Strength, Target, metrics,
        product::{SIGMARK, VERIFIER},
        steps::READERS,
    },
};

/// The fields of a line of CSV.
fn fields(line: &str) -> Vec<String> {
    let mut all = vec![String::new()];
    let mut quoted = false;
    for letter in line.chars() {
        match (letter, all.last_mut()) {
            ('"', _) => quoted = !quoted,
            (',', _) if !quoted => all.push(String::new()),
            (letter, Some(field)) => field.push(letter),
            _ => {}
        }
    }
    all
}

/// A published table by the names of its columns.
fn published(name: &str) -> Vec<HashMap<String, String>> {
    let text = fs::read_to_string(root().join("results").join(name)).unwrap();
    let header = fields(text.lines().next().unwrap());
    let rows = text.lines().skip(1);
    rows.map(|line| header.iter().cloned().zip(fields(line)).collect())
        .collect()
}

/// What the published cells tell of the results; of the marks they tell α alone.
fn results() -> Results {
    let tables = attacks::tables();
    let all = || {
        let paper = tables.table4.iter().chain(&tables.table5);
        paper.chain(&tables.meshlab).chain(&tables.beyond)
    };
    let mark = |alpha| Mark {
        alpha,
        figures: metrics::figures().map(|figure| (figure.id.into(), 1.0)).collect(),
        seconds: 1.0,
        measuring_seconds: 1.0,
    };
    let mut outcomes: Vec<Outcome> = Vec::new();
    for line in published("cells.csv") {
        let number = |name: &str| line[name].parse::<f64>().unwrap();
        let alpha = number("alpha");
        if outcomes
            .last()
            .is_none_or(|last| last.model.name != line["model"])
        {
            outcomes.push(Outcome {
                model: cast().find(|model| model.name == line["model"]).unwrap(),
                file: line["file"].clone(),
                digest: line["digest"].clone(),
                vertices: 0,
                columns: Vec::new(),
            });
        }
        let columns = &mut outcomes.last_mut().unwrap().columns;
        if columns.last().is_none_or(|last| last.name != line["algorithm"]) {
            let entry = plan::all_markings(1)
                .into_iter()
                .find(|entry| entry.name() == line["algorithm"]);
            columns.push(Column {
                algorithm: entry.unwrap().id(),
                name: line["algorithm"].clone(),
                distortion: 1.0,
                preparation: None,
                strength: Some(Strength {
                    alpha,
                    printed: false,
                    reached: true,
                }),
                marks: vec![mark(alpha)],
                trials: Vec::new(),
                sweep: Vec::new(),
            });
        }
        let column = columns.last_mut().unwrap();
        let step = READERS.iter().find(|reader| reader.id.name() == line["detector"]);
        if let Some(reader) = step {
            let steps = &mut column.trials.last_mut().unwrap().cell.steps;
            steps.push(Step {
                reader: reader.id.clone(),
                rate: number("rate"),
                margin: number("margin"),
            });
            continue;
        }
        let rated = Rated {
            detector: [DetectorId::PAPER, DetectorId::LEAST_SQUARES, VERIFIER]
                .into_iter()
                .find(|detector| detector.name() == line["detector"])
                .unwrap(),
            rate: number("rate"),
            margin: line.get("margin").and_then(|margin| margin.parse().ok()),
            p_value: number("p_value"),
            tries: line.get("tries").map_or(1, |tries| tries.parse().unwrap()),
            rate_in_true_pose: line["rate_in_true_pose"].parse().ok(),
            strangers: vec![0.5],
            verified: line["verified"] == "true",
        };
        let target = match line["signature"].parse::<usize>() {
            Ok(number) => Target::marked(number - 1, alpha),
            Err(_) => Target::unmarked(alpha),
        };
        // Marked meshes come before unmarked ones, and those of the sweep behind them.
        let first_part = column.trials.iter().all(|trial| trial.target.is_marked);
        let trials = if first_part || !target.is_marked {
            &mut column.trials
        } else {
            if column.sweep.last().is_none_or(|(mark, _)| mark.alpha != alpha) {
                column.sweep.push((mark(alpha), Vec::new()));
            }
            &mut column.sweep.last_mut().unwrap().1
        };
        if rated.detector == DetectorId::LEAST_SQUARES {
            trials.last_mut().unwrap().cell.readings.push(rated);
            continue;
        }
        trials.push(Trial {
            target,
            attack: all().find(|attack| attack.spec == line["attack"]).unwrap(),
            cell: Cell {
                attack: serde_json::Value::Null,
                vertices: line["vertices"].parse().unwrap(),
                aligned: line["aligned"] == "true",
                basis: line["basis"].clone(),
                overlap: number("overlap"),
                missing: number("missing"),
                readings: vec![rated],
                steps: Vec::new(),
                attack_seconds: number("attack_seconds"),
                reference_seconds: number("reference_seconds"),
                registration_seconds: number("registration_seconds"),
                reading_seconds: number("reading_seconds"),
            },
            picture: None,
        });
    }
    Results {
        outcomes,
        failures: Vec::new(),
        signatures: 3,
        pictures: Vec::new(),
        foot: String::new(),
    }
}

/// Whether there are Sigmark's, which were not always among them.
fn of_sigmark(results: &Results) -> bool {
    results.columns().any(|(_, column)| column.algorithm == SIGMARK)
}

/// What of a table does not depend on the marks' distortion, by the names of its columns.
fn rows(table: &Table) -> Vec<HashMap<String, String>> {
    let csv = table.csv();
    let header = fields(csv.lines().next().unwrap());
    csv.lines()
        .skip(1)
        .map(|line| header.iter().cloned().zip(fields(line)).collect())
        .collect()
}

#[test]
fn the_published_cells_make_the_published_rates() {
    let results = results();
    let all = tables::all(&results);
    for name in ["table4", "table5", "meshlab", "beyond", "shortfalls", "fig2"] {
        let (_, table) = all.iter().find(|(own, _)| *own == name).unwrap();
        let (mut made, mut there) = (rows(table), published(&format!("{name}.csv")));
        for row in made.iter_mut().chain(&mut there) {
            row.retain(|column, _| !metrics::figures().any(|figure| column.starts_with(figure.header)));
        }
        assert_eq!(made, there, "{name}");
    }
    let (made, there) = (rows(&tables::cells(&results)), published("cells.csv"));
    assert_eq!(made.len(), there.len(), "lines of cells.csv");
    for (made, there) in made.iter().zip(&there) {
        for (column, figure) in there {
            assert_eq!(&made[column], figure, "{column}");
        }
    }
}

#[test]
fn the_published_cells_make_the_published_page() {
    let results = results();
    let page = fs::read_to_string(root().join("results/paper.md")).unwrap();
    let shown = illustrations::all(&results);
    let by_sigmark = usize::from(of_sigmark(&results));
    assert_eq!(shown.len(), 3 + by_sigmark, "Fig. 2, and Fig. 11 by all readers");
    for picture in shown {
        let section = format!(
            "### {}\n\n![{}]({})\n\n{}\n",
            picture.title, picture.title, picture.file, picture.caption
        );
        assert!(page.contains(&section), "{section}");
    }
    for (name, table) in tables::all(&results) {
        let markdown = table.markdown();
        // Header and note; and what stands in no table that shows distortions, whole.
        let mut lines: Vec<&str> = markdown.lines().collect();
        if name != "shortfalls" {
            lines.retain(|line| {
                !line.starts_with("| ") || line.starts_with("| model") || line.starts_with("| ---")
            });
        }
        for line in lines {
            assert!(page.lines().any(|own| own == line), "{name}: {line}");
        }
    }
}
