//! Meshes in the colours of their patches.

use std::{fs, path::Path};

use anyhow::{Context, Result};
use bench_harness::{edge_graph, mesh_files, name_of};
use mesh::{Asset, TriMesh};
use partition::{Options, partition};
use quality::picture::{Colour, Paint, Picture, View, linear};

use crate::process::root;

/// Pixels of the longer side.
const SIZE: usize = 720;

/// Triangles between patches.
const BORDER: Colour = [0.012, 0.012, 0.016];

/// sRGB; muted, and clearly different from each other.
const PALETTE: [u32; 10] = [
    0x4e79a7, 0xf28e2b, 0x59a14f, 0xe15759, 0xb07aa1, 0xedc948, 0x76b7b2, 0xff9da7, 0x9c755f, 0xbab0ac,
];

struct Subject {
    file: &'static str,
    parts: usize,
    view: View,
    picture: &'static str,
}

const SUBJECTS: [Subject; 2] = [
    Subject {
        file: "igea_134k",
        parts: 5,
        view: View {
            eye: [0.3, 0.0, 1.0],
            up: [0.0, 1.0, 0.0],
        },
        picture: "igea_5_patches.png",
    },
    Subject {
        file: "ct_skull_1081k_closed",
        parts: 33,
        view: View {
            eye: [0.55, 1.0, 0.3],
            up: [0.0, 0.0, 1.0],
        },
        picture: "skull_33_patches.png",
    },
];

pub(crate) fn run(meshes: &Path) -> Result<()> {
    let results = root().join("results");
    fs::create_dir_all(&results).with_context(|| results.display().to_string())?;
    let files = mesh_files(meshes)?;
    for subject in &SUBJECTS {
        let Some(file) = files.iter().find(|path| name_of(path) == subject.file) else {
            eprintln!("{}: no file {}, left out", meshes.display(), subject.file);
            continue;
        };
        let asset = Asset::open(file)?;
        let colours = colours(asset.mesh(), subject.parts)?;
        let path = results.join(subject.picture);
        let picture = Picture::of(asset.mesh(), Paint::Triangles(&colours), subject.view, SIZE);
        fs::write(&path, picture.to_png()?).with_context(|| path.display().to_string())?;
        println!("written: {}", path.display());
    }
    Ok(())
}

/// The colour of each triangle: its patch's, or the border's if its corners belong to several.
fn colours(mesh: &TriMesh, parts: usize) -> Result<Vec<Colour>> {
    let options = Options {
        parts,
        contiguous: true,
        ..Default::default()
    };
    let part_of = partition(&edge_graph(mesh)?, &options)?.part_of;
    let corners = || {
        mesh.triangles()
            .iter()
            .map(|t| t.map(|v| part_of[v as usize] as usize))
    };
    let mut touch = vec![vec![false; parts]; parts];
    for [a, b, c] in corners() {
        for (p, q) in [(a, b), (b, c), (c, a)] {
            touch[p][q] = true;
            touch[q][p] = true;
        }
    }
    let chosen = distinct(&touch, PALETTE.len());
    Ok(corners()
        .map(|[a, b, c]| {
            if a == b && b == c {
                linear(PALETTE[chosen[a]])
            } else {
                BORDER
            }
        })
        .collect())
}

/// A colour for each part that none of its neighbours has, if there are enough; of those the least used so far.
fn distinct(touch: &[Vec<bool>], colours: usize) -> Vec<usize> {
    let mut chosen: Vec<usize> = Vec::with_capacity(touch.len());
    for neighbours in touch {
        let uses = |colour: usize| chosen.iter().filter(|&&other| other == colour).count();
        let clashes = |colour: usize| {
            chosen
                .iter()
                .zip(neighbours)
                .any(|(&other, &touches)| touches && other == colour)
        };
        let best = (0..colours).min_by_key(|&colour| (clashes(colour), uses(colour)));
        chosen.push(best.unwrap_or(0));
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_that_touch_get_different_colours() {
        // A wheel: the hub touches all, the rim is a cycle of five; four colours are needed.
        let touch: Vec<Vec<bool>> = (0..6usize)
            .map(|a| {
                (0..6usize)
                    .map(|b| a != b && (a == 0 || b == 0 || a.abs_diff(b) == 1 || a.abs_diff(b) == 4))
                    .collect()
            })
            .collect();
        let chosen = distinct(&touch, 4);
        for a in 0..6 {
            for b in 0..6 {
                assert!(!touch[a][b] || chosen[a] != chosen[b], "{chosen:?}");
            }
        }
    }
}
