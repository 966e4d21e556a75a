"""The team filter in C: ``team_filter.c``, compiled together with the functions of ``team_model``."""

import ctypes
from functools import cache
from importlib import resources

import numpy as np

from relform_controller.compiled import generated_c
from relform_controller.estimation import team_model
from relform_controller.estimation.estimator import TeamCovariances
from relform_controller.estimation.team_belief import Belief, Innovation, Observation, check_definite
from relform_controller.estimation.team_filter import ReferenceTeamFilter, TeamFilter
from relform_controller.ocp import layout
from relform_controller.ocp.model import RigidBody
from relform_controller.ocp.problem import Disturbances, TeamGeometry
from relform_core.arrays import Array
from relform_core.c_library import NoCompilerError, shared_library

_N_POSE = 6
_PANEL = 8
"""The work space is padded to a multiple of this."""
_N_WORK = 3
"""How many matrices the work space holds."""
_CONSTANTS = {
    "N_STATE": layout.N_STATE,
    "N_INPUT": layout.N_INPUT,
    "POSITION": layout.POSITION.start,
    "VELOCITY": layout.VELOCITY.start,
    "ROLL": layout.ROLL,
    "PITCH": layout.PITCH,
    "YAW": layout.YAW,
    "RATE": layout.RATE.start,
    "DISTURBANCE": team_model.DISTURBANCE.start,
    "THRUST_SCALE": team_model.THRUST_SCALE,
    "N_FILTER_STATE": team_model.N_FILTER_STATE,
    "N_OWN_ROWS": team_model.N_OWN_ROWS,
    "RATE_ROWS": team_model.RATE_ROWS.start,
    "SPECIFIC_FORCE_ROWS": team_model.SPECIFIC_FORCE_ROWS.start,
    "POSITION_ROWS": team_model.POSITION_ROWS.start,
    "YAW_ROW": team_model.YAW_ROW,
}


def make_team_filter(body: RigidBody, n_vehicles: int) -> TeamFilter:
    """The compiled filter, or the one in NumPy where there is no C compiler.

    Args:
        body: the nominal body of every vehicle.
        n_vehicles: number of vehicles.
    Raises:
        RelformError: the compiler fails, or its result cannot be kept.
    """
    try:
        return CompiledTeamFilter(body, n_vehicles)
    except NoCompilerError:
        return ReferenceTeamFilter(body, n_vehicles)


class CompiledTeamFilter:
    """The filter in C.

    Args:
        body: the nominal body of every vehicle.
        n_vehicles: number of vehicles.
    Raises:
        RelformError: there is no C compiler, or it fails.
    """

    def __init__(self, body: RigidBody, n_vehicles: int) -> None:
        self._n = n_vehicles
        self._n_pairs = n_vehicles * (n_vehicles - 1)
        library = _library(body)
        size = -(-n_vehicles * team_model.N_FILTER_STATE // _PANEL) * _PANEL
        self._work_space = np.empty(_N_WORK * size**2)
        self._work = _address(self._work_space)
        self._predict, self._innovate = library.predict, library.innovate
        self._correct, self._geometry = library.correct, library.geometry

    def predict(self, belief: Belief, thrusts: Array, duration: float, noise: Array) -> Belief:
        """See ``TeamFilter``."""
        states, factor = np.empty_like(belief.states), np.empty_like(belief.factor)
        failed = self._predict(
            self._n,
            self._work,
            _address(belief.states),
            _address(belief.factor),
            _address(thrusts),
            duration,
            _address(noise),
            _address(states),
            _address(factor),
        )
        check_definite(failed)
        return Belief(states, factor)

    def innovation(self, belief: Belief, thrusts: Array, observation: Observation) -> Innovation:
        """See ``TeamFilter``."""
        n, n_pairs = self._n, self._n_pairs
        found = Innovation(
            own=np.empty((n, team_model.N_OWN_ROWS)),
            own_by_state=np.empty((n, team_model.N_OWN_ROWS, team_model.N_FILTER_STATE)),
            sightings=np.empty((n_pairs, team_model.N_SIGHT_ROWS)),
            sightings_by_observer=np.empty((n_pairs, team_model.N_SIGHT_ROWS, _N_POSE)),
            sightings_by_target=np.empty((n_pairs, team_model.N_SIGHT_ROWS, 3)),
            forces=np.empty((n, 3)),
            torque_distances=np.empty(n),
            sighting_distances=np.empty(n_pairs),
            leader_distance=np.empty(1),
        )
        self._innovate(
            n,
            _address(belief.states),
            _address(belief.factor),
            _address(thrusts),
            _address(observation.own),
            _address(observation.own_weights),
            _address(observation.sightings),
            _address(observation.sighting_weights),
            _address(found.own),
            _address(found.own_by_state),
            _address(found.sightings),
            _address(found.sightings_by_observer),
            _address(found.sightings_by_target),
            _address(found.forces),
            _address(found.torque_distances),
            _address(found.sighting_distances),
            _address(found.leader_distance),
        )
        return found

    def correct(self, belief: Belief, innovation: Innovation) -> Belief:
        """See ``TeamFilter``."""
        states, factor = np.empty_like(belief.states), np.empty_like(belief.factor)
        failed = self._correct(
            self._n,
            self._work,
            _address(belief.states),
            _address(belief.factor),
            _address(innovation.own),
            _address(innovation.own_by_state),
            _address(innovation.sightings),
            _address(innovation.sightings_by_observer),
            _address(innovation.sightings_by_target),
            _address(states),
            _address(factor),
        )
        check_definite(failed)
        return Belief(states, factor)

    def geometry(self, belief: Belief) -> tuple[Array, TeamGeometry, TeamCovariances]:
        """See ``TeamFilter``."""
        n, n_pairs = self._n, self._n_pairs
        states = np.empty((n, layout.N_STATE))
        p_I1I2_I1, yaw_I1I2 = np.empty((n_pairs, 3)), np.empty(n_pairs)
        disturbances = np.empty((n, 3))
        covariances = TeamCovariances(np.empty((n_pairs, 4, 4)), np.empty((4, 4)))
        self._geometry(
            n,
            self._work,
            _address(belief.states),
            _address(belief.factor),
            _address(states),
            _address(p_I1I2_I1),
            _address(yaw_I1I2),
            _address(disturbances),
            _address(covariances.pairs),
            _address(covariances.leader),
        )
        leader = belief.states[0]
        geometry = TeamGeometry(
            p_I1I2_I1,
            yaw_I1I2,
            p_NI_N=leader[layout.POSITION].copy(),
            yaw_NI=float(leader[layout.YAW]),
            disturbances=Disturbances(disturbances, belief.states[:, team_model.THRUST_SCALE].copy()),
        )
        return states, geometry, covariances


@cache
def _library(body: RigidBody) -> ctypes.CDLL:
    """The library for vehicles with this body, with typed functions."""
    functions = (team_model.transition(body), team_model.own_measurement(body), team_model.sighting())
    constants = [f"#define {name} {value}" for name, value in _CONSTANTS.items()]
    text = resources.files(__package__).joinpath("team_filter.c").read_text()
    library = ctypes.CDLL(str(shared_library("\n".join([generated_c(functions), *constants, text]))))
    pointer, count = ctypes.c_void_p, ctypes.c_long
    library.predict.argtypes = [count, *[pointer] * 4, ctypes.c_double, *[pointer] * 3]
    library.innovate.argtypes = [count, *[pointer] * 16]
    library.correct.argtypes = [count, *[pointer] * 10]
    library.geometry.argtypes = [count, *[pointer] * 9]
    library.innovate.restype = library.geometry.restype = None
    return library


def _address(array: Array) -> int:
    """Address of the first of an array's elements, which must be in the order of C."""
    return ctypes.addressof(ctypes.c_char.from_buffer(array.data))
