use std::{path::Path, sync::Arc};

use anyhow::Result;
use serde_json::{Map, Value, json};

use super::{
    look_up::{Catalogue, Finding, LookedUp},
    words,
};
use crate::{
    Answer,
    args::{LibrarySearch, Searching},
    files,
    progress::Progress,
    report,
    suspects::{Inquiry, ReportPage, Session},
};

pub(crate) fn run(arguments: &LibrarySearch) -> Result<Answer> {
    let search = &arguments.search;
    let session = Session::begin(None, false, &search.time_limit, &search.common);
    let suspects = session.listed(&arguments.suspects)?;
    let catalogue = session.read(|job| Catalogue::open(search, job))?;
    let asking = Asking {
        search,
        session: &session,
        catalogue,
    };
    session.judge(&asking, &suspects, None, "Found in the library:")
}

/// A library that is asked for one suspect after the other.
struct Asking<'a> {
    search: &'a Searching,
    session: &'a Session<'a>,
    catalogue: Catalogue,
}

/// A search writes no page for people.
pub(super) enum NoPage {}

impl ReportPage for NoPage {
    fn failed(&mut self, _: &Path, _: &str) {
        match *self {}
    }

    fn html(&self) -> String {
        match *self {}
    }
}

impl Inquiry for Asking<'_> {
    type Page = NoPage;

    fn judge(&self, path: &Path, progress: &Arc<Progress>, _: Option<&mut NoPage>) -> Result<bool> {
        let suspect = files::open_mesh(path)?;
        let job = progress.job(self.search.common.threads());
        progress.begin("search", "searching the library");
        let found = self.catalogue.look_up(&suspect, path, &job);
        let found = self.session.within_limit_at(path, found, &job)?;
        let seconds = progress.finish();
        print(&self.catalogue, self.search, path, &found, &seconds)?;
        Ok(found.best.is_some())
    }
}

/// Says what was found.
pub(super) fn print(
    catalogue: &Catalogue,
    search: &Searching,
    path: &Path,
    found: &LookedUp,
    seconds: &report::Seconds,
) -> Result<()> {
    let mut object = described(catalogue, found)?;
    object.insert("suspect".into(), json!(path));
    object.insert("library".into(), json!(search.library));
    object.insert("seconds".into(), report::seconds_json(seconds));
    let lines = words::summary(path, catalogue, search, found, seconds)?;
    report::print(search.common.json, &object.into(), &lines)
}

/// What was found, as `--json` prints it.
fn described(catalogue: &Catalogue, found: &LookedUp) -> Result<Map<String, Value>> {
    let best = found.best();
    let finding = best.and_then(|best| best.finding.as_ref());
    let lying = finding.and_then(Finding::lying);
    let marked = match finding {
        Some(Finding::Marked(marked)) => Some(marked),
        _ => None,
    };
    let statement = marked.and_then(|marked| Some(best?.certificates.get(marked.certificate)?.statement()));
    let original = match best {
        Some(best) => {
            let files = catalogue.library.files(best.record.id)?;
            json!({
                "number": best.record.id.number(),
                "name": best.record.name,
                "digest": best.record.digest,
                "files": files.into_iter().map(|file| file.path).collect::<Vec<_>>(),
            })
        }
        None => Value::Null,
    };
    let candidates = found.candidates.iter().map(|looked| {
        json!({
            "original": looked.record.digest,
            "name": looked.record.name,
            "score": looked.candidate.score,
            "by": looked.candidate.by.name(),
            "verdict": looked.finding.as_ref().map(Finding::name),
        })
    });
    let object = json!({
        "outcome": finding.map_or("not_found", Finding::name),
        "original": original,
        "recipient": statement.map(|statement| &statement.recipient),
        "message": statement.map(|statement| &statement.message),
        "public_key": statement.map(|statement| statement.public_key.fingerprint()),
        "p_value": marked.map(|marked| found.p_value(marked)),
        "evidence": marked.is_some_and(|marked| found.is_evidence(marked)),
        "readings": found.readings,
        "margin": marked.and_then(|marked| marked.margin),
        "overlap": lying.map(|lying| lying.overlap),
        "coverage": lying.map(|lying| lying.coverage),
        "registration": lying.and_then(|lying| lying.registration),
        "transform": lying.and_then(|lying| lying.transform).map(|transform| transform.to_matrix()),
        "candidates": candidates.collect::<Vec<_>>(),
        "searched": catalogue.index.len(),
    });
    Ok(match object {
        Value::Object(members) => members,
        _ => Map::new(),
    })
}
