//! The time stamps of a certificate.

use std::path::Path;

use anyhow::{Context, Result};
use serde_json::{Value, json};
use sigmark::Certificate;
use time_stamp::{Roots, Stamp, Stamped};

use crate::{
    files::{self, Text},
    report,
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

    pub(crate) fn lines(&self) -> Vec<String> {
        let line = |text: String| report::field("existed", text);
        match self {
            Self::Unchecked(0) => Vec::new(),
            Self::Unchecked(count) => {
                let stamps = report::counted(*count, "time stamp", "time stamps");
                vec![line(format!(
                    "{stamps}, not checked: give the root certificates of their authorities with --stamp-roots"
                ))]
            }
            Self::Checked(stamps) if stamps.is_empty() => vec![line("no time stamp says since when".into())],
            Self::Checked(stamps) => {
                let stamps = stamps.iter();
                stamps
                    .map(|stamp| line(format!("time-stamped {} by {}", stamp.time, stamp.authority)))
                    .collect()
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
