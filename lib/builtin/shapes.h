// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Simple shapes as scene meshes: what the built-in room and tests are made of. Outside counter-
/// clockwise; `material` is an index into Scene::materials.
#pragma once

#include <span>
#include <string>

#include "scene/scene.h"

namespace polyhull {

/// The parallelogram corner + [0,1] a + [0,1] b, seen from the side of cross(a, b). Texture
/// coordinates run from 0 to \p repeat along a and b.
SceneMesh parallelogram(const std::string& name, int material, const Vec3f& corner, const Vec3f& a,
                        const Vec3f& b, const Vec2f& repeat = Vec2f(1.0f));

/// A box with edges along the axes. Texture coordinates are metres.
SceneMesh box(const std::string& name, int material, const Vec3f& low, const Vec3f& high);

/// A surface of revolution around the vertical through \p foot: the profile's points are (radius,
/// height), from the bottom to the top for an outside that faces away from the axis. Points given
/// twice make a crease. Texture coordinates are (once around, length along the profile in metres).
SceneMesh lathe(const std::string& name, int material, const Vec3f& foot,
                std::span<const Vec2f> profile, int segments);

/// A sphere.
SceneMesh sphere(const std::string& name, int material, const Vec3f& centre, float radius,
                 int segments);

/// Adds the triangles of \p part to \p mesh (which takes part's name and material if it is empty).
void append(SceneMesh& mesh, const SceneMesh& part);

/// Four bars around the rectangle at \p low with the edges \p across and \p up, along the axes: \p border wide, and
/// from the rectangle's plane to \p depth before it.
SceneMesh picture_frame(const std::string& name, int material, const Vec3f& low,
                        const Vec3f& across, const Vec3f& up, const Vec3f& depth, float border);

}  // namespace polyhull
