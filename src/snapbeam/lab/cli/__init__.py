"""Commands of the laboratory part."""

from snapbeam.parts import installed_parts

COMMANDS = {
    "track": "snapbeam.lab.cli.track:track",
    **({"look": "snapbeam.lab.cli.look:look"} if "explorer" in installed_parts() else {}),
    "vibrometer": "snapbeam.lab.cli.vibrometer:vibrometer",
    "fit-decay": "snapbeam.lab.cli.fit_decay:fit_decay",
    "frf": "snapbeam.lab.cli.frequency_response:frequency_response",
    "calibrate": "snapbeam.lab.cli.calibrate:calibrate",
    "compare": "snapbeam.lab.cli.compare:compare",
    "process-tests": "snapbeam.lab.cli.process_tests:process_tests",
}
"""Module and function of each command, by name."""
