"""Maps in the formats of others."""

from stillroom.documents.exports import Export, ExportFormat, export
from stillroom.documents.grids import read_grid
from stillroom.documents.stored import decode_map
from stillroom.service.maps import as_document, find_version, reading_of
from stillroom.store.database import Database
from stillroom.store.grids import GridStore


def export_version(
    database: Database, grids: GridStore, robot_id: str, map_name: str, number: int, kind: ExportFormat
) -> tuple[Export, str]:
    """The version in that format, and what a file of it is called. Raises NotFound."""
    of, row = find_version(database, robot_id, map_name, number)
    semantic_map = decode_map(row.document)
    grid = read_grid(grids.get(row.grid), reading_of(database, of, row))
    geojson = as_document(of, row, semantic_map).model_dump_json().encode()
    name = f"{robot_id}-{map_name}-v{number}"
    made = export(kind, semantic_map, grid, geojson, name)
    return made, name + made.suffix
