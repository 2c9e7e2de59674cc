//! The model part of 3MF: XML with vertices and triangles as attributes. Build items and components place the objects.

use std::collections::HashMap;
use std::ops::Range;

use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

use super::geometry::{Geometry, Instance};
use super::text::TextGeometry;
use crate::error::{CUT_SHORT, Fault};
use crate::slots::placement::Placement;
use crate::words::Word;

/// Components in components in components: deeper is an attack.
const DEEPEST: usize = 16;

/// How many objects may be shown: a few that are made of each other could be any number, with meshes or without.
const MOST_SHOWN: usize = 1 << 17;

/// What the file describes.
#[derive(Default)]
struct Model {
    text: TextGeometry,
    /// The mesh's vertices and triangles in the text, of each object that has one.
    meshes: HashMap<String, (Range<usize>, Vec<[u32; 3]>)>,
    /// Objects that others are made of.
    components: HashMap<String, Vec<Part>>,
    /// What objects are called, if anything.
    names: HashMap<String, String>,
    items: Vec<Part>,
}

/// An object where an item or a component puts it.
struct Part {
    object: String,
    placement: Option<Placement>,
    /// The part of the package in which the object lies, where one is named (3MF's production extension).
    path: Option<String>,
    /// Where this stands in the text.
    at: usize,
}

/// Reads the part of this name in its package.
pub(crate) fn read(bytes: &[u8], name: &str) -> Result<Geometry, Fault> {
    Model::of(bytes)?.assembled(bytes, name)
}

impl Model {
    fn of(bytes: &[u8]) -> Result<Self, Fault> {
        let mut model = Self::default();
        let text = std::str::from_utf8(bytes).map_err(|error| {
            Fault::at_line(
                bytes,
                error.valid_up_to(),
                "this is not UTF-8, as 3MF has to be: export the model anew",
            )
        })?;
        let mut reader = Reader::from_str(text);
        let mut object = String::new();
        let (mut first, mut triangles) = (0, Vec::new());
        loop {
            let at = reader.buffer_position() as usize;
            let malformed = |problem: String| {
                Fault::at_line(
                    bytes,
                    at.min(bytes.len()),
                    format!("this is not the XML of 3MF ({problem}){CUT_SHORT}"),
                )
            };
            let event = reader
                .read_event()
                .map_err(|error| malformed(error.to_string()))?;
            let element = match &event {
                Event::Start(element) | Event::Empty(element) => element,
                Event::End(end) if end.local_name().as_ref() == "mesh" => {
                    let vertices = first..model.text.vertex_count();
                    model
                        .meshes
                        .insert(object.clone(), (vertices, std::mem::take(&mut triangles)));
                    continue;
                }
                Event::Eof => break,
                _ => continue,
            };
            match element.local_name().as_ref() {
                "object" => {
                    object = attribute(element, "id").unwrap_or_default();
                    if let Some(name) = attribute(element, "name") {
                        model.names.insert(object.clone(), name);
                    }
                }
                "mesh" => first = model.text.vertex_count(),
                "vertex" => model.take_vertex(bytes, element, at)?,
                "triangle" => {
                    let corner = |name| attribute(element, name)?.parse::<u32>().ok();
                    let (Some(a), Some(b), Some(c)) = (corner("v1"), corner("v2"), corner("v3")) else {
                        return Err(malformed("a triangle without three corners".into()));
                    };
                    triangles.push([a, b, c]);
                }
                name @ ("component" | "item") => {
                    let placed = Part {
                        object: attribute(element, "objectid").unwrap_or_default(),
                        placement: transform(element),
                        path: attribute(element, "path"),
                        at,
                    };
                    match name {
                        "item" => model.items.push(placed),
                        _ => model.components.entry(object.clone()).or_default().push(placed),
                    }
                }
                _ => {}
            }
        }
        Ok(model)
    }

    fn take_vertex(&mut self, bytes: &[u8], element: &BytesStart<'_>, at: usize) -> Result<(), Fault> {
        let numbers = ["x", "y", "z"].map(|name| number(bytes, element, name));
        let [Some(x), Some(y), Some(z)] = numbers else {
            let problem = format!(
                "vertex {} needs three coordinates{CUT_SHORT}",
                self.text.vertex_count()
            );
            return Err(Fault::at_line(bytes, at, problem));
        };
        self.text.push_words([x, y, z]).map_err(|word| {
            Fault::at_line(
                bytes,
                word.start,
                format!("{} is not a number{CUT_SHORT}", word.shown()),
            )
        })
    }

    /// Every mesh where the first build item has it; the other times are instances. Objects that no item builds are not shown.
    fn assembled(mut self, bytes: &[u8], name: &str) -> Result<Geometry, Fault> {
        let mut gathered = Gathered {
            shown: Vec::new(),
            room: MOST_SHOWN,
        };
        let check = |part: &Part| part.check(bytes, name);
        for item in &self.items {
            self.gather(item, item.placement, &check, 0, &mut gathered)?;
        }
        let mut first: HashMap<String, Option<Placement>> = HashMap::new();
        let (mut instances, mut room) = (Vec::new(), bytes.len());
        let mut names = Vec::new();
        for (object, placement) in gathered.shown {
            let (vertices, own) = &self.meshes[&object];
            let count = (vertices.end - vertices.start) as u32;
            if own.as_flattened().iter().any(|&v| v >= count) {
                let problem = format!("object {object} has a triangle whose vertex there is not{CUT_SHORT}");
                return Err(Fault::in_file(problem));
            }
            let offset = vertices.start as u32;
            let triangles = own.iter().map(|corners| corners.map(|v| v + offset));
            match first.get(&object) {
                None => {
                    let mirrors = placement.is_some_and(|placement| placement.mirrors());
                    let turned = triangles.map(|[a, b, c]| if mirrors { [a, c, b] } else { [a, b, c] });
                    self.text.push_triangles(turned);
                    if let Some(placement) = placement {
                        self.text.place(vertices.clone(), placement);
                    }
                    if let Some(name) = self.names.get(&object) {
                        names.push((vertices.clone(), name.clone()));
                    }
                    first.insert(object, placement);
                }
                Some(from) if *from != placement && own.len() <= room => {
                    room -= own.len();
                    let triangles = triangles.collect();
                    instances.push(Instance {
                        triangles,
                        from: *from,
                        to: placement,
                    });
                }
                Some(_) => {}
            }
        }
        names.sort_by_key(|(vertices, _)| vertices.start);
        Ok(Geometry {
            names,
            instances,
            ..self.text.finish()
        })
    }

    /// The meshes of which an object is made that is placed so in the end.
    fn gather(
        &self,
        part: &Part,
        placement: Option<Placement>,
        check: &impl Fn(&Part) -> Result<(), Fault>,
        depth: usize,
        gathered: &mut Gathered,
    ) -> Result<(), Fault> {
        check(part)?;
        if depth > DEEPEST || gathered.room == 0 {
            return Err(Fault::in_file(
                "its objects are made of each other without end: export the model anew",
            ));
        }
        gathered.room -= 1;
        if self.meshes.contains_key(&part.object) {
            gathered.shown.push((part.object.clone(), placement));
        }
        for component in self.components.get(&part.object).into_iter().flatten() {
            let together = match (component.placement, placement) {
                (Some(own), Some(outer)) => own.then(&outer),
                (own, outer) => own.or(outer),
            };
            self.gather(component, together, check, depth + 1, gathered)?;
        }
        Ok(())
    }
}

impl Part {
    /// Refuses an object of another part of the package than the one of this name: one of the same number here may be any other.
    fn check(&self, bytes: &[u8], name: &str) -> Result<(), Fault> {
        let is_own = |path: &str| path.trim_start_matches('/').eq_ignore_ascii_case(name);
        match &self.path {
            Some(path) if !is_own(path) => {
                let problem = format!(
                    "object {} lies in another part of the package, {path} (3MF's production extension), which is not read: export the model as plain 3MF, or as STL",
                    self.object
                );
                Err(Fault::at_line(bytes, self.at, problem))
            }
            _ => Ok(()),
        }
    }
}

/// The meshes that items are made of, and how many more objects may be looked at.
struct Gathered {
    shown: Vec<(String, Option<Placement>)>,
    room: usize,
}

/// An attribute's text, whatever its namespace.
fn attribute(element: &BytesStart<'_>, name: &str) -> Option<String> {
    let found = element
        .attributes()
        .flatten()
        .find(|attribute| attribute.key.local_name().as_ref() == name)?;
    Some(found.value.into_owned())
}

/// Where an attribute's number stands in the file.
fn number<'a>(bytes: &'a [u8], element: &BytesStart<'_>, name: &str) -> Option<Word<'a>> {
    let found = element
        .attributes()
        .flatten()
        .find(|attribute| attribute.key.as_ref() == name)?;
    let value = found.value.as_bytes();
    let blank = value.iter().take_while(|b| b.is_ascii_whitespace()).count();
    let start = (value.as_ptr() as usize).checked_sub(bytes.as_ptr() as usize)? + blank;
    let end = start + value.trim_ascii().len();
    Some(Word {
        text: bytes.get(start..end)?,
        start,
    })
}

/// Twelve numbers, row by row, for row vectors; `None` if it is not there, flattens space, or changes nothing.
fn transform(element: &BytesStart<'_>) -> Option<Placement> {
    let text = attribute(element, "transform")?;
    let numbers: Vec<f64> = text
        .split_ascii_whitespace()
        .map_while(|word| word.parse().ok())
        .collect();
    let rows: [f64; 12] = numbers.try_into().ok()?;
    let [a, b, c, d]: [[f64; 3]; 4] =
        std::array::from_fn(|i| [rows[3 * i], rows[3 * i + 1], rows[3 * i + 2]]);
    let columns = [
        a[0], a[1], a[2], 0.0, b[0], b[1], b[2], 0.0, c[0], c[1], c[2], 0.0, d[0], d[1], d[2], 1.0,
    ];
    Placement::of_columns(&columns).filter(|placement| !placement.is_identity())
}
