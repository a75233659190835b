// SPDX-License-Identifier: LGPL-2.1-or-later
#include "hull/subject_size.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <limits>
#include <vector>

#include "base/median.h"
#include "hull/measure.h"
#include "rig/rig.h"

namespace polyhull {
namespace {

constexpr double highest = 5.0, longest = 10.0;  // metres, of what hangs together
constexpr double usual_distance = 3.0;           // metres, of cameras from a subject

/// The range along up and the three axes.
struct Ranges {
  std::array<double, 4> least, most;
  Ranges() {
    least.fill(std::numeric_limits<double>::infinity());
    most.fill(-std::numeric_limits<double>::infinity());
  }
  void add(const Vec3& p, const Vec3& up) {
    const std::array<double, 4> along{glm::dot(p, up), p.x, p.y, p.z};
    for (std::size_t i = 0; i < 4; ++i)
      least[i] = std::min(least[i], along[i]), most[i] = std::max(most[i], along[i]);
  }
  double height() const { return most[0] - least[0]; }
  double extent() const {
    return std::max({most[1] - least[1], most[2] - least[2], most[3] - least[3]});
  }
  Vec3 middle() const {
    return 0.5 * Vec3(least[1] + most[1], least[2] + most[2], least[3] + most[3]);
  }
};

std::string text_of(double metres) {
  return metres < 100.0 ? fmt::format("{:.3g} m", metres) : fmt::format("{:.0f} m", metres);
}

}  // namespace

SubjectSize subject_size(const Hull& hull, std::span<const Vec3> centres, const Vec3& up,
                         double metres_per_unit, bool bounded) {
  SubjectSize size;
  const bool endless = !bounded && std::any_of(hull.faces.begin(), hull.faces.end(),
                                               [](const HullFace& face) { return face.view < 0; });
  if (hull.empty() || endless || centres.empty()) return size;
  const Vec3 upwards = glm::normalize(up);
  Ranges all;
  for (const Vec3f& vertex : hull.vertices) all.add(Vec3(vertex), upwards);
  size.known = true;
  size.height = size.part = metres_per_unit * all.height();
  size.extent = metres_per_unit * all.extent();
  std::vector<double> distances;
  for (const Vec3& centre : centres)
    distances.push_back(metres_per_unit * glm::length(centre - hull.origin - all.middle()));
  size.distance = median(distances);
  if (size.height <= highest && size.extent <= longest) return size;
  const std::vector<std::uint32_t> parts = connected_parts(hull);
  std::vector<Ranges> ranges(hull.vertices.size());
  size.part = size.extent = 0.0;
  for (std::size_t v = 0; v < parts.size(); ++v)
    ranges[parts[v]].add(Vec3(hull.vertices[v]), upwards);
  for (std::size_t v = 0; v < parts.size(); ++v) {
    if (parts[v] != v) continue;
    size.part = std::max(size.part, metres_per_unit * ranges[v].height());
    size.extent = std::max(size.extent, metres_per_unit * ranges[v].extent());
  }
  return size;
}

bool is_implausible(const SubjectSize& size) {
  return size.known && (size.distance < nearest_stage || size.distance > farthest_stage ||
                        size.part > highest || size.extent > longest);
}

std::string about_size(const SubjectSize& size, const std::string& unit) {
  Rig now, then;
  now.unit = unit;
  then.unit = likely_unit(size.distance / now.metres_per_unit(), usual_distance);
  const double times = then.metres_per_unit() / now.metres_per_unit();
  std::string text = fmt::format(
      "The subject is {} high and the cameras are {} away from it, by a rig whose unit is {}. ",
      text_of(size.part), text_of(size.distance), unit);
  if (then.unit == unit)
    return text +
           "Unless there is something so large, the unit or the rig is wrong, or a matte lets "
           "through what stands beside the subject.";
  return text + fmt::format(
                    "That unit is probably wrong: if the rig's lengths are in {}, the subject "
                    "is {} high. Write \"unit\": \"{}\" into the rig file.",
                    then.unit, text_of(size.part * times), then.unit);
}

}  // namespace polyhull
