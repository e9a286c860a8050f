"""The structure file: boxes, panels and the joints that turn them.

TOML, one table per part; lengths in metres, body axes of the vehicle file (x fore, y starboard, z nadir,
origin in the centre of mass), every part as it stands when all joints are at zero. See
`emulator/data/structures/iss.toml`.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from gnss_hil.dbc.common.shipped_files import Files
from gnss_hil.dbc.common.vehicle import Direction, Place, Strict
from gnss_hil.emulator.signal.structure.materials import MaterialName

Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9 ._+-]{0,31}$")]
Length = Annotated[float, Field(ge=0.001, le=500)]
Angle = Annotated[float, Field(ge=-360, le=360)]

UNIT_TOLERANCE = 1e-3


class StructureError(ValueError):
    """A structure file that cannot be used; the message is for people."""


def _length_1(name: str, vector: Direction) -> None:
    norm = float(np.linalg.norm(vector))
    if abs(norm - 1) > UNIT_TOLERANCE:
        raise ValueError(f"{name} has length {norm:.4g}; a direction has length 1")


def _upright(name: str, vector: Direction, other: str, towards: Direction) -> None:
    cosine = float(np.dot(vector, towards))
    if abs(cosine) > UNIT_TOLERANCE:
        raise ValueError(f"{name} is not at right angles to {other}: their product is {cosine:.4g}")


class Joint(Strict):
    """A joint through point_m along axis_body.

    name     of the joint
    point_m  a point of the axis
    axis_body, facing_body   unit vectors
    angle_deg   about the axis, right-handed
    rate_dps    the same, in a second
    turns    "sun": so that facing_body points as close to the Sun as it can; "rate": rate_dps from angle_deg
             at the start; "fixed": at angle_deg
    parent   the joint that carries this one
    """

    name: Name
    point_m: Place
    axis_body: Direction
    turns: Literal["sun", "rate", "fixed"]
    facing_body: Direction | None = None
    angle_deg: Angle = 0.0
    rate_dps: Annotated[float, Field(ge=-10, le=10)] = 0.0
    parent: str | None = None

    @model_validator(mode="after")
    def _complete(self):
        _length_1("axis_body", self.axis_body)
        if (self.turns == "sun") != (self.facing_body is not None):
            raise ValueError("facing_body goes with turns = 'sun', and turns = 'sun' with facing_body")
        if self.facing_body is not None:
            _length_1("facing_body", self.facing_body)
            _upright("facing_body", self.facing_body, "axis_body", self.axis_body)
        if self.rate_dps and self.turns != "rate":
            raise ValueError("rate_dps goes with turns = 'rate'")
        return self


class Part(Strict):
    """What boxes and panels have in common.

    name          of the part
    centre_m      its middle
    material      the surface's, see `gnss_hil.emulator.signal.structure.materials`
    amplitude     part of the reflected amplitude that leaves like from a mirror (lattices, wrinkled blankets)
    roughness_m   rms height of the surface
    joint         what turns it; none: it is fixed to the craft
    """

    name: Name
    centre_m: Place
    material: MaterialName = "metal"
    amplitude: Annotated[float, Field(ge=0, le=1)] = 1.0
    roughness_m: Annotated[float, Field(ge=0, le=1)] = 0.0
    joint: str | None = None


class Box(Part):
    """A solid with three pairs of faces.

    size_m     along its own axes
    turn_deg   of its axes from the body's: roll, pitch, yaw; yaw first
    radius_m   the box stands for a cylinder of this radius along its x axis: what its sides reflect spreads
    """

    size_m: tuple[Length, Length, Length]
    turn_deg: tuple[Angle, Angle, Angle] = (0.0, 0.0, 0.0)
    radius_m: Length | None = None


class Panel(Part):
    """A rectangle without thickness, reflecting on both sides.

    normal_body   unit vector at right angles to it
    along_body    unit vector along one of its edges
    size_m        along that edge, and across
    """

    normal_body: Direction
    along_body: Direction
    size_m: tuple[Length, Length]

    @model_validator(mode="after")
    def _square(self):
        _length_1("normal_body", self.normal_body)
        _length_1("along_body", self.along_body)
        _upright("along_body", self.along_body, "normal_body", self.normal_body)
        return self


class StructureFile(Strict):
    """A craft's outside.

    name   of the structure
    """

    name: Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9-]{0,31}$")]
    joint: Annotated[tuple[Joint, ...], Field(max_length=64)] = ()
    box: Annotated[tuple[Box, ...], Field(max_length=256)] = ()
    panel: Annotated[tuple[Panel, ...], Field(max_length=256)] = ()

    @property
    def parts(self) -> tuple[Box | Panel, ...]:
        return (*self.box, *self.panel)

    @model_validator(mode="after")
    def _hangs_together(self):
        if not self.parts:
            raise ValueError("no box and no panel")
        _all_different("part", (part.name for part in self.parts))
        _all_different("joint", (joint.name for joint in self.joint))
        known: set[str] = set()
        for joint in self.joint:
            if joint.parent is not None and joint.parent not in known:
                raise ValueError(
                    f"joint '{joint.name}': parent '{joint.parent}' is not among the joints before it"
                )
            known.add(joint.name)
        for part in self.parts:
            if part.joint is not None and part.joint not in known:
                raise ValueError(f"'{part.name}': there is no joint '{part.joint}'")
        return self


def _all_different(kind: str, names: Iterable[str]) -> None:
    seen: set[str] = set()
    for name in names:
        if name in seen:
            raise ValueError(f"two {kind}s are named '{name}'")
        seen.add(name)


FILES = Files("structure", "gnss_hil.emulator.data", "structures", StructureFile, StructureError)
shipped, find = FILES.shipped, FILES.find


def parse(text: str, origin: str) -> StructureFile:
    """A structure from TOML text; StructureError says what is wrong and where."""
    return FILES.checked(FILES.document(text, origin), origin)


def load(path: Path) -> StructureFile:
    """A structure from a file; StructureError says what is wrong and where."""
    return FILES.checked(FILES.read(path), str(path))
