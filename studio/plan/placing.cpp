// SPDX-License-Identifier: LGPL-2.1-or-later
#include "studio/plan/placing.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <utility>

#include "base/error.h"
#include "base/thread_pool.h"
#include "studio/plan/forecast.h"

namespace polyhull {
namespace {

constexpr int azimuth_step = 5;           // degrees
constexpr std::size_t points_each = 800;  // on each body
constexpr double furthest = 30.0;         // metres
constexpr double widest = 150.0;          // degrees of a field of view
constexpr double smallest = 30.0;         // px that a person is tall
constexpr double off_wall = 0.3;          // metres for a camera's body and its plugs
constexpr double border = 0.02;           // of the picture that stays free of the stage
constexpr int finalists = 3;
constexpr int judged_side = 512;  // px of the pictures by which places are judged

Vec3 place(double azimuth, double distance, double height) {
  const double angle = azimuth * std::numbers::pi / 180.0;
  return {distance * std::sin(angle), height, distance * std::cos(angle)};
}

Camera camera_of(const PlanRequest& request) {
  Camera camera;
  camera.width = request.width;
  camera.height = request.height;
  const double focal = 0.5 * request.width / std::tan(request.fov * std::numbers::pi / 360.0);
  camera.K = from_rows({focal, 0.0, 0.5 * (request.width - 1), 0.0, focal,
                        0.5 * (request.height - 1), 0.0, 0.0, 1.0});
  return camera;
}

/// How far the corners of \p box reach from the picture's middle, 1 at its border.
double reach(const Camera& camera, const Bounds& box) {
  double most = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 p(corner & 1 ? box.max.x : box.min.x, corner & 2 ? box.max.y : box.min.y,
                 corner & 4 ? box.max.z : box.min.z);
    const auto pixel = camera.project(p);
    if (!pixel) return std::numeric_limits<double>::infinity();
    most = std::max({most, std::abs(pixel->x - camera.K[2][0]) / (0.5 * camera.width),
                     std::abs(pixel->y - camera.K[2][1]) / (0.5 * camera.height)});
  }
  return most;
}

/// From there, turned to the stage's axis so that \p box reaches least far in the picture.
Camera best_aimed(const Camera& like, const Vec3& centre, const Bounds& box) {
  Camera best;
  double least = std::numeric_limits<double>::infinity();
  for (int step = 1; step < 10; ++step) {
    const Camera camera = aimed(like, centre, Vec3(0.0, 0.1 * step * box.max.y, 0.0));
    const double its = reach(camera, box);
    if (step > 1 && !(its < least)) continue;
    least = its;
    best = camera;
  }
  return best;
}

/// As near as the whole stage stays in the picture.
Camera nearest_whole(const Camera& like, double azimuth, double height, const Stage& stage) {
  const auto at = [&](double distance) {
    return best_aimed(like, place(azimuth, distance, height), stage.bounds());
  };
  double near = 0.1, far = furthest;
  if (reach(at(far), stage.bounds()) > 1.0 - border) {
    throw Error(Error::Kind::bad_input,
                "With a field of view of {:.3g} degrees no camera within {:g} m has the whole "
                "stage in its picture; a wider field of view or a smaller stage would do.",
                2.0 * std::atan(0.5 * like.width / like.K[0][0]) * 180.0 / std::numbers::pi,
                furthest);
  }
  while (far - near > 0.01) {
    const double middle = 0.5 * (near + far);
    (reach(at(middle), stage.bounds()) > 1.0 - border ? near : far) = middle;
  }
  return at(std::ceil(20.0 * far) / 20.0);  // twentieths of a metre
}

/// Room for a person in the middle of the stage.
Bounds person_on(const Stage& stage) {
  return {Vec3(-0.5, 0.0, -0.5), Vec3(0.5, std::min(stage.height, 1.9), 0.5)};
}

/// How far from the stage's axis a camera may stand in that direction.
double wall_distance(const PlanRequest& request, double azimuth) {
  if (!request.room) return std::numeric_limits<double>::infinity();
  const Vec3 way = glm::abs(place(azimuth, 1.0, 0.0));
  const double wall = std::min((0.5 * request.room->x - off_wall) / std::max(way.x, 1e-9),
                               (0.5 * request.room->y - off_wall) / std::max(way.z, 1e-9));
  return std::floor(20.0 * wall + 1e-9) / 20.0;  // twentieths of a metre
}

std::vector<double> heights_of(const PlanRequest& request) {
  if (!request.heights.empty()) return request.heights;
  std::vector<double> heights;
  for (const double share : {0.35, 0.65, 1.0}) heights.push_back(share * request.stage.height);
  return heights;
}

/// How far a person in the middle of the stage reaches from the middle of a picture, 1 at its
/// border, from the worst of the places that far away.
double worst_reach(const PlanRequest& request, const Camera& like, double distance) {
  double worst = 0.0;
  for (const double height : heights_of(request))
    for (int azimuth = 0; azimuth < 360; azimuth += azimuth_step)
      worst = std::max(
          worst, reach(best_aimed(like, place(azimuth, distance, height), person_on(request.stage)),
                       person_on(request.stage)));
  return worst;
}

bool would_do(const PlanRequest& request) {
  try {
    candidates_of(request);
    return true;
  } catch (const Error&) {
    return false;
  }
}

/// Standing people fit better into pictures that are higher than wide. Empty where that is too
/// little.
std::string side_hint(const PlanRequest& request) {
  if (request.width <= request.height) return {};
  PlanRequest turned = request;
  std::swap(turned.width, turned.height);
  const double fov =
      360.0 / std::numbers::pi *
      std::atan(std::tan(request.fov * std::numbers::pi / 360.0) * request.height / request.width);
  turned.fov = std::round(10.0 * fov) / 10.0;  // as it is told
  if (!would_do(turned)) return {};
  return fmt::format(", or cameras on their side (--picture {}x{} --fov {:.1f})", turned.width,
                     turned.height, turned.fov);
}

/// Whether cameras that far away may stand somewhere, and enough of them see a person.
bool distance_would_do(const PlanRequest& request, double distance) {
  PlanRequest moved = request;
  moved.distance = distance;
  double farthest_wall = 0.0;
  for (int azimuth = 0; azimuth < 360; azimuth += azimuth_step)
    farthest_wall = std::max(farthest_wall, wall_distance(request, azimuth));
  return distance <= farthest_wall + 1e-9 && would_do(moved);
}

[[noreturn]] void refuse_distance(const PlanRequest& request, const Camera& like, double height) {
  const double wider = std::min(worst_reach(request, like, *request.distance), 20.0) * 0.5 *
                       like.width / like.K[0][0];
  const double degrees = std::ceil(std::atan(wider) * 360.0 / std::numbers::pi);
  double enough = std::floor(20.0 * *request.distance) / 20.0;  // twentieths of a metre
  bool fits = false;
  do {
    enough += 0.05;
    fits = worst_reach(request, like, enough) <= 1.0;
  } while (!fits && enough < furthest);
  std::string ways;
  if (degrees <= widest) ways = fmt::format("a field of view of {:.0f} degrees", degrees);
  if (fits && distance_would_do(request, enough))
    ways += fmt::format("{}a distance of {:.2f} m", ways.empty() ? "" : " or ", enough);
  if (ways.empty()) ways = fits ? "a larger room" : "a picture nearer to a square";
  throw Error(Error::Kind::bad_input,
              "From {:g} m away, {:g} m high (--heights), a person in the middle of the stage does "
              "not fit into the picture; {} would do{}.",
              *request.distance, height, ways, side_hint(request));
}

/// At the distance that is given.
Camera at_distance(const PlanRequest& request, const Camera& like, double azimuth, double height) {
  const Camera camera =
      best_aimed(like, place(azimuth, *request.distance, height), person_on(request.stage));
  if (!(reach(camera, person_on(request.stage)) <= 1.0)) refuse_distance(request, like, height);
  return camera;
}

/// Nothing where the walls are too near.
std::optional<Camera> candidate_at(const PlanRequest& request, const Camera& like, double azimuth,
                                   double height) {
  const double wall = wall_distance(request, azimuth);
  if (!request.distance) {
    const Camera camera = nearest_whole(like, azimuth, height, request.stage);
    return distance_of(camera) <= wall ? std::optional(camera) : std::nullopt;
  }
  if (wall >= *request.distance) return at_distance(request, like, azimuth, height);
  const Vec3 centre = place(azimuth, wall, height);
  const Camera camera = best_aimed(like, centre, person_on(request.stage));
  const bool on_stage = std::abs(centre.x) <= 0.5 * request.stage.width &&
                        std::abs(centre.z) <= 0.5 * request.stage.depth;
  return !on_stage && reach(camera, person_on(request.stage)) <= 1.0 ? std::optional(camera)
                                                                     : std::nullopt;
}

[[noreturn]] void refuse_room(const PlanRequest& request, std::size_t places) {
  throw Error(Error::Kind::bad_input,
              "Within the room's walls there are {} places for cameras from which {} the picture, "
              "fewer than {} cameras; a wider field of view, a smaller stage{} would do{}.",
              places,
              request.distance ? "a person in the middle of the stage fits into"
                               : "the whole stage fits into",
              request.cameras,
              request.distance ? ""
                               : ", or a distance (--distance), for which a person in the middle "
                                 "is enough,",
              side_hint(request));
}

void check(const PlanRequest& request) {
  const auto refuse = [](bool wrong, const std::string& message) {
    if (wrong) throw Error(Error::Kind::bad_input, "{}", message);
  };
  refuse(request.cameras < 2 || request.cameras > 64,
         fmt::format("A plan has 2 to 64 cameras, not {}.", request.cameras));
  refuse(
      request.width < 64 || request.height < 64 || request.width > 32768 || request.height > 32768,
      fmt::format("Pictures have 64 to 32768 pixels a side, not {}x{}.", request.width,
                  request.height));
  refuse(!(request.fov >= 10.0 && request.fov <= widest),
         fmt::format("The field of view is {:g} degrees; 10 to {:g} can be planned.", request.fov,
                     widest));
  if (request.room) {
    const Vec2 least(request.stage.width + 2.0 * off_wall, request.stage.depth + 2.0 * off_wall);
    refuse(!(request.room->x > least.x && request.room->y > least.y && request.room->x <= 100.0 &&
             request.room->y <= 100.0),
           fmt::format("The room is {:g} x {:g} m (x, z); around this stage it must be more than "
                       "{:g} x {:g} m, for cameras stand {:g} m off its walls, and at most 100 m.",
                       request.room->x, request.room->y, least.x, least.y, off_wall));
  }
  const double clear = 0.5 * std::hypot(request.stage.width, request.stage.depth);
  refuse(request.distance && !(*request.distance > clear && *request.distance <= furthest),
         fmt::format("The distance is {:g} m; it must be more than {:.2f} m, where the stage's "
                     "corners are, and at most {:g} m.",
                     request.distance.value_or(0.0), clear, furthest));
  for (const double height : request.heights) {
    refuse(
        !(height >= 0.1 && height <= 10.0),
        fmt::format("A camera {:g} m above the floor cannot be planned; 0.1 to 10 can.", height));
  }
}

using Choice = std::vector<std::size_t>;  // of candidates

/// What a choice shows but for the one at \p without.
Sight sight_of(const Choice& choice, const std::vector<Sight>& sights, std::size_t without) {
  Sight sum = no_sight(sights.front().empty.size());
  for (std::size_t k = 0; k < choice.size(); ++k) {
    if (k != without) add(sights[choice[k]], sum);
  }
  return sum;
}

struct Best {
  std::size_t candidate = 0;
  double cost = std::numeric_limits<double>::infinity();
};

Best best_with(const Sight& others, const std::vector<Sight>& sights) {
  Best best;
  for (std::size_t c = 0; c < sights.size(); ++c) {
    const double cost = cost_of(others, sights[c]);
    if (cost < best.cost) best = {c, cost};
  }
  return best;
}

struct End {
  double cost = 0.0;
  Choice choice;
  auto operator<=>(const End&) const = default;
};

/// Greedy from \p first on, then exchanged until nothing helps.
End search(std::size_t first, std::size_t count, const std::vector<Sight>& sights) {
  End end{0.0, {first}};
  while (end.choice.size() < count) {
    const Best best = best_with(sight_of(end.choice, sights, end.choice.size()), sights);
    end.choice.push_back(best.candidate);
    end.cost = best.cost;
  }
  for (bool changed = true; changed;) {
    changed = false;
    for (std::size_t k = 0; k < count; ++k) {
      const Best best = best_with(sight_of(end.choice, sights, k), sights);
      if (!(best.cost < end.cost - 1e-9)) continue;
      end = {best.cost, end.choice};
      end.choice[k] = best.candidate;
      changed = true;
    }
  }
  std::sort(end.choice.begin(), end.choice.end());
  return end;
}

std::vector<Camera> chosen(const Choice& choice, const std::vector<Camera>& candidates) {
  std::vector<Camera> cameras;
  for (const std::size_t c : choice) cameras.push_back(candidates[c]);
  std::stable_sort(cameras.begin(), cameras.end(),
                   [](const Camera& a, const Camera& b) { return azimuth_of(a) < azimuth_of(b); });
  for (std::size_t k = 0; k < cameras.size(); ++k) cameras[k].name = fmt::format("cam{}", k);
  return cameras;
}

}  // namespace

std::vector<Camera> candidates_of(const PlanRequest& request) {
  check(request);
  const Camera like = camera_of(request);
  std::vector<Camera> candidates;
  for (const double height : heights_of(request)) {
    for (int azimuth = 0; azimuth < 360; azimuth += azimuth_step) {
      if (const auto camera = candidate_at(request, like, azimuth, height))
        candidates.push_back(*camera);
    }
  }
  if (candidates.size() < static_cast<std::size_t>(request.cameras))
    refuse_room(request, candidates.size());
  const Camera& first = candidates.front();
  const double tall = first.K[0][0] * 1.75 / distance_of(first);
  if (tall < smallest) {
    throw Error(Error::Kind::bad_input,
                "A person would be {:.0f} px tall in the pictures, too little for an outline; with "
                "{:.0f} times as many pixels, a narrower field of view or less distance it works.",
                tall, std::ceil(smallest / tall));
  }
  return candidates;
}

std::vector<Camera> plan_cameras(const PlanRequest& request,
                                 const std::function<void(const std::string&)>& progress) {
  const auto say = [&](const std::string& line) {
    if (progress) progress(line);
  };
  const std::vector<Camera> candidates = candidates_of(request);
  const std::vector<StageBody> bodies =
      stage_bodies(request.stage, spread_for(candidates, request.stage));
  say(fmt::format("looking at the figure from {} places", candidates.size()));
  const std::vector<Sight> sights =
      sights_of(coarse(candidates, judged_side), bodies, surface_points(bodies, points_each));

  // Beginnings all around on the lowest height: exchanges find the others.
  const double lowest = candidates.front().centre().y;
  const auto around = std::find_if(candidates.begin(), candidates.end(), [&](const Camera& camera) {
    return std::abs(camera.centre().y - lowest) > 1e-6;
  });
  const auto starts = static_cast<std::size_t>(around - candidates.begin() + 1) / 2;
  std::vector<End> ends(starts);
  say(fmt::format("choosing {} of them, from {} beginnings", request.cameras, starts));
  parallel_each(starts, 1, 0, [&](std::size_t s) {
    ends[s] = search(2 * s, static_cast<std::size_t>(request.cameras), sights);
  });
  const std::set<End> sorted(ends.begin(), ends.end());
  std::vector<Camera> best;
  double least = std::numeric_limits<double>::infinity();
  int tried = 0;
  for (const End& end : sorted) {
    if (tried++ == finalists) break;
    const std::vector<Camera> cameras = chosen(end.choice, candidates);
    const Forecast forecast = forecast_of(coarse(cameras, judged_side), request.stage);
    // A place that no camera shows the colour of is a fault of the picture all the same.
    const double cost = forecast.refined_mean + SightError::unseen_mm * forecast.unseen;
    say(fmt::format("simulated {} of {}: {:.2f} mm from the figure", tried,
                    std::min<std::size_t>(finalists, sorted.size()), forecast.refined_mean));
    if (cost < least) least = cost, best = cameras;
  }
  return best;
}

std::optional<Camera> one_more(const std::vector<Camera>& cameras, const Stage& stage) {
  std::vector<double> distances, heights;
  for (const Camera& camera : cameras) {
    distances.push_back(distance_of(camera));
    heights.push_back(camera.centre().y);
  }
  std::sort(distances.begin(), distances.end());
  std::sort(heights.begin(), heights.end());
  const double distance = distances[distances.size() / 2];
  std::vector<Camera> candidates;
  const double low = heights.front(), high = heights.back();
  for (const double height : std::set{low, 0.5 * (low + high), high}) {
    for (int azimuth = 0; azimuth < 360; azimuth += azimuth_step) {
      const Camera camera =
          best_aimed(cameras.front(), place(azimuth, distance, height), person_on(stage));
      if (reach(camera, person_on(stage)) <= 1.0) candidates.push_back(camera);
    }
  }
  if (candidates.empty()) return std::nullopt;
  const std::vector<StageBody> bodies = stage_bodies(stage, spread_for(cameras, stage));
  const std::vector<SurfacePoint> points = surface_points(bodies, points_each);
  Sight seen = no_sight(points.size());
  for (const Sight& sight : sights_of(coarse(cameras, judged_side), bodies, points))
    add(sight, seen);
  Camera best =
      candidates[best_with(seen, sights_of(coarse(candidates, judged_side), bodies, points))
                     .candidate];
  best.name = "one more";
  return best;
}

double off_facing(const Camera& a, const Camera& b) {
  return 180.0 - std::abs(std::remainder(azimuth_of(a) - azimuth_of(b), 360.0));
}

}  // namespace polyhull
