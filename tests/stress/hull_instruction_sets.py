#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""The hull with and without fused multiply-add.

hull_instruction_sets.py BASELINE V3 CONTRACTED [COUNT]

The library as shipped, built for x86-64, and the same sources built for x86-64-v3 must give the same
bytes. Built for x86-64-v3 with contraction allowed, which the project does not do, coordinates may
differ in their last bits, but every hull must still be sound and of the same volume: no decision may
hang on how a product is rounded.
"""
import pathlib
import subprocess
import sys


def lines_of(program, count):
    run = subprocess.run([program, count], capture_output=True, text=True, check=True)
    return run.stdout.splitlines()


def main():
    baseline, v3, contracted = sys.argv[1:4]
    count = sys.argv[4] if len(sys.argv) > 4 else '60'
    flags = pathlib.Path('/proc/cpuinfo').read_text()
    if not all(f' {name}' in flags for name in ('avx2', 'bmi2', 'fma')):
        print('this processor has no x86-64-v3')
        return 77
    base, same, other = (lines_of(program, count) for program in (baseline, v3, contracted))
    assert 'baseline' in base[0] and 'fused' in same[0] and 'fused' in other[0], 'wrong programs'
    assert len(base) == len(same) == len(other) > 100, 'different numbers of scenes'
    wrong = [(a, b) for a, b in zip(base[1:], same[1:]) if a != b]
    for a, b in wrong[:5]:
        print(f'x86-64:    {a}\nx86-64-v3: {b}')
    different = 0
    for a, b in zip(base[1:], other[1:]):
        different += a != b
        x, y = a.split(';'), b.split(';')
        if x[1] == 'refused' or y[1] == 'refused':
            continue
        # Volumes agree to six digits where there is any.
        u, v = float(x[5]), float(y[5])
        if y[2] != 'sound' or abs(u - v) > 1e-5 * max(abs(u), abs(v)) + 1e-30:
            wrong.append((a, b))
            print(f'x86-64:           {a}\nwith contraction: {b}')
    print(f'{len(base) - 1} hulls, {len(wrong)} wrong; contraction changes bytes of {different}')
    return 1 if wrong else 0


if __name__ == '__main__':
    sys.exit(main())
