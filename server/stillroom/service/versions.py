"""A semantic map as a new version of a stored map."""

from collections.abc import Mapping

from stillroom import __version__
from stillroom.documents.stored import decode_ids, encode_ids, encode_map
from stillroom.maps.semantics import Ids, SemanticMap
from stillroom.store import maps
from stillroom.store.rows import Json, MapRow


def ids_of(of: MapRow) -> Ids:
    """The map's own counters, so that no id is ever given out twice, whatever version is in force.

    The first map of a robot has ids like r3, its second like r2-3: unique over all maps of a robot.
    """
    return decode_ids("" if of.ordinal == 1 else f"{of.ordinal}-", of.used_ids)


def rooms_of(semantic_map: SemanticMap) -> list[tuple[str, int, str]]:
    """As `NewVersion` has them."""
    return [(room.id, room.segment_id, room.name) for room in semantic_map.rooms]


def new_version(
    semantic_map: SemanticMap,
    *,
    retired: Mapping[str, str | None],
    parent: int | None,
    cause: str,
    mission: str | None,
    made_by: str,
    grid: str,
    frame_from: int | None,
    motion: Json | None,
    algorithm: str = __version__,
) -> maps.NewVersion:
    return maps.NewVersion(
        parent=parent,
        cause=cause,
        mission=mission,
        made_by=made_by,
        algorithm=algorithm,
        grid=grid,
        frame_from=frame_from,
        motion=motion,
        document=encode_map(semantic_map),
        rooms=rooms_of(semantic_map),
        retired=retired,
        used_ids=encode_ids(semantic_map.ids),
    )
