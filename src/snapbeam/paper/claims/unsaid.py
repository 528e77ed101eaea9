"""What the paper leaves open, and how much it matters."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from snapbeam.core.codes import ResponseClass
from snapbeam.model.paper_values import CONTACT, DAMPING_RATIO
from snapbeam.paper.claims.table import Claim
from snapbeam.paper.studies.sensitivity import buckling_mode_damping
from snapbeam.paper.system import paper_model
from snapbeam.sweeps.analysis import Difference, compare_maps, is_interwell

if TYPE_CHECKING:
    from snapbeam.paper.recipe import Results

__all__ = ["contact_stiffness", "damping", "end_rule", "reference_frequency", "tolerance"]

_RULE = (
    "Two maps of one grid after the same cycles: share of the points of another class, share that snap in "
    "one and not in the "
    "other, greatest change of the share of a class, ratio of the mean thresholds."
)


def _compare(results: Results, first: str, second: str) -> Difference:
    data = results["sensitivity"]
    return compare_maps(data[first], data[second])


def _words(difference: Difference) -> str:
    return (
        f"{100.0 * difference.changed:.1f} % of the points change class, {100.0 * difference.snapped:.1f} % "
        f"between "
        f"intrawell and interwell; a class's share moves by {100.0 * difference.share:.1f} % at most; "
        f"threshold times "
        f"{difference.threshold:.3f}"
    )


def _floor(results: Results) -> str:
    chaos = _compare(results, "base", "perturbed")
    return (
        f"1e-9 in V does: {100.0 * chaos.changed:.1f} % change class, {100.0 * chaos.snapped:.1f} % between "
        f"intrawell and "
        f"interwell, threshold times {chaos.threshold:.3f}"
    )


def reference_frequency(results: Results) -> list[Claim]:
    """Which omega_1 normalises one mode."""
    data = results["sensitivity"]
    own, other = (float(data[name].attrs["reference_freq"]) for name in ("one_mode", "one_mode_reference"))
    return [
        Claim(
            "A",
            "which omega_1 normalises Omega and V of one mode",
            "not said",
            f"{own:.2f} Hz against {other:.2f} Hz: "
            + _words(_compare(results, "one_mode", "one_mode_reference")),
            _floor(results),
            "open",
            _RULE,
            f"Every figure here uses the model's own; the other scales both axes of the map by "
            f"{other / own:.3f}.",
        )
    ]


def contact_stiffness(results: Results) -> list[Claim]:
    """4e8 against what the materials give."""
    difference = _compare(results, "base", "soft_contact")
    soft = float(results["sensitivity"]["soft_contact"].attrs["contact_stiffness"])
    return [
        Claim(
            "B",
            "the contact stiffness, against what a common modulus of the stated material gives",
            f"{CONTACT.stiffness:.1e} N/m^1.5",
            f"{soft:.2e} N/m^1.5: " + _words(difference),
            _floor(results),
            "open",
            _RULE,
        )
    ]


def damping(results: Results) -> list[Claim]:
    """Linear modes about a well or the buckling modes themselves."""
    model = paper_model(int(results["sensitivity"]["base"].attrs["modes"]))
    projected, exact = buckling_mode_damping(model)
    error = float(np.abs(projected / exact - 1.0).max())
    first = ", ".join(f"{value:.4f}" for value in projected[:3])
    return [
        Claim(
            "C",
            "how the damping ratio is applied: to the linear modes about a well, or to the buckling modes",
            "not said",
            _words(_compare(results, "base", "buckling_damping")),
            _floor(results),
            "open",
            _RULE,
            f"A ratio of {DAMPING_RATIO} in each buckling mode by itself is {first}, ... in the first "
            f"linear modes, up to "
            f"{projected.max():.3f}. The engine takes a ratio for each linear mode: the damping matrix of "
            f"the buckling modes is "
            f"taken by its diagonal there, which differs from the exact eigenvalues by {100.0 * error:.2g} "
            f"% at most; the "
            "coupling of the linear modes by damping is left out.",
        )
    ]


def end_rule(results: Results) -> list[Claim]:
    """Transient 1 or 2 by the sign at the end, and whether that end is final."""
    parts = []
    for ds in results["fig6"].values():
        kinds = ds.response.values
        transient = (kinds == ResponseClass.TRANSIENT_1) | (kinds == ResponseClass.TRANSIENT_2)
        final = ds.end_is_final.values.astype(bool)
        parts.append(
            f"N = {int(ds.attrs['modes'])}: {100.0 * float((~final[transient]).mean()):.1f} % of the "
            f"transient ones "
            f"({100.0 * float((~final & transient).mean()):.1f} % of all)"
        )
    return [
        Claim(
            "D",
            "transient 1 or 2: about which well a run ends",
            "type of the response at the end",
            "not settled, above the barrier at the last instant, " + "; ".join(parts),
            "none (a count)",
            "open",
            "Read as the sign of the centre displacement at the last instant. Counted: transient runs whose "
            "energy at the end is "
            "above the lowest barrier, for which another rule (a mean over the last cycles, say) could "
            "decide otherwise.",
        )
    ]


def tolerance(results: Results) -> list[Claim]:
    """Half the step, and where the points that change class lie."""
    data = results["sensitivity"]
    half, chaos = _compare(results, "base", "half_step"), _compare(results, "base", "perturbed")
    base = data["base"].response.values
    inside = is_interwell(base)
    changed = base != data["half_step"].response.values
    share = float(inside[changed].mean()) if changed.any() else float("nan")
    return [
        Claim(
            "E",
            "the tolerance of the integrator: the map with half the step",
            "not said",
            _words(half),
            _floor(results),
            "open",
            _RULE,
            f"Of the points that change, {100.0 * half.at_border:.0f} % have a neighbour of another class "
            f"and "
            f"{100.0 * share:.0f} % are interwell: they lie on the borders and in the speckle above the "
            f"threshold. A change of "
            f"1e-9 in V does the same ({100.0 * chaos.changed:.1f} %): it is the responses that are "
            f"chaotic, not the step that is "
            "too long.",
        )
    ]
