//! Whose copy it was.

use std::path::PathBuf;

use clap::Args;

use super::{Common, TimeLimit, numbers};

#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  sigmark trace found.obj --original model.glb --certificates copies/ --public-key owner.pub.pem

The copies were made by
  sigmark embed model.glb --recipients buyers.csv -o copies/ --key owner.pem

The suspect is read once, whoever may have had it, and asked for the mark of every copy for which a certificate lies in the folders. It may \
be in any format, moved, scaled, cropped, decimated or re-meshed, as for `sigmark verify`, and its parts may have been moved alone; a copy is named where far too little is left \
to be read. Where several gave their copies together, in whatever way these were mixed, the surest is named first, then what he had is taken out, and the others are asked for again, until nobody is \
left. Who is not named is not hinted at.

p is the probability that somebody is named whose copy is not in it, at most: it counts all copies, all ways in which the suspect could lie on \
the original, and all rounds; and it holds whatever was done to the copies. It says that the file was made of that copy, not who gave it away: \
a copy can be stolen from its owner, and who issues copies has them all. SECURITY.md says what may be concluded.

Certificates of other originals and other keys are passed over and counted. Without --public-key it is asked for the copies of the key that signed certificates of this original; where two keys did, \
say which. Exit code 0 if somebody is named, 1 if nobody is; of several suspects 0 if \
in one, and 2 if one could not be judged.

--json prints: an object a suspect, each in a line, of suspect (file name), accused (whose copies are in it, the surest first: recipient, message, certificate (file name), p_value, correlation, margin (T0, beside those \
before)), candidates (copies that were asked for), passed_over (certificates of other originals or keys), unreadable (file names in the folders that look like certificates and could not be read), unsigned (certificates that would have been named, but that the key did not sign), altered (where nobody is named, others that it did not sign: the marks that these were issued with were not asked for), p_bound, registration (connectivity, surroundings, surface, parts, rig: by its vertices, brought back from its pose by the joints and morph targets of the original's file, which the certificate binds, rig_surface: by its surface, brought back likewise, local_frames: by its vertices, each seen from its own surroundings, where something had bent or posed it, or bent_surface: by its surface, likewise), poses, overlap, \
coverage, missing, transform (4 × 4, suspect to original; null where it was bent or posed), mirrored, attack_model (as `sigmark verify` has it), remark (why it is another shape), original (file name), \
public_key (fingerprint), own_key (whether the key is the certificates'), seconds (of each stage). What can't be said is null. Of one of several suspects that could not be judged: suspect and error alone.")]
pub(crate) struct Trace {
    /// The meshes in question, or folders of them
    #[arg(required = true, value_name = "SUSPECT")]
    pub(crate) suspects: Vec<PathBuf>,
    /// The very file that was signed
    #[arg(long, value_name = "FILE")]
    pub(crate) original: PathBuf,
    /// A folder that holds the certificates of all copies, or a certificate; may be given again
    #[arg(long, required = true, value_name = "DIR")]
    pub(crate) certificates: Vec<PathBuf>,
    /// The signer's public key [default: the certificates' own]
    #[arg(long, value_name = "PEM")]
    pub(crate) public_key: Option<PathBuf>,
    /// The largest probability of naming an innocent
    #[arg(long, value_name = "P", default_value = "1e-5", allow_negative_numbers = true, value_parser = numbers::between_0_and_1)]
    pub(crate) p_bound: f64,
    /// Where to write what was found as a page for people: HTML in one file, with pictures
    #[arg(long, value_name = "FILE")]
    pub(crate) report: Option<PathBuf>,
    /// Replace a report that exists
    #[arg(long, requires = "report")]
    pub(crate) force: bool,
    #[command(flatten)]
    pub(crate) time_limit: TimeLimit,
    #[command(flatten)]
    pub(crate) common: Common,
}
