"""A function in a universal file (dataset 58), in the units of the file.

Source of the format: SDRC universal file datasets.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Axis:
    """Specific data type (0: unknown, 18: frequency, ...) and unit label of an axis."""

    kind: int = 0
    unit: str = "NONE"


@dataclass(frozen=True, eq=False, kw_only=True)
class FunctionSet:
    """58: a function of a response dof and a reference dof."""

    function: int  # 1 time, 4 FRF, 5 transmissibility, 6 coherence, ...
    # response, reference: (node, direction -6 to 6)
    response: tuple[int, int]
    reference: tuple[int, int]
    due: int  # how many values the head says there are
    # x, y: (n,)
    x: np.ndarray
    y: np.ndarray
    abscissa: Axis
    ordinate: Axis
    denominator: Axis
    title: str = ""  # first line of its head
    number: int = 0  # of the dataset in the file, from 1
    # of the entities (parts of a structure, points) of response and reference; "" for none
    names: tuple[str, str] = ("", "")


def function_set(d: Mapping[str, Any], number: int) -> FunctionSet:
    """The dictionary that pyuff makes of a dataset 58."""
    abscissa, ordinate, denominator = (
        Axis(int(d[f"{axis}_spec_data_type"]), str(d[f"{axis}_axis_units_lab"]))
        for axis in ("abscissa", "ordinate", "orddenom")
    )
    return FunctionSet(
        function=int(d["func_type"]),
        response=(int(d["rsp_node"]), int(d["rsp_dir"])),
        reference=(int(d["ref_node"]), int(d["ref_dir"])),
        due=int(d["num_pts"]),
        x=d["x"],
        y=d["data"],
        abscissa=abscissa,
        ordinate=ordinate,
        denominator=denominator,
        title=str(d.get("id1", "")),
        number=number,
        names=(_name(d.get("rsp_ent_name")), _name(d.get("ref_ent_name"))),
    )


def _name(text: object) -> str:
    """Name of an entity as a word of a label, or an empty text."""
    name = re.sub(r"[^\w.+-]+", "_", str(text or "").strip())
    return "" if name.upper() in ("NONE", "NULL", "0") else name
