"""A question as a picture: the map as it was, beside what is proposed or what the robot saw."""

from stillroom.documents.grids import read_grid
from stillroom.documents.missions import stored_meta
from stillroom.documents.pictures import contact_sheet, draw, encode
from stillroom.documents.stored import decode_map
from stillroom.maps.grid import OccupancyGrid
from stillroom.service.maps import reading_of
from stillroom.store import conflicts, maps, missions
from stillroom.store.database import Database
from stillroom.store.grids import GridStore
from stillroom.store.rows import ConflictRow, MissionRow

TILE = 480
"""Pixels of each half: readable on a phone, and some tens of kilobytes."""


def review_picture(database: Database, grids: GridStore, row: ConflictRow) -> bytes:
    """PNG. `row`: a conflict that nothing has ended."""
    with database.read() as tx:
        of, mission = maps.get(tx, row.map_id), missions.get(tx, row.mission_id)
        before = maps.version_at(tx, row.map_id, row.base_version)
        proposed = conflicts.proposals(tx, [row.sighting_id])[row.sighting_id]
        chosen = next((proposal.name for proposal in proposed if proposal.action != "keep_previous"), None)
        after = None if chosen is None else conflicts.proposed_map(tx, row.sighting_id, chosen)[0]
    assert before is not None
    rooms = {room["id"] for room in row.rooms}
    was = draw(read_grid(grids.get(before.grid), reading_of(database, of, before)), decode_map(before.document), rooms)
    seen = _seen(grids, mission)
    if after is None:
        return encode(contact_sheet([("As it is", was), ("What the robot saw", draw(seen))], TILE, 2))
    caption = "Now" if row.resolved else "If you accept"
    return encode(contact_sheet([("Before", was), (caption, draw(seen, decode_map(after), rooms))], TILE, 2))


def _seen(grids: GridStore, mission: MissionRow) -> OccupancyGrid:
    return read_grid(grids.get(mission.grid), stored_meta(mission.meta).reading())
