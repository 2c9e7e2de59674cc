//! The page of the poses.

use std::path::Path;

use anyhow::{Context, Result};
use evaluation::{
    machine, sources,
    table::{MOST_MARGIN, Table},
};
use mesh::{TriMesh, shapes};
use quality::picture::{Paint, Picture, View, linear};

use super::{
    Found, Original, PoseBench, Row,
    blender::Blender,
    models::{BENT_OTHERS, FRAMES, NO_RIG, OTHER_VERTICES, OWN_RIG, Pose},
    null::LEVELS,
    reading::{ALGORITHMS, Read, Signed, job, unposed},
};
use crate::results;

/// Pixels of a panel, and its colour.
const SIZE: usize = 480;
const CLAY: u32 = 0xc8_b8_a8;

/// Writes the page and its CSV. `code`: the digest of what the figures depend on.
pub(super) fn write(found: &[Found], bench: &PoseBench, blender: &Blender, code: &str) -> Result<()> {
    let results = results::folder()?;
    long(found).write_csv(&results.join("pose.csv"))?;
    let models: Vec<String> = found.iter().map(of_model).collect();
    let page = format!(
        "# Models in another pose\n\nWritten by `cargo xtask bench pose --meshes DIR --assets DIR{}`. Each model is signed once as `sigmark embed` does it by default, with what poses it; posed by Blender, baked and written in another format with its vertices in another order, by our own skinning, \
         or dragged by handles; and read three ways: by {}, in the position that a similarity gives, and by {}, whole. **V** is verified: the payload was read back, all of it. *d* is detected, p ≤ 10⁻⁶ (in brackets what is no evidence, p > 2⁻¹²⁰), – is not found. The numbers are T₀ and the share of right bits; \
         reading stops at the first look that has all, so where it is verified they are no measure of what is left. pose.csv has p, how the suspect was recognised, and CPU seconds.\n\n{}\n{}\n{}\n{}\n{}, {}; {}. Code {}, sources' digest {code}.\n",
        options(bench),
        ALGORITHMS[..2].join(" and by "),
        ALGORITHMS[2],
        overview(found, bench.every).markdown(),
        models.concat(),
        nobody(found).markdown(),
        pictures(&results),
        machine::description(),
        blender.versions()?,
        machine::load(),
        sources::commit(),
    );
    results::write_page(&results.join("pose.md"), &page)
}

/// What else was asked for, as it is typed.
fn options(bench: &PoseBench) -> String {
    let mut options: String = bench
        .only
        .iter()
        .map(|name| format!(" --only '{name}'"))
        .collect();
    if bench.every > 1 {
        options += &format!(" --every {}", bench.every);
    }
    options
}

/// Of every group of poses how many were read.
fn overview(found: &[Found], every: usize) -> Table {
    let header = "model | vertices | joints | targets | payload | poses | suspects | verified | p < 10⁻¹² | least T₀ | greatest p | CPU s";
    let mut table = Table::new("By sigmark verify", header.split(" | ")).text_columns(1);
    if every > 1 {
        table = table.note(&format!("Of animations every {every}th frame."));
    }
    for model in found {
        for group in [FRAMES, OWN_RIG, OTHER_VERTICES, NO_RIG, BENT_OTHERS] {
            let read: Vec<&Read> = of_group(model, group)
                .filter_map(|row| row.read.as_ref()?.last())
                .collect();
            if read.is_empty() {
                continue;
            }
            let margins = read.iter().map(|read| read.margin.unwrap_or(0.0));
            let worst = read.iter().map(|read| read.p).fold(0.0, f64::max);
            let seconds: f64 = read.iter().map(|read| read.cpu).sum();
            table.row([
                model.name.clone(),
                model.vertices.to_string(),
                model.joints.to_string(),
                model.targets.to_string(),
                model.payload.clone(),
                group.into(),
                read.len().to_string(),
                read.iter()
                    .filter(|read| read.outcome == "verified")
                    .count()
                    .to_string(),
                read.iter().filter(|read| read.p < 1e-12).count().to_string(),
                format!("{:.1}", margins.fold(f64::INFINITY, f64::min)),
                format!("{worst:.0e}"),
                format!("{:.1}", seconds / read.len() as f64),
            ]);
        }
    }
    table
}

fn of_group<'a>(model: &'a Found, group: &'a str) -> impl Iterator<Item = &'a Row> {
    model.rows.iter().filter(move |row| row.pose.group == group)
}

/// Every pose of a model by every algorithm; of animations the worst frame.
fn of_model(model: &Found) -> String {
    let mut header = vec!["pose", "made by", "vertices"];
    header.extend(ALGORITHMS);
    header.push("recognised by");
    let mut table = Table::new(&model.name, header).text_columns(2);
    let p = |row: &&Row| {
        row.read
            .as_ref()
            .and_then(|read| read.last())
            .map_or(1.0, |read| read.p)
    };
    let worst = of_group(model, FRAMES).max_by(|a, b| p(a).total_cmp(&p(b)));
    let others = model.rows.iter().filter(|row| row.pose.group != FRAMES);
    for row in worst.into_iter().chain(others) {
        let name = match row.pose.group.as_str() {
            FRAMES => format!("worst frame: {}", row.pose.name),
            _ => row.pose.name.clone(),
        };
        let mut cells = vec![name, row.pose.made_by(), row.vertices.to_string()];
        match &row.read {
            Some(read) => {
                cells.extend(read.iter().map(cell));
                cells.push(read.last().map_or_else(String::new, |read| read.way.clone()));
            }
            None => cells.extend(["", "", "", "could not be made"].map(String::from)),
        }
        table.row(cells);
    }
    format!("{}\n", table.markdown())
}

fn cell(read: &Read) -> String {
    let sign = match read.outcome.as_str() {
        "verified" => "**V**",
        "detected" if read.is_evidence => "*d*",
        "detected" => "(*d*)",
        _ => "–",
    };
    let margin = read
        .margin
        .map_or_else(String::new, |margin| format!(" {:.1}", margin.min(MOST_MARGIN)));
    let rate = read
        .rate()
        .map_or_else(String::new, |rate| format!(", {:.1} %", 100.0 * rate));
    format!("{sign}{margin}{rate}")
}

/// How often chance came so far where there is no mark.
fn nobody(found: &[Found]) -> Table {
    let header = "model | pose | readings | trials | p ≤ 0.1 | p ≤ 0.01 | p ≤ 10⁻³ | p ≤ 10⁻⁴ | smallest p";
    let mut table = Table::new("Without a mark", header.split(" | ")).text_columns(2).note(
        "Unmarked originals, posed, each asked for random words: as it lies, with the pose undone by the rig, and, where something may have bent it, in the frames of each vertex' surroundings, by its vertices or brought back by its surface. p is the least of the ways in which it lies on the original, times their number: two, or three where it may have been bent; the verifier counts parts besides. p is an upper bound: at most a tenth, a hundredth, … of the trials may be below.",
    );
    let (mut trials, mut below) = (0, [0; LEVELS.len()]);
    for model in found {
        for copy in &model.null {
            trials += copy.trials;
            below = std::array::from_fn(|i| below[i] + copy.below[i]);
            let counts = copy.below.map(|count| count.to_string());
            let first = [
                model.name.clone(),
                copy.pose.clone(),
                copy.readings.to_string(),
                copy.trials.to_string(),
            ];
            table.row(
                first
                    .into_iter()
                    .chain(counts)
                    .chain([format!("{:.0e}", copy.least)]),
            );
        }
    }
    let first = ["all".into(), String::new(), String::new(), trials.to_string()];
    let counts = below.map(|count| count.to_string());
    table.row(first.into_iter().chain(counts).chain([String::new()]));
    let allowed = LEVELS.map(|level| format!("{:.0}", level * trials as f64));
    let first = ["allowed".into(), String::new(), String::new(), String::new()];
    table.row(first.into_iter().chain(allowed).chain([String::new()]));
    table
}

fn long(found: &[Found]) -> Table {
    let header = "model | group | pose | made by | vertices | algorithm | outcome | evidence | recognised by | ER | T0 | p | bits | wrong | CPU s";
    let mut table = Table::new("Poses", header.split(" | "));
    for model in found {
        for row in &model.rows {
            for (algorithm, read) in ALGORITHMS.iter().zip(row.read.iter().flatten()) {
                table.row([
                    model.name.clone(),
                    row.pose.group.clone(),
                    row.pose.name.clone(),
                    row.pose.made_by(),
                    row.vertices.to_string(),
                    (*algorithm).into(),
                    read.outcome.clone(),
                    read.is_evidence.to_string(),
                    read.way.clone(),
                    read.rate().map_or_else(String::new, |rate| format!("{rate:.4}")),
                    read.margin
                        .map_or_else(String::new, |margin| format!("{margin:.2}")),
                    format!("{:.2e}", read.p),
                    read.bits.to_string(),
                    read.errors.map_or_else(String::new, |errors| errors.to_string()),
                    format!("{:.2}", read.cpu),
                ]);
            }
        }
    }
    table
}

/// Where a picture of a model goes.
fn picture_name(model: &str) -> String {
    format!("pose_{}.png", model.replace(' ', "-"))
}

/// The pictures that there are.
fn pictures(results: &Path) -> String {
    let drawn = super::models::all().filter(|model| model.drawn.is_some());
    let shown = drawn.filter_map(|model| {
        let (name, pose) = (picture_name(model.name), model.drawn?());
        let is_there = results.join(&name).is_file();
        is_there.then(|| format!("**{}**, {pose}: the suspect, the original, and the suspect with its pose undone.\n\n![{}]({name})\n", model.name, model.name))
    });
    shown.collect::<Vec<_>>().join("\n")
}

/// Draws the suspect, the original, and the suspect with its pose undone, side by side.
pub(super) fn picture(original: &Original<'_>, pose: fn() -> Pose, blender: &Blender) -> Result<()> {
    let Original { model, asset, .. } = original;
    let path = results::folder()?.join(picture_name(model.name));
    let signed = Signed::new(asset)?;
    let marked = blender.keep(model.name, original.path, &signed.file(asset)?)?;
    let pose = pose();
    let files = blender.pose(&marked, std::slice::from_ref(&pose))?;
    let suspect = pose.suspect(&signed, files.first().and_then(Option::as_deref))?;
    let rig = signed.rig().context("there is no rig to undo a pose by")?;
    let back = unposed(asset.mesh(), rig, &suspect)?.context("the pose was not undone")?;
    let transform = signed.reader().align(&suspect, &job())?.transform;
    let shown = shapes::moved(&suspect, &transform);
    let view = view(asset.mesh());
    let [shown, original, back] = [&shown, asset.mesh(), &back].map(|mesh| drawn(mesh, view));
    let picture = Picture::beside(&Picture::beside(&shown, &original), &back);
    results::write(&path, picture.to_png()?)
}

fn drawn(mesh: &TriMesh, view: View) -> Picture {
    let clay = vec![linear(CLAY); mesh.triangle_count()];
    Picture::of(mesh, Paint::Triangles(&clay), view, SIZE)
}

/// From the broad side, a little from above; y is up, if the model is not flattest there.
fn view(mesh: &TriMesh) -> View {
    let size = mesh.bounding_box().size();
    let flattest = (0..3).min_by(|&a, &b| size[a].total_cmp(&size[b])).unwrap_or(2);
    let up = if flattest == 1 { 2 } else { 1 };
    let eye = std::array::from_fn(|axis| match axis {
        _ if axis == flattest => 1.0,
        _ if axis == up => 0.25,
        _ => 0.4,
    });
    View {
        eye,
        up: std::array::from_fn(|axis| if axis == up { 1.0 } else { 0.0 }),
    }
}
