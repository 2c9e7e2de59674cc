//! Places of a surface: what is left of a model that was cropped.

use job::{Job, JobError};
use mesh::{Edges, TriMesh, Vec3};

use super::{
    balls::Balls,
    cloud::{Cloud, FINE},
    grid::Grid,
    words::{Axes, CODE, LARGE, SMALL},
};

/// Balls of one radius.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Level {
    /// In roots of the original's area.
    radius: f64,
    /// Of an original's samples every so many is seen.
    seen: f64,
    /// Places of an original, and of a suspect at most.
    pub(crate) places: usize,
    asked: usize,
    axes: &'static Axes,
    /// The number of the first word.
    first: usize,
}

/// Small balls and large ones.
pub(crate) const LEVELS: [Level; 2] = [
    Level {
        radius: 0.1,
        seen: 2.0,
        places: 1024,
        asked: 128,
        axes: &SMALL,
        first: 0,
    },
    Level {
        radius: 0.2,
        seen: 8.0,
        places: 512,
        asked: 96,
        axes: &LARGE,
        first: SMALL.words(),
    },
];

/// Samples of a suspect of which places are chosen, those that see least of a border, and how many are taken although they see some.
const OFFERED: usize = 512;
const BORDERED: usize = 24;

/// Samples of a suspect that are laid on originals.
const LAID: usize = 192;

/// A suspect may be what is left of an original: the root of the original's area is so many times the suspect's, from 1 on by this factor.
const SIZES: usize = 14;
const GROWTH: f64 = 1.08;

/// A place of a surface.
#[derive(Clone, Debug)]
pub(crate) struct Place {
    pub(crate) point: Vec3,
    pub(crate) normal: Vec3,
    pub(crate) code: [u8; CODE],
}

/// What is sought of a suspect of some size, in roots of the original's area.
#[derive(Clone, Debug)]
pub(crate) struct Sought {
    pub(crate) places: [Vec<Place>; 2],
    /// Of each place, its word and those that lie close by.
    pub(crate) words: Vec<Vec<u16>>,
    pub(crate) samples: Vec<(Vec3, Vec3)>,
}

/// The places of an original in roots of its area.
pub(super) fn of_original(cloud: &Cloud) -> [Vec<Place>; 2] {
    LEVELS.map(|level| level.places(cloud, 1.0, (0..level.places).map(|k| k * (FINE / level.places))))
}

/// The words of places, sorted.
pub(super) fn words(places: &[Vec<Place>; 2]) -> Vec<u16> {
    let of_level = |(level, places): (&'static Level, &Vec<Place>)| -> Vec<u16> {
        places.iter().map(|place| level.word(&place.code)).collect()
    };
    let mut words: Vec<u16> = LEVELS.iter().zip(places).flat_map(of_level).collect();
    words.sort_unstable();
    words
}

/// What is sought of a suspect in roots of its own area, in all sizes.
pub(super) fn sought(cloud: &Cloud, borders: &[Vec3], job: &Job) -> Result<Vec<Sought>, JobError> {
    let sizes = job.map(SIZES, 1, |size| of_size(cloud, borders, GROWTH.powi(size as i32)))?;
    job.go_on()?;
    Ok(sizes)
}

fn of_size(cloud: &Cloud, borders: &[Vec3], growth: f64) -> Sought {
    let places = LEVELS.map(|level| {
        let chosen = chosen(cloud, borders, level.radius * growth, level.asked);
        level.places(cloud, growth, chosen)
    });
    let samples = (0..LAID)
        .map(|k| k * FINE / LAID)
        .map(|i| (cloud.points[i] / growth, cloud.normals[i]));
    let words = LEVELS.iter().zip(&places);
    Sought {
        words: words
            .flat_map(|(level, places)| places.iter().map(|place| level.probes(&place.code)))
            .collect(),
        samples: samples.collect(),
        places,
    }
}

/// Samples whose balls see no border, which may be that of the cut, or least of it.
fn chosen(cloud: &Cloud, borders: &[Vec3], radius: f64, most: usize) -> Vec<usize> {
    let grid = Grid::new(borders, radius);
    let mut offered: Vec<(usize, usize)> = (0..FINE)
        .step_by(FINE / OFFERED)
        .map(|i| {
            let mut count = 0;
            grid.near(cloud.points[i], |_, _| count += 1);
            (count, i)
        })
        .collect();
    offered.sort_unstable();
    let whole = offered.iter().filter(|(count, _)| *count == 0).count();
    offered.truncate(whole.max(BORDERED));
    let count = most.min(offered.len());
    (0..count).map(|k| offered[k * offered.len() / count].1).collect()
}

/// The middles of edges at which a surface ends, in roots of its area.
pub(super) fn borders(mesh: &TriMesh, edges: &Edges, cloud: &Cloud) -> Vec<Vec3> {
    let open = (0..edges.count()).filter(|&e| edges.triangles(e).len() == 1);
    open.map(|e| {
        let [a, b] = edges.vertices()[e].map(|v| mesh.point(v as usize));
        cloud.place(a * 0.5 + b * 0.5)
    })
    .collect()
}

impl Level {
    /// The places around some samples of a cloud whose unit is so many times smaller than the level's.
    fn places(&self, cloud: &Cloud, growth: f64, centres: impl IntoIterator<Item = usize>) -> Vec<Place> {
        let step = (self.seen * growth * growth).round() as usize;
        let mut balls = Balls::new(cloud, self.radius * growth, step);
        let place = |centre: usize| {
            let (numbers, normal) = balls.see(centre);
            Place {
                point: cloud.points[centre] / growth,
                normal,
                code: self.axes.code(&numbers),
            }
        };
        centres.into_iter().map(place).collect()
    }

    fn word(&self, code: &[u8; CODE]) -> u16 {
        (self.first + self.axes.word(code)) as u16
    }

    /// The word of a code and those of cells that are close.
    fn probes(&self, code: &[u8; CODE]) -> Vec<u16> {
        let probes = self.axes.probes(code).into_iter();
        probes.map(|word| (self.first + word) as u16).collect()
    }
}

/// How many words there are.
pub(crate) const WORDS: usize = SMALL.words() + LARGE.words();

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::{Similarity, shapes};
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(8))]

        #[test]
        fn place_size_and_position_change_no_place(seed in 0..50_u64, angles in prop::array::uniform4(-1.0..1.0_f64), scale in 1e-2..1e2_f64) {
            prop_assume!(angles.iter().map(|x| x * x).sum::<f64>() > 0.01);
            let mesh = shapes::bumpy_sphere(3, seed);
            let transform = Similarity { scale, translation: [1.0, -2.0, 5.0], ..Similarity::from_quaternion(angles) };
            let places = |mesh: &TriMesh| of_original(&Cloud::fine(mesh).unwrap().in_roots());
            let (a, b) = (places(&mesh), places(&shapes::moved(&mesh, &transform)));
            let turn = Similarity::from_quaternion(angles);
            for (a, b) in a.iter().flatten().zip(b.iter().flatten()) {
                // A sample on the very edge of a ball may be seen or not.
                prop_assert!((0..CODE).all(|axis| a.code[axis].abs_diff(b.code[axis]) <= 3));
                prop_assert!((turn.apply(a.point) - b.point).norm() < 1e-6);
                prop_assert!(turn.apply(a.normal).dot(b.normal) > 0.999);
            }
        }

        #[test]
        fn a_word_is_looked_up_with_those_beside_it(code in prop::array::uniform8(any::<u8>())) {
            for level in &LEVELS {
                let (word, probes) = (level.word(&code), level.probes(&code));
                prop_assert_eq!(probes[0], word);
                prop_assert!(probes.iter().all(|&probe| usize::from(probe) < WORDS && usize::from(probe) >= level.first));
                let mut distinct = probes.clone();
                distinct.sort_unstable();
                distinct.dedup();
                prop_assert_eq!(distinct.len(), probes.len());
            }
        }
    }

    #[test]
    fn places_far_from_the_border_are_chosen_first() {
        let mesh = shapes::rectangle(16, 16, 1.0, 1.0);
        let cloud = Cloud::fine(&mesh).unwrap().in_roots();
        let borders = borders(&mesh, &Edges::of(&mesh), &cloud);
        for i in chosen(&cloud, &borders, 0.2, 64) {
            assert!(
                borders
                    .iter()
                    .all(|&border| (border - cloud.points[i]).norm() > 0.2)
            );
        }
    }
}
