"""Arrays: none is copied that need not be, none changed, and no trap is fallen into."""

import subprocess
import sys
import textwrap

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.linalg import LinearOperator

import hlcp
from hlcp import FivePoint, scenes
from hlcp._operators import described, vector


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_arrays_of_the_right_type_are_shared(dtype):
    centre = np.full((5, 4), 4.0, dtype)
    A = FivePoint((5, 4), south=-1, centre=centre)
    assert np.shares_memory(A.centre, centre)
    assert np.shares_memory(described("A", A, dtype, 0)[1][2], centre)
    for index in (np.int32, np.int64):
        matrix = sp.eye_array(6, format="csr", dtype=dtype)
        matrix.indices, matrix.indptr = matrix.indices.astype(index), matrix.indptr.astype(index)
        _, pointers, indices, entries = described("A", matrix, dtype, 0)
        assert np.shares_memory(pointers, matrix.indptr)
        assert np.shares_memory(indices, matrix.indices)
        assert np.shares_memory(entries, matrix.data)
    q = np.ones((5, 4), dtype)
    assert np.shares_memory(vector("q", q, dtype), q)


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
@pytest.mark.parametrize("kind", ["stencil", "matrix"])
def test_a_solve_takes_ten_vectors_and_no_copy_of_the_operators(kind):
    # Three vectors of the solver's, 2n of scratch, three of the answer; a copy would be another
    # ten (two stencils of five arrays) or fifteen (two matrices of 7.5 n).
    program = """
        import sys, numpy as np, hlcp, scipy.sparse as sp
        m = 1000
        n = m * m
        arrays = [np.full((m, m), c) for c in (-1.0, -1.0, 5.0, -1.0, -1.0)]
        names = "south", "west", "centre", "east", "north"
        A = hlcp.FivePoint((m, m), **dict(zip(names, arrays)))
        B = hlcp.FivePoint((m, m), **dict(zip(names, [a.copy() for a in arrays])))
        if sys.argv[1] == "matrix":
            A, B = A.tocsr(), B.tocsr()
        q = np.full(n, -1.0)

        def peak(field):
            with open("/proc/self/status") as status:
                return next(int(line.split()[1]) for line in status if line.startswith(field))

        hlcp.solve(np.eye(2), None, -np.ones(2))
        try:
            with open("/proc/self/clear_refs", "w") as refs:
                refs.write("5")
        except OSError:
            sys.exit(77)
        before = peak("VmRSS")
        hlcp.solve(A, B, q, "MGS", maxiter=2)
        print((peak("VmHWM") - before) * 1024 / (8 * n))
    """
    run = subprocess.run([sys.executable, "-c", textwrap.dedent(program), kind],
                         capture_output=True, text=True)
    if run.returncode == 77:
        pytest.skip("the peak cannot be reset here")
    assert run.returncode == 0, run.stderr
    assert float(run.stdout) <= 10


def test_traps_of_strides_and_types_are_seen_through():
    rng = np.random.default_rng(3)
    A, B, q, *_ = scenes.example1(6)
    centre, q = rng.uniform(8, 9, (6, 6)), q + rng.standard_normal((6, 6))

    def posed(array):
        return FivePoint((6, 6), south=-1, west=-1, centre=array, east=-1, north=-1)

    expected = hlcp.solve(posed(centre), B, q, "MGS")
    padded = np.zeros((12, 18))
    padded[::2, ::3] = centre
    unaligned = np.frombuffer(b"x" + centre.tobytes(), dtype=np.uint8)[1:].view(np.float64)
    assert not unaligned.flags.aligned
    twisted = [
        np.asfortranarray(centre), padded[::2, ::3], centre[::-1, ::-1].copy()[::-1, ::-1],
        centre.astype(">f8"), unaligned.reshape(6, 6), np.ma.masked_array(centre),
        np.array(centre, np.longdouble), centre.tolist(),
    ]
    for array in twisted:
        assert np.array_equal(hlcp.solve(posed(array), B, q, "MGS").z, expected.z)
    padded[::2, ::3] = q
    for vector in (np.asfortranarray(q), padded[::2, ::3], q.astype(">f8"), q.tolist()):
        assert np.array_equal(hlcp.solve(posed(centre), B, vector, "MGS").z, expected.z)
    flat = hlcp.solve(posed(centre), B, q.ravel(), "MGS")
    assert flat.z.shape == (36,) and np.array_equal(flat.z, expected.z.ravel())
    column = hlcp.solve(posed(centre), B, q.reshape(-1, 1), "MGS")
    assert column.r.shape == (36, 1)


def test_whole_numbers_are_numbers():
    A = np.array([[4, -1], [-1, 4]], dtype=np.int8)
    for q in ([-3, 5], np.array([-3, 5], dtype=np.int16), [True, False]):
        assert hlcp.solve(A, None, q).success
    huge = hlcp.solve(A.astype(np.int64), None, [-(2**62), 2**62], "MGS")
    assert huge.success and huge.z[0] == pytest.approx(2**60, rel=1e-9)


def test_a_matrix_out_of_order_is_sorted_in_a_copy():
    A = sp.csr_array(([-1.0, 4.0, 2.0, 2.0, -1.0], [1, 0, 1, 1, 0], [0, 2, 5]), shape=(2, 2))
    before = A.indices.copy()
    result = hlcp.solve(A, None, [-3.0, -3.0])
    assert result.success and np.allclose(result.z, 1.0)
    assert np.array_equal(A.indices, before) and A.nnz == 5


def test_arguments_are_never_changed_even_read_only_ones():
    A, B, q, z, r = scenes.bearing2d(15, 7)
    A, B = A.tocsr(), B.tocsr()
    arrays = [q, A.data, A.indices, A.indptr, B.data, B.indices, B.indptr]
    copies = [array.copy() for array in arrays]
    for array in arrays:
        array.flags.writeable = False
    result = hlcp.solve(A, B, q)
    assert result.success and result.z.flags.writeable
    assert hlcp.certify(A, B, q, result.z, result.r) is not None
    hlcp.solve(A, B, q, x0=result.x)
    assert all(np.array_equal(array, copy) for array, copy in zip(arrays, copies))


EYE = sp.eye_array(3, format="csr")


SPOILT = np.eye(3)
SPOILT[2, 1] = np.inf


def indexed(dtype):
    """A unit matrix whose index arrays have this type."""
    matrix = sp.eye_array(3, format="csr")
    matrix.indices, matrix.indptr = matrix.indices.astype(dtype), matrix.indptr.astype(dtype)
    return matrix


class Shaped(LinearOperator):
    """An operator of a shape that none has."""

    def __init__(self, shape):
        super().__init__(np.float64, (3, 3))
        self.shape = shape

    def _matvec(self, x):
        return x


def broken(**parts):
    matrix = sp.eye_array(3, format="csr")
    for name, value in parts.items():
        setattr(matrix, name, np.asarray(value, dtype=getattr(matrix, name).dtype))
    matrix.has_canonical_format = True
    return matrix


@pytest.mark.parametrize("sentence, arguments", [
    (r"q\[1\] is NaN", (EYE, None, [1.0, np.nan, 2.0])),
    (r"q\[2\] is -inf", (EYE, None, [1.0, 0.0, -np.inf])),
    ("q has order 2, but the problem has order 3", (EYE, None, [1.0, 2.0])),
    ("q has order 0", (EYE, None, [])),
    ("q is a single number", (EYE, None, 1.0)),
    ("q has the type object", (EYE, None, None)),
    ("q has the type object", (EYE, None, [10**400, 1, 1])),
    ("q has the type complex128", (EYE, None, [1j, 1, 1])),
    ("q has the type <U", (EYE, None, ["a", "b", "c"])),
    ("q has the type datetime64", (EYE, None, np.zeros(3, "M8[s]"))),
    ("q is a masked array with 1 entries masked", (EYE, None, np.ma.masked_less([1., -2., 3.], 0))),
    ("inhomogeneous", (EYE, None, [[1.0, 2.0], [3.0]])),
    ("A is None", (None, EYE, [1.0])),
    ("A has 2 rows and 3 columns, but it must be square", (np.ones((2, 3)), None, [1.0, 2.0])),
    ("B has 3 rows and 2 columns", (EYE, np.ones((3, 2)), np.ones(3))),
    ("B has order 2, but the problem has order 3", (EYE, np.eye(2), np.ones(3))),
    ("A has 1 dimensions", (np.ones(3), None, np.ones(3))),
    ("A has 0 dimensions", (3.0, None, np.ones(3))),
    ("A has the type object", (object(), None, np.ones(3))),
    ("A has the type complex128", (1j * np.eye(3), None, np.ones(3))),
    ("A: the matrix has order 0", (np.empty((0, 0)), None, [])),
    ("A: the matrix has order 0", (sp.csr_array((0, 0)), None, [])),
    (r"diagonal of B\[1\] is -1.*; the problem is A z − B r", (EYE, np.diag([1.0, -1.0, 1.0]), np.ones(3))),
    (r"B\[0, 0\] is nan, which is not", (EYE, np.diag([np.nan, 1.0, 1.0]), np.ones(3))),
    (r"A\[2, 1\] is inf, which is not", (SPOILT, None, np.ones(3))),
    (r"A\[2, 1\] is inf, which is not", (sp.csc_array(SPOILT), None, np.ones(3))),
    (r"A: columns\[1\] is 7", (broken(indices=[0, 7, 2]), None, np.ones(3))),
    (r"A: columns\[1\] is -1", (broken(indices=[0, -1, 2]), None, np.ones(3))),
    (r"A: offsets\[2\] is 1", (broken(indptr=[0, 2, 1, 3]), None, np.ones(3))),
    (r"A: offsets\[3\] is 9", (broken(indptr=[0, 1, 2, 9]), None, np.ones(3))),
    (r"A: offsets\[0\] is 1", (broken(indptr=[1, 1, 2, 3]), None, np.ones(3))),
    (r"A: offsets\[0\] is -1", (broken(indptr=[-1, 1, 2, 3]), None, np.ones(3))),
    (r"A: .* 3 columns need as many values, but 1 are given", (broken(data=[1.0]), None, np.ones(3))),
    ("A has 0 rows and 3 columns", (broken(indptr=[]), None, np.ones(3))),
    ("A.indices is an array of 2 dimensions", (broken(indices=[[0, 1, 2]]), None, np.ones(3))),
    ("A.indptr is an array of .* type uint64", (indexed(np.uint64), None, np.ones(3))),
    ("B.indptr is an array of .* type float64", (EYE, indexed(np.float64), np.ones(3))),
    (r"A has the shape \(-3, -3\)", (Shaped((-3, -3)), None, np.ones(3))),
])
def test_wrong_input_is_a_value_error_that_says_where(sentence, arguments):
    with pytest.raises(ValueError, match=sentence):
        hlcp.solve(*arguments)


@pytest.mark.parametrize("indptr", [[-(2**31), 1, 2, 3], [0, 2**31 - 1, 2, 3], [0, 1, 2, 2**31 - 1]])
def test_an_index_that_leads_astray_is_not_followed(indptr):
    matrix = broken(indptr=indptr)
    del matrix._has_canonical_format, matrix._has_sorted_indices
    with pytest.raises(ValueError, match="offsets"):
        hlcp.solve(matrix, None, np.ones(3))


@pytest.mark.parametrize("sentence, options", [
    ("there is no method 'TMAR'; the closest name is 'TMAOR'", {"method": "TMAR"}),
    ("MSOR needs alpha", {"method": "MSOR"}),
    ("MGS takes no alpha", {"method": "MGS", "alpha": 1.2}),
    ("alpha is -1, but it must be positive", {"method": "MSOR", "alpha": -1}),
    ("five-point", {"method": "FMG"}),
    ("give rtol or atol", {"rtol": 1e-3, "atol": 1e-3}),
    ("relative tolerance is -1", {"rtol": -1}),
    ("relative tolerance is NaN", {"rtol": np.nan}),
    ("norm is 1", {"norm": 1}),
    ("norm is array", {"norm": np.ones(2)}),
    ("alpha is '1.2', but it must be a real number", {"method": "MSOR", "alpha": "1.2"}),
    ("rtol is 1j, but it must be a real number", {"rtol": 1j}),
    ("atol is 10000.*, but it must be a real number", {"atol": 10**400}),
    ("maxiter is 1.5, but it must be a whole number", {"maxiter": 1.5}),
    (r"method is '\\ud800'", {"method": "\ud800"}),
    ("method is 3, but it must be one of", {"method": 3}),
    ("base is 0, but it must be one of", {"method": "NEWTON", "base": 0}),
    ("callback is 3, but it must be a function", {"callback": 3}),
    ("maxiter is -1", {"maxiter": -1}),
    ("maxtime is -1", {"maxtime": -1}),
    ("alpha is True", {"method": "MSOR", "alpha": True}),
    ("rtol is .*1j", {"rtol": np.complex128(1j)}),
    ("maxtime is NaN", {"maxtime": np.nan}),
    ("threads is 0", {"threads": 0}),
    ("threads is 1000000", {"threads": 10**6}),
    ("window is -1", {"method": "ANDERSON", "window": -1}),
    ("give x0, or z0 and r0", {"x0": np.ones(3), "z0": np.ones(3)}),
    ("x0 has order 2", {"x0": [1.0, 2.0]}),
    ("z0 has order 2", {"z0": [1.0, 2.0]}),
    (r"r0\[0\] is NaN", {"r0": [np.nan, 0, 0]}),
    ("give tau or omega", {"tau": 1, "omega": 1}),
    ("tau is 0", {"tau": 0}),
    ("omega is -1", {"omega": -1}),
    ("omega has order 2", {"omega": [1.0, 2.0]}),
    (r"omega\[1\] is NaN", {"omega": [1.0, np.nan, 1.0]}),
    (r"splitting is \[\], but it must be a function", {"splitting": []}),
    ("with a splitting of your own it must be", {"splitting": lambda v: v, "method": "MGS"}),
    ("it must be a function, or two", {"splitting": [lambda v: v] * 3}),
    (r"splitting\(v\) has 2 entries, but it must have 3", {"splitting": lambda v: v[:2]}),
    (r"splitting\(v\) has the type object", {"splitting": lambda v: None}),
])
def test_a_wrong_option_is_a_value_error_that_names_it(sentence, options):
    with pytest.raises(ValueError, match=sentence):
        hlcp.solve(EYE, None, [-1.0, -2.0, 3.0], **options)


@pytest.mark.parametrize("maxtime", [1e8, 1e19, 1e308, np.inf, np.float32(1e30), np.array(5)])
def test_a_long_time_is_a_time(maxtime):
    q = [-1.0, -2.0, 3.0]
    assert hlcp.solve(EYE, None, q, maxtime=maxtime).success
    assert hlcp.certify(EYE, None, q, [1.0, 2.0, 0.0], [0.0, 0.0, 3.0], maxtime=maxtime)


@pytest.mark.parametrize("sentence, grid, coefficients", [
    (r"grid is 9, but it must be \(ny, nx\)", 9, {"centre": 4}),
    (r"grid is \(3, 0\), but it must have one point", (3, 0), {"centre": 4}),
    (r"grid is \(3, -1\), but it must have one point", (3, -1), {"centre": 4}),
    ("at most as many as an array can hold", (10**10, 10**10), {"centre": 4}),
    (r"west has the shape \(2,\), but the grid has \(3, 3\)", (3, 3), {"centre": 4, "west": [1, 2]}),
    ("centre has the type complex128", (3, 3), {"centre": 1j}),
    (r"centre\[0\] is NaN", (3, 3), {"centre": np.nan}),
    (r"east\[4\] is inf", (3, 3), {"centre": 4, "east": np.diag([0, np.inf, 0])}),
])
def test_a_wrong_stencil_is_a_value_error(sentence, grid, coefficients):
    with pytest.raises(ValueError, match=sentence), np.errstate(invalid="ignore"):
        hlcp.solve(FivePoint(grid, **coefficients), None, np.ones(9))


def test_q_has_the_shape_of_the_grid():
    A = FivePoint((4, 5), south=-1, west=-1, centre=5, east=-1, north=-1)
    q = np.sin(np.arange(20.0))
    plain = hlcp.solve(A, None, q).z
    for shape in [(4, 5), (20, 1), (1, 20)]:
        z = hlcp.solve(A, None, q.reshape(shape)).z
        assert z.shape == shape and (z.ravel() == plain).all()
    for shape in [(5, 4), (2, 10), (2, 2, 5)]:
        for pair in [(A, None), (np.eye(20), A)]:
            with pytest.raises(ValueError, match=r"q has the shape .* the grid has \(4, 5\)"):
                hlcp.solve(*pair, q.reshape(shape))
    assert hlcp.solve(A.tocsr(), None, q.reshape(5, 4)).z.shape == (5, 4)
    other, grid = np.ones((5, 4)), q.reshape(4, 5)
    for name in ("x0", "z0", "r0", "omega"):
        for pair in [(A, None), (A.tocsr(), None)]:
            with pytest.raises(ValueError, match=rf"{name} has the shape \(5, 4\), but .* \(4, 5\)"):
                hlcp.solve(*pair, grid, **{name: other})
    for arrays in [(grid.T, other.T, other.T), (grid, other, other.T), (grid, other.T, other)]:
        with pytest.raises(ValueError, match=r"has the shape \(5, 4\), but the grid has \(4, 5\)"):
            hlcp.certify(A, None, *arrays)


def test_what_does_not_fit_the_memory_is_a_memory_error():
    for call in (lambda: scenes.disc_lcp(10**7), lambda: scenes.slider(10**18),
                 lambda: scenes.bearing2d(10**30, 10**30)):
        with pytest.raises((MemoryError, ValueError)):
            call()
