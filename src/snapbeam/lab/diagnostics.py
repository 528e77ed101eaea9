"""The kinds of diagnostics of the lab part: code, severity and message."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from snapbeam.util.diagnostics import Diagnostic, Severity


class Kind(NamedTuple):
    """One kind of diagnostic; ``says`` are its words, with the numbers in braces and the way out."""

    code: str
    severity: Severity
    says: str

    def found(self, severity: Severity | None = None, told: str = "", **numbers: float) -> Diagnostic:
        """The diagnostic with its numbers, in words; *told* stands for ``{told}`` in them."""
        words = self.says.format(told=told, **numbers)
        return Diagnostic(self.code, words, numbers, severity or self.severity)


def holding(kinds: Mapping[str, Kind], *checks: tuple[str, bool, Mapping[str, float]]) -> list[Diagnostic]:
    """The diagnostics whose condition holds, of names, conditions and numbers."""
    return [kinds[name].found(None, "", **numbers) for name, holds, numbers in checks if holds]


def table(group: str, **words: dict[str, str]) -> dict[str, Kind]:
    """Kinds of a group by name, from their words by severity."""
    return {
        name: Kind(f"{group}.{name}", Severity(severity), says)
        for severity, kinds in words.items()
        for name, says in kinds.items()
    }


KINDS_ALIGNMENT = table(
    "alignment",
    info={
        "polarity": "the vibrometer counts as negative what is positive for the camera; a drive made with this "
        "alignment is turned over (polarity, --polarity, says otherwise)",
        "clocks": "the clocks differ by {difference:.1e}",
    },
    warning={
        "polarity_open": "whether the vibrometer counts the camera's direction as positive cannot be told, for the "
        "start of the motion is not in both records, or fits both ways; give polarity (--polarity) 1 or -1",
        "cycle_open": "whole cycles of {period_ms:.5g} ms remain open: the start of the motion is not in both "
        "records, or does not tell them apart; give near (--near), a delay known to half a cycle",
        "amplitude": "the camera sees {gain:.4f} +- {error:.4f} times the vibrometer's amplitude: pixel_size "
        "(--pixel-size), sensitivity (--sensitivity) or the plane of focus is wrong; amplitude_from "
        "(--amplitude-from) camera takes the camera's",
    },
)

KINDS_CALIBRATION = table(
    "calibration",
    info={
        "no_check": "as many parameters as measured values: nothing is left to check the model with",
        "unequal_wells": "{told}",
        "assumed_errors": "no standard errors given for {told} assumed, on which the uncertainties rest",
        "damping_differs": "damping ratios from {low:.4g} to {high:.4g}: the model takes one for every mode",
    },
    warning={
        "antisymmetric": "the first frequency about a well of this beam, {frequency:.1f} Hz, belongs to the "
        "antisymmetric mode, which does not depend on the buckling level (above b/r = 6.2, b the buckling level, r "
        "the radius of gyration): say which measured frequencies are symmetric, lower_well_shape (--lower-well "
        "159a,165s), or measure the symmetric one",
        "crossing": "the first two frequencies about a well, {symmetric:.1f} Hz symmetric and {antisymmetric:.1f} Hz "
        "antisymmetric, lie so close that their order may be the other one: say which measured frequencies are "
        "symmetric, lower_well_shape (--lower-well 159a,165s)",
        "undetermined": "{told}",
        "linked": "{told}",
        "vague": "{told} is known to {share:.0%} only",
        "outlier": "{told}: model {model:.4g} Hz, measured {measured:.4g} Hz, {apart:.1f} standard errors apart",
        "scatter": "the data scatter {scatter:.2f} times as much as their standard errors allow; the uncertainties "
        "are raised by it",
    },
)
KINDS_CALIBRATION |= table(
    "contact",
    warning={
        "coarse": "the impacts last {frames:.1f} frames only: record faster for a contact stiffness",
        "few": "{count:.0f} impact(s) of speeds within a factor {span:.2f}: the law of Hertz cannot be checked on them",
    },
    error={
        "exponent": "durations go with the closing speed to the power {exponent:+.2f} +- {error:.2f}, not -0.20: "
        "these are no collisions of two rigid bodies (the beam bends while it is in touch), so they tell no contact "
        "stiffness"
    },
)

KINDS_COMPARISON = table(
    "comparison",
    info={
        "no_start": "without start (--start), and with a shaker that moves from the first sample on, it is not known "
        "which cycle is the first: the runs are aligned within a cycle only",
        "no_shaker": "the shaker was not recorded: start (--start) alone aligns the runs, and its error shifts them; "
        "amplitude and phase of the drive are not compared",
        "gaps": "{share_percent:.0f} % of the compared cycles were not measured",
    },
    warning={
        "shifted": "the shakers are {shift:+.2f} cycles apart counted from the start of each: start (--start) is "
        "wrong, or the drive is of another test; the measured clock was shifted by as much",
        "amplitude": "the measured shaker moves {ratio:.3f} times as far as the simulated one: another test, or "
        "another scale",
        "contradicting": "{points:.0f} measured points have the coordinates of another point and a different class: "
        "they do not count; correct the table",
    },
    error={
        "turned_over": "the simulated shaker moves down where the measured one moves up (correlation "
        "{correlation:.2f} from the start on): the drive was recorded by a vibrometer that is upside down against the "
        "camera; make it again with camera (--camera) or polarity (--polarity) -1",
        "units": "{inside:.0f} of {points:.0f} measured points lie on the map; {fitting:.0f} would, and with its "
        "classes, if {told}: look at the columns of the table and at their units",
    },
)

KINDS_DECAY = table(
    "decay",
    info={
        "release": "the free decay begins at {start:.6g} s; what lies before is left out (start, --start, says "
        "otherwise)",
        "drift": "the zero drifts by {drift_percent:.0f} % of the amplitude; taken out as a polynomial of degree "
        "{degree:.0f}",
        "hum": "a line of {frequency:.3f} Hz with {amplitude_percent:.1f} % of the amplitude does not decay (mains or "
        "a machine); taken out",
        "close_modes": "two modes lie close together, {first:.3f} and {second:.3f} Hz: both are fitted (modes, "
        "--modes, shows both)",
        "damping_law": "beside viscous damping there is {told} damping, {strength:.2f} +- {error:.1g} times as strong "
        "at the start: the damping ratio is that of the viscous part, of vanishing amplitude",
        "damping_curve": "damping depends on amplitude in a free form, {times:.3g} times that of zero amplitude at "
        "the start; no amplitude below {lowest_percent:.2g} % of the first stands out of the noise: the damping ratio "
        "is extrapolated to zero, and its standard error holds the curves that fit",
    },
    warning={
        "clipped": "tops are cut off until {until:.6g} s: the decay is taken from there; choose a larger range",
        "disturbed": "at {at:.6g} s the motion jumps by {jump_percent:.0f} % of its amplitude: a second hit, or a "
        "dropout; only the decay {told} that is used (start, --start, and stop, --stop, choose)",
        "misfit": "the fit leaves {ratio:.1f} times as much near the mode as the noise explains ({share_percent:.1f} "
        "% of the amplitude): something else is in the record; standard errors are raised to what parts of the decay "
        "differ by",
        "parts_differ": "the early and the late half of the decay differ by {frequency_se:.1f} standard errors in "
        "frequency and {damping_se:.1f} in damping; standard errors are raised by that",
        "frequency_drift": "the frequency changes by {share_percent:+.2f} % over the decay in a way that its "
        "amplitude does not: the temperature, or a clamp that creeps; the frequency is that of the start, and the "
        "change is in its standard error",
        "touches": "above {level_percent:.2g} % of the first amplitude the beam touches a stop on one side, as a "
        "shaker not yet drawn back (both the frequency and the damping are higher there): the decay is taken from "
        "{until:.6g} s where enough is left after it, else the difference is in the standard errors",
        "window": "the noise falls with the decay, {factor:.1f} times over the record, as under an exponential window "
        "of {constant:.3g} s: such a window adds {added_percent:.3g} % to the damping ratio, which is in its standard "
        "error; save the record without a window, or give its exponential_window (--exponential-window)",
        "fade": "the noise falls faster and faster, {factor:.1f} times over the record, as under a fade-out: it adds "
        "about {added_percent:.3g} % to the damping ratio, which is in its standard error; save the record without a "
        "window or fade-out, or end it before that (stop, --stop)",
        "hardening": "the frequency rises with amplitude, by {rise_percent:.2g} % at the start ({certain:.0f} "
        "standard errors); about a well a buckled beam softens: the beam is not buckled, or the mode lies above half "
        "the sampling frequency, {half_hz:.5g} Hz, and is seen folded",
        "above_band": "a mode at {frequency:.5g} Hz lies above {limit_hz:.5g} Hz, the sampling frequency over 2.56, "
        "where filters against aliasing still let pass what lies above half of it: it may be {folded:.5g} Hz; record "
        "faster",
        "short": "the record ends with {left_percent:.0f} % of the amplitude left: damping is read from little decay",
        "large": "the frequency changes by {change_percent:.0f} %: leave out the first cycles with start (--start)",
        "faint": "the first mode starts less than 5 times above the noise",
        "undamped": "the damping ratio is not told from zero",
        "off_asked": "frequencies (--frequencies) {asked:.5g} Hz was asked for, the nearest mode is at {found:.5g} Hz",
    },
    error={
        "clipped_throughout": "tops are cut off over nearly the whole decay, so that its damping is not in it; choose "
        "a larger range",
        "hum_asked": "near frequencies (--frequencies) {asked:.5g} Hz there is only a line of {frequency:.4f} Hz that "
        "does not decay",
        "one_sided": "the tops fall towards bottoms that stay level: the signal was rectified or squared, and the "
        "mode has half the frequency, {half_hz:.5g} Hz; record the signal itself",
    },
)

LOSSY_ERROR = 0.15
"""Standard error [px] of an edge in a video that throws detail away; measured 0.06 to 0.14 px."""

KINDS_RECORDING = table(
    "recording",
    info={
        "rate_given": "frame_rate (--frame-rate) = {given:g} Hz is taken, the file says {stated:g} Hz",
        "contradiction": "the header contradicts itself about the step between frames; frame_rate (--frame-rate) = "
        "{given:g} Hz is taken as given",
        "shutter": "a shutter of {stated:g} s cannot be: read as its reciprocal, {exposure_us:.4g} us",
        "no_exposure": "a shutter of {stated:g} s cannot be within a frame of {frame_us:.4g} us: the exposure is not "
        "known",
        "two_exposures": "the header gives exposures of {first_us:.4g} and {second_us:.4g} us; the second is taken",
        "colour": "pictures in {channels:.0f} colours are turned to grey",
    },
    warning={
        "lossy": "the file's compression throws detail away: edges lie 0.06 to 0.14 px off however little they "
        "scatter; standard errors are raised to {error_px:.2f} px; save the recording uncompressed",
        "frames_missing": "{frames:.0f} frame(s) are missing at {places:.0f} place(s), the first after frame "
        "{first:.0f}, by the numbers or time stamps in the file; there the result is NaN, and later times are right",
        "curve": "the camera's settings bend edges (curve of gamma {gamma:g}, edge enhancement {enhance:g}): switch "
        "both off, or undo the curve with gamma (--gamma)",
        "mosaic": "pixels lie under a mosaic of colour filters (levels {spread_percent:.0f} % apart): each kind is "
        "brought to the same mean, which is right for grey things in white light only",
    },
)

KINDS_RESPONSE = table(
    "response",
    warning={
        "incoherent": "no more than {lines:.0f} neighbouring lines are coherent: the excitation is narrow, or the "
        "response is noise; excite by random vibration, an impact or a sweep, or record longer",
        "no_mode": "no mode can be fitted to the peak at {frequency:.5g} Hz: its height may be too small by the "
        "window, and its standard error is that of the noise alone; choose another resolution (--resolution)",
        "coarse": "the line at the peak of {frequency:.5g} Hz is {bias_percent:.2g} % off by the window, which is in "
        "its standard error; the fitted mode has {magnitude:.4g}; choose a smaller resolution (--resolution), or "
        "record longer",
    },
)

KINDS_SIGNAL = table(
    "signal",
    warning={
        "cut_in_number": "{told}, as a copy that was broken off does",
        "cut": "{told}: the header promises {promised:.0f} samples and the file contains {found:.0f}: the file was "
        "cut; copy it again",
        "appended": "{told}: the header promises {promised:.0f} samples and the file contains {found:.0f}: later "
        "records were appended, which need not follow the first without a gap; save each record to a file of its own",
    },
)

KINDS_VIBROMETER = table(
    "vibrometer",
    info={
        "hum": "a line of {frequency:.3f} Hz with {share_percent:.1f} % of the amplitude is there at rest too "
        "(mains); taken out",
        "high_pass_possible": "noise and start do not exclude a high-pass filter (AC coupling) of up to {corner:.3g} "
        "Hz, which would take {loss_percent:.2g} % of the amplitude: {taken_percent:.2g} % is in the standard error; "
        "a sudden start after a longer rest, a longer record or less noise excludes it, and DC coupling or a corner "
        "below {limit:.2g} Hz",
        "slow_start": "the shaker starts so gently that its start is known to {uncertainty_ms:.2g} ms only",
        "no_rest": "the record begins in motion: its start-up is not in it, and a filter of the electronics shows in "
        "the noise alone",
    },
    warning={
        "noisy": "sine to noise and distortion {sinad_db:.1f} dB, not above {limit_db:g} dB: noise",
        "distorted": "sine to noise and distortion {sinad_db:.1f} dB, not above {limit_db:g} dB: distortion",
        "dropout": "{count:.0f} dropout(s) or spike(s), {total_ms:.3g} ms together, the first at {at:.6g} s: left out "
        "of the fit, and bridged by the steady motion in displacement and drive",
        "clipped": "the tops are cut off over {share_percent:.0f} % of the cycle: the amplitude is taken from the "
        "rest of it, with a wider standard error; choose a larger range on the vibrometer",
        "unsteady": "the motion does not stay steady (cycles stray by {stray_percent:.1f} %): the standard error of "
        "the amplitude is that of its parts",
        "second_line": "beside the drive there is a line of {frequency:.4g} Hz with {share_percent:.1f} % of its "
        "amplitude: the shaker moves at two frequencies, or the record holds hum and no rest to tell it by; what it "
        "may pull is in the standard errors",
        "frequency": "the shaker moves at {found:.6g} Hz, not at the frequency (--frequency) of {stated:g} Hz that "
        "was set",
        "amplitude": "the amplitude is {found:.5g}, {share_percent:+.1f} % off the amplitude (--amplitude) of "
        "{stated:.5g} that was set: check range and sensitivity (--sensitivity)",
        "low_pass": "the noise falls steeply from {corner:.3g} Hz on, as behind a low-pass filter: at the drive's "
        "frequency it takes up to {loss_percent:.2g} % of the amplitude, and delays the start by up to {delay_ms:.2g} "
        "ms, which is in the standard errors; switch the filter off, or set it above {wanted:.3g} Hz",
        "crosstalk": "{share_percent:.2g} % of the amplitude is there at the drive's frequency before the start "
        "(crosstalk, or a floor that moves): taken out for the start, and in the standard error of the amplitude; "
        "look at cables and supports",
        "saturated": "the tops are pressed flat as by an amplifier near its limit (third harmonic {third_percent:.2g} "
        "%): the amplitude may be {loss_percent:.2g} % too small, which is in its standard error; choose a larger "
        "range",
        "slew": "the flanks are straight as of electronics with a limited slew rate (third harmonic "
        "{third_percent:.2g} %): the amplitude may be {loss_percent:.2g} % too small, which is in its standard error; "
        "choose a larger range, or a decoder for faster motion",
        "crossover": "small values are suppressed as by an amplifier with a dead zone about zero (third harmonic "
        "{third_percent:.2g} %): the amplitude may be {loss_percent:.2g} % too small, which is in its standard error; "
        "look at the power supply of the amplifier, or record without it",
        "high_pass": "the noise falls below {corner:.3g} Hz as behind a high-pass filter (AC coupling): at the "
        "drive's frequency it may take {loss_percent:.2g} % of the amplitude, which is in its standard error; switch "
        "to DC coupling, or to a corner below {limit:.2g} Hz",
        "notch": "the noise has a hole at {centre:g} Hz as behind a notch filter: at the drive's frequency it may "
        "take {loss_percent:.2g} % of the amplitude, which is in its standard error; switch the filter off",
        "drifts": "the amplitude drifts by {change_percent:.2g} % over the steady part (temperature of shaker or "
        "amplifier, or a start that is not over): half of that is in its standard error; let the shaker warm up, "
        "record longer, or cut the record",
        "beat": "the amplitude changes by {change_percent:.2g} % and the phase bends by {bend:.2g} rad over the "
        "steady part, as where two lines beat that lie closer than one over the length of the record: which is in the "
        "standard errors; record longer",
        "clock_drifts": "the frequency changes by {share_percent:.2g} % over the steady part at a constant amplitude "
        "(the generator, or the clock of the record): half of that is in its standard error; let both warm up, or "
        "record with one clock",
        "hysteresis": "the signal stays behind at every turning point as with play or hysteresis (third harmonic "
        "{third_percent:.2g} %): the amplitude may be {loss_percent:.2g} % too small, which is in its standard error; "
        "look at the mount of the sensor and its amplifier",
        "jitter": "the noise is strongest where the motion is fastest, as with a sampling clock that jitters by "
        "{jitter_us:.3g} us: it takes {loss_percent:.2g} % of the amplitude, which is in its standard error; use the "
        "clock of the converter",
        "few_bits": "the record has {levels:.0f} levels only, {steps:.2g} of them to the amplitude: their rounding is "
        "in the standard error; choose a smaller range",
        "interpolated": "the samples were put in between others, {each:.2g} of them to a cycle: straight lines or "
        "steps take {loss_percent:.2g} % of the amplitude, which is in its standard error; take the samples as they "
        "were recorded",
    },
    error={
        "dropout_in_start": "a dropout of {total_ms:.3g} ms in the start-up at {at:.6g} s: what the shaker did there "
        "is not known, so no drive can be made of this record",
        "interrupted": "the motion stops and begins again: {outside_ms:.3g} ms of it lie outside the longest stretch, "
        "and are not in its start-up or its displacement; cut the record, or record again",
        "samples_lost": "{lost:.0f} of every {every:.0f} samples are lost: the time axis is too short, and the "
        "frequency {share_percent:.2g} % too high, which is in its standard error; record with a slower rate or a "
        "faster disk",
        "gain": "at {at:.6g} s the amplitude changes {ratio:.3g} times from one constant to another (a range that was "
        "switched): which of them is right is not in the record, and the difference is in the standard error; cut the "
        "record there or record again with one range",
        "sign": "at {at:.6g} s the sign of the signal changes: which of them is right is not in the record; cut the "
        "record there",
        "one_sided": "the mean moves by {share:.2g} times the amplitude when the motion starts, so this is no "
        "velocity or displacement of a shaker: rectified or squared, with half its frequency; record the signal itself",
        "not_there": "at the frequency (--frequency) of {stated:g} Hz there is hardly any motion; the highest line is "
        "at {found:.6g} Hz: another frequency, another channel (--channel), or a rectified or squared signal",
        "beyond_shakers": "{told}, more than electrodynamic shakers can do (the motion has {speed:.3g} m/s, "
        "{acceleration_g:.3g} g, {travel_mm:.3g} mm): check the unit (units, --units; mm/s may have been read as m/s) "
        "and sensitivity (--sensitivity)",
        "clocks": "the shaker moves at {own:.6g} Hz, its acceleration (--acceleration) at {other:.6g} Hz, {ratio:.4g} "
        "times as fast: another test, or a sampling frequency (sampling_frequency, --sampling-frequency) of one "
        "record is wrong",
        "acceleration": "acceleration (--acceleration) is {ratio:.4g} times what belongs to this motion: {told}",
    },
)
