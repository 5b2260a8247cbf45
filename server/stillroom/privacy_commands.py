"""The commands about all that is known of a robot: archive, import, erase. They work on the service's own database and grids."""

import argparse
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stillroom.arguments import add_command

if TYPE_CHECKING:
    from stillroom.store.database import Database
    from stillroom.store.grids import GridStore


_WHOSE = "a robot's id, or the e-mail address of a home's owner"


def add_commands(commands: Any) -> None:
    archive = add_command(
        commands,
        "archive",
        _archive,
        "Save everything of a robot's maps, or of a home, as a zip, which `import` reads again.",
    )
    archive.add_argument("whose", help=_WHOSE)
    archive.add_argument("--out", type=Path, metavar="FILE", help="(default: WHOSE.zip)")
    bring_in = add_command(
        commands, "import", _import, "Bring the maps of an archive into a robot or a home, all or none."
    )
    bring_in.add_argument("whose", help=_WHOSE)
    bring_in.add_argument("file", type=Path, metavar="FILE")
    erase = add_command(
        commands,
        "erase",
        _erase,
        "Delete everything of a robot's maps, for good; the fleet's figures keep their counts.",
    )
    erase.add_argument("robot")
    erase.add_argument("--confirm", metavar="ROBOT", help="the robot's id once more")


def _archive(options: argparse.Namespace) -> int:
    from stillroom.service.accounts import address
    from stillroom.service.archiving import archive, archive_home

    def save(database: "Database", grids: "GridStore") -> str:
        whose: str = options.whose
        out: Path = options.out or Path(f"{whose}.zip")
        pieces = archive_home(database, grids, address(whose)) if "@" in whose else archive(database, grids, whose)
        with out.open("wb") as file:
            for piece in pieces:
                file.write(piece)
        return str(out)

    return _with_service(save)


def _import(options: argparse.Namespace) -> int:
    from stillroom.documents.archives import Archive
    from stillroom.service.accounts import address
    from stillroom.service.importing import import_archive, import_home

    def bring_in(database: "Database", grids: "GridStore") -> str:
        whose: str = options.whose
        with options.file.open("rb") as file:
            if "@" in whose:
                made = import_home(database, grids, address(whose), Archive(file)).robots
            else:
                made = [import_archive(database, grids, whose, Archive(file))]
        return "\n".join(
            f"{robot.robot}: {', '.join(robot.maps)}, {robot.versions} versions, {robot.missions} missions"
            for robot in made
        )

    return _with_service(bring_in)


def _erase(options: argparse.Namespace) -> int:
    from stillroom.service.erasing import erase_robot

    def erase(database: "Database", grids: "GridStore") -> str:
        gone = erase_robot(database, grids, options.robot, options.confirm)
        return f"deleted: {gone.maps} maps, {gone.missions} missions"

    return _with_service(erase)


def _with_service(do: "Callable[[Database, GridStore], str]") -> int:
    from stillroom.documents.files import in_words
    from stillroom.errors import StillroomError
    from stillroom.settings import Settings
    from stillroom.store.database import Database
    from stillroom.store.grids import GridStore
    from stillroom.store.migrate import migrate

    settings = Settings.from_environment()
    database = Database(settings.database_url)
    try:
        migrate(database)
        print(do(database, GridStore(settings.grid_store_url)))
    except StillroomError as error:
        print(f"stillroom: {in_words(error)}", file=sys.stderr)
        return 1
    except OSError as error:
        print(f"stillroom: {error}", file=sys.stderr)
        return 1
    finally:
        database.dispose()
    return 0
