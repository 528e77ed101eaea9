r"""
The paper's results from the shell
==================================

This example computes a figure of the paper, its numbers, and a run in its notch, with commands only.
"""

import json
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
from typer.testing import CliRunner

from snapbeam.cli.app import app

folder = tempfile.TemporaryDirectory()
files = Path(folder.name)


def shell(*words: str) -> str:
    """What a command prints; an error if it fails."""
    print("$ snapbeam", *words)
    done = CliRunner().invoke(
        app, [word.replace("OUT", str(files)) for word in words]
    )
    assert done.exit_code == 0, done.output
    return done.stdout.replace(f"{files}/", "")


# %%
# The paper states 81.8, 159 and 380 Hz for its beam:

found = json.loads(shell("frequencies", "--count", "3", "--json", "-"))
print([f"{each:.1f} Hz" for each in found["reduced"]])

# %%
# A figure, as a sketch; ``--full`` computes it at the size of the paper:

print(shell("reproduce", "figA9", "-o", "OUT"))

# %%
# The run of Fig. 5, as numbers for a script and as a figure:

run = "simulate --frequency-ratio 1.21 --velocity-amplitude 0.18 --cycles 40"
files_of_it = "-o OUT/run.nc --plot OUT/run.png --window 0:20 --json -"
found = json.loads(shell(*run.split(), *files_of_it.split()))
plt.close("all")  # the picture is in its file
print(found["summary"]["response_class"], f"{found['summary']['peak_force']:.2f} N")
picture = plt.imread(files / "run.png")
figure = plt.figure(figsize=(7.5, 7.5 * picture.shape[0] / picture.shape[1]))
figure.add_axes((0, 0, 1, 1)).imshow(picture)
figure.axes[0].axis("off")

# %%
# The file contains all parameters. Here the location of the striker changes, and everything else is the same.

print(
    shell("simulate", "--from", "OUT/run.nc", "--location", "0.3", "--cycles", "40")
)
folder.cleanup()
