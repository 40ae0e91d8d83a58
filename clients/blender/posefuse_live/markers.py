"""A person of plain OSC as a bundle of empties, one a joint."""
import bpy
from mathutils import Vector

from .figure import MARK, lives
from .people import GONE_S, Joints


def place(room: tuple) -> Vector:
    """A place of the room (X forward, Y left, Z up) where Blender's front view sees who looks ahead: -Y forward, X left, Z up."""
    return Vector((room[1], -room[0], room[2]))


class Markers:
    """The empties of one person."""

    def __init__(self, name: str, collection):
        self.collection = collection
        self.person = self._empty(name, 0.2, "PLAIN_AXES")
        self.joints = {}
        self.news = -1

    def pose(self, person: Joints, now_s: float):
        """Moves the empties to where the joints are now; those that were not heard of for a while vanish."""
        gone = [joint for joint, empty in self.joints.items() if not lives(empty)]
        for joint in gone:
            # Its user took it out of the file: it is made anew.
            del self.joints[joint]
            self.news = -1
        for joint, heard_s in person.heard.items():
            if joint in self.joints:
                _hide(self.joints[joint], now_s - heard_s > GONE_S)
        if person.news == self.news:
            return
        self.news = person.news
        for joint, at in person.places.items():
            if joint not in self.joints:
                empty = self._empty(f"{self.person.name} {joint}", 0.03, "SPHERE")
                empty.parent = self.person
                self.joints[joint] = empty
            self.joints[joint].location = place(at)

    def show(self, visible: bool):
        """Shows or hides all."""
        for empty in filter(lives, (self.person, *self.joints.values())):
            if not visible:
                _hide(empty, True)
        if visible:
            _hide(self.person, False)

    def remove(self):
        """Takes them out of the file."""
        for empty in filter(lives, (*self.joints.values(), self.person)):
            bpy.data.objects.remove(empty)

    def _empty(self, name: str, size: float, shape: str):
        empty = bpy.data.objects.new(name, None)
        empty.empty_display_size, empty.empty_display_type = size, shape
        empty[MARK] = True
        self.collection.objects.link(empty)
        return empty


def _hide(thing, hidden: bool):
    if thing.hide_viewport != hidden:
        thing.hide_viewport = hidden
