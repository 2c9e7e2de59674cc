//! Key files and passphrases.

use std::{
    env,
    io::IsTerminal,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result, bail};
use sigmark::{KeyError, PublicKey, SigningKey};
use zeroize::Zeroizing;

use crate::files::{self, Text};

/// The environment variable that a locked key's passphrase is taken from, for programs that call this one.
const PASSPHRASE: &str = "SIGMARK_PASSPHRASE";

/// Reads a private key, asking for the passphrase if it is locked.
pub(crate) fn read_private(path: &Path) -> Result<SigningKey> {
    let pem = Zeroizing::new(files::read_text(path, Text::PrivateKey)?);
    let key = match SigningKey::from_pem(&pem) {
        Err(KeyError::PassphraseNeeded) => SigningKey::from_encrypted_pem(&pem, &existing_passphrase(path)?),
        other => other,
    };
    key.with_context(|| path.display().to_string())
}

/// Reads a public key; with it comes the file's text.
pub(crate) fn read_public(path: &Path) -> Result<(PublicKey, String)> {
    let pem = files::read_text(path, Text::PublicKey)?;
    let key = PublicKey::from_pem(&pem).with_context(|| path.display().to_string())?;
    Ok((key, pem))
}

/// `owner.pem` → `owner.pub.pem`.
pub(crate) fn public_path(private: &Path) -> PathBuf {
    private.with_extension("pub.pem")
}

fn existing_passphrase(path: &Path) -> Result<Zeroizing<String>> {
    if let Some(passphrase) = passphrase_of_environment()? {
        return Ok(passphrase);
    }
    if !std::io::stdin().is_terminal() {
        bail!(
            "{}: is locked by a passphrase; run in a terminal, or set {PASSPHRASE}",
            path.display()
        );
    }
    let passphrase = rpassword::prompt_password(format!("Passphrase of {}: ", path.display()))
        .with_context(|| format!("{}: no passphrase was read", path.display()))?;
    Ok(Zeroizing::new(passphrase))
}

/// A passphrase for a new key, typed twice.
pub(crate) fn new_passphrase(path: &Path) -> Result<Zeroizing<String>> {
    let shown = path.display();
    let asked = || format!("{shown}: no passphrase was read");
    let passphrase = match passphrase_of_environment()? {
        Some(passphrase) => passphrase,
        None if !std::io::stdin().is_terminal() => {
            bail!("{shown}: a passphrase is needed to lock this key; run in a terminal, or set {PASSPHRASE}")
        }
        None => {
            let asking = |text: String| {
                rpassword::prompt_password(text)
                    .map(Zeroizing::new)
                    .with_context(asked)
            };
            let first = asking(format!("New passphrase of {shown}: "))?;
            if asking("The same again: ".into())? != first {
                bail!("{shown}: the two passphrases differ, so nothing was written; try again");
            }
            first
        }
    };
    if passphrase.is_empty() {
        bail!("{shown}: the passphrase is empty; choose one, or leave out --encrypt");
    }
    Ok(passphrase)
}

fn passphrase_of_environment() -> Result<Option<Zeroizing<String>>> {
    match env::var(PASSPHRASE) {
        Ok(passphrase) => Ok(Some(Zeroizing::new(passphrase))),
        Err(env::VarError::NotPresent) => Ok(None),
        Err(env::VarError::NotUnicode(_)) => {
            bail!(
                "{PASSPHRASE}: is not UTF-8 text; set it from a UTF-8 terminal, or unset it and type the passphrase"
            )
        }
    }
}
