//! The page of the tracing, its chart and its picture.

use anyhow::Result;
use evaluation::{
    chart::{Panel, THEIRS, page as svg_page},
    machine,
    markup::OURS,
    pictures::under_raking_light,
    python::Python,
    sources,
    table::Table,
};
use job::Job;
use mesh::TriMesh;

use super::{
    BOUND, BUYERS, CHARTED, COLLUDERS, Leak, Model, Traced,
    collusion::{Domain, RULES, Rule},
    copies::{Layout, Shop},
};
use crate::results;

const PLAIN: &str = "#3f9142";

/// Writes the page, its chart and its CSV file. `code`: the digest of what the figures depend on.
pub(super) fn write(models: &[Model], python: &Python, code: &str) -> Result<()> {
    let results = results::folder()?;
    long(models).write_csv(&results.join("tracing.csv"))?;
    results::write(&results.join("tracing.svg"), chart(models))?;
    let mut sections = vec![words()];
    sections.push(summary(models));
    sections.push("![T of colluders who average their copies](tracing.svg)\n\nThe mean T of those who average. Dashes are what theory says where there is no noise.\n".into());
    for model in models {
        sections.push(format!(
            "## {}\n\n{} chips; a copy is {:.3} % of the diagonal off (RMS). Reading a suspect took {:.1} s, asking 10 000 copies {:.2} s.\n",
            model.name,
            model.chips,
            100.0 * model.rms,
            model.seconds_of_reading,
            model.seconds_of_10_000
        ));
        for domain in Domain::ALL {
            sections.push(attacks(model, *domain).markdown());
        }
        sections.push(afterwards(model).markdown());
        sections.push(leaks(model).markdown());
    }
    sections.push("![The original; the mean of eight copies; random negative of eight copies](tracing_attacks.png)\n\nA raking light on the original, the average of eight copies, and what random negative makes of the same eight: averaging takes the marks' visibility away, the rules that take the ends of what the colluders \
                   have add theirs.\n".into());
    sections.push(format!(
        "{}, {}; {}. Code {}, sources' digest {code}.\n",
        machine::description(),
        python.versions()?,
        machine::load(),
        sources::commit(),
    ));
    results::write_page(&results.join("tracing.md"), &sections.join("\n"))
}

fn words() -> String {
    format!(
        "# Whose copy was it?\n\nWritten by `cargo xtask bench tracing`. {BUYERS} copies of a model are given out, as `sigmark embed --recipients --chip-rate 16` makes them; some buyers mix theirs by a rule, coordinate by coordinate as their files have them, or, which is the more an \
         attacker can know, coefficient by coefficient of the very harmonics of the mark; the mixture is rounded to 14 bits and traced. *Rotated* is our layout, judged by the code of `sigmark trace`: a cell has the colluders who are named at p ≤ {BOUND:e} of those that there are, and T of the surest. \
         *Plain* has the same bits on single harmonics, ±1; *Tardos* his code there, by the symmetric score, on as many chips and of the same distortion. Both are scored from the same reading, and who is above the same bound in the first round counts as named.\n"
    )
}

/// In a line a model: how many are named, and how many innocents.
fn summary(models: &[Model]) -> String {
    let lines = models.iter().map(|model| {
        let ours = || model.traced.iter().filter(|t| t.layout == Layout::Rotated.name());
        let least = |colluders: usize, is: &dyn Fn(&Traced) -> bool| {
            let cells = ours().filter(|t| t.colluders == colluders && is(t));
            cells.map(|t| t.named).min().unwrap_or(0)
        };
        let in_files = |t: &Traced| t.domain == Domain::Coordinates.name();
        let wrong: usize = ours().chain(&model.afterwards).map(|t| t.wrong).sum();
        let codes: usize = model.leaks.iter().map(|leak| leak.codes).sum();
        let false_names: usize = model.leaks.iter().map(|leak| leak.wrong).sum();
        format!(
            "- **{}**, {} chips. Under each rule, of three colluders at least {} are named where they mix what their files have and {} where they mix harmonics; of eight {} and {}; of twenty who average {}. \
             Innocents that were named: {wrong} by all mixtures, {false_names} of {codes} fresh codes.\n",
            model.name,
            model.chips,
            least(3, &in_files),
            least(3, &|t| !in_files(t)),
            least(8, &in_files),
            least(8, &|t| !in_files(t)),
            least(20, &|t| t.attack == Rule::Average.name()),
        )
    });
    lines.collect()
}

fn attacks(model: &Model, domain: Domain) -> Table {
    let layouts = || {
        Layout::ALL
            .into_iter()
            .filter(|layout| layout.domains().contains(&domain))
    };
    let mut header = vec!["rule".to_string()];
    for colluders in COLLUDERS {
        header.push(format!("{colluders}: moved, %"));
        header.extend(layouts().map(|layout| format!("{colluders}: {}", layout.name())));
    }
    let title = format!("Mixed by {}", domain.name());
    let mut table = Table::new(&title, header.iter().map(String::as_str));
    for rule in RULES {
        let mut row = vec![rule.name().to_string()];
        for colluders in COLLUDERS {
            let of = |layout: Layout| {
                model.traced.iter().find(|traced| {
                    (
                        traced.layout.as_str(),
                        traced.domain.as_str(),
                        traced.attack.as_str(),
                        traced.colluders,
                    ) == (layout.name(), domain.name(), rule.name(), colluders)
                })
            };
            row.push(of(Layout::Rotated).map_or_else(String::new, |t| format!("{:.3}", 100.0 * t.rms)));
            row.extend(layouts().map(|layout| of(layout).map_or_else(String::new, cell)));
        }
        table.row(row);
    }
    table
}

/// How many were named, T of the surest, and innocents that were.
fn cell(traced: &Traced) -> String {
    let wrong = match traced.wrong {
        0 => String::new(),
        wrong => format!(", {wrong} innocent"),
    };
    let best = traced.t.first().copied().unwrap_or(0.0);
    format!("{} of {} · {best:.1}{wrong}", traced.named, traced.colluders)
}

fn afterwards(model: &Model) -> Table {
    let mut table = Table::new(
        "The average of eight, and what happened to it afterwards",
        ["then", "named", "T of the surest", "best innocent"],
    );
    for traced in &model.afterwards {
        table.row([
            traced.attack.clone(),
            format!("{} of {}", traced.named, traced.colluders),
            traced.t.first().map_or_else(String::new, |t| format!("{t:.1}")),
            format!("{:.1}", traced.innocent),
        ]);
    }
    table
}

fn leaks(model: &Model) -> Table {
    let mut table = Table::new(
        "One copy among very many codes",
        [
            "suspect",
            "codes",
            "T₀",
            "p",
            "named",
            "innocents named",
            "seconds",
        ],
    );
    for Leak {
        suspect,
        margin,
        p,
        named,
        wrong,
        codes,
        seconds,
    } in &model.leaks
    {
        table.row([
            suspect.clone(),
            codes.to_string(),
            margin.map_or_else(|| "–".into(), |margin| format!("{margin:.1}")),
            p.map_or_else(|| "–".into(), |p| format!("{p:.0e}")),
            named.to_string(),
            wrong.to_string(),
            format!("{seconds:.0}"),
        ]);
    }
    table
}

fn long(models: &[Model]) -> Table {
    let header = "model | chips | layout | domain | attack | colluders | named | innocents_named | T_best | T_mean | T_innocent | rms";
    let mut table = Table::new("Traced", header.split(" | "));
    for model in models {
        for traced in model.traced.iter().chain(&model.charted).chain(&model.afterwards) {
            table.row([
                model.name.clone(),
                model.chips.to_string(),
                traced.layout.clone(),
                traced.domain.clone(),
                traced.attack.clone(),
                traced.colluders.to_string(),
                traced.named.to_string(),
                traced.wrong.to_string(),
                traced.t.first().map_or_else(String::new, |t| format!("{t:.2}")),
                format!("{:.2}", mean(traced)),
                format!("{:.2}", traced.innocent),
                format!("{:.3e}", traced.rms),
            ]);
        }
    }
    table
}

fn mean(traced: &Traced) -> f64 {
    traced.t.iter().sum::<f64>() / traced.t.len().max(1) as f64
}

/// The highest T of the chart, and its unit on the way there.
const HIGHEST: f64 = 90.0;
const STEP: usize = 15;

/// A panel a model: mean T of those who average, and what theory says where there is no noise.
fn chart(models: &[Model]) -> String {
    let mut drawn = String::new();
    for (i, model) in models.iter().enumerate() {
        let most = CHARTED[CHARTED.len() - 1] as f64;
        let across = |colluders: f64| colluders.ln() / most.ln();
        let up = |t: f64| t.clamp(0.0, HIGHEST) / HIGHEST;
        let room = [70.0 + 400.0 * i as f64, 60.0, 310.0, 260.0];
        let title = format!("{}: T of colluders, average", model.name);
        let mut panel = Panel::new(room, "colluders", &title);
        CHARTED
            .iter()
            .for_each(|&c| panel.tick_x(across(c as f64), &c.to_string()));
        (0..=HIGHEST as usize)
            .step_by(STEP)
            .for_each(|t| panel.tick_y(up(t as f64), &t.to_string()));
        let chips = model.chips as f64;
        for (row, (layout, colour)) in Layout::ALL.into_iter().zip([OURS, PLAIN, THEIRS]).enumerate() {
            let of = model
                .charted
                .iter()
                .filter(|traced| traced.layout == layout.name());
            panel.curve(of.map(|t| (across(t.colluders as f64), up(mean(t)))), colour);
            panel.legend(0.6, row, layout.name(), colour);
            let theory = |c: f64| match layout {
                // A codeword has as many bits as the power of two below its chips.
                Layout::Rotated => (chips / (chips / chips.log2().floor().exp2() + c - 1.0)).sqrt(),
                Layout::Plain => (chips / c).sqrt(),
                Layout::Tardos => std::f64::consts::FRAC_2_PI * chips.sqrt() / c,
            };
            for &c in &CHARTED {
                let (c, t) = (c as f64, theory(c as f64));
                let place = (across(c), up(t));
                panel.curve([(place.0 - 0.012, place.1), (place.0 + 0.012, place.1)], colour);
            }
        }
        drawn += panel.drawn();
    }
    svg_page(70.0 + 400.0 * models.len() as f64, 380.0, &drawn)
}

/// What two rules make of a model, beside the original.
pub(super) fn picture(mesh: &TriMesh) -> Result<()> {
    let job = Job::new(std::thread::available_parallelism().map_or(1, usize::from));
    let shop = Shop::open(mesh, &job)?;
    let of = |rule: Rule| shop.collude(Layout::Rotated, Domain::Coordinates, rule, 8, &job);
    let (average, negative) = (of(Rule::Average)?.0, of(Rule::RandomNegative)?.0);
    let picture = under_raking_light([mesh, &average, &negative]);
    let path = results::folder()?.join("tracing_attacks.png");
    results::write(&path, picture.to_png()?)
}
