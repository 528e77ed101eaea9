"""The alarm for a curve of the camera on good scenes with texture and on scenes with such a curve.

``python tests/lab/random_gamma.py GOOD BENT [SEED]`` prints the rates of ``docs/data/random_defects.md``. Nothing is tracked: the alarm
follows from the survey of a recording, of which the rest is left out.
"""

from __future__ import annotations

import sys
import tempfile
from unittest.mock import patch

import numpy as np
import random_scenes

from snapbeam.lab.tracking import track
from snapbeam.lab.tracking.diagnostics import of_the_edges
from snapbeam.lab.tracking.settings import TrackingSettings

_survey = track.survey


class _Surveyed(Exception):
    """The end of a run after its survey."""


def _stop(*args, **options):
    raise _Surveyed(_survey(*args, **options))


def judged(rng, bent):
    """Codes told of the edges of a textured scene, half of them through a Gaussian lens, and the gamma of its camera."""
    scene = random_scenes.spoiled_scene(rng, "gamma") if bent else random_scenes.good_scene(rng)
    scene.camera["lens"] = "gaussian" if rng.random() < 0.5 else "disk"
    scene.defects["texture"] = rng.uniform(0.0, 0.06)
    with tempfile.TemporaryDirectory() as folder, patch.object(track, "survey", _stop):
        try:
            random_scenes.measured(scene, folder, rng)
        except _Surveyed as found:
            told = of_the_edges(found.args[0].shape, TrackingSettings())
    return [one.code.partition(".")[2] for one in told], scene.defects.get("gamma", 1.0), scene.camera["lens"]


if __name__ == "__main__":
    seed = int(sys.argv[3]) if len(sys.argv) > 3 else 9101
    for bent, count in enumerate(map(int, sys.argv[1:3])):
        found = [judged(np.random.default_rng((seed, k, bent)), bent) for k in range(count)]
        print(("good", "bent")[bent], count, "told", sum("gamma" in codes for codes, *_ in found))
        print([(k, codes, round(g, 2), lens) for k, (codes, g, lens) in enumerate(found) if ("gamma" in codes) != bent])
