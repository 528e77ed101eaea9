"""Many runs: a sweep over any parameters, kept, resumed, spread over a cluster, refined, repeated."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from snapbeam.model.integration import Integration
from snapbeam.model.system import System
from snapbeam.sweeps.checkpointed_sweep import CheckpointOptions, compute_sweep
from snapbeam.sweeps.replicates import Replicates
from snapbeam.sweeps.setup import sweep_setup
from snapbeam.util.diagnostics import counting
from snapbeam.util.validation import integer

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["sweep"]


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
    """Class and statistics of the response over any parameters, and any mixture of them.

    Points that share a structure are marched together; the numbers depend on neither batch, order, tasks, threads,
    workers nor interruptions, bit for bit.

    Parameters
    ----------
    system : System
        What is studied; what is not swept is as it says.
    axes : mapping of str to array_like, or xarray.Dataset, or pandas.DataFrame
        A mapping from parameters to values makes a grid, with a dimension for each: names as in
        :func:`snapbeam.model.parameters`, dotted (``"beam.thickness"``) or as datasets have them
        (``"frequency_ratio"``), with strictly increasing values.  A dataset with one-dimensional variables, or a
        data frame, makes a list of points along the dimension ``point``.
    integration : Integration, optional
    checkpoint : path or CheckpointOptions, optional
        Folder that keeps the sweep while it is computed.  One that exists is resumed: what is finished and
        undamaged is not computed again.
    cluster : str, optional
        Who computes: ``"local:4"``, ``"tcp://host:8786"`` or a TOML file with a section ``[slurm]``; this
        process by default.  Needs a store.
    refine_levels : int
        Times the spacing of the axes of numbers is halved where neighbours differ in class.
    replicates : Replicates or int, optional
        Repeats of each run with a changed start; adds ``class_fraction``.
    output : path, optional
        NetCDF file to write, a block at a time, so that memory does not grow with the sweep.
    progress : callable, optional
        Called as ``progress(done, total)`` with points; True writes a line to standard error.

    Returns
    -------
    xarray.Dataset
        The variables of :data:`snapbeam.STATISTICS` over the axes; every parameter in the attributes.  With *output*,
        opened from that file.

    Raises
    ------
    InputError
        For bad input, and for a store that holds another sweep.  Runs that fail numerically are UNKNOWN points with
        a ``status``.
    CheckpointError
        If the store is in use, cannot be written or is damaged beyond repair.

    Examples
    --------
    >>> ds = sb.sweep(system, {"model.damping_ratio": [0.002, 0.005], "frequency_ratio": omega})  # doctest: +SKIP
    """
    setup = sweep_setup(system, axes, integration)
    keeping = checkpoint if isinstance(checkpoint, CheckpointOptions) else CheckpointOptions(checkpoint)
    if replicates is not None and not isinstance(replicates, Replicates):
        replicates = integer("replicates", replicates, 0, 10_000)
    repeats = Replicates(replicates) if isinstance(replicates, int) and replicates else replicates or None
    return compute_sweep(
        setup,
        keeping,
        cluster=cluster,
        refine_levels=refine_levels,
        replicas=repeats,
        output=output,
        progress=counting(progress, "sweep"),
    )
