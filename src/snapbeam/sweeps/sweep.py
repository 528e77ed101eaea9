"""Sweeps over any parameters."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from snapbeam.model.integration import Integration
from snapbeam.model.system import System
from snapbeam.sweeps.compute import CheckpointOptions, compute_sweep
from snapbeam.sweeps.replicates import Replicates
from snapbeam.sweeps.setup import sweep_setup
from snapbeam.util.diagnostics import counting
from snapbeam.util.validation import integer

if TYPE_CHECKING:
    import xarray as xr


def sweep(
    system: System,
    axes: Mapping[str, Any] | xr.Dataset | Any,
    integration: Integration | None = None,
    *,
    checkpoint: str | os.PathLike[str] | CheckpointOptions | None = None,
    cluster: str | None = None,
    refine_levels: int = 0,
    replicates: Replicates | int | None = None,
    output: str | os.PathLike[str] | None = None,
    progress: Callable[[int, int], object] | bool | None = None,
) -> xr.Dataset:
    """Compute the response class and the statistics of a run at every point of a grid or list of parameters.

    Points with the same structure are integrated together. Results are bitwise identical for any batches, order,
    threads, workers or interruptions, on the same engine, version and processor type.

    Parameters
    ----------
    system : System
        Nominal system.
    axes : mapping of str to array_like, or xarray.Dataset, or pandas.DataFrame
        Mapping from parameters to strictly increasing values, a grid, or a dataset or data frame of one-dimensional
        variables, a list along ``point``. Names are those of :func:`snapbeam.model.parameters`, dotted
        (``"beam.thickness"``) or short (``"frequency_ratio"``). ``"drive.frequency_hz"`` and the other names of
        ``snapbeam.model.parameters.PHYSICAL`` are in Hz, m/s, g, um or m and become ratios; if another axis changes the
        structure, the result is a list of points that keep their Hz.
    integration : Integration, optional
        Solver settings.
    checkpoint : path or CheckpointOptions, optional
        Folder of finished tasks; of an existing one only missing or damaged tasks are computed.
    cluster : str, optional
        Workers: ``"local:4"``, ``"tcp://host:8786"`` or a TOML file with a section ``[slurm]``; this process by
        default. A cluster needs a checkpoint.
    refine_levels : int
        Halvings of the grid spacing where neighbours differ in response class.
    replicates : Replicates or int, optional
        Repeats of each run with a perturbed start; they add ``class_fraction``.
    output : path, optional
        NetCDF file, written block by block, for a sweep larger than the memory.
    progress : callable, optional
        Called as ``progress(done, total)`` with points; True prints it.

    Returns
    -------
    xarray.Dataset
        The :data:`snapbeam.STATISTICS` over the axes, with all parameters in the attributes; opened from *output*, if
        given.

    Raises
    ------
    InputError
        If an axis is not valid, or the checkpoint belongs to another sweep. Runs that fail numerically have the class
        UNKNOWN and the reason in ``status``.
    CheckpointError
        If the checkpoint is in use, cannot be written or is damaged beyond repair.

    See Also
    --------
    snapbeam.threshold, snapbeam.CheckpointOptions, snapbeam.plot.plot_response_map

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> system = paper.struck_beam(frequency_ratio=1.2, velocity_amplitude=0.18)
    >>> axes = {"model.damping_ratio": [0.002, 0.005], "drive.frequency_ratio": [0.8, 1.0, 1.2]}
    >>> dataset = sb.sweep(system, axes, sb.Integration(cycles=20))
    >>> dict(dataset.sizes)
    {'damping_ratio': 2, 'frequency_ratio': 3}
    """
    setup = sweep_setup(system, axes, integration)
    options = checkpoint if isinstance(checkpoint, CheckpointOptions) else CheckpointOptions(checkpoint)
    if replicates is not None and not isinstance(replicates, Replicates):
        replicates = integer("replicates", replicates, 0, 10_000)
    repeats = Replicates(replicates) if isinstance(replicates, int) and replicates else replicates or None
    return compute_sweep(
        setup,
        options,
        cluster=cluster,
        refine_levels=refine_levels,
        replicates=repeats,
        output=output,
        progress=counting(progress, "sweep"),
    )
