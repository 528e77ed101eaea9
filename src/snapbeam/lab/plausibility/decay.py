"""A free decay against itself: was it free, was it whole, does the model say it all."""

from __future__ import annotations

from snapbeam.core.findings import Severity
from snapbeam.lab.plausibility.kinds import Kind, table

__all__ = ["KINDS"]

NOTE, DOUBT, WRONG = Severity.INFO, Severity.WARNING, Severity.ERROR

KINDS = table(
    Kind(
        "decay.release", NOTE,
        "where the motion sets in",
        "the free decay begins at {start:.6g} s; what lies before is left out (start, --start, says otherwise)",
        ("start",),
    ),
    Kind(
        "decay.clipped", DOUBT,
        "levels hit exactly again and again, or first maxima that do not fall",
        "tops are cut off until {until:.6g} s: the decay is taken from there; choose a larger range",
    ),
    Kind(
        "decay.clipped_throughout", WRONG,
        "levels hit exactly again and again, or first maxima that do not fall",
        "tops are cut off over nearly the whole decay, so that its damping is not in it; choose a larger range",
    ),
    Kind(
        "decay.disturbed", DOUBT,
        "amplitude and phase of the mode, cycle by cycle",
        "at {at:.6g} s the motion jumps by {jump_percent:.0f} % of its amplitude: a second hit, or a dropout; only the "
        "decay {told} that is used (start, --start, and stop, --stop, choose)",
        ("start", "stop"),
    ),
    Kind(
        "decay.drift", NOTE,
        "the mean over each cycle",
        "the zero drifts by {drift_percent:.0f} % of the amplitude; taken out as a polynomial of degree {degree:.0f}",
    ),
    Kind(
        "decay.hum", NOTE,
        "lines that do not decay",
        "a line of {frequency:.3f} Hz with {amplitude_percent:.1f} % of the amplitude does not decay (mains or a "
        "machine); taken out",
    ),
    Kind(
        "decay.hum_asked", WRONG,
        "lines that do not decay, near a frequency that was asked for",
        "near frequencies (--frequencies) {asked:.5g} Hz there is only a line of {frequency:.4f} Hz that does not "
        "decay",
        ("frequencies",),
    ),
    Kind(
        "decay.close_modes", NOTE,
        "poles of the matrix pencil, and what one mode leaves",
        "two modes lie close together, {first:.3f} and {second:.3f} Hz: both are fitted (modes, --modes, shows both)",
        ("modes",),
    ),
    Kind(
        "decay.damping_law", NOTE,
        "the amplitude cycle by cycle, against viscous, dry and quadratic damping",
        "beside viscous damping there is {told} damping, {strength:.2f} +- {error:.1g} times as strong at the start: "
        "the damping ratio is that of the viscous part, of vanishing amplitude",
    ),
    Kind(
        "decay.misfit", DOUBT,
        "what the fit leaves near the mode, against the noise about it",
        "the fit leaves {ratio:.1f} times as much near the mode as the noise explains ({share_percent:.1f} % of the "
        "amplitude): something else is in the record; standard errors are raised to what parts of the decay differ by",
    ),
    Kind(
        "decay.parts_differ", DOUBT,
        "frequency and damping of the early and the late half of the decay",
        "the early and the late half of the decay differ by {frequency_se:.1f} standard errors in frequency and "
        "{damping_se:.1f} in damping; standard errors are raised by that",
    ),
    Kind(
        "decay.frequency_drift", DOUBT,
        "the phase cycle by cycle, against the changes that softening makes",
        "the frequency changes by {share_percent:+.2f} % over the decay in a way that its amplitude does not: the "
        "temperature, or a clamp that creeps; the frequency is that of the start, and the change is in its standard "
        "error",
    ),
    Kind(
        "decay.window", DOUBT,
        "the noise of the sensor in each eighth of the record, which does not decay",
        "the noise falls with the decay, {factor:.1f} times over the record, as under an exponential window of "
        "{constant:.3g} s: such a window adds {added_percent:.3g} % to the damping ratio, which is in its standard "
        "error; save the record without a window, or give its exponential_window (--exponential-window)",
        ("exponential_window",),
    ),
    Kind(
        "decay.hardening", DOUBT,
        "the sign of the change of the frequency with amplitude",
        "the frequency rises with amplitude, by {rise_percent:.2g} % at the start ({certain:.0f} standard errors); "
        "about a well a buckled beam softens: the beam is not buckled, or the mode lies above half the sampling "
        "frequency, {half_hz:.5g} Hz, and is seen folded",
    ),
    Kind(
        "decay.above_band", DOUBT,
        "the frequency of a mode against the sampling frequency",
        "a mode at {frequency:.5g} Hz lies above {limit_hz:.5g} Hz, the sampling frequency over 2.56, where filters "
        "against aliasing still let pass what lies above half of it: it may be {folded:.5g} Hz; record faster",
    ),
    Kind(
        "decay.short", DOUBT,
        "the amplitude left at the end",
        "the record ends with {left_percent:.0f} % of the amplitude left: damping is read from little decay",
    ),
    Kind(
        "decay.large", DOUBT,
        "change of the frequency with amplitude",
        "the frequency changes by {change_percent:.0f} %: leave out the first cycles with start (--start)",
        ("start",),
    ),
    Kind(
        "decay.faint", DOUBT,
        "the amplitude at the start against the noise",
        "the first mode starts less than 5 times above the noise",
    ),
    Kind(
        "decay.undamped", DOUBT,
        "the damping ratio against its standard error",
        "the damping ratio is not told from zero",
    ),
    Kind(
        "decay.off_asked", DOUBT,
        "the frequency found, against the one asked for",
        "frequencies (--frequencies) {asked:.5g} Hz was asked for, the nearest mode is at {found:.5g} Hz",
        ("frequencies",),
    ),
)  # fmt: skip
