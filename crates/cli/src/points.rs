//! Pairs of points that people give: where a point of the suspect belongs on the original.

use anyhow::{Context, Result, anyhow, bail};
use mesh_io::Asset;
use registration::PointPair;

/// A point as it was written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Point {
    /// In the coordinates of its file.
    Place([f64; 3]),
    /// A vertex of its file, from 0.
    Vertex(usize),
}

impl Point {
    /// Reads `x,y,z` or a vertex number.
    fn parse(text: &str) -> Option<Self> {
        let words: Vec<&str> = text.split(',').map(str::trim).collect();
        match words.as_slice() {
            [number] => number.parse().ok().map(Self::Vertex),
            [x, y, z] => Self::of_numbers([x, y, z]),
            _ => None,
        }
    }

    fn of_numbers(words: [&str; 3]) -> Option<Self> {
        let [x, y, z] = words.map(|word| word.parse().ok().filter(|x: &f64| x.is_finite()));
        Some(Self::Place([x?, y?, z?]))
    }

    /// Where it lies on the file's surface.
    fn place(self, asset: &Asset) -> Result<[f64; 3]> {
        let number = match self {
            Self::Place(place) => return Ok(place),
            Self::Vertex(number) => number,
        };
        let file = asset.path().display();
        let vertices = asset.welded().vertex_of();
        let Some(vertex) = vertices.get(number) else {
            bail!(
                "{file}: there is no vertex {number}: it has {}, counted from 0",
                vertices.len()
            );
        };
        let vertex = vertex.ok_or_else(|| {
            anyhow!("{file}: vertex {number} belongs to no face; give a vertex of the surface")
        })?;
        Ok(asset.mesh().positions()[vertex as usize])
    }
}

/// A point of the suspect, and the point of the original where it belongs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pair {
    suspect: Point,
    original: Point,
}

const FORM: &str = "give a pair A=B, each x,y,z or the number of a vertex from 0: 1.5,-2,0=10,3,7 or 17=4711";

impl Pair {
    /// Reads `A=B`.
    pub(crate) fn parse(text: &str) -> Result<Self, String> {
        let (suspect, original) = text.split_once('=').ok_or(FORM)?;
        Ok(Self {
            suspect: Point::parse(suspect).ok_or(FORM)?,
            original: Point::parse(original).ok_or(FORM)?,
        })
    }

    /// Reads a line of a file: `A=B`, six coordinates or two vertex numbers.
    fn of_line(line: &str) -> Result<Self, String> {
        const FORMS: &str = "a pair is A=B, six coordinates or two vertex numbers";
        if line.contains('=') {
            return Self::parse(line);
        }
        let words: Vec<&str> = line.split_whitespace().collect();
        let (suspect, original) = match words.as_slice() {
            [a, b] => (Point::parse(a), Point::parse(b)),
            [a, b, c, x, y, z] => (Point::of_numbers([a, b, c]), Point::of_numbers([x, y, z])),
            _ => (None, None),
        };
        Ok(Self {
            suspect: suspect.ok_or(FORMS)?,
            original: original.ok_or(FORMS)?,
        })
    }

    /// The pair in the coordinates of the two files.
    pub(crate) fn place(self, suspect: &Asset, original: &Asset) -> Result<PointPair> {
        Ok(PointPair {
            suspect: self.suspect.place(suspect)?,
            original: self.original.place(original)?,
        })
    }
}

/// Reads a file of pairs, one a line; what follows # is a comment.
pub(crate) fn parse_lines(text: &str) -> Result<Vec<Pair>> {
    let lines = text
        .lines()
        .map(|line| line.split('#').next().unwrap_or("").trim());
    let pairs = (1..).zip(lines).filter(|(_, line)| !line.is_empty());
    pairs
        .map(|(number, line)| {
            Pair::of_line(line)
                .map_err(anyhow::Error::msg)
                .with_context(|| format!("line {number}"))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_are_coordinates_or_vertices_on_either_side() {
        let pair = Pair::parse("-1.5,2, 3e2=7").unwrap();
        assert_eq!(pair.suspect, Point::Place([-1.5, 2.0, 300.0]));
        assert_eq!(pair.original, Point::Vertex(7));
        for wrong in [
            "",
            "1",
            "1,2=3",
            "1,2,3=",
            "a,b,c=1",
            "1,2,3=-4",
            "1,nan,3=4",
            "1=2=3",
            "1.5=2",
        ] {
            assert!(Pair::parse(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_file_holds_a_pair_a_line_in_any_of_the_forms() {
        let text = "# picked by hand\n1 2 3  4 5 6\n\n7 8 # the nose\n1,2,3=9\n";
        let pairs = parse_lines(text).unwrap();
        assert_eq!(
            pairs,
            ["1,2,3=4,5,6", "7=8", "1,2,3=9"].map(|pair| Pair::parse(pair).unwrap())
        );
        let error = parse_lines("1 2\n1 2 3\n").unwrap_err();
        assert_eq!(error.to_string(), "line 2");
        assert!(parse_lines("").unwrap().is_empty());
    }
}
