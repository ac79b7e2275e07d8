"""Prints the rooms of a checkout, the arrows between them, and what goes round in a circle."""

import argparse
import sys
from collections import Counter
from pathlib import Path

import grimp
import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

PACKAGES = ("registration_core", "app")
Arrow = tuple[str, str]
"""From what imports to what is imported."""


def main() -> None:
    """Print a section for each package."""
    parser = argparse.ArgumentParser(description="Show the rooms of a checkout and the arrows between them.")
    parser.add_argument("checkout", nargs="?", type=Path, default=Path.cwd())
    sys.path.insert(0, str(parser.parse_args().checkout.resolve()))
    for package in PACKAGES:
        graph = grimp.build_graph(package, cache_dir=None)
        modules = {module for module in graph.modules if not graph.find_children(module)}
        arrows = {(one, other) for one in modules for other in graph.find_modules_directly_imported_by(one)}
        between = between_rooms(arrows)
        rooms = Counter(room_of(module) for module in modules)
        print(f"{package}: {len(modules)} modules, {len(between)} arrows between rooms")
        for room, count in sorted(rooms.items()):
            print(f"    {room}  {count}" if count > 1 else f"    {room}")
        for name, found in (("rooms", circles(between)), ("modules", circles(arrows))):
            print(f"  circles of {name}: {len(found)}")
            for circle in found:
                print(f"    {', '.join(circle)}")


def room_of(module: str) -> str:
    """The folder of a module; those beside the rooms of a package are rooms of their own."""
    parent = module.rpartition(".")[0]
    return module if parent in PACKAGES else parent


def between_rooms(arrows: set[Arrow]) -> set[Arrow]:
    """The arrows that leave a room."""
    found = {(room_of(one), room_of(other)) for one, other in arrows}
    return {(one, other) for one, other in found if one != other}


def circles(arrows: set[Arrow]) -> list[list[str]]:
    """What depends on itself by way of others, largest first."""
    names = sorted({name for arrow in arrows for name in arrow})
    if not names:
        return []
    index = {name: i for i, name in enumerate(names)}
    rows, columns = zip(*[(index[one], index[other]) for one, other in arrows], strict=True)
    graph = coo_array((np.ones(len(rows)), (rows, columns)), shape=(len(names), len(names)))
    count, labels = connected_components(graph, connection="strong")
    found = [[name for name, label in zip(names, labels, strict=True) if label == i] for i in range(count)]
    return sorted((circle for circle in found if len(circle) > 1), key=len, reverse=True)


if __name__ == "__main__":
    main()
