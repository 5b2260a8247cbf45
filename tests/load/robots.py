"""Robots for a load: simulated homes whose missions were drawn beforehand, sent by as many robots as it takes."""

import struct
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from stillroom.simulator.building import draw_home
from stillroom.simulator.effects import Effects, Streams
from stillroom.simulator.fleet import SimulatedRobot, Sortie
from stillroom.simulator.running import ROOM_COUNTS

_AFTER_HEADER = 33
"""A PNG's signature and its first chunk."""
_TIMES = {"started_at": "2026-01-01T00:00:00Z", "ended_at": "2026-01-01T00:40:00Z"}


@dataclass(frozen=True, eq=False)
class Home:
    robot: SimulatedRobot
    sorties: Sequence[Sortie]
    pictures: Sequence[bytes]


def draw_homes(count: int, missions: int) -> list[Home]:
    """Of 5 to 12 rooms."""
    homes = []
    for number in range(count):
        streams = Streams(7, number)
        home = draw_home(streams.of("home"), ROOM_COUNTS[number % len(ROOM_COUNTS)])
        robot = SimulatedRobot(home, streams, Effects.DEMO)
        sorties = [robot.sortie(k) for k in range(missions)]
        homes.append(Home(robot, sorties, [sortie.png() for sortie in sorties]))
    return homes


@dataclass(eq=False)
class LoadRobot:
    """One robot; its missions go through those of its home again and again, each with bytes of its own."""

    id: str
    token: str
    home: Home
    next: int = 0
    held_back: list[int] = field(default_factory=list)
    """Missions that it kept, to send them too late."""

    @property
    def path(self) -> str:
        return f"/api/v1/robots/{self.id}/maps/ground"

    def grid(self, number: int) -> bytes:
        picture = self.home.pictures[number % len(self.home.pictures)]
        return with_text(picture, f"{self.id} {number}")

    def meta(self, number: int, base: Mapping[str, Any] | None) -> dict[str, Any]:
        """`base`: the map that it set out with."""
        sortie = self.home.sorties[number % len(self.home.sorties)]
        if base is not None:
            base = dict(base) | {"mission": str(int(base["mission"]) % len(self.home.sorties))}
        return self.home.robot.meta(sortie, base) | _TIMES | {"sequence": number, "epoch": 0}


def with_text(picture: bytes, text: str) -> bytes:
    """A PNG with other bytes and the same pixels."""
    return picture[:_AFTER_HEADER] + _text(text) + picture[_AFTER_HEADER:]


def _text(text: str) -> bytes:
    """A PNG's chunk that readers pass over."""
    content = b"tEXt" + b"Comment\0" + text.encode()
    return struct.pack(">I", len(content) - 4) + content + struct.pack(">I", zlib.crc32(content))
