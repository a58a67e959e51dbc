"""Solving and certifying."""

from __future__ import annotations

import enum
import inspect
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import OptimizeResult

from hlcp import _hlcp
from hlcp._operators import (
    FivePoint, Vector, count, described, exact, function, number, real, vector,
)

Map = Callable[[NDArray[Any]], ArrayLike]


class Status(enum.IntEnum):
    """How a solve ended; only `CONVERGED` is a success."""

    CONVERGED = 0
    """The residual, with a bound on its rounding, is within the tolerance."""
    DIVERGED = 1
    """The iterates ran away: try a smaller alpha, another tau or method."""
    STAGNATED = 2
    """The iterates came to rest, or rounding hides the residual: a looser tolerance, float64."""
    CYCLING = 3
    """The iterates repeat: try another alpha or tau; the problem may have no solution."""
    ITERATION_LIMIT = 4
    """`maxiter` iterations were taken: more may help, another method, or there is no solution."""
    TIME_LIMIT = 5
    """`maxtime` is over."""
    STOPPED = 6
    """The callback said so."""


class Result(OptimizeResult):  # type: ignore[misc]
    """The answer of `solve`, a `scipy.optimize.OptimizeResult`.

    Attributes
    ----------
    z, r : ndarray
        The unknowns, in the shape and type of q: of the last iterate on success, else of the one
        with the smallest residual. Both are non-negative, and one of z[i] and r[i] is 0.
    x : ndarray
        The modulus variable, with z = abs(x) + x and r = omega (abs(x) - x): a start for a similar
        problem.
    success : bool
        Whether the residual is within the tolerance.
    status : Status
        How the iteration ended.
    message : str
        The same in a sentence, with the numbers.
    nit : int
        Iterations.
    sweeps : int
        What they are worth in sweeps over the unknowns.
    residual : float
        The norm of A z - B r + q, recomputed for this z and r, in the units of q.
    relative : float
        The residual over the norm of q.
    elapsed : float
        Seconds of the iterations, as `maxtime` counts them.
    """

    z: NDArray[Any]
    r: NDArray[Any]
    x: NDArray[Any]
    success: bool
    status: Status
    message: str
    nit: int
    sweeps: int
    residual: float
    relative: float
    elapsed: float


@dataclass(frozen=True, slots=True)
class Progress:
    """An iterate, as a callback sees it.

    Attributes
    ----------
    nit : int
        The iterations that led to it; 0 for the start.
    x : ndarray
        The modulus variable, a copy in the shape of q; z is abs(x) + x.
    residual : float
        The norm of A z - B r + q; NaN within a long step that does not know it.
    elapsed : float
        Seconds since the solve began.
    """

    nit: int
    x: NDArray[Any]
    residual: float
    elapsed: float


class _Pair:
    """A and B, and what is passed of them to the compiled half."""

    def __init__(self, A: Any, B: Any) -> None:
        if A is None:
            raise ValueError("A is None, but only B may be, for the identity")
        self._given = A, B
        self._described: dict[Any, tuple[Any, Any]] = {}

    def described(self, dtype: Any) -> tuple[Any, Any]:
        if dtype not in self._described:
            A, B = self._given
            of_a = described("A", A, dtype, 0)
            order = np.shape(A)[0]
            self._described[dtype] = of_a, described("B", B, dtype, order)
        return self._described[dtype]

    def check(self, **arrays: NDArray[Any] | None) -> None:
        """Refuse arrays of other planes than the grid of the operators, or the first of them."""
        planes = [("the grid", given.grid) for given in self._given if isinstance(given, FivePoint)]
        for name, array in arrays.items():
            if array is None or array.ndim < 2 or 1 in array.shape:
                continue
            for whose, shape in planes:
                if array.shape != shape:
                    raise ValueError(f"{name} has the shape {array.shape}, but {whose} has {shape};"
                                     f" give {name}.ravel() if its entries are in that order, row"
                                     " by row")
            planes.append((name, array.shape))


def _precision(q: NDArray[Any]) -> Any:
    """Return the type that a solve with this q computes in."""
    return np.float32 if q.dtype == np.float32 else np.float64


def solve(
    A: Any,
    B: Any,
    q: ArrayLike,
    method: str = "AUTO",
    *,
    alpha: float | None = None,
    beta: float | None = None,
    alpha2: float | None = None,
    beta2: float | None = None,
    base: str | None = None,
    window: int | None = None,
    splitting: Map | Sequence[Map] | None = None,
    tau: float | None = None,
    omega: ArrayLike | None = None,
    x0: ArrayLike | None = None,
    z0: ArrayLike | None = None,
    r0: ArrayLike | None = None,
    rtol: float | None = None,
    atol: float | None = None,
    rounding: float | None = None,
    norm: float = 2,
    maxiter: int = 30_000,
    maxtime: float | None = None,
    threads: int = 1,
    callback: Callable[[Progress], object] | None = None,
) -> Result:
    """Find z, r >= 0 with z'r = 0 and A z - B r + q = 0.

    Parameters
    ----------
    A, B : sparse matrix, ndarray, FivePoint or LinearOperator, of shape (n, n)
        The operators; B = None is the identity, and the problem the LCP. Arrays are borrowed where
        they are of the type of q: those of a `FivePoint`, and of a CSR matrix in canonical format
        with indices of 32 or 64 bits. Anything else is converted, which copies. A LinearOperator
        is asked for products alone, and needs a `splitting` and `omega`.
    q : array_like with n entries
        The right-hand side. z, r and x take its shape; on a grid an array of two dimensions has the
        shape of that. For q of type float32 the solve is in
        single precision, otherwise in double, whatever the types of A and B.
    method : str
        One of `methods`, in any case: "AUTO" chooses. The paper's are "MGS", "AMSOR", "TMAOR" and
        so on; with a grid there are "MGW", "MGF" and "FMG".
    alpha, beta, alpha2, beta2 : float
        The relaxation parameters of the methods that take them, as "TMAOR". A splitting of your own
        takes none.
    base : str
        The method that "ANDERSON" accelerates, and "NEWTON" and "AMG" fall back on; without it
        "AMGS", forward and then backward.
    window : int
        How many earlier iterates "ANDERSON" mixes; 10 without it.
    splitting : callable, or two
        ``splitting(v)`` returns y with M y = v, where A + B Omega = M - N is a splitting of your
        own: the method is then "MMS", or "TMMS" for two functions, or by default "ANDERSON" on
        it.
    tau : float
        Omega = tau diag(A) / diag(B); 1 without it. Where one of the two is zero, the largest
        entries of its row in A and in B take their place.
    omega : float or array_like with n entries
        The diagonal of Omega, instead of tau.
    x0, z0, r0 : array_like with n entries
        The start: a modulus variable, or a z and an r (0 where one is missing).
    rtol, atol : float
        The norm of the residual, over that of q or in the units of q, that is good enough; give
        one. Without either, rtol is 1e-10.
    rounding : float
        The residual that is good enough too, in units of the rounding in it; 4 in single
        precision and 0 in double, if not given.
    norm : 2 or numpy.inf
        The norm of both.
    maxiter : int
        The largest number of iterations.
    maxtime : float
        The longest time of the iterations, in seconds. To convert A and B and to set the method up,
        as to find an order for "PIVOTING", is not in it.
    threads : int
        How many threads share the sweeps over five-point operators with 16384 points or more; the
        results have the same bits for any number.
    callback : callable
        ``callback(progress)`` sees every iterate as a `Progress`, and stops the solve by returning
        True or raising StopIteration. Within a long step it is called about fifty times per
        second.

    Returns
    -------
    Result
        Not converging raises nothing: read ``success``, ``status`` and ``message``.

    Raises
    ------
    ValueError
        For input that cannot be solved as it stands, with what is wrong and where.
    KeyboardInterrupt
        On Ctrl-C, at once; with a function of yours, or below 10,000 unknowns, once the sweep is
        done. No argument is ever changed.

    Notes
    -----
    Whatever `splitting`, `callback` or a LinearOperator raises comes out as it is. Other threads
    of Python run during the solve. They must not write to the arrays that it works on. With
    threads > 1 the functions are called on a thread that is not the caller's.

    Examples
    --------
    >>> import numpy as np, scipy.sparse as sp, hlcp
    >>> A = sp.diags_array([-1.0, 4.0, -1.0], offsets=[-1, 0, 1], shape=(3, 3))
    >>> result = hlcp.solve(A, None, [-2.0, 5.0, -6.0])
    >>> print(result.z.round(9), result.r.round(9), result.status.name)
    [0.5 0.  1.5] [0. 3. 0.] CONVERGED

    The least x'x / 2 with x >= 0 and x[0] + x[1] >= 1, and its multiplier:

    >>> hlcp.solve(np.array([[1, 0, -1], [0, 1, -1], [1, 1, 0]]), None, [0.0, 0.0, -1.0]).z
    array([0.5, 0.5, 0.5])
    """
    return _solve(_Pair(A, B), q, method=method, alpha=alpha, beta=beta, alpha2=alpha2,
                  beta2=beta2, base=base, window=window, splitting=splitting, tau=tau, omega=omega,
                  x0=x0, z0=z0, r0=r0, rtol=rtol, atol=atol, rounding=rounding,
                  norm=norm, maxiter=maxiter, maxtime=maxtime, threads=threads, callback=callback)


def _solve(pair: _Pair, q: ArrayLike, *, method: Any, base: Any, splitting: Any, omega: Any,
           x0: Any, z0: Any, r0: Any, norm: Any, maxiter: Any, threads: Any, window: Any,
           callback: Any, **numbers: Any) -> Result:
    array = real("q", q)
    shape, dtype = array.shape, _precision(array)
    entries = vector("q", array, dtype)
    A, B = pair.described(dtype)
    for name, value in (("method", method), ("base", "" if base is None else base)):
        if not isinstance(value, str) or not value.isascii():
            raise ValueError(f"{name} is {value!r}, but it must be one of hlcp.methods()")
    norm = number("norm", norm)
    if norm not in (2, np.inf):
        raise ValueError(f"norm is {norm}, but it must be 2 or inf")
    if x0 is not None and not (z0 is None and r0 is None):
        raise ValueError("give x0, or z0 and r0, not both")
    if callback is not None and not callable(callback):
        raise ValueError(f"callback is {callback!r}, but it must be a function")
    settings: dict[str, Any] = {name: number(name, value) for name, value in numbers.items()}
    if settings["tau"] is not None and omega is not None:
        raise ValueError("give tau or omega, not both")
    x0, z0, r0, omega = (None if given is None else real(name, given) for name, given in (
        ("x0", x0), ("z0", z0), ("r0", r0), ("omega", omega)))
    pair.check(q=array, x0=x0, z0=z0, r0=r0, omega=omega)
    if omega is not None:
        omega = vector("omega", omega, dtype) if omega.ndim else float(omega)
    starts = [None if start is None else vector(name, start, dtype)
              for name, start in (("x0", x0), ("z0", z0), ("r0", r0))]
    maps = splitting if isinstance(splitting, (list, tuple)) else [splitting]
    if splitting is None:
        maps = []
    elif len(maps) not in (1, 2) or not all(map(callable, maps)):
        raise ValueError(f"splitting is {splitting!r}, but it must be a function, or two for TMMS")
    if maps:
        idle = {name: settings[name] for name in ("alpha", "beta", "alpha2", "beta2")}
        idle |= {"base": base, "window": window if method.upper() in ("MMS", "TMMS") else None}
        for name, value in idle.items():
            if value is not None:
                raise ValueError(f"{name} is {value!r}, but {method} with a splitting of your own"
                                 f" takes no {name}")
    largest = norm == np.inf

    def watch(nit: int, x: Vector, l2: float, linf: float, elapsed: float) -> bool:
        progress = Progress(nit, x.reshape(shape), linf if largest else l2, elapsed)
        try:
            return bool(callback(progress))
        except StopIteration:
            return True

    settings |= {
        "method": method,
        "base": base,
        "splittings": [function("splitting(v)", f, dtype, len(entries)) for f in maps],
        "tau": 1.0 if settings["tau"] is None else settings["tau"],
        "window": None if window is None else count("window", window, 0),
        "linf": largest,
        "maxiter": count("maxiter", maxiter, 0),
        "maxtime": _seconds(settings["maxtime"]),
        "threads": count("threads", threads, 1, 1024),
        "callback": None if callback is None else watch,
    }
    # Python's own functions run where the caller is, as far as they can.
    runs_python = callback is not None or maps or any(
        isinstance(given, tuple) and callable(given[-1]) for given in (A, B))
    is_apart = settings["threads"] > 1 or not runs_python and len(entries) >= 10_000
    z, r, x, (status, message), (nit, sweeps, elapsed), (residual, relative) = _hlcp.solve(
        dtype is np.float64, is_apart, [A, B, entries], starts, omega, settings)
    status = Status[status.upper().replace(" ", "_")]
    return Result(
        z=z.reshape(shape), r=r.reshape(shape), x=x.reshape(shape),
        success=status is Status.CONVERGED, status=status, message=message, nit=nit, sweeps=sweeps,
        residual=residual[largest], relative=relative[largest], elapsed=elapsed)


def _seconds(maxtime: Any) -> float | None:
    """Return the longest time; thirty years are no limit, and more may be too much for a clock."""
    seconds = number("maxtime", maxtime)
    return None if (seconds or 0.0) >= 1e9 else seconds


class Solver:
    """Solves for one q after the other, from the last answer if asked to.

    It keeps A and B as they are after their conversion, and the vectors of the last answer.

    Parameters
    ----------
    A, B, method, **options
        As for `solve`, without q; the options hold for every solve, unless it is given others.
        A and B must not be changed afterwards.

    Attributes
    ----------
    last : Result or None
        The last answer.

    Examples
    --------
    >>> import numpy as np, hlcp
    >>> A = hlcp.FivePoint((32, 32), south=-1, west=-1, centre=4.5, east=-1, north=-1)
    >>> solver = hlcp.Solver(A, method="AMSOR", alpha=1.3)
    >>> load = np.cos(np.linspace(0, 3, 1024))
    >>> [solver.resume(load + 1e-6 * day).nit for day in range(3)]  # doctest: +SKIP
    [22, 11, 11]
    """

    last: Result | None

    def __init__(self, A: Any, B: Any = None, method: str = "AUTO", **options: Any) -> None:
        self._options = {"method": method, **options}
        self._bound(None, {})  # An option that does not exist is a TypeError at once.
        self._pair = _Pair(A, B)
        self.last = None

    def _bound(self, q: Any, options: dict[str, Any]) -> dict[str, Any]:
        """Return all the options of a solve, with their defaults."""
        bound = inspect.signature(solve).bind(None, None, q, **{**self._options, **options})
        bound.apply_defaults()
        return {name: value for name, value in bound.arguments.items() if name not in "ABq"}

    def solve(self, q: ArrayLike, **options: Any) -> Result:
        """Solve for q, from 0 unless a start is given.

        Parameters
        ----------
        q : array_like with n entries
        **options
            As for `hlcp.solve`.

        Returns
        -------
        Result

        Raises
        ------
        ValueError
            As `hlcp.solve`; ``last`` stays what it was.
        """
        self.last = _solve(self._pair, q, **self._bound(q, options))
        return self.last

    def resume(self, q: ArrayLike, **options: Any) -> Result:
        """Solve for q from the x of the last answer, or as `solve` if there was none.

        Parameters
        ----------
        q : array_like with n entries
        **options
            As for `hlcp.solve`.

        Returns
        -------
        Result

        Raises
        ------
        ValueError
            As `hlcp.solve`; ``last`` stays what it was.
        """
        given = options.keys() & {"x0", "z0", "r0"}
        if given:
            raise ValueError(f"{min(given)} is given, but resume starts from the last answer; call"
                             " solve with a start of your own")
        last = {} if self.last is None else {"x0": self.last.x, "z0": None, "r0": None}
        return self.solve(q, **options, **last)


@dataclass(frozen=True, slots=True, eq=False)
class Certificate:
    """What is proved of the distance of (z, r) from a solution (z*, r*).

    All of it is a statement about real numbers; rounding is accounted for. It is true (as a bool)
    if a solution is proved to exist within the bounds; else these are infinite.

    Attributes
    ----------
    z, r : ndarray of float64
        Not less than abs(z - z*) and abs(r - r*), entry by entry.
    error : float
        The largest of these.
    sides : ndarray of int8
        1 where z* > 0 = r* is proved, -1 where r* > 0 = z* is, and 0 where neither is.
    unique : bool
        Whether (z*, r*) is proved to be the only solution; else others are not excluded.
    functionals : list of (float, float)
        Two numbers for each that was asked for, between which ``c_z @ z* + c_r @ r*`` lies.
    message : str
        The same in a sentence, or the reason why nothing is proved.
    """

    z: NDArray[np.float64]
    r: NDArray[np.float64]
    error: float
    sides: NDArray[np.int8]
    unique: bool
    functionals: list[tuple[float, float]]
    message: str

    def __bool__(self) -> bool:
        return bool(np.isfinite(self.error))

    def __str__(self) -> str:
        return self.message


def certify(A: Any, B: Any, q: ArrayLike, z: ArrayLike, r: ArrayLike, *,
            functionals: Sequence[tuple[ArrayLike, ArrayLike]] = (),
            maxtime: float | None = None) -> Certificate:
    """Prove that the problem has a solution, and bound its distance from z and r.

    Parameters
    ----------
    A, B : sparse matrix, ndarray or FivePoint, of shape (n, n)
        The operators; B = None is the identity.
    q, z, r : array_like with n entries
        The right-hand side, and an answer that may come from anywhere. The proof is in double
        precision, in which float32 is exact.
    functionals : sequence of (c_z, c_r)
        Coefficients of z and of r, each an array_like with n entries or one number for all: a load,
        a flow or a price, of which bounds are wanted.
    maxtime : float
        The longest time, in seconds; where it is too short, `message` says so.

    Returns
    -------
    Certificate
        With infinite bounds where no proof was found: nothing is claimed then.

    Raises
    ------
    ValueError
        For input that does not fit or is not finite, for a LinearOperator, of which the rows are
        not known, and for numbers that double precision would round: integers beyond 2^53, long
        doubles, entries of a sparse matrix that are given twice.

    Notes
    -----
    Other threads of Python run meanwhile. Ctrl-C ends the call.

    Examples
    --------
    >>> import hlcp
    >>> A = hlcp.FivePoint((1, 2), west=-1, centre=4, east=-1)
    >>> bound = hlcp.certify(A, None, [-4.0, 3.0], [1.001, 0.0], [0.0, 2.0])
    >>> bool(0.001 <= bound.z[0] < 0.0014), bound.unique, bound.sides.tolist()
    (True, True, [1, -1])
    >>> bound = hlcp.certify(A, None, [-4.0, 3.0], [1.0, 0.0], [0.0, 2.0], functionals=[(1, 0.5)])
    >>> lower, upper = bound.functionals[0]
    >>> lower <= 2 <= upper < 2 + 1e-12
    True
    """
    pair = _Pair(A, B)
    shape = np.shape(q)
    of_a = described("A", A, np.float64, 0, is_proof=True)
    of_b = described("B", B, np.float64, np.shape(A)[0], is_proof=True)
    arrays = {name: exact(name, given) for name, given in (("q", q), ("z", z), ("r", r))}
    pair.check(**arrays)
    entries = [vector(name, array, np.float64) for name, array in arrays.items()]
    wanted = [_coefficients(f"functionals[{k}]", pair, len(entries[0]))
              for k, pair in enumerate(functionals)]
    proof = _hlcp.certify([of_a, of_b], entries, wanted, _seconds(maxtime))
    if isinstance(proof, str):
        nothing = np.full(shape, np.inf)
        open_sides = np.zeros(shape, np.int8)
        return Certificate(nothing, nothing, np.inf, open_sides, False,
                           [(-np.inf, np.inf)] * len(wanted), f"not proved: {proof}")
    (of_z, of_r), sides, unique, bounds, message = proof
    error = float(max(np.max(of_z), np.max(of_r)))
    return Certificate(of_z.reshape(shape), of_r.reshape(shape), error, sides.reshape(shape),
                       unique, [(lower, upper) for lower, upper in bounds], message)


def _coefficients(name: str, pair: Any, order: int) -> list[Vector]:
    if not isinstance(pair, Sequence) or len(pair) != 2:
        raise ValueError(f"{name} is {pair!r}, but it must be coefficients of z and of r")
    found = []
    for given in pair:
        array = exact(name, given)
        if array.ndim and array.size != order:
            raise ValueError(f"{name} has {array.size} coefficients, but it must have {order}")
        if not np.all(np.isfinite(array)):
            raise ValueError(f"{name} has a coefficient that is not finite")
        found.append(vector(name, array if array.ndim else np.full(order, array), np.float64))
    return found


def methods() -> list[str]:
    """Return the names of all methods, those of the paper first.

    Examples
    --------
    >>> import hlcp
    >>> "AUTO" in hlcp.methods()
    True
    """
    return _hlcp.names()
