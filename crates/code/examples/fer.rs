//! Scratch.
use std::{sync::atomic::{AtomicUsize, Ordering}, time::Instant};
use code::{PolarCode, CheckNodes};
use rand_chacha::{ChaCha12Rng, rand_core::{Rng, SeedableRng}};

fn gauss(r: &mut impl Rng) -> f64 {
    let u = ((r.next_u64() >> 11) as f64 + 0.5) / (1u64 << 53) as f64;
    let v = (r.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
    (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
}

// args: bits length t0 frames lists design param gen minw exact threads
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let (bits, length, t0, frames): (usize, usize, f64, usize) = (a[1].parse().unwrap(), a[2].parse().unwrap(), a[3].parse().unwrap(), a[4].parse().unwrap());
    let lists: Vec<usize> = a[5].split(',').map(|s| s.parse().unwrap()).collect();
    let generator = u64::from_str_radix(&a[8], 16).unwrap();
    let exact = a[10] == "1";
    let threads: usize = a.get(11).map_or(2, |s| s.parse().unwrap());
    let code = { let base = PolarCode::new(bits, length).unwrap(); let pos: Vec<usize> = base.positions().collect(); let c = if generator == 0 { base } else { PolarCode::of_positions(length, &pos, generator).unwrap() }; if exact { c } else { c.with_check_nodes(CheckNodes::MinSum) } };
    let snr = t0 * t0 / length as f64;
    let next = AtomicUsize::new(0);
    let errs: Vec<AtomicUsize> = lists.iter().map(|_| AtomicUsize::new(0)).collect();
    let times: Vec<AtomicUsize> = lists.iter().map(|_| AtomicUsize::new(0)).collect();
    let runs: Vec<AtomicUsize> = lists.iter().map(|_| AtomicUsize::new(0)).collect();
    std::thread::scope(|s| for _ in 0..threads { s.spawn(|| loop {
        let f = next.fetch_add(1, Ordering::Relaxed);
        if f >= frames { break; }
        let mut rng = ChaCha12Rng::seed_from_u64(f as u64);
        let payload: Vec<bool> = (0..bits).map(|_| rng.next_u32() & 1 == 1).collect();
        let x = code.encode(&payload).unwrap();
        let sigma = 1.0 / snr.sqrt();
        let llr: Vec<f64> = x.iter().map(|&b| { let y = if b { -1.0 } else { 1.0 } + sigma * gauss(&mut rng); 2.0 * y * snr }).collect();
        for (k, &l) in lists.iter().enumerate() {
            let t = Instant::now();
            let c = code.decode(&llr, l).unwrap();
            times[k].fetch_add(t.elapsed().as_micros() as usize, Ordering::Relaxed);
            runs[k].fetch_add(1, Ordering::Relaxed);
            if c.into_iter().any(|c| c.payload == payload) { break; }
            errs[k].fetch_add(1, Ordering::Relaxed);
        }
    }); });
    print!("{} ", a[1..11].join(" "));
    for (k, l) in lists.iter().enumerate() {
        let e = errs[k].load(Ordering::Relaxed);
        print!("| L{l} {e} {:.2e} {:.2}ms ", e as f64 / frames as f64, times[k].load(Ordering::Relaxed) as f64 / 1000.0 / runs[k].load(Ordering::Relaxed).max(1) as f64);
    }
    println!();
}
