//! Meshes in the colours of their patches, a cropped suspect beside what it tells of the original, and marks under a raking light.

use std::{fs, path::Path, sync::Arc};

use anyhow::{Context, Result, ensure};
use job::Job;
use mesh::{Similarity, TriMesh, Vec3, Welded, shapes};
use mesh_io::Asset;
use partition::{Options, partition};
use quality::picture::{Colour, Paint, Picture, View, linear};
use rand_chacha::{ChaCha20Rng, rand_core::SeedableRng};
use registration::{align, resample};
use sigmark::{
    Curve, Embedder, SigningKey, Strength,
    mark::{Borders, ChipLayout, ChipPlan, MarkLayout, Original, PatchCount, Pool},
};

use crate::{
    inputs::{edge_graph, mesh_files, named},
    models::{up_y, up_z},
    process::root,
};

/// Pixels of the longer side.
const SIZE: usize = 720;

/// Triangles between patches.
const BORDER: Colour = [0.012, 0.012, 0.016];

/// sRGB; muted, and clearly different from each other.
const PALETTE: [u32; 10] = [
    0x4e79a7, 0xf28e2b, 0x59a14f, 0xe15759, 0xb07aa1, 0xedc948, 0x76b7b2, 0xff9da7, 0x9c755f, 0xbab0ac,
];

/// Which files are painted in how many patches, how they are looked at, and what the picture is called.
const SUBJECTS: [(&str, usize, View, &str); 2] = [
    ("igea_134k", 5, up_y([0.3, 0.0, 1.0]), "igea_5_patches.png"),
    (
        "ct_skull_1081k_closed",
        33,
        up_z([0.55, 1.0, 0.3]),
        "skull_33_patches.png",
    ),
];

/// Writes the pictures of the meshes that are there into results/.
pub fn run(meshes: &Path) -> Result<()> {
    let results = root().join("results");
    fs::create_dir_all(&results).with_context(|| results.display().to_string())?;
    let files = mesh_files(meshes)?;
    for (name, parts, view, picture) in SUBJECTS {
        let Some(file) = named(&files, name) else { continue };
        let asset = Asset::open(file)?;
        let colours = colours(asset.mesh(), parts)?;
        let painted = Picture::of(asset.mesh(), Paint::Triangles(&colours), view, SIZE);
        save(&painted, &results.join(picture))?;
    }
    if let Some(file) = named(&files, CROPPED) {
        save(&cropped(file)?, &results.join("armadillo_cropped.png"))?;
    }
    if let Some(file) = named(&files, LIT) {
        save(&lit(file)?, &results.join("igea_raking_light.png"))?;
    }
    Ok(())
}

/// The model of which marks are lit.
const LIT: &str = "igea_134k";

/// From the left to the right: the original, a mark of the paper's layout, and one of the default, both of the default strength.
fn lit(file: &Path) -> Result<Picture> {
    let (asset, job) = (
        Asset::open(file)?,
        Job::new(std::thread::available_parallelism().map_or(1, usize::from)),
    );
    let original = asset.mesh();
    let marked = |cut: Original, plan| -> Result<TriMesh> {
        let layout = MarkLayout::with_strength(Arc::new(cut), plan, Strength::default())?;
        let bits: Vec<bool> = (0..BITS).map(|t| t * t % 7 < 3).collect();
        let positions = layout.write(&bits, &job)?.positions(layout.original());
        Ok(original.with_positions(positions)?)
    };
    let chips = ChipLayout::new(BITS, 3)?;
    let cut = Original::cut(original.clone(), chips.functions(), PatchCount::Paper, &job)?;
    let papers = marked(cut.with_borders(Borders::Free), ChipPlan::EveryPatch(chips))?;
    let cut = Original::pooled(original.clone(), BITS, Pool::default(), &job)?;
    let ours = marked(cut, ChipPlan::pooled(BITS, [1; 32]))?;
    Ok(under_raking_light([original, &papers, &ours]))
}

/// Three meshes beside each other under a raking light, all seen from where igea is.
pub fn under_raking_light(meshes: [&TriMesh; 3]) -> Picture {
    let [left, middle, right] = meshes.map(|mesh| {
        let colours = raking(mesh);
        Picture::of(mesh, Paint::Triangles(&colours), LIT_FROM, 3 * SIZE / 4)
    });
    Picture::beside(&Picture::beside(&left, &middle), &right)
}

const BITS: usize = 512;

const LIT_FROM: View = up_y([0.3, 0.0, 1.0]);

/// Where the light comes from: along the surface, which shows every step.
const LIGHT: Vec3 = Vec3([-1.0, 0.5, 0.35]);

/// The larger, the smaller a highlight.
const SHININESS: i32 = 24;

/// Each triangle as a light from the side shows it, with a highlight: stone, polished.
fn raking(mesh: &TriMesh) -> Vec<Colour> {
    let (light, eye) = (LIGHT.unit(), Vec3(LIT_FROM.eye).unit());
    let half_way = (light + eye).unit();
    let of_triangle = |t: usize| {
        let [a, b, c] = mesh.corners(t);
        let normal = (b - a).cross(c - a).unit();
        let diffuse = normal.dot(light).max(0.0);
        let highlight = normal.dot(half_way).max(0.0).powi(SHININESS);
        [0.62, 0.6, 0.56].map(|stone| (stone * (0.08 + 0.8 * diffuse) + 0.5 * highlight).min(1.0))
    };
    (0..mesh.triangle_count()).map(of_triangle).collect()
}

fn save(picture: &Picture, path: &Path) -> Result<()> {
    fs::write(path, picture.to_png()?).with_context(|| path.display().to_string())?;
    println!("written: {}", path.display());
    Ok(())
}

/// The model of Fig. 3, at a quarter of its vertices.
const CROPPED: &str = "armadillo_43k";

const FROM_THE_FRONT: View = up_y([0.25, 0.1, 1.0]);

/// sRGB: the suspect's surface, and vertices of the original that the suspect does not have.
const SEEN: u32 = 0x8fb0cf;
const MISSING: u32 = 0xe8a15c;

/// Fig. 3: a signed model cropped, turned and scaled; and, aligned and resampled, what it shows of the original. Vertices
/// that were not seen are the original's, in another colour.
fn cropped(file: &Path) -> Result<Picture> {
    let (asset, job) = (Asset::open(file)?, Job::default());
    let original = asset.mesh();
    let key = SigningKey::generate(Curve::P256, &mut ChaCha20Rng::seed_from_u64(2012));
    let signed = Embedder::new(&key).embed(original, &job)?;
    let away = Similarity {
        scale: 0.1,
        ..Similarity::from_quaternion([1.0, 0.08, 0.2, -0.14])
    };
    let suspect = shapes::moved(&lower_part(signed.mesh())?, &away);

    let found = align(original, &suspect, &Default::default(), &job)?;
    ensure!(found.aligned, "the cropped model does not align");
    let seen = resample(original, &suspect, &found.transform, &Default::default(), &job)?;
    let resampled = original.with_positions(seen.positions(original))?;
    let is_seen = |t: &[u32; 3]| t.iter().all(|&v| seen.offsets[v as usize].is_some());
    let colours: Vec<Colour> = original
        .triangles()
        .iter()
        .map(|t| linear(if is_seen(t) { SEEN } else { MISSING }))
        .collect();
    let left = vec![linear(SEEN); suspect.triangle_count()];
    let [left, right] = [(&suspect, &left), (&resampled, &colours)]
        .map(|(mesh, colours)| Picture::of(mesh, Paint::Triangles(colours), FROM_THE_FRONT, 2 * SIZE / 3));
    Ok(Picture::beside(&left, &right))
}

/// The half of the vertices that lies lowest, and the triangles between them.
fn lower_part(mesh: &TriMesh) -> Result<TriMesh> {
    let height = |p: &[f64; 3]| p[1] + 0.3 * p[0];
    let mut heights: Vec<f64> = mesh.positions().iter().map(height).collect();
    heights.sort_by(f64::total_cmp);
    let middle = heights[heights.len() / 2];
    let kept = mesh.triangles().iter().copied();
    let kept: Vec<[u32; 3]> = kept
        .filter(|t| t.iter().all(|&v| height(&mesh.positions()[v as usize]) < middle))
        .collect();
    Ok(Welded::new(mesh.positions(), &kept)?.into_mesh())
}

/// The colour of each triangle: its patch's, or the border's if its corners belong to several.
fn colours(mesh: &TriMesh, parts: usize) -> Result<Vec<Colour>> {
    let options = Options {
        parts,
        contiguous: true,
        ..Default::default()
    };
    let part_of = partition(&edge_graph(mesh)?, &options, &Job::default())?.part_of;
    let triangles = mesh.triangles().iter();
    let corners = || triangles.clone().map(|t| t.map(|v| part_of[v as usize] as usize));
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
