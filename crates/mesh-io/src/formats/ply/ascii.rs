use super::Wanted;
use super::faces::{Faces, Triangles};
use super::header::{Element, Header, Property};
use crate::error::{CUT_SHORT, Fault};
use crate::formats::{geometry::Geometry, text::TextGeometry};
use crate::words::{Word, Words, not_a_number};

/// Reads the data as text: one record a line.
pub(super) struct Ascii<'a> {
    words: Words<'a>,
    triangles: Triangles,
}

impl<'a> Ascii<'a> {
    pub(super) fn read(
        bytes: &'a [u8],
        header: &Header<'_>,
        Wanted {
            element: wanted,
            axes,
        }: Wanted,
    ) -> Result<Geometry, Fault> {
        let words = Words::new(bytes, header.end);
        let vertex = super::vertex(header)?;
        let mut ascii = Self {
            words,
            triangles: Triangles::new(header.elements[vertex].count),
        };
        let mut geometry = TextGeometry::default();
        for (number, element) in header.elements.iter().enumerate() {
            // A vertex has its coordinates; what follows them may lack, as in assimp's files of meshes with colours and without.
            let sought = (number == wanted).then_some(axes);
            let needed = match sought {
                _ if number != vertex => element.properties.len(),
                Some(axes) => through(axes),
                None => through(element.axes()?),
            };
            // A digit and a blank a value; the last blank may lack.
            element.check_count(
                (bytes.len() + 1).saturating_sub(ascii.words.position()),
                2 * needed,
            )?;
            if element.properties.is_empty() {
                continue;
            }
            let indices = element.faces();
            for record in 0..element.count {
                let Some(first) = ascii.words.next_anywhere() else {
                    let (count, name) = (element.count, element.name.escape_ascii());
                    let problem = format!(
                        "the file ends after {record} of {count} records of element {name}{CUT_SHORT}"
                    );
                    return Err(ascii.words.fault(problem));
                };
                ascii.words.go_back_to(first);
                let xyz = ascii.record(element, needed, sought, indices)?;
                if sought.is_some() {
                    geometry.push_vertex(&ascii.words, xyz.map(|word| word.unwrap_or(first)))?;
                }
                if let Some(extra) = ascii.words.next_in_line() {
                    let problem = format!(
                        "{} is more than the header declares for this line: mend one of them",
                        extra.shown()
                    );
                    return Err(ascii.words.fault_at(extra, problem));
                }
                ascii.words.skip_line();
            }
        }
        let declared = axes.map(|axis| header.elements[wanted].properties[axis].value);
        let geometry = geometry.finish_as(declared);
        Ok(Geometry {
            triangles: ascii.triangles.triangles,
            ..geometry
        })
    }

    /// Reads one record, which has its first `needed` properties at least; returns the words of those that are `sought`.
    fn record(
        &mut self,
        element: &Element<'_>,
        needed: usize,
        sought: Option<[usize; 3]>,
        indices: Option<(usize, Faces)>,
    ) -> Result<[Option<Word<'a>>; 3], Fault> {
        let mut xyz = [None; 3];
        for (number, property) in element.properties.iter().enumerate() {
            let value = match self.words.next_in_line() {
                Some(value) => value,
                None if number >= needed => break,
                None => return Err(self.cut_short(property)),
            };
            if property.count.is_none() {
                if let Some(axis) = sought.and_then(|axes| axes.iter().position(|&a| a == number)) {
                    xyz[axis] = Some(value);
                }
                continue;
            }
            let faces = indices
                .filter(|&(list, _)| list == number)
                .map(|(_, faces)| faces);
            self.list(property, value, faces)?;
        }
        Ok(xyz)
    }

    fn list(&mut self, property: &Property<'_>, count: Word<'_>, faces: Option<Faces>) -> Result<(), Fault> {
        let length = count.integer().filter(|&n| n >= 0).ok_or_else(|| {
            self.words.fault_at(
                count,
                format!("{} is not the length of a list{CUT_SHORT}", count.shown()),
            )
        })?;
        for _ in 0..length {
            let word = self.words.next_in_line();
            let word = word.ok_or_else(|| self.cut_short(property))?;
            if let Some(faces) = faces {
                let index = word.integer().ok_or_else(|| not_a_number(&self.words, word))?;
                self.triangles
                    .push_index(index, faces)
                    .map_err(|problem| self.words.fault_at(word, problem))?;
            }
        }
        faces.map_or(Ok(()), |faces| {
            self.triangles
                .end_list(faces)
                .map_err(|p| self.words.fault_at(count, p))
        })
    }

    fn cut_short(&self, property: &Property<'_>) -> Fault {
        let name = property.name.escape_ascii();
        let problem = format!("the line ends before the value of property {name}{CUT_SHORT}");
        self.words.fault(problem)
    }
}

/// How many properties a record has up to the last of these.
fn through(axes: [usize; 3]) -> usize {
    axes.into_iter().fold(0, |needed, axis| needed.max(axis + 1))
}
