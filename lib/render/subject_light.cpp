// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/subject_light.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

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
  Irradiance(const RenderFrame& frame, const TracedScene& scene, bool bodies)
      : frame_(frame), scene_(scene), bodies_(bodies) {
    for (const Light& light : frame.lights)
      powers_.push_back((powers_.empty() ? 0.0f : powers_.back()) + light_strength(light));
  }

  /// What surfaces and the sky give there.
  Vec3f indirect(const Vec3f& point) const { return look_around(point).indirect; }
  /// Whether the point seems to be within a closed body.
  bool within(const Vec3f& point) const { return look_around(point).within; }

  Vec3f at(const Vec3f& point) const {
    const Around around = look_around(point);
    if (!around.within || !bodies_) return around.indirect + direct(point);
    return look_around(around.out).indirect + direct(around.out);
  }

 private:
  static constexpr int ways = 64;

  struct Around {
    Vec3f indirect{0.0f};
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
      if (!hit.hit()) {
        out.indirect += frame_.sky;
        continue;
      }
      const Surface at = scene_.plain_surface(rays_[i], hit);
      backs += at.back && !at.material->double_sided;
      if (hit.distance < nearest) {
        nearest = hit.distance;
        out.out = point + (hit.distance + 0.02f) * rays_[i].direction;
      }
      out.indirect += sent(at, hit, rays_[i].direction, static_cast<std::uint32_t>(i));
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
                     light_sample(scene_, frame_.lights[chosen], sample_point(number, 3u),
                                  at.point + scene_.epsilon() * at.geometric, at.normal);
  }

  Vec3f direct(const Vec3f& point) const {
    Vec3f sum(0.0f);
    for (const Light& light : frame_.lights) {
      const Given few = from(light, point, 4);
      // Where some of its places are hidden, more are asked.
      sum += few.hidden == 0 || few.hidden == few.places ? few.irradiance
                                                         : from(light, point, 8).irradiance;
    }
    return sum;
  }

  struct Given {
    Vec3f irradiance{0.0f};
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
    }
    out.irradiance /= static_cast<float>(places.size());
    return out;
  }

  const RenderFrame& frame_;
  const TracedScene& scene_;
  const bool bodies_;
  std::vector<float> powers_;  // of the lights up to each
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

Vec3f LightLattice::at(const Vec3f& point) const {
  int low[3];
  float share[3];
  for (int k = 0; k < 3; ++k) {
    const int last = size[static_cast<std::size_t>(k)] - 1;
    // NaN counts as 0.
    const float t = point[k] > 0.0f ? std::min(point[k], static_cast<float>(last)) : 0.0f;
    low[k] = std::min(static_cast<int>(t), last - 1);
    share[k] = t - static_cast<float>(low[k]);
  }
  const int dy = size[0], dz = size[0] * size[1];
  const Vec3f* const f =
      &factors[static_cast<std::size_t>((low[2] * size[1] + low[1]) * size[0] + low[0])];
  const auto along_x = [&](const Vec3f* p) { return p[0] + share[0] * (p[1] - p[0]); };
  const auto along_y = [&](const Vec3f* p) {
    const Vec3f a = along_x(p);
    return a + share[1] * (along_x(p + dy) - a);
  };
  const Vec3f a = along_y(f);
  return a + share[2] * (along_y(f + dz) - a);
}

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
      sky_ != frame.sky) {
    scene_ = frame.scene;
    lights_ = frame.lights;
    ambient_ = frame.ambient;
    sky_ = frame.sky;
    nodes_.clear();
    lattices_.clear();
    const Irradiance irradiance(frame, scene, false);
    bodies_ = !irradiance.within(stage_middle);
    rest_ = glm::max(frame.ambient - irradiance.indirect(stage_middle), Vec3f(0.0f));
    stage_ = irradiance.at(stage_middle) + rest_;
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
  const auto at = [&, x_nodes = nx, y_nodes = ny](int x, int y, int z) -> Vec3f& {
    return out.factors[static_cast<std::size_t>((z * y_nodes + y) * x_nodes + x)];
  };

  if (nodes_.size() > most_kept) nodes_.clear();
  std::vector<std::array<int, 3>> missing;
  for (int z = 0; z < nz; ++z)
    for (int y = floor; y < ny; ++y)
      for (int x = 0; x < nx; ++x) {
        const auto kept = nodes_.find({first[0] + x, first[1] + y, first[2] + z, doubled});
        if (kept != nodes_.end())
          at(x, y, z) = kept->second;
        else
          missing.push_back({x, y, z});
      }
  found_ = missing.size();
  const Irradiance irradiance(frame, scene, bodies_);
  parallel_for(missing.size(), 16, 0, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto& [x, y, z] = missing[i];
      const Vec3f here =
          irradiance.at(place_of(first[0] + x, first[1] + y, first[2] + z, cell)) + rest_;
      for (int c = 0; c < 3; ++c)
        at(x, y, z)[c] = stage_[c] > 0.0f ? std::min(here[c] / stage_[c], brightest) : 1.0f;
    }
  });
  for (const auto& [x, y, z] : missing)
    nodes_.emplace(Node{first[0] + x, first[1] + y, first[2] + z, doubled}, at(x, y, z));

  for (int y = floor - 1; y >= 0; --y)
    for (int z = 0; z < nz; ++z)
      for (int x = 0; x < nx; ++x) {
        const Vec3f& near = at(x, y + 1, z);
        const Vec3f& far = at(x, std::min(y + 2, ny - 1), z);
        at(x, y, z) = glm::clamp(2.0f * near - far, Vec3f(0.0f), Vec3f(brightest));
      }
  return out;
}

}  // namespace polyhull
