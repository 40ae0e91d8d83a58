"""Posefuse in Blender: the people of a room, live, as armatures that move and can be recorded.

Needs nothing but Blender (4.2 or newer): the server sends VMC, or plain OSC, over UDP.
"""
from . import panel

bl_info = {
    "name": "Posefuse live",
    "author": "Posefuse",
    "version": (0, 1, 0),
    "blender": (4, 2, 0),
    "location": "3D View > Sidebar > Posefuse",
    "description": "Shows and records the people of a Posefuse room as they move",
    "category": "Animation",
}


def register():
    panel.register()


def unregister():
    panel.unregister()
