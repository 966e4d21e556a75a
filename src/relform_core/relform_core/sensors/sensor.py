"""One kind of sensor: the key under which its measurements and its configuration are found."""

from dataclasses import dataclass
from typing import Annotated, Generic, Protocol, TypeVar

from pydantic import Field

from relform_core.schema import Probability, Schema


class Measurement(Protocol):
    """What a sensor measured at one instant."""

    @property
    def stamp_ns(self) -> int:
        """Instant of the measurement, in simulation time [ns]."""


class SensorConfig(Schema):
    """Section of ``config/sensors/*.yaml`` on one sensor."""

    dropout_probability: Annotated[Probability, Field(examples=[0.05])]
    """Probability that a measurement is missing, independent of the others; of range and bearing, that of one
    target."""

    @property
    def message_loss(self) -> float:
        """Probability that a whole message of this sensor is lost."""
        return self.dropout_probability


M = TypeVar("M", bound=Measurement)
C = TypeVar("C", bound=SensorConfig)


@dataclass(frozen=True, eq=False)
class Source(Generic[M]):
    """What a vehicle sends to the controller: one kind of measurement."""

    name: str
    """Of its topic, of its section in the configuration, and of its modules."""
    measurement: type[M]


@dataclass(frozen=True, eq=False)
class Sensor(Source[M], Generic[M, C]):
    """Registration of a sensor."""

    config: type[C]
    stream: int
    """Key of its random stream, see ``randomness``. Append, never renumber: recorded results depend on it."""
    leader_only: bool = False
    """Whether only the leader carries it; otherwise every vehicle does."""
    optional: bool = False
    """Whether the configuration may leave its section out: then no vehicle carries it."""
