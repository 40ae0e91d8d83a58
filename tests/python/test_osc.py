"""Skeletons sent by python-osc to `posefuse agent osc`, seen in the room where they were sent from."""
import itertools
import threading
import time

import pytest
from conftest import free_port
from pythonosc.osc_bundle_builder import OscBundleBuilder
from pythonosc.osc_message_builder import OscMessageBuilder
from pythonosc.udp_client import SimpleUDPClient


def message(address, *values):
    built = OscMessageBuilder(address)
    for value in values:
        built.add_arg(value)
    return built.build()


def send(ports, over):
    """Somebody's head and left foot, thirty times a second, by both layouts."""
    stage, ours = (SimpleUDPClient("127.0.0.1", port) for port in ports)
    for number in itertools.count(1):
        if over.is_set():
            return
        sway = 0.001 * (number % 5)
        # 0.3 m to the right in the picture, 0.6 m up, 2.5 m away; OSCeleton mirrors and scales.
        stage.send_message("/joint", ["head", 4, (1280 + 300 + 1000 * sway) / 2560, (960 - 600) / 1920, 2500 / 1280])
        stage.send_message("/joint", ["l_foot", 4, (1280 + 400) / 2560, (960 + 900) / 1920, 2500 / 1280])
        bundle = OscBundleBuilder(1000.0 + number)
        bundle.add_content(message("/skel/9/Head/pos", 0.3 + sway, -0.6, 2.5, 0.5))
        bundle.add_content(message("/skel/9/AnkleLeft/pos", 0.4, 0.9, 2.5))
        ours.send(bundle.build())
        ours.send_message("/tempo", 120)
        time.sleep(1 / 30)


def test_osceleton_by_the_frame_and_ours_by_the_bundle(room):
    import posefuse

    ports = free_port(), free_port()
    room.start("stage", "agent", "osc", "--name", "stage", "--port", ports[0], "--layout", "osceleton", "--server", room.url)
    room.start("ours", "agent", "osc", "--name", "ours", "--port", ports[1], "--server", room.url)
    room.wait_for(lambda: len(room.status().sensors) == 2, "both agents")
    over = threading.Event()
    sender = threading.Thread(target=send, args=(ports, over), daemon=True)
    sender.start()
    with posefuse.Room(room.address) as reader:
        found = {name: next(frame.bodies for frame in reader.watch_sensors(name, seconds=15) if frame.bodies) for name in ("stage", "ours")}
    over.set()
    sender.join()
    for name, identity in (("stage", 4), ("ours", 9)):
        body = found[name][identity]
        assert set(body) == {"Head", "AnkleLeft"}
        assert body["Head"][:3] == pytest.approx((0.3, -0.6, 2.5), abs=6e-3)
        assert body["AnkleLeft"][:3] == pytest.approx((0.4, 0.9, 2.5), abs=1e-3)
    assert found["ours"][9]["Head"].confidence == 0.5
    assert {sensor.info.model for sensor in room.status().sensors} == {"OSC (osceleton)", "OSC (posefuse)"}
