//! Small problems in integers, each grown from a seed.

pub(crate) type Matrix = Vec<Vec<i64>>;

/// A problem in small integers, which both precisions hold exactly, and how it is to be solved.
#[derive(Debug, Clone)]
pub(crate) struct Case {
    pub(crate) a: Matrix,
    pub(crate) b: Matrix,
    pub(crate) q: Vec<i64>,
    /// The power of two that multiplies q.
    pub(crate) power: i32,
    /// Ω; where there is none, the ratio of the diagonals.
    pub(crate) omega: Option<Vec<i64>>,
    pub(crate) gamma: i64,
    pub(crate) exchanged: bool,
    /// The length of a row of the grid, where the operators are posed as five-point ones.
    pub(crate) grid: Option<usize>,
    pub(crate) starts: Vec<Vec<i64>>,
    pub(crate) iterations: usize,
}

impl Case {
    /// The problem as one types it, rows parted by semicolons, with the defaults of the command
    /// line.
    pub(crate) fn typed(a: &str, b: &str, q: &str) -> Self {
        let row = |text: &str| -> Vec<i64> {
            text.split_whitespace().map(|entry| entry.parse().expect("an integer")).collect()
        };
        let matrix = |text: &str| text.split(';').map(row).collect();
        let (a, b, q): (Matrix, Matrix, _) = (matrix(a), matrix(b), row(q));
        let starts = vec![vec![1; q.len()]];
        let (power, omega, gamma, exchanged, grid, iterations) = (0, None, 1, false, None, 2000);
        Self { a, b, q, power, omega, gamma, exchanged, grid, starts, iterations }
    }

    /// q as it is posed.
    pub(crate) fn q(&self) -> Vec<f64> {
        self.q.iter().map(|&q| q as f64 * 2_f64.powi(self.power)).collect()
    }
}

/// SplitMix64 (Steele, Lea and Flood, OOPSLA 2014): streams from neighbouring seeds are unrelated.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut bits = self.0;
        bits = (bits ^ bits >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ bits >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        bits ^ bits >> 31
    }

    /// An integer from `low` to `high`, both included.
    fn between(&mut self, low: i64, high: i64) -> i64 {
        let count = (high - low + 1) as u64;
        low + ((self.next() >> 11) % count) as i64
    }

    pub(crate) fn index(&mut self, count: usize) -> usize {
        self.between(0, count as i64 - 1) as usize
    }

    /// True once in `count` times.
    fn once_in(&mut self, count: usize) -> bool {
        self.index(count) == 0
    }

    pub(crate) fn vector(&mut self, n: usize, low: i64, high: i64) -> Vec<i64> {
        (0..n).map(|_| self.between(low, high)).collect()
    }

    /// A matrix whose entries beside the diagonal, where the pattern has any, are zero once in
    /// three times.
    pub(crate) fn matrix(&mut self, pattern: &Pattern, on: [i64; 2], off: [i64; 2]) -> Matrix {
        let entry = |i: usize, j: usize| match (i == j, pattern.has(i, j)) {
            (true, _) => self.between(on[0], on[1]),
            (_, true) if !self.once_in(3) => self.between(off[0], off[1]),
            _ => 0,
        };
        square(pattern.n, entry)
    }

    /// A matrix with each diagonal entry above the other absolute values of its row.
    pub(crate) fn dominant(&mut self, pattern: &Pattern) -> Matrix {
        let mut matrix = self.matrix(pattern, [0, 0], [-2, 2]);
        for (i, row) in matrix.iter_mut().enumerate() {
            row[i] = row.iter().map(|entry| entry.abs()).sum::<i64>() + self.between(1, 3);
        }
        matrix
    }

    /// A singular M-matrix: its rows, multiplied by `weights`, sum to zero, and no entry beside the
    /// diagonal is positive.
    pub(crate) fn singular(&mut self, pattern: &Pattern, weights: &[i64]) -> Matrix {
        let mut matrix = self.matrix(pattern, [0, 0], [-2, -1]);
        for j in 0..pattern.n {
            let sum: i64 = (0..pattern.n).map(|i| weights[i] * matrix[i][j]).sum();
            for (i, row) in matrix.iter_mut().enumerate() {
                row[j] = if i == j { -sum } else { weights[j] * row[j] };
            }
            // A column that was empty stays one.
        }
        matrix
    }

    /// Integers x, and the q that z = x⁺ and r = x⁻ solve.
    pub(crate) fn plant(&mut self, a: &Matrix, b: &Matrix) -> [Vec<i64>; 2] {
        let x = self.vector(a.len(), -3, 3);
        let z: Vec<i64> = x.iter().map(|&x| x.max(0)).collect();
        let r: Vec<i64> = x.iter().map(|&x| (-x).max(0)).collect();
        let q = (0..x.len()).map(|i| dot(&b[i], &r) - dot(&a[i], &z)).collect();
        [x, q]
    }
}

pub(crate) fn dot(u: &[i64], v: &[i64]) -> i64 {
    u.iter().zip(v).map(|(u, v)| u * v).sum()
}

pub(crate) fn square(n: usize, mut entry: impl FnMut(usize, usize) -> i64) -> Matrix {
    (0..n).map(|i| (0..n).map(|j| entry(i, j)).collect()).collect()
}

pub(crate) fn identity(n: usize) -> Matrix {
    square(n, |i, j| i64::from(i == j))
}

/// Where a matrix may have entries: everywhere, or at a point's neighbours on a grid.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pattern {
    pub(crate) n: usize,
    pub(crate) grid: Option<usize>,
}

impl Pattern {
    fn has(&self, i: usize, j: usize) -> bool {
        let beside = |nx: usize| i.abs_diff(j) == 1 && i / nx == j / nx || i.abs_diff(j) == nx;
        i == j || self.grid.is_none_or(beside)
    }
}

/// The problem that grows from a seed.
pub(crate) fn grown(seed: u64) -> Case {
    let random = &mut Random(seed);
    let n = 1 + random.index(5);
    let kind = random.index(KINDS);
    let grid =
        (random.once_in(3) && kind != 7).then(|| if n == 4 { 2 + 2 * random.index(2) } else { n });
    let pattern = &Pattern { n, grid };
    let (a, b, q) = posed(random, pattern, kind);
    let omega = match random.index(4) {
        0 => Some(vec![random.between(1, 4); n]),
        1 => Some(random.vector(n, 1, 4)),
        _ if (0..n).all(|i| a[i][i] > 0 && b[i][i] > 0) => None,
        _ => Some(vec![1; n]),
    };
    let mut starts = vec![vec![1; n]];
    if random.once_in(3) {
        let size = [4, 4, 4, 1 << 20][random.index(4)];
        starts.push(random.vector(n, -size, size));
    }
    Case {
        power: [0, 0, 0, 0, 20, -10][random.index(6)],
        gamma: random.between(1, 2),
        exchanged: random.once_in(6),
        iterations: [300, 300, 300, 300, 300, 2000][random.index(6)],
        a,
        b,
        q,
        omega,
        grid,
        starts,
    }
}

/// The kinds of problems that [`posed`] makes.
pub(crate) const KINDS: usize = 11;

/// The matrices and q of a problem of one kind.
pub(crate) fn posed(
    random: &mut Random,
    pattern: &Pattern,
    kind: usize,
) -> (Matrix, Matrix, Vec<i64>) {
    let n = pattern.n;
    let weights = random.vector(n, 1, 5);
    let any = [1, 5];
    let [a, b] = match kind {
        // With one solution, mostly.
        0 | 1 => [random.dominant(pattern), random.dominant(pattern)],
        // With several, often.
        2 | 3 => [random.matrix(pattern, [1, 2], [-4, 4]), random.matrix(pattern, [1, 2], [-4, 4])],
        // Singular M-matrices: without a solution where the weighted sum of q is negative.
        4 | 5 => [random.singular(pattern, &weights), identity(n)],
        // The weighted rows of both sum to zero.
        6 => [random.singular(pattern, &weights), random.singular(pattern, &weights)],
        // Two equal rows.
        7 => {
            let mut pair =
                [random.matrix(pattern, any, [0, 3]), random.matrix(pattern, any, [-3, 3])];
            let rows = [random.index(n), random.index(n)];
            for matrix in &mut pair {
                matrix[rows[0]] = matrix[rows[1]].clone();
            }
            pair
        }
        // A column of zeros, in one of them or in both.
        8 | 9 => {
            let mut pair = [random.dominant(pattern), random.dominant(pattern)];
            if random.once_in(3) {
                pair[1] = random.matrix(pattern, any, [-4, 4]);
            }
            let [j, k] = [random.index(n), random.index(n)];
            pair[0].iter_mut().for_each(|row| row[j] = 0);
            if k != j && random.once_in(2) {
                pair[1].iter_mut().for_each(|row| row[k] = 0);
            }
            pair
        }
        _ => [random.matrix(pattern, any, [-3, 3]), random.matrix(pattern, any, [-3, 3])],
    };
    let planted = match kind {
        1 | 3 => true,
        4 | 5 | 8 => false,
        _ => random.once_in(3),
    };
    let mut q = if planted {
        let [_, q] = random.plant(&a, &b);
        q
    } else {
        random.vector(n, -4, 4)
    };
    if kind == 4 && dot(&weights, &q) > 0 {
        q.iter_mut().for_each(|q| *q = -*q);
    }
    (a, b, q)
}
