import numpy as np

from coop_drake.fields.density import _factorise_and_solve


def system(size, weakest):
    """A matrix with known singular values from 1 down to ``weakest``, and two right-hand sides."""
    rng = np.random.default_rng(3)
    left, _ = np.linalg.qr(rng.normal(size=(size, size)))
    right, _ = np.linalg.qr(rng.normal(size=(size, size)))
    matrix = left * np.geomspace(1.0, weakest, size) @ right
    return np.asfortranarray(matrix), rng.normal(size=(size, 2))


def test_large_systems_are_solved_to_double_precision():
    matrix, solution = system(1_100, 1e-3)
    found, condition = _factorise_and_solve(matrix.copy(order="F"), matrix @ solution)
    np.testing.assert_allclose(found, solution, atol=1e-10)
    assert 1e3 < condition < 1e7


def test_what_single_precision_cannot_solve_is_factorised_in_double():
    matrix, solution = system(1_100, 1e-9)
    found, condition = _factorise_and_solve(matrix.copy(order="F"), matrix @ solution)
    np.testing.assert_allclose(matrix @ found, matrix @ solution, atol=1e-12)
    np.testing.assert_allclose(found, solution, atol=1e-4)
    assert condition > 1e9
