//! Numbers with bounds, refused before any work is done.

use std::time::Duration;

use sigmark::mark::MOST_DISTORTION;

const MOST_THREADS: usize = 256;

pub(super) fn positive(text: &str) -> Result<f64, String> {
    real(text, "a number above 0", |x| x > 0.0 && x.is_finite())
}

pub(super) fn seconds(text: &str) -> Result<Duration, String> {
    let seconds = positive(text)?;
    Duration::try_from_secs_f64(seconds).map_err(|_| "give a number of seconds".into())
}

pub(super) fn between_0_and_1(text: &str) -> Result<f64, String> {
    real(text, "a number between 0 and 1", |x| x > 0.0 && x < 1.0)
}

pub(super) fn at_least_1(text: &str) -> Result<f64, String> {
    real(text, "a number from 1", |x| x >= 1.0 && x.is_finite())
}

pub(super) fn distortion(text: &str) -> Result<f64, String> {
    let what = format!("a number above 0 and at most {MOST_DISTORTION}");
    real(text, &what, |x| x > 0.0 && x <= MOST_DISTORTION)
}

pub(super) fn count(text: &str) -> Result<usize, String> {
    whole(text, "a whole number from 1", |n| n >= 1)
}

pub(super) fn threads(text: &str) -> Result<usize, String> {
    let what = format!("a whole number from 1 to {MOST_THREADS}");
    whole(text, &what, |n| (1..=MOST_THREADS).contains(&n))
}

fn real(text: &str, what: &str, fits: impl Fn(f64) -> bool) -> Result<f64, String> {
    let value = text.trim().parse().ok().filter(|&x| fits(x));
    value.ok_or_else(|| format!("give {what}"))
}

fn whole(text: &str, what: &str, fits: impl Fn(usize) -> bool) -> Result<usize, String> {
    let value = text.trim().parse().ok().filter(|&n| fits(n));
    value.ok_or_else(|| format!("give {what}"))
}
