"""Python's side: threads, signals, exceptions, pickling, types."""

import doctest
import os
import pickle
import signal
import subprocess
import sys
import textwrap
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse.linalg import LinearOperator

import hlcp
from hlcp import FivePoint, scenes

HERE = Path(__file__).parent


@pytest.fixture
def interrupts():
    """Python's own answer to Ctrl-C, which a process in the background lacks."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.parametrize("m, threads", [(50, 1), (300, 1), (300, 2)])
def test_ctrl_c_ends_a_solve_and_leaves_arrays_alone(m, threads, interrupts):
    A, B, q, *_ = scenes.disc_lcp(m)
    before, solver = q.copy(), hlcp.Solver(A, B, "MSOR", threads=threads, alpha=1e-6)
    last = solver.solve(q, maxiter=5)
    timer = threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        solver.resume(q, rtol=0.0, maxiter=10**12)
    timer.join()
    assert np.array_equal(q, before) and solver.last is last
    assert solver.resume(q, maxiter=5).nit == 5


def test_a_process_may_end_with_an_interrupted_solve_under_way():
    program = """
        import os, signal, threading, hlcp
        signal.signal(signal.SIGINT, signal.default_int_handler)
        A, B, q, z, r = hlcp.scenes.disc_lcp(700)
        for call in (lambda: hlcp.solve(A.tocsr(), B, q, "AMG", rtol=0.0, maxiter=10**9),
                     lambda: hlcp.certify(A.tocsr(), B, q, z, r)):
            threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT)).start()
            try:
                call()
                threading.Event().wait(1.0)
            except KeyboardInterrupt:
                print("interrupted", flush=True)
    """
    run = subprocess.run([sys.executable, "-c", textwrap.dedent(program)],
                         capture_output=True, text=True)
    assert run.returncode == 0 and run.stderr == "" and run.stdout.startswith("interrupted")


@pytest.mark.parametrize("threads", [1, 2])
def test_other_threads_run_during_a_solve(threads):
    ticks, over = [], threading.Event()

    def tick():
        while not over.wait(0.001):
            ticks.append(time.monotonic())

    thread = threading.Thread(target=tick)
    thread.start()
    begun = time.monotonic()
    A, B, q, *_ = scenes.disc_lcp(50 if threads == 1 else 300)
    hlcp.solve(A, B, q, "MSOR", alpha=1e-6, maxiter=10**9, maxtime=0.3, threads=threads)
    ended = time.monotonic()
    over.set()
    thread.join()
    assert len([t for t in ticks if begun + 0.05 < t < ended - 0.05]) >= 5


def test_solves_on_several_threads_do_not_meet():
    A, B, q, *_ = scenes.example1(40)
    expected, found = hlcp.solve(A, B, q, "TMGS").z, []
    threads = [threading.Thread(target=lambda: found.append(hlcp.solve(A, B, q, "TMGS").z))
               for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(found) == 8 and all(np.array_equal(z, expected) for z in found)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_a_forked_process_solves_on_threads_of_its_own():
    A, B, q, *_ = scenes.example1(150)
    expected = hlcp.solve(A, B, q, "TMGS", threads=2).z
    child = os.fork()
    if child == 0:
        same = np.array_equal(hlcp.solve(A, B, q, "TMGS", threads=2).z, expected)
        os._exit(0 if same else 1)
    assert os.waitpid(child, 0)[1] == 0


class Strange(Exception):
    """Nothing that hlcp knows of."""


@pytest.mark.parametrize("threads", [1, 2])
def test_an_exception_comes_out_as_it_is(threads):
    mine = Strange("the third product")
    calls = []

    def failing(x):
        calls.append(x)
        if len(calls) == 3:
            raise mine
        return 4 * x

    options = {"omega": 4.0, "threads": threads, "method": "MMS"}
    products = LinearOperator((3, 3), matvec=failing, dtype=np.float64)
    with pytest.raises(Strange) as raised:
        hlcp.solve(products, None, -np.ones(3), splitting=lambda v: v / 16, **options)
    assert raised.value is mine and len(calls) == 3
    with pytest.raises(Strange) as raised:
        calls = [None, None]
        hlcp.solve(4 * np.eye(3), None, -np.ones(3), splitting=failing, **options)
    assert raised.value is mine

    def callback(progress):
        raise mine

    with pytest.raises(Strange) as raised:
        hlcp.solve(4 * np.eye(3), None, -np.ones(3), callback=callback, threads=threads)
    assert raised.value is mine
    with pytest.raises(ValueError, match="ambiguous"):
        hlcp.solve(np.eye(3), None, -np.ones(3), callback=lambda progress: progress.x)
    with pytest.raises(SystemExit):
        hlcp.solve(np.eye(3), None, -np.ones(3), callback=lambda progress: sys.exit())


def test_a_callback_may_solve():
    A, B, q, *_ = scenes.example1(8)
    inner = []
    hlcp.solve(A, B, q, "MGS", callback=lambda p: inner.append(hlcp.solve(A, B, q, "MGS").nit))
    assert len(set(inner)) == 1


def test_an_array_spoiled_during_the_solve_is_no_crash():
    for name in ("indices", "indptr"):
        A = FivePoint((20, 20), south=-1, west=-1, centre=4, east=-1, north=-1).tocsr()

        def spoil(progress):
            getattr(A, name)[:] = 10**6

        with pytest.raises(RuntimeError, match="an array was changed"):
            hlcp.solve(A, None, -np.ones(400), "MGS", callback=spoil)
    q = -np.ones(400)
    A = FivePoint((20, 20), south=-1, west=-1, centre=4, east=-1, north=-1)
    assert not hlcp.solve(A, None, q, callback=lambda progress: q.fill(np.nan)).success


def test_results_survive_pickling():
    A, B, q, *_ = scenes.bearing2d(9, 5)
    result = hlcp.solve(A, B, q)
    for thing in (result, hlcp.certify(A, B, q, result.z, result.r), A):
        copy = pickle.loads(pickle.dumps(thing))
        assert type(copy) is type(thing)
    copy = pickle.loads(pickle.dumps(result))
    assert copy.status is hlcp.Status.CONVERGED and np.array_equal(copy.z, result.z)
    assert set(result) >= {"z", "r", "x", "success", "status", "message", "nit", "sweeps", "residual"}
    assert np.array_equal(hlcp.solve(pickle.loads(pickle.dumps(A)), B, q).z, result.z)


def test_a_plot_is_drawn():
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    rng = np.random.default_rng(2)
    field = rng.standard_normal((5, 7))
    ax = hlcp.plot(np.maximum(field, 0), np.maximum(-field, 0), extent=(0, 7, 0, 5))
    ax.figure.canvas.draw()
    assert len(ax.images) == 2 and np.array_equal(ax.images[0].get_array(), np.maximum(field, 0))
    assert np.array_equal(ax.images[1].get_array().mask, field >= 0)
    line = hlcp.plot(field[0], field[0]).lines[0]
    assert np.array_equal(line.get_ydata(), field[0])
    with pytest.raises(ValueError, match="shape"):
        hlcp.plot(field, field[0])


def test_the_examples_of_the_docstrings_are_true():
    for name in ("", "._bearing", "._film", "._operators", "._plot", "._solve", ".scenes"):
        module = sys.modules["hlcp" + name]
        results = doctest.testmod(module)
        assert results.attempted > 0 and results.failed == 0
    for document in (HERE.parent / "README.md", HERE.parents[1] / "docs" / "guide.md"):
        results = doctest.testfile(str(document), module_relative=False)
        assert results.attempted > 5 and results.failed == 0


@pytest.mark.parametrize("script", ["analyst.py --m 15", "engineer.py --nx 30", "measure.py --quick",
                                    "rotor.py --nx 48", "superlu.py 3 1 1"])
def test_the_example_scripts_run(script):
    name, *options = script.split()
    run = subprocess.run([sys.executable, HERE.parent / "examples" / name, *options],
                         capture_output=True, text=True)
    assert run.returncode == 0 and len(run.stdout.splitlines()) >= 5, run.stderr


@pytest.mark.parametrize("checker", [["mypy.stubtest", "hlcp", "--mypy-config-file"],
                                     ["mypy", "-p", "hlcp", "--config-file"]])
def test_the_types_are_those_of_the_code(checker):
    pytest.importorskip("mypy")
    run = subprocess.run([sys.executable, "-m", *checker, HERE.parent / "pyproject.toml"],
                         capture_output=True, text=True)
    assert run.returncode == 0, run.stdout + run.stderr
