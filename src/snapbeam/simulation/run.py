"""A recorded run: time series, impacts and summary."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from snapbeam.model.integration import Integration
from snapbeam.model.state import State
from snapbeam.model.system import System
from snapbeam.simulation.summary import RunSummary
from snapbeam.simulation.tolerance import ErrorEstimate
from snapbeam.solver.statistics import STATISTICS
from snapbeam.util.display import html_table, plotter
from snapbeam.util.validation import choice

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

_KINDS = ("run", "modal_amplitudes", "energies", "spectrum", "spectrogram", "phase_portrait")


def _described(system: System) -> list[tuple[str, str, str]]:
    """Return the sections of a system and their contents."""
    return [line.partition("  ") for line in system.describe().splitlines()]


@dataclass(frozen=True, eq=False)
class Run:
    """A recorded run.

    Attributes
    ----------
    dataset : xarray.Dataset
        Time series: the variables of :data:`snapbeam.simulation.dataset.SCHEMA`.
    summary : RunSummary
        Response class and statistics.
    impacts : xarray.Dataset
        Onset, duration, peak force and impulse of each impact.
    system : System
        The system that was simulated.
    integration : Integration
        Solver settings.
    accuracy : ErrorEstimate or None
        Error estimate, if a tolerance was given.
    final_state : State or None
        State at the end of the run; None if the run failed.

    See Also
    --------
    snapbeam.simulate, snapbeam.RunSummary, snapbeam.load

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> system = paper.struck_beam(frequency_ratio=1.2, velocity_amplitude=0.18)
    >>> run = sb.simulate(system, sb.Integration(cycles=20))
    >>> run.summary.response_class.label
    'continuous interwell'
    >>> displacement = run.dataset["midspan_displacement"]
    """

    dataset: xr.Dataset
    summary: RunSummary
    impacts: xr.Dataset
    system: System
    integration: Integration
    accuracy: ErrorEstimate | None = None
    final_state: State | None = None

    @classmethod
    def of(cls, tables: Callable[[], tuple[xr.Dataset, xr.Dataset]], **parts: Any) -> Run:
        """Return a run whose dataset and impacts *tables* computes at the first access; *parts* are other attributes."""
        run = cls.__new__(cls)
        vars(run).update({"accuracy": None, "final_state": None} | parts | {"_tables": tables})
        return run

    def __getattr__(self, name: str) -> Any:
        tables = vars(self).get("_tables")
        if name in ("dataset", "impacts") and tables is not None:
            dataset, impacts = tables()
            vars(self).update(dataset=dataset, impacts=impacts)
            vars(self).pop("_tables", None)
        if name in vars(self):
            return vars(self)[name]
        raise AttributeError(f"{type(self).__name__} has no {name!r}")

    def __getstate__(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in self.__dataclass_fields__}

    def save(self, path: str | os.PathLike[str], content: str = "samples") -> None:
        """Write the run to a NetCDF file atomically; :func:`snapbeam.load` reads it.

        Parameters
        ----------
        path : path
        content : {"samples", "waveforms", "states", "statistics"}
            All samples; those without the amplitudes and velocities of the modes; one at the start of each cycle, or the nearest
            to it; or none.  The statistics, the impacts and the
            state at the end are always in the file.
        """
        from snapbeam.simulation.save import save_run

        save_run(self, path, content)

    def to_dataframe(self) -> pd.DataFrame:
        """Return the time series as a table: one row for each time, a column for each mode of a modal variable.

        Examples
        --------
        >>> import snapbeam as sb
        >>> from snapbeam import paper
        >>> system = paper.struck_beam(frequency_ratio=1.2, velocity_amplitude=0.18, modes=2)
        >>> frame = sb.simulate(system, sb.Integration(cycles=2)).to_dataframe()
        >>> "modal_amplitude_2" in frame
        True
        """
        from snapbeam.util.tables import data_frame

        return data_frame(self.dataset)

    def plot(self, kind: str = "run", ax: Any = None, **options: Any) -> Any:
        """Plot the run.

        The kinds are ``"run"``, ``"modal_amplitudes"``, ``"energies"``, ``"spectrum"``, ``"spectrogram"`` and
        ``"phase_portrait"``.  Options are those of the function ``plot_...`` of :mod:`snapbeam.plot`; returns the axes.
        """
        choice("kind", kind, _KINDS)
        return plotter(f"plot_{kind}")(self, ax=ax, **options)

    def _repr_html_(self) -> str:
        shown = ("zero_crossings", "impacts", "peak_force", "striker_work", "contact_time_fraction")
        rows = [(STATISTICS[name].long_name, f"{self.summary[name]:.5g}", STATISTICS[name].unit) for name in shown]
        rows += [(section, line.strip(), "") for section, _, line in _described(self.system)]
        return html_table(f"Run: {self.summary.response_class.label}, {self.summary.status.advice}", rows)

    def __repr__(self) -> str:
        samples = self.dataset.sizes["time"]
        return f"<Run {self.summary.response_class.label}, {samples} samples, {self.impacts.sizes['impact']} impacts>"
