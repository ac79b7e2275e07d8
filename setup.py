"""Puts into the wheel what lies beside the packages; all else is written in pyproject.toml."""

from setuptools import find_packages, setup

FOLDERS = ("static", "migrations", "scenes")
"""They are found inside `app` once it is installed (`app/resources.py`)."""

setup(
    packages=[
        *find_packages(include=["app", "app.*", "registration_core", "registration_core.*"]),
        *(f"app.{folder}" for folder in FOLDERS),
    ],
    package_dir={f"app.{folder}": folder for folder in FOLDERS},
)
