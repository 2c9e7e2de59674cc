//! Pictures of original and suspect, with one camera and one light, and of where they differ.

use anyhow::Result;
use job::Job;
use mesh::{BoundingBox, Similarity, TriMesh, Vec3};
use quality::{
    Scale,
    picture::{Colour, Paint, Picture, View, linear},
    vertex_distances,
};

/// Pixels of a picture's longer side.
const SIZE: usize = 560;

/// Unpainted clay, light enough for the shades to be seen on paper.
const CLAY: u32 = 0xc9c5bd;

/// How far the eye stands beside the model's broad side and above its middle: tangents.
const ASIDE: f64 = 0.5;
const ABOVE: f64 = 0.3;

/// How much of the model's height is its base, and how far a base reaches at least: shares.
const SLICE: f64 = 0.02;
const LEAST_BASE: f64 = 0.2;

/// What is nearer than this fraction of the diagonal is no difference, but rounding.
const NOTHING: f64 = 1e-9;

/// PNG files of one mesh, from two sides.
pub(super) type Sides = Vec<Vec<u8>>;

/// Two meshes in pictures.
pub(super) struct Pictures {
    pub(super) original: Sides,
    pub(super) suspect: Sides,
    /// `None` where no transform was found that would lay the one onto the other.
    pub(super) difference: Option<Difference>,
}

/// The suspect in the colours of its distance from the original.
pub(super) struct Difference {
    pub(super) sides: Sides,
    /// What the last colour stands for, as a fraction of the original's diagonal.
    pub(super) greatest: f64,
    /// The colours from 0 to that, from left to right.
    pub(super) scale: Vec<u8>,
}

/// Draws both as they lie after `transform`; without one, each by itself.
pub(super) fn draw(
    original: &TriMesh,
    suspect: &TriMesh,
    transform: Option<&Similarity>,
    job: &Job,
) -> Result<Pictures> {
    let Some(transform) = transform else {
        return Ok(Pictures {
            original: sides(original, &[original], None, job)?,
            suspect: sides(suspect, &[suspect], None, job)?,
            difference: None,
        });
    };
    let moved = suspect.with_positions(transform.apply_all(suspect.positions()))?;
    let both = [original, &moved];
    let diagonal = original.bounding_box().diagonal();
    let distances: Vec<f64> = vertex_distances(&moved, original, &job.quiet())?
        .into_iter()
        .map(|distance| distance / diagonal)
        .collect();
    let greatest = greatest(&distances);
    let scale = Scale::up_to(greatest);
    Ok(Pictures {
        original: sides(original, &both, None, job)?,
        suspect: sides(&moved, &both, None, job)?,
        difference: Some(Difference {
            sides: sides(&moved, &both, Some((&distances, scale)), job)?,
            greatest,
            scale: bar(scale).to_png()?,
        }),
    })
}

/// Below which 99 of 100 distances lie, rounded up to two digits: a few stray points would make all else blue.
fn greatest(distances: &[f64]) -> f64 {
    let mut sorted = distances.to_vec();
    sorted.sort_by(f64::total_cmp);
    let most = sorted
        .get(sorted.len() * 99 / 100)
        .copied()
        .unwrap_or(0.0)
        .max(NOTHING);
    let digit = 10f64.powf(most.log10().floor() - 1.0);
    (most / digit).ceil() * digit
}

/// The scale of a heat map.
fn bar(scale: Scale) -> Picture {
    const COLOURS: usize = 256;
    let mut bar = Picture::blank(COLOURS, 1, [1.0; 3]);
    for x in 0..COLOURS {
        let value = scale.greatest() * (x as f64 + 0.5) / COLOURS as f64;
        bar.fill(x, 0, 1, 1, scale.colour(value));
    }
    bar
}

/// A mesh from two opposite sides, as clay or in the colours of numbers; all of `frame` would fit into the pictures.
fn sides(mesh: &TriMesh, frame: &[&TriMesh], values: Option<(&[f64], Scale)>, job: &Job) -> Result<Sides> {
    let clay = vec![linear(CLAY); mesh.triangle_count()];
    let views = views(frame);
    let drawn = job.map_reported(views.len(), 1, |i| -> Result<Vec<u8>> {
        let framed = framed(mesh, frame, views[i])?;
        let picture = match values {
            None => Picture::of(&framed, Paint::Triangles(&clay), views[i], SIZE),
            Some((values, scale)) => {
                let colour = move |value: f64| -> Colour { scale.colour(value) };
                let mut values = values.to_vec();
                values.resize(framed.vertex_count(), 0.0);
                Picture::of(&framed, Paint::Values(&values, &colour), views[i], SIZE)
            }
        };
        Ok(picture.to_png()?)
    })?;
    drawn.into_iter().collect()
}

/// From the broad side, and from behind.
fn views(frame: &[&TriMesh]) -> [View; 2] {
    let up = frame.first().map_or(1, |mesh| up(mesh));
    let size = frame.first().map_or([0.0; 3], |mesh| mesh.bounding_box().size());
    // The two other axes, so that the second, x or z, is to the right of whoever looks along the first with the third up.
    let [toward, right] = if up == 1 { [2, 0] } else { [0, 1] };
    let axis = |axis: usize| Vec3(std::array::from_fn(|i| f64::from(i == axis)));
    let [front, side] = match size[right] >= size[toward] {
        true => [axis(toward), axis(right)],
        false => [axis(right), -axis(toward)],
    };
    [1.0, -1.0].map(|face| View {
        eye: (front * face + side * (face * ASIDE) + axis(up) * ABOVE).into(),
        up: axis(up).into(),
    })
}

/// The axis that is up, y or z: files do not say it, but what stands has feet or a base, which reach about as far as the model does.
fn up(mesh: &TriMesh) -> usize {
    let [y, z] = [1, 2].map(|axis| base(mesh, axis));
    if z > LEAST_BASE && z > 2.0 * y { 2 } else { 1 }
}

/// Of the area of the model's box across an axis, the share of the box around what lies lowest.
fn base(mesh: &TriMesh, axis: usize) -> f64 {
    let whole = mesh.bounding_box();
    let lowest = whole.min[axis] + SLICE * whole.size()[axis];
    let low: Vec<[f64; 3]> = mesh
        .positions()
        .iter()
        .copied()
        .filter(|p| p[axis] <= lowest)
        .collect();
    let base = BoundingBox::of(&low).size();
    let across = (0..3).filter(|&other| other != axis);
    across
        .map(|other| base[other] / whole.size()[other].max(f64::MIN_POSITIVE))
        .product()
}

/// The mesh, and vertices that no triangle uses where `frame` reaches farthest: the camera shows all vertices, and so is the same for
/// all meshes of one frame.
fn framed(mesh: &TriMesh, frame: &[&TriMesh], View { eye, up }: View) -> Result<TriMesh> {
    let forward = Vec3(eye).unit();
    let right = Vec3(up).cross(forward).unit();
    let mut positions = mesh.positions().to_vec();
    for axis in [right, forward.cross(right)] {
        let along = |p: &&[f64; 3]| axis.dot(Vec3(**p));
        let all = || frame.iter().flat_map(|mesh| mesh.positions());
        positions.extend(all().min_by(|a, b| along(a).total_cmp(&along(b))));
        positions.extend(all().max_by(|a, b| along(a).total_cmp(&along(b))));
    }
    Ok(TriMesh::new(positions, mesh.triangles().to_vec())?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::shapes;

    #[test]
    fn a_part_is_drawn_where_it_lies_in_the_whole_and_as_large() {
        let [near, far] = [0.0, 5.0].map(|x| shapes::translated(&shapes::icosphere(2), [x, 0.0, 0.0]));
        let whole = shapes::disjoint_union(&[near.clone(), far]);
        let view = views(&[&whole])[0];
        let picture = |mesh: &TriMesh| {
            let framed = framed(mesh, &[&whole, &near], view).unwrap();
            let clay = vec![[0.5; 3]; mesh.triangle_count()];
            Picture::of(&framed, Paint::Triangles(&clay), view, 90)
        };
        let (all, part) = (picture(&whole), picture(&near));
        assert_eq!((all.width(), all.height()), (part.width(), part.height()));
        let is_seen = |picture: &Picture, x, y| picture.pixel(x, y).is_some_and(|pixel| pixel[3] > 0);
        let count = |picture: &Picture, from: usize, to: usize| {
            (from..to)
                .flat_map(|x| (0..picture.height()).map(move |y| (x, y)))
                .filter(|&(x, y)| is_seen(picture, x, y))
                .count()
        };
        let middle = all.width() / 2;
        assert_eq!(count(&all, 0, middle), count(&part, 0, middle));
        assert!(count(&all, middle, all.width()) > 0);
        assert_eq!(count(&part, middle, part.width()), 0);
    }

    #[test]
    fn what_stands_on_four_feet_stands_upright_whichever_axis_is_up() {
        let feet = [[0.0, 0.0], [3.0, 0.0], [0.0, 1.0], [3.0, 1.0]]
            .map(|[x, z]| shapes::translated(&shapes::rectangle(1, 1, 0.1, 0.1), [x, z, 0.0]));
        let body = shapes::translated(&shapes::icosphere(2), [1.5, 0.5, 2.0]);
        let animal = shapes::disjoint_union(&[&feet[..], &[body]].concat());
        assert_eq!(up(&animal), 2);
        let tilted = animal.positions().iter().map(|&[x, y, z]| [x, z, -y]).collect();
        let tilted = animal.with_positions(tilted).unwrap();
        assert_eq!(up(&tilted), 1);
        assert_eq!(up(&shapes::icosphere(2)), 1);
        for mesh in [&animal, &tilted] {
            for view in views(&[mesh]) {
                let [eye, up] = [view.eye, view.up].map(Vec3);
                assert!(eye.dot(up) > 0.0 && up.norm() == 1.0);
            }
        }
    }

    #[test]
    fn the_scale_ends_where_almost_all_do() {
        let mut distances: Vec<f64> = (0..1000).map(|i| f64::from(i) * 1e-6).collect();
        distances[3] = 7.0;
        assert!(
            (greatest(&distances) - 0.001).abs() < 1e-12,
            "{}",
            greatest(&distances)
        );
        assert!((greatest(&[0.0; 5]) - NOTHING).abs() < 1e-12);
        assert!(greatest(&[]) > 0.0);
    }

    #[test]
    fn meshes_that_do_not_align_are_drawn_each_by_itself() {
        let (a, b) = (shapes::icosphere(1), shapes::torus(8, 6, 2.0, 0.5));
        let pictures = draw(&a, &b, None, &Job::default()).unwrap();
        assert!(pictures.difference.is_none() && pictures.original.len() == 2 && pictures.suspect.len() == 2);
        let pictures = draw(&a, &a, Some(&Similarity::IDENTITY), &Job::default()).unwrap();
        assert!(pictures.difference.is_some());
        assert_eq!(pictures.original, pictures.suspect);
    }
}
