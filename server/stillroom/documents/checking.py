"""Stored maps from elsewhere: what `documents.stored` writes is trusted when it is read; what others bring has to be such a document."""

import json
import re
from collections.abc import Mapping
from datetime import datetime
from typing import Annotated, Any, Literal

import shapely
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError

from stillroom.documents.missions import faults_of
from stillroom.documents.stored import FORMAT, decode_map, decode_motion, upgrade
from stillroom.errors import Fault, InvalidInput
from stillroom.maps.grid import LARGEST
from stillroom.maps.semantics import DividerKind, MadeBy, RestrictionKind, RoomKind, SemanticMap, Shut, WallKind

FARTHEST_M = 1e6
MOST_PARTS = 20_000
"""Features of one kind."""
Json = dict[str, Any]
Metres = Annotated[float, Field(ge=-FARTHEST_M, le=FARTHEST_M)]
Point = tuple[Metres, Metres]
Id = Annotated[str, Field(min_length=1, max_length=64, pattern=r"^[^\x00-\x1f\x7f]*$")]
Key = Annotated[str, Field(pattern=r"^[A-Za-z0-9._~-]{1,130}$")]
Segment = tuple[Point, Point]
Polyline = Annotated[list[Point], Field(min_length=2, max_length=100_000)]
Ring = Annotated[list[Point], Field(min_length=4, max_length=100_000)]
Rings = Annotated[list[Ring], Field(min_length=1, max_length=10_000)]


def _is_moment(text: str) -> str:
    if datetime.fromisoformat(text).tzinfo is None:
        raise ValueError("a moment needs a zone")
    return text


MomentText = Annotated[str, Field(max_length=40), AfterValidator(_is_moment)]


class _Strict(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False)


class _Frame(_Strict):
    resolution: Annotated[float, Field(ge=0.001, le=1.0)]
    width: Annotated[int, Field(ge=1, le=LARGEST)]
    height: Annotated[int, Field(ge=1, le=LARGEST)]
    origin: tuple[Metres, Metres, Annotated[float, Field(ge=-100, le=100)]]


class _Room(_Strict):
    id: Id
    name: Annotated[str, Field(min_length=1, max_length=200, pattern=r"^[^\x00-\x1f\x7f]*$")]
    segment_id: Annotated[int, Field(ge=0, le=2**31 - 1)]
    polygon: Rings
    made_by: MadeBy
    named_by: MadeBy
    derived_from: Id | None
    last_visited: Key | None
    pinned: bool
    anchor: Rings | None
    kind: RoomKind | None


class _Divider(_Strict):
    id: Id
    line: Segment
    kind: DividerKind
    made_by: MadeBy
    rooms: Annotated[list[Id], Field(max_length=2)]
    shut: Shut


class _Wall(_Strict):
    id: Id
    line: Polyline
    kind: WallKind


class _Clutter(_Strict):
    id: Id
    polygon: Rings


class _Restriction(_Strict):
    id: Id
    kind: RestrictionKind
    shape: Polyline
    placed: bool


class _MetaOccupancy(_Strict):
    id: Id
    polygon: Rings
    cell: Literal["occupied", "free"]
    since: Key
    contradicted: Annotated[int, Field(ge=0)]


class _MetaDivider(_Strict):
    id: Id
    line: Segment
    rooms: Annotated[list[Id], Field(max_length=2)]
    since: Key
    contradicted: Annotated[int, Field(ge=0)]


class _Declined(_Strict):
    shape: Rings | Polyline
    until: MomentText | None


class _Phantom(_Strict):
    id: Id
    shape: Ring | Polyline


class _Map(_Strict):
    format: Annotated[int, Field(ge=FORMAT, le=FORMAT)]
    frame: _Frame
    rooms: Annotated[list[_Room], Field(max_length=MOST_PARTS)]
    dividers: Annotated[list[_Divider], Field(max_length=MOST_PARTS)]
    walls: Annotated[list[_Wall], Field(max_length=MOST_PARTS)]
    clutter: Annotated[list[_Clutter], Field(max_length=MOST_PARTS)]
    restrictions: Annotated[list[_Restriction], Field(max_length=MOST_PARTS)]
    meta_occupancy: Annotated[list[_MetaOccupancy], Field(max_length=MOST_PARTS)]
    meta_dividers: Annotated[list[_MetaDivider], Field(max_length=MOST_PARTS)]
    declined: Annotated[list[_Declined], Field(max_length=MOST_PARTS)]
    phantoms: Annotated[list[_Phantom], Field(max_length=MOST_PARTS)]


class _Motion(_Strict):
    source: Annotated[list[Point], Field(min_length=1, max_length=100_000)]
    target: Annotated[list[Point], Field(min_length=1, max_length=100_000)]


def check_map(document: Json, at: str) -> tuple[Json, SemanticMap]:
    """The document in the newest format, and the map. Raises InvalidInput with pointers below `at`."""
    try:
        newest = upgrade(document)
        _Map.model_validate_json(json.dumps(newest))
        found = decode_map(newest)
    except ValidationError as error:
        raise InvalidInput("A version's map can't be used.", faults_of(error, at)) from None
    except (KeyError, TypeError, ValueError, AttributeError, shapely.errors.ShapelyError) as error:
        raise InvalidInput("A version's map can't be used.", (Fault(at, str(error)),)) from None
    if found.frame.width * found.frame.height > LARGEST:
        raise InvalidInput("A version's map can't be used.", (Fault(f"{at}/frame", "too many cells"),))
    if not all(room.polygon.is_valid and room.polygon.area > 0 for room in found.rooms):
        raise InvalidInput("A version's map can't be used.", (Fault(f"{at}/rooms", "a room crosses itself"),))
    ids = [feature.id for features in (found.rooms, found.dividers, found.walls) for feature in features]
    if len(set(ids)) != len(ids):
        raise InvalidInput("A version's map can't be used.", (Fault(at, "an id is there twice"),))
    return newest, found


def check_motion(document: Json | None, at: str) -> Json | None:
    """Raises InvalidInput."""
    if document is None:
        return None
    try:
        motion = _Motion.model_validate_json(json.dumps(document))
        if len(motion.source) != len(motion.target):
            raise ValueError("as many sources as targets")
        decode_motion(document)
    except ValidationError as error:
        raise InvalidInput("A version's motion can't be used.", faults_of(error, at)) from None
    except ValueError as error:
        raise InvalidInput("A version's motion can't be used.", (Fault(at, str(error)),)) from None
    return document


# -- other ids -----------------------------------------------------------------------------------------------------

_NAMED_BY_ID = ("id", "derived_from", "survivor")
_LISTS_OF_IDS = ("rooms", "dividers", "restrictions", "discovered")


def renamer(before: str, after: str) -> "Mapping[str, str]":
    """Ids of a map that is another among its robot's maps than it was: r3 becomes r2-3. Walls are named by versions."""
    return _Renamed(re.compile(rf"([a-vx-z]){re.escape(before)}([0-9]+)"), after)


class _Renamed(dict[str, str]):
    def __init__(self, known: re.Pattern[str], prefix: str) -> None:
        super().__init__()
        self._known, self._prefix = known, prefix

    def __missing__(self, old: str) -> str:
        found = self._known.fullmatch(old)
        self[old] = old if found is None else f"{found[1]}{self._prefix}{found[2]}"
        return self[old]


def with_ids(value: Any, ids: Mapping[str, str], key: str = "") -> Any:
    """A document with other ids, wherever one stands."""
    if isinstance(value, dict):
        return {name: with_ids(inner, ids, name) for name, inner in value.items()}
    if isinstance(value, list):
        named = key in _LISTS_OF_IDS
        return [ids[inner] if named and isinstance(inner, str) else with_ids(inner, ids) for inner in value]
    return ids[value] if key in _NAMED_BY_ID and isinstance(value, str) else value
