"""What a robot says about a mission (`meta` of an upload)."""

import json
import math
import re
from collections.abc import Iterator
from datetime import UTC, datetime
from hashlib import sha256
from itertools import islice
from typing import Annotated, Any

from pydantic import AfterValidator, AwareDatetime, BaseModel, ConfigDict, FailFast, Field, ValidationError
from pydantic_core import to_json

from stillroom.documents.images import Mode, Reading
from stillroom.documents.json_text import load_json
from stillroom.errors import Fault, InvalidInput
from stillroom.maps.geometry import Pose, as_points
from stillroom.maps.mission import Tracking

FARTHEST_M = 1e5
MAX_META = 4 * 2**20
"""Bytes."""
MOST_FAULTS = 100
_PERHAPS_NOT_FINITE = re.compile(rb"NaN|Infinity|[eE]\+?\d{3}|\d{200}")
"""How a number is written that may be none: to look at each takes longer than all else."""
MISSION_ID = r"^[A-Za-z0-9._-]{1,64}$"


def _in_utc(moment: datetime) -> datetime:
    try:
        return moment.astimezone(UTC)
    except OverflowError:
        raise ValueError("not a moment of the years 1 to 9999 in UTC") from None


Moment = Annotated[AwareDatetime, AfterValidator(_in_utc)]
Metres = Annotated[float, Field(strict=True, ge=-FARTHEST_M, le=FARTHEST_M, allow_inf_nan=False)]
Resolution = Annotated[float, Field(strict=True, ge=0.001, le=1.0, allow_inf_nan=False)]
Radians = Annotated[float, Field(strict=True, ge=-100, le=100, allow_inf_nan=False)]
Position = tuple[Metres, Metres]
Positions = Annotated[list[Position], FailFast()]
PoseDocument = tuple[Metres, Metres, Radians]
Label = Annotated[str, Field(max_length=100, pattern=r"^[^\x00-\x1f]*$")]
Count = Annotated[int, Field(ge=0, le=2**53 - 1)]


class SubmapDocument(BaseModel):
    model_config = ConfigDict(strict=True)

    from_: Annotated[PoseDocument, Field(alias="from")]
    to: PoseDocument


class TrackingDocument(BaseModel):
    """Where the robot's SLAM saw the base version's features at the end of the mission, in whichever form it has."""

    model_config = ConfigDict(strict=True)

    rooms: dict[str, Positions] = {}
    dividers: dict[str, Positions] = {}
    submaps: Annotated[list[SubmapDocument], FailFast()] = []
    transform: PoseDocument | None = None

    def as_tracking(self) -> Tracking:
        return Tracking(
            rooms={key: as_points(ring) for key, ring in self.rooms.items()},
            dividers={key: as_points(line) for key, line in self.dividers.items()},
            submaps=tuple((Pose(*submap.from_), Pose(*submap.to)) for submap in self.submaps),
            transform=None if self.transform is None else Pose(*self.transform),
        )


class MissionMeta(BaseModel):
    """Fields that are not listed here are kept with the mission and ignored."""

    model_config = ConfigDict(strict=True, extra="allow")

    sequence: Count
    epoch: Count = 0
    started_at: Moment | None = None
    ended_at: Moment | None = None
    firmware: Label | None = None
    model: Label | None = None
    resolution: Resolution | None = None
    """Metres a cell."""
    origin: PoseDocument | None = None
    """Pose of the outer corner of the grid's lower-left cell."""
    mode: Mode = "trinary"
    negate: bool | Annotated[int, Field(ge=0, le=1)] = False
    occupied_thresh: Annotated[float, Field(ge=0, le=1)] = 0.65
    free_thresh: Annotated[float, Field(ge=0, le=1)] = 0.196
    base_version: Annotated[int, Field(ge=0, le=2**31 - 1)] | None = None
    tracking: TrackingDocument = TrackingDocument()

    def reading(self) -> Reading:
        """How to read the grid. Raises InvalidInput where that contradicts itself."""
        if self.free_thresh > self.occupied_thresh:
            fault = Fault("/meta/free_thresh", "free_thresh is over occupied_thresh")
            raise InvalidInput("The meta does not say how to read the grid.", (fault,))
        origin = None if self.origin is None else Pose(*self.origin)
        return Reading(self.resolution, origin, self.mode, bool(self.negate), self.occupied_thresh, self.free_thresh)

    def digest(self) -> str:
        """Equal for equal parsed meta, however it was written down."""
        known = self.model_dump(mode="json", include=set(MissionMeta.model_fields))
        tracking = known["tracking"]
        for kind in ("rooms", "dividers"):  # numbers have their type by now, and the fields their order
            tracking[kind] = dict(sorted(tracking[kind].items()))
        more = json.dumps(_plain_numbers(self.model_extra), sort_keys=True)
        return sha256(to_json(known) + more.encode()).hexdigest()


def parse_meta(content: bytes) -> tuple[MissionMeta, dict[str, Any]]:
    """The meta and the JSON it came as. Raises InvalidInput with pointers below /meta."""
    if len(content) > MAX_META:
        raise InvalidInput("The meta is too long.", (Fault("/meta", f"more than {MAX_META} bytes"),))
    document = load_json(content, "/meta")
    suspicious = _not_finite(document, "/meta") if _PERHAPS_NOT_FINITE.search(content) else ()
    faults = tuple(Fault(pointer, "not a finite number") for pointer in islice(suspicious, MOST_FAULTS))
    if faults:
        raise InvalidInput("The meta has numbers that are not finite.", faults)
    try:
        meta = MissionMeta.model_validate_json(content)
    except ValidationError as error:
        raise InvalidInput("The meta can't be used.", faults_of(error, "/meta")) from None
    return meta, document


def stored_meta(document: dict[str, Any]) -> MissionMeta:
    """Meta that was accepted once."""
    # not strictly: JSON in Python has lists for tuples and text for moments
    return MissionMeta.model_validate(document, strict=False)


class MissionTimes(BaseModel):
    """What of a mission's meta is shown with it: reading all of it takes much longer."""

    started_at: Moment | None = None
    ended_at: Moment | None = None
    base_version: int | None = None


def faults_of(error: ValidationError, below: str = "") -> tuple[Fault, ...]:
    """What is wrong, by pointer; of very many only how many."""
    if error.error_count() > MOST_FAULTS:
        return (Fault(below, f"{error.error_count()} things are wrong"),)
    found = error.errors(include_url=False, include_context=False, include_input=False)
    return tuple(Fault(pointer(entry["loc"], below), entry["msg"]) for entry in found)


def pointer(location: tuple[int | str, ...], below: str = "") -> str:
    """A JSON pointer (RFC 6901)."""
    return below + "".join(f"/{str(part).replace('~', '~0').replace('/', '~1')}" for part in location)


def _not_finite(value: object, at: str) -> Iterator[str]:
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from _not_finite(inner, pointer((key,), at))
    elif isinstance(value, list):
        for index, inner in enumerate(value):
            yield from _not_finite(inner, f"{at}/{index}")
    elif isinstance(value, float) and not math.isfinite(value):
        yield at


def _plain_numbers(value: Any) -> Any:
    """1.0 and 1 are the same number."""
    if isinstance(value, float):
        return int(value) if value.is_integer() else value
    if isinstance(value, list):
        return [_plain_numbers(inner) for inner in value]
    if isinstance(value, dict):
        return {key: _plain_numbers(inner) for key, inner in value.items()}
    return value
