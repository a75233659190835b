#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""A live stage in Python: four cameras that run by the clock, the figure in a room, and a bus that is listened to.

    python3 live_stage.py [SECONDS [SINK]]      # 10 seconds, autovideosink

A gst-launch-1.0 line looks after latency by itself; an application has to: hullbuild and the cameras tell by a
message when theirs has changed, and until it is set anew frames come too late and are dropped.
"""
import sys

import gi

gi.require_version("Gst", "1.0")
from gi.repository import GLib, Gst  # noqa: E402

RATE = 5  # a camera's frames per second; real ones deliver what they deliver

# On a stage: v4l2src device=/dev/video0, or aravissrc do-timestamp=true, in place of rigtestsrc.
CAMERA = ("rigtestsrc is-live=true camera=cam{0} ! video/x-raw,framerate={1}/1 ! queue max-size-buffers=2 ! "
          "silhouette camera=cam{0} ! hull.")


class Stage:
    def __init__(self, sink):
        cameras = " ".join(CAMERA.format(i, RATE) for i in range(4))
        self.pipeline = Gst.parse_launch(
            f"{cameras} hullbuild name=hull ! hulltexture ! queue max-size-buffers=2 ! composite.mesh_0 "
            f"scenesrc is-live=true light-spacing=0.1 ! video/x-raw,width=640,height=360,framerate={RATE}/1 ! "
            f"queue max-size-buffers=2 ! composite.background composite name=composite ! videoconvert ! {sink}")
        self.loop = GLib.MainLoop()
        self.failure = None
        self.latencies = self.dropped = 0
        bus = self.pipeline.get_bus()
        bus.add_signal_watch()
        bus.connect("message", self.on_message)

    def on_message(self, _bus, message):
        if message.type == Gst.MessageType.LATENCY:
            self.pipeline.recalculate_latency()
            self.latencies += 1
        elif message.type == Gst.MessageType.WARNING:  # the stream goes on; say it to the operator
            warning, _debug = message.parse_warning()
            print(f"warning from {message.src.get_name()}: {warning.message}")
        elif message.type == Gst.MessageType.QOS:  # a frame or a set came too late and was left out
            self.dropped += 1
        elif message.type == Gst.MessageType.CLOCK_LOST:  # a camera that gave the clock is gone: choose another
            self.pipeline.set_state(Gst.State.PAUSED)
            self.pipeline.set_state(Gst.State.PLAYING)
        elif message.type == Gst.MessageType.ERROR:
            self.failure, _debug = message.parse_error()
            self.loop.quit()
        elif message.type == Gst.MessageType.EOS:
            self.loop.quit()

    def number(self, element, name):
        """One counter (an integer) or figure (a float) of an element's stats; None before its first use."""
        return self.pipeline.get_by_name(element).get_property("stats").get_value(name)

    def report(self):
        query = Gst.Query.new_latency()
        known = self.pipeline.query(query)
        _live, least, _most = query.parse_latency()
        print(f"{self.number('composite', 'frames')} frames, {self.number('hull', 'sets')} hulls of "
              f"{self.number('hull', 'cameras')} cameras in {self.number('hull', 'faces-ms'):.1f} ms, latency "
              f"{f'{least / Gst.MSECOND:.0f} ms' if known else 'not known yet'}, {self.dropped} left out")
        return True

    def run(self, seconds):
        GLib.timeout_add_seconds(1, self.report)
        GLib.timeout_add_seconds(seconds, self.loop.quit)
        self.pipeline.set_state(Gst.State.PLAYING)
        self.loop.run()
        frames = self.number("composite", "frames")
        self.pipeline.set_state(Gst.State.NULL)
        print(f"{frames} frames in {seconds} s; latency was set anew {self.latencies} times")
        if self.failure:
            print(self.failure.message, file=sys.stderr)
        return 0 if frames and not self.failure else 1


if __name__ == "__main__":
    Gst.init(None)
    seconds = int(sys.argv[1]) if len(sys.argv) > 1 else 10
    stage = Stage(sys.argv[2] if len(sys.argv) > 2 else "autovideosink")
    sys.exit(stage.run(seconds))
