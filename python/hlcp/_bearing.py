"""Bearings: films under a wall whose position is given, carries a load or moves."""

import itertools
import math
import sys
import threading
import warnings
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hlcp import _hlcp
from hlcp._film import (FilmResult, Side, Supply, _is, _number, _numbers, _side, _sides_agree,
                        _supply)
from hlcp._operators import count, rank, real, vector
from hlcp._plot import axes, plot
from hlcp._solve import Result, Status

Speed = float | tuple[float, float]
Groove = (float | tuple[float, float] | tuple[float, float, float]
          | tuple[float, float, float, float])
Dam = tuple[tuple[float, float], float, float]
Lobes = tuple[int, float] | tuple[int, float, float] | tuple[int, float, float, float]
Pocket = (tuple[tuple[float, float], tuple[float, float], float]
          | tuple[tuple[float, float], tuple[float, float], float, str])
Dimples = (tuple[tuple[int, int], tuple[float, float], float]
           | tuple[tuple[int, int], tuple[float, float], float, str])
Floats = NDArray[np.float64]
Interval = tuple[float, float]


@dataclass(frozen=True, slots=True)
class FilmBounds:
    """What is proved of a film: intervals that hold the figures of the exact solution of the
    equations on its cells, in SI units.

    Attributes
    ----------
    load, peak : (float, float)
    friction : list of (float, float)
        On the moving wall and on the other one.
    sides, supplies : list of (float, float)
        What flows out in the west, east, south and north, and what each supply delivers.
    """

    load: Interval
    friction: list[Interval]
    sides: list[Interval]
    supplies: list[Interval]
    peak: Interval


@dataclass(frozen=True, slots=True)
class Sensitivity:
    """The derivative of what a bearing does by a number, in SI units.

    Attributes
    ----------
    forces : list of float
        Of the forces along the coordinates of `position`.
    load, power, peak : float
    friction, full_friction, sides, supplies, position : list of float
    ecc, attitude : float or None
        As in `BearingResult`; the attitude NaN without a load or an eccentricity.
    """

    forces: list[float]
    load: float
    friction: list[float]
    full_friction: list[float]
    power: float
    sides: list[float]
    supplies: list[float]
    peak: float
    position: list[float]
    ecc: float | None
    attitude: float | None


class BearingResult(FilmResult):
    """The answer of `Journal.film` and `Pad.film`: a `FilmResult` without x, of which differ or are
    new, in SI units

    Attributes
    ----------
    load : float
        What the film carries, in N: of a journal the resultant of both directions.
    at : list of float
        Where it acts, x and y; of a journal the place to which that is pressed.
    friction : list of float
        The drag against the motion on the wall that moves the faster, and on the other one.
    full_friction : list of float
        The same if all of the gap is sheared, as handbooks count it.
    ecc : float or None
        Of a journal its eccentricity over the clearance.
    attitude : float or None
        Of a journal the attitude angle, in degrees; NaN without a load.
    position : list of float
        Of a journal its eccentricity along x = 0 and a quarter further, from there to the widest
        gap, in m; of a pad its rise in m, and its slopes along x and y.
    specific_load : float
        The load over the area, of a journal over its diameter times its length, in Pa.
    sommerfeld, torque : float or None
        Of a journal the Sommerfeld number (R/c)^2 mu N/P, and the moment of the drag on the wall
        that moves the faster, in N m.
    leakage : float
        What leaves the film, in m^3/s: what flows out at sides (side leakage), whatever flows in
        elsewhere on the same side, and what supplies draw.
    temperature_rise : float
        How much warmer the oil leaves if it takes all of the power with it, in K. What supplies
        pump warms it further, by their pressure over density times specific heat.
    reynolds, laminar : float
        The Reynolds number of shear, with the clearance of a journal or the mean gap of a pad, and
        that up to which it is laminar.
    films : int
        How many films the search for the load took.
    bounds : FilmBounds or None
        What is proved with ``certify=True``.
    range : FilmBounds or None
        What is proved of all films within `tolerance`.
    proof : str
        What was proved, or why nothing was; empty unless it was asked for.
    """

    at: list[float]
    ecc: float | None
    attitude: float | None
    position: list[float]
    specific_load: float
    sommerfeld: float | None
    torque: float | None
    leakage: float
    temperature_rise: float
    reynolds: float
    laminar: float
    films: int
    bounds: FilmBounds | None
    range: FilmBounds | None
    proof: str
    _walled: dict[str, Any]
    _how: dict[str, Any]
    # By the frequency over the running speed, and without one by the clamp.
    _known: dict[float | None, tuple[Floats, Floats]]
    _told: list[str]
    _carries: Any
    _shape: dict[str, Any]

    @property
    def stiffness(self) -> Floats:
        """Stiffness, the change of each force against each coordinate, in N/m (a pad's slopes have
        no unit): of a journal along the load and across it, a quarter further in the direction of
        the motion; of a pad for its rise and the slopes along x and y. It is for slow motions;
        `coefficients` has it at any frequency."""
        return self._coefficients(0.0)[0]

    @property
    def damping(self) -> Floats:
        """Damping, the same by the speed of each coordinate, in N s/m."""
        return self._coefficients(0.0)[1]

    @property
    def clamped(self) -> tuple[Floats, Floats]:
        """Stiffness and damping by the clamp of published tables, z >= 0 without a balance of
        mass."""
        return self._coefficients(None)

    def coefficients(self, frequency: float) -> tuple[Floats, Floats]:
        """Compute stiffness and damping for motions at a frequency.

        Parameters
        ----------
        frequency : float
            That of the motion over the running speed; 0 for slow motions.

        Returns
        -------
        (ndarray, ndarray)
            Along the coordinates of `stiffness`: K and C of the force against a motion
            d exp(i w t), which is (K + i w C) d exp(i w t).

        Raises
        ------
        ValueError
            For a film that is not solved, that nothing feeds, or of more than 300,000 cells.

        Examples
        --------
        >>> import hlcp
        >>> bearing = hlcp.Journal(0.1, 0.05, 1e-4, grooves=[0], nx=60, ny=10)
        >>> film = bearing.film(rpm=3000, viscosity=0.02, load=1000)
        >>> film.coefficients(0.5)[0].shape, [round(figure, 3) for figure in film.threshold]
        ((2, 2), [667.317, 0.505])
        """
        return self._coefficients(_frequency(frequency))

    @property
    def threshold(self) -> tuple[float, float] | None:
        """Of a journal the mass of a rigid rotor on this bearing above which it whirls by itself,
        in kg (critical mass), and the frequency of that over the running speed (whirl frequency
        ratio), from the coefficients at this frequency; None where none is found up to twice the
        running speed. Of a mass of 0 a rotor of any mass leaves its place: it whirls, a light one
        at about this frequency, or at a frequency of 0 the film pushes it away (static
        instability). `ValueError` for a film that nothing feeds, and a journal at rest."""
        if not self.success or self._walled["journal"] is None:
            raise ValueError("a threshold is that of a journal, solved")
        found = _hlcp.bearing_threshold(self._stored())
        return None if found is None else (found[0], found[1])

    def _coefficients(self, frequency: float | None) -> tuple[Floats, Floats]:
        known = self._known
        if frequency not in known:
            if not self.success:
                raise ValueError(f"the film has no coefficients, because it is not solved:"
                                 f" {self.message}")
            stiffness, damping = _hlcp.bearing_coefficients(
                self._stored(), frequency, self._how)
            known[frequency] = np.array(stiffness), np.array(damping)
        return known[frequency]

    def sensitivities(self, *, gaps: dict[str, ArrayLike] | None = None,
                      position: bool = False) -> dict[str, Sensitivity]:
        """Compute the derivatives of the figures by the numbers that the bearing depends on, exact
        but for rounding, each by one linear solve.

        Parameters
        ----------
        gaps : dict of array_like of shape (ny, nx)
            More numbers, by name: what a unit of each adds to the gap in each cell.
        position : bool
            Whether the wall stays where it is though a load was asked for. Without it the position
            follows that load.

        Returns
        -------
        dict of Sensitivity
            By ``speed`` and ``upper_speed``, of the lower and the upper wall, in m/s;
            ``viscosity``, of all cells alike; ``clearance``, the eccentricity over it kept;
            ``ambient``, the pressure from which loads are counted and that of all sides and
            supplies that are at it; ``cavitation``; ``west`` to ``north``, the pressure or the
            content there; ``supplies[k]``, a pressure, those of `grooves` after the others;
            ``pockets[k]`` and ``dimples[k]``, a depth; in a fixed position also ``ecc``, or
            ``rise``, ``slope_x`` and ``slope_y``.

        Raises
        ------
        ValueError
            For a film that is not solved, that nothing feeds, or arrays of another shape.

        Notes
        -----
        A film has kinks where a cell begins to break: the derivatives are those between.

        Examples
        --------
        >>> import hlcp
        >>> bearing = hlcp.Journal(0.1, 0.05, 1e-4, grooves=[0], nx=60, ny=10)
        >>> found = bearing.film(rpm=3000, viscosity=0.02, load=1000).sensitivities()
        >>> round(found["clearance"].ecc * 1e-5, 4)      # with 10 um more
        0.043
        """
        if not self.success:
            raise ValueError(f"the film has no derivatives, because it is not solved:"
                             f" {self.message}")
        grid, patterns = self.pressure.shape, [*_depths(self._shape)]
        for name, gap in (gaps or {}).items():
            array = real(f"gaps[{name!r}]", gap)
            if array.shape != grid:
                raise ValueError(f"gaps[{name!r}] has the shape {array.shape}, but the film has"
                                 f" {grid}")
            patterns.append((name, vector(f"gaps[{name!r}]", array, np.float64)))
        carries = None if position else self._carries
        found = _hlcp.bearing_sensitivities(self._stored(), carries, patterns)
        return {name: Sensitivity(*slopes) for name, slopes in found}

    def _stored(self) -> tuple[Any, Any, Any]:
        """Return the film, z and r, as the compiled half takes them."""
        return self._walled, self.z.ravel(), self.r.ravel()

    def plot(self, ax: Any = None) -> Any:
        """Draw the pressure, the void where the film is broken, and the supplies.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
            Where to draw; new axes without it.

        Returns
        -------
        matplotlib.axes.Axes
            In degrees around a journal, else in mm.
        """
        walled = self._walled
        film = walled["film"]
        is_journal = walled["journal"] is not None
        by = [360.0 / film["size"][0] if is_journal else 1e3, 1e3]
        width, height = (length * unit for length, unit in zip(film["size"], by))
        ax = plot(self.pressure / 1e6, self.r, ax=ax, extent=(0.0, width, 0.0, height),
                  labels=("pressure, MPa", "void"))
        for corner, size, _ in film["supplies"]:
            (x, y), (lx, ly) = ([v * unit for v, unit in zip(pair, by)] for pair in (corner, size))
            ax.plot([x, x + lx, x + lx, x, x], [y, y, y + ly, y + ly, y], color="tab:orange",
                    clip_on=False)
        if is_journal and not math.isnan(self.at[0]):
            ax.axvline(self.at[0] * by[0], color="tab:red", linestyle=":")
        ax.set(xlim=(0.0, width), ylim=(0.0, height), ylabel="y, mm",
               xlabel="x, degrees" if is_journal else "x, mm")
        if is_journal:
            ax.set_xticks(range(0, 361, 60))
        return ax


@dataclass(frozen=True, slots=True, eq=False)
class MotionResult:
    """What a bearing does while its wall moves, in SI units: a row for each time but the first.

    Attributes
    ----------
    times : ndarray of shape (n,)
    load, power, supplied, oil, peak, least_gap, broken_share : ndarray of shape (n,)
        The power is also that which moves the wall, and `supplied` a mean over the step; `oil` is
        what the film holds, in m^3. All else is that at the end of the step.
    at, friction : ndarray of shape (n, 2)
    sides : ndarray of shape (n, 4)
        The means of what flows out over a step: with `supplied` they are what `oil` gains.
    position : ndarray of shape (n, 2) or (n, 3)
        Of a journal its displacement along the load and across it, in m; of a pad its rise and its
        slopes along x and y.
    imbalance : float
        What the oil has gained beyond what flowed in, by time, in m^3/s.
    success : bool
        Whether all steps converged.
    film : BearingResult
        The film after the last step.
    """

    times: Floats
    load: Floats
    at: Floats
    friction: Floats
    power: Floats
    sides: Floats
    supplied: Floats
    oil: Floats
    peak: Floats
    least_gap: Floats
    broken_share: Floats
    position: Floats
    imbalance: float
    success: bool
    film: BearingResult

    def plot(self, ax: Any = None) -> Any:
        """Draw the orbit of a journal in its clearance, the load pointing down, or the rise of a
        pad.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
            Where to draw; new axes without it.

        Returns
        -------
        matplotlib.axes.Axes
        """
        ax = axes(ax)
        journal = self.film._walled["journal"]
        if journal is None:
            ax.plot(self.times, 1e6 * self.position[:, 0])
            ax.set(xlabel="time, s", ylabel="rise, um")
            return ax
        along, across = (self.position / journal[2]).T
        around = np.linspace(0.0, 2 * np.pi, 181)
        ax.plot(across, -along)
        ax.plot(np.cos(around), np.sin(around), color="tab:gray")
        ax.set(xlabel="across the load, clearances", ylabel="against the load, clearances",
               aspect="equal")
        return ax


@dataclass(frozen=True, slots=True, eq=False)
class Coefficients:
    """Stiffness and damping of a row of films.

    Attributes
    ----------
    omega : ndarray of shape (n,)
        The angular speeds of a journal, in rad/s; of a pad the speeds of its wall, in m/s.
    load, ecc, attitude : ndarray of shape (n,)
        As in `BearingResult`; of a pad NaN but for the load.
    stiffness, damping : ndarray of shape (n, 2, 2), of a pad (n, 3, 3)
        As in `BearingResult`; NaN where a film did not converge.
    films : list of BearingResult
    """

    omega: Floats
    load: Floats
    ecc: Floats
    attitude: Floats
    stiffness: Floats
    damping: Floats
    films: list[BearingResult]


class _Bearing:
    """What a journal and a pad have in common."""

    _given: dict[str, Any]
    _grid: tuple[int, int]
    _size: tuple[float, float]
    _gap: Floats
    _of_journal: tuple[float, float, float, list[float], Any] | None
    _film: dict[str, Any]
    _shape: dict[str, Any]
    _ambient: float
    _oil: list[float]
    # Options that a sweep may give lists of: those of film(), and those of the bearing.
    _of_film: tuple[str, ...]
    _of_bearing: tuple[str, ...]

    @property
    def gap(self) -> Floats:
        """The gap in each cell, in m, of a journal in the middle of its bearing."""
        return self._gap.reshape(self._grid).copy()

    def replace(self, **changes: Any) -> Self:
        """Return the same bearing with other options.

        Parameters
        ----------
        **changes
            Those of the class.
        """
        return type(self)(**{**self._given, **changes})

    def __repr__(self) -> str:
        given = (f"{name}={value!r}" for name, value in self._given.items()
                 if value is not None and value != ())
        return f"{type(self).__name__}({', '.join(given)})"

    def _build(self, shape: dict[str, Any], sides: dict[str, Side | None], supplies: Any,
               roughness: Any, pockets: Any, dimples: Any, ambient: Any, cavitation: Any,
               oil: Any) -> None:
        self._oil = _numbers("oil", oil, 2)
        if min(self._oil) <= 0.0:
            raise ValueError(f"oil is {oil!r}, but it must be a density in kg/m^3 and a specific"
                             " heat in J/(kg K), both positive")
        self._ambient, cavitation = _number("ambient", ambient), _number("cavitation", cavitation)
        if self._ambient < cavitation:
            raise ValueError(f"ambient is {ambient} Pa, below cavitation, {cavitation} Pa")
        self._shape = {
            "journal": None, "plane": None, "taper": None, "parabola": None, "map": None, **shape,
            "grid": self._grid, "size": self._size,
            "roughness": None if roughness is None else self._map("roughness", roughness),
            "pockets": [_pocket(f"pockets[{k}]", pocket)
                        for k, pocket in enumerate(_listed("pockets", pockets))],
            "dimples": [_dimples(f"dimples[{k}]", array)
                        for k, array in enumerate(_listed("dimples", dimples))],
        }
        self._gap = _hlcp.film_gap(self._shape)
        self._of_journal = shape.get("journal")
        self._film = {
            "grid": self._grid, "size": self._size, "gap": self._gap, "cavitation": cavitation,
            "sides": [_side(name, side, self._ambient) for name, side in sides.items()],
            "supplies": [_supply(supply) for supply in _listed("supplies", supplies)],
            "step": None,
        }

    def _map(self, name: str, value: Any) -> Any:
        array = real(name, value)
        if array.shape != self._grid:
            raise ValueError(f"{name} has the shape {array.shape}, but the film has {self._grid}")
        return vector(name, array, np.float64)

    def _walled(self, speeds: list[float], viscosity: Any, position: list[float]
                ) -> dict[str, Any]:
        if viscosity is None:
            raise ValueError("viscosity is missing; it is in Pa s")
        thickness = real("viscosity", viscosity)
        if thickness.shape not in [(), self._grid]:
            raise ValueError(f"viscosity has the shape {thickness.shape}, but the film has"
                             f" {self._grid}")
        thickness = vector("viscosity", np.atleast_1d(thickness), np.float64)
        unsound = np.flatnonzero(~((thickness > 0) & np.isfinite(thickness)))
        if len(unsound):
            at = unsound[0]
            where = f"viscosity[{at // self._grid[1]}, {at % self._grid[1]}]"
            raise ValueError(f"{where if rank(viscosity) else 'viscosity'} is {thickness[at]},"
                             " but it must be positive, in Pa s")
        return {"film": {**self._film, "viscosity": thickness, "speeds": speeds},
                "ambient": self._ambient, "journal": self._of_journal, "position": position,
                "oil": self._oil,
                **{shape: self._shape[shape] for shape in ("plane", "taper", "parabola")}}

    def _solved(self, walled: dict[str, Any], carries: Any, start: BearingResult | None,
                method: Any, threads: Any, certify: bool, tolerance: Any) -> BearingResult:
        """Solve for a film; nothing is warned of."""
        how = _how(method, threads)
        part = _optional("tolerance", tolerance)
        if part is not None and not 0.0 <= part <= 0.5:
            raise ValueError(f"tolerance is {part}, but it must be a part from 0 to 0.5; 1e-3 is a"
                             " thousandth")
        begin = None if start is None else start._stored()
        found = _hlcp.bearing_film(walled, carries, begin, how)
        result = self._result({**walled, "position": found["position"]}, found, how)
        result.__dict__["_carries"] = carries
        if certify:
            result["proof"], proved = _hlcp.bearing_bounds(result._stored(), None)
            result["bounds"] = None if proved is None else _bounds(proved)
        if part is not None and result.success:
            said, proved = _hlcp.bearing_bounds(result._stored(), part)
            result["proof"] = "; ".join(filter(None, [result.proof, said]))
            result["range"] = None if proved is None else _bounds(proved)
        return result

    def _result(self, walled: dict[str, Any], found: dict[str, Any], how: Any) -> BearingResult:
        status, told = Status[found.pop("status").upper()], found.pop("warnings")
        for name in ("z", "r", "pressure"):
            found[name] = found[name].reshape(self._grid)
        result = BearingResult(
            found, success=status is Status.CONVERGED, status=status, content=1.0 - found["r"],
            bounds=None, range=None, proof="")
        # Apart from the entries that are shown.
        result.__dict__.update(_walled=walled, _how=how, _known={}, _carries=None,
                               _shape=self._shape, _told=told)
        return result

    def _start(self, start: Any) -> BearingResult | None:
        if start is None:
            return None
        if not isinstance(start, BearingResult) or start.pressure.shape != self._grid or (
                start._walled["journal"] is None) != (self._of_journal is None):
            raise ValueError(f"start must be the answer of a {type(self).__name__} of the shape"
                             f" {self._grid}")
        return start if start.success else None

    def _moved(self, walled: dict[str, Any], times: Any, rows: Any, driven: Any, method: Any,
               threads: Any) -> MotionResult:
        at, how = real("times", times), _how(method, threads)
        if at.ndim != 1 or len(at) < 2 or not np.all(np.diff(at) > 0):
            raise ValueError("times must be two numbers or more, each above the one before, in s")
        if len(rows) != len(at):
            raise ValueError(f"there are {len(rows)} rows of positions or loads, but {len(at)}"
                             " times")
        if not np.all(np.isfinite(rows)):
            raise ValueError("positions and loads must be finite numbers")
        steps, imbalance, success, last = _hlcp.bearing_motion(
            walled, at.tolist(), rows.tolist(), driven, how)
        film = {**walled["film"], "step": last.pop("step")}
        walled = {**walled, "film": film, "position": last["position"]}
        table = np.array(steps)
        supplied, oil, peak, least_gap, broken_share = table[:, 10:15].T
        return MotionResult(
            at[1:].astype(np.float64), table[:, 0], table[:, 1:3], table[:, 3:5], table[:, 5],
            table[:, 6:10], supplied, oil, peak, least_gap, broken_share, table[:, 15:], imbalance,
            success, self._result(walled, last, how))

    def _run(self, options: dict[str, Any], start: BearingResult | None,
             guess: Floats | None) -> BearingResult:
        raise NotImplementedError

    def _row(self, runs: list[dict[str, Any]], threads: Any, progress: bool | None,
             frequencies: list[float | None] | None) -> list[BearingResult | ValueError]:
        """Solve for films, each from the one before, in as many rows as there are threads; perhaps
        with coefficients."""
        threads = count("threads", threads, 1)
        done: list[BearingResult | ValueError | None] = [None] * len(runs)
        cuts = np.linspace(0, len(runs), min(threads, len(runs)) + 1).round().astype(int)
        over = threading.Event()
        with _Bar(len(runs), progress) as bar:

            def chain(first: int, last: int) -> None:
                past: list[tuple[dict[str, Any], BearingResult]] = []
                for k in range(first, last):
                    if over.is_set():
                        return
                    options = dict(runs[k])
                    changes = {name: options.pop(name) for name in self._of_bearing
                               if name in options}
                    try:
                        of = self.replace(**changes) if changes else self
                        film = of._run(options, past[-1][1] if past else None,
                                       _ahead(past, runs[k]))
                        if frequencies is not None and film.success:
                            film._coefficients(frequencies[k])
                        done[k] = film
                        past = [*past[-3:], (runs[k], film)] if film.success else []
                    except ValueError as error:
                        done[k], past = error, []
                    bar.step()

            pairs = list(itertools.pairwise(cuts.tolist()))
            if len(pairs) == 1:
                chain(*pairs[0])
            else:
                with ThreadPoolExecutor(len(pairs)) as pool:
                    try:
                        for future in [pool.submit(chain, *pair) for pair in pairs]:
                            future.result()
                    finally:
                        over.set()
        return [film for film in done if film is not None]

    def sweep(self, *, coefficients: bool = False, keep: bool = False, threads: int = 1,
              progress: bool | None = None, **options: Any) -> list[dict[str, Any]]:
        """Solve for the films of all combinations of lists, each from its neighbour.

        Parameters
        ----------
        coefficients : bool
            Whether stiffness and damping are computed.
        keep : bool
            Whether a record has its `BearingResult`, as ``film``.
        threads : int
            How many rows of films are solved at the same time. Each starts from the film before
            it, so that the number of threads shows in the last digits.
        progress : bool
            Whether a bar shows on standard error how far it is; without it on a terminal only.
        **options
            Those of `film`, and of the bearing its extents, clearance, ambient and cavitation:
            each a number, or a list, of which every number is tried.

        Returns
        -------
        list of dict
            A record for each combination, those of the last list the fastest: what the lists had,
            and load, ecc and attitude (of a pad rise and slopes), friction on the moving wall,
            power, peak, least_gap, broken_share, leakage, supplied (the sum of `supplies`), success
            and message, in SI units. Where no position carries a load the figures are NaN, and `message` says so.

        Raises
        ------
        ValueError
            For an option that is no number and no list of them, and for what is wrong with all of
            the films alike.

        Examples
        --------
        >>> import hlcp
        >>> bearing = hlcp.Journal(0.1, 0.05, 1e-4, grooves=[0], nx=60, ny=10)
        >>> records = bearing.sweep(rpm=[1500, 3000], load=[500, 1000], viscosity=0.02)
        >>> for run in records:
        ...     print(run["rpm"], run["load"], round(run["ecc"], 3), round(run["power"]))
        1500 500 0.291 181
        1500 1000 0.45 187
        3000 500 0.164 732
        3000 1000 0.291 725
        """
        lists: dict[str, list[Any]] = {}
        fixed = {}
        for name, value in options.items():
            if name not in self._of_film + self._of_bearing:
                known = ", ".join(self._of_film + self._of_bearing)
                raise ValueError(f"there is no option {name} to sweep; there are {known}")
            if rank(value) == 1 and name != "at":
                lists[name] = real(name, value).tolist()
                if not lists[name]:
                    raise ValueError(f"{name} is an empty list")
            else:
                fixed[name] = value
        runs = [dict(zip(lists, values)) for values in itertools.product(*lists.values())]
        # A way through all of them on which one option changes at a time, to the next value.
        way = list(_snake([len(values) for values in lists.values()]))
        found = self._row([{**fixed, **runs[k]} for k in way], threads, progress,
                          [0.0] * len(runs) if coefficients else None)
        errors = [film for film in found if isinstance(film, ValueError)]
        if len(errors) == len(runs) and len({str(error) for error in errors}) == 1:
            raise errors[0]
        records: list[dict[str, Any]] = [{}] * len(runs)
        for k, film in zip(way, found):
            records[k] = {**runs[k], **self._record(film, coefficients), **runs[k]}
            if keep:
                records[k]["film"] = film if isinstance(film, BearingResult) else None
        return records

    def _record(self, film: BearingResult | ValueError, coefficients: bool) -> dict[str, Any]:
        is_journal = self._of_journal is not None
        place = ("ecc", "attitude") if is_journal else ("rise", "slope_x", "slope_y")
        names = ("load", *place, "friction", "power", "peak", "least_gap", "broken_share",
                 "leakage", "supplied")
        order = 2 if is_journal else 3
        if isinstance(film, ValueError):
            record = dict.fromkeys(names, math.nan) | {"success": False, "message": str(film)}
            pair = np.full((2, order, order), np.nan)
        else:
            where = [film.ecc, film.attitude] if is_journal else film.position
            figures = [film.load, *where, film.friction[0], film.power, film.peak, film.least_gap,
                       film.broken_share, film.leakage, sum(film.supplies)]
            record = dict(zip(names, figures)) | {"success": film.success, "message": film.message}
            pair = np.array(film._coefficients(0.0) if coefficients and film.success
                            else np.full((2, order, order), np.nan))
        if coefficients:
            record |= {"stiffness": pair[0], "damping": pair[1]}
        return record

    def _coefficients(self, options: dict[str, Any], frequency: Any, clamped: bool, threads: Any,
                      progress: bool | None) -> Coefficients:
        options = {**options, "frequency": 0.0 if frequency is None else frequency}
        if clamped and frequency is not None:
            raise ValueError("by the clamp coefficients are those for slow motions; leave frequency"
                             " or clamped out")
        given = {name: real(name, value) for name, value in options.items() if value is not None}
        for name, array in given.items():
            if array.ndim > 1:
                raise ValueError(f"{name} has the shape {array.shape}, but it must be a number or"
                                 " (n,)")
        try:
            arrays = dict(zip(given, np.broadcast_arrays(*given.values())))
        except ValueError:
            shapes = ", ".join(f"{name} {array.shape}" for name, array in given.items())
            raise ValueError(f"the arrays have shapes that do not fit: {shapes}") from None
        runs = [dict(zip(arrays, values))
                for values in zip(*(np.atleast_1d(array).tolist() for array in arrays.values()))]
        at: list[float | None] = [_frequency(run.pop("frequency")) for run in runs]
        if clamped:
            at = [None] * len(runs)
        found = self._row(runs, threads, progress, at)
        films = []
        for options, film in zip(runs, found):
            if isinstance(film, ValueError):
                told = ", ".join(f"{name}={value:g}" for name, value in options.items())
                raise ValueError(f"with {told}: {film}") from film
            films.append(film)
        order = 3 if self._of_journal is None else 2
        nothing = np.full((2, order, order), np.nan)
        pairs = np.array([film._coefficients(whirl) if film.success else nothing
                          for film, whirl in zip(films, at)])

        def each(value: Any) -> Floats:
            return np.array([value(film) for film in films], dtype=np.float64)

        def omega(film: BearingResult) -> float:
            walled = film._walled
            speed = float(walled["film"]["speeds"][0])
            return speed if self._of_journal is None else speed / (self._of_journal[0] / 2)

        return Coefficients(
            omega=each(omega), load=each(lambda film: film.load), ecc=each(lambda film: film.ecc),
            attitude=each(lambda film: film.attitude), stiffness=pairs[:, 0], damping=pairs[:, 1],
            films=films)


class Journal(_Bearing):
    """A journal in a bearing, over ny by nx cells: x runs around it, y along it.

    Parameters
    ----------
    diameter, length : float
        Of the journal and of the bearing, in m.
    clearance : float
        The radial clearance, in m.
    lobes : (int, float), (int, float, float) or (int, float, float, float)
        A bush of so many arcs with the radius of `clearance`, elliptical (lemon bore), of three or
        four lobes, or offset halves: their number; how far their centres are from the middle, over
        the clearance (preload); where each is narrowest, from 0 where it begins to 1 where it ends,
        0.5 if not given; and the middle of one of them in degrees from x = 0, 0 if not given.
    grooves : sequence of float or (float, float[, float[, float]])
        Axial grooves: the angle from x = 0 in degrees; the pressure in Pa, ambient if not given;
        the width in degrees, none if not given; and the length in m, that of the bearing if not
        given.
    dams : sequence of ((float, float), float, float)
        Pressure dams, pockets in the middle of the bearing that end in a step: the angles in
        degrees from where to where, in the direction of x, the length and the depth in m.
    supplies : sequence of ((x, y), (lx, ly), pressure)
        Rectangles that are kept full, as in `film`.
    pockets : sequence of ((x, y), (lx, ly), depth) or ((x, y), (lx, ly), depth, "ellipse")
        Rectangles, or the ellipses in them, by which the gap is deeper, in m.
    dimples : sequence of ((kx, ky), (lx, ly), depth) or ((kx, ky), (lx, ly), depth, "ellipse")
        Even arrays of so many along x and y.
    roughness : array_like of shape (ny, nx)
        What is added to the gap, in m: of a bush that is not round, too.
    tilt : (float, float)
        How the eccentricity grows along y, along x = 0 and a quarter further (misalignment).
    south, north : float, "closed", "periodic" or ("starved", float)
        The ends of the bearing, as in `film`.
    ambient, cavitation : float
        The pressure around the film, from which loads are counted, and that in a broken
        (cavitated) film, in Pa.
    oil : (float, float)
        Its density in kg/m^3 and specific heat in J/(kg K), for `reynolds` and `temperature_rise`.
    nx, ny : int
        Cells around the journal and along it.

    Raises
    ------
    ValueError
        For extents that are not positive, pockets and supplies that are not in the film, pressures
        below that of cavitation, and so on.

    Examples
    --------
    >>> import hlcp
    >>> bearing = hlcp.Journal(diameter=0.1, length=0.1, clearance=1e-4, grooves=[0], nx=180, ny=30)
    >>> film = bearing.film(rpm=3000, viscosity=0.02, load=5000)
    >>> f"{film.ecc:.6f} {film.attitude:.4f}"
    '0.244362 71.3895'
    """

    _of_film = ("rpm", "speed", "viscosity", "load", "ecc", "attitude", "method")
    _of_bearing = ("diameter", "length", "clearance", "ambient", "cavitation")

    def __init__(
        self,
        diameter: float,
        length: float,
        clearance: float,
        *,
        lobes: Lobes | None = None,
        grooves: Sequence[Groove] = (),
        dams: Sequence[Dam] = (),
        supplies: Sequence[Supply] = (),
        pockets: Sequence[Pocket] = (),
        dimples: Sequence[Dimples] = (),
        roughness: ArrayLike | None = None,
        tilt: tuple[float, float] = (0.0, 0.0),
        south: Side | None = None,
        north: Side | None = None,
        ambient: float = 0.0,
        cavitation: float = 0.0,
        oil: tuple[float, float] = (870.0, 1950.0),
        nx: int = 360,
        ny: int = 60,
    ) -> None:
        self._given = {name: value for name, value in locals().items()
                       if name not in ("self", "__class__")}
        self._grid = _cells(ny, nx)
        sizes = [_positive(name, value) for name, value in
                 (("diameter", diameter), ("length", length), ("clearance", clearance))]
        self._size = math.pi * sizes[0], sizes[1]
        sides: dict[str, Side | None] = {"west": "periodic", "east": "periodic", "south": south,
                                         "north": north}
        _sides_agree(sides)
        around = [_groove(f"grooves[{k}]", groove, ambient, sizes[1])
                  for k, groove in enumerate(_listed("grooves", grooves))]
        cuts = [(*self._patch(angle - width / 2.0, width, along), pressure)
                for angle, pressure, width, along in around]
        steps = [_dam(f"dams[{k}]", dam) for k, dam in enumerate(_listed("dams", dams))]
        dug = [(*self._patch(start, end - start, along), depth)
               for start, end, along, depth in steps]
        journal = sizes[0], sizes[1], sizes[2], _numbers("tilt", tilt, 2), _lobes(lobes)
        self._build({"journal": journal}, sides, [*_listed("supplies", supplies), *cuts],
                    roughness, [*_listed("pockets", pockets), *dug], dimples, ambient, cavitation, oil)

    def _patch(self, start: float, arc: float, along: float
               ) -> tuple[tuple[float, float], tuple[float, float]]:
        """Return the corner and the size of a rectangle from an angle on, in the middle."""
        width, length = self._size
        return (start / 360.0 % 1.0 * width, (length - along) / 2.0), (arc / 360.0 * width, along)

    def film(
        self,
        *,
        viscosity: ArrayLike,
        rpm: float | None = None,
        speed: Speed | None = None,
        load: float | None = None,
        ecc: float | None = None,
        attitude: float | None = None,
        start: BearingResult | None = None,
        method: str = "AMG",
        threads: int = 1,
        certify: bool = False,
        tolerance: float | None = None,
    ) -> BearingResult:
        """Compute the film at an eccentricity, or where it carries a load.

        Parameters
        ----------
        viscosity : float or array_like of shape (ny, nx)
            In Pa s.
        rpm : float
            The speed in turns per minute.
        speed : float or (float, float)
            Instead, that of the surface, or of the journal and the bearing, in m/s.
        load : float
            What it is to carry, in N. A `ValueError` says that no position was found.
        ecc : float
            The eccentricity over the clearance; with `load` where the search begins.
        attitude : float
            In degrees in the direction of the motion. With `ecc` alone it is how far the widest
            gap is from x = 0, from where grooves are counted; without it that is x = 0. With
            `load` it is how far x = 0 is from the place opposite the load, so that grooves keep
            their places; without it they turn with the widest gap, as do lobes, dams and pockets.
            ``film(load=W, attitude=0)`` and ``film(ecc=e, attitude=a)`` with the eccentricity and attitude of that are the same
            film.
        start : BearingResult
            The answer of a similar bearing on as many cells.
        method : str
            One of `methods` that needs no parameters.
        threads : int
            How many threads share the sweeps.
        certify : bool
            Whether bounds on load, friction, flows and peak are proved.
        tolerance : float
            Proves the range of these over all films whose gap, viscosity, speeds and supplies'
            pressures, each as a whole, are within this part.

        Returns
        -------
        BearingResult

        Raises
        ------
        ValueError
            For numbers that are no bearing, a film that nothing drives, and a load that no
            position is found for.

        Warns
        -----
        UserWarning
            As `hlcp.film`, and of a film that nothing feeds.
        """
        options = {"viscosity": viscosity, "rpm": rpm, "speed": speed, "load": load, "ecc": ecc,
                   "attitude": attitude, "method": method}
        film = self._run(options, self._start(start), None, threads, certify, tolerance)
        for text in film._told:
            warnings.warn(text, stacklevel=2)
        return film

    def _run(self, options: dict[str, Any], start: BearingResult | None,
             guess: Floats | None = None, threads: Any = 1, certify: bool = False,
             tolerance: Any = None) -> BearingResult:
        given = {name: options.get(name) for name in self._of_film}
        force, ecc = _force(given["load"]), _eccentricity(given["ecc"])
        attitude = _optional("attitude", given["attitude"])
        if force is None and ecc is None:
            raise ValueError("a journal needs its position: give ecc, from 0 to below 1, or load")
        assert self._of_journal is not None
        clearance, turn = self._of_journal[2], math.radians(attitude or 0.0)
        speeds = self._speeds(given["rpm"], given["speed"])
        along = [(self._half() if ecc is None else ecc) * clearance, 0.0]
        if force is None:
            turn *= -1.0 if sum(speeds) < 0 else 1.0
            along = [along[0] * math.cos(turn), along[0] * math.sin(turn)]
        elif start is not None and ecc is None:
            along = [clearance * at for at in (_relative(start) if guess is None else guess)]
            if attitude is None:
                along = [math.hypot(*along), 0.0]
        carries = None if force is None else (force, None, attitude)
        return self._solved(self._walled(speeds, given["viscosity"], along), carries, start,
                            given["method"], threads, certify, tolerance)

    def _half(self) -> float:
        """Return half of the way to the bush, in clearances, where searches begin."""
        assert self._of_journal is not None
        _, length, clearance, tilt, lobes = self._of_journal
        preload = 0.0 if lobes is None else lobes[1]
        return 0.5 * max(1.0 - preload - math.hypot(*tilt) * length / 2.0 / clearance, 0.0)

    def _speeds(self, rpm: Any, speed: Any) -> list[float]:
        if rpm is None:
            return _walls(speed)
        if speed is not None:
            raise ValueError("give rpm or speed, not both")
        assert self._of_journal is not None
        return [math.pi * self._of_journal[0] * _number("rpm", rpm) / 60.0, 0.0]

    def coefficients(
        self,
        *,
        viscosity: ArrayLike,
        rpm: ArrayLike | None = None,
        speed: ArrayLike | None = None,
        load: ArrayLike | None = None,
        ecc: ArrayLike | None = None,
        attitude: ArrayLike | None = None,
        frequency: ArrayLike | None = None,
        clamped: bool = False,
        threads: int = 1,
        progress: bool | None = None,
    ) -> Coefficients:
        """Compute stiffness and damping for arrays of speeds, loads and so on, each film from the
        one before.

        Parameters
        ----------
        viscosity, rpm, speed, load, ecc, attitude : float or array_like of shape (n,)
            As in `film`.
        frequency : float or array_like of shape (n,)
            That of the motion over the running speed; without it they are for slow motions.
        clamped : bool
            Whether they are by the clamp of published tables, for slow motions, without a balance
            of mass.
        threads, progress
            As in `sweep`.

        Returns
        -------
        Coefficients
            Along the load and across it.

        Examples
        --------
        >>> import hlcp
        >>> bearing = hlcp.Journal(0.1, 0.05, 1e-4, grooves=[0], nx=60, ny=10)
        >>> found = bearing.coefficients(rpm=[1500, 3000, 4500], viscosity=0.02, load=1000)
        >>> found.stiffness.shape, bool((found.damping[:, 0, 0] > 0).all())
        ((3, 2, 2), True)
        """
        options = {"viscosity": viscosity, "rpm": rpm, "speed": speed, "load": load, "ecc": ecc,
                   "attitude": attitude}
        return self._coefficients(options, frequency, clamped, threads, progress)

    def motion(
        self,
        times: ArrayLike,
        *,
        viscosity: ArrayLike,
        positions: ArrayLike | None = None,
        loads: ArrayLike | None = None,
        mass: float | None = None,
        load: float | None = None,
        rpm: float | None = None,
        speed: Speed | None = None,
        ecc: float | None = None,
        attitude: float = 0.0,
        method: str = "AMG",
        threads: int = 1,
    ) -> MotionResult:
        """Move the journal along given positions, or freely under loads.

        Parameters
        ----------
        times : array_like of shape (n,)
            In s; a step leads from each to the next.
        viscosity, rpm, speed, method, threads
            As in `film`.
        positions : array_like of shape (n, 2)
            The displacement of the journal from the middle, along the load and across it, a quarter
            further in the direction of the motion, in m.
        loads : array_like of shape (n, 2), (n,) or ()
            Instead, the load on the journal, in its direction and across it, in N.
        mass : float
            With `loads` the mass of the journal, in kg, or 0.
        load : float
            With `loads`, the motion begins where this load is carried, in N.
        ecc : float
            With `loads` the eccentricity at the first time, the widest gap at x = 0; without it and
            `load` 0.
        attitude : float
            How far x = 0 is from the place opposite the load, in degrees in the direction of the
            motion.

        Returns
        -------
        MotionResult

        Raises
        ------
        ValueError
            For times that do not increase, arrays that do not fit them, walls that meet and steps
            that do not settle.

        Notes
        -----
        A film that a wall carries and something feeds has settled before; another one begins full.
        """
        rows, weight = _driven(positions, loads, mass, real("times", times).shape, 2)
        begin = _eccentricity(ecc)
        if weight is None and begin is not None:
            raise ValueError("ecc is where the journal is, but positions say that at every time;"
                             " leave it out, or give loads and mass")
        turn, force = _number("attitude", attitude), _begun(load, weight)
        if begin is None:
            begin = 0.0 if force is None else self._half()
        assert self._of_journal is not None
        walled = self._walled(self._speeds(rpm, speed), viscosity,
                              [begin * self._of_journal[2], 0.0])
        carries = None if force is None else (force, None, turn)
        return self._moved(walled, times, rows, (weight, turn, carries), method, threads)


class Pad(_Bearing):
    """A pad over ny by nx cells, whose upper wall may rise and tilt: x runs along the motion.

    Parameters
    ----------
    size : (float, float)
        The extents along x and y, in m.
    plane : (float, float)
        A plane, by the gaps at both ends of x, in m.
    taper : (float, float, float)
        Instead, a taper and a land: the gaps at the ends of the taper, and its length along x, in
        m.
    parabola : (float, float) or (float, float, float)
        Instead, a parabola: the least gap, the radius of curvature along x, and the place of the
        least gap, in m; in the middle without one.
    map : array_like of shape (ny, nx)
        Instead, the gap in each cell, in m.
    tilt : (float, float)
        Slopes: what the gap gains along x and along y.
    pockets, dimples, supplies, roughness, ambient, cavitation, oil
        As in `Journal`.
    west, east, south, north : float, "closed", "periodic" or ("starved", float)
        The sides, as in `film`.
    nx, ny : int
        Cells along x and y, 180 and 60 if not given, or those of the map.

    Raises
    ------
    ValueError
        As in `Journal`.

    Examples
    --------
    >>> import hlcp
    >>> pad = hlcp.Pad((0.05, 0.03), plane=(40e-6, 20e-6), nx=90, ny=54)
    >>> round(pad.film(speed=3, viscosity=0.04).load)
    853
    """

    _of_film = ("speed", "viscosity", "load", "at", "method")
    _of_bearing = ("ambient", "cavitation")

    def __init__(
        self,
        size: tuple[float, float],
        *,
        plane: tuple[float, float] | None = None,
        taper: tuple[float, float, float] | None = None,
        parabola: tuple[float, float] | tuple[float, float, float] | None = None,
        map: ArrayLike | None = None,
        tilt: tuple[float, float] = (0.0, 0.0),
        pockets: Sequence[Pocket] = (),
        dimples: Sequence[Dimples] = (),
        roughness: ArrayLike | None = None,
        supplies: Sequence[Supply] = (),
        west: Side | None = None,
        east: Side | None = None,
        south: Side | None = None,
        north: Side | None = None,
        ambient: float = 0.0,
        cavitation: float = 0.0,
        oil: tuple[float, float] = (870.0, 1950.0),
        nx: int | None = None,
        ny: int | None = None,
    ) -> None:
        self._given = {name: value for name, value in locals().items()
                       if name not in ("self", "__class__")}
        if sum(shape is not None for shape in (plane, taper, parabola, map)) != 1:
            raise ValueError("a pad has one shape: give plane, taper, parabola or map")
        shape: dict[str, Any] = {}
        if map is not None:
            gap = real("map", map)
            if gap.ndim != 2:
                raise ValueError(f"map has {gap.ndim} dimensions, but it must be of the shape"
                                 " (ny, nx)")
            for name, given, cells in (("ny", ny, gap.shape[0]), ("nx", nx, gap.shape[1])):
                if given not in (None, cells):
                    raise ValueError(f"{name} is {given}, but the map has {cells}; leave it out")
            self._grid = _cells(*gap.shape)
            shape["map"] = vector("map", gap, np.float64)
        else:
            self._grid = _cells(60 if ny is None else ny, 180 if nx is None else nx)
        if plane is not None:
            shape["plane"] = _numbers("plane", plane, 2)
        if taper is not None:
            *gaps, length = _numbers("taper", taper, 3)
            shape["taper"] = gaps, _positive("the length of taper", length)
        if parabola is not None:
            if rank(parabola) != 1 or len(parabola) not in (2, 3):
                raise ValueError(f"parabola is {parabola!r}, but it must be its least gap and its"
                                 " radius, and perhaps a place")
            least, radius, *at = _numbers("parabola", parabola, len(parabola))
            radius = _positive("the radius of parabola", radius)
            shape["parabola"] = least, radius, at[0] if at else None
        of_x, of_y = _numbers("size", size, 2)
        self._size = _positive("size[0]", of_x), _positive("size[1]", of_y)
        self._tilt = _numbers("tilt", tilt, 2)
        sides = {"west": west, "east": east, "south": south, "north": north}
        _sides_agree(sides)
        self._build(shape, sides, supplies, roughness, pockets, dimples, ambient, cavitation, oil)

    def film(
        self,
        *,
        viscosity: ArrayLike,
        speed: Speed = 0.0,
        load: float | None = None,
        at: tuple[float, float] | None = None,
        start: BearingResult | None = None,
        method: str = "AMG",
        threads: int = 1,
        certify: bool = False,
        tolerance: float | None = None,
    ) -> BearingResult:
        """Compute the film in its position, or where it carries a load.

        Parameters
        ----------
        viscosity : float or array_like of shape (ny, nx)
            In Pa s.
        speed : float or (float, float)
            The speed of the lower wall, or of the lower and the upper one, along x, in m/s.
        load : float
            What it is to carry, in N: the rise of the upper wall is found.
        at : (float, float)
            With `load`, where it is to act: the slopes of the wall are found, too.
        start, method, threads, certify, tolerance
            As in `Journal.film`.

        Returns
        -------
        BearingResult

        Raises
        ------
        ValueError
            As in `Journal.film`.
        """
        options = {"viscosity": viscosity, "speed": speed, "load": load, "at": at,
                   "method": method}
        film = self._run(options, self._start(start), None, threads, certify, tolerance)
        for text in film._told:
            warnings.warn(text, stacklevel=2)
        return film

    def _run(self, options: dict[str, Any], start: BearingResult | None,
             guess: Floats | None = None, threads: Any = 1, certify: bool = False,
             tolerance: Any = None) -> BearingResult:
        given = {name: options.get(name) for name in self._of_film}
        force, at = _force(given["load"]), given["at"]
        if at is not None:
            if force is None:
                raise ValueError("at is where a load acts, but there is no load")
            at = _numbers("at", at, 2)
            for axis, place, end in zip("xy", at, self._size):
                if not 0.0 <= place <= end:
                    raise ValueError(f"at: {axis} is {place} m, outside the film, which ends at"
                                     f" {end} m")
        position = [0.0, *self._tilt]
        if force is not None and start is not None:
            position = list(start.position) if at is not None else [start.position[0], *self._tilt]
        carries = None if force is None else (force, at, None)
        walled = self._walled(_walls(given["speed"]), given["viscosity"], position)
        return self._solved(walled, carries, start, given["method"], threads, certify, tolerance)

    def coefficients(
        self,
        *,
        viscosity: ArrayLike,
        speed: ArrayLike = 0.0,
        load: ArrayLike | None = None,
        frequency: ArrayLike | None = None,
        clamped: bool = False,
        threads: int = 1,
        progress: bool | None = None,
    ) -> Coefficients:
        """Compute stiffness and damping for arrays of speeds and loads, each film from the one
        before.

        Parameters
        ----------
        viscosity, speed, load : float or array_like of shape (n,)
            As in `film`.
        frequency, clamped, threads, progress
            As in `Journal.coefficients`; the running speed of a wall is 2 pi times how often it
            passes the film in a second.

        Returns
        -------
        Coefficients
            For the rise of the upper wall and its slopes along x and y.
        """
        options = {"viscosity": viscosity, "speed": speed, "load": load}
        return self._coefficients(options, frequency, clamped, threads, progress)

    def motion(
        self,
        times: ArrayLike,
        *,
        viscosity: ArrayLike,
        positions: ArrayLike | None = None,
        loads: ArrayLike | None = None,
        mass: float | None = None,
        load: float | None = None,
        speed: Speed = 0.0,
        method: str = "AMG",
        threads: int = 1,
    ) -> MotionResult:
        """Move the upper wall along given positions, or freely under loads.

        Parameters
        ----------
        times : array_like of shape (n,)
            In s; a step leads from each to the next.
        viscosity, speed, method, threads
            As in `film`.
        positions : array_like of shape (n,), (n, 2) or (n, 3)
            The rise, in m, and what is added to the slopes along x and y.
        loads : array_like of shape (n,) or ()
            Instead, the load, in N; the slopes stay.
        mass : float
            With `loads` the mass of the wall, in kg, or 0.
        load : float
            With `loads`, the motion begins where this load is carried, in N.

        Returns
        -------
        MotionResult

        Raises
        ------
        ValueError
            As in `Journal.motion`.
        """
        rows, weight = _driven(positions, loads, mass, real("times", times).shape, 1)
        walled = self._walled(_walls(speed), viscosity, [0.0, *self._tilt])
        force = _begun(load, weight)
        carries = None if force is None else (force, None, None)
        return self._moved(walled, times, rows, (weight, 0.0, carries), method, threads)


def _depths(shape: dict[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield what a metre more of depth adds to the gap, for each pocket and each array of
    dimples."""
    plain = {**shape, "pockets": [], "dimples": []}
    for kind in "pockets", "dimples":
        for k, (place, size, _, is_ellipse) in enumerate(shape[kind]):
            deep = {**plain, kind: [(place, size, 1.0, is_ellipse)]}
            yield f"{kind}[{k}]", _hlcp.film_gap(deep) - _hlcp.film_gap(plain)


class _Bar:
    """A line on standard error that shows how many runs are done."""

    def __init__(self, total: int, shows: bool | None) -> None:
        self._total, self._done, self._lock = total, 0, threading.Lock()
        self._shows = sys.stderr.isatty() if shows is None else shows

    def __enter__(self) -> Self:
        return self

    def step(self) -> None:
        with self._lock:
            self._done += 1
            if self._shows:
                full = 30 * self._done // self._total
                bar = "#" * full + "." * (30 - full)
                sys.stderr.write(f"\r{bar} {self._done}/{self._total}")
                sys.stderr.flush()

    def __exit__(self, *_: object) -> None:
        if self._shows and self._done:
            sys.stderr.write("\n")


def _relative(film: BearingResult) -> Floats:
    """Return the position of a journal in clearances."""
    clearance: float = film._walled["journal"][2]
    return np.array(film.position, np.float64) / clearance


def _ahead(past: list[tuple[dict[str, Any], BearingResult]],
           options: dict[str, Any]) -> Floats | None:
    """Return the position of a journal to which those before lead, on a polynomial through them, in
    clearances; None if more than one option changes, or it is far from the last one."""
    runs = [options, *(run for run, _ in reversed(past))]
    changed = [name for name in options if any(np.any(run[name] != options[name]) for run in runs)]
    if len(past) < 2 or past[-1][1].ecc is None or len(changed) != 1:
        return None
    at, *known = (float(run[changed[0]]) for run in runs)
    if not np.all(np.diff([at, *known]) * (known[0] - at) > 0):
        return None
    weights = [math.prod((at - other) / (value - other) for other in known if other != value)
               for value in known]
    films = [film for _, film in past[::-1]]
    guess = np.sum([weight * _relative(film) for weight, film in zip(weights, films)], axis=0)
    last = films[0]
    room = last.least_gap / last._walled["journal"][2]
    return guess if np.hypot(*(guess - _relative(last))) < 0.5 * room else None


def _snake(lengths: list[int]) -> Iterator[int]:
    """Yield the places of a product of lists on a way from neighbour to neighbour."""
    if not lengths:
        yield 0
        return
    inner = math.prod(lengths[1:])
    for k in range(lengths[0]):
        way = list(_snake(lengths[1:]))
        yield from (k * inner + at for at in (way if k % 2 == 0 else reversed(way)))


def _driven(positions: Any, loads: Any, mass: Any, shape: tuple[int, ...],
            width: int) -> tuple[Any, float | None]:
    """Return a row for each time, and the mass where they are loads."""
    if (positions is None) == (loads is None):
        raise ValueError("a motion has positions, or loads and a mass")
    weight = _optional("mass", mass)
    if (weight is None) != (loads is None):
        raise ValueError("loads move a wall with a mass, in kg, or 0; positions without one")
    if weight is not None and weight < 0.0:
        raise ValueError(f"mass is {mass}, but it must be a number of kilogrammes, 0 or more")
    name = "loads" if positions is None else "positions"
    rows = real(name, loads if positions is None else positions)
    if positions is None and rows.ndim == 0:
        rows = np.broadcast_to(rows, shape)
    if rows.ndim == 1 and (positions is None or width == 1):
        rows = np.column_stack([rows, np.zeros((len(rows), width - 1))])
    widest = width if positions is None or width == 2 else 3
    if rows.ndim != 2 or not width <= rows.shape[1] <= widest:
        wanted = f"(n, {width})" if widest == width else f"(n,) to (n, {widest})"
        raise ValueError(f"{name} has the shape {np.shape(rows)}, but it must be {wanted}")
    return rows.astype(np.float64), weight


def _begun(load: Any, mass: float | None) -> float | None:
    """Return the load that is carried where a motion begins."""
    force = _force(load)
    if force is not None and mass is None:
        raise ValueError("load is where a free motion begins, but positions say where the wall is;"
                         " leave it out, or give loads and mass")
    return force


def _how(method: Any, threads: Any) -> dict[str, Any]:
    method = "AMG" if method is None else method
    if not isinstance(method, str) or not method.isascii():
        raise ValueError(f"method is {method!r}, but it must be one of hlcp.methods()")
    threads = count("threads", threads, 1, 1024)
    # The usual method is left for another one where it does not converge.
    return {"method": None if method.upper() == "AMG" else method, "threads": threads}


def _bounds(proved: Any) -> FilmBounds:
    def pairs(intervals: list[list[float]]) -> list[Interval]:
        return [(lower, upper) for lower, upper in intervals]

    load, friction, sides, supplies, peak = proved
    load, peak = pairs([load, peak])
    return FilmBounds(load, pairs(friction), pairs(sides), pairs(supplies), peak)


def _cells(ny: Any, nx: Any) -> tuple[int, int]:
    of_y, of_x = count("ny", ny, 1), count("nx", nx, 1)
    if of_y * of_x > 1 << 28:
        raise ValueError("nx times ny is more than 268 million cells")
    return of_y, of_x


def _optional(name: str, value: Any) -> float | None:
    return None if value is None else _number(name, value)


def _force(load: Any) -> float | None:
    force = _optional("load", load)
    if force is not None and force <= 0.0:
        raise ValueError(f"load is {force} N, but it must be positive")
    return force


def _eccentricity(ecc: Any) -> float | None:
    given = _optional("ecc", ecc)
    if given is not None and not 0.0 <= given < 1.0:
        raise ValueError(f"ecc is {given}, but an eccentricity over the clearance is at least 0 and"
                         " below 1")
    return given


def _walls(speed: Any) -> list[float]:
    """Return the speeds of the lower and the upper wall."""
    if speed is None or rank(speed) == 0:
        return [0.0 if speed is None else _number("speed", speed), 0.0]
    return _numbers("speed", speed, 2)


def _frequency(value: Any) -> float:
    ratio = _number("frequency", value)
    if ratio < 0.0:
        raise ValueError(f"frequency is {ratio}, but over the running speed it must be 0 or more")
    return ratio


def _positive(name: str, value: Any) -> float:
    given = _number(name, value)
    if given <= 0.0:
        raise ValueError(f"{name} is {given}, but it must be positive, in m")
    return given


def _listed(name: str, value: Any) -> Sequence[Any]:
    if isinstance(value, str) or not isinstance(value, (Sequence, np.ndarray)):
        raise ValueError(f"{name} is {value!r}, but it must be a list")
    return value  # type: ignore[return-value]


def _groove(name: str, groove: Any, ambient: Any, whole: float
            ) -> tuple[float, float, float, float]:
    given = [groove] if rank(groove) == 0 else groove
    if rank(given) != 1 or not 1 <= len(given) <= 4:
        raise ValueError(f"{name} is {groove!r}, but it must be an angle in degrees, or (angle,"
                         " pressure, width, length) or the first of these")
    angle, pressure, width, length = [
        _number(name, number) for number in (*given, *(ambient, 0.0, whole)[len(given) - 1:])]
    if abs(angle) > 360.0:
        raise ValueError(f"{name} has an angle of {angle} degrees, but it must be between -360 and"
                         " 360; one groove with a pressure is [(angle, pressure)]")
    if not 0.0 <= width < 360.0 or not 0.0 < length <= whole * (1.0 + 1e-9):
        raise ValueError(f"{name} has a width of {width} degrees and a length of {length} m, but"
                         " the width must be 0 or more and below 360 degrees, and the length"
                         f" positive and at most that of the bearing, {whole} m")
    return angle, pressure, width, length


def _dam(name: str, dam: Any) -> tuple[float, float, float, float]:
    try:
        around, length, depth = dam
    except (TypeError, ValueError):
        raise ValueError(f"{name} is {dam!r}, but it must be ((from, to), length, depth)") from None
    start, end = _numbers(f"{name}: the angles", around, 2)
    if not start < end < start + 360.0:
        raise ValueError(f"{name} is from {start} to {end} degrees, but it ends less than a turn"
                         " beyond where it begins")
    return start, end, _positive(f"{name}: the length", length), _number(name, depth)


def _lobes(lobes: Any) -> tuple[int, float, float, float] | None:
    if lobes is None:
        return None
    if rank(lobes) != 1 or not 2 <= len(lobes) <= 4:
        raise ValueError(f"lobes is {lobes!r}, but it must be (count, preload, offset, degrees), or"
                         " the first two or three of these")
    preload, offset, middle = [
        _number("lobes", number) for number in (*lobes[1:], *(0.5, 0.0)[len(lobes) - 2:])]
    return count("lobes: the count", lobes[0], 1), preload, offset, math.radians(middle)


def _outline(name: str, given: Any, wanted: str) -> tuple[Any, list[float], float, bool]:
    is_ellipse = isinstance(given, Sequence) and len(given) == 4 and _is(given[3], "ellipse")
    try:
        first, size, depth = given[:3] if is_ellipse else given
    except (TypeError, ValueError):
        raise ValueError(f"{name} is {given!r}, but it must be {wanted}, perhaps with 'ellipse'"
                         ) from None
    extents = [_positive(f"{name}: the size", length) for length in
               _numbers(f"{name}: the size", size, 2)]
    return first, extents, _number(f"{name}: the depth", depth), is_ellipse


def _pocket(name: str, pocket: Any) -> tuple[list[float], list[float], float, bool]:
    corner, size, depth, is_ellipse = _outline(name, pocket, "((x, y), (lx, ly), depth)")
    return _numbers(f"{name}: the corner", corner, 2), size, depth, is_ellipse


def _dimples(name: str, array: Any) -> tuple[list[int], list[float], float, bool]:
    counts, size, depth, is_ellipse = _outline(name, array, "((kx, ky), (lx, ly), depth)")
    if rank(counts) != 1 or len(counts) != 2:
        raise ValueError(f"{name}: the numbers are {counts!r}, but they must be (kx, ky)")
    many = [count(f"{name}: the number", k, 1, 10_000) for k in counts]
    return many, size, depth, is_ellipse
