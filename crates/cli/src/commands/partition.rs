use std::{path::Path, sync::Arc};

use anyhow::{Context, Result, bail};
use mesh::Edges;
use mesh_io::Asset;
use partition::{Effort, Graph, Options, Partition, PartitionStage, partition, read_metis};
use serde_json::json;

use crate::{
    Answer, args,
    files::{self, Output, Text},
    progress::Progress,
    report::{self, Lines},
};

/// What is divided: a graph, and the mesh that it came from if it is one.
struct Input {
    graph: Graph,
    asset: Option<Asset>,
}

pub(crate) fn run(arguments: &args::Partition) -> Result<Answer> {
    for output in [&arguments.output, &arguments.labels].into_iter().flatten() {
        files::check_apart(output, &arguments.input, "the input itself")?;
        files::check_free(output, arguments.force)?;
    }
    if let (Some(output), Some(labels)) = (&arguments.output, &arguments.labels) {
        files::check_apart(labels, output, "to be both the coloured mesh and the labels")?;
    }
    let progress = Arc::new(Progress::new());
    progress.begin("reading", "reading");
    let input = read(&arguments.input)?;
    progress.begin("partition", "dividing");
    let options = Options {
        parts: arguments.parts,
        imbalance: arguments.imbalance,
        seed: arguments.seed,
        contiguous: true,
        effort: if arguments.high_effort {
            Effort::High
        } else {
            Effort::Default
        },
        ..Options::default()
    };
    let job = progress
        .job(arguments.common.threads())
        .within(PartitionStage::Refinement);
    let result =
        partition(&input.graph, &options, &job).with_context(|| arguments.input.display().to_string())?;
    progress.begin("writing", "writing");
    write(arguments, &input, &result)?;
    let seconds = progress.finish();

    let object = json!({
        "parts": arguments.parts,
        "cut": result.cut,
        "imbalance": result.imbalance,
        "components": result.components,
        "output": arguments.output,
        "labels": arguments.labels,
        "seconds": report::seconds_json(&seconds),
    });
    let vertices = report::counted(input.graph.vertex_count(), "vertex", "vertices");
    let parts = report::counted(arguments.parts, "part", "parts");
    let mut lines = Lines::new(format!("{}: {vertices} in {parts}", arguments.input.display()));
    let cut = result.cut.unsigned_abs() as usize;
    lines.field("cut", report::counted(cut, "edge", "edges"));
    lines.field("imbalance", format!("{:.2} %", 100.0 * result.imbalance));
    let pieces = report::counted(result.components.iter().sum(), "piece", "pieces");
    lines.field("connected", format!("{pieces} in all"));
    lines.field("time", report::seconds_text(&seconds));
    let written = [&arguments.output, &arguments.labels].into_iter().flatten();
    let written: Vec<String> = written.map(|path| path.display().to_string()).collect();
    if !written.is_empty() {
        lines.field("written", written.join(" and "));
    }
    report::print(arguments.common.json, &object, &lines)?;
    Ok(Answer::Yes)
}

fn read(path: &Path) -> Result<Input> {
    if files::has_extension(path, "graph") {
        let text = files::read_text(path, Text::Graph)?;
        let graph = read_metis(&text).with_context(|| path.display().to_string())?;
        return Ok(Input { graph, asset: None });
    }
    let asset = files::open_mesh(path)?;
    let edges: Vec<(u32, u32, i32)> = Edges::of(asset.mesh())
        .vertices()
        .iter()
        .map(|&[a, b]| (a, b, 1))
        .collect();
    let graph =
        Graph::from_edges(asset.mesh().vertex_count(), &edges).with_context(|| path.display().to_string())?;
    Ok(Input {
        graph,
        asset: Some(asset),
    })
}

fn write(arguments: &args::Partition, input: &Input, result: &Partition) -> Result<()> {
    let mut files = Vec::new();
    if let Some(path) = &arguments.output {
        let Some(asset) = &input.asset else {
            let path = path.display();
            bail!("{path}: a graph has no shape to colour; leave out -o, or give a mesh");
        };
        let colours: Vec<[u8; 3]> = result.part_of.iter().map(|&part| colour(part)).collect();
        files.push((path, mesh_io::write_coloured_ply(asset.mesh(), &colours)));
    }
    if let Some(path) = &arguments.labels {
        files.push((path, labels(input, result).into_bytes()));
    }
    let outputs = files.iter().map(|(path, bytes)| Output::public((path, bytes)));
    files::write_together(&outputs.collect::<Vec<_>>(), arguments.force)
}

/// One part number a line, in the order of the file's vertices.
fn labels(input: &Input, result: &Partition) -> String {
    let line = |part: Option<&u32>| part.map_or("-1\n".into(), |part| format!("{part}\n"));
    match &input.asset {
        Some(asset) => asset
            .welded()
            .vertex_of()
            .iter()
            .map(|v| line(v.map(|v| &result.part_of[v as usize])))
            .collect(),
        None => result.part_of.iter().map(|part| line(Some(part))).collect(),
    }
}

/// Hues a golden angle apart, in three shades: neighbours in number never look alike.
fn colour(part: u32) -> [u8; 3] {
    let hue = (f64::from(part) * 0.618_034).fract() * 6.0;
    let shade = [1.0, 0.75, 0.88][part as usize % 3];
    [0.0, 4.0, 2.0].map(|offset: f64| {
        let ramp = ((hue + offset).rem_euclid(6.0) - 3.0).abs() - 1.0;
        (255.0 * shade * (0.25 + 0.75 * ramp.clamp(0.0, 1.0))) as u8
    })
}
