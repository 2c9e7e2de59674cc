use anyhow::Result;
use library::Library;
use serde_json::json;

use crate::{
    Answer,
    args::LibraryList,
    report::{self, Lines},
};

/// People are shown so many recipients of an original.
const SHOWN: usize = 4;

pub(crate) fn run(arguments: &LibraryList) -> Result<Answer> {
    let library = Library::open(&arguments.library)?;
    let (records, waiting) = (library.originals()?, library.waiting()?);
    let mut lines = Lines::new(format!(
        "{}: {}",
        arguments.library.display(),
        report::counted(records.len(), "original", "originals")
    ));
    let mut originals = Vec::new();
    for record in &records {
        let certificates = library.certificates(&record.digest)?;
        let files: Vec<String> = library
            .files(record.id)?
            .into_iter()
            .map(|file| file.path)
            .collect();
        let mut recipients: Vec<String> = certificates
            .iter()
            .filter(|certificate| !certificate.recipient.is_empty())
            .map(|certificate| report::quoted(&certificate.recipient))
            .collect();
        let more = recipients.len().saturating_sub(SHOWN);
        recipients.truncate(SHOWN);
        let for_whom = match (recipients.is_empty(), more) {
            (true, _) => String::new(),
            (false, 0) => format!(" for {}", report::listed(&recipients)),
            (false, more) => format!(
                " for {} and {} more",
                recipients.join(", "),
                report::grouped(more)
            ),
        };
        let kept = match record.geometry_bytes {
            Some(bytes) => format!("{} KiB kept", report::grouped(bytes.div_ceil(1024))),
            None => "geometry not kept".into(),
        };
        lines.field(
            &record.id.to_string(),
            format!(
                "{}: {} vertices, {}, {kept}; {}{for_whom}",
                record.name,
                report::grouped(record.vertices),
                report::counted(record.triangles, "triangle", "triangles"),
                report::counted(certificates.len(), "certificate", "certificates"),
            ),
        );
        originals.push(json!({
            "number": record.id.number(),
            "name": record.name,
            "digest": record.digest,
            "vertices": record.vertices,
            "triangles": record.triangles,
            "geometry": record.geometry_bytes,
            "files": files,
            "certificates": certificates.iter().map(|certificate| json!({
                "recipient": certificate.recipient,
                "message": certificate.message,
                "public_key": certificate.key,
            })).collect::<Vec<_>>(),
        }));
    }
    if waiting > 0 {
        let count = report::counted(waiting, "certificate", "certificates");
        lines.field("waiting", format!("{count} of originals that are not here"));
    }
    let object = json!({ "library": arguments.library, "waiting": waiting, "originals": originals });
    report::print(arguments.json, &object, &lines)?;
    Ok(Answer::Yes)
}
