//! Tall matrices, #V rows, in blocks of eight columns.
//!
//! A block is row-major: its eight values of one row share a cache line. Triangular solves, inner products and linear
//! combinations all run along rows, eight columns at a time, and read each block once from front to back.
//! Benchmark: `spectrum` in bench-harness.

use faer::{Mat, MatRef};
use pulp::{Arch, Simd, WithSimd};

/// Columns in a block.
pub(crate) const LANES: usize = 8;

/// Rows that are worked on at a time, so that a chunk of each operand stays in the first-level cache.
const CHUNK: usize = 128;

/// Consecutive blocks of a tall matrix. Columns that a matrix does not need are zero.
#[derive(Clone)]
pub(crate) struct Tall {
    rows: usize,
    data: Vec<f64>,
}

impl Tall {
    /// Zeros, wide enough for `columns`.
    pub(crate) fn zeros(rows: usize, columns: usize) -> Self {
        Self {
            rows,
            data: vec![0.0; rows * columns.next_multiple_of(LANES)],
        }
    }

    pub(crate) fn rows(&self) -> usize {
        self.rows
    }

    /// Columns, counting those that pad the last block.
    pub(crate) fn columns(&self) -> usize {
        self.data.len().checked_div(self.rows).unwrap_or(0)
    }

    /// Columns `start` to `end`, multiples of [`LANES`], as blocks.
    pub(crate) fn blocks(&self, start: usize, end: usize) -> &[f64] {
        &self.data[self.rows * start..self.rows * end]
    }

    /// All blocks.
    pub(crate) fn all(&self) -> &[f64] {
        &self.data
    }

    /// All blocks.
    pub(crate) fn all_mut(&mut self) -> &mut [f64] {
        &mut self.data
    }

    /// Columns before `column`, a multiple of [`LANES`], and those from it.
    pub(crate) fn split_at_mut(&mut self, column: usize) -> (&mut [f64], &mut [f64]) {
        self.data.split_at_mut(self.rows * column)
    }

    /// The value in row i of column k.
    pub(crate) fn at(&self, i: usize, k: usize) -> f64 {
        self.data[(k / LANES * self.rows + i) * LANES + k % LANES]
    }

    /// The values of column k.
    pub(crate) fn column(&self, k: usize) -> impl Iterator<Item = f64> + '_ {
        self.blocks(k / LANES * LANES, k / LANES * LANES + LANES)
            .iter()
            .skip(k % LANES)
            .step_by(LANES)
            .copied()
    }

    /// The values of column k.
    pub(crate) fn column_mut(&mut self, k: usize) -> impl Iterator<Item = &mut f64> + '_ {
        let block = self.rows * (k / LANES * LANES);
        self.data[block..block + self.rows * LANES]
            .iter_mut()
            .skip(k % LANES)
            .step_by(LANES)
    }

    /// Puts the blocks of another matrix of the same height behind these.
    pub(crate) fn append(&mut self, other: &Tall) {
        self.data.extend_from_slice(&other.data);
    }
}

/// VᵀW of blocks of the given height.
pub(crate) fn inner(rows: usize, v: &[f64], w: &[f64]) -> Mat<f64> {
    let (p, q) = (v.len() / rows, w.len() / rows);
    let mut product = Mat::zeros(p, q);
    if p > 0 && q > 0 {
        let mut tiles = vec![[[0.0; LANES]; LANES]; p / LANES * (q / LANES)];
        let tiles_mut = &mut tiles;
        Arch::new().dispatch(InRows(Inner {
            rows,
            v,
            w,
            tiles: tiles_mut,
        }));
        for (t, tile) in tiles.iter().enumerate() {
            let (i, j) = (t / (q / LANES) * LANES, t % (q / LANES) * LANES);
            for (k, row) in tile.iter().enumerate() {
                for (l, &value) in row.iter().enumerate() {
                    product[(i + k, j + l)] = value;
                }
            }
        }
    }
    product
}

/// W ← W + V C.
pub(crate) fn add(rows: usize, w: &mut [f64], v: &[f64], c: MatRef<'_, f64>) {
    combine_blocks(rows, w, v, c, false);
}

/// W ← V C, for V of at least one column. W is not read: pages of fresh memory that are read first are faulted in twice.
pub(crate) fn combination(rows: usize, w: &mut [f64], v: &[f64], c: MatRef<'_, f64>) {
    combine_blocks(rows, w, v, c, true);
}

fn combine_blocks(rows: usize, w: &mut [f64], v: &[f64], c: MatRef<'_, f64>, replace: bool) {
    let (p, q) = (v.len() / rows, w.len() / rows);
    if p > 0 && q > 0 {
        let tile = |t: usize| {
            let (i, j) = (t / (q / LANES) * LANES, t % (q / LANES) * LANES);
            std::array::from_fn(|k| std::array::from_fn(|l| c[(i + k, j + l)]))
        };
        let tiles: Vec<_> = (0..p / LANES * (q / LANES)).map(tile).collect();
        let tiles = &tiles;
        Arch::new().dispatch(InRows(Add {
            rows,
            v,
            w,
            tiles,
            replace,
        }));
    }
}

/// X ← X C, for C as high as wide.
pub(crate) fn multiply(rows: usize, x: &mut [f64], c: MatRef<'_, f64>) {
    let width = x.len() / rows;
    let mut before = vec![0.0; CHUNK * width];
    for start in (0..rows).step_by(CHUNK) {
        let height = CHUNK.min(rows - start);
        let before = &mut before[..height * width];
        let chunks = before.chunks_exact_mut(height * LANES);
        for (saved, block) in chunks.zip(x.chunks_exact_mut(rows * LANES)) {
            saved.copy_from_slice(&block[start * LANES..(start + height) * LANES]);
        }
        for (j, block) in x.chunks_exact_mut(rows * LANES).enumerate() {
            let target = &mut block[start * LANES..(start + height) * LANES];
            combination(height, target, before, c.subcols(j * LANES, LANES));
        }
    }
}

/// A piece of a coefficient matrix: a block of V by a block of W.
type Tile = [[f64; LANES]; LANES];

/// What is done with vectors of which R make a row of a block.
trait Kernel {
    fn run<S: Simd, const R: usize>(self, simd: S);
}

struct InRows<K>(K);

impl<K: Kernel> WithSimd for InRows<K> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        match LANES / S::F64_LANES {
            1 => self.0.run::<S, 1>(simd),
            2 => self.0.run::<S, 2>(simd),
            4 => self.0.run::<S, 4>(simd),
            _ => self.0.run::<S, 8>(simd),
        }
    }
}

struct Inner<'a> {
    rows: usize,
    v: &'a [f64],
    w: &'a [f64],
    tiles: &'a mut [Tile],
}

impl Kernel for Inner<'_> {
    #[inline(always)]
    fn run<S: Simd, const R: usize>(self, simd: S) {
        let block = self.rows * LANES;
        let across = self.w.len() / block;
        for start in (0..block).step_by(CHUNK * LANES) {
            let chunk = start..(start + CHUNK * LANES).min(block);
            for (i, v) in self.v.chunks_exact(block).enumerate() {
                for (j, w) in self.w.chunks_exact(block).enumerate() {
                    let (w, _) = S::as_simd_f64s(&w[chunk.clone()]);
                    let (w, _) = w.as_chunks::<R>();
                    let (v, _) = v[chunk.clone()].as_chunks::<LANES>();
                    let tile = &mut self.tiles[i * across + j];
                    if R == 1 {
                        accumulate::<S, R, 8>(simd, v, w, 0, tile);
                    } else {
                        accumulate::<S, R, 4>(simd, v, w, 0, tile);
                        accumulate::<S, R, 4>(simd, v, w, 4, tile);
                    }
                }
            }
        }
    }
}

/// tile[k] += Σ_rows v[k] w for K rows k of the tile, as many as fit into registers.
#[inline(always)]
fn accumulate<S: Simd, const R: usize, const K: usize>(
    simd: S,
    v: &[[f64; LANES]],
    w: &[[S::f64s; R]],
    first: usize,
    tile: &mut Tile,
) {
    let mut sums = [[simd.splat_f64s(0.0); R]; K];
    for (v, w) in v.iter().zip(w) {
        for k in 0..K {
            let factor = simd.splat_f64s(v[first + k]);
            for r in 0..R {
                sums[k][r] = simd.mul_add_e_f64s(factor, w[r], sums[k][r]);
            }
        }
    }
    for k in 0..K {
        let (target, _) = S::as_mut_simd_f64s(&mut tile[first + k]);
        for r in 0..R {
            target[r] = simd.add_f64s(target[r], sums[k][r]);
        }
    }
}

struct Add<'a> {
    rows: usize,
    v: &'a [f64],
    w: &'a mut [f64],
    tiles: &'a [Tile],
    /// Whether what is in W gives way.
    replace: bool,
}

impl Kernel for Add<'_> {
    #[inline(always)]
    fn run<S: Simd, const R: usize>(self, simd: S) {
        let block = self.rows * LANES;
        let across = self.w.len() / block;
        for start in (0..block).step_by(CHUNK * LANES) {
            let chunk = start..(start + CHUNK * LANES).min(block);
            for (i, v) in self.v.chunks_exact(block).enumerate() {
                for (j, w) in self.w.chunks_exact_mut(block).enumerate() {
                    let (w, _) = S::as_mut_simd_f64s(&mut w[chunk.clone()]);
                    let (w, _) = w.as_chunks_mut::<R>();
                    let (v, _) = v[chunk.clone()].as_chunks::<LANES>();
                    let tile = &self.tiles[i * across + j];
                    let fresh = self.replace && i == 0;
                    match (R == 1, fresh) {
                        (true, false) => combine::<S, R, 8, false>(simd, v, w, 0, tile),
                        (true, true) => combine::<S, R, 8, true>(simd, v, w, 0, tile),
                        (false, false) => {
                            combine::<S, R, 4, false>(simd, v, w, 0, tile);
                            combine::<S, R, 4, false>(simd, v, w, 4, tile);
                        }
                        (false, true) => {
                            combine::<S, R, 4, true>(simd, v, w, 0, tile);
                            combine::<S, R, 4, false>(simd, v, w, 4, tile);
                        }
                    }
                }
            }
        }
    }
}

/// w += Σ_k v[k] tile[k] for K rows k of the tile; w = if FRESH.
#[inline(always)]
fn combine<S: Simd, const R: usize, const K: usize, const FRESH: bool>(
    simd: S,
    v: &[[f64; LANES]],
    w: &mut [[S::f64s; R]],
    first: usize,
    tile: &Tile,
) {
    let mut coefficients = [[simd.splat_f64s(0.0); R]; K];
    for k in 0..K {
        coefficients[k].copy_from_slice(S::as_simd_f64s(&tile[first + k]).0);
    }
    for (v, target) in v.iter().zip(w) {
        // Two sums halve the chain of dependent additions.
        let zero = [simd.splat_f64s(0.0); R];
        let (mut even, mut odd) = (if FRESH { zero } else { *target }, zero);
        for k in (0..K).step_by(2) {
            let factors = [simd.splat_f64s(v[first + k]), simd.splat_f64s(v[first + k + 1])];
            for r in 0..R {
                even[r] = simd.mul_add_e_f64s(factors[0], coefficients[k][r], even[r]);
                odd[r] = simd.mul_add_e_f64s(factors[1], coefficients[k + 1][r], odd[r]);
            }
        }
        for r in 0..R {
            target[r] = simd.add_f64s(even[r], odd[r]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dense;
    use crate::noise::Noise;

    fn noise(rows: usize, columns: usize, stream: u64) -> (Tall, Mat<f64>) {
        let mut noise = Noise::new(7, stream);
        let mut tall = Tall::zeros(rows, columns);
        tall.all_mut().iter_mut().for_each(|x| *x = noise.next());
        let mut dense = Mat::zeros(rows, columns);
        for k in 0..columns {
            for (i, x) in tall.column(k).enumerate() {
                dense[(i, k)] = x;
            }
        }
        (tall, dense)
    }

    #[test]
    fn blocked_products_agree_with_dense_ones_for_any_number_of_rows() {
        for rows in [1, 7, 127, 128, 129, 1000] {
            let ((v, dense_v), (mut w, mut dense_w)) = (noise(rows, 24, 1), noise(rows, 16, 2));
            let c = inner(rows, v.all(), w.all());
            let expected = dense::product(dense_v.transpose(), dense_w.as_ref());
            assert!((&c - &expected).norm_max() < 1e-12 * rows as f64);
            add(rows, w.all_mut(), v.all(), c.as_ref());
            dense::add_product(dense_w.as_mut(), 1.0, dense_v.as_ref(), expected.as_ref());
            for k in 0..16 {
                let errors = w.column(k).enumerate().map(|(i, x)| (x - dense_w[(i, k)]).abs());
                assert!(errors.fold(0.0, f64::max) < 1e-11 * rows as f64);
            }
        }
    }

    #[test]
    fn a_matrix_is_multiplied_in_place() {
        for (rows, columns) in [(1, 8), (129, 8), (300, 24)] {
            let ((mut x, before), (_, c)) = (noise(rows, columns, 5), noise(columns, columns, 6));
            multiply(rows, x.all_mut(), c.as_ref());
            let expected = dense::product(before.as_ref(), c.as_ref());
            for k in 0..columns {
                let errors = x.column(k).enumerate().map(|(i, x)| (x - expected[(i, k)]).abs());
                assert!(errors.fold(0.0, f64::max) < 1e-12);
            }
        }
    }

    #[test]
    fn scalar_kernels_agree_with_vector_kernels() {
        let rows = 300;
        let ((v, _), (mut w, _)) = (noise(rows, 16, 3), noise(rows, 8, 4));
        let c = inner(rows, v.all(), w.all());
        let mut tiles = vec![[[0.0; LANES]; LANES]; 2];
        InRows(Inner {
            rows,
            v: v.all(),
            w: w.all(),
            tiles: &mut tiles,
        })
        .with_simd(pulp::Scalar::new());
        for (t, tile) in tiles.iter().enumerate() {
            for k in 0..LANES {
                assert!((0..LANES).all(|l| (tile[k][l] - c[(t * LANES + k, l)]).abs() < 1e-11));
            }
        }
        let mut scalar = w.clone();
        InRows(Add {
            rows,
            v: v.all(),
            w: scalar.all_mut(),
            tiles: &tiles,
            replace: false,
        })
        .with_simd(pulp::Scalar::new());
        add(rows, w.all_mut(), v.all(), c.as_ref());
        assert!(
            scalar
                .all()
                .iter()
                .zip(w.all())
                .all(|(a, b)| (a - b).abs() < 1e-9)
        );
    }
}
