// SPDX-License-Identifier: LGPL-2.1-or-later
#include "matte_damage.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "figure.h"
#include "silhouette/contour/contourer.h"
#include "studio/cameras/camera_picture.h"

namespace polyhull::test {
namespace {

constexpr double clearance = 3.0;  // px, of holes and specks from the outline

/// A closed curve around (x, y) whose radius changes with the angle.
struct Blob {
  double x, y, radius, phase2, phase3;
  /// Px inside it, negative outside, roughly.
  double depth(double px, double py) const {
    const double angle = std::atan2(py - y, px - x);
    return radius *
               (1.0 + 0.15 * std::sin(2 * angle + phase2) + 0.1 * std::sin(3 * angle + phase3)) -
           std::hypot(px - x, py - y);
  }
};

void recount(Matte& matte) {
  for (int y = 0; y < matte.height; ++y) find_states(matte.row(y), matte.width, matte.state_row(y));
}

template <class Visit>
void visit_around(const Matte& matte, const Blob& blob, double margin, Visit visit) {
  const double reach = 1.25 * blob.radius + margin + 1.0;
  const int x0 = std::max(0, static_cast<int>(blob.x - reach));
  const int x1 = std::min(matte.width - 1, static_cast<int>(blob.x + reach) + 1);
  const int y0 = std::max(0, static_cast<int>(blob.y - reach));
  const int y1 = std::min(matte.height - 1, static_cast<int>(blob.y + reach) + 1);
  for (int y = y0; y <= y1; ++y)
    for (int x = x0; x <= x1; ++x) visit(x, y);
}

bool allowed(const Matte& matte, const Blob& blob, Damage kind) {
  int covered = 0, bare = 0;
  const double margin = kind == Damage::bite ? 0.0 : clearance;
  visit_around(matte, blob, margin, [&](int x, int y) {
    if (blob.depth(x, y) <= -margin) return;
    ++(matte.row(y)[x] >= 128 ? covered : bare);
  });
  if (kind == Damage::hole) return bare == 0;
  if (kind == Damage::speck) return covered == 0;
  // A bite that takes all of a limb's end is one, too, but some must remain outside and inside.
  return bare > 0 && covered > bare;
}

}  // namespace

std::vector<Matte> mattes_of(const std::shared_ptr<const Subject>& subject, const Rig& rig,
                             double time) {
  std::vector<Matte> mattes;
  for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
    CameraPicture picture(rig, static_cast<int>(i), subject, PictureQuality::exact);
    picture.set_time(time);
    Matte& matte = mattes.emplace_back();
    matte.resize(rig.cameras[i].width, rig.cameras[i].height);
    picture.matte(matte.values.data(), matte.stride);
    recount(matte);
  }
  return mattes;
}

Matte matte_of(const Rings& rings, int width, int height) {
  Matte matte;
  matte.resize(width, height);
  std::vector<float> coverage(static_cast<std::size_t>(width));
  constexpr int lines = 8;  // of each row
  for (int y = 0; y < height; ++y) {
    std::fill(coverage.begin(), coverage.end(), 0.0f);
    for (int line = 0; line < lines; ++line) {
      const float at = static_cast<float>(y) - 0.5f + (static_cast<float>(line) + 0.5f) / lines;
      std::vector<float> crossings;
      for (std::size_t r = 0; r < rings.size(); ++r) {
        const auto ring = rings.ring(r);
        Vec2f last = ring.back();
        for (const Vec2f& next : ring) {
          if ((last.y <= at) != (next.y <= at))
            crossings.push_back(last.x + (at - last.y) * (next.x - last.x) / (next.y - last.y));
          last = next;
        }
      }
      std::sort(crossings.begin(), crossings.end());
      for (std::size_t k = 0; k + 1 < crossings.size(); k += 2) {
        const int first = std::max(0, static_cast<int>(crossings[k] + 0.5f));
        const int end = std::min(width - 1, static_cast<int>(crossings[k + 1] + 0.5f));
        for (int x = first; x <= end; ++x)
          coverage[x] +=
              std::clamp(std::min(crossings[k + 1], x + 0.5f) - std::max(crossings[k], x - 0.5f),
                         0.0f, 1.0f) /
              lines;
      }
    }
    for (int x = 0; x < width; ++x)
      matte.row(y)[x] = static_cast<std::uint8_t>(255.0f * std::min(1.0f, coverage[x]) + 0.5f);
  }
  recount(matte);
  return matte;
}

bool damage(Matte& matte, Damage kind, double diameter, Dice& dice) {
  int left = matte.width, right = -1, top = matte.height, bottom = -1;
  for (int y = 0; y < matte.height; ++y)
    for (int x = 0; x < matte.width; ++x)
      if (matte.row(y)[x] >= 128) {
        left = std::min(left, x), right = std::max(right, x);
        top = std::min(top, y), bottom = std::max(bottom, y);
      }
  if (right < left) return false;
  const double margin = kind == Damage::speck ? 60.0 + diameter : 0.0;
  for (int attempt = 0; attempt < 2000; ++attempt) {
    const Blob blob{dice.between(left - margin, right + margin),
                    dice.between(top - margin, bottom + margin), 0.5 * diameter,
                    dice.between(0.0, 6.28), dice.between(0.0, 6.28)};
    if (blob.x < 1 || blob.y < 1 || blob.x > matte.width - 2 || blob.y > matte.height - 2) continue;
    if (!allowed(matte, blob, kind)) continue;
    visit_around(matte, blob, 0.0, [&](int x, int y) {
      const double share = std::clamp(blob.depth(x, y) + 0.5, 0.0, 1.0);
      std::uint8_t& value = matte.row(y)[x];
      if (kind == Damage::speck) {
        value = std::max(value, static_cast<std::uint8_t>(255.0 * share));
      } else {
        value = std::min(value, static_cast<std::uint8_t>(255.0 * (1.0 - share)));
      }
    });
    recount(matte);
    return true;
  }
  return false;
}

Rings standing_silhouette(const Camera& camera, double time) {
  std::vector<Capsule> body = walking_figure(time);
  const auto upright = [](const Vec3& p) { return Vec3(p.x, p.z + 0.95, -p.y); };
  for (Capsule& part : body) part.a = upright(part.a), part.b = upright(part.b);
  return silhouette_of(body, camera, 2.0);
}

double total_area(const Rings& rings) {
  double area = 0.0;
  for (std::size_t i = 0; i < rings.size(); ++i) area += ring_area(rings.ring(i));
  return area;
}

Rings contours_of(const Matte& matte) {
  ContourSettings settings;
  settings.approximate.tolerance = 0.5;
  settings.approximate.min_edges = 3;
  settings.approximate.min_area = 0.0;
  settings.steadiness = 0.0;
  Contourer contourer;
  return contourer.find(matte, settings);
}

Rig ring_around_person(int count, std::uint64_t seed) {
  Dice dice(seed);
  Rig rig;
  for (int i = 0; i < count; ++i) {
    const double jitter = seed == 0 ? 0.0 : dice.between(-0.35, 0.35);
    const double angle = 2.0 * std::numbers::pi * (i + jitter) / count;
    const double height = seed == 0 ? 0.6 + 0.45 * ((i * 3) % 5) : dice.between(0.6, 2.4);
    const double flat = std::sqrt(9.0 - (height - 0.9) * (height - 0.9));
    const Vec3 eye(flat * std::sin(angle), height, flat * std::cos(angle));
    const Vec3 forward = glm::normalize(Vec3(0.0, 0.9, 0.0) - eye);
    const Vec3 right = glm::normalize(glm::cross(forward, Vec3(0.0, 1.0, 0.0)));
    Camera camera;
    camera.name = "cam" + std::to_string(i);
    camera.width = 1024, camera.height = 768;
    camera.K = from_rows({700, 0, 511.5, 0, 700, 383.5, 0, 0, 1});
    camera.R = glm::transpose(Mat3(right, glm::cross(forward, right), forward));
    camera.t = -(camera.R * eye);
    rig.cameras.push_back(camera);
  }
  rig.bounds = Bounds{Vec3(-1.2, -0.1, -1.2), Vec3(1.2, 2.2, 1.2)};
  return rig;
}

}  // namespace polyhull::test
