fn main() {
    let p = std::env::args().nth(1).unwrap();
    let size = std::fs::metadata(&p).unwrap().len();
    let t = std::time::Instant::now();
    let r = mesh_io::Asset::open(&p);
    let e = t.elapsed();
    let s = std::fs::read_to_string("/proc/self/status").unwrap();
    let k: u64 = s.lines().find(|l| l.starts_with("VmHWM")).unwrap().split_whitespace().nth(1).unwrap().parse().unwrap();
    println!("{p}: {} MiB, peak {} MiB = {:.1}x, {e:?}, {}", size >> 20, k >> 10, k as f64 * 1024. / size as f64, match r { Ok(a) => format!("{a:?}"), Err(e) => { let m = e.to_string(); m.chars().take(160).collect() } });
}
