"""`stillroom simulate`: robots in simulated homes that upload missions to a service, and owners who name their rooms."""

import itertools
import json
import secrets
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime, timedelta
from functools import partial
from pathlib import Path

import httpx2

from stillroom.simulator.building import draw_home
from stillroom.simulator.client import WAIT_S, Client, Json, Refused
from stillroom.simulator.distortion import Distortion
from stillroom.simulator.effects import Effects, Streams
from stillroom.simulator.fleet import SimulatedRobot, Sortie
from stillroom.simulator.owner import served_rooms, tidy_up
from stillroom.simulator.truth import MapFit, fit

MAP = "ground"
ROOM_COUNTS = (6, 9, 7, 11, 8, 5, 10, 12)
"""Of the homes, in turn."""
START_S = 30
DURATION = timedelta(minutes=40)
"""That missions are said to have taken."""
Told = Callable[[str], None]


@dataclass(frozen=True)
class Simulation:
    url: str
    operator_token: str
    state: Path
    """A file that keeps the robots' tokens from one run to the next."""
    homes: int = 3
    every_s: float = 5.0
    """From one mission of a robot to its next."""
    missions: int | None = None
    """How many each robot does in this run; None: until it is stopped."""
    seed: int = 1
    resolution: float = 0.05
    effects: Effects = Effects.DEMO
    score: bool = False


@dataclass
class Registration:
    """What is kept of a robot: who it is to the service, and how far it has come."""

    id: str
    token: str
    next: int = 0


@dataclass
class Household:
    """A robot at a service, and the owner of its home."""

    robot: SimulatedRobot
    registration: Registration
    client: Client
    owner: Client
    told: Told
    score: bool
    known_rooms: frozenset[str] = field(default_factory=frozenset)

    @property
    def path(self) -> str:
        return f"/api/v1/robots/{self.registration.id}/maps/{MAP}"

    def step(self) -> None:
        """One mission, and what the owner does about rooms that are new in it."""
        sortie = self.robot.sortie(self.registration.next)
        answer = self._upload(sortie)
        self.registration.next += 1
        served = self.client.map_in_force(self.path)
        if served is None:
            self.told(f"{self.registration.id} mission {sortie.number}: {answer['status']}, no map yet")
            return
        self.told(f"{self.registration.id} mission {sortie.number}: {_outcome(answer)}{self._scored(served, sortie)}")
        if frozenset(served_rooms(served)) != self.known_rooms:
            self._settle_in(served, sortie)

    def _upload(self, sortie: Sortie) -> Json:
        base = self.client.map_in_force(self.path)
        now = datetime.now(UTC)
        times = {"started_at": (now - DURATION).isoformat(), "ended_at": now.isoformat()}
        meta = self.robot.meta(sortie, base) | times
        try:
            return self.client.upload(self.path, str(sortie.number), sortie.png(), meta)
        except Refused as refused:
            if refused.status != 409:
                raise
            return {"status": "refused: sent before, with another base", "outcome": None}

    def _settle_in(self, served: Json, sortie: Sortie) -> None:
        for text in tidy_up(partial(self.owner.edit, self.path), self.robot.home, self._distortion(served)):
            self.told(f"{self.registration.id}: the service refused an edit: {text}")
        served = self.client.map_in_force(self.path) or served
        self.known_rooms = frozenset(served_rooms(served))
        self.told(
            f"{self.registration.id}: {len(self.known_rooms)} rooms after their owner's edits{self._scored(served, sortie)}"
        )

    def _scored(self, served: Json, sortie: Sortie) -> str:
        if not self.score:
            return ""
        found = self.fit(served, sortie)
        lost = f", lost: {', '.join(found.lost)}" if found.lost else ""
        wrong = f", elsewhere: {', '.join(found.misnamed)}" if found.misnamed else ""
        return f"; mean IoU {found.mean_iou:.3f} of {len(found.rooms)} rooms{lost}{wrong}"

    def fit(self, served: Json, sortie: Sortie) -> MapFit:
        """A served map against the home, where the robot has been."""
        return fit(self.robot.home, sortie.sensed.floor.frame, sortie.explored, served, self._distortion(served))

    def _distortion(self, served: Json) -> Distortion:
        return self.robot.distortion(int(served["mission"]))


def _outcome(answer: Json) -> str:
    if answer["outcome"] is None:
        return str(answer["status"])
    at = f" at {answer['succeeded_at']}" if answer["outcome"] == "resolved" else ""
    return f"{answer['outcome']}{at}, version {answer['version']}"


def simulate(simulation: Simulation, told: Told, warned: Told) -> None:
    """Until each robot has done its missions. Raises UploadFailed where the service can't be reached, Refused.

    `told` hears what came of each mission, `warned` what had to be tried again.
    """
    rounds = itertools.count() if simulation.missions is None else range(simulation.missions)
    with httpx2.Client(base_url=simulation.url, timeout=WAIT_S + 30) as http:
        _wait_until_ready(http)
        operator = Client(http, simulation.operator_token, warned)
        known = _read(simulation.state)
        households = [_household(simulation, number, known, operator, told) for number in range(simulation.homes)]
        due = time.monotonic()
        for _ in rounds:
            time.sleep(max(due - time.monotonic(), 0.0))
            due = time.monotonic() + simulation.every_s
            for household in households:
                household.step()
                _write(simulation.state, known)


def _wait_until_ready(http: httpx2.Client) -> None:
    """For a service that is just being started. One that does not come is told of by the first request."""
    end = time.monotonic() + START_S
    while time.monotonic() < end:
        try:
            if http.get("/readyz").is_success:
                return
        except httpx2.TransportError:
            pass
        time.sleep(0.2)


def _household(
    simulation: Simulation, number: int, known: dict[str, Registration], operator: Client, told: Told
) -> Household:
    streams = Streams(simulation.seed, number)
    home = draw_home(streams.of("home"), ROOM_COUNTS[number % len(ROOM_COUNTS)])
    robot = SimulatedRobot(home, streams, simulation.effects, simulation.resolution)
    key = f"{simulation.url} seed {simulation.seed} home {number + 1}"
    registration = known.get(key)
    if registration is None or not _is_valid(operator, registration):
        registration = known[key] = _register(operator, number + 1)
        _write(simulation.state, known)
    client = Client(operator.http, registration.token, operator.told)
    return Household(robot, registration, client, operator, told, simulation.score)


def _is_valid(operator: Client, registration: Registration) -> bool:
    """Whether the service still knows a robot of an earlier run."""
    try:
        Client(operator.http, registration.token, operator.told).map_in_force(
            f"/api/v1/robots/{registration.id}/maps/{MAP}"
        )
    except Refused:
        return False
    return True


def _register(operator: Client, number: int) -> Registration:
    """A new robot; where its plain id is taken, by one whose token nobody here has, one with a longer id."""
    robot = f"demo-{number}"
    while (token := operator.add_robot(robot, f"Demo home {number}")) is None:
        robot = f"demo-{number}-{secrets.token_hex(3)}"
    return Registration(robot, token)


def _read(state: Path) -> dict[str, Registration]:
    if not state.exists():
        return {}
    return {key: Registration(**kept) for key, kept in json.loads(state.read_text()).items()}


def _write(state: Path, known: dict[str, Registration]) -> None:
    """Whole or not at all, and for nobody else to read: it holds tokens."""
    state.parent.mkdir(parents=True, exist_ok=True)
    fresh = state.with_suffix(".new")
    fresh.touch(mode=0o600)
    fresh.write_text(json.dumps({key: asdict(kept) for key, kept in known.items()}, indent=1))
    fresh.replace(state)
