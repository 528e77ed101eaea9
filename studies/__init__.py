"""Studies beyond the paper: ``python -m studies NAME`` computes and draws one as ``snapbeam reproduce`` does a figure of the paper.

``studies.STUDIES["two_tips"]()`` draws one; they are among ``paper.FIGURES`` once this is imported.
"""

from snapbeam.paper import FIGURES, Recipe

__all__ = ["STUDIES"]

STUDIES: dict[str, Recipe] = {
    name: Recipe(name, about, "studies")
    for name, about in {
        "lifetimes": "how long snapping lasts over the plane of fig6 and fig7",
        "notch": "how far each thing left out of the model moves the notch of fig6",
        "two_tips": "how high a slow pusher with one tip or two is when the beam snaps",
        "switch": "the cheapest burst that switches a beam with a bias",
        "harvesting": "power of a harvester by impact, and its share at high frequencies",
    }.items()
}
FIGURES.update(STUDIES)
