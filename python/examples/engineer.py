"""A thrust pad with dimples: what the texture does to load, friction and leakage.

    python python/examples/engineer.py [--nx 192] [--out film.png]

The pad is 50 mm by 30 mm, the film 20 um thick and parallel, so that without a texture it carries
nothing; the runner slides at 5 m/s. Dimples of growing depth cover the half where oil enters.
"""

import argparse

import numpy as np

import hlcp

SIZE = 0.05, 0.03  # m
GAP = 20e-6  # m
OIL = {"speed": 5.0, "viscosity": 0.03, "ambient": 1e5}  # m/s, Pa s, Pa


def dimples(nx, ny, along, across, depth):
    """Return a map of round dimples, spherical caps, on the first half of the pad."""
    x = (np.arange(nx) + 0.5) / nx * 2 * along
    y = (np.arange(ny) + 0.5) / ny * across
    squared = ((x % 1 - 0.5) ** 2 + ((y % 1 - 0.5) ** 2)[:, None]) / 0.35**2
    return np.where(x < along, depth * np.maximum(1 - squared, 0), 0.0)


def main():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--nx", type=int, default=192, help="cells along the motion")
    options.add_argument("--out", help="a file for the map of the last film; needs matplotlib")
    options = options.parse_args()
    nx = options.nx
    ny = nx * 3 // 5

    print("  depth       load   friction   power     peak   leakage  broken")
    print("     um          N          N       W      bar      ml/s     %")
    last = None
    for depth in (0.0, 5e-6, 10e-6, 20e-6):
        gap = GAP + dimples(nx, ny, 6, 6, depth)
        last = hlcp.film(gap, size=SIZE, **OIL, start=last)
        if not last.success:
            raise SystemExit(last.message)
        leakage = 1e6 * (last.sides[2] + last.sides[3])
        print(f"{1e6 * depth:7.0f} {last.load:10.3f} {last.friction[0]:10.3f} {last.power:7.2f}"
              f" {last.peak / 1e5:8.3f} {leakage:9.4f} {100 * last.broken_share:6.2f}")
    if options.out:
        ax = hlcp.plot(last.pressure / 1e5, last.r, extent=(0, 50, 0, 30),
                       labels=("pressure, bar", "void"))
        ax.set(xlabel="x, mm", ylabel="y, mm", aspect="equal")
        ax.figure.savefig(options.out)


if __name__ == "__main__":
    main()
