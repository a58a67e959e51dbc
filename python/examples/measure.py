"""What a call costs over Rust, and the same problems by SciPy beside hlcp.

    python python/examples/measure.py [--quick]

Three ways to solve A z - B r + q = 0, z, r >= 0, z'r = 0, to the same residual:

* the paper's Gauss-Seidel splitting as SciPy users write it: sparse products and one triangular
  solve an iteration (`splu` of the lower triangle, in its natural order);
* FBNS, the Newton method of T. Woloszynski, P. Podsiadlo and G. W. Stachowiak, Efficient solution
  to the cavitation problem in hydrodynamic lubrication, Tribology Letters 58 (2015) 18: the
  Fischer-Burmeister function, the Schur complement of its diagonal block, a sparse LU;
* hlcp, on the stencils and on the same sparse matrices.
"""

import sys
import time

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

import hlcp


def gauss_seidel(A, B, q, tol, maxiter):
    """Return z, r and the iterations of x = x - M^-1 F(x), M the lower triangle of A + B Omega."""
    omega = A.diagonal() / B.diagonal()
    M = sp.csc_array(sp.tril(A + B @ sp.diags_array(omega)))
    lower = splu(M, permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    x = np.zeros_like(q)
    for k in range(maxiter + 1):
        z, r = np.abs(x) + x, omega * (np.abs(x) - x)
        defect = A @ z - B @ r + q
        if np.linalg.norm(defect) <= tol:
            break
        x -= lower.solve(defect)
    return z, r, k


def fbns(A, B, q, tol, maxiter):
    """Return z, r and the iterations of Fischer, Burmeister, Newton and Schur."""
    z, r = np.zeros_like(q), np.zeros_like(q)
    for k in range(maxiter + 1):
        defect, root = A @ z - B @ r + q, np.hypot(z, r)
        complementarity = z + r - root
        if np.hypot(np.linalg.norm(defect), np.linalg.norm(complementarity)) <= tol:
            break
        root[root == 0] = np.inf
        by_z, by_r = 1 - z / root, 1 - r / root
        # Eliminate, point by point, the unknown with the larger derivative.
        keep_z = by_z < by_r
        kept = np.where(keep_z, by_z, by_r)
        gone = np.where(keep_z, by_r, by_z)
        z_mask, r_mask = sp.diags_array(keep_z * 1.0), sp.diags_array(~keep_z * 1.0)
        of_kept = A @ z_mask - B @ r_mask
        of_gone = A @ r_mask - B @ z_mask
        schur = of_kept - of_gone @ sp.diags_array(kept / gone)
        rhs = of_gone @ (complementarity / gone) - defect
        d_kept = splu(sp.csc_array(schur)).solve(rhs)
        d_gone = -(complementarity + kept * d_kept) / gone
        z = z + np.where(keep_z, d_kept, d_gone)
        r = r + np.where(keep_z, d_gone, d_kept)
    return z, r, k


def seconds(call, least=0.5):
    """Return what a call returns, and the least seconds of some."""
    best, total = np.inf, 0.0
    while True:
        begun = time.perf_counter()
        answer = call()
        took = time.perf_counter() - begun
        best, total = min(best, took), total + took
        if total >= least:
            return answer, best


def overhead(m):
    """Print how much longer a call is than the solve within it, with everything borrowed."""
    A, B, q, *_ = hlcp.scenes.disc_hlcp(m)
    arrays = {name: np.full((m, m), getattr(A, name))
              for name in ("south", "west", "centre", "east", "north")}
    print(f"a call over the solve within it, n = {m * m}")
    for label, given, method, options in [
        ("constant stencils", (A, B), "FMG", {}),
        ("varying stencils", (hlcp.FivePoint((m, m), **arrays), B), "FMG", {}),
        ("CSR matrices, 26 sweeps", (A.tocsr(), B.tocsr()), "MGS", {"maxiter": 26}),
        ("constant stencils, 26 sweeps", (A, B), "MGS", {"maxiter": 26}),
        ("one sweep", (A, B), "MGS", {"maxiter": 1}),
    ]:
        shares = []
        for _ in range(5):
            begun = time.perf_counter()
            result = hlcp.solve(*given, q, method, **options)
            call = time.perf_counter() - begun
            shares.append(((call - result.elapsed) / result.elapsed, call))
        share, call = min(shares)
        print(f"  {label:30} {method:5} {call:8.3f} s  {100 * share:6.1f} % over")
    tiny = hlcp.scenes.example1(3)
    _, call = seconds(lambda: hlcp.solve(*tiny[:3], "MGS"))
    print(f"  nine unknowns{'':18} MGS   {1e6 * call:8.0f} us\n")


def compare(name, scene, rtol=1e-8):
    """Print the three ways on one scene."""
    A, B, q, *_ = scene
    n, flat = q.size, q.ravel()
    a, b = A.tocsr(), sp.eye_array(n, format="csr") if B is None else B.tocsr()
    tol = rtol * np.linalg.norm(flat)
    print(f"{name}, n = {n}, residual <= {rtol:.0e} |q|")

    def line(label, z, r, count, took, note=""):
        residual = np.linalg.norm(a @ z.ravel() - b @ r.ravel() + flat)
        print(f"  {label:30} {count:7} iterations {took:9.3f} s   residual {residual:.1e} {note}")

    limit = 2000
    (z, r, k), took = seconds(lambda: gauss_seidel(a, b, flat, tol, limit), 0)
    line("SciPy, Gauss-Seidel splitting", z, r, k, took, "(stopped)" if k == limit else "")
    if n <= 300_000:
        (z, r, k), took = seconds(lambda: fbns(a, b, flat, tol, 100), 0)
        line("SciPy, FBNS", z, r, k, took, "(stopped)" if k == 100 else "")
    for label, given, method, options in [
        ("hlcp MGS, stencils", (A, B), "MGS", {"maxiter": limit}),
        ("hlcp AUTO, stencils", (A, B), "AUTO", {}),
        ("hlcp AUTO, matrices", (a, None if B is None else b), "AUTO", {}),
    ]:
        result, took = seconds(lambda: hlcp.solve(*given, q, method, rtol=rtol, **options), 0)
        line(label, result.z, result.r, result.nit, took, "" if result.success else "(stopped)")
    print()


if __name__ == "__main__":
    quick = "--quick" in sys.argv
    overhead(200 if quick else 1000)
    compare("example1", hlcp.scenes.example1(64 if quick else 512))
    for m in (31,) if quick else (127, 255):
        compare("disc_lcp", hlcp.scenes.disc_lcp(m))
        compare("bearing2d", hlcp.scenes.bearing2d(2 * m + 1, m))
