"""A simulated robot: what it does in its home and what its map shows, mission by mission. No HTTP; see `client`.

What a robot does next never depends on what a service answers: all that it draws comes from `Streams`.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from numpy.random import Generator

from stillroom.documents.images import UNKNOWN_GREY, encode_png
from stillroom.maps.geometry import Points, as_points
from stillroom.maps.grid import Cell, Mask
from stillroom.simulator.changes import World, move_furniture, world_during
from stillroom.simulator.distortion import Distortion, distortion_at
from stillroom.simulator.effects import Effects, Streams
from stillroom.simulator.homes import Home
from stillroom.simulator.mapping import Sensed, sense

OUTLIER_M = 1.0
"""Standard deviation of a vertex that was tracked grossly wrong."""


@dataclass(frozen=True, eq=False)
class Sortie:
    """One mission as it went: the world it went through, how its map is bent, and the map."""

    number: int
    world: World
    distortion: Distortion
    sensed: Sensed
    explored: Mask
    """Cells of the floor where the robot has been in all its missions so far, but for what stands there now."""
    happened: frozenset[str] = frozenset()
    """Which of `EFFECTS` came in it."""

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
        self._furnished = (0, home)
        self._seen: Mask | None = None
        self._distortions: dict[int, Distortion] = {}

    def sortie(self, number: int) -> Sortie:
        world = world_during(self._home_at(number), number, self.effects, self.streams)
        bent = self.distortion(number)
        sensed = sense(world, bent, number, self.resolution, self.effects, self.streams)
        self._seen = sensed.seen if self._seen is None else self._seen | sensed.seen
        happened = {
            "doors": world.shut,
            "skipped": world.skipped,
            "tracking_missing": number and not self._tracks(number),
        }
        named = frozenset(name for name, there in happened.items() if there)
        return Sortie(number, world, bent, sensed, self._seen & ~sensed.floor.solid, named)

    def _tracks(self, number: int) -> bool:
        return self.streams.of("silence", number).random() >= self.effects.tracking_missing

    def distortion(self, number: int) -> Distortion:
        if number not in self._distortions:
            self._distortions[number] = distortion_at(self.home, number, self.effects, self.streams)
        return self._distortions[number]

    def meta(self, sortie: Sortie, base: Mapping[str, Any] | None) -> dict[str, Any]:
        """The upload's `meta`; `base` is the document of the map in force, None before there is one."""
        frame = sortie.sensed.grid.frame
        meta: dict[str, Any] = {
            "sequence": sortie.number,
            "firmware": "1.0.0",
            "model": "simulated",
            "resolution": frame.resolution,
            "origin": [frame.origin.x, frame.origin.y, frame.origin.yaw],
        }
        if base is None:
            return meta
        tracking = self.tracking(base, int(base["mission"]), sortie.number)
        return meta | {"base_version": base["version"]} | ({} if tracking is None else {"tracking": tracking})

    def tracking(self, base: Mapping[str, Any], base_mission: int, number: int) -> dict[str, Any] | None:
        """The `tracking` of a mission's meta: where the features of a map document went since the mission whose frame it has.

        None where the robot tracked nothing.
        """
        if not self._tracks(number):
            return None
        noise, outliers = self.streams.of("tracking", number), self.streams.of("outliers", number)
        before, after = self.distortion(base_mission), self.distortion(number)

        def tracked(vertices: object) -> list[list[float]]:
            moved = after.apply(before.undo(as_points(vertices)))
            placed: list[list[float]] = np.round(_with_errors(moved, self.effects, noise, outliers), 4).tolist()
            return placed

        kinds: dict[str, dict[str, Any]] = {"rooms": {}, "dividers": {}}
        for feature in base["features"]:
            coordinates = feature["geometry"]["coordinates"]
            if feature["properties"]["semantic"] == "room":
                kinds["rooms"][feature["id"]] = tracked(coordinates[0][:-1])
            elif feature["properties"]["semantic"] == "divider":
                kinds["dividers"][feature["id"]] = tracked(coordinates)
        return kinds

    def _home_at(self, number: int) -> Home:
        """The home as its furniture stands in a mission; asked for in order, each piece is moved once."""
        past, home = self._furnished if self._furnished[0] <= number else (0, self.home)
        for step in range(past + 1, number + 1):
            home = move_furniture(home, self.effects.furniture_moves, self.streams.of("furniture", step))
        self._furnished = (number, home)
        return home


def _with_errors(points: Points, effects: Effects, noise: Generator, outliers: Generator) -> Points:
    points = points + effects.tracking_noise_m * noise.normal(size=points.shape)
    gross: npt.NDArray[np.bool_] = outliers.random(len(points)) < effects.tracking_outliers
    return points + gross[:, None] * OUTLIER_M * outliers.normal(size=points.shape)
