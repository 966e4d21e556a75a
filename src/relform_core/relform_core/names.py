"""The names of a flight's nodes and topics, and the numbers that its messages use for kinds and states."""

from enum import IntEnum

FORMATION = "formation"
"""Namespace of the controller that commands the whole team."""
CONTROLLER = "controller"
"""Node in the namespace of each controller."""
EVENTS_OF_CONTROLLER = "events"
"""Topic in the namespace of each controller, as the next five."""
STATE_OF_CONTROLLER = "state"
SOLVER_OF_CONTROLLER = "solver"
REFERENCE_OF_CONTROLLER = "reference"
STATUS_OF_CONTROLLER = "status"
SEPARATION_OF_CONTROLLER = "separation"

CLOCK = "/clock"
EVENTS = f"/{FORMATION}/{EVENTS_OF_CONTROLLER}"
SOLVER = f"/{FORMATION}/{SOLVER_OF_CONTROLLER}"
REFERENCE = f"/{FORMATION}/{REFERENCE_OF_CONTROLLER}"
STATUS = f"/{FORMATION}/{STATUS_OF_CONTROLLER}"
DIAGNOSTICS = "/diagnostics"
MEMBERS = "/sim/members"
"""Topic of the clock's decisions on nodes of a running flight."""

TF = "/tf"
TF_STATIC = "/tf_static"
MARKERS = f"/{FORMATION}/markers"
PATH = "path"
"""Topic in the namespace of each vehicle, as the last of the next two."""
REFERENCE_PATH = "reference_path"
"""Topic in the namespace of the leader."""
ROBOT_DESCRIPTION = "robot_description"

GROUND_TRUTH = "ground_truth"
"""Topic in the namespace of each vehicle."""
ROTOR_SPEEDS = "rotor_speeds"
"""Topic in the namespace of each vehicle."""
STEP_DONE = "step_done"
"""Topic in the namespace of each member of the barrier."""

CLOCK_NODE = "/sim/clock"
CONTROLLER_NODE = f"/{FORMATION}/{CONTROLLER}"
RECORDER_NODE = "/recorder"
MONITOR_NODE = "/monitor"
PLAYER_NODE = "/player"
VISUALIZATION_NODE = "/visualization"
VEHICLE_NODE = "quadrotor"
"""Node in the namespace of each vehicle."""

CONFIG_ATTACHMENT = "config.yaml"
"""The effective configuration, attached to the bag of a flight."""
VERSIONS_ATTACHMENT = "versions.json"
"""The versions of the recording software, attached to every bag."""


class EventKind(IntEnum):
    """Kind of an event of the flight; the numbers of FormationEvent.msg."""

    STEP = 0
    SET_FORMATION = 1
    FAULT = 2
    SET_PARAMETERS = 3
    REQUEST = 4
    ALARM = 5
    TAKE_OVER = 6


class EstimatorMode(IntEnum):
    """How the estimate of a control step came about; the numbers of FormationState.msg."""

    MEASURED = 0
    """Everything that the estimator uses was measured in this step."""
    PREDICTED = 1
    """Something was not measured in this step, and a prediction stands in for it."""
    DEGRADED = 2
    """Something has been missing for so long, or contradicts so much, that the estimate is poorer."""


class SolverState(IntEnum):
    """How a control step ended; the numbers of SolverStatus.msg."""

    SOLVED = 0
    STEP_LIMIT = 1
    FALLBACK = 2


class SeparationLevel(IntEnum):
    """How close two vehicles are; the numbers of Separation.msg."""

    OK = 0
    WARNING = 1
    """Two vehicles are closer than ``separation.warning_m``, or the plan brings them closer."""
    EMERGENCY = 2
    """Two vehicles are closer than ``separation.emergency_m``."""


def vehicle_node(vehicle: str) -> str:
    """Fully qualified name of the node of a vehicle."""
    return f"/{vehicle}/{VEHICLE_NODE}"


def vehicle_topic(vehicle: str, name: str) -> str:
    """Fully qualified name of a topic of a vehicle."""
    return f"/{vehicle}/{name}"


def step_done_topic(node: str) -> str:
    """Topic on which a member of the barrier reports that it has finished a step."""
    return f"{node}/{STEP_DONE}"


def split_node_name(node: str) -> tuple[str, str]:
    """Namespace and base name of a fully qualified node name: ``/sim/clock`` is ``("/sim", "clock")``."""
    namespace, _, name = node.rpartition("/")
    return namespace or "/", name
