"""The service by which somebody asks a team for another formation."""

from collections.abc import Callable

from rclpy.node import Node

from relform_controller.live_values import LiveControllerValues, by_formation_key
from relform_controller.reference.formation_request import FormationRequest, answer, assigned
from relform_controller.team_controller import TeamController
from relform_core.errors import ConfigError, MessageError
from relform_core.scenario_config import ScenarioConfig
from relform_msgs.srv import SetFormation
from relform_ros.events import formation_from_msgs
from relform_ros.live_parameters import LiveParameters


class FormationService:
    """Turns a request into places, which then go the way of the parameters ``formation.<follower>``.

    Args:
        node: of the controller.
        config: the scenario.
        controller: flies the formation.
        parameters: of the node.
        next_step: gives the control step from which on a request applies.
    """

    def __init__(
        self,
        node: Node,
        config: ScenarioConfig,
        controller: TeamController,
        parameters: LiveParameters[LiveControllerValues],
        next_step: Callable[[], int],
    ) -> None:
        self._config = config
        self._controller = controller
        self._parameters = parameters
        self._next_step = next_step
        node.create_service(SetFormation, "set_formation", self._on_request)

    def _on_request(
        self, request: SetFormation.Request, response: SetFormation.Response
    ) -> SetFormation.Response:
        try:
            response.message = self._set(request)
            response.success = True
        except (ConfigError, MessageError) as error:
            response.message = str(error)
            response.success = False
        return response

    def _set(self, request: SetFormation.Request) -> str:
        places = formation_from_msgs(request.formation, self._config.team) if request.formation else None
        formation = FormationRequest(request.name, request.shape, places).formation(self._config)
        if request.assign:
            present = self._controller.way_to(self._controller.formation).start
            formation = assigned(formation, present[1:])
        self._parameters.change(by_formation_key(formation))
        way = self._controller.way_to(formation)
        return answer(self._next_step(), way, formation if request.assign else None)
