//! Key files and passphrases.

use std::{
    io::IsTerminal,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result, bail};
use sigmark::signature::{KeyError, PublicKey, SigningKey};

use crate::files;

/// The environment variable that a locked key's passphrase is taken from, for programs that call this one.
const PASSPHRASE: &str = "SIGMARK_PASSPHRASE";

/// Reads a private key, asking for the passphrase if it is locked.
pub(crate) fn read_private(path: &Path) -> Result<SigningKey> {
    let pem = files::read_text(path, "a private key")?;
    match SigningKey::from_pem(&pem) {
        Err(KeyError::PassphraseNeeded) => SigningKey::from_encrypted_pem(&pem, &existing_passphrase(path)?),
        other => other,
    }
    .with_context(|| path.display().to_string())
}

/// Reads a public key.
pub(crate) fn read_public(path: &Path) -> Result<PublicKey> {
    let pem = files::read_text(path, "a public key")?;
    PublicKey::from_pem(&pem).with_context(|| path.display().to_string())
}

/// `owner.pem` → `owner.pub.pem`.
pub(crate) fn public_path(private: &Path) -> PathBuf {
    private.with_extension("pub.pem")
}

fn existing_passphrase(path: &Path) -> Result<String> {
    if let Ok(passphrase) = std::env::var(PASSPHRASE) {
        return Ok(passphrase);
    }
    if !std::io::stdin().is_terminal() {
        bail!(
            "{}: is locked by a passphrase; run in a terminal, or set {PASSPHRASE}",
            path.display()
        );
    }
    rpassword::prompt_password(format!("Passphrase of {}: ", path.display()))
        .context("no passphrase was read")
}

/// A passphrase for a new key, typed twice.
pub(crate) fn new_passphrase() -> Result<String> {
    let passphrase = match std::env::var(PASSPHRASE) {
        Ok(passphrase) => passphrase,
        Err(_) if !std::io::stdin().is_terminal() => {
            bail!("a passphrase is needed to lock the key; run in a terminal, or set {PASSPHRASE}")
        }
        Err(_) => {
            let first = rpassword::prompt_password("New passphrase: ").context("no passphrase was read")?;
            if rpassword::prompt_password("The same again: ").context("no passphrase was read")? != first {
                bail!("the two passphrases differ; nothing was written");
            }
            first
        }
    };
    if passphrase.is_empty() {
        bail!("the passphrase is empty; choose one, or leave out --encrypt");
    }
    Ok(passphrase)
}
