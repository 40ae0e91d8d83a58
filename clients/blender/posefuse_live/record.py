"""What moves, as keys: samples are gathered while it records, and become one action a person at the end."""
import bpy


class Recorder:
    """Gathers the poses of armatures and empties against time."""

    def __init__(self, begin_s: float, frame: float, rate_hz: float):
        self.begin_s, self.frame, self.rate_hz = begin_s, frame, rate_hz
        #: For each object's name and channel (data path, index) its frames and values, alternating as Blender takes them.
        self.samples: dict[str, dict[tuple, list]] = {}
        self.count = 0

    def sample(self, thing, now_s: float):
        """Takes in how an armature or an empty stands now."""
        frame = self.frame + (now_s - self.begin_s) * self.rate_hz
        channels = self.samples.setdefault(thing.name, {})
        self._vector(channels, "location", thing.location, frame)
        if thing.type == "ARMATURE":
            self._vector(channels, "rotation_quaternion", thing.rotation_quaternion, frame)
            for bone in thing.pose.bones:
                path = f'pose.bones["{bone.name}"]'
                self._vector(channels, f"{path}.rotation_quaternion", bone.rotation_quaternion, frame)
                self._vector(channels, f"{path}.location", bone.location, frame)
        self.count += 1

    def finish(self) -> dict[str, object]:
        """An action for each object that moved, by the object's name. They are kept with the file though nothing uses them yet."""
        actions = {}
        for name, channels in self.samples.items():
            action = bpy.data.actions.new(f"{name} take")
            action.use_fake_user = True
            curves = _curves(action, name)
            for (path, index), keys in channels.items():
                curve = curves.new(path, index=index)
                curve.keyframe_points.add(len(keys) // 2)
                curve.keyframe_points.foreach_set("co", keys)
                for point in curve.keyframe_points:
                    point.interpolation = "LINEAR"
                curve.update()
            actions[name] = action
        return actions

    @staticmethod
    def _vector(channels: dict, path: str, values, frame: float):
        """Neighbouring quaternions are kept on one side: q and -q are the same rotation, but not halfway between."""
        values = list(values)
        if len(values) == 4 and (path, 0) in channels:
            last = [channels[path, index][-1] for index in range(4)]
            if sum(old * new for old, new in zip(last, values)) < 0:
                values = [-value for value in values]
        for index, value in enumerate(values):
            channels.setdefault((path, index), []).extend((frame, value))


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
