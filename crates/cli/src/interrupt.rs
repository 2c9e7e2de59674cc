//! Ctrl-C: computations end, files are whole or absent, and the exit code says what happened.
//!
//! Jobs ask [`is_asked_for`] in their loops, so that work ends by returning, and temporary files go away. What asks nobody (reading a large
//! file, packing one) is left behind after a moment, but never while a file is being [written](writing).

use std::{
    process,
    sync::{
        Once, PoisonError, RwLock, RwLockReadGuard,
        atomic::{AtomicBool, Ordering},
    },
    thread,
    time::Duration,
};

use crate::report;

/// As shells have it: 128 and the number of the signal.
pub(crate) const EXIT_CODE: u8 = 130;

/// How long work may take to end by itself. A second Ctrl-C does not wait.
const PATIENCE: Duration = Duration::from_secs(1);

static ASKED: AtomicBool = AtomicBool::new(false);
/// Many may write at once; the program ends when none does.
static WRITING: RwLock<()> = RwLock::new(());

/// From now on Ctrl-C ends work in order. Before, it ends the program as it always does: a prompt for a passphrase gets its terminal back from
/// the shell only so.
pub(crate) fn watch() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        // Where signals can't be handled, Ctrl-C ends the program at once, as ever.
        let _ = ctrlc::set_handler(stop);
    });
}

/// Whether Ctrl-C was pressed.
pub(crate) fn is_asked_for() -> bool {
    ASKED.load(Ordering::Relaxed)
}

/// Keeps the program alive while files are written that have to be whole, or that belong together. Who holds this does not ask for it again.
pub(crate) fn writing() -> RwLockReadGuard<'static, ()> {
    WRITING.read().unwrap_or_else(PoisonError::into_inner)
}

/// Says once that work was interrupted.
pub(crate) fn say() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| report::failure(&anyhow::anyhow!("interrupted; no file is half-written")));
}

fn stop() {
    if ASKED.swap(true, Ordering::Relaxed) {
        leave();
    }
    thread::spawn(|| {
        thread::sleep(PATIENCE);
        leave();
    });
}

/// Ends the program between two files.
fn leave() {
    let _whole = WRITING.write().unwrap_or_else(PoisonError::into_inner);
    say();
    process::exit(i32::from(EXIT_CODE));
}
