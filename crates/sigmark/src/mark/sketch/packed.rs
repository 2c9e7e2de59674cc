//! A sketch as text: little-endian numbers, compressed by zlib, in base64.

use std::io::{Read, Write};

use base64::{Engine, engine::general_purpose::STANDARD as BASE64};
use flate2::{Compression, read::ZlibDecoder, write::ZlibEncoder};
use mesh::BoundingBox;

use super::{Sketch, VERTICES_PER_WALK, probes};

impl Sketch {
    /// The least and the greatest corner of the bounds (IEEE doubles); the number of first triangles (32-bit integer) and their corners; the
    /// probes (coordinates in single precision); the labels (32-bit integers); for each patch the opposites of its eigenfunctions, a byte each.
    pub(crate) fn to_text(&self) -> String {
        let mut bytes = Vec::new();
        for corner in [self.bounds.min, self.bounds.max] {
            corner.iter().for_each(|x| bytes.extend(x.to_le_bytes()));
        }
        bytes.extend((self.first.len() as u32).to_le_bytes());
        for point in self.first.as_flattened().iter().chain(&self.probes) {
            point.iter().for_each(|x| bytes.extend(x.to_le_bytes()));
        }
        self.labels
            .iter()
            .for_each(|label| bytes.extend(label.to_le_bytes()));
        bytes.extend(self.opposite.iter().flatten().map(|&opposite| u8::from(opposite)));
        let mut packed = ZlibEncoder::new(Vec::new(), Compression::best());
        // Writing to memory does not fail.
        let packed = packed
            .write_all(&bytes)
            .and_then(|()| packed.finish())
            .unwrap_or_default();
        BASE64.encode(packed)
    }

    /// The sketch of an original with so many vertices and triangles, and of patches with so many functions; none where the text is not one. Memory is that of
    /// the sketch, whatever the text is.
    pub(crate) fn from_text(
        text: &str,
        vertices: usize,
        triangles: usize,
        functions: &[usize],
    ) -> Option<Self> {
        let packed = BASE64.decode(text).ok()?;
        let mut numbers = Numbers(ZlibDecoder::new(&packed[..]));
        let mut corner = || Some([numbers.double()?, numbers.double()?, numbers.double()?]);
        let bounds = BoundingBox {
            min: corner()?,
            max: corner()?,
        };
        let walks = numbers.integer()? as usize;
        if walks > 1 + vertices / VERTICES_PER_WALK {
            return None;
        }
        let first = (0..walks).map(|_| Some([numbers.point()?, numbers.point()?, numbers.point()?]));
        let first = first.collect::<Option<_>>()?;
        let probes = probes(vertices).map(|_| numbers.point()).collect::<Option<_>>()?;
        let labels = (0..vertices).map(|_| numbers.integer()).collect::<Option<_>>()?;
        let mut of_patch = |&m: &usize| (0..m).map(|_| numbers.boolean()).collect::<Option<Vec<_>>>();
        let opposite = functions.iter().map(&mut of_patch).collect::<Option<_>>()?;
        numbers.is_at_end().then_some(Self {
            bounds,
            triangles,
            first,
            probes,
            labels,
            opposite,
        })
    }
}

struct Numbers<R>(R);

impl<R: Read> Numbers<R> {
    fn bytes<const N: usize>(&mut self) -> Option<[u8; N]> {
        let mut bytes = [0; N];
        self.0.read_exact(&mut bytes).ok()?;
        Some(bytes)
    }

    fn double(&mut self) -> Option<f64> {
        self.bytes().map(f64::from_le_bytes).filter(|x| x.is_finite())
    }

    fn integer(&mut self) -> Option<u32> {
        self.bytes().map(u32::from_le_bytes)
    }

    fn boolean(&mut self) -> Option<bool> {
        self.bytes().and_then(|[byte]| match byte {
            0 => Some(false),
            1 => Some(true),
            _ => None,
        })
    }

    fn point(&mut self) -> Option<[f32; 3]> {
        let mut coordinate = || self.bytes().map(f32::from_le_bytes).filter(|x| x.is_finite());
        Some([coordinate()?, coordinate()?, coordinate()?])
    }

    fn is_at_end(&mut self) -> bool {
        matches!(self.0.read(&mut [0]), Ok(0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sketch() -> Sketch {
        Sketch {
            bounds: BoundingBox {
                min: [-1.0, 0.0, 0.5],
                max: [2.0, 3.0, 4.0],
            },
            triangles: 30,
            first: vec![[[0.25; 3], [0.5, 0.0, -0.5], [0.125; 3]]],
            probes: (0..17).map(|i| [i as f32, 0.0, 1.0]).collect(),
            labels: (0..17).map(|i| i % 3).collect(),
            opposite: vec![vec![true, false, true], vec![false; 4]],
        }
    }

    #[test]
    fn a_sketch_reads_back_from_its_text() {
        let text = sketch().to_text();
        assert_eq!(Sketch::from_text(&text, 17, 30, &[3, 4]), Some(sketch()));
    }

    #[test]
    fn what_is_no_sketch_of_the_original_is_not_read() {
        let text = sketch().to_text();
        for (vertices, functions) in [
            (16, &[3, 4][..]),
            (18, &[3, 4]),
            (17, &[3]),
            (17, &[3, 5]),
            (17, &[]),
        ] {
            assert_eq!(Sketch::from_text(&text, vertices, 30, functions), None);
        }
        for wrong in ["", "????", &text[..text.len() / 2], &text[4..]] {
            assert_eq!(Sketch::from_text(wrong, 17, 30, &[3, 4]), None);
        }
        let mut endless = sketch();
        endless.labels = vec![0; 1 << 22];
        assert_eq!(Sketch::from_text(&endless.to_text(), 17, 30, &[3, 4]), None);
    }
}
