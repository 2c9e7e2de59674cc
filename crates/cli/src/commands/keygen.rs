use anyhow::{Context, Result};
use rand_core::UnwrapErr;
use serde_json::json;
use sigmark::SigningKey;

use crate::{
    Answer,
    args::Keygen,
    files::{self, Output},
    keys,
    report::{self, Lines},
};

pub(crate) fn run(arguments: &Keygen) -> Result<Answer> {
    let private = &arguments.output;
    let public = keys::public_path(private);
    files::check_free(private, arguments.force)?;
    files::check_free(&public, arguments.force)?;

    let mut rng = UnwrapErr(getrandom::SysRng);
    let key = SigningKey::generate(arguments.profile.curve(), &mut rng);
    let pem = if arguments.encrypt {
        key.to_encrypted_pem(&keys::new_passphrase(private)?, &mut rng)
            .context("the key can't be locked")?
    } else {
        key.to_pem()
    };
    let public_pem = key.public_key().to_pem();
    let outputs = [
        (private, pem.as_bytes(), true),
        (&public, public_pem.as_bytes(), false),
    ];
    let outputs = outputs.map(|(path, bytes, private)| Output { path, bytes, private });
    files::write_together(&outputs, arguments.force)?;

    let fingerprint = key.public_key().fingerprint();
    let curve = arguments.profile.curve();
    let object = json!({
        "private_key": private,
        "public_key": public,
        "curve": curve.name(),
        "fingerprint": fingerprint,
    });
    let mut lines = Lines::new(format!("New {curve} key {fingerprint}"));
    let (private, public) = (private.display(), public.display());
    lines.field("private key", format!("{private}  (keep it secret, keep a copy)"));
    lines.field("public key", format!("{public}  (for whoever is to verify)"));
    report::print(arguments.json, &object, &lines)?;
    Ok(Answer::Yes)
}
