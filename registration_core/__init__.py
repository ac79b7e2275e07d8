"""Six-degree-of-freedom registration of known objects in depth images: geometry and numerics only."""

from registration_core.acceptance import NEVER, Calibration, acceptance, calibration_of
from registration_core.algorithm import ALGORITHM
from registration_core.camera import Intrinsics
from registration_core.certificates import Certificates, Check
from registration_core.color_edges import color_is_aligned
from registration_core.compilation import warm_up
from registration_core.correspondence import Correspondence, pose_from_correspondences
from registration_core.estimate import Ambiguity, Estimate, Hypothesis, SnapStep, WorldEstimate
from registration_core.global_search import propose
from registration_core.known_objects import explained_pixels
from registration_core.object_model import ObjectModel, Symmetries
from registration_core.problem import region_of_interest
from registration_core.recalibration import Recalibration, recalibration
from registration_core.snap import snap, snap_steps
from registration_core.snap_config import SnapConfig
from registration_core.symmetry_axes import axes_of, check_axes
from registration_core.symmetry_group import SuggestedSymmetry, SymmetryAxis, as_symmetries
from registration_core.symmetry_search import find_symmetries, residual_of
from registration_core.views import snap_views, snap_views_steps

__all__ = [
    "ALGORITHM",
    "NEVER",
    "Ambiguity",
    "Calibration",
    "Certificates",
    "Check",
    "Correspondence",
    "Estimate",
    "Hypothesis",
    "Intrinsics",
    "ObjectModel",
    "Recalibration",
    "SnapConfig",
    "SnapStep",
    "SuggestedSymmetry",
    "Symmetries",
    "SymmetryAxis",
    "WorldEstimate",
    "acceptance",
    "as_symmetries",
    "axes_of",
    "calibration_of",
    "check_axes",
    "color_is_aligned",
    "explained_pixels",
    "find_symmetries",
    "pose_from_correspondences",
    "propose",
    "recalibration",
    "region_of_interest",
    "residual_of",
    "snap",
    "snap_steps",
    "snap_views",
    "snap_views_steps",
    "warm_up",
]
