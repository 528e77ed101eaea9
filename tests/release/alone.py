"""Install each archive of a folder alone in a fresh environment and run it: ``python alone.py dist [extra ...]``."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import venv
from pathlib import Path

CONSTRAINTS = Path(__file__).parents[2] / "constraints.txt"
CHECKS = {
    "": (
        "import snapbeam as sb; from snapbeam import paper; "
        "run = sb.simulate(sb.System(sb.ReducedModel.from_beam(paper.BEAM, modes=2), paper.CONTACT, "
        "sb.Shaker(frequency_ratio=1.2, velocity_amplitude=0.2)), sb.Integration(cycles=3)); "
        "run.save('run.nc'); assert sb.load_run('run.nc').system == run.system; print(run)"
    ),
    "lab": "import snapbeam.lab as lab; print(*[getattr(lab, name).__name__ for name in lab.__all__])",
    "video": "import imageio_ffmpeg, PIL; from snapbeam.figures.animation import animate_run; print(animate_run)",
    "cluster": "import zarr, distributed; from snapbeam.sweeps.keep.store import MapStore; print(MapStore)",
}
COMMANDS = (
    ["--version"],
    ["frequencies", "--count", "3"],
    ["map", "--modes", "1", "--cycles", "4", "--frequency-ratio", "1:1.5:3", "--velocity-amplitude", "0.1:0.4:3",
     "--plot", "map.png"],
    ["info", "map.nc"],
)  # fmt: skip


def run(*words: str | Path, cwd: Path) -> str:
    """Run a command away from the source tree; its output, or an error that shows it."""
    environment = {
        key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "VIRTUAL_ENV")
    }
    done = subprocess.run(
        [str(word) for word in words], cwd=cwd, env=environment, capture_output=True, text=True
    )
    if done.returncode:
        raise SystemExit(f"{' '.join(map(str, words))}\n{done.stdout}\n{done.stderr}")
    return done.stdout


def try_alone(archive: Path, extras: tuple[str, ...] = ()) -> None:
    """Install an archive into an empty environment, with extras, and use it."""
    with tempfile.TemporaryDirectory() as folder:
        here = Path(folder)
        venv.create(here / "env", with_pip=True)
        binaries = here / "env" / ("Scripts" if os.name == "nt" else "bin")
        named = f"{archive.resolve()}[{','.join(extras)}]" if extras else str(archive.resolve())
        run(
            binaries / "python",
            "-m",
            "pip",
            "install",
            "--quiet",
            "--constraint",
            CONSTRAINTS,
            named,
            cwd=here,
        )
        for extra in ("", *extras):
            print(run(binaries / "python", "-c", CHECKS[extra], cwd=here).strip()[:200])
        for words in COMMANDS:
            run(binaries / "snapbeam", *words, cwd=here)
        assert (here / "map.png").stat().st_size > 10_000


def main() -> None:
    """Try every archive of a folder; the wheel with each extra too."""
    folder, *extras = sys.argv[1:]
    archives = sorted(Path(folder).glob("snapbeam-*"))
    assert len(archives) == 2, archives
    for archive in archives:
        print(archive.name, flush=True)
        try_alone(archive, tuple(extras) if archive.suffix == ".whl" else ())


if __name__ == "__main__":
    main()
