"""Fit a machine profile to measured program times.

Besides the feeds, two parameters determine most of a program's run time: the accelerations and the corner value
(`Machine.corner_deviation`). Users seldom know either of them. The fit scales the accelerations of all axes by a single
factor. LinuxCNC has no corner value, so only the accelerations are fitted there. Both parameters are positive, so we
fit their logarithms with weighted nonlinear least squares (Levenberg–Marquardt).

Sources: J. J. Moré, "The Levenberg-Marquardt algorithm: implementation and theory" (1978). G. A. F. Seber and C. J.
Wild, "Nonlinear regression" (1989), section 2.1, for computing standard errors from the inverse of JᵀJ.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from leafcut.geometry.arrays import Floats
from leafcut.model.machine import Machine
from leafcut.model.toolpath import Toolpath
from leafcut.timing.toolpath import corner_style_of_machine, measure_toolpath

#: Error of a stopwatch, in seconds, and error of the timing model, as a fraction of the program time. Manual and
#: electronic timing differ by about 0.2 s (R. K. Hetzler and others, J. Strength Cond. Res. 22, 2008). For the model
#: error, see docs/results/machine_time.md.
HAND_S, MODEL_SHARE = 0.3, 0.005
#: The fit scales the accelerations by at least 1 / _WIDEST and at most _WIDEST.
_WIDEST = 20.0
#: Range in mm within which the fit looks for the corner value.
_CORNERS = (1e-4, 2.0)
#: Largest standard error, on a log scale, at which a parameter counts as determined. With 95 % confidence, the
#: accelerations are then known to within a third and the corner value to within a factor of 2. Profiles usually state
#: only the order of magnitude of the corner value.
_KNOWN = {"acceleration": 0.15, "corner": 0.35}
#: Step size for numerical derivatives with respect to the logarithms. It is large compared with the model's rounding
#: errors.
_STEP = 0.01
_MOST_STEPS, _SMALLEST = 40, 1e-6
#: A parameter affects the program times if their slope is at least this large, in weighted seconds.
_NO_EFFECT = 1e-8


@dataclass(frozen=True)
class MeasuredProgram:
    """A program's toolpath and its measured run time."""

    name: str
    path: Toolpath
    seconds: float


@dataclass(frozen=True)
class MachineFit:
    """Result of fitting a machine profile, including measures of its quality.

    Attributes
    ----------
    machine
        The machine with the fitted values. Parameters that the fit could not determine keep the values from the
        profile.
    before, after
        Predicted time of each program before and after the fit, float64[n], s.
    acceleration, corner
        Fitted factor on the accelerations and fitted corner value in mm. None if the parameter was not fitted.
    error
        Relative standard error of each parameter (acceleration, corner). Infinite if the parameter has no effect.
    condition
        Condition number of the weighted Jacobian. It is infinite if a parameter has no effect, and 1 if only one
        parameter is fitted.
    held
        Why a parameter was not fitted, for each parameter that kept the value from the profile.
    """

    machine: Machine
    before: Floats
    after: Floats
    acceleration: float | None
    corner: float | None
    error: dict[str, float]
    condition: float
    held: dict[str, str]


def predict_program_seconds(programs: Sequence[MeasuredProgram], machine: Machine) -> Floats:
    """Predict the run time of each program in seconds. Every program starts at X0 Y0."""
    return np.array([measure_toolpath(program.path, machine, start=(0.0, 0.0)).time_s for program in programs])


def fit_machine(programs: Sequence[MeasuredProgram], machine: Machine) -> MachineFit:
    """Fit the accelerations and the corner value to the measured times.

    A parameter keeps the value from the profile if it has no effect or if the programs do not determine it. If the
    programs cannot determine both parameters together, only the accelerations are fitted.
    """
    seconds = np.array([program.seconds for program in programs])
    weight = 1.0 / np.hypot(HAND_S, MODEL_SHARE * seconds)
    before = predict_program_seconds(programs, machine)
    parameters = ["acceleration"] if corner_style_of_machine(machine) == "linuxcnc" else ["acceleration", "corner"]
    held: dict[str, str] = {}
    if "corner" not in parameters:
        held["corner"] = "LinuxCNC's corners go by the program's own G64 P, not by a value of the machine"
    if len(programs) < 2:
        held |= dict.fromkeys(parameters, "one program is not enough; measure at least two")
        return MachineFit(machine, before, before, None, None, {}, math.nan, held)
    errors: dict[str, float] = {}
    condition = math.nan
    while parameters:
        logs, jacobian = _fit_least_squares(programs, machine, parameters, seconds, weight)
        changed = _with_parameters(machine, parameters, logs)
        after = predict_program_seconds(programs, changed)
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


def _initial_parameters(machine: Machine, parameters: Sequence[str]) -> Floats:
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
    difference: Floats = (
        predict_program_seconds(programs, _with_parameters(machine, parameters, logs)) - seconds
    ) * weight
    return difference


def _fit_least_squares(
    programs: Sequence[MeasuredProgram], machine: Machine, parameters: Sequence[str], seconds: Floats, weight: Floats
) -> tuple[Floats, Floats]:
    """Run the Levenberg–Marquardt fit.

    Returns
    -------
    logarithms
        Logarithms of the fitted parameters, float64[p].
    jacobian
        Weighted Jacobian at the solution, float64[n, p].
    """
    low, high = _parameter_bounds(parameters)

    def residuals(logs: Floats) -> Floats:
        return _residuals(programs, machine, parameters, logs, seconds, weight)

    def jacobian_at(logs: Floats) -> Floats:
        columns = []
        for k in range(len(logs)):
            step = np.zeros(len(logs))
            step[k] = _STEP
            columns.append((residuals(logs + step) - residuals(logs - step)) / (2.0 * _STEP))
        return np.column_stack(columns)

    current = np.clip(_initial_parameters(machine, parameters), low, high)
    residual, damping = residuals(current), 1e-3
    jacobian = jacobian_at(current)
    for _ in range(_MOST_STEPS):
        normal = jacobian.T @ jacobian
        scale = np.diag(np.maximum(np.diag(normal), 1e-12))
        step = np.linalg.lstsq(normal + damping * scale, -jacobian.T @ residual, rcond=None)[0]
        candidate = np.clip(current + np.clip(step, -1.0, 1.0), low, high)
        candidate_residual = residuals(candidate)
        if candidate_residual @ candidate_residual < residual @ residual:
            moved = float(np.abs(candidate - current).max())
            current, residual, damping = candidate, candidate_residual, max(damping / 10.0, 1e-9)
            jacobian = jacobian_at(current)
            if moved < _SMALLEST:
                break
        else:
            damping *= 10.0
            if damping > 1e9:
                break
    return current, jacobian


def _standard_errors(jacobian: Floats, parameters: Sequence[str], residual: Floats) -> tuple[dict[str, float], float]:
    """Compute the standard error of each logarithm and the condition number of the column-normalised Jacobian.

    The variance is estimated from the residuals. It is at least 1, because the weights already assume a variance of 1.
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
