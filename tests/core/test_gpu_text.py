"""The kernels for a GPU: they compile for two architectures, and run on the CPU, one thread, with the bits of the native core."""

from __future__ import annotations

import ctypes
import dataclasses
import platform
import subprocess
from types import SimpleNamespace

import numpy as np
import pytest

import snapbeam as sb
from snapbeam import _core
from snapbeam.model import default_values
from snapbeam.solver import cuda, native
from snapbeam.solver.assemble import make_ensemble
from snapbeam.util.validation import InputError

HOST = r"""
#include <math.h>
#include <string.h>
#define __CUDACC_RTC__ 1
#define __global__
#define __shared__ static
#define __launch_bounds__(threads)
#define __noinline__ __attribute__((noinline))
#define __forceinline__ inline __attribute__((always_inline))
#undef INFINITY
#undef NAN
static struct { int x; } threadIdx{0}, blockIdx{0}, gridDim{1}, blockDim{1};
static inline int __syncthreads_or(int any) { return any; }
static inline void __syncthreads() {}
static inline int atomicAdd(int *at, int more) { const int old = *at; *at += more; return old; }
static inline double __longlong_as_double(long long bits) { double x; memcpy(&x, &bits, 8); return x; }
"""
"""The words of CUDA for one thread of the CPU."""


class HostMemory:
    """What :class:`snapbeam.solver.cuda._Memory` does, with memory of the host."""

    def __init__(self):
        self.held = []

    def room(self, size):
        self.held.append(np.zeros(size + 64, dtype=np.uint8))
        return self.held[-1].ctypes.data + -self.held[-1].ctypes.data % 64

    def put(self, values):
        at = self.room(values.nbytes)
        ctypes.memmove(at, values.ctypes.data, values.nbytes)
        return at

    def get(self, at, values):
        ctypes.memmove(values.ctypes.data, at, values.nbytes)

    def launch(self, kernel, blocks, threads, *arguments):
        assert blocks == threads == 1
        kernel.function(*(each.item() for each in arguments))

    def close(self):
        self.held.clear()


@pytest.fixture
def host(monkeypatch, tmp_path):
    """Kernels of a GPU on the CPU."""

    def compiled(architecture, defined):
        text, module = tmp_path / "kernel.cpp", tmp_path / "kernel.so"
        text.write_text(HOST + cuda.source(), encoding="utf-8")
        fused = ["-mfma"] if {"avx2", "avx512"} & set(_core.instruction_sets()) else []
        macros = [f"-D{name}={value}" for name, value in defined.items()]
        words = ["g++", "-std=c++20", "-O1", "-ffp-contract=off", *fused, "-w", "-fPIC", "-shared", *macros]
        try:
            subprocess.run([*words, str(text), "-o", str(module)], check=True)
        except FileNotFoundError:
            pytest.skip("g++ was not found")
        library = ctypes.CDLL(str(module))
        types = {
            "sizes": [ctypes.c_uint64],
            "begin_runs": [ctypes.c_uint64] * 3,
            "go_on": [ctypes.c_uint64, ctypes.c_uint64, ctypes.c_int, ctypes.c_int],
        }

        def kernel(name):
            function = getattr(library, name)
            function.argtypes, function.restype = types[name], None
            occupancy = SimpleNamespace(max_active_blocks_per_multiprocessor=lambda threads, shared: 1)
            return SimpleNamespace(function=function, occupancy=occupancy)

        return SimpleNamespace(get_kernel=kernel)

    card = SimpleNamespace(arch="90", properties=SimpleNamespace(multiprocessor_count=1))
    for name, value in (("_Memory", HostMemory), ("compiled", compiled), ("_device", lambda: card), ("_BLOCK", 1)):  # fmt: skip
        monkeypatch.setattr(cuda, name, value)
    monkeypatch.setenv("SNAPBEAM_LAYOUT", "thread")


def striker(law=default_values.CONTACT, amplitude=0.25, **given):
    return sb.Contact(law, sb.Shaker(frequency_ratio=1.2, velocity_amplitude=amplitude), **given)


def beam(modes):
    return sb.ReducedModel.from_beam(default_values.BEAM, modes=modes, damping_ratio=0.005)


CHIRP = sb.Chirp(start_ratio=0.5, stop_ratio=2.0, velocity_amplitude=0.1, sweep_cycles=4.0)
NOISE = sb.BandLimitedNoise(low_ratio=0.5, high_ratio=3.0, velocity_rms=0.02, seed=3)
SYSTEMS = {
    "one mode": lambda: sb.System(beam(1), contacts=[striker()]),
    "modes in registers": lambda: sb.System(beam(4), contacts=[striker()]),
    "two laws, a circuit and a spring": lambda: sb.System(
        beam(5),
        contacts=[
            striker(sb.KelvinVoigt(2.3e5, 2.0)),
            sb.Contact(default_values.CONTACT, sb.Striker(drive=sb.FixedStop(), side="above", gap=1e-4, location=0.7)),
        ],
        forces=[sb.LocalSpring(stiffness=20.0, location=0.3)],
        harvesters=[sb.PiezoelectricHarvester(moment_per_volt=1e-4, capacitance=3e-7, resistance=1e4)],
    ),
    "noise and a chirp on the base": lambda: sb.System(
        beam(2),
        contacts=[striker(), sb.Contact(default_values.CONTACT, sb.Striker(drive=CHIRP, side="above", gap=1e-4))],
        base_excitation=sb.BaseExcitation(motion=NOISE, striker_on_base=False),
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", SYSTEMS)
def test_a_thread_has_the_bits_of_the_native_core(name, host):
    system = SYSTEMS[name]()
    axes = {"drive.velocity_amplitude": np.linspace(0.1, 0.5, 5)}
    found = {engine: sb.sweep(system, axes, sb.Integration(cycles=12, engine=engine)) for engine in ("native", "cuda")}
    assert found["cuda"].attrs["engine"] == "cuda"
    fused = _core.instruction_sets()[0] != "baseline" or platform.machine() in ("aarch64", "arm64")
    for variable in found["native"].data_vars:
        one, other = (found[engine][variable].values for engine in ("native", "cuda"))
        if fused:
            np.testing.assert_array_equal(one, other, err_msg=str(variable))
    classes = [found[engine].response_class.values for engine in ("native", "cuda")]
    np.testing.assert_array_equal(*classes)


@pytest.mark.slow
def test_states_at_the_end(host):
    ensemble = make_ensemble(sb.System(beam(2), contacts=[striker()]), sb.Integration(cycles=3))
    one, other = (
        native.integrate_with_output_states(dataclasses.replace(ensemble, on_gpu=gpu)) for gpu in (False, True)
    )
    np.testing.assert_array_equal(one.q, other.q)
    assert np.isfinite(one.q).all()


@pytest.mark.slow
@pytest.mark.parametrize("architecture", ["sm_80", "sm_90"])
@pytest.mark.parametrize("name", SYSTEMS)
def test_kernels_compile_without_a_gpu(name, architecture):
    pytest.importorskip("cuda.core", reason="the extra cuda is not installed")
    problem = native._Arrays(make_ensemble(SYSTEMS[name](), sb.Integration(cycles=1))).problem
    program = cuda.compiled(architecture, cuda.definitions(problem))
    assert {b"sizes", b"begin_runs", b"go_on"} <= set(program.code.split(b"\0"))


def test_without_a_gpu_the_engine_is_refused():
    system = sb.System(beam(1), contacts=[striker()])
    with pytest.raises(InputError, match=r"engine = 'cuda'.*(pip install|engine = 'native')"):
        sb.sweep(system, {"drive.velocity_amplitude": [0.1, 0.2]}, sb.Integration(cycles=1, engine="cuda"))


def test_a_single_run_stays_on_the_cpu():
    system = sb.System(beam(1), contacts=[striker()])
    run = sb.simulate(system, sb.Integration(cycles=2, engine="cuda"))
    assert run.dataset.attrs["engine"] == "native"


def test_a_gpu_without_room_names_the_way_out(monkeypatch):
    def allocate(size, stream):
        raise RuntimeError("CUDA_ERROR_OUT_OF_MEMORY: not enough memory")

    card = SimpleNamespace(allocate=allocate, create_stream=lambda: None)
    monkeypatch.setattr(cuda, "_device", lambda: card)
    with pytest.raises(InputError, match=r"no room for 2 GB more.*points_per_task"):
        cuda._Memory().room(2_000_000_000)
