// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Animations of nodes as glTF 2.0 defines them (section 3.11 and appendix C): keys of translations,
/// rotations and scales, and the values between.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "gltf/node_transform.h"

namespace polyhull {

/// One part of a node's transform over time.
struct AnimationTrack {
  enum class Part { translation, rotation, scale };
  enum class Interpolation {
    step,    ///< the value of the key before
    linear,  ///< on the straight line; rotations on the shorter great circle, at even speed
    cubic,   ///< on the Hermite spline of the keys' tangents
  };
  Part part = Part::translation;
  Interpolation interpolation = Interpolation::linear;
  std::vector<double> times;  ///< seconds, none before the one that it follows; at least one
  /// One for each time, a rotation as x, y, z, w; of cubic ones three: the tangent that leads to the key,
  /// its value, and the tangent away from it, per second.
  std::vector<Vec4> values;

  /// The value at \p time; before the first key and after the last one theirs. A rotation has length 1.
  Vec4 at(double time) const;
};

/// What an animation does to a node.
struct NodeMotion {
  int node = 0;        ///< in Scene::nodes
  NodeTransform rest;  ///< as the file has it: parts without a track stay
  std::vector<AnimationTrack> tracks;

  NodeTransform at(double time) const;
};

struct Animation {
  std::string name;
  std::vector<NodeMotion> motions;  ///< each of another node, with a mesh or light on or below it
  double duration = 0.0;            ///< seconds to the last key
};

/// The number, from 1 on, of the animation that \p choice means: a name, else a number; empty: the first
/// one, if there is any. 0: none, also for "0"; nothing: it is not there.
std::optional<int> find_animation(const std::vector<Animation>& animations,
                                  std::string_view choice);

/// The time in \p animation, from 0 to its duration, \p seconds after its begin: over and over with
/// \p loop, else its end stays.
double time_in(const Animation& animation, double seconds, bool loop);

}  // namespace polyhull
