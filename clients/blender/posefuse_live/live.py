"""The stream: sockets that are read between Blender's own work, and the scene that follows them.

Everything runs in Blender's main thread, from a timer: `step` takes what has come since, moves who is there, hides who has
left, and never waits.
"""
import socket
import time

import bpy

from . import osc
from .figure import MARK, Figure, lives, remove
from .markers import Markers
from .people import People
from .record import Recorder, assign, release

#: Times a second that the scene is moved.
RATE_HZ = 60
#: The most packets of one step: what is left waits in the system's buffer for the next.
MOST_PACKETS = 2000
COLLECTION = "Posefuse live"


class Stream:
    """One connection of Blender to a server."""

    def __init__(self, host: str, port: int, people: int):
        """Listens on `people` ports from `port` on. Raises OSError where one of them is taken or not allowed."""
        self.people, self.sockets = People(), {}
        self.first_port = port
        self.figures: dict[int, Figure] = {}
        self.markers: dict[str, Markers] = {}
        #: Somebody cannot be shown, because Blender is in another mode than Object Mode.
        self.waiting = False
        self.recorder: Recorder | None = None
        #: What was recorded, by the object's name: the newest take of each.
        self.actions: dict[str, object] = {}
        self.packets = self.malformed = 0
        self.packet_times: list[float] = []
        try:
            for number in range(port, port + people):
                self.sockets[number] = _listen(host, number)
        except OSError:
            self.close()
            raise

    def step(self, now_s: float | None = None):
        """Takes in what has come, and moves the scene."""
        now_s = time.monotonic() if now_s is None else now_s
        self.waiting = False
        for port, listening in self.sockets.items():
            self._read(port, listening, now_s)
        for port, body in self.people.bodies.items():
            self._follow_body(port, body, now_s)
        for who, person in self.people.skeletons.items():
            self._follow_joints(who, person, now_s)
        self.packet_times = [at for at in self.packet_times if now_s - at < 1.0]

    def present(self, now_s: float | None = None) -> list[str]:
        """The names of the objects of those who are there."""
        now_s = time.monotonic() if now_s is None else now_s
        bodies = [(self.figures[port].armature, body) for port, body in self.people.bodies.items() if port in self.figures]
        skeletons = [(self.markers[who].person, person) for who, person in self.people.skeletons.items() if who in self.markers]
        return [thing.name for thing, person in bodies + skeletons if lives(thing) and not self.people.gone(person, now_s)]

    def packet_rate(self) -> int:
        """Packets of the last second."""
        return len(self.packet_times)

    def start_recording(self, frame: float, rate_hz: float, now_s: float | None = None):
        """Gathers keys from now on; they begin at this frame."""
        self.recorder = Recorder(time.monotonic() if now_s is None else now_s, frame, rate_hz)

    def stop_recording(self) -> int:
        """Makes actions of what was gathered; gives how many. They move the figures once the stream has ended."""
        recorder, self.recorder = self.recorder, None
        actions = recorder.finish() if recorder else {}
        self.actions |= actions
        return len(actions)

    def close(self):
        """Ends the stream. Who was shown stays, moved by what was recorded last."""
        if self.recorder is not None:
            self.stop_recording()
        for listening in self.sockets.values():
            listening.close()
        self.sockets = {}
        for name, action in self.actions.items():
            if (thing := bpy.data.objects.get(name)) is not None:
                assign(thing, action)
                thing.hide_viewport = thing.hide_render = False

    def _read(self, port: int, listening: socket.socket, now_s: float):
        for _ in range(MOST_PACKETS):
            try:
                packet = listening.recv(65536)
            except BlockingIOError:
                return
            except OSError:
                # Windows tells a UDP reader of errors of packets that it sent; there is nothing to do about them.
                continue
            self.packets += 1
            self.packet_times.append(now_s)
            try:
                messages = osc.messages(packet)
            except osc.Malformed:
                self.malformed += 1
                continue
            for address, arguments in messages:
                self.people.hear(port, address, arguments, now_s)

    def _follow_body(self, port: int, body, now_s: float):
        figure = self.figures.get(port)
        if figure is not None and not lives(figure.armature):
            # Its user has deleted it: it is made anew when its person moves again.
            del self.figures[port]
            figure = None
        if self.people.gone(body, now_s):
            if figure is not None:
                figure.show(False)
            # Who comes next on this port may be somebody else.
            body.bones, body.rounds = {}, 0
            return
        if not body.is_whole():
            return
        if figure is None or not figure.fits(body):
            if bpy.context.mode != "OBJECT":
                # Making an armature would end what its user is at.
                self.waiting = True
                return
            figure = self._figure(port, body)
        figure.show(True)
        release(figure.armature)
        figure.pose(body)
        if self.recorder is not None:
            self.recorder.sample(figure.armature, now_s)

    def _figure(self, port: int, body) -> Figure:
        old = self.figures.pop(port, None)
        if old is not None:
            remove(old.armature)
        name = f"Posefuse person {port - self.first_port + 1}"
        left = bpy.data.objects.get(name)
        if left is not None and MARK in left and left.type == "ARMATURE":
            # Of an earlier stream.
            remove(left)
        self.figures[port] = Figure(name, body, _collection())
        return self.figures[port]

    def _follow_joints(self, who: str, person, now_s: float):
        markers = self.markers.get(who)
        if markers is not None and not lives(markers.person):
            del self.markers[who]
            markers = None
        if self.people.gone(person, now_s):
            if markers is not None:
                markers.show(False)
            return
        if markers is None:
            markers = self.markers[who] = Markers(f"Posefuse skeleton {who}", _collection())
        markers.show(True)
        markers.pose(person, now_s)
        if self.recorder is not None:
            for empty in markers.joints.values():
                self.recorder.sample(empty, now_s)


def _listen(host: str, port: int) -> socket.socket:
    listening = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
        listening.bind((host, port))
        listening.setblocking(False)
    except OSError:
        listening.close()
        raise
    return listening


def _collection():
    """The collection that everybody goes to; made where it is missing."""
    collection = bpy.data.collections.get(COLLECTION)
    if collection is None:
        collection = bpy.data.collections.new(COLLECTION)
    if collection.name not in bpy.context.scene.collection.children:
        bpy.context.scene.collection.children.link(collection)
    return collection
