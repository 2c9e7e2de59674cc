use std::{
    any::Any,
    fmt::Debug,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
};

/// What a computation is doing. Each crate has one enum of these.
pub trait Stage: Any + Debug {
    /// One lower-case word, as JSON reports name it. No other stage of the crate has it.
    fn name(&self) -> &'static str;
}

/// Watches a computation, possibly from several threads at once, and may end it. Every method has a default that does nothing.
pub trait Observer: Send + Sync {
    /// A stage begins; the one before it is over.
    fn stage(&self, _stage: &dyn Stage) {}

    /// How much of the present stage is done, from 0 to 1.
    fn fraction(&self, _done: f64) {}

    /// Asked in every loop. Answer `true` to make the computation end soon with [`JobError::Cancelled`](crate::JobError::Cancelled).
    fn cancelled(&self) -> bool {
        false
    }
}

/// Who is told what.
#[derive(Clone)]
pub(crate) enum Audience {
    Nobody,
    Observer(Arc<dyn Observer>),
    /// Asked whether to go on, and told nothing.
    Quiet(Arc<dyn Observer>),
    /// Told how much is done of one stage alone.
    Within {
        observer: Arc<dyn Observer>,
        shown: &'static str,
        /// Whether that stage is under way.
        showing: Arc<AtomicBool>,
    },
}

impl Audience {
    pub(crate) fn within(&self, shown: &'static str) -> Self {
        match self {
            Self::Observer(observer) => Self::Within {
                observer: Arc::clone(observer),
                shown,
                showing: Arc::default(),
            },
            // A step of a step: only the outer one's fraction means something to the observer.
            Self::Within { .. } => self.quiet(),
            Self::Nobody | Self::Quiet(_) => self.clone(),
        }
    }

    pub(crate) fn quiet(&self) -> Self {
        match self.observer() {
            Some(observer) => Self::Quiet(Arc::clone(observer)),
            None => Self::Nobody,
        }
    }

    pub(crate) fn stage(&self, stage: &dyn Stage) {
        match self {
            Self::Observer(observer) => observer.stage(stage),
            Self::Within { shown, showing, .. } => showing.store(stage.name() == *shown, Ordering::Relaxed),
            Self::Nobody | Self::Quiet(_) => {}
        }
    }

    pub(crate) fn fraction(&self, done: f64) {
        match self {
            Self::Observer(observer) => observer.fraction(done),
            Self::Within {
                observer, showing, ..
            } if showing.load(Ordering::Relaxed) => observer.fraction(done),
            _ => {}
        }
    }

    pub(crate) fn cancelled(&self) -> bool {
        self.observer().is_some_and(|observer| observer.cancelled())
    }

    fn observer(&self) -> Option<&Arc<dyn Observer>> {
        match self {
            Self::Nobody => None,
            Self::Observer(observer) | Self::Quiet(observer) | Self::Within { observer, .. } => {
                Some(observer)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Job, JobError};
    use std::sync::Mutex;

    #[derive(Clone, Copy, Debug)]
    enum Outer {
        Work,
    }

    #[derive(Clone, Copy, Debug)]
    enum Inner {
        Preparation,
        Solving,
    }

    impl Stage for Outer {
        fn name(&self) -> &'static str {
            "work"
        }
    }

    impl Stage for Inner {
        fn name(&self) -> &'static str {
            match self {
                Self::Preparation => "preparation",
                Self::Solving => "solving",
            }
        }
    }

    #[derive(Default)]
    struct Diary(Mutex<Vec<String>>, AtomicBool);

    impl Observer for Diary {
        fn stage(&self, stage: &dyn Stage) {
            self.0.lock().unwrap().push(stage.name().into());
        }

        fn fraction(&self, done: f64) {
            self.0.lock().unwrap().push(done.to_string());
        }

        fn cancelled(&self) -> bool {
            self.1.load(Ordering::Relaxed)
        }
    }

    fn inner(job: &Job) -> Result<(), JobError> {
        job.begin(Inner::Preparation)?;
        job.progress(0.25)?;
        job.begin(Inner::Solving)?;
        job.progress(0.5)
    }

    #[test]
    fn of_a_step_only_the_progress_of_the_chosen_stage_is_seen() {
        let diary = Arc::new(Diary::default());
        let job = Job::default().shared_with(diary.clone());
        job.begin(Outer::Work).unwrap();
        inner(&job.within(Inner::Solving)).unwrap();
        inner(&job.quiet()).unwrap();
        inner(&job.within(Inner::Solving).within(Inner::Solving)).unwrap();
        assert_eq!(*diary.0.lock().unwrap(), ["work", "0.5"]);
    }

    #[test]
    fn parts_of_a_stage_are_fractions_of_the_whole() {
        let diary = Arc::new(Diary::default());
        let job = Job::default().shared_with(diary.clone());
        let second_half = job.part(0.5, 1.0);
        second_half.progress(0.5).unwrap();
        second_half.part(0.5, 1.0).progress(0.5).unwrap();
        inner(&job.part(0.0, 0.5).within(Inner::Solving)).unwrap();
        assert_eq!(*diary.0.lock().unwrap(), ["0.75", "0.875", "0.25"]);
    }

    #[test]
    fn every_part_of_a_job_can_be_cancelled() {
        let diary = Arc::new(Diary::default());
        let job = Job::new(2).shared_with(diary.clone());
        let parts = [job.clone(), job.quiet(), job.alone(), job.within(Inner::Solving)];
        assert!(parts.iter().all(|part| inner(part).is_ok()));
        diary.1.store(true, Ordering::Relaxed);
        assert!(parts.iter().all(|part| inner(part) == Err(JobError::Cancelled)));
    }
}
