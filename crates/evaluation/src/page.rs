//! The files of the results: tables as CSV, pictures, a page in Markdown, and one in HTML that needs nothing else.

use std::{fmt::Write, fs};

use crate::study::PAPER_DETECTOR;
use anyhow::{Context, Result};
use base64::{Engine, engine::general_purpose::STANDARD};

use crate::markup::escaped;
use crate::{
    figures::{self, Shown},
    reproduce::{Options, save},
    results::{Column, Outcome, Results, Trial},
    roc::Roc,
    sheet::Sheet,
    study::{SCHEME, Target},
    tables,
};

/// The threshold that the paper chooses.
const PAPER_THRESHOLD: f64 = 0.561;

pub(crate) fn write(results: &Results, options: &Options) -> Result<()> {
    let folder = &options.output;
    fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let tables = tables::all(results);
    for (name, sheet) in &tables {
        save(folder, &format!("{name}.csv"), sheet.csv().as_bytes())?;
    }
    save(folder, "cells.csv", tables::cells(results).as_bytes())?;
    let shown = pictures(results);
    for picture in &shown {
        save(folder, &picture.file, &picture.bytes)?;
    }
    let sheets: Vec<&Sheet> = tables.iter().map(|(_, sheet)| sheet).collect();
    for sheet in &sheets {
        println!("\n{}", sheet.markdown());
    }
    let words = words(results, options.meshes.is_some());
    save(folder, "paper.md", markdown(&words, &sheets, &shown).as_bytes())?;
    save(folder, "paper.html", html(&words, &sheets, &shown).as_bytes())
}

/// All that is seen beside tables.
fn pictures(results: &Results) -> Vec<Shown> {
    let mut shown = Vec::new();
    if let Some(svg) = figures::strengths(results) {
        shown.push(Shown {
            file: "fig2.svg".into(),
            title: "Fig. 2: the strength of the mark".into(),
            caption: "Extraction rate of MHBs by the paper's rule, over the distortion of the mark.".into(),
            bytes: svg.into_bytes(),
        });
    }
    shown.extend(results.pictures.iter().map(|picture| Shown {
        file: picture.file.clone(),
        title: picture.title.clone(),
        caption: picture.caption.clone(),
        bytes: picture.bytes.clone(),
    }));
    shown.extend(figures::attacked(results));
    for (i, detector) in detectors(results).into_iter().enumerate() {
        let roc = roc(results, &detector);
        let (marked, unmarked) = roc.counts();
        if marked == 0 || unmarked == 0 {
            continue;
        }
        let (equal, paper) = (roc.equal_error(SCHEME.bits()), roc.at(PAPER_THRESHOLD));
        let per_cent = |rate: f64| format!("{:.2} %", 100.0 * rate);
        shown.push(Shown {
            file: if i == 0 { "fig11.svg".into() } else { format!("fig11_{}.svg", detector.replace(' ', "_")) },
            title: if i == 0 { "Fig. 11: MHBs, the paper's extraction".into() } else { format!("As Fig. 11: MHBs, {detector}") },
            caption: format!(
                "{marked} marked and {unmarked} unmarked meshes. Area under the curve {:.4}. Errors are equal at {} ({} false positives, {} false negatives); at the paper's threshold of 56.1 % there are {} and {}.",
                roc.area(),
                per_cent(equal.threshold),
                per_cent(equal.false_positives),
                per_cent(equal.false_negatives),
                per_cent(paper.false_positives),
                per_cent(paper.false_negatives),
            ),
            bytes: roc.svg(SCHEME.bits()).into_bytes(),
        });
    }
    shown
}

fn detectors(results: &Results) -> Vec<String> {
    let columns = results.outcomes.iter().flat_map(|outcome| &outcome.columns);
    let mut columns = columns.filter(|column| column.algorithm == "MHBs" && !column.trials.is_empty());
    columns
        .next()
        .map_or_else(|| vec![PAPER_DETECTOR.into()], Column::detectors)
}

/// As in the paper, one marked and one unmarked mesh for each model and attack of Tables 4 and 5: the first signature's.
fn roc(results: &Results, detector: &str) -> Roc {
    let printed =
        |outcome: &Outcome, trial: &Trial| outcome.model.attacks().any(|attack| attack == trial.attack);
    let trials = || {
        let six = results
            .outcomes
            .iter()
            .filter(|outcome| !outcome.model.is_again());
        six.flat_map(|outcome| {
            let columns = outcome.columns.iter().filter(|column| column.algorithm == "MHBs");
            columns
                .flat_map(|column| &column.trials)
                .filter(move |trial| printed(outcome, trial))
        })
    };
    let rates = |marked: bool| {
        let wanted = trials().filter(move |trial| match trial.target {
            Target::Marked(number) => marked && number == 0,
            Target::Unmarked => !marked,
        });
        let rated = wanted
            .flat_map(|trial| &trial.cell.readings)
            .filter(|rated| rated.detector == detector);
        rated.map(|rated| rated.rate).collect::<Vec<f64>>()
    };
    Roc::new(rates(true), rates(false))
}

/// What stands above and below the tables.
struct Words {
    models: String,
    foot: String,
    missing: Vec<String>,
}

fn words(results: &Results, whole: bool) -> Words {
    let mut models = String::from(if whole {
        "The paper's models, and the meshes that stand for them: "
    } else {
        "The quick set: one mesh, which stands for the paper's bunny: "
    });
    let list = results.outcomes.iter().map(|outcome| {
        format!(
            "{} ({} vertices), {} ({} vertices, SHA-256 {}…)",
            outcome.model.name,
            outcome.model.vertices,
            outcome.file,
            outcome.vertices,
            outcome.digest.get(..16).unwrap_or_default()
        )
    });
    models += &list.collect::<Vec<_>>().join("; ");
    Words {
        models: models + ".",
        foot: results.foot.clone(),
        missing: results.failures.clone(),
    }
}

const INTRODUCTION: &str = "Wang, Feng and Miao, A robust confirmable watermarking algorithm for 3D mesh based on manifold harmonics analysis (2012), reproduced by `cargo xtask reproduce`. \
     Signatures are ECDSA on B-163 with SHA-1, 324 bits. Every algorithm marks the same mesh with the same signatures, as strongly as gives the paper's d_rmse; every suspect is moved by a random \
     similarity after its attack, found again, resampled and read; what is read is compared with the signature by the harness, not by the algorithm.";

fn markdown(words: &Words, sheets: &[&Sheet], shown: &[Shown]) -> String {
    let mut page = format!(
        "# The paper, reproduced\n\n{INTRODUCTION}\n\n{}\n\n",
        words.models
    );
    for line in &words.missing {
        let _ = writeln!(page, "- Missing: {}", line.lines().next().unwrap_or_default());
    }
    for sheet in sheets {
        page += &sheet.markdown();
        page.push('\n');
    }
    page += "## Figures\n\n";
    for picture in shown {
        let _ = write!(
            page,
            "### {}\n\n![{}]({})\n\n{}\n\n",
            picture.title, picture.title, picture.file, picture.caption
        );
    }
    page + &format!("{}\n", words.foot)
}

const STYLE: &str = "body{font:15px/1.5 system-ui,-apple-system,'Segoe UI','DejaVu Sans',sans-serif;color:#1f2933;background:#fff;max-width:1320px;margin:2rem auto;padding:0 1rem}\
h1{font-size:1.7rem}h2{font-size:1.15rem;margin:2.2rem 0 .5rem}p{max-width:60rem;color:#3e4c59}.wide{overflow-x:auto}\
table{border-collapse:collapse;font-size:12px;font-variant-numeric:tabular-nums;white-space:nowrap}\
th,td{padding:.3rem .45rem;border-bottom:1px solid #e4e7eb;text-align:right}th{font-weight:600;background:#f5f7fa;position:sticky;top:0}\
th:nth-child(-n+2),td:nth-child(-n+2){text-align:left}td i{display:block;color:#7b8794;font-style:normal;font-size:11px}td s{color:#9aa5b1;text-decoration:none;font-size:10px}\
td.below{background:#ffe3d3}td.above{background:#dff3e4}figure{display:inline-block;margin:0 1rem 1.5rem 0;max-width:100%;vertical-align:top}\
figure img{width:400px;max-width:100%}figure svg{max-width:100%;height:auto}figure img,figure svg{border:1px solid #e4e7eb;border-radius:6px}figcaption{max-width:400px;font-size:13px;color:#52606d}\
.missing{background:#fff3bf;padding:.5rem 1rem;border-radius:6px}footer{margin-top:3rem;font-size:12px;color:#7b8794}";

fn html(words: &Words, sheets: &[&Sheet], shown: &[Shown]) -> String {
    let mut page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width\">\
         <title>The paper, reproduced</title><style>{STYLE}</style></head><body>\n<h1>The paper, reproduced</h1>\n<p>{}</p>\n<p>{}</p>\n\
         <p>In each cell ours stands above, the paper's figure below in grey. Orange cells are more than five points below it, green ones more than five above.</p>\n",
        escaped(&INTRODUCTION.replace('`', "")),
        escaped(&words.models)
    );
    for line in &words.missing {
        let _ = writeln!(page, "<p class=\"missing\">Missing: {}</p>", escaped(line));
    }
    for sheet in sheets {
        page += &sheet.html();
    }
    page += "<section><h2>Figures</h2>\n";
    for picture in shown {
        let image = match std::str::from_utf8(&picture.bytes) {
            Ok(svg) if picture.file.ends_with(".svg") => svg.to_string(),
            _ => format!(
                "<img alt=\"{}\" src=\"data:image/png;base64,{}\">",
                escaped(&picture.title),
                STANDARD.encode(&picture.bytes)
            ),
        };
        let _ = writeln!(
            page,
            "<figure>{image}<figcaption><b>{}.</b> {}</figcaption></figure>",
            escaped(&picture.title),
            escaped(&picture.caption)
        );
    }
    page + &format!(
        "</section>\n<footer>{}</footer>\n</body></html>\n",
        escaped(&words.foot)
    )
}
