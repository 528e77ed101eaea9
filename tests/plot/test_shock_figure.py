"""Figure of a run without cycles: seconds, the base's acceleration, and the power of a harvester beside it."""

from __future__ import annotations

import numpy as np
import pytest

import snapbeam as sb


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:harvester")
@pytest.mark.filterwarnings("ignore:.*lowest mode about")
def test_a_shock_with_a_harvester():
    """The acceleration has its stated peak; the mean power lies in its own panel, over the last quarter of the time."""
    beam = sb.Beam(length=0.3, thickness=4e-4, width=0.02, density=7850.0, young_modulus=2e11, buckling_level=5e-4)
    circuit = sb.PiezoelectricHarvester(moment_per_volt=-1e-4, capacitance=7e-7, resistance=1e4, patch_end=0.25)
    base = sb.BaseExcitation(motion=sb.Shock(acceleration_g=5.0, duration_ms=40.0), direction="up")
    model = sb.ReducedModel.from_beam(beam, 1, damping_ratio=0.05)
    system = sb.System(model, base_excitation=base, harvesters=[circuit])
    run = sb.simulate(system, sb.Integration(cycles=10))
    axes = sb.plot.plot_run(run).figure.axes
    labels = [ax.get_ylabel() for ax in axes]
    shock = axes[next(i for i, label in enumerate(labels) if "acceleration" in label)]
    assert shock.lines[0].get_ydata().max() == pytest.approx(5.0, rel=0.01)
    power = axes[next(i for i, label in enumerate(labels) if "Power" in label)]
    mean = next(line for line in power.lines if "mean" in str(line.get_label()))
    end = float(run.dataset["time"][-1])
    unit = {"ms": 1e-3, "s": 1.0}[axes[labels.index(shock.get_ylabel())].get_xlabel()[6:-1]]
    np.testing.assert_allclose(np.array(mean.get_xdata()) * unit, [0.75 * end, end], rtol=0.01)
    assert not any("mean" in str(line.get_label()) for line in shock.lines)
