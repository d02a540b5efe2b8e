"""Options that several commands have, with how their values are called in the help."""

import pathlib
from typing import Annotated

from tyro.conf import Positional, UseAppendAction, arg

Out = Annotated[pathlib.Path, arg(metavar="DIR")]
OutFile = Annotated[pathlib.Path, arg(metavar="FILE.csv")]
Folder = Annotated[Positional[pathlib.Path], arg(metavar="DIR")]
Columns = Annotated[pathlib.Path | None, arg(metavar="FILE.toml")]
KnownPayload = Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="REC=KG")]
Hold = Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="NAME=VALUE")]
