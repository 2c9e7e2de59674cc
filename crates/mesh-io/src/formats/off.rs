//! Geomview OFF, its variants with colours (C), normals (N) and texture coordinates (ST) included.

use super::{geometry::Geometry, text::TextGeometry};
use crate::error::{CUT_SHORT, Fault};
use crate::format;
use crate::slots::directions::{Found, Unturned};
use crate::words::{Word, Words};

pub(crate) fn read(bytes: &[u8]) -> Result<Geometry, Fault> {
    let mut words = Words::new(bytes, bytes.len() - format::without_bom(bytes).len());
    let header = read_keyword(&mut words)?;
    let [vertices, faces] = read_counts(&mut words, header.next, bytes.len())?;

    let mut geometry = read_vertices(&mut words, vertices, 0)?;
    let mut corners = Vec::new();
    for face in 0..faces {
        let Some(count) = words.next_anywhere() else {
            return Err(words.fault(format!("the file ends after {face} of {faces} faces{CUT_SHORT}")));
        };
        read_face(&mut words, count, vertices, &mut corners)?;
        geometry.push_polygon(&corners);
        words.skip_line();
    }
    Ok(geometry.finish())
}

/// The normals of vertices, which follow their coordinates if the keyword has an N.
pub(crate) fn normals(bytes: &[u8]) -> Result<Found, Fault> {
    let mut words = Words::new(bytes, bytes.len() - format::without_bom(bytes).len());
    let header = read_keyword(&mut words)?;
    let [vertices, _] = read_counts(&mut words, header.next, bytes.len())?;
    let mut found = Found::default();
    if header.has_normals {
        match read_vertices(&mut words, vertices, 3) {
            Ok(normals) => found.lists.extend(normals.into_normals(true)),
            Err(fault) => found.left.push(Unturned::new("the normals", fault.problem)),
        }
    }
    Ok(found)
}

/// Reads three numbers of each vertex, after those that are to be passed over.
fn read_vertices(words: &mut Words<'_>, vertices: usize, after: usize) -> Result<TextGeometry, Fault> {
    let mut geometry = TextGeometry::default();
    for vertex in 0..vertices {
        let Some(first) = words.next_anywhere() else {
            return Err(words.fault(format!(
                "the file ends after {vertex} of {vertices} vertices{CUT_SHORT}"
            )));
        };
        words.go_back_to(first);
        for _ in 0..after {
            words.next_in_line();
        }
        geometry.read_vertex(words)?;
        words.skip_line();
    }
    Ok(geometry)
}

/// What the keyword says.
struct Keyword<'a> {
    /// The word after it on its line.
    next: Option<Word<'a>>,
    has_normals: bool,
}

/// Reads `OFF`, `COFF`, `NOFF` and so on. The keyword may be left out.
fn read_keyword<'a>(words: &mut Words<'a>) -> Result<Keyword<'a>, Fault> {
    let Some(keyword) = words.next_anywhere() else {
        return Err(words.fault(format!("expected OFF{CUT_SHORT}")));
    };
    if keyword.integer().is_some() {
        return Ok(Keyword {
            next: Some(keyword),
            has_normals: false,
        });
    }
    let refused = |problem: String| Err(words.fault_at(keyword, problem));
    let Some(prefix) = keyword.text.strip_suffix(b"OFF") else {
        return refused(format!(
            "expected OFF, COFF, NOFF, CNOFF or STOFF, found {}",
            keyword.shown()
        ));
    };
    let prefix = prefix.strip_prefix(b"ST").unwrap_or(prefix);
    let prefix = prefix.strip_prefix(b"C").unwrap_or(prefix);
    match prefix.strip_prefix(b"N").unwrap_or(prefix) {
        b"" => {}
        b"4" | b"n" | b"4n" => {
            let keyword = keyword.text.escape_ascii();
            return refused(format!(
                "{keyword} has vertices of other than three coordinates: convert it to plain OFF"
            ));
        }
        _ => {
            return refused(format!(
                "{} is no kind of OFF that is known here",
                keyword.shown()
            ));
        }
    }
    let next = words.next_in_line();
    match next {
        Some(word) if word.text == b"BINARY" => {
            Err(words.fault_at(word, "binary OFF is not read: convert it to ASCII OFF or to PLY"))
        }
        _ => Ok(Keyword {
            next,
            has_normals: prefix.starts_with(b"N"),
        }),
    }
}

/// Reads the numbers of vertices, faces and (passed over) edges, which the file must be long enough for.
fn read_counts(
    words: &mut Words<'_>,
    first: Option<Word<'_>>,
    file_size: usize,
) -> Result<[usize; 2], Fault> {
    const SHORTEST_LINE: usize = 6; // "0 0 0\n"
    let Some(first) = first.or_else(|| words.next_anywhere()) else {
        return Err(words.fault(format!(
            "expected the numbers of vertices, faces and edges{CUT_SHORT}"
        )));
    };
    let mut counts = [0; 2];
    for (count, word) in counts.iter_mut().zip([Some(first), words.next_in_line()]) {
        let Some(word) = word else {
            return Err(words.fault_at(
                first,
                "expected the numbers of vertices, faces and edges on one line",
            ));
        };
        *count = word
            .integer()
            .and_then(|n| usize::try_from(n).ok())
            .ok_or_else(|| {
                words.fault_at(
                    word,
                    format!("{} is not a count of vertices or faces", word.shown()),
                )
            })?;
        if *count > file_size / SHORTEST_LINE + 1 {
            let problem =
                format!("{count} vertices or faces cannot be in a file of {file_size} bytes{CUT_SHORT}");
            return Err(words.fault_at(word, problem));
        }
    }
    words.skip_line();
    Ok(counts)
}

/// Reads the corners of a face, whose `count` was just read; the colours that may follow are left alone.
fn read_face(
    words: &mut Words<'_>,
    count: Word<'_>,
    vertices: usize,
    corners: &mut Vec<u32>,
) -> Result<(), Fault> {
    let Some(wanted) = count.integer() else {
        return Err(words.fault_at(
            count,
            format!("{} is not the number of a face's corners", count.shown()),
        ));
    };
    if wanted < 3 {
        return Err(words.fault_at(
            count,
            format!("this face has {wanted} corners, and needs at least 3: remove it"),
        ));
    }
    corners.clear();
    for corner in 0..wanted {
        let Some(word) = words.next_in_line() else {
            return Err(words.fault_at(
                count,
                format!("the line ends after {corner} of {wanted} corners{CUT_SHORT}"),
            ));
        };
        let index = word
            .integer()
            .and_then(|i| u32::try_from(i).ok())
            .filter(|&i| (i as usize) < vertices);
        corners.push(index.ok_or_else(|| {
            let problem = format!(
                "{} is not one of the {vertices} vertices (counted from 0)",
                word.shown()
            );
            words.fault_at(word, problem)
        })?);
    }
    Ok(())
}
