//! The envelope of key files: text with one block between `-----BEGIN …-----` and `-----END …-----` (RFC 7468).

use pkcs8::LineEnding;
use pkcs8::der::pem;
use zeroize::Zeroizing;

use super::KeyError;

/// OpenSSL writes it before a SEC1 key; the key itself names the curve again.
const PARAMETERS: &str = "EC PARAMETERS";

/// A decoded block.
pub(super) struct Block {
    pub(super) label: String,
    pub(super) der: Zeroizing<Vec<u8>>,
}

/// Decodes the one key block of a text. Comments before it are skipped, as is an `EC PARAMETERS` block.
pub(super) fn decode(text: &str) -> Result<Block, KeyError> {
    let (mut label, mut block, mut rest) = next_block(text)?;
    if label == PARAMETERS {
        (label, block, rest) = next_block(rest)?;
    }
    if !rest.trim().is_empty() {
        return Err(KeyError::TrailingText);
    }
    if block.contains("Proc-Type:") {
        return Err(KeyError::LegacyEncryption);
    }
    let (_, der) = pem::decode_vec(block.as_bytes()).map_err(|error| KeyError::DamagedPem {
        detail: error.to_string(),
    })?;
    Ok(Block {
        label: label.to_owned(),
        der: Zeroizing::new(der),
    })
}

/// The label and the text of the first block, boundaries included, and what follows it.
fn next_block(text: &str) -> Result<(&str, &str, &str), KeyError> {
    const BEGIN: &str = "-----BEGIN ";
    const DASHES: &str = "-----";
    let damaged = |detail: &str| KeyError::DamagedPem {
        detail: detail.to_owned(),
    };
    let start = text.find(BEGIN).ok_or(KeyError::NotPem)?;
    let text = &text[start..];
    let label = text[BEGIN.len()..]
        .split_once(DASHES)
        .map(|(label, _)| label)
        .filter(|label| !label.contains(['\n', '\r']))
        .ok_or_else(|| damaged("its first line does not end in dashes"))?;
    let boundary = format!("-----END {label}{DASHES}");
    let end = text
        .find(&boundary)
        .ok_or_else(|| damaged("its last line is missing"))?
        + boundary.len();
    Ok((label, &text[..end], &text[end..]))
}

/// The text of a block, lines ending in "\n".
pub(super) fn encode(label: &str, der: &[u8]) -> Zeroizing<String> {
    let text = pem::encode_string(label, LineEnding::LF, der)
        .expect("a label without dashes and a few hundred octets can be encoded");
    Zeroizing::new(text)
}
