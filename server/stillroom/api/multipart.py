"""The two parts of an upload. Parts are told by name and type alone; a file name is allowed and means nothing."""

from dataclasses import dataclass, field

from python_multipart.exceptions import FormParserError
from python_multipart.multipart import MultipartParser, parse_options_header
from starlette.requests import Request

from stillroom.errors import Fault, InvalidInput, UnsupportedFormat

MOST_PARTS = 16
"""Two have a meaning; others are passed over."""


@dataclass
class Part:
    content_type: str = ""
    name: str = ""
    content: bytearray = field(default_factory=bytearray)


async def read_parts(request: Request) -> dict[str, Part]:
    """All parts by name. Raises UnsupportedFormat for another body, InvalidInput for a broken one."""
    content_type, options = parse_options_header(request.headers.get("Content-Type", ""))
    if content_type != b"multipart/form-data" or b"boundary" not in options:
        raise UnsupportedFormat("An upload is multipart/form-data with the parts grid and meta.")
    reader = _Reader()
    try:
        parser = MultipartParser(options[b"boundary"], reader.callbacks())  # type: ignore[arg-type]
        async for chunk in request.stream():
            parser.write(chunk)
        parser.finalize()
    except FormParserError as error:
        raise InvalidInput("The multipart body is broken.", (Fault("", str(error)),)) from None
    if not reader.ended:
        raise InvalidInput("The multipart body is cut off.", (Fault("", "cut off"),))
    return {part.name: part for part in reader.parts}


class _Reader:
    def __init__(self) -> None:
        self.parts: list[Part] = []
        self.ended = False
        self._name = bytearray()
        self._value = bytearray()

    def callbacks(self) -> dict[str, object]:
        return {
            "on_part_begin": self._begin,
            "on_part_data": lambda data, start, end: self.parts[-1].content.extend(data[start:end]),
            "on_header_field": lambda data, start, end: self._name.extend(data[start:end]),
            "on_header_value": lambda data, start, end: self._value.extend(data[start:end]),
            "on_header_end": self._header,
            "on_end": self._end,
        }

    def _begin(self) -> None:
        if len(self.parts) >= MOST_PARTS:
            raise FormParserError(f"more than {MOST_PARTS} parts")
        self.parts.append(Part())

    def _header(self) -> None:
        name, value = bytes(self._name).lower(), bytes(self._value)
        self._name.clear()
        self._value.clear()
        if name == b"content-disposition":
            self.parts[-1].name = parse_options_header(value)[1].get(b"name", b"").decode("utf-8", "replace")
        elif name == b"content-type":
            self.parts[-1].content_type = parse_options_header(value)[0].decode("latin-1").lower()

    def _end(self) -> None:
        self.ended = True
