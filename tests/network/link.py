#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""A link between two network namespaces that is slow, unsteady and loses packets: what the kernel's netem
does, where the kernel has none.

usage: link.py NAMESPACE_A DEVICE_A NAMESPACE_B DEVICE_B DELAY_MS JITTER_MS LOSS

Makes a TUN device in each, and carries each packet to the other DELAY_MS +- JITTER_MS later, in order, but
for the share LOSS that is lost. SIGUSR1 cuts the link, SIGUSR2 mends it. Prints "ready"."""
import collections
import ctypes
import fcntl
import os
import random
import select
import signal
import struct
import sys
import time

TUNSETIFF, IFF_TUN, IFF_NO_PI, CLONE_NEWNET = 0x400454CA, 1, 0x1000, 0x40000000


def open_device(namespace, name):
    libc = ctypes.CDLL(None, use_errno=True)
    with open(f"/run/netns/{namespace}") as file:
        if libc.setns(file.fileno(), CLONE_NEWNET) != 0:
            raise OSError(ctypes.get_errno(), f"namespace {namespace}")
    device = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
    fcntl.ioctl(device, TUNSETIFF, struct.pack("16sH", name.encode(), IFF_TUN | IFF_NO_PI))
    return device


def main():
    spaces, names = sys.argv[1:5:2], sys.argv[2:5:2]
    delay, jitter, loss = (float(word) for word in sys.argv[5:8])
    devices = [open_device(*pair) for pair in zip(spaces, names)]
    whole = [True]
    signal.signal(signal.SIGUSR1, lambda *_: whole.__setitem__(0, False))
    signal.signal(signal.SIGUSR2, lambda *_: whole.__setitem__(0, True))
    chance = random.Random(1)
    waiting = {device: collections.deque() for device in devices}  # (when due, packet) for the other end
    print("ready", flush=True)
    while True:
        due = [queue[0][0] for queue in waiting.values() if queue]
        readable, _, _ = select.select(devices, [], [], max(0.0, min(due) - time.monotonic()) if due else 1.0)
        for device in readable:
            for _ in range(64):
                try:
                    packet = os.read(device, 65536)
                except BlockingIOError:
                    break
                if not whole[0] or chance.random() < loss:
                    continue
                when = time.monotonic() + 1e-3 * (delay + chance.uniform(-jitter, jitter))
                queue = waiting[device]
                # A link keeps the order.
                queue.append((max(when, queue[-1][0]) if queue else when, packet))
        now = time.monotonic()
        for device, other in (devices, devices[::-1]):
            queue = waiting[device]
            while queue and queue[0][0] <= now:
                try:
                    os.write(other, queue.popleft()[1])
                except OSError:
                    pass  # its end is full: lost


if __name__ == "__main__":
    main()
