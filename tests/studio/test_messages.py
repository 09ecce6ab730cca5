"""Messages are translated by templates; `tools/lint` compares the catalogue with the source."""

from __future__ import annotations

import pytest

from leafcut.message import Message
from leafcut.studio.messages import Messages
from leafcut.studio.wording import words

ES = words("es")


@pytest.mark.parametrize(
    ("english", "spanish"),
    [
        ("plate.dxf: the file is empty", "plate.dxf: el archivo está vacío"),
        ("--thickness: division by zero in '1/0in'", "“Espesor”: división entre cero en '1/0in'"),
        ("unknown machine 'foo'; did you mean 'fo'?", "máquina desconocida 'foo'; ¿quiso decir 'fo'?"),
        ("a line that nobody knows", "a line that nobody knows"),
        ("cut.nc:12: G81: a cycle with no repeats", "cut.nc:12: G81: un ciclo sin repeticiones"),
        (
            "pierce height: the torch is lit at Z1.5, not at the pierce height, Z3.8 (line 12)",
            "altura de perforación: la antorcha se enciende en Z1.5, no en la altura de perforación, Z3.8 (línea 12)",
        ),
        (
            "changed hole: at X1.000 Y2.000: peck 3 became 4; tool 1 became 2 (original line 5, line 7)",
            "agujero cambiado: en X1.000 Y2.000: picoteo 3 pasó a 4; herramienta 1 pasó a 2 "
            "(línea original 5, línea 7)",
        ),
        ("l.toml: 'depth' is wrong: '3mn' is not a number", "l.toml: 'depth' no es válido: '3mn' no es un número"),
        ("plate.dxf: nothing is left to cut or mark", "plate.dxf: no queda nada que cortar ni marcar"),
        ("stopped", "detenido"),
        (
            "line 40 'G0 Z0.5 M7': error 20: the controller does not support this word; the machine is standing still; "
            "its position is X1.000 Y2.000 Z-0.500 (machine coordinates); it was in line 44, hole 11; "
            "lines up to 60 of 287 were accepted; resume with --from-hole 11",
            "línea 40 'G0 Z0.5 M7': error 20: el control no tiene esta palabra; la máquina está parada; "
            "está en X1.000 Y2.000 Z-0.500 (coordenadas de máquina); estaba en la línea 44, agujero 11; "
            "se aceptaron las líneas hasta la 60 de 287; siga con “Desde el agujero” 11",
        ),
        (
            "line 12 'G1 Z-1': alarm 1: a limit switch was reached: the machine stopped at once and lost its "
            "position; home it",
            "línea 12 'G1 Z-1': alarma 1: se alcanzó un final de carrera: la máquina se paró en seco y su "
            "posición se perdió; haga el recorrido de referencia",
        ),
        ("12 holes outside the selected diameters left out", "se omiten por su diámetro: 12 agujeros"),
        ("", ""),
    ],
)
def test_a_message_is_translated_with_the_labels_of_the_form(english: str, spanish: str) -> None:
    assert ES.plain(english) == spanish
    assert words("en").plain("the file is empty") == "the file is empty"


@pytest.mark.parametrize("name", ["part 7.dxf", "holder.nc", "dialect x.toml"])
def test_the_name_of_a_file_is_not_translated(name: str) -> None:
    assert ES.plain(Message("{}: {}", name, "the file is empty")) == f"{name}: el archivo está vacío"


def test_values_of_a_message_are_translated_only_if_they_are_messages_too() -> None:
    spanish = Messages({"{} '{}' is no {}": "{2} no es {0} '{1}'", "a hole": "un agujero"})
    message = Message("{} '{}' is no {}", "x", "a hole", Message("a hole"))
    assert message == "x 'a hole' is no a hole"
    assert spanish.translate(message) == "un agujero no es x 'a hole'"


def test_a_message_with_an_unknown_template_is_matched_as_a_whole() -> None:
    spanish = Messages(
        {"{}: {}": "{}: {}", "no room for {}": "no hay sitio para {}", "the {} holes": "los {} agujeros"}
    )
    assert (
        spanish.translate(Message("no room for {}", Message("the {} {}", 3, "holes")))
        == "no hay sitio para los 3 agujeros"
    )
    assert spanish.translate(Message("no {} for {}", "room", "x")) == "no hay sitio para x"


def test_quoted_input_is_not_translated() -> None:
    made = Messages({"'{}' is no {}": "'{}' no es {}", "a hole": "un agujero"})
    assert made.translate("'a thing' is no a hole") == "'a thing' no es un agujero"
    assert made.translate("'(((((' is no ))))))") == "'(((((' no es ))))))"
