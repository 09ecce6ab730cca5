"""Available combinations in a cut chart: processes, materials, thicknesses and currents."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from leafcut.read.cutchart import SAME_THICKNESS, ChartRow, is_kind_of_process, material_name


@dataclass(frozen=True)
class ChartChoices:
    """The values that are still available in a cut chart after earlier choices. Thicknesses are in mm and currents in
    A, in ascending order.
    """

    processes: tuple[str, ...]
    materials: tuple[str, ...]
    thicknesses: tuple[float, ...]
    amps: tuple[float, ...]
    nozzles: tuple[str, ...]


def choices_of(
    rows: Iterable[ChartRow],
    process: str = "",
    material: str = "",
    thickness: float | None = None,
    amps: float | None = None,
) -> ChartChoices:
    """Return the choices that a cut chart offers. An empty argument matches all rows.

    Each kind of choice is filtered by the choices before it, and the current also by the thickness. A choice without a
    matching row is ignored, so that the user still sees the alternatives.
    """
    rows = list(rows)
    cut = [row for row in rows if not process or is_kind_of_process(row.process, process)] or rows
    made_of = [row for row in cut if not material or row.material == material_name(material)]
    with_amps = [row for row in made_of if amps is None or row.amps == amps] or made_of
    near = [row for row in made_of if thickness is None or _has_thickness(row, thickness)] or made_of
    return ChartChoices(
        tuple(sorted({row.process for row in rows})),
        tuple(sorted({row.material for row in cut})),
        tuple(sorted({row.thickness for row in with_amps})),
        tuple(sorted({row.amps for row in near if row.amps is not None})),
        tuple(dict.fromkeys(row.rates.nozzle for row in near if row.rates.nozzle)),
    )


def _has_thickness(row: ChartRow, thickness: float) -> bool:
    return abs(row.thickness - thickness) <= SAME_THICKNESS * thickness
