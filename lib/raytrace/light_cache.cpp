// SPDX-License-Identifier: LGPL-2.1-or-later
#include "raytrace/light_cache.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <numbers>

#include "base/thread_pool.h"
#include "raytrace/area_light.h"
#include "raytrace/sampling.h"

namespace polyhull {
namespace {

constexpr float pi = std::numbers::pi_v<float>;
constexpr int most_samples = 1024;
constexpr std::uint32_t light_seed = 0x3c6ef372U, bounce_seed = 0xa54ff53aU,
                        mirror_seed = 0x510e527fU;
constexpr int mirror_depth = 3;
constexpr std::size_t grain = 256;

/// The start of rays from a node.
Vec3f start(const SurfaceGrid::Node& node, float epsilon) {
  return node.place + epsilon * node.normal;
}

SurfaceGrid::Node turned(SurfaceGrid::Node node, bool back) {
  if (back) node.normal = -node.normal;
  return node;
}

std::vector<Vec2f> sample_points(int count, std::uint32_t seed) {
  std::vector<Vec2f> points;
  for (int i = 0; i < std::clamp(count, 1, most_samples); ++i)
    points.push_back(sample_point(static_cast<std::uint32_t>(i), seed));
  return points;
}

/// How much of the light reaches a node, by weight, over some of the sample points.
struct Share {
  float visible = 0.0f;
  float whole = 0.0f;
};

Share visible_share(const TracedScene& scene, const Light& light, const SurfaceGrid::Node& node,
                    std::span<const Vec2f> points) {
  std::array<Ray, 64> rays;
  std::array<float, 64> weights;
  std::array<std::uint8_t, 64> blocked;
  Share share;
  const Vec3f origin = start(node, scene.epsilon());
  for (std::size_t first = 0; first < points.size(); first += rays.size()) {
    std::size_t count = 0;
    for (std::size_t i = first; i < std::min(first + rays.size(), points.size()); ++i) {
      const LightSample sample = sample_light(light, points[i], origin, node.normal);
      if (sample.weight <= 0.0f) continue;
      weights[count] = sample.weight;
      rays[count].origin = origin;
      rays[count].direction = sample.place - origin;
      // A node in the very plane of a wall that stands there is on the wall's near side, too.
      rays[count].near = 10.0f * scene.epsilon() / glm::length(rays[count].direction);
      rays[count].far = 1.0f - 1e-4f;
      ++count;
    }
    scene.caster().occluded(std::span(rays).first(count), std::span(blocked).first(count));
    for (std::size_t i = 0; i < count; ++i) {
      share.whole += weights[i];
      if (!blocked[i]) share.visible += weights[i];
    }
  }
  return share;
}

/// Whether a node lies inside a closed body: most of what it sees are backs.
bool inside_a_body(const TracedScene& scene, const SurfaceGrid::Node& node) {
  const auto [x, y] = tangents(node.normal);
  int backs = 0;
  constexpr std::uint32_t count = 8;
  for (std::uint32_t i = 0; i < count; ++i) {
    const Vec3f local = cosine_direction(sample_point(i, bounce_seed));
    Ray ray;
    ray.origin = start(node, scene.epsilon());
    ray.near = 10.0f * scene.epsilon();
    ray.direction = local.x * x + local.y * y + local.z * node.normal;
    const RayHit hit = scene.caster().intersect(ray);
    if (!hit.hit()) continue;
    const Material& material = scene.scene().materials[scene.scene().meshes[hit.mesh].material];
    if (!material.double_sided && glm::dot(hit.normal, ray.direction) > 0.0f) ++backs;
  }
  return 2 * backs > static_cast<int>(count);
}

/// A node inside a body that stands on the surface would darken the visible rim beside the body: it
/// takes the mean of its neighbours outside instead. Two rounds reach as far as interpolation does.
void mend_hidden(const SurfaceGrid& grid, std::vector<char>& hidden, std::vector<Float4>& values) {
  if (std::find(hidden.begin(), hidden.end(), 1) == hidden.end()) return;
  for (int round = 0; round < 2; ++round) {
    std::vector<Float4> sums(values.size(), Float4{});  // the last component counts
    const auto compare = [&](std::uint32_t a, std::uint32_t b) {
      if (hidden[a] == hidden[b]) return;
      const std::uint32_t to = hidden[a] ? a : b, from = hidden[a] ? b : a;
      Float4 value = values[from];
      value[3] = 1.0f;
      sums[to] += value;
    };
    grid.for_blocks(1, [&](const SurfaceGrid::Block& block) {
      const std::uint32_t right = block.first + 1, below = block.first + block.stride;
      compare(block.first, right);
      compare(block.first, below);
      compare(block.first, below + 1);
      compare(right, below);
      compare(right, below + 1);
      compare(below, below + 1);
    });
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (sums[i][3] == 0.0f) continue;
      values[i] = sums[i] / sums[i][3];
      hidden[i] = 0;
    }
  }
}

Float4 interpolate(const SurfaceGrid& grid, const std::vector<Float4>& values, const RayHit& hit) {
  const SurfaceGrid::Lookup lookup = grid.lookup(hit);
  return lookup.weight[0] * values[lookup.index[0]] + lookup.weight[1] * values[lookup.index[1]] +
         lookup.weight[2] * values[lookup.index[2]] + lookup.weight[3] * values[lookup.index[3]];
}

constexpr float not_asked = -1.0f;  // in place of a share of visible light
constexpr float alike = 0.12f;      // shares that differ less may be interpolated between

}  // namespace

LightCache::LightCache(const TracedScene& scene, const LightCacheOptions& options,
                       const std::atomic<bool>* stop)
    : stop_(stop),
      fine_(scene.scene(), options.spacing, options.most_nodes),
      coarse_(scene.scene(), options.bounce_spacing, options.most_nodes / 8) {
  const int sides = find_double_sided(scene.scene()) ? 2 : 1;
  for (int side = 0; side < sides; ++side) fill_direct(scene, options, side == 1);
  for (int side = 0; side < sides; ++side) fill_bounced(scene, options, side == 1);
  for (int side = 0; side < sides; ++side) {
    all_.sides[side] = direct_[side];
    parallel_for(fine_.size(), grain, options.threads, [&](std::size_t begin, std::size_t end) {
      fine_.for_nodes(scene.scene(), begin, end, [&](std::size_t i, const SurfaceGrid::Node& node) {
        all_.sides[side][i] += interpolate(coarse_, bounced_[side], node.hit);
      });
    });
  }
  find_mean(scene);
  stop_ = nullptr;  // which may not live as long
}

LightCache::LightCache(const TracedScene& scene, const LightCacheOptions& options,
                       LightValues values)
    : fine_(scene.scene(), options.spacing, options.most_nodes),
      coarse_(scene.scene(), options.bounce_spacing, options.most_nodes / 8),
      all_(std::move(values)) {
  find_double_sided(scene.scene());
}

bool LightCache::usable() const {
  const bool back = std::find(double_sided_.begin(), double_sided_.end(), 1) != double_sided_.end();
  return all_.sides[0].size() == fine_.size() &&
         all_.sides[1].size() == (back ? fine_.size() : 0);
}

LightValues LightCache::values_for(const TracedScene& scene,
                                   const LightCacheOptions& options) const {
  const SurfaceGrid grid(scene.scene(), options.spacing, options.most_nodes);
  LightValues out;
  out.mean_bounced = all_.mean_bounced;
  for (std::size_t side = 0; side < out.sides.size(); ++side) {
    if (all_.sides[side].empty()) continue;
    out.sides[side].resize(grid.size());
    parallel_for(grid.size(), grain, options.threads, [&](std::size_t begin, std::size_t end) {
      grid.for_nodes(scene.scene(), begin, end, [&](std::size_t i, const SurfaceGrid::Node& node) {
        out.sides[side][i] = interpolate(fine_, all_.sides[side], node.hit);
      });
    });
  }
  return out;
}

/// Whether any mesh is.
bool LightCache::find_double_sided(const Scene& scene) {
  bool any = false;
  for (const SceneMesh& mesh : scene.meshes) {
    double_sided_.push_back(scene.materials[mesh.material].double_sided);
    any |= double_sided_.back() != 0;
  }
  return any;
}

Vec3f LightCache::irradiance(const RayHit& hit, bool back) const {
  return gain_ * to_vector(interpolate(fine_, all_.sides[back && double_sided_[hit.mesh] ? 1 : 0], hit));
}

/// The share of a light that each node sees, by weight.
void LightCache::ask_light(const TracedScene& scene, const LightCacheOptions& options,
                           const Light& light, bool back, std::vector<float>& shares) {
  const std::vector<Vec2f> points =
      sample_points(light.is_area() ? options.light_samples : 1, light_seed);
  const auto few = std::span(points).first(
      std::min(points.size(), static_cast<std::size_t>(std::max(options.first_samples, 1))));
  std::atomic<std::uint64_t> rays = 0;
  const auto ask = [&](const std::vector<char>& wanted, bool thorough) {
    parallel_for(fine_.size(), grain, options.threads, [&](std::size_t begin, std::size_t end) {
      std::uint64_t asked = 0;
      fine_.for_nodes(scene.scene(), begin, end, [&](std::size_t i, SurfaceGrid::Node node) {
        if (!wanted[i] || (back && !double_sided_[node.mesh]) || stopped()) return;
        node = turned(node, back);
        Share share = visible_share(scene, light, node, few);
        asked += few.size();
        const bool soft = share.visible > 0.0f && share.visible < share.whole * (1.0f - 1e-5f);
        if ((soft || thorough) && share.whole > 0.0f) {
          const Share more =
              visible_share(scene, light, node, std::span(points).subspan(few.size()));
          share.visible += more.visible;
          share.whole += more.whole;
          asked += points.size() - few.size();
        }
        // A node that the light's front is turned away from does as if it saw it: the light's
        // closed form is 0 there, and a neighbour's share is not disturbed.
        shares[i] = share.whole > 0.0f ? std::min(share.visible / share.whole, 1.0f) : 1.0f;
      });
      rays += asked;
    });
  };
  std::vector<char> wanted(fine_.size(), 0);
  fine_.for_vertex_ranges([&](std::size_t begin, std::size_t end) {
    std::fill(wanted.begin() + static_cast<std::ptrdiff_t>(begin),
              wanted.begin() + static_cast<std::ptrdiff_t>(end), 1);
  });
  const auto corners = [](const SurfaceGrid::Block& block) {
    const std::uint32_t below = block.first + block.height * block.stride;
    return std::array{block.first, block.first + block.width, below, below + block.width};
  };
  constexpr std::uint32_t step = 2;
  fine_.for_blocks(step, [&](const SurfaceGrid::Block& block) {
    for (const std::uint32_t i : corners(block)) wanted[i] = 1;
  });
  ask(wanted, false);
  std::fill(wanted.begin(), wanted.end(), 0);
  std::vector<SurfaceGrid::Block> even;
  fine_.for_blocks(step, [&](const SurfaceGrid::Block& block) {
    float least = 2.0f, most = -2.0f;
    for (const std::uint32_t i : corners(block)) {
      least = std::min(least, shares[i]);
      most = std::max(most, shares[i]);
    }
    if (most - least <= alike) {
      even.push_back(block);
      return;
    }
    for (std::uint32_t t = 0; t <= block.height; ++t)
      for (std::uint32_t s = 0; s <= block.width; ++s)
        wanted[block.first + t * block.stride + s] = 1;
  });
  ask(wanted, true);
  for (const SurfaceGrid::Block& block : even) {
    const auto c = corners(block);
    for (std::uint32_t t = 0; t <= block.height; ++t) {
      for (std::uint32_t s = 0; s <= block.width; ++s) {
        float& share = shares[block.first + t * block.stride + s];
        if (share != not_asked) continue;  // its other block asked
        const float x = static_cast<float>(s) / static_cast<float>(block.width);
        const float y = static_cast<float>(t) / static_cast<float>(block.height);
        share = (1.0f - y) * ((1.0f - x) * shares[c[0]] + x * shares[c[1]]) +
                y * ((1.0f - x) * shares[c[2]] + x * shares[c[3]]);
      }
    }
  }
  rays_ += rays;
}

void LightCache::fill_direct(const TracedScene& scene, const LightCacheOptions& options,
                             bool back) {
  std::vector<Float4>& values = direct_[back ? 1 : 0];
  values.assign(fine_.size(), Float4{});
  std::vector<char> hidden(fine_.size(), 0);
  for (const Light& light : scene.scene().lights) {
    std::vector<float> shares(fine_.size(), not_asked);
    ask_light(scene, options, light, back, shares);
    parallel_for(fine_.size(), grain, options.threads, [&](std::size_t begin, std::size_t end) {
      fine_.for_nodes(scene.scene(), begin, end, [&](std::size_t i, SurfaceGrid::Node node) {
        if ((back && !double_sided_[node.mesh]) || stopped()) return;
        node = turned(node, back);
        const Vec3f origin = start(node, scene.epsilon());
        const float unoccluded = unoccluded_irradiance(light, origin, node.normal);
        if (unoccluded <= 0.0f) return;
        if (shares[i] > 0.0f)
          values[i] += to_float4(light.radiance * (unoccluded * shares[i]));
        else if (!back && inside_a_body(scene, node))
          hidden[i] = 1;
      });
    });
  }
  if (!back) mend_hidden(fine_, hidden, values);
}

void LightCache::fill_bounced(const TracedScene& scene, const LightCacheOptions& options,
                              bool back) {
  const SurfaceGrid& grid = coarse_;
  std::vector<Float4>& values = bounced_[back ? 1 : 0];
  values.assign(grid.size(), Float4{});
  const std::vector<Vec2f> points = sample_points(options.bounce_samples, bounce_seed);
  const std::vector<Vec2f> mirror_points = sample_points(options.light_samples / 2, mirror_seed);
  std::vector<char> hidden(grid.size(), 0);
  std::atomic<std::uint64_t> rays = 0;
  // L_1 along a ray from a node, as the path tracer has it but with the straight light from the
  // cache. Backs of single-sided surfaces are seen from inside bodies only: dark, and counted.
  const auto bounce = [&](Ray ray, RayHit hit, std::uint64_t& asked, int& backs) {
    Vec3f radiance(0.0f), throughput(1.0f);
    bool planar = true;
    for (int depth = 0;; ++depth) {
      if (!hit.hit()) break;
      const Surface surface = scene.plain_surface(ray, hit);
      if (surface.back && !double_sided_[hit.mesh]) {
        if (depth == 0) ++backs;
        break;
      }
      if (surface.light < 0 || depth > 1 || !planar) radiance += throughput * surface.emission;
      const bool mirror = surface.material->is_mirror();
      Vec3f f(0.0f), diffuse(1.0f);
      if (mirror) {
        f = fresnel(surface.material->f0(),
                    -glm::dot(surface.normal, ray.direction) / glm::length(ray.direction));
        diffuse = (Vec3f(1.0f) - f) * (1.0f - surface.material->metallic);
      }
      radiance += throughput * diffuse * scene.base_colour(hit) / pi *
                  to_vector(interpolate(fine_, direct_[surface.back ? 1 : 0], hit));
      if (!mirror || depth >= mirror_depth) break;
      planar = scene.is_planar_mirror(hit.mesh);
      throughput *= f;
      ray.origin = surface.point + scene.epsilon() * surface.geometric;
      ray.direction = glm::reflect(ray.direction, surface.normal);
      hit = scene.caster().intersect(ray);
      ++asked;
    }
    return radiance;
  };
  parallel_for(grid.size(), 16, options.threads, [&](std::size_t begin, std::size_t end) {
    std::uint64_t asked = 0;
    std::array<Ray, 64> ways;
    std::array<RayHit, 64> hits;
    grid.for_nodes(scene.scene(), begin, end, [&](std::size_t i, SurfaceGrid::Node node) {
      node = turned(node, back);
      if ((back && !double_sided_[node.mesh]) || stopped()) return;
      const auto [x, y] = tangents(node.normal);
      const Vec3f origin = start(node, scene.epsilon());
      Vec3f sum(0.0f);
      int backs = 0;
      for (std::size_t first = 0; first < points.size(); first += ways.size()) {
        const std::size_t count = std::min(ways.size(), points.size() - first);
        for (std::size_t k = 0; k < count; ++k) {
          const Vec3f local = cosine_direction(points[first + k]);
          ways[k].origin = origin;
          ways[k].near = 10.0f * scene.epsilon();
          ways[k].direction = local.x * x + local.y * y + local.z * node.normal;
        }
        scene.caster().intersect(std::span(ways).first(count), std::span(hits).first(count), false);
        for (std::size_t k = 0; k < count; ++k) {
          sum += bounce(ways[k], hits[k], asked, backs);
        }
      }
      hidden[i] = 2 * backs > static_cast<int>(points.size());
      sum *= pi / static_cast<float>(points.size());
      asked += points.size();
      for (const MirroredLight& light : scene.mirrored_lights()) {
        if (unoccluded_irradiance(light.image, origin, node.normal) <= 0.0f) continue;
        Vec3f mirrored(0.0f);
        for (const Vec2f& point : mirror_points) {
          mirrored += mirrored_light_sample(scene, light, point, origin, node.normal);
        }
        sum += mirrored / static_cast<float>(mirror_points.size());
        asked += 2 * mirror_points.size();
      }
      values[i] = to_float4(sum);
    });
    rays += asked;
  });
  rays_ += rays;
  if (!back) mend_hidden(grid, hidden, values);
}

void LightCache::find_mean(const TracedScene& scene) {
  Vec3 sum(0.0);
  double area = 0.0;
  for (std::uint32_t m = 0; m < scene.scene().meshes.size(); ++m) {
    const SceneMesh& mesh = scene.scene().meshes[m];
    for (std::uint32_t i = 0; i < mesh.triangles.size() / 3; ++i) {
      const Vec3 p0(mesh.positions[mesh.triangles[3 * i]]),
          p1(mesh.positions[mesh.triangles[3 * i + 1]]),
          p2(mesh.positions[mesh.triangles[3 * i + 2]]);
      const double part = 0.5 * glm::length(glm::cross(p1 - p0, p2 - p0));
      RayHit middle;
      middle.mesh = m;
      middle.triangle = i;
      middle.u = middle.v = 1.0f / 3.0f;
      sum += part * Vec3(to_vector(interpolate(coarse_, bounced_[0], middle)));
      area += part;
    }
  }
  if (area > 0.0) all_.mean_bounced = Vec3f(sum / area);
}

}  // namespace polyhull
