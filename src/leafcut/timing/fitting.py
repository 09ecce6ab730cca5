"""A machine fitted to a stop-watch: how its profile has to change so that measured programs take the time they took.

Two of the model's numbers are seldom known, and decide most of what is not feed: the accelerations (one factor for all
axes here) and the corner value (`Machine.corner_deviation`; LinuxCNC's corners have none). Both are positive, so their
logarithms are sought, by least squares of the weighted differences of seconds, with steps of Levenberg and Marquardt.
Source: J. J. Moré, "The Levenberg-Marquardt algorithm: implementation and theory" (1978); standard errors from the
inverse of JᵀJ: G. A. F. Seber and C. J. Wild, "Nonlinear regression" (1989), section 2.1.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from leafcut.geometry.arrays import Floats
from leafcut.model.machine import Machine
from leafcut.model.toolpath import Toolpath
from leafcut.timing.toolpath import corner_style, measure

#: Error of a stopwatch, s, and of the model, as a fraction of the time. Sources: a hand differs from electronic timing
#: by about 0.2 s (R. K. Hetzler and others, J. Strength Cond. Res. 22, 2008); the model: docs/results/machine_time.md.
HAND_S, MODEL_SHARE = 0.3, 0.005
#: The accelerations may be so many times those of the profile, or that part of them.
_WIDEST = 20.0
#: Between which the corner value is sought, mm.
_CORNERS = (1e-4, 2.0)
#: Standard errors of logarithms up to which a number counts as told by the programs: 95 times of 100 the accelerations
#: are then within a third, and the corner value, of which profiles know the power of ten at best, within a factor of 2.
_KNOWN = {"acceleration": 0.15, "corner": 0.35}
#: Step for derivatives, of logarithms: far above the rounding of the model, far below what changes it.
_STEP = 0.01
_MOST_STEPS, _SMALLEST = 40, 1e-6
#: Slopes below this, in weighted seconds, are none.
_NO_EFFECT = 1e-8


@dataclass(frozen=True)
class Measured:
    """A program as it runs, and the seconds that it took."""

    name: str
    path: Toolpath
    seconds: float


@dataclass(frozen=True)
class Fitted:
    """What was fitted, and what it is worth.

    Attributes
    ----------
    machine
        With the values that were found; the profile's own where the programs do not tell one.
    before, after
        The model's seconds of each program, float64[n].
    acceleration, corner
        The factor on the accelerations, and the corner value, mm; None where it was not fitted.
    error
        By name (acceleration, corner) the relative standard error of what was sought; inf where it has no effect.
    condition
        Of the weighted Jacobian of both, by singular values; inf where one has no effect, 1 with one number alone.
    held
        Why a number was not fitted, in words, by name.
    """

    machine: Machine
    before: Floats
    after: Floats
    acceleration: float | None
    corner: float | None
    error: dict[str, float]
    condition: float
    held: dict[str, str]


def model_seconds(programs: Sequence[Measured], machine: Machine) -> Floats:
    """Return the model's seconds of programs, float64[n], each from X0 Y0 on."""
    return np.array([measure(one.path, machine, start=(0.0, 0.0)).time_s for one in programs])


def fit(programs: Sequence[Measured], machine: Machine) -> Fitted:
    """Return the machine with accelerations and corner value that come nearest to what was measured.

    A number that the programs do not tell apart from the other, or that has no effect on them, keeps its value: the
    corner value first. One program alone, or none that an acceleration makes longer, fits nothing.
    """
    seconds = np.array([one.seconds for one in programs])
    weight = 1.0 / np.hypot(HAND_S, MODEL_SHARE * seconds)
    before = model_seconds(programs, machine)
    sought = ["acceleration"] if corner_style(machine) == "linuxcnc" else ["acceleration", "corner"]
    held: dict[str, str] = {}
    if "corner" not in sought:
        held["corner"] = "LinuxCNC's corners go by the program's own G64 P, and have no value of the machine"
    if len(programs) < 2:
        held |= dict.fromkeys(sought, "one program tells nothing apart; measure at least two")
        return Fitted(machine, before, before, None, None, {}, math.nan, held)
    errors: dict[str, float] = {}
    condition = math.nan
    while sought:
        found, jacobian = _least_squares(programs, machine, sought, seconds, weight)
        changed = _changed(machine, sought, found)
        after = model_seconds(programs, changed)
        now, condition_now = _errors(jacobian, sought, (after - seconds) * weight)
        condition = condition_now if not errors else condition
        errors |= now
        unknown = [name for name in sought if now[name] > _KNOWN[name]]
        beyond = _at_end(found, sought)
        if not unknown and not beyond:
            values = dict(zip(sought, np.exp(found).tolist(), strict=True))
            told = (values.get("acceleration"), values.get("corner"))
            return Fitted(changed, before, after, *told, errors, condition, held)
        gone = max(unknown or beyond)  # the corner value first: it is the one that matters less
        held[gone] = _why(now[gone], gone)
        sought = [name for name in sought if name != gone]
    return Fitted(machine, before, before, None, None, errors, condition, held)


def _why(error: float, name: str) -> str:
    if not math.isfinite(error):
        return "the programs do not tell it from the rest, or it changes the time of none of them"
    if error > 1.0:
        return "the programs do not tell it, or their times contradict each other"
    if error > _KNOWN[name]:
        return f"the programs do not tell it: its standard error is {100 * error:.0f} %"
    return f"the best {name} lies beyond what machines have; check what was measured"


def _start(machine: Machine, sought: Sequence[str]) -> Floats:
    """Return the logarithms of what the profile has, float64[p]."""
    values = {"acceleration": 1.0, "corner": machine.corner_deviation}
    return np.log([values[name] for name in sought])


def _ends(sought: Sequence[str]) -> tuple[Floats, Floats]:
    lowest = {"acceleration": 1.0 / _WIDEST, "corner": _CORNERS[0]}
    highest = {"acceleration": _WIDEST, "corner": _CORNERS[1]}
    return np.log([lowest[name] for name in sought]), np.log([highest[name] for name in sought])


def _at_end(found: Floats, sought: Sequence[str]) -> list[str]:
    """Return the numbers that were only stopped by the end of what is sought."""
    each = zip(sought, found, *_ends(sought), strict=True)
    return [name for name, value, least, most in each if not least + 1e-9 < value < most - 1e-9]


def _changed(machine: Machine, sought: Sequence[str], logs: Floats) -> Machine:
    values = dict(zip(sought, np.exp(logs).tolist(), strict=True))
    factor = values.get("acceleration", 1.0)
    x, y, z = machine.acceleration
    acceleration = (x * factor, y * factor, z * factor)
    return replace(machine, acceleration=acceleration, corner_deviation=values.get("corner", machine.corner_deviation))


def _residuals(
    programs: Sequence[Measured], machine: Machine, sought: Sequence[str], logs: Floats, seconds: Floats, weight: Floats
) -> Floats:
    difference: Floats = (model_seconds(programs, _changed(machine, sought, logs)) - seconds) * weight
    return difference


def _least_squares(
    programs: Sequence[Measured], machine: Machine, sought: Sequence[str], seconds: Floats, weight: Floats
) -> tuple[Floats, Floats]:
    """Return the logarithms that were found, float64[p], and the weighted Jacobian there, float64[n, p]."""
    low, high = _ends(sought)

    def off(logs: Floats) -> Floats:
        return _residuals(programs, machine, sought, logs, seconds, weight)

    def slopes(logs: Floats) -> Floats:
        columns = []
        for k in range(len(logs)):
            step = np.zeros(len(logs))
            step[k] = _STEP
            columns.append((off(logs + step) - off(logs - step)) / (2.0 * _STEP))
        return np.column_stack(columns)

    current = np.clip(_start(machine, sought), low, high)
    residual, damping = off(current), 1e-3
    jacobian = slopes(current)
    for _ in range(_MOST_STEPS):
        normal = jacobian.T @ jacobian
        scale = np.diag(np.maximum(np.diag(normal), 1e-12))
        step = np.linalg.lstsq(normal + damping * scale, -jacobian.T @ residual, rcond=None)[0]
        candidate = np.clip(current + np.clip(step, -1.0, 1.0), low, high)
        tried = off(candidate)
        if tried @ tried < residual @ residual:
            moved = float(np.abs(candidate - current).max())
            current, residual, damping = candidate, tried, max(damping / 10.0, 1e-9)
            jacobian = slopes(current)
            if moved < _SMALLEST:
                break
        else:
            damping *= 10.0
            if damping > 1e9:
                break
    return current, jacobian


def _errors(jacobian: Floats, sought: Sequence[str], residual: Floats) -> tuple[dict[str, float], float]:
    """Return the standard error of each logarithm, and the condition of the Jacobian with its columns made alike.

    The spread of what was measured is the larger of what a hand and the model allow (1 here, by the weights) and of
    what is left over.
    """
    free = len(residual) - len(sought)
    spread = max(1.0, float(residual @ residual) / free if free > 0 else 1.0)
    size = np.sqrt((jacobian * jacobian).sum(axis=0))
    if np.any(size < _NO_EFFECT):
        # The others are judged without what has no effect.
        alone = np.where(size < _NO_EFFECT, math.inf, math.sqrt(spread) / np.maximum(size, _NO_EFFECT))
        return dict(zip(sought, alone.tolist(), strict=True)), math.inf
    singular = np.linalg.svd(jacobian / size, compute_uv=False)
    if singular[-1] < _NO_EFFECT:
        return dict.fromkeys(sought, math.inf), math.inf
    variance = np.diag(np.linalg.inv(jacobian.T @ jacobian)) * spread
    return dict(zip(sought, np.sqrt(variance).tolist(), strict=True)), float(singular[0] / singular[-1])
