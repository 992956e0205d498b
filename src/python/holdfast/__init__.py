"""Bounded curved contact patches with full covariance from depth clouds.

    >>> import holdfast
    >>> patch = holdfast.fit(points, covariances)       # one patch: help(holdfast.fit)
    >>> sensor = holdfast.Sensor.load("kinect_v1")
    >>> patches = holdfast.extract(image, sensor)       # all of an image
    >>> foot = holdfast.Foot.load("humanoid_foot")      # may it step there?
    >>> ranking = holdfast.rank_footholds(patch_map, foot)

Lengths are in metres, angles in radians, curvatures in 1/m; cameras look along +z with
x to the right and y down. Arrays of another kind than float64 in C order are copied.
"""

import os as _os

from . import _core
from ._core import (
    RISK_ASSUMPTIONS,
    ContactRisk,
    ContactRisks,
    Foot,
    FootholdRanking,
    Patch,
    Patches,
    PatchMap,
    RiskGrid,
    Sensor,
    Simulation,
    __version__,
    calibrate,
    contact_risk,
    extract,
    fit,
    fit_many,
    rank_footholds,
    risk_grid,
    scene_names,
    simulate,
)

_core._set_package_folder(_os.path.dirname(__file__))

__all__ = [
    "ContactRisk",
    "ContactRisks",
    "Foot",
    "FootholdRanking",
    "Patch",
    "PatchMap",
    "Patches",
    "RISK_ASSUMPTIONS",
    "RiskGrid",
    "Sensor",
    "Simulation",
    "__version__",
    "calibrate",
    "contact_risk",
    "extract",
    "fit",
    "fit_many",
    "rank_footholds",
    "risk_grid",
    "scene_names",
    "simulate",
]

# What users see, in messages and in help().
for _name in __all__:
    if callable(globals()[_name]):
        globals()[_name].__module__ = __name__
del _name
