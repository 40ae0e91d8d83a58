"""A body of the VMC protocol as an armature that moves.

Unity's axes (X right, Y up, Z forward, left-handed) become Blender's of a figure that the front view sees (-Y forward, X left,
Z up). In the rest pose, the T-pose, no bone of the sender is turned; Blender's bones have axes of their own there (Y along the
bone), so each rotation is taken over to them.
"""
import bpy
from mathutils import Matrix, Quaternion, Vector

from .people import Body

#: What shows who nobody else's objects are.
MARK = "posefuse_live"
#: Where the bones that carry nothing point, Blender's axes, and how long they are drawn, metres.
ENDS = {"Head": ((0, 0, 1), 0.2), "Hand": (None, 0.1), "Toes": ((0, -1, 0), 0.06), "Foot": ((0, -1, 0), 0.15), "Distal": (None, 0.02)}
#: The bone that a bone points to, where it carries several.
ALONG = {"Hips": "Spine", "Chest": "Neck", "UpperChest": "Neck", "Spine": "Chest", "LeftHand": "LeftMiddleProximal", "RightHand": "RightMiddleProximal"}
#: Offsets that differ by less need no other figure, metres.
SAME_M = 1e-4


def place(unity: tuple) -> Vector:
    """A place or an offset in Blender's axes."""
    return Vector((-unity[0], -unity[2], unity[1]))


def turn(unity: tuple) -> Quaternion:
    """A rotation in Blender's axes; mirrored axes turn the other way."""
    x, y, z, w = unity
    return Quaternion((w, x, z, -y))


class Figure:
    """The armature of one person, from the first whole body on. It can be made in Object Mode only."""

    def __init__(self, name: str, body: Body, collection):
        self.bones = self._in_order(body)
        #: From the parent's origin to the bone's own in the rest pose; the hips stand over the origin, the feet on the floor.
        self.offsets = {bone: place(body.bones[bone][0]) for bone in self.bones}
        self.offsets["Hips"] = Vector((0, 0, self._leg(body)))
        self.armature = self._build(name, body, collection)
        #: For each bone its axes in the rest pose, against the armature's.
        self.rest = {bone.name: bone.matrix_local.to_quaternion() for bone in self.armature.data.bones}
        self.news = -1
        for bone in self.armature.pose.bones:
            bone.rotation_mode = "QUATERNION"
        self.armature.rotation_mode = "QUATERNION"

    def fits(self, body: Body) -> bool:
        """Whether the armature has all bones that have come. Those that have not stay as they are: packets get lost."""
        return body.bones.keys() <= set(self.bones)

    def pose(self, body: Body):
        """Moves the armature as the body stands now."""
        if body.news == self.news:
            return
        self.news = body.news
        position, rotation = body.root
        self.armature.location, self.armature.rotation_quaternion = place(position), turn(rotation)
        for name, (position, rotation) in body.bones.items():
            rest, bone = self.rest[name], self.armature.pose.bones.get(name)
            if bone is None:
                # Its user took it out of the armature.
                continue
            bone.rotation_quaternion = rest.inverted() @ turn(rotation) @ rest
            off = place(position) - self.offsets[name]
            # Measures that were learned anew come in as they are; the armature need not be another.
            bone.location = rest.inverted() @ off if name == "Hips" or off.length > SAME_M else Vector()

    def show(self, visible: bool):
        """Shows or hides it."""
        if self.armature.hide_viewport == visible:
            self.armature.hide_viewport = self.armature.hide_render = not visible

    @staticmethod
    def _leg(body: Body) -> float:
        """How far below the hips the body ends in the rest pose."""
        below = 0.0
        for bone in ("LeftUpperLeg", "LeftLowerLeg", "LeftFoot", "LeftToes"):
            below -= place(body.bones[bone][0]).z if bone in body.bones else 0.0
        return below

    @staticmethod
    def _in_order(body: Body) -> list[str]:
        """The bones, parents before children."""
        order = []
        todo = [bone for bone in body.bones if body.parent(bone) is None]
        while todo:
            bone = todo.pop(0)
            order.append(bone)
            todo += [child for child in body.bones if body.parent(child) == bone]
        return order

    def _build(self, name: str, body: Body, collection):
        data = bpy.data.armatures.new(name)
        data.display_type = "OCTAHEDRAL"
        armature = bpy.data.objects.new(name, data)
        armature[MARK] = True
        armature.show_in_front = True
        collection.objects.link(armature)
        layer = bpy.context.view_layer
        before = layer.objects.active
        layer.objects.active = armature
        bpy.ops.object.mode_set(mode="EDIT")
        try:
            self._bones(data.edit_bones, body)
        finally:
            bpy.ops.object.mode_set(mode="OBJECT")
            layer.objects.active = before or armature
        return armature

    def _bones(self, edit_bones, body: Body):
        heads, children = {}, {}
        for name in self.bones:
            parent = body.parent(name)
            heads[name] = heads.get(parent, Vector()) + self.offsets[name]
            children.setdefault(parent, []).append(name)
        for name in self.bones:
            bone = edit_bones.new(name)
            parent = body.parent(name)
            bone.parent = edit_bones[parent] if parent else None
            bone.head = heads[name]
            bone.tail = heads[name] + self._along(name, parent, heads, children.get(name, []))
            # Their Z looks ahead, where it can.
            bone.align_roll(Vector((0, -1, 0)))
            bone.use_connect = False

    @staticmethod
    def _along(name: str, parent: str | None, heads: dict, children: list[str]) -> Vector:
        """From where a bone begins to where it is drawn to end: bones of no length vanish from an armature."""
        to = next((child for child in [ALONG.get(name), *children] if child in children), None)
        if to and (heads[to] - heads[name]).length > 1e-3:
            return heads[to] - heads[name]
        way, length = next((end for part, end in ENDS.items() if name.endswith(part)), (None, 0.05))
        if way is not None:
            return Vector(way) * length
        onwards = heads[name] - heads[parent] if parent else Vector((0, 0, 1))
        return (onwards.normalized() if onwards.length > 1e-3 else Vector((0, 0, 1))) * length


def remove(armature):
    """Takes an armature and its data out of the file."""
    data = armature.data
    bpy.data.objects.remove(armature)
    if data.users == 0:
        bpy.data.armatures.remove(data)


def world(armature, bone: str) -> Matrix:
    """A bone's axes and place in the scene."""
    return armature.matrix_world @ armature.pose.bones[bone].matrix


def lives(thing) -> bool:
    """Whether an object is still in the file."""
    try:
        return thing.name in bpy.data.objects
    except ReferenceError:
        return False
