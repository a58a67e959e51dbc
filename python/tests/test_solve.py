"""Solving: every name, every kind of operator, every option."""

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.optimize import lsq_linear, nnls
from scipy.sparse.linalg import LinearOperator, splu

import hlcp
from hlcp import FivePoint, Status, scenes


def parameters(name):
    """The parameters that a name leaves open."""
    if name.endswith("SOR"):
        return {"alpha": 1.1}
    return {"alpha": 1.1, "beta": 0.9} if name.endswith("AOR") else {}


def residual(A, B, q, result):
    n = q.size
    B = sp.eye_array(n) if B is None else B
    return np.linalg.norm(A @ result.z.ravel() - B @ result.r.ravel() + q.ravel())


@pytest.mark.parametrize("name", hlcp.methods())
def test_every_name_solves_the_papers_example(name):
    A, B, q, z, r = scenes.example1(12)
    result = hlcp.solve(A, B, q, name.lower(), **parameters(name))
    assert result.success and result.status is Status.CONVERGED, result.message
    # Both operators have an inverse of max-norm below 1: error <= residual <= 1e-10 |q|.
    error = max(abs(result.z - z).max(), abs(result.r - r).max())
    assert error <= 1e-10 * np.linalg.norm(q)


@pytest.mark.parametrize("name", ["MGS", "TMSOR", "ANDERSON", "ADAPTIVE", "NEWTON", "AMG"])
@pytest.mark.parametrize("index", [np.int32, np.int64])
def test_a_matrix_takes_the_iterations_of_its_stencil(name, index):
    A, B, q, *_ = scenes.example2(20)
    stencil = hlcp.solve(A, B, q, name, **parameters(name))
    matrices = []
    for matrix in (A.tocsr(), B.tocsr()):
        matrix.indices, matrix.indptr = matrix.indices.astype(index), matrix.indptr.astype(index)
        matrices.append(matrix)
    matrix = hlcp.solve(*matrices, q, name, **parameters(name))
    assert (matrix.nit, matrix.sweeps) == (stencil.nit, stencil.sweeps)
    assert np.allclose(matrix.z, stencil.z, rtol=0, atol=1e-12)


def test_all_kinds_of_matrices_are_one_problem():
    A, B, q, *_ = scenes.example1(6)
    expected = hlcp.solve(A.tocsr(), B.tocsr(), q, "MGS")
    kinds = [
        np.array, np.asfortranarray, sp.csr_matrix, sp.csc_array, sp.coo_array,
        sp.dia_array, sp.lil_array, sp.bsr_array, lambda a: a.astype(np.int64),
        lambda a: np.ma.masked_array(a), lambda a: a.tolist(), lambda a: a.astype(">f8"),
    ]
    for kind in kinds:
        given = [kind(matrix.toarray()) for matrix in (A.tocsr(), B.tocsr())]
        result = hlcp.solve(*given, q, "MGS")
        assert np.array_equal(result.z, expected.z) and result.nit == expected.nit


def test_the_stencil_is_its_matrix():
    rng = np.random.default_rng(5)
    A = FivePoint((4, 3), south=rng.random((4, 3)), west=2.0, centre=rng.random(3),
                  east=rng.random((4, 1)), north=-1)
    x = rng.standard_normal(12)
    assert np.allclose(A @ x, A.tocsr() @ x, rtol=1e-14) and A.tocsr().nnz == 12 + 2 * (9 + 8)
    assert np.allclose(A @ np.eye(12), A.tocsr().toarray())


def test_without_b_it_is_the_lcp_of_nnls():
    rng = np.random.default_rng(11)
    M, d = rng.standard_normal((30, 12)), rng.standard_normal(30)
    result = hlcp.solve(M.T @ M, None, -M.T @ d, rtol=1e-13)
    assert result.success
    # The error is at most the residual over the least eigenvalue.
    bound = 1e-12 * np.linalg.norm(M.T @ d) / np.linalg.eigvalsh(M.T @ M)[0]
    assert np.abs(result.z - nnls(M, d)[0]).max() <= bound
    assert np.abs(result.z - lsq_linear(M, d, (0, np.inf), tol=1e-14).x).max() <= 1e-6
    explicit = hlcp.solve(M.T @ M, np.eye(12), -M.T @ d, rtol=1e-13)
    assert np.array_equal(explicit.z, result.z)


@pytest.mark.parametrize("method", ["AUTO", "ANDERSON", "MMS", "TMMS"])
def test_products_and_a_splitting_suffice(method):
    A, _, q, z, _ = scenes.disc_lcp(15)
    matrix, n = A.tocsr(), q.size
    lu = splu((matrix + 4.0 * sp.eye_array(n)).tocsc())
    products = LinearOperator((n, n), matvec=lambda x: matrix @ x)
    splitting = [lu.solve, lu.solve] if method == "TMMS" else lu.solve
    result = hlcp.solve(products, None, q, method, splitting=splitting, omega=4.0)
    assert result.success, result.message
    assert np.abs(result.z - z).max() <= 1e-8
    assert residual(matrix, None, q, result) <= 1e-10 * np.linalg.norm(q)
    # The same with the rows at hand.
    assert hlcp.solve(matrix, None, q, method, splitting=splitting, omega=4.0).success


def test_products_alone_need_a_splitting_and_omega():
    products = LinearOperator((3, 3), matvec=lambda x: 2 * x, dtype=np.float64)
    with pytest.raises(ValueError, match="A is known by its products alone"):
        hlcp.solve(products, None, -np.ones(3))
    with pytest.raises(ValueError, match="give omega, for the diagonal"):
        hlcp.solve(products, None, -np.ones(3), splitting=lambda v: v / 4)
    with pytest.raises(ValueError, match="its rows"):
        hlcp.certify(products, None, -np.ones(3), np.ones(3), np.ones(3))


@pytest.mark.parametrize("name, value", [
    ("alpha", 1.2), ("beta", 0.5), ("alpha2", 1.0), ("beta2", 1.0), ("base", "AMGS"), ("window", 5)])
def test_a_splitting_takes_no_parameters(name, value):
    A, q = 4.0 * np.eye(3), -np.ones(3)
    options = {"splitting": lambda v: v / 8, "omega": 4.0}
    assert hlcp.solve(A, None, q, "MMS", **options).success
    with pytest.raises(ValueError, match=f"{name} is {value!r}, but MMS .* takes no {name}"):
        hlcp.solve(A, None, q, "MMS", **options, **{name: value})
    assert hlcp.solve(A, None, q, "ANDERSON", **options, window=5).success


@pytest.mark.parametrize("start", ["x0", "z0", "r0", "both"])
def test_a_start_at_the_answer_is_the_answer(start):
    A, B, q, z, r = scenes.example1(8)
    if start == "z0":
        r = np.zeros_like(r)
        q = -(A @ z.ravel())
    if start == "r0":
        z = np.zeros_like(z)
        q = B @ r.ravel()
    given = {"x0": (z - r) / 2} if start == "x0" else {"z0": z, "r0": r}
    if start in ("z0", "r0"):
        given = {start: given[start]}
    result = hlcp.solve(A, B, q, "MGS", omega=1.0, **given)
    assert (result.nit, result.status) == (0, Status.CONVERGED)


def test_the_callback_sees_every_iterate_and_may_stop():
    A, B, q, *_ = scenes.example1(16)
    seen = []
    result = hlcp.solve(A, B, q, "MGS", callback=seen.append)
    assert [progress.nit for progress in seen] == list(range(result.nit + 1))
    assert np.array_equal(seen[-1].x, result.x) and seen[0].x.shape == q.shape
    assert seen[0].residual == pytest.approx(np.linalg.norm(q))

    result = hlcp.solve(A, B, q, "MGS", callback=lambda progress: progress.nit == 3)
    assert (result.nit, result.status, result.success) == (3, Status.STOPPED, False)

    def stop(progress):
        raise StopIteration

    assert hlcp.solve(A, B, q, "MGS", callback=stop).status is Status.STOPPED


def test_what_a_callback_does_to_its_iterate_changes_nothing():
    A, B, q, *_ = scenes.example1(16)

    def spoil(progress):
        progress.x[:] = np.nan

    assert np.array_equal(hlcp.solve(A, B, q, "MGS", callback=spoil).z,
                          hlcp.solve(A, B, q, "MGS").z)


def test_threads_change_no_bit():
    A, B, q, *_ = scenes.example1(130)
    for name in ("TMGS", "MGF"):
        one, three = (hlcp.solve(A, B, q, name, threads=threads) for threads in (1, 3))
        assert np.array_equal(one.x, three.x) and one.nit == three.nit


def test_single_precision_comes_from_q():
    A, B, q, z, _ = scenes.example1(16)
    result = hlcp.solve(A, B, q.astype(np.float32), "MGS")
    assert result.success and result.z.dtype == result.x.dtype == np.float32
    assert np.abs(result.z - z).max() <= 1e-5
    for other in (q.astype(np.float16), np.rint(q).astype(int), q.astype(np.longdouble)):
        assert hlcp.solve(A, B, other, "MGS").z.dtype == np.float64
    assert hlcp.solve(A.tocsr(), B.tocsr(), q.astype(np.float32)).z.dtype == np.float32


def test_tolerances_and_norms_are_those_asked_for():
    A, B, q, *_ = scenes.example1(16)
    coarse = hlcp.solve(A, B, q, "MGS", rtol=1e-3)
    assert 1e-6 < coarse.relative <= 1e-3
    assert coarse.residual == pytest.approx(residual(A, B, q, coarse), rel=1e-6)
    fine = hlcp.solve(A, B, q, "MGS", atol=1e-11, norm=np.inf)
    assert fine.residual <= 1e-11 and fine.nit > coarse.nit
    assert hlcp.solve(A, B, q, "MGS", maxiter=2).status is Status.ITERATION_LIMIT
    assert hlcp.solve(A, B, q, "MGS", maxtime=0.0).status is Status.TIME_LIMIT
    assert hlcp.solve(A, B, q, "MGS", maxtime=np.inf).success


def test_not_converging_raises_nothing():
    # z - r = 3 with alpha = 3: the error of x doubles in every sweep.
    result = hlcp.solve(np.eye(1), None, [-3.0], "MSOR", alpha=3.0, x0=[1.0])
    assert (result.status, result.success) == (Status.DIVERGED, False)
    assert result.message.startswith("diverged")
    result = hlcp.solve(np.eye(1), None, [-3.0], "MSOR", alpha=2.0, x0=[1.0])
    assert result.status is Status.CYCLING and "period 2" in result.message


@pytest.mark.parametrize("equations", [0, 3])
def test_a_quadratic_program_has_zeros_on_its_diagonals(equations):
    rng = np.random.default_rng()
    n, m = 300, 60
    G = sp.random_array((m, n), density=0.05, rng=rng, data_sampler=rng.standard_normal)
    A = sp.block_array([[sp.eye_array(n), -G.T], [G, None]], format="csr")
    B = sp.eye_array(n + m, format="lil")
    B[:, n:n + equations] = A[:, [*range(n, n + equations)]]
    x, side = rng.uniform(0.1, 1, n + m), rng.random(n + m) < 0.5
    q = B @ np.where(side, 0, x) - A @ np.where(side, x, 0)
    result = hlcp.solve(A, B, q)
    assert result, result.message
    # The minimiser is unique, though the multipliers may not be.
    assert np.allclose(result.z[:n], np.where(side, x, 0)[:n], atol=1e-6)


def test_tau_and_omega_are_the_same_diagonal():
    A, B, q, *_ = scenes.bearing2d(15, 7)
    omega = 0.8 * A.tocsr().diagonal() / B.tocsr().diagonal()
    by_tau = hlcp.solve(A, B, q, "MGS", tau=0.8)
    assert np.allclose(by_tau.z, hlcp.solve(A, B, q, "MGS", omega=omega).z, atol=1e-12)
    assert hlcp.solve(A, B, q, "MGS").nit != by_tau.nit


def test_a_solver_resumes():
    A, B, q, *_ = scenes.example1(24)
    solver = hlcp.Solver(A, B, "AMGS", rtol=1e-8)
    first = solver.resume(q)
    assert np.array_equal(first.z, hlcp.solve(A, B, q, "AMGS", rtol=1e-8).z)
    again = solver.resume(q + 1e-6)
    assert again.success and again.nit < first.nit and solver.last is again
    assert solver.resume(q + 1e-6, rtol=1e-12).relative <= 1e-12
    assert solver.solve(q).nit == first.nit
    assert np.array_equal(first.z, solver.last.z) and first.z is not solver.last.z
    with pytest.raises(ValueError, match="z0 is given, but resume starts from the last answer"):
        solver.resume(q, z0=first.z)
    # A start among the options holds for the first solve alone.
    started = hlcp.Solver(A, B, "AMGS", rtol=1e-8, z0=first.z, r0=first.r)
    assert started.resume(q).nit == started.resume(q).nit == 0
    with pytest.raises(TypeError):
        hlcp.Solver(A, B, "AMGS", rtoll=1e-8)
    with pytest.raises(ValueError):
        solver.solve(q[0])
    assert solver.last.nit == first.nit


def test_a_certificate_bounds_the_error():
    A, B, q, z, r = scenes.example1(12)
    result = hlcp.solve(A, B, q, rtol=1e-6)
    bound = hlcp.certify(A, B, q, result.z, result.r)
    assert np.all(np.abs(result.z - z) <= bound.z) and np.all(np.abs(result.r - r) <= bound.r)
    assert 0 < bound.error < 1e-3 and "proved" in str(bound) and bound.z.shape == q.shape
    assert bound and bound.unique and np.all(z[bound.sides > 0] > 0) and np.any(bound.sides < 0)
    assert np.all(r[bound.sides < 0] > 0)
    assert hlcp.certify(A.tocsr(), B.tocsr(), q, result.z, result.r).error < 1e-3
    nothing = hlcp.certify(-np.eye(2), None, np.ones(2), np.ones(2), np.zeros(2))
    assert not nothing and nothing.error == np.inf and "diagonal" in str(nothing)


def test_a_certificate_has_its_time():
    A = hlcp.FivePoint((1, 99), west=-1, centre=2, east=-1)
    i = np.arange(1, 100)
    given = A, None, np.full(99, -2.0), i * (100 - i) + 1e-6, np.zeros(99)
    late = hlcp.certify(*given, maxtime=0)
    assert not late and str(late) == "not proved: the time limit was reached"
    assert hlcp.certify(*given, maxtime=np.inf).error < 1.1e-6
    for wrong in (-1, "soon"):
        with pytest.raises(ValueError, match=f"maxtime is {wrong!r}, but it must be"):
            hlcp.certify(*given, maxtime=wrong)


def test_a_certificate_is_of_the_numbers_as_they_are_given():
    # -3.3 of single precision is 4.8e-8 from that of double precision.
    q = np.array([-3.3], np.float32)
    bound = hlcp.certify(np.array([[3.3]]), None, q, [1.0], [0.0])
    assert bound and bound.error >= abs(-float(q[0]) / 3.3 - 1) > 1e-8
    off = hlcp.certify(np.array([[1.0]]), None, np.array([-1], np.float32), [1 + 1e-8], [0.0])
    assert off.error >= 1e-8
    pair = np.array([[1, -0.99999999], [-0.99999999 - 3e-8, 1]])  # its determinant is negative
    assert not hlcp.certify(pair, None, np.ones(2, np.float32), [0, 0], [1, 1]).unique
    one, whole = np.eye(1), 2**53 + 1
    assert hlcp.certify(one, None, [-(whole - 1)], [whole - 1], [0])
    for sentence, A, q in [
        (rf"q\[0\] is -{whole}", one, np.array([-whole])),
        (rf"q\[0\] is {2**64 - 1}", one, np.array([2**64 - 1], np.uint64)),
        (rf"A\[0, 0\] is {whole}", np.array([[whole]]), [-1.0]),
        (rf"A.data\[0\] is {whole}", sp.csr_array(np.array([[whole]])), [-1.0]),
        (r"q\[0\] is -0.1", one, np.array([-1], np.longdouble) / 10),
        ("A has entries given twice", sp.coo_array(([0.1, 0.2], ([0, 0], [0, 0]))), [-1.0]),
    ]:
        if np.asarray(q).dtype == np.longdouble and np.finfo(np.longdouble).nmant == 52:
            continue  # the same type as double
        with pytest.raises(ValueError, match=sentence):
            hlcp.certify(A, None, q, [1.0], [0.0])
    # One is exact in any type, and the proof the same.
    wide = hlcp.certify(one, None, [-1.0], [1.0], [0.0])
    for kind in (np.float32, np.longdouble, np.int64, np.uint8):
        proof = hlcp.certify(np.ones((1, 1), kind), None, -np.ones(1), np.ones(1, kind), [0])
        assert proof.unique and proof.error == wide.error



SCENES = {
    "example1": (8,), "example2": (8,), "disc_lcp": (15,), "disc_hlcp": (15,), "slider": (40,),
    "journal_bearing": (12, 10), "obstacle": (12,), "bearing2d": (15, 7),
    "spiral": (15,), "bessel": (15,), "dam": (15, 16),
}


@pytest.mark.parametrize("name", SCENES)
def test_scenes_have_the_answers_they_come_with(name):
    A, B, q, z, r = getattr(scenes, name)(*SCENES[name])
    result = hlcp.solve(A, B, q, rtol=1e-11)
    assert result.success and result.z.shape == q.shape == A.grid
    assert residual(A, B, q, result) <= 1e-10 * np.linalg.norm(q)
    if z is not None:
        assert np.abs(result.z - z).max() <= 1e-7 and np.abs(result.r - r).max() <= 1e-6


def test_a_dam_seeps_as_dupuit_says():
    A, B, q, *_ = scenes.dam(31, 32, length=2.0, tail=0.25)
    z = hlcp.solve(A, B, q, rtol=1e-11).z
    # Through the first faces, from the upstream depth 1 - y in the middle of each row.
    y = 1 - (np.arange(32) + 0.5) / 32
    wet = (1 - y - z[:, 0]).sum() * (1 / 32) / (2.0 / 32)
    assert abs(wet - (1 - 0.25**2) / 4) < 1e-8


def test_every_scene_is_tested():
    assert {*SCENES, "AmericanPut", "Scene"} == {*scenes.__all__}


def test_a_put_has_the_published_price():
    put = scenes.AmericanPut(rate=0.06, volatility=0.2, maturity=1.0, m=64, steps=64)
    solver, z = hlcp.Solver(put.A), np.zeros(put.A.shape[0])
    assert put.exercise(z) == 1.0
    for k in range(put.lcps):
        z = solver.resume(put.q(k, z)).z
    # QuantLib's example: spot 36, strike 40.
    assert abs(40 * put.price(z, 0.9) - 4.48667344) < 1e-3
    assert 0.75 < put.exercise(z) < 1.0
    with pytest.raises(ValueError, match="z has 3 entries, but it must have"):
        put.q(0, np.zeros(3))
    with pytest.raises(ValueError, match="spot is -1, but it must be positive"):
        put.price(z, -1)
    with pytest.raises(ValueError, match="volatility"):
        scenes.AmericanPut(0.06, -0.2, 1.0, 32, 32)


@pytest.mark.parametrize("periodic", [(False, True), (True, False), (True, True)])
def test_a_grid_may_close(periodic):
    rng = np.random.default_rng(4)
    sides = {name: -rng.random((5, 7)) for name in ("south", "west", "east", "north")}
    A = FivePoint((5, 7), centre=4.5, periodic=periodic, **sides)
    matrix, x = A.tocsr(), rng.standard_normal(35)
    assert matrix.nnz == 35 + 2 * (28 + 7 * periodic[0]) + 2 * (30 + 5 * periodic[1])
    assert np.allclose(A @ x, matrix @ x, rtol=1e-14)
    # By hand: the western neighbour of the first column is the last one.
    last = matrix.toarray()[14, 20]
    assert last == (sides["west"][2, 0] if periodic[1] else 0)
    q = rng.standard_normal(35)
    stencil, assembled = hlcp.solve(A, None, q, "MGS"), hlcp.solve(matrix, None, q, "MGS")
    assert stencil.nit == assembled.nit and np.allclose(stencil.z, assembled.z, atol=1e-9)
    assert hlcp.certify(A, None, q, stencil.z, stencil.r).error < 1e-8
    with pytest.raises(ValueError, match="2 points along x, but it needs three to close"):
        FivePoint((5, 2), centre=4, periodic=(False, True))
    with pytest.raises(ValueError, match="periodic is True, but it must be two truths"):
        FivePoint((5, 5), centre=4, periodic=True)


def test_functionals_are_bounded():
    A, B, q, z, r = scenes.example1(8)
    rng = np.random.default_rng(1)
    of_z, of_r = rng.standard_normal((2, 64))
    result = hlcp.solve(A, B, q)
    pairs = [(of_z, of_r), (1, np.zeros(64))]
    proved = hlcp.certify(A, B, q, result.z, result.r, functionals=pairs).functionals
    for (lower, upper), exact in zip(proved, (of_z @ z.ravel() + of_r @ r.ravel(), z.sum())):
        assert lower - 1e-12 <= exact <= upper + 1e-12 and upper - lower < 1e-7
    refused = hlcp.certify(-A.tocsr(), B, q, z, r, functionals=pairs)
    assert not refused and refused.functionals == [(-np.inf, np.inf)] * 2
    with pytest.raises(ValueError, match=r"functionals\[0\] has 3 coefficients, but it must have 64"):
        hlcp.certify(A, B, q, z, r, functionals=[(np.ones(3), 0)])
    with pytest.raises(ValueError, match=r"functionals\[0\] is 1, but it must be coefficients"):
        hlcp.certify(A, B, q, z, r, functionals=[1])


def test_scenes_agree_with_published_figures():
    # The slider's peak and rupture by quadrature, as hlcp-verify's Slider has them.
    A, B, q, *_ = scenes.slider(1000)
    z = hlcp.solve(A, B, q).z.ravel()
    assert z.max() == pytest.approx(0.0284374736235, rel=1e-2)
    assert np.flatnonzero(z)[-1] / 1000 == pytest.approx(0.678934433068565, abs=2e-3)
