//! The time stamps of a certificate.

use std::{fmt, path::Path};

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
    Checked {
        stamped: Vec<Stamped>,
        refused: Vec<Refused>,
    },
}

/// A stamp that does not check. It counts for nothing, and against nobody: stamps are not sealed, so anybody can add some.
pub(crate) struct Refused {
    /// Which of the certificate's, from 1.
    number: usize,
    reason: String,
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { number, reason } = self;
        write!(
            f,
            "time stamp {number} of the certificate does not check, and counts for nothing: {reason}"
        )
    }
}

impl Stamps {
    /// Checks every stamp of a certificate against root certificates, if there are any; fails where these can't be read.
    pub(crate) fn of(certificate: &Certificate, roots: Option<&Path>) -> Result<Self> {
        let Some(roots) = roots else {
            return Ok(Self::Unchecked(certificate.stamps().len()));
        };
        let text = files::read_text(roots, Text::Roots)?;
        let roots = Roots::from_pem(&text).with_context(|| roots.display().to_string())?;
        let digest = certificate.digest();
        let (mut stamped, mut refused) = (Vec::new(), Vec::new());
        for (number, reply) in (1..).zip(certificate.stamps()) {
            match Stamp::from_reply(reply).and_then(|stamp| stamp.verify(&digest, &roots)) {
                Ok(checked) => stamped.push(checked),
                Err(error) => refused.push(Refused {
                    number,
                    reason: error.to_string(),
                }),
            }
        }
        Ok(Self::Checked { stamped, refused })
    }

    /// Those that check; null where nobody asked.
    pub(crate) fn json(&self) -> Value {
        match self {
            Self::Unchecked(_) => Value::Null,
            Self::Checked { stamped, .. } => stamped.iter().map(object).collect(),
        }
    }

    /// Those that do not, and why; null where nobody asked.
    pub(crate) fn refused_json(&self) -> Value {
        match self {
            Self::Unchecked(_) => Value::Null,
            Self::Checked { refused, .. } => refused
                .iter()
                .map(|Refused { number, reason }| json!({ "number": number, "reason": reason }))
                .collect(),
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
            Self::Checked { stamped, refused } => {
                if stamped.is_empty() {
                    lines.field(name, "no time stamp says since when");
                }
                for Stamped { time, authority, .. } in stamped {
                    lines.field(name, format!("time-stamped {time} by {authority}"));
                }
                for refused in refused {
                    lines.field(name, refused);
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
