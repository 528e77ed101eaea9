"""Draw the figures that pages show of examples and of their own code, into docs/images.

``python docs/_ext/example_figures.py`` draws all, ``python docs/_ext/example_figures.py orbits README`` those of some pages.
"""

from __future__ import annotations

import io
import os
import re
import runpy
import shlex
import sys
import tempfile
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
from PIL import Image

DOCS = Path(__file__).parents[1]
EXAMPLES = ("ex24_dynamics", "ex25_design", "ex43_cheapest_place")
PAGES = (
    "index", "getting-started", "tutorial_beam", "long_maps", "mems_arch", "mems_switch",
    "howto_harvester", "beams", "orbits", "basins", "design",
)  # fmt: skip
"""Pages with figures ``images/PAGE_1.png``, ``images/PAGE_2.png`` and so on, each of the last block above it that drew one."""


def save(picture: Image.Image, target: Path) -> None:
    """Save a picture as a small PNG file: at most 1,400 pixels wide, with a palette."""
    picture = picture.convert("RGB")
    if picture.width > 1400:
        picture = picture.resize((1400, round(picture.height * 1400 / picture.width)), Image.Resampling.LANCZOS)
    picture.quantize(colors=128, dither=Image.Dither.NONE).save(target, optimize=True)


def drawn(figure: Any) -> Image.Image:
    """Return the picture of a figure."""
    stream = io.BytesIO()
    figure.savefig(stream, dpi=150)
    return Image.open(stream)


def draw_page(name: str, images: Path) -> None:
    """Run files, code and commands of a page in the present folder, and save a picture for each link to its own figures."""
    from typer.testing import CliRunner

    from snapbeam.cli.app import app

    text = (DOCS / f"{name}.md").read_text(encoding="utf-8")
    beam = (DOCS / "tutorial_beam.md").read_text(encoding="utf-8")
    Path("beam.toml").write_text(beam.partition("```toml\n")[2].partition("```")[0], encoding="utf-8")
    scope: dict[str, Any] = {}
    picture = None
    pattern = rf"^```(.*)\n((?:(?!```).*\n)*)```$|^!\[[^\]]*\]\(images/({re.escape(name)}_\d+\.png)\)$"
    last = max((m.end() for m in re.finditer(pattern, text, re.MULTILINE) if m[3]), default=0)
    for kind, block, target in re.findall(pattern, text[:last], re.MULTILINE):
        if target:
            assert picture is not None, target
            save(picture, images / target)
            picture = None
        elif kind == "toml" and (file := re.match(r"# (\S+\.toml)\n", block)):
            Path(file[1]).write_text(block, encoding="utf-8")
        elif kind == "python" and 'open_dataset("map.nc")' not in block:
            plt.close("all")
            exec(compile(block, name, "exec"), scope)
            if plt.get_fignums():
                picture = drawn(plt.figure(plt.get_fignums()[-1]))
        elif kind == "" and block.startswith("snapbeam "):
            for line in block.replace("\\\n", " ").splitlines():
                words = shlex.split(line, comments=True)[1:]
                if not words or "..." in words or "explore" in words:
                    continue
                result = CliRunner().invoke(app, words)
                if "No such file" in result.output:  # an example of a command, with a file of the reader
                    continue
                assert result.exit_code == 0, f"{line}\n{result.output}"
                for option in ("--plot", "-o"):
                    if option in words and (path := Path(words[words.index(option) + 1])).suffix == ".png":
                        picture = Image.open(path).copy()
                        break


def draw_potential(images: Path) -> None:
    """Draw the potential energy of the paper's beam with one mode, and motions of three classes in it."""
    import numpy as np

    from snapbeam import ReducedModel, ResponseClass
    from snapbeam.model import default_values
    from snapbeam.plot.style import CLASS_COLORS, figure_style, new_figure

    model = ReducedModel.from_beam(default_values.BEAM, modes=1)
    well = abs(float(model.wells[0][0]))

    def energy(displacement: Any) -> Any:
        squared = (np.asarray(displacement) * well) ** 2
        linear, cubic = float(model.stiffness[0]), model.nonlinear_stiffness
        return 1e6 * (0.5 * linear * (squared - well**2) + 0.25 * cubic * (squared**2 - well**4))

    with figure_style():
        figure = new_figure("double", 70.0)
        axes = figure.add_subplot()
        w = np.linspace(-1.55, 1.55, 300)
        axes.plot(w, energy(w), color="black")
        barrier = float(energy(0.0))

        def turning(level: float) -> float:
            return float(w[w > 1.0][np.argmax(energy(w[w > 1.0]) >= level)])

        axes.annotate("", (0.0, barrier), (0.0, 0.0), arrowprops={"arrowstyle": "<->", "shrinkA": 0, "shrinkB": 0})
        axes.text(0.04, 0.1 * barrier, "barrier")
        axes.plot([-1.0, 1.0], [0.0, 0.0], "ko", ms=4)
        axes.plot([0.0], [barrier], "ko", mfc="white", ms=4)
        for place, name in ((-1.0, "lower well"), (1.0, "upper well")):
            axes.text(place, -0.2 * barrier, name, ha="center", va="center")
        axes.text(0.0, 1.09 * barrier, "saddle", ha="center", va="center")
        level = 0.55 * barrier
        left = turning(level)
        inner = float(w[(w > -1.0) & (w < 0.0)][np.argmax(energy(w[(w > -1.0) & (w < 0.0)]) >= level)])
        arrow = {"arrowstyle": "<->", "lw": 1.6, "shrinkA": 0, "shrinkB": 0}
        axes.annotate(
            "", (-left, level), (inner, level), arrowprops=arrow | {"color": CLASS_COLORS[ResponseClass.INTRAWELL]}
        )
        axes.text(-1.0, level + 0.08 * barrier, "intrawell", ha="center", color=CLASS_COLORS[ResponseClass.INTRAWELL])
        level = 1.75 * barrier
        green = "#6F8A2F"  # the class colour, dark enough for type
        axes.annotate("", (-turning(level), level), (turning(level), level), arrowprops=arrow | {"color": green})
        axes.text(0.0, level + 0.08 * barrier, "continuous interwell", ha="center", color=green)
        blue = CLASS_COLORS[ResponseClass.TRANSIENT_2]
        over = np.linspace(-0.95, 0.9, 60)
        height = barrier * (0.25 + 1.1 * (1.0 - (over / 0.95) ** 2))
        axes.plot(over, height, color=blue, lw=1.6)
        axes.annotate(
            "", (over[-1], height[-1]), (over[-3], height[-3]), arrowprops=arrow | {"arrowstyle": "->", "color": blue}
        )
        axes.text(0.5, 1.18 * barrier, "transient interwell 2", color="#2F7FB5", va="center")
        axes.set_xlabel("Displacement at mid-span $w/b$")
        axes.set_ylabel("Potential energy (µJ)")
        axes.set_xlim(-1.6, 1.6)
        axes.set_ylim(-0.35 * barrier, 2.15 * barrier)
    save(drawn(figure), images / "potential_energy.png")


def draw_systems(images: Path) -> None:
    """Draw the schematics of the pages on strikers, beams, harvesters and systems."""
    import snapbeam as sb
    from snapbeam import paper

    level, hertz = paper.BEAM.buckling_level, paper.CONTACT
    model = sb.ReducedModel.from_beam(paper.BEAM, modes=8)
    shaker = sb.Shaker(frequency_ratio=1.2, velocity_amplitude=0.18)
    burst = sb.Burst(
        frequency_ratio=1.2, velocity_amplitude=0.2, duration_cycles=5, ramp_up_cycles=2, ramp_down_cycles=1, retraction=0.4
    )  # fmt: skip
    body = sb.Striker(drive=burst, mass=0.02, suspension_stiffness=700.0, suspension_damping=0.7, gap=0.1 * level)
    sphere = sb.Striker(drive=sb.ConstantVelocity(speed=0.4), mass=2e-3, gap=0.5 * level, side="above", location=0.5)
    several = [
        sb.Striker(drive=sb.Sine(frequency_ratio=1.2, velocity_amplitude=0.18) + burst, location=0.3),
        sb.Striker(drive=sb.Sine(frequency_ratio=0.9, velocity_amplitude=0.12), side="above", location=0.7, gap=0.3 * level),
    ]  # fmt: skip
    side_load = sb.Imperfection(midspan_amplitude=1.5e-5, point_load=-0.02, point_location=0.3)
    wells = sb.ReducedModel.from_beam(paper.BEAM, modes=8, imperfection=side_load)
    base = sb.BaseExcitation(motion=sb.AccelerationSine(frequency_ratio=0.9, acceleration_amplitude=0.25))
    stop = sb.Striker(drive=sb.FixedStop(), gap=0.15 * level)
    noise = sb.BandLimitedNoise(low_ratio=0.3, high_ratio=1.5, velocity_rms=0.15, seed=1)
    shaking = sb.Striker(drive=noise, gap=-0.1 * level, location=0.7)
    piezo = sb.PiezoelectricHarvester(moment_per_volt=4e-3, capacitance=60e-9, resistance=2e4, patch_end=0.25)
    coil = sb.ElectromagneticHarvester(force_factor=1.5, resistance=30.0, coil_resistance=10.0, location=0.7)
    load = sb.AxialLoadModulation(motion=sb.HarmonicForce(frequency_ratio=2.0, amplitude=3.0))
    for name, system in {
        "body": sb.System(model, contacts=[sb.Contact(sb.HuntCrossley(4e8, 2.0), body)]),
        "sphere": sb.System(model, contacts=[sb.Contact(hertz, sphere)]),
        "several": sb.System(model, contacts=[sb.Contact(hertz, several[0]), sb.Contact(sb.PowerLaw(1e6, 1.4), several[1])]),
        "wells": sb.System(wells, contacts=[sb.Contact(hertz, shaker)]),
        "base": sb.System(model, contacts=[sb.Contact(hertz, stop)], harvesters=[piezo], base_excitation=base),
        "coil": sb.System(model, contacts=[sb.Contact(hertz, shaker)], harvesters=[coil], axial_load=load),
        "stop": sb.System(model, contacts=[sb.Contact(sb.KelvinVoigt(linear_stiffness=1e6, linear_damping=2.0), shaking)]),
    }.items():  # fmt: skip
        save(drawn(system.plot()), images / f"system_{name}.png")
        plt.close("all")


def draw_examples(images: Path) -> None:
    """Run each example and save the figures that it leaves open, in their order."""
    for name in EXAMPLES:
        runpy.run_path(str(DOCS.parent / "examples" / f"{name}.py"), run_name="__main__")
        for number, figure in enumerate(plt.get_fignums(), 1):
            target = images / f"{name}_{number}.png"
            if target.exists():
                save(drawn(plt.figure(figure)), target)
        plt.close("all")
    import snapbeam

    page = (DOCS / "base_and_load.md").read_text(encoding="utf-8")
    os.chdir(images)
    exec(
        next(each for each in re.findall(r"```python\n(.*?)```", page, re.DOTALL) if "estimated_psd" in each),
        {"sb": snapbeam},
    )


def main(names: list[str]) -> None:
    """Draw the figures of some pages, or of all pages and examples."""
    images = DOCS / "images"
    for name in names or PAGES:
        with tempfile.TemporaryDirectory() as folder:
            os.chdir(folder)
            draw_page(name, images)
            plt.close("all")
            os.chdir(DOCS)
    if not names:
        draw_potential(images)
        draw_systems(images)
        draw_examples(images)


if __name__ == "__main__":
    main(sys.argv[1:])
