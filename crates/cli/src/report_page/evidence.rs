//! What the page says of the claim: which files, who says what, how it was checked, and how to do it again.

use std::{fs, path::Path};

use sigmark::{GeometryDigest, PayloadKind};

use super::{
    Page, date,
    html::{Facts, Html, table},
    repeat,
};
use crate::{
    claims::{ReadFile, ReadMesh},
    report,
    stamps::{Refused, Stamps},
};

impl Page<'_> {
    /// Every file by its bytes.
    pub(super) fn compared(&self) -> Html {
        let claim = self.claim;
        let certificates = std::slice::from_ref(&claim.certificate_file);
        compared(
            &self.suspects,
            &self.original,
            certificates,
            claim.key_file.as_ref(),
        )
    }

    /// Who says what of which original.
    pub(super) fn claimed(&self) -> Html {
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
                "taken from the certificate itself. It shows that certificate and mark belong together, but not whose key it is: \
                     anybody can make one."
            }
            false => {
                "given by whoever asked for this report, and the same as in the certificate. Whose it is, is known from where it was got."
            }
        };
        let key = Html::digits(&statement.public_key.fingerprint())
            .and(Html::markup(whose).within("p", Some("note")));
        facts.add("Public key", key);
        let record = &statement.original;
        let has_it = match GeometryDigest::of(self.claim.original.mesh()) == record.digest {
            true => "The original compared here has it.",
            false => {
                "The original compared here does NOT have it: it is another file of the same geometry. A claim needs the very file."
            }
        };
        let digest = record.digest.to_string();
        let digest = Html::digits(digest.trim_start_matches("sha256:"));
        let size = format!(
            "SHA-256 of its geometry: {} vertices, {} triangles. {has_it}",
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
    pub(super) fn checked(&self) -> Html {
        let certificate = &self.claim.certificate;
        let statement = certificate.statement();
        let covers = match statement.binds_original() {
            true => {
                "h, the hash of a statement that binds the key, the original\u{2019}s geometry, where and how strongly it was \
                     marked, the message and the recipient. None of it can be exchanged without another signature."
            }
            false => "the message alone (the paper\u{2019}s profile): it does not say of which model.",
        };
        let (bits, code_bits) = (
            statement.payload.bits(statement.scheme),
            self.claim.certificate.bits().len(),
        );
        let held = match statement.payload {
            PayloadKind::PlainSignature => "the signature as it is".into(),
            PayloadKind::Tag => format!(
                "a tag of the signature, {bits} bits of a hash over it and h, as a codeword of {code_bits} bits"
            ),
            _ => format!("the whole signature, mixed by h, as a codeword of {code_bits} bits"),
        };
        let mut facts = Facts::default();
        facts.add(
            "Scheme",
            Html::text(statement.scheme.name())
                .and(Html::text(format!(", {} bits", statement.scheme.bits()))),
        );
        facts.add("In the shape", Html::text(held));
        facts.add("It is over", Html::markup(covers));
        facts.add("h", Html::digits(&repeat::hex(certificate.statement_hash())));
        let is_original = GeometryDigest::of(self.claim.original.mesh()) == statement.original.digest;
        facts.add(
            "Certificate",
            Html::markup(match is_original {
                true => {
                    "its signature and its seal were checked by the public key, and its digest of the \
                     geometry against the original, before any suspect was looked at."
                }
                false => {
                    "its signature and its seal were checked by the public key. The file compared as the original has another \
                     digest; its geometry was recognised by a sketch that the seal covers, and the signature does not."
                }
            }),
        );
        facts.add("Suspect", Html::markup("was laid onto the original; the difference between the two, in the lowest vibration \
             modes of the original\u{2019}s surface, tells the bits. The reader does not know the signature that it looks for, \
             which is why chance can be reckoned with."));
        Html::markup("How it was checked")
            .within("h2", None)
            .and(facts.table())
    }

    /// How to come to the same answer.
    pub(super) fn again(&self) -> Html {
        let claim = self.claim;
        let files = self
            .suspects
            .iter()
            .chain([&self.original])
            .flat_map(ReadMesh::files)
            .chain([&claim.certificate_file])
            .chain(&claim.key_file);
        let suspects: Vec<&Path> = self.suspects.iter().map(|mesh| &*mesh.file.path).collect();
        repeat::steps(files, repeat::verify(self.arguments, claim, &suspects))
    }

    /// What a reader might take it for, and it is not.
    pub(super) fn limits(&self) -> Html {
        let limits = [
            "The probabilities are about chance and about made-up claims. They say nothing of how a file came to where it was \
                 found, nor who made the original.",
            "A model whose mark is not found may still be a copy: a mark can be removed by whoever is ready to spoil the surface.",
            "This page shows where the surface was moved, which is what the mark is. Give it to those alone who may see the \
                 original or the certificate; whoever has both of these can remove the mark.",
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

/// Every file by its bytes.
pub(super) fn compared(
    suspects: &[ReadMesh],
    original: &ReadMesh,
    certificates: &[ReadFile],
    key: Option<&ReadFile>,
) -> Html {
    let mut rows: Vec<Vec<Html>> = suspects.iter().flat_map(|mesh| rows("Suspect", mesh)).collect();
    rows.extend(self::rows("Original", original));
    rows.extend(certificates.iter().map(|file| row("Certificate", file)));
    rows.extend(key.map(|file| row("Public key", file)));
    let heads = ["Role", "File", "SHA-256 of its bytes"];
    let note = "The time below a file\u{2019}s name is when it was last changed, as this computer\u{2019}s file system says; \
         it proves nothing.";
    Html::markup("What was compared")
        .within("h2", None)
        .and(table("files", &heads, rows))
        .and(Html::markup(note).within("p", Some("note")))
}

/// A mesh in the table of what was compared, and below it the files that belong to it.
fn rows(role: &'static str, mesh: &ReadMesh) -> Vec<Vec<Html>> {
    let companions = mesh.companions.iter().map(|file| row("Read with it", file));
    std::iter::once(row(role, &mesh.file)).chain(companions).collect()
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
            Self::Checked { stamped, refused } if stamped.is_empty() => {
                Html::markup("no time stamp says since when.").and(refused.iter().map(Refused::html).collect())
            }
            Self::Checked { stamped, refused } => stamped
                .iter()
                .map(|stamp| format!("{}, by {} (serial number {})", stamp.time, stamp.authority, stamp.serial))
                .map(|text| Html::foreign(text).within("p", None))
                .chain(refused.iter().map(Refused::html))
                .collect::<Html>()
                .and(Html::markup("Each stamp was checked up to the root certificates that were given; whether a certificate \
                     was withdrawn since was not asked.").within("p", Some("note"))),
        }
    }
}

impl Refused {
    fn html(&self) -> Html {
        Html::foreign(self.to_string()).within("p", None)
    }
}
