use mesh::{Rig, TriMesh};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

/// SHA-256 of a mesh's geometry: its vertex positions and triangles, in their order. Written as `sha256:` and 64 hex digits.
///
/// What goes in: the text `sigmark geometry v1` and a zero byte; #V and #F as 64-bit integers; every coordinate as the
/// bits of an IEEE double (−0 counted as 0); every triangle as three 32-bit indices; all little-endian.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GeometryDigest([u8; 32]);

impl GeometryDigest {
    /// The digest of a mesh.
    pub fn of(mesh: &TriMesh) -> Self {
        let mut hash = Sha256::new();
        hash.update(b"sigmark geometry v1\0");
        hash.update((mesh.vertex_count() as u64).to_le_bytes());
        hash.update((mesh.triangle_count() as u64).to_le_bytes());
        for position in mesh.positions() {
            for x in position {
                hash.update((x + 0.0).to_le_bytes());
            }
        }
        for triangle in mesh.triangles() {
            for v in triangle {
                hash.update(v.to_le_bytes());
            }
        }
        Self(hash.finalize().into())
    }

    /// The 32 bytes.
    pub fn as_bytes(&self) -> &[u8; 32] {
        &self.0
    }
}

/// SHA-256 of what poses a mesh: joints, weights and morph targets. Written as `sha256:` and 64 hex digits.
///
/// What goes in: the text `sigmark rig v1` and a zero byte, then these fields, each as its length in bytes (a 64-bit integer) and its bytes: #V and the number of joints (64-bit integers); how many joints move each vertex
/// (32-bit integers); these joints, vertex by vertex and ascending (32-bit integers); their weights (IEEE doubles); the number of morph targets (a 64-bit integer); and of each target two fields: the vertices that it
/// moves, ascending (32-bit integers), and their offsets (three IEEE doubles each, −0 counted as 0). All little-endian.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RigDigest([u8; 32]);

impl RigDigest {
    /// The digest of a rig.
    pub fn of(rig: &Rig) -> Self {
        let mut hash = Sha256::new_with_prefix(b"sigmark rig v1\0");
        let weights = || (0..rig.vertices()).flat_map(|v| rig.weights_of(v));
        hash_field(&mut hash, [(rig.vertices() as u64).to_le_bytes()]);
        hash_field(&mut hash, [(rig.joints() as u64).to_le_bytes()]);
        let counts = (0..rig.vertices()).map(|v| rig.weights_of(v).len() as u32);
        hash_field(&mut hash, counts.map(u32::to_le_bytes));
        hash_field(&mut hash, weights().map(|(joint, _)| joint.to_le_bytes()));
        hash_field(&mut hash, weights().map(|(_, weight)| weight.to_le_bytes()));
        hash_field(&mut hash, [(rig.targets().len() as u64).to_le_bytes()]);
        for target in rig.targets() {
            hash_field(&mut hash, target.iter().map(|(vertex, _)| vertex.to_le_bytes()));
            let offsets = target.iter().flat_map(|(_, offset)| offset);
            hash_field(&mut hash, offsets.map(|x| (x + 0.0).to_le_bytes()));
        }
        Self(hash.finalize().into())
    }

    /// The 32 bytes.
    pub fn as_bytes(&self) -> &[u8; 32] {
        &self.0
    }
}

/// The length in bytes of all numbers, and these.
fn hash_field<const N: usize>(hash: &mut Sha256, numbers: impl IntoIterator<Item = [u8; N]> + Clone) {
    let count = numbers.clone().into_iter().count();
    hash.update(((count * N) as u64).to_le_bytes());
    numbers.into_iter().for_each(|number| hash.update(number));
}

/// A digest is written as `sha256:` and 64 hexadecimal digits.
macro_rules! written_as_text {
    ($digest:ident) => {
        impl std::fmt::Display for $digest {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("sha256:")?;
                self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
            }
        }

        impl std::str::FromStr for $digest {
            type Err = String;

            fn from_str(text: &str) -> Result<Self, String> {
                let wrong = || format!("expected `sha256:` and 64 hexadecimal digits, found `{text}`");
                let hex = text
                    .strip_prefix("sha256:")
                    .filter(|hex| hex.len() == 64 && hex.is_ascii())
                    .ok_or_else(wrong)?;
                let mut bytes = [0; 32];
                for (i, byte) in bytes.iter_mut().enumerate() {
                    *byte = u8::from_str_radix(&hex[2 * i..2 * i + 2], 16).map_err(|_| wrong())?;
                }
                Ok(Self(bytes))
            }
        }

        impl Serialize for $digest {
            fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                serializer.collect_str(self)
            }
        }

        impl<'de> Deserialize<'de> for $digest {
            fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                String::deserialize(deserializer)?
                    .parse()
                    .map_err(serde::de::Error::custom)
            }
        }
    };
}

written_as_text!(GeometryDigest);
written_as_text!(RigDigest);

#[cfg(test)]
mod tests {
    use super::*;

    const PUBLISHED: &str = "sha256:5816a46f12019712d0778044effc340ccb51ddca5a6246d678518c1e919f8d64";

    fn triangle(z: f64) -> TriMesh {
        TriMesh::new(
            vec![[0.0, 0.0, z], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            vec![[0, 1, 2]],
        )
        .unwrap()
    }

    #[test]
    fn the_smallest_change_of_a_coordinate_changes_the_digest() {
        assert_ne!(
            GeometryDigest::of(&triangle(0.0)),
            GeometryDigest::of(&triangle(f64::MIN_POSITIVE))
        );
    }

    #[test]
    fn the_two_zeros_are_the_same_place() {
        assert_eq!(
            GeometryDigest::of(&triangle(0.0)),
            GeometryDigest::of(&triangle(-0.0))
        );
    }

    fn rig(weight: f64, offset: f64) -> Rig {
        let rig = Rig::new(&[vec![(0, 1.0), (1, weight)], vec![(1, 1.0)], vec![]]);
        rig.with_targets([vec![(1, [0.0, offset, 0.0])], vec![(0, [1.0; 3])]])
    }

    /// Computed by `hashlib` from the bytes that the page names.
    #[test]
    fn a_rig_has_the_digest_that_the_page_describes() {
        let digest = RigDigest::of(&rig(3.0, 0.5));
        assert_eq!(digest.to_string(), PUBLISHED);
    }

    #[test]
    fn whatever_poses_a_mesh_changes_its_digest() {
        let base = RigDigest::of(&rig(3.0, 0.5));
        let targets = rig(3.0, 0.5).targets().to_vec();
        let weights = [vec![(0, 1.0), (1, 3.0)], vec![(1, 1.0)], vec![]];
        let without = Rig::new(&weights);
        let swapped = without.clone().with_targets(targets.iter().rev().cloned());
        let others = [
            rig(3.0 + 1e-15, 0.5),
            rig(3.0, 0.25),
            without,
            swapped,
            Rig::default(),
        ];
        for other in &others {
            assert_ne!(base, RigDigest::of(other));
        }
        assert_eq!(base, RigDigest::of(&rig(3.0, 0.5)));
    }

    #[test]
    fn a_digest_reads_back_from_its_text() {
        let digest = GeometryDigest::of(&triangle(2.0));
        assert_eq!(digest.to_string().parse(), Ok(digest));
        for wrong in [
            "",
            "sha256:",
            "sha256:00",
            &digest.to_string()[7..],
            &digest.to_string().replace("sha256", "sha512"),
        ] {
            assert!(wrong.parse::<GeometryDigest>().is_err(), "{wrong}");
        }
    }
}
