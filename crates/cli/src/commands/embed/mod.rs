mod companions;
mod copies;
mod several;
mod words;

use std::{
    fs,
    path::{Path, PathBuf},
    sync::Arc,
};

use anyhow::{Context, Result, bail};
use job::Job;
use mesh_io::Asset;
use quality::FacetTurn;
use serde_json::{Value, json};
use sigmark::{Curve, Embedder, Prediction, Prepared, ReadBack, Scheme, Signed, SigningKey, Strength};

use crate::{
    Answer,
    args::{Embed, Manifest, Profile},
    batch, claims, figures,
    files::{self, Output},
    keys,
    progress::Progress,
    report::{self, Lines, Seconds},
};

pub(crate) use words::{held, limits};

/// A model, and where its signed copy and the certificate go.
struct Task {
    model: PathBuf,
    output: PathBuf,
    certificate: PathBuf,
}

/// What was done with a model, for programs and for people.
struct Done {
    object: Value,
    summary: Lines,
    seconds: f64,
}

pub(crate) fn run(arguments: &Embed) -> Result<Answer> {
    if let Some(list) = &arguments.recipients {
        return copies::run(arguments, list);
    }
    if batch::is_batch(&arguments.models) {
        return several::run(arguments);
    }
    let task = Task {
        model: arguments.models.first().cloned().unwrap_or_default(),
        output: arguments.output.clone(),
        certificate: arguments
            .certificate
            .clone()
            .unwrap_or_else(|| files::with_suffix(&arguments.output, ".cert.json")),
    };
    task.check(arguments)?;
    companions::check_apart(std::slice::from_ref(&task), &arguments.key)?;
    // Before there is a progress bar, which would run over a question for the passphrase.
    let embedder = embedder(arguments, &keys::read_private(&arguments.key)?)?;
    let done = task.sign(arguments, embedder, Progress::new(), !arguments.common.json)?;
    report::print(arguments.common.json, &done.object, &done.summary)?;
    Ok(Answer::Yes)
}

impl Task {
    /// Signs the model and writes both files; announces what it will be good for where that is asked for.
    fn sign(
        &self,
        arguments: &Embed,
        embedder: Embedder,
        progress: Progress,
        announce: bool,
    ) -> Result<Done> {
        let embedder = embedder.original_name(file_name(&self.model));
        let progress = Arc::new(progress);
        let job = progress.job(arguments.common.threads());
        progress.begin("reading", "reading");
        let asset = files::open_mesh(&self.model)?;
        asset.check_name(&self.output)?;
        check_manifest(&asset, &self.model, arguments.c2pa)?;
        let model = || self.model.display().to_string();
        let embedder = embedder.rig(claims::rig_of(&asset, &self.model).as_ref());
        let original = Arc::new(embedder.cut(asset.mesh(), &job).with_context(model)?);
        let announced = |prepared: &Prepared, is_raised| match announce {
            true => progress.tell(&words::planned(&self.model, prepared, is_raised)),
            false => Ok(()),
        };
        let mut prepared = embedder.prepare_in(&original).with_context(model)?;
        announced(&prepared, false)?;
        let recipient = &arguments.recipient;
        let mut attempt = Attempt::make(&prepared, recipient, &asset, &job).with_context(model)?;
        if !attempt.read_back.is_sound() && arguments.leaves_strength_open() {
            // The file's precision is coarser than the mark.
            let stronger = embedder.strength(Strength::STRONG);
            prepared = stronger.prepare_in(&original).with_context(model)?;
            announced(&prepared, true)?;
            attempt = Attempt::make(&prepared, recipient, &asset, &job).with_context(model)?;
        }
        let signed = &attempt.signed;
        if announce && is_held_back(&prepared, signed) {
            progress.tell(&words::held_back(&self.model, signed))?;
        }
        progress.begin("writing", "writing");
        let turn = self.write(&asset, &attempt, arguments.force)?;
        let seconds = progress.finish();
        let mut object = object(arguments, &prepared, signed.prediction(), &seconds);
        object["output"] = json!(self.output);
        object["certificate"] = json!(self.certificate);
        object["facet_turn"] = json!(turn.summary());
        object["flipped"] = turn.flipped().into();
        object["manifest_dropped"] = asset.has_manifest().into();
        let mut summary = words::summary(self, signed, &turn, &seconds);
        if asset.has_manifest() {
            summary.line(words::MANIFEST_DROPPED);
        }
        Ok(Done {
            object,
            summary,
            seconds: seconds.iter().map(|(_, seconds)| seconds).sum(),
        })
    }

    /// Writes the signed mesh and the certificate, if the mark as the file holds it is [sound](ReadBack::is_sound), and the files that it
    /// refers to. Tells how far its facets turned.
    fn write(&self, asset: &Asset, attempt: &Attempt, force: bool) -> Result<FacetTurn> {
        let Attempt {
            signed,
            marked,
            read_back,
            ..
        } = attempt;
        check_sound(read_back, &self.output)?;
        let companions = self.companions(marked)?;
        let (mesh, json) = (marked.to_bytes(), signed.certificate().to_json()?);
        let mut outputs: Vec<Output<'_>> = companions
            .iter()
            .map(|(path, bytes)| Output::public((path, bytes)))
            .collect();
        outputs.push(Output::public((&self.output, &mesh)));
        outputs.push(Output {
            path: &self.certificate,
            bytes: json.as_bytes(),
            private: true,
        });
        let turn = FacetTurn::between(asset.mesh(), marked.mesh())?;
        files::write_together(&outputs, force)?;
        Ok(turn)
    }

    /// Files that the signed mesh refers to by name, and that are not there yet: they go beside it, and never over those of the model.
    fn companions<'a>(&self, marked: &'a Asset) -> Result<Vec<(PathBuf, &'a [u8])>> {
        let mut companions = Vec::new();
        for (name, bytes) in marked.companions() {
            let path = self.output.with_file_name(name);
            if fs::read(&path).is_ok_and(|there| there == bytes) {
                continue;
            }
            if files::resolved(&path) == files::resolved(&self.model.with_file_name(name)) {
                bail!(
                    "{}: the model refers to {name}, which would change; write to another folder, or save the model as GLB",
                    self.output.display()
                );
            }
            batch::make_folder_of(&path)?;
            companions.push((path, bytes));
        }
        Ok(companions)
    }

    /// Both files can be written, and replace nothing that is read.
    fn check(&self, arguments: &Embed) -> Result<()> {
        self.check_apart(&arguments.key)?;
        files::check_free(&self.output, arguments.force)?;
        files::check_free(&self.certificate, arguments.force)
    }

    /// Neither file is one that is read, or the other.
    fn check_apart(&self, key: &Path) -> Result<()> {
        let (output, certificate) = (&self.output, &self.certificate);
        for output in [output, certificate] {
            files::check_apart(
                output,
                &self.model,
                "the model, which you need as it is to verify",
            )?;
            files::check_apart(output, key, "the private key")?;
        }
        files::check_apart(
            certificate,
            output,
            "to be both the signed mesh and the certificate",
        )
    }
}

/// What `--json` prints of every mark.
fn object(arguments: &Embed, prepared: &Prepared, prediction: &Prediction, seconds: &Seconds) -> Value {
    let mut object = figures::of_mark(prepared, prediction, arguments.laplacian.name());
    object.insert("seconds".into(), report::seconds_json(seconds));
    Value::Object(object)
}

/// Refuses a model with a C2PA manifest where that was asked for.
fn check_manifest(asset: &Asset, model: &Path, manifest: Manifest) -> Result<()> {
    if asset.has_manifest() && manifest == Manifest::Refuse {
        bail!(
            "{}: holds a C2PA manifest, which would no longer be true of a signed copy; --c2pa drop leaves it out",
            model.display()
        );
    }
    Ok(())
}

/// Whether triangles that would have turned too far took more of what was foretold than a draw of bits does.
fn is_held_back(prepared: &Prepared, signed: &Signed) -> bool {
    signed.prediction().margin < 0.97 * prepared.prediction().margin
}

/// Refuses a file whose precision is too coarse for the mark.
fn check_sound(read_back: &ReadBack, output: &Path) -> Result<()> {
    if read_back.is_sound() {
        return Ok(());
    }
    bail!(
        "{}: only {:.1} % of the bits survive the precision of this file; mark more strongly with --distortion, \
         or use a file with more digits",
        output.display(),
        100.0 * read_back.extraction_rate
    );
}

/// A model as it would be signed with one strength.
struct Attempt {
    signed: Signed,
    /// As the file holds it, whose precision may be coarser than the mark.
    marked: Asset,
    /// What is read back from it.
    read_back: ReadBack,
}

impl Attempt {
    fn make(prepared: &Prepared, recipient: &str, asset: &Asset, job: &Job) -> Result<Self> {
        let mut signed = prepared.embed_for(recipient, job)?;
        let write = |positions: &[[f64; 3]]| anyhow::Ok(asset.with_positions(positions)?);
        let marked = signed.hold(write, |marked| marked.mesh().positions())?;
        let read_back = signed.read_back(marked.mesh().positions(), job)?;
        Ok(Self {
            signed,
            marked,
            read_back,
        })
    }
}

fn embedder(arguments: &Embed, key: &SigningKey) -> Result<Embedder> {
    let mut embedder = Embedder::new(key)
        .message(&arguments.message)
        .payload(arguments.payload.kind())
        .strength(arguments.strength())
        .laplacian(arguments.laplacian.kind());
    if let Some(rate) = arguments.chip_rate {
        embedder = embedder.chip_rate(rate);
    }
    if let Some(patches) = arguments.patches {
        embedder = embedder.patches(patches);
    }
    if let Some(profile) = arguments.profile {
        if profile.curve() != key.curve() {
            let name = if profile == Profile::Paper {
                "paper"
            } else {
                "standard"
            };
            bail!(
                "{}: this key is on {}, but the {name} profile signs on {}; make a key with `sigmark keygen --profile {name}`",
                arguments.key.display(),
                key.curve(),
                profile.curve()
            );
        }
        embedder = embedder.scheme(profile.scheme());
    }
    // On the paper's curve the scheme hashes with SHA-1 anyway.
    if arguments.sha1 && key.curve() == Curve::P256 {
        embedder = embedder.scheme(Scheme::EcdsaP256Sha1);
    }
    Ok(embedder)
}

/// What of a path is in its folder; nothing of what is no text.
fn file_name(path: &Path) -> &str {
    path.file_name()
        .and_then(|name| name.to_str())
        .unwrap_or_default()
}
