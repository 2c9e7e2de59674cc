//! The files of the results: tables as CSV, pictures, a page in Markdown, and one in HTML that needs nothing else.

mod illustrations;
#[cfg(test)]
mod published;
mod roc;
mod tables;
mod verdicts;

use std::{fmt::Write, fs, path::Path};

use anyhow::{Context, Result};
use base64::{Engine, engine::general_purpose::STANDARD};

use crate::{
    output::{markup::escaped, table::Table},
    results::{Illustration, Results},
};

/// Writes everything into a folder, and the tables to the terminal. `full`: all six models were asked for.
pub(crate) fn write(results: &Results, folder: &Path, full: bool) -> Result<()> {
    fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let tables = tables::all(results);
    for (name, table) in &tables {
        table.write_csv(&folder.join(format!("{name}.csv")))?;
    }
    tables::cells(results).write_csv(&folder.join("cells.csv"))?;
    let shown = illustrations::all(results);
    for picture in &shown {
        save(folder, &picture.file, &picture.bytes)?;
    }
    let tables: Vec<Table> = tables.into_iter().map(|(_, table)| table).collect();
    for table in &tables {
        println!("\n{}", table.markdown());
    }
    let models = models(results, full);
    save(folder, "paper.md", markdown(results, &models, &tables, &shown))?;
    save(folder, "paper.html", html(results, &models, &tables, &shown))
}

fn save(folder: &Path, name: &str, bytes: impl AsRef<[u8]>) -> Result<()> {
    let path = folder.join(name);
    fs::write(&path, bytes).with_context(|| path.display().to_string())
}

/// Which meshes were taken, in words.
fn models(results: &Results, full: bool) -> String {
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
    let begin = if full {
        "The paper's models, and the meshes that stand for them"
    } else {
        "The quick set: one mesh, which stands for the paper's bunny"
    };
    format!("{begin}: {}.", list.collect::<Vec<_>>().join("; "))
}

const INTRODUCTION: &str = "Wang, Feng and Miao, A robust confirmable watermarking algorithm for 3D mesh based on manifold harmonics analysis (2012), reproduced by `cargo xtask reproduce`. \
     Signatures are ECDSA on B-163 with SHA-1, 324 bits. Every algorithm marks the same mesh with the same signatures, as strongly as gives the paper's d_rmse; every suspect is moved by a random \
     similarity after its attack, found again, resampled and read; what is read is compared with the signature by the harness, not by the algorithm.";

fn markdown(results: &Results, models: &str, tables: &[Table], shown: &[Illustration]) -> String {
    let mut page = format!("# The paper, reproduced\n\n{INTRODUCTION}\n\n{models}\n\n");
    for line in &results.failures {
        let _ = writeln!(page, "- Missing: {}", line.lines().next().unwrap_or_default());
    }
    for table in tables {
        page += &table.markdown();
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
    page + &format!("{}\n", results.foot)
}

const STYLE: &str = "body{font:15px/1.5 system-ui,-apple-system,'Segoe UI','DejaVu Sans',sans-serif;color:#1f2933;background:#fff;max-width:1320px;margin:2rem auto;padding:0 1rem}\
h1{font-size:1.7rem}h2{font-size:1.15rem;margin:2.2rem 0 .5rem}p{max-width:60rem;color:#3e4c59}.wide{overflow-x:auto}\
table{border-collapse:collapse;font-size:12px;font-variant-numeric:tabular-nums;white-space:nowrap}\
th,td{padding:.3rem .45rem;border-bottom:1px solid #e4e7eb;text-align:right}th{font-weight:600;background:#f5f7fa;position:sticky;top:0}\
th:nth-child(-n+2),td:nth-child(-n+2){text-align:left}td i,td b{display:block;color:#7b8794;font-style:normal;font-weight:400;font-size:11px}td s{color:#9aa5b1;text-decoration:none;font-size:10px}\
td.below{background:#ffe3d3}td.above{background:#dff3e4}figure{display:inline-block;margin:0 1rem 1.5rem 0;max-width:100%;vertical-align:top}\
figure img{width:400px;max-width:100%}figure svg{max-width:100%;height:auto}figure img,figure svg{border:1px solid #e4e7eb;border-radius:6px}figcaption{max-width:400px;font-size:13px;color:#52606d}\
.missing{background:#fff3bf;padding:.5rem 1rem;border-radius:6px}footer{margin-top:3rem;font-size:12px;color:#7b8794}";

fn html(results: &Results, models: &str, tables: &[Table], shown: &[Illustration]) -> String {
    let mut page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width\">\
         <title>The paper, reproduced</title><style>{STYLE}</style></head><body>\n<h1>The paper, reproduced</h1>\n<p>{}</p>\n<p>{}</p>\n\
         <p>In each cell ours stands above; in grey below it the paper's figure, or T₀ and how many signatures were verified. Orange cells are more than five points below it, green ones more than five above.</p>\n",
        escaped(&INTRODUCTION.replace('`', "")),
        escaped(models)
    );
    for line in &results.failures {
        let _ = writeln!(page, "<p class=\"missing\">Missing: {}</p>", escaped(line));
    }
    for table in tables {
        page += &table.html();
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
        escaped(&results.foot)
    )
}
