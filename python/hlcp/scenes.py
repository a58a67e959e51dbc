"""Problems with known answers, those of the command's ``--scene``.

>>> from hlcp import scenes, solve
>>> A, B, q, z, r = scenes.disc_lcp(63)
>>> result = solve(A, B, q, rtol=1e-12)
>>> bool(abs(result.z - z).max() < 1e-8)
True
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hlcp import _hlcp
from hlcp._operators import FivePoint, count, number, real, stencil, vector

__all__ = ["AmericanPut", "Scene", "bearing2d", "bessel", "dam", "disc_hlcp", "disc_lcp",
           "example1", "example2", "journal_bearing", "obstacle", "slider", "spiral"]


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


def _scene(name: str, sizes: dict[str, int], *numbers: float) -> Scene:
    nx, *ny = (count(what, size, 0) for what, size in sizes.items())
    of_a, of_b, q, solution = _hlcp.scene(name, [nx, *(ny or [nx])], numbers)
    grid = tuple(of_a[0])

    def field(value: Any) -> Any:
        return value.reshape(grid) if isinstance(value, np.ndarray) else value

    z, r = (None, None) if solution is None else map(field, solution)
    B = None if of_b is None else stencil(of_b)
    return Scene(stencil(of_a), B, field(q), z, r)


def example1(m: int, mu: float = 4.0, nu: float = 4.0) -> Scene:
    """Return the paper's Example 1, with symmetric A, on m x m points.

    Its q is made for the z and r that come with it.
    """
    return _scene("example1", {"m": m}, mu, nu)


def example2(m: int, mu: float = 4.0, nu: float = 4.0) -> Scene:
    """Return the paper's Example 2, with A that is not symmetric, on m x m points.

    Its q is made for the z and r that come with it.
    """
    return _scene("example2", {"m": m}, mu, nu)


def disc_lcp(m: int) -> Scene:
    """Return a contact in a disc, as an LCP on m x m points: multigrid's case."""
    return _scene("disc_lcp", {"m": m})


def disc_hlcp(m: int) -> Scene:
    """Return a contact in a disc with a second operator on r, on m x m points."""
    return _scene("disc_hlcp", {"m": m})


def slider(cells: int) -> Scene:
    """Return the parabolic slider of the lubrication literature, with cells - 1 unknowns.

    z = 1 stands for the pressure 6 mu U L / h_min**2, and r is the void fraction.
    """
    return _scene("slider", {"cells": cells, "lines": 1})


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
    return _scene("journal_bearing", {"nx": nx, "ny": ny}, ecc, b)


def obstacle(m: int) -> Scene:
    """Return PETSc's membrane over a dome, an LCP on (m - 2) x (m - 2) points."""
    return _scene("obstacle", {"m": m})


def spiral(m: int) -> Scene:
    """Return a membrane on the spiral of Gräser and Kornhuber, an LCP on m x m points."""
    return _scene("spiral", {"m": m})


def bessel(m: int) -> Scene:
    """Return a membrane pressed against a product of Bessel's functions, an LCP on m x m points."""
    return _scene("bessel", {"m": m})


def dam(nx: int, ny: int, length: float = 1.0, tail: float = 0.5, layer: float = 1.0) -> Scene:
    """Return seepage through a dam of earth, an HLCP on ny x nx cells, from the crest down.

    z is the pressure head and r the dry share of the pores.

    Parameters
    ----------
    nx, ny : int
        Columns of points between the faces, and rows of cells.
    length, tail : float
        The length of the base, and the depth of the tailwater, over the depth upstream.
    layer : float
        The conductivity of the lower half over that of the upper.
    """
    return _scene("dam", {"nx": nx, "ny": ny}, length, tail, layer)


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
    return _scene("bearing2d", {"nx": nx, "ny": ny}, ecc, aspect, groove)


class AmericanPut:
    """An American put by Crank and Nicolson, one LCP with B = None after the other.

    The unknown is the value of waiting, in strikes, on a line of points in log(spot / strike).

    Parameters
    ----------
    rate : float
        The interest rate per year.
    volatility : float
        Per square root of a year.
    maturity : float
        In years.
    m : int
        Points per standard deviation.
    steps : int
        Steps in time; the first ones are halved.

    Attributes
    ----------
    A : FivePoint
        That of all LCPs.
    lcps : int
        How many there are.

    Raises
    ------
    ValueError
        For numbers that are not positive, and a grid too coarse for the drift.

    Examples
    --------
    >>> import numpy as np, hlcp
    >>> put = hlcp.scenes.AmericanPut(rate=0.06, volatility=0.2, maturity=1.0, m=32, steps=32)
    >>> solver, z = hlcp.Solver(put.A), np.zeros(put.A.shape[0])
    >>> for k in range(put.lcps):
    ...     z = solver.resume(put.q(k, z)).z
    >>> round(40 * put.price(z, 36 / 40), 3)
    4.485
    """

    A: FivePoint
    lcps: int

    def __init__(self, rate: float, volatility: float, maturity: float, m: int,
                 steps: int) -> None:
        numbers = [number(name, value) for name, value in
                   (("rate", rate), ("volatility", volatility), ("maturity", maturity))]
        self._given = *numbers, count("m", m, 0), count("steps", steps, 0)
        shown, self.lcps = _hlcp.put(self._given)
        self.A = stencil(shown)

    def q(self, k: int, z: ArrayLike) -> NDArray[np.float64]:
        """Return q of an LCP.

        Parameters
        ----------
        k : int
            The number of the LCP, from 0.
        z : array_like
            The z of the LCP before; zeros before the first one.
        """
        entries: NDArray[np.float64] = _hlcp.put_q(self._given, count("k", k, 0), self._field(z))
        return entries

    def price(self, z: ArrayLike, spot: float) -> float:
        """Return the price, in strikes.

        Parameters
        ----------
        z : array_like
            That of the last LCP, or of one before for an earlier maturity.
        spot : float
            In strikes.
        """
        place = number("spot", spot)
        if place is None or not 0.0 < place < np.inf:
            raise ValueError(f"spot is {spot!r}, but it must be positive")
        return _hlcp.put_price(self._given, self._field(z), place)[0]

    def exercise(self, z: ArrayLike) -> float:
        """Return the largest price of the grid, in strikes, at which the put is exercised.

        Parameters
        ----------
        z : array_like
            As for `price`.
        """
        return _hlcp.put_price(self._given, self._field(z), 1.0)[1]

    def _field(self, z: ArrayLike) -> Any:
        entries = vector("z", real("z", z), np.float64)
        if len(entries) != self.A.shape[0]:
            raise ValueError(f"z has {len(entries)} entries, but it must have {self.A.shape[0]}")
        return entries
