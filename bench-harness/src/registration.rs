//! How often marked suspects come back onto their originals, how exactly, and in what time.

use std::{
    fs,
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

use anyhow::{Context, Result, bail};
use evaluation::inputs::{mesh_files, name_of};
use job::Job;
use mesh::{Similarity, TriMesh, shapes};
use mesh_io::{Asset, Format, Precision, write_mesh};
use rand_chacha::{ChaCha20Rng, rand_core::SeedableRng};
use registration::{AlignOptions, Aligner, Alignment, MatchedBy};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use sigmark::{
    Curve, Embedder, Signed, SigningKey, Verifier,
    mark::{
        CoefficientDetector, Detector, LeastSquaresDetector, Registered, Sampler, SoftBits, extraction_rate,
    },
};

use crate::{measure::timed, peers, registration_large, registration_peers, registration_tables as tables};
use evaluation::{
    meshes::random_similarity,
    python::Python,
    sources::{self, digest},
};

/// What happens to a suspect before it is moved.
pub(crate) struct Attack {
    pub(crate) name: &'static str,
    /// Of `attack.py`: name and strength.
    pub(crate) script: (&'static str, f64),
    /// Whether the seed makes a difference.
    random: bool,
    /// Whether what is left of the surface lies exactly on the original's, but for the mark.
    pub(crate) exact: bool,
}

const fn attack(name: &'static str, script: (&'static str, f64), random: bool, exact: bool) -> Attack {
    Attack {
        name,
        script,
        random,
        exact,
    }
}

pub(crate) const ATTACKS: [Attack; 8] = [
    // Keeping all is the crop that changes nothing.
    attack("none", ("crop", 100.0), false, true),
    attack("crop to 50 %", ("crop", 50.0), true, true),
    attack("crop to 25 %", ("crop", 25.0), true, true),
    attack("noise 0.5 %", ("noise", 0.5), true, false),
    attack("simplification to 5 %", ("simplify", 5.0), false, false),
    attack("isotropic re-meshing", ("remesh", 100.0), false, false),
    attack("Laplacian x5", ("laplacian", 5.0), false, false),
    attack("Loop", ("loop", 1.0), false, false),
];

/// A kind of suspect: a row of the tables.
#[derive(Clone, Copy)]
pub(crate) enum Trial {
    Attacked(&'static Attack),
    /// The mirror image, of each attack in turn.
    Mirrored,
    /// Another model.
    Stranger,
}

pub(crate) fn trials() -> impl Iterator<Item = Trial> {
    let attacked = ATTACKS.iter().map(Trial::Attacked);
    attacked.chain([Trial::Mirrored, Trial::Stranger])
}

impl Trial {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Attacked(attack) => attack.name,
            Self::Mirrored => "mirrored",
            Self::Stranger => "another model",
        }
    }

    pub(crate) fn is_exact(self) -> bool {
        matches!(self, Self::Attacked(attack) if attack.exact)
    }

    /// The attack of a draw, and its seed; none for strangers.
    fn attack(self, draw: u64) -> Option<(&'static Attack, u64)> {
        let (attack, turn) = match self {
            Self::Attacked(attack) => (attack, draw),
            Self::Mirrored => (&ATTACKS[draw as usize % ATTACKS.len()], 0),
            Self::Stranger => return None,
        };
        Some((attack, if attack.random { turn % VARIANTS } else { 0 }))
    }

    /// How many draws there are of it for so many of each attack: no other model is like the next.
    fn draws(self, wanted: u64) -> u64 {
        match self {
            Self::Stranger => wanted.div_ceil(5),
            _ => wanted,
        }
    }
}

/// Of attacks that are random, so many seeds are used in turn.
pub(crate) const VARIANTS: u64 = 4;

/// Draws of each trial before the next trial of a mesh has its turn, so that a run that ends early has some of each.
const ROUND: u64 = 4;

/// Root mean square error as a fraction of the diagonal where geometry is unchanged.
pub(crate) const EXACT: f64 = 1e-6;

/// A pose that is off by less than this is the right one, if not exactly.
pub(crate) const RIGHT_POSE: f64 = 5e-3;

/// The true transform may read so much more of the bits.
pub(crate) const LOST_RATE: f64 = 0.005;

/// Transforms that bring the suspect's vertices nearer to each other than this fraction of the diagonal, root mean square, read
/// the same: a thousandth of a mark.
const SAME_PLACE: f64 = 1e-7;

/// The draws of one mesh and trial.
pub(crate) struct Cell {
    pub(crate) mesh: String,
    pub(crate) vertices: usize,
    pub(crate) trial: Trial,
    pub(crate) draws: Vec<Draw>,
}

/// One alignment.
pub(crate) struct Draw {
    aligned: bool,
    /// Root mean square distance of the suspect's vertices from where they belong, over the original's diagonal.
    pub(crate) error: f64,
    /// That of the unmarked suspect, where it lies exactly on the original.
    pub(crate) exact_error: Option<f64>,
    hand_recognised: bool,
    /// None for strangers, and for what did not align.
    rates: Option<Rates>,
    pub(crate) overlap: f64,
    pub(crate) cpu: f64,
}

/// How bits are read.
#[derive(Clone, Copy)]
pub(crate) enum Rule {
    /// As `sigmark verify` reads surfaces.
    LeastSquares,
    Paper,
}

/// Extraction rates with the found transform and with the true one.
#[derive(Clone, Copy, Serialize, Deserialize)]
struct Rates {
    least_squares: [f64; 2],
    paper: [f64; 2],
}

impl Draw {
    pub(crate) fn rates(&self, rule: Rule) -> Option<[f64; 2]> {
        self.rates.map(|rates| match rule {
            Rule::LeastSquares => rates.least_squares,
            Rule::Paper => rates.paper,
        })
    }

    pub(crate) fn is_right(&self, trial: Trial, rule: Rule) -> bool {
        if matches!(trial, Trial::Stranger) {
            return !self.aligned;
        }
        let reads = self
            .rates(rule)
            .is_some_and(|[found, truth]| found >= truth - LOST_RATE - 1e-12);
        let exact = self.exact_error.is_none_or(|error| error <= EXACT);
        self.aligned && self.hand_recognised && self.error < RIGHT_POSE && reads && exact
    }

    fn of(value: &Value) -> Option<Self> {
        Some(Self {
            aligned: value["aligned"].as_bool()?,
            error: value["error"].as_f64()?,
            exact_error: value["exact_error"].as_f64(),
            hand_recognised: value["hand_recognised"].as_bool()?,
            rates: serde_json::from_value(value["rates"].clone()).ok()?,
            overlap: value["overlap"].as_f64()?,
            cpu: value["cpu"].as_f64()?,
        })
    }
}

/// What to measure.
pub struct Selection {
    pub only: Vec<String>,
    pub attacks: Vec<String>,
    pub draws: u64,
    pub most_vertices: usize,
    pub with_peers: bool,
    /// No draw begins later.
    pub time: Option<Duration>,
}

pub fn run(folder: &Path, selection: &Selection) -> Result<()> {
    let attacks = Python::prepare()?;
    let begin = Instant::now();
    let draws = peers::folder(&format!("registration/{}", code()?))?;
    let chosen = |name: &str, wanted: &[String]| {
        wanted.is_empty() || wanted.iter().any(|prefix| name.starts_with(prefix.as_str()))
    };
    let files = by_size(mesh_files(folder)?)?;
    let mut cells = Vec::new();
    for (i, path) in files.iter().enumerate() {
        if !chosen(&name_of(path), &selection.only) {
            continue;
        }
        let original = Asset::open(path)?.mesh().clone();
        if original.vertex_count() > selection.most_vertices {
            continue;
        }
        let mut bench = Bench {
            name: name_of(path),
            original: &original,
            // Not a neighbour: those by size may be versions of one model.
            stranger: &files[(i + 4) % files.len()],
            attacks: &attacks,
            folder: draws.clone(),
            prepared: None,
            may_begin: &|| selection.time.is_none_or(|time| begin.elapsed() < time),
        };
        let trials = trials().filter(|trial| chosen(trial.name(), &selection.attacks));
        cells.extend(bench.cells(&trials.collect::<Vec<_>>(), selection.draws)?);
    }
    if cells.is_empty() {
        bail!("{}: no draws of meshes of such names", folder.display());
    }
    let peers = if selection.with_peers {
        registration_large::run(&files, &attacks)? + &registration_peers::run(&files, &attacks)?
    } else {
        String::new()
    };
    tables::write(&cells, &attacks, &peers)
}

/// The digest of what finished draws depend on.
pub(crate) fn code() -> Result<String> {
    sources::digest_of(
        &["mesh", "partition", "mhb-core", "registration", "sigmark"],
        &["xtask/src/bench/registration.rs"],
    )
}

/// The smallest file first.
fn by_size(files: Vec<PathBuf>) -> Result<Vec<PathBuf>> {
    let mut sized = Vec::new();
    for path in files {
        let size = fs::metadata(&path)
            .with_context(|| path.display().to_string())?
            .len();
        sized.push((size, path));
    }
    sized.sort();
    Ok(sized.into_iter().map(|(_, path)| path).collect())
}

/// One mesh and its draws.
struct Bench<'a> {
    name: String,
    original: &'a TriMesh,
    stranger: &'a Path,
    attacks: &'a Python,
    folder: PathBuf,
    prepared: Option<Prepared>,
    may_begin: &'a dyn Fn() -> bool,
}

/// What all draws of a mesh share.
struct Prepared {
    aligner: Aligner,
    signed: Signed,
    readings: Vec<Reading>,
}

/// What was read of a suspect in a place.
struct Reading {
    suspect: String,
    place: Similarity,
    rates: Rates,
}

impl Bench<'_> {
    /// The draws of all trials, in rounds.
    fn cells(&mut self, trials: &[Trial], draws: u64) -> Result<Vec<Cell>> {
        let mut cells: Vec<Cell> = trials
            .iter()
            .map(|&trial| Cell {
                mesh: self.name.clone(),
                vertices: self.original.vertex_count(),
                trial,
                draws: Vec::new(),
            })
            .collect();
        for first in (0..draws).step_by(ROUND as usize) {
            for cell in &mut cells {
                let last = (first + ROUND).min(cell.trial.draws(draws));
                for number in first..last {
                    let Some(value) = self.finished(cell.trial, number)? else {
                        continue;
                    };
                    let draw = Draw::of(&value).context("not a finished draw")?;
                    if !draw.is_right(cell.trial, Rule::LeastSquares) {
                        println!("{}, {}, draw {number}: {value}", cell.mesh, cell.trial.name());
                    }
                    cell.draws.push(draw);
                }
                if !cell.draws.is_empty() && first < last {
                    println!("{}", tables::line(cell));
                }
            }
        }
        cells.retain(|cell| !cell.draws.is_empty());
        Ok(cells)
    }

    /// A draw as it was finished before, or now; none when the time is over.
    fn finished(&mut self, trial: Trial, number: u64) -> Result<Option<Value>> {
        let kept: String = trial.name().chars().filter(char::is_ascii_alphanumeric).collect();
        let name = format!("{}-{kept}-{number}", self.name);
        let folder = self.folder.clone();
        if !folder.join(format!("{name}.json")).is_file() && !(self.may_begin)() {
            return Ok(None);
        }
        peers::cell(&folder, &name, || self.draw(trial, number)).map(Some)
    }

    fn prepared(&mut self) -> Result<&mut Prepared> {
        if self.prepared.is_none() {
            let aligner = Aligner::new(self.original, &AlignOptions::default())?;
            let key = SigningKey::generate(Curve::P256, &mut ChaCha20Rng::seed_from_u64(2012));
            let signed = Embedder::new(&key).embed(self.original, &Job::default())?;
            signed.original().keep_bases(&Job::default())?;
            self.prepared = Some(Prepared {
                aligner,
                signed,
                readings: Vec::new(),
            });
        }
        self.prepared.as_mut().context("just prepared")
    }

    fn draw(&mut self, trial: Trial, number: u64) -> Result<Value> {
        let mirrored = matches!(trial, Trial::Mirrored);
        let mut moved = random_similarity(self.original, number);
        if mirrored {
            moved.rotation = moved.rotation.map(|[x, y, z]| [-x, y, z]);
        }
        let (name, suspect) = match trial.attack(number) {
            Some((attack, seed)) => {
                let marked = self.prepared()?.signed.mesh().clone();
                let (script, strength) = attack.script;
                let name = format!("{}-marked", self.name);
                let suspect = attacked(self.attacks, &marked, &name, script, strength, seed)?;
                (format!("{script}-{strength}-{seed}"), suspect)
            }
            None => (String::new(), Asset::open(self.stranger)?.mesh().clone()),
        };
        let there = shapes::moved(&suspect, &moved);
        let (found, cost) = timed(|| {
            self.prepared()?
                .aligner
                .align(&there, &Job::default())
                .map_err(anyhow::Error::from)
        });
        let found = found?;
        let diagonal = self.original.bounding_box().diagonal();
        let place = moved.then(&found.transform);
        let rates = match trial {
            Trial::Stranger => None,
            _ if !found.aligned => None,
            _ => Some(self.rates(&name, &suspect, &moved, &found)?),
        };
        Ok(json!({
            "draw": number,
            "aligned": found.aligned,
            "error": misfit(&suspect, &place) / diagonal,
            "exact_error": self.exact_error(trial, number, &moved)?,
            "hand_recognised": found.mirrored() == mirrored,
            "rates": rates,
            "basis": found.matched_by,
            "overlap": found.overlap,
            "coverage": found.coverage,
            "residual": found.residual,
            "alternatives": found.alternatives.len(),
            "free_directions": found.free_directions,
            "cpu": cost.cpu,
            "wall": cost.wall,
        }))
    }

    /// How far the unmarked suspect is off, where it lies exactly on the original.
    fn exact_error(&mut self, trial: Trial, number: u64, moved: &Similarity) -> Result<Option<f64>> {
        let Some((attack, seed)) = trial.attack(number).filter(|_| trial.is_exact()) else {
            return Ok(None);
        };
        let (script, strength) = attack.script;
        let suspect = attacked(self.attacks, self.original, &self.name, script, strength, seed)?;
        let there = shapes::moved(&suspect, moved);
        let found = self.prepared()?.aligner.align(&there, &Job::default())?;
        let error = misfit(&suspect, &moved.then(&found.transform));
        Ok(Some(error / self.original.bounding_box().diagonal()))
    }

    /// Extraction rates; with the best of all poses that were found, as the verifier has it.
    fn rates(
        &mut self,
        name: &str,
        suspect: &TriMesh,
        moved: &Similarity,
        found: &Alignment,
    ) -> Result<Rates> {
        let near = SAME_PLACE * self.original.bounding_box().diagonal();
        let prepared = self.prepared()?;
        let mut best: Option<Rates> = None;
        for pose in std::iter::once(&found.transform).chain(&found.alternatives) {
            let place = moved.then(pose);
            let known = prepared.readings.iter().find(|reading| {
                let between = reading.place.then(&place.inverse());
                reading.suspect == name && misfit(suspect, &between) <= near
            });
            let rates = match known {
                Some(reading) => reading.rates,
                None => {
                    let same = |reading: &&Reading| reading.suspect == name;
                    let truth = prepared.readings.iter().find(same).map(|reading| reading.rates);
                    let rates = read(&prepared.signed, suspect, &place, found, truth)?;
                    prepared.readings.push(Reading {
                        suspect: name.into(),
                        place,
                        rates,
                    });
                    rates
                }
            };
            if best.is_none_or(|best| rates.least_squares[0] > best.least_squares[0]) {
                best = Some(rates);
            }
        }
        best.context("no pose")
    }
}

/// Extraction rates of a suspect in the pose before it was moved: as the verifier reads it under a transform that is nearly right,
/// and under none, if these are not `known`. The transform is bettered for the paper's rule, as the verifier does it.
fn read(
    signed: &Signed,
    suspect: &TriMesh,
    place: &Similarity,
    found: &Alignment,
    known: Option<Rates>,
) -> Result<Rates> {
    let (original, job) = (signed.original(), &Job::default());
    let records = &signed.certificate().mark().patches;
    let alphas: Vec<f64> = records.iter().map(|patch| patch.alpha).collect();
    let rate = |bits: SoftBits| extraction_rate(&signed.signature().bits(), &bits.hard());
    let both = |registered: &Registered| {
        let by = |detector: &dyn Detector| detector.detect(original, &alphas, registered, job).map(rate);
        anyhow::Ok([by(&LeastSquaresDetector)?, by(&CoefficientDetector)?])
    };
    let (read, truth) =
        if let (MatchedBy::Connectivity, Some(map)) = (found.matched_by, &found.correspondence) {
            // The verifier fits corresponding vertices anew, from no first guess.
            let certificate = signed.certificate();
            let verifier = Verifier::with_original(original, certificate, certificate.public_key())?;
            let verdict = verifier.verify(suspect, job)?;
            let fitted = verdict.transform.context("the verifier read nothing")?;
            let seen = map.carry(suspect);
            let placed = seen.iter().map(|seen| seen.map(|p| fitted.apply(p)));
            let placed = Registered::by_vertices(placed.collect());
            (both(&placed)?, Registered::by_vertices(seen))
        } else {
            let mut sampler = Sampler::new(original.mesh(), suspect);
            if let Some(survivors) = &found.correspondence {
                sampler = sampler.survivors(survivors);
            }
            let (_, bits, _) = sampler.read(original, &alphas, place, job)?;
            let better = sampler.refine(original, &alphas, place, job)?;
            let paper = CoefficientDetector.detect(original, &alphas, &sampler.sample(&better, job)?, job)?;
            (
                [rate(bits), rate(paper)],
                sampler.sample(&Similarity::IDENTITY, job)?,
            )
        };
    let truth = match known {
        Some(rates) => [rates.least_squares[1], rates.paper[1]],
        None => both(&truth)?,
    };
    Ok(Rates {
        least_squares: [read[0], truth[0]],
        paper: [read[1], truth[1]],
    })
}

/// A mesh after an attack; finished ones are kept, by the digest of the mesh and the attacks.
pub(crate) fn attacked(
    attacks: &Python,
    original: &TriMesh,
    name: &str,
    script: &str,
    strength: f64,
    seed: u64,
) -> Result<TriMesh> {
    let folder = peers::folder("registration/suspects")?;
    let bytes = write_mesh(original, Format::Ply, Precision::Double);
    let kept = digest(&[&bytes, sources::digest_of(&[], &[])?.as_bytes()].concat());
    let result = folder.join(format!("{name}-{script}-{strength}-{seed}-{kept}.ply"));
    if !result.is_file() {
        let source = folder.join(format!("{name}.ply"));
        fs::write(&source, bytes).with_context(|| source.display().to_string())?;
        // Under a name of its own until it is whole.
        let partial = folder.join(format!("{name}-{script}-{strength}-{seed}.partial.ply"));
        let words = [source.as_os_str(), partial.as_os_str(), script.as_ref()];
        let numbers = [
            "--strength".into(),
            strength.to_string(),
            "--seed".into(),
            seed.to_string(),
        ];
        let arguments = words.into_iter().map(Into::into).chain(numbers.map(Into::into));
        attacks.run("attack.py", arguments.collect::<Vec<std::ffi::OsString>>())?;
        fs::rename(&partial, &result).with_context(|| result.display().to_string())?;
    }
    Ok(Asset::open(&result)?.mesh().clone())
}

/// Root mean square distance by which a transform moves the vertices of a mesh.
pub(crate) fn misfit(mesh: &TriMesh, transform: &Similarity) -> f64 {
    let moved = mesh.positions().iter().map(|&p| {
        let q = transform.apply(p);
        (0..3).map(|i| (p[i] - q[i]).powi(2)).sum::<f64>()
    });
    (moved.sum::<f64>() / mesh.vertex_count() as f64).sqrt()
}
