use anyhow::Result;
use mesh::TopologyReport;
use serde_json::json;

use crate::{
    Answer,
    args::Inspect,
    capacity::Capacity,
    files,
    report::{self, Lines},
};

pub(crate) fn run(arguments: &Inspect) -> Result<Answer> {
    let asset = files::open_mesh(&arguments.model)?;
    let topology = TopologyReport::of_welded(asset.welded());
    let capacity = Capacity::of(asset.mesh());
    let object = json!({
        "file": arguments.model,
        "format": asset.format().to_string(),
        "gzipped": asset.is_gzipped(),
        "file_vertices": asset.file_vertex_count(),
        "topology": topology,
        "remarks": topology.remarks(),
        "capacity": capacity.json(),
    });
    let packed = if asset.is_gzipped() { ", gzipped" } else { "" };
    let (model, format) = (arguments.model.display(), asset.format());
    let mut lines = Lines::new(format!("{model}: {format}{packed}"));
    topology.to_string().lines().for_each(|line| lines.line(line));
    capacity.tell(&mut lines);
    report::print(arguments.json, &object, &lines)?;
    Ok(Answer::Yes)
}
