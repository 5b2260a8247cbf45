"""The borders of a mask along the edges of its cells: exact, and the same however finely the cells are divided."""

import cv2
import numpy as np
import numpy.typing as npt

from stillroom.maps.grid import Mask

Corners = npt.NDArray[np.int64]
"""Shape (n, 2): column and row of points where four cells meet; cell (c, r) covers [c, c + 1) x [r, r + 1)."""
QUADRANTS = np.array([(1, 1), (-1, 1), (-1, -1), (1, -1)])
"""Sides (to the right, up) to which two borders lead from a corner, for the odd one of the four cells around it."""
ODD_CELLS = np.zeros(16, np.uint8)
"""Of the cells around a point, a bit each, those that the border turns around; none where it goes straight on."""
for _one in range(4):
    ODD_CELLS[1 << _one] = ODD_CELLS[15 - (1 << _one)] = 1 << _one
ODD_CELLS[0b0101], ODD_CELLS[0b1010] = 0b0101, 0b1010
TURNS = np.zeros(256, np.uint8)
TURNS[:16] = ODD_CELLS > 0
BITS = np.array([[4, 8], [2, 1]], np.uint8)


def trace(mask: Mask) -> list[Corners]:
    """The border of each 4-connected part of `mask`, and of each hole in one, as the corners at which it turns.

    The mask is on the left: borders of parts run counter-clockwise, those of holes clockwise. Each begins at its corner that is farthest
    from the middle of them all, so that turned and mirrored masks have turned and mirrored borders.
    """
    places, quadrants, horizontal = _corners(mask)
    if not len(places):
        return []
    sideways, upright = QUADRANTS.take(quadrants, 0).T
    beside = _partners(places[:, 1], places[:, 0], sideways)
    above = _partners(places[:, 0], places[:, 1], upright)
    return _from_farthest(places, _cycles(np.where(horizontal, beside, above).tolist()))


def enclosed(ring: Corners) -> float:
    """Cells that a ring encloses, negative where it runs clockwise."""
    x, y = ring.T
    return float(x[:-1] @ y[1:] - x[1:] @ y[:-1] + x[-1] * y[0] - x[0] * y[-1]) / 2


def _corners(mask: Mask) -> tuple[Corners, npt.NDArray[np.int64], npt.NDArray[np.bool_]]:
    """Every corner, the quadrant of its odd cell, and whether the border leaves it horizontally. Where parts touch over a corner there are two."""
    cells = cv2.copyMakeBorder(mask.view(np.uint8), 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=0)
    # a bit for each of the four cells around each point, in the order of QUADRANTS
    around = np.asarray(cv2.filter2D(cells, cv2.CV_8U, BITS, anchor=(0, 0), borderType=cv2.BORDER_CONSTANT), np.uint8)
    points = np.flatnonzero(cv2.LUT(around, TURNS).view(np.bool_))
    kinds = around.ravel()[points]
    rows, columns = np.divmod(points, around.shape[1])
    odd = ODD_CELLS[kinds]
    found = [np.flatnonzero(odd >> quadrant & 1) for quadrant in range(4)]
    quadrants, corners = np.repeat(np.arange(4), [len(some) for some in found]), np.concatenate(found)
    alone = kinds[corners] >> quadrants & 1 == 1
    return np.stack([columns[corners], rows[corners]], 1), quadrants, (quadrants % 2 == 1) ^ alone


def _partners(
    line: npt.NDArray[np.int64], at: npt.NDArray[np.int64], towards: npt.NDArray[np.int64]
) -> npt.NDArray[np.int64]:
    """For each corner the one at the other end of its border along a `line` of the grid, `at` places on it and leading `towards` -1 or 1."""
    # one number for all three, as no two corners have the same, is sorted much faster
    order = np.argsort((line * (at.max() + 1) + at) * 2 + (towards > 0)).reshape(-1, 2)
    partner = np.empty(order.size, np.int64)
    partner[order[:, 0]], partner[order[:, 1]] = order[:, 1], order[:, 0]
    return partner


def _cycles(following: list[int]) -> list[list[int]]:
    left = following.copy()
    rings = []
    for start in range(len(left)):
        ring, k = [], start
        while (after := left[k]) >= 0:
            left[k] = -1
            ring.append(k)
            k = after
        if ring:
            rings.append(ring)
    return rings


def _from_farthest(places: Corners, rings: list[list[int]]) -> list[Corners]:
    corners = places.take(np.concatenate(rings), 0)
    size = np.array([len(ring) for ring in rings])
    stop = np.cumsum(size)
    begin = stop - size
    from_middle = np.repeat(size, size)[:, None] * corners - np.repeat(np.add.reduceat(corners, begin), size, axis=0)
    far = from_middle[:, 0] ** 2 + from_middle[:, 1] ** 2
    farthest = [(a, a + int(far[a:b].argmax()), b) for a, b in zip(begin.tolist(), stop.tolist(), strict=True)]
    return [np.concatenate([corners[first:b], corners[a:first]]) for a, first, b in farthest]
