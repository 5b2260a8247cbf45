"""Poses at which two sets of walls may lie on each other: the turn from where walls face, the shift by correlation.

The correlation is done by FFT, one picture for each of four directions in which walls face, so that inside and outside, or the walls
along a corridor and across it, are never mixed up.
"""

from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from stillroom.maps.geometry import Points, Pose
from stillroom.pipeline.alignment import WallSamples

CELL_M = 0.20
BLUR_M = 0.20
DIRECTIONS = np.array([(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)])
OTHER_TURNS = 4
"""Turns that are tried besides the four quarter turns of the likeliest one: not every home is of right angles."""
TURNS_APART_DEG = 8
BINS = 720
"""Of half a degree."""
SHIFTS_PER_TURN = 2
SHIFTS_APART_M = 2.0
MARGIN_M = 1.0
THICKEST = 2.0
"""Walls count in a cell as often as this at the most: a rack of them is not better than one."""

Picture = npt.NDArray[np.float32]


def likely_poses(before: WallSamples, after: WallSamples) -> list[Pose]:
    """Poses that bring the walls of `before` onto those of `after`, both not empty, best correlation first."""
    centre = before.points.mean(0)
    radius = float(np.linalg.norm(before.points - centre, axis=1).max())
    low = after.points.min(0) - MARGIN_M
    extent = np.ptp(after.points, axis=0).max() + 2 * MARGIN_M
    size = cv2.getOptimalDFTSize(int(np.ceil((extent + 2 * radius) / CELL_M)))
    targets = [
        _spectrum(cv2.GaussianBlur(picture, (0, 0), BLUR_M / CELL_M))
        for picture in _pictures(after.points - low, after.normals, size)
    ]
    found: list[tuple[float, Pose]] = []
    for yaw in _turns(before.normals, after.normals):
        turn = Pose(yaw=yaw)
        points = turn.apply(before.points - centre)
        corner = points.min(0)
        pictures = _pictures(points - corner, before.normals @ turn.rotation.T, size)
        match = _correlation(targets, pictures)
        for score, shift in _peaks(match):
            # shifts are cyclic: those beyond the map are the ones that end before it
            shift = np.where(shift * CELL_M > extent, shift - size, shift)
            x, y = (low + shift * CELL_M - corner - turn.apply(centre[None])[0]).tolist()
            found.append((score, Pose(x, y, yaw)))
    return [pose for _, pose in sorted(found, key=lambda entry: -entry[0])]


def _turns(before: Points, after: Points) -> list[float]:
    """Angles (radians) at which the directions of two sets of normals agree best, at least `TURNS_APART_DEG` apart."""
    histograms = []
    for normals in (before, after):
        facing = np.arctan2(normals[:, 1], normals[:, 0]) / (2 * np.pi)
        counts = np.bincount(np.round(facing * BINS).astype(int) % BINS, minlength=BINS).astype(float)
        kernel = np.exp(-0.5 * (np.arange(-8, 9) / 3.0) ** 2)
        histograms.append(np.fft.rfft(np.convolve(np.concatenate([counts[-8:], counts, counts[:8]]), kernel, "valid")))
    match = np.fft.irfft(histograms[1] * np.conj(histograms[0]), BINS)
    quarter = int(match.reshape(4, BINS // 4).sum(0).argmax())
    turns = [quarter + k * BINS // 4 for k in range(4)]
    near = np.arange(-round(TURNS_APART_DEG / 360 * BINS), round(TURNS_APART_DEG / 360 * BINS) + 1)
    for turn in turns:
        match[(turn + near) % BINS] = -np.inf
    for _ in range(OTHER_TURNS):
        turns.append(int(match.argmax()))
        match[(turns[-1] + near) % BINS] = -np.inf
    return [turn * 2 * np.pi / BINS for turn in turns]


def _pictures(points: Points, normals: Points, size: int) -> list[Picture]:
    """Wall points as a picture (size, size) for each direction; a slanting wall counts for the two that it lies between, by cos²."""
    column, row = np.round(points / CELL_M).astype(np.int64).T % size
    cells = row * size + column
    shares = np.maximum(normals @ DIRECTIONS.T, 0.0) ** 2
    counts = [np.bincount(cells, share, minlength=size * size).reshape(size, size) for share in shares.T]
    return [np.minimum(count, THICKEST).astype(np.float32) for count in counts]


def _correlation(targets: list[Picture], pictures: list[Picture]) -> Picture:
    """How well pictures lie on the spectra of others for each cyclic shift (row, column)."""
    together = np.zeros_like(targets[0])
    for target, picture in zip(targets, pictures, strict=True):
        together += cv2.mulSpectrums(target, _spectrum(picture), 0, conjB=True)
    return np.asarray(cv2.idft(together, flags=cv2.DFT_SCALE | cv2.DFT_REAL_OUTPUT), np.float32)


def _spectrum(picture: npt.NDArray[Any]) -> Picture:
    return np.asarray(cv2.dft(picture), np.float32)


def _peaks(match: Picture) -> list[tuple[float, Points]]:
    """The highest values of a cyclic correlation and their shifts (column, row) in cells, apart from each other."""
    apart = np.arange(-round(SHIFTS_APART_M / CELL_M), round(SHIFTS_APART_M / CELL_M) + 1)
    found = []
    for _ in range(SHIFTS_PER_TURN):
        row, column = np.unravel_index(match.argmax(), match.shape)
        found.append((float(match[row, column]), np.array([column, row], np.float64)))
        match[np.ix_((row + apart) % len(match), (column + apart) % len(match))] = -np.inf
    return found
