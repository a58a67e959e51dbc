"""Horizontal linear complementarity problems on NumPy arrays.

Given square A and B and a vector q, find z and r with ::

    A z - B r + q = 0,    z >= 0,    r >= 0,    z'r = 0.

With B the identity this is the linear complementarity problem.

=================  ==================================================================
`solve`            solves it, on sparse matrices, stencils or products alone
`Solver`           solves for one q after the other, from the last answer
`FivePoint`        a five-point operator on a grid, its arrays borrowed
`certify`          proves how far an answer is from the solution
`film`             pressure and cavitation in a lubricating film, from a map of its gap
`profile`          the same along a line
`Journal`          a journal bearing: its equilibrium, coefficients, motion and proved figures
`Pad`              the same of a pad, a plane, a parabola or a map
`scenes`           problems with known answers
`plot`             draws z and r (needs matplotlib)
`methods`          the names of all methods
=================  ==================================================================

>>> import numpy as np, hlcp
>>> A = hlcp.FivePoint((60, 60), south=-1, west=-1, centre=4, east=-1, north=-1)
>>> q = np.where(np.arange(60) < 20, -0.1, 0.2) * np.ones((60, 1))
>>> result = hlcp.solve(A, None, q)
>>> result.success, result.z.shape
(True, (60, 60))
"""

from importlib.metadata import version

from hlcp import scenes
from hlcp._bearing import (BearingResult, Coefficients, FilmBounds, Journal, MotionResult, Pad,
                           Sensitivity)
from hlcp._film import FilmResult, ProfileResult, film, profile
from hlcp._operators import FivePoint
from hlcp._plot import plot
from hlcp._solve import Certificate, Progress, Result, Solver, Status, certify, methods, solve

__version__ = version("hlcp")

__all__ = [
    "BearingResult",
    "Certificate",
    "Coefficients",
    "FilmBounds",
    "FilmResult",
    "FivePoint",
    "Journal",
    "MotionResult",
    "Pad",
    "ProfileResult",
    "Progress",
    "Result",
    "Sensitivity",
    "Solver",
    "Status",
    "certify",
    "film",
    "methods",
    "plot",
    "profile",
    "scenes",
    "solve",
]
