"""The card of the system: every parameter with its unit and its limits, what follows from them, files in and out."""

from __future__ import annotations

import html
import tomllib
from collections.abc import Callable
from typing import Any

import numpy as np
import panel as pn

from snapbeam import InputError, Integration, System
from snapbeam.config import Config, Parameter, config_from_mapping, parameters
from snapbeam.explorer.address import number
from snapbeam.explorer.downloads import Downloads
from snapbeam.explorer.limits import CYCLES, MODES, UPLOAD, too_large
from snapbeam.explorer.lines import plain, system_toml
from snapbeam.explorer.look import Look, styled
from snapbeam.explorer.maps.source import integration_mapping

__all__ = ["SystemCard", "changed_parameters"]

_SECTIONS = {
    "beam": "Beam", "model": "Reduced model", "contact": "Contact", "striker": "Striker", "drive": "Drive",
    "run": "Integration",
}  # fmt: skip
_RUN = ("integration.cycles", "integration.accuracy", "integration.step", "integration.early_termination")
_PRESETS: dict[str, dict[str, dict[str, Any]]] = {
    "the paper's beam": {},
    "the paper's, one mode": {"model": {"modes": 1}},
    "the paper's, 8 modes": {"model": {"modes": 8}},
    "the paper's, 1000 cycles": {"run": {"cycles": 1000}},
    "Newton's impact, one mode": {"model": {"modes": 1}, "contact": {"coefficient": 0.6}},
    "twice the buckling level": {"beam": {"buckling_level": 0.67e-3}},
    "struck a quarter along": {"striker": {"location": 0.25}},
}


class SystemCard:
    """Fields of a system.

    Parameters
    ----------
    system, integration : System, Integration
        What the fields hold at first.
    post : callable
        ``post(work)``: do something on the page's own thread.
    downloads : Downloads
    look : Look
    """

    def __init__(
        self,
        system: System,
        integration: Integration,
        post: Callable[[Callable[[], None]], None],
        downloads: Downloads,
        look: Look,
    ) -> None:
        self.look = look
        self.first = (system, integration)
        self.system, self.integration = system, integration
        self.post, self.downloads = post, downloads
        self.used: Callable[[System, Integration], None] = lambda *_: None
        self.fields: dict[str, Any] = {}
        self.words = pn.pane.HTML("", sizing_mode="stretch_width", css_classes=["system-words"])
        self.facts = pn.pane.HTML("", sizing_mode="stretch_width", css_classes=["system-facts"])
        self.box = pn.Column(sizing_mode="stretch_width", margin=0)
        apply = pn.widgets.Button(name="Use this system", button_type="primary", width=130)
        apply.on_click(lambda _: post(self.apply))
        back = pn.widgets.Button(name="Back to the map's", width=130)
        back.on_click(lambda _: post(lambda: self.take(*self.first)))
        save = pn.widgets.Button(name="Save as TOML", width=110)
        save.on_click(lambda _: post(self._save))
        self.preset = pn.widgets.Select(name="Preset", options=["", *_PRESETS], width=210)
        self.preset.param.watch(lambda event: post(lambda: self._chosen(event.new)), "value")
        self.law = pn.widgets.Select(name="Law of contact", options=_kinds("contact"), width=160)
        self.law.param.watch(lambda _: post(self._law_changed), "value")
        self.file = pn.widgets.FileInput(accept=".toml", multiple=False, width=220)
        self.file.param.watch(lambda event: post(lambda: self._given(event.new)), "value")
        self._buttons = pn.FlexBox(apply, back, save, margin=0)
        self._fill()

    @property
    def layout(self) -> Any:
        """The card."""
        return pn.Column(
            pn.FlexBox(self.preset, pn.Column("Open a TOML file", self.file, margin=0), margin=0),
            self._buttons, self.words, self.facts, self.box,
            sizing_mode="stretch_width", css_classes=["card", "system"],
        )  # fmt: skip

    # ------------------------------------------------------------------ fields

    def _rows(self) -> list[Parameter]:
        held = self.system.parameters
        drive = str(held.get("drive.type", "sine"))
        rows = []
        for row in parameters().values():
            kinds = {"contact": self.law.value, "drive": drive}
            of_kind = not row.kinds or kinds.get(row.section) in row.kinds
            plain_kind = row.quantity.kind in (float, int, str, bool)
            if (
                of_kind
                and plain_kind
                and (row.section != "run" or row.name in _RUN)
                and row.section in _SECTIONS
            ):
                rows.append(row)
        return rows

    def _fill(self) -> None:
        """Make the fields of the system that is held."""
        law = str(self.system.parameters.get("contact.type", "hertz"))
        if self.law.value != law and law in self.law.options:
            self.law.value = law
        self._make_fields()
        self._show_facts()

    def _make_fields(self) -> None:
        held = dict(self.system.parameters)
        held |= {f"run.{name}": value for name, value in integration_mapping(self.integration).items()}
        if self.integration.cycles is None:
            held["integration.cycles"] = self.integration.cycles_or_default
        self.fields = {}
        parts: list[Any] = []
        for section, title in _SECTIONS.items():
            own = [row for row in self._rows() if row.section == section]
            fields = [self._field(row, held.get(row.name)) for row in own]
            if section == "contact":
                fields = [self.law, *fields]
            if fields:
                parts += [pn.pane.HTML(f"<h2>{title}</h2>", margin=0), pn.FlexBox(*fields, margin=0)]
        for part in parts:
            styled(part, self.look)
        self.box.objects = parts

    def _field(self, row: Parameter, value: Any) -> Any:
        unit = "" if row.quantity.unit == "1" else f" ({row.quantity.unit})"
        name = f"{row.name.partition('.')[2].replace('_', ' ')}{unit}"
        words = f"{row.quantity.long_name}; allowed: {row.limits or 'any'}"
        common: dict[str, Any] = {"name": name, "width": 160, "description": words}
        if row.quantity.choices:
            field = pn.widgets.Select(options=list(row.quantity.choices), value=value, **common)
        elif row.quantity.kind is bool:
            field = pn.widgets.Select(options={"no": False, "yes": True}, value=bool(value), **common)
        else:
            field = pn.widgets.TextInput(value=_text(value), placeholder=row.limits, **common)
        self.fields[row.name] = field
        return field

    def sections(self) -> dict[str, dict[str, Any]]:
        """What stands in the fields.

        Raises
        ------
        InputError
            For what is no number, and for values out of range.
        """
        found: dict[str, dict[str, Any]] = {}
        for name, field in self.fields.items():
            row = parameters()[name]
            section, _, key = name.partition(".")
            value: Any = field.value
            if isinstance(value, str) and not row.quantity.choices:
                if not value.strip():
                    continue
                value = number(name, value)
                if row.quantity.kind is int and value == int(value):
                    value = int(value)
            found.setdefault(section, {})[key] = row.quantity.check(name, value)
        found.setdefault("contact", {})["type"] = self.law.value
        if found.get("model", {}).get("modes", 1) > MODES:
            raise InputError(f"model.modes: a page may ask for at most {MODES}")
        if found.get("run", {}).get("cycles", 1) > CYCLES:
            raise InputError(f"integration.cycles: a page may ask for at most {CYCLES}")
        return found

    # ------------------------------------------------------------------ doing

    def apply(self) -> None:
        """Use what stands in the fields from now on; refused with words, and nothing changes."""
        try:
            sections = self.sections()
            run = {name: value for name, value in sections.pop("run", {}).items() if value is not None}
            kept = self.system.to_mapping()
            sections.setdefault("drive", {})["type"] = kept.get("drive", {}).get("type", "sine")
            if sections["drive"]["type"] != "sine" or "start" in kept or "mass" in kept.get("model", {}):
                raise InputError(
                    "a system with a record, a start of its own or matrices is changed from Python"
                )
            system = System.from_mapping(sections)
            self.take(system, Integration(**run))
        except InputError as error:
            self.refuse(str(error))

    def take(self, system: System, integration: Integration) -> None:
        """Use a system from now on."""
        self.system, self.integration = system, integration
        self.words.object = ""
        self._fill()
        self.used(system, integration)

    def _law_changed(self) -> None:
        if str(self.system.parameters.get("contact.type")) != self.law.value:
            self._make_fields()

    def _chosen(self, name: str) -> None:
        if name:
            config = config_from_mapping(_PRESETS[name])
            self.take(config.system, config.integration)

    def _given(self, content: bytes | None) -> None:
        if not content:
            return
        try:
            if len(content) > UPLOAD:
                raise InputError(too_large("the file", len(content)))
            try:
                sections = tomllib.loads(content.decode("utf-8"))
            except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError, ValueError) as error:
                raise InputError(f"the file is no TOML: {error}") from None
            config: Config = config_from_mapping(sections, "the file")
            self.take(config.system, config.integration)
        except InputError as error:
            self.refuse(str(error))

    def refuse(self, words: str) -> None:
        """Say what cannot be done."""
        self.words.object = f'<p class="bad" role="alert">{html.escape(words)}</p>'

    def _save(self) -> None:
        try:
            text = system_toml(self.system, self.integration)
        except InputError as error:
            self.refuse(str(error))
            return
        self.downloads.give("system.toml", text.encode())

    def _show_facts(self) -> None:
        model = self.system.model
        facts = [
            ("f₁", f"{model.reference_frequency:.6g} Hz"),
            (
                "natural frequencies",
                ", ".join(f"{value:.4g}" for value in model.natural_frequencies[:4]) + " Hz",
            ),
            ("barrier", f"{1e6 * (model.saddle_energy - model.well_energy):.4g} µJ"),
        ]
        beam = model.beam
        if beam is not None:
            facts += [
                ("b/r", f"{beam.buckling_level / beam.radius_of_gyration:.4g}"),
                ("P/P_cr", f"{beam.axial_load / beam.critical_load:.5g}"),
            ]
        cells = "".join(f"<td><span class=faint>{name}</span> <b>{value}</b></td>" for name, value in facts)
        found = [each.message for each in self.system.diagnostics()]
        doubts = "".join(f'<p class="bad">{html.escape(each)}</p>' for each in found)
        self.facts.object = f'<table class="facts"><tr>{cells}</tr></table>{doubts}'


def _kinds(section: str) -> list[str]:
    return sorted({kind for row in parameters().values() if row.section == section for kind in row.kinds})


def changed_parameters(
    before: tuple[System, Integration], after: tuple[System, Integration]
) -> dict[str, Any]:
    """What differs between two systems and how they are integrated: new values by dotted name."""
    found: dict[str, Any] = {}
    old, new = plain(before[0].to_mapping()), plain(after[0].to_mapping())
    for section, values in new.items():
        for name, value in values.items():
            before_it: Any = old.get(section, {}).get(name)
            if not np.array_equal(before_it, value):
                found[f"{section}.{name}"] = value
    one, other = (integration_mapping(each[1]) for each in (before, after))
    for name, value in other.items():
        cycles = name == "cycles" and before[1].cycles_or_default == after[1].cycles_or_default
        if one[name] != value and name not in ("engine",) and not cycles:
            found[f"run.{name}"] = value
    return found


def _text(value: Any) -> str:
    """A value as a field holds it: a number as short as it can be and be the same when it is read."""
    if isinstance(value, float):
        short = f"{value:.6g}"
        return short if float(short) == value else repr(value)
    return "" if value is None else str(value)
