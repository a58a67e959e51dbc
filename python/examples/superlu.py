"""AUTO beside semismooth Newton with SciPy's SuperLU, on random problems of eleven families.

    python superlu.py [seed] [problems of each family] [seconds for each solve]

Newton's method starts from 0, changes all signs at once and factorises the whole Jacobian in each
step. Both end at a residual of 1e-10 of q, or in the time for a solve.
"""

import sys
import time
import warnings

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

import hlcp

seed, each, patience = (int(argument)
                        for argument in (sys.argv[1:] + ["1", "2", "60"][len(sys.argv) - 1:]))
random = np.random.default_rng(seed)


def line(m, lower=-1.0, centre=2.0, upper=-1.0):
    return sp.diags([lower, centre, upper], [-1, 0, 1], (m, m))


def laplacian(*sides):
    """Return that of a grid in as many dimensions as there are sides."""
    matrix = sp.csr_matrix((1, 1))
    for m in sides:
        matrix = sp.kron(sp.eye(m), matrix) + sp.kron(line(m), sp.eye(matrix.shape[0]))
    return matrix.tocsr()


def hills(m):
    """Return a smooth load of either sign on m x m points."""
    x, y = np.meshgrid(*2 * [np.linspace(0, 1, m)])
    a = random.uniform(3, 12, 4)
    return (np.sin(a[0] * x) * np.cos(a[1] * y) + 0.5 * np.sin(a[2] * x * y + a[3])
            - random.uniform(-0.4, 0.4)).ravel()


def log(low, high):
    return float(np.exp(random.uniform(np.log(low), np.log(high))))


def film(nx, ny, ring=False):
    """Return a wedge with square dimples, or a ring that nothing feeds."""
    i, j = (grid.ravel() for grid in np.meshgrid(np.arange(nx), np.arange(ny)))
    depth, (kx, ky), ecc = random.uniform(0.2, 3), random.integers(3, 12, 2), random.uniform(0.3, 0.95)

    def height(i, j):
        if ring:
            return 1 + ecc * np.cos(2 * np.pi * i / nx)
        return 2 - i / nx + depth * ((i * kx // nx % 2 == 0) & (j * ky // ny % 2 == 0))

    h, west, number, a = height(i, j), height(i - 1, j), np.arange(nx * ny), []
    for di, dj, weight in [(-1, 0, 1), (1, 0, 1), (0, -1, (ny / nx) ** 2), (0, 1, (ny / nx) ** 2)]:
        bond = 2 * weight / (h ** -3.0 + height(i + di, j + dj) ** -3.0)
        column = (i + di) % nx if ring else i + di
        inside = (0 <= column) & (column < nx) & (0 <= j + dj) & (j + dj < ny)
        a += [(bond, number, number), (-bond[inside], number[inside],
                                       (column + (j + dj) * nx)[inside])]
    column = (i - 1) % nx if ring else i - 1
    inside = column >= 0
    b = [(h, number, number), (-west[inside], number[inside], (column + j * nx)[inside])]
    matrices = (sp.csr_matrix((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))),
                              (nx * ny, nx * ny))
                for values, rows, columns in (zip(*a), zip(*b)))
    return *matrices, h - west


def scaled(a, b, q):
    factors = 10 ** random.uniform(-6, 6, len(q))
    return sp.diags(factors) @ a, sp.diags(factors) @ b, factors * q


def skew():
    n, strength, diagonal = int(log(1000, 5000)), log(0.1, 30), log(0.1, 10)
    rows, columns = np.repeat(np.arange(n), 4), random.integers(0, n, 4 * n)
    r = sp.csr_matrix((random.uniform(-1, 1, 4 * n), (rows, columns)), (n, n))
    return strength * (r - r.T) + diagonal * sp.eye(n), sp.eye(n), random.uniform(-1, 1, n)


def pair():
    """Return columns that dominate by 1e-5, three entries of each anywhere."""
    n, matrices = int(log(1000, 12000)), []
    for _ in "AB":
        rows, columns = random.integers(0, n, 3 * n), np.repeat(np.arange(n), 3)
        values = random.uniform(0.05, 1.05, 3 * n) * (rows != columns)
        off = sp.csr_matrix((values, (rows, columns)), (n, n))
        matrices.append(sp.diags(1.00001 * np.asarray(off.sum(0)).ravel() + 1e-6) - off)
    return *matrices, random.uniform(-1, 1, n)


def swirl():
    m, strength = int(log(40, 300)), log(1e2, 1e4)
    x, y = np.meshgrid(*2 * [np.linspace(0, 1, m)])
    u, v = (strength / m * wind.ravel() for wind in (np.sin(np.pi * x) * np.cos(np.pi * y),
                                                     -np.cos(np.pi * x) * np.sin(np.pi * y)))
    along, across = (lambda of: sp.kron(sp.eye(m), of)), (lambda of: sp.kron(of, sp.eye(m)))
    back, forth = line(m, -1, 1, 0), line(m, 0, 1, -1)
    wind = (sp.diags(weights) @ way(step)
            for weights, way, step in [(np.maximum(u, 0), along, back),
                                       (np.maximum(-u, 0), along, forth),
                                       (np.maximum(v, 0), across, back),
                                       (np.maximum(-v, 0), across, forth)])
    return laplacian(m, m) + sum(wind), sp.eye(m * m), 10 * hills(m) / m**2


def contact(m):
    return laplacian(m, m), sp.eye(m * m), hills(m) / m**2


def plate():
    m = int(log(32, 140))
    a = laplacian(m, m)
    return a @ a, sp.eye(m * m), hills(m) / m**4


def cube():
    m = int(log(10, 26))
    return laplacian(m, m, m), sp.eye(m**3), np.sin(0.37 * np.arange(m**3)) - 0.2


def stripes():
    m = int(log(40, 300))
    b = sp.kron(sp.eye(m), line(m, -1, 4, -1))
    return laplacian(m, m), b, np.sin(0.01 * np.arange(m * m))


def sides():
    return int(log(32, 300)), int(log(32, 300))


FAMILIES = {
    "skew": skew, "plates": plate, "films": lambda: film(*sides()),
    "films, rows scaled": lambda: scaled(*film(*sides())),
    "rings, not fed": lambda: film(*sides(), ring=True), "contacts": lambda: contact(sides()[0]),
    "contacts, rows scaled": lambda: scaled(*contact(sides()[0])), "swirls": swirl,
    "pairs": pair, "cubes": cube, "stripes": stripes,
}


def newton(a, b, q):
    """Return the seconds of a solve, or nothing."""
    begin = time.perf_counter()
    b = (b @ sp.diags(a.diagonal() / b.diagonal())).tocsc()
    a, x = a.tocsc(), np.zeros(len(q))
    while time.perf_counter() - begin < patience:
        off = a @ (abs(x) + x) - b @ (abs(x) - x) + q
        if not np.isfinite(off).all():
            return None
        if np.linalg.norm(off) <= 1e-10 * np.linalg.norm(q):
            return time.perf_counter() - begin
        sign = np.where(x >= 0, 1.0, -1.0)
        try:
            x -= splu((a @ sp.diags(1 + sign) + b @ sp.diags(1 - sign)).tocsc()).solve(off)
        except RuntimeError:  # The matrix is singular.
            return None
    return None


warnings.simplefilter("ignore")
print(f"| family, seed {seed} | n | AUTO, s | Newton with SuperLU, s | ratio |\n|---|---|---|---|---|")
ratios = []
for name, draw in FAMILIES.items():
    for _ in range(each):
        a, b, q = draw()
        a, b = a.tocsr(), b.tocsr()
        begin = time.perf_counter()
        auto = hlcp.solve(a, b, q, rtol=1e-10, maxtime=patience)
        own = time.perf_counter() - begin if auto.success else None
        other = newton(a, b, q)
        both = None not in (own, other)
        ratios += [own / other] if both else []
        told = [f"{seconds:.3f}" if seconds else "–" for seconds in (own, other)]
        print(f"| {name} | {len(q)} | {' | '.join(told)} | {ratios[-1] if both else np.nan:.2f} |",
              flush=True)
print(f"\nRatio: median {np.median(ratios):.2f}, 90 % {np.quantile(ratios, 0.9):.2f}, worst "
      f"{max(ratios):.2f} of {len(ratios)}")
