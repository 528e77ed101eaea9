"""The explorer's peer: a page of HoloViews on a map, whose clicks SciPy answers.

``python -m benchmarks.peers.scipy_page map.nc MODES CYCLES`` serves it on the loopback address.  It is what one writes
with the usual tools: an image, a stream of taps, a curve that follows them.  The equations are those of the other
peers, compiled once by Numba, and integrated by LSODA (``odeint``) at the tolerance that keeps e5 below 1e-3 in the bench.
Models have the names that the explorer's have, so that both pages are timed by the same script.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

import holoviews as hv
import numpy as np
import panel as pn
import xarray as xr
from numba import njit
from numpy.typing import NDArray
from scipy.integrate import odeint

from benchmarks.cases import Case
from benchmarks.peers.equations import equations_of

__all__ = ["TOLERANCE", "page", "waveform"]

TOLERANCE = 1e-9
_WEIGHT = 400.0
"""How much looser the absolute tolerance is on velocities, as in the bench."""
_SAMPLES = 4000

_Array = NDArray[np.float64]


@njit(error_model="numpy", fastmath={"contract", "reassoc", "nsz"})
def _slope(
    t: float, u: _Array, tension: _Array, rows: _Array, gamma: float, stiffness: float, amplitude: float, drive: float,
    rate: float,
) -> _Array:  # fmt: skip
    """As in :mod:`benchmarks.peers.equations`; *rows*: g, contact, push, omega^2 and 2 zeta omega."""
    count = u.size // 2
    q = u[:count]
    r = tension @ q
    gq, qr, depth = 0.0, 0.0, amplitude * np.sin(drive * t)
    for i in range(count):
        gq += rows[0, i] * q[i]
        qr += r[i] * q[i]
        depth -= rows[1, i] * q[i]
    force = stiffness * depth * np.sqrt(depth) if depth > 0.0 else 0.0
    du = np.empty(u.size)
    for i in range(count):
        du[i] = rate * u[count + i]
        pull = force * rows[2, i] - rows[3, i] * q[i] - gamma * (qr * rows[0, i] + (2.0 * gq + qr) * r[i])
        du[count + i] = pull / rate - rows[4, i] * u[count + i]
    return du


def waveform(case: Case, cycles: int) -> tuple[_Array, _Array]:
    """Cycles of excitation, and the displacement of the contact point from rest, in b."""
    e = equations_of(case)
    rows = np.array([e.g, e.contact, e.push, e.omega**2, 2.0 * e.damping_ratio * e.omega])
    rate = _WEIGHT * float(e.omega[0])
    times = np.linspace(0.0, cycles * case.period, _SAMPLES)
    memory = (np.ascontiguousarray(e.tension), rows, e.gamma, e.stiffness, e.amplitude, e.drive, rate)
    with np.errstate(all="ignore"):
        states = odeint(
            _slope, np.zeros(2 * e.omega.size), times, memory, rtol=TOLERANCE, atol=TOLERANCE, tfirst=True,
            mxstep=10**8,
        )  # fmt: skip
    return times / case.period, np.asarray(states[:, : e.omega.size] @ e.read_out)


def page(dataset: xr.Dataset, modes: int, cycles: int) -> Any:
    """The map beside the waveform of the point that was clicked."""
    hv.extension("bokeh")
    x, y = dataset["frequency_ratio"].values, dataset["velocity_amplitude"].values
    kinds = dataset["response_class"].transpose("velocity_amplitude", "frequency_ratio").values
    image = hv.Image((x, y, kinds.astype(float)), ["frequency ratio", "velocity amplitude"], "response_class")
    tap = hv.streams.CircuitIncrement(source=image, x=None, y=None)

    def run(x: float | None, y: float | None) -> Any:
        found = ([], []) if x is None or y is None else waveform(Case(modes, _near(xs, x), _near(ys, y)), cycles)
        return hv.Curve(found, "cycle", "displacement (b)")

    xs, ys = x, y
    shown = hv.DynamicMap(run, streams=[tap]).opts(
        hv.opts.Curve(width=620, height=420, framewise=True, hooks=[_named("run", "waveform")])
    )
    return pn.Row(
        image.opts(width=560, height=420, tools=["tap"], cmap="viridis", hooks=[_named("map", "map-base")]), shown
    )


def _near(values: _Array, value: float) -> float:
    return float(values[int(np.argmin(np.abs(values - value)))])


def _named(figure: str, source: str) -> Callable[[Any, Any], None]:
    def hook(plot: Any, _: Any) -> None:
        plot.state.name = figure
        plot.handles["source"].name = source

    return hook


def main() -> None:
    """Serve the page until it is stopped; its address is printed."""
    file, modes, cycles = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    dataset = xr.load_dataset(file, engine="h5netcdf")
    waveform(Case(modes, 1.2, 0.1), 1)  # the compile aside
    server = pn.serve(lambda: page(dataset, modes, cycles), port=0, address="127.0.0.1", show=False, start=False)
    server.start()
    print(f"Page at http://127.0.0.1:{server.port}/", flush=True)
    server.io_loop.start()


if __name__ == "__main__":
    main()
