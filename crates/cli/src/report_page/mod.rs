//! The page that `verify --report` writes: what was asked, what was found, and how somebody else finds it again, for people who have to
//! decide something by it.
//!
//! One HTML file that loads nothing and runs nothing. `words` are the sentences, `pictures` what is drawn, `repeat` the commands; `html`
//! is the only way from a text to markup, and escapes it.

mod date;
mod html;
mod pictures;
mod repeat;
mod section;
mod words;

use std::{fs, path::Path, time::SystemTime};

use anyhow::Result;
use job::Job;
use mesh_io::Asset;
use sigmark::{GeometryDigest, Verdict};

use crate::{
    args::Verify,
    claims::{Claim, ReadFile},
    report,
    stamps::Stamps,
};
use html::{Facts, Html, table};

const STYLE: &str = include_str!("style.css");

/// A page that grows by a section a suspect.
pub(crate) struct Page<'a> {
    arguments: &'a Verify,
    claim: &'a Claim,
    stamps: &'a Stamps,
    made: SystemTime,
    suspects: Vec<ReadFile>,
    /// Suspects that could not be read have no entry among those above.
    names: Vec<Html>,
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
        let number = self.sections.len() + 1;
        let name = Html::foreign(path.display().to_string());
        let word = Html::markup(words::word(verdict, self.arguments));
        self.overview.push(vec![
            name.clone().link(number),
            word,
            section::at_most(verdict.p_value),
            section::at_most(verdict.p_dispute()),
        ]);
        self.suspects.push(ReadFile::of(path, &suspect.to_bytes()));
        let head = name.clone().named("h2", number);
        let body = section::section(verdict, self.arguments, self.claim, &pictures);
        self.sections
            .push(head.and(body).within("section", Some("suspect")));
        self.names.push(name);
        Ok(())
    }

    /// A suspect could not be judged.
    pub(crate) fn failed(&mut self, path: &Path, error: &str) {
        let number = self.sections.len() + 1;
        let name = Html::foreign(path.display().to_string());
        let word = Html::markup("Not judged");
        self.overview.push(vec![
            name.clone().link(number),
            word.clone(),
            Html::default(),
            Html::default(),
        ]);
        let what = Html::markup("This file could not be judged, so nothing is said of it: ")
            .and(Html::foreign(error));
        let verdict = word
            .within("strong", None)
            .and(what.within("p", None))
            .within("div", Some("verdict weak"));
        self.sections.push(
            name.clone()
                .named("h2", number)
                .and(verdict)
                .within("section", Some("suspect")),
        );
        self.names.push(name);
    }

    /// The file.
    pub(crate) fn html(&self) -> String {
        let title = match self.names.as_slice() {
            [name] => Html::markup("Signature report: ").and(name.clone()),
            names => Html::text(format!("Signature report on {} models", names.len())),
        };
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
        // In the title of a window there are no elements.
        let plain = match self.names.len() {
            1 => Html::markup("Signature report"),
            _ => title.clone(),
        };
        html::document(&plain, STYLE, &body.within("main", None))
    }

    fn header(&self) -> Html {
        let version = env!("CARGO_PKG_VERSION");
        let made = format!("Made by Sigmark {version} on {}", date::utc(self.made));
        let question =
            Html::markup("Does this 3D model carry the signature that was hidden in the shape of ")
                .and(Html::foreign(self.claim.original_path.display().to_string()).within("strong", None))
                .and(Html::markup("?"));
        let mut header = Html::markup("Signature report").within("h1", None);
        header.push(&question.within("p", Some("question")));
        header.push(&Html::text(made).within("p", Some("made")));
        if self.overview.len() > 1 {
            let heads = ["Suspect", "Answer", "p (owner)", "p (stranger)"];
            header.push(&table("overview", &heads, self.overview.clone()));
        }
        header.within("header", None)
    }

    /// Every file by its bytes.
    fn compared(&self) -> Html {
        let claim = self.claim;
        let original = self.original();
        let mut rows: Vec<Vec<Html>> = self.suspects.iter().map(|file| row("Suspect", file)).collect();
        rows.push(row("Original", &original));
        rows.push(row("Certificate", &claim.certificate_file));
        rows.extend(claim.key_file.iter().map(|file| row("Public key", file)));
        let heads = ["Role", "File", "SHA-256 of its bytes"];
        let note = "The time below a file\u{2019}s name is when it was last changed, as this computer\u{2019}s file system says; it proves nothing.";
        Html::markup("What was compared")
            .within("h2", None)
            .and(table("files", &heads, rows))
            .and(Html::markup(note).within("p", Some("note")))
    }

    fn original(&self) -> ReadFile {
        ReadFile::of(&self.claim.original_path, &self.claim.original.to_bytes())
    }

    /// Who says what of which original.
    fn claimed(&self) -> Html {
        let statement = self.claim.certificate.statement();
        let mut facts = Facts::default();
        let text = |text: &str| match text {
            "" => Html::markup("none"),
            text => Html::foreign(text).within("span", Some("quoted")),
        };
        facts.add("Message", text(&statement.message));
        facts.add("Recipient", text(&statement.recipient));
        let whose = match self.claim.own_key {
            true => {
                "taken from the certificate itself. It shows that certificate and mark belong together, but not whose key it is: anybody can make one."
            }
            false => {
                "given by whoever asked for this report, and the same as in the certificate. Whose it is, is known from where it was got."
            }
        };
        let key = Html::digits(&statement.public_key.fingerprint())
            .and(Html::markup(whose).within("p", Some("note")));
        facts.add("Public key", key);
        let record = &statement.original;
        let digest = GeometryDigest::of(self.claim.original.mesh()).to_string();
        let digest = Html::digits(digest.trim_start_matches("sha256:"));
        let size = format!(
            "SHA-256 of its geometry: {} vertices, {} triangles. The original compared here has it.",
            report::grouped(record.vertices),
            report::grouped(record.triangles)
        );
        facts.add(
            "Original\u{2019}s digest",
            digest.and(Html::text(size).within("p", Some("note"))),
        );
        facts.add("Existed since", self.stamps.html_facts());
        Html::markup("What is claimed")
            .within("h2", None)
            .and(facts.table())
    }

    /// How the signature was checked.
    fn checked(&self) -> Html {
        let certificate = &self.claim.certificate;
        let statement = certificate.statement();
        let covers = match statement.binds_original() {
            true => {
                "h, the hash of a statement that binds the key, the original\u{2019}s geometry, where and how strongly it was marked, the message and the recipient. None of it can be exchanged without another signature."
            }
            false => "the message alone (the paper\u{2019}s profile): it does not say of which model.",
        };
        let mut facts = Facts::default();
        facts.add(
            "Scheme",
            Html::text(statement.scheme.name()).and(Html::text(format!(
                ", {} bits in the shape",
                statement.scheme.bits()
            ))),
        );
        facts.add("It is over", Html::markup(covers));
        facts.add("h", Html::digits(&repeat::hex(certificate.statement_hash())));
        facts.add("Certificate", Html::markup("its signature and its seal were checked by the public key, and its digest of the geometry against the original, before any suspect was looked at."));
        facts.add("Suspect", Html::markup("was laid onto the original; the difference between the two, in the lowest vibration modes of the original\u{2019}s surface, tells the bits. The reader does not know the signature that it looks for, which is why chance can be reckoned with."));
        Html::markup("How it was checked")
            .within("h2", None)
            .and(facts.table())
    }

    /// How to come to the same answer.
    fn again(&self) -> Html {
        let original = self.original();
        let claim = self.claim;
        let files = self
            .suspects
            .iter()
            .chain([&original, &claim.certificate_file])
            .chain(&claim.key_file);
        let sums = format!("sha256sum -c <<'FILES'\n{}FILES", repeat::checksums(files));
        let suspects: Vec<&Path> = self.suspects.iter().map(|file| &*file.path).collect();
        let command = repeat::command(self.arguments, claim, &suspects);
        let version = format!(
            "sigmark --version        # this page was made by sigmark {}",
            env!("CARGO_PKG_VERSION")
        );
        let pre = |text: String| Html::text(text).within("pre", None);
        let step = |text: &'static str, command: Html| Html::markup(text).and(command).within("li", None);
        let steps: Html = [
            step("The same program:", pre(version)),
            step(
                "The same files (on a Mac, <code>shasum -a 256 -c</code>):",
                pre(sums),
            ),
            step("The same question:", pre(command)),
        ]
        .into_iter()
        .collect();
        Html::markup("How to repeat this")
            .within("h2", None)
            .and(
                Html::markup("In the folder in which it was done, or with other paths to the same files:")
                    .within("p", None),
            )
            .and(steps.within("ol", None))
            .and(
                Html::markup("The answer and all numbers come out the same, on any number of processors.")
                    .within("p", Some("note")),
            )
    }

    fn limits(&self) -> Html {
        let limits = [
            "The probabilities are about chance and about made-up claims. They say nothing of how a file came to where it was found, nor who made the original.",
            "A model whose mark is not found may still be a copy: a mark can be removed by whoever is ready to spoil the surface.",
            "This page shows where the surface was moved, which is what the mark is. Give it to those alone who may see the original or the certificate; whoever has both of these can remove the mark.",
        ];
        let items: Html = limits
            .into_iter()
            .map(|limit| Html::markup(limit).within("li", None))
            .collect();
        Html::markup("What this page does not say")
            .within("h2", None)
            .and(items.within("ul", None))
    }
}

/// A file in the table of what was compared.
fn row(role: &'static str, file: &ReadFile) -> Vec<Html> {
    let changed = fs::metadata(&file.path)
        .and_then(|metadata| metadata.modified())
        .ok();
    let changed = changed
        .map(|time| format!(", changed {}", date::utc(time)))
        .unwrap_or_default();
    let size = format!("{} bytes{changed}", report::grouped(file.bytes));
    let name = Html::foreign(file.path.display().to_string()).and(Html::text(size).within("p", Some("note")));
    vec![Html::markup(role), name, Html::digits(&repeat::hex(&file.sha256))]
}

impl Stamps {
    /// Since when the certificate existed, as far as time stamps say.
    fn html_facts(&self) -> Html {
        match self {
            Self::Unchecked(0) => Html::markup("no time stamp says since when. The claim is as old as its owner can show by other means."),
            Self::Unchecked(count) => Html::text(format!(
                "{}, not checked: that takes the root certificates of their authorities (--stamp-roots).",
                report::counted(*count, "time stamp", "time stamps")
            )),
            Self::Checked(stamps) if stamps.is_empty() => Html::markup("no time stamp says since when."),
            Self::Checked(stamps) => stamps
                .iter()
                .map(|stamp| {
                    let text = format!("{}, by {} (serial number {})", stamp.time, stamp.authority, stamp.serial);
                    Html::foreign(text).within("p", None)
                })
                .collect::<Html>()
                .and(Html::markup("Each signature was checked up to the root certificates that were given; whether a certificate was withdrawn since was not asked.").within("p", Some("note"))),
        }
    }
}
