//! Originals for a large library: real meshes, shapes by formula, and variations of both.
//!
//! A variation is another model, not a pose or a copy: its base is stretched along three axes, tapered, often bent or twisted, displaced by a random smooth field that one sees, in some a second model is stuck on,
//! or a piece is cut away. Every fourth is subdivided before it is displaced.

use std::path::Path;

use anyhow::{Context, Result, ensure};
use decimation::{Decimator, decimate};
use evaluation::inputs::{mesh_files, name_of};
use job::Job;
use library::{Descriptor, Query};
use mesh::{TriMesh, Vec3, Welded, shapes};
use mesh_io::Asset;

use super::draw::Draw;

/// Variations are made of versions with so many triangles.
const BASE_TRIANGLES: usize = 8000;

/// Of so many shapes by formula.
const FORMULAE: usize = 24;

/// What variations are made of.
pub(super) struct Base {
    pub(super) name: String,
    /// As it came; none for shapes by formula.
    pub(super) whole: Option<TriMesh>,
    /// With few triangles, about the origin, its diagonal 1.
    pub(super) small: TriMesh,
    /// Whether thresholds were chosen by models made of it.
    pub(super) tunes: bool,
}

/// An original of the library.
pub(super) struct Model {
    pub(super) name: String,
    pub(super) mesh: TriMesh,
}

/// All bases: the meshes of some folders, then shapes by formula.
pub(super) fn bases(folders: &[&Path], job: &Job) -> Result<Vec<Base>> {
    let mut paths = Vec::new();
    for folder in folders {
        paths.extend(mesh_files(folder)?);
    }
    ensure!(!paths.is_empty(), "no mesh file there");
    let read = |i: usize| -> Result<Base> {
        let path = &paths[i];
        let whole = Asset::open(path)?.scene()?.into_owned();
        let small = small(&whole, &job.alone()).with_context(|| path.display().to_string())?;
        Ok(Base {
            name: name_of(path),
            small,
            whole: Some(whole),
            tunes: false,
        })
    };
    let real = job.map(paths.len(), 1, read)?;
    let mut bases: Vec<Base> = Vec::new();
    for base in real {
        let base = base?;
        // Two files of one mesh are one original.
        if bases.iter().all(|other| other.whole != base.whole) {
            bases.push(base);
        }
    }
    for number in 0..FORMULAE {
        bases.push(Base {
            name: format!("formula {number}"),
            whole: None,
            small: unit(&formula(&mut Draw::new(11, number as u64))),
            tunes: false,
        });
    }
    for (base, tunes) in tuning(&bases, job)?.into_iter().enumerate() {
        bases[base].tunes = tunes;
    }
    Ok(bases)
}

/// Two bases with descriptors so near are one thing: two scans or two resolutions of it.
const ONE_THING: f64 = 6.0;

/// Every second base tunes, and what is the same thing as one that does.
fn tuning(bases: &[Base], job: &Job) -> Result<Vec<bool>> {
    let described = job.map(bases.len(), 1, |base| {
        let mesh = &bases[base].small;
        Ok((Query::of(mesh, &job.alone())?, Descriptor::of(mesh)?))
    })?;
    let described: Vec<(Query, Descriptor)> = described.into_iter().collect::<Result<_>>()?;
    let is_one_thing = |a: usize, b: usize| described[a].0.distance(&described[b].1) < ONE_THING;
    let tunes = |base: usize| {
        (0..bases.len())
            .step_by(2)
            .any(|even| base == even || is_one_thing(base, even))
    };
    Ok((0..bases.len()).map(tunes).collect())
}

fn small(mesh: &TriMesh, job: &Job) -> Result<TriMesh> {
    let unit = unit(mesh);
    // The queue is exact and slow; a mesh of millions is halved by thresholds first.
    let coarse = match unit.triangle_count() > 200_000 {
        true => decimate(&unit, 60_000, Decimator::Threshold, job)?,
        false => unit,
    };
    Ok(match coarse.triangle_count() > BASE_TRIANGLES {
        true => decimate(&coarse, BASE_TRIANGLES, Decimator::Queue, job)?,
        false => coarse,
    })
}

/// The mesh about the origin with a diagonal of 1.
fn unit(mesh: &TriMesh) -> TriMesh {
    let bounds = mesh.bounding_box();
    let (centre, diagonal) = (Vec3(bounds.centre()), bounds.diagonal().max(1e-300));
    with(mesh, |p| (p - centre) / diagonal)
}

/// The mesh with every vertex elsewhere; as it was, where that is nowhere.
pub(super) fn with(mesh: &TriMesh, place: impl Fn(Vec3) -> Vec3) -> TriMesh {
    let positions = mesh.positions().iter().map(|&p| place(Vec3(p)).0);
    mesh.with_positions(positions.collect())
        .unwrap_or_else(|_| mesh.clone())
}

/// A ball whose radius follows Gielis's formula in two angles.
fn formula(draw: &mut Draw) -> TriMesh {
    let mut one = || {
        let m = draw.between(2.0, 8.0).floor();
        let n = [
            draw.between(0.4, 3.0),
            draw.between(0.5, 4.0),
            draw.between(0.5, 4.0),
        ];
        move |angle: f64| {
            let (a, b) = ((m * angle / 4.0).cos().abs(), (m * angle / 4.0).sin().abs());
            (a.powf(n[1]) + b.powf(n[2]))
                .powf(-1.0 / (2.0 * n[0]))
                .clamp(0.25, 2.5)
        }
    };
    let (across, along) = (one(), one());
    with(&shapes::icosphere(5), |p| {
        let Vec3([x, y, z]) = p;
        let (longitude, latitude) = (y.atan2(x), z.clamp(-1.0, 1.0).asin());
        let (r, s) = (across(longitude), along(latitude));
        let level = latitude.cos() * s;
        Vec3([
            r * level * longitude.cos(),
            r * level * longitude.sin(),
            s * latitude.sin(),
        ])
    })
}

/// The `number`th original: first the real meshes, then variations of all bases in turn.
pub(super) fn original(bases: &[Base], number: usize) -> Model {
    let real: Vec<usize> = (0..bases.len()).filter(|&b| bases[b].whole.is_some()).collect();
    if let Some(&base) = real.get(number)
        && let Some(whole) = &bases[base].whole
    {
        return Model {
            name: bases[base].name.clone(),
            mesh: whole.clone(),
        };
    }
    let base = number % bases.len();
    Model {
        name: format!("{} {number}", bases[base].name),
        mesh: variation(bases, &bases[base].small, number as u64),
    }
}

/// Numbers of variations that are in no library.
pub(super) const STRANGERS: u64 = 1 << 40;

/// A model that is in no library: in turn a variation of a base, and of a shape by formula of which no original was made.
pub(super) fn stranger(bases: &[Base], number: usize) -> TriMesh {
    let seed = STRANGERS + number as u64;
    match number.is_multiple_of(2) {
        true => variation(bases, &bases[(number / 2) % bases.len()].small, seed),
        false => variation(bases, &unit(&formula(&mut Draw::new(13, seed))), seed),
    }
}

/// Another model, of a base; a second model that is stuck on it is one of the library's bases.
pub(super) fn variation(bases: &[Base], base: &TriMesh, seed: u64) -> TriMesh {
    let mut draw = Draw::new(7, seed);
    let mut mesh = base.clone();
    let kind = draw.unit();
    if kind < 0.2 {
        let other = &bases[draw.one_of(bases.len())].small;
        mesh = stuck_together(&mesh, other, &mut draw);
    } else if kind < 0.3 {
        mesh = cut(&mesh, draw.direction(), draw.between(0.6, 0.85)).unwrap_or(mesh);
    }
    if seed.is_multiple_of(4) && mesh.triangle_count() < 2 * BASE_TRIANGLES {
        mesh = shapes::divided(&mesh);
    }
    let stretch: [f64; 3] = std::array::from_fn(|_| (0.25 * draw.normal()).exp());
    let mut mesh = with(&mesh, |Vec3([x, y, z])| {
        Vec3([x * stretch[0], y * stretch[1], z * stretch[2]])
    });
    let taper = draw.between(-0.5, 0.5);
    let axis = draw.direction();
    mesh = with(&mesh, |p| p * (1.0 + taper * p.dot(axis)));
    if draw.unit() < 0.5 {
        mesh = twisted(&mesh, draw.direction(), draw.between(-60.0, 60.0));
    }
    if draw.unit() < 0.5 {
        mesh = bent(&mesh, draw.direction(), draw.between(-70.0, 70.0));
    }
    displaced(&unit(&mesh), draw.between(0.015, 0.04), &mut draw)
}

/// Moves by a smooth random field of so large a root mean square, as a fraction of the diagonal.
fn displaced(mesh: &TriMesh, amount: f64, draw: &mut Draw) -> TriMesh {
    let waves: Vec<(Vec3, Vec3, f64)> = (0..14)
        .map(|_| {
            let length = draw.between(0.25, 1.2);
            let wave = draw.direction() * (std::f64::consts::TAU / length);
            (
                wave,
                draw.direction() * length.sqrt(),
                draw.between(0.0, std::f64::consts::TAU),
            )
        })
        .collect();
    let field = |p: Vec3| {
        waves
            .iter()
            .map(|&(wave, along, phase)| along * (wave.dot(p) + phase).sin())
            .sum::<Vec3>()
    };
    let square: f64 = mesh.positions().iter().map(|&p| field(Vec3(p)).squared()).sum();
    let scale = amount / (square / mesh.vertex_count() as f64).sqrt().max(1e-12);
    with(mesh, |p| p + field(p) * scale)
}

/// A second model, smaller, about a vertex of the first.
fn stuck_together(mesh: &TriMesh, other: &TriMesh, draw: &mut Draw) -> TriMesh {
    let place = Vec3(mesh.positions()[draw.one_of(mesh.vertex_count())]);
    let turn =
        mesh::Similarity::from_quaternion([draw.normal(), draw.normal(), draw.normal(), draw.normal()]);
    let scale = draw.between(0.3, 0.6);
    let moved = with(other, |p| place + turn.apply(p) * scale);
    shapes::disjoint_union(&[mesh.clone(), moved])
}

/// What a plane across a direction leaves: so large a share of the vertices.
pub(super) fn cut(mesh: &TriMesh, direction: Vec3, share: f64) -> Option<TriMesh> {
    let used = mesh.used_vertices();
    let height = |v: usize| mesh.point(v).dot(direction);
    let mut heights: Vec<f64> = (0..mesh.vertex_count())
        .filter(|&v| used[v])
        .map(height)
        .collect();
    heights.sort_by(f64::total_cmp);
    let place = ((heights.len() as f64 * share) as usize).min(heights.len() - 1);
    let limit = heights[place];
    let is_kept = |corners: &&[u32; 3]| corners.iter().all(|&v| height(v as usize) <= limit);
    let kept: Vec<[u32; 3]> = mesh.triangles().iter().filter(is_kept).copied().collect();
    Some(Welded::new(mesh.positions(), &kept).ok()?.into_mesh())
}

/// Turns every slice across a direction, the last by so many degrees more than the first.
pub(super) fn twisted(mesh: &TriMesh, axis: Vec3, degrees: f64) -> TriMesh {
    let [low, high] = extent(mesh, axis);
    with(mesh, |p| {
        let share = (p.dot(axis) - low) / (high - low).max(1e-12) - 0.5;
        turned(p, axis, degrees.to_radians() * share)
    })
}

/// Lays a direction onto an arc of so many degrees that is as long.
pub(super) fn bent(mesh: &TriMesh, axis: Vec3, degrees: f64) -> TriMesh {
    let [low, high] = extent(mesh, axis);
    let angle = degrees.to_radians();
    if angle.abs() < 1e-6 {
        return mesh.clone();
    }
    let side = across(axis);
    let radius = (high - low) / angle;
    with(mesh, |p| {
        let (along, aside) = (p.dot(axis), p.dot(side));
        let turn = (along - 0.5 * (low + high)) / radius;
        let out = radius - aside;
        p - axis * along - side * aside + axis * (out * turn.sin()) + side * (radius - out * turn.cos())
    })
}

pub(super) fn extent(mesh: &TriMesh, axis: Vec3) -> [f64; 2] {
    let heights = mesh.positions().iter().map(|&p| Vec3(p).dot(axis));
    heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| {
        [low.min(x), high.max(x)]
    })
}

pub(super) fn across(axis: Vec3) -> Vec3 {
    let least = (0..3).fold(0, |least, i| {
        if axis.0[i].abs() < axis.0[least].abs() {
            i
        } else {
            least
        }
    });
    let mut other = Vec3::ZERO;
    other[least] = 1.0;
    axis.cross(other).unit()
}

/// Rodrigues' rotation.
pub(super) fn turned(p: Vec3, axis: Vec3, angle: f64) -> Vec3 {
    let (sine, cosine) = angle.sin_cos();
    p * cosine + axis.cross(p) * sine + axis * (axis.dot(p) * (1.0 - cosine))
}
