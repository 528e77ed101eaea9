"""A calibrated beam against its data: what they determine, where they contradict each other or the model."""

from __future__ import annotations

from snapbeam.core.findings import Severity
from snapbeam.lab.plausibility.kinds import Kind, table

__all__ = ["KINDS"]

NOTE, DOUBT, WRONG = Severity.INFO, Severity.WARNING, Severity.ERROR

KINDS = table(
    Kind(
        "calibration.antisymmetric", DOUBT,
        "parity of the model's modes, where the data tell modes apart by their order only",
        "the first frequency about a well of this beam, {frequency:.1f} Hz, belongs to the antisymmetric mode, which "
        "does not depend on the buckling level (above b/r = 6.2, b the buckling level, r the radius of gyration): "
        "say which measured frequencies are symmetric, lower_well_shape (--lower-well 159a,165s), or measure the "
        "symmetric one",
        ("lower_well_shape",),
    ),
    Kind(
        "calibration.crossing", DOUBT,
        "distance of the model's first symmetric and antisymmetric frequency",
        "the first two frequencies about a well, {symmetric:.1f} Hz symmetric and {antisymmetric:.1f} Hz "
        "antisymmetric, lie so close that their order may be the other one: "
        "say which measured frequencies are symmetric, lower_well_shape (--lower-well 159a,165s)",
        ("lower_well_shape",),
    ),
    Kind(
        "calibration.undetermined", DOUBT,
        "singular values of the sensitivities of all frequencies to all parameters",
        "{told}",
    ),
    Kind("calibration.linked", DOUBT, "correlation of the fitted parameters", "{told}"),
    Kind("calibration.vague", DOUBT, "standard errors of the fitted parameters", "{told}"),
    Kind(
        "calibration.no_check", NOTE,
        "number of data against number of parameters",
        "as many parameters as measured values: nothing is left to check the model with",
    ),
    Kind(
        "calibration.unequal_wells", NOTE,
        "frequencies of one mode about the two wells",
        "{told}",
    ),
    Kind("calibration.assumed_errors", NOTE, "whether standard errors were given", "{told}"),
    Kind(
        "calibration.outlier", DOUBT,
        "each measured frequency against the model's, in standard errors",
        "{told}: model {model:.4g} Hz, measured {measured:.4g} Hz, {apart:.1f} standard errors apart",
    ),
    Kind(
        "calibration.scatter", DOUBT,
        "chi-square per degree of freedom",
        "the data scatter {scatter:.2f} times as much as their standard errors allow; the uncertainties are raised by "
        "it",
    ),
    Kind(
        "calibration.damping_differs", NOTE,
        "damping ratios of different modes",
        "damping ratios from {low:.4g} to {high:.4g}: the model takes one for every mode",
    ),
    Kind(
        "contact.exponent", WRONG,
        "durations of impacts over their closing speed, against the law of Hertz",
        "durations go with the closing speed to the power {exponent:+.2f} +- {error:.2f}, not -0.20: these are no "
        "collisions of two rigid bodies (the beam bends while it is in touch), so they tell no contact stiffness",
    ),
    Kind(
        "contact.coarse", DOUBT,
        "durations of impacts in frames",
        "the impacts last {frames:.1f} frames only: record faster for a contact stiffness",
    ),
    Kind(
        "contact.few", DOUBT,
        "number and spread of the impacts",
        "{count:.0f} impact(s) of speeds within a factor {span:.2f}: the law of Hertz cannot be checked on them",
    ),
)  # fmt: skip
