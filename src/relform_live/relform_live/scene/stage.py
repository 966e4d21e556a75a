"""What the 3D scene shows of a flight at an instant."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from relform_analysis.flight.tracking_errors import yaw_of
from relform_bringup.scene.path_ahead import PathAhead
from relform_core.arrays import Array
from relform_core.units import NANOSECONDS_PER_SECOND
from relform_live.scene import colours
from relform_live.scene.colours import Colours
from relform_live.scene.flight_data import FlightData
from relform_live.scene.history import History
from relform_live.scene.track import Track, turned
from relform_live.scene.trail import Trail

AHEAD_POINTS = 60
AHEAD_SPACING_NS = NANOSECONDS_PER_SECOND // 10
AHEAD_EVERY = 5
"""Control steps after which the path ahead is looked up again."""


@dataclass(frozen=True, eq=False)
class Poses:
    """Poses of all vehicles in team order, in {n}."""

    p_NB_N: Array
    """[m], shape (vehicle, 3)."""
    wxyz_NB: Array
    """Quaternions with the real part first, shape (vehicle, 4)."""


@dataclass(frozen=True, eq=False)
class Links:
    """Lines between the vehicles that may see each other."""

    segments: Array
    """Their ends in {n} [m], shape (link, 2, 3)."""
    colours: Colours
    """Shape (link, 3)."""


@dataclass(frozen=True, eq=False)
class Picture:
    """The scene at one instant; None: not known yet."""

    stamp_ns: int
    truth: Poses | None
    estimate: Poses | None
    targets: Array | None
    """Where the reference wants the vehicles, in team order, in {n} [m], shape (vehicle, 3)."""
    links: Links | None
    ahead: Array
    """The path of the leader's reference, as far as it is known, in {n} [m], shape (AHEAD_POINTS, 3)."""


class Stage:
    """Makes pictures of a flight, and keeps the trails of the vehicles and the course of the errors."""

    def __init__(self, data: FlightData) -> None:
        team = data.config.team
        self._data = data
        self.vehicles = team.vehicles
        self.colours = colours.of_vehicles(len(self.vehicles))
        """Shape (vehicle, 3)."""
        self.trails = {vehicle: Trail() for vehicle in self.vehicles}
        self.history = History(2)
        """Mean formation error and the leader's distance from its reference [m], both true."""
        targets_of = data.config.targets_of
        self.edges = tuple(
            (a, b) for i, a in enumerate(self.vehicles) for b in self.vehicles[i + 1 :] if b in targets_of[a]
        )
        """The pairs of vehicles that may see each other."""
        self._shown_ns = -1
        self._path = PathAhead(data.config)
        self._ahead = np.zeros((AHEAD_POINTS, 3))
        self._ahead_step = -AHEAD_EVERY

    def picture(self, stamp_ns: int) -> Picture:
        """The scene at an instant; see ``advance``."""
        truth = _poses(self._data.truths, stamp_ns)
        self.advance(stamp_ns)
        links = None
        if truth is not None:
            place = dict(zip(self.vehicles, truth.p_NB_N, strict=True))
            segments = np.array([(place[a], place[b]) for a, b in self.edges]).reshape(-1, 2, 3)
            links = Links(segments, self._link_colours())
        return Picture(
            stamp_ns,
            truth,
            _poses(self._data.estimates, stamp_ns),
            self._targets(stamp_ns),
            links,
            self._path_ahead(),
        )

    def clear(self) -> None:
        """Begin trails and course again."""
        self.history = History(2)
        for trail in self.trails.values():
            trail.clear()
        self._shown_ns = -1

    def advance(self, stamp_ns: int) -> None:
        """Let trails and course grow up to an instant, or begin again if it is earlier than before."""
        if stamp_ns < self._shown_ns:
            self.clear()
        for vehicle, track in self._data.truths.items():
            for pose in track.between(self._shown_ns, stamp_ns):
                self.trails[vehicle].add(pose.stamp_ns, pose.p_NB_N)
        errors, leader = self._data.formation_errors(), self._data.leader_error()
        if errors and leader is not None:
            self.history.add(stamp_ns, float(np.mean(list(errors.values()))), leader)
        self._shown_ns = stamp_ns

    def _link_colours(self) -> Colours:
        errors = self._data.formation_errors()
        sees = self._data.sees
        worst = [
            max(errors.get((a, b), np.nan), errors.get((b, a), np.nan))
            if sees(a, b) or sees(b, a)
            else np.nan
            for a, b in self.edges
        ]
        return colours.of_errors(np.array(worst, dtype=np.float64))

    def _path_ahead(self) -> Array:
        """From the leader's reference on; all points are the reference where nothing is known to be ahead."""
        if (reference := self._data.reference) is None:
            return self._ahead
        if not 0 <= reference.step - self._ahead_step < AHEAD_EVERY:
            self._ahead_step = reference.step
            poses = self._path.after(reference.step, reference.value, AHEAD_SPACING_NS, AHEAD_POINTS)
            places = [pose.p_NB_N for _, pose in poses] or [reference.value.p_NB_N]
            places += [places[-1]] * (AHEAD_POINTS - len(places))
            self._ahead = np.array(places)
        return self._ahead

    def _targets(self, stamp_ns: int) -> Array | None:
        """The leader's reference, and the places of the formation around the leader as it flies."""
        leader = self._data.truths[self.vehicles[0]]
        if self._data.reference is None or not leader:
            return None
        reference, pose = self._data.reference.value, leader.at(stamp_ns)
        yaw = float(yaw_of(pose.q_NB))
        places = [self._data.leader_reference.at(stamp_ns).p_NB_N]
        for follower in self.vehicles[1:]:
            place = reference.formation[self.vehicles[0], follower]
            places.append(pose.p_NB_N + turned(yaw, place))
        return np.array(places)


def _poses(tracks: Mapping[str, Track], stamp_ns: int) -> Poses | None:
    if not all(tracks.values()):
        return None
    poses = [track.at(stamp_ns) for track in tracks.values()]
    return Poses(
        np.array([pose.p_NB_N for pose in poses]), np.array([np.roll(pose.q_NB, 1) for pose in poses])
    )
