"""Claims 1, 11 and 13: natural frequencies, their convergence, and the wells of another basis."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

import snapbeam as sb
from snapbeam.model.paper_values import BEAM, MODES, STRAIGHT_BEAM
from snapbeam.paper.claims.table import Claim
from snapbeam.paper.system import paper_model

if TYPE_CHECKING:
    from snapbeam.paper.recipe import Results

__all__ = ["convergence", "dynamic_basis", "misprint", "natural_frequencies"]

_PRINTED = {
    "1a": ("the straight beam's first two frequencies", STRAIGHT_BEAM, (80.0, 221.0)),
    "1b": ("the buckled beam's first three frequencies, 32 modes", BEAM, (81.8, 159.0, 380.0)),
}


def natural_frequencies(results: Results) -> list[Claim]:
    """Claim 1."""
    rows = []
    for number, (words, beam, printed) in _PRINTED.items():
        model = sb.ReducedModel.from_beam(beam, modes=MODES)
        measured = model.natural_freq[: len(printed)]
        exact = sb.exact_natural_freq(beam, len(printed))
        worst = float(np.abs(measured / np.array(printed) - 1.0).max())
        rows.append(
            Claim(
                number,
                words,
                ", ".join(f"{value:g}" for value in printed) + " Hz",
                ", ".join(f"{value:.2f}" for value in measured) + " Hz",
                f"{1e2 * float(np.abs(measured / exact - 1.0).max()):.3f} % (truncation at 32 modes)",
                "holds" if worst < 5e-3 else "fails",
                "Eigenvalues of the linearised model; agreement: within 0.5 % of the printed numbers.",
                f"Greatest deviation from the printed numbers {1e2 * worst:.2f} %.",
            )
        )
    return rows


def misprint(results: Results) -> list[Claim]:
    """The factor 2 in Eq. (A.2)."""
    import scipy.linalg

    model = paper_model(MODES)
    square = model.tension_stiffness * float(model.equilibrium[0] ** 2)
    tangent = model.stiffness + 2.0 * square
    tangent[0] = model.stiffness[0] + 3.0 * square
    freq = np.sqrt(scipy.linalg.eigvalsh(np.diag(tangent), model.mass)[:3]) / (2.0 * math.pi)
    return [
        Claim(
            "1c",
            "linearisation about a well, Eq. (A.2), with the factor 2 it prints for the higher modes",
            "81.8, 159, 380 Hz",
            ", ".join(f"{value:.2f}" for value in freq) + " Hz",
            "none (closed form)",
            "holds" if np.abs(freq / [81.8, 159.0, 380.0] - 1.0).max() < 5e-3 else "fails",
            "Eigenvalues with the stiffness as printed; agreement: within 0.5 %.",
            "The factor is a misprint: differentiating Eq. (11) gives 1, which gives the paper's own "
            "numbers (1b).",
        )
    ]


def convergence(results: Results) -> list[Claim]:
    """Claim 11."""
    error = results["figA9"]["error"]
    row = error.error.sel(modes=MODES).values
    worst = int(np.nanargmax(row))
    return [
        Claim(
            "11",
            "32 modes give the first ten natural frequencies within 0.07 % of the exact ones",
            "< 0.07 %",
            f"{1e2 * row[worst]:.4f} % (mode {worst + 1})",
            "below the last digit",
            "holds" if row[worst] < 7e-4 else "fails",
            "Greatest relative error of the first ten frequencies against the exact ones.",
        )
    ]


def dynamic_basis(results: Results) -> list[Claim]:
    """Claim 13: the linear modes about the lower well as the basis, the first few of them."""
    from scipy.optimize import minimize

    model = paper_model(results.pick(32, 64))
    depth = model.barrier_energy - model.well_energy
    rest = model.equilibrium
    parts, worst = [], 0.0
    for count in (2, 4, 8, 16):
        basis = model.linear_modes[:, :count]
        start = basis.T @ model.mass @ (-2.0 * rest)

        def energy(q: np.ndarray, basis: np.ndarray = basis) -> float:
            return float(model.potential_energy(rest + basis @ q)) / depth

        scale = np.abs(start).max()
        found = minimize(lambda u: energy(u * scale), start / scale, method="BFGS", options={"gtol": 1e-9})  # noqa: B023
        gap = float(found.fun - model.well_energy / depth)
        worst = max(worst, gap)
        parts.append(f"{count}: {100.0 * gap:.2g} %")
    own = model.wells
    exact = float(abs(np.diff(model.potential_energy(own))[0])) / depth
    return [
        Claim(
            "13",
            "dynamic modes about a well as the basis give wells of unequal energy, buckling modes do not",
            "unequal; equal",
            f"dynamic modes, difference over the barrier, {', '.join(parts)}; buckling modes "
            f"{100.0 * exact:.1g} %",
            "1e-6 (minimisation)",
            "holds" if worst > 1e-6 and exact < 1e-12 else "fails",
            "Energy of the minimum nearest the second well, in the space of the first few linear modes "
            "about the first, "
            "minus that of the first, over the height of the barrier.",
            "The difference falls as dynamic modes are added; with buckling modes both wells are in the "
            "basis.",
        )
    ]
