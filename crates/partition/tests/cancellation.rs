//! A caller's wish to stop is heard at every level of the multilevel scheme.
#![allow(clippy::unwrap_used)] // helpers outside of #[test] functions

use std::sync::{
    Arc, Mutex,
    atomic::{AtomicUsize, Ordering},
};

use job::{Job, JobError, Observer, Stage};
use partition::{Effort, Graph, Method, Options, PartitionError, partition};

fn grid(side: u32) -> Graph {
    let at = |x: u32, y: u32| y * side + x;
    let right = (1..side).flat_map(|x| (0..side).map(move |y| (at(x - 1, y), at(x, y), 1)));
    let up = (0..side).flat_map(|x| (1..side).map(move |y| (at(x, y - 1), at(x, y), 1)));
    Graph::from_edges((side * side) as usize, &right.chain(up).collect::<Vec<_>>()).unwrap()
}

/// Asks to stop when it is asked for the `last` time, and goes on counting.
struct Impatient {
    last: usize,
    asked: AtomicUsize,
    stages: Mutex<Vec<&'static str>>,
    fractions: Mutex<Vec<f64>>,
}

impl Impatient {
    fn at(last: usize) -> Arc<Self> {
        Arc::new(Self {
            last,
            asked: AtomicUsize::new(0),
            stages: Mutex::default(),
            fractions: Mutex::default(),
        })
    }

    fn asked(&self) -> usize {
        self.asked.load(Ordering::Relaxed)
    }
}

impl Observer for Impatient {
    fn stage(&self, stage: &dyn Stage) {
        self.stages.lock().unwrap().push(stage.name());
    }

    fn fraction(&self, done: f64) {
        self.fractions.lock().unwrap().push(done);
    }

    fn cancelled(&self) -> bool {
        self.asked.fetch_add(1, Ordering::Relaxed) + 1 >= self.last
    }
}

fn options() -> Vec<Options> {
    let with = |effort, method| Options {
        parts: 12,
        contiguous: true,
        effort,
        method,
        ..Default::default()
    };
    vec![
        with(Effort::Default, Method::Direct),
        with(Effort::High, Method::Direct),
        with(Effort::Default, Method::RecursiveBisection),
    ]
}

#[test]
fn a_partition_ends_soon_wherever_it_is_cancelled() {
    /// Tasks side by side, and a level's loops around each, may ask once more before all has come to its end.
    const MORE: usize = 40;
    let graph = grid(150);
    for options in options() {
        let patient = Impatient::at(usize::MAX);
        let job = Job::default().shared_with(patient.clone());
        partition(&graph, &options, &job).unwrap();
        let all = patient.asked();
        assert!(all > 1000, "asked only {all} times");
        for threads in [1, 2] {
            for moment in 1..=7 {
                let last = (all * moment / 7).max(1);
                let observer = Impatient::at(last);
                let job = Job::new(threads).shared_with(observer.clone());
                let result = partition(&graph, &options, &job);
                assert_eq!(result, Err(PartitionError::Job(JobError::Cancelled)));
                assert!(
                    observer.asked() <= last + MORE,
                    "{} after {last}",
                    observer.asked()
                );
            }
        }
    }
}

#[test]
fn stages_come_in_order_and_end_complete() {
    for options in options() {
        let observer = Impatient::at(usize::MAX);
        let job = Job::default().shared_with(observer.clone());
        partition(&grid(60), &options, &job).unwrap();
        let stages = observer.stages.lock().unwrap();
        let expected = match options.method {
            Method::Direct => &["coarsening", "division", "refinement", "connection"][..],
            _ => &["division", "refinement", "connection"],
        };
        assert_eq!(*stages, expected);
        let fractions = observer.fractions.lock().unwrap();
        assert!(fractions.iter().all(|fraction| (0.0..=1.0).contains(fraction)));
        assert_eq!(fractions.last(), Some(&1.0));
    }
}
