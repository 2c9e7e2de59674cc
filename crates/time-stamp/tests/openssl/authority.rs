//! A throw-away authority by the `openssl` command, which is also the second opinion on stamps.

use std::{
    fs,
    io::ErrorKind,
    process::{Command, Output},
};

use tempfile::TempDir;

/// Names and uses of certificates, and how the authority answers.
const CONFIGURATION: &str = include_str!("openssl.cnf");

/// A folder with keys, certificates and replies, each a file by its name.
pub(crate) struct Authority {
    folder: TempDir,
}

impl Authority {
    pub(crate) fn new() -> Self {
        let authority = Self {
            folder: tempfile::tempdir().unwrap(),
        };
        authority.write("openssl.cnf", CONFIGURATION.as_bytes());
        authority.write("serial", b"4711\n");
        authority
    }

    pub(crate) fn write(&self, name: &str, bytes: &[u8]) {
        fs::write(self.folder.path().join(name), bytes).unwrap();
    }

    pub(crate) fn read(&self, name: &str) -> Vec<u8> {
        fs::read(self.folder.path().join(name)).unwrap()
    }

    pub(crate) fn pem(&self, name: &str) -> String {
        String::from_utf8(self.read(&format!("{name}.pem"))).unwrap()
    }

    /// Runs `openssl`; its arguments are words of a line.
    pub(crate) fn openssl(&self, line: &str) -> Output {
        let mut command = Command::new("openssl");
        let run = command
            .current_dir(self.folder.path())
            .env("OPENSSL_CONF", "openssl.cnf");
        match run.args(line.split_whitespace()).output() {
            Err(error) if error.kind() == ErrorKind::NotFound => {
                panic!(
                    "these tests need the `openssl` command: install OpenSSL 3 (the package is called openssl nearly everywhere)"
                )
            }
            output => output.unwrap(),
        }
    }

    /// As [`openssl`](Self::openssl), for what has to work.
    pub(crate) fn make(&self, line: &str) -> String {
        let output = self.openssl(line);
        let errors = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "openssl {line}: {errors}");
        String::from_utf8_lossy(&output.stdout).into_owned()
    }

    /// A key: `rsa`, or the name of a curve.
    pub(crate) fn key(&self, name: &str, kind: &str) {
        let options = match kind {
            "rsa" => "RSA -pkeyopt rsa_keygen_bits:2048".to_string(),
            "rsa1024" => "RSA -pkeyopt rsa_keygen_bits:1024".to_string(),
            curve => format!("EC -pkeyopt ec_paramgen_curve:{curve}"),
        };
        self.make(&format!("genpkey -algorithm {options} -out {name}.key"));
    }

    /// A certificate `name`.pem for `key`, by its own issuer, for what `section` says.
    pub(crate) fn root(&self, name: &str, key: &str, section: &str) {
        self.make(&format!(
            "req -x509 -new -key {key}.key -extensions {section} -subj /O=Test/CN={name} -days 36500 -out {name}.pem"
        ));
    }

    /// A certificate `name`.pem for `key` by the issuer whose certificate and key are called `issuer`; more options behind.
    pub(crate) fn issue(&self, name: &str, key: &str, issuer: (&str, &str), section: &str, more: &str) {
        let (issuer, issuer_key) = issuer;
        self.make(&format!(
            "req -new -key {key}.key -subj /O=Test/CN={name} -out {name}.csr"
        ));
        let days = if more.contains("-days") { "" } else { "-days 36000" };
        self.make(&format!(
            "x509 -req -in {name}.csr -CA {issuer}.pem -CAkey {issuer_key}.key -set_serial {serial} \
             -extfile openssl.cnf -extensions {section} {days} {more} -out {name}.pem",
            serial = 1 + name
                .bytes()
                .fold(7, |sum, byte| sum * 31 % 65521 + u64::from(byte)),
        ));
    }

    /// The authority's reply to a query, as section `answers` of the configuration has it.
    pub(crate) fn reply(&self, query: &[u8], signer: &str, key: &str, chain: &str, answers: &str) -> Vec<u8> {
        // Tests of one authority run one after another: the file of serial numbers is one.
        self.write("query.tsq", query);
        self.make(&format!(
            "ts -reply -config openssl.cnf -section {answers} -queryfile query.tsq \
             -signer {signer}.pem -inkey {key}.key -chain {chain}.pem -out reply.tsr"
        ));
        self.read("reply.tsr")
    }

    /// A token that says `info`, signed by whoever, fit for it or not.
    pub(crate) fn token(&self, info: &[u8], signer: &str, key: &str, more: &str) -> Vec<u8> {
        self.write("info.der", info);
        self.make(&format!(
            "cms -sign -binary -nodetach -in info.der -econtent_type 1.2.840.113549.1.9.16.1.4 -md sha256 \
             -signer {signer}.pem -inkey {key}.key {more} -outform DER -out token.der"
        ));
        self.read("token.der")
    }

    /// The number of the last reply.
    pub(crate) fn last_serial(&self) -> String {
        let serial = String::from_utf8(self.read("serial")).unwrap();
        serial.trim().to_lowercase()
    }

    /// What `openssl ts -verify` says about a reply or a token, at a time in seconds since 1970, or now.
    pub(crate) fn verifies(
        &self,
        reply: &[u8],
        of: &str,
        roots: &str,
        time: Option<u64>,
    ) -> Result<(), String> {
        self.write("suspect.tsr", reply);
        let token = if is_token(reply) { "-token_in" } else { "" };
        let time = time.map(|time| format!("-attime {time}")).unwrap_or_default();
        let output = self.openssl(&format!(
            "ts -verify -in suspect.tsr {token} {of} -CAfile {roots}.pem {time}"
        ));
        match output.status.success() {
            true => Ok(()),
            false => Err(String::from_utf8_lossy(&output.stderr).into_owned()),
        }
    }
}

/// Whether signed data begin, not a reply's status.
fn is_token(reply: &[u8]) -> bool {
    reply.windows(2).take(6).any(|pair| pair == [0x06, 0x09])
}

/// DER: a tag and what is in it.
pub(crate) fn der(tag: u8, parts: &[&[u8]]) -> Vec<u8> {
    let body = parts.concat();
    let length = body.len();
    let length = match length {
        0..128 => vec![length as u8],
        128..256 => vec![0x81, length as u8],
        _ => vec![0x82, (length >> 8) as u8, length as u8],
    };
    [&[tag], &*length, &body].concat()
}
