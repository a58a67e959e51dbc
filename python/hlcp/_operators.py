"""Operators, and what is passed of them to the compiled half."""

from __future__ import annotations

import operator
import sys
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse
from scipy.sparse.linalg import LinearOperator

Vector = NDArray[np.floating[Any]]


def real(name: str, value: Any) -> NDArray[Any]:
    """Return `value` as an array, unless its entries are not real numbers."""
    if np.ma.is_masked(value):
        masked = np.count_nonzero(np.ma.getmaskarray(value))
        raise ValueError(f"{name} is a masked array with {masked} entries masked, but it must have"
                         " them all; fill them first")
    try:
        array = np.asarray(value)
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from None
    if array.dtype.kind not in "biuf":
        raise ValueError(f"{name} has the type {array.dtype}, but it must hold real numbers")
    return array


def rank(value: Any) -> int:
    """Return the dimensions of an array_like; -1 for what is none."""
    try:
        return np.ndim(value)
    except ValueError:
        return -1


def vector(name: str, value: Any, dtype: Any) -> Vector:
    """Return the entries of `value` in one row, of type `dtype`; a view where they are that."""
    array = real(name, value)
    if array.ndim == 0:
        raise ValueError(f"{name} is a single number, but it must be a vector")
    return np.require(array, dtype, ["C", "ALIGNED", "ENSUREARRAY"]).reshape(-1)


def exact(name: str, value: Any) -> NDArray[Any]:
    """Return `value` as an array of float64, unless that would round an entry."""
    array = real(name, value)
    with np.errstate(over="ignore"):
        wide = array.astype(np.float64, copy=False)
    if array.dtype.kind in "iu":
        large = np.argwhere((array > 2**53) | (array < -(2**53)))
        rounded = [at for at in large if int(wide[tuple(at)]) != int(array[tuple(at)])]
    elif array.dtype.itemsize > 8:
        rounded = list(np.argwhere(np.isfinite(array) & (wide.astype(array.dtype) != array)))
    else:
        rounded = []
    if rounded:
        place, entry = ", ".join(map(str, rounded[0])), array[tuple(rounded[0])]
        raise ValueError(f"{name}[{place}] is {entry}, which float64 would round; a proof needs"
                         " numbers that float64 holds")
    return wide


def count(name: str, value: Any, least: int, most: int | None = None) -> int:
    """Return a whole number from `least` to `most`; without that the machine's largest for a larger
    one."""
    try:
        number = operator.index(value)
    except TypeError:
        raise ValueError(f"{name} is {value!r}, but it must be a whole number") from None
    if number < least:
        raise ValueError(f"{name} is {number}, but it must be at least {least}")
    if most is not None and number > most:
        raise ValueError(f"{name} is {number}, but it must be at most {most}")
    return min(number, sys.maxsize)


def number(name: str, value: Any) -> float | None:
    """Return a real number; None for None."""
    if value is None:
        return None
    try:
        kind = value.dtype.kind if isinstance(value, (np.generic, np.ndarray)) else "f"
        if isinstance(value, (str, bool)) or kind not in "iuf" or np.ndim(value):
            raise TypeError
        return float(value)
    except (TypeError, ValueError, OverflowError):
        raise ValueError(f"{name} is {value!r}, but it must be a real number") from None


class FivePoint(LinearOperator):  # type: ignore[misc]
    """A five-point operator on a grid, zero outside it, or one that closes.

    At column i and row j of the grid ::

        (A x)[j, i] = south x[j-1, i] + west x[j, i-1] + centre x[j, i]
                      + east x[j, i+1] + north x[j+1, i]

    with coefficients that are one number, or one for each point. No matrix is formed. It is a
    `scipy.sparse.linalg.LinearOperator`: ``A @ x`` is the product.

    Parameters
    ----------
    grid : (int, int)
        The shape (ny, nx) of the grid; the operator has shape (ny nx, ny nx).
    south, west, centre, east, north : float or array_like
        The coefficients of the neighbours in the row j - 1, the column i - 1, and so on. An array
        of shape (ny, nx) in C order and of type float64 (or float32, for q of that type) is
        borrowed and never copied: what is changed in it later is seen. Other arrays are broadcast
        and copied. Those that lead outside the grid have no meaning, but must be finite.
    periodic : (bool, bool)
        Whether the grid closes along y and along x: the southern neighbours of its first row are
        then those of the last one, and the other way round. It takes three points or more.

    Attributes
    ----------
    grid : (int, int)
    periodic : (bool, bool)
    south, west, centre, east, north : float or ndarray of shape (ny, nx)

    Raises
    ------
    ValueError
        For a grid without points, an array that does not fit the grid, or one that does not hold
        real numbers.

    Examples
    --------
    >>> import numpy as np, hlcp
    >>> A = hlcp.FivePoint((2, 3), south=-1, west=-1, centre=4, east=-1, north=-1)
    >>> A @ np.arange(1.0, 7.0)
    array([-2., -1.,  4., 10.,  8., 16.])
    """

    grid: tuple[int, int]
    periodic: tuple[bool, bool]

    def __init__(
        self,
        grid: tuple[int, int],
        *,
        south: ArrayLike = 0.0,
        west: ArrayLike = 0.0,
        centre: ArrayLike,
        east: ArrayLike = 0.0,
        north: ArrayLike = 0.0,
        periodic: tuple[bool, bool] = (False, False),
    ) -> None:
        if np.ndim(grid) != 1 or len(grid) != 2:
            raise ValueError(f"grid is {grid!r}, but it must be (ny, nx)")
        ny, nx = (count("grid", points, -sys.maxsize) for points in grid)
        if min(ny, nx) < 1 or ny * nx > sys.maxsize // 8:
            raise ValueError(f"grid is ({ny}, {nx}), but it must have one point, or more, and at"
                             " most as many as an array can hold")
        self.grid = ny, nx
        if np.ndim(periodic) != 1 or len(periodic) != 2 or not all(
                isinstance(closes, (bool, np.bool_)) for closes in periodic):
            raise ValueError(f"periodic is {periodic!r}, but it must be two truths, (along y, along"
                             " x)")
        self.periodic = bool(periodic[0]), bool(periodic[1])
        for closes, points, name in zip(self.periodic, self.grid, "yx"):
            if closes and points < 3:
                raise ValueError(f"the grid has {points} points along {name}, but it needs three to"
                                 " close")
        self.south = self._coefficient("south", south)
        self.west = self._coefficient("west", west)
        self.centre = self._coefficient("centre", centre)
        self.east = self._coefficient("east", east)
        self.north = self._coefficient("north", north)
        arrays = [c.dtype for c in self._coefficients() if not isinstance(c, float)]
        super().__init__(np.result_type(*arrays) if arrays else np.float64, (ny * nx, ny * nx))

    def _coefficient(self, name: str, value: ArrayLike) -> float | Vector:
        array = real(name, value)
        if array.ndim == 0:
            return float(array)
        try:
            array = np.broadcast_to(array, self.grid)
        except ValueError:
            raise ValueError(f"{name} has the shape {array.shape}, but the grid has"
                             f" {self.grid}") from None
        dtype = np.float32 if array.dtype == np.float32 else np.float64
        return np.require(array, dtype, ["C", "ALIGNED", "ENSUREARRAY"])

    def _coefficients(self) -> list[float | Vector]:
        return [self.south, self.west, self.centre, self.east, self.north]

    def _matvec(self, x: NDArray[Any]) -> NDArray[Any]:
        x = x.reshape(self.grid)
        south, west, centre, east, north = (np.broadcast_to(c, self.grid)
                                            for c in self._coefficients())
        y = centre * x
        y[1:] += south[1:] * x[:-1]
        y[:, 1:] += west[:, 1:] * x[:, :-1]
        y[:, :-1] += east[:, :-1] * x[:, 1:]
        y[:-1] += north[:-1] * x[1:]
        along_y, along_x = self.periodic
        if along_y:
            y[0] += south[0] * x[-1]
            y[-1] += north[-1] * x[0]
        if along_x:
            y[:, 0] += west[:, 0] * x[:, -1]
            y[:, -1] += east[:, -1] * x[:, 0]
        flat: NDArray[Any] = y.reshape(-1)
        return flat

    def tocsr(self) -> Any:
        """Return the same matrix as a `scipy.sparse.csr_array`."""
        points = np.arange(self.shape[0]).reshape(self.grid)
        neighbours = [(-1, 0), (0, -1), (0, 0), (0, 1), (1, 0)]
        rows, columns, entries = [], [], []
        along_y, along_x = self.periodic
        for coefficient, (dj, di) in zip(self._coefficients(), neighbours):
            here = _inside(0 if along_y else -dj), _inside(0 if along_x else -di)
            rows.append(points[here].ravel())
            columns.append(np.roll(points, (-dj, -di), (0, 1))[here].ravel())
            entries.append(np.broadcast_to(coefficient, self.grid)[here].ravel())
        triplets = np.concatenate(entries), (np.concatenate(rows), np.concatenate(columns))
        matrix = sparse.coo_array(triplets, shape=self.shape).tocsr()
        matrix.eliminate_zeros()
        return matrix


def stencil(shown: Any) -> FivePoint:
    """Return what the compiled half shows of an operator on a grid."""
    grid, arrays, periodic = shown
    names = "south", "west", "centre", "east", "north"
    fields = (c.reshape(grid) if isinstance(c, np.ndarray) else c for c in arrays)
    return FivePoint(tuple(grid), **dict(zip(names, fields)), periodic=tuple(periodic))


def _inside(step: int) -> slice:
    """Return the points of a line that one goes to by a step of -1, 0 or 1 on it."""
    return slice(max(step, 0), min(step, 0) or None)


def described(name: str, given: Any, dtype: Any, order: int, is_proof: bool = False) -> Any:
    """Return what the compiled half takes for an operator; None is the identity. A proof is of the
    matrix as it is given: what would round on the way is refused."""
    if given is None:
        return order
    if isinstance(given, FivePoint):
        return given.grid, [c if isinstance(c, float) else vector(name, c, dtype)
                            for c in given._coefficients()], given.periodic
    if isinstance(given, LinearOperator):
        rows, columns = given.shape
        if min(rows, columns) < 0:
            raise ValueError(f"{name} has the shape {given.shape}, but it must be (n, n)")
        return rows, columns, function(f"{name} @ x", given.matvec, dtype, rows)
    if not sparse.issparse(given):
        array = exact(name, given) if is_proof else real(name, given)
        if array.ndim != 2:
            raise ValueError(f"{name} has {array.ndim} dimensions, but it must be a matrix")
        given = sparse.csr_array(array.astype(dtype, copy=False))
    if given.ndim != 2:
        raise ValueError(f"{name} has {given.ndim} dimensions, but it must be a matrix")
    for label in ("indptr", "indices", "row", "col"):
        places = getattr(given, label, None)
        if places is not None and (places.ndim != 1 or places.dtype.kind != "i"):
            raise ValueError(f"{name}.{label} is an array of {places.ndim} dimensions of the type"
                             f" {places.dtype}, but it must be a vector of int32 or int64")
    if is_proof and given.dtype != np.float64:
        if given.dtype.itemsize >= 8:
            exact(f"{name}.data", given.tocoo(copy=True).data)
        given = given.astype(np.float64)
    matrix = given.tocsr()
    real(name, matrix.data)
    pointers, indices = matrix.indptr, matrix.indices
    # SciPy reads wherever indptr leads, so that one that leads astray is not shown to it; the
    # compiled half refuses it.
    leads = (len(pointers) > 0 and pointers[0] == 0 and np.all(pointers[:-1] <= pointers[1:])
             and pointers[-1] <= min(len(indices), len(matrix.data)))
    entries = matrix.data
    if leads:
        if not matrix.has_canonical_format:
            matrix = matrix.copy()
            matrix.sum_duplicates()
        if is_proof and given.format in ("bsr", "coo", "csc", "csr") and matrix.nnz != given.nnz:
            raise ValueError(f"{name} has entries given twice, whose sum may round; call"
                             f" {name}.sum_duplicates() before")
        pointers = matrix.indptr
        # Arrays may be longer than the matrix.
        indices, entries = matrix.indices[:pointers[-1]], matrix.data[:pointers[-1]]
        unsound = np.flatnonzero(~np.isfinite(entries))
        if len(unsound):
            at = unsound[0]
            row = np.searchsorted(pointers, at, side="right") - 1
            raise ValueError(f"{name}[{row}, {indices[at]}] is {entries[at]}, which is not a finite"
                             " number")
    narrow = pointers.dtype == indices.dtype == np.int32
    pointers, indices = (np.require(array, np.int32 if narrow else np.int64,
                                    ["C", "ALIGNED", "ENSUREARRAY"])
                         for array in (pointers, indices))
    return matrix.shape[1], pointers, indices, vector(name, entries, dtype)


def function(name: str, call: Any, dtype: Any, order: int) -> Any:
    """Return `call` as a map from vectors of `order` entries to such vectors."""

    def checked(x: Vector) -> Vector:
        y = vector(name, call(x), dtype)
        if len(y) != order:
            raise ValueError(f"{name} has {len(y)} entries, but it must have {order}")
        return y

    return checked
