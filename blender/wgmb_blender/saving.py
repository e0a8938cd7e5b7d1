"""Blurred files through Blender: its compositor, its colour management, its formats and films.

Copies of the scene do this, without objects, so that the scene itself is not touched.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import bpy

from .rendering import Render, at_once
from .sharp import FIVE
from .wgmb_worker.problem import ProblemError
from .wgmb_worker.recipe import Picture, View

_SOUND = {"SPEAKER"}  # objects that a film needs


def tree_of(scene: bpy.types.Scene) -> bpy.types.NodeTree:
    """The compositor's nodes."""
    return scene.compositing_node_group if FIVE else scene.node_tree


def new_tree(scene: bpy.types.Scene) -> bpy.types.NodeSocket:
    """Give a scene an empty compositor; returns the socket that takes the picture."""
    if FIVE:
        tree = bpy.data.node_groups.new("wgmb", "CompositorNodeTree")
        tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
        scene.compositing_node_group = tree
        return tree.nodes.new("NodeGroupOutput").inputs[0]
    scene.use_nodes = True
    scene.node_tree.nodes.clear()
    return scene.node_tree.nodes.new("CompositorNodeComposite").inputs[0]


class Desk:
    """A copy of a scene without objects, which renders what its compositor makes of files."""

    def __init__(self, scene: bpy.types.Scene, picture: Picture):
        self.scene = scene.copy()
        self.images: list[bpy.types.Image] = []
        self._tree = None
        held = self.scene.collection
        for child in list(held.children):
            held.children.unlink(child)
        for one in list(held.objects):
            held.objects.unlink(one)
        for one in scene.objects:
            if one.type in _SOUND:
                held.objects.link(one)
        self.scene.camera = scene.camera
        render = self.scene.render
        render.resolution_x, render.resolution_y = picture.result
        render.resolution_percentage = 100
        render.use_border = render.use_sequencer = render.use_single_layer = False
        render.use_compositing = True

    def own(self, tree: bpy.types.NodeTree) -> None:
        """Note a tree that goes when the desk does; those of 4.x go with their scene."""
        self._tree = tree if FIVE else None

    def load(self, path: Path) -> bpy.types.Image:
        """A file as an image that goes when the desk does."""
        image = bpy.data.images.load(str(path))
        self.images.append(image)
        return image

    def close(self) -> None:
        """Remove all that was made."""
        with contextlib.suppress(ReferenceError):
            # `scenes.remove` asks the context's window, and ends a `blender -c`, which has none.
            bpy.data.batch_remove([self.scene])
        for image in self.images:
            with contextlib.suppress(ReferenceError):
                bpy.data.images.remove(image)
        if self._tree is not None:
            bpy.data.node_groups.remove(self._tree)


def picture_of_files(
    desk: Desk, files: dict[View, Path], more: dict[str, Any] | None = None
) -> bpy.types.NodeSocket:
    """Nodes that show a file of each view; returns the socket that has the picture."""
    tree = tree_of(desk.scene)
    shown = []
    for path in files.values():
        node = tree.nodes.new("CompositorNodeImage")
        node.image = desk.load(path)
        for name, value in (more or {}).items():
            setattr(node, name, value)
        shown.append(node)
    return of_each_view(tree, list(files), [node.outputs[0] for node in shown])


def of_each_view(
    tree: bpy.types.NodeTree, views: Sequence[View], sockets: Sequence[bpy.types.NodeSocket]
) -> bpy.types.NodeSocket:
    """One socket that has what each of these has, in its view."""
    if len(sockets) == 1:
        return sockets[0]
    switch = tree.nodes.new("CompositorNodeSwitchView")
    for view, socket in zip(views, sockets, strict=True):
        if view.name not in switch.inputs:
            raise ProblemError(f"Blender's Switch View node has no view {view.name}")
        tree.links.new(socket, switch.inputs[view.name])
    return switch.outputs[0]


class Compositing:
    """The scene's compositor, with blurred files where it has view layers."""

    def __init__(self, scene: bpy.types.Scene, picture: Picture, views: Sequence[View]):
        self._views, self._scene, self._desk = views, scene, Desk(scene, picture)
        self._images: dict[View, bpy.types.Image] = {}
        image = self._desk.scene.render.image_settings
        if FIVE:
            image.media_type = "IMAGE"
            self._desk.scene.compositing_node_group = tree_of(scene).copy()
            self._desk.own(tree_of(self._desk.scene))
        image.file_format, image.color_depth = "OPEN_EXR", "32"
        image.color_mode, image.exr_codec, image.views_format = "RGBA", "ZIP", "INDIVIDUAL"
        render = self._desk.scene.render
        render.use_file_extension, render.use_stamp = True, False

    def __call__(self, number: int, files: Sequence[Path]) -> Iterator[None]:
        """Composite a frame: its files, of each view, become the composites."""
        for view, path in zip(self._views, files, strict=True):
            if view in self._images:
                self._images[view].filepath = str(path)
                self._images[view].reload()
            else:
                self._images[view] = self._desk.load(path)
        if len(self._images) == len(self._views) and not self._is_ready:
            self._replace()
        self._desk.scene.render.filepath = str(files[0].with_name(f"composite_{number:06d}"))
        yield from at_once(self._desk.scene, number, self.composites(number, files))

    _is_ready = False

    def composites(self, number: int, files: Sequence[Path]) -> list[Path]:
        """The files of a composited frame."""
        return [
            path.with_name(f"composite_{number:06d}{view.suffix}.exr")
            for view, path in zip(self._views, files, strict=True)
        ]

    def close(self) -> None:
        """Remove all that was made."""
        self._desk.close()

    def _replace(self) -> None:
        """Put the files in the place of the scene's view layers."""
        tree = tree_of(self._desk.scene)
        own = (None, self._scene, self._desk.scene)
        for node in [n for n in tree.nodes if n.type == "R_LAYERS" and n.scene in own]:
            self._replace_one(tree, node)
        self._is_ready = True

    def _replace_one(self, tree: bpy.types.NodeTree, node: bpy.types.Node) -> None:
        shown = []
        for image in self._images.values():
            one = tree.nodes.new("CompositorNodeImage")
            one.image = image
            if one.has_layers:
                one.layer = node.layer
            shown.append(one)
        for socket in [s for s in node.outputs if s.is_linked]:
            found = [_same(one, socket) for one in shown]
            source = of_each_view(tree, self._views, found)
            for link in list(socket.links):
                tree.links.new(source, link.to_socket)
        tree.nodes.remove(node)


def _same(node: bpy.types.Node, wanted: bpy.types.NodeSocket) -> bpy.types.NodeSocket:
    """The socket of an image that has what one of a view layer has."""
    names = (wanted.name, "Combined") if wanted.name == "Image" else (wanted.name,)
    for name in names:
        if name in node.outputs:
            return node.outputs[name]
    there = ", ".join(socket.name for socket in node.outputs)
    raise ProblemError(f"The compositor uses {wanted.name}, which the frames lack ({there})")


class Saving:
    """Pictures to the scene's output: a file each, or a film at the end."""

    def __init__(
        self, scene: bpy.types.Scene, picture: Picture, views: Sequence[View], numbers: list[int]
    ):
        self._scene, self._picture, self._views = scene, picture, views
        self.numbers = numbers
        self.is_film = scene.render.is_movie_format
        self.files: list[Path] = []
        self._desk: Desk | None = None
        self._images: dict[View, bpy.types.Image] = {}

    def paths(self, number: int) -> list[Path]:
        """The files of a frame as Blender names them."""
        return paths_of(self._scene, self._views, number)

    def picture(self, number: int, files: Sequence[Path]) -> Iterator[None]:
        """Save a frame as the picture that the scene's settings ask for."""
        if self._desk is None:
            self._desk = Desk(self._scene, self._picture)
            end = new_tree(self._desk.scene)
            self._desk.own(tree_of(self._desk.scene))
            given = dict(zip(self._views, files, strict=True))
            tree_of(self._desk.scene).links.new(picture_of_files(self._desk, given), end)
        else:
            for image, path in zip(self._desk.images, files, strict=True):
                image.filepath = str(path)
                image.reload()
        render = self._desk.scene.render
        whole = self._scene.render.frame_path(frame=number)
        ending = render.file_extension if render.use_file_extension else ""
        render.filepath = whole.removesuffix(ending)
        written = self.paths(number)
        for path in written:
            path.parent.mkdir(parents=True, exist_ok=True)
        yield from at_once(self._desk.scene, number, written)
        self.files += written

    def film(self, files: Sequence[Sequence[Path]], render: Render) -> Iterator[None]:
        """Make the film of all frames: the files of each of its views, in their order."""
        first, count = self.numbers[0], len(files)
        desk = self._desk = Desk(self._scene, self._picture)
        scene = desk.scene
        scene.frame_start, scene.frame_end, scene.frame_step = first, first + count - 1, 1
        end = new_tree(scene)
        desk.own(tree_of(scene))
        nodes = []
        for i in range(len(self._views)):
            node = tree_of(scene).nodes.new("CompositorNodeImage")
            node.image = desk.load(files[0][i])
            node.image.source = "SEQUENCE"
            node.frame_start, node.frame_duration, node.frame_offset = first, count, 0
            node.use_auto_refresh = True
            nodes.append(node.outputs[0])
        tree_of(scene).links.new(of_each_view(tree_of(scene), self._views, nodes), end)
        path = Path(scene.render.frame_path(frame=first))
        path.parent.mkdir(parents=True, exist_ok=True)
        yield from render(scene, first, [])
        if not path.is_file():
            raise ProblemError(f"Blender did not write {path}")
        self.files.append(path)

    def close(self) -> None:
        """Remove all that was made for it in Blender."""
        if self._desk is not None:
            self._desk.close()
            self._desk = None


def paths_of(scene: bpy.types.Scene, views: Sequence[View], number: int) -> list[Path]:
    """The files that Blender would write for a frame."""
    render = scene.render
    apart = render.use_multiview and render.image_settings.views_format == "INDIVIDUAL"
    if not apart:
        return [Path(render.frame_path(frame=number))]
    return [Path(render.frame_path(frame=number, view=view.name)) for view in views]
