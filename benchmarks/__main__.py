"""``python -m benchmarks [part ...] [--quick] [-o FOLDER]``."""

from __future__ import annotations

import argparse
from importlib import import_module
from pathlib import Path

from benchmarks.peers import PEERS, methods

_PARTS = {
    "work-precision": "work_precision",
    "rivals": "rivals",
    "ensemble": "ensemble",
    "scaling": "scaling",
    "requests": "requests",
    "levels": "levels",
    "explorer": "explorer",
    "dynamics": "dynamics",
    "systems": "systems",
    "fixed-steps": "fixed_steps",
    "calls": "calls",
}


def main() -> None:
    """Run the parts asked for."""
    parts = [*_PARTS, "peers"]
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description="snapbeam beside other integrators")
    parser.add_argument("part", nargs="*", help=f"any of {', '.join(parts)}; by default all but the last")
    parser.add_argument("--quick", action="store_true", help="few repeats, short runs: does everything work")
    parser.add_argument("-o", "--output", type=Path, default=Path("out/bench"), metavar="FOLDER")
    arguments = parser.parse_args()
    unknown = [part for part in arguments.part if part not in parts]
    if unknown:
        parser.error(f"part = {unknown[0]!r}: must be one of {', '.join(parts)}")
    arguments.output.mkdir(parents=True, exist_ok=True)
    for part in arguments.part or _PARTS:
        if part == "peers":
            for peer in PEERS:
                found = methods(peer)
                print(found if isinstance(found, str) else f"{peer}: {', '.join(m.name for m in found)}")
        else:
            import_module(f"benchmarks.{_PARTS[part]}").run(arguments.output, arguments.quick)


if __name__ == "__main__":
    main()
