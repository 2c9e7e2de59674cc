use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use anyhow::{Context, Result};
use mesh_io::{Asset, Format, Precision, write_mesh};

use super::{
    look_up::{Catalogue, Finding, Looked},
    search::{self, NoPage},
};
use crate::{
    Answer,
    args::{Common, LibraryVerify, TimeLimit, Verify},
    batch::Found,
    claims::{Claim, ReadFile},
    commands::verify::Judging,
    files,
    progress::Progress,
    stamps::Stamps,
    suspects::{Inquiry, Session},
};

pub(crate) fn run(arguments: &LibraryVerify) -> Result<Answer> {
    let (path, options) = (&arguments.suspect, &arguments.search);
    // What is searched for and then judged has one time limit.
    let session = Session::begin(None, false, &options.time_limit, &options.common);
    let suspects = [Found {
        path: path.clone(),
        relative: path.clone(),
    }];
    let asking = Asking {
        arguments,
        session: &session,
        suspects: &suspects,
        suspect: files::open_mesh(path)?,
        catalogue: session.read(|job| Catalogue::open(options, job))?,
    };
    session.judge(&asking, &suspects, None, "Found in")
}

/// A suspect whose original a library is asked for.
struct Asking<'a> {
    arguments: &'a LibraryVerify,
    session: &'a Session<'a>,
    suspects: &'a [Found],
    suspect: Asset,
    catalogue: Catalogue,
}

impl Inquiry for Asking<'_> {
    type Page = NoPage;

    fn judge(&self, path: &Path, progress: &Arc<Progress>, _: Option<&mut NoPage>) -> Result<bool> {
        let (catalogue, options) = (&self.catalogue, &self.arguments.search);
        progress.begin("search", "searching the library");
        let job = progress.job(options.common.threads());
        let found = catalogue.look_up(&self.suspect, path, &job);
        let found = self.session.within_limit_at(path, found, &job)?;
        let claimed = found.best().and_then(|best| Some((best, certificate_of(best)?)));
        let Some((best, number)) = claimed else {
            search::print(catalogue, options, path, &found, &progress.finish())?;
            return Ok(false);
        };
        let claim = claim(self.arguments, catalogue, best, number)?;
        let asked = Verify {
            suspects: vec![path.into()],
            certificate: options.library.clone(),
            original: Some(claim.original_path.clone()),
            public_key: options.public_key.clone(),
            dispute: self.arguments.dispute,
            profile: None,
            stamp_roots: None,
            // The one was chosen by what was read with all.
            p_bound: options.p_bound / found.certificates.max(1) as f64,
            enough: None,
            report: None,
            force: false,
            time_limit: TimeLimit::of(options.time_limit.duration()),
            common: Common::of(&options.common),
        };
        let stamps = Stamps::of(&claim.certificate, None)?;
        let judging = Judging::new(&asked, self.session, claim, stamps, self.suspects)?;
        let judging = judging.among(found.certificates);
        (&judging).judge(path, progress, None)
    }
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
