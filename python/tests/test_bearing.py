"""Bearings: the figures of the command, and what is more in Python."""

import json
import math
import pickle
import shutil
import subprocess
import sys
import textwrap
from pathlib import Path

import numpy as np
import pytest

import hlcp
from hlcp._bearing import _snake

HERE = Path(__file__).parent
BEARING = dict(diameter=0.1, length=0.05, clearance=1e-4, nx=60, ny=10)
OIL = {"rpm": 3000, "viscosity": 0.02}
WEDGE = dict(size=(0.05, 0.03), plane=(40e-6, 20e-6), nx=40, ny=20)
SLIDES = {"speed": 3.0, "viscosity": 0.04}


def journal(**options):
    return hlcp.Journal(**BEARING | {"grooves": [(0.0, 1e5)]} | options)


def pad(**options):
    return hlcp.Pad(**WEDGE | options)


def close(found, wanted, within=1e-12):
    """Whether numbers, or lists of them, agree to a part of the largest."""
    found, wanted = np.asarray(found, float), np.asarray(wanted, float)
    return np.all(np.abs(found - wanted) <= within * np.max(np.abs(wanted)))


# The same films as options of the command and as calls, and the figures of the first ones.

ROUND = "--journal --diameter 0.1 --length 0.05 --clearance 1e-4 --rpm 3000 --viscosity 0.02 --nx 60 --ny 10"
FLAT = "--lx 0.05 --ly 0.03 --speed 3 --viscosity 0.04"
FILMS = {
    "ecc": (f"{ROUND} --groove 0,1e5 --ecc 0.7 --coefficients --certify --data-tolerance 1e-3",
            lambda: journal().film(**OIL, ecc=0.7, certify=True, tolerance=1e-3)),
    "load": (f"{ROUND} --groove 0,1e5 --load 2000 --coefficients",
             lambda: journal().film(**OIL, load=2000)),
    "attitude": (f"{ROUND} --groove 90 --groove 270,2e5 --load 2000 --attitude 20 --coefficients"
                 " --ambient 1e4 --cavitation=-5e4 --tilt 2e-4,1e-4",
                 lambda: journal(grooves=[90, (270, 2e5)], ambient=1e4, cavitation=-5e4,
                                 tilt=(2e-4, 1e-4)).film(**OIL, load=2000, attitude=20)),
    "backwards": (f"{ROUND.replace('3000', '-3000')} --supply 0.1,0.02,0.03,0.01,2e5 --ecc 0.6"
                  " --side south=closed --side north=starved,0.5 --pocket 0.2,0.01,0.02,0.02,1e-5"
                  " --sensitivities",
                  lambda: journal(grooves=[], supplies=[((0.1, 0.02), (0.03, 0.01), 2e5)],
                                  pockets=[((0.2, 0.01), (0.02, 0.02), 1e-5)], south="closed",
                                  north=("starved", 0.5)).film(rpm=-3000, viscosity=0.02, ecc=0.6)),
    "speeds": (f"{ROUND.replace('--rpm 3000', '--speed 3,8')} --groove 10,1e5 --ecc 0.5",
               lambda: journal(grooves=[(10, 1e5)]).film(speed=(3, 8), viscosity=0.02, ecc=0.5)),
    "plane": (f"--pad plane,40e-6,20e-6 {FLAT} --nx 40 --ny 20 --coefficients --certify",
              lambda: pad().film(**SLIDES, certify=True)),
    "dimples": (f"--pad plane,40e-6,20e-6 {FLAT} --nx 48 --ny 24 --dimples 4,3,6e-3,5e-3,1e-5,ellipse"
                " --tilt 1e-5,2e-5 --load 700,0.029,0.015 --ambient 1e5",
                lambda: pad(nx=48, ny=24, dimples=[((4, 3), (6e-3, 5e-3), 1e-5, "ellipse")],
                            tilt=(1e-5, 2e-5), ambient=1e5).film(**SLIDES, load=700,
                                                                 at=(0.029, 0.015))),
    "lobes": (f"{ROUND} --lobes 3,0.4,0.7,20 --groove 80,1e5,12 --groove 200,1e5,12,0.03 --load 900"
              " --attitude 0 --dam 230,300,0.03,5e-5 --coefficients",
              lambda: journal(lobes=(3, 0.4, 0.7, 20), grooves=[(80, 1e5, 12), (200, 1e5, 12, 0.03)],
                              dams=[((230, 300), 0.03, 5e-5)]).film(**OIL, load=900, attitude=0)),
    "taper": (f"--pad taper,40e-6,20e-6,0.04 {FLAT} --nx 40 --ny 20",
              lambda: pad(plane=None, taper=(40e-6, 20e-6, 0.04)).film(**SLIDES)),
    "oil": (f"{ROUND} --groove 0,1e5 --ecc 0.3 --oil 950,1800",
            lambda: journal(oil=(950, 1800)).film(**OIL, ecc=0.3)),
    "parabola": (f"--pad parabola,2e-5,10,0.03 {FLAT} --nx 40 --ny 20 --load 300 --coefficients",
                 lambda: pad(plane=None, parabola=(2e-5, 10, 0.03)).film(**SLIDES, load=300)),
    "method": (f"--pad plane,40e-6,20e-6 {FLAT} --nx 40 --ny 20 --method AUTO",
               lambda: pad().film(**SLIDES, method="AUTO")),
}
SIDES = "west", "east", "south", "north"


def test_sensitivities_are_of_gaps_and_under_loads_or_in_positions():
    wall = pad(south="closed", supplies=[((0.03, 0), (0, 0.03), 2e5)]).film(**SLIDES)
    found = wall.sensitivities(gaps={"more": np.ones((20, 40))})
    assert list(found) == [
        "speed", "upper_speed", "viscosity", "rise", "slope_x", "slope_y", "ambient", "cavitation",
        "west", "east", "north", "supplies[0]", "more"]
    assert close(found["more"].forces, found["rise"].forces)
    now = journal().film(**OIL, load=3000, attitude=20)
    found, fixed = now.sensitivities(), now.sensitivities(position=True)
    assert "ecc" in fixed and "ecc" not in found and fixed["speed"].load > 1.0
    assert abs(found["speed"].load) < 1e-6 * fixed["speed"].load
    assert pickle.loads(pickle.dumps(now)).sensitivities()["speed"] == found["speed"]


def test_doubts_are_warned_of():
    with pytest.warns(UserWarning, match=r"nothing feeds this film.*grooves=\[\(0, 2e5\)\]"):
        journal(grooves=[]).film(**OIL, ecc=0.5)
    with pytest.warns(UserWarning, match=r"a viscosity of 40 Pa s .*1 cP is 0.001 Pa s"):
        pad().film(speed=3.0, viscosity=40.0)
    with pytest.warns(UserWarning, match=r"a viscosity of 40 Pa s .*1 cP is 0.001 Pa s"):
        hlcp.film(np.full((4, 6), 2e-5), size=(0.05, 0.03), speed=3.0, viscosity=40.0)
    with pytest.warns(UserWarning, match=r"a viscosity of 40 Pa s .*1 cP is 0.001 Pa s"):
        hlcp.profile([0, 0.05], [4e-5, 2e-5], speed=3.0, viscosity=40.0)


def test_sensitivities_of_no_film_are_refused():
    with pytest.raises(ValueError, match="so it runs dry"), pytest.warns(UserWarning):
        journal(grooves=[]).film(**OIL, ecc=0.5).sensitivities()
    with pytest.raises(ValueError, match="has the shape"):
        pad().film(**SLIDES).sensitivities(gaps={"bump": [1.0, 2.0]})


def figures(film):
    """The figures of a film by the names of the command."""
    return {
        "load_n": film.load, "load_x_m": film.at[0], "load_y_m": film.at[1],
        "moments_n_m": film.moments, "friction_moving_n": film.friction[0],
        "friction_fixed_n": film.friction[1], "full_friction_moving_n": film.full_friction[0],
        "full_friction_fixed_n": film.full_friction[1], "power_w": film.power,
        "peak_pressure_pa": film.peak, "least_gap_m": film.least_gap,
        "broken_share": film.broken_share, "least_content": film.least_content, "ecc": film.ecc,
        "attitude_deg": film.attitude, "specific_load_pa": film.specific_load,
        "sommerfeld": film.sommerfeld, "torque_n_m": film.torque, "leakage_m3_s": film.leakage,
        "temperature_rise_k": film.temperature_rise, "reynolds": film.reynolds,
        "reynolds_laminar": film.laminar,
    }


@pytest.fixture(scope="session")
def command():
    """The command, if it is built."""
    built = HERE.parents[1] / "target" / "release" / "hlcp"
    return str(built) if built.exists() else shutil.which("hlcp")


STORED = HERE / "films.json"


@pytest.mark.parametrize("name", FILMS)
def test_the_figures_are_those_of_the_command(name, command, tmp_path):
    options, call = FILMS[name]
    wanted = json.loads(STORED.read_text())[name]
    runs = [(wanted, 1e-9)]  # Of another machine, as far as a search goes.
    if command:
        run = subprocess.run([command, "film", *options.split(), "--json", "--out", tmp_path / "f"],
                             capture_output=True, text=True)
        assert run.returncode == 0, run.stderr
        runs.append((json.loads(run.stdout), 1e-12))
    film = call()
    for wanted, within in runs:
        for key, found in figures(film).items():
            if wanted[key] is None:
                assert found is None or math.isnan(found), key
            elif key == "moments_n_m":
                # Differences of what is much more.
                assert np.allclose(found, wanted[key], rtol=within, atol=within * film.load), key
            else:
                assert close(found, wanted[key], within), (key, found, wanted[key])
        flows = [wanted["flow_m3_s"][side] or 0.0 for side in SIDES]
        assert close([*film.sides, *film.supplies], [*flows, *wanted["flow_m3_s"]["supplies"]],
                     within)
        if wanted["position"]:
            assert close(film.position, wanted["position"], within)
        if "--coefficients" in options:
            pairs = [(film.stiffness, "stiffness_n_m"), (film.damping, "damping_n_s_m"),
                     (film.clamped[0], "stiffness_clamp_n_m"),
                     (film.clamped[1], "damping_clamp_n_s_m")]
            for found, key in pairs:
                assert close(found, wanted[key], within), key
        if wanted.get("sensitivities"):
            told = film.sensitivities()
            assert told.keys() == wanted["sensitivities"].keys()
            for name, slopes in wanted["sensitivities"].items():
                of = told[name]
                keys = ("load_n friction_moving_n friction_fixed_n full_friction_moving_n"
                        " full_friction_fixed_n power_w peak_pressure_pa ecc attitude_deg").split()
                assert [of.load, *of.friction, *of.full_friction, of.power, of.peak, of.ecc,
                        of.attitude] == pytest.approx([slopes[key] for key in keys], rel=1e-9), name
                flows = slopes["flow_m3_s"]
                assert close([of.sides[3], *of.supplies], [flows["north"], *flows["supplies"]],
                             1e-9), name
        if wanted["bounds"]:
            # These are of the exact solution, and how far what is printed may be off it.
            pairs = [(film.bounds.load, film.load, "load_n"),
                     (film.bounds.peak, film.peak, "peak_pressure_pa"),
                     (film.bounds.friction[0], film.friction[0], "friction_moving_n")]
            for (lower, upper), found, key in pairs:
                assert lower <= upper and max(upper - found, found - lower) == pytest.approx(
                    wanted["bounds"][key], rel=0.1, abs=1e-12 * abs(found)), key
        if wanted["range"]:
            assert np.allclose(film.range.load, wanted["range"]["load_n"], rtol=1e-9)
            assert np.allclose(film.range.friction[0], wanted["range"]["friction_moving_n"],
                               rtol=1e-9)


def test_maps_are_those_of_the_command(command, tmp_path):
    rng = np.random.default_rng(5)
    gap = np.linspace(40e-6, 20e-6, 30) * np.ones((12, 1))
    rough, oil = 1e-6 * rng.random((12, 30)), 0.02 + 0.02 * rng.random((12, 30))
    film = hlcp.Pad((0.05, 0.03), map=gap, roughness=rough).film(speed=3, viscosity=oil)
    same = hlcp.film(gap + rough, size=(0.05, 0.03), speed=3, viscosity=oil)
    assert film.load == pytest.approx(same.load, rel=1e-10)
    assert np.allclose(film.pressure, same.pressure, rtol=1e-8, atol=1e-8 * same.peak)
    if command:
        for name, array in {"gap": gap, "rough": rough, "oil": oil}.items():
            np.save(tmp_path / f"{name}.npy", array)
        run = subprocess.run(
            [command, "film", "--map", "gap.npy", "--roughness", "rough.npy", "--viscosity", "oil.npy",
             *"--lx 0.05 --ly 0.03 --speed 3 --json --out f".split()], cwd=tmp_path,
            capture_output=True, text=True)
        wanted = json.loads(run.stdout)
        assert close(film.load, wanted["load_n"]) and close(film.power, wanted["power_w"])
        assert close(film.pressure, np.load(tmp_path / "f-pressure.npy"))
        assert close(film.content, np.load(tmp_path / "f-content.npy"))


MOTIONS = {
    "orbit": (f"{ROUND} --groove 0,1e5 --attitude 10", True),
    "falls": (f"{ROUND} --groove 0,1e5 --attitude 10 --ecc 0.3 --mass 4", True),
    "squeeze": ("--pad plane,40e-6,20e-6 --lx 0.05 --ly 0.03 --viscosity 0.04 --nx 40 --ny 20", False),
    "drops": (f"--pad plane,40e-6,20e-6 {FLAT} --nx 40 --ny 20 --mass 2", False),
}


@pytest.mark.parametrize("name", MOTIONS)
def test_motions_are_those_of_the_command(name, command, tmp_path):
    if not command:
        pytest.skip("the command is not built")
    options, is_journal = MOTIONS[name]
    times = np.linspace(0.0, 4e-3, 9)
    wave = np.sin(2 * np.pi * times / 4e-3)
    if name == "orbit":
        rows = 1e-5 * np.column_stack([3 + wave, 2 - wave])
        motion = journal().motion(times, **OIL, positions=rows, attitude=10)
    elif name == "falls":
        rows = np.column_stack([2000 + 100 * wave, 100 * wave])
        motion = journal().motion(times, **OIL, loads=rows, mass=4, ecc=0.3, attitude=10)
    elif name == "squeeze":
        rows = np.column_stack([-3e-6 * wave, 2e-5 * wave])
        motion = pad().motion(times, viscosity=0.04, positions=rows)
    else:
        rows = (900 + 50 * wave)[:, None]
        motion = pad().motion(times, **SLIDES, loads=rows[:, 0], mass=2)
    np.savetxt(tmp_path / "m.csv", np.column_stack([times, rows]), delimiter=",", fmt="%.17g")
    run = subprocess.run([command, "film", *options.split(), "--motion", "m.csv", "--out", "f",
                          "--json"], cwd=tmp_path, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    table = np.loadtxt(tmp_path / "f-motion.csv", delimiter=",", skiprows=1)
    found = np.column_stack([motion.times, motion.load, motion.at, motion.friction, motion.power,
                             motion.sides, motion.supplied, motion.oil, motion.peak,
                             motion.least_gap, motion.broken_share, motion.position])
    assert motion.success and table.shape == found.shape
    for one, other in zip(found.T, table.T):
        assert np.array_equal(np.isnan(one), np.isnan(other))
        assert close(np.nan_to_num(one), np.nan_to_num(other), 1e-12)
    last = json.loads(run.stdout)
    assert close(motion.film.load, last["load_n"]) and close(motion.film.power, last["power_w"])
    assert motion.imbalance == pytest.approx(last["mass_imbalance_m3_s"], abs=1e-25)


def test_a_motion_may_be_a_rise_alone_and_its_load_one_number():
    times = np.linspace(0.0, 0.01, 6)
    motion = pad().motion(times, viscosity=0.04, positions=-1e-4 * times)
    assert motion.film.success and motion.film.position == pytest.approx([-1e-6, 0, 0])
    assert np.array_equal(motion.film.sides, motion.sides[-1])
    constant = journal().motion(times, **OIL, loads=1000, mass=5)
    assert constant.position.shape == (5, 2)


def test_a_motion_begins_where_a_load_is_carried():
    rest = journal().film(**OIL, load=2000, attitude=0)
    still = journal().motion(np.linspace(0, 1e-2, 6), **OIL, loads=2000, mass=3, load=2000)
    assert still.film.ecc == pytest.approx(rest.ecc, abs=1e-6)
    assert still.film.attitude == pytest.approx(rest.attitude, abs=1e-4)
    level = pad().film(**SLIDES, load=900)
    floating = pad().motion([0, 1e-3, 2e-3], **SLIDES, loads=900, mass=0, load=900)
    assert np.allclose(floating.position[:, 0], level.position[0], rtol=1e-6)
    with pytest.raises(ValueError, match="load is where a free motion begins"):
        pad().motion([0, 1], **SLIDES, positions=[0, 0], load=900)


def test_a_load_is_carried_and_found_again():
    bearing = journal()
    fixed = bearing.film(**OIL, load=2000, attitude=0)
    again = bearing.film(**OIL, ecc=fixed.ecc, attitude=fixed.attitude)
    assert fixed.load == pytest.approx(2000, rel=1e-8) == again.load
    assert again.attitude == pytest.approx(fixed.attitude, rel=1e-8)
    assert again.at[0] == pytest.approx(0.05 * math.pi)
    backwards = bearing.film(rpm=-3000, viscosity=0.02, ecc=fixed.ecc, attitude=fixed.attitude)
    assert backwards.load == pytest.approx(2000, rel=1e-7)
    wall = pad().film(**SLIDES, load=900, at=(0.029, 0.016))
    assert wall.load == pytest.approx(900) and wall.at == pytest.approx([0.029, 0.016], rel=1e-6)
    started = bearing.film(**OIL, load=2100, attitude=0, start=fixed)
    assert started.films < fixed.films and started.load == pytest.approx(2100)
    # What is not asked for stays.
    assert bearing.film(**OIL, load=2100, start=fixed).position[1] == 0 != fixed.position[1]
    level = pad().film(**SLIDES, load=900, start=wall)
    assert level.position[1:] == [0, 0] != wall.position[1:] and level.load == pytest.approx(900)


def test_coefficients_are_differences_of_loads():
    bearing, step = journal(), 1e-4
    film = bearing.film(**OIL, ecc=0.5)
    size = BEARING["clearance"] * step
    # Along the load and across it, a displacement of the journal closes the gap on that side.
    turn = film.at[0] / (0.05)
    e1, e2 = np.array([np.cos(turn), np.sin(turn)]), np.array([-np.sin(turn), np.cos(turn)])

    def force(position):
        ecc, angle = np.hypot(*position), np.degrees(np.arctan2(position[1], position[0]))
        moved = bearing.film(**OIL, ecc=ecc / BEARING["clearance"], attitude=angle)
        angle = moved.at[0] / 0.05
        total = moved.load * np.array([np.cos(angle), np.sin(angle)])
        return np.array([total @ e1, total @ e2])

    at = np.array(film.position)
    for k, way in enumerate((e1, e2)):
        # The position points to the widest gap, away from where the journal goes.
        slope = (force(at - size * way) - force(at + size * way)) / (2 * size)
        assert np.allclose(slope, film.stiffness[:, k], rtol=2e-3, atol=2e-3 * film.stiffness.max())


def test_coefficients_of_arrays_are_those_of_films():
    bearing = journal()
    rpm = np.array([1500.0, 3000.0, 6000.0])
    found = bearing.coefficients(rpm=rpm, viscosity=0.02, load=[1000, 2000, 1000])
    assert found.omega == pytest.approx(rpm * 2 * np.pi / 60)
    assert found.load == pytest.approx([1000, 2000, 1000])
    for k in range(3):
        film = bearing.film(rpm=rpm[k], viscosity=0.02, load=[1000, 2000, 1000][k])
        assert found.ecc[k] == pytest.approx(film.ecc, rel=1e-7)
        assert close(found.stiffness[k], film.stiffness, 1e-6)
    clamped = bearing.coefficients(rpm=3000, viscosity=0.02, ecc=0.5, clamped=True)
    assert close(clamped.stiffness[0], bearing.film(**OIL, ecc=0.5).clamped[0], 1e-9)
    heights = pad().coefficients(speed=[2, 3], viscosity=0.04)
    assert heights.damping.shape == (2, 3, 3) and heights.stiffness[0, 0, 0] > 0
    with pytest.raises(ValueError, match=r"shapes that do not fit: viscosity \(\), rpm \(2,\), load \(3,\)"):
        bearing.coefficients(rpm=[1, 2], viscosity=0.02, load=[1, 2, 3])
    with pytest.raises(ValueError, match="with viscosity=0.02, rpm=3000, load=-1: load is -1"):
        bearing.coefficients(rpm=3000, viscosity=0.02, load=-1)


def test_whirls_are_those_of_the_command(command, tmp_path):
    film = journal().film(**OIL, ecc=0.4)
    assert close(film.coefficients(0)[0], film.stiffness, 0)
    mass, ratio = film.threshold
    k, c = film.coefficients(ratio)
    omega = ratio * 100 * np.pi
    impedance = k - mass * omega**2 * np.eye(2) + 1j * omega * c
    assert abs(np.linalg.det(impedance)) <= 1e-8 * np.abs(impedance).max() ** 2
    found = journal().coefficients(**OIL, ecc=0.4, frequency=[0.5, ratio])
    assert close(found.stiffness[1], k) and close(found.damping[0], film.coefficients(0.5)[1])
    assert pad().film(**SLIDES).coefficients(0.5)[0].shape == (3, 3)
    if command:
        run = subprocess.run([command, "film", *ROUND.split(), "--groove", "0,1e5", "--ecc", "0.4",
                              "--whirl", "0.5", "--json", "--out", tmp_path / "f"],
                             capture_output=True, text=True)
        assert run.returncode == 0, run.stderr
        told = json.loads(run.stdout)
        assert close(film.coefficients(0.5)[0], told["whirl"][0]["stiffness_n_m"])
        assert (mass, ratio) == pytest.approx((told["critical_mass_kg"],
                                               told["whirl_frequency_ratio"]), rel=1e-12)


def test_a_rotor_has_its_bearing():
    ross = pytest.importorskip("ross")
    sys.path.insert(0, str(HERE.parent / "examples"))
    from rotor import element

    found = journal().coefficients(rpm=[1500, 3000, 4500, 6000], viscosity=0.02, load=1000,
                                   attitude=0)
    bearing = element(found, node=0)
    assert isinstance(bearing, ross.BearingElement)
    # Down is along the load, and x is a quarter further in the direction of the motion.
    (along, cross), (back, across) = found.stiffness[1]
    expected = [[across, -back], [-cross, along]]
    assert np.allclose(bearing.K(found.omega[1])[:2, :2], expected, rtol=1e-6)
    (along, cross), (back, across) = found.damping[1]
    expected = [[across, -back], [-cross, along]]
    assert np.allclose(bearing.C(found.omega[1])[:2, :2], expected, rtol=1e-6)


def test_a_row_of_films_goes_from_neighbour_to_neighbour():
    assert list(_snake([2, 3])) == [0, 1, 2, 5, 4, 3]
    assert sorted(_snake([3, 2, 4])) == list(range(24)) and list(_snake([])) == [0]
    rpm = np.linspace(1000, 5000, 16)
    found = journal().coefficients(rpm=rpm, viscosity=0.02, load=1000)
    alone = [journal().film(rpm=speed, viscosity=0.02, load=1000).films for speed in rpm]
    # Where four films lead, the next one is nearly there.
    led = [film.films for film in found.films]
    assert max(led[5:]) <= 3 < min(alone[5:])


def test_sweeps_are_films_in_any_number_of_threads(capsys):
    bearing = journal()
    lists = dict(rpm=[1500, 3000], load=[500, 1000, 2000], clearance=[8e-5, 1e-4])
    records = bearing.sweep(**lists, viscosity=0.02, coefficients=True, progress=False)
    assert len(records) == 12 and capsys.readouterr().err == ""
    assert [run["rpm"] for run in records] == [1500] * 6 + [3000] * 6
    assert [run["clearance"] for run in records] == [8e-5, 1e-4] * 6
    for run in records[::5]:
        film = bearing.replace(clearance=run["clearance"]).film(
            rpm=run["rpm"], load=run["load"], viscosity=0.02)
        assert run["success"] and run["ecc"] == pytest.approx(film.ecc, rel=1e-7)
        assert run["power"] == pytest.approx(film.power, rel=1e-7)
        assert close(run["stiffness"], film.stiffness, 1e-5)
    shared = bearing.sweep(**lists, viscosity=0.02, threads=2, progress=True)
    assert [run["ecc"] for run in shared] == pytest.approx([run["ecc"] for run in records])
    assert capsys.readouterr().err.endswith("############################## 12/12\n")


def test_what_fails_in_a_sweep_is_a_record():
    records = journal().sweep(ecc=[0.2, 1.5], **OIL, coefficients=True, keep=True)
    assert records[0]["success"] and records[0]["film"].ecc == pytest.approx(0.2)
    assert not records[1]["success"] and "ecc is 1.5" in records[1]["message"]
    assert math.isnan(records[1]["load"]) and np.isnan(records[1]["damping"]).all()
    rises = pad().sweep(load=[600, 1200], **SLIDES)
    assert rises[0]["rise"] > rises[1]["rise"] and rises[0]["slope_x"] == 0


def test_results_survive_pickling_with_their_coefficients():
    film = journal().film(**OIL, load=1000, certify=True)
    copy = pickle.loads(pickle.dumps(film))
    assert close(copy.stiffness, film.stiffness) and copy.bounds == film.bounds
    assert copy.status is hlcp.Status.CONVERGED
    assert pickle.loads(pickle.dumps(journal())).film(**OIL, load=1000).ecc == pytest.approx(film.ecc)


def test_ctrl_c_ends_a_search_and_threads_change_nothing():
    program = """
        import os, signal, threading, time, hlcp
        signal.signal(signal.SIGINT, signal.default_int_handler)
        bearing = hlcp.Journal(0.1, 0.05, 1e-4, grooves=[0], nx=720, ny=240)
        threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT)).start()
        begun = time.monotonic()
        try:
            bearing.sweep(rpm=list(range(1000, 3000, 100)), viscosity=0.02, load=1000)
        except KeyboardInterrupt:
            print(time.monotonic() - begun)
    """
    run = subprocess.run([sys.executable, "-c", textwrap.dedent(program)], capture_output=True,
                         text=True)
    assert run.returncode == 0 and run.stderr == "" and float(run.stdout) < 20
    wide = pad(nx=160, ny=120)
    one, two = (wide.film(**SLIDES, method="MGF", threads=threads) for threads in (1, 2))
    assert np.array_equal(one.pressure, two.pressure)


def test_pictures_are_drawn(monkeypatch):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    ax = journal().film(**OIL, ecc=0.7).plot()
    assert ax.get_xlim() == (0, 360) and len(ax.lines) == 2 and len(ax.images) == 2
    assert pad().film(**SLIDES).plot().get_xlim() == pytest.approx((0, 50))
    times = np.linspace(0, 1e-3, 4)
    motion = journal().motion(times, **OIL, loads=500, mass=1)
    orbit = motion.plot().lines[0]
    assert np.allclose(orbit.get_xdata(), 1e4 * motion.position[:, 1])
    assert np.allclose(orbit.get_ydata(), -1e4 * motion.position[:, 0])
    assert pad().motion(times, viscosity=0.04, positions=-1e-3 * times).plot().get_ylabel()
    monkeypatch.setitem(sys.modules, "matplotlib.pyplot", None)
    with pytest.raises(ImportError, match="pip install matplotlib"):
        motion.plot()


@pytest.mark.filterwarnings("ignore:nothing feeds")
@pytest.mark.parametrize("sentence, call", [
    ("diameter is -1.0, but it must be positive", lambda: journal(diameter=-1)),
    ("clearance is 'thin', but it must be a real number", lambda: journal(clearance="thin")),
    ("nx is 0, but it must be at least 1", lambda: journal(nx=0)),
    (r"grooves is 90, but it must be a list", lambda: journal(grooves=90)),
    (r"grooves\[1\] is \(\), but it must be an angle", lambda: journal(grooves=[0, ()])),
    ("south and north must both be 'periodic'", lambda: journal(south="periodic")),
    ("ambient is -1.0 Pa, below cavitation", lambda: journal(ambient=-1.0)),
    (r"roughness has the shape \(2, 2\), but the film has \(10, 60\)",
     lambda: journal(roughness=np.zeros((2, 2)))),
    (r"pockets\[0\] from x = 0.045 m to 0.055 m is outside the film, which ends at 0.05 m",
     lambda: pad(pockets=[((0.045, 0.0), (0.01, 0.01), 1e-5)])),
    (r"pockets\[0\] of 0.00001 m by 0.00001 m is lost in cells",
     lambda: pad(pockets=[((0.01, 0.01), (1e-5, 1e-5), 1e-5)])),
    (r"pockets\[0\] is 3, but it must be \(\(x, y\), \(lx, ly\), depth\)", lambda: pad(pockets=[3])),
    (r"dimples\[0\] overlap; the film has 0.005 m by 0.003 m for each",
     lambda: pad(dimples=[((10, 10), (0.006, 0.001), 1e-5)])),
    (r"dimples\[0\]: the number is 0", lambda: pad(dimples=[((0, 1), (0.006, 0.001), 1e-5)])),
    (r"supplies\[0\] from y = 0.04 m", lambda: pad(
        supplies=[((0.01, 0.04), (0.01, 0.01), 1e5)]).film(**SLIDES)),
    ("a pad has one shape", lambda: pad(map=np.ones((2, 2)))),
    ("a pad has one shape", lambda: pad(plane=None)),
    ("nx is 3, but the map has 2", lambda: hlcp.Pad((1, 1), map=np.ones((2, 2)), nx=3)),
    ("parabola is 3, but", lambda: pad(plane=None, parabola=3)),
    ("viscosity is 0.0, but it must be positive", lambda: journal().film(rpm=1, viscosity=0.0, ecc=0)),
    (r"viscosity\[1, 2\] is -1.0", lambda: pad(nx=3, ny=2).film(
        speed=1, viscosity=[[1.0, 1, 1], [1, 1, -1]])),
    ("give rpm or speed, not both", lambda: journal().film(**OIL, speed=3, ecc=0.5)),
    ("a journal needs its position", lambda: journal().film(**OIL)),
    ("ecc is 1.0, but an eccentricity", lambda: journal().film(**OIL, ecc=1.0)),
    ("load is -3.0 N, but it must be positive", lambda: journal().film(**OIL, load=-3)),
    ("the journal meets its bush at an end, 180.0 degrees from x = 0",
     lambda: journal(tilt=(1e-2, 0)).film(**OIL, ecc=0.5)),
    ("the journal meets its bush at an end, 180.0 degrees from x = 0",
     lambda: journal(lobes=(2, 0.5), nx=13).film(**OIL, ecc=0.501)),
    ("a frequency is over the running speed, but nothing runs",
     lambda: journal(grooves=[(0, 2e5)]).film(viscosity=1, ecc=0.5).coefficients(0.5)),
    ("it answers to no motion: nothing feeds", lambda: journal(grooves=[]).film(
        **OIL, ecc=0.5).threshold),
    ("the walls meet at x = 0 m, where the gap is -1e-6 m",
     lambda: pad(plane=(-1e-6, 2e-5)).film(**SLIDES)),
    ("nothing drives the film: the walls carry nothing and all pressures are 0 Pa",
     lambda: pad().film(viscosity=0.04)),
    ("it carries nothing instead of 100 N: nothing feeds", lambda: journal(grooves=[]).film(
        **OIL, load=100)),
    ("no method 'MGX'", lambda: pad().film(**SLIDES, method="MGX")),
    ("threads is 1025, but it must be at most 1024", lambda: pad().film(**SLIDES, threads=1025)),
    ("attitude is inf, but it must be finite", lambda: journal().film(
        **OIL, ecc=0.5, attitude=math.inf)),
    ("attitude is nan, but it must be finite", lambda: journal().motion(
        [0, 1], **OIL, positions=np.zeros((2, 2)), attitude=math.nan)),
    ("tolerance is 2.0, but it must be a part", lambda: pad().film(**SLIDES, tolerance=2.0)),
    ("at is where a load acts, but there is no load", lambda: pad().film(**SLIDES, at=(0, 0))),
    ("at: y is 0.04 m, outside the film", lambda: pad().film(**SLIDES, load=9, at=(0.01, 0.04))),
    (r"start must be the answer of a Journal of the shape \(10, 60\)",
     lambda: journal().film(**OIL, ecc=0.5, start=pad().film(**SLIDES))),
    ("1000000000000 N failed.*take more cells where the film is narrow",
     lambda: journal(nx=12, ny=3).film(**OIL, load=1e12)),
    ("there is no option bore to sweep; there are rpm", lambda: journal().sweep(bore=[1, 2])),
    ("viscosity is missing", lambda: journal().sweep(rpm=[1000, 2000], ecc=0.5)),
    ("load is an empty list", lambda: journal().sweep(**OIL, load=[])),
    ("the preload of the lobes is 1.5, but it must be from 0 to below 1",
     lambda: journal(lobes=(2, 1.5))),
    (r"lobes is \(2,\), but it must be", lambda: journal(lobes=(2,))),
    (r"grooves\[1\] has an angle of 100000.0 degrees", lambda: journal(grooves=(90, 1e5))),
    (r"grooves\[0\] has a width of -5.0 degrees .* the width must be 0 or more and below 360",
     lambda: journal(grooves=[(0, 1e5, -5)])),
    (r"dams\[0\] is from 90.0 to 20.0 degrees", lambda: journal(dams=[((90, 20), 0.03, 1e-5)])),
    ("the length of taper is 0.0, but it must be positive",
     lambda: pad(plane=None, taper=(2e-5, 1e-5, 0))),
    (r"oil is \(0, 1950\), but it must be a density", lambda: journal(oil=(0, 1950))),
    ("frequency is -1.0, but over the running speed", lambda: journal().film(
        **OIL, ecc=0.5).coefficients(-1)),
    ("by the clamp coefficients are those for slow motions", lambda: journal().coefficients(
        **OIL, ecc=0.5, frequency=1, clamped=True)),
    ("a threshold is that of a journal", lambda: pad().film(**SLIDES).threshold),
    ("a motion has positions, or loads", lambda: pad().motion([0, 1], viscosity=1)),
    ("loads move a wall with a mass", lambda: pad().motion([0, 1], viscosity=1, loads=3)),
    (r"positions has the shape \(2, 3\), but it must be \(n, 2\)",
     lambda: journal().motion([0, 1], **OIL, positions=np.zeros((2, 3)))),
    ("times must be two numbers or more", lambda: pad().motion([0, 0], viscosity=1, positions=[0, 0])),
    ("there are 3 rows of positions or loads, but 2 times",
     lambda: pad().motion([0, 1], viscosity=1, positions=[0, 0, 0])),
    (r"positions\[1\]: the walls meet", lambda: pad().motion([0, 1], viscosity=1, positions=[0, -1])),
    ("ecc is where the journal is", lambda: journal().motion(
        [0, 1], **OIL, positions=np.zeros((2, 2)), ecc=0.5)),
    ("mass is -1", lambda: pad().motion([0, 1], viscosity=1, loads=3, mass=-1)),
])
def test_a_wrong_bearing_is_a_value_error(sentence, call):
    with pytest.raises(ValueError, match=sentence):
        call()


def test_leakage_is_one_figure_everywhere():
    # More oil enters in the south than leaves there; it leaves in the north, and by a supply.
    bearing = journal(grooves=[], south=2e5, north=0.0, supplies=[((0.1, 0.01), (0.05, 0.01), 0.0)])
    film = bearing.film(**OIL, ecc=0.5)
    assert film.sides[2] < 0.0 < film.sides[3] and film.supplies[0] < 0.0
    assert film.leakage > film.sides[3] - film.supplies[0]
    [record] = bearing.sweep(**OIL, ecc=[0.5])
    assert record["leakage"] == film.leakage and record["supplied"] == film.supplies[0]


def test_an_unknown_option_is_a_type_error():
    with pytest.raises(TypeError, match="unexpected keyword argument 'bore'"):
        journal(bore=1)
