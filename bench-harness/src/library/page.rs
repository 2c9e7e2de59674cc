//! The page of the libraries.

use anyhow::Result;
use evaluation::{machine, sources, table::Table};

use super::{
    LibraryBench,
    built::Figures,
    models::Base,
    suspects::Group,
    trials::{FEW, Found, Speed, Strangers},
};
use crate::results;

/// Writes the page and its CSV files.
pub(super) fn write(
    options: &LibraryBench,
    bases: &[Base],
    library: &Figures,
    found: &[Found],
    strangers: &Strangers,
    speed: &[Speed],
) -> Result<()> {
    let folder = results::folder()?;
    let (attacks, speeds) = (attacks(found), speeds(speed));
    attacks.write_csv(&folder.join("library.csv"))?;
    speeds.write_csv(&folder.join("library_speed.csv"))?;
    let page = format!(
        "# Searching in a library\n\nWritten by `cargo xtask bench library --meshes DIR --assets DIR --size {} --suspects {} --strangers {} --read {}`.\n\n{}\n{}\n{}\n{}\n{}\n{}{}; {}. Code {}, digest of what made the library {}.\n",
        options.size,
        options.suspects,
        options.strangers,
        options.read,
        how_made(bases, library),
        verdicts(found),
        attacks.markdown(),
        of_strangers(strangers),
        speed_words(library, found),
        speeds.markdown(),
        machine::description(),
        machine::load(),
        sources::commit(),
        library.code,
    );
    results::write_page(&folder.join("library.md"), &page)
}

fn how_made(bases: &[Base], library: &Figures) -> String {
    let real: Vec<&str> = bases
        .iter()
        .filter(|base| base.whole.is_some())
        .map(|base| base.name.as_str())
        .collect();
    let formulae = bases.len() - real.len();
    let tested = bases.iter().filter(|base| !base.tunes).count();
    format!(
        "The library has {} originals: {} real meshes and assets as they came ({}), and variations of these, decimated to 8000 triangles, and of {formulae} shapes by Gielis's formula. A variation is another model: stretched along each axis by a factor of e^0.25 (standard \
         deviation), tapered, in half of the cases bent and in half twisted by up to 60 to 70°, and displaced by a random smooth field of 1.5 to 4 % of the diagonal (root mean square, wave lengths from a quarter of the diagonal); every fifth has a second model stuck on, every tenth a piece cut off, every \
         fourth is subdivided first. Variations of one base resemble each other far more than models of a shop do.\n\n\
         Suspects are originals of the library, real meshes first, then by chance, attacked, then turned, scaled between 1/100 and 100 and shifted. Thresholds were chosen on {} of the {} bases, but for those that say which vertices are the same, and how many are looked at that are nearest by one measure alone, which were chosen on all; suspects here are of the other {tested}, of which none resembles one of those. *Re-meshing* is the clustering of vertices in a grid of 80 cells along the diagonal; \
         simplification is fast-simplification's; a joint turns what lies beyond the thinnest of 32 planes. The search is that of `sigmark library search` before any alignment.\n",
        library.size,
        real.len(),
        real.join(", "),
        bases.len() - tested,
        bases.len(),
    )
}

/// What is asked of each group, and what was missed.
fn verdicts(found: &[Found]) -> String {
    let mut text = String::new();
    for (group, what) in [
        (Group::Table4, "attacks of Table 4"),
        (Group::Crop, "crops"),
        (Group::Pose, "poses"),
    ] {
        let Some(asked) = group.asked() else {
            continue;
        };
        let of_group: Vec<&Found> = found.iter().filter(|found| found.group == group).collect();
        let missed: Vec<String> = of_group
            .iter()
            .filter(|found| share(found.among_ten, found.suspects) < asked)
            .map(|found| {
                format!(
                    "{} ({:.1} %)",
                    found.attack,
                    100.0 * share(found.among_ten, found.suspects)
                )
            })
            .collect();
        let (ten, all) = of_group.iter().fold((0, 0), |(ten, all), found| {
            (ten + found.among_ten, all + found.suspects)
        });
        text += &format!(
            "- Under {what} the original is to be among the first ten for {:.1} %: it is for {:.2} % of {all} suspects. ",
            100.0 * asked,
            100.0 * share(ten, all)
        );
        let small = [0, 1].map(|i| of_group.iter().map(|found| found.small[i]).sum::<usize>());
        text += &format!(
            "Of the {} that have at least {FEW} triangles it is for {:.2} %. ",
            all - small[0],
            100.0 * share(ten - small[1], all - small[0])
        );
        text += &match missed.is_empty() {
            true => "Every attack reaches it.\n".into(),
            false => format!("**Missed under {}.**\n", missed.join(", ")),
        };
    }
    text
}

fn share(part: usize, all: usize) -> f64 {
    part as f64 / all.max(1) as f64
}

fn attacks(found: &[Found]) -> Table {
    let header = "attack | suspects | first (%) | among ten (%) | asked (%) | by the whole (%) | by the surface (%) | by small shapes (%) | by vertices (%) | search (ms) | worst of 100 (ms)";
    let mut table = Table::new("The right original", header.split(" | "))
        .note("*By*: it is among the first three by that alone.");
    for found in found {
        let percent = |count: usize| format!("{:.1}", 100.0 * share(count, found.suspects));
        let [whole, part, local, vertices] = found.by.map(percent);
        table.row([
            found.attack.to_string(),
            found.suspects.to_string(),
            percent(found.first),
            percent(found.among_ten),
            found
                .group
                .asked()
                .map_or_else(String::new, |asked| format!("{:.1}", 100.0 * asked)),
            whole,
            part,
            local,
            vertices,
            format!("{:.0}", found.milliseconds[0]),
            format!("{:.0}", found.milliseconds[1]),
        ]);
    }
    table
}

fn of_strangers(strangers: &Strangers) -> String {
    let searched = |kind: usize, what: &str| {
        let of = strangers.searched[kind];
        format!(
            "Of {} {what}, {} ({:.1} %) have candidates near enough to be aligned, {:.2} each on average.",
            of.suspects,
            of.with_candidates,
            100.0 * share(of.with_candidates, of.suspects),
            of.candidates as f64 / of.suspects.max(1) as f64,
        )
    };
    format!(
        "## Models that are not in it\n\n{} {} The {} likeliest pairs of those whose original can be signed were read: the original was signed, and the mark looked for in the stranger's model. It lies on the original in {} \
         of them; marks found: **{}**; the least p, ten readings counted, is {:.1e}, and 1e-6 would be a claim. An alignment and reading takes {:.2} s (median).\n",
        searched(0, "new variations of the library's bases"),
        searched(
            1,
            "variations of other shapes by formula, of which nothing in the library was made"
        ),
        strangers.read,
        strangers.lying,
        strangers.claims,
        strangers.least_p,
        strangers.seconds,
    )
}

fn speed_words(library: &Figures, found: &[Found]) -> String {
    let slowest = found
        .iter()
        .map(|found| found.milliseconds[0])
        .fold(0.0, f64::max);
    let cpu = found.iter().map(|found| found.cpu).fold(0.0, f64::max);
    let describing = found.iter().map(|found| found.describing).fold(0.0, f64::max);
    format!(
        "## Time and memory\n\nOpening the file and reading the descriptors of {} originals takes {:.2} s; the index has {:.0} MiB in memory ({:.1} KiB an original), the file without geometry {:.0} MiB. From a suspect's mesh to its candidates it takes up to {slowest:.0} ms of wall time on all cores (median of an attack), of which up to {describing:.0} ms go into describing it; \
         the search by itself takes up to {cpu:.0} ms of CPU time (mean of an attack).\n",
        library.size,
        library.seconds_to_open,
        library.bytes_in_memory as f64 / (1 << 20) as f64,
        library.bytes_in_memory as f64 / 1024.0 / library.size as f64,
        library.bytes_in_file as f64 / (1 << 20) as f64,
    )
}

fn speeds(speed: &[Speed]) -> Table {
    let header = "models | number | triangles | models a second and core | of it describing (ms) | geometry (KiB) | of raw (%)";
    let mut table = Table::new(
        "Adding originals with their geometry, one thread, CPU time",
        header.split(" | "),
    );
    for speed in speed {
        table.row([
            speed.what.clone(),
            speed.models.to_string(),
            speed.triangles.to_string(),
            format!("{:.1}", 1.0 / speed.seconds),
            format!("{:.1}", 1e3 * speed.describing),
            format!("{:.0}", speed.bytes as f64 / 1024.0),
            format!("{:.0}", 100.0 * speed.bytes as f64 / speed.raw.max(1) as f64),
        ]);
    }
    table
}
