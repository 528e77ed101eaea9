"""Draw the figures that pages show of examples and of their own code, into docs/images: ``python docs/_ext/example_figures.py``."""

from __future__ import annotations

import os
import re
import runpy
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt

import snapbeam

DOCS = Path(__file__).parents[1]
EXAMPLES = ("ex24_dynamics", "ex25_design", "ex26_backbone", "ex27_bifurcation_curves", "ex43_cheapest_place")


def main() -> None:
    """Run each example and save the figures that it leaves open, in their order."""
    for name in EXAMPLES:
        runpy.run_path(str(DOCS.parent / "examples" / f"{name}.py"), run_name="__main__")
        for number, figure in enumerate(plt.get_fignums(), 1):
            plt.figure(figure).savefig(DOCS / "images" / f"{name}_{number}.png", dpi=150)
        plt.close("all")
    page = (DOCS / "base_and_load.md").read_text(encoding="utf-8")
    os.chdir(DOCS / "images")
    exec(
        next(each for each in re.findall(r"```python\n(.*?)```", page, re.DOTALL) if "estimated_psd" in each),
        {"sb": snapbeam},
    )


if __name__ == "__main__":
    main()
