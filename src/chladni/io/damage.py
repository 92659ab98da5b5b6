"""Exceptions by which libraries report a damaged file, NumPy, SciPy, zip and XML among them."""

import zipfile
import zlib
from struct import error as StructError
from tokenize import TokenError

DAMAGED = (
    *(ValueError, TypeError, LookupError, OSError, EOFError, RuntimeError, MemoryError),
    *(ArithmeticError, AttributeError, NameError, AssertionError, SyntaxError),
    *(zipfile.BadZipFile, zlib.error, StructError, TokenError),
)
