"""The CUDA engine: in the simulator against the CPU engine, compiled for a device, and who is refused."""

from __future__ import annotations

import dataclasses
import sys

import numpy as np
import pytest
from cuda_simulator import Job, march_in_simulator

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.solver import registry as engines
from snapbeam.solver.assemble import make_ensemble
from snapbeam.solver.cpu import driver as cpu_engine
from snapbeam.solver.ensemble import Ensemble
from snapbeam.util.status_codes import RunStatus
from snapbeam.util.validation import InputError

pytest.importorskip("numba_cuda", reason="the CUDA engine needs numba-cuda")

from snapbeam.solver.cuda import driver as cuda_engine
from snapbeam.solver.cuda.driver import Options
from snapbeam.solver.cuda.layout import device_structure, launch_bounds

CONTACT = sb.HertzContact(stiffness=4e8)


def ensemble_of(modes, ratio, velocity, cycles, accuracy="standard", location=1 / 2.1, **options) -> Ensemble:
    """Runs of the paper's beam, for a whole number of cycles or a part of one."""
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=modes, damping_ratio=0.005)
    ratio, velocity = np.atleast_1d(ratio).astype(float), np.atleast_1d(velocity).astype(float)
    system = sb.System(
        model,
        contacts=[
            sb.Contact(CONTACT, sb.Shaker(frequency_ratio=1.0, velocity_amplitude=0.0, location=location))
        ],
    )
    ensemble = make_ensemble(
        system,
        sb.Integration(cycles=max(1, int(cycles)), accuracy=accuracy, **options),
        {"drive.frequency_ratio": ratio, "drive.velocity_amplitude": velocity},
    )
    if cycles < 1:
        runs = ensemble.runs.copy()
        runs["end"] = (runs["period"] * cycles).astype(np.int64)
        runs["output_interval"], runs["last_quarter"] = runs["end"], runs["end"] // 4 * 3
        ensemble = dataclasses.replace(ensemble, runs=runs)
    return ensemble


def _absurd(ensemble: Ensemble) -> Ensemble:
    return dataclasses.replace(ensemble, law_numbers=np.full_like(ensemble.law_numbers, 1e250))


PAIR = ensemble_of(1, [1.21, 1.6], [0.18, 0.4], 1)
JOBS = {
    "one mode": Job(PAIR),
    "slices of seven steps, two blocks": Job(PAIR, Options(most_blocks=2, fewest_threads=1), 7),
    "two modes": Job(ensemble_of(2, 3.0, 0.5, 0.3)),
    "a block of sixteen": Job(ensemble_of(2, 1.6, 0.4, 0.04), Options(1, fewest_threads=16)),
    "sixth order": Job(ensemble_of(1, 3.5, 0.5, 0.1, accuracy="reference")),
    "decided": Job(ensemble_of(1, 1.4 + 26 / 110 * 5, 0.1 + 5 / 22, 20, early_termination=True)),
    "step limit": Job(dataclasses.replace(ensemble_of(1, 1.6, 0.4, 1), max_steps=5)),
    "not finite": Job(_absurd(ensemble_of(1, 1.6, 0.4, 1))),
}


@pytest.fixture(scope="module")
def simulated():
    return dict(zip(JOBS, march_in_simulator(list(JOBS.values())), strict=True))


@pytest.mark.parametrize("name", ["one mode", "two modes", "a block of sixteen", "sixth order", "decided"])
def test_same_run_as_the_cpu_engine_to_round_off(simulated, name):
    """Over the first impacts every event falls on the same tick, and every number agrees to 1e-9 of it."""
    accumulators_of_runs, _ = simulated[name]
    expected = cpu_engine.run_ensemble(JOBS[name].ensemble)
    assert (accumulators_of_runs["steps"] >= 5).all()
    for column in expected.dtype.names:
        if expected.dtype[column].kind == "i":
            np.testing.assert_array_equal(accumulators_of_runs[column], expected[column], err_msg=column)
        else:
            np.testing.assert_allclose(
                accumulators_of_runs[column], expected[column], rtol=1e-9, atol=1e-18, err_msg=column
            )


def test_the_cases_hold_what_they_are_for(simulated):
    accumulators_of_runs, _ = simulated["one mode"]
    assert accumulators_of_runs["impacts"].tolist() == [2, 1]
    assert accumulators_of_runs["zero_crossings"].tolist() == [0, 1], (
        "one run snaps through, and changes its well"
    )
    assert (accumulators_of_runs["peak_force"] > 1.0).all()
    accumulators_of_runs, _ = simulated["decided"]
    assert accumulators_of_runs["status"][0] == RunStatus.EARLY_STOP
    assert np.isfinite(accumulators_of_runs["early_stop_time"][0])


def test_runs_do_not_depend_on_slices_or_blocks(simulated):
    """Laid down every seven steps and taken up again, beside another run: the same bits."""
    whole, sliced = simulated["one mode"], simulated["slices of seven steps, two blocks"]
    assert sliced[0].tobytes() == whole[0].tobytes()
    assert sliced[1] == [(1, 2), (2, 2)], "progress is told as runs end"


def test_bad_ends_have_a_status(simulated):
    accumulators_of_runs = simulated["step limit"][0]
    assert accumulators_of_runs["status"][0] == RunStatus.STEP_LIMIT
    assert accumulators_of_runs["steps"][0] == 5
    assert simulated["not finite"][0]["status"][0] == RunStatus.DIVERGED


@pytest.mark.parametrize("modes", [1, 2, 9, 32, 50, 128])
def test_device_structure_holds_the_whole_tension(modes):
    """Each thread's column of G, against the q it reads from shared memory, makes G q."""
    ensemble = ensemble_of(modes, 1.0, 0.1, 1)
    structure = device_structure(ensemble)
    q = np.random.default_rng(5).normal(size=modes)
    threads = structure.across(q)
    shared = np.zeros(2 * structure.threads + structure.columns)
    shared[structure.places[0]] = threads
    near = shared[structure.places[1][:, None] + np.arange(structure.columns)]
    product = structure.back(np.sum(structure.coupling.T * near, axis=1))
    expected = ensemble.structure.coupling @ q
    np.testing.assert_allclose(product, expected, rtol=1e-12, atol=1e-12 * np.abs(expected).max())
    assert structure.threads >= 16
    assert np.unique(structure.places[0]).size == structure.threads, "no two modes in one place"


def test_the_engine_says_why_not(monkeypatch):
    monkeypatch.setattr(cuda_engine, "_unusable", lambda: "no CUDA device was found")
    with pytest.raises(InputError, match=r"engine = 'cuda': no CUDA device was found; use engine='cpu'"):
        engines.resolve("cuda")
    assert engines.resolve("auto", runs=10**6, cycles=1000)[0] == "cpu"
    with pytest.raises(InputError, match="no CUDA device"):
        cuda_engine.run_ensemble(PAIR)
    with pytest.raises(InputError, match="'auto', 'cpu', 'cuda'"):
        engines.resolve("gpu")


def test_auto_takes_a_device_only_where_it_pays(monkeypatch):
    monkeypatch.setattr(cuda_engine, "_unusable", lambda: None)
    monkeypatch.setattr(cuda_engine, "simulated", lambda: False)
    big = {"runs": 52_000, "cycles": 1000, "modes": 32}
    assert engines.resolve("auto", **big)[0] == "cuda"
    assert engines.resolve("cuda")[0] == "cuda"
    for less in (
        {"runs": 1999},
        {"cycles": 38},
        {"modes": 129},
        {"law": sb.Restitution},
        {"drive": sb.RecordedMotion},
    ):
        assert engines.resolve("auto", **(big | less))[0] == "cpu", less
    with pytest.raises(InputError, match="more than its 128"):
        engines.resolve("cuda", modes=129)
    with pytest.raises(InputError, match="restitution"):
        engines.resolve("cuda", law=sb.Restitution)
    monkeypatch.setattr(cuda_engine, "simulated", lambda: True)
    assert engines.resolve("auto", **big)[0] == "cpu", "nobody wants a map from the simulator"


@pytest.mark.slow
@pytest.mark.parametrize(("order", "threads", "columns"), [(4, 32, 16), (6, 128, 64)])
def test_the_kernel_compiles_for_a_device(monkeypatch, order, threads, columns):
    """To PTX, without a device: no array of a thread may end up in memory, and no sine in a library."""
    from numba import cuda, float64

    from snapbeam.solver.cuda.integrate import integrate_kernel, signature

    def nothing(x):
        x[0] = 0.0

    try:
        cuda.compile(nothing, (float64[::1],), device=False, cc=(9, 0), abi="numba", output="ptx")
    except Exception as error:
        pytest.skip(f"the CUDA compilers are not here: {error}")

    class Device:
        compute_capability = (9, 0)

    kernel = integrate_kernel(order, threads, columns, 6)
    monkeypatch.setattr(sys.modules[type(kernel).__module__], "get_current_device", lambda: Device)
    ptx, _ = cuda.compile(
        kernel.py_func,
        signature(sb.HertzContact, sb.Sine),
        device=False,
        cc=(9, 0),
        abi="numba",
        output="ptx",
        launch_bounds=launch_bounds(threads, columns),
    )
    assert f".maxntid {threads}" in ptx
    assert ptx.count("fma.rn.f64") > 100
    for unwanted in ("ld.local", "st.local", "__nv_sin", "__nv_cos", "__nv_pow"):
        assert unwanted not in ptx
    assert ("bar.sync" in ptx) == (threads > 32), "one warp needs no barrier of the block"
