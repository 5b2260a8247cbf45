"""What the robot saw when a question came up, beside the map that it was carried over from."""

from functools import partial

import numpy as np
import shapely

from stillroom.documents.conflicts import ConfirmedDocument, DifferenceDocument, SensedDocument
from stillroom.documents.features import frame
from stillroom.documents.geojson import Polygon
from stillroom.documents.grids import read_grid
from stillroom.documents.missions import stored_meta
from stillroom.documents.stored import decode_map, decode_motion, rings
from stillroom.maps.geometry import Pose, fit_pose
from stillroom.maps.grid import OccupancyGrid
from stillroom.maps.motion import Motion
from stillroom.pipeline.differences import differences
from stillroom.service.conflicts import find_conflict
from stillroom.service.frames import motion_between
from stillroom.service.maps import map_url, reading_of
from stillroom.service.steps import frame_step
from stillroom.store import maps, missions
from stillroom.store.database import Database
from stillroom.store.grids import GridStore
from stillroom.store.rows import ConflictRow, VersionRow


def sensed(database: Database, grids: GridStore, robot_id: str, map_name: str, key: str) -> SensedDocument:
    """Raises NotFound."""
    with database.read() as tx:
        of, row = find_conflict(tx, robot_id, map_name, key)
        mission = missions.get(tx, row.mission_id)
        before = maps.version_at(tx, of.id, row.base_version)
        head = None if of.head is None else maps.version_at(tx, of.id, of.head)
        assert before is not None
        assert head is not None
        after = maps.version_at(tx, of.id, mission.version) if mission.version is not None else None
        back = motion_between(partial(frame_step, tx, of.id), head.number, before.number)
    grid = read_grid(grids.get(mission.grid), stored_meta(mission.meta).reading())
    motion = decode_motion(row.motion)
    moved = None if motion is None else rigid(before, motion)
    known = read_grid(grids.get(before.grid), reading_of(database, of, before))
    taken = row.resolved or mission.version != row.base_version
    url = f"{map_url(of)}/missions/{mission.key}"
    return SensedDocument(
        mission=mission.key,
        base_version=before.number,
        version=head.number,
        taken=taken,
        frame=frame(grid.frame),
        grid=f"{url}/grid.png",
        cells=f"{url}/cells.png",
        moved=None if moved is None else pose_numbers(moved),
        moved_now=None if motion is None or back is None else pose_numbers(rigid(head, motion.after(back))),
        differences=[] if moved is None else difference_documents(known, moved, grid),
        confirmed=_confirmed(row, after, Pose()) if taken else _confirmed(row, before, moved),
    )


def _confirmed(conflict: ConflictRow, of: VersionRow | None, moved: Pose | None) -> list[ConfirmedDocument]:
    """The anchors of the rooms that slid or shrank, as a version has them; `moved` takes its frame to the mission's."""
    if conflict.cause != "drift" or of is None or moved is None:
        return []
    drifted = {room["id"] for room in conflict.rooms}
    return [
        ConfirmedDocument(room=room.id, geometry=_polygon(shapely.transform(room.anchor, moved.apply)))
        for room in decode_map(of.document).rooms
        if room.id in drifted and room.anchor is not None
    ]


def difference_documents(before: OccupancyGrid, moved: Pose, now: OccupancyGrid) -> list[DifferenceDocument]:
    return [
        DifferenceDocument(
            change=found.change,
            area=round(found.polygon.area, 2),
            geometry=_polygon(found.polygon),
        )
        for found in differences(before, moved, now)
    ]


def _polygon(shape: shapely.Polygon) -> Polygon:
    return Polygon(coordinates=[np.round(ring, 3).tolist() for ring in rings(shape)])


def rigid(of: VersionRow, motion: Motion) -> Pose:
    points = decode_map(of.document).vertices()
    return fit_pose(points, motion.apply(points))


def pose_numbers(pose: Pose) -> tuple[float, float, float]:
    x, y, yaw = np.round([pose.x, pose.y, pose.yaw], 5).tolist()
    return x, y, yaw
