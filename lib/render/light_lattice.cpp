// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/light_lattice.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/thread_pool.h"
#include "render/frame.h"
#include "render/light_samples.h"
#include "render/projection.h"

namespace polyhull {
namespace {

constexpr int ways = 32;             // in which a body may hide what comes from all sides
constexpr float body_albedo = 0.3f;  // of skin and clothes, more or less

/// Where a point lies among the nodes: the first of the eight around it, and how far beyond it.
struct Cell {
  std::size_t node;
  float share[3];
  int dy, dz;  // nodes to the next row, to the next layer

  Cell(const std::array<int, 3>& size, const Vec3f& point) {
    int low[3];
    for (int k = 0; k < 3; ++k) {
      const int last = size[static_cast<std::size_t>(k)] - 1;
      // NaN counts as 0.
      const float t = point[k] > 0.0f ? std::min(point[k], static_cast<float>(last)) : 0.0f;
      low[k] = std::min(static_cast<int>(t), last - 1);
      share[k] = t - static_cast<float>(low[k]);
    }
    dy = size[0];
    dz = size[0] * size[1];
    node = static_cast<std::size_t>(low[2] * dz + low[1] * dy + low[0]);
  }
  /// Calls use(node, weight) for the eight around it.
  template <typename Use>
  void for_corners(const Use& use) const {
    for (int corner = 0; corner < 8; ++corner) {
      float weight = 1.0f;
      for (int k = 0; k < 3; ++k) weight *= corner >> k & 1 ? share[k] : 1.0f - share[k];
      use(node +
              static_cast<std::size_t>((corner & 1) + (corner >> 1 & 1) * dy + (corner >> 2) * dz),
          weight);
    }
  }
};

/// Unit normals at the vertices of a mesh; 0 where it has no area.
std::vector<Vec3f> normals_of(const Mesh& mesh) {
  const Hull& hull = mesh.hull;
  if (hull.normals.size() == hull.vertices.size()) return hull.normals;
  if (mesh.texturing && mesh.texturing->normals.size() == hull.vertices.size())
    return mesh.texturing->normals;
  std::vector<Vec3f> out(hull.vertices.size(), Vec3f(0.0f));
  for (std::size_t f = 0; f + 2 < hull.triangles.size(); f += 3) {
    const std::uint32_t* v = &hull.triangles[f];
    const Vec3f& a = hull.vertices[v[0]];
    const Vec3f cross = glm::cross(hull.vertices[v[1]] - a, hull.vertices[v[2]] - a);
    for (int k = 0; k < 3; ++k) out[v[k]] += cross;
  }
  for (Vec3f& n : out) {
    const float length = glm::length(n);
    n = length > 0.0f ? n / length : Vec3f(0.0f);
  }
  return out;
}

/// How far beside the middle of a lamp's part, in parts, a ray of row or column \p across ends: all of
/// them are a grid that is turned a little, in which no two share a row.
float aside(int across, int side) {
  return (static_cast<float>(across) + 0.5f) / static_cast<float>(side) - 0.5f;
}

Bounds box_of(const Light& lamp) {
  const Vec3 centre(lamp.centre), reach(glm::abs(lamp.u) + glm::abs(lamp.v));
  return {centre - reach, centre + reach};
}

/// What falls on places of a body, a block of them at a time: rays to one part of a lamp, or in one
/// direction, are traced together.
class FormFinder {
 public:
  static constexpr std::size_t block = 64;

  /// \p sides: parts_of_lamps().
  FormFinder(const LightLattice& light, std::span<const int> sides, float amount,
             const Hiding& hiding)
      : light_(light), sides_(sides), amount_(amount), hiding_(hiding) {}

  /// Writes the forms at \p places, at most block of them, to \p out.
  void find(std::span<const Vec3f> places, std::span<const Vec3f> normals, Vec3f* out) {
    points_.clear();
    for (std::size_t i = 0; i < places.size(); ++i) {
      Point& at = points_.emplace_back(
          Point{places[i], normals[i], {light_.size, (places[i] - light_.origin) / light_.cell}});
      at.cell.for_corners(
          [&](std::size_t node, float weight) { at.around.add(light_.indirect[node], weight); });
      at.mean = at.even = at.around.mean();
    }
    for (std::size_t lamp = 0; lamp < light_.lamps.size(); ++lamp) add_lamp(lamp);
    if (amount_ > 0.0f) add_around();
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const Point& at = points_[i];
      const float amount = at.normal != Vec3f(0.0f) ? amount_ : 0.0f;
      const Vec3f lit = at.even + amount * (at.faced - at.even);
      for (int c = 0; c < 3; ++c) out[i][c] = at.mean[c] > 0.0f ? lit[c] / at.mean[c] : 1.0f;
    }
  }

 private:
  struct Point {
    Vec3f place, normal;
    Cell cell;
    LightMoments around{};
    Vec3f mean{0.0f};   // over all orientations, without bodies
    Vec3f even{0.0f};   // the same past others
    Vec3f faced{0.0f};  // on the surface past all
    Vec3f power{0.0f};  // of the lamp at hand: what faces it gets
  };
  /// Of a ray: what it tells of its point.
  struct Asked {
    Point* at;
    float even, faced;  // shares of Point::power
  };

  void ask(Point& at, const Vec3f& way, float far, const Asked& asked) {
    rays_.push_back({at.place + hiding_.lift * at.normal, 0.0f, way, far});
    asked_.push_back(asked);
  }

  /// Which of rays_ the body itself meets.
  void trace_own() {
    own_.assign(rays_.size(), 0);
    if (hiding_.own) hiding_.trees->hide(*hiding_.own, rays_, own_);
  }
  /// Which of rays_ others meet.
  void trace_others() {
    others_.assign(rays_.size(), 0);
    for (const Hiding::Other& other : hiding_.others)
      hiding_.trees->hide(other.number, rays_, others_);
  }

  /// The light of a lamp, by the middles of as many parts of it as it looks large.
  void add_lamp(std::size_t number) {
    const Light& lamp = light_.lamps[number];
    const Vec3f power = light_power(lamp), back = light_normal(lamp);
    const Bounds box = box_of(lamp);
    rays_.clear();
    asked_.clear();
    for (Point& at : points_) {
      float facing = 0.0f;
      at.cell.for_corners([&](std::size_t node, float weight) {
        facing += weight * light_.direct[node * light_.lamps.size() + number];
      });
      if (!(facing > 0.0f)) continue;
      at.power = facing * power;
      at.mean += 0.25f * at.power;
      const bool past = std::any_of(
          hiding_.others.begin(), hiding_.others.end(), [&](const Hiding::Other& other) {
            return stands_between(other.box, {Vec3(at.place), Vec3(at.place)}, box);
          });
      if (!past) at.even += 0.25f * at.power;
      if (!past && amount_ == 0.0f) continue;
      const Vec3f middle = lamp.centre - at.place;
      const float wide = glm::length(glm::cross(lamp.u, lamp.v)) / glm::dot(middle, middle);
      const int side = wide == 0.0f ? 1 : std::min(wide < 0.003f ? 2 : 4, sides_[number]);
      const auto along = [side](float part) { return (2.0f * part + 1.0f) / side - 1.0f; };
      const std::size_t first = asked_.size();
      float all = 0.0f;
      for (int j = 0; j < side; ++j)
        for (int i = 0; i < side; ++i) {
          const Vec3f way = middle + along(i) * lamp.u + along(j) * lamp.v;
          const float square = std::max(glm::dot(way, way), 1e-6f), distance = std::sqrt(square);
          const float given = light_exit(lamp, -glm::dot(back, way) / distance) / square;
          all += given;
          const float faced = given * std::max(glm::dot(at.normal, way) / distance, 0.0f);
          if (!past && faced == 0.0f) continue;
          // An edge along the lamp's side lets one ray after the other pass, not row by row.
          const Vec3f to =
              middle + along(i + aside(j, side)) * lamp.u + along(j - aside(i, side)) * lamp.v;
          ask(at, to - hiding_.lift * at.normal, 1.0f - 1e-4f, {&at, past ? given : 0.0f, faced});
        }
      for (std::size_t i = first; all > 0.0f && i < asked_.size(); ++i) {
        asked_[i].even /= all;
        asked_[i].faced /= all;
      }
    }
    trace_own();
    trace_others();
    for (std::size_t i = 0; i < asked_.size(); ++i) {
      const auto& [at, even, faced] = asked_[i];
      if (others_[i]) continue;
      at->even += 0.25f * even * at->power;
      if (!own_[i]) at->faced += faced * at->power;
    }
  }

  /// What comes from all sides. The directions are the same for all places, so that what is found changes
  /// smoothly over a body and does not flicker while it moves: a spiral of Fibonacci's on the sphere.
  void add_around() {
    for (Point& at : points_) at.faced += at.around.irradiance(at.normal);
    for (int k = 0; hiding_.own && k < ways; ++k) {
      const float up = 1.0f - (2.0f * static_cast<float>(k) + 1.0f) / ways;
      const float angle = 2.39996323f * static_cast<float>(k), flat = std::sqrt(1.0f - up * up);
      const Vec3f way(flat * std::cos(angle), up, flat * std::sin(angle));
      rays_.clear();
      asked_.clear();
      for (Point& at : points_) {
        const float cosine = glm::dot(at.normal, way);
        if (cosine > 0.0f)
          ask(at, way, std::numeric_limits<float>::infinity(), {&at, 0.0f, cosine});
      }
      trace_own();
      for (std::size_t i = 0; i < asked_.size(); ++i) {
        if (!own_[i]) continue;
        Point& at = *asked_[i].at;
        const float share = 4.0f * asked_[i].faced / ways;  // of even light
        at.faced +=
            share * (body_albedo * at.even - std::numbers::pi_v<float> * at.around.radiance(way));
      }
    }
    for (Point& at : points_) at.faced = glm::max(at.faced, Vec3f(0.0f));
  }

  const LightLattice& light_;
  const std::span<const int> sides_;
  const float amount_;
  const Hiding& hiding_;
  std::vector<Point> points_;
  std::vector<Ray> rays_;
  std::vector<Asked> asked_;
  std::vector<std::uint8_t> own_, others_;
};

/// Of each lamp how many parts along a side are looked at, at most: the error of one that gives less
/// counts less.
std::vector<int> parts_of_lamps(const LightLattice& light) {
  std::vector<float> given(light.lamps.size(), 0.0f);  // at most, to any node
  for (std::size_t i = 0; i < light.direct.size(); ++i)
    given[i % given.size()] = std::max(given[i % given.size()], light.direct[i]);
  float all = 0.0f;
  for (std::size_t lamp = 0; lamp < given.size(); ++lamp)
    all += given[lamp] *= light_strength(light.lamps[lamp]);
  std::vector<int> out;
  for (const float lamp : given)
    out.push_back(lamp * 8.0f >= all ? 4 : lamp * 64.0f >= all ? 2 : 1);
  return out;
}

/// Normals of the subject's vertices in the scene.
std::vector<Vec3f> scene_normals(const PlacedSubject& subject) {
  std::vector<Vec3f> out = normals_of(*subject.mesh);
  const glm::mat3 turn(glm::mat4(subject.local_to_scene));
  for (Vec3f& normal : out) {
    const Vec3f turned = turn * normal;
    const float length = glm::length(turned);
    normal = length > 0.0f ? turned / length : Vec3f(0.0f);
  }
  return out;
}

/// How far rays start over a subject's surface: a quarter of a side of its triangles, on average.
float lift_of(const PlacedSubject& subject) {
  const std::vector<std::uint32_t>& triangles = subject.mesh->hull.triangles;
  double sum = 0.0;
  for (std::size_t f = 0; f + 2 < triangles.size(); f += 3)
    sum += glm::distance(subject.points[triangles[f]], subject.points[triangles[f + 1]]);
  return static_cast<float>(0.25 * sum / static_cast<double>(triangles.size() / 3));
}

}  // namespace

void LightMoments::add(const Vec3f& way, const Vec3f& irradiance) {
  for (int k = 0; k < 3; ++k) {
    first[k] += way[k] * irradiance;
    second[k] += way[k] * way[k] * irradiance;
    second[3 + k] += way[k] * way[(k + 1) % 3] * irradiance;
  }
}

void LightMoments::add_even(const Vec3f& irradiance) {
  for (int k = 0; k < 3; ++k) second[k] += 4.0f / 3.0f * irradiance;
}

void LightMoments::add(const LightMoments& other, float share) {
  for (std::size_t k = 0; k < first.size(); ++k) first[k] += share * other.first[k];
  for (std::size_t k = 0; k < second.size(); ++k) second[k] += share * other.second[k];
}

Vec3f LightMoments::irradiance(const Vec3f& normal) const {
  Vec3f straight(0.0f), square(0.0f);
  for (int k = 0; k < 3; ++k) {
    straight += normal[k] * first[k];
    square +=
        normal[k] * normal[k] * second[k] + 2.0f * normal[k] * normal[(k + 1) % 3] * second[3 + k];
  }
  return glm::max(0.375f * mean() + 0.5f * straight + 15.0f / 32.0f * square, Vec3f(0.0f));
}

Vec3f LightMoments::radiance(const Vec3f& way) const {
  Vec3f straight(0.0f), square(0.0f), all(0.0f);
  for (int k = 0; k < 3; ++k) {
    straight += way[k] * first[k];
    square += way[k] * way[k] * second[k] + 2.0f * way[k] * way[(k + 1) % 3] * second[3 + k];
    all += second[k];
  }
  const Vec3f sum = all + 3.0f * straight + 7.5f * (square - all / 3.0f);
  return glm::max(sum / (4.0f * std::numbers::pi_v<float>), Vec3f(0.0f));
}

Vec3f LightLattice::at(const Vec3f& point) const {
  const Cell cell_of(size, point);
  const Vec3f* const f = &factors[cell_of.node];
  const auto& share = cell_of.share;
  const auto along_x = [&](const Vec3f* p) { return p[0] + share[0] * (p[1] - p[0]); };
  const auto along_y = [&](const Vec3f* p) {
    const Vec3f a = along_x(p);
    return a + share[1] * (along_x(p + cell_of.dy) - a);
  };
  const Vec3f a = along_y(f);
  return a + share[2] * (along_y(f + cell_of.dz) - a);
}

std::vector<Vec3f> find_form(const LightLattice& light, std::span<const Vec3f> places,
                             std::span<const Vec3f> normals, float amount, const Hiding& hiding) {
  std::vector<Vec3f> out(places.size(), Vec3f(1.0f));
  const std::vector<int> sides = parts_of_lamps(light);
  parallel_for(places.size(), FormFinder::block, 0, [&](std::size_t begin, std::size_t end) {
    FormFinder finder(light, sides, amount, hiding);
    for (std::size_t i = begin; i < end; i += FormFinder::block) {
      const std::size_t count = std::min(FormFinder::block, end - i);
      finder.find(places.subspan(i, count), normals.subspan(i, count), &out[i]);
    }
  });
  return out;
}

void find_forms(RenderPlan& plan, BodyTrees& trees) {
  const auto make = [&](std::size_t i) {
    const PlacedSubject& body = plan.subjects[i];
    trees.make(i, {body.points, body.mesh->hull.triangles, body.content, body.local_to_scene});
  };
  for (std::size_t i = 0; i < plan.subjects.size(); ++i) {
    PlacedSubject& subject = plan.subjects[i];
    if (!subject.shade || subject.image) continue;
    const float amount =
        subject.lighting == SubjectLighting::relit ? std::clamp(subject.relight, 0.0f, 1.0f) : 0.0f;
    Hiding hiding;
    hiding.trees = &trees;
    for (std::size_t k = 0; k < plan.subjects.size(); ++k) {
      if (k == i || plan.subjects[k].image) continue;
      const Bounds& other = plan.subjects[k].bounds;
      const std::vector<Light>& lamps = subject.shade->lamps;
      if (std::any_of(lamps.begin(), lamps.end(), [&](const Light& lamp) {
            return stands_between(other, subject.bounds, box_of(lamp));
          }))
        hiding.others.push_back({k, other});
    }
    if (amount > 0.0f) hiding.own = i;
    if (!hiding.own && hiding.others.empty()) continue;
    if (hiding.own) make(i);
    for (const Hiding::Other& other : hiding.others) make(other.number);
    hiding.lift = lift_of(subject);
    subject.form =
        find_form(*subject.shade, subject.points, scene_normals(subject), amount, hiding);
  }
  trees.drop_unused();
}

}  // namespace polyhull
