"""Layout of the state and input vectors of the optimal control problem. Slice by these names."""

# State of one vehicle, eq. MPC_StateDef: s = [p_IB_I, v_IB_I, rpy_IB, w_IB_B].
POSITION = slice(0, 3)
VELOCITY = slice(3, 6)
RPY = slice(6, 9)
VELOCITY_AND_RPY = slice(3, 9)
RATE = slice(9, 12)
ROLL, PITCH, YAW = 6, 7, 8
N_STATE = 12

# Input of one vehicle: thrust of each rotor, front, left, back, right [N].
N_INPUT = 4


def ordered_pairs(n_vehicles: int) -> tuple[tuple[int, int], ...]:
    """All (i, j) with i != j: observer i, in whose {mc_i} target j is controlled (eq. CostFunc1)."""
    return tuple((i, j) for i in range(n_vehicles) for j in range(n_vehicles) if i != j)
