use std::io::{Read, Write};

use base64::{Engine, engine::general_purpose::STANDARD as BASE64};
use flate2::{Compression, read::ZlibDecoder, write::ZlibEncoder};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::CertificateError;

/// Patch labels of all vertices, packed: 32-bit little-endian integers, compressed by zlib, in base64.
///
/// With them a certificate outlives the rule by which patches are cut.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct PackedLabels(String);

/// What a statement holds of labels.
#[derive(Clone, Debug)]
pub(in crate::claim) struct LabelsSummary {
    /// SHA-256 of the labels, 32-bit little-endian integers.
    pub(in crate::claim) digest: [u8; 32],
    /// How many vertices each patch has.
    pub(in crate::claim) patch_sizes: Vec<usize>,
}

impl PackedLabels {
    /// Packs labels.
    pub fn pack(labels: &[u32]) -> Self {
        let bytes: Vec<u8> = labels.iter().flat_map(|label| label.to_le_bytes()).collect();
        let mut packed = ZlibEncoder::new(Vec::new(), Compression::best());
        // Writing to memory does not fail.
        let packed = packed
            .write_all(&bytes)
            .and_then(|()| packed.finish())
            .unwrap_or_default();
        Self(BASE64.encode(packed))
    }

    /// The labels of a mesh of `vertices` vertices; nothing more is unpacked.
    ///
    /// # Errors
    /// When the text is damaged or holds another number of labels.
    pub fn unpack(&self, vertices: usize) -> Result<Vec<u32>, CertificateError> {
        let mut labels = Vec::new();
        self.read(vertices, |piece| {
            labels.extend(piece.iter().map(|&label| u32::from_le_bytes(label)));
            Ok(())
        })?;
        Ok(labels)
    }

    /// What a statement holds of the labels of so many vertices and patches.
    ///
    /// # Errors
    /// As [`unpack`](Self::unpack); when a label names a patch that is not there.
    pub(in crate::claim) fn summary(
        &self,
        vertices: usize,
        patches: usize,
    ) -> Result<LabelsSummary, CertificateError> {
        let mut hash = Sha256::new();
        let mut patch_sizes = vec![0; patches];
        self.read(vertices, |labels| {
            hash.update(labels.as_flattened());
            let labels = labels.iter().map(|&label| u32::from_le_bytes(label) as usize);
            for label in labels.filter(|&label| label > 0) {
                let size = patch_sizes
                    .get_mut(label - 1)
                    .ok_or_else(|| CertificateError::Field {
                        field: "labels",
                        problem: format!("name patch {label}, which \"patches\" does not list"),
                    })?;
                *size += 1;
            }
            Ok(())
        })?;
        Ok(LabelsSummary {
            digest: hash.finalize().into(),
            patch_sizes,
        })
    }

    /// Hands the labels over, little-endian, in pieces that need little memory however many there are.
    fn read(
        &self,
        vertices: usize,
        mut each: impl FnMut(&[[u8; 4]]) -> Result<(), CertificateError>,
    ) -> Result<(), CertificateError> {
        let damaged = || CertificateError::Field {
            field: "labels",
            problem: format!("does not hold {vertices} labels"),
        };
        let packed = BASE64.decode(&self.0).map_err(|_| damaged())?;
        let mut unpacked = ZlibDecoder::new(&packed[..]);
        let mut piece = [[0; 4]; 1 << 12];
        let mut left = vertices;
        while left > 0 {
            let piece = &mut piece[..left.min(1 << 12)];
            unpacked
                .read_exact(piece.as_flattened_mut())
                .map_err(|_| damaged())?;
            each(piece)?;
            left -= piece.len();
        }
        match unpacked.read(&mut [0]) {
            Ok(0) => Ok(()),
            _ => Err(damaged()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn labels_unpack_to_what_was_packed(labels in proptest::collection::vec(0u32..40, 1..9000)) {
            let packed = PackedLabels::pack(&labels);
            prop_assert_eq!(packed.unpack(labels.len()).unwrap(), labels.clone());
            prop_assert!(packed.unpack(labels.len() + 1).is_err());
            prop_assert!(packed.unpack(labels.len() - 1).is_err());
            prop_assert!(PackedLabels(packed.0[1..].into()).unpack(labels.len()).is_err());
        }
    }

    #[test]
    fn a_small_text_asks_for_no_more_memory_than_its_labels_are_said_to_take() {
        let bomb = PackedLabels::pack(&vec![0; 1 << 24]);
        assert!(bomb.0.len() < 1 << 17);
        assert!(bomb.unpack(10).is_err());
        assert!(bomb.unpack(usize::MAX).is_err());
    }
}
