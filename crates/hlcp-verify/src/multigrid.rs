//! An approximate solver for row-wise diagonally dominant M-matrices.
//!
//! Nothing that is proved rests on it: its answers are candidates for witnesses, and the witness is
//! checked.

use nalgebra::{DMatrix, DVector};

/// A square matrix `diag(pivot) − off` by rows.
#[derive(Debug, Clone, Default)]
pub(crate) struct Sparse {
    pivot: Vec<f64>,
    starts: Vec<usize>,
    off: Vec<(u32, f64)>,
}

impl Sparse {
    /// Appends the row with this diagonal entry and these off-diagonal moduli.
    pub(crate) fn push(&mut self, pivot: f64, off: impl IntoIterator<Item = (usize, f64)>) {
        self.starts.push(self.off.len());
        self.pivot.push(pivot);
        self.off.extend(off.into_iter().map(|(j, g)| (j as u32, g)));
    }

    fn order(&self) -> usize {
        self.pivot.len()
    }

    fn row(&self, i: usize) -> &[(u32, f64)] {
        let end = self.starts.get(i + 1).copied().unwrap_or(self.off.len());
        &self.off[self.starts[i]..end]
    }

    fn coupled(&self, i: usize, x: &[f64]) -> f64 {
        self.row(i).iter().map(|&(j, g)| g * x[j as usize]).sum()
    }

    fn residual(&self, b: &[f64], x: &[f64]) -> Vec<f64> {
        (0..self.order()).map(|i| b[i] - self.pivot[i] * x[i] + self.coupled(i, x)).collect()
    }

    fn relax(&self, b: &[f64], x: &mut [f64], i: usize) {
        x[i] = (b[i] + self.coupled(i, x)) / self.pivot[i];
    }

    /// Which of `.1` aggregates each unknown joins: pairs by the largest coupling.
    fn pairs(&self) -> (Vec<u32>, usize) {
        const NONE: u32 = u32::MAX;
        let (mut aggregate, mut count) = (vec![NONE; self.order()], 0);
        for i in 0..self.order() {
            if aggregate[i] != NONE {
                continue;
            }
            // Of couplings that rounding alone tells apart the last, so that aggregates of a grid
            // line up.
            let mut strongest: Option<(u32, f64)> = None;
            for &(j, g) in self.row(i) {
                let free = aggregate[j as usize] == NONE && j as usize != i;
                if free && strongest.is_none_or(|(_, best)| g >= 0.999 * best) {
                    strongest = Some((j, g));
                }
            }
            if let Some((j, _)) = strongest {
                aggregate[j as usize] = count;
            }
            aggregate[i] = count;
            count += 1;
        }
        (aggregate, count as usize)
    }

    /// The sums of the entries over pairs of aggregates.
    fn coarse(&self, aggregate: &[u32], count: usize) -> Self {
        let mut members = vec![Vec::new(); count];
        for (i, &a) in aggregate.iter().enumerate() {
            members[a as usize].push(i);
        }
        let mut coarse = Self::default();
        let mut place = vec![usize::MAX; count];
        let mut entries: Vec<(usize, f64)> = Vec::new();
        for (a, members) in members.iter().enumerate() {
            entries.clear();
            let mut pivot = 0.0;
            for &i in members {
                pivot += self.pivot[i];
                for &(j, g) in self.row(i) {
                    let to = aggregate[j as usize] as usize;
                    if to == a {
                        pivot -= g;
                    } else if let Some(entry) = entries.get_mut(place[to]).filter(|e| e.0 == to) {
                        entry.1 += g;
                    } else {
                        place[to] = entries.len();
                        entries.push((to, g));
                    }
                }
            }
            coarse.push(pivot, entries.iter().copied());
        }
        coarse
    }
}

/// Aggregation multigrid, accelerated on every level by generalised conjugate residuals (a
/// K-cycle).
///
/// Unknowns are paired twice a level by their largest coupling, and a coarse matrix is the sum of
/// its aggregates' entries, so it is again a row-wise diagonally dominant M-matrix (after Notay's
/// AGMG).
#[derive(Debug)]
pub(crate) struct Multigrid {
    levels: Vec<Level>,
    bottom: Option<nalgebra::LU<f64, nalgebra::Dyn, nalgebra::Dyn>>,
}

#[derive(Debug)]
struct Level {
    matrix: Sparse,
    /// Where each unknown goes on the next level; empty on the last.
    aggregate: Vec<u32>,
}

const SMALL: usize = 48;

impl Multigrid {
    pub(crate) fn new(matrix: Sparse) -> Self {
        let mut levels = vec![];
        let mut matrix = matrix;
        while matrix.order() > SMALL {
            let (first, half) = matrix.pairs();
            let middle = matrix.coarse(&first, half);
            let (second, quarter) = middle.pairs();
            if quarter * 10 > matrix.order() * 9 {
                break;
            }
            let aggregate = first.iter().map(|&a| second[a as usize]).collect();
            let next = middle.coarse(&second, quarter);
            levels.push(Level { matrix, aggregate });
            matrix = next;
        }
        let n = matrix.order();
        let bottom = (n <= SMALL).then(|| {
            let mut dense = DMatrix::zeros(n, n);
            for i in 0..n {
                dense[(i, i)] += matrix.pivot[i];
                for &(j, g) in matrix.row(i) {
                    dense[(i, j as usize)] -= g;
                }
            }
            dense.lu()
        });
        levels.push(Level { matrix, aggregate: vec![] });
        Self { levels, bottom }
    }

    /// An approximate solution, to a residual of `tolerance` times the right-hand side or as near
    /// as it gets.
    pub(crate) fn solve(&self, b: &[f64], tolerance: f64) -> Vec<f64> {
        self.conjugate_residuals(0, b, 60, tolerance)
    }

    fn conjugate_residuals(
        &self,
        level: usize,
        b: &[f64],
        steps: usize,
        tolerance: f64,
    ) -> Vec<f64> {
        const KEPT: usize = 8;
        let matrix = &self.levels[level].matrix;
        let (mut x, mut r) = (vec![0.0; b.len()], b.to_vec());
        let mut directions: Vec<(Vec<f64>, Vec<f64>)> = vec![];
        let goal = tolerance * tolerance * dot(b, b);
        for step in 0..steps {
            let mut p = self.cycle(level, &r);
            let zero = vec![0.0; b.len()];
            let mut q = matrix.residual(&zero, &p);
            q.iter_mut().for_each(|q| *q = -*q);
            for (old_p, old_q) in &directions {
                let share = dot(&q, old_q);
                add(&mut q, -share, old_q);
                add(&mut p, -share, old_p);
            }
            let norm = dot(&q, &q).sqrt();
            if !(norm > 0.0 && norm.is_finite()) {
                break;
            }
            p.iter_mut().for_each(|p| *p /= norm);
            q.iter_mut().for_each(|q| *q /= norm);
            let length = dot(&r, &q);
            add(&mut x, length, &p);
            add(&mut r, -length, &q);
            if dot(&r, &r) <= goal {
                break;
            }
            if directions.len() < KEPT {
                directions.push((p, q));
            } else {
                directions[step % KEPT] = (p, q);
            }
        }
        x
    }

    /// How many steps a cycle on this level makes on the next: two where that is no more work.
    ///
    /// However slowly the levels shrink, all cycles on one meet no more rows than the first has.
    fn steps(&self, level: usize) -> usize {
        let [fine, coarse] = [0, 1].map(|next| self.levels[level + next].matrix.order());
        if 2 * coarse <= fine { 2 } else { 1 }
    }

    /// A forward sweep, the next level, a backward sweep.
    fn cycle(&self, level: usize, b: &[f64]) -> Vec<f64> {
        let Level { matrix, aggregate } = &self.levels[level];
        let n = b.len();
        let mut x = vec![0.0; n];
        if aggregate.is_empty() {
            if let Some(solution) =
                self.bottom.as_ref().and_then(|lu| lu.solve(&DVector::from_column_slice(b)))
            {
                return solution.as_slice().to_vec();
            }
            for _ in 0..8 {
                (0..n).for_each(|i| matrix.relax(b, &mut x, i));
                (0..n).rev().for_each(|i| matrix.relax(b, &mut x, i));
            }
            return x;
        }
        (0..n).for_each(|i| matrix.relax(b, &mut x, i));
        let mut coarse = vec![0.0; self.levels[level + 1].matrix.order()];
        for (r, &a) in matrix.residual(b, &x).iter().zip(aggregate) {
            coarse[a as usize] += r;
        }
        let last = level + 2 == self.levels.len();
        let correction = if last && self.bottom.is_some() {
            self.cycle(level + 1, &coarse)
        } else {
            self.conjugate_residuals(level + 1, &coarse, self.steps(level), 0.0)
        };
        for (x, &a) in x.iter_mut().zip(aggregate) {
            *x += correction[a as usize];
        }
        (0..n).rev().for_each(|i| matrix.relax(b, &mut x, i));
        x
    }
}

fn dot(x: &[f64], y: &[f64]) -> f64 {
    x.iter().zip(y).map(|(x, y)| x * y).sum()
}

/// `y += a x`.
fn add(y: &mut [f64], a: f64, x: &[f64]) {
    y.iter_mut().zip(x).for_each(|(y, x)| *y += a * x);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tree of stars: each node of a star of `1 + leaves` is the centre of another.
    fn stars(leaves: usize, depth: u32) -> Sparse {
        let n = (leaves + 1).pow(depth);
        let mut off = vec![vec![]; n];
        let mut size = 1;
        while size < n {
            for centre in (0..n).step_by(size * (leaves + 1)) {
                for leaf in 1..=leaves {
                    off[centre].push((centre + leaf * size, 1.0));
                    off[centre + leaf * size].push((centre, 1.0));
                }
            }
            size *= leaves + 1;
        }
        let mut matrix = Sparse::default();
        off.into_iter().for_each(|row| matrix.push(row.len() as f64 + 0.01, row));
        matrix
    }

    /// Aggregates of a star grow by one leaf at a time.
    #[test]
    fn levels_that_shrink_slowly_do_not_multiply_the_work() {
        let multigrid = Multigrid::new(stars(17, 3));
        let order = |level: usize| multigrid.levels[level].matrix.order();
        let (mut cycles, last) = (1, multigrid.levels.len() - 1);
        assert!(last >= 9 && order(last) > order(0) / 10);
        for level in 0..last {
            cycles *= multigrid.steps(level);
            assert!(cycles * order(level + 1) <= order(0), "{cycles} cycles on level {level}");
        }
        // With two steps everywhere there would be 2⁹ cycles on 612 rows for one on 5832.
        let x = multigrid.solve(&vec![1.0; order(0)], 1e-3);
        let residual = multigrid.levels[0].matrix.residual(&vec![1.0; order(0)], &x);
        assert!(dot(&residual, &residual) <= 1e-6 * order(0) as f64);
    }
}
