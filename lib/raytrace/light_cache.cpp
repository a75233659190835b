// SPDX-License-Identifier: LGPL-2.1-or-later
#include "raytrace/light_cache.h"

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <numbers>
#include <optional>

#include "base/thread_pool.h"
#include "environment/environment.h"
#include "raytrace/lamp_share.h"
#include "raytrace/sampling.h"

namespace polyhull {
namespace {

constexpr float pi = std::numbers::pi_v<float>;
constexpr std::uint32_t bounce_seed = 0xa54ff53aU;
constexpr int mirror_depth = 3;
constexpr std::size_t grain = 256;

SurfaceGrid::Node turned(SurfaceGrid::Node node, bool back) {
  if (back) node.normal = -node.normal;
  return node;
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
      values[i][3] = 0.0f;
      hidden[i] = 0;
    }
  }
}

constexpr float not_asked = -1.0f;  // as the fourth number of a share
constexpr float alike = 0.12f;      // shares that differ less may be interpolated between
constexpr int least_samples = 16;   // of bounced light
constexpr float sharp = 0.7f;       // shares that differ more have a border in between
// Of the environment, where a sun is a part: of its shadow.
constexpr float sharp_of_environment = 0.3f;

/// The largest difference of a colour among a block's corners.
float contrast(const std::vector<Float4>& shares, const SurfaceGrid::Block& block) {
  const auto at = corners(block);
  Float4 least = shares[at[0]], most = least;
  for (const std::uint32_t i : at) {
    least = shares[i] < least ? shares[i] : least;
    most = shares[i] > most ? shares[i] : most;
  }
  const Float4 d = most - least;
  return std::max({d[0], d[1], d[2]});
}

}  // namespace

LightCache::LightCache(const TracedScene& scene, const LightCacheOptions& options,
                       const std::atomic<bool>* stop)
    : stop_(stop),
      fine_(scene.scene(), options.spacing, options.most_nodes),
      coarse_(scene.scene(), options.bounce_spacing, options.most_nodes / 8) {
  const int sides = find_double_sided(scene.scene()) ? 2 : 1;
  for (int side = 0; side < sides && !stopped(); ++side) fill_direct(scene, options, side == 1);
  for (int side = 0; side < sides && !stopped(); ++side) fill_bounced(scene, options, side == 1);
  if (stopped()) return;
  for (int side = 0; side < sides; ++side) {
    parallel_for(fine_.size(), grain, options.threads, [&](std::size_t begin, std::size_t end) {
      fine_.for_nodes(scene.scene(), begin, end, [&](std::size_t i, const SurfaceGrid::Node& node) {
        all_.sides[side][i] += direct_[side][i] + interpolate(coarse_, bounced_[side], node.hit);
      });
    });
    refine_borders(scene, options, side == 1);
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

LightCache::LightCache(const TracedScene& scene, const LightCacheOptions& options,
                       MappedLight values)
    : LightCache(scene, options, LightValues{{}, values.mean_bounced}) {
  mapped_ = std::move(values);
}

LightValues LightCache::all_values() const {
  LightValues out = all_;
  for (std::size_t i = 0; mapped_.file && i < out.sides.size(); ++i)
    out.sides[i].assign(mapped_.sides[i].begin(), mapped_.sides[i].end());
  return out;
}

void LightCache::rest() const {
  const auto page = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));
  for (const std::span<const Float4>& side : mapped_.sides) {
    if (side.empty()) continue;
    const auto begin = reinterpret_cast<std::uintptr_t>(side.data()) / page * page;
    const auto end = reinterpret_cast<std::uintptr_t>(side.data() + side.size());
    madvise(reinterpret_cast<void*>(begin), end - begin, MADV_DONTNEED);  // refused: it stays
  }
}

bool LightCache::usable() const {
  const bool back = std::find(double_sided_.begin(), double_sided_.end(), 1) != double_sided_.end();
  const auto fits = [&](std::span<const Float4> values) {
    return values.size() >= fine_.size() && (values.size() - fine_.size()) % border_nodes == 0;
  };
  return fits(side(0)) && (back ? fits(side(1)) : side(1).empty());
}

LightValues LightCache::values_for(const TracedScene& scene,
                                   const LightCacheOptions& options) const {
  const SurfaceGrid grid(scene.scene(), options.spacing, options.most_nodes);
  LightValues out;
  out.mean_bounced = all_.mean_bounced;
  for (std::size_t number = 0; number < out.sides.size(); ++number) {
    const std::span<const Float4> own = side(number);
    std::vector<Float4>& values = out.sides[number];
    if (own.empty()) continue;
    values.resize(grid.size());
    parallel_for(grid.size(), grain, options.threads, [&](std::size_t begin, std::size_t end) {
      grid.for_nodes(scene.scene(), begin, end, [&](std::size_t i, const SurfaceGrid::Node& node) {
        values[i] = interpolate(fine_, own, node.hit);
        values[i][3] = 0.0f;
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
  const std::span<const Float4> values = side(back && double_sided_[hit.mesh] ? 1 : 0);
  const SurfaceGrid::Lookup at = fine_.lookup(hit);
  const float border = values[at.index[0]][3];
  // Of nodes at vertices the fourth number is 0.
  if (!(border > 0.0f)) return gain_ * to_vector(interpolate(fine_, values, hit));
  const auto cells = static_cast<float>(border_cells);
  const float x = cells * (at.weight[1] + at.weight[3]), y = cells * (at.weight[2] + at.weight[3]);
  const auto column = std::min(static_cast<std::uint32_t>(x), border_cells - 1u);
  const auto row = std::min(static_cast<std::uint32_t>(y), border_cells - 1u);
  const SurfaceGrid::Block cell{
      static_cast<std::uint32_t>(fine_.size() +
                                 (static_cast<std::size_t>(border) - 1) * border_nodes) +
          row * (border_cells + 1u) + column,
      border_cells + 1u, 1, 1, 0};
  return gain_ * to_vector(between(values, cell, x - static_cast<float>(column),
                                   y - static_cast<float>(row)));
}

/// The share of a lamp that each node sees.
void LightCache::ask_lamp(const TracedScene& scene, const LightCacheOptions& options,
                          const LampShare& lamp, bool back, std::vector<Float4>& shares) {
  std::atomic<std::uint64_t> rays = 0;
  const auto ask = [&](const std::vector<char>& wanted, bool thorough) {
    parallel_for(fine_.size(), grain, options.threads, [&](std::size_t begin, std::size_t end) {
      std::uint64_t asked = 0;
      fine_.for_nodes(scene.scene(), begin, end, [&](std::size_t i, const SurfaceGrid::Node& node) {
        if (!wanted[i] || (back && !double_sided_[node.mesh]) || stopped()) return;
        shares[i] = lamp.at(turned(node, back), thorough, asked);
      });
      rays += asked;
    });
  };
  std::vector<char> wanted(fine_.size(), 0);
  fine_.for_vertex_ranges([&](std::size_t begin, std::size_t end) {
    std::fill(wanted.begin() + static_cast<std::ptrdiff_t>(begin),
              wanted.begin() + static_cast<std::ptrdiff_t>(end), 1);
  });
  const std::uint32_t step = lamp.is_mirrored() ? 4 : 2;
  fine_.for_blocks(step, [&](const SurfaceGrid::Block& block) {
    for (const std::uint32_t i : corners(block)) wanted[i] = 1;
  });
  ask(wanted, false);
  std::fill(wanted.begin(), wanted.end(), 0);
  std::vector<SurfaceGrid::Block> even;
  fine_.for_blocks(step, [&](const SurfaceGrid::Block& block) {
    if (contrast(shares, block) <= alike) {
      even.push_back(block);
      return;
    }
    for (std::uint32_t t = 0; t <= block.height; ++t)
      for (std::uint32_t s = 0; s <= block.width; ++s)
        wanted[block.first + t * block.stride + s] = 1;
  });
  ask(wanted, true);
  for (const SurfaceGrid::Block& block : even) {
    for (std::uint32_t t = 0; t <= block.height; ++t) {
      for (std::uint32_t s = 0; s <= block.width; ++s) {
        Float4& share = shares[block.first + t * block.stride + s];
        if (share[3] != not_asked) continue;  // its other block asked
        share = between(shares, block, static_cast<float>(s) / static_cast<float>(block.width),
                        static_cast<float>(t) / static_cast<float>(block.height));
      }
    }
  }
  rays_ += rays;
}

/// The light of a lamp into \p values; \p hidden gets nodes that lie in bodies, unless it is null.
void LightCache::fill_lamp(const TracedScene& scene, const LightCacheOptions& options,
                           const LampShare& lamp, bool back, std::vector<Float4>& values,
                           std::vector<char>* hidden) {
  std::vector<Float4> shares(fine_.size(), Float4{0.0f, 0.0f, 0.0f, not_asked});
  ask_lamp(scene, options, lamp, back, shares);
  parallel_for(fine_.size(), grain, options.threads, [&](std::size_t begin, std::size_t end) {
    fine_.for_nodes(scene.scene(), begin, end, [&](std::size_t i, SurfaceGrid::Node node) {
      if ((back && !double_sided_[node.mesh]) || stopped()) return;
      node = turned(node, back);
      const std::optional<Vec3f> unoccluded = lamp.unoccluded(node);
      if (!unoccluded) return;
      Float4 share = shares[i];
      share[3] = 0.0f;
      if (std::max({share[0], share[1], share[2]}) > 0.0f)
        values[i] += share * to_float4(*unoccluded);
      else if (hidden != nullptr && inside_a_body(scene, node))
        (*hidden)[i] = 1;
    });
  });
  if (!options.borders || options.divided) return;
  std::vector<char>& borders = borders_[back ? 1 : 0];
  const float border = lamp.is_environment() ? sharp_of_environment : sharp;
  fine_.for_blocks(1, [&](const SurfaceGrid::Block& block) {
    if (contrast(shares, block) > border) borders[block.first] = 1;
  });
}

/// The lamps that \p options ask for, and then their images in mirrors.
std::vector<LampShare> LightCache::lamps_of(const TracedScene& scene,
                                            const LightCacheOptions& options, int first,
                                            int samples, int mirrored_samples) {
  std::vector<LampShare> lamps;
  const auto is_asked_for = [&](std::size_t light) {
    return options.lamp < 0 || static_cast<std::size_t>(options.lamp) == light;
  };
  const std::vector<Light>& lights = scene.scene().lights;
  for (std::size_t i = 0; i < lights.size(); ++i)
    if (is_asked_for(i)) lamps.emplace_back(scene, lights[i], nullptr, first, samples);
  for (const MirroredLight& light : scene.mirrored_lights())
    if (is_asked_for(light.light))
      lamps.emplace_back(scene, light.image, &light, first, mirrored_samples);
  if (options.lamp >= 0)
    for (LampShare& lamp : lamps) lamp.set_radiance(Vec3f(1.0f));
  else if (scene.scene().environment)
    lamps.emplace_back(scene, options.first_samples, options.light_samples);
  return lamps;
}

void LightCache::fill_direct(const TracedScene& scene, const LightCacheOptions& options,
                             bool back) {
  const int side = back ? 1 : 0;
  direct_[side].assign(fine_.size(), Float4{});
  std::vector<Float4>& mirrored = all_.sides[side];
  mirrored.assign(fine_.size(), Float4{});
  borders_[side].assign(fine_.size(), 0);
  std::vector<char> hidden(fine_.size(), 0);
  for (const LampShare& lamp : lamps_of(scene, options, options.first_samples,
                                        options.light_samples, options.light_samples / 2)) {
    if (lamp.is_mirrored())
      fill_lamp(scene, options, lamp, back, mirrored, nullptr);
    else
      fill_lamp(scene, options, lamp, back, direct_[side], back ? nullptr : &hidden);
  }
  if (back) return;
  std::vector<char> same = hidden;
  mend_hidden(fine_, hidden, direct_[side]);
  mend_hidden(fine_, same, mirrored);
}

void LightCache::fill_bounced(const TracedScene& scene, const LightCacheOptions& options,
                              bool back) {
  const SurfaceGrid& grid = coarse_;
  std::vector<Float4>& values = bounced_[back ? 1 : 0];
  values.assign(grid.size(), Float4{});
  // Dense meshes have a node at each vertex, however many: then each asks fewer ways.
  const std::size_t most = options.most_nodes / 8;
  const int samples =
      grid.size() <= most
          ? options.bounce_samples
          : std::max(least_samples,
                     static_cast<int>(options.bounce_samples * (static_cast<double>(most) /
                                                                static_cast<double>(grid.size()))));
  const std::vector<Vec2f> points = spread_points(samples, bounce_seed);
  std::vector<char> hidden(grid.size(), 0);
  std::atomic<std::uint64_t> rays = 0;
  // L_1 along a ray from a node, as the path tracer has it but with the straight light from the
  // cache. Backs of single-sided surfaces are seen from inside bodies only: dark, and counted.
  const bool alone = options.lamp >= 0;
  const auto emission = [&](const Surface& surface) {
    return alone ? Vec3f(surface.light == options.lamp ? 1.0f : 0.0f) : surface.emission;
  };
  // The environment is straight light but for what mirrors bring of it: that is the mean over the directions
  // which four rays stand for, since of a sun that none or one of them meets each node would have as much too much.
  const Environment* environment = scene.scene().environment.get();
  const auto beyond = [&](const Vec3f& way, int depth) {
    if (environment == nullptr) return scene.scene().sky;
    if (depth == 0) return Vec3f(0.0f);
    return scene.scene().sky * environment->radiance(way, 4.0f * pi / static_cast<float>(samples));
  };
  const auto bounce = [&](Ray ray, RayHit hit, std::uint64_t& asked, int& backs) {
    Vec3f radiance(0.0f), throughput(1.0f);
    bool planar = true;
    for (int depth = 0;; ++depth) {
      if (!hit.hit()) {
        if (!alone) radiance += throughput * beyond(ray.direction, depth);
        break;
      }
      const Surface surface = scene.plain_surface(ray, hit);
      if (surface.back && !double_sided_[hit.mesh]) {
        if (depth == 0) ++backs;
        break;
      }
      if (surface.light < 0 || depth > 1 || !planar) radiance += throughput * emission(surface);
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
      const Vec3f origin = ray_start(scene, node);
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
