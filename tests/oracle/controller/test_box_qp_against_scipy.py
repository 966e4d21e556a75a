"""The quadratic program with bounds against SciPy's bounded least squares, which it is when H = J' J."""

import daqp
import numpy as np
import pytest
from scipy.optimize import lsq_linear

from relform_controller.solver.dense import box_qp
from relform_controller.solver.dense.box_qp import BoxQp, QpError
from support.world import Array


def random_problem(seed: int, size: int, tightness: float) -> tuple[Array, Array, Array, Array]:
    """J and r of |J x + r|^2 / 2, and bounds; the tighter, the more of them are active."""
    generator = np.random.default_rng(seed)
    J = generator.normal(size=(2 * size, size)) * 10.0 ** generator.uniform(-2.0, 1.0, size)
    r = generator.normal(size=2 * size)
    x = np.linalg.lstsq(J, -r)[0]
    width = np.abs(x) * generator.uniform(0.2, 3.0, size) / tightness + 1e-3
    centre = generator.uniform(-0.3, 0.3, size) * width
    return J, r, centre - width, centre + width


@pytest.mark.parametrize("tightness", [0.1, 1.0, 10.0])
@pytest.mark.parametrize(("seed", "size"), [(1, 1), (2, 8), (3, 40), (4, 180)])
def test_solution_and_multipliers(seed: int, size: int, tightness: float) -> None:
    J, r, lower, upper = random_problem(seed, size, tightness)
    found = BoxQp(J.T @ J, lower, upper).solve(J.T @ r)
    expected = lsq_linear(J, -r, (lower, upper), method="bvls", tol=1e-15, max_iter=1000)
    assert expected.success
    np.testing.assert_allclose(found.x, expected.x, atol=1e-7)
    # The slope that is left points out of the box where a bound is active, and is zero elsewhere.
    np.testing.assert_allclose(found.multipliers, -J.T @ (J @ expected.x + r), atol=1e-6)
    np.testing.assert_array_equal(np.sign(found.multipliers), expected.active_mask)
    assert (found.iterations > 1) == found.multipliers.any()


def test_cases_with_and_without_active_bounds_are_among_them() -> None:
    active = []
    for tightness in (0.1, 1.0, 10.0):
        J, r, lower, upper = random_problem(4, 180, tightness)
        active.append(np.count_nonzero(BoxQp(J.T @ J, lower, upper).solve(J.T @ r).multipliers))
    assert active[0] < 20 < active[1] < 120 < active[2]


def test_many_gradients_for_one_factorisation() -> None:
    J, _, lower, upper = random_problem(7, 30, 1.0)
    qp = BoxQp(J.T @ J, lower, upper)
    for seed in range(5):
        r = np.random.default_rng(seed).normal(size=60)
        expected = lsq_linear(J, -r, (lower, upper), method="bvls", tol=1e-15)
        np.testing.assert_allclose(qp.solve(J.T @ r).x, expected.x, atol=1e-8)


@pytest.mark.parametrize("seed", range(5))
def test_if_the_guesses_never_settle_daqp_takes_over(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    J, r, lower, upper = random_problem(seed, 20, 3.0)
    expected = BoxQp(J.T @ J, lower, upper).solve(J.T @ r)
    monkeypatch.setattr(box_qp, "_ITERATIONS_MAX", 1)
    found = BoxQp(J.T @ J, lower, upper).solve(J.T @ r)
    np.testing.assert_allclose(found.x, expected.x, atol=1e-8)
    np.testing.assert_allclose(found.multipliers, expected.multipliers, atol=1e-6)
    assert found.iterations > 1


def test_a_problem_that_neither_method_solves_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    J, r, lower, upper = random_problem(1, 5, 3.0)
    monkeypatch.setattr(box_qp, "_ITERATIONS_MAX", 1)
    monkeypatch.setattr(
        daqp, "solve", lambda *_: (np.zeros(5), 0.0, -4, {"iterations": 1000, "lam": np.zeros(5)})
    )
    with pytest.raises(QpError, match=r"^the QP was not solved \(daqp exit flag -4\)$"):
        BoxQp(J.T @ J, lower, upper).solve(J.T @ r)


@pytest.mark.parametrize(
    ("hessian", "problem"),
    [
        ([[1.0, np.nan], [np.nan, 1.0]], "the Hessian is not finite"),
        ([[1.0, 2.0], [2.0, 1.0]], "the Hessian is not positive definite"),
        ([[1.0, 0.0], [0.0, 0.0]], "the Hessian is not positive definite"),
    ],
)
def test_a_hessian_that_has_no_minimiser(hessian: list[list[float]], problem: str) -> None:
    with pytest.raises(QpError, match=f"^{problem}$"):
        BoxQp(np.array(hessian), np.full(2, -1.0), np.full(2, 1.0))


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_gradient_that_is_not_finite(bad: float) -> None:
    with pytest.raises(QpError, match=r"^the gradient is not finite$"):
        BoxQp(np.eye(2), np.full(2, -1.0), np.full(2, 1.0)).solve(np.array([0.5, bad]))
