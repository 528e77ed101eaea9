"""A small result of every kind that has a figure, each from the public function that computes it."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.util.datasets import xr

SHORT = sb.Integration(cycles=20)
SYSTEM = sb.System(
    sb.ReducedModel.from_beam(default_values.BEAM, modes=1, damping_ratio=0.05),
    contacts=[sb.Contact(default_values.CONTACT, sb.Shaker(frequency_ratio=1.6, velocity_amplitude=0.03))],
)
CHAOTIC = SYSTEM.replace(**{"drive.frequency_ratio": 0.8, "drive.velocity_amplitude": 0.5})
PLANE = {"drive.frequency_ratio": np.linspace(0.8, 1.6, 5), "drive.velocity_amplitude": np.linspace(0.05, 0.3, 6)}
SPEEDS = {"drive.velocity_amplitude": np.linspace(0.05, 0.5, 16)}
SPREAD = sb.uncertainty.ParameterUncertainty(
    of={"location": sb.uncertainty.Normal(0.01), "contact.stiffness": sb.uncertainty.LogNormal(0.2)}
)
MOVING = sb.uncertainty.ParameterUncertainty(of={"velocity_amplitude": sb.uncertainty.Normal(0.1, relative=True)})


@cache
def _attractors() -> sb.dynamics.Attractors:
    return sb.dynamics.find_attractors(SYSTEM, 12)


@cache
def _branch() -> sb.dynamics.Branch:
    orbit = sb.dynamics.periodic_orbit(SYSTEM, transient=100)
    return sb.dynamics.continuation(orbit, "velocity_amplitude", (0.02, 0.3), max_points=12)


def _curve() -> xr.Dataset:
    fold, names = _branch().special_points[0], ("frequency_ratio", "velocity_amplitude")
    return sb.dynamics.bifurcation_curve(fold, names, ((1.5, 1.7), (0.02, 0.1)), max_points=5)


def _equilibria() -> xr.Dataset:
    plate = sb.ReducedModel.from_matrices([[1e-9]], [[2.0]], contact_shape=[1.0], length_scale=3e-6)
    electrode = sb.ElectrostaticForce(voltage=1.0, area=4e-8, gap=3e-6)
    return sb.model.equilibrium_branches(sb.System(plate, forces=[electrode]), "force.voltage", (0.0, 8.0))


def _field() -> xr.Dataset:
    time, place = np.linspace(0.0, 0.1, 30), np.linspace(0.0, 0.16, 12)
    values = 3e-4 * np.sin(np.pi * place / 0.16) * np.cos(200.0 * time)[:, None]
    over = ("time", "position")
    data = {"displacement": (over, values), "displacement_se": (over, np.full(values.shape, 1e-6))}
    return xr.Dataset(data, {"time": time, "position": place})


def _scores() -> xr.Dataset:
    kinds = ("measurement", np.array([0, 3, 3, 1], dtype=np.int8))
    middle = np.array([0.9, 0.2, 0.6, 0.8])
    columns = {"probability": middle, "probability_low": middle - 0.1, "probability_high": middle + 0.1}
    data = {name: ("measurement", values) for name, values in columns.items()}
    return xr.Dataset(data | {"response_class": kinds, "most_likely": kinds}, attrs={"agree": 3, "agree_expected": 2.5})


def _tangency() -> xr.Dataset:
    data = {"crosses": ("value", [False, False, True, True]), "bracket": ("manifolds", [0.024, 0.026])}
    coordinates = {"value": ("value", [0.02, 0.024, 0.026, 0.03]), "manifolds": ["apart", "crossing"]}
    return xr.Dataset(data, coordinates, {"parameter": "velocity_amplitude"})


def _crossings() -> xr.Dataset:
    data = {"state": (("point", "coordinate"), [[0.1, 0.2], [0.3, 0.4]]), "stable_arclength": ("point", [1.0, 2.0])}
    return xr.Dataset(data, {"coordinate": ["amplitude[1]", "velocity[1]"]})


def _lifetimes(axes: dict[str, np.ndarray]) -> xr.Dataset:
    settings = sb.dynamics.LifetimeSettings(settling_cycles=10)
    how = sb.Integration(cycles=60)
    return sb.dynamics.lifetime_map(SYSTEM, axes, how, initial_conditions=8, settings=settings)


def _basins() -> xr.Dataset:
    grid = {"amplitude[1]": np.linspace(-0.98, 1.4, 12), "velocity[1]": np.linspace(-0.6, 0.6, 9)}
    return sb.dynamics.basins_of_attraction(_attractors(), grid)


def _edge() -> xr.Dataset:
    ends = np.array([-0.9, 0.0]), np.array([-1.0, 1.3])
    return sb.dynamics.edge_tracking(SYSTEM, *ends, periods=25, horizon=60).to_dataset()


def _posterior() -> xr.Dataset:
    draw = np.random.default_rng(1).normal(size=(2000, 3))
    values = np.array([3.4e-4, 4e8, 0.005]) * (1.0 + np.array([0.02, 0.1, 0.05]) * draw)
    names = ("beam.buckling_level", "contact.stiffness", "model.damping_ratio")
    return sb.uncertainty.Posterior(names, values, np.full(2000, 1 / 2000)).to_dataset()


def _designs(objectives: object = "velocity_amplitude") -> xr.Dataset:
    effort = sb.uncertainty.OptimizerSettings(
        generations=6, population=10, samples=40, validation_samples=80, candidates=3
    )
    variables = {"velocity_amplitude": (0.03, 0.3), "location": (0.3, 0.5)}
    limit = sb.uncertainty.Constraint(quantity="snap", lower=0.8)
    return sb.uncertainty.optimize_design(CHAOTIC, variables, objectives, limit, MOVING, effort, integration=SHORT)


def _saddle() -> sb.dynamics.PeriodicOrbit:
    return sb.dynamics.periodic_orbit(SYSTEM, [0.0, 0.0])


def _over_seeds() -> xr.Dataset:
    motion = sb.RecordedAcceleration.from_psd([(20, 0.01), (200, 0.01)], duration_s=0.5, ramp_up_s=0.05)
    shaken = sb.System(SYSTEM.model, base_excitation=sb.BaseExcitation(motion=motion))
    axes = {"base_excitation.rms_g": [0.1, 0.2, 0.3], "base_excitation.seed": [0, 1, 2]}
    return sb.mean_over_seeds(sb.sweep(shaken, axes, sb.Integration(cycles=10)))


QUICK: dict[str, Callable[[], xr.Dataset]] = {
    "run": lambda: sb.simulate(CHAOTIC.replace(**{"model.modes": 3}), SHORT).dataset,
    "map": lambda: sb.sweep(SYSTEM, PLANE, SHORT)[["response_class", "peak_force"]],
    "map of a line": lambda: sb.sweep(SYSTEM, SPEEDS, SHORT)[
        ["response_class", "peak_force", "min_midspan_displacement", "max_midspan_displacement"]
    ],
    "threshold": lambda: sb.threshold(
        SYSTEM, "drive.velocity_amplitude", np.linspace(0.02, 0.4, 20),
        {"drive.frequency_ratio": np.linspace(0.6, 1.6, 6)}, SHORT,
    ),
    "hysteresis": lambda: sb.dynamics.hysteresis(SYSTEM, "velocity_amplitude", np.linspace(0.05, 0.3, 8), SHORT),
    "lifetimes": lambda: _lifetimes(PLANE),
    "lifetimes of a line": lambda: _lifetimes(SPEEDS),
    "lifetimes of a point": lambda: _lifetimes({"drive.velocity_amplitude": [0.2, 0.3]}).isel(velocity_amplitude=0),
    "impact section": lambda: sb.dynamics.poincare_section(CHAOTIC, "impact", 60),
    "section at a level": lambda: sb.dynamics.poincare_section(CHAOTIC, ("midspan_displacement", 0.0, "up"), 60),
    "stroboscopic section": lambda: sb.dynamics.poincare_section(CHAOTIC, "stroboscopic", 60),
    "attractors": lambda: _attractors().to_dataset(),
    "orbit": lambda: sb.dynamics.periodic_orbit(SYSTEM, transient=100).to_dataset(),
    "backbone": lambda: sb.dynamics.backbone_curve(sb.System(SYSTEM.model), max_points=20),
    "posterior": _posterior,
    "means over seeds": _over_seeds,
    "probability map": lambda: sb.uncertainty.probability_map(
        CHAOTIC, {key: values[1:4] for key, values in PLANE.items()}, MOVING, 12, integration=SHORT
    ),
    "probability line": lambda: sb.uncertainty.probability_map(CHAOTIC, SPEEDS, MOVING, 20, integration=SHORT),
}  # fmt: skip
SLOW: dict[str, Callable[[], xr.Dataset]] = {
    "basins": _basins,
    "branch": lambda: _branch().to_dataset(),
    "edge": _edge,
    "diagram": lambda: sb.dynamics.bifurcation_diagram(
        SYSTEM, "velocity_amplitude", np.linspace(0.02, 0.1, 9), periods=(100, 16)
    ),
    "exponents": lambda: sb.dynamics.lyapunov_spectrum(SYSTEM, 2, periods=40, transient=10),
    "line of exponents": lambda: sb.dynamics.lyapunov_spectrum(CHAOTIC, periods=40, transient=10, axes=SPEEDS),
    "map of exponents": lambda: sb.dynamics.lyapunov_spectrum(CHAOTIC, periods=40, transient=10, axes=PLANE),
    "designs": _designs,
    "front of designs": lambda: _designs(["velocity_amplitude", "peak_force"]),
    "quantiles": lambda: sb.uncertainty.quantile_threshold(
        CHAOTIC, "velocity_amplitude", (0.02, 0.4), {"frequency_ratio": [0.8, 1.2, 1.6]}, MOVING,
        sb.uncertainty.QuantileSearchSettings(runs=120), integration=SHORT,
    ),
    "sensitivities": lambda: sb.uncertainty.sensitivity(CHAOTIC, "peak_force", SPREAD, samples=8, integration=SHORT),
    "sensitivity indices": lambda: sb.uncertainty.sensitivity(
        CHAOTIC, "peak_force", SPREAD, "sobol", samples=64, integration=SHORT
    ),
    "gradient": lambda: sb.uncertainty.gradient(SYSTEM, "peak_force", ["contact.stiffness", "location"], integration=SHORT),
    "gradients of several statistics": lambda: sb.uncertainty.gradient(
        SYSTEM, ["peak_force", "impacts", "rms_midspan_displacement", "striker_work"],
        ["contact.stiffness", "location", "velocity_amplitude"], integration=SHORT,
    ),
    "manifold": lambda: sb.dynamics.invariant_manifold(_saddle(), max_arclength=1.0),
    "force-displacement curve": lambda: sb.force_displacement(SYSTEM),
    "growth of a perturbation": lambda: sb.perturbation_growth(CHAOTIC, SHORT),
    "bifurcation curve": _curve,
    "estimated density": lambda: sb.RecordedAcceleration.from_psd("NAVMAT P-9492", duration_s=2.0).estimated_psd(),
    "equilibrium branches": _equilibria,
    "displacement field": _field,
    "measured classes": _scores,
    "homoclinic tangency": _tangency,
    "homoclinic points": _crossings,
}  # fmt: skip


def _once(make: Callable[[], xr.Dataset]) -> Callable[[], xr.Dataset]:
    """A result that is computed for its first figure only."""
    kept = cache(make)
    return lambda: kept().copy()


RESULTS = {name: _once(make) for name, make in (QUICK | SLOW).items()}
