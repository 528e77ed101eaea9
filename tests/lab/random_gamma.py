"""The alarm for a curve of the camera on good scenes with texture and on scenes with such a curve.

``python tests/lab/random_gamma.py GOOD BENT [SEED]`` prints the rates of ``docs/data/random_defects.md`` and the largest
errors of the scenes in which no curve is told.
"""

from __future__ import annotations

import sys
import tempfile

import numpy as np
import random_scenes


def judged(rng, bent):
    """The outcome of a textured scene, half of them through a Gaussian lens, the gamma of its camera, and the lens."""
    scene = random_scenes.spoiled_scene(rng, "gamma") if bent else random_scenes.good_scene(rng)
    scene.camera["lens"] = "gaussian" if rng.random() < 0.5 else "disk"
    scene.defects["texture"] = rng.uniform(0.0, 0.06)
    with tempfile.TemporaryDirectory() as folder:
        outcome = random_scenes.judged(scene, folder, rng)
    return outcome, scene.defects.get("gamma", 1.0), scene.camera["lens"]


if __name__ == "__main__":
    seed = int(sys.argv[3]) if len(sys.argv) > 3 else 9101
    for bent, count in enumerate(map(int, sys.argv[1:3])):
        found = [(k, *judged(np.random.default_rng((seed, k, bent)), bent)) for k in range(count)]
        told = ["camera.gamma" in outcome.codes for _, outcome, *_ in found]
        print(("good", "bent")[bent], count, "told", sum(told))
        for (k, outcome, gamma, lens), named in zip(found, told, strict=True):
            if named != bent:
                print(k, outcome, round(gamma, 2), lens)
