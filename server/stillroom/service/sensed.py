"""What the robot saw when a question came up, beside the map that it was carried over from."""

from functools import partial

import numpy as np

from stillroom.documents.conflicts import DifferenceDocument, SensedDocument
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
from stillroom.store.rows import VersionRow


def sensed(database: Database, grids: GridStore, robot_id: str, map_name: str, key: str) -> SensedDocument:
    """Raises NotFound."""
    with database.read() as tx:
        of, row = find_conflict(tx, robot_id, map_name, key)
        mission = missions.get(tx, row.mission_id)
        before = maps.version_at(tx, of.id, row.base_version)
        head = None if of.head is None else maps.version_at(tx, of.id, of.head)
        assert before is not None
        assert head is not None
        back = motion_between(partial(frame_step, tx, of.id), head.number, before.number)
    grid = read_grid(grids.get(mission.grid), stored_meta(mission.meta).reading())
    motion = decode_motion(row.motion)
    moved = None if motion is None else _rigid(before, motion)
    known = read_grid(grids.get(before.grid), reading_of(database, of, before))
    url = f"{map_url(of)}/missions/{mission.key}"
    return SensedDocument(
        mission=mission.key,
        base_version=before.number,
        version=head.number,
        taken=row.resolved or mission.version != row.base_version,
        frame=frame(grid.frame),
        grid=f"{url}/grid.png",
        cells=f"{url}/cells.png",
        moved=None if moved is None else _numbers(moved),
        moved_now=None if motion is None or back is None else _numbers(_rigid(head, motion.after(back))),
        differences=[] if moved is None else _differences(known, moved, grid),
    )


def _differences(before: OccupancyGrid, moved: Pose, now: OccupancyGrid) -> list[DifferenceDocument]:
    return [
        DifferenceDocument(
            change=found.change,
            area=round(found.polygon.area, 2),
            geometry=Polygon(coordinates=[np.round(ring, 3).tolist() for ring in rings(found.polygon)]),
        )
        for found in differences(before, moved, now)
    ]


def _rigid(of: VersionRow, motion: Motion) -> Pose:
    points = decode_map(of.document).vertices()
    return fit_pose(points, motion.apply(points))


def _numbers(pose: Pose) -> tuple[float, float, float]:
    x, y, yaw = np.round([pose.x, pose.y, pose.yaw], 5).tolist()
    return x, y, yaw
