"""Eigenvalues of stiffness and mass matrices: rigid modes, penalties, sparse matrices, symmetry."""

from __future__ import annotations

import math
import warnings
from typing import Any

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse as sp
from numpy.typing import NDArray

import snapbeam as sb
from snapbeam.model import buckling_modes
from snapbeam.model.matrix_pairs import coupled_blocks, eigenpairs
from snapbeam.util import diagnostics
from snapbeam.util.validation import InputError

FIRST = 66.670179
"""First natural frequency of the strip, Hz: (4.7300408)^2 sqrt(E I/(rho A L^4))/(2 pi)."""


@pytest.fixture(autouse=True)
def _untold(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(diagnostics, "_told", set())


def strip(elements: int, clamped: bool = True) -> tuple[sp.csr_array, sp.csr_array]:
    """Mass and stiffness of the steel strip of Hermite elements in docs/finite_elements.md."""
    le, area, bending = 0.2 / elements, 5e-6, 210e9 * 0.01 * 0.5e-3**3 / 12
    mass = 7800.0 * area * le / 420 * np.array(
        [[156, 22 * le, 54, -13 * le], [22 * le, 4 * le**2, 13 * le, -3 * le**2],
         [54, 13 * le, 156, -22 * le], [-13 * le, -3 * le**2, -22 * le, 4 * le**2]]
    )  # fmt: skip
    stiffness = bending / le**3 * np.array(
        [[12, 6 * le, -12, 6 * le], [6 * le, 4 * le**2, -6 * le, 2 * le**2],
         [-12, -6 * le, 12, -6 * le], [6 * le, 2 * le**2, -6 * le, 4 * le**2]]
    )  # fmt: skip
    rows, columns = np.indices((4, 4)).reshape(2, 1, 16) + 2 * np.arange(elements)[:, None]
    n = 2 * elements + 2
    free = np.arange(2, n - 2) if clamped else np.arange(n)
    pair = []
    for each in (mass, stiffness):
        data = np.broadcast_to(each.ravel(), rows.shape).ravel()
        whole = sp.csr_array(sp.coo_array((data, (rows.ravel(), columns.ravel())), shape=(n, n)))
        pair.append(whole[free][:, free])
    return pair[0], pair[1]


def model_of(mass: Any, stiffness: Any, **more: Any) -> sb.ReducedModel:
    contact = np.zeros(mass.shape[0])
    contact[2 * (contact.size // 4)] = 1.0
    return sb.ReducedModel.from_matrices(mass, stiffness, **{"contact_shape": contact, **more})


# ---------------------------------------------------------------------- rigid modes


@pytest.mark.parametrize(
    "elements",
    [
        24,
        pytest.param(300, marks=pytest.mark.slow),
        pytest.param(600, marks=pytest.mark.slow),
        pytest.param(700, marks=pytest.mark.slow),
    ],
)
def test_fine_mesh_is_not_rigid(elements: int) -> None:
    """Above 600 elements the first frequency was 0, because its square is 1e-12 of the largest."""
    mass, stiffness = strip(elements)
    model = model_of(mass.toarray(), stiffness.toarray())
    assert model.natural_frequencies[0] == pytest.approx(FIRST, rel=3e-6)


@pytest.mark.parametrize(
    "elements", [5, pytest.param(300, marks=pytest.mark.slow), pytest.param(600, marks=pytest.mark.slow)]
)
def test_free_strip_has_two_rigid_modes(elements: int) -> None:
    """A free strip has two, and then the frequencies of the clamped one."""
    mass, stiffness = strip(elements, clamped=False)
    found = model_of(mass.toarray(), stiffness.toarray()).natural_frequencies
    assert found[:2].tolist() == [0.0, 0.0]
    assert found[2] == pytest.approx(FIRST, rel=2e-3 if elements == 5 else 3e-6)


@pytest.mark.slow
def test_what_rounding_hides_is_refused() -> None:
    """Of 60,000 elements, rounding of the entries exceeds the first eigenvalue."""
    mass, stiffness = strip(60_000)
    with pytest.raises(InputError, match=r"stiffness: whether its eigenvalue .* is 0 cannot be decided"):
        model_of(mass, stiffness, modes=3)
    # rounding of a rigid mode's stiffness in a product of matrices
    rounded = np.array([[3e-9, 1e-9], [1e-9, 1e8]])
    with pytest.raises(InputError, match="set entries that are only rounding to 0"):
        model_of(np.eye(2), rounded)
    assert model_of(np.eye(2), np.diag([0.0, 1e8])).omega.tolist() == [0.0, 1e4]


def test_soft_parts_beside_stiff_ones_keep_their_frequency() -> None:
    """Parts that nothing connects have a scale of their own."""
    assert model_of(np.eye(2), [1e-10, 1e-4]).omega == pytest.approx([1e-5, 1e-2], rel=1e-15)
    omega = model_of(np.diag([1.0, 1e-12, 1.0]), [1e-8, 1.0, 0.0]).omega
    assert omega == pytest.approx([0.0, 1e-4, 1e6], rel=1e-15)
    assert omega[0] == 0.0


@pytest.mark.slow
def test_modes_are_normalised_after_inverse_iteration() -> None:
    mass, stiffness = (each.toarray() for each in strip(300))
    value, vectors = eigenpairs(stiffness, mass)
    np.testing.assert_allclose(vectors.T @ mass @ vectors, np.eye(value.size), atol=1e-9)
    residual = stiffness @ vectors[:, :5] - value[:5] * (mass @ vectors[:, :5])
    scale = np.abs(stiffness) @ np.abs(vectors[:, :5])
    assert np.abs(residual / scale).max() < 1e-11


def test_imperfect_beam_with_many_modes_keeps_its_first_frequency() -> None:
    """Of 256 modes the square of the first is 1e-9 of the largest; near the snap it is not rounded to 0."""
    beam = sb.Beam(length=0.2, width=0.01, thickness=0.5e-3, young_modulus=210e9, density=7800.0, buckling_level=1e-3)
    uneven = sb.Imperfection(midspan_amplitude=1e-5)
    few, many = (sb.ReducedModel.from_beam(beam, modes, imperfection=uneven) for modes in (32, 256))
    assert many.natural_frequencies[0] == pytest.approx(few.natural_frequencies[0], rel=1e-4)
    assert many.natural_frequencies[0] > 0.0


# ---------------------------------------------------------------------- penalties


def coupled(n: int, seed: int = 1) -> tuple[Any, Any]:
    rng = np.random.default_rng(seed)
    one, two = rng.normal(size=(2, n, n))
    return two @ two.T + n * np.eye(n), one @ one.T + np.eye(n)


@pytest.mark.parametrize("penalty", [1e14, 1e15, 1e16, 1e20, 1e30, 1e36])
def test_penalty_fixes_a_coordinate(penalty: float) -> None:
    """diag(4, 9, X) gave [0, 3] at 1e15 and [0, 0] from 1e16."""
    with pytest.warns(sb.DiagnosticWarning, match=r"fix the coordinates 2; snapbeam removes them"):
        model = sb.ReducedModel.from_matrices(np.eye(3), [4.0, 9.0, penalty], contact_shape=[1.0, 1.0, 0.0])
    assert model.omega.tolist() == [2.0, 3.0]


@pytest.mark.parametrize("penalty", [1e15, 1e20, 1e36])
@pytest.mark.parametrize("added", [True, False])
def test_penalties_in_coupled_matrices(penalty: float, added: bool) -> None:
    """The model is that of the matrices without these coordinates, in every field."""
    mass, stiffness = coupled(6)
    held, free = [1, 4], [0, 2, 3, 5]
    large = stiffness.copy()
    for i in held:
        large[i, i] = penalty + (stiffness[i, i] if added else 0.0)
    square = np.diag([1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
    rows = {"contact_shape": np.arange(1.0, 7.0), "midspan_shape": np.arange(2.0, 8.0)}
    rows |= {"patch_shape": np.arange(3.0, 9.0), "transverse_force": np.linspace(0.1, 0.6, 6)}
    rows["base_shape"] = np.where(np.isin(np.arange(6), held), 0.0, 1.0)
    ratio = np.linspace(0.01, 0.06, 6)
    with pytest.warns(sb.DiagnosticWarning, match="coordinates 1, 4;"):
        model = sb.ReducedModel.from_matrices(
            mass, large, nonlinear_stiffness=2.0, elongation_matrix=square, damping_ratio=ratio, **rows
        )
    inner = np.ix_(free, free)
    expected = sb.ReducedModel.from_matrices(
        mass[inner], stiffness[inner], nonlinear_stiffness=2.0, elongation_matrix=square[inner],
        damping_ratio=ratio[:4], **{name: row[free] for name, row in rows.items()},
    )  # fmt: skip
    for name in ("mass", "stiffness", "elongation_matrix", "damping_ratio", "natural_frequencies", *rows):
        np.testing.assert_array_equal(getattr(model, name), getattr(expected, name), err_msg=name)


def test_base_that_moves_fixed_coordinates_acts_through_the_mass() -> None:
    mass, stiffness = coupled(4)
    stiffness[3, 3] = 1e20
    with pytest.warns(sb.DiagnosticWarning):
        model = sb.ReducedModel.from_matrices(mass, stiffness, contact_shape=np.ones(4), base_shape=np.ones(4))
    assert model.base_shape is not None
    np.testing.assert_allclose(model.mass @ model.base_shape, (mass @ np.ones(4))[:3], rtol=1e-12)


@pytest.mark.parametrize("sparse", [False, True])
def test_a_base_shape_that_was_multiplied_by_the_mass_is_told(sparse: bool) -> None:
    mass, stiffness = strip(6)
    rigid = np.tile([1.0, 0.0], mass.shape[0] // 2)
    given = (mass, stiffness) if sparse else (mass.toarray(), stiffness.toarray())
    with pytest.warns(sb.DiagnosticWarning, match=r"base_shape of 10 numbers .*is the mass matrix times"):
        sb.ReducedModel.from_matrices(*given, contact_shape=rigid, base_shape=mass @ rigid, modes=2)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for right in (rigid, -rigid, 0.3 * rigid, np.linspace(0.0, 1.0, rigid.size)):
            sb.ReducedModel.from_matrices(*given, contact_shape=rigid, base_shape=right, modes=2)


@pytest.mark.filterwarnings("ignore::snapbeam.DiagnosticWarning")
def test_penalties_without_mass_and_in_sparse_matrices() -> None:
    mass, stiffness = strip(50, clamped=False)
    whole = stiffness.tolil()
    for i in (0, 1, 100, 101):
        whole[i, i] = 1e30
    for given in ((mass, whole.tocsr()), (mass.toarray(), whole.toarray())):
        model = model_of(*given, modes=4)
        assert model.natural_frequencies[0] == pytest.approx(FIRST, rel=1e-5)
    model = sb.ReducedModel.from_matrices(np.diag([1.0, 0.0]), [4.0, 1e20], contact_shape=[1.0, 0.0])
    assert model.omega.tolist() == [2.0]


def test_stiff_coordinates_that_are_no_penalty_stay() -> None:
    """Another unit, a light mass, elastic modes beside a rigid one, and a stiff link are no penalties."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert model_of(np.diag([1.0, 1e-13]), [1e15, 1e2]).modes == 2
        assert model_of(np.diag([1.0, 1e-14]), [4.0, 9.0]).modes == 2
        assert model_of(np.eye(3), [1e-9, 1e5, 1e8]).modes == 3
        assert model_of(np.eye(2), np.array([[1e13, -1e13], [-1e13, 1e13 + 4.0]])).modes == 2


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"contact_shape": [0.0, 0.0, 1.0]}, "contact_shape: must not be zeros only"),
        ({"well_amplitude": [-1.0, 0.0, 1.0], "nonlinear_stiffness": 1.0}, "well_amplitude: must be 0 in the"),
    ],
)
def test_rows_on_fixed_coordinates_only_are_refused(more: dict[str, Any], message: str) -> None:
    with pytest.warns(sb.DiagnosticWarning), pytest.raises(InputError, match=message):
        sb.ReducedModel.from_matrices(np.eye(3), [4.0, 9.0, 1e20], **{"contact_shape": np.ones(3), **more})


# ---------------------------------------------------------------------- against SciPy


def random_pair(number: int) -> tuple[Any, Any, int, NDArray[np.bool_]]:
    """A pair, the number of its rigid modes, and the mask of its fixed coordinates."""
    rng = np.random.default_rng(number)
    limits = (2, 40) if number % 8 else (41, 300)
    n = {40: 900, 120: 2000}.get(number, int(rng.integers(*limits)))
    rigid = int(rng.integers(0, min(3, n)))
    inverse = rng.normal(size=(n, n))
    mass = inverse @ inverse.T + n * np.eye(n)
    if number % 3:
        shape = rng.normal(size=(n, n - rigid))
        stiffness = shape @ shape.T
    else:  # a chain of unequal springs, free at both ends or at one; the first masses free
        mass, stiffness, rigid = np.diag(rng.uniform(0.5, 2.0, n)), np.zeros((n, n)), max(rigid, 1)
        for i in range(rigid - 1, n - 1):
            stiffness[i : i + 2, i : i + 2] += rng.uniform(0.1, 10.0) * np.array([[1.0, -1.0], [-1.0, 1.0]])
    unit = 10.0 ** rng.uniform(-3.0, 3.0, n) if number % 2 else np.ones(n)
    mass = 10.0 ** rng.uniform(-12.0, 12.0) * unit[:, None] * mass * unit
    stiffness = 10.0 ** rng.uniform(-12.0, 12.0) * unit[:, None] * stiffness * unit
    fixed = np.zeros(n, dtype=bool)
    if number % 4 == 1:  # coordinates beside the others
        added = int(rng.integers(1, 4))
        fixed = np.concatenate((fixed, np.ones(added, dtype=bool)))
        whole = [np.zeros((n + added, n + added)) for _ in range(2)]
        for each, own in zip(whole, (mass, stiffness), strict=True):
            each[:n, :n] = own
            across = 1e-3 * rng.normal(size=(n, added)) * np.sqrt(np.diag(own))[:, None] * math.sqrt(own.max())
            each[:n, n:], each[n:, :n] = across, across.T
            each[n:, n:] = np.eye(added) * own.max()
        mass, stiffness = whole
        k, m = np.diag(stiffness)[:n], np.diag(mass)
        least = max(1e14, 1e12 * k.max(), 1e12 * m[n:].max() * (k / m[:n]).max())
        stiffness[n:, n:] = np.diag(least * 10.0 ** rng.uniform(0.1, 12.0, added))
    turn = rng.permutation(fixed.size)
    return mass[np.ix_(turn, turn)], stiffness[np.ix_(turn, turn)], rigid, fixed[turn]


@pytest.mark.parametrize(
    "numbers", [range(1, 9), pytest.param(range(200), marks=pytest.mark.slow)], ids=["quick", "all"]
)
@pytest.mark.filterwarnings("ignore::snapbeam.DiagnosticWarning")
def test_random_pairs_against_scipy(numbers: range) -> None:
    """Sizes 2 to 2,000, scales 1e-12 to 1e12, rigid and fixed coordinates: no silent zero, no lost rigid mode."""
    for number in numbers:
        mass, stiffness, rigid, fixed = random_pair(number)
        found = sb.ReducedModel.from_matrices(mass, stiffness, contact_shape=np.ones(len(mass))).omega ** 2
        inner = np.ix_(~fixed, ~fixed)
        expected = scipy.linalg.eigh(stiffness[inner], mass[inner], eigvals_only=True)
        assert found.size == expected.size, number
        assert int((found == 0.0).sum()) == rigid, number
        np.testing.assert_allclose(
            found[rigid:], expected[rigid:], rtol=1e-9, atol=1e-13 * expected[-1], err_msg=str(number)
        )


# ---------------------------------------------------------------------- sparse matrices and size


def laplacian(n: int, free: bool = False) -> sp.csr_array:
    diagonal = np.full(n, 2.0)
    if free:
        diagonal[[0, -1]] = 1.0
    return sp.csr_array(sp.diags_array([diagonal, -np.ones(n - 1), -np.ones(n - 1)], offsets=[0, 1, -1]))


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::snapbeam.DiagnosticWarning")
def test_sparse_strip_of_20_000_coordinates() -> None:
    """In less than a second; rounding of the entries is reported."""
    mass, stiffness = strip(10_001)
    model = model_of(mass, stiffness, modes=6)
    assert model.modes == 6
    assert model.natural_frequencies[0] == pytest.approx(FIRST, rel=1e-3)
    mass, stiffness = strip(2_000, clamped=False)
    found = model_of(mass, stiffness, modes=4).natural_frequencies
    assert found[:2].tolist() == [0.0, 0.0]
    assert found[2] == pytest.approx(FIRST, rel=1e-5)


def test_sparse_grid_finds_every_double_frequency() -> None:
    n, one = 60, sp.eye_array(60)
    side = laplacian(n)
    stiffness = sp.csr_array(sp.kron(side, one) + sp.kron(one, side))
    own = 2.0 - 2.0 * np.cos(math.pi * np.arange(1, n + 1) / (n + 1))
    expected = np.sort((own[:, None] + own).ravel())
    for modes in (1, 2, 12):
        found = model_of(sp.csr_array(sp.eye_array(n * n)), stiffness, modes=modes).omega ** 2
        np.testing.assert_allclose(found, expected[:modes], rtol=1e-11)


def test_sparse_parts_and_unstable_motions() -> None:
    """Parts that nothing connects, each with its scale; negative eigenvalues are not missed."""
    alone = sp.diags_array([0.0, 1e-9, 5.0])
    stiffness = sp.csr_array(sp.block_diag([laplacian(3000, True), laplacian(1000), alone]))
    found = eigenpairs(stiffness, sp.csr_array(sp.eye_array(4003)), count=3).value
    assert found[:2].tolist() == [0.0, 0.0]
    assert found[2] == pytest.approx(1e-9, rel=1e-14)
    pulled = laplacian(2000).tolil()
    pulled[0, 0], pulled[1000, 1000] = -1.0, -3.0
    found = eigenpairs(sp.csr_array(pulled), sp.csr_array(sp.eye_array(2000)), count=10).value
    expected = scipy.linalg.eigvalsh_tridiagonal(pulled.diagonal(), -np.ones(1999), select="i", select_range=(0, 9))
    np.testing.assert_allclose(found, expected, atol=1e-14)
    with pytest.raises(InputError, match="must be stable"):
        model_of(sp.csr_array(sp.eye_array(2000)), sp.csr_array(pulled), modes=4)


def test_modes_are_those_of_the_whole_model() -> None:
    """Projection onto all modes changes the coordinates only; dense, sparse and fewer modes agree."""
    mass, stiffness = (each.toarray() for each in strip(10))
    rows = {name: np.linspace(0.1, 1.0, len(mass)) for name in ("midspan_shape", "base_shape", "patch_shape")}
    force = 1e-3 * np.ones(len(mass))
    more = {"nonlinear_stiffness": 1e3, "transverse_force": force, "damping_ratio": 0.01, **rows}
    whole = model_of(mass, stiffness, **more)
    turned = model_of(mass, stiffness, elongation_matrix=np.eye(len(mass)), modes=len(mass), **more)
    np.testing.assert_allclose(turned.natural_frequencies, whole.natural_frequencies, rtol=1e-9)
    for name in rows:
        one, two = (
            each.linear_modes.T @ (each.mass if name == "base_shape" else np.eye(each.modes)) @ getattr(each, name)
            for each in (turned, whole)
        )
        np.testing.assert_allclose(np.abs(one), np.abs(two), rtol=1e-6, atol=1e-9)
    assert turned.potential_energy(turned.well_amplitude) == pytest.approx(whole.well_energy, rel=1e-9)
    few = model_of(sp.csr_array(mass), sp.csr_array(stiffness), modes=3)
    np.testing.assert_allclose(few.omega, model_of(mass, stiffness).omega[:3], rtol=1e-9)


@pytest.mark.parametrize("modes", [0, 257, 2.5])
def test_refused_numbers_of_modes(modes: Any) -> None:
    mass, stiffness = strip(300)
    with pytest.raises(InputError, match="modes = "):
        model_of(mass, stiffness, modes=modes)


def test_a_well_with_modes_is_refused() -> None:
    with pytest.raises(InputError, match="well_amplitude with modes"):
        model_of(np.eye(2), [-1.0, 1.0], nonlinear_stiffness=1.0, well_amplitude=[-1.0, 0.0], modes=1)


def test_size(monkeypatch: pytest.MonkeyPatch) -> None:
    """A dense pair that takes a minute is announced, a sparse one needs its number of modes."""
    mass, stiffness = sp.csr_array(sp.eye_array(4000)), laplacian(4000)
    with pytest.raises(InputError, match="sparse matrices of 4000 coordinates or more need modes"):
        model_of(mass, stiffness)
    monkeypatch.setattr(buckling_modes, "_MINUTE", 40)
    with pytest.warns(sb.DiagnosticWarning, match=r"mass of shape \(40, 40\): .* take about 1 min"):
        model_of(np.eye(40), laplacian(40).toarray())


# ---------------------------------------------------------------------- symmetry


@pytest.mark.parametrize("kind", [np.asarray, sp.csr_array])
def test_asymmetry(kind: Any) -> None:
    def given(difference: float) -> sb.ReducedModel:
        return model_of(np.eye(2), kind(np.array([[2.0, 1.0], [1.0 + difference, 2.0]])))

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert given(1e-14).omega == pytest.approx([1.0, math.sqrt(3.0)])
    with pytest.warns(sb.DiagnosticWarning, match="stiffness: is symmetric to single precision only"):
        assert given(1e-7).stiffness[0, 1] == pytest.approx(1.0 + 0.5e-7, abs=1e-15)
    message = r"stiffness\[0, 1\] = 1.0, stiffness\[1, 0\] = 1.000001: must be symmetric; check the order"
    with pytest.raises(InputError, match=message):
        given(1e-6)


@pytest.mark.parametrize("kind", [np.asarray, sp.csr_array])
def test_one_triangle(kind: Any) -> None:
    mass, stiffness = coupled(4)
    with pytest.raises(InputError, match=r"mass.*only the upper triangle is given; give A"):
        model_of(kind(np.triu(mass)), stiffness)
    with pytest.raises(InputError, match=r"stiffness.*only the lower triangle is given; give A"):
        model_of(mass, kind(np.tril(stiffness)))


def test_penalty_hides_no_asymmetry() -> None:
    """The scale of an entry is that of its rows, not the largest entry."""
    stiffness = np.diag([4.0, 4.0, 1e20])
    stiffness[0, 1] = 1.0
    with pytest.raises(InputError, match=r"stiffness\[0, 1\] = 1.0"):
        model_of(np.eye(3), stiffness)


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0, 2.0, 20.0])
def test_blocks_are_connected_components(share):
    from scipy.sparse.csgraph import connected_components

    random = np.random.default_rng(5)
    for count in (1, 2, 7, 60):
        coupled = random.random((count, count)) < share / count
        order, sizes = coupled_blocks(coupled)
        number, label = connected_components(coupled, directed=False)
        assert np.array_equal(order, np.argsort(label, kind="stable"))
        assert np.array_equal(sizes, np.bincount(label, minlength=number))
