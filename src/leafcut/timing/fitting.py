"""Fit a machine profile to the measured times of programs.

Apart from the feeds, two parameters determine most of the time, and they are seldom known: the accelerations (here one
factor for all axes) and the corner value (`Machine.corner_deviation`, which LinuxCNC does not have). Both are positive,
so their logarithms are fitted to the times by weighted least squares with the Levenberg–Marquardt method.

Sources: J. J. Moré, "The Levenberg-Marquardt algorithm: implementation and theory" (1978); for standard errors from the
inverse of JᵀJ, G. A. F. Seber and C. J. Wild, "Nonlinear regression" (1989), section 2.1.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from leafcut.geometry.arrays import Floats
from leafcut.model.machine import Machine
from leafcut.model.toolpath import Toolpath
from leafcut.timing.toolpath import corner_style, measure_toolpath

#: Error of a stopwatch, s, and error of the model as a share of the time. Sources: manual and electronic timing differ
#: by about 0.2 s (R. K. Hetzler and others, J. Strength Cond. Res. 22, 2008); for the model,
#: docs/results/machine_time.md.
HAND_S, MODEL_SHARE = 0.3, 0.005
#: Search range of the factor on the accelerations: from 1 / _WIDEST to _WIDEST.
_WIDEST = 20.0
#: Search range of the corner value, mm.
_CORNERS = (1e-4, 2.0)
#: Maximum standard error of the logarithm of a parameter that counts as determined. At 95 % confidence, the
#: accelerations are then known to within a third, and the corner value to within a factor of 2. Profiles usually give
#: only the order of magnitude of the corner value.
_KNOWN = {"acceleration": 0.15, "corner": 0.35}
#: Step of the logarithms for numerical derivatives; large compared with the rounding errors of the model.
_STEP = 0.01
_MOST_STEPS, _SMALLEST = 40, 1e-6
#: Minimum slope of the times, in weighted seconds, for a parameter that affects them.
_NO_EFFECT = 1e-8


@dataclass(frozen=True)
class MeasuredProgram:
    """The toolpath of a program and its measured time."""

    name: str
    path: Toolpath
    seconds: float


@dataclass(frozen=True)
class MachineFit:
    """The result and the quality of a fit.

    Attributes
    ----------
    machine
        The machine with the fitted values; undetermined parameters have the values of the profile.
    before, after
        Time of each program according to the model, before and after the fit, float64[n], s.
    acceleration, corner
        Factor on the accelerations, and corner value, mm; None if not fitted.
    error
        Relative standard error of each parameter (acceleration, corner); infinite if the parameter has no effect.
    condition
        Condition number of the weighted Jacobian: infinite if a parameter has no effect, 1 for a single parameter.
    held
        For each parameter that was not fitted, the reason.
    """

    machine: Machine
    before: Floats
    after: Floats
    acceleration: float | None
    corner: float | None
    error: dict[str, float]
    condition: float
    held: dict[str, str]


def model_seconds(programs: Sequence[MeasuredProgram], machine: Machine) -> Floats:
    """Return the time of each program according to the model, s; each program starts at X0 Y0."""
    return np.array([measure_toolpath(program.path, machine, start=(0.0, 0.0)).time_s for program in programs])


def fit_machine(programs: Sequence[MeasuredProgram], machine: Machine) -> MachineFit:
    """Fit the accelerations and the corner value to the measured times.

    A parameter keeps the value of the profile if the programs do not determine it or it has no effect. If the programs
    do not determine both parameters together, the corner value is not fitted.
    """
    seconds = np.array([program.seconds for program in programs])
    weight = 1.0 / np.hypot(HAND_S, MODEL_SHARE * seconds)
    before = model_seconds(programs, machine)
    parameters = ["acceleration"] if corner_style(machine) == "linuxcnc" else ["acceleration", "corner"]
    held: dict[str, str] = {}
    if "corner" not in parameters:
        held["corner"] = "LinuxCNC's corners go by the program's own G64 P, not by a value of the machine"
    if len(programs) < 2:
        held |= dict.fromkeys(parameters, "one program is not enough; measure at least two")
        return MachineFit(machine, before, before, None, None, {}, math.nan, held)
    errors: dict[str, float] = {}
    condition = math.nan
    while parameters:
        logs, jacobian = _least_squares(programs, machine, parameters, seconds, weight)
        changed = _with_parameters(machine, parameters, logs)
        after = model_seconds(programs, changed)
        step_errors, step_condition = _standard_errors(jacobian, parameters, (after - seconds) * weight)
        condition = step_condition if not errors else condition
        errors |= step_errors
        undetermined = [name for name in parameters if step_errors[name] > _KNOWN[name]]
        out_of_range = _parameters_at_bounds(logs, parameters)
        if not undetermined and not out_of_range:
            values = dict(zip(parameters, np.exp(logs).tolist(), strict=True))
            fitted_values = (values.get("acceleration"), values.get("corner"))
            return MachineFit(changed, before, after, *fitted_values, errors, condition, held)
        dropped = max(undetermined or out_of_range)  # drop the corner value first, because it matters less
        held[dropped] = _reason_unfitted(step_errors[dropped], dropped)
        parameters = [name for name in parameters if name != dropped]
    return MachineFit(machine, before, before, None, None, errors, condition, held)


def _reason_unfitted(error: float, name: str) -> str:
    if not math.isfinite(error):
        return "the programs do not determine it, or it does not change their times"
    if error > 1.0:
        return "the programs do not determine it, or their times contradict each other"
    if error > _KNOWN[name]:
        return f"the programs do not determine it: its standard error is {100 * error:.0f} %"
    return f"the best {name} is implausible for a machine; check the measurements"


def _start_values(machine: Machine, parameters: Sequence[str]) -> Floats:
    values = {"acceleration": 1.0, "corner": machine.corner_deviation}
    return np.log([values[name] for name in parameters])


def _parameter_bounds(parameters: Sequence[str]) -> tuple[Floats, Floats]:
    lowest = {"acceleration": 1.0 / _WIDEST, "corner": _CORNERS[0]}
    highest = {"acceleration": _WIDEST, "corner": _CORNERS[1]}
    return np.log([lowest[name] for name in parameters]), np.log([highest[name] for name in parameters])


def _parameters_at_bounds(logs: Floats, parameters: Sequence[str]) -> list[str]:
    rows = zip(parameters, logs, *_parameter_bounds(parameters), strict=True)
    return [name for name, value, low, high in rows if not low + 1e-9 < value < high - 1e-9]


def _with_parameters(machine: Machine, parameters: Sequence[str], logs: Floats) -> Machine:
    values = dict(zip(parameters, np.exp(logs).tolist(), strict=True))
    factor = values.get("acceleration", 1.0)
    x, y, z = machine.acceleration
    acceleration = (x * factor, y * factor, z * factor)
    return replace(machine, acceleration=acceleration, corner_deviation=values.get("corner", machine.corner_deviation))


def _residuals(
    programs: Sequence[MeasuredProgram],
    machine: Machine,
    parameters: Sequence[str],
    logs: Floats,
    seconds: Floats,
    weight: Floats,
) -> Floats:
    difference: Floats = (model_seconds(programs, _with_parameters(machine, parameters, logs)) - seconds) * weight
    return difference


def _least_squares(
    programs: Sequence[MeasuredProgram], machine: Machine, parameters: Sequence[str], seconds: Floats, weight: Floats
) -> tuple[Floats, Floats]:
    """Return the logarithms of the fitted parameters, float64[p], and the weighted Jacobian at the solution, float64[n,
    p].
    """
    low, high = _parameter_bounds(parameters)

    def off(logs: Floats) -> Floats:
        return _residuals(programs, machine, parameters, logs, seconds, weight)

    def slopes(logs: Floats) -> Floats:
        columns = []
        for k in range(len(logs)):
            step = np.zeros(len(logs))
            step[k] = _STEP
            columns.append((off(logs + step) - off(logs - step)) / (2.0 * _STEP))
        return np.column_stack(columns)

    current = np.clip(_start_values(machine, parameters), low, high)
    residual, damping = off(current), 1e-3
    jacobian = slopes(current)
    for _ in range(_MOST_STEPS):
        normal = jacobian.T @ jacobian
        scale = np.diag(np.maximum(np.diag(normal), 1e-12))
        step = np.linalg.lstsq(normal + damping * scale, -jacobian.T @ residual, rcond=None)[0]
        candidate = np.clip(current + np.clip(step, -1.0, 1.0), low, high)
        candidate_residual = off(candidate)
        if candidate_residual @ candidate_residual < residual @ residual:
            moved = float(np.abs(candidate - current).max())
            current, residual, damping = candidate, candidate_residual, max(damping / 10.0, 1e-9)
            jacobian = slopes(current)
            if moved < _SMALLEST:
                break
        else:
            damping *= 10.0
            if damping > 1e9:
                break
    return current, jacobian


def _standard_errors(jacobian: Floats, parameters: Sequence[str], residual: Floats) -> tuple[dict[str, float], float]:
    """Return the standard error of each logarithm, and the condition number of the Jacobian with normalised columns.

    The variance is estimated from the residuals; it is at least 1, the variance that the weights imply.
    """
    degrees_of_freedom = len(residual) - len(parameters)
    spread = max(1.0, float(residual @ residual) / degrees_of_freedom if degrees_of_freedom > 0 else 1.0)
    size = np.sqrt((jacobian * jacobian).sum(axis=0))
    if np.any(size < _NO_EFFECT):
        # A parameter has no effect: compute the error of each parameter on its own.
        separate_errors = np.where(size < _NO_EFFECT, math.inf, math.sqrt(spread) / np.maximum(size, _NO_EFFECT))
        return dict(zip(parameters, separate_errors.tolist(), strict=True)), math.inf
    singular = np.linalg.svd(jacobian / size, compute_uv=False)
    if singular[-1] < _NO_EFFECT:
        return dict.fromkeys(parameters, math.inf), math.inf
    variance = np.diag(np.linalg.inv(jacobian.T @ jacobian)) * spread
    return dict(zip(parameters, np.sqrt(variance).tolist(), strict=True)), float(singular[0] / singular[-1])
