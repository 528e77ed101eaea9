"""Install archives alone in fresh environments and use them: ``python alone.py dist [extra ...]``.

The source archive is installed as it stands, the wheel as it stands and once more with each extra, by itself: what an
extra needs and does not name is not there.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
import time
import urllib.request
import venv
from pathlib import Path

ROOT = Path(__file__).parents[2]
CONSTRAINTS = ROOT / "constraints.txt"
EXTRAS = ("lab", "video", "cluster", "explorer", "laws", "cuda")
"""What users install; the others are for working on snapbeam."""

_SYSTEM = (
    "import snapbeam as sb; from snapbeam.model import default_values; "
    "system = sb.System(sb.ReducedModel.from_beam(default_values.BEAM, modes=1), contacts=[sb.Contact(default_values.CONTACT, "
    "sb.Shaker(frequency_ratio=1.2, velocity_amplitude=0.2))]); "
)
_CORE = (
    f"{_SYSTEM}run = sb.simulate(system, sb.Integration(cycles=3)); "
    "run.save('run.nc'); assert sb.load('run.nc').system == run.system; print(run)"
)
_README = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"), re.DOTALL)
_SIGNAL = (
    "import numpy as np; t = np.arange(40000) / 20e3; ramp = np.clip(t / 0.3, 0, 1); "
    "np.savetxt('velocity.csv', np.c_[t, 0.02 * ramp * np.sin(2 * np.pi * 100 * t)], delimiter=',', "
    "header='time_s,velocity_m_s', comments='')"
)
_LAWS = (
    f"import warnings; warnings.simplefilter('error'); {_SYSTEM}\n"
    "from snapbeam.solver.statistics import Statistic, register_statistic\n"
    "def deepest(held, step):\n"
    "    return max(held, step.penetration[1])\n"
    "row = Statistic('deepest', 'float64', 'm', 'maximum penetration', lambda reading, held: held, update=deepest)\n"
    "register_statistic(row)\n"
    "print(sb.simulate(system, sb.Integration(cycles=2)))\n"
)
# without a GPU the kernels compile
_KERNELS = (
    f"{_SYSTEM}from snapbeam.solver import cuda, native; from snapbeam.solver.assemble import make_ensemble; "
    "problem = native._Arrays(make_ensemble(system, sb.Integration(cycles=1))).problem; "
    "assert cuda.compiled('sm_90', cuda.definitions(problem)).code"
)
_GRID = "--frequency-ratio 1:1.5:3 --velocity-amplitude 0.1:0.4:3"
USES = {
    "": (
        ("python", "-c", _CORE),
        ("python", "-c", _README[0]),
        ("python", str(Path(__file__).with_name("each_set.py"))),
        "snapbeam --version",
        "python -m snapbeam frequencies --count 3",
        f"snapbeam map --modes 1 --cycles 4 {_GRID} --plot map.png",
        "snapbeam info map.nc",
        "snapbeam plot map.nc -o again.pdf",
    ),
    "lab": (
        ("python", "-c", "import snapbeam.lab as lab; print(*[getattr(lab, name).__name__ for name in lab.__all__])"),
        ("python", "-c", _SIGNAL),
        "snapbeam vibrometer velocity.csv --frequency 100 --plot drive.png --json drive.json",
    ),
    "video": (
        "snapbeam simulate --modes 1 --cycles 2 --animate beam.gif",
        "snapbeam simulate --modes 1 --cycles 2 --animate beam.mp4",
    ),
    "cluster": (
        f"snapbeam map --modes 1 --cycles 4 {_GRID} --checkpoint kept --cluster local:1 -o kept.nc",
    ),
    "explorer": (f"snapbeam map --modes 1 --cycles 4 {_GRID}", "page: snapbeam explore map.nc --no-browser"),
    "laws": (("python", "-c", _LAWS),),
    "cuda": (("python", "-c", _KERNELS),),
}  # fmt: skip


class Alone:
    """An environment with one archive in it, in a folder of its own, away from the source tree."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._binaries = folder / "env" / ("Scripts" if os.name == "nt" else "bin")
        hidden = ("PYTHONPATH", "VIRTUAL_ENV")
        self._environment = {key: value for key, value in os.environ.items() if key not in hidden}
        venv.create(folder / "env")

    def install(self, archive: Path, extra: str) -> None:
        """Install the archive, with an extra or none."""
        named = f"{archive.resolve()}[{extra}]" if extra else str(archive.resolve())
        # by the pip that is there; what is never imported need not be compiled
        pip = [sys.executable, "-m", "pip", "--python", str(self._binaries / "python"), "--disable-pip-version-check"]
        words = ["install", "--quiet", "--no-compile", "--constraint", str(CONSTRAINTS), named]
        done = subprocess.run([*pip, *words], capture_output=True, text=True, cwd=self.folder)
        if done.returncode:
            raise SystemExit(f"{' '.join(words)}\n{done.stdout}\n{done.stderr}")

    def run(self, program: str, *words: str) -> str:
        """Run a command; its output, or an error that shows it."""
        done = subprocess.run(
            [str(self._binaries / program), *words], cwd=self.folder, env=self._environment, capture_output=True,
            text=True,
        )  # fmt: skip
        if done.returncode:
            raise SystemExit(f"{program} {' '.join(words)}\n{done.stdout}\n{done.stderr}")
        return done.stdout

    def open_page(self, program: str, *words: str) -> str:
        """Start a command that serves a page, and fetch the page."""
        served = subprocess.Popen(
            [str(self._binaries / program), *words], cwd=self.folder, env=self._environment, text=True,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        )  # fmt: skip
        try:
            assert served.stdout is not None
            line = served.stdout.readline()
            found = re.search(r"http://\S+", line)
            if found is None:
                raise SystemExit(f"{program} {' '.join(words)}\n{line}{served.communicate()[0]}")
            # the address with the token sets a cookie, and leads to the page
            opener = urllib.request.build_opener(urllib.request.HTTPCookieProcessor())
            with opener.open(found[0], timeout=300) as page:
                text: str = page.read().decode()
            assert "snapbeam" in text
            return f"a page of {len(text)} characters"
        finally:
            served.terminate()
            served.communicate()


def try_alone(archive: Path, extra: str = "") -> None:
    """Install an archive into an empty environment, with an extra or none, and use it."""
    with tempfile.TemporaryDirectory() as folder:
        here = Alone(Path(folder))
        here.install(archive, extra)
        for use in USES[extra]:
            words = list(use) if isinstance(use, tuple) else use.split()
            if words[0] == "page:":
                print(here.open_page(*words[1:]), flush=True)
            else:
                print(here.run(*words).strip()[:200], flush=True)
        pictures = [*here.folder.glob("*.png"), *here.folder.glob("*.gif"), *here.folder.glob("*.mp4")]
        assert all(picture.stat().st_size > 10_000 for picture in pictures), pictures
        if not extra:
            assert (here.folder / "map.png").exists() and (here.folder / "again.pdf").exists()


def main() -> None:
    """Try every archive of a folder; the wheel with each of the extras named, or with all, too."""
    folder, *extras = sys.argv[1:]
    source, wheel = next(Path(folder).glob("snapbeam-*.tar.gz")), next(Path(folder).glob("snapbeam-*.whl"))
    for archive, extra in ((source, ""), (wheel, ""), *((wheel, extra) for extra in extras or EXTRAS)):
        start = time.monotonic()
        print(f"{archive.name} [{extra}]", flush=True)
        try_alone(archive, extra)
        print(f"  {time.monotonic() - start:.0f} s", flush=True)


if __name__ == "__main__":
    main()
