"""What people are told of what is kept of their homes."""

from stillroom.documents.geojson import Document


class Imported(Document):
    """What an archive brought."""

    robot: str
    maps: list[str]
    versions: int
    missions: int


class Erased(Document):
    """What there was, and is not any more."""

    robots: list[str]
    maps: int
    missions: int
