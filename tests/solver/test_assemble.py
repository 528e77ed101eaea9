"""From a system to an ensemble: modal numbers without a layout, and time in ticks."""

from __future__ import annotations

import math

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.solver.assemble import make_ensemble
from snapbeam.solver.structure import structure_of
from snapbeam.util.validation import InputError

MODEL = sb.ReducedModel.from_beam(default_values.BEAM, modes=5)
SYSTEM = sb.System(
    MODEL, contacts=[sb.Contact(default_values.CONTACT, sb.Shaker(frequency_ratio=1.21, velocity_amplitude=0.18))]
)


@pytest.mark.parametrize("side", ["below", "above"])
def test_structure_is_the_model_about_its_well(side: str) -> None:
    """The equations of a structure, in q, are Eq. (11) in alpha: the energy of any state is the same."""
    structure = structure_of(MODEL, side)
    sign = 1.0 if side == "below" else -1.0
    np.testing.assert_array_equal(structure.equilibrium, sign * MODEL.well_amplitude)
    rng = np.random.default_rng(0)
    alpha = 1e-3 * rng.normal(size=(4, 5))
    velocity = rng.normal(size=(4, 5))
    both = [structure.to_modal(*each) for each in zip(alpha, velocity, strict=True)]
    q, p = (np.array(part) for part in zip(*both, strict=True))
    np.testing.assert_allclose(structure.amplitudes(q), alpha, rtol=0.0, atol=1e-16)
    np.testing.assert_allclose(structure.velocities(p), velocity, rtol=1e-10)
    gq, r = q @ structure.well, q @ structure.coupling
    qr = (q * r).sum(axis=1)
    energy = 0.5 * ((p**2) + (structure.omega * q) ** 2).sum(axis=1)
    energy = energy + structure.nonlinear_stiffness * qr * (gq + 0.25 * qr)
    expected = MODEL.kinetic_energy(velocity) + MODEL.potential_energy(alpha) - MODEL.well_energy
    np.testing.assert_allclose(energy, expected, rtol=1e-9)
    # the centre, and the other well
    center = structure.center_rest + q @ structure.center
    np.testing.assert_allclose(center, sign * (alpha @ MODEL.midspan_shape), rtol=0.0, atol=1e-16)
    np.testing.assert_allclose(structure.amplitudes(structure.shift), -structure.equilibrium, rtol=1e-9, atol=1e-16)


def test_structures_are_told_apart_by_their_numbers() -> None:
    hashes = {
        structure_of(model, side).hash
        for model in (MODEL, sb.ReducedModel.from_beam(default_values.BEAM, 5, damping_ratio=0.01))
        for side in ("below", "above")
    }
    assert len(hashes) == 4
    assert structure_of(MODEL, "below").hash == structure_of(MODEL, "below").hash


def test_ticks_make_whole_periods() -> None:
    ensemble = make_ensemble(SYSTEM, sb.Integration(cycles=7), {"drive.frequency_ratio": np.array([0.3, 1.0, 3.7])})
    runs = ensemble.runs
    period = 1.0 / (MODEL.reference_frequency * np.array([0.3, 1.0, 3.7]))
    np.testing.assert_allclose(runs["period"] * runs["tick"], period, rtol=1e-15)
    np.testing.assert_array_equal(runs["period"] % runs["step"], 0)
    np.testing.assert_array_equal(runs["end"], 7 * runs["period"])
    np.testing.assert_array_equal(runs["last_quarter"], runs["end"] // 4 * 3)
    assert ensemble.cycles == 7.0
    ensemble = make_ensemble(SYSTEM, sb.Integration(), periods=2.5)
    assert ensemble.runs["output_interval"][0] == ensemble.runs["period"][0]
    assert ensemble.runs["end"][0] == ensemble.runs["period"][0] * 2.5


def test_the_tip_touches_unless_a_gap_is_given() -> None:
    def offset(**changes) -> float:
        return float(make_ensemble(SYSTEM.replace(**changes), sb.Integration(cycles=1)).runs["offset"][0, 0])

    assert offset() == 0.0
    stroke = 0.18 / 1.21 * default_values.BEAM.buckling_level
    assert offset(**{"drive.phase": 0.5}) == pytest.approx(-stroke * math.sin(0.5), rel=1e-12)
    assert offset(**{"contact.gap": 1e-4}) == -1e-4
    assert offset(**{"contact.gap": -1e-5}) == 1e-5
    for side, sign in (("below", 1.0), ("above", -1.0)):
        given = {"contact.side": side}
        struck = SYSTEM.replace(**given)
        rest = sign * float(MODEL.shape_at(default_values.LOCATION) @ MODEL.well_amplitude)
        placed = struck.replace(**{"initial_state.striker_position": rest - sign * 2e-5})
        found = make_ensemble(placed, sb.Integration(cycles=1)).runs["offset"][0, 0]
        assert found == pytest.approx(-2e-5, rel=1e-9), side


def test_a_column_that_is_the_systems_own_changes_nothing() -> None:
    integration = sb.Integration(cycles=2)
    alone = make_ensemble(SYSTEM, integration)
    for name in ("drive.frequency_ratio", "contact.location", "contact.stiffness", "drive.phase"):
        same = make_ensemble(SYSTEM, integration, {name: np.full(2, SYSTEM.get(name))})
        assert same.size == 2
        for column in alone.runs.dtype.names:
            if column not in ("start_row",):
                np.testing.assert_array_equal(same.runs[column], alone.runs[column][[0, 0]], err_msg=column)


def test_an_ensemble_holds_no_layout() -> None:
    """Modes are counted as the model counts them; padding is an engine's own affair."""
    ensemble = make_ensemble(SYSTEM, sb.Integration(cycles=1), {"contact.location": np.array([0.3, 0.4, 0.3])})
    assert ensemble.structure.omega.shape == (5,)
    assert ensemble.starts.shape == (1, 2, 5)
    assert ensemble.contact_rows.shape == (2, 5)
    assert ensemble.runs["contact_row"].tolist() == [[0], [1], [0]]
    for i, location in enumerate((0.3, 0.4, 0.3)):
        row = ensemble.contact_rows[ensemble.runs["contact_row"][i, 0]]
        np.testing.assert_array_equal(row, MODEL.linear_modes.T @ MODEL.shape_at(location))


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ({"beam.thickness": np.array([1e-4])}, r"beam\.thickness: no parameter that may differ between the runs"),
        ({"contact.coefficient": np.array([0.5])}, r"contact\.coefficient: no parameter that may differ"),
    ],
)
def test_refusals(points, message: str) -> None:
    with pytest.raises(InputError, match=message):
        make_ensemble(SYSTEM, sb.Integration(cycles=1), points)


def test_more_steps_than_can_be_counted() -> None:
    with pytest.raises(InputError, match=r"makes .* steps, must be at most 2\.2e\+12"):
        make_ensemble(SYSTEM.replace(**{"drive.frequency_ratio": 1e-5}), sb.Integration(cycles=10**7, step=1e-7))
