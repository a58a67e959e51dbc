"""Pictures, for those who have matplotlib."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike


def axes(ax: Any) -> Any:
    """Return these axes, or without any new ones."""
    try:
        import matplotlib.pyplot as plt
    except ImportError as error:
        raise ImportError("a picture needs matplotlib: pip install matplotlib") from error
    return plt.figure(layout="constrained").add_subplot() if ax is None else ax


def plot(z: ArrayLike, r: ArrayLike | None = None, *, ax: Any = None,
         extent: tuple[float, float, float, float] | None = None,
         labels: tuple[str, str] = ("z", "r")) -> Any:
    """Draw z, and r where it is positive.

    Parameters
    ----------
    z : array_like of shape (n,) or (ny, nx)
        Drawn as a curve, or as a map with x to the right and y upwards.
    r : array_like of the same shape, optional
        Drawn as a second curve, or as a second map on the points where it is positive.
    ax : matplotlib.axes.Axes, optional
        Where to draw; new axes without it.
    extent : (left, right, bottom, top), optional
        The coordinates of the map's edges; of a curve the first two count. Without it points are
        counted.
    labels : (str, str), optional
        The names of z and r with their units.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    ImportError
        Without matplotlib.
    ValueError
        For arrays of another shape.

    Examples
    --------
    >>> import hlcp
    >>> A, B, q, *_ = hlcp.scenes.bearing2d(63, 31)
    >>> result = hlcp.solve(A, B, q)
    >>> hlcp.plot(result.z, result.r).figure.savefig("film.png")  # doctest: +SKIP
    """
    z = np.asarray(z)
    r = None if r is None else np.asarray(r)
    if z.ndim not in (1, 2) or r is not None and r.shape != z.shape:
        raise ValueError(f"z has the shape {z.shape} and r {None if r is None else r.shape}, but"
                         " they must be (n,) or (ny, nx), and the same")
    ax = axes(ax)
    if z.ndim == 1:
        left, right = (0.0, len(z) - 1.0) if extent is None else extent[:2]
        along = np.linspace(left, right, len(z))
        ax.plot(along, z, color="tab:blue", label=labels[0])
        if r is not None:
            other = ax.twinx()
            other.plot(along, r, color="tab:orange", label=labels[1])
            other.set_ylabel(labels[1], color="tab:orange")
        ax.set_ylabel(labels[0], color="tab:blue")
        return ax
    image: Any = {"origin": "lower", "extent": extent, "aspect": "equal" if extent is None
                  else "auto", "interpolation": "nearest"}
    ax.figure.colorbar(ax.imshow(z, cmap="viridis", **image), ax=ax, label=labels[0])
    if r is not None and np.any(r > 0):
        ax.figure.colorbar(ax.imshow(np.ma.masked_less_equal(r, 0), cmap="Greys", **image), ax=ax,
                           label=labels[1])
    return ax
