"""Drawer Play: the rig's tracks, those that play on a timeline with their sound, and controls."""

import threading
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from gazerig.robot.control.track_choices import TrackInfo
from gazerig.robot.dashboard.requests.outbox import Outbox
from gazerig.robot.dashboard.widgets.html import LINE_PX, box, heading, line, note, svg, text
from gazerig.robot.dashboard.widgets.widget import Buttons
from gazerig.robot.dashboard.widgets.widgets import Container
from gazerig.robot.model.commands import NO_TRACK, EndTrack, Play
from gazerig.robot.model.control_source import FINISHED, TrackState
from gazerig.robot.model.types import Snapshot

ALL = "all"
"""Choice of all tracks that play."""
_SPEEDS, _SPEED_STEP = (0.25, 4.0), 0.05
"""Slowest and fastest speed of tracks, and its step."""
_BINS = 160
_ROW_PX, _WAVE_PX, _BAR_PX = 62.0, 22.0, 7.0
_DRAWN_EVERY_S = 0.2


class PlayPanel:
    """The drawer; it is filled when the rig offers tracks."""

    def __init__(self, place: Container, outbox: Outbox) -> None:
        self._place, self._outbox = place, outbox
        self._infos: dict[str, TrackInfo] = {}
        self._waves = SoundWaves()
        self._drawn_s = 0.0
        self.tracks: Buttons | None = None

    def offer(self, names: Sequence[str]) -> None:
        """Show a button for each track, instead of the previous ones; the first ends all.

        Args:
            names: tracks that the rig can play, and the name that ends them.
        """
        options = tuple(sorted(names, key=lambda name: (name != NO_TRACK, name)))
        if self.tracks is not None:
            self.tracks.options = options
            return
        place = self._place
        self.tracks = place.buttons("play", options, order=1)
        self.speed = place.slider("speed", _SPEEDS, _SPEED_STEP, 1.0, order=2)
        self.loops = place.checkbox("loop", value=False, hint="repeat until it is ended", order=3)
        self.timeline = place.html(note("no track plays"), order=4)
        self.which = place.choice("track", (ALL,), order=5)
        self.end = place.buttons("", ("end",), order=6)
        self.list = place.section("all tracks", is_open=False, order=7).html()
        self.tracks.on_press(self._play)
        self.end.on_press(lambda _, who: self._end(who))
        self._draw_list()

    def add_infos(self, infos: Sequence[object]) -> None:
        """Add what the rig reports of each track, as it was sent."""
        self._infos = {info.name: info for info in msgspec.convert(infos, list[TrackInfo])}
        self._draw_list()

    def show(self, snapshot: Snapshot) -> None:
        """Show the tracks that play, at most five times a second."""
        if self.tracks is None or 0.0 <= snapshot.t_s - self._drawn_s < _DRAWN_EVERY_S:
            return
        self._drawn_s = snapshot.t_s
        shown = snapshot.tracks
        playing = [track for track in shown if track.is_playing]
        self.tracks.current = playing[-1].name if playing else NO_TRACK
        self.which.options = (ALL, *dict.fromkeys(track.name for track in playing))
        self.timeline.content = timeline_html(shown, self._infos, self._waves)

    def _play(self, name: str, who: str) -> None:
        track = "" if name == NO_TRACK else name
        self._outbox.command(Play(track, float(self.speed.value), loop=self.loops.value), who)

    def _end(self, who: str) -> None:
        track = "" if self.which.value == ALL else self.which.value
        if len(self.which.options) > 1:  # something plays
            self._outbox.command(EndTrack(track), who)

    def _draw_list(self) -> None:
        if self.tracks is not None and self._infos:
            self.list.content = "".join(map(_info_html, self._infos.values()))


def timeline_html(
    tracks: Sequence[TrackState],
    infos: Mapping[str, TrackInfo],
    waves: "SoundWaves",
) -> str:
    """Return the tracks as rows of a timeline: sound, cues, position, layers, owners, limits."""
    if not tracks:
        return note("no track plays")
    parts: list[str] = []
    notes: list[str] = []
    for row, track in enumerate(tracks):
        parts += _row(track, infos.get(track.name), waves, row * _ROW_PX)
        if track.who and track.is_playing:
            notes.append(f"{track.name}: started by {track.who}")
        if track.limited:
            notes.append(f"{track.name}: {track.limited}")
        if track.end_reason not in ("", FINISHED):
            notes.append(f"{track.name} has ended: {track.end_reason}")
    says = "; ".join(f"{track.name} at {track.position_s:.1f} s" for track in tracks)
    drawing = svg(len(tracks) * _ROW_PX, parts, f"tracks: {says}")
    return drawing + "".join(map(note, notes))


def _row(
    track: TrackState, info: TrackInfo | None, waves: "SoundWaves", top: float
) -> Iterable[str]:
    """Return one track: its name and time, sound, bar with cues, layers and owned joints."""
    lasts_s = max(track.duration_s, 1e-3)
    x = min(max(track.position_s / lasts_s, 0.0), 1.0) * LINE_PX
    extra = [
        "ended" if track.end_reason else "",
        "loop" if track.loop else "",
        f"x{track.speed:g}" if track.speed != 1 else "",
    ]
    yield text(0.0, top + 12.0, " ".join([track.name, *filter(None, extra)]))
    clock = f"{max(track.position_s, 0.0):.1f} of {track.duration_s:.1f} s"
    if track.clock != "loop":
        clock += f", {track.clock} clock"
    yield text(LINE_PX, top + 12.0, clock, "end")
    middle = top + 17.0 + _WAVE_PX / 2.0
    if track.sound and (wave := waves.get(track.sound)) is not None:
        step = LINE_PX / _BINS
        for k, high in enumerate(wave.tolist()):
            tall = max(0.6, high * _WAVE_PX)
            yield box(k * step, middle - tall / 2.0, 0.8 * step, tall, "calm")
    bar = top + 18.0 + _WAVE_PX
    yield box(0.0, bar, LINE_PX, _BAR_PX, "line-grid", "the track's time")
    yield box(0.0, bar, x, _BAR_PX, "ok")
    for name, at_s in info.cues if info is not None else ():
        place = at_s / lasts_s * LINE_PX
        yield line(((place, bar - 4.0), (place, bar + _BAR_PX)), "axis")
        yield text(min(place + 2.0, LINE_PX - 40.0), bar - 3.0, name, size=10.0)
    yield line(((x, top + 16.0), (x, bar + _BAR_PX)), "mean")
    layers = ", ".join(info.layers) if info is not None else ""
    owns = f"owns {', '.join(track.owns)}" if track.owns else "owns no joint"
    yield text(0.0, bar + _BAR_PX + 12.0, f"{layers}; {owns}" if layers else owns, size=11.0)


def _info_html(info: TrackInfo) -> str:
    """Return one track of the list: name, duration, description, or why the rig refuses it."""
    slower = f", {info.slowed_by:.2f} times slower" if info.slowed_by > 1.0 + 1e-6 else ""
    aside = "" if info.refused else f"{info.duration_s:.1f} s{slower}"
    refused = info.refused and f"refused: {info.refused}"
    lines = [info.description, refused, Path(info.sound).name]
    return heading(info.name, aside) + "".join(map(note, filter(None, lines)))


class SoundWaves:
    """Outlines of sounds, each read once in a thread of its own."""

    def __init__(self) -> None:
        self._found: dict[str, NDArray[np.float32] | None] = {}

    def get(self, path: str) -> NDArray[np.float32] | None:
        """Return the outline of a sound, None while it is not known or cannot be read."""
        if path not in self._found:
            self._found[path] = None
            threading.Thread(target=self._read, args=(path,), daemon=True).start()
        return self._found[path]

    def _read(self, path: str) -> None:
        from gazerig.drivers.sound.sound_file import SoundInfo, read_samples

        try:
            samples = read_samples(SoundInfo(path, 0.0))
        except Exception:  # the rig has reported it
            return
        self._found[path] = outline(samples, _BINS)


def outline(samples: NDArray[np.float32], bins: int) -> NDArray[np.float32]:
    """Return the largest magnitude of each part of a sound, as a share of the largest.

    Args:
        samples: (n,) one channel.
        bins: number of equal parts.
    """
    if not len(samples):
        return np.zeros(bins, np.float32)
    edges = np.linspace(0, len(samples), bins + 1).astype(int)[:-1]
    found = np.maximum.reduceat(np.abs(samples), np.minimum(edges, len(samples) - 1))
    return np.asarray(found / max(float(found.max()), 1e-9), np.float32)
