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


def changed(change: str) -> Image:
    """The home of the tests as a robot finds it on one day or another."""
    image = home(wall_between=change != "open plan")
    match change:
        case "gap":
            image[72:96, 99:101] = FREE
        case "small gap":
            image[76:88, 99:101] = FREE
        case "shut":
            image[50:68, 99:101] = OCCUPIED
        case "annex":
            image[100:102, 50:60] = FREE
            image[102:116, 20:90] = FREE
            image[116:118, 18:92] = OCCUPIED
            image[102:118, 18:20] = image[102:118, 90:92] = OCCUPIED
        case "part":
            image[18:102, 140:182] = UNEXPLORED
        case "sofa":
            image[60:90, 20:40] = OCCUPIED
        case "leak":
            image[40:48, 180:182] = FREE
            image[30:60, 182:196] = FREE
        case "other floor":
            image[18:102, 18:182] = UNEXPLORED
            image[18:60, 18:120] = OCCUPIED
            image[20:58, 20:118] = FREE
    return image


def png(image: Image) -> bytes:
    """As a robot sends it: the top row first."""
    return cv2.imencode(".png", image[::-1])[1].tobytes()


def pixels(content: bytes) -> Image:
    """What a PNG holds, row 0 at the bottom."""
    decoded = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED)
    assert decoded is not None
    return np.asarray(decoded[::-1], np.uint8)
