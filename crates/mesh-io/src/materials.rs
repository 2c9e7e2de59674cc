//! Materials and pictures beside an OBJ or a PLY: no part of the shape, but of what people see.
//!
//! An OBJ names libraries of materials (`mtllib`), and these name pictures (`map_Kd` and its like). A PLY names pictures in comments (`TextureFile`, as MeshLab writes them).
//! Names may hold blanks, a line may hold several, and options stand before them: whatever of a line names a file is taken.

use std::collections::HashSet;
use std::path::Path;
use std::sync::Arc;

use crate::buffer::Buffer;
use crate::companion::name_beside;
use crate::picture::is_picture;
use crate::{Format, format, source};

/// The largest library that is read, in bytes, and the longest line that is looked at.
const LARGEST_LIBRARY: u64 = 1 << 24;
const LONGEST_LINE: usize = 4096;

/// How many words of a line may begin or be a name, and how often a file is sought in all.
const MOST_WORDS: usize = 32;
const MOST_TRIES: usize = 10_000;

/// The names, from the folder, of files that are there and that a mesh file in it refers to; whatever they hold.
pub(crate) fn names(format: Format, bytes: &[u8], folder: &Path) -> Vec<String> {
    let mut names = Names::new(folder);
    match format {
        Format::Obj => {
            names.add_all(bytes, |keyword| keyword == b"mtllib");
            for at in 0..names.found.len() {
                if let Some(library) = library(&folder.join(&names.found[at])) {
                    names.add_all(&library, names_a_picture);
                }
            }
        }
        Format::Ply => {
            let lines = lines(bytes).take_while(|line| *line != b"end_header");
            for comment in lines.filter_map(|line| after(line, |keyword| keyword == b"comment")) {
                if let Some(rest) = after(comment, |keyword| keyword.eq_ignore_ascii_case(b"TextureFile")) {
                    names.add(rest);
                }
            }
        }
        _ => {}
    }
    names.found
}

/// Those of them that are libraries of materials and pictures, with their bytes.
pub(crate) fn beside(format: Format, bytes: &[u8], folder: &Path) -> Vec<Buffer> {
    let read = |name: String| {
        let bytes = source::read(&folder.join(&name), source::LARGEST).ok()?;
        let bytes = Arc::new(bytes);
        (is_picture(&name, &bytes) || is_library(&bytes)).then_some(Buffer { name, bytes })
    };
    names(format, bytes, folder)
        .into_iter()
        .filter_map(read)
        .collect()
}

/// The bytes of a library of materials.
fn library(path: &Path) -> Option<Vec<u8>> {
    let bytes = source::read(path, LARGEST_LIBRARY).ok()?;
    is_library(&bytes).then_some(bytes)
}

/// Whether it is a text with a material.
fn is_library(bytes: &[u8]) -> bool {
    bytes.len() as u64 <= LARGEST_LIBRARY
        && !bytes.contains(&0)
        && lines(bytes).any(|line| after(line, |keyword| keyword == b"newmtl").is_some())
}

fn names_a_picture(keyword: &[u8]) -> bool {
    const OTHERS: [&[u8]; 5] = [b"bump", b"decal", b"disp", b"norm", b"refl"];
    let begins_with = |first: &[u8]| {
        keyword
            .get(..first.len())
            .is_some_and(|own| own.eq_ignore_ascii_case(first))
    };
    begins_with(b"map_") || OTHERS.iter().any(|other| keyword.eq_ignore_ascii_case(other))
}

/// The lines of a text, without blanks around them.
fn lines(bytes: &[u8]) -> impl Iterator<Item = &[u8]> {
    let lines = format::without_bom(bytes).split(|b| matches!(b, b'\n' | b'\r'));
    lines.map(<[u8]>::trim_ascii)
}

/// What follows the first word of a line, if that is a keyword and the line is not too long.
fn after(line: &[u8], is_keyword: impl Fn(&[u8]) -> bool) -> Option<&[u8]> {
    let end = line.iter().position(u8::is_ascii_whitespace)?;
    let is_asked = line.len() <= LONGEST_LINE && is_keyword(&line[..end]);
    is_asked.then(|| line[end..].trim_ascii())
}

/// Names of files that are there, each once.
struct Names<'a> {
    folder: &'a Path,
    found: Vec<String>,
    sought: HashSet<String>,
}

impl<'a> Names<'a> {
    fn new(folder: &'a Path) -> Self {
        Self {
            folder,
            found: Vec::new(),
            sought: HashSet::new(),
        }
    }

    /// Those in the lines of a text that begin with a keyword.
    fn add_all(&mut self, text: &[u8], is_keyword: impl Fn(&[u8]) -> bool) {
        for rest in lines(text).filter_map(|line| after(line, &is_keyword)) {
            self.add(rest);
        }
    }

    /// Those in a line without its keyword: the rest of the line from one of its words on, or one of its words.
    fn add(&mut self, line: &[u8]) {
        let Ok(line) = std::str::from_utf8(line) else {
            return;
        };
        let mut rest = line;
        for word in line.split_ascii_whitespace().take(MOST_WORDS) {
            rest = rest.trim_ascii_start();
            self.seek(rest);
            self.seek(word);
            rest = &rest[word.len()..];
        }
    }

    fn seek(&mut self, name: &str) {
        // As programs on Windows write it.
        let Some(name) = name_beside(&name.replace('\\', "/")) else {
            return;
        };
        let is_new = self.sought.len() < MOST_TRIES && self.sought.insert(name.clone());
        if is_new && self.folder.join(&name).is_file() {
            self.found.push(name);
        }
    }
}
