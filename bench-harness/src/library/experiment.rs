use anyhow::Result;
use library::descriptor::places::{NUMBERS, probe};
use mesh::{Edges, TriMesh, Vec3};
use super::{draw::Draw, models::{Base, cut, variation}};

const N: usize = NUMBERS;

pub(super) fn boundary(mesh: &TriMesh) -> Vec<Vec3> {
    let edges = Edges::of(mesh);
    (0..edges.count()).filter(|&e| edges.triangles(e).len() == 1).map(|e| {
        let [a, b] = edges.vertices()[e].map(|v| mesh.point(v as usize));
        (a + b) * 0.5
    }).collect()
}

pub(super) fn run(bases: &[Base]) -> Result<()> {
    level(bases, 0)?;
    level(bases, 1)
}
fn level(bases: &[Base], level: usize) -> Result<()> {
    println!("LEVEL {level}");
    let mut within = [[0.0; N]; N];
    let mut total = [[0.0; N]; N];
    let mut mean = [0.0; N];
    let (mut nw, mut nt) = (0.0, 0.0);
    let mut all = Vec::new();
    let mut pairs = Vec::new();
    let mut seconds = 0.0;
    let mut runs = 0.0;
    for b in (0..bases.len()).step_by(2) {
        for k in 0..2 {
            let seed = (1000 + b * 4 + 49 * 17 * k) as u64;
            let mesh = variation(bases, b, seed);
            let (r, places, took) = probe(level, &mesh, None, 0);
            seconds += took; runs += 1.0;
            let mut draw = Draw::new(99, seed);
            let Some(crop) = cut(&mesh, draw.direction(), 0.35) else { continue };
            let root = r / [0.1, 0.2][level];
            let (_, queries, _) = probe(level, &crop, Some(root), 64);
            let border = boundary(&crop);
            let mut inside = 0;
            for (f, p) in &queries {
                let p = Vec3(*p);
                if border.iter().any(|&b| (b - p).squared() < r * r) { continue }
                inside += 1;
                let near = places.iter().min_by(|a, b| (Vec3(a.1) - p).squared().total_cmp(&(Vec3(b.1) - p).squared())).unwrap();
                pairs.push((*f, near.0));
            }
            println!("{} {}: inside {} of {}, root {:.3}", bases[b].name, k, inside, queries.len(), root);
            all.extend(places.iter().map(|p| p.0));
        }
    }
    println!("seconds per 1024 places {:.4}", seconds / runs);
    for f in &all { for i in 0..N { mean[i] += f[i]; } nt += 1.0; }
    mean.iter_mut().for_each(|m| *m /= nt);
    for f in &all { for i in 0..N { for j in 0..N { total[i][j] += (f[i]-mean[i])*(f[j]-mean[j]) / nt; } } }
    // robust: clip pairs
    for (a, b) in &pairs { for i in 0..N { for j in 0..N { within[i][j] += (a[i]-b[i])*(a[j]-b[j]); } } nw += 1.0; }
    for row in &mut within { for x in row.iter_mut() { *x /= nw; } }
    println!("pairs {nw}");
    for i in 0..N { println!("{i:2} mean {:.4} total {:.4} within {:.4} ratio {:.2}", mean[i], total[i][i].sqrt(), within[i][i].sqrt(), (total[i][i]/within[i][i]).sqrt()); }
    // LDA
    for i in 0..N { within[i][i] *= 1.0 + 1e-6; }
    let l = cholesky(&within);
    let mut m = [[0.0; N]; N];
    // m = L^-1 T L^-T
    let mut half = [[0.0; N]; N];
    for c in 0..N { let col: Vec<f64> = (0..N).map(|r| total[r][c]).collect(); let x = forward(&l, &col); for r in 0..N { half[r][c] = x[r]; } }
    for r in 0..N { let x = forward(&l, &half[r].to_vec()); for c in 0..N { m[r][c] = x[c]; } }
    let (values, vectors) = jacobi(m);
    let mut order: Vec<usize> = (0..N).collect();
    order.sort_by(|&a, &b| values[b].total_cmp(&values[a]));
    for &o in &order {
        // P = L^-T v
        let v: Vec<f64> = (0..N).map(|r| vectors[r][o]).collect();
        let p = backward(&l, &v);
        println!("lambda {:.2} [{}]", values[o].sqrt(), p.iter().map(|x| format!("{x:.3}")).collect::<Vec<_>>().join(", "));
    }
    println!("mean [{}]", mean.iter().map(|x| format!("{x:.4}")).collect::<Vec<_>>().join(", "));
    Ok(())
}

fn cholesky(a: &[[f64; N]; N]) -> [[f64; N]; N] {
    let mut l = [[0.0; N]; N];
    for i in 0..N { for j in 0..=i {
        let s: f64 = a[i][j] - (0..j).map(|k| l[i][k]*l[j][k]).sum::<f64>();
        l[i][j] = if i == j { s.max(1e-18).sqrt() } else { s / l[j][j] };
    } }
    l
}
fn forward(l: &[[f64; N]; N], b: &[f64]) -> Vec<f64> {
    let mut x = vec![0.0; N];
    for i in 0..N { x[i] = (b[i] - (0..i).map(|k| l[i][k]*x[k]).sum::<f64>()) / l[i][i]; }
    x
}
fn backward(l: &[[f64; N]; N], b: &[f64]) -> Vec<f64> {
    let mut x = vec![0.0; N];
    for i in (0..N).rev() { x[i] = (b[i] - (i+1..N).map(|k| l[k][i]*x[k]).sum::<f64>()) / l[i][i]; }
    x
}
fn jacobi(mut a: [[f64; N]; N]) -> (Vec<f64>, [[f64; N]; N]) {
    let mut v = [[0.0; N]; N];
    for i in 0..N { v[i][i] = 1.0; }
    for _ in 0..60 { for p in 0..N { for q in p+1..N {
        if a[p][q].abs() < 1e-14 { continue }
        let theta = (a[q][q]-a[p][p]) / (2.0*a[p][q]);
        let t = theta.signum() / (theta.abs() + (theta*theta+1.0).sqrt());
        let c = 1.0/(t*t+1.0).sqrt(); let s = t*c;
        for k in 0..N { let (x,y) = (a[k][p], a[k][q]); a[k][p] = c*x - s*y; a[k][q] = s*x + c*y; }
        for k in 0..N { let (x,y) = (a[p][k], a[q][k]); a[p][k] = c*x - s*y; a[q][k] = s*x + c*y; }
        for k in 0..N { let (x,y) = (v[k][p], v[k][q]); v[k][p] = c*x - s*y; v[k][q] = s*x + c*y; }
    } } }
    ((0..N).map(|i| a[i][i]).collect(), v)
}
