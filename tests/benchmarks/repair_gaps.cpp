// SPDX-License-Identifier: LGPL-2.1-or-later
// Holes that hullbuild's repair fills, of people in any pose (capsules, every fourth time the studio's
// figure) whose arms and legs enclose gaps: how many of the pixels filled are the subject's. Three
// kinds of sets: ideal mattes with holes by chance; the same with what real recordings have, which are
// cameras that are off, outlines grown, shrunk, bitten and with shadows at the feet, specks of
// background, clothes in the screen's colour, seen by several cameras; and those without any hole by
// keying, so that what is filled is a gap. Writes repair_gaps.tsv. Usage: repair_gaps FOLDER [SCENES]
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <numbers>
#include <string>
#include <vector>

#include "hull/repair/repair.h"
#include "hull/repair/ring_regions.h"
#include "support/figure.h"
#include "support/matte_damage.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

enum class Kind { ideal, real, gaps };

double degrees(Dice& dice, double low, double high) {
  return glm::radians(dice.between(low, high));
}

/// Somebody standing or crouching, hands on the hips or anywhere; y up, the feet at y = 0.
std::vector<Capsule> posed_figure(Dice& dice) {
  const double turn = degrees(dice, 0, 360);
  std::vector<Capsule> body;
  const auto place = [&](const Vec3& p) {
    return Vec3(p.x * std::cos(turn) + p.z * std::sin(turn), p.y,
                -p.x * std::sin(turn) + p.z * std::cos(turn));
  };
  const auto add = [&](const Vec3& a, const Vec3& b, double radius) {
    body.push_back({place(a), place(b), radius});
  };
  const bool crouches = dice.chance(0.3);
  const double hips = crouches ? dice.between(0.57, 0.82) : 0.92, chest = hips + 0.48;
  add({0, hips + 0.08, 0}, {0, chest - 0.05, 0}, 0.15);
  add({-0.1, chest - 0.08, 0}, {0.1, chest - 0.08, 0}, 0.12);
  add({0, chest, 0}, {0, chest + 0.15, 0}, 0.06);
  add({0, chest + 0.24, 0.01}, {0, chest + 0.29, 0.01}, 0.1);
  for (const int side : {-1, 1}) {
    const Vec3 shoulder(side * 0.2, chest, 0);
    Vec3 elbow, hand;
    if (dice.chance(0.35)) {
      elbow = shoulder + Vec3(side * dice.between(0.15, 0.25), -0.2, dice.between(-0.1, 0.1));
      hand = Vec3(side * 0.17, hips + 0.1, dice.between(0.0, 0.1));
    } else {
      const double up = degrees(dice, 5, 150), forward = degrees(dice, -60, 90);
      const double bend = degrees(dice, 0, 110);
      const Vec3 way(side * std::sin(up) * std::cos(forward), -std::cos(up),
                     std::sin(up) * std::sin(forward));
      const Vec3 other(side * dice.between(-1, 0.5), dice.between(-0.3, 1), dice.between(0, 1));
      elbow = shoulder + 0.29 * way;
      hand = elbow +
             0.27 * glm::normalize(std::cos(bend) * way + std::sin(bend) * glm::normalize(other));
    }
    add(shoulder, elbow, 0.052);
    add(elbow, hand, 0.042);
    add(hand, hand + 0.08 * glm::normalize(hand - elbow), 0.04);
    const Vec3 hip(side * 0.1, hips, 0);
    const double out = degrees(dice, 0, 25), swing = degrees(dice, -35, 50);
    Vec3 thigh(side * std::sin(out), -std::cos(out) * std::cos(swing), std::sin(swing));
    if (crouches) thigh += Vec3(0, 0.3, 0.6);
    const Vec3 knee = hip + 0.43 * glm::normalize(thigh);
    const double back = dice.between(0.0, 0.9) * std::max(0.0, std::sin(swing));
    const Vec3 foot =
        knee + 0.42 * glm::normalize(Vec3(side * dice.between(-0.1, 0.15), -1, -back));
    add(hip, knee, 0.085);
    add(knee, foot, 0.06);
    add(foot, foot + Vec3(0, -0.03, 0.16), 0.045);
  }
  double low = 1e9;
  for (const Capsule& part : body)
    low = std::min({low, part.a.y - part.radius, part.b.y - part.radius});
  for (Capsule& part : body) part.a.y -= low, part.b.y -= low;
  return body;
}

/// Of variance 1.
double bell(Dice& dice) {
  double sum = -6.0;
  for (int i = 0; i < 12; ++i) sum += dice.unit();
  return sum;
}

Vec3 bell_vector(Dice& dice) {
  const double x = bell(dice), y = bell(dice);
  return {x, y, bell(dice)};
}

/// Puts a disc of foreground or background into the matte.
void stamp(Matte& matte, const Vec2& at, double radius, bool foreground) {
  const int reach = static_cast<int>(radius) + 2;
  const int x0 = static_cast<int>(at.x), y0 = static_cast<int>(at.y);
  for (int y = std::max(0, y0 - reach); y <= std::min(matte.height - 1, y0 + reach); ++y)
    for (int x = std::max(0, x0 - reach); x <= std::min(matte.width - 1, x0 + reach); ++x) {
      const double share = std::clamp(radius + 0.5 - std::hypot(x - at.x, y - at.y), 0.0, 1.0);
      const auto level = static_cast<std::uint8_t>(255.0 * share);
      std::uint8_t& value = matte.row(y)[x];
      value = foreground ? std::max(value, level)
                         : std::min(value, static_cast<std::uint8_t>(255 - level));
    }
}

/// The matte shrunk or grown by up to 2 px, with bumps and notches at its outline, and shadows at the
/// feet.
void roughen(Matte& matte, Dice& dice) {
  const Rings outline = contours_of(matte);
  const int grown = dice.whole(-1, 2);
  for (const Vec2f& p : outline.points)  // dense enough: within half a pixel of the outline
    if (grown != 0) stamp(matte, Vec2(p), std::abs(grown) + 1.0, grown > 0);
  float lowest = 0.0f, highest = 1e9f;
  for (const Vec2f& p : outline.points)
    lowest = std::max(lowest, p.y), highest = std::min(highest, p.y);
  const auto somewhere = [&] {
    return outline.points[dice.whole(0, static_cast<int>(outline.points.size()) - 1)];
  };
  for (int i = 0; i < 40; ++i) {
    const Vec2 at(somewhere());
    const double radius = dice.between(1, 5);
    stamp(matte, at, radius, dice.chance(0.6));
  }
  for (int i = 0; i < 4; ++i) {
    const Vec2f at = somewhere();
    if (at.y > lowest - 0.1f * (lowest - highest))
      stamp(matte, Vec2(at), dice.between(4, 20), true);
  }
}

void recount(Matte& matte) {
  for (int y = 0; y < matte.height; ++y) find_states(matte.row(y), matte.width, matte.state_row(y));
}

struct Scene {
  Rig rig;  ///< as calibrated
  std::vector<Matte> truth, mattes;
};

Scene make_scene(int cameras, int number, Kind kind) {
  Dice dice(1000 * cameras + number);
  Scene scene;
  const Rig truth = scene.rig = ring_around_person(cameras, 1 + number);
  const std::vector<Capsule> body = posed_figure(dice);
  if (number % 4 == 3) {
    scene.truth = mattes_of(open_subject(""), truth, 0.9 * number);
  } else {
    for (const Camera& camera : truth.cameras)
      scene.truth.push_back(
          matte_of(silhouette_of(body, camera, 2.0), camera.width, camera.height));
  }
  scene.mattes = scene.truth;
  const auto spoil = [&](Damage damage_kind, int count, double most) {
    for (int i = 0; i < count; ++i)
      damage(scene.mattes[dice.whole(0, cameras - 1)], damage_kind, dice.between(5, most), dice);
  };
  if (kind != Kind::ideal) {
    for (Camera& camera : scene.rig.cameras) {
      const Vec3 by = 0.001 * bell_vector(dice);  // .7 px
      const Vec3 centre = camera.centre() + 0.002 * bell_vector(dice);
      const Mat3 off = Mat3(1.0) + Mat3(0, by.z, -by.y, -by.z, 0, by.x, by.y, -by.x, 0);
      const Vec3 a = glm::normalize(off[0]), b = glm::normalize(off[1] - glm::dot(off[1], a) * a);
      camera.R = Mat3(a, b, glm::cross(a, b)) * camera.R;
      camera.t = -(camera.R * centre);
    }
    for (Matte& matte : scene.mattes) roughen(matte, dice), recount(matte);
    spoil(Damage::bite, 1 + cameras / 6, 50);
    spoil(Damage::speck, cameras / 2, 40);
  }
  if (kind != Kind::gaps) spoil(Damage::hole, 1 + cameras / 4, 60);
  if (kind == Kind::real && dice.chance(0.5)) {
    const Capsule& part = body[dice.whole(0, static_cast<int>(body.size()) - 1)];
    const Vec3 out = dice.direction();
    const Vec3 patch = glm::mix(part.a, part.b, dice.unit()) + part.radius * out;
    const double size = dice.between(0.01, 0.08);  // metres; 230 px each
    for (int k = 0; k < cameras; ++k) {
      const double facing = glm::dot(glm::normalize(truth.cameras[k].centre() - patch), out);
      const auto at = truth.cameras[k].project_ideal(patch);
      if (facing < 0.3 || !at) continue;
      stamp(scene.mattes[k], *at, 230.0 * size * facing, false);
      recount(scene.mattes[k]);
    }
  }
  return scene;
}

/// Pixels of holes; those of the subject are to be filled, those of gaps not.
struct Sums {
  double subject = 0, gaps = 0, filled_subject = 0, filled_gaps = 0;
  int holes = 0, filled = 0;
};

void measure(const Scene& scene, Sums& sums) {
  std::vector<Rings> contours;
  std::vector<Silhouette> views;
  for (const Matte& matte : scene.mattes) contours.push_back(contours_of(matte));
  for (std::size_t k = 0; k < contours.size(); ++k)
    views.push_back({&scene.rig.cameras[k], &contours[k]});
  const std::vector<ViewRepair> repairs = find_repairs(views, {.repair = Repair::both});
  for (std::size_t k = 0; k < views.size(); ++k) {
    const std::vector<hull::RingRegion> regions = hull::regions_of(contours[k]);
    const std::vector<std::uint32_t>& out = repairs[k].leave_out;
    const auto left_out = [&](std::uint32_t r) {
      return std::binary_search(out.begin(), out.end(), r);
    };
    for (std::uint32_t r = 0; r < regions.size(); ++r) {
      const std::int32_t around = regions[r].parent;
      const bool in_dropped =
          around >= 0 && regions[around].area > 0.0 && left_out(static_cast<std::uint32_t>(around));
      if (regions[r].area >= 0.0 || in_dropped) continue;
      const std::vector<Vec2> points =
          hull::points_inside(contours[k], r, regions[r].area, 1 << 20);
      double subject = 0.0;
      for (const Vec2& p : points)
        subject +=
            scene.truth[k].row(static_cast<int>(p.y + 0.5))[static_cast<int>(p.x + 0.5)] >= 128;
      const double area = -regions[r].area;
      const double share = points.empty() ? 0.0 : subject / static_cast<double>(points.size());
      ++sums.holes, sums.subject += share * area, sums.gaps += (1.0 - share) * area;
      if (!left_out(r)) continue;
      ++sums.filled, sums.filled_subject += share * area, sums.filled_gaps += (1.0 - share) * area;
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return std::fprintf(stderr, "usage: repair_gaps FOLDER [SCENES]\n"), 2;
  const int scenes = argc > 2 ? std::atoi(argv[2]) : 24;
  std::string table =
      "sets\tcameras\tholes\tof the subject, px\tof gaps, px\tfilled\tof the subject filled, px\t"
      "of gaps filled, px\tright %\tfound %\n";
  for (const Kind kind : {Kind::ideal, Kind::real, Kind::gaps})
    for (const int cameras : {4, 5, 6, 8, 12}) {
      Sums sums;
      for (int number = 0; number < scenes; ++number)
        measure(make_scene(cameras, number, kind), sums);
      const double filled = sums.filled_subject + sums.filled_gaps;
      char line[256];
      std::snprintf(line, sizeof line, "%s\t%d\t%d\t%.0f\t%.0f\t%d\t%.0f\t%.0f\t%.2f\t%.1f\n",
                    kind == Kind::ideal  ? "ideal"
                    : kind == Kind::real ? "real"
                                         : "gaps",
                    cameras, sums.holes, sums.subject, sums.gaps, sums.filled, sums.filled_subject,
                    sums.filled_gaps, filled > 0 ? 100.0 * sums.filled_subject / filled : 100.0,
                    sums.subject > 0 ? 100.0 * sums.filled_subject / sums.subject : 0.0);
      std::fputs(line, stdout), std::fflush(stdout);
      table += line;
    }
  std::ofstream(std::string(argv[1]) + "/repair_gaps.tsv") << table;
}
