// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/subject_light.h"

#include <algorithm>
#include <cmath>

#include "base/thread_pool.h"
#include "raytrace/traced_scene.h"
#include "render/light_samples.h"

namespace polyhull {
namespace {

constexpr float cell_length = 0.125f;  // metres
constexpr int most_nodes = 64;         // along an axis; larger subjects have larger cells
constexpr std::size_t most_kept = 1u << 18;
constexpr float brightest = 4.0f;  // f
const Vec3f stage_middle(0.0f, 1.0f, 0.0f);

/// Phi at points of a scene.
class Irradiance {
 public:
  Irradiance(const RenderFrame& frame, const RayCaster& caster) : frame_(frame), caster_(caster) {}

  Vec3f at(const Vec3f& point) const {
    Vec3f sum = frame_.ambient;
    for (const Light& light : frame_.lights) {
      const Given few = from(light, point, 4);
      // Where some of its places are hidden, more are asked.
      sum += few.hidden == 0 || few.hidden == few.places ? few.irradiance
                                                         : from(light, point, 8).irradiance;
    }
    return sum;
  }

 private:
  struct Given {
    Vec3f irradiance{0.0f};
    int hidden = 0, places = 0;
  };
  /// By the middles of side x side parts of the light.
  Given from(const Light& light, const Vec3f& point, int side) const {
    const std::vector<Vec3> places = light_cells(light, side * side);
    const Vec3f normal = light_normal(light);
    rays_.resize(places.size());
    blocked_.resize(places.size());
    for (std::size_t i = 0; i < places.size(); ++i)
      rays_[i] = {point, 0.0f, Vec3f(places[i]) - point, 1.0f - 1e-4f};
    caster_.occluded(rays_, blocked_);
    Given out;
    out.places = static_cast<int>(places.size());
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (blocked_[i] != 0) {
        ++out.hidden;
        continue;
      }
      const Vec3f& way = rays_[i].direction;
      const float square = std::max(glm::dot(way, way), 1e-6f);
      const float exit = light_exit(light, -glm::dot(normal, way) / std::sqrt(square));
      out.irradiance += exit / (4.0f * square) * light_power(light);
    }
    out.irradiance /= static_cast<float>(places.size());
    return out;
  }

  const RenderFrame& frame_;
  const RayCaster& caster_;
  static thread_local std::vector<Ray> rays_;
  static thread_local std::vector<std::uint8_t> blocked_;
};
thread_local std::vector<Ray> Irradiance::rays_;
thread_local std::vector<std::uint8_t> Irradiance::blocked_;

/// 21 bits an axis.
std::uint64_t key_of(const std::array<int, 3>& node) {
  std::uint64_t key = 0;
  for (const int i : node) key = key << 21 | (static_cast<std::uint64_t>(i) & 0x1fffffu);
  return key;
}

/// Nodes lie at the middles of cells, so that none is in a floor at a round height.
Vec3f place_of(const std::array<int, 3>& node, float cell) {
  return cell * (Vec3f(static_cast<float>(node[0]), static_cast<float>(node[1]),
                       static_cast<float>(node[2])) +
                 0.5f);
}

/// The nodes from \p first on, \p size of them, and one more on each side, where f goes on as it does
/// between the two before: what lies there may be under the floor.
LightLattice lattice_of(const std::array<int, 3>& first, const std::array<int, 3>& size, float cell,
                        const std::unordered_map<std::uint64_t, Vec3f>& nodes) {
  LightLattice out;
  out.origin = place_of({first[0] - 1, first[1] - 1, first[2] - 1}, cell);
  out.cell = cell;
  out.size = {size[0] + 2, size[1] + 2, size[2] + 2};
  const std::array<int, 3> step{1, out.size[0], out.size[0] * out.size[1]};
  out.factors.resize(static_cast<std::size_t>(step[2] * out.size[2]));
  for (int z = 0; z < size[2]; ++z)
    for (int y = 0; y < size[1]; ++y)
      for (int x = 0; x < size[0]; ++x)
        out.factors[static_cast<std::size_t>((x + 1) * step[0] + (y + 1) * step[1] +
                                             (z + 1) * step[2])] =
            nodes.at(key_of({first[0] + x, first[1] + y, first[2] + z}));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t across = (axis + 1) % 3, along = (axis + 2) % 3;
    const int last = out.size[axis] - 1;
    for (int j = 0; j < out.size[along]; ++j)
      for (int i = 0; i < out.size[across]; ++i) {
        Vec3f* const line =
            &out.factors[static_cast<std::size_t>(i * step[across] + j * step[along])];
        const auto continue_to = [&](int to, int from, int before) {
          const Vec3f& near = line[from * step[axis]];
          const Vec3f& far = line[(size[axis] > 1 ? before : from) * step[axis]];
          line[to * step[axis]] = glm::clamp(2.0f * near - far, Vec3f(0.0f), Vec3f(brightest));
        };
        continue_to(0, 1, 2);
        continue_to(last, last - 1, last - 2);
      }
  }
  return out;
}

}  // namespace

Vec3f LightLattice::at(const Vec3f& point) const {
  int low[3];
  float share[3];
  for (int k = 0; k < 3; ++k) {
    const float t =
        std::clamp(point[k], 0.0f, static_cast<float>(size[static_cast<std::size_t>(k)] - 1));
    low[k] = std::min(static_cast<int>(t), std::max(size[static_cast<std::size_t>(k)] - 2, 0));
    share[k] = t - static_cast<float>(low[k]);
  }
  const int dx = size[0] > 1, dy = size[1] > 1 ? size[0] : 0,
            dz = size[2] > 1 ? size[0] * size[1] : 0;
  const Vec3f* const f =
      &factors[static_cast<std::size_t>((low[2] * size[1] + low[1]) * size[0] + low[0])];
  const auto along_x = [&](const Vec3f* p) { return p[0] + share[0] * (p[dx] - p[0]); };
  const auto along_y = [&](const Vec3f* p) {
    const Vec3f a = along_x(p);
    return a + share[1] * (along_x(p + dy) - a);
  };
  const Vec3f a = along_y(f);
  return a + share[2] * (along_y(f + dz) - a);
}

std::shared_ptr<const LightLattice> SubjectLight::around(const RenderFrame& frame,
                                                         const RenderPlan& plan,
                                                         const TracedScene& scene) {
  found_ = 0;
  std::vector<Vec3f> corners;
  for (const PlacedSubject& subject : plan.subjects) {
    if (subject.lighting != SubjectLighting::shade) continue;
    const Bounds box = bounds_of(subject.points);
    corners.emplace_back(box.min);
    corners.emplace_back(box.max);
  }
  if (corners.empty()) return nullptr;
  const Bounds box = bounds_of(corners);
  float cell = cell_length;
  const Vec3 extent = box.max - box.min;
  while (std::max({extent.x, extent.y, extent.z}) > (most_nodes - 1) * static_cast<double>(cell))
    cell *= 2.0f;
  const Irradiance irradiance(frame, scene.caster());
  if (scene_ != frame.scene || lights_ != frame.lights || ambient_ != frame.ambient ||
      cell_ != cell || nodes_.size() > most_kept) {
    scene_ = frame.scene;
    lights_ = frame.lights;
    ambient_ = frame.ambient;
    cell_ = cell;
    nodes_.clear();
    last_.reset();
    stage_ = irradiance.at(stage_middle);
  }
  if (!(std::max({stage_.x, stage_.y, stage_.z}) > 0.0f)) return nullptr;

  // The nodes within the box, and at least the one in whose cell its middle is.
  Node first, size;
  for (int k = 0; k < 3; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const double low = box.min[k] / cell - 0.5, high = box.max[k] / cell - 0.5;
    first[i] = static_cast<int>(std::ceil(low));
    size[i] = static_cast<int>(std::floor(high)) - first[i] + 1;
    if (size[i] >= 1) continue;
    first[i] = static_cast<int>(std::lround(0.5 * (low + high)));
    size[i] = 1;
  }
  if (last_ && first == first_ && size == size_) return last_;
  first_ = first;
  size_ = size;

  std::vector<Node> missing;
  for (int z = 0; z < size[2]; ++z)
    for (int y = 0; y < size[1]; ++y)
      for (int x = 0; x < size[0]; ++x) {
        const Node node{first[0] + x, first[1] + y, first[2] + z};
        if (!nodes_.contains(key_of(node))) missing.push_back(node);
      }
  std::vector<Vec3f> factors(missing.size());
  parallel_for(missing.size(), 16, 0, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3f here = irradiance.at(place_of(missing[i], cell));
      for (int c = 0; c < 3; ++c)
        factors[i][c] = stage_[c] > 0.0f ? std::min(here[c] / stage_[c], brightest) : 1.0f;
    }
  });
  for (std::size_t i = 0; i < missing.size(); ++i) nodes_.emplace(key_of(missing[i]), factors[i]);
  found_ = missing.size();
  last_ = std::make_shared<const LightLattice>(lattice_of(first, size, cell, nodes_));
  return last_;
}

}  // namespace polyhull
