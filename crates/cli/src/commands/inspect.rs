use anyhow::Result;
use mesh::TopologyReport;
use serde_json::json;

use crate::{Answer, args::Inspect, files, report};

pub(crate) fn run(arguments: &Inspect) -> Result<Answer> {
    let asset = files::open_mesh(&arguments.model)?;
    let topology = TopologyReport::of_welded(asset.welded());
    if arguments.json {
        report::json(&json!({
            "file": arguments.model,
            "format": asset.format().to_string(),
            "gzipped": asset.is_gzipped(),
            "file_vertices": asset.file_vertex_count(),
            "topology": topology,
            "remarks": topology.remarks(),
        }))?;
        return Ok(Answer::Yes);
    }
    let packed = if asset.is_gzipped() { ", gzipped" } else { "" };
    let mut lines = vec![format!(
        "{}: {}{packed}",
        arguments.model.display(),
        asset.format()
    )];
    lines.extend(topology.to_string().lines().map(String::from));
    report::lines(&lines)?;
    Ok(Answer::Yes)
}
