"""The studio shows a message in Spanish by its template and values; `tools/lint` keeps the catalogue complete."""

from __future__ import annotations

import numpy as np
import pytest

from leafcut.errors import DataError, OptionError, PlanError, ReadError, SendError, name_suggestion
from leafcut.files.schemas import MACHINE, check_schema
from leafcut.geometry.polyline import Polyline
from leafcut.message import Message
from leafcut.model.contour import Contour
from leafcut.model.difference import Difference
from leafcut.model.issue import Issue
from leafcut.model.part import Part
from leafcut.processes.contours import prepare_sheet
from leafcut.studio.wording import words

ES, EN = words("es"), words("en")


@pytest.mark.parametrize(
    ("message", "spanish"),
    [
        (ReadError("plate.dxf", "the file is empty"), "plate.dxf: el archivo está vacío"),
        (
            OptionError("unknown machine '{}'{}", "foo", name_suggestion("foo", ["fo"])),
            "máquina desconocida 'foo'; ¿quiso decir 'fo'?",
        ),
        (
            Difference(
                Message("missing slot"), 0, 7, Message("{} is missing", Message("the slot from {} to {}", "A", "B"))
            ),
            "falta una ranura: la ranura de A a B ya no está (línea 7)",
        ),
        (Issue("L446", Message("reading"), Message("line {}", 5)), "L446 leyendo (línea 5)"),
        (SendError("give --thickness"), "give “Espesor”"),
    ],
)
def test_a_message_is_shown_in_spanish_by_its_template(message: object, spanish: str) -> None:
    assert ES.translate_for_page(Message("{}", message)) == spanish
    assert EN.translate(Message("{}", message)) == str(message)


def test_the_parts_of_a_composed_message_are_translated() -> None:
    line = Contour(Polyline(np.array([(0.0, 0.0, 0.0), (5.0, 0.0, 0.0)])), layer="A")
    with pytest.raises(PlanError) as refused:
        prepare_sheet(Part("plate", contours=(line,)))
    assert "el extremo más cercano" in ES.translate_for_page(str(refused.value))
    with pytest.raises(DataError) as newer:
        check_schema(MACHINE, 99, "mill.toml")
    assert "perfil de máquina" in ES.translate_for_page(str(newer.value))


def test_values_are_translated_only_if_they_are_messages() -> None:
    assert ES.translate_for_page(Message("{}: {}", "reading", Message("reading"))) == "reading: leyendo"
    assert ES.translate_for_page(Message("{} is missing", "reading")) == "reading ya no está"


@pytest.mark.parametrize("text", ["reading", "the file is empty", "part 7", "[MSG:Hold]", ""])
def test_a_text_that_is_no_message_is_unchanged(text: str) -> None:
    """For example the name of a file or of a part, or an answer of a controller."""
    assert ES.translate_for_page(text) == EN.translate_for_page(text) == text


def test_a_template_without_a_translation_stays_english_but_its_values_do_not() -> None:
    assert ES.translate_for_page(Message("zzz {} zzz", Message("reading"))) == "zzz leyendo zzz"


def test_gaps_may_have_another_order_in_spanish() -> None:
    spanish = {"{} of {}": "{1}: {0}", "{{{}}}": "<{}>"}
    es = type(ES)("es", {}, {}, spanish)
    assert es.translate_for_page(Message("{} of {}", 1, 2)) == "2: 1"
    assert es.translate_for_page(Message("{{{}}}", 1)) == "<1>"
