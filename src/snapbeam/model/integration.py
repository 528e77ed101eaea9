"""Solver settings of a run: duration, step or tolerance, engine."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

from snapbeam.model.quantity import check_fields, quantities, quantity
from snapbeam.util.validation import InputError

ACCURACIES = ("standard", "reference")
ENGINES = ("auto", "native", "python", "cuda")
CYCLES = 200
"""Default number of cycles of a run."""


@dataclass(frozen=True, kw_only=True)
class Integration:
    """Solver settings of a run: number of cycles, time step or tolerance, engine.

    Parameters
    ----------
    cycles : int, optional
        Number of cycles of excitation, at least 1; by default 200, or all cycles of a recorded drive.
    step : float, optional
        Step in free flight, s; steps in contact scale with it. Follows from model and contact by default.
    accuracy : {"standard", "reference"}
        Order 4, or order 6 with much shorter steps, to check results.
    tolerance : float, optional
        Maximum error of the displacement of the contact point and of mid-span, over b, from 1e-10 to 0.1, up to the
        predictability horizon; in place of *step* and *accuracy*.
    engine : {"auto", "native", "python", "cuda"}
        Solver: ``"auto"`` and ``"native"`` are the core in C++. ``"python"`` is its specification, for laws in plain
        Python: hundreds to thousands of times slower, without *step*, *tolerance* or *early_termination*. ``"cuda"`` is the core on
        an NVIDIA GPU (extra ``cuda``), for maps of ten thousand runs and more.
    early_termination : bool
        End a run once its response class is certain; other statistics stop there.
    threads : int, optional
        Threads of the native core, all cores by default; results do not depend on it.
    high_frequency_ratio : float
        Multiple of omega_1 above which the energy of a mode counts as high, for ``high_frequency_energy_fraction``.
    max_steps : int, optional
        Maximum number of steps of a run, by default about one hour on one core (1e10 with 1 mode, 7e8 with 64). If free
        flight alone needs more, an InputError is raised; otherwise the run ends with the status STEP_LIMIT.

    Raises
    ------
    InputError
        If a value is out of range, or a tolerance is combined with a step or an accuracy.

    See Also
    --------
    snapbeam.simulate, snapbeam.sweep

    Examples
    --------
    >>> import snapbeam as sb
    >>> integration = sb.Integration(cycles=200, accuracy="reference")
    >>> integration.replace(cycles=1000).cycles
    1000
    """

    cycles: int | None = quantity("1", "cycles of excitation", default=None, kind=int, low=1, high=10**7, optional=True)
    step: float | None = quantity("s", "step in free flight", default=None, low=0.0, optional=True)
    accuracy: str = quantity("1", "accuracy level", default="standard", kind=str, choices=ACCURACIES)
    tolerance: float | None = quantity(
        "1", "maximum error of the displacement, over b", default=None, low=1e-10, high=0.1, closed="both",
        optional=True,
    )  # fmt: skip
    engine: str = quantity("1", "what integrates", default="auto", kind=str, choices=ENGINES)
    early_termination: bool = quantity(
        "1", "whether a run ends once its response class is certain", default=False, kind=bool
    )
    threads: int | None = quantity(
        "1", "threads of the native core", default=None, kind=int, low=1, high=4096, optional=True
    )
    high_frequency_ratio: float = quantity(
        "1", "multiple of omega_1 above which the energy of a mode counts as high", default=5.0, low=0.0
    )
    max_steps: int | None = quantity(
        "1", "steps that a run may take", default=None, kind=int, low=1, high=10**15, optional=True
    )

    def __post_init__(self) -> None:
        check_fields(self)
        if self.tolerance is not None and (self.step is not None or self.accuracy != "standard"):
            raise InputError(
                f"tolerance = {self.tolerance!r} with step = {self.step!r}, accuracy = {self.accuracy!r}: give one"
            )
        if self.engine == "python":
            for name, value in (("step", self.step), ("tolerance", self.tolerance), ("early_termination", self.early_termination or None)):  # fmt: skip
                if value is not None:
                    raise InputError(
                        f"{name} = {value!r} with engine = 'python': which controls its own steps and runs to the end; leave "
                        f"{name} out, or use engine = 'native'"
                    )

    def replace(self, **changes: Any) -> Integration:
        """An integration with some values changed; unknown names are refused."""
        known = quantities(Integration)
        for name in changes:
            if name not in known:
                raise InputError(f"{name}: is not a parameter of an integration; must be one of {', '.join(known)}")
        return dataclasses.replace(self, **changes)

    @property
    def cycles_or_default(self) -> int:
        """Number of cycles, 200 by default."""
        return CYCLES if self.cycles is None else self.cycles
