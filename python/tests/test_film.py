"""Films: the figures of the command, on a NumPy gap map."""

from pathlib import Path

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
    with pytest.warns(UserWarning, match="builds up pressure where the gap narrows that way"):
        result = hlcp.film(STEP[:, ::-1], **PAD)
    assert result.success and result.load == 0


def test_maps_of_another_shape_and_negative_oil_are_refused():
    gap = np.linspace(40e-6, 20e-6, 12) * np.ones((5, 1))
    film = dict(size=(0.05, 0.03), speed=3.0)
    thick = np.linspace(0.01, 0.1, 60).reshape(12, 5)
    assert hlcp.film(gap, viscosity=thick.T, **film).load > 0
    for wrong in (thick, thick.ravel(), thick[:1, :1]):
        with pytest.raises(ValueError, match=r"viscosity has the shape \(.*\), but the gap has \(5, 12\)"):
            hlcp.film(gap, viscosity=wrong, **film)
    step = dict(viscosity=0.04, duration=1e-3, **film)
    assert hlcp.film(gap, oil=gap, **step).load > 0
    for wrong in (gap.T, gap.ravel()):
        with pytest.raises(ValueError, match=r"oil has the shape \(.*\), but the gap has \(5, 12\)"):
            hlcp.film(gap, oil=wrong, **step)
    with pytest.raises(ValueError, match="the oil before a time step, in m, is -"):
        hlcp.film(gap, oil=-gap, **step)
    other = hlcp.film(gap.T.copy(), viscosity=0.04, **film)
    for start in (other, 3.0):
        with pytest.raises(ValueError, match=r"start must be the answer of a film of the shape \(5, 12\)"):
            hlcp.film(gap, viscosity=0.04, start=start, **film)


def test_a_pressure_is_any_real_number_but_not_a_truth():
    expected = rayleigh(west=1e5, east=10).load
    for kind in (np.float32, np.int64, np.array, float):
        assert rayleigh(west=kind(1e5), east=kind(10)).load == expected
    for wrong in (True, np.True_, np.array([1e5]), 1j, np.complex128(1)):
        with pytest.raises(ValueError, match="west is .* but it must be a pressure"):
            rayleigh(west=wrong)


def test_a_film_that_its_callback_stops_is_not_said_to_carry_nothing(recwarn):
    result = rayleigh(callback=lambda progress: True, method="MGS")
    assert result.status == hlcp.Status.STOPPED and not list(recwarn)


def test_a_ring_and_a_supply():
    around = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    gap = 1e-5 * (1 + 0.5 * np.cos(around)) * np.ones((20, 1))
    ring = {"west": "periodic", "east": "periodic"}
    fed = hlcp.film(gap, **PAD, **ring, supplies=[((0.0, 0.004), (0.001, 0.002), 2e5)])
    assert fed.success and fed.supplies[0] > 0
    assert fed.supplies[0] == pytest.approx(sum(fed.sides[2:]), rel=1e-6)
    dry = hlcp.film(gap, **PAD, **ring)
    assert dry.success and dry.content.max() <= 1e-15 and dry.load == 0
    # Before a closed side the last column stays full.
    sides = {"west": ["starved", 0.0], "east": "closed", "south": "closed", "north": "closed"}
    dry = hlcp.film(STEP, **PAD, **sides, ambient=1e5)
    assert dry.success and np.allclose(dry.content, np.arange(STEP.shape[1]) == STEP.shape[1] - 1)
    area = PAD["size"][0] * PAD["size"][1]
    assert dry.load == pytest.approx(-1e5 * area)


def test_a_ring_that_is_hardly_fed_is_told():
    around = (np.arange(40) + 0.5) / 40 * 2 * np.pi
    gap = 1e-6 * (1 + 0.9 * np.cos(around)) * np.ones((12, 1))
    ring = {"size": (0.5 * np.pi, 0.5), "speed": 25 * np.pi, "viscosity": 1.0,
            "west": "periodic", "east": "periodic"}
    with pytest.warns(UserWarning) as told:
        film = hlcp.film(gap, **ring, ambient=100.0)
    assert film.success and film.feed < 2e-8
    assert any(str(warning.message) == film.doubt for warning in told)
    assert "of the oil that goes round enters the film" in film.doubt


def test_a_ring_beyond_algebraic_multigrid_is_solved_by_default():
    ny, nx = 46, 23
    x, y = np.meshgrid((np.arange(nx) + 0.5) / nx, (np.arange(ny) + 0.5) / ny)
    gap = 1e-5 * (1.0 + 0.43 * np.cos(2 * np.pi * (x + 0.8 * y)))
    described = dict(size=(0.0659, 0.0122), speed=10.0, viscosity=0.03, west="periodic",
                     east="periodic", south=2.33, north=("starved", 0.166))
    by_default, other = hlcp.film(gap, **described), hlcp.film(gap, method="AUTO", **described)
    # It would go on for minutes, and by default must not.
    alone = hlcp.film(gap, method="AMG", maxtime=3.0, **described)
    assert by_default.success and not alone.success
    assert by_default.sweeps == other.sweeps and (by_default.pressure == other.pressure).all()
    easy = np.linspace(4e-5, 2e-5, 30) * np.ones((20, 1))
    pads = [hlcp.film(easy, size=(0.05, 0.03), speed=3.0, viscosity=0.04, **options)
            for options in ({}, {"method": "AMG"}, {"maxtime": 1e-9})]
    assert pads[0].success and pads[0].sweeps == pads[1].sweeps
    assert pads[2].status is hlcp.Status.TIME_LIMIT and pads[2].sweeps <= pads[1].sweeps


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
    (r"viscosity has the shape \(3,\)", {"viscosity": [1.0, 2.0, 3.0]}),
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


PROFILE = dict(speed=4.57, viscosity=0.039)


def test_a_profile_has_its_closed_form():
    x, h = [0.0, 0.014, 0.014 + 2e-8, 0.02], [4e-5, 4e-5, 2e-5, 2e-5]
    line = hlcp.profile(x, h, speed=2.0, viscosity=0.04, ambient=1e5)
    rise = 6 * 0.04 * 2 * 0.014 * 0.006 * 20e-6 / (0.006 * 64e-15 + 0.014 * 8e-15)
    assert line.success and line.peak == pytest.approx(1e5 + rise, rel=1e-5)
    assert line.load == pytest.approx(rise * 0.01, rel=1e-5) and line.ruptures == []
    assert repr(line).startswith("ProfileResult(load=") and "array" not in repr(line)
    assert line.peak_x == pytest.approx(0.014, rel=1e-5) and np.ptp(line.flow) < 1e-9 * line.flow[0]


def test_a_profile_is_that_of_the_command():
    # hlcp film crates/hlcp-cli/data/pad.csv --speed 4.57 --viscosity 0.039 --x-unit mm --h-unit um
    pad = np.loadtxt(Path(__file__).parents[2] / "crates/hlcp-cli/data/pad.csv", delimiter=",")
    line = hlcp.profile(1e-3 * pad[:, 0], 1e-6 * pad[:, 1], **PROFILE)
    assert line.peak == pytest.approx(3.591624e6, rel=1e-6)
    assert line.peak_x == pytest.approx(24.395975e-3, rel=1e-6)
    assert line.load == pytest.approx(1.013442e5, rel=1e-6)
    assert line.friction == pytest.approx(4.210918e2, rel=1e-6)
    assert line.ruptures == pytest.approx([51.804025e-3], rel=1e-6) and len(line.x) == 465
    assert len(hlcp.profile([0, 1e-3, 3e-3], [2e-5, 1e-5, 2e-5], **PROFILE, refine=5).x) == 11


@pytest.mark.parametrize("sentence, options", [
    ("x has 2 numbers and h 3", {"h": [1, 2, 3]}),
    (r"x\[1\] is 0.0, which does not exceed the x before it, 0.0; for a step", {"x": [0, 0]}),
    (r"h\[1\] is 0.0, but it must be positive", {"h": [1, 0]}),
    ("speed is -2, but it must be positive; turn the profile round", {"speed": -2}),
    ("speed is 0, but it must be positive$", {"speed": 0}),
    ("ambient is -1 Pa, below cavitation", {"ambient": -1}),
    ("no point between the ends", {"refine": 1}),
    ("refine is 65536, but it must be at most 65535", {"refine": 65536}),
])
def test_a_wrong_profile_is_a_value_error(sentence, options):
    with pytest.raises(ValueError, match=sentence):
        hlcp.profile(**{"x": [0.0, 0.01], "h": [2e-5, 1e-5], **PROFILE, **options})
