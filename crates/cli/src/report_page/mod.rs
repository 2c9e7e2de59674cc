//! The pages that `verify --report` and `trace --report` write: what was asked, what was found, and how somebody else finds it again, for people who have to
//! decide something by it.
//!
//! One HTML file that loads nothing and runs nothing. `traced` is the page of `trace`; `words` are the sentences of `verify`'s, `pictures` what is drawn, `repeat` the commands; `html`
//! is the only way from a text to markup, and escapes it.

mod date;
mod evidence;
mod html;
mod pictures;
mod repeat;
mod section;
mod traced;
mod words;

use std::{path::Path, time::SystemTime};

use anyhow::Result;
use job::Job;
use mesh_io::Asset;
use sigmark::Verdict;

use crate::{
    args::Verify,
    claims::{Claim, ReadMesh},
    stamps::Stamps,
    suspects::ReportPage,
};
use html::{Html, table};

pub(crate) use traced::TracePage;

const STYLE: &str = include_str!("style.css");

/// A page that grows by a section a suspect.
pub(crate) struct Page<'a> {
    arguments: &'a Verify,
    claim: &'a Claim,
    stamps: &'a Stamps,
    made: SystemTime,
    original: ReadMesh,
    suspects: Vec<ReadMesh>,
    /// Suspects that could not be judged have no entry among those above.
    names: Vec<String>,
    sections: Vec<Html>,
    /// Of each suspect the line in the table of all.
    overview: Vec<Vec<Html>>,
}

impl<'a> Page<'a> {
    /// A page on a claim, made at a time.
    pub(crate) fn new(arguments: &'a Verify, claim: &'a Claim, stamps: &'a Stamps, made: SystemTime) -> Self {
        Self {
            arguments,
            claim,
            stamps,
            made,
            original: ReadMesh::of(&claim.original_path, &claim.original),
            suspects: Vec::new(),
            names: Vec::new(),
            sections: Vec::new(),
            overview: Vec::new(),
        }
    }

    /// A suspect was judged.
    pub(crate) fn judged(
        &mut self,
        path: &Path,
        suspect: &Asset,
        verdict: &Verdict,
        job: &Job,
    ) -> Result<()> {
        let original = self.claim.original.mesh();
        let pictures = pictures::draw(original, suspect.mesh(), verdict.transform.as_ref(), job)?;
        let word = words::word(verdict, self.arguments);
        let chances = [verdict.p_value, verdict.p_dispute()].map(section::at_most);
        let body = section::section(verdict, self.arguments, self.claim, &pictures);
        self.add(path, word, chances, body);
        self.suspects.push(ReadMesh::of(path, suspect));
        Ok(())
    }

    /// A section, and a line in the table of all.
    fn add(&mut self, path: &Path, word: &'static str, [owner, stranger]: [Html; 2], body: Html) {
        let path = path.display().to_string();
        let (name, number) = (Html::foreign(&path), self.sections.len() + 1);
        let link = name.clone().link(number);
        self.overview
            .push(vec![link, Html::markup(word), owner, stranger]);
        let section = name.named("h2", number).and(body);
        self.sections.push(section.within("section", Some("suspect")));
        self.names.push(path);
    }

    fn header(&self) -> Html {
        let version = env!("CARGO_PKG_VERSION");
        let made = format!("Made by Sigmark {version} on {}", date::utc(self.made));
        let question = match self.overview.len() {
            0 | 1 => "Does this 3D model carry the signature that was hidden in the shape of ",
            _ => "Which of these 3D models carry the signature that was hidden in the shape of ",
        };
        let original = Html::foreign(self.claim.original_path.display().to_string()).within("strong", None);
        let question = Html::markup(question).and(original).and(Html::markup("?"));
        let mut header = Html::markup("Signature report").within("h1", None);
        header.push(&question.within("p", Some("question")));
        header.push(&Html::text(made).within("p", Some("made")));
        if self.overview.len() > 1 {
            let heads = ["Suspect", "Answer", "p (owner)", "p (stranger)"];
            header.push(&table("overview", &heads, self.overview.clone()));
        }
        header.within("header", None)
    }
}

impl ReportPage for Page<'_> {
    fn failed(&mut self, path: &Path, error: &str) {
        let body = section::not_judged(error);
        self.add(path, section::NOT_JUDGED, Default::default(), body);
    }

    fn html(&self) -> String {
        let mut body = self.header();
        self.sections.iter().for_each(|section| body.push(section));
        for part in [
            self.compared(),
            self.claimed(),
            self.checked(),
            self.again(),
            self.limits(),
        ] {
            body.push(&part.within("section", None));
        }
        let title = match self.names.as_slice() {
            [name] => format!("Signature report: {name}"),
            names => format!("Signature report on {} models", names.len()),
        };
        html::document(&Html::text(title), STYLE, &body.within("main", None))
    }
}
