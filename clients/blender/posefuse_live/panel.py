"""The sidebar's panel (N in the 3D view, tab Posefuse): start, stop, record, and what is going on."""
import traceback

import bpy

from .live import RATE_HZ, Stream

#: The stream of this Blender, while there is one.
stream: Stream | None = None
#: Why the last stream ended by itself; empty: it did not.
trouble = ""
#: Whether playback began the recording that is going on, so that its end ends it.
with_playback = False


class Settings(bpy.types.PropertyGroup):
    """What a user chooses; kept in the file."""

    port: bpy.props.IntProperty(
        name="Port", default=39539, min=1024, max=65535,
        description="The first person's UDP port, as set at the server; the others follow",
    )
    people: bpy.props.IntProperty(
        name="People", default=4, min=1, max=32, description="On how many ports to listen: one for each person",
    )
    remote: bpy.props.BoolProperty(
        name="From other computers", default=False,
        description="Also take what other computers send. Anybody in the network can then move your figures",
    )
    with_playback: bpy.props.BoolProperty(
        name="Record with playback", default=True,
        description="While Auto Keying is on, playing the scene records, and stopping it ends the recording",
    )


class POSEFUSE_OT_start(bpy.types.Operator):
    """Show the people of a Posefuse server as they move"""

    bl_idname, bl_label = "posefuse.start", "Start"

    @classmethod
    def poll(cls, context):
        return stream is None

    def execute(self, context):
        global stream, trouble
        settings = context.scene.posefuse
        trouble = ""
        host = "0.0.0.0" if settings.remote else "127.0.0.1"
        try:
            stream = Stream(host, settings.port, settings.people)
        except (OSError, OverflowError) as error:
            last = settings.port + settings.people - 1
            self.report({"ERROR"}, f"Cannot listen on the ports {settings.port} to {last} ({error}); another program may use one: choose another port here and at the server")
            return {"CANCELLED"}
        bpy.app.timers.register(_tick, persistent=True)
        return {"FINISHED"}


class POSEFUSE_OT_stop(bpy.types.Operator):
    """End the stream. Figures stay, with what was recorded"""

    bl_idname, bl_label = "posefuse.stop", "Stop"

    @classmethod
    def poll(cls, context):
        return stream is not None

    def execute(self, context):
        close()
        return {"FINISHED"}


class POSEFUSE_OT_record(bpy.types.Operator):
    """Begin or end a recording: each person's motion becomes an action with keys, from the current frame on"""

    bl_idname, bl_label = "posefuse.record", "Record"

    @classmethod
    def poll(cls, context):
        return stream is not None

    def execute(self, context):
        if stream.recorder is None:
            _start_recording(context.scene)
        else:
            count = stream.stop_recording()
            self.report({"INFO"}, f"{count} actions were made; they move the figures when the stream is stopped")
        return {"FINISHED"}


class POSEFUSE_PT_panel(bpy.types.Panel):
    """What a user sees"""

    bl_idname, bl_label, bl_category = "POSEFUSE_PT_panel", "Posefuse", "Posefuse"
    bl_space_type, bl_region_type = "VIEW_3D", "UI"

    def draw(self, context):
        layout, settings = self.layout, context.scene.posefuse
        column = layout.column()
        column.enabled = stream is None
        for name in ("port", "people", "remote"):
            column.prop(settings, name)
        layout.prop(settings, "with_playback")
        row = layout.row(align=True)
        row.operator("posefuse.start", icon="PLAY")
        row.operator("posefuse.stop", icon="PAUSE")
        recording = stream is not None and stream.recorder is not None
        layout.operator("posefuse.record", text="Stop recording" if recording else "Record", icon="REC", depress=recording)
        for words in status():
            layout.label(text=words)


def status(now_s: float | None = None) -> list[str]:
    """What is going on, in words."""
    if stream is None:
        return ["Stopped", trouble] if trouble else ["Stopped"]
    there = stream.present(now_s)
    lines = [f"{len(there)} {'person' if len(there) == 1 else 'people'}, {stream.packet_rate()} packets/s"]
    if stream.packets == 0:
        lines += ["Nothing comes: is VMC on at the server,", f"with this computer and port {stream.first_port} as its target?"]
    elif stream.waiting:
        lines.append("Somebody new is shown in Object Mode")
    elif not there:
        lines.append("Nobody is in the room")
    if stream.malformed or stream.people.ignored:
        lines.append(f"Not understood: {stream.malformed} packets, {stream.people.ignored} messages")
    if stream.recorder is not None:
        lines.append(f"Recording: {stream.recorder.count} poses")
    return lines


def close():
    """Ends the stream, if there is one."""
    global stream
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
    if stream is not None:
        stream.close()
        stream = None


def _start_recording(scene):
    global with_playback
    with_playback = False
    stream.start_recording(scene.frame_current, scene.render.fps / scene.render.fps_base)


def _tick():
    """Blender's timer; its answer is when to come again."""
    global trouble
    if stream is None:
        return None
    try:
        stream.step()
    except Exception as error:  # noqa: BLE001 Blender forgets a timer that raises, and the ports would stay taken.
        traceback.print_exc()
        trouble = f"by an error, see the console: {error}"
        close()
        return None
    # The panel's words change, too.
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()
    return 1 / RATE_HZ


@bpy.app.handlers.persistent
def _playback_begins(scene, *_):
    global with_playback
    if stream is not None and stream.recorder is None and scene.posefuse.with_playback and scene.tool_settings.use_keyframe_insert_auto:
        _start_recording(scene)
        with_playback = True


@bpy.app.handlers.persistent
def _playback_ends(scene, *_):
    global with_playback
    if stream is not None and stream.recorder is not None and with_playback:
        stream.stop_recording()
    with_playback = False


@bpy.app.handlers.persistent
def _file_changes(*_):
    # The figures of the stream are of the file that goes.
    close()


CLASSES = [Settings, POSEFUSE_OT_start, POSEFUSE_OT_stop, POSEFUSE_OT_record, POSEFUSE_PT_panel]
HANDLERS = [("animation_playback_pre", _playback_begins), ("animation_playback_post", _playback_ends), ("load_pre", _file_changes)]


def register():
    for one in CLASSES:
        bpy.utils.register_class(one)
    bpy.types.Scene.posefuse = bpy.props.PointerProperty(type=Settings)
    for name, handler in HANDLERS:
        getattr(bpy.app.handlers, name).append(handler)


def unregister():
    close()
    for name, handler in HANDLERS:
        handlers = getattr(bpy.app.handlers, name)
        if handler in handlers:
            handlers.remove(handler)
    del bpy.types.Scene.posefuse
    for one in reversed(CLASSES):
        bpy.utils.unregister_class(one)
