"""Files of VTK by pyvista."""

from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import FileError

if TYPE_CHECKING:
    from pyvista import DataSet


def vtk_data_set(path: Path) -> "DataSet":
    """The data set of a file, the blocks of several put together.

    Raises
    ------
    FileError
        If VTK cannot read it.
    """
    import pyvista

    quiet = pyvista.VtkErrorCatcher(send_to_logging=False)
    with pyvista.vtk_verbosity("off"), quiet as caught:
        try:
            found = pyvista.read(path)
        except (OSError, ValueError, RuntimeError) as error:
            raise FileError(f"{path} cannot be read as a mesh: {error}") from error
    if isinstance(found, pyvista.MultiBlock):
        found = found.combine()
    if not found.n_points:
        why = caught.error_events[0].alert if caught.error_events else "it has no points"
        raise FileError(f"{path} cannot be read as a mesh: {why}")
    return found
