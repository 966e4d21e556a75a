"""What a controller watches for beside flying, where the scenario asks for it."""

import dataclasses

from relform_controller.alarms import Alarms
from relform_controller.estimation.estimator import TeamEstimate
from relform_controller.geofence_watch import GeofenceWatch
from relform_controller.ocp.problem import Plan, TeamGeometry
from relform_controller.separation_monitor import SeparationMonitor
from relform_core.measurements import TeamMeasurements
from relform_core.names import SeparationLevel
from relform_core.scenario_config import ScenarioConfig
from relform_core.telemetry import Decision


class Watch:
    """Adds to each decision what was noticed in its step.

    Args:
        config: the scenario; what it does not ask for is not watched.
    """

    def __init__(self, config: ScenarioConfig) -> None:
        vehicles = config.team.vehicles
        self._separation: SeparationMonitor | None = None
        if config.separation is not None:
            self._separation = SeparationMonitor(vehicles, config.separation, config.controller.stage_length)
        self._geofence = None if config.geofence is None else GeofenceWatch(vehicles, config.geofence)
        self._alarms = Alarms()

    def watched(
        self,
        decision: Decision,
        measurements: TeamMeasurements,
        estimate: TeamEstimate,
        planned: TeamGeometry,
        plan: Plan,
    ) -> Decision:
        """The decision with what was noticed.

        Args:
            decision: of this step.
            measurements: that arrived in it.
            estimate: of its instant.
            planned: where the {mi} frames of the plan lie.
            plan: of the decision.
        """
        separation, causes, breach = None, {}, ""
        if self._separation is not None:
            separation = self._separation.update(measurements, estimate.geometry, planned, plan.states)
            if separation.level is SeparationLevel.EMERGENCY:
                causes["separation"] = str(separation)
        if self._geofence is not None and (outside := self._geofence.outside(estimate)):
            causes |= outside
            breach = "; ".join(f"{name} {where}" for name, where in outside.items())
        if not causes and separation is None:
            return decision
        alarms = self._alarms.begin(measurements.arrival_ns, causes)
        return dataclasses.replace(decision, separation=separation, breach=breach, alarms=alarms)
