// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/subject_light.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>

#include "base/thread_pool.h"
#include "raytrace/sampling.h"
#include "raytrace/traced_scene.h"
#include "render/light_samples.h"

namespace polyhull {
namespace {

constexpr float cell_length = 0.125f;  // metres; that of larger or farther subjects is doubled
constexpr int most_cells = 32;         // along an axis of a subject
constexpr double most_away = 1 << 20;  // cells from the origin
constexpr std::size_t most_kept = 1u << 18;
constexpr std::size_t most_lattices = 16;
constexpr float brightest = 4.0f;  // f
const Vec3f stage_middle(0.0f, 1.0f, 0.0f);

/// Phi at points of a scene.
class Irradiance {
 public:
  /// \p bodies: places within bodies count as the nearest ones out of them.
  Irradiance(std::span<const Light> lights, const Vec3f& sky, const TracedScene& scene, bool bodies)
      : lights_(lights), scene_(scene), bodies_(bodies) {
    if (!scene.scene().environment) sky_ = sky;  // which has lights of its own
    // Those far away are as strong as they are felt here.
    for (const Light& light : lights) {
      const Vec3f way = light.centre - stage_middle;
      powers_.push_back((powers_.empty() ? 0.0f : powers_.back()) +
                        light_strength(light) / std::max(glm::dot(way, way), 1.0f));
    }
  }

  /// What surfaces and the sky give there.
  Vec3f indirect(const Vec3f& point) const { return look_around(point).indirect; }
  /// Whether the point seems to be within a closed body.
  bool within(const Vec3f& point) const { return look_around(point).within; }

  /// Phi, and what it is the mean of.
  struct Arriving {
    Vec3f mean{0.0f};
    LightMoments indirect;
    std::vector<float> direct;  // LightLattice::direct
  };
  Arriving at(const Vec3f& point) const {
    const Around around = look_around(point);
    if (!around.within || !bodies_) return with_direct(point, around);
    return with_direct(around.out, look_around(around.out));
  }

 private:
  static constexpr int ways = 64;
  static constexpr float solid_angle = 4.0f * std::numbers::pi_v<float> / ways;

  struct Around {
    Vec3f indirect{0.0f};
    LightMoments moments;
    bool within = false;  // a closed body
    Vec3f out{0.0f};      // then, the nearest place out of it
  };

  /// What surfaces and the sky send there from all sides.
  Around look_around(const Vec3f& point) const {
    rays_.resize(ways);
    hits_.resize(ways);
    for (std::size_t i = 0; i < ways; ++i) {
      const Vec2f at = sample_point(static_cast<std::uint32_t>(i), 1u);
      const float up = 2.0f * at.x - 1.0f, angle = 2.0f * std::numbers::pi_v<float> * at.y;
      const float flat = std::sqrt(std::max(0.0f, 1.0f - up * up));
      rays_[i] = {point, 0.0f, {flat * std::cos(angle), up, flat * std::sin(angle)}};
    }
    scene_.caster().intersect(rays_, hits_, false);
    Around out;
    int backs = 0;
    float nearest = std::numeric_limits<float>::infinity();
    for (std::size_t i = 0; i < ways; ++i) {
      const RayHit& hit = hits_[i];
      const Vec3f& way = rays_[i].direction;
      if (!hit.hit()) {
        out.indirect += sky_;
        out.moments.add(way, solid_angle * sky_);
        continue;
      }
      const Surface at = scene_.plain_surface(rays_[i], hit);
      backs += at.back && !at.material->double_sided;
      if (hit.distance < nearest) {
        nearest = hit.distance;
        out.out = point + (hit.distance + 0.02f) * way;
      }
      const Vec3f radiance = sent(at, hit, way, static_cast<std::uint32_t>(i));
      out.indirect += radiance;
      out.moments.add(way, solid_angle * radiance);
    }
    out.indirect *= std::numbers::pi_v<float> / static_cast<float>(ways);
    out.within = backs > ways * 3 / 4;
    return out;
  }

  /// The light of the lamps that a surface scatters against \p direction, from one of their places.
  Vec3f sent(const Surface& at, const RayHit& hit, const Vec3f& direction,
             std::uint32_t number) const {
    Vec3f out = at.light < 0 ? at.emission : Vec3f(0.0f);
    if (powers_.empty() || !(powers_.back() > 0.0f)) return out;
    // One lamp, the stronger the likelier.
    const Vec2f which = sample_point(number, 2u);
    const auto lamp = std::min<std::ptrdiff_t>(
        std::upper_bound(powers_.begin(), powers_.end(), which.x * powers_.back()) -
            powers_.begin(),
        std::ssize(powers_) - 1);
    const auto chosen = static_cast<std::size_t>(lamp);
    const float share =
        (powers_[chosen] - (chosen > 0 ? powers_[chosen - 1] : 0.0f)) / powers_.back();
    if (!(share > 0.0f)) return out;
    Vec3f scattered = scene_.base_colour(hit) / std::numbers::pi_v<float>;
    if (at.material->is_mirror())
      scattered *= (Vec3f(1.0f) - fresnel(at.material->f0(), -glm::dot(direction, at.normal))) *
                   (1.0f - at.material->metallic);
    return out + scattered / share *
                     light_sample(scene_, lights_[chosen], sample_point(number, 3u),
                                  at.point + scene_.epsilon() * at.geometric, at.normal);
  }

  Arriving with_direct(const Vec3f& point, const Around& around) const {
    Arriving out{Vec3f(0.0f), around.moments, {}};
    for (const Light& light : lights_) {
      Given given = from(light, point, 4);
      // Where some of its places are hidden, more are asked.
      if (given.hidden != 0 && given.hidden != given.places) given = from(light, point, 8);
      out.mean += given.irradiance;
      out.direct.push_back(given.facing);
    }
    out.mean = around.indirect + out.mean;
    return out;
  }

  struct Given {
    Vec3f irradiance{0.0f};
    float facing = 0.0f;  // of what faces it, per power
    int hidden = 0, places = 0;
  };
  /// By the middles of side x side parts of the light.
  Given from(const Light& light, const Vec3f& point, int side) const {
    const std::vector<Vec3> places = light_cells(light, side * side);
    const Vec3f normal = light_normal(light), power = light_power(light);
    rays_.resize(places.size());
    blocked_.resize(places.size());
    for (std::size_t i = 0; i < places.size(); ++i)
      rays_[i] = {point, 0.0f, Vec3f(places[i]) - point, 1.0f - 1e-4f};
    scene_.caster().occluded(rays_, blocked_);
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
      out.irradiance += exit / (4.0f * square) * power;
      out.facing += exit / square;
    }
    out.irradiance /= static_cast<float>(places.size());
    out.facing /= static_cast<float>(places.size());
    return out;
  }

  const std::span<const Light> lights_;
  const TracedScene& scene_;
  const bool bodies_;
  Vec3f sky_{0.0f};
  std::vector<float> powers_;  // at the stage, of the lights up to each
  static thread_local std::vector<Ray> rays_;
  static thread_local std::vector<RayHit> hits_;
  static thread_local std::vector<std::uint8_t> blocked_;
};
thread_local std::vector<Ray> Irradiance::rays_;
thread_local std::vector<RayHit> Irradiance::hits_;
thread_local std::vector<std::uint8_t> Irradiance::blocked_;

/// Nodes lie at the middles of cells, so that none is in a floor at a round height.
Vec3f place_of(int x, int y, int z, float cell) {
  return cell * (Vec3f(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)) + 0.5f);
}

}  // namespace

std::size_t SubjectLight::Hash::operator()(const Node& node) const {
  std::uint64_t hash = 0;
  for (const int i : node) hash = (hash ^ static_cast<std::uint32_t>(i)) * 0x9e3779b97f4a7c15u;
  return static_cast<std::size_t>(hash ^ hash >> 32);
}

std::shared_ptr<const LightLattice> SubjectLight::around(const PlacedSubject& subject,
                                                         const RenderFrame& frame,
                                                         const TracedScene& scene) {
  found_ = 0;
  if (scene_ != frame.scene || lights_ != frame.lights || ambient_ != frame.ambient ||
      sky_ != frame.sky || undimmed_ != frame.undimmed || undimmed_sky_ != frame.undimmed_sky) {
    scene_ = frame.scene;
    lights_ = frame.lights;
    ambient_ = frame.ambient;
    sky_ = frame.sky;
    undimmed_ = frame.undimmed;
    undimmed_sky_ = frame.undimmed_sky;
    nodes_.clear();
    lattices_.clear();
    const Irradiance irradiance(frame.lights, frame.sky, scene, false);
    bodies_ = !irradiance.within(stage_middle);
    const Vec3f indirect = irradiance.indirect(stage_middle);
    rest_ = glm::max(frame.ambient - indirect, Vec3f(0.0f));
    stage_ = irradiance.at(stage_middle).mean + rest_;
    if (!frame.undimmed.empty() || frame.undimmed_sky) {
      const Irradiance before(frame.undimmed.empty() ? frame.lights : frame.undimmed,
                              frame.undimmed_sky.value_or(frame.sky), scene, false);
      const Vec3f lit = before.at(stage_middle).mean, scattered = before.indirect(stage_middle);
      if (std::max({lit.x, lit.y, lit.z}) > 0.0f)
        for (int c = 0; c < 3; ++c)
          stage_[c] = lit[c] + rest_[c] * (indirect[c] > 0.0f ? scattered[c] / indirect[c] : 1.0f);
    }
  }
  if (!(std::max({stage_.x, stage_.y, stage_.z}) > 0.0f)) return nullptr;
  const Part part = part_around(bounds_of(subject.points));
  auto kept = std::find_if(lattices_.begin(), lattices_.end(),
                           [&](const auto& lattice) { return lattice.first == part; });
  if (kept == lattices_.end()) {
    if (lattices_.size() < most_lattices) lattices_.emplace_back();
    kept = lattices_.end() - 1;
    *kept = {part, std::make_shared<const LightLattice>(lattice(part, frame, scene))};
  }
  std::rotate(lattices_.begin(), kept, kept + 1);
  return lattices_.front().second;
}

SubjectLight::Part SubjectLight::part_around(const Bounds& box) {
  double extent = 0.0, away = 0.0;
  for (int k = 0; k < 3; ++k) {
    extent = std::max(extent, box.max[k] - box.min[k]);
    away = std::max({away, std::abs(box.min[k]), std::abs(box.max[k])});
  }
  Part out;
  float cell = cell_length;
  for (; extent > most_cells * static_cast<double>(cell) || away > most_away * cell; cell *= 2.0f)
    ++out.doubled;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto axis = static_cast<int>(k);
    out.first[k] = static_cast<int>(std::floor(box.min[axis] / cell - 0.5));
    const int last = static_cast<int>(std::ceil(box.max[axis] / cell - 0.5));
    out.size[k] = std::max(last - out.first[k] + 1, 2);
  }
  // Half a cell or more over the lowest point.
  out.floor = static_cast<int>(std::ceil(box.min.y / cell)) - out.first[1];
  out.size[1] = std::max(out.size[1], out.floor + 1);
  return out;
}

LightLattice SubjectLight::lattice(const Part& part, const RenderFrame& frame,
                                   const TracedScene& scene) {
  const std::array<int, 3>& first = part.first;
  const int floor = part.floor, doubled = part.doubled;
  LightLattice out;
  const float cell = out.cell = std::ldexp(cell_length, doubled);
  out.size = part.size;
  out.origin = place_of(first[0], first[1], first[2], cell);
  const auto [nx, ny, nz] = out.size;
  out.factors.resize(static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny) *
                     static_cast<std::size_t>(nz));
  out.lamps = frame.lights;
  const std::size_t lamps = out.lamps.size();
  out.indirect.resize(out.factors.size());
  out.direct.resize(out.factors.size() * lamps);
  const auto node = [x_nodes = nx, y_nodes = ny](int x, int y, int z) {
    return static_cast<std::size_t>((z * y_nodes + y) * x_nodes + x);
  };

  if (nodes_.size() > most_kept / (1 + lamps / 32)) nodes_.clear();
  const auto put = [&](std::size_t at, const Found& found) {
    out.factors[at] = found.factor;
    out.indirect[at] = found.indirect;
    std::copy(found.direct.begin(), found.direct.end(), out.direct.data() + at * lamps);
  };
  std::vector<std::array<int, 3>> missing;
  for (int z = 0; z < nz; ++z)
    for (int y = floor; y < ny; ++y)
      for (int x = 0; x < nx; ++x) {
        const auto kept = nodes_.find({first[0] + x, first[1] + y, first[2] + z, doubled});
        if (kept != nodes_.end())
          put(node(x, y, z), kept->second);
        else
          missing.push_back({x, y, z});
      }
  found_ = missing.size();
  const Irradiance irradiance(frame.lights, frame.sky, scene, bodies_);
  std::vector<Found> found(missing.size());
  parallel_each(missing.size(), 16, 0, [&](std::size_t i) {
    const auto& [x, y, z] = missing[i];
    Irradiance::Arriving light =
        irradiance.at(place_of(first[0] + x, first[1] + y, first[2] + z, cell));
    const Vec3f here = light.mean + rest_;
    for (int c = 0; c < 3; ++c)
      found[i].factor[c] = stage_[c] > 0.0f ? std::min(here[c] / stage_[c], brightest) : 1.0f;
    light.indirect.add_even(rest_);
    found[i].indirect = light.indirect;
    found[i].direct = std::move(light.direct);
    put(node(x, y, z), found[i]);
  });
  for (std::size_t i = 0; i < missing.size(); ++i) {
    const auto& [x, y, z] = missing[i];
    nodes_.emplace(Node{first[0] + x, first[1] + y, first[2] + z, doubled}, std::move(found[i]));
  }

  for (int y = floor - 1; y >= 0; --y)
    for (int z = 0; z < nz; ++z)
      for (int x = 0; x < nx; ++x) {
        const std::size_t here = node(x, y, z), above = node(x, y + 1, z);
        const Vec3f& near = out.factors[above];
        const Vec3f& far = out.factors[node(x, std::min(y + 2, ny - 1), z)];
        out.factors[here] = glm::clamp(2.0f * near - far, Vec3f(0.0f), Vec3f(brightest));
        out.indirect[here] = out.indirect[above];
        std::copy_n(out.direct.data() + above * lamps, lamps, out.direct.data() + here * lamps);
      }
  return out;
}

}  // namespace polyhull
