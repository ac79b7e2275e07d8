"""The mesh in its own colours: the same picture at the same places, or what fits a page."""

import io

import numpy as np
import pytest
import trimesh
from PIL import Image
from trimesh.visual.texture import SimpleMaterial, TextureVisuals

from app.datasets.outline_mesh import MOST_FACES
from app.datasets.textured_mesh import MOST_PIXELS, as_glb, packed, textured_mesh
from registration_core import ObjectModel
from registration_core.geometry.mesh_file import plain_ply

RED, BLUE = (255, 0, 0), (0, 0, 255)


def ring(sections: int = 40) -> trimesh.Trimesh:
    """A torus of millimetres, red where z is positive, blue below."""
    mesh = trimesh.creation.torus(80.0, 30.0, major_sections=sections, minor_sections=sections)
    mesh.visual.vertex_colors = np.where(mesh.vertices[:, 2:] > 0.0, [*RED, 255], [*BLUE, 255])
    return mesh


def red_over_blue(side: int) -> Image.Image:
    picture = np.full((side, side, 3), BLUE, dtype=np.uint8)
    picture[: side // 2] = RED
    return Image.fromarray(picture)


def with_texture(mesh: trimesh.Trimesh, picture: Image.Image) -> tuple[bytes, bytes]:
    """The file of the mesh, as high in the picture as in space, and that of the picture."""
    low, high = mesh.bounds[:, 2]
    uv = np.column_stack([np.full(len(mesh.vertices), 0.5), (mesh.vertices[:, 2] - low) / (high - low)])
    mesh.visual = TextureVisuals(uv=uv, material=SimpleMaterial(image=picture))
    stream = io.BytesIO()
    picture.save(stream, format="PNG")
    return plain_ply(mesh, "skin.png"), stream.getvalue()


def shown(content: bytes, texture: bytes | None = None) -> trimesh.Trimesh | None:
    """What a page gets, as it reads it."""
    model = ObjectModel.from_bytes(content, "ply", "mm")
    mesh = textured_mesh(content, "ply", texture, model)
    if mesh is None:
        return None
    assert np.allclose(mesh.bounds, [model.vertices.min(axis=0), model.vertices.max(axis=0)], atol=2e-3)
    scene = trimesh.load_scene(io.BytesIO(as_glb(mesh, np.zeros(3))), file_type="glb")
    (received,) = scene.geometry.values()
    assert received.visual.material.metallicFactor == 0.0
    return received


def unpacked(content: bytes) -> tuple[trimesh.Trimesh, bytes]:
    """What a page makes of the bytes: the mesh with its colours or places in the picture, and the picture."""
    count, faces, size = np.frombuffer(content, "<u4", 3)
    parts, start = [], 12
    for kind, shape in (
        ("<f4", (count, 3)),
        ("<u4", (faces, 3)),
        ("<f4", (count, 2)) if size else ("u1", (count, 4)),
    ):
        part = np.frombuffer(content, kind, int(np.prod(shape)), start).reshape(shape)
        parts.append(part)
        start += part.nbytes
    assert len(content) == start + size
    mesh = trimesh.Trimesh(parts[0], parts[1], process=False)
    if size:
        mesh.vertex_attributes["place"] = parts[2]
    else:
        mesh.visual.vertex_colors = parts[2]
    return mesh, content[start:]


def is_red(mesh: trimesh.Trimesh, colors: np.ndarray) -> None:
    """Checks the colours (V, 4) of its vertices, but at the rim between the two."""
    clear = np.abs(mesh.vertices[:, 2]) > 0.005
    wanted = np.where(mesh.vertices[clear, 2:] > 0.0, RED, BLUE)
    assert clear.sum() > 100
    assert np.array_equal(colors[clear, :3], wanted)


def test_a_mesh_without_colours_has_none_to_show() -> None:
    assert shown(plain_ply(trimesh.creation.box((10.0, 20.0, 30.0)))) is None


def test_a_texture_that_is_not_at_hand_is_gone_without() -> None:
    content, _ = with_texture(ring(), red_over_blue(64))
    assert shown(content) is None


def test_vertex_colours_arrive() -> None:
    mesh = shown(plain_ply(ring()))
    assert mesh is not None
    is_red(mesh, mesh.visual.vertex_attributes["color"])


@pytest.mark.parametrize("side", [64, 2 * MOST_PIXELS])
def test_a_texture_arrives_the_right_way_up_and_not_too_large(side: int) -> None:
    mesh = shown(*with_texture(ring(), red_over_blue(side)))
    assert mesh is not None
    assert mesh.visual.material.baseColorTexture.size == (min(side, MOST_PIXELS),) * 2
    is_red(mesh, mesh.visual.to_color().vertex_colors)


def test_colours_of_vertices_become_amounts_of_light_in_gltf_alone() -> None:
    grey = ring()
    grey.visual.vertex_colors = [188, 10, 255, 255]  # 50 % and 0.3 % of the light that 255 stands for
    content = plain_ply(grey)
    mesh = textured_mesh(content, "ply", None, ObjectModel.from_bytes(content, "ply", "mm"))
    assert mesh is not None
    (seen,) = trimesh.load_scene(io.BytesIO(as_glb(mesh, np.zeros(3))), file_type="glb").geometry.values()
    assert np.unique(seen.visual.vertex_attributes["color"], axis=0).tolist() == [[128, 1, 255, 255]]
    assert unpacked(packed(mesh))[0].visual.vertex_colors[0].tolist() == [188, 10, 255, 255]


def test_vertex_colours_are_packed_for_a_page() -> None:
    content = plain_ply(ring())
    packed_ring = textured_mesh(content, "ply", None, ObjectModel.from_bytes(content, "ply", "mm"))
    assert packed_ring is not None
    mesh, picture = unpacked(packed(packed_ring))
    assert picture == b""
    is_red(mesh, mesh.visual.vertex_colors)


def test_a_texture_is_packed_with_places_from_the_upper_edge_on() -> None:
    content, texture = with_texture(ring(), red_over_blue(64))
    packed_ring = textured_mesh(content, "ply", texture, ObjectModel.from_bytes(content, "ply", "mm"))
    assert packed_ring is not None
    mesh, content = unpacked(packed(packed_ring))
    picture = np.asarray(Image.open(io.BytesIO(content)))
    rows = np.clip((mesh.vertex_attributes["place"][:, 1] * 64).astype(int), 0, 63)
    is_red(mesh, picture[rows, 32])


@pytest.mark.parametrize("picture", [None, red_over_blue(64)], ids=["vertex colours", "texture"])
def test_a_dense_mesh_keeps_its_colours_in_few_faces(picture: Image.Image | None) -> None:
    dense = ring(sections=160)
    assert len(dense.faces) > MOST_FACES
    mesh = shown(plain_ply(dense)) if picture is None else shown(*with_texture(dense, picture))
    assert mesh is not None and len(mesh.faces) <= MOST_FACES
    is_red(mesh, mesh.visual.vertex_attributes["color"])
