"""A robot that uploads drawn grids: the first map with its rooms named after their letters, and what a mission makes of it."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
import shapely
from shapely import Polygon

from stillroom.maps.constraints import violations
from stillroom.maps.geometry import Pose, as_points
from stillroom.maps.grid import OccupancyGrid, look_up
from stillroom.maps.mission import Mission, Tracking
from stillroom.maps.semantics import Divider, Ids, Room, SemanticMap
from stillroom.pipeline.conflicts import Conflict, ConflictKind
from stillroom.pipeline.creation import create_map
from stillroom.pipeline.obstacles import corrected
from stillroom.pipeline.params import PARAMS
from stillroom.pipeline.update import RESOLVERS, MapUpdate, ResolverName, update_map
from tests.drawing import Drawing, iou
from tests.missions import mission, track_all


def first_map(drawing: Drawing, doors: Sequence[tuple[str, str]] = ()) -> SemanticMap:
    """The map of mission 0; a person has named its rooms after their letters, and made the ways between `doors` doors."""
    created = create_map(drawing.grid, "0", Ids())
    letters = {room.id: letter for letter, room in drawing.rooms(created).items()}
    shut = {drawing.divider(created, *sides).id for sides in doors}
    return replace(
        created,
        rooms=tuple(replace(room, name=letters[room.id], named_by="user") for room in created.rooms),
        dividers=tuple(replace(d, kind="door", made_by="user") if d.id in shut else d for d in created.dividers),
    )


def upload(
    base: SemanticMap,
    grid: OccupancyGrid,
    pose: Pose = Pose(),
    noise_m: float = 0.0,
    seed: int = 0,
    number: int = 1,
    resolvers: Sequence[ResolverName] = RESOLVERS,
) -> MapUpdate:
    """What a mission with that grid makes of `base`, every vertex tracked with its own error."""
    tracking = track_all(base, pose, np.random.default_rng(seed), noise_m)
    return update_map(base, mission(str(number), base, tracking, grid), resolvers=resolvers)


def upload_untracked(base: SemanticMap, grid: OccupancyGrid, number: int = 1) -> MapUpdate:
    return update_map(base, Mission(str(number), grid, None))


def upload_moved(base: SemanticMap, grid: OccupancyGrid, pose: Pose, number: int = 1) -> MapUpdate:
    """Tracked by one transform."""
    return update_map(base, mission(str(number), base, Tracking(transform=pose), grid))


def uploads(base: SemanticMap, grids: Sequence[OccupancyGrid], noise_m: float = 0.0) -> Iterator[MapUpdate]:
    """Missions 1, 2, ... each on the map that the one before left in force."""
    for number, grid in enumerate(grids, 1):
        update = upload(base, grid, noise_m=noise_m, seed=number, number=number)
        base = update.map
        yield update


def named(semantic_map: SemanticMap, name: str) -> Room:
    (room,) = (room for room in semantic_map.rooms if room.name == name)
    return room


def kept(before: SemanticMap, after: SemanticMap, pose: Pose = Pose()) -> Mapping[str, float]:
    """Of each room of `before` by its name: how much the room of the same id has the same shape, 0 where there is none."""
    rooms = {room.name: after.room(room.id) for room in before.rooms}
    shapes = {room.name: shapely.transform(room.polygon, pose.apply) for room in before.rooms}
    return {name: iou(shapes[name], room.polygon) if room else 0.0 for name, room in rooms.items()}


def between(semantic_map: SemanticMap, first: str, second: str) -> Divider:
    sides = {named(semantic_map, first).id, named(semantic_map, second).id}
    (found,) = (divider for divider in semantic_map.dividers if set(divider.rooms) == sides)
    return found


def new_room(update: MapUpdate) -> Room:
    """The one room that was discovered."""
    (new,) = update.discovered
    room = update.map.room(new)
    assert room is not None
    return room


def conflicts_of(update: MapUpdate, kind: ConflictKind) -> list[Conflict]:
    return [conflict for conflict in update.conflicts if conflict.kind == kind]


def rows(update: MapUpdate) -> tuple[bool, bool, bool]:
    """The paper's three rows: transfer alone, with meta-occupancy, with meta-dividers."""
    assert update.ablation is not None
    return update.ablation.transfer, update.ablation.meta_occupancy, update.ablation.meta_dividers


def assert_valid(semantic_map: SemanticMap, grid: OccupancyGrid) -> None:
    """Every constraint holds on the grid as the meta layer corrects it."""
    assert violations(semantic_map, corrected(grid, semantic_map.meta.occupancy), PARAMS.wall_reach_m) == ()


def assert_all_kept(before: SemanticMap, update: MapUpdate, grid: OccupancyGrid, least: float = 0.95) -> None:
    """Taken and valid, every room of `before` with its id, name and shape."""
    assert update.taken, update.reason
    found = kept(before, update.map)
    assert {name: share >= least for name, share in found.items()} == dict.fromkeys(found, True), found
    assert {room.id: room.name for room in before.rooms}.items() <= {r.id: r.name for r in update.map.rooms}.items()
    assert_valid(update.map, grid)


def covers(polygon: Polygon, region: Polygon) -> float:
    """The share of a region that lies in a polygon."""
    return float(shapely.intersection(polygon, region).area / region.area)


def cells_of(grid: OccupancyGrid, region: Polygon) -> list[int]:
    """The values of the cells whose centres lie in a region."""
    frame = grid.frame
    columns, rows_ = np.meshgrid(np.arange(frame.width) + 0.5, np.arange(frame.height) + 0.5)
    centres = as_points(np.stack([columns.ravel(), rows_.ravel()], 1))
    inside = shapely.contains_xy(region, frame.to_map(centres))
    return [int(value) for value in look_up(grid.cells, centres[inside], 0)]
