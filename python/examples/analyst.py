"""Speed against accuracy, with a splitting of one's own beside the library's methods.

    python python/examples/analyst.py [--m 255] [--out chart.png]

The scene is a contact in a disc, whose z and r are known. The own splitting is Gauss-Seidel by
grid lines: M is what A + B Omega has within the lines and of the lines below, factorised once by
SciPy. It is run as it is (MMS), and accelerated (ANDERSON).
"""

import argparse

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

import hlcp


def line_splitting(A, omega):
    """Return the solve with the block lower triangle of A + omega I, blocks being grid lines."""
    matrix = (A.tocsr() + omega * sp.eye_array(A.shape[0])).tocoo()
    _, nx = A.grid
    keep = matrix.col // nx <= matrix.row // nx
    block = sp.csc_array((matrix.data[keep], (matrix.row[keep], matrix.col[keep])), matrix.shape)
    return splu(block, permc_spec="NATURAL").solve


def main():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--m", type=int, default=255, help="points a side")
    options.add_argument("--out", help="a file for the chart, which needs matplotlib")
    options = options.parse_args()

    A, B, q, z, r = hlcp.scenes.disc_lcp(options.m)
    omega = 4.0
    mine = {"splitting": line_splitting(A, omega), "omega": omega}
    rivals = {
        "own splitting": ("MMS", mine),
        "own splitting, Anderson": ("ANDERSON", mine),
        "AMSOR": ("AMSOR", {"alpha": 2 - 8 / options.m}),
        "MGF": ("MGF", {}),
        "AUTO": ("AUTO", {}),
    }
    print(f"{'':24} {'rtol':>6} {'iterations':>10} {'sweeps':>7} {'seconds':>8} {'error':>8}")
    curves = {}
    for label, (method, given) in rivals.items():
        for rtol in (1e-2, 1e-4, 1e-6, 1e-8, 1e-10):
            result = hlcp.solve(A, B, q, method, rtol=rtol, maxiter=2000, **given)
            error = max(np.abs(result.z - z).max(), np.abs(result.r - r).max())
            curves.setdefault(label, []).append((result.elapsed, error))
            print(f"{label:24} {rtol:6.0e} {result.nit:10} {result.sweeps:7}"
                  f" {result.elapsed:8.4f} {error:8.1e} {'' if result.success else result.message}")
            if not result.success:
                break
    if options.out:
        import matplotlib.pyplot as plt

        figure, ax = plt.subplots(layout="constrained")
        for (label, points), marker in zip(curves.items(), "osd^v"):
            ax.loglog(*zip(*points), marker=marker, label=label)
        ax.set(xlabel="seconds", ylabel="largest error of z and r", title=f"{q.size} unknowns")
        ax.legend()
        figure.savefig(options.out)


if __name__ == "__main__":
    main()
