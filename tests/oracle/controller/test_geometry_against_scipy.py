"""Eqs. RelPos1 to RelPos4 against poses in a common world frame."""

import casadi as ca
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from relform_controller.ocp.terms.formation import relative_position


def evaluate(*values: object) -> np.ndarray:
    sizes = (3, 1, 3, 3, 1)
    symbols = [ca.SX.sym(f"a{i}", size) for i, size in enumerate(sizes)]
    function = ca.Function("f", symbols, [relative_position(*symbols)])
    return np.array(function(*[ca.DM(value) for value in values])).reshape(-1)


def test_a_number_worked_out_by_hand() -> None:
    """{mi_2} is 3 m ahead of {mi_1} and turned left by 90 deg. 2 moves 1 m along its own x, 1 moves 1 m ahead
    and turns left by 90 deg: so 2 is 2 m ahead and 1 m to the left of 1 in {mi_1}, which is 1 m ahead and 2 m
    to the right in {mc_1}.
    """
    p_B1B2_C1 = evaluate([1, 0, 0], np.pi / 2, [1, 0, 0], [3, 0, 0], np.pi / 2)
    np.testing.assert_allclose(p_B1B2_C1, [1, -2, 0], atol=1e-15)


@pytest.mark.parametrize("seed", range(10))
def test_positions_in_the_control_frame(seed: int) -> None:
    generator = np.random.default_rng(seed)
    p_NI_N = generator.uniform(-30.0, 30.0, (2, 3))
    yaw_NI, yaw_IB = generator.uniform(-np.pi, np.pi, (2, 2))
    p_IB_I = generator.uniform(-2.0, 2.0, (2, 3))
    R_NI = [Rotation.from_euler("z", yaw) for yaw in yaw_NI]
    p_NB_N = [p + R.apply(offset) for p, R, offset in zip(p_NI_N, R_NI, p_IB_I, strict=True)]
    R_NC1 = Rotation.from_euler("z", yaw_NI[0] + yaw_IB[0])
    expected = R_NC1.inv().apply(p_NB_N[1] - p_NB_N[0])

    p_I1I2_I1 = R_NI[0].inv().apply(p_NI_N[1] - p_NI_N[0])
    found = evaluate(p_IB_I[0], yaw_IB[0], p_IB_I[1], p_I1I2_I1, yaw_NI[1] - yaw_NI[0])
    np.testing.assert_allclose(found, expected, atol=1e-12)
