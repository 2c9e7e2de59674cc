//! Wavefront OBJ: `v` and `f` lines, in any order; all other lines are kept and not looked at, but for `vn` where a mesh turns.

use super::{geometry::Geometry, text::TextGeometry};
use crate::error::{CUT_SHORT, Fault};
use crate::format;
use crate::slots::directions::{Found, Unturned};
use crate::words::{Word, Words};

pub(crate) fn read(bytes: &[u8]) -> Result<Geometry, Fault> {
    let mut words = Words::with_continued_lines(bytes, bytes.len() - format::without_bom(bytes).len());
    let mut geometry = TextGeometry::default();
    let mut corners = Vec::new();
    let mut largest: Option<(u32, Word<'_>)> = None;
    while let Some(keyword) = words.next_anywhere() {
        match keyword.text {
            b"v" => geometry.read_vertex(&mut words)?,
            b"f" => {
                corners.clear();
                while let Some(word) = words.next_in_line() {
                    let index = vertex_index(&words, word, geometry.vertex_count())?;
                    corners.push(index);
                    if largest.is_none_or(|(largest, _)| index > largest) {
                        largest = Some((index, word));
                    }
                }
                if corners.len() < 3 {
                    let problem = format!(
                        "this face has {} corners, and needs at least 3: remove it",
                        corners.len()
                    );
                    return Err(words.fault_at(keyword, problem));
                }
                geometry.push_polygon(&corners);
            }
            _ => {}
        }
        words.skip_line();
    }
    // A face may refer to vertices further down, so this can be known only now.
    let count = geometry.vertex_count();
    match largest {
        Some((index, word)) if index as usize >= count => {
            let problem = format!(
                "the face refers to {}, but the file has {count} vertices (counted from 1)",
                word.shown()
            );
            Err(words.fault_at(word, problem + CUT_SHORT))
        }
        _ => Ok(geometry.finish()),
    }
}

/// The normals, `vn`.
pub(crate) fn normals(bytes: &[u8]) -> Found {
    let mut words = Words::with_continued_lines(bytes, bytes.len() - format::without_bom(bytes).len());
    let (mut normals, mut unread) = (TextGeometry::default(), 0);
    while let Some(keyword) = words.next_anywhere() {
        if keyword.text == b"vn" && normals.read_vertex(&mut words).is_err() {
            unread += 1;
        }
        words.skip_line();
    }
    let mut found = Found::default();
    found.lists.extend(normals.into_normals(false));
    if unread > 0 {
        let what = format!("{unread} of the lines vn");
        found.left.push(Unturned::new(what, "they hold no three numbers"));
    }
    found
}

/// The vertex, from 0, of a corner such as `7`, `7/1`, `7//3`, `7/1/3` or `-1/-1/-1`.
fn vertex_index(words: &Words<'_>, word: Word<'_>, vertices_so_far: usize) -> Result<u32, Fault> {
    let end = word
        .text
        .iter()
        .position(|&b| b == b'/')
        .unwrap_or(word.text.len());
    let number = Word {
        text: &word.text[..end],
        ..word
    };
    let Some(number) = number.integer() else {
        let problem = format!(
            "{} is not the corner of a face: expected an index such as 7, 7/1, 7//3 or 7/1/3",
            word.shown()
        );
        return Err(words.fault_at(word, problem));
    };
    let index = match number {
        0 => {
            return Err(words.fault_at(
                word,
                "a face refers to vertex 0, but OBJ counts from 1: export the file again",
            ));
        }
        1.. => number - 1,
        _ => number.saturating_add_unsigned(vertices_so_far as u64),
    };
    u32::try_from(index).map_err(|_| {
        let problem = format!(
            "the face refers to {}, but there are {vertices_so_far} vertices before it",
            word.shown()
        );
        words.fault_at(word, problem)
    })
}
