"""The modes of a vehicle: which one follows, by what its controller asks for and by what happens to it.

This is the one table of transitions; docs/architecture.md draws it.
"""

from collections.abc import Mapping
from enum import Enum

from relform_core.flight_modes import Request, VehicleMode


class Happening(Enum):
    """What changes a mode without a request."""

    UP = "it has reached the height of take-off"
    DOWN = "it is on the ground"
    NO_PLAN = "no command came, and the plan of the last one is over"
    SILENT = "no command came for too long"
    WEAK = "its thrust is too weak to fly on"


_M, _R, _H = VehicleMode, Request, Happening

REQUESTED: Mapping[VehicleMode, Mapping[Request, VehicleMode]] = {
    _M.IDLE: {
        _R.REST: _M.IDLE,
        _R.LAND: _M.IDLE,
        _R.ARM: _M.ARMED,
        _R.TAKE_OFF: _M.ARMED,
        _R.STOP: _M.STOPPED,
    },
    _M.ARMED: {
        _R.ARM: _M.ARMED,
        _R.REST: _M.IDLE,
        _R.LAND: _M.IDLE,
        _R.TAKE_OFF: _M.TAKING_OFF,
        _R.STOP: _M.STOPPED,
    },
    _M.TAKING_OFF: {
        _R.TAKE_OFF: _M.TAKING_OFF,
        _R.HOVER: _M.HOVERING,
        _R.LAND: _M.LANDING,
        _R.STOP: _M.STOPPED,
    },
    _M.HOVERING: {
        _R.TAKE_OFF: _M.HOVERING,
        _R.HOVER: _M.HOVERING,
        _R.FLY: _M.FLYING,
        _R.LAND: _M.LANDING,
        _R.STOP: _M.STOPPED,
    },
    _M.FLYING: {_R.FLY: _M.FLYING, _R.HOVER: _M.HOVERING, _R.LAND: _M.LANDING, _R.STOP: _M.STOPPED},
    _M.LANDING: {_R.LAND: _M.LANDING, _R.HOVER: _M.HOVERING, _R.STOP: _M.STOPPED},
    _M.FAILSAFE: {_R.FLY: _M.FLYING, _R.HOVER: _M.HOVERING, _R.LAND: _M.LANDING, _R.STOP: _M.STOPPED},
    _M.STOPPED: {_R.STOP: _M.STOPPED},
}
"""By mode, the mode that follows each request. A request that a mode does not list changes nothing."""

HAPPENED: Mapping[VehicleMode, Mapping[Happening, VehicleMode]] = {
    _M.TAKING_OFF: {_H.SILENT: _M.FAILSAFE, _H.UP: _M.HOVERING},
    _M.HOVERING: {_H.WEAK: _M.FAILSAFE, _H.SILENT: _M.FAILSAFE, _H.NO_PLAN: _M.FAILSAFE},
    _M.FLYING: {_H.WEAK: _M.FAILSAFE, _H.NO_PLAN: _M.FAILSAFE},
    _M.LANDING: {_H.DOWN: _M.IDLE},
    _M.FAILSAFE: {_H.DOWN: _M.STOPPED},
}
"""By mode, the mode that follows each happening, which matters only where it is listed."""


class ModeMachine:
    """The mode of one vehicle, and why it is in it.

    Args:
        mode: the first one.
    """

    def __init__(self, mode: VehicleMode) -> None:
        self.mode = mode
        self.reason = ""
        """Why the vehicle is in its mode, or why it refuses the present request; for people."""
        self._entered_because = ""

    def step(self, request: Request | None, happenings: frozenset[Happening]) -> bool:
        """Change the mode, at most once for what happens, and then once for a request.

        Args:
            request: in force; None: none is.
            happenings: all that are true now.
        Returns:
            Whether the mode allows the request.
        """
        for happening, following in HAPPENED.get(self.mode, {}).items():
            if happening in happenings:
                self._enter(following, happening.value)
                break
        if request is not None and request not in REQUESTED[self.mode]:
            self.reason = f"refuses to {request} while {self.mode}"
            return False
        if request is not None:
            self._enter(REQUESTED[self.mode][request], f"asked to {request}")
        self.reason = self._entered_because
        return True

    def _enter(self, mode: VehicleMode, reason: str) -> None:
        if mode is not self.mode:
            self.mode = mode
            self._entered_because = reason
