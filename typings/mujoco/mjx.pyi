# MuJoCo's names come out of a compiled module which a type checker can't read; so they are all of unknown type.
from typing import Any

def __getattr__(name: str) -> Any: ...
