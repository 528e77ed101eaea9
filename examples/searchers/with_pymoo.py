"""Little speed and little force at once: a front found by pymoo's NSGA-II, which snapbeam does not need otherwise.

``pip install pymoo``; a whole generation is computed at a time, on all cores.
"""

import numpy as np
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.problem import Problem
from pymoo.optimize import minimize

import snapbeam as sb
from snapbeam import paper

shaker = sb.Shaker(frequency_ratio=1.0, velocity_amplitude=0.1)
system = sb.System(
    sb.ReducedModel.from_beam(paper.BEAM, modes=1, damping_ratio=paper.DAMPING_RATIO),
    contacts=[sb.Contact(paper.CONTACT, shaker)],
)
uncertainty = sb.uncertainty.ParameterUncertainty(
    of={"velocity_amplitude": sb.uncertainty.Normal(0.02, relative=True)},
    displacement=3.5e-6,
    phase=True,
)
variables = {
    "location": (0.1, 0.48),
    "frequency_ratio": (0.3, 2.6),
    "velocity_amplitude": (0.01, 0.6),
}
problem = sb.uncertainty.design_problem(
    system,
    variables,
    ["speed", sb.uncertainty.Objective(quantity="peak_force", quantile=0.5)],
    sb.uncertainty.Constraint(quantity="snap", lower=0.95),
    uncertainty,
    samples=40,
    integration=sb.Integration(cycles=10),
)


class Strike(Problem):
    """The problem in pymoo's words."""

    def __init__(self) -> None:
        low, high = np.array(list(variables.values())).T
        super().__init__(
            n_var=len(variables), n_obj=2, n_ieq_constr=1, xl=low, xu=high
        )

    def _evaluate(
        self,
        x: np.ndarray,
        out: dict[str, np.ndarray],
        *args: object,
        **kwargs: object,
    ) -> None:
        out["F"], violation, _ = problem.evaluate(x)
        out["G"] = violation[:, None]


found = minimize(Strike(), NSGA2(pop_size=16), ("n_gen", 8), seed=1)
for x, (speed, force) in sorted(
    zip(found.X, found.F, strict=True), key=lambda member: member[1][0]
):
    print(
        f"{speed:.4f} m/s, {force:.3f} N at",
        {
            name: round(float(value), 3)
            for name, value in zip(variables, x, strict=True)
        },
    )
