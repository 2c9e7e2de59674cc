//! The page that `trace --report` writes: of whose copies a suspect was made, and what that means.

use std::{path::Path, time::SystemTime};

use anyhow::Result;
use job::Job;
use mesh::TriMesh;
use mesh_io::Asset;
use sigmark::claim::Trace;

use super::{
    STYLE, date, evidence,
    html::{self, Facts, Html, table},
    pictures, repeat,
    section::{at_most, gallery, not_judged},
};
use crate::{
    args,
    claims::{ReadFile, ReadMesh},
    commands::{
        trace::{Copies, accused, named},
        verify::{caveat, remark},
    },
    files::{self, Text},
    report,
    suspects::ReportPage,
};

/// A page that grows by a section a suspect.
pub(crate) struct TracePage<'a> {
    arguments: &'a args::Trace,
    mesh: &'a TriMesh,
    copies: &'a Copies,
    made: SystemTime,
    original: ReadMesh,
    suspects: Vec<ReadMesh>,
    /// Certificates of copies that were named.
    certificates: Vec<ReadFile>,
    names: Vec<String>,
    sections: Vec<Html>,
}

impl<'a> TracePage<'a> {
    /// A page that was begun at a time.
    pub(crate) fn new(
        arguments: &'a args::Trace,
        original: &'a Asset,
        copies: &'a Copies,
        made: SystemTime,
    ) -> Self {
        Self {
            arguments,
            mesh: original.mesh(),
            copies,
            made,
            original: ReadMesh::of(&arguments.original, original),
            suspects: Vec::new(),
            certificates: Vec::new(),
            names: Vec::new(),
            sections: Vec::new(),
        }
    }

    /// A suspect was judged.
    pub(crate) fn judged(&mut self, path: &Path, suspect: &Asset, trace: &Trace, job: &Job) -> Result<()> {
        let copies = self.copies;
        for (_, copy) in accused(trace, copies) {
            if self.certificates.iter().all(|file| file.path != copy.certificate) {
                let text = files::read_text(&copy.certificate, Text::Certificate)?;
                self.certificates
                    .push(ReadFile::of(&copy.certificate, text.as_bytes()));
            }
        }
        let pictures = pictures::draw(self.mesh, suspect.mesh(), trace.transform.as_ref(), job)?;
        let body = answer(trace)
            .and(accusations(trace, copies))
            .and(gallery(&pictures, trace.registration()))
            .and(measured(trace, copies));
        self.add(path, body);
        self.suspects.push(ReadMesh::of(path, suspect));
        Ok(())
    }

    fn add(&mut self, path: &Path, body: Html) {
        let path = path.display().to_string();
        let section = Html::foreign(&path)
            .named("h2", self.sections.len() + 1)
            .and(body);
        self.sections.push(section.within("section", Some("suspect")));
        self.names.push(path);
    }

    /// How to come to the same answer.
    fn again(&self) -> Html {
        let files = self
            .suspects
            .iter()
            .chain([&self.original])
            .flat_map(ReadMesh::files)
            .chain(&self.certificates)
            .chain(&self.copies.key_file);
        let suspects: Vec<&Path> = self.suspects.iter().map(|mesh| &*mesh.file.path).collect();
        repeat::steps(files, repeat::trace(self.arguments, &suspects))
    }

    fn header(&self) -> Html {
        let version = env!("CARGO_PKG_VERSION");
        let made = format!("Made by Sigmark {version} on {}", date::utc(self.made));
        let original = Html::foreign(self.arguments.original.display().to_string()).within("strong", None);
        let question = Html::markup("Of which of the copies that were given out of ")
            .and(original)
            .and(Html::markup(" was this made?"));
        let mut header = Html::markup("Tracing report").within("h1", None);
        header.push(&question.within("p", Some("question")));
        header.push(&Html::text(made).within("p", Some("made")));
        header.within("header", None)
    }
}

impl ReportPage for TracePage<'_> {
    fn failed(&mut self, path: &Path, error: &str) {
        self.add(path, not_judged(error));
    }

    fn html(&self) -> String {
        let mut body = self.header();
        self.sections.iter().for_each(|section| body.push(section));
        let key = self.copies.key_file.as_ref();
        let compared = evidence::compared(&self.suspects, &self.original, &self.certificates, key);
        for part in [meaning(), compared, self.again(), limits()] {
            body.push(&part.within("section", None));
        }
        let title = match self.names.as_slice() {
            [name] => format!("Whose copy: {name}"),
            names => format!("Whose copies: {} models", names.len()),
        };
        html::document(&Html::text(title), STYLE, &body.within("main", None))
    }
}

fn answer(trace: &Trace) -> Html {
    let asked = report::counted(trace.candidates, "copy", "copies");
    let (class, word, sentence) = match (trace.accused.len(), trace.mismatch) {
        (0, Some(mismatch)) => (
            "verdict no",
            "Nobody named",
            format!("This is another shape: {}.", remark(mismatch)),
        ),
        (0, None) => (
            "verdict no",
            "Nobody named",
            format!(
                "It has the shape of the original, but nothing of the marks of {asked} that were asked for is in it beyond what chance explains."
            ),
        ),
        (1, _) => (
            "verdict yes",
            "One copy named",
            format!("Of {asked} that were asked for, this was made of one."),
        ),
        (count, _) => (
            "verdict yes",
            "Several copies named",
            format!("Of {asked} that were asked for, this was made of {count} at least, mixed together."),
        ),
    };
    let word = Html::markup(word).within("strong", None);
    word.and(Html::text(sentence).within("p", None))
        .within("div", Some(class))
}

/// Who, and how sure it is.
fn accusations(trace: &Trace, copies: &Copies) -> Html {
    let rows: Vec<Vec<Html>> = accused(trace, copies)
        .map(|(accused, copy)| {
            vec![
                Html::foreign(named(copy)),
                at_most(accused.p_value),
                Html::text(format!("{:.1}", accused.margin)),
                Html::foreign(copy.certificate.display().to_string()),
            ]
        })
        .collect();
    match rows.is_empty() {
        true => Html::default(),
        false => table("overview", &["Copy for", "p", "T0", "Certificate"], rows),
    }
}

fn measured(trace: &Trace, copies: &Copies) -> Html {
    let mut facts = Facts::default();
    let share = |fraction: f64| format!("{:.1} %", 100.0 * fraction);
    facts.add("Copies asked for", Html::text(report::grouped(trace.candidates)));
    if copies.passed_over > 0 {
        facts.add(
            "Passed over",
            Html::text(format!(
                "{} certificates of other originals or keys",
                report::grouped(copies.passed_over)
            )),
        );
    }
    for path in &copies.unreadable {
        facts.add("Unreadable", Html::foreign(path.display().to_string()));
    }
    facts.add("Public key", Html::digits(&copies.key.fingerprint()));
    facts.add(
        "Suspect\u{2019}s surface",
        Html::text(format!("{} of it lies on the original", share(trace.overlap))),
    );
    if let Some(by) = trace.registration() {
        if let Some(caveat) = caveat(by).filter(|_| trace.is_found()) {
            facts.add("Mind", Html::text(format!("{caveat}.")));
        }
        let seen = share(1.0 - trace.missing);
        facts.add(
            "Vertices seen",
            Html::text(format!("{seen} of the original\u{2019}s")),
        );
    }
    Html::markup("Measured").within("h3", None).and(facts.table())
}

fn meaning() -> Html {
    let how = "Every copy that was given out differs from the others by less than one sees, in a pattern of its own that follows from a signed \
               statement with the recipient\u{2019}s name. The suspect was laid onto the original and read once, without any of these patterns; then each was compared with \
               what was read.";
    let p = "<b>p</b> is an upper bound on the probability that anybody at all would be named whose copy is not in the suspect, whatever was done to \
             the copies of others. All copies are counted in it, all positions in which the suspect could lie, and all rounds: who is named second was looked for after the first\u{2019}s \
             pattern was taken out. <b>T<sub>0</sub></b> is the signal-to-noise ratio of the copy\u{2019}s pattern in what was read: the number of standard deviations by which the agreement lies beyond chance, without the limit that so many bits set to that.";
    Html::markup("What it means")
        .within("h2", None)
        .and(Html::markup(how).within("p", None))
        .and(Html::markup(p).within("p", None))
}

fn limits() -> Html {
    let limits = [
        "It says of which copy the file was made, not who gave it away: a copy can be stolen from the one who bought it, or lost, or sold on.",
        "Whoever issues the copies has all of them, and could have given away any. Only what the recipient alone has had since, such as a copy that was handed over before witnesses, rules that out.",
        "p is for certificates that existed before the suspect turned up, which time stamps show. Who could make one up afterwards can try many recipients and messages until one fits: between strangers, p has to be below 2<sup>\u{2212}120</sup>.",
        "Who is not named may have taken part: where many mix their copies, each leaves little. Nothing is said of anybody who is not named.",
        "The certificates hold what is hidden in the copies. With one of them and the original the mark can be removed: neither belongs into other hands than the owner\u{2019}s and the judge\u{2019}s.",
    ];
    let items: Html = limits
        .into_iter()
        .map(|limit| Html::markup(limit).within("li", None))
        .collect();
    Html::markup("What this page does not say")
        .within("h2", None)
        .and(items.within("ul", None))
}
