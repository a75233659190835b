#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""Embeds the whole chain in Python: four synthetic cameras, the hull, the room, one PNG per frame.

    python3 composite_to_png.py FOLDER
"""
import pathlib
import sys

import gi

gi.require_version("Gst", "1.0")
from gi.repository import GLib, Gst  # noqa: E402


def main():
    folder = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    Gst.init(None)
    cameras = " ".join(
        f"rigtestsrc camera=cam{i} num-buffers=3 ! queue ! chromamatte ! gaussblur ! "
        f"contourfind camera=cam{i} ! hull." for i in range(4))
    pipeline = Gst.parse_launch(
        f"{cameras} hullbuild name=hull ! hulltexture ! composite.mesh_0 "
        "scenesrc num-buffers=3 ! video/x-raw,width=640,height=360 ! composite.background "
        f"composite name=composite ! videoconvert ! pngenc ! "
        f"multifilesink location={folder}/composite-%d.png")

    loop = GLib.MainLoop()
    failed = []

    def on_message(_bus, message):
        if message.type == Gst.MessageType.ERROR:
            error, _debug = message.parse_error()
            failed.append(error.message)
        if message.type in (Gst.MessageType.ERROR, Gst.MessageType.EOS):
            loop.quit()

    bus = pipeline.get_bus()
    bus.add_signal_watch()
    bus.connect("message", on_message)
    pipeline.set_state(Gst.State.PLAYING)
    loop.run()
    stats = pipeline.get_by_name("composite").get_property("stats")
    print(f"{stats.get_value('frames')} frames, the last one in {stats.get_value('frame-ms'):.1f} ms; all of it:")
    print(stats.to_string())
    pipeline.set_state(Gst.State.NULL)
    for text in failed:
        print(text, file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
