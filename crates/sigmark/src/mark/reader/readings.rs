use std::sync::OnceLock;

use job::Job;
use mesh::Similarity;
use registration::{Correspondence, Placement};

use super::{
    BroughtBack, Found, Reading, ReadingMethod, Suspect, Wanted, by_vertices,
    in_frames::InFrames,
    looks::looks,
    suspect::{Sampled, SeenBy, Undecided},
};
use crate::mark::{MarkError, MarkStage, correlation};

/// All that can be read of a suspect, whatever the bits are that are looked for: one suspect can be asked for many.
///
/// Nothing in here depends on bits but the choice of the [best](Self::best), and that counts all that it could have chosen. Everything is read when
/// it is first asked for.
pub struct Readings<'a> {
    found: &'a Found,
    ways: Vec<Way<'a>>,
}

/// A way in which the suspect may lie on the original, with the looks that are taken at it.
struct Way<'a> {
    by: ReadBy<'a>,
    looks: Vec<Look>,
}

/// A look at some of the patches.
struct Look {
    method: ReadingMethod,
    /// Whether it is by draws of a suspect's regions, where the look before left bits open.
    by_draws: bool,
    first: OnceLock<Reading>,
    /// By vertices, once more by the joint estimate.
    again: OnceLock<Reading>,
}

enum ReadBy<'a> {
    /// By a map of the vertices.
    Vertices(&'a Correspondence),
    /// By a map of the vertices, in local frames.
    Frames(Box<InFrames>),
    /// In a pose, in which it was sampled.
    Surface(Box<Surface>),
}

/// A suspect as it was sampled in a pose.
struct Surface {
    suspect: Suspect,
    sampled: Sampled,
    /// What samples of all patches left open.
    undecided: OnceLock<Undecided>,
}

impl<'a> Readings<'a> {
    pub(super) fn of(found: &'a Found, method: &'a ReadingMethod, job: &Job) -> Result<Self, MarkError> {
        method.layout().original().keep_a_gigabyte();
        let ways = match &found.placement {
            Placement::ByVertices(maps) if found.brought_back == BroughtBack::InFrames => {
                job.begin(MarkStage::Resampling)?;
                let way = |map| {
                    let frames = InFrames::of(method.layout(), &found.suspect, map, job)?;
                    Ok(Way {
                        looks: vec![Look::by(method.clone())],
                        by: ReadBy::Frames(Box::new(frames)),
                    })
                };
                maps.iter().map(way).collect::<Result<_, MarkError>>()?
            }
            Placement::ByVertices(maps) => maps
                .iter()
                .map(|map| Way {
                    looks: looks_by(method, |v| map.suspect_of[v].is_some()),
                    by: ReadBy::Vertices(map),
                })
                .collect(),
            Placement::BySurface(alignment) => {
                let poses = std::iter::once(&alignment.transform).chain(&alignment.alternatives);
                let way = |&pose: &Similarity| {
                    let seen_by = SeenBy::Surface(alignment.correspondence.clone());
                    let suspect = Suspect::new(found.reference.clone(), found.suspect.clone(), seen_by);
                    job.begin(MarkStage::Resampling)?;
                    if found.brought_back == BroughtBack::InFrames {
                        let sampled = suspect.sample(&pose, job)?;
                        let frames = InFrames::seen(method.layout(), sampled, job)?;
                        return Ok(Way {
                            looks: vec![Look::by(method.clone())],
                            by: ReadBy::Frames(Box::new(frames)),
                        });
                    }
                    let sampled = suspect.sampled(&pose, job)?;
                    Ok(Way {
                        looks: looks_by(method, |v| sampled.registered.positions[v].is_some()),
                        by: ReadBy::Surface(Box::new(Surface {
                            suspect,
                            sampled,
                            undecided: OnceLock::new(),
                        })),
                    })
                };
                let mut ways: Vec<Way<'_>> = poses.map(way).collect::<Result<_, MarkError>>()?;
                // Every way has as many looks.
                if method.detector().is_none() && ways.iter().any(Way::is_coarser) {
                    let by_draws = || Look::by_draws(method.clone());
                    ways.iter_mut().for_each(|way| way.looks.push(by_draws()));
                }
                ways
            }
        };
        Ok(Self { found, ways })
    }

    /// The reading that agrees best with the bits that are looked for; the first of equals, and the first at all that is enough.
    ///
    /// Looks are taken one after the other. At the surface of a coarser suspect the last one draws the regions that decimation made of the original, where samples of all patches are not enough. By vertices, the best of the first readings, which are cheap, is taken if it is enough; if not, the joint
    /// estimate reads once more in its pose.
    ///
    /// # Errors
    /// As [`Found::read`].
    pub fn best<'w>(&self, wanted: impl Into<Wanted<'w>>, job: &Job) -> Result<Reading, MarkError> {
        let looks = self.ways.first().map_or(0, |way| way.looks.len());
        // Any way, look and rule might be the one that is taken.
        let rules = match self.ways.first().map(|way| &way.by) {
            Some(ReadBy::Vertices(_)) => 2,
            _ => 1,
        };
        let wanted = wanted.into().of(rules * looks * self.ways.len());
        let mut best: Option<Reading> = None;
        for look in 0..looks {
            let (reading, is_enough) = self.best_of_look(look, wanted, job)?;
            let is_better = |best: &Reading| agreement(&reading, wanted) > agreement(best, wanted);
            if is_enough || best.as_ref().is_none_or(is_better) {
                best = Some(reading);
            }
            if is_enough {
                break;
            }
        }
        let tries = wanted.tries();
        best.map(|best| Reading { tries, ..best })
            .ok_or(MarkError::Alignment)
    }

    /// What the joint estimate reads of all patches in each of the ways in which the suspect may lie: nothing is chosen by bits.
    ///
    /// # Errors
    /// As [`Found::read`].
    pub fn of_every_way(&self, job: &Job) -> Result<Vec<&Reading>, MarkError> {
        let last = |way: &'_ Way<'a>| way.looks.len().saturating_sub(1);
        let read = |way| -> Result<&Reading, MarkError> {
            let look = last(way);
            let Way { by, looks } = way;
            let Look {
                method, first, again, ..
            } = looks.get(look).ok_or(MarkError::Alignment)?;
            match by {
                ReadBy::Surface(_) | ReadBy::Frames(_) => kept(first, || self.first(way, look, job)),
                ReadBy::Vertices(map) => kept(again, || {
                    job.begin(MarkStage::Detection)?;
                    by_vertices::read_anew(&self.found.suspect, map, method, job)
                }),
            }
        };
        self.ways.iter().map(read).collect()
    }

    /// The best reading of a look, and whether it is enough.
    fn best_of_look(&self, look: usize, wanted: Wanted<'_>, job: &Job) -> Result<(Reading, bool), MarkError> {
        let mut best: Option<(&Way<'a>, &Reading)> = None;
        for way in &self.ways {
            let reading = kept(&way.looks[look].first, || self.first(way, look, job))?;
            if best.is_none_or(|(_, best)| agreement(reading, wanted) > agreement(best, wanted)) {
                best = Some((way, reading));
            }
        }
        let (way, first) = best.ok_or(MarkError::Alignment)?;
        let is_enough = wanted.is_enough(&first.soft);
        let ReadBy::Vertices(map) = way.by else {
            return Ok((first.clone(), is_enough));
        };
        if is_enough {
            return Ok((first.clone(), true));
        }
        let suspect = &self.found.suspect;
        let Look { method, again, .. } = &way.looks[look];
        let again = kept(again, || {
            by_vertices::read_again(suspect, map, &first.transform, method, job)
        })?;
        let is_enough = wanted.is_enough(&again.soft);
        let better = is_enough || agreement(again, wanted) > agreement(first, wanted);
        Ok((if better { again.clone() } else { first.clone() }, is_enough))
    }

    fn first(&self, way: &Way<'a>, look: usize, job: &Job) -> Result<Reading, MarkError> {
        let method = &way.looks[look].method;
        match &way.by {
            ReadBy::Vertices(map) => {
                job.begin(MarkStage::Detection)?;
                by_vertices::first_reading(&self.found.suspect, map, method, job)
            }
            ReadBy::Frames(frames) => {
                job.begin(MarkStage::Detection)?;
                frames.read(method, job)
            }
            ReadBy::Surface(surface) if way.looks[look].by_draws => {
                let by_samples = kept(&way.looks[look - 1].first, || self.first(way, look - 1, job))?;
                let by_draws = surface.read_by_draws(method, job)?;
                Ok(by_draws.unwrap_or_else(|| by_samples.clone()))
            }
            ReadBy::Surface(surface) => surface.read(method, job),
        }
    }
}

impl Way<'_> {
    /// Whether the suspect was decimated, so that regions might be drawn.
    fn is_coarser(&self) -> bool {
        matches!(&self.by, ReadBy::Surface(surface) if surface.suspect.is_coarser(&surface.sampled))
    }
}

impl Surface {
    fn read(&self, method: &ReadingMethod, job: &Job) -> Result<Reading, MarkError> {
        let (reading, left) = self.suspect.read_sampled(method, &self.sampled, job)?;
        if let Some(left) = left {
            self.undecided.get_or_init(|| left);
        }
        Ok(reading)
    }

    /// None where samples left nothing open, or nothing is drawn.
    fn read_by_draws(&self, method: &ReadingMethod, job: &Job) -> Result<Option<Reading>, MarkError> {
        let Some(undecided) = self.undecided.get() else {
            return Ok(None);
        };
        self.suspect.read_by_draws(method, &self.sampled, undecided, job)
    }
}

/// The looks at a suspect, given which vertices of the original are seen; one, at all patches, by a detector that was given.
fn looks_by(method: &ReadingMethod, is_seen: impl Fn(usize) -> bool) -> Vec<Look> {
    let methods = match method.detector() {
        Some(_) => vec![method.clone()],
        None => looks(method.layout(), is_seen)
            .iter()
            .map(|patches| method.among(patches))
            .collect(),
    };
    methods.into_iter().map(Look::by).collect()
}

impl Look {
    fn by(method: ReadingMethod) -> Self {
        Self {
            method,
            by_draws: false,
            first: OnceLock::new(),
            again: OnceLock::new(),
        }
    }

    fn by_draws(method: ReadingMethod) -> Self {
        Self {
            by_draws: true,
            ..Self::by(method)
        }
    }
}

/// What was read, or is read now.
fn kept(
    place: &OnceLock<Reading>,
    read: impl FnOnce() -> Result<Reading, MarkError>,
) -> Result<&Reading, MarkError> {
    match place.get() {
        Some(reading) => Ok(reading),
        None => {
            let reading = read()?;
            Ok(place.get_or_init(|| reading))
        }
    }
}

pub(super) fn agreement(reading: &Reading, wanted: Wanted<'_>) -> f64 {
    correlation(wanted.bits, &reading.soft.weights())
}
