"""The commands about map files: upload, export, render, segment."""

import argparse
import sys
from collections import Counter
from functools import partial
from pathlib import Path
from typing import Any

from stillroom.arguments import add_command, add_service, count, positive

FORMATS = ("geojson", "nav2", "keepout", "occupancy_grid", "valetudo", "png")
NO_TOKEN = "stillroom: give --token or STILLROOM_TOKEN"


def add_commands(commands: Any) -> None:
    _add_upload(commands)
    _add_export(commands)
    _add_render(commands)
    _add_segment(commands)


def _add_upload(commands: Any) -> None:
    upload = add_command(
        commands,
        "upload",
        _upload,
        "Upload maps as a robot's missions, in the given order: PNG or PGM images, the YAML files of ROS map_server, Valetudo maps, "
        "nav_msgs/OccupancyGrid as JSON, iRobot's UMF.",
    )
    upload.add_argument("files", nargs="+", type=Path, metavar="FILE")
    add_service(upload)
    upload.add_argument("--sequence", type=count, default=0, help="of the first file; counts up (default: %(default)s)")
    upload.add_argument("--epoch", type=count, help="counted up after the robot was reset")
    upload.add_argument("--resolution", type=float, metavar="M", help="metres a cell")
    upload.add_argument(
        "--origin", type=float, nargs=3, metavar=("X", "Y", "YAW"), help="pose of the lower-left cell's outer corner"
    )
    upload.add_argument("--base-version", type=count, metavar="N", help="the version that --transform starts from")
    upload.add_argument(
        "--transform", type=float, nargs=3, metavar=("X", "Y", "YAW"), help="motion of the map since --base-version"
    )


def _add_export(commands: Any) -> None:
    export = add_command(commands, "export", _export, "Save a version of a map in the format of others.")
    add_service(export)
    export.add_argument("--format", required=True, choices=FORMATS)
    export.add_argument("--version", type=count, metavar="N", help="(default: the one in force)")
    export.add_argument("--out", type=Path, metavar="FILE", help="(default: named after robot, map and version)")


def _add_render(commands: Any) -> None:
    render = add_command(commands, "render", _render, "Draw map files of any readable format as PNG pictures.")
    render.add_argument("files", nargs="+", type=Path, metavar="FILE")
    render.add_argument("--out", type=Path, metavar="DIR", help="a picture of each file goes there")
    render.add_argument("--sheet", type=Path, metavar="FILE", help="all of them on one picture, with captions")
    render.add_argument("--rooms", action="store_true", help="with the rooms that a first mission of each would have")
    render.add_argument(
        "--resolution", type=positive, metavar="M", help="metres a cell, where the file does not say (default: 0.05)"
    )


def _add_segment(commands: Any) -> None:
    segment = add_command(
        commands,
        "segment",
        _segment,
        "Find the rooms of map files of any readable format: for each FILE an image of labels (STEM_rooms.png, 16 bits, 0 is no room), the map "
        "as GeoJSON and a picture.",
    )
    segment.add_argument("files", nargs="+", type=Path, metavar="FILE")
    segment.add_argument("--out", type=Path, required=True, metavar="DIR")
    segment.add_argument(
        "--resolution", type=positive, metavar="M", help="metres a cell, where the file does not say (default: 0.05)"
    )
    segment.add_argument("--sensitivity", type=float, metavar="S", help="higher: more rooms (default: 0)")


def _upload(options: argparse.Namespace) -> int:
    """0: all taken; 1: one was refused or could not be sent, and those after it were not tried; 2: not all were taken."""
    import httpx2

    from stillroom.uploading import WAIT_S, Upload, UploadFailed, upload_file

    if not options.token:
        print(NO_TOKEN, file=sys.stderr)
        return 1
    upload = Upload(options.url.rstrip("/"), options.token, options.robot, options.map, _meta(options))
    all_taken = True
    with httpx2.Client(timeout=WAIT_S + 30) as client:
        for index, file in enumerate(options.files):
            place = f"[{index + 1}/{len(options.files)}] {file.name}: "
            try:
                mission = upload_file(upload, file, options.sequence + index, client, partial(_progress, place))
            except UploadFailed as error:
                print(f"stillroom: {error}", file=sys.stderr)
                return 1
            print(place + _told(mission), flush=True)
            all_taken &= mission["outcome"] in ("created", "updated", "resolved")
    return 0 if all_taken else 2


def _export(options: argparse.Namespace) -> int:
    import httpx2

    from stillroom.exporting import export_version
    from stillroom.uploading import WAIT_S, UploadFailed

    if not options.token:
        print(NO_TOKEN, file=sys.stderr)
        return 1
    path = f"{options.url.rstrip('/')}/api/v1/robots/{options.robot}/maps/{options.map}"
    with httpx2.Client(timeout=WAIT_S) as client:
        try:
            name, content = export_version(
                client, path, options.token, options.version, options.format, partial(_progress, "")
            )
        except UploadFailed as error:
            print(f"stillroom: {error}", file=sys.stderr)
            return 1
    target: Path = options.out or Path(name)
    try:
        target.write_bytes(content)
    except OSError as error:
        print(f"stillroom: {error}", file=sys.stderr)
        return 1
    print(target)
    return 0


def _render(options: argparse.Namespace) -> int:
    """0: all drawn; 1: some could not be read, or a picture not be written."""
    from stillroom.documents.files import in_words
    from stillroom.errors import StillroomError
    from stillroom.rendering import render_file, save, save_sheet

    if options.out is None and options.sheet is None:
        print("stillroom: give --out, --sheet or both", file=sys.stderr)
        return 1
    given = {} if options.resolution is None else {"resolution": options.resolution}
    drawn, failed = [], False
    for file in options.files:
        try:
            caption, picture = render_file(file, given, options.rooms)
            if options.out is not None:
                print(f"{save(options.out, file, picture)}: {caption}", flush=True)
        except (StillroomError, OSError) as error:
            said = in_words(error) if isinstance(error, StillroomError) else error
            print(f"stillroom: {file}: {said}", file=sys.stderr)
            failed = True
            continue
        drawn.append((caption, picture))
    if options.sheet is not None and drawn:
        try:
            save_sheet(options.sheet, drawn)
        except OSError as error:
            print(f"stillroom: {error}", file=sys.stderr)
            return 1
        print(options.sheet)
    return int(failed)


def _segment(options: argparse.Namespace) -> int:
    """0: all done; 1: some could not be read, or their rooms not be written."""
    from stillroom.documents.files import in_words
    from stillroom.errors import StillroomError
    from stillroom.segmenting import save, segment_file

    twice = sorted(stem for stem, files in Counter(file.stem for file in options.files).items() if files > 1)
    if twice:
        print(f"stillroom: more than one file is called {', '.join(twice)}", file=sys.stderr)
        return 1
    given = {} if options.resolution is None else {"resolution": options.resolution}
    failed = False
    for file in options.files:
        try:
            found = segment_file(file, given, options.sensitivity)
            save(options.out, file.stem, found)
        except (StillroomError, OSError) as error:
            said = in_words(error) if isinstance(error, StillroomError) else error
            print(f"stillroom: {file}: {said}", file=sys.stderr)
            failed = True
            continue
        print(f"{options.out / file.stem}_rooms.png: {len(found.semantic_map.rooms)} rooms", flush=True)
    return int(failed)


def _progress(place: str, text: str) -> None:
    print(place + text, file=sys.stderr)


def _meta(options: argparse.Namespace) -> dict[str, Any]:
    given = {
        "resolution": options.resolution,
        "origin": options.origin,
        "epoch": options.epoch,
        "base_version": options.base_version,
        "tracking": None if options.transform is None else {"transform": options.transform},
    }
    return {name: value for name, value in given.items() if value is not None}


def _told(mission: dict[str, Any]) -> str:
    if mission["status"] != "done":
        return f"mission {mission['id']} is {mission['status']}"
    return f"mission {mission['id']} {mission['outcome']}, version {mission['version']}. {mission['reason']}"
