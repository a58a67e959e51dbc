"""Stiffness and damping of a journal bearing for a rotor's model in ROSS.

    python python/examples/rotor.py [--nx 180] [--frequency 1]

The bearing is 100 mm by 50 mm with a radial clearance of 100 um, fed by a groove opposite the load
of 2 kN. For twenty speeds the equilibrium, stiffness and damping are found, each from the speed
before, and where the package ross-rotordynamics is installed a ross.BearingElement is made of them.
"""

import argparse
import time

import numpy as np

import hlcp


def element(found, node):
    """Return a `ross.BearingElement` at a node, for a load down along -y and a rotor that turns
    from x to y: what is across the load is along x, what is along it is against y."""
    import ross

    turn = np.array([[0.0, 1.0], [-1.0, 0.0]])
    (kxx, kxy), (kyx, kyy) = np.moveaxis(turn @ found.stiffness @ turn.T, 0, -1)
    (cxx, cxy), (cyx, cyy) = np.moveaxis(turn @ found.damping @ turn.T, 0, -1)
    return ross.BearingElement(n=node, kxx=kxx, kxy=kxy, kyx=kyx, kyy=kyy, cxx=cxx, cxy=cxy,
                               cyx=cyx, cyy=cyy, frequency=found.omega)


def main():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--nx", type=int, default=180, help="cells around the journal")
    options.add_argument("--frequency", type=float, default=0.0,
                         help="that of the whirl over the running speed; without it slow motions")
    options = options.parse_args()

    bearing = hlcp.Journal(0.1, 0.05, 1e-4, grooves=[(0, 1e5)], nx=options.nx, ny=options.nx // 6)
    begun = time.perf_counter()
    found = bearing.coefficients(rpm=np.linspace(600, 6000, 20), viscosity=0.02, load=2000,
                                 attitude=0, frequency=options.frequency)
    print(f"{len(found.films)} films with coefficients in {time.perf_counter() - begun:.2f} s")
    print("   rpm    ecc  attitude    K along   K across  C along  C across")
    print("                degrees       N/um       N/um   N s/mm    N s/mm")
    for omega, ecc, attitude, k, c in zip(found.omega, found.ecc, found.attitude, found.stiffness,
                                          found.damping):
        print(f"{omega * 30 / np.pi:6.0f} {ecc:6.3f} {attitude:9.2f} {k[0, 0] / 1e6:10.2f}"
              f" {k[1, 1] / 1e6:10.2f} {c[0, 0] / 1e3:8.1f} {c[1, 1] / 1e3:9.1f}")
    try:
        made = element(found, node=0)
        print(f"a {type(made).__name__} of ROSS for {len(found.omega)} speeds")
    except ImportError:
        print("for a ross.BearingElement: pip install ross-rotordynamics")


if __name__ == "__main__":
    main()
