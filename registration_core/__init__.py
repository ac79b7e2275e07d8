"""Six-degree-of-freedom registration of known objects in depth images: geometry and numerics only."""

from registration_core.algorithm import ALGORITHM
from registration_core.compilation import warm_up
from registration_core.config import SnapConfig
from registration_core.estimate import Estimate, Hypothesis, SnapStep, WorldEstimate
from registration_core.geometry.camera import Intrinsics
from registration_core.geometry.correspondence import Correspondence, pose_from_correspondences
from registration_core.geometry.object_model import ObjectModel, Symmetries
from registration_core.judge.acceptance import NEVER, Calibration, acceptance, calibration_of
from registration_core.judge.ambiguity import Ambiguity
from registration_core.judge.certificates import Certificates, Check
from registration_core.judge.recalibration import Recalibration, recalibration
from registration_core.propose import propose
from registration_core.rendering.known_objects import explained_pixels
from registration_core.search.color_edges import color_is_aligned
from registration_core.search.snap_input import region_of_interest
from registration_core.snap import snap, snap_steps
from registration_core.snap_views import snap_views, snap_views_steps
from registration_core.symmetry.axes import axes_of, check_axes
from registration_core.symmetry.find import find_symmetries, residual_of
from registration_core.symmetry.group import SuggestedSymmetry, SymmetryAxis, as_symmetries

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
