use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use anyhow::{Context, Result};
use job::Job;
use library::{AddedAs, CertificateRecord, Entry, FileRecord, Library, LibraryError};
use serde_json::json;
use sigmark::{Certificate, GeometryDigest};

use super::{is_of_library, record_of};
use crate::{
    Answer,
    args::LibraryAdd,
    batch,
    claims::{self, CERTIFICATE_SUFFIX},
    files, interrupt,
    progress::Progress,
    report::{self, Lines},
};

/// Meshes that are read for each thread, so that memory holds no more.
const A_THREAD: usize = 4;

pub(crate) fn run(arguments: &LibraryAdd) -> Result<Answer> {
    let progress = Arc::new(Progress::new());
    progress.begin("listing", "listing files");
    let (certificates, meshes) = listed(&arguments.paths, &arguments.library)?;
    let mut adding = Adding {
        arguments,
        library: Library::create(&arguments.library)?,
        job: progress.job(arguments.common.threads()),
        counts: Counts::default(),
    };
    progress.begin("certificates", "reading certificates");
    adding.add_certificates(&certificates)?;
    progress.begin("originals", "describing originals");
    adding.add_meshes(&meshes)?;
    let seconds = progress.finish();

    let Adding { library, counts, .. } = adding;
    let (total, waiting) = (library.count()?, library.waiting()?);
    let object = json!({
        "library": arguments.library,
        "originals": counts.originals,
        "known": counts.known,
        "unchanged": counts.unchanged,
        "copies": counts.copies,
        "certificates": counts.certificates,
        "waiting": waiting,
        "failed": counts.failed,
        "total": total,
        "seconds": report::seconds_json(&seconds),
    });
    let mut lines = Lines::new(format!(
        "Added {} and {} to {}",
        report::counted(counts.originals, "original", "originals"),
        report::counted(counts.certificates, "certificate", "certificates"),
        arguments.library.display()
    ));
    for (count, what, why) in [
        (counts.known, "known", "their originals were there already"),
        (counts.unchanged, "unchanged", "not read again"),
        (
            counts.copies,
            "signed copies",
            "beside their certificates, and no originals",
        ),
        (counts.failed, "failed", "standard error says why"),
        (
            waiting,
            "waiting",
            "certificates whose originals are not in the library",
        ),
    ] {
        if count > 0 {
            lines.field(what, format!("{}, {why}", report::grouped(count)));
        }
    }
    lines.field("now", report::counted(total, "original", "originals"));
    lines.field("time", report::seconds_text(&seconds));
    report::print(arguments.common.json, &object, &lines)?;
    Ok(match counts.failed {
        0 => Answer::Yes,
        _ => Answer::Failed,
    })
}

/// Certificates and meshes that were named, and those in folders that were.
fn listed(paths: &[PathBuf], library: &Path) -> Result<(Vec<PathBuf>, Vec<PathBuf>)> {
    let (mut certificates, mut meshes) = (Vec::new(), Vec::new());
    for path in paths {
        let one = std::slice::from_ref(path);
        if path.is_dir() {
            let inside = claims::certificates_in(one)?;
            // A folder of certificates alone is none without meshes.
            match batch::meshes(one, None) {
                Ok(found) => meshes.extend(found.into_iter().map(|found| found.path)),
                Err(_) if !inside.is_empty() => {}
                Err(error) => return Err(error),
            }
            certificates.extend(inside);
        } else if path.to_string_lossy().ends_with(CERTIFICATE_SUFFIX) {
            certificates.push(path.clone());
        } else {
            files::check_apart(library, path, "a mesh that is to be added")?;
            meshes.push(path.clone());
        }
    }
    Ok((certificates, meshes))
}

#[derive(Default)]
struct Counts {
    originals: usize,
    known: usize,
    unchanged: usize,
    copies: usize,
    certificates: usize,
    failed: usize,
}

struct Adding<'a> {
    arguments: &'a LibraryAdd,
    library: Library,
    job: Job,
    counts: Counts,
}

/// What a mesh file turned out to be.
enum Read {
    Original(Box<Entry>),
    /// A copy that was signed, if no certificate names it as its original.
    Copy(Box<Entry>),
}

impl Adding<'_> {
    fn add_certificates(&mut self, paths: &[PathBuf]) -> Result<()> {
        let read = |path: &Path| -> Result<CertificateRecord> {
            let (certificate, text): (Certificate, String) = claims::read_certificate_text(path)?;
            let statement = certificate.statement();
            Ok(CertificateRecord {
                original: statement.original.digest,
                recipient: statement.recipient.clone(),
                message: statement.message.clone(),
                key: certificate.public_key().fingerprint(),
                text,
            })
        };
        for chunk in self.changed(paths, Library::knows)?.chunks(64) {
            let records = self.job.map(chunk.len(), 1, |i| read(&chunk[i].0))?;
            for ((_, file), record) in chunk.iter().zip(records) {
                self.job.go_on()?;
                match record {
                    Ok(record) => {
                        let _whole = interrupt::writing();
                        let is_new = self.library.add_certificate(&record, Some(file))?;
                        self.counts.certificates += usize::from(is_new);
                    }
                    Err(error) => self.failed(&error),
                }
            }
        }
        Ok(())
    }

    fn add_meshes(&mut self, paths: &[PathBuf]) -> Result<()> {
        let keeps_geometry = !self.arguments.no_geometry;
        // Geometry that was not kept is read again where it is to be kept now.
        let is_there = match keeps_geometry {
            true => Library::keeps,
            false => Library::knows,
        };
        let changed = self.changed(paths, is_there)?;
        let at_a_time = A_THREAD * self.job.threads();
        let total = changed.len().max(1);
        for (number, chunk) in changed.chunks(at_a_time).enumerate() {
            self.job.progress((number * at_a_time) as f64 / total as f64)?;
            let read = self.job.map(chunk.len(), 1, |i| {
                read_mesh(&chunk[i].0, &chunk[i].1, keeps_geometry)
            })?;
            for read in read {
                self.job.go_on()?;
                match read {
                    Ok(read) => self.add(read)?,
                    Err(error) if is_of_library(&error) => return Err(error),
                    Err(error) => self.failed(&error),
                }
            }
        }
        Ok(())
    }

    fn add(&mut self, read: Read) -> Result<()> {
        let entry = match read {
            Read::Original(entry) => entry,
            Read::Copy(entry) if self.library.names(&entry.digest)? => entry,
            Read::Copy(_) => {
                self.counts.copies += 1;
                return Ok(());
            }
        };
        let _whole = interrupt::writing();
        match self.library.add(&entry)? {
            AddedAs::New(_) => self.counts.originals += 1,
            AddedAs::Known(_) => self.counts.known += 1,
        }
        Ok(())
    }

    /// Those that are not there as they are now.
    fn changed(
        &mut self,
        paths: &[PathBuf],
        is_there: fn(&Library, &FileRecord) -> Result<bool, LibraryError>,
    ) -> Result<Vec<(PathBuf, FileRecord)>> {
        let mut changed = Vec::new();
        for path in paths {
            match record_of(path) {
                Ok(file) if is_there(&self.library, &file)? => self.counts.unchanged += 1,
                Ok(file) => changed.push((path.clone(), file)),
                Err(error) => self.failed(&error),
            }
        }
        Ok(changed)
    }

    /// A file that could not be added costs its own line.
    fn failed(&mut self, error: &anyhow::Error) {
        self.counts.failed += 1;
        report::failure(error);
    }
}

fn read_mesh(path: &Path, file: &FileRecord, keeps_geometry: bool) -> Result<Read> {
    let shown = || path.display().to_string();
    let asset = files::open_mesh(path)?;
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let scene = asset.scene()?;
    let mesh = asset.mesh();
    let entry = Entry::of(&name, mesh, keeps_geometry).with_context(shown)?;
    let entry = match GeometryDigest::of(&scene) == entry.digest {
        true => entry,
        false => entry.seen_as(&scene).with_context(shown)?,
    };
    let entry = Box::new(entry.lying_in(file.clone()));
    Ok(match files::with_suffix(path, CERTIFICATE_SUFFIX).is_file() {
        true => Read::Copy(entry),
        false => Read::Original(entry),
    })
}
