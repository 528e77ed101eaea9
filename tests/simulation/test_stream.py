"""A run that is written while it goes on is the run that is saved when it is over."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from test_save import CASES

import snapbeam as sb
from snapbeam.util.validation import InputError, InputTypeError

QUICK = ("recorded", "failed")


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if name in QUICK else pytest.mark.slow) for name in CASES]
)
def test_is_what_save_writes(name: str, tmp_path) -> None:
    system, integration = CASES[name]
    outcome = sb.simulate_to_file(system, integration, path=tmp_path / "run.nc")
    assert [file.name for file in tmp_path.iterdir()] == ["run.nc"]
    same(sb.load(tmp_path / "run.nc"), sb.simulate(system, integration), outcome)


def test_in_many_pieces(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr("snapbeam.simulation.stream._CHUNK", 1000)
    monkeypatch.setattr("snapbeam.simulation.stream._KEPT_BACK", 300)
    system, integration = CASES["plain"][0], sb.Integration(cycles=60)
    outcome = sb.simulate_to_file(system, integration, path=tmp_path / "run.nc")
    same(sb.load(tmp_path / "run.nc"), sb.simulate(system, integration), outcome)


def test_instants_asked_for(tmp_path) -> None:
    system, integration = CASES["plain"]
    times = np.linspace(0.0, 0.01, 50)
    sb.simulate_to_file(system, integration, path=tmp_path / "run.nc", sample_times=times)
    found = sb.load(tmp_path / "run.nc").dataset
    expected = sb.simulate(system, integration, sample_times=times).dataset
    np.testing.assert_array_equal(found.time, times)
    np.testing.assert_allclose(found.displacement_at_striker, expected.displacement_at_striker, rtol=1e-13)


def same(found: sb.Run, expected: sb.Run, outcome: sb.RunSummary) -> None:
    """But for the last digit of what is summed over modes, which hangs on how many samples are summed at a time."""
    assert set(found.dataset.variables) == set(expected.dataset.variables)
    for name, variable in expected.dataset.variables.items():
        values, largest = found.dataset[name].values, np.nanmax(np.abs(variable.values), initial=0.0)
        np.testing.assert_allclose(values, variable.values, rtol=1e-13, atol=1e-14 * largest, err_msg=name)
        assert found.dataset[name].attrs == variable.attrs
    np.testing.assert_array_equal(found.impacts.to_array(), expected.impacts.to_array())
    np.testing.assert_equal(dict(found.summary), dict(expected.summary))
    np.testing.assert_equal(dict(outcome), dict(expected.summary))
    attrs = {key: value for key, value in expected.dataset.attrs.items() if key not in ("created", "command")}
    for key, value in attrs.items():
        np.testing.assert_equal(found.dataset.attrs[key], value, err_msg=key)
    assert found.system == expected.system and found.integration == expected.integration
    assert found.accuracy == expected.accuracy and (found.final_state is None) == (expected.final_state is None)
    if expected.final_state is not None and found.final_state is not None:
        np.testing.assert_array_equal(found.final_state.amplitude, expected.final_state.amplitude)
        np.testing.assert_array_equal(found.final_state.velocity, expected.final_state.velocity)


def test_refusals(tmp_path) -> None:
    system, integration = CASES["plain"]
    with pytest.raises(InputError, match=r"path = '.*run.txt'"):
        sb.simulate_to_file(system, integration, path=tmp_path / "run.txt")
    with pytest.raises(InputTypeError, match="system = 3: must be a System"):
        sb.simulate_to_file(3, path=tmp_path / "run.nc")
    with pytest.raises(InputError, match="samples is too long to record"):
        sb.simulate_to_file(system, sb.Integration(cycles=10**7, max_steps=10**12), path=tmp_path / "run.nc")
    assert not list(tmp_path.iterdir())


def test_what_a_run_in_memory_refuses_is_refused(tmp_path) -> None:
    """A beam to which nothing happens."""
    still = sb.System(CASES["plain"][0].model)
    for call in (sb.simulate, lambda system: sb.simulate_to_file(system, path=tmp_path / "run.nc")):
        with pytest.raises(InputError, match="without a striker the beam needs an initial_state"):
            call(still)
    assert list(tmp_path.iterdir()) == []


def test_a_run_that_is_stopped_leaves_nothing(tmp_path) -> None:
    def stop(share: float) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sb.simulate_to_file(CASES["plain"][0], sb.Integration(cycles=2000), path=tmp_path / "run.nc", progress=stop)
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_memory_does_not_grow_with_what_a_sample_holds(tmp_path) -> None:
    code = f"""
import resource, snapbeam as sb
from snapbeam.model import default_values
model = sb.ReducedModel.from_beam(default_values.BEAM, modes=32)
system = sb.System(model, contacts=[sb.Contact(default_values.CONTACT, sb.Shaker(frequency_ratio=1.21, velocity_amplitude=0.18))])
def peak():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
sb.simulate_to_file(system, sb.Integration(cycles=20), path={str(tmp_path / "short.nc")!r})
before = peak()
sb.simulate_to_file(system, sb.Integration(cycles=3000), path={str(tmp_path / "long.nc")!r})
print(before, peak())
"""
    said = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout
    before, after = map(float, said.split())
    size = sb.load(tmp_path / "long.nc").dataset.nbytes
    assert size > 3e8 and after - before < 2.5e8, (size, before, after)
