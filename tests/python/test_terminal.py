"""`posefuse calibrate` at a terminal: one is asked before a calibration is put in force."""
import os
import pty
import re
import select
import time

from conftest import POSEFUSE


def at_a_terminal(arguments, answers, seconds=90):
    """Runs it on a pseudo-terminal, answers each question; gives exit code and what was on the screen."""
    process, terminal = pty.fork()
    if process == 0:
        os.execv(POSEFUSE, [POSEFUSE, *arguments])
    screen, asked, deadline = b"", 0, time.monotonic() + seconds
    while time.monotonic() < deadline:
        if not select.select([terminal], [], [], 1)[0]:
            continue
        try:
            read = os.read(terminal, 65536)
        except OSError:
            break
        if not read:
            break
        screen += read
        if screen.count(b"eep the old one:") > asked:
            os.write(terminal, answers[asked].encode() + b"\r")
            asked += 1
    code = os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])
    text = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", screen.decode(errors="replace"))
    assert asked == len(answers), text
    return code, text


def test_a_calibration_is_put_in_force_only_by_a_yes(room):
    epoch = str(time.time_ns())
    for number, name in enumerate(["left", "right"], 1):
        room.start(name, "agent", "sim", "--name", name, "--sensor", number, "--sensors", 2, "--layout", "arc",
                   "--epoch-ns", epoch, "--server", room.url)
    room.wait_for(lambda: sum(s.frames_received > 30 for s in room.status().sensors) == 2, "both sensors")

    short = ["calibrate", "--seconds", "2", "--server", room.url]
    code, screen = at_a_terminal(short, ["what?", "r", "k"])
    assert code == 1 and "calibration failed" in screen and "as it was" in screen, screen
    assert not room.status().HasField("calibration")

    long = ["calibrate", "--seconds", "14", "--server", room.url]
    code, screen = at_a_terminal(long, ["y"])
    assert code in (0, 3) and "in force now" in screen, screen
    assert [s.sensor for s in room.status().calibration.sensors] == ["left", "right"]
