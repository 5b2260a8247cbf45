"""How well rooms found agree with rooms that somebody drew, by the definitions of the room segmentation benchmark of Bormann et al. (ICRA 2016).

A label image is an integer array (height, width), 0 where there is no room. Rooms of a hundred cells or fewer don't count.
"""

from dataclasses import astuple, dataclass

import cv2
import numpy as np
import numpy.typing as npt

Labels = npt.NDArray[np.int64]
Table = npt.NDArray[np.float64]

FEWEST_CELLS = 100


@dataclass(frozen=True)
class Scores:
    """In percent. Recall rewards too few rooms and precision too many; the others match rooms one to one."""

    recall: float
    """Mean over drawn rooms of the share that the found room with most of it has."""
    precision: float
    """Mean over found rooms of the share that lies in one drawn room."""
    iou: float
    """Mean over drawn rooms of the intersection over union with the found room matched to it."""
    f1: float
    """Share of rooms, drawn and found, that are matched with an IoU over 0.5."""
    both: float
    """Share of drawn rooms of which the matched room has more than half, which itself lies in it for more than half."""


def drawn_rooms(grey: npt.NDArray[np.uint8]) -> Labels:
    """Rooms of a plan of the benchmark on which thin grey lines close every doorway."""
    return np.asarray(cv2.connectedComponents((grey > 250).view(np.uint8), connectivity=8)[1], np.int64)


def score(found: Labels, drawn: Labels) -> Scores:
    common, found_cells, drawn_cells = _common(found, drawn)
    if not common.size:
        return Scores(0.0, 0.0, 0.0, 0.0, 0.0)
    iou = common / (found_cells[:, None] + drawn_cells[None] - common)
    i, j = best_pairs(iou)
    recall, precision = common[i, j] / drawn_cells[j], common[i, j] / found_cells[i]
    return Scores(
        recall=100 * float((common.max(0) / drawn_cells).mean()),
        precision=100 * float((common.max(1) / found_cells).mean()),
        iou=100 * float(iou[i, j].sum()) / len(drawn_cells),
        f1=200 * float((iou[i, j] > 0.5).sum()) / (len(found_cells) + len(drawn_cells)),
        both=100 * float(((recall > 0.5) & (precision > 0.5)).sum()) / len(drawn_cells),
    )


def matched(found: Labels, drawn: Labels) -> tuple[int, int]:
    """Of the drawn rooms those that a found room matches with an IoU over 0.5, and all of them."""
    common, found_cells, drawn_cells = _common(found, drawn)
    if not common.size:
        return 0, len(drawn_cells)
    iou = common / (found_cells[:, None] + drawn_cells[None] - common)
    return int((iou > 0.5).any(0).sum()), len(drawn_cells)


def mean(scores: list[Scores]) -> Scores:
    return Scores(*np.mean([astuple(each) for each in scores], axis=0).tolist())


def _common(found: Labels, drawn: Labels) -> tuple[Table, Table, Table]:
    """Cells that each found room (rows) and each drawn room (columns) have in common; cells of each found and of each drawn room."""
    (first, rows), (second, columns) = (_numbered(labels) for labels in (found, drawn))
    table = np.zeros((rows + 1, columns + 1))
    np.add.at(table, (first.ravel(), second.ravel()), 1)
    return table[1:, 1:], table[1:].sum(1), table[:, 1:].sum(0)


def _numbered(labels: Labels) -> tuple[Labels, int]:
    """Labels of enough cells numbered from 1 on, the others 0, and how many there are."""
    values, place, cells = np.unique(labels, return_inverse=True, return_counts=True)
    counts = (values != 0) & (cells > FEWEST_CELLS)
    return np.asarray(np.where(counts, np.cumsum(counts), 0)[place].reshape(labels.shape)), int(counts.sum())


def best_pairs(gain: Table) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Rows and columns paired one to one for the largest sum of `gain` (Hungarian method); pairs that gain nothing are left out."""
    rows, columns = gain.shape
    if rows > columns:
        j, i = best_pairs(gain.T)
        return i, j
    cost = np.pad(-gain, ((1, 0), (1, 0)))
    row_price, column_price = np.zeros(rows + 1), np.zeros(columns + 1)
    row_of = np.zeros(columns + 1, np.int64)
    for row in range(1, rows + 1):
        row_of[0], column = row, 0
        slack, came_from, done = (
            np.full(columns + 1, np.inf),
            np.zeros(columns + 1, np.int64),
            np.zeros(columns + 1, bool),
        )
        while row_of[column]:
            done[column] = True
            reduced = cost[row_of[column]] - row_price[row_of[column]] - column_price
            better = ~done & (reduced < slack)
            slack[better], came_from[better] = reduced[better], column
            following = int(np.where(done, np.inf, slack)[1:].argmin()) + 1
            step = slack[following]
            row_price[row_of[done]] += step
            column_price[done] -= step
            slack[~done] -= step
            column = following
        while column:
            row_of[column] = row_of[came_from[column]]
            column = int(came_from[column])
    j = np.flatnonzero(row_of[1:])
    i = row_of[1:][j] - 1
    gains = gain[i, j] > 0
    return i[gains], j[gains]
