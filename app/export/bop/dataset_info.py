"""`dataset_info.md`: what an exported dataset holds, for people."""

from collections import Counter

from app.export.content.selection import Selection

TEXT = """# {name}

Exported by Snap6D in the format of the BOP benchmark, scene by scene.
Lengths are in millimetres, cameras as in OpenCV (x right, y down, z forward).

- Newest annotation: {newest} (UTC).
- {scenes} scenes, {images} images, {annotations} annotated object instances.
- Left out: {left_out} images of scenes in which nothing is annotated.
- Not annotated in the exported scenes: {instances_open} object instances that have a task.
- Of these were skipped by those who looked for them: {skipped}.

An object that lies in a scene and has no annotation is missing from `scene_gt.json` too.
Images of one scene share one world where `scene_camera.json` has `cam_R_w2c` and `cam_t_w2c`.
Masks and `scene_gt_info.json` follow bop_toolkit: a surface is visible where it lies at most 15 mm behind
the measured one, and where nothing was measured.
Instances wholly behind a camera have no entry for its image.
`models_eval` has the same surfaces with evenly spread vertices.
`interaction_log` has every step of the annotation; operators appear as codes, not by name.

## Objects
| obj_id | name | annotated instances |
|---|---|---|
{objects}

## Annotations with several submissions
{several}
"""


def dataset_info(selection: Selection) -> str:
    """The text of `dataset_info.md`."""
    annotations = selection.annotations
    counts = Counter(annotation.obj_id for annotation in annotations)
    return TEXT.format(
        name=selection.name,
        newest=selection.newest_submission.strftime("%Y-%m-%d %H:%M:%S"),
        scenes=len(selection.scenes),
        images=sum(len(scene.images) for scene in selection.scenes),
        annotations=len(annotations),
        left_out=selection.images_left_out,
        instances_open=selection.instances_open,
        skipped=", ".join(f"{count} as {reason!r}" for reason, count in selection.instances_skipped)
        or "none",
        objects="\n".join(
            f"| {found.obj_id} | {found.name} | {counts[found.obj_id]} |" for found in selection.objects
        ),
        several=several_submissions(selection),
    )


def several_submissions(selection: Selection) -> str:
    """A table of the instances that more than one registration was submitted for."""
    rows = []
    for scene in selection.scenes:
        annotated = {
            id(annotation): (image.image_id, annotation)
            for image in reversed(scene.images)
            for annotation in image.annotations
        }
        rows += [
            f"| {scene.folder} | {image_id} | {found.obj_id} | {found.name} | {found.candidates} |"
            for image_id, found in sorted(annotated.values(), key=lambda pair: (pair[0], pair[1].obj_id))
            if found.candidates > 1
        ]
    if not rows:
        return "None: every annotation is the only one submitted."
    head = "| scene | first image | obj_id | object | submitted |\n|---|---|---|---|---|\n"
    return (
        "The newest is exported; one made in accurate mode goes before quick ones.\n\n"
        + head
        + "\n".join(rows)
    )
