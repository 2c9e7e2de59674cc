//! The triangular solves of L E Lᵀ X = B for many right-hand sides at once.
//!
//! Right-hand sides go in groups of eight, one group's row in one cache line, so that every entry of L is loaded once
//! for eight of them, rows are gathered without scattering over columns, and the inner loops run across the group.
//! L is kept by supernodes (columns of equal structure), each row-major and negated: its unit lower triangle, then the
//! rows below. All groups pass through one supernode before the next, while its entries are in the cache.
//! Benchmark: `spectrum` in bench-harness.

use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;
use pulp::{Arch, Simd, WithSimd};

use super::tall::LANES;

struct Supernode {
    first_column: usize,
    width: usize,
    /// Where its rows below the triangle begin in `Packed::rows`.
    first_row: usize,
    height: usize,
    /// Where its entries begin in `Packed::entries`: width² of the triangle, then height × width.
    first_entry: usize,
}

/// −L by supernodes and E⁻¹.
pub(crate) struct Packed {
    size: usize,
    supernodes: Vec<Supernode>,
    rows: Vec<u32>,
    entries: Vec<f64>,
    inverse_pivots: Vec<f64>,
}

impl Packed {
    /// Repacks a numeric factor, column-major by supernodes with E on the diagonal, in the memory that it has.
    pub(crate) fn new(structure: &SymbolicSupernodalCholesky<u32>, values: Vec<f64>) -> Self {
        let size = structure.nrows();
        let mut packed = Self {
            size,
            supernodes: Vec::with_capacity(structure.n_supernodes()),
            rows: Vec::new(),
            entries: values,
            inverse_pivots: Vec::with_capacity(size),
        };
        let mut columns = Vec::new();
        for s in 0..structure.n_supernodes() {
            let pattern = structure.supernode(s).pattern();
            let (begin, end) = (
                structure.supernode_begin()[s] as usize,
                structure.supernode_end()[s] as usize,
            );
            let (width, height) = (end - begin, pattern.len());
            let first_entry = structure.col_ptr_for_val()[s] as usize;
            packed.supernodes.push(Supernode {
                first_column: begin,
                width,
                first_row: packed.rows.len(),
                height,
                first_entry,
            });
            packed.rows.extend_from_slice(pattern);
            let column_length = width + height;
            let entries = &mut packed.entries[first_entry..first_entry + column_length * width];
            columns.clear();
            columns.extend_from_slice(entries);
            for (i, row) in entries.chunks_exact_mut(width).enumerate() {
                for (k, entry) in row.iter_mut().enumerate() {
                    *entry = -columns[k * column_length + i];
                }
            }
            packed
                .inverse_pivots
                .extend((0..width).map(|k| columns[k * (column_length + 1)].recip()));
        }
        packed
    }

    /// The diagonal of E, whose signs are those of the eigenvalues' distances from the shift.
    pub(crate) fn inverse_pivots(&self) -> &[f64] {
        &self.inverse_pivots
    }

    /// Solves in place. `x` holds groups one after another, each #V rows of [`LANES`] values.
    pub(crate) fn solve(&self, x: &mut [f64]) {
        Arch::new().dispatch(Solve { factor: self, x });
    }
}

struct Solve<'a> {
    factor: &'a Packed,
    x: &'a mut [f64],
}

impl WithSimd for Solve<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let factor = self.factor;
        let registers = LANES / S::F64_LANES;
        let group = factor.size * registers;
        let (x, _) = S::as_mut_simd_f64s(self.x);
        for node in &factor.supernodes {
            let parts = factor.parts(node);
            for x in x.chunks_exact_mut(group) {
                for register in 0..registers {
                    forward(simd, parts, x, registers, register);
                }
            }
        }
        for node in factor.supernodes.iter().rev() {
            let parts = factor.parts(node);
            for x in x.chunks_exact_mut(group) {
                for register in 0..registers {
                    backward(simd, parts, x, registers, register);
                }
            }
        }
    }
}

/// What a supernode has of the factor.
#[derive(Clone, Copy)]
struct Parts<'a> {
    first_column: usize,
    width: usize,
    triangle: &'a [f64],
    below: &'a [f64],
    rows: &'a [u32],
    inverse_pivots: &'a [f64],
}

impl Packed {
    #[inline(always)]
    fn parts(&self, node: &Supernode) -> Parts<'_> {
        let (first_column, width) = (node.first_column, node.width);
        let square = width * width;
        let entries = &self.entries[node.first_entry..][..square + node.height * width];
        let (triangle, below) = entries.split_at(square);
        Parts {
            first_column,
            width,
            triangle,
            below,
            rows: &self.rows[node.first_row..][..node.height],
            inverse_pivots: &self.inverse_pivots[first_column..][..width],
        }
    }
}

/// x_top ← L_top⁻¹ x_top, x_rows ← x_rows − L_below x_top.
#[inline(always)]
fn forward<S: Simd>(simd: S, node: Parts<'_>, x: &mut [S::f64s], registers: usize, register: usize) {
    let width = node.width;
    let end = (node.first_column + width) * registers;
    let (head, tail) = x.split_at_mut(end);
    let top = &mut head[node.first_column * registers..];
    for i in 1..width {
        let row = &node.triangle[i * width..][..i];
        let mut sum = top[i * registers + register];
        for (k, &l) in row.iter().enumerate() {
            sum = simd.mul_add_e_f64s(simd.splat_f64s(l), top[k * registers + register], sum);
        }
        top[i * registers + register] = sum;
    }
    let at = |row: u32| row as usize * registers + register - end;
    let mut quads = node.rows.chunks_exact(4);
    let mut quad_entries = node.below.chunks_exact(4 * width);
    for (quad, l) in (&mut quads).zip(&mut quad_entries) {
        let [a, b, c, d] = [at(quad[0]), at(quad[1]), at(quad[2]), at(quad[3])];
        let mut sums = [tail[a], tail[b], tail[c], tail[d]];
        let (l0, l) = l.split_at(width);
        let (l1, l) = l.split_at(width);
        let (l2, l3) = l.split_at(width);
        for ((((x, &l0), &l1), &l2), &l3) in top[register..]
            .iter()
            .step_by(registers)
            .zip(l0)
            .zip(l1)
            .zip(l2)
            .zip(l3)
        {
            sums[0] = simd.mul_add_e_f64s(simd.splat_f64s(l0), *x, sums[0]);
            sums[1] = simd.mul_add_e_f64s(simd.splat_f64s(l1), *x, sums[1]);
            sums[2] = simd.mul_add_e_f64s(simd.splat_f64s(l2), *x, sums[2]);
            sums[3] = simd.mul_add_e_f64s(simd.splat_f64s(l3), *x, sums[3]);
        }
        [tail[a], tail[b], tail[c], tail[d]] = sums;
    }
    for (&row, l) in quads
        .remainder()
        .iter()
        .zip(quad_entries.remainder().chunks_exact(width))
    {
        let mut sum = tail[at(row)];
        for (x, &l) in top[register..].iter().step_by(registers).zip(l) {
            sum = simd.mul_add_e_f64s(simd.splat_f64s(l), *x, sum);
        }
        tail[at(row)] = sum;
    }
}

/// x_top ← L_topᵀ⁻¹ (E⁻¹ x_top − L_belowᵀ x_rows).
#[inline(always)]
fn backward<S: Simd>(simd: S, node: Parts<'_>, x: &mut [S::f64s], registers: usize, register: usize) {
    let width = node.width;
    let end = (node.first_column + width) * registers;
    let (head, tail) = x.split_at_mut(end);
    let top = &mut head[node.first_column * registers..];
    for (x, &e) in top[register..]
        .iter_mut()
        .step_by(registers)
        .zip(node.inverse_pivots)
    {
        *x = simd.mul_f64s(*x, simd.splat_f64s(e));
    }
    let at = |row: u32| row as usize * registers + register - end;
    let mut quads = node.rows.chunks_exact(4);
    let mut quad_entries = node.below.chunks_exact(4 * width);
    for (quad, l) in (&mut quads).zip(&mut quad_entries) {
        let [a, b, c, d] = [
            tail[at(quad[0])],
            tail[at(quad[1])],
            tail[at(quad[2])],
            tail[at(quad[3])],
        ];
        let (l0, l) = l.split_at(width);
        let (l1, l) = l.split_at(width);
        let (l2, l3) = l.split_at(width);
        for ((((x, &l0), &l1), &l2), &l3) in top[register..]
            .iter_mut()
            .step_by(registers)
            .zip(l0)
            .zip(l1)
            .zip(l2)
            .zip(l3)
        {
            let sum = simd.mul_add_e_f64s(simd.splat_f64s(l0), a, *x);
            let sum = simd.mul_add_e_f64s(simd.splat_f64s(l1), b, sum);
            let sum = simd.mul_add_e_f64s(simd.splat_f64s(l2), c, sum);
            *x = simd.mul_add_e_f64s(simd.splat_f64s(l3), d, sum);
        }
    }
    for (&row, l) in quads
        .remainder()
        .iter()
        .zip(quad_entries.remainder().chunks_exact(width))
    {
        let a = tail[at(row)];
        for (x, &l) in top[register..].iter_mut().step_by(registers).zip(l) {
            *x = simd.mul_add_e_f64s(simd.splat_f64s(l), a, *x);
        }
    }
    for i in (1..width).rev() {
        let row = &node.triangle[i * width..][..i];
        let x = top[i * registers + register];
        for (k, &l) in row.iter().enumerate() {
            let at = k * registers + register;
            top[at] = simd.mul_add_e_f64s(simd.splat_f64s(l), x, top[at]);
        }
    }
}
