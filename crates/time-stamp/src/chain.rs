use base64::{Engine, engine::general_purpose::STANDARD as BASE64};

use crate::{
    StampError, Time,
    certificate::{Certificate, shown},
};

const BEGIN: &str = "-----BEGIN CERTIFICATE-----";
const END: &str = "-----END CERTIFICATE-----";

/// So many certificates are tried as another's issuer, and no more: every try may cost a signature check.
const MOST_TRIES: usize = 100;

/// The authorities that a caller trusts: self-signed root certificates, and others that help to get there.
#[derive(Clone, Debug)]
pub struct Roots {
    trusted: Vec<Certificate>,
    helpers: Vec<Certificate>,
}

impl Roots {
    /// Reads certificates in PEM (RFC 7468), one or many, whatever stands between them. Trusted are those whose issuer is
    /// their subject. The others are not trusted by themselves, but are used where a reply lacks them.
    ///
    /// # Errors
    /// [`StampError::NoRoots`] when a certificate can't be read or none is a root; [`StampError::TooLarge`].
    pub fn from_pem(text: &str) -> Result<Self, StampError> {
        crate::check_size(text.len())?;
        let mut certificates = Vec::new();
        for (i, block) in text.split(BEGIN).skip(1).enumerate() {
            let certificate = certificate(block).ok_or_else(|| {
                StampError::NoRoots(format!("certificate {} of the file can't be read", i + 1))
            })?;
            certificates.push(certificate);
        }
        let none = match certificates.len() {
            0 => "the file holds no certificate",
            _ => "none of the file's certificates is self-signed",
        };
        let (trusted, helpers): (Vec<_>, _) = certificates.into_iter().partition(Certificate::is_self_issued);
        match trusted.is_empty() {
            true => Err(StampError::NoRoots(none.into())),
            false => Ok(Self { trusted, helpers }),
        }
    }

    /// Those that the file held beside the trusted ones.
    pub(crate) fn helpers(&self) -> &[Certificate] {
        &self.helpers
    }

    /// All that the file held.
    pub(crate) fn all(&self) -> impl Iterator<Item = &Certificate> {
        self.helpers.iter().chain(&self.trusted)
    }

    /// That a chain of certificates leads from the signer's to a root (RFC 5280 section 6.1), every one of them good at `time`.
    /// The root itself has to be good, too. Each of `others` may be a link. Names match when their bytes do (section 4.1.2.6).
    pub(crate) fn check<'a>(
        &'a self,
        signer: &'a Certificate,
        others: Vec<&'a Certificate>,
        time: Time,
    ) -> Result<(), StampError> {
        signer.check(time)?;
        if self.trusted.iter().any(|root| root.der() == signer.der()) {
            return Ok(());
        }
        let mut search = Search {
            roots: &self.trusted,
            others,
            time,
            path: vec![signer],
            tries: 0,
        };
        search.climb(signer, 0)
    }
}

/// The certificate of a PEM block from behind its first line.
fn certificate(block: &str) -> Option<Certificate> {
    let (body, _) = block.split_once(END)?;
    let body: String = body.split_ascii_whitespace().collect();
    Certificate::from_der(&BASE64.decode(body).ok()?).ok()
}

/// Depth first, from the signer's certificate to a root.
struct Search<'a> {
    roots: &'a [Certificate],
    others: Vec<&'a Certificate>,
    time: Time,
    /// The signer's certificate and those above it, to the present one.
    path: Vec<&'a Certificate>,
    tries: usize,
}

impl<'a> Search<'a> {
    /// From `child` to a root. `between` counts the authorities from the signer's issuer to `child` that are not self-issued,
    /// as the length of a path is counted (RFC 5280 section 4.2.1.9).
    fn climb(&mut self, child: &'a Certificate, between: usize) -> Result<(), StampError> {
        let issued = |issuer: &&Certificate| issuer.subject() == child.issuer();
        let mut failures = Vec::new();
        for root in self.roots.iter().filter(issued) {
            match self.link(root, child, between) {
                Ok(()) => return Ok(()),
                Err(failure) => failures.push(failure),
            }
        }
        let others: Vec<_> = self.others.iter().copied().filter(issued).collect();
        for issuer in others {
            if self.path.iter().any(|below| below.der() == issuer.der()) {
                continue;
            }
            self.path.push(issuer);
            let above = between + usize::from(!issuer.is_self_issued());
            let climbed = self
                .link(issuer, child, between)
                .and_then(|()| self.climb(issuer, above));
            self.path.pop();
            match climbed {
                Ok(()) => return Ok(()),
                Err(failure) => failures.push(failure),
            }
        }
        let untrusted = StampError::Untrusted {
            issuer: shown(child.issuer()),
        };
        Err(failures.into_iter().next().unwrap_or(untrusted))
    }

    fn link(&mut self, issuer: &Certificate, child: &Certificate, between: usize) -> Result<(), StampError> {
        self.tries += 1;
        if self.tries > MOST_TRIES {
            return Err(StampError::TooManyPaths);
        }
        issuer.check(self.time)?;
        issuer.check_issues(between)?;
        child.check_signature(issuer)
    }
}
