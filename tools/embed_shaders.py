#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""Writes the shaders named on the command line as a table in a C++ source file.

usage: embed_shaders.py OUTPUT.cpp SHADER...
"""
import os
import sys

output, *names = sys.argv[1:]
with open(output, "w", encoding="utf-8") as out:
    out.write('// Made by tools/embed_shaders.py from shaders/.\n#include "render/gl/objects/shader_sources.h"\n\n')
    out.write("namespace polyhull {\n\nstd::span<const ShaderSource> shader_sources() {\n")
    out.write("  static constexpr ShaderSource sources[] = {\n")
    for name in names:
        with open(name, encoding="utf-8") as file:
            text = file.read()
        out.write('      {"%s",\n       R"GLSL(%s)GLSL"},\n' % (os.path.basename(name), text))
    out.write("  };\n  return sources;\n}\n\n}  // namespace polyhull\n")
