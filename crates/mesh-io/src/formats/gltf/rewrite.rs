//! What changes in the JSON once positions, or what turns with them, did.

use std::ops::Range;
use std::sync::Arc;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::accessor::Accessor;
use super::buffers::Store;
use super::container::Container;
use super::document::Document;
use crate::buffer::Buffer;
use crate::error::Fault;
use crate::number;
use crate::slots::scene::SceneSlots;

/// A stretch of the text, and what it becomes.
type Splice = (Range<usize>, String);

/// Brings the text up to numbers that were overwritten in the buffers: the bounds of their accessors, and buffers that the text holds itself.
/// Returns where the positions lie then.
pub(crate) fn rewrite(
    old: &[Buffer],
    mut buffers: Vec<Buffer>,
    slots: &SceneSlots,
) -> Result<(Vec<Buffer>, SceneSlots), Fault> {
    let container = Container::of(&old[0].bytes)?;
    let json = &old[0].bytes[container.json.clone()];
    let document = Document::of(json, container.json.start)?;
    let [before, after] = [old, &buffers[..]].map(|buffers| Store {
        buffers: buffers.to_vec(),
        places: slots.places.clone(),
    });
    let mut splices = Vec::new();
    let mut accessors = super::position_accessors(&document, &before)?;
    accessors.extend(super::directions::accessors(&document));
    for accessor in accessors {
        new_bounds(&document, [&before, &after], accessor, json, &mut splices)?;
    }
    new_contents(&document, [&before, &after], &mut splices);
    splices.sort_by_key(|(range, _)| range.start);

    // Both hold the first buffer, which is about to change: a reference less spares a copy.
    drop((before, after));
    buffers[0].bytes = Arc::new(container.rebuilt(&buffers[0].bytes, &spliced(json, &splices)));
    let container = Container::of(&buffers[0].bytes)?;
    let document = Document::of(&buffers[0].bytes[container.json.clone()], container.json.start)?;
    let mut places = slots.places.clone();
    for (buffer, place) in &mut places {
        if let (0, Some(bin)) = (*buffer, &container.bin) {
            *place = bin.start..bin.start + place.len();
        }
    }
    let store = Store { buffers, places };
    let runs = super::runs(&document, &store)?;
    let Store { buffers, places } = store;
    Ok((buffers, SceneSlots { runs, places }))
}

fn spliced(text: &[u8], splices: &[Splice]) -> Vec<u8> {
    let mut out = Vec::with_capacity(text.len() + 64);
    let mut from = 0;
    for (range, new) in splices {
        out.extend_from_slice(&text[from..range.start]);
        out.extend_from_slice(new.as_bytes());
        from = range.end;
    }
    out.extend_from_slice(&text[from..]);
    out
}

/// The bounds of an accessor of which a number changed, number by number.
fn new_bounds(
    document: &Document,
    [before, after]: [&Store; 2],
    index: usize,
    json: &[u8],
    splices: &mut Vec<Splice>,
) -> Result<(), Fault> {
    if document
        .bounds
        .get(index)
        .is_none_or(|bounds| *bounds == [None, None])
    {
        return Ok(());
    }
    let accessor = Accessor::of(document, before, index)?;
    let bounds = |store: &Store| match accessor.shape.components {
        3 => bounds_of(&accessor.numbers::<3>(store)),
        4 => bounds_of(&accessor.numbers::<4>(store)),
        _ => Default::default(),
    };
    let (old, new) = (bounds(before), bounds(after));
    for (side, range) in document.bounds[index].iter().enumerate() {
        let Some(range) = range.clone().filter(|_| old[side] != new[side]) else {
            continue;
        };
        let tokens = tokens(&json[range.clone()]);
        if tokens.len() != old[side].len() {
            continue;
        }
        for (axis, token) in tokens.into_iter().enumerate() {
            if old[side][axis] != new[side][axis] {
                let place = range.start + token.start..range.start + token.end;
                splices.push((place, shown(new[side][axis])));
            }
        }
    }
    Ok(())
}

/// The least and the greatest number of each axis.
fn bounds_of<const N: usize>(numbers: &[[f64; N]]) -> [Vec<f64>; 2] {
    let start = [[f64::INFINITY; N], [f64::NEG_INFINITY; N]];
    let bounds = numbers.iter().fold(start, |[low, high], number| {
        [
            std::array::from_fn(|i| low[i].min(number[i])),
            std::array::from_fn(|i| high[i].max(number[i])),
        ]
    });
    bounds.map(Vec::from)
}

/// A number as short as single precision allows; integers are written as such.
fn shown(number: f64) -> String {
    let mut text = Vec::new();
    number::write_single(number as f32, &mut text);
    String::from_utf8_lossy(&text).into_owned()
}

/// Where the numbers of a JSON array stand.
fn tokens(array: &[u8]) -> Vec<Range<usize>> {
    let is_part = |byte: &u8| !b"[], \t\r\n".contains(byte);
    let mut tokens = Vec::new();
    let mut at = 0;
    while let Some(start) = array[at..].iter().position(is_part) {
        let start = at + start;
        let length = array[start..].iter().take_while(|byte| is_part(byte)).count();
        tokens.push(start..start + length);
        at = start + length;
    }
    tokens
}

/// Buffers that the text holds itself, where they changed.
fn new_contents(document: &Document, [before, after]: [&Store; 2], splices: &mut Vec<Splice>) {
    for (index, buffer) in document.root.buffers.iter().enumerate() {
        let held = after.places[index].0;
        let (old, new) = (&before.buffers[held], &after.buffers[held]);
        let kind = buffer.uri.as_deref().and_then(|uri| uri.split_once(";base64,"));
        let (Some((kind, _)), Some(range)) = (kind, document.uris[index].clone()) else {
            continue;
        };
        if new.name.is_empty() && !new.is_same(old) {
            let uri = format!("{kind};base64,{}", STANDARD.encode(new.bytes.as_slice()));
            splices.push((range, serde_json::Value::from(uri).to_string()));
        }
    }
}
