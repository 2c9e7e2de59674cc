//! Division into two and into many parts, at each effort and by each method; its phases one by one.
#![allow(missing_docs)]

use bench_harness::{edge_graph, surface};
use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use job::Job;
use partition::bench::{Division, coarsened};
use partition::{Effort, Graph, Method, Options, partition};

fn graph() -> Graph {
    edge_graph(&surface(40_000)).expect("the surface has few edges")
}

fn division(criterion: &mut Criterion) {
    let graph = graph();
    let with = |parts| Options {
        parts,
        ..Default::default()
    };
    let cases = [
        ("bisection", with(2)),
        ("64 parts", with(64)),
        (
            "64 parts, fast",
            Options {
                effort: Effort::Fast,
                ..with(64)
            },
        ),
        (
            "64 parts, high effort",
            Options {
                effort: Effort::High,
                ..with(64)
            },
        ),
        (
            "64 parts, recursive bisection",
            Options {
                method: Method::RecursiveBisection,
                ..with(64)
            },
        ),
        (
            "64 parts, connected",
            Options {
                contiguous: true,
                ..with(64)
            },
        ),
    ];
    let mut group = criterion.benchmark_group("division");
    group.sample_size(10);
    for (name, options) in &cases {
        group.bench_function(*name, |bencher| {
            bencher.iter(|| partition(&graph, options, &Job::default()));
        });
    }
    group.bench_function("64 parts, 2 threads", |bencher| {
        bencher.iter(|| partition(&graph, &with(64), &Job::new(2)));
    });
    group.finish();
}

/// Each phase as default effort runs it for 64 parts.
fn phases(criterion: &mut Criterion) {
    const PARTS: usize = 64;
    const COARSEST: usize = 30 * PARTS;
    let graph = graph();
    let mut group = criterion.benchmark_group("phase");
    group.sample_size(10);
    let (one, two) = (Job::default(), Job::new(2));
    let jobs = [&one, &two];
    for job in jobs {
        let id = BenchmarkId::new("coarsening, threads", job.threads());
        group.bench_function(id, |bencher| bencher.iter(|| coarsened(&graph, COARSEST, job)));
    }
    let coarsest = coarsened(&graph, COARSEST, &one).expect("one thread is always there");
    for job in jobs {
        let division = Division::initial(&graph, PARTS, job).expect("the options are sound");
        let id = |phase: &str| BenchmarkId::new(format!("{phase}, threads"), job.threads());
        group.bench_function(id("division of the coarsest graph"), |bencher| {
            bencher.iter(|| Division::initial(&coarsest, PARTS, job).map(drop));
        });
        group.bench_function(id("local search on the finest graph"), |bencher| {
            bencher.iter(|| division.search());
        });
        group.bench_function(id("flows on the finest graph"), |bencher| {
            bencher.iter(|| division.flows());
        });
    }
    let division = Division::initial(&graph, PARTS, &one).expect("the options are sound");
    group.bench_function("connection of the parts", |bencher| {
        bencher.iter(|| division.connect());
    });
    group.finish();
}

criterion_group!(benches, division, phases);
criterion_main!(benches);
