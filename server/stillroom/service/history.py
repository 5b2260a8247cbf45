"""People look back: what differs between two versions, what versions are called, and which one a map stays at."""

from functools import partial

import numpy as np

from stillroom.documents import api
from stillroom.documents.stored import decode_map
from stillroom.errors import NotFound
from stillroom.maps.geometry import fit_pose
from stillroom.maps.motion import IDENTITY, Motion
from stillroom.maps.semantics import SemanticMap
from stillroom.pipeline.comparison import compare
from stillroom.service.access import Principal
from stillroom.service.edits import restore_version
from stillroom.service.frames import motion_between
from stillroom.service.maps import find_in_force, find_map, find_version, map_summary, version_item
from stillroom.service.steps import frame_step
from stillroom.store import clock, events, maps
from stillroom.store.database import Database


def diff_versions(database: Database, robot_id: str, map_name: str, first: int, second: int) -> api.DiffDocument:
    """What changed from one version to another, whichever is the older. Raises NotFound."""
    of, before = find_version(database, robot_id, map_name, first)
    _, after = find_version(database, robot_id, map_name, second)
    with database.read() as tx:
        motion = motion_between(partial(frame_step, tx, of.id), first, second)
    old, new = decode_map(before.document), decode_map(after.document)
    changes = compare(old, new, motion or IDENTITY)
    return api.DiffDocument(
        from_version=first,
        to_version=second,
        moved=None if motion is None else _rigid(old, motion),
        changes=[api.ChangeDocument.model_validate(vars(change)) for change in changes],
    )


def _rigid(semantic_map: SemanticMap, motion: Motion) -> tuple[float, float, float]:
    points = semantic_map.vertices()
    pose = fit_pose(points, motion.apply(points))
    x, y, yaw = np.round([pose.x, pose.y, pose.yaw], 5).tolist()
    return x, y, yaw


def change_settings(database: Database, robot_id: str, map_name: str, settings: api.MapSettings) -> api.MapSummary:
    """Raises NotFound."""
    values = {"title": settings.name and settings.name.strip(), "review": settings.review}
    return _changed(database, robot_id, map_name, {name: value for name, value in values.items() if value is not None})


def name_version(
    database: Database, robot_id: str, map_name: str, number: int, name: str | None
) -> api.VersionListItem:
    """Raises NotFound."""
    with database.write() as tx:
        of = find_map(tx, robot_id, map_name)
        if maps.version_head(tx, of.id, number) is None:
            raise NotFound(f"The map {map_name} of {robot_id} has no version {number}.")
        maps.name_version(tx, of.id, number, name and name.strip())
        events.add(tx, of, [("settings", {})], clock.now(tx))
        row = maps.version_head(tx, of.id, number)
    assert row is not None
    return api.VersionListItem.model_validate(version_item(of, row))


def pin_map(database: Database, caller: Principal, robot_id: str, map_name: str, number: int | None) -> api.MapSummary:
    """The map stays at a version until a person agrees to another: at `number`, which is restored where it is not in force.

    Raises NotFound.
    """
    with database.read() as tx:
        _, head = find_in_force(tx, robot_id, map_name)
    if number is not None and number != head:
        head = restore_version(database, caller, robot_id, map_name, number).version
    return _changed(database, robot_id, map_name, {"pinned": head})


def unpin_map(database: Database, robot_id: str, map_name: str) -> api.MapSummary:
    """Raises NotFound."""
    return _changed(database, robot_id, map_name, {"pinned": None})


def _changed(database: Database, robot_id: str, map_name: str, values: dict[str, str | int | None]) -> api.MapSummary:
    with database.write() as tx:
        of = find_map(tx, robot_id, map_name)
        if values:
            maps.change_settings(tx, of.id, values)
            events.add(tx, of, [("settings", {})], clock.now(tx))
        of = maps.get(tx, of.id)
        return map_summary(of, maps.heads(tx, [of]).get(of.id))
