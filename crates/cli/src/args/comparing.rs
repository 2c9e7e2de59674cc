//! Bringing meshes together and measuring how they differ.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use quality::{
    DameMetric, DistanceMetric, DistanceOptions, Metric, Msdm2Metric, ShapeDnaMetric, ShapeDnaOptions,
};

use super::{Common, TimeLimit, numbers};
use crate::points::Pair;

/// What can be measured of two meshes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum MetricName {
    /// Distances between the surfaces: d_rmse, mean, Hausdorff, MRMS
    Distance,
    /// Shape-DNA: distance of the normalised Laplace-Beltrami eigenvalues
    ShapeDna,
    /// MSDM2: what people notice, by curvature
    Msdm2,
    /// DAME: what people notice, by the angles at edges; needs the same triangles
    Dame,
}

/// What a heat map shows at each vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum Heat {
    /// The distance from the reference, as a fraction of its diagonal
    #[default]
    Distance,
    /// The local distortion of MSDM2
    Msdm2,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  sigmark compare model.obj signed.obj --heatmap difference.png

The first mesh is the reference. Both are compared as they lie: nothing is aligned. Distances are fractions of the \
reference's diagonal in JSON and per cent of it for people; forward is from the second mesh to the first. DAME finds vertices \
that came in another order. What can't be computed is named with the reason; the exit code is 2 if that is everything.

--json prints: reference, distorted (file names), diagonal (in the models' unit), distance (d_rmse, mean, hausdorff_forward, \
hausdorff_backward, hausdorff, rmse_backward, mean_backward, mrms, samples, interval), shape_dna (p, m, distance, components of both), msdm2 \
(forward, backward, symmetric), dame (error in radians, edges), not_computed (reasons), heatmap (file, max), seconds (of each \
stage). What was not asked for or not computed is null.")]
pub(crate) struct Compare {
    /// The mesh to measure by
    pub(crate) reference: PathBuf,
    /// The mesh that differs from it
    pub(crate) distorted: PathBuf,
    /// What to measure, separated by commas [default: everything]
    #[arg(long, value_name = "METRICS", value_enum, value_delimiter = ',', hide_default_value = true,
        default_values_t = [MetricName::Distance, MetricName::ShapeDna, MetricName::Msdm2, MetricName::Dame])]
    pub(crate) metrics: Vec<MetricName>,
    /// Largest distance between samples of a surface, as a fraction of its diagonal
    #[arg(long, value_name = "FRACTION", default_value_t = 5e-4, allow_negative_numbers = true, value_parser = numbers::between_0_and_1)]
    pub(crate) interval: f64,
    /// m of Shape-DNA's d_p,m: how many eigenvalues
    #[arg(long, value_name = "M", default_value_t = 50, allow_negative_numbers = true, value_parser = numbers::count)]
    pub(crate) eigenvalues: usize,
    /// p of Shape-DNA's d_p,m
    #[arg(long, value_name = "P", default_value_t = 2.0, allow_negative_numbers = true, value_parser = numbers::at_least_1)]
    pub(crate) norm: f64,
    /// Where to paint the second mesh in the colours of the difference: a .png picture of four sides, or a .ply mesh
    #[arg(long, value_name = "FILE")]
    pub(crate) heatmap: Option<PathBuf>,
    /// What the heat map shows
    #[arg(long, value_enum, default_value_t)]
    pub(crate) heatmap_of: Heat,
    /// What the last colour stands for; the same number makes pictures comparable [default: the greatest difference]
    #[arg(long, value_name = "NUMBER", allow_negative_numbers = true, value_parser = numbers::positive)]
    pub(crate) heatmap_max: Option<f64>,
    /// Replace a file that exists
    #[arg(long)]
    pub(crate) force: bool,
    #[command(flatten)]
    pub(crate) common: Common,
}

impl Compare {
    /// The metric of a name, as it was asked for.
    pub(crate) fn metric(&self, name: MetricName) -> Box<dyn Metric> {
        match name {
            MetricName::Distance => Box::new(DistanceMetric {
                options: DistanceOptions {
                    interval: self.interval,
                },
                ..Default::default()
            }),
            MetricName::ShapeDna => Box::new(ShapeDnaMetric {
                options: ShapeDnaOptions {
                    count: self.eigenvalues,
                    ..Default::default()
                },
                p: self.norm,
                ..Default::default()
            }),
            MetricName::Msdm2 => Box::new(Msdm2Metric),
            MetricName::Dame => Box::new(DameMetric::default()),
        }
    }
}

#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  sigmark align found.obj model.obj -o aligned.obj

Exit code 0 if the suspect lies on the original now, 1 if it does not align with it, or with --pose if no pose had to be undone: then nothing is written.

The suspect may be moved, turned, scaled, mirrored, cropped, decimated or re-meshed; no first guess is needed. What is \
written is the suspect's file with other vertex positions; normals and tangents stored in it turn with the mesh, and so do glTF's \
morph targets. Of a mirrored suspect, normals go on pointing to the side to which they pointed, while faces keep the order of their \
corners. Skeletons, animations, cameras and lights of a scene stay where they were; what else can't be turned is named in a line on \
standard error. Everything else stays byte for byte. Where the search fails, help it with at least three pairs of points, each good to a few hundredths of the diagonal:
  sigmark align found.obj model.obj -o aligned.obj --point 10,0,3=0.4,1,2 --point 17=4711 \\
      --point 9,9,8=220
A on the suspect belongs to B on the original; each is x,y,z in the coordinates of its file, or the number of a vertex in \
the order of its file, from 0. --points reads pairs from a text file, one a line: A=B, or six coordinates, or two vertex \
numbers, separated by blanks; # begins a comment.

--pose brings a suspect back that was posed: one that still has the original's vertices, in any order and file, but with the joints bent or the morph targets taken \
that the original's glTF has; or one with the joints bent whose surface was cut, decimated or divided then. Where no joints do, or the original has none, what bent or posed it otherwise is undone by the surface alone, as well as that tells. Normals and tangents that are stored in the suspect's file stay as they are in its pose.
  sigmark align posed.obj model.glb -o unposed.obj --pose

--json prints: aligned, output (file name; null if nothing was written), transform (4 × 4, suspect to original; null with --pose, as scale, rotation and translation), scale, \
rotation (3 × 3; determinant -1 where mirrored), translation, mirrored, pose (null, or undone_by, rig: by its vertices and the original's joints and morph targets, rig_surface: by its surface and the joints, or bent_surface: by its surface alone, and between, how many vertices were laid between their neighbours since the pose could not be undone for \
them), not_turned (what should have turned with the mesh, and why it did not), registration (connectivity, surroundings, surface or \
points), overlap (share of the suspect's surface that lies on the original, 0 to 1), coverage (share of the original's that \
lies on the suspect), residual (RMS, fraction of the diagonal), ambiguous, alternatives (other transforms that fit a \
symmetric shape), free_directions (in which the shape slides on itself), seconds (of each stage).")]
pub(crate) struct Align {
    /// The mesh to move
    pub(crate) suspect: PathBuf,
    /// The mesh onto which it is moved
    pub(crate) original: PathBuf,
    /// Where to write the moved suspect: the same format as the suspect
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
    /// A point of the suspect and where it belongs on the original: x,y,z or a vertex number on either side; three or more
    #[arg(long, value_name = "A=B", allow_hyphen_values = true, value_parser = Pair::parse)]
    pub(crate) point: Vec<Pair>,
    /// A text file with such pairs, one a line
    #[arg(long, value_name = "FILE")]
    pub(crate) points: Option<PathBuf>,
    /// Undo the suspect's pose, by the joints and morph targets of the original's glTF where they explain it
    #[arg(long, conflicts_with_all = ["point", "points"])]
    pub(crate) pose: bool,
    /// Replace a file that exists
    #[arg(long)]
    pub(crate) force: bool,
    #[command(flatten)]
    pub(crate) time_limit: TimeLimit,
    #[command(flatten)]
    pub(crate) common: Common,
}
