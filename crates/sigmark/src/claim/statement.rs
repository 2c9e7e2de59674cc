use mhb_core::LaplacianKind;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::{
    CertificateError, PackedLabels,
    certificate::{LabelsSummary, VERSION},
    keys::PublicKey,
};
use crate::{
    mark::{Borders, ChipLayout, ChipPlan, LARGEST_PATCH, MOST_FUNCTIONS, MarkError, VERTICES_PER_FUNCTION},
    payload::{GeometryDigest, Payload, PayloadKind, RigDigest, Scheme},
};

/// No file that is read has more. Every vertex has a label, and many equal ones pack so well that a text of a few megabytes could say
/// gigabytes of them, which take their time to hash.
const MOST_VERTICES: usize = 1 << 27;

/// What a signer says, and what a verdict rests on: who marked which original with what, and exactly how.
///
/// Its [hash](Self::hash) h is what the signature in the shape signs, and what the bits in the shape are permuted by. Nothing that a
/// reader's measurements depend on, beside the suspect, is outside it: so none of it can be chosen once the bits are known.
#[derive(Clone, Debug, PartialEq)]
pub struct Statement {
    /// Who signs.
    pub public_key: PublicKey,
    /// What the signer asserts; may be empty.
    pub message: String,
    /// Whom the copy is for; may be empty.
    pub recipient: String,
    /// The mesh that is signed.
    pub original: OriginalRecord,
    /// The scheme of the signature.
    pub scheme: Scheme,
    /// What of it stands in the shape.
    pub payload: PayloadKind,
    /// How bits sit in patches.
    pub carrier: Carrier,
    /// Which Laplacian gave the harmonics.
    pub laplacian: LaplacianKind,
    /// Which vertices make which patch.
    pub labels: PackedLabels,
    /// m of each patch, the number of its harmonics.
    pub functions: Vec<usize>,
    /// α of each patch in the scale-free convention, positive.
    pub alphas: Vec<f64>,
}

/// The original as the statement knows it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OriginalRecord {
    /// Digest of its welded geometry.
    pub digest: GeometryDigest,
    /// #V after welding.
    pub vertices: usize,
    /// #F after welding.
    pub triangles: usize,
    /// Digest of what poses it; none where nothing does, or nobody said what.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rig: Option<RigDigest>,
}

/// How bits sit in patches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Carrier {
    /// The paper's: the lowest manifold harmonics of each patch, free at its borders, all of one strength, in the order of eq. 15.
    Harmonics {
        /// c, how often each bit stands in a patch.
        chip_rate: usize,
    },
    /// Harmonics that are zero at borders between patches; the chips of all patches are [pooled](ChipPlan::Pooled) by h.
    PooledHarmonics,
}

impl Carrier {
    /// The name in certificates and statements.
    pub fn name(self) -> &'static str {
        match self {
            Self::Harmonics { .. } => "harmonics",
            Self::PooledHarmonics => "pooled-harmonics",
        }
    }

    /// The carrier with a name, and a chip rate if it has one.
    pub(super) fn named(name: &str, chip_rate: Option<usize>) -> Option<Self> {
        match (name, chip_rate) {
            ("harmonics", Some(chip_rate)) => Some(Self::Harmonics { chip_rate }),
            ("pooled-harmonics", None) => Some(Self::PooledHarmonics),
            _ => None,
        }
    }

    /// Whether marks of a scheme are carried so: the paper's by its own carrier, and no others, since their readers count on pooled chips.
    pub fn suits(self, scheme: Scheme) -> bool {
        scheme.is_of_paper() == matches!(self, Self::Harmonics { .. })
    }

    /// c, how often each bit stands in a patch, where that is a number.
    pub fn chip_rate(self) -> Option<usize> {
        match self {
            Self::Harmonics { chip_rate } => Some(chip_rate),
            Self::PooledHarmonics => None,
        }
    }

    /// What the harmonics do at borders between patches.
    pub fn borders(self) -> Borders {
        match self {
            Self::Harmonics { .. } => Borders::Free,
            Self::PooledHarmonics => Borders::Fixed,
        }
    }

    /// Which bits lie where in patches with these numbers of harmonics, given h.
    ///
    /// # Errors
    /// [`MarkError::EmptyLayout`] when the chip rate is zero; [`MarkError::Room`].
    pub fn plan(
        self,
        scheme: Scheme,
        payload: PayloadKind,
        functions: &[usize],
        hash: [u8; 32],
    ) -> Result<ChipPlan, MarkError> {
        let least = payload.bits(scheme);
        let bits = payload.mark_bits(scheme, chips_of(functions))?;
        Ok(match self {
            Self::Harmonics { chip_rate } => ChipPlan::EveryPatch(ChipLayout::new(bits, chip_rate)?),
            Self::PooledHarmonics => {
                // Of a code's bits, a random half more than there is payload are enough to read what nothing disturbs.
                let enough = if bits > least { least + least / 2 } else { bits };
                let enough = enough.min(chips_of(functions));
                ChipPlan::Pooled {
                    bits,
                    enough,
                    key: hash,
                }
            }
        })
    }
}

/// How many chips patches with these numbers of harmonics have room for. Numbers may come from a file.
pub(super) fn chips_of(functions: &[usize]) -> usize {
    let places = functions.iter().map(|m| m.saturating_sub(1).saturating_mul(3));
    places.fold(0, usize::saturating_add)
}

/// h, and how many vertices each patch has.
pub(super) struct Checked {
    pub(super) hash: [u8; 32],
    pub(super) patch_sizes: Vec<usize>,
}

impl Statement {
    /// h: SHA-256 over a domain, then every field as its length in bytes, a 64-bit integer, and its bytes. Integers and doubles are
    /// little-endian, texts UTF-8 and keys DER; `docs/certificate.md` lists the fields.
    ///
    /// # Errors
    /// [`CertificateError::Field`] where a value can't be meant: a carrier of another scheme, a strength that is not positive, labels of
    /// another number of vertices, a patch without room for the bits.
    pub fn hash(&self) -> Result<[u8; 32], CertificateError> {
        Ok(self.checked()?.hash)
    }

    /// What the signature in the shape signs: a domain and h. In the paper's scheme the message alone, which binds nothing else.
    pub fn signed_bytes(&self, hash: &[u8; 32]) -> Vec<u8> {
        match self.binds_original() {
            true => [b"sigmark mark v4\0", &hash[..]].concat(),
            false => self.message.as_bytes().to_vec(),
        }
    }

    /// Whether the signature in the shape is over this statement, and so over the original. In the paper's scheme it is over the message
    /// alone: whoever has a model that bears it can name another original.
    pub fn binds_original(&self) -> bool {
        !self.scheme.is_of_paper()
    }

    /// The way from the signature to the bits in the shape, given h.
    ///
    /// # Errors
    /// [`CertificateError::Field`] when there is no room for them.
    pub fn coded(&self, hash: [u8; 32]) -> Result<Payload, CertificateError> {
        Payload::new(self.payload, self.scheme, hash, chips_of(&self.functions)).map_err(wrong_patches)
    }

    /// Which bits lie where, given h.
    ///
    /// # Errors
    /// [`CertificateError::Field`] when the chip rate is zero, or there is no room for the bits.
    pub fn plan(&self, hash: [u8; 32]) -> Result<ChipPlan, CertificateError> {
        let plan = self
            .carrier
            .plan(self.scheme, self.payload, &self.functions, hash);
        plan.map_err(|error| match error {
            MarkError::EmptyLayout { .. } => CertificateError::Field {
                field: "chip_rate",
                problem: "is 0".into(),
            },
            other => wrong_patches(other),
        })
    }

    /// Whether there are patches, with room for every bit; in the paper's carrier just as much in each as it takes.
    fn check_room(&self) -> Result<(), CertificateError> {
        let wrong = |problem: String| CertificateError::Field {
            field: "patches",
            problem,
        };
        let plan = self.plan([0; 32])?;
        if self.functions.is_empty() || self.functions.len() != self.alphas.len() {
            return Err(wrong("is empty".into()));
        }
        plan.check(&self.functions).map_err(wrong_patches)?;
        let least = match plan {
            ChipPlan::EveryPatch(layout) => layout.functions(),
            ChipPlan::Pooled { .. } => 2,
        };
        let is_wrong = |&&m: &&usize| m < least || (m > least && self.carrier.chip_rate().is_some());
        match self.functions.iter().find(is_wrong) {
            Some(m) => Err(wrong(format!(
                "has one of {m} functions, where {least} are needed"
            ))),
            None => Ok(()),
        }
    }

    /// Whether payload and carrier are those of the scheme.
    fn check_kinds(&self) -> Result<(), CertificateError> {
        let Self {
            scheme,
            payload,
            carrier,
            ..
        } = *self;
        let never = |field, name: &str| CertificateError::Field {
            field,
            problem: format!("is \"{name}\", which marks of {scheme} never have"),
        };
        match (payload.suits(scheme), carrier.suits(scheme)) {
            (false, _) => Err(never("payload", payload.name())),
            (_, false) => Err(never("carrier", carrier.name())),
            _ => Ok(()),
        }
    }

    /// Whether there are no more vertices than any mesh has, and every strength is one.
    fn check_numbers(&self) -> Result<(), CertificateError> {
        if self.original.vertices > MOST_VERTICES {
            return Err(CertificateError::Field {
                field: "vertices",
                problem: format!("is {}, more than any mesh has", self.original.vertices),
            });
        }
        match self.alphas.iter().position(|&a| !(a > 0.0 && a.is_finite())) {
            Some(i) => Err(CertificateError::Field {
                field: "alpha",
                problem: format!("of patch {} is {}, not a positive number", i + 1, self.alphas[i]),
            }),
            None => Ok(()),
        }
    }

    /// Checks every field that can be checked without the original, and hashes all; labels are unpacked piece by piece on the way, so
    /// that a small file can't ask for much memory.
    pub(super) fn checked(&self) -> Result<Checked, CertificateError> {
        self.checked_with(PackedLabels::summary)
    }

    /// As [`checked`](Self::checked), with what unpacks labels, given the numbers of vertices and patches.
    pub(super) fn checked_with(
        &self,
        unpack: impl FnOnce(&PackedLabels, usize, usize) -> Result<LabelsSummary, CertificateError>,
    ) -> Result<Checked, CertificateError> {
        self.check_kinds()?;
        self.check_room()?;
        self.check_numbers()?;
        let mut hash = Sha256::new_with_prefix(b"sigmark statement\0");
        let mut field = |bytes: &[u8]| {
            hash.update((bytes.len() as u64).to_le_bytes());
            hash.update(bytes);
        };
        field(&VERSION.to_le_bytes());
        field(&self.public_key.to_spki());
        field(self.original.digest.as_bytes());
        field(&(self.original.vertices as u64).to_le_bytes());
        field(&(self.original.triangles as u64).to_le_bytes());
        field(
            self.original
                .rig
                .as_ref()
                .map_or(&[], |rig| rig.as_bytes().as_slice()),
        );
        field(self.scheme.name().as_bytes());
        field(self.payload.name().as_bytes());
        field(self.carrier.name().as_bytes());
        field(&(self.carrier.chip_rate().unwrap_or(0) as u64).to_le_bytes());
        field(laplacian_name(self.laplacian).as_bytes());
        let functions: Vec<[u8; 8]> = self.functions.iter().map(|&m| (m as u64).to_le_bytes()).collect();
        field(functions.as_flattened());
        let alphas: Vec<[u8; 8]> = self.alphas.iter().map(|a| a.to_le_bytes()).collect();
        field(alphas.as_flattened());
        field(self.message.as_bytes());
        field(self.recipient.as_bytes());
        let LabelsSummary { digest, patch_sizes } =
            unpack(&self.labels, self.original.vertices, self.alphas.len())?;
        field(&digest);
        check_sizes(&patch_sizes, &self.functions)?;
        Ok(Checked {
            hash: hash.finalize().into(),
            patch_sizes,
        })
    }
}

fn wrong_patches(error: MarkError) -> CertificateError {
    CertificateError::Field {
        field: "patches",
        problem: format!("is wrong: {error}"),
    }
}

/// Whether each patch has room for its functions, and neither is too large for anyone to compute.
fn check_sizes(sizes: &[usize], functions: &[usize]) -> Result<(), CertificateError> {
    if let Some(most) = functions.iter().max().filter(|most| **most > MOST_FUNCTIONS) {
        return Err(CertificateError::Field {
            field: "patches",
            problem: format!(
                "has one of {most} functions, and at most {MOST_FUNCTIONS} can be computed with"
            ),
        });
    }
    let least = |i: usize| functions[i].saturating_mul(VERTICES_PER_FUNCTION);
    match (0..sizes.len()).find(|&i| !(least(i)..=LARGEST_PATCH).contains(&sizes[i])) {
        None => Ok(()),
        Some(i) => Err(CertificateError::Field {
            field: "patches",
            problem: format!(
                "has one of {} vertices (number {}), but with {} functions a patch has {} to {LARGEST_PATCH}",
                sizes[i],
                i + 1,
                functions[i],
                least(i),
            ),
        }),
    }
}

/// The name in certificates and statements.
fn laplacian_name(kind: LaplacianKind) -> &'static str {
    match kind {
        LaplacianKind::Intrinsic => "intrinsic",
        _ => "cotangent",
    }
}
