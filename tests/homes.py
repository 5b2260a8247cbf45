"""A small home as a robot would sense it, for tests of everything around the core."""

import cv2
import numpy as np
import numpy.typing as npt

FREE, OCCUPIED, UNEXPLORED = 254, 0, 205
RESOLUTION = 0.05
ORIGIN = [-1.0, -2.0, 0.0]

Image = npt.NDArray[np.uint8]


def home(*, shift: tuple[int, int] = (0, 0), wall_between: bool = True) -> Image:
    """Two rooms of 4 x 4 m with a doorway of 0.9 m between them, row 0 at the bottom; `shift` in cells (x, y)."""
    image = np.full((120, 200), UNEXPLORED, np.uint8)
    image[18:102, 18:182] = OCCUPIED
    image[20:100, 20:180] = FREE
    if wall_between:
        image[20:50, 99:101] = OCCUPIED
        image[68:100, 99:101] = OCCUPIED
    x, y = shift
    return np.roll(image, (y, x), (0, 1))


def png(image: Image) -> bytes:
    """As a robot sends it: the top row first."""
    return cv2.imencode(".png", image[::-1])[1].tobytes()


def pixels(content: bytes) -> Image:
    """What a PNG holds, row 0 at the bottom."""
    decoded = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED)
    assert decoded is not None
    return np.asarray(decoded[::-1], np.uint8)
