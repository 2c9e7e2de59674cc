//! The time stamps of a certificate.

use std::path::Path;

use anyhow::{Context, Result};
use serde_json::{Value, json};
use sigmark::Certificate;
use time_stamp::{Roots, Stamp, Stamped};

use crate::{
    files::{self, Text},
    report::{self, Lines},
};

/// What is known of a certificate's stamps.
pub(crate) enum Stamps {
    /// So many are there, and nobody asked.
    Unchecked(usize),
    Checked(Vec<Stamped>),
}

impl Stamps {
    /// Checks every stamp of a certificate against root certificates, if there are any.
    pub(crate) fn of(certificate: &Certificate, path: &Path, roots: Option<&Path>) -> Result<Self> {
        let Some(roots) = roots else {
            return Ok(Self::Unchecked(certificate.stamps().len()));
        };
        let text = files::read_text(roots, Text::Roots)?;
        let roots = Roots::from_pem(&text).with_context(|| roots.display().to_string())?;
        let digest = certificate.digest();
        let checked = certificate.stamps().iter().enumerate().map(|(i, reply)| {
            let stamped = Stamp::from_reply(reply).and_then(|stamp| stamp.verify(&digest, &roots));
            stamped.with_context(|| format!("{}: time stamp {}", path.display(), i + 1))
        });
        Ok(Self::Checked(checked.collect::<Result<_>>()?))
    }

    /// null where nobody asked.
    pub(crate) fn json(&self) -> Value {
        match self {
            Self::Unchecked(_) => Value::Null,
            Self::Checked(stamps) => stamps.iter().map(object).collect(),
        }
    }

    /// Says under a name since when the certificate existed.
    pub(crate) fn tell(&self, name: &str, lines: &mut Lines) {
        match self {
            Self::Unchecked(0) => {}
            Self::Unchecked(count) => {
                let stamps = report::counted(*count, "time stamp", "time stamps");
                let remedy = "give the root certificates of their authorities with --stamp-roots";
                lines.field(name, format!("{stamps}, not checked: {remedy}"));
            }
            Self::Checked(stamps) if stamps.is_empty() => {
                lines.field(name, "no time stamp says since when");
            }
            Self::Checked(stamps) => {
                for Stamped { time, authority, .. } in stamps {
                    lines.field(name, format!("time-stamped {time} by {authority}"));
                }
            }
        }
    }
}

fn object(stamped: &Stamped) -> Value {
    json!({
        "time": stamped.time.to_rfc3339(),
        "authority": stamped.authority,
        "serial": stamped.serial,
    })
}
