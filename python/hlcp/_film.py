"""Lubricating films."""

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hlcp import _hlcp
from hlcp._operators import count, number, rank, real, stencil, vector
from hlcp._solve import Result, Solver, Status

Side = float | str | tuple[str, float]
Supply = tuple[tuple[float, float], tuple[float, float], float]


class FilmResult(Result):
    """The answer of `film`: a `Result`, and in SI units

    Attributes
    ----------
    pressure : ndarray of shape (ny, nx)
        The pressure in each cell, in Pa.
    content : ndarray of shape (ny, nx)
        The part of the gap that oil fills, 1 - r.
    load : float
        The integral of the pressure above the ambient one, in N.
    moments : list of float
        Its moments about the middle, of p (x - Lx/2) and of p (y - Ly/2), in N m.
    friction : list of float
        The drag on the lower wall against x, and on the upper wall along x, if the lower one is
        the faster, in N.
    full_friction : list of float
        The same if all of the gap is sheared, as handbooks count it.
    power : float
        The power that moves the walls along the film, in W.
    sides : list of float
        What flows out in the west, east, south and north, in m^3/s.
    supplies : list of float
        What each supply delivers, in m^3/s.
    stored : float
        What a time step adds to the oil in the film, in m^3/s.
    imbalance : float
        What flows out and is stored less what is supplied, in m^3/s.
    peak : float
        The largest pressure, in Pa.
    least_gap : float
        In m.
    broken_share : float
        The part of the area in which the film is broken.
    least_content : float
        The least film content; below 0 the answer is no film.
    feed : float
        Of a steady ring, what enters over what goes round in circles that are broken somewhere;
        infinite without any.
    doubt : str or None
        What makes the figures uncertain although the solve converged.
    """

    pressure: NDArray[np.float64]
    content: NDArray[np.float64]
    load: float
    moments: list[float]
    friction: list[float]
    full_friction: list[float]
    power: float
    sides: list[float]
    supplies: list[float]
    stored: float
    imbalance: float
    peak: float
    least_gap: float
    broken_share: float
    least_content: float
    feed: float
    doubt: str | None


def film(
    gap: ArrayLike,
    *,
    size: tuple[float, float],
    speed: float | tuple[float, float],
    viscosity: ArrayLike,
    ambient: float = 0.0,
    cavitation: float = 0.0,
    west: Side | None = None,
    east: Side | None = None,
    south: Side | None = None,
    north: Side | None = None,
    supplies: Sequence[Supply] = (),
    duration: float | None = None,
    oil: ArrayLike | None = None,
    start: FilmResult | None = None,
    **options: Any,
) -> FilmResult:
    """Compute pressure and cavitation in a lubricating film from its gap, conserving mass.

    Parameters
    ----------
    gap : array_like of shape (ny, nx)
        The gap in each cell, in m: x to the right along a row, y from row to row.
    size : (float, float)
        The extents along x and y, in m.
    speed : float or (float, float)
        The speed of the lower wall, or of the lower and the upper one, along x, in m/s.
    viscosity : float or array_like of shape (ny, nx)
        In Pa s.
    ambient : float
        The pressure around the film, from which the load is counted, in Pa.
    cavitation : float
        The pressure in a broken film, in Pa.
    west, east, south, north : float, "closed", "periodic" or ("starved", float)
        What is at each side: a reservoir at a pressure in Pa (without any, the ambient one), a
        wall, the opposite side, or oil that enters with this film content at the cavitation
        pressure.
    supplies : sequence of ((x, y), (lx, ly), pressure)
        Rectangles that are kept full at a pressure, by their smallest x and y and their size, in m
        and Pa. One with lx = 0 is a groove between two columns of cells.
    duration, oil : float, array_like of shape (ny, nx)
        A time step that ends in this position, in s, and the height of the oil in each cell before
        it, in m: the content times the gap.
    start : FilmResult
        The answer of a similar film on the same grid.
    **options
        Those of `solve`: method, threads, callback, maxiter and so on. Without a method it is
        "AMG", as a bearing's, and "AUTO" where that fails or takes 50 iterations. The tolerance is
        rtol = 1e-12 unless one is given, or four units of the rounding in the residual.

    Returns
    -------
    FilmResult

    Raises
    ------
    ValueError
        For a gap, a viscosity or an extent that is not positive, a pressure below that of
        cavitation, one periodic side without the opposite one, and so on.

    Warns
    -----
    UserWarning
        Of a gap over a millimetre, or under a millionth of the film, a peak above 10 GPa, a
        viscosity of 5 Pa s or more, a film that carries nothing or that nothing feeds, and of
        figures that rounding settles.

    Notes
    -----
    Without `duration` the film is steady. One that nothing feeds runs dry: its content is 0, but 1
    before a closed side towards which a wall carries oil, and where the speeds of the walls cancel.

    Examples
    --------
    A wedge from 40 to 20 micrometres, 50 mm by 30 mm:

    >>> import numpy as np, hlcp
    >>> gap = np.linspace(40e-6, 20e-6, 90) * np.ones((54, 1))
    >>> pad = hlcp.film(gap, size=(0.05, 0.03), speed=3.0, viscosity=0.04)
    >>> pad.success, round(pad.load)
    (True, 865)
    """
    cells = real("gap", gap)
    if cells.ndim != 2:
        raise ValueError(f"gap has {cells.ndim} dimensions, but it must be a map of shape (ny, nx)")
    heights, thickness = vector("gap", cells, np.float64), real("viscosity", viscosity)
    depth = None if oil is None else real("oil", oil)
    for name, array, shapes in (("viscosity", thickness, [(), cells.shape]),
                                ("oil", cells if depth is None else depth, [cells.shape])):
        if array.shape not in shapes:
            raise ValueError(f"{name} has the shape {array.shape}, but the gap has {cells.shape}")
    if start is not None and (not isinstance(start, FilmResult)
                              or start.pressure.shape != cells.shape):
        raise ValueError(f"start must be the answer of a film of the shape {cells.shape}")
    if not isinstance(supplies, Sequence):
        raise ValueError(f"supplies is {supplies!r}, but it must be a list")
    ambient, cavitation = _number("ambient", ambient), _number("cavitation", cavitation)
    if (duration is None) != (oil is None):
        raise ValueError("a time step needs both its duration and the oil before it")
    unsound = np.argwhere(~((cells > 0) & np.isfinite(cells)))
    if len(unsound):
        row, column = unsound[0]
        raise ValueError(f"gap[{row}, {column}] is {cells[row, column]}, but it must be positive and"
                         " finite")
    given = {"west": west, "east": east, "south": south, "north": north}
    _sides_agree(given)
    described = {
        "grid": cells.shape,
        "size": _numbers("size", size, 2),
        "gap": heights,
        "viscosity": vector("viscosity", np.atleast_1d(thickness), np.float64),
        "speeds": [_number("speed", speed), 0.0] if rank(speed) == 0
                  else _numbers("speed", speed, 2),
        "sides": [_side(name, side, ambient) for name, side in given.items()],
        "supplies": [_supply(supply) for supply in supplies],
        "cavitation": cavitation,
        "step": None if depth is None else (_number("duration", duration),
                                             vector("oil", depth, np.float64)),
    }
    of_a, of_b, q, unit, dry = _hlcp.film(described)
    if not {"rtol", "atol", "rounding"} & set(options):
        options |= {"rtol": 1e-12, "rounding": 4.0}
    if start is not None:
        options |= {"z0": (start.pressure - cavitation) / unit, "r0": start.r}
    elif dry is not None:
        options |= {"r0": dry}
    operators, flow = (stencil(of_a), stencil(of_b)), q.reshape(cells.shape)
    is_chosen = {"method", "splitting"} & set(options)
    methods = [options.pop("method", "AUTO")] if is_chosen else ["AMG", "AUTO"]
    # Newton's method takes a dozen steps, or none of thousands helps.
    newton = {"maxiter": min(50, options.get("maxiter", 50))}
    for method in methods:
        limited = options if method == methods[-1] else options | newton
        result = Solver(*operators, method=method).solve(flow, **limited)
        figures, told = _hlcp.film_figures(described, result.z.ravel(), result.r.ravel(), ambient,
                                            result.success)
        is_film = result.success and (oil is not None or figures["least_content"] >= -1e-9)
        if is_film or result.status in {Status.TIME_LIMIT, Status.STOPPED}:
            break
    for text in told:
        warnings.warn(text, stacklevel=2)
    return FilmResult(result, pressure=cavitation + unit * result.z, content=1.0 - result.r,
                      **figures)


@dataclass(frozen=True, slots=True, eq=False)
class ProfileResult:
    """The answer of `profile`, in SI units and per metre of width.

    Attributes
    ----------
    x, h : ndarray of shape (n,)
        The points, also those between the given ones, and the gap there.
    pressure : ndarray of shape (n,)
    content : ndarray of shape (n,)
        The part of the gap that oil fills in the piece that begins at a point.
    flow : ndarray of shape (n - 1,)
        What flows through each piece, the same but for rounding, in m^2/s.
    load : float
        The integral of the pressure above the ambient one, in N/m.
    friction : float
        The drag on the plane, in N/m.
    peak, peak_x : float
        The largest pressure, and where it is.
    ruptures, forms_again : list of float
        Where a full film ruptures and where a broken one forms again, to within a piece.
    success : bool
    message : str
    """

    x: NDArray[np.float64] = field(repr=False)
    h: NDArray[np.float64] = field(repr=False)
    pressure: NDArray[np.float64] = field(repr=False)
    content: NDArray[np.float64] = field(repr=False)
    flow: NDArray[np.float64] = field(repr=False)
    load: float
    friction: float
    peak: float
    peak_x: float
    ruptures: list[float]
    forms_again: list[float]
    success: bool
    message: str


def profile(
    x: ArrayLike,
    h: ArrayLike,
    *,
    speed: float,
    viscosity: float,
    ambient: float = 0.0,
    cavitation: float = 0.0,
    refine: int | None = None,
) -> ProfileResult:
    """Compute a film along a line, above a plane that moves in the direction of x.

    Parameters
    ----------
    x, h : array_like of shape (m,)
        Places, which increase, and the gap there, in m; between them it is a straight line. For a
        step, put two points very close together.
    speed : float
        That of the plane, in m/s, positive.
    viscosity : float
        In Pa s.
    ambient, cavitation : float
        The pressures at both ends and in a broken film, in Pa.
    refine : int
        How many pieces each stretch between two points is cut into; without it none is longer than
        1/400 of the film.

    Returns
    -------
    ProfileResult

    Raises
    ------
    ValueError
        For places that do not increase, gaps that are not positive, and so on.

    Warns
    -----
    UserWarning
        As `film`, of a gap, a peak, a viscosity and figures that rounding settles.

    Examples
    --------
    >>> import hlcp
    >>> line = hlcp.profile([0, 0.02, 0.05], [30e-6, 15e-6, 40e-6], speed=2.0, viscosity=0.03)
    >>> round(line.load), [round(1e3 * x, 1) for x in line.ruptures]
    (23458, [24.8])
    """
    places, gaps = (vector(name, real(name, value), np.float64)
                    for name, value in (("x", x), ("h", h)))
    if len(places) < 2 or len(gaps) != len(places):
        raise ValueError(f"x has {len(places)} numbers and h {len(gaps)}, but both must have the"
                         " same, and two or more")
    at = np.flatnonzero(~(np.diff(places) > 0))
    if len(at):
        last, place = places[at[0]], places[at[0] + 1]
        hint = "; for a step, put two points very close together" if place == last else ""
        raise ValueError(f"x[{at[0] + 1}] is {place}, which does not exceed the x before it,"
                         f" {last}{hint}")
    at = np.flatnonzero(~((gaps > 0) & np.isfinite(gaps)))
    if len(at):
        raise ValueError(f"h[{at[0]}] is {gaps[at[0]]}, but it must be positive and finite")
    conditions = []
    for name, value, is_positive in (("speed", speed, True), ("viscosity", viscosity, True),
                                     ("ambient", ambient, False),
                                     ("cavitation", cavitation, False)):
        conditions.append(_number(name, value))
        if is_positive and conditions[-1] <= 0.0:
            turned = name == "speed" and conditions[-1] < 0.0
            way = "; turn the profile round" if turned else ""
            raise ValueError(f"{name} is {value}, but it must be positive{way}")
    if conditions[2] < conditions[3]:
        raise ValueError(f"ambient is {ambient} Pa, below cavitation, {cavitation} Pa")
    pieces = None if refine is None else count("refine", refine, 1, 65535)
    if pieces == 1 and len(places) == 2:
        raise ValueError("there is no point between the ends to solve for; refine by 2 or more")
    arrays, figures, told = _hlcp.film_line(places, gaps, conditions, pieces)
    for text in told:
        warnings.warn(text, stacklevel=2)
    return ProfileResult(*arrays, *figures)


def _number(name: str, value: Any) -> float:
    """Return a finite number."""
    given = number(name, value)
    if given is None:
        raise ValueError(f"{name} is None, but it must be a real number")
    if not math.isfinite(given):
        raise ValueError(f"{name} is {given}, but it must be finite")
    return given


def _numbers(name: str, values: Any, many: int) -> list[float]:
    if rank(values) != 1 or len(values) != many:
        raise ValueError(f"{name} is {values!r}, but it must be {many} numbers")
    return [_number(name, value) for value in values]


def _is(side: Any, word: str) -> bool:
    return isinstance(side, str) and side == word


def _sides_agree(given: dict[str, Side | None]) -> None:
    for one, other in (("west", "east"), ("south", "north")):
        if _is(given[one], "periodic") != _is(given[other], "periodic"):
            raise ValueError(f"{one} and {other} must both be 'periodic', or neither")


def _side(name: str, side: Side | None, ambient: float) -> tuple[str, float]:
    if _is(side, "closed") or _is(side, "periodic"):
        return str(side), 0.0
    if isinstance(side, (tuple, list)) and len(side) == 2 and _is(side[0], "starved"):
        return "starved", _number(name, side[1])
    try:
        return "pressure", _number(name, ambient if side is None else side)
    except ValueError:
        raise ValueError(f"{name} is {side!r}, but it must be a pressure, 'closed', 'periodic' or"
                         " ('starved', content)") from None


def _supply(supply: Any) -> tuple[Any, Any, Any]:
    try:
        corner, size, pressure = supply
    except (TypeError, ValueError):
        raise ValueError(f"a supply is {supply!r}, but it must be ((x, y), (lx, ly), pressure)"
                         ) from None
    return (_numbers("a supply's corner", corner, 2), _numbers("a supply's size", size, 2),
            _number("a supply's pressure", pressure))
