"""What surfaces are made of, and how they reflect a circularly polarised wave.

Sources: materials: Recommendation ITU-R P.2040-3, table 3 (typed from memory). Reflection coefficients:
Fresnel's; into either hand: half sum and half difference of them, which the symmetry of a plane demands.
Roughness: Beckmann & Spizzichino, The Scattering of Electromagnetic Waves from Rough Surfaces (1963), the
coherent part. Time runs as exp(+j w t).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from gnss_hil.dbc.common.arrays import C128, F64
from gnss_hil.emulator.signal.bands import L1_HZ

MaterialName = Literal["metal", "glass"]
"""The rows of MATERIALS, as structure files name them."""


@dataclass(frozen=True, slots=True)
class Material:
    """a, c, d of P.2040-3, table 3: permittivity a, conductivity c f^d [S/m] with f in GHz (b is 0 for both).
    A surface is taken as a half space of it (modelled)."""

    name: MaterialName
    a: float
    c: float
    d: float

    @property
    def permittivity(self) -> complex:
        """Relative permittivity at L1 of GPS; GLONASS is 2 % above, and nothing here notices."""
        from scipy.constants import epsilon_0

        conductivity = self.c * (L1_HZ / 1e9) ** self.d
        return self.a - 1j * conductivity / (2 * np.pi * L1_HZ * epsilon_0)


MATERIALS: dict[MaterialName, Material] = {
    m.name: m for m in (Material("metal", 1.0, 1e7, 0.0), Material("glass", 6.31, 0.0036, 1.3394))
}


def fresnel(permittivity: C128, cos_incidence: F64) -> tuple[C128, C128]:
    """Reflection coefficients (k,) of the electric field across and along the plane of incidence, TE and TM.

    permittivity    (k,) relative, complex
    cos_incidence   (k,) of the angle from the surface's normal, 0 to 1
    """
    inside: C128 = np.sqrt(permittivity - (1 - cos_incidence**2))
    te = (cos_incidence - inside) / (cos_incidence + inside)
    tm = (permittivity * cos_incidence - inside) / (permittivity * cos_incidence + inside)
    return te, tm


def circular(permittivity: C128, cos_incidence: F64) -> tuple[C128, C128]:
    """Reflection coefficients (k,) of a right-handed wave into right-handed and left-handed parts."""
    te, tm = fresnel(permittivity, cos_incidence)
    return (tm + te) / 2, (tm - te) / 2


def coherent(roughness_m: F64, cos_incidence: F64, wave_m: F64) -> F64:
    """Part (k,) of the amplitude that a surface of this height deviation (rms) reflects like a mirror:
    exp(-g / 2), g = (4 pi roughness cos / wave)^2."""
    return np.exp(-((4 * np.pi * roughness_m * cos_incidence / wave_m) ** 2) / 2)
