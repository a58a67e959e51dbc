"""Films: the figures of the command, on a NumPy gap map."""

import numpy as np
import pytest

import hlcp

PAD = {"size": (0.02, 0.01), "speed": 2.0, "viscosity": 0.04}
STEP = np.where(np.arange(100) < 70, 40e-6, 20e-6)[None, :]


def rayleigh(**options):
    """Rayleigh's step, which has no flow across."""
    return hlcp.film(STEP, **PAD, south="closed", north="closed", **options)


def test_rayleighs_step_has_its_pressure():
    result = rayleigh(ambient=1e5)
    rise = 6 * 0.04 * 2 * 0.014 * 0.006 * 20e-6 / (0.006 * 64e-15 + 0.014 * 8e-15)
    assert result.success and result.peak == pytest.approx(1e5 + rise, rel=1e-8)
    assert result.load == pytest.approx(rise * 0.02 * 0.01 / 2, rel=1e-8)
    assert result.pressure.shape == (1, 100) and np.all(result.content == 1)
    # What enters in the west leaves in the east.
    assert result.sides[0] == pytest.approx(-result.sides[1], rel=1e-9)
    assert abs(result.imbalance) <= 1e-9 * result.sides[1] and result.broken_share == 0.0


def test_a_moving_upper_wall_is_the_lower_one_the_other_way_round():
    lower = rayleigh()
    upper = hlcp.film(STEP[:, ::-1], **PAD | {"speed": (0.0, -2.0)}, south="closed", north="closed")
    assert np.allclose(upper.pressure[:, ::-1], lower.pressure, rtol=1e-9)


def test_a_diverging_film_breaks_and_keeps_its_oil():
    gap = np.linspace(20e-6, 40e-6, 60) * np.ones((20, 1))
    result = hlcp.film(gap, **PAD, ambient=1e5, cavitation=0.0)
    assert result.success and 0 < result.broken_share < 1
    assert np.all((result.content > 0) & (result.content <= 1)) and result.pressure.min() == 0
    assert abs(result.imbalance) <= 1e-9 * max(map(abs, result.sides))


def test_units_and_directions_that_were_hardly_meant_are_told():
    with pytest.warns(UserWarning, match="lengths are in metres"):
        hlcp.film(1e6 * STEP, size=(20.0, 10.0), speed=2.0, viscosity=0.04)
    with pytest.warns(UserWarning, match="pressure builds up where the gap narrows along x"):
        result = hlcp.film(STEP[:, ::-1], **PAD)
    assert result.success and result.load == 0


def test_a_ring_and_a_supply():
    around = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    gap = 1e-5 * (1 + 0.5 * np.cos(around)) * np.ones((20, 1))
    ring = {"west": "periodic", "east": "periodic"}
    fed = hlcp.film(gap, **PAD, **ring, supplies=[((0.0, 0.004), (0.001, 0.002), 2e5)])
    assert fed.success and fed.supplies[0] > 0
    assert fed.supplies[0] == pytest.approx(sum(fed.sides[2:]), rel=1e-6)
    dry = hlcp.film(gap, **PAD, **ring)
    assert dry.success and dry.content.max() <= 1e-15 and dry.load == 0


def test_a_time_step_stores_oil_and_starts_from_the_one_before():
    gap = np.linspace(40e-6, 20e-6, 40) * np.ones((20, 1))
    steady = hlcp.film(gap, **PAD)
    assert hlcp.film(gap, **PAD, start=steady).nit == 0 < steady.nit
    step = hlcp.film(gap, **PAD, duration=1e-3, oil=steady.content * gap, start=steady)
    assert step.success and abs(step.stored) <= 1e-9 * max(map(abs, step.sides))
    squeezed = hlcp.film(0.99 * gap, **PAD, duration=1e-3, oil=gap, start=step)
    assert squeezed.success and squeezed.load > 1.1 * steady.load
    assert squeezed.stored == pytest.approx(-0.01 * gap.sum() * 0.02 * 0.01 / 800 / 1e-3, rel=1e-6)


@pytest.mark.parametrize("sentence, options", [
    ("gap has 1 dimensions", {"gap": STEP[0]}),
    (r"gap\[0, 3\] is -1.0, but it must be positive", {"gap": [[1.0, 1.0, 1.0, -1.0]]}),
    (r"viscosity\[0\] is 0, but it must be positive", {"viscosity": 0.0}),
    ("viscosity has order 3", {"viscosity": [1.0, 2.0, 3.0]}),
    ("size is 1.0, but it must be 2 numbers", {"size": 1.0}),
    (r"speed is \(1.0, 2.0, 3.0\), but it must be 2 numbers", {"speed": (1.0, 2.0, 3.0)}),
    ("west is 'wall', but it must be a pressure", {"west": "wall"}),
    ("west and east must both be 'periodic', or neither", {"east": "periodic"}),
    ("content", {"west": ("starved", 1.5)}),
    ("pressure", {"west": -1.0}),
    ("ambient is None", {"ambient": None}),
    ("cavitation is 'low'", {"cavitation": "low"}),
    ("supplies is 3", {"supplies": 3}),
    ("a supply is 1", {"supplies": [1]}),
    ("a supply's size is 1", {"supplies": [((0, 0), 1, 1)]}),
    ("duration and the oil", {"duration": 1.0}),
    ("there is no method 'MGX'", {"method": "MGX"}),
])
def test_a_wrong_film_is_a_value_error(sentence, options):
    with pytest.raises(ValueError, match=sentence):
        hlcp.film(**{"gap": STEP, **PAD, **options})
