"""Makes the fitted numbers of a snap from nothing: scenes, candidates, features, weights, calibration."""
