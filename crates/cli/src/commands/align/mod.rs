mod pose;

use std::{
    fs,
    path::{Path, PathBuf},
    sync::Arc,
};

use anyhow::{Context, Result, bail};
use job::JobError;
use mesh_io::{Asset, Companion, Unturned};
use registration::{AlignOptions, Aligner, Alignment, MatchedBy, RegistrationError, align, align_points};
use serde_json::{Value, json};

use crate::{
    Answer,
    args::Align,
    batch,
    files::{self, Output, Text},
    points::{self, Pair},
    progress::Progress,
    report::{self, Lines, Seconds},
};
use pose::Brought;

pub(crate) fn run(arguments: &Align) -> Result<Answer> {
    check_output(arguments)?;
    let progress = Arc::new(Progress::within(arguments.time_limit.duration()));
    progress.begin("reading", "reading");
    let pairs = pairs(arguments)?;
    let suspect = files::open_mesh(&arguments.suspect)?;
    let original = files::open_mesh(&arguments.original)?;
    suspect.check_name(&arguments.output)?;
    let pairs = pairs
        .iter()
        .map(|pair| pair.place(&suspect, &original))
        .collect::<Result<Vec<_>>>()?;

    let options = AlignOptions::default();
    let job = progress.job(arguments.common.threads());
    let (from, onto) = (suspect.mesh(), original.mesh());
    let brought = match arguments.pose {
        true => {
            let aligner = Aligner::new(onto, &options)?;
            let undone = pose::undone(&aligner, (&original, &arguments.original), from, &job);
            undone.map_err(|error| match error.downcast() {
                Ok(error) => blame(error, arguments),
                Err(error) if is_cancelled(&error) => arguments.time_limit.exceeded(),
                Err(error) => error,
            })?
        }
        false => None,
    };
    let (brought, found) = match brought {
        Some((brought, found)) => (Some(brought), Ok(found)),
        // How it lies there in its own pose.
        None if pairs.is_empty() => (None, align(onto, from, &options, &job)),
        None => (None, align_points(onto, from, &pairs, &options, &job)),
    };
    let mut found = found.map_err(|error| blame(error, arguments))?;
    found.aligned &= brought.is_some() || !arguments.pose;
    let mut left = Vec::new();
    if found.aligned {
        progress.begin("writing", "writing");
        let written = match &brought {
            Some(brought) => suspect.with_positions(&brought.positions)?,
            None => {
                let moved = suspect.moved_by(&found.transform)?;
                left = moved.left;
                moved.asset
            }
        };
        write(&written, arguments)?;
    }
    let seconds = progress.finish();

    if !left.is_empty() {
        report::warning(&not_turned(arguments, &left));
    }
    let lines = summary(arguments, &found, brought.as_ref(), &options, &seconds);
    report::print(
        arguments.common.json,
        &object(arguments, &found, brought.as_ref(), &left, &seconds),
        &lines,
    )?;
    Ok(if found.aligned { Answer::Yes } else { Answer::No })
}

fn check_output(arguments: &Align) -> Result<()> {
    let (output, force) = (&arguments.output, arguments.force);
    files::check_apart(output, &arguments.suspect, "the suspect")?;
    files::check_apart(output, &arguments.original, "the original")?;
    if let Some(points) = &arguments.points {
        files::check_apart(output, points, "the file of points")?;
    }
    check_companions(arguments)?;
    files::check_free(output, force)
}

/// What a stranger's file refers to by name replaces nothing that is read, also where files may be replaced.
fn check_companions(arguments: &Align) -> Result<()> {
    let named = |path: &Path| mesh_io::companions_of(path).unwrap_or_default();
    let mut inputs: Vec<PathBuf> = arguments.points.iter().cloned().collect();
    for model in [&arguments.suspect, &arguments.original] {
        let beside = named(model)
            .into_iter()
            .map(|companion| model.with_file_name(companion.name));
        inputs.extend(beside.chain([model.clone()]));
    }
    let inputs: Vec<PathBuf> = inputs.iter().map(|path| files::resolved(path)).collect();
    for Companion { name, is_buffer } in named(&arguments.suspect) {
        let source = arguments.suspect.with_file_name(&name);
        let target = arguments.output.with_file_name(&name);
        let is_there = !is_buffer && fs::read(&source).ok() == fs::read(&target).ok();
        if !is_there && inputs.contains(&files::resolved(&target)) {
            bail!(
                "{}: the suspect refers to {name}, whose copy would replace {}, which is read; write to another folder",
                arguments.output.display(),
                target.display()
            );
        }
    }
    Ok(())
}

/// Writes the file and those that it refers to by name, but for what is there already, or nothing.
fn write(written: &Asset, arguments: &Align) -> Result<()> {
    let output = &arguments.output;
    written.check_name(output)?;
    let mut companions = Vec::new();
    for (name, bytes) in written.companions() {
        let path = output.with_file_name(name);
        if fs::read(&path).is_ok_and(|there| there == bytes) {
            continue;
        }
        batch::make_folder_of(&path)?;
        companions.push((path, bytes));
    }
    let bytes = written.to_bytes();
    let mut outputs: Vec<Output<'_>> = companions
        .iter()
        .map(|(path, bytes)| Output::public((path, bytes)))
        .collect();
    outputs.push(Output::public((output, &bytes)));
    files::write_together(&outputs, arguments.force)
}

/// All pairs that were given, on the command line and in a file.
fn pairs(arguments: &Align) -> Result<Vec<Pair>> {
    let mut pairs = arguments.point.clone();
    if let Some(path) = &arguments.points {
        let text = files::read_text(path, Text::Points)?;
        let read = points::parse_lines(&text).with_context(|| path.display().to_string())?;
        if read.is_empty() {
            anyhow::bail!("{}: holds no pair of points; give at least three", path.display());
        }
        pairs.extend(read);
    }
    Ok(pairs)
}

/// The error with the name of the file that it is about.
fn blame(error: RegistrationError, arguments: &Align) -> anyhow::Error {
    let file = match error {
        RegistrationError::Job(JobError::Cancelled) => return arguments.time_limit.exceeded(),
        RegistrationError::NoSurface { mesh: "original" } => &arguments.original,
        RegistrationError::NoSurface { .. } => &arguments.suspect,
        _ => return error.into(),
    };
    anyhow::Error::new(error).context(file.display().to_string())
}

fn is_cancelled(error: &anyhow::Error) -> bool {
    error.downcast_ref::<JobError>() == Some(&JobError::Cancelled)
}

/// What lies as it lay before, in a line.
fn not_turned(arguments: &Align, left: &[Unturned]) -> String {
    const NAMED: usize = 4;
    let mut named: Vec<String> = left.iter().take(NAMED).map(ToString::to_string).collect();
    if left.len() > NAMED {
        named.push(format!("{} more (--json names them)", left.len() - NAMED));
    }
    format!(
        "{}: not turned with the mesh: {}",
        arguments.output.display(),
        report::listed(&named)
    )
}

/// What `--json` prints.
fn object(
    arguments: &Align,
    found: &Alignment,
    brought: Option<&Brought>,
    left: &[Unturned],
    seconds: &Seconds,
) -> Value {
    // Of a pose there is no one transform.
    let transform = brought.is_none().then_some(found.transform);
    json!({
        "aligned": found.aligned,
        "output": found.aligned.then_some(&arguments.output),
        "transform": transform.map(|transform| transform.to_matrix()),
        "scale": transform.map(|transform| transform.scale),
        "rotation": transform.map(|transform| transform.rotation),
        "translation": transform.map(|transform| transform.translation),
        "mirrored": found.mirrored(),
        "pose": brought.map(|brought| json!({"undone_by": brought.by, "between": brought.between})),
        "not_turned": left.iter().map(ToString::to_string).collect::<Vec<_>>(),
        "registration": found.matched_by,
        "overlap": found.overlap,
        "coverage": found.coverage,
        "residual": found.residual,
        "ambiguous": found.ambiguous(),
        "alternatives": found.alternatives.iter().map(mesh::Similarity::to_matrix).collect::<Vec<_>>(),
        "free_directions": found.free_directions,
        "seconds": report::seconds_json(seconds),
    })
}

fn summary(
    arguments: &Align,
    found: &Alignment,
    brought: Option<&Brought>,
    options: &AlignOptions,
    seconds: &Seconds,
) -> Lines {
    let (suspect, original) = (arguments.suspect.display(), arguments.original.display());
    let lies_unposed = arguments.pose && brought.is_none() && found.overlap >= options.least_overlap;
    let mut lines = Lines::new(match (found.aligned, found.mirrored()) {
        _ if found.aligned && brought.is_some() => {
            format!("ALIGNED: {suspect} lies on {original}, in its pose")
        }
        (true, false) => format!("ALIGNED: {suspect} lies on {original}"),
        (true, true) => format!("ALIGNED: {suspect} lies on {original} as its mirror image"),
        (false, _) if lies_unposed => {
            format!("NO POSE TO UNDO: {suspect} lies on {original} as it is; align it without --pose")
        }
        (false, _) => format!("DOES NOT ALIGN: {suspect} is not {original}, nor a part of it"),
    });
    let by = match brought.map_or(found.matched_by, |brought| brought.by) {
        MatchedBy::Rig => "its vertices, and its pose undone by the original's joints and morph targets",
        MatchedBy::RigSurface => "its surface, and its pose undone by the original's joints",
        MatchedBy::BentSurface => "its surface, and what had bent or posed it undone",
        MatchedBy::Connectivity => "its vertices",
        MatchedBy::Surroundings => "the vertices that are left",
        MatchedBy::Points => "its surface, from the given points",
        _ => "its surface",
    };
    lines.field("recognised by", by);
    let [overlap, coverage] = [found.overlap, found.coverage].map(|share| 100.0 * share);
    let overlap = format!(
        "{overlap:.1} % of the suspect's surface lies on the original, {coverage:.1} % of the original's on the suspect"
    );
    lines.field("overlap", overlap);
    if found.aligned {
        lines.field("apart", format!("{:.2e} of the diagonal (RMS)", found.residual));
        match brought {
            None => lines.field("scale", format!("{:.9}", found.transform.scale)),
            Some(Brought { between: 0, .. }) => {}
            Some(Brought { between, .. }) => {
                let vertices = report::counted(*between, "vertex was", "vertices were");
                lines.field(
                    "between",
                    format!("{vertices} laid between neighbours: the pose could not be undone there"),
                );
            }
        }
        if let Some(ambiguity) = ambiguity(found) {
            lines.field("ambiguous", ambiguity);
        }
    } else if !lies_unposed {
        let needed = 100.0 * options.least_overlap;
        lines.field(
            "needed",
            format!("{needed:.0} % of the suspect; nothing is written"),
        );
    }
    lines.field("time", report::seconds_text(seconds));
    if found.aligned {
        lines.field("written", arguments.output.display());
        if brought.is_some() {
            lines.line(
                "Normals, tangents and bones that are in the file stay as they are in the suspect's pose.",
            );
        } else if found.mirrored() {
            lines
                .line("Its faces wind the other way round now: they were mirrored, and their order is kept.");
        }
    }
    lines
}

/// What is left open by a shape with symmetries.
fn ambiguity(found: &Alignment) -> Option<String> {
    if found.free_directions > 0 {
        return Some(
            "the shape slides on itself, as a sphere does: one of infinitely many positions was taken".into(),
        );
    }
    let others = found.alternatives.len();
    (others > 0).then(|| {
        let positions = report::counted(others, "other position fits", "other positions fit");
        format!("the shape is symmetric: {positions} about as well")
    })
}
