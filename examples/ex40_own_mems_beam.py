r"""
Your own beam: a silicon microbeam
==================================

This example goes from the parameter file of a silicon beam, 400 µm long and 2 µm thick, to a figure for a journal. The
steps are shell commands, run here from Python. The commands that the program suggests are run too.
"""

import re
import shlex
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
from typer.testing import CliRunner

from snapbeam.cli.app import app

folder = tempfile.TemporaryDirectory()
files = Path(folder.name)
beam = files / "mems.toml"
beam.write_text("""
[beam]
length = 400e-6
thickness = 2e-6
width = 10e-6
density = 2330.0
young_modulus = 160e9
buckling_level = 3e-6

[model]
modes = 4
damping_ratio = 0.005

[contact]
radius = 5e-6
young_modulus = [160e9, 160e9]
poisson_ratio = [0.22, 0.22]
location = 0.47

[sweep]
frequency_ratio = "0.6:2:15"
velocity_amplitude = "0.05:0.6:12"

[integration]
cycles = 60
""")


def shell(command: str) -> str:
    """What a command prints; an error if it fails."""
    print("$", command.replace(f"{files}/", ""))
    done = CliRunner().invoke(app, shlex.split(command)[1:])
    assert done.exit_code == 0, done.output
    return done.stdout


# %%
# First the frequencies. The command reports values that are missing in the file and taken from the paper's beam.

print(shell(f"snapbeam frequencies --config {beam} --count 4"))

# %%
# Then the map, and its figure at column width, as PDF for the journal.

said = shell(
    f"snapbeam map --config {beam} -o {files}/mems.nc --plot {files}/mems.pdf"
)
print(said.replace(f"{files}/", ""))

# %%
# The program suggests next steps. Each suggestion is a complete command for this system:

for line in re.findall(r"^  .*?(snapbeam (?:simulate|plot).*)$", said, re.MULTILINE):
    command = re.sub(r"(--plot|-o) (\S+)", rf"\1 {files}/\2", line)
    print(shell(command).replace(f"{files}/", ""))
plt.close("all")  # their pictures are in files

# %%
# The suggested run:

picture = plt.imread(files / "run.png")
figure = plt.figure(figsize=(7.5, 7.5 * picture.shape[0] / picture.shape[1]))
figure.add_axes((0, 0, 1, 1)).imshow(picture)
figure.axes[0].axis("off")
folder.cleanup()
