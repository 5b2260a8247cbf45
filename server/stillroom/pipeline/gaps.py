"""Where lines that should lie on walls find none on a new grid. All lines at once: there are hundreds of short ones in a home."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from stillroom.maps.geometry import GRID_M, Points
from stillroom.maps.grid import GridFrame, Mask
from stillroom.pipeline.params import Params

Numbers = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Gap:
    """A stretch of a tracked line along which the new grid has no wall.

    `path` (n, 2), metres, follows the line from the wall on one side to the wall on the other, moved with what is left of both.
    """

    path: Points
    bounded: bool = True
    """Whether there is wall at both ends; a line may also begin or end without."""

    @property
    def chord_m(self) -> float:
        """From end to end."""
        return float(np.hypot(*(self.path[-1] - self.path[0])))


def find_gaps(
    lines: Sequence[Points], wall: Mask, frame: GridFrame, params: Params, leaps_m: float = np.inf
) -> list[Gap]:
    """Where lines (n, 2) that should lie on `wall` find none within the classification distance on either side.

    And where, from one place on a line to the next, the wall leaps aside by more than `leaps_m`: a way may lead between.
    """
    return WallSearch.along(lines, frame, params).gaps(wall, leaps_m)


@dataclass(frozen=True, eq=False)
class WallSearch:
    """Stations on lines, a cell apart, and the cells across the line at each, the nearest first.

    `stations`: (n, 2), cells; `line`: (n,), which line each is on; `rings`: of each line, whether it is closed; `across`: (n, m), numbers of
    cells, row by row; `inside`: (n, m), whether there is such a cell.
    """

    frame: GridFrame
    stations: Points
    line: Numbers
    rings: Mask
    across: Numbers
    inside: Mask

    @staticmethod
    def along(lines: Sequence[Points], frame: GridFrame, params: Params) -> "WallSearch":
        """For lines (n, 2) that should lie on walls."""
        points = frame.to_cells(np.concatenate([np.zeros((0, 2)), *lines]))
        drawn = shapely.linestrings(points, indices=np.repeat(np.arange(len(lines)), [len(line) for line in lines]))
        stations, line = shapely.get_coordinates(shapely.segmentize(drawn, 1.0), return_index=True)
        before, after = np.arange(len(line)), np.arange(len(line))
        before[1:] -= line[1:] == line[:-1]
        after[:-1] += line[1:] == line[:-1]
        along = (stations.take(after, 0) - stations.take(before, 0)) / (after - before)[:, None]
        along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-9)
        reach = np.ceil(params.wall_classification_m / frame.resolution)
        steps = np.arange(-reach, reach + 1)
        steps = steps[np.argsort(np.abs(steps), kind="stable")]
        columns = np.floor(stations[:, :1] + steps * along[:, 1:]).astype(np.int32)
        rows = np.floor(stations[:, 1:] - steps * along[:, :1]).astype(np.int32)
        inside = (columns >= 0) & (rows >= 0) & (columns < frame.width) & (rows < frame.height)
        across = np.where(inside, rows * frame.width + columns, 0)
        rings = np.array([np.abs(line[0] - line[-1]).max() < GRID_M for line in lines], np.bool_)
        return WallSearch(frame, stations, line, rings, across, inside)

    def gaps(self, wall: Mask, leaps_m: float = np.inf) -> list[Gap]:
        """As `find_gaps`: of each line those between two places on `wall`, then those at its beginning and at its end."""
        hit, place = self._nearest(wall)
        order = self._from_wall(hit)
        hit, place, stations = hit.take(order), place.take(order, 0), self.stations.take(order, 0)
        shift = place + 0.5 - stations
        found = np.flatnonzero(hit)
        if not len(found):
            return []
        parted = np.diff(found) > 1
        if np.isfinite(leaps_m):
            parted |= np.hypot(*np.diff(place[found], axis=0).T) > leaps_m / self.frame.resolution
        same = np.diff(self.line[found]) == 0
        inner = np.flatnonzero(same & parted)
        first, last = found[np.append(True, ~same)], found[np.append(~same, True)]
        begin = np.searchsorted(self.line, self.line[first])
        end = np.searchsorted(self.line, self.line[first], side="right") - 1
        early, late = first > begin + 1, last < end - 1
        a = np.concatenate([found[inner], begin[early], last[late]])
        b = np.concatenate([found[inner + 1], first[early], end[late]])
        held = np.concatenate([found[inner], first[early], last[late]])
        bounded = np.arange(len(a)) < len(inner)
        size = b - a + 1
        stop = np.cumsum(size)
        gap = np.repeat(np.arange(len(a)), size)
        step = np.arange(len(gap)) - (stop - size)[gap]
        share = step * (bounded / (size - 1))[gap]
        share[stop - 1] = bounded
        share = share[:, None]
        cells = stations.take(a[gap] + step, 0) + (1 - share) * shift.take(held[gap], 0) + share * shift.take(b[gap], 0)
        path = self.frame.to_map(cells)
        by_line = np.argsort(self.line[a], kind="stable").tolist()
        return [Gap(path[stop[k] - size[k] : stop[k]], bool(bounded[k])) for k in by_line]

    def _nearest(self, wall: Mask) -> tuple[Mask, Numbers]:
        """For each station whether a cell of `wall` lies across the line, and which is the nearest, column and row: (n,) and (n, 2)."""
        seen = wall.ravel().take(self.across) & self.inside
        station, first = np.arange(len(seen)), seen.argmax(1)
        rows, columns = np.divmod(self.across[station, first], self.frame.width)
        return seen[station, first], np.stack([columns, rows], 1)

    def _from_wall(self, hit: Mask) -> Numbers:
        """An order of stations in which rings begin, and end, on a wall, so that no gap is cut in two."""
        begin = np.searchsorted(self.line, np.arange(len(self.rings)))
        size = np.bincount(self.line, minlength=len(self.rings)) - self.rings
        found = np.flatnonzero(hit)
        on_wall, first = np.unique(self.line[found], return_index=True)
        start = np.zeros(len(self.rings), np.int64)
        start[on_wall] = found[first] - begin[on_wall]
        start[~self.rings] = 0
        step = np.arange(len(self.line)) - begin[self.line]
        return np.asarray(begin[self.line] + (step + start[self.line]) % size[self.line])
