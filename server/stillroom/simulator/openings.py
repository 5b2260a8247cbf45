"""What is cut into the walls of a home: windows down to the floor, and ways through that were not there before."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import shapely
from numpy.random import Generator
from shapely import LineString, Polygon

from stillroom.maps.geometry import Points, as_line, as_points, polygons_in
from stillroom.simulator.furnishing import moved_elsewhere
from stillroom.simulator.homes import Door, Home, Window, as_multipolygon
from stillroom.simulator.plans import thick_line

_THICKEST_M = 0.35
"""Of walls between two rooms."""
_PASSAGE_M = (0.8, 2.0)
_JAMB_M = 0.15
"""From the end of a wall to what is cut into it, at least."""
_BEFORE_M = 0.6
"""What stands so near to a new way through is moved."""
_WINDOW_M = (0.7, 2.2)
_PANE_M = 0.9
"""A window is divided into panes of about this width,"""
_BAR_M = 0.10
"""with bars between them that no ray passes."""
_VIEW_M = (1.0, 3.0)
"""How far one sees through a window."""
_OUTER_M = 0.25
"""Outer walls are thinner than this."""


def with_passage(home: Home, rng: Generator) -> Home:
    """With a way through a wall between two rooms that had none; the same home where there is no such wall."""
    candidates = [wall for pair in _strangers(home) for wall in _common_walls(home, *pair)]
    draws = rng.random(3).tolist()
    if not candidates:
        return home
    names, line, thickness = candidates[int(draws[0] * len(candidates))]
    part = _part(line, _PASSAGE_M, draws[1], draws[2])
    cut = Door(f"passage-{len(home.doors)}", "opening", names, as_line(part), thick_line(as_line(part), thickness))
    way = thick_line(cut.line, 2 * _BEFORE_M)
    opened = replace(home, doors=(*home.doors, cut))
    for piece in home.furniture:
        if shapely.intersects(piece.footprint, way):
            opened = moved_elsewhere(opened, piece, rng)
    return opened


def _strangers(home: Home) -> list[tuple[str, str]]:
    """Pairs of rooms without a doorway between them."""
    joined = {frozenset(door.rooms) for door in home.doors}
    names = [room.name for room in home.rooms]
    return [(a, b) for i, a in enumerate(names) for b in names[i + 1 :] if frozenset((a, b)) not in joined]


def _common_walls(home: Home, a: str, b: str) -> list[tuple[tuple[str, str], Points, float]]:
    """(rooms, middle line (2, 2), thickness) of the straight walls between two rooms that a way through fits into."""
    here, there = home.room(a).polygon, home.room(b).polygon
    if shapely.distance(here, there) > _THICKEST_M:
        return []
    reach = shapely.buffer(there, _THICKEST_M, join_style="mitre")
    found = []
    for edge in edges(here):
        along = shapely.intersection(LineString(edge), reach)
        if along.length < _PASSAGE_M[0] + 2 * _JAMB_M or along.geom_type != "LineString":
            continue
        gap = float(shapely.distance(shapely.line_interpolate_point(along, along.length / 2), there))
        middle = shapely.get_coordinates(along)[[0, -1]] + outward(edge) * gap / 2
        if 0.01 < gap <= _THICKEST_M:
            found.append(((a, b), middle, gap))
    return found


def draw_windows(home: Home, share: float, rng: Generator) -> Home:
    """With windows in that share of the longer outer walls."""
    inside = shapely.buffer(shapely.union_all([home.walls, *(room.polygon for room in home.rooms)]), 1e-3)
    windows: list[Window] = []
    for room in home.rooms:
        others = [shapely.buffer(other.polygon, 2 * _OUTER_M) for other in home.rooms if other is not room]
        around = shapely.union_all(others)
        for edge in edges(room.polygon):
            has, where, width, depth, *posts = rng.random(8).tolist()
            free = shapely.difference(LineString(edge), around)
            if has < share and free.geom_type == "LineString" and free.length > _WINDOW_M[0] + 2 * _JAMB_M:
                part = _part(as_points(shapely.get_coordinates(free))[[0, -1]], _WINDOW_M, where, width)
                windows.append(_window(f"window-{len(windows)}", part, outward(edge), depth, posts, inside))
    return replace(home, windows=tuple(windows))


def _window(
    key: str, part: Points, outward: Points, depth: float, posts: list[float], inside: shapely.Geometry
) -> Window:
    """In the stretch `part` (2, 2) of a room's face; outside are a fan of free ground and a few things that stand on it."""
    length = float(np.linalg.norm(part[1] - part[0]))
    count = max(1, round(length / _PANE_M))
    along = (part[1] - part[0]) / length
    stops = part[0] + np.linspace(0, length, count + 1)[:, None] * along
    thick = outward * _OUTER_M
    panes = [_quad(a + along * _BAR_M / 2, b - along * _BAR_M / 2, thick) for a, b in pairwise(stops)]
    far = _VIEW_M[0] + depth * (_VIEW_M[1] - _VIEW_M[0])
    ends = part + thick + np.array([[-0.5], [0.5]]) * far * along
    fan = Polygon(np.stack([part[0], part[1], ends[1] + outward * far, ends[0] + outward * far]))
    things = [
        shapely.buffer(shapely.Point(part[0] + along * length * x + outward * (0.5 + y * far)), 0.15)
        for x, y in zip(posts[::2], posts[1::2], strict=True)
    ]
    ground = shapely.difference(fan, shapely.union_all([inside, *things]))
    return Window(key, as_multipolygon(shapely.union_all(panes)), as_multipolygon(ground))


def _quad(a: Points, b: Points, off: Points) -> Polygon:
    return Polygon(np.stack([a - off * 0.1, b - off * 0.1, b + off, a + off]))


def _part(line: Points, widths_m: tuple[float, float], where: float, width: float) -> Points:
    """A stretch (2, 2) of a line (2, 2); `where` and `width` from 0 to 1."""
    length = float(np.linalg.norm(line[1] - line[0]))
    clear = length - 2 * _JAMB_M
    size = widths_m[0] + width * (min(widths_m[1], clear) - widths_m[0])
    start = _JAMB_M + where * (clear - size)
    along = (line[1] - line[0]) / length
    return np.stack([line[0] + along * start, line[0] + along * (start + size)])


def edges(polygon: Polygon) -> list[Points]:
    """The sides (2, 2) of a polygon, its inside on their left."""
    (ring,) = polygons_in(shapely.orient_polygons(polygon))
    corners = shapely.get_coordinates(ring.exterior)
    return [corners[i : i + 2] for i in range(len(corners) - 1)]


def outward(edge: Points) -> Points:
    """Unit vector (2,) to the right of an edge."""
    along = (edge[1] - edge[0]) / np.linalg.norm(edge[1] - edge[0])
    return np.array([along[1], -along[0]])
