"""Events on /formation/events that several nodes send or read."""

from collections.abc import Mapping

from relform_core.tuning import Value
from relform_msgs.msg import FormationEvent
from relform_ros.fields import header_to_msg


def parameters_to_msg(step: int, period_ns: int, source: str, changes: Mapping[str, Value]) -> FormationEvent:
    """Numbers among the parameters of ``source`` were changed, and apply from a step on."""
    return FormationEvent(
        header=header_to_msg(step * period_ns),
        step=step,
        kind=FormationEvent.SET_PARAMETERS,
        source=source,
        description="changed by parameters",
        parameter_names=list(changes),
        parameter_values=list(changes.values()),
    )


def parameters_from_msg(msg: FormationEvent) -> dict[str, Value]:
    """The changed parameters of an event."""
    return dict(zip(msg.parameter_names, msg.parameter_values, strict=True))
