// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Any bytes as a hull scene, for fuzzing: cameras and rings on coarse grids, so that coincidences
/// are common, and now and then raw floating-point numbers, so that nothing is sacred.
#pragma once

#include <cstdint>
#include <cstring>
#include <span>

#include "hull/hull.h"
#include "support/scenes.h"

namespace polyhull::test {

class ByteReader {
 public:
  explicit ByteReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  bool empty() const { return bytes_.empty(); }
  std::uint8_t byte() {
    if (bytes_.empty()) return 0;
    const std::uint8_t value = bytes_[0];
    bytes_ = bytes_.subspan(1);
    return value;
  }
  int small() { return static_cast<std::int8_t>(byte()); }
  template <class Real>
  Real raw() {
    Real value = 0;
    unsigned char memory[sizeof(Real)] = {};
    for (unsigned char& b : memory) b = byte();
    std::memcpy(&value, memory, sizeof value);
    return value;
  }

 private:
  std::span<const std::uint8_t> bytes_;
};

struct ScenePlan {
  HullScene scene;
  HullOptions options;
};

inline ScenePlan scene_from_bytes(std::span<const std::uint8_t> bytes) {
  ByteReader in(bytes);
  ScenePlan plan;
  plan.scene.name = "bytes";
  const int cameras = in.byte() % 6;
  const std::uint8_t flags = in.byte();
  const bool raw = (flags & 0xf0) == 0xf0;
  if (flags & 1) {
    const double reach = 0.25 * (1 + in.byte() % 32);
    plan.options.bounds = Bounds{Vec3(-reach), Vec3(reach)};
    if (raw) plan.options.bounds->max.y = in.raw<double>();
  }
  if (flags & 2) plan.options.unseen = Unseen::keep;
  if (flags & 4) plan.options.max_deviation = raw ? in.raw<double>() : in.byte() / 1024.0;
  plan.options.threads = flags & 8 ? 2 : 1;
  for (int i = 0; i < cameras; ++i) {
    const Vec3 centre(in.small() / 16.0, in.small() / 16.0, in.small() / 16.0);
    const int pose = in.byte();
    Vec3 target(0.0);
    target[pose % 3] = (pose & 8) ? 0.5 : 0.0;
    if (glm::length(target - centre) < 1e-3) target.x += 1;
    const double focal = (pose & 16) ? 1000 : 1 << (pose % 11);
    Camera camera = look_at("cam" + std::to_string(i), centre, target, focal, 1024, 768,
                            (pose & 4) ? 0.0 : pose);
    if (raw) {
      camera.R[0][pose % 3] = in.raw<double>();
      camera.t[pose % 3] = in.raw<double>();
      camera.K[0][0] = in.raw<double>();
    }
    plan.scene.rig.cameras.push_back(camera);
    Rings rings;
    const int count = in.byte() % 4;
    for (int r = 0; r < count; ++r) {
      std::vector<Vec2f> ring;
      const int n = in.byte() % 16;
      for (int k = 0; k < n && !in.empty(); ++k) {
        if (raw) {
          const float x = in.raw<float>();
          ring.emplace_back(x, in.raw<float>());
        } else {
          ring.emplace_back(512.0f + 4.0f * float(in.small()), 384.0f + 3.0f * float(in.small()));
        }
      }
      add_ring(rings, ring);
    }
    plan.scene.silhouettes.push_back(rings);
  }
  return plan;
}

}  // namespace polyhull::test
