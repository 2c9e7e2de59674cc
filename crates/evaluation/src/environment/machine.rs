//! On what the figures were measured.

use std::process::Command;

/// Processor, cores, compiler: one line for the foot of a table.
pub fn description() -> String {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let rustc = Command::new("rustc").arg("--version").output();
    let rustc = rustc.map(|said| String::from_utf8_lossy(&said.stdout).into_owned());
    let rustc = rustc.unwrap_or_default();
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

/// The most memory that this process held at a time since it began or [`forget_peak_memory`] was called, in bytes; `None`
/// where the system does not say.
pub fn peak_memory() -> Option<u64> {
    bytes("/proc/self/status", "VmHWM:")
}

/// As [`peak_memory`], of another process that runs.
pub fn peak_memory_of(process: u32) -> Option<u64> {
    bytes(&format!("/proc/{process}/status"), "VmHWM:")
}

/// User and system time of the programs that this process began and that have ended, in seconds, together with those that they waited
/// for; `None` where the system does not say. The difference of two calls is what ended in between.
pub fn cpu_of_children() -> Option<f64> {
    /// Linux tells programs these times in hundredths of a second, whatever it counts in itself.
    const TICKS: f64 = 100.0;
    let text = std::fs::read_to_string("/proc/self/stat").ok()?;
    // The second field is a name in brackets, which may hold anything; these are the sixteenth and the seventeenth.
    let (_, from_third) = text.rsplit_once(')')?;
    let ticks = from_third.split_whitespace().skip(13).take(2);
    let ticks: Vec<f64> = ticks.map(str::parse).collect::<Result<_, _>>().ok()?;
    (ticks.len() == 2).then(|| ticks.iter().sum::<f64>() / TICKS)
}

/// The memory that programs can still have, in bytes; `None` where the system does not say.
pub fn available_memory() -> Option<u64> {
    bytes("/proc/meminfo", "MemAvailable:")
}

/// An amount of memory that Linux tells by this name, in KiB.
fn bytes(file: &str, name: &str) -> Option<u64> {
    let text = std::fs::read_to_string(file).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(1024 * kibibytes)
}

/// Lets [`peak_memory`] count anew from what is held now, where the system can.
pub fn forget_peak_memory() {
    // Elsewhere than on Linux there is nothing to forget.
    let _ = std::fs::write("/proc/self/clear_refs", "5");
}

/// How much other work the machine had: timings on a busy machine mean less.
pub fn load() -> String {
    let Ok(text) = std::fs::read_to_string("/proc/loadavg") else {
        return "load not known".into();
    };
    let averages: Vec<&str> = text.split_whitespace().take(3).collect();
    format!(
        "load average over 1, 5 and 15 minutes at the end: {}",
        averages.join(", ")
    )
}
