"""Public names; each is loaded when it is first used."""

from .server import Explorer as Explorer
from .server import explore as explore
from .server import serve as serve
