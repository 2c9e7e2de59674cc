//! Keys, signing, verification.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use sigmark::{Curve, PayloadKind, Scheme, Strength};

use super::{Common, Laplacian, TimeLimit, numbers};

/// A curve, a hash function, and what is signed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum Profile {
    /// ECDSA on P-256 with SHA-256, 512 bits, over all that the claim rests on: key, original, mark, message
    #[default]
    Standard,
    /// The paper's: ECDSA on a binary curve (B-163) with SHA-1, 324 bits, over the message alone. For reproduction only
    Paper,
}

impl Profile {
    pub(crate) fn curve(self) -> Curve {
        self.scheme().curve()
    }

    pub(crate) fn scheme(self) -> Scheme {
        match self {
            Self::Standard => Scheme::EcdsaP256Sha256,
            Self::Paper => Scheme::EcdsaB163Sha1,
        }
    }
}

/// What of the signature the shape holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum Payload {
    /// The whole, or the tag where the whole would not survive much
    #[default]
    Auto,
    /// The whole, 512 bits
    Signature,
    /// 128 bits that stand for it: read where three quarters of the mark are lost
    Tag,
}

impl Payload {
    /// None for what the model has room for.
    pub(crate) fn kind(self) -> Option<PayloadKind> {
        match self {
            Self::Auto => None,
            Self::Signature => Some(PayloadKind::Signature),
            Self::Tag => Some(PayloadKind::Tag),
        }
    }
}

/// Strengths with a name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum StrengthName {
    /// Facets turn by half a degree: hard to find even where one looks for it
    Subtle,
    /// Facets turn by about a degree
    #[default]
    Standard,
    /// Facets turn by about two degrees: for rough surfaces, and for what has to outlast much
    Strong,
}

/// What happens to a manifest that says who made a file by a digest of all its bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum Manifest {
    /// Left out of the signed copy, and said
    #[default]
    Drop,
    /// Such a model is not signed
    Refuse,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  sigmark keygen -o owner.pem        writes owner.pem and owner.pub.pem

The private key is PKCS#8 PEM, readable by you alone; OpenSSL reads it too. Keep it secret and keep a copy: whoever \
has it can sign in your name, and without it nothing more can be signed. Give the public key to whoever is to verify.

--json prints: private_key, public_key (file names), curve, fingerprint.")]
pub(crate) struct Keygen {
    /// Where to write the private key; the public key goes beside it, as .pub.pem
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
    /// Which kind of signature the key is for
    #[arg(long, value_enum, default_value_t)]
    pub(crate) profile: Profile,
    /// Lock the private key with a passphrase, asked for or taken from SIGMARK_PASSPHRASE
    #[arg(long)]
    pub(crate) encrypt: bool,
    /// Replace files that exist
    #[arg(long)]
    pub(crate) force: bool,
    /// Print one JSON object
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  sigmark embed model.obj -o signed.obj --key owner.pem --message \"© 2026 Studio, order 4711\"
  sigmark embed a.obj b.ply models/ -o signed/ --key owner.pem --recipient \"Museum, Berlin\"
  sigmark embed model.obj -o copies/ --key owner.pem --recipients orders.csv

The first writes signed.obj, the same file with other vertex positions, and signed.obj.cert.json, the certificate. Give away the \
signed file. Keep the original and the certificate: both are needed to verify, and whoever has both can remove the mark. The joints and morph targets of a glTF are signed with it, so that \
a copy in another pose is found and is evidence: sign the file that has them, before it is posed or exported without them.

Several models, or folders of them, go into a folder: signed/NAME and signed/NAME.cert.json each, in the folders that they had in the one that \
was named. Hidden files and linked folders are passed over, as is the folder of the outputs. What can't be signed is named on standard error \
and does not stop the rest; then the exit code is 2.

With --recipients one model is signed for each recipient of a list, with a certificate each; what costs most is computed once. Every copy lies in a \
folder of its own, under the model's name and with its time, so that the file says nobody's name: copies/RECIPIENT/model.obj, and copies/index.csv says which folder \
is whose. Send the model's file from a folder, and whatever lies there but the certificate; keep certificates and index.csv to yourself. A run that was interrupted goes on where it stopped when it is started again, and so \
does one whose list has grown: copies that are there already, with their certificates, stay. Anything else in their places is refused before a copy is written. With --force all are made again, and whatever differs is replaced.

Reads and writes GLB, glTF, OBJ, PLY, STL and OFF, also gzipped, 3MF, and the one mesh of a zip archive, where a glTF has its buffers and textures in it, too. Only positions change (and what glTF \
says of their bounds): materials, textures, skins, animations, morph targets, unknown extensions stay byte for byte, and so do stored normals and tangents, \
which keep the look. A scene of many parts is one work; what it places several times is marked once. Buffers, materials and pictures that a file refers to by name are copied beside \
the output, and never over what is read, another output, or another model's copy that is not the same: that is refused before anything is signed. No triangle turns by more than 15 degrees before the file rounds positions, unless the strength is given in figures and turns more than one in fifty: around others the mark is held back. Where the file's own precision is too coarse for the standard strength, strong is taken; where even that is lost, nothing is written. A locked key's passphrase is asked for, or taken from the \
environment variable SIGMARK_PASSPHRASE.

--json prints: output, certificate (file names), scheme, payload (signature, tag or plain-signature: what the shape holds), bits (of the payload), code_bits (what they become: the bits that stand in the shape), chips (places for those in all), laplacian, functions (manifold harmonics of each patch), \
patches, unmarked_vertices, alpha, distortion_rms (fraction of the diagonal), margin_predicted (T0 under noise of 0.1 %, of the mark as it is written), margin_read (T0 at which the payload is read), noise_read, noise_evidence, \
noise_detected (up to which noise, as a share of the bounding box, the payload is read, the mark is evidence, is detected), facet_turn (median, p99, max: by how many degrees triangles \
turned), flipped (triangles that look the other way), manifest_dropped (whether the model had a C2PA manifest), seconds (of each stage). Of several models an object a model, each in a line, with \
model (file name); of one that failed model and error alone. With --recipients one object, whose output is the folder, certificate null, and facet_turn, flipped, margin_predicted, noise_read, noise_evidence and noise_detected those of the new copies for which they are worst \
(facet_turn and flipped null if none is new), with index (file name), made, skipped (how many copies are new, and how many were there) and copies (recipient, output, certificate, made of each).")]
pub(crate) struct Embed {
    /// The mesh to sign; several, or folders of them, are signed one after the other
    #[arg(required = true, value_name = "MODEL")]
    pub(crate) models: Vec<PathBuf>,
    /// Where to write the signed mesh: the same format as the model. Of several models or recipients, the folder for all, made if there is none
    #[arg(short, long, value_name = "PATH")]
    pub(crate) output: PathBuf,
    /// The private key
    #[arg(short, long, value_name = "PEM")]
    pub(crate) key: PathBuf,
    /// What you assert: a text that stands in the certificate and is signed [default: none]
    #[arg(
        short,
        long,
        value_name = "TEXT",
        default_value = "",
        hide_default_value = true
    )]
    pub(crate) message: String,
    /// Whom this copy is for: a text that stands in the certificate and is signed [default: none]
    #[arg(long, value_name = "TEXT", default_value = "", hide_default_value = true)]
    pub(crate) recipient: String,
    /// Make a copy for each recipient of a list: CSV, the column with the header "recipient", or a name in each line without any header. The output is a folder then
    #[arg(long, value_name = "CSV", conflicts_with_all = ["recipient", "certificate"])]
    pub(crate) recipients: Option<PathBuf>,
    /// Where to write the certificate [default: the output's name and .cert.json]
    #[arg(long, value_name = "FILE")]
    pub(crate) certificate: Option<PathBuf>,
    /// Kind of signature; must suit the key [default: as the key's curve has it]
    #[arg(long, value_enum)]
    pub(crate) profile: Option<Profile>,
    /// What of the signature the shape holds
    #[arg(long, value_enum, value_name = "WHAT", default_value_t)]
    pub(crate) payload: Payload,
    /// Hash with SHA-1 in place of SHA-256 (P-256 keys)
    #[arg(long)]
    pub(crate) sha1: bool,
    /// How strongly to mark: subtle and strong are half and twice the standard distortion; less where the model is thin [default: standard]
    #[arg(long, value_enum, group = "how_strong")]
    strength: Option<StrengthName>,
    /// How far the surface moves: RMS displacement as a fraction of the bounding box's diagonal; in place of --strength [default: 0.0004]
    #[arg(long, value_name = "FRACTION", group = "how_strong", allow_negative_numbers = true, value_parser = numbers::distortion)]
    distortion: Option<f64>,
    /// Strength as α of eq. 12, for patches of unit area; in place of --strength
    #[arg(long, value_name = "ALPHA", group = "how_strong", allow_negative_numbers = true, value_parser = numbers::positive)]
    alpha: Option<f64>,
    /// Strength as the paper's α, in the model's unit of length; in place of --strength
    #[arg(long, value_name = "ALPHA", group = "how_strong", allow_negative_numbers = true, value_parser = numbers::positive)]
    paper_alpha: Option<f64>,
    /// How many chips there are to a bit of the payload, where there is room: more outlasts more decimation, and shows more at the same distortion. In
    /// the paper's profile how often each bit stands in a patch [default: 6, for a tag 24; for the paper's profile 3]
    #[arg(long, value_name = "C", allow_negative_numbers = true, value_parser = numbers::count)]
    pub(crate) chip_rate: Option<usize>,
    /// Into how many patches the mesh is cut, about [default: as many as make the harmonics cheap]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = numbers::count)]
    pub(crate) patches: Option<usize>,
    /// Which Laplacian gives the manifold harmonics
    #[arg(long, value_enum, default_value_t)]
    pub(crate) laplacian: Laplacian,
    /// What to do with a C2PA manifest in the model: it says who made the file by a digest of every byte, and no longer holds
    #[arg(long, value_enum, value_name = "WHAT", default_value_t)]
    pub(crate) c2pa: Manifest,
    /// Replace files that exist
    #[arg(long)]
    pub(crate) force: bool,
    #[command(flatten)]
    pub(crate) common: Common,
}

impl Embed {
    /// Whether nothing was asked for by name or number.
    pub(crate) fn leaves_strength_open(&self) -> bool {
        self.strength.is_none()
            && self.distortion.is_none()
            && self.alpha.is_none()
            && self.paper_alpha.is_none()
    }

    pub(crate) fn strength(&self) -> Strength {
        match (self.distortion, self.alpha, self.paper_alpha) {
            (Some(fraction), _, _) => Strength::Distortion(fraction),
            (_, Some(alpha), _) => Strength::Alpha(alpha),
            (_, _, Some(alpha)) => Strength::PaperAlpha(alpha),
            _ => match self.strength.unwrap_or_default() {
                StrengthName::Subtle => Strength::SUBTLE,
                StrengthName::Standard => Strength::default(),
                StrengthName::Strong => Strength::STRONG,
            },
        }
    }
}

#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  sigmark verify found.obj --certificate signed.obj.cert.json

That is for the owner: the original is looked for beside the certificate, by its name, then by its digest, and the key is the \
certificate's own. A third party has the key from its owner:
  sigmark verify found.obj --certificate signed.obj.cert.json --original model.obj \\
      --public-key owner.pub.pem --dispute --report report.html

The report is a page for people, with pictures, in one file: what was asked and found, what it means, and how to repeat it. It shows where \
the surface was moved: give it to those alone who may see the original or the certificate; on Unix its owner alone can read it.

Exit code 0 if the signature was read back (verified) or its presence is beyond doubt (detected), 1 if it was not found; of several \
suspects 0 if it was found in one, and 2 if one could not be judged. Folders are walked for meshes; hidden files and linked folders are \
passed over.

Two levels. Detected: a model without the mark comes so far with a probability of 1e-6 at most (--p-bound). That holds for a claim that was \
there before the suspect: your own, or one with a time stamp. Who could make a claim after he saw the suspect can try many, and needs \
to be below 2^-120, which 2^80 tries do not reach with a probability of 2^-40: evidence against a stranger. --dispute asks for that, \
and exits with 1 below it.

An original of the same geometry in another file, at another precision, in another order or unit, among other parts, is recognised as such: the mark is read for the \
owner's information, and the verdict says that a claim needs the very file.

The suspect may be in any format, moved, turned, scaled, mirrored, its vertices and faces in any order. Where it lost the \
original's triangles, because it was cropped, decimated, subdivided or re-meshed, it is laid onto the original by its \
surface; at least 80 % of that must lie there, or of the surface of one of its four largest connected parts, if it stands among other things. Of a scene, connected parts that were taken out, moved, turned or scaled alone, or put into another \
scene are put back one by one, and the verdict says which were found.

Few patches are read first, and more only where these do not hold the whole signature; the probability allows for all that might have been read. Who needs no signature read back can say which probability is enough, and waits less \
where much was lost:
  sigmark verify found/ --certificate signed.obj.cert.json --enough 1e-9

The signature, or its tag, stands in the shape as a codeword: \
it is read where many bits are lost or wrong.

--json prints: an object a suspect, each in a line, of suspect (file name), outcome (verified, detected or not_found), evidence (whether p_value is at most 2^-120 for a mark that binds the \
original, compared with the very file), scheme, signed (what the signature in the shape covers: statement or message), own_key (whether the key is the \
certificate's), original (file name), original_is (file: the very one that was signed; geometry: another of that geometry), extraction_rate (0 to 1), p_value, p_dispute (2^80 p_value, at most 1, of a tag at least 2^-48; 1 where nothing is found), correlation, margin (T0, the signal-to-noise ratio), payload (signature, tag or plain-signature), bits (of the code, of which something was read), \
bit_errors (how many of those are wrong, before the code mends any), patches_read (of how many patches the bits were read), tries (of how many readings this could have been chosen, by which p_value is multiplied), registration (connectivity, surroundings, surface, parts, rig: by its vertices, brought back from its pose by the joints and morph targets of the original's file, which the certificate binds, rig_surface: by its surface, brought back likewise, local_frames: by its vertices, each seen from its own surroundings, where something had bent or posed it, or bent_surface: by its surface, likewise), poses (how many were tried), overlap (share of the \
suspect's surface that lies on the original, 0 to 1), coverage (share of the original's that lies on the suspect), missing \
(share of the original's vertices that were not seen), residual (fraction of the diagonal), transform (4 × 4, suspect to \
original; null where it was bent or posed: then no one transform does), mirrored (null likewise), attack_model (of what moved the suspect, the shares of squared displacements that mark, misalignment, offset, \
smoothing, tessellation_bias, bending and noise explain; null where the paper's rule alone read it, or it is another shape), remark (why it is another shape), parts (connected parts of the original that were seen: part, its number, name, seen, 0 to 1, and transform if it was put back alone), marked_parts (how many carry the mark), message, recipient, public_key (fingerprint), stamps (time, authority and serial of each that checks; null where --stamp-roots is not given), stamps_refused (number and reason of each that does not, and counts for nothing; null likewise), seconds (of each stage). What can't be said \
is null. Of one of several suspects that could not be judged: suspect and error alone.")]
pub(crate) struct Verify {
    /// The meshes in question, or folders of them; what is computed of the original for the first serves the others
    #[arg(required = true, value_name = "SUSPECT")]
    pub(crate) suspects: Vec<PathBuf>,
    /// The certificate that embed wrote
    #[arg(long, value_name = "FILE")]
    pub(crate) certificate: PathBuf,
    /// The very file that was signed; has to be given with --dispute [default: looked for beside the certificate]
    #[arg(long, value_name = "FILE", required_if_eq("dispute", "true"))]
    pub(crate) original: Option<PathBuf>,
    /// The signer's public key; has to be given with --dispute [default: the certificate's own]
    #[arg(long, value_name = "PEM", required_if_eq("dispute", "true"))]
    pub(crate) public_key: Option<PathBuf>,
    /// Ask for evidence that holds against a stranger, who may have made his claim after he saw the suspect: with --original and --public-key, which nothing is taken for
    #[arg(long)]
    pub(crate) dispute: bool,
    /// Read marks of the paper's profile, too, which do not say whose the model is
    #[arg(long, value_enum)]
    pub(crate) profile: Option<Profile>,
    /// Check the certificate's time stamps against these root certificates, in PEM; those that don't check are told and count for nothing [default: stamps are mentioned, not checked]
    #[arg(long, value_name = "PEM")]
    pub(crate) stamp_roots: Option<PathBuf>,
    /// The largest probability of being wrong that counts as detected
    #[arg(long, value_name = "P", default_value = "1e-6", allow_negative_numbers = true, value_parser = numbers::between_0_and_1)]
    pub(crate) p_bound: f64,
    /// Look at no more of a suspect once the probability of being wrong is at most this, though the signature was not read; at most --p-bound, and with --dispute 2^-120, 7.5e-37 [default: look on until it is read, or all was looked at]
    #[arg(long, value_name = "P", allow_negative_numbers = true, value_parser = numbers::between_0_and_1)]
    pub(crate) enough: Option<f64>,
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
