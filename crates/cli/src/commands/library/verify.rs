use std::path::PathBuf;

use anyhow::{Context, Result};
use mesh_io::{Asset, Format, Precision, write_mesh};

use super::{
    look_up::{Catalogue, Finding, Looked, was_stopped},
    search,
};
use crate::{
    Answer,
    args::{Common, LibraryVerify, TimeLimit, Verify},
    claims::{Claim, ReadFile},
    commands::verify::Judging,
    files,
    progress::Progress,
    stamps::Stamps,
    suspects::Session,
};

pub(crate) fn run(arguments: &LibraryVerify) -> Result<Answer> {
    let (path, options) = (&arguments.suspect, &arguments.search);
    let suspect = files::open_mesh(path)?;
    let catalogue = Catalogue::open(options)?;
    let progress = std::sync::Arc::new(Progress::within(options.time_limit.duration()));
    progress.begin("search", "searching the library");
    let job = progress.job(options.common.threads());
    let found = catalogue.look_up(&*suspect.scene()?, path, &job);
    let found = found.map_err(|error| match was_stopped(&error) {
        true => options.time_limit.exceeded(),
        false => error,
    })?;
    let seconds = progress.finish();
    drop(progress);
    let claimed = found.best().and_then(|best| Some((best, certificate_of(best)?)));
    let Some((best, number)) = claimed else {
        search::print(&catalogue, options, path, &found, &seconds)?;
        return Ok(Answer::No);
    };
    let claim = claim(arguments, &catalogue, best, number)?;
    let asked = Verify {
        suspects: vec![path.clone()],
        certificate: options.library.clone(),
        original: Some(claim.original_path.clone()),
        public_key: options.public_key.clone(),
        dispute: arguments.dispute,
        profile: None,
        stamp_roots: None,
        p_bound: options.p_bound,
        enough: None,
        report: None,
        force: false,
        time_limit: TimeLimit::of(options.time_limit.duration()),
        common: Common::of(&options.common),
    };
    let session = Session::begin(None, false, &asked.time_limit, &asked.common);
    let stamps = Stamps::of(&claim.certificate, &options.library, None)?;
    let suspects = session.listed(&asked.suspects)?;
    let judging = Judging::new(&asked, &session, claim, stamps, &suspects)?;
    session.judge(&&judging, &suspects, None, "Found in")
}

/// The certificate by which a suspect is judged: the one whose mark was found, or where none was, the only one, or the first.
fn certificate_of(best: &Looked) -> Option<usize> {
    match &best.finding {
        Some(Finding::Marked(marked)) => Some(marked.certificate),
        _ if best.certificates.is_empty() => None,
        _ => Some(0),
    }
}

/// The claim that a library has on an original.
fn claim(arguments: &LibraryVerify, catalogue: &Catalogue, best: &Looked, number: usize) -> Result<Claim> {
    let options = &arguments.search;
    let named = || best.record.name.clone();
    let certificate = best.certificates.get(number).cloned().with_context(named)?;
    let mesh = catalogue.geometry(&best.record)?.with_context(named)?;
    let bytes = write_mesh(&mesh, Format::Ply, Precision::Double);
    let original = Asset::from_bytes(bytes, Format::Ply).with_context(named)?;
    let file = catalogue.library.files(best.record.id)?.into_iter().next();
    let text = certificate.to_json().with_context(named)?;
    Ok(Claim {
        certificate_file: ReadFile::of(&options.library, text.as_bytes()),
        public_key: catalogue.key.unwrap_or(*certificate.public_key()),
        certificate,
        key_file: None,
        original,
        rig: catalogue.rig(best)?,
        original_path: file.map_or_else(|| PathBuf::from(named()), |file| file.path.into()),
        own_key: catalogue.key.is_none(),
    })
}
