use mesh::TriMesh;
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

impl std::fmt::Display for GeometryDigest {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("sha256:")?;
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

impl std::str::FromStr for GeometryDigest {
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

impl Serialize for GeometryDigest {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for GeometryDigest {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer)?
            .parse()
            .map_err(serde::de::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
