"""Buttons and fields by which the user asks something of the team; refusals appear in red."""

import math
from collections.abc import Mapping
from typing import Any, Literal

import viser
from pydantic import TypeAdapter

from relform_core.formations_config import Shape, places_by_follower
from relform_core.scenario_config import ScenarioConfig
from relform_core.schema import Vector3
from relform_live.requests import Answer, ChangeFormation, Command, GoTo, Offer, Request, Submit
from relform_live.viewer.layout import Place

SHAPES = ("line", "column", "v", "circle", "grid", "sphere")
SPACING_M = 1.2
PLACES_MAX = 8
"""Followers up to which the panel has a field for the place of each."""
SHOWN_S = 8.0
"""How long an answer is shown."""
COLOURS: Mapping[str, Literal["red", "orange", "teal"]] = {
    "emergency stop": "red",
    "emergency land": "orange",
    "take off": "teal",
    "start": "teal",
}
"""Of buttons, by their title."""

_SHAPE: TypeAdapter[Shape] = TypeAdapter(Shape)


class Controls:
    """The part of the panel that belongs to one flight; it shows what the nodes of the flight offer."""

    def __init__(self, server: viser.ViserServer, config: ScenarioConfig, submit: Submit) -> None:
        self._gui = gui = server.gui
        self._config = config
        self._submit = submit
        self._offer = Offer()
        self._commands = gui.add_folder("Commands", order=Place.COMMANDS, visible=False)
        self._formation = gui.add_folder("Formation", order=Place.FORMATION, visible=False)
        self._go_to = gui.add_folder("Go to", order=Place.GO_TO, visible=False, expand_by_default=False)
        self._buttons: dict[Command, viser.GuiButtonHandle] = {}
        with self._formation:
            self._add_formations()
        with self._go_to:
            self._add_go_to()

    def remove(self) -> None:
        """Take the controls out of the panel."""
        for folder in (self._commands, self._formation, self._go_to):
            folder.remove()

    def offer(self, offer: Offer) -> None:
        """Show what is offered, and nothing else."""
        if offer == self._offer:
            return
        self._offer = offer
        self._commands.visible = bool(offer.commands)
        self._formation.visible, self._go_to.visible = offer.formation, offer.go_to
        with self._commands:
            for order, command in enumerate(offer.commands):
                if command not in self._buttons:
                    self._buttons[command] = self._add_command(command, order)
        for command, button in self._buttons.items():
            button.visible = command in offer.commands

    def _add_command(self, command: Command, order: int) -> viser.GuiButtonHandle:
        button = self._gui.add_button(command.title, color=COLOURS.get(command.title), order=order)
        button.on_click(lambda event: self._ask(command, event.client))
        return button

    def _add_formations(self) -> None:
        gui = self._gui
        named = gui.add_dropdown("named", tuple(self._config.formations))
        fly_named = gui.add_button("fly this formation")
        shape = gui.add_dropdown("shape", SHAPES, initial_value="v")
        spacing = gui.add_number("spacing (m)", SPACING_M, min=0.1, max=100.0, step=0.1)
        fly_shape = gui.add_button("fly this shape")
        fly_named.on_click(
            lambda event: self._set_formation(self._config.formations[named.value], event.client)
        )
        fly_shape.on_click(
            lambda event: self._set_formation(self._shape(shape.value, spacing.value), event.client)
        )
        self._fields: dict[str, viser.GuiVector3Handle] = {}
        if len(self._config.team.followers) <= PLACES_MAX:
            with gui.add_folder("places from the leader: ahead, left, up (m)", expand_by_default=False):
                self._add_places()

    def _add_places(self) -> None:
        first = self._config.formations[self._config.phases[0].formation]
        for follower in self._config.team.followers:
            self._fields[follower] = self._gui.add_vector3(follower, first[follower], step=0.1)
        fly = self._gui.add_button("fly these places")
        fly.on_click(
            lambda event: self._set_formation(
                {follower: field.value for follower, field in self._fields.items()}, event.client
            )
        )

    def _shape(self, kind: str, spacing: float) -> Mapping[str, Vector3]:
        shape = _SHAPE.validate_python({"kind": kind, "spacing_m": float(spacing)})
        return places_by_follower(shape, self._config.team.followers)

    def _set_formation(self, places: Mapping[str, Vector3], client: viser.ClientHandle | None) -> None:
        for follower, field in self._fields.items():
            field.value = places[follower]  # type: ignore[misc]  # viser defines the setter apart from the getter
        self._ask(ChangeFormation(places), client)

    def _add_go_to(self) -> None:
        gui = self._gui
        place = gui.add_vector3("x, y, z (m)", self._config.start.position, step=0.5)
        turn = gui.add_checkbox("turn", False)
        yaw = gui.add_number("yaw (deg)", 0.0, min=-180.0, max=180.0, step=5.0)
        go = gui.add_button("go to this place")
        go.on_click(
            lambda event: self._ask(
                GoTo(place.value, math.radians(yaw.value) if turn.value else None), event.client
            )
        )

    def _ask(self, request: Request, client: viser.ClientHandle | None) -> None:
        def show(answer: Answer) -> None:
            if client is not None:
                title = f"{request.title}: {'accepted' if answer.accepted else 'refused'}"
                colour: Any = "teal" if answer.accepted else "red"
                client.add_notification(title, answer.text, color=colour, auto_close_seconds=SHOWN_S)

        self._submit(request, show)
