"""The page of ``snapbeam look``: a frame of a recording, what tracking finds in it, and what a person sets over it."""

from __future__ import annotations

import math
import shlex
from contextlib import suppress
from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np
import panel as pn
from bokeh.document import Document
from bokeh.models import BoxAnnotation, BoxEditTool, ColumnDataSource, LinearColorMapper, PointDrawTool, Range1d
from markupsafe import Markup

from snapbeam.explorer.address import Address
from snapbeam.explorer.jobs import Tab
from snapbeam.explorer.server import begin_pages
from snapbeam.explorer.style import FAINT, HEADING, NOTE, REFUSED, Html, button, figure, legend, look_of, sheet, styled
from snapbeam.lab.camera import Recording, open_recording, pixel_size_from_marks
from snapbeam.lab.cli.options import rest_of, whole_numbers
from snapbeam.lab.image_sources import open_source
from snapbeam.lab.look import moved, opened_with, write_look
from snapbeam.lab.plot.tracking import BEAM_MARK, SHAKER_MARK, STICKER_MARK, edge_lines
from snapbeam.lab.tracking.first_look import first_look
from snapbeam.lab.tracking.settings import SIDES, TrackingSettings
from snapbeam.lab.tracking.track import edges_in
from snapbeam.util.validation import InputError, file_path, positive, shown

_WIDTH, _HEIGHT = 560, 540
"""Pixels of the page that a frame may take."""
_NUMBERS = {
    "pixel_size": ("Pixel size, µm", -6), "frame_rate": ("Frame rate, Hz", 0),
    "threshold": ("Threshold, grey level", 0), "tip_distance": ("Tip to sticker, mm", -3),
    "buckling_level": ("Buckling level b, mm", -3), "location": ("Location of the contact, x_s/L", 0),
}  # fmt: skip
"""Label of each number that may be given, and the power of ten of its unit."""
_WHOLE = {
    "region": ("Region", "ROW:ROW,COLUMN:COLUMN", 4), "frames": ("Frames to use", "FIRST:LAST+1", 2),
    "rest_frames": ("Frames at rest", "N or FIRST:LAST+1", 0),
}  # fmt: skip
_CHOICES = {"side": list(SIDES), "objects": ["auto", "bright", "dark"]}
_FLAGS = {"shaker": "Follow the shaker", "marker": "Look for its sticker"}
_ANY = {"frame_rate": 1.0, "pixel_size": 1e-5}
"""Scales at which a picture is looked at while none is known."""
_DRAWN = ("fixed_marks", "contact_column")
_WAYS = {
    "Line": "Drag the ends of the line over a known length.",
    "Contact": "Click where the shaker strikes; by default this is found. Backspace removes the chosen point.",
    "Fixed marks": "Hold Shift and drag around an object that stands still. Backspace removes the chosen one.",
    "Move the picture": "Drag the picture; the wheel zooms.",
}


class Looked:
    """The recording that the pages of one server show, the file to write, and the settings to begin with."""

    def __init__(self, path: Path, output: Path, sections: dict[str, dict[str, Any]]) -> None:
        self.path, self.output, self.sections = path, output, sections
        self.source = open_source(file_path("path", path))
        self.pages = 0
        self.opened(sections)[0].close()
        begin_pages()

    def opened(self, sections: dict[str, dict[str, Any]]) -> tuple[Recording, TrackingSettings]:
        """The recording with checked settings, at any scale where none is known."""
        missing = {name: value for name, value in _ANY.items() if getattr(self.source, name) is None}
        return opened_with(self.path, sections | {"camera": missing | sections["camera"]})

    def page(self, arguments: dict[str, list[bytes]], doc: Any) -> LookPage:
        """A page for a session."""
        return LookPage(self, arguments, doc)

    def close(self) -> None:
        """Close the recording."""
        self.source.close()


class LookPage(Tab):
    """A frame with what was found and what was set on the left, the settings on the right."""

    def __init__(self, shared: Looked, arguments: dict[str, list[bytes]], doc: Document | None = None) -> None:
        super().__init__(doc)
        self.shared, source = shared, shared.source
        self.height, self.width = source.shape
        self.count = int(source.numbers.size)
        address = Address.read(arguments)
        self.look = look_of(address.theme, lecture=address.type == "large")
        self.words = Html("", sizing_mode="stretch_width", css_classes=["look-words"])
        self.found = Html("", sizing_mode="stretch_width", css_classes=["look-found"])
        self.recording: Recording | None = None
        self.first = 0  # frame of the file that is the recording's first
        self.edges: Any = None
        self.proposed: list[tuple[int, int, int, int]] = []
        self._fields()
        self._figure()
        pn.config.raw_css = [sheet(self.look)]
        self.layout = self._laid_out()
        styled(self.layout, self.look)
        self._draw_set()
        self.show()
        pn.state.onload(lambda: self._told(self.find))

    def close(self) -> None:
        """The tab is closed."""
        super().close()
        if self.recording is not None:
            self.recording.close()

    # ------------------------------------------------------------------ widgets

    def _fields(self) -> None:
        """One field for each setting, filled with what the file of settings or the recording says."""
        source, sections = self.shared.source, self.shared.sections
        given = moved(sections["tracking"], sections["camera"].get("region"), 1) | sections["camera"]
        own = (*_NUMBERS, *_WHOLE, *_CHOICES, *_FLAGS, *_DRAWN)
        self.kept = {name: value for name, value in sections["tracking"].items() if name not in own}
        self.drawn = {name: given.get(name) for name in _DRAWN}
        stated = {name: getattr(source, name) for name in _ANY}
        usual = vars(TrackingSettings())
        self.field: dict[str, Any] = {}
        for name, (label, power) in _NUMBERS.items():
            text = _shown(given.get(name, stated.get(name)), power)
            self.field[name] = pn.widgets.TextInput(name=label, value=text, width=160)
        self.stated = {name: _shown(value, _NUMBERS[name][1]) for name, value in stated.items()}
        for name, (label, form, _) in _WHOLE.items():
            value = given.get(name)
            text = "" if value is None else str(value) if isinstance(value, int) else ":".join(map(str, value[:2]))
            text += f",{value[2]}:{value[3]}" if name == "region" and value else ""
            self.field[name] = pn.widgets.TextInput(name=label, value=text, placeholder=form, width=160)
        for name, options in _CHOICES.items():
            value = given.get(name, usual[name])
            self.field[name] = pn.widgets.Select(name=name.capitalize(), options=options, value=value, width=160)
        for name, label in _FLAGS.items():
            self.field[name] = pn.widgets.Checkbox(name=label, value=given.get(name, usual[name]), width=160)
        self.field["region"].param.watch(lambda _: self.post(self._draw_region), "value")
        self.source_of = {}
        for name, hint in (("pixel_size", source.pixel_size_hint), ("frame_rate", source.frame_rate_question)):
            words = "in the file" if stated[name] is not None else f"not in the file{'; ' if hint else ''}{hint}"
            words = "in the file of settings" if name in sections["camera"] else words
            self.source_of[name] = Html(FAINT.format(words), width=160, margin=(0, 10))
        self.length = pn.widgets.TextInput(name="Length of the line, mm", width=160)
        self.centred = pn.widgets.Checkbox(name="between the centres of two marks", width=160, margin=(30, 10, 5, 10))
        self.frame = pn.widgets.IntSlider(
            name="Frame", start=0, end=max(self.count - 1, 1), sizing_mode="stretch_width"
        )
        self.frame.param.watch(lambda _: self.post(self.show), "value")
        self.way = pn.widgets.RadioButtonGroup(options=list(_WAYS), margin=(5, 10))

    def _figure(self) -> None:
        """The frame, the tools over it, and the sources of what they change."""
        scale = min(_WIDTH / self.width, _HEIGHT / self.height)
        wide, high = round(self.width * scale), round(self.height * scale)
        self.plot = plot = figure(
            self.look, name="frame", sizing_mode=None, frame_width=wide, frame_height=high, width=None,
            height=None, x_range=Range1d(-0.5, self.width - 0.5),
            y_range=Range1d(self.height - 0.5, -0.5), tools="pan,wheel_zoom,reset", x_axis_label="column (px)",
            y_axis_label="row (px)",
        )  # fmt: skip
        plot.grid.visible = False
        self.image = ColumnDataSource({"image": []})
        corner = {"x": -0.5, "y": -0.5, "dw": self.width, "dh": self.height}
        plot.image("image", source=self.image, color_mapper=LinearColorMapper("Greys256", low=0, high=255), **corner)
        self.lines = ColumnDataSource({name: [] for name in ("xs", "ys", "color", "dash", "name")}, name="found")
        plot.multi_line(
            "xs", "ys", source=self.lines, line_color="color", line_dash="dash", line_width=2, legend_field="name"
        )
        third = [self.width / 3 - 0.5, 2 * self.width / 3 - 0.5]
        self.line = ColumnDataSource({"x": third, "y": [self.height / 16] * 2}, name="line")
        self.contact = ColumnDataSource({"x": [], "y": []}, name="contact")
        self.marks = ColumnDataSource({name: [] for name in ("left", "right", "top", "bottom")}, name="marks")
        accent = self.look.accent
        plot.line("x", "y", source=self.line, line_color="white", line_width=3, line_alpha=0.6)
        plot.line("x", "y", source=self.line, line_color=accent, line_width=1.5)
        ends = plot.scatter("x", "y", source=self.line, size=12, fill_color="white", line_color=accent, line_width=2)
        place = plot.scatter(
            "x", "y", source=self.contact, size=14, marker="triangle", fill_color=SHAKER_MARK, line_color="white"
        )
        boxes = plot.quad(
            source=self.marks, left="left", right="right", top="top", bottom="bottom", fill_color=STICKER_MARK,
            fill_alpha=0.25, line_color=STICKER_MARK, line_width=2,
        )  # fmt: skip
        self.box = BoxAnnotation(
            left=-0.5, right=self.width - 0.5, top=-0.5, bottom=self.height - 0.5, editable=True, movable="none",
            resizable="all", inverted=True, fill_color="black", fill_alpha=0.35, line_color=accent, line_width=2,
            name="region",
        )  # fmt: skip
        plot.add_layout(self.box)
        tools = [
            PointDrawTool(renderers=[ends], add=False, num_objects=2), PointDrawTool(renderers=[place], num_objects=1),
            BoxEditTool(renderers=[boxes]), plot.tools[0],
        ]  # fmt: skip
        plot.add_tools(*tools[:3])
        plot.toolbar.active_drag, plot.toolbar.active_tap = tools[0], None
        self.way.jscallback(
            args={"tools": tools}, value="tools.forEach((tool, i) => { tool.active = i === cb_obj.active; });"
        )
        plot.toolbar_location = None
        for side in ("left", "right", "top", "bottom"):
            self.box.on_change(side, lambda attr, old, new: self.post(self._region_drawn))
        self.line.on_change("data", lambda attr, old, new: self.post(self._measure))
        legend(plot, self.look)

    def _laid_out(self) -> Any:
        field = self.field
        title = Markup('<h1>snapbeam <span class="faint">{}: {} frames of {} x {} pixels</span></h1>').format(
            self.shared.path.name, self.count, self.height, self.width
        )
        wide: dict[str, Any] = {"sizing_mode": "stretch_width", "margin": 0}
        self.hint = Html(NOTE.format(_WAYS["Line"]), sizing_mode="stretch_width", margin=0)
        self.way.param.watch(lambda event: setattr(self.hint, "object", NOTE.format(_WAYS[event.new])), "value")
        self.measured = Html("", sizing_mode="stretch_width", margin=0, css_classes=["look-measured"])
        left = pn.Column(
            self.frame, self.way, self.hint, pn.pane.Bokeh(self.plot), self.found, sizing_mode="stretch_width",
            css_classes=["card", "left"], styles={"min-width": f"{self.plot.frame_width + 90}px"},
        )  # fmt: skip

        def press(name: str, work: Any, **options: Any) -> Any:
            return button(name, self.post, lambda: self._told(work), **options)

        def row(*parts: Any) -> Any:
            return pn.FlexBox(*parts, **wide)

        def stated(name: str) -> Any:
            return pn.Column(field[name], self.source_of[name], margin=0)

        scale = press("Set the pixel size", self.take_scale, width=160)
        tip = press("Set tip to sticker", self.take_tip, width=160)
        begin = press("First: this frame", lambda: self.take_frame(0), width=160)
        end = press("Last: this frame", lambda: self.take_frame(1), width=160)
        words = ("snapbeam", "track", str(self.shared.path), "--settings", str(self.shared.output))
        command = Html(Markup("<pre>{}</pre>").format(shlex.join(words)), sizing_mode="stretch_width")
        right = pn.Column(
            Html(HEADING.format("Scale")),
            row(stated("pixel_size"), self.length, self.centred),
            self.measured, row(scale, tip),
            Html(HEADING.format("Time")),
            row(stated("frame_rate"), field["frames"], field["rest_frames"]), row(begin, end),
            Html(HEADING.format("Scene")),
            row(field["region"], field["threshold"]), row(field["side"], field["objects"]),
            row(field["shaker"], field["marker"]),
            row(field["tip_distance"], field["buckling_level"], field["location"]),
            row(
                press("Find beam and shaker", self.find, width=160),
                press("Write the settings", self.write, width=160, button_type="primary"),
            ),
            self.words, command,
            sizing_mode="stretch_width", css_classes=["card", "right"],
        )  # fmt: skip
        body = pn.FlexBox(left, right, flex_wrap="wrap", css_classes=["body"], **wide)
        return pn.Column(Html(title, margin=0), body, css_classes=["whole"], **wide)

    # ------------------------------------------------------------------ the picture

    def show(self) -> None:
        """Show the chosen frame, and what was found in it."""
        at = self._at()
        picture = self.shared.source.read(at, at + 1, (0, self.height))[0].astype(float)
        low, high = np.percentile(picture, (0.2, 99.8))
        grey = np.clip((picture - low) * (255.0 / max(high - low, 1.0)), 0, 255).astype(np.uint8)
        self.image.data = {"image": [grey]}
        self._draw_found()

    def _at(self) -> int:
        return min(int(self.frame.value), self.count - 1)

    def _draw_set(self) -> None:
        """Draw the settings of the file over the picture."""
        marks, column = self.drawn["fixed_marks"] or [], self.drawn["contact_column"]
        names = ("top", "bottom", "left", "right")
        self.marks.data = {name: [mark[i] - 0.5 for mark in marks] for i, name in enumerate(names)}
        if column is not None:
            x, y = (self.width / 2, column) if self._sideways() else (column, self.height / 2)
            self.contact.data = {"x": [x], "y": [y]}
        self._draw_region()
        self._measure()

    def _sideways(self) -> bool:
        return self.field["side"].value in ("left", "right")

    def _draw_region(self) -> None:
        """Draw the region that was typed."""
        with suppress(InputError):
            top, bottom, left, right = self._whole("region") or (0, self.height, 0, self.width)
            self.box.update(top=top - 0.5, bottom=bottom - 0.5, left=left - 0.5, right=right - 0.5)

    def _region_drawn(self) -> None:
        """Write the region that was drawn into its field."""
        ends = [
            min(max(round(float(end) + 0.5), 0), most)
            for pair, most in (((self.box.top, self.box.bottom), self.height), ((self.box.left, self.box.right), self.width))
            for end in sorted(pair)
        ]  # fmt: skip
        whole = ends == [0, self.height, 0, self.width]
        self.field["region"].value = "" if whole else "{}:{},{}:{}".format(*ends)

    def _draw_found(self) -> None:
        """Draw the edges that were found in the frame, where it is one of those in use, or regions with a beam."""
        lines: list[Any] = []
        at = self._at() - self.first
        if self.edges is not None and self.recording is not None and 0 <= at < len(self.recording):
            top, _, left, _ = self.recording.region
            attrs, seen = self.edges(at)
            for name, color, style, rows, columns in edge_lines(attrs, seen, self.recording.shape):
                lines.append((columns + left, rows + top, color, "solid" if style == "-" else "dashed", name))
        for top, bottom, left, right in self.proposed:
            x, y = np.array([left, right]) - 0.5, np.array([top, bottom]) - 0.5
            lines.append((x[[0, 1, 1, 0, 0]], y[[0, 0, 1, 1, 0]], BEAM_MARK, "dotted", "a beam is found here"))
        names = ("xs", "ys", "color", "dash", "name")
        self.lines.data = {name: [line[i] for line in lines] for i, name in enumerate(names)}

    def find(self) -> None:
        """Find beam and shaker with the settings of the page; where there is no beam, regions with one."""
        self.edges, self.proposed, self.found.object = None, [], ""
        if self.recording is not None:
            self.recording.close()
            self.recording = None
        try:
            sections = self.sections()
            self.recording, settings = self.shared.opened(sections)
            self.first = (sections["camera"].get("frames") or (0,))[0]
            try:
                self.edges = edges_in(self.recording, settings)
                attrs, rows = self.edges(0)
                by = "sticker" if "marker_row" in rows else "tip" if "tip_row" in rows else ""
                self.found.object = NOTE.format(
                    f"Found: a beam {attrs['beam_thickness_px']:.1f} px thick at the threshold {attrs['threshold']:.4g}; "
                    + (f"the shaker by its {by}." if by else "no shaker is followed.")
                )
            except InputError as error:
                regions = first_look(self.recording, settings).options
                self.proposed = list(regions)
                self.found.object = REFUSED.format(error) + Markup("").join(
                    NOTE.format(f"A beam is found with {words}") for words in regions.values()
                )
        finally:
            self._draw_found()

    # ------------------------------------------------------------------ what was set

    def _number(self, field: Any, power: int) -> float | None:
        """The number of a field in SI units; None if the field is empty."""
        if not (text := field.value.strip()):
            return None
        try:
            return float(Decimal(text).scaleb(power))
        except (ArithmeticError, ValueError):
            raise InputError(f"{field.name} = {shown(text)}: must be a number") from None

    def _whole(self, name: str) -> Any:
        """The whole numbers of a field; None if the field is empty."""
        count, text = _WHOLE[name][2], self.field[name].value.strip()
        if not text:
            return None
        return whole_numbers(name, text, count) if count else rest_of(text)

    def sections(self) -> dict[str, dict[str, Any]]:
        """Values that were set, as the sections of a file of settings."""
        camera: dict[str, Any] = {}
        tracking = dict(self.kept)
        for name, (_, power) in _NUMBERS.items():
            if self.field[name].value != self.stated.get(name):
                (camera if name in _ANY else tracking)[name] = self._number(self.field[name], power)
        for name in _WHOLE:
            (tracking if name == "rest_frames" else camera)[name] = self._whole(name)
        usual = vars(TrackingSettings())
        for name in (*_CHOICES, *_FLAGS):
            if self.field[name].value != usual[name]:
                tracking[name] = self.field[name].value
        ends = [self.marks.data[name] for name in ("top", "bottom", "left", "right")]
        tracking["fixed_marks"] = [
            [round(float(end) + 0.5) for pair in (sorted((a, b)), sorted((c, d))) for end in pair]
            for a, b, c, d in zip(*ends, strict=True)
        ] or None  # fmt: skip
        if len(place := self.contact.data["y" if self._sideways() else "x"]):
            tracking["contact_column"] = round(float(place[0]), 2)
        made = {"camera": camera, "tracking": moved(tracking, camera["region"], -1)}
        return self.shared.sections | {
            section: {name: value for name, value in values.items() if value is not None}
            for section, values in made.items()
        }

    def _ends(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """(row, column) of the ends of the line."""
        (x, u), (y, v) = self.line.data["x"], self.line.data["y"]
        return (float(y), float(x)), (float(v), float(u))

    def _apart(self) -> float:
        return math.dist(*self._ends())

    def _pixel(self) -> float | None:
        return self._number(self.field["pixel_size"], -6)

    def _measure(self) -> None:
        """Say how long the line is."""
        words = f"Line: {self._apart():.1f} px"
        with suppress(InputError):
            words += f" = {1e3 * self._apart() * pixel:.4g} mm" if (pixel := self._pixel()) else ""
        self.measured.object = NOTE.format(words)

    def take_scale(self) -> None:
        """Set the pixel size from the line, whose length was given."""
        length = self._number(self.length, -3)
        if length is None:
            raise InputError(f"{self.length.name}: must be given")
        length = positive(self.length.name, length, "mm")
        size = length / positive("line", self._apart(), "px")
        if self.centred.value:
            first, second = self._ends()
            with open_recording(self.shared.path, frame_rate=1.0, pixel_size=1e-5) as recording:
                size, _ = pixel_size_from_marks(recording, first, second, length, frame=self._at())
        self.field["pixel_size"].value = f"{1e6 * size:.6g}"
        self.source_of["pixel_size"].object = FAINT.format(f"from a line of {1e3 * length:g} mm")
        self._measure()

    def take_tip(self) -> None:
        """Set the distance from the tip to its sticker from the line."""
        pixel = self._pixel()
        if pixel is None:
            raise InputError(f"{self.field['pixel_size'].name}: must be given")
        self.field["tip_distance"].value = f"{1e3 * pixel * self._apart():.5g}"

    def take_frame(self, which: int) -> None:
        """Make the shown frame the first (0) or the last one (1) in use."""
        frames = list(self._whole("frames") or (0, self.count))
        frames[which] = self._at() + which
        self.field["frames"].value = "{}:{}".format(*frames)

    def write(self) -> None:
        """Write the file."""
        target = write_look(self.shared.path, self.sections(), self.shared.output)
        self.words.object = NOTE.format(f"Written: {target}")

    def _told(self, work: Any) -> None:
        """Do something, and say what is wrong with what was set."""
        self.words.object = ""
        try:
            work()
        except (InputError, OSError) as error:
            self.words.object = REFUSED.format(error)


def _shown(value: float | None, power: int) -> str:
    """A number in another unit, as short as it is exact."""
    return "" if value is None else f"{Decimal(repr(float(value))).scaleb(-power).normalize():f}"
