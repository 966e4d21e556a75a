"""Messages that were recorded with another definition; rosbags writes them."""

from pathlib import Path

import numpy as np
import pytest
from rosbags.typesys import get_types_from_msg

from relform_analysis.flight.from_bag import read_flight_log
from relform_bags.from_bag import decode, has_installed_definition
from relform_bags.message_types import SEPARATOR, message_class, message_type
from relform_bags.reader import BagMessage, read_bag
from relform_core.errors import BagError
from support.bags import TOPICS, random_message, typestore

OLDER_FLIGHT = Path(__file__).parents[2] / "data/older_flight"
STATE = "relform_msgs/msg/FormationState"
PARTS = ("std_msgs/Header", "builtin_interfaces/Time", "geometry_msgs/Vector3")
OLD_STATE = "std_msgs/Header header\nPairState[] pairs\nstring weather\nfloat64 leader_yaw_error\n"
OLD_PAIR = "string target_id\nfloat32[3] wind\ngeometry_msgs/Vector3 position\nbool yaw_held\n"


def bag_message(type_name: str, data: bytes, definition: str) -> BagMessage:
    return BagMessage("/topic", type_name, data, 0, 0, definition)


@pytest.fixture(scope="module")
def old() -> BagMessage:
    """A state with fewer, other and further fields, also in the messages that it contains."""
    store = type(typestore())()  # of its own, because it knows other types of the same names
    for part in PARTS:
        package, _, name = part.partition("/")
        text = message_type(f"{package}/msg/{name}").definition.partition(SEPARATOR)[0]
        store.register(get_types_from_msg(text, f"{package}/msg/{name}"))
    store.register(get_types_from_msg(OLD_PAIR, "relform_msgs/msg/PairState"))
    store.register(get_types_from_msg(OLD_STATE, STATE))
    types = store.types
    stamp = types["builtin_interfaces/msg/Time"](sec=7, nanosec=50_000_000)
    pair = types["relform_msgs/msg/PairState"](
        target_id="follower_1",
        wind=np.array([1.0, 2.0, 3.0], dtype=np.float32),
        position=types["geometry_msgs/msg/Vector3"](x=-1.5, y=0.25, z=1e-9),
        yaw_held=True,
    )
    state = types[STATE](
        header=types["std_msgs/msg/Header"](stamp=stamp, frame_id="somewhere"),
        pairs=[pair, pair],
        weather="fog",
        leader_yaw_error=-0.75,
    )
    sections = [OLD_STATE, f"MSG: relform_msgs/PairState\n{OLD_PAIR}"]
    for part in PARTS:
        package, _, name = part.partition("/")
        text = message_type(f"{package}/msg/{name}").definition.partition(SEPARATOR)[0]
        sections.append(f"MSG: {part}\n{text}")
    definition = f"\n{SEPARATOR}\n".join(sections)
    return bag_message(STATE, bytes(store.serialize_cdr(state, STATE)), definition)


def test_fields_of_an_older_definition_are_taken_over_by_name(old: BagMessage) -> None:
    state = decode(old)
    assert isinstance(state, message_class(STATE))
    assert (state.header.stamp.sec, state.header.frame_id) == (7, "somewhere")
    assert state.leader_yaw_error == -0.75
    for pair in state.pairs:
        assert (pair.target_id, pair.yaw_held) == ("follower_1", True)
        assert (pair.position.x, pair.position.y, pair.position.z) == (-1.5, 0.25, 1e-9)


def test_fields_that_were_not_recorded_have_their_defaults(old: BagMessage) -> None:
    state, new = decode(old), message_class(STATE)()
    assert (state.step, state.phase) == (0, "")
    assert state.estimator_mode == new.estimator_mode == 255
    assert state.leader_covariance[0] == state.pairs[1].covariance[0] == -1.0


@pytest.mark.parametrize("type_name", [STATE, *(type_name for type_name, _ in TOPICS.values())])
def test_both_ways_of_decoding_agree(type_name: str) -> None:
    message = random_message(type_name, np.random.default_rng(3))
    data = bytes(typestore().serialize_cdr(message, type_name))
    definition = message_type(type_name).definition
    first, *others = definition.split(SEPARATOR)
    extended = SEPARATOR.join([f"{first}string remark\n", *others])
    installed = bag_message(type_name, data, definition)
    # An empty text at the end of the bytes is the additional field.
    recorded = bag_message(type_name, data + bytes(-len(data) % 4) + b"\1\0\0\0\0", extended)
    assert has_installed_definition(installed)
    assert not has_installed_definition(recorded)
    assert decode(recorded) == decode(installed)


def test_comments_and_the_order_of_types_make_no_other_definition() -> None:
    first, *others = message_type(STATE).definition.split(SEPARATOR)
    plain = "\n".join(line.partition("#")[0] for line in first.splitlines())
    definition = f"{SEPARATOR}\n".join([f"{plain}\n", *(other.lstrip() for other in reversed(others))])
    assert has_installed_definition(bag_message(STATE, b"", definition))
    assert has_installed_definition(bag_message(STATE, b"", ""))


@pytest.mark.parametrize("definition", ["std_msgs/Header header\n", "no definition", "float64[9] step\n"])
def test_definition_that_does_not_help_is_one_line(definition: str) -> None:
    with pytest.raises(BagError) as error:
        decode(bag_message(STATE, bytes(200), definition))
    (line,) = str(error.value).splitlines()
    assert line.startswith(f"message type '{STATE}' was recorded with another definition, which cannot be ")


def test_flight_that_an_older_version_recorded() -> None:
    states = [
        entry for entry in read_bag(OLDER_FLIGHT, {"/formation/state"}) if isinstance(entry, BagMessage)
    ]
    assert not any(map(has_installed_definition, states))
    log = read_flight_log(OLDER_FLIGHT)
    assert len(log.phase) == len(states) == 40
    others = ~np.eye(3, dtype=bool)
    assert np.isfinite(log.p_BB_C__est[:, others]).all()
    assert np.isfinite(log.yaw_variance[:, others]).all()
