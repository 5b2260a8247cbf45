"""A simulated robot: what it does in its home and what its map shows, mission by mission. No HTTP; see `client`.

What a robot does next never depends on what a service answers: all that it draws comes from `Streams`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np

from stillroom.documents.images import UNKNOWN_GREY, encode_png
from stillroom.maps.grid import Cell, Mask, OccupancyGrid
from stillroom.simulator.building import home_of
from stillroom.simulator.changes import World, home_during, world_during
from stillroom.simulator.distortion import Distortion, distortion_at, is_reset
from stillroom.simulator.effects import Effects, Streams
from stillroom.simulator.homes import Home
from stillroom.simulator.mapping import Sensed, sense
from stillroom.simulator.tracking import form_of, track_map

_SLIVER_CELLS = 5
"""What was seen is as wide as this at least: 12 cm."""
_OTHER = 1_000_003
"""From a home's seed to that of the other floor."""


@dataclass(frozen=True, eq=False)
class Sortie:
    """One mission as it went: the world it went through, how its map is bent, and the map."""

    number: int
    world: World
    distortion: Distortion
    sensed: Sensed
    explored: Mask
    """Cells of the floor where the robot has been in all its missions so far, but for what stands there now, and slivers."""
    happened: frozenset[str] = frozenset()
    """What came in it, by the names of EFFECTS."""

    @property
    def refuse(self) -> str | None:
        """The effect for which its grid must not be taken; None: it may."""
        return next((name for name in ("slam_failures", "other_floors") if name in self.happened), None)

    def png(self) -> bytes:
        """The grid as the robot uploads it."""
        grey = np.zeros(3, np.uint8)
        grey[[Cell.UNEXPLORED, Cell.FREE, Cell.OCCUPIED]] = UNKNOWN_GREY, 254, 0
        return encode_png(grey[self.sensed.grid.cells[::-1]])


class SimulatedRobot:
    """One robot in one home; the same for the same home, streams, effects and resolution (metres a cell)."""

    def __init__(self, home: Home, streams: Streams, effects: Effects, resolution: float = 0.05) -> None:
        self.home = home
        self.streams = streams
        self.effects = effects
        self.resolution = resolution
        self._standing = (0, home)
        self._seen: Mask | None = None
        self._distortions: dict[int, Distortion] = {}

    def sortie(self, number: int) -> Sortie:
        world = world_during(self._home_at(number), number, self.effects, self.streams)
        bent = self.distortion(number)
        sensed = sense(world, bent, number, self.resolution, self.effects, self.streams)
        happened = world.happened | sensed.happened | self._tracking_happened(number)
        if self._is_elsewhere(number):
            sensed = replace(sensed, grid=self._other_floor(number), seen=np.zeros_like(sensed.seen))
            happened = frozenset({"other_floors"})
        self._seen = sensed.seen if self._seen is None else self._seen | sensed.seen
        return Sortie(number, world, bent, sensed, _wide(self._seen & ~sensed.floor.solid), happened)

    def distortion(self, number: int) -> Distortion:
        if number not in self._distortions:
            self._distortions[number] = distortion_at(self.home, number, self.effects, self.streams)
        return self._distortions[number]

    def meta(self, sortie: Sortie, base: Mapping[str, Any] | None) -> dict[str, Any]:
        """The upload's `meta`; `base` is the document of the map that it set out with, None before there was one."""
        frame = sortie.sensed.grid.frame
        meta: dict[str, Any] = {
            "sequence": sortie.number,
            "epoch": self.epoch(sortie.number),
            "firmware": "1.0.0",
            "model": "simulated",
            "resolution": frame.resolution,
            "origin": [frame.origin.x, frame.origin.y, frame.origin.yaw],
        }
        if base is None or is_reset(sortie.number, self.effects, self.streams):
            return meta
        tracking = self.tracking(base, int(base["mission"]), sortie.number)
        return meta | {"base_version": base["version"]} | ({} if tracking is None else {"tracking": tracking})

    def tracking(self, base: Mapping[str, Any], base_mission: int, number: int) -> dict[str, Any] | None:
        """The `tracking` of a mission's meta: where the features of a map document went since the mission whose frame it has.

        None where the robot tracked nothing. On another floor it tracks them where they were.
        """
        if not self._tracks(number) or self.epoch(base_mission) != self.epoch(number):
            return None
        noise, outliers = self.streams.of("tracking", number), self.streams.of("outliers", number)
        before = self.distortion(base_mission)
        after = before if self._is_elsewhere(number) else self.distortion(number)
        return track_map(base, before, after, form_of(self.effects, self.streams), self.effects, noise, outliers)

    def epoch(self, number: int) -> int:
        """How often the robot had lost its map by then."""
        return sum(is_reset(past, self.effects, self.streams) for past in range(number + 1))

    def _tracking_happened(self, number: int) -> frozenset[str]:
        happened = {
            "tracking_missing": number > 0 and not self._tracks(number),
            "resets": is_reset(number, self.effects, self.streams),
            "tracking_forms": form_of(self.effects, self.streams) != "vertices",
        }
        return frozenset(name for name, has in happened.items() if has)

    def _tracks(self, number: int) -> bool:
        lost = self._is_elsewhere(number) and self.streams.of("floors", number).random(2)[1] < 0.5
        return not lost and self.streams.of("silence", number).random() >= self.effects.tracking_missing

    def _is_elsewhere(self, number: int) -> bool:
        return number > 0 and self.streams.of("floors", number).random() < self.effects.other_floors

    def _other_floor(self, number: int) -> OccupancyGrid:
        """The grid of a mission on another floor, which is the same one each time."""
        streams = replace(self.streams, seed=self.streams.seed + _OTHER)
        home = home_of(streams, self.effects)
        bent = distortion_at(home, number, self.effects, streams)
        return sense(World(home), bent, number, self.resolution, replace(self.effects, slam_failures=0.0), streams).grid

    def _home_at(self, number: int) -> Home:
        """The home as it stands in a mission; asked for in order, each change is made once."""
        past, home = self._standing if self._standing[0] <= number else (0, self.home)
        for step in range(past + 1, number + 1):
            home = home_during(home, step, self.effects, self.streams)
        self._standing = (number, home)
        return home


def _wide(seen: Mask) -> Mask:
    """Without slivers that no robot's map holds: what it saw past the edge of a cupboard."""
    kernel = np.ones((_SLIVER_CELLS, _SLIVER_CELLS), np.uint8)
    return np.asarray(cv2.morphologyEx(seen.view(np.uint8), cv2.MORPH_OPEN, kernel) > 0)
