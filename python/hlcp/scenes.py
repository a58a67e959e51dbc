"""Problems with known answers, those of the command's ``--scene``.

>>> from hlcp import scenes, solve
>>> A, B, q, z, r = scenes.disc_lcp(63)
>>> result = solve(A, B, q, rtol=1e-12)
>>> bool(abs(result.z - z).max() < 1e-8)
True
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hlcp import _hlcp
from hlcp._operators import FivePoint, count

__all__ = ["Scene", "bearing2d", "disc_hlcp", "disc_lcp", "example1", "example2",
           "journal_bearing", "obstacle", "slider"]


class Scene(NamedTuple):
    """A problem: ``A, B, q, z, r = scene``.

    Attributes
    ----------
    A : FivePoint
    B : FivePoint or None
        None is the identity.
    q : ndarray of shape (ny, nx)
    z, r : ndarray of shape (ny, nx), or None
        The solution, where it is known.
    """

    A: FivePoint
    B: FivePoint | None
    q: NDArray[np.float64]
    z: NDArray[np.float64] | None
    r: NDArray[np.float64] | None


def _scene(posed: Any) -> Scene:
    of_a, of_b, q, solution = posed
    grid = tuple(of_a[0])

    def field(value: Any) -> Any:
        return value.reshape(grid) if isinstance(value, np.ndarray) else value

    def stencil(coefficients: Any) -> FivePoint:
        names = "south", "west", "centre", "east", "north"
        return FivePoint(grid, **dict(zip(names, map(field, coefficients))))

    z, r = (None, None) if solution is None else map(field, solution)
    B = None if of_b is None else stencil(of_b[1])
    return Scene(stencil(of_a[1]), B, field(q), z, r)


def example1(m: int, mu: float = 4.0, nu: float = 4.0) -> Scene:
    """Return the paper's Example 1, with symmetric A, on m x m points.

    Its q is made for the z and r that come with it.
    """
    return _scene(_hlcp.example(True, count("m", m, 0), mu, nu))


def example2(m: int, mu: float = 4.0, nu: float = 4.0) -> Scene:
    """Return the paper's Example 2, with A that is not symmetric, on m x m points.

    Its q is made for the z and r that come with it.
    """
    return _scene(_hlcp.example(False, count("m", m, 0), mu, nu))


def disc_lcp(m: int) -> Scene:
    """Return a contact in a disc, as an LCP on m x m points: multigrid's case."""
    return _scene(_hlcp.disc(True, count("m", m, 0)))


def disc_hlcp(m: int) -> Scene:
    """Return a contact in a disc with a second operator on r, on m x m points."""
    return _scene(_hlcp.disc(False, count("m", m, 0)))


def slider(cells: int) -> Scene:
    """Return the parabolic slider of the lubrication literature, with cells - 1 unknowns.

    z = 1 stands for the pressure 6 mu U L / h_min**2, and r is the void fraction.
    """
    return _scene(_hlcp.slider(count("cells", cells, 0)))


def journal_bearing(nx: int, ny: int, ecc: float = 0.1, b: float = 10.0) -> Scene:
    """Return PETSc's journal bearing, an LCP on ny x nx points.

    Parameters
    ----------
    nx, ny : int
        Inner points around the journal and along it.
    ecc : float
        The eccentricity, from 0 to below 1.
    b : float
        Half the length of the bearing over its radius.
    """
    return _scene(_hlcp.journal_bearing(count("nx", nx, 0), count("ny", ny, 0), ecc, b))


def obstacle(m: int) -> Scene:
    """Return PETSc's membrane over a dome, an LCP on (m - 2) x (m - 2) points."""
    return _scene(_hlcp.obstacle(count("m", m, 0)))


def bearing2d(nx: int, ny: int, ecc: float = 0.6, aspect: float = 1.0,
              groove: float = 0.0) -> Scene:
    """Return a journal bearing with mass-conserving cavitation, an HLCP on ny x nx points.

    Parameters
    ----------
    nx, ny : int
        Inner points around the journal and along it.
    ecc : float
        The eccentricity, from 0 to below 1.
    aspect : float
        The length over the diameter.
    groove : float
        Where the feed groove is, in radians from the widest gap.
    """
    return _scene(_hlcp.bearing2d(count("nx", nx, 0), count("ny", ny, 0), ecc, aspect, groove))
