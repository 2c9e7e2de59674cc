//! On what the figures were measured.

use std::process::Command;

use crate::process;

/// Processor, cores, compiler: one line for the foot of a table.
pub(crate) fn description() -> String {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let rustc = process::output(Command::new("rustc").arg("--version")).unwrap_or_default();
    format!("{}, {cores} cores; {}", processor(), rustc.trim())
}

fn processor() -> String {
    let linux = std::fs::read_to_string("/proc/cpuinfo").ok();
    let model = linux.as_deref().and_then(|text| {
        let line = text.lines().find(|line| line.starts_with("model name"))?;
        line.split_once(':').map(|(_, name)| name.trim().to_string())
    });
    model.unwrap_or_else(|| format!("{} {}", std::env::consts::OS, std::env::consts::ARCH))
}

/// How much other work the machine had: timings on a busy machine mean less.
pub(crate) fn load() -> String {
    let linux = std::fs::read_to_string("/proc/loadavg").ok();
    let words: Option<Vec<String>> =
        linux.map(|text| text.split_whitespace().take(3).map(String::from).collect());
    words.map_or_else(
        || "load not known".into(),
        |words| {
            format!(
                "load average over 1, 5 and 15 minutes at the end: {}",
                words.join(", ")
            )
        },
    )
}

/// Runs `work`; answers also with the megabytes by which the process's memory grew at most, where the system tells.
pub(crate) fn peak_growth<T>(work: impl FnOnce() -> T) -> (T, Option<f64>) {
    let kilobytes = |key: &str| -> Option<f64> {
        let status = std::fs::read_to_string("/proc/self/status").ok()?;
        let line = status.lines().find_map(|line| line.strip_prefix(key))?;
        line.split_whitespace().next()?.parse().ok()
    };
    // Linux: the peak begins anew from the memory of this moment.
    let reset = std::fs::write("/proc/self/clear_refs", "5").is_ok();
    let before = kilobytes("VmRSS:");
    let result = work();
    let peak = kilobytes("VmHWM:").filter(|_| reset);
    let growth = before
        .zip(peak)
        .map(|(before, peak)| (peak - before).max(0.0) / 1024.0);
    (result, growth)
}
