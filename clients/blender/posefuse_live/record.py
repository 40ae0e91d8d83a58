"""What moves, as keys: samples are gathered while it records, and become one action a person at the end."""
from array import array

import bpy

#: What Blender calls straight lines between keys, as a number: names can only be set key by key.
LINEAR = bpy.types.Keyframe.bl_rna.properties["interpolation"].enum_items["LINEAR"].value


class Samples:
    """How one object stood: the frames, and for each channel (data path, index) its value at each of them."""

    def __init__(self):
        self.frames = array("f")
        self.channels: dict[tuple, array] = {}

    def add(self, path: str, values):
        """Neighbouring quaternions are kept on one side: q and -q are the same rotation, but not halfway between."""
        values = list(values)
        if len(values) == 4 and (path, 0) in self.channels:
            last = [self.channels[path, index][-1] for index in range(4)]
            if sum(old * new for old, new in zip(last, values)) < 0:
                values = [-value for value in values]
        for index, value in enumerate(values):
            self.channels.setdefault((path, index), array("f")).append(value)


class Recorder:
    """Gathers the poses of armatures and empties against time: about 0.6 kB a person and sample."""

    def __init__(self, begin_s: float, frame: float, rate_hz: float):
        self.begin_s, self.frame, self.rate_hz = begin_s, frame, rate_hz
        #: By the object's name.
        self.samples: dict[str, Samples] = {}
        self.count = 0

    def sample(self, thing, now_s: float):
        """Takes in how an armature or an empty stands now."""
        samples = self.samples.setdefault(thing.name, Samples())
        samples.frames.append(self.frame + (now_s - self.begin_s) * self.rate_hz)
        samples.add("location", thing.location)
        if thing.type == "ARMATURE":
            samples.add("rotation_quaternion", thing.rotation_quaternion)
            for bone in thing.pose.bones:
                path = f'pose.bones["{bone.name}"]'
                samples.add(f"{path}.rotation_quaternion", bone.rotation_quaternion)
                samples.add(f"{path}.location", bone.location)
        self.count += 1

    def finish(self) -> dict[str, object]:
        """An action for each object that moved, by the object's name. They are kept with the file though nothing uses them yet."""
        actions = {}
        for name, samples in self.samples.items():
            action = bpy.data.actions.new(f"{name} take")
            action.use_fake_user = True
            curves = _curves(action, name)
            many = len(samples.frames)
            for (path, index), values in samples.channels.items():
                if len(values) != many:
                    # A bone that its user took away, or added, halfway.
                    continue
                keys = array("f", bytes(8 * many))
                keys[0::2], keys[1::2] = samples.frames, values
                curve = curves.new(path, index=index)
                curve.keyframe_points.add(many)
                curve.keyframe_points.foreach_set("co", keys)
                curve.keyframe_points.foreach_set("interpolation", array("i", [LINEAR]) * many)
                curve.update()
            actions[name] = action
        return actions


def assign(thing, action):
    """Lets an action move an object from now on."""
    thing.animation_data_create()
    thing.animation_data.action = action
    slots = getattr(action, "slots", None)
    if slots and thing.animation_data.action_slot is None:
        thing.animation_data.action_slot = slots[0]


def release(thing):
    """Lets no action move an object: it is moved live."""
    if thing.animation_data is not None and thing.animation_data.action is not None:
        thing.animation_data.action = None


def _curves(action, name: str):
    """Where an action's curves go: Blender 5 has them in a slot of a layer."""
    if hasattr(action, "fcurves"):
        return action.fcurves
    slot = action.slots.new(id_type="OBJECT", name=name)
    strip = action.layers.new("Layer").strips.new(type="KEYFRAME")
    return strip.channelbag(slot, ensure=True).fcurves
