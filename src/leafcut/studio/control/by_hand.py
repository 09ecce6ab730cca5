"""Manual control of the machine: position, zeros, jog pad and probe."""

from __future__ import annotations

from typing import TYPE_CHECKING

from nicegui.elements.mixins.text_element import TextElement

from leafcut.studio.control.fields import JogPad, MachineForm, enable
from leafcut.studio.control.state import MachineState, MachineTask
from leafcut.studio.page.elements import box, button, text
from leafcut.studio.page.page_state import View
from leafcut.units import to_fixed

if TYPE_CHECKING:
    from leafcut.studio.control.panel import MachinePanel

_AXES = "XYZ"
#: Jog distances, mm.
STEPS = ("0.1", "1", "10", "100")


class ByHandPanel:
    """The cards for position, jog and probe."""

    def __init__(self, view: View, panel: MachinePanel) -> None:
        self.view, self.panel, self.link = view, panel, panel.link
        self.step = "1"
        self._position()
        self._jog()
        self._probe()

    def _position(self) -> None:
        w = self.view.words
        self.work: list[TextElement] = []
        self.machine: list[TextElement] = []
        self.zeros: list[TextElement] = []
        with box("section", "card machine-card", aria_label=w("machine.position")):
            text("h2", w("machine.position"))
            with box("table", "place", aria_label=w("machine.position")):
                with box("thead"), box("tr"):
                    text("td", "")
                    text("th", w("machine.work"), "n", scope="col")
                    text("th", w("machine.machine"), "n", scope="col")
                    text("td", "")
                with box("tbody"):
                    for axis in _AXES:
                        with box("tr"):
                            text("th", axis, scope="row")
                            self.work.append(text("td", "–", "n large", id=f"machine-work-{axis.lower()}"))
                            self.machine.append(text("td", "–", "n quiet", id=f"machine-place-{axis.lower()}"))
                            with box("td", "n"):
                                self._zero(w("machine.zero_axis", axis=axis), axis)
            with box("div", "ends"):
                self._zero(w("machine.zero_xy"), "XY")
                self._zero(w("machine.zero_all"), "XYZ")
            self.unsure = text("p", w("machine.unsure"), "warn small")

    def _zero(self, words: str, axes: str) -> None:
        self.zeros.append(button(words, lambda: self.panel.ask(self.link.zero, axes), "small"))

    def _jog(self) -> None:
        w = self.view.words
        with box("section", "card machine-card", aria_label=w("machine.jog")):
            text("h2", w("machine.jog"))
            with box("div", "steps", role="group", aria_label=w("machine.step")):
                self.steps = {
                    step: button(
                        step,
                        lambda step=step: self._choose(step),
                        "tab small",
                        aria_pressed="true" if step == self.step else "false",
                        aria_label=f"{step} mm",
                    )
                    for step in STEPS
                }
                text("span", "mm", "quiet small")
            self.pad = JogPad(w("machine.jog"), w("machine.jog_hint"), self._move, self._let_go)
            self.jog_fields = MachineForm(w)
            self.jog_fields.add("jog-feed", w("machine.feed"), "1000", unit="mm/min")
            text("p", w("machine.jog_hint"), "quiet small")

    def _choose(self, step: str) -> None:
        self.step = step
        for size, step_button in self.steps.items():
            step_button.props(f"aria-pressed={'true' if size == step else 'false'}")

    async def _move(self, axis: str, sign: int, is_held: bool) -> None:
        if axis not in _AXES:
            return
        distances = {axis: (1 if sign > 0 else -1) * float(self.step)}
        await self.panel.ask(lambda key: self.link.jog(key, distances, self.jog_feed(), held=is_held))

    def jog_feed(self) -> float:
        """Return the jog feed, mm/min."""
        return self.jog_fields.number("jog-feed")

    async def _let_go(self) -> None:
        await self.panel.ask(self.link.cancel)

    def _probe(self) -> None:
        w = self.view.words
        with box("details", "card machine-card") as place:
            text("summary", w("machine.probe"))
            with box("div", "fields"):
                text("p", w("machine.probe_hint"), "quiet small")
                self.probe_fields = MachineForm(w)
                self.probe_fields.add("plate", w("machine.plate"), "1.5", unit="mm")
                self.probe_fields.add("probe-feed", w("machine.feed"), "50", unit="mm/min")
                self.probe_fields.add("probe-limit", w("machine.limit"), "15", unit="mm")
                with box("div", "ends"):
                    self.probe = button(w("machine.probe_now"), self._probe_now, "")
        self.probe_place = place

    async def _probe_now(self) -> None:
        number = self.probe_fields.number
        await self.panel.ask(
            lambda key: self.link.probe(key, number("plate"), number("probe-feed"), number("probe-limit"))
        )

    def show(self, state: MachineState, commands: bool) -> None:
        """Update the position, and enable the actions that are possible now."""
        for places, place in ((self.work, state.work), (self.machine, state.machine)):
            for axis, cell in enumerate(places):
                words = "–" if place is None or not state.open else to_fixed(place[axis], 3)
                if cell.text != words:
                    cell.set_text(words)
        asked = state.question is not None
        free = commands and (asked or state.doing in (MachineTask.NOTHING, MachineTask.ASKING))
        at_rest = free and state.status == "Idle"
        for zero_button in self.zeros:
            enable(zero_button, at_rest)
        enable(self.probe, at_rest)
        self.pad.switch(free and state.status in ("Idle", "Jog"))
        self.unsure.set_visibility(state.open and state.unsure)
