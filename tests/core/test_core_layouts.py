"""One text, several layouts: a lane of a pack is a run alone to the bit, whatever its neighbours, threads and order."""

from __future__ import annotations

import numpy as np
import pytest
from core_systems import arrays, crowded, struck

import snapbeam as sb
from snapbeam import _core
from snapbeam.solver import native

SETS = _core.instruction_sets()
RATIOS = np.linspace(0.6, 2.2, 11)


def integrated(system, layout, which, threads=1, points=RATIOS, order=None, cycles=2):
    """Statistics of the runs and of their channels."""
    found = arrays(system, cycles, {"drive.frequency_ratio": points})
    if order is not None:
        found.batch["order"] = np.asarray(order, np.int32)
    _core.integrate(found.problem, found.batch, layout, which, threads, None)
    return found.batch["statistics"], found.batch["of_channels"]


def same(one, other, rows=slice(None)):
    return all(np.array_equal(a, b[rows], equal_nan=True) for a, b in zip(one, other, strict=True))


@pytest.mark.sampled(2)
@pytest.mark.parametrize("which", SETS)
@pytest.mark.parametrize("modes", [1, 2, 5, 8])
@pytest.mark.parametrize("made", [struck, crowded], ids=["struck", "crowded"])
def test_lanes_of_runs_and_single_runs_have_the_same_bits(made, modes, which):
    whole = integrated(made(modes), "runs", which)
    assert same(integrated(made(modes), "thread", which), whole)
    assert (whole[0][:, native.OF_CORE.index("status")] == 0).all()


@pytest.mark.parametrize("layout", ["runs", "modes", "thread"])
@pytest.mark.parametrize("made", [struck, crowded], ids=["struck", "crowded"])
def test_neighbours_threads_and_order_change_no_bit(made, layout):
    system = made(3)
    whole = integrated(system, layout, "")
    assert same(integrated(system, layout, "", threads=3), whole)
    assert same(integrated(system, layout, "", order=np.arange(RATIOS.size)[::-1]), whole)
    alone = integrated(system, layout, "", points=RATIOS[4:5])
    assert same(alone, (whole[0][4:5], whole[1][4:5]))


LOADED = {"axial_load": sb.AxialLoadModulation(motion=sb.HarmonicForce(frequency_ratio=2.0, amplitude=3.0))}
NOISY = {
    "base_excitation": sb.BaseExcitation(motion=sb.BandLimitedNoise(low_ratio=0.5, high_ratio=3.0, velocity_rms=0.05))
}


@pytest.mark.parametrize("parts", [LOADED, LOADED | NOISY], ids=["load", "load and noise"])
def test_neighbours_change_no_bit_of_runs_that_change_wells(parts):
    """Signals are taken from the time again in some runs of a pack, and the tension about another well in others."""
    system, points = struck(8, **parts), np.linspace(0.3, 3.5, 24)
    whole = integrated(system, "runs", "", points=points, cycles=20)
    assert (whole[0][:, native.OF_CORE.index("zero_crossings")] > 10).any()
    assert same(integrated(system, "runs", "", points=points, cycles=20, order=np.arange(24)[::-1]), whole)
    assert same(integrated(system, "thread", "", points=points, cycles=20), whole)


@pytest.mark.parametrize("which", SETS)
@pytest.mark.parametrize("modes", [1, 4, 8, 16, 32])
def test_layouts_agree_within_rounding(modes, which):
    """Over two cycles, in which the paper's motion enlarges rounding at most a million times."""
    found = {
        layout: integrated(struck(modes), layout, which, points=RATIOS[:3]) for layout in ("runs", "modes", "thread")
    }
    columns = [
        native.OF_CORE.index(name)
        for name in ("max_displacement", "min_center", "energy", "dissipated", "square_velocity")
    ]
    for layout in ("runs", "modes"):
        np.testing.assert_allclose(found[layout][0][:, columns], found["thread"][0][:, columns], rtol=1e-8, atol=1e-18)


def test_a_set_that_is_not_present_is_refused():
    found = arrays(struck(1))
    with pytest.raises(ValueError, match="instruction set 'neon2'"):
        _core.integrate(found.problem, found.batch, "runs", "neon2", 1, None)
    with pytest.raises(ValueError, match="layout 'rows'"):
        _core.integrate(found.problem, found.batch, "rows", "", 1, None)
