"""A recorded flight as a ``FlightLog``, from the bag alone."""

from collections.abc import Sequence
from pathlib import Path

from rclpy.serialization import deserialize_message

from relform_analysis.flight.log import FlightLog, FlightLogBuilder
from relform_bags.message_types import message_class
from relform_bags.reader import BagAttachment, BagMessage, find_bag, read_bag
from relform_core.errors import BagError, ConfigError
from relform_core.load import LoadedScenario, load_scenario_text
from relform_core.names import CONFIG_ATTACHMENT


def read_flight_log(path: Path) -> FlightLog:
    """Read a flight; of a bag that was cut off, what there is.

    Args:
        path: the bag's file or folder, or the folder of the run.
    Raises:
        BagError: one line: there is no bag, it is not of relform, or it holds no flight.
    """
    file = find_bag(path)
    builder: FlightLogBuilder | None = None
    try:
        for entry in read_bag(file):
            match entry:
                case BagAttachment(name, text) if name == CONFIG_ATTACHMENT:
                    builder = FlightLogBuilder(load_attached_scenario(text, file))
                case BagMessage(topic, type_name, data) if builder is not None:
                    if FlightLogBuilder.needs(topic):
                        builder.add(topic, deserialize_message(data, message_class(type_name)))
        if builder is None:
            raise BagError(f"not a bag of relform: it has no attachment {CONFIG_ATTACHMENT}")
        if missing := builder.missing():
            raise BagError(f"no flight in it: {missing}")
        return builder.build()
    except BagError as error:
        prefix = f"{file}: "
        raise BagError(prefix + str(error).removeprefix(prefix)) from None


def load_attached_scenario(text: str, file: Path, overrides: Sequence[str] = ()) -> LoadedScenario:
    """The scenario that is attached to a bag, with some keys changed.

    Raises:
        BagError: it is not usable.
        ConfigError: an override is not.
    """
    origin = f"{file}: its attachment {CONFIG_ATTACHMENT}"
    try:
        scenario = load_scenario_text(text, origin)
    except ConfigError as error:
        raise BagError(str(error).splitlines()[0]) from None
    return load_scenario_text(text, origin, overrides) if overrides else scenario
