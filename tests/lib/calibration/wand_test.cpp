// SPDX-License-Identifier: LGPL-2.1-or-later
// Calibration by a moved light against synthetic truth.
#include "studio/calibration/light/wand.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include <filesystem>
#include <fstream>
#include <map>
#include <random>
#include <sstream>

#include "base/error.h"
#include "studio/calibration/light/find_light.h"
#include "support/calibration_takes.h"
#include "support/folder.h"
#include "support/refusal.h"

namespace polyhull::calibration {
namespace {

struct WandTruth {
  Take take = empty_wand_take();
  std::vector<Camera> cameras;
  KnownDistance distance;
};

struct WandCase {
  int cameras = 8;
  int positions = 500;
  double noise = 0.25, mismatches = 0.1;
  unsigned seed = 1;
  bool known = true;  // lenses
  bool planar = false;
  double length = 0.5;  // of a wand with two ends, m; 0: the distance of two cameras is known
};

// The stage of make_ring() with a wand instead of the board; half of the positions are its other
// end where it has one.
WandTruth make_wand(const WandCase& wanted) {
  RingSettings ring;
  ring.cameras = wanted.cameras;
  ring.instants = ring.near_views = 0;
  ring.seed = wanted.seed;
  WandTruth out;
  out.cameras = make_ring(ring).cameras;
  std::mt19937 random(wanted.seed + 100);
  std::uniform_real_distribution<double> side(-1.2, 1.2), height(0.2, 2.0), chance(0.0, 1.0);
  std::normal_distribution<double> gauss;
  for (const Camera& camera : out.cameras) {
    out.take.cameras.push_back({camera.name, camera.width, camera.height, {}});
    if (wanted.known) out.take.cameras.back().known = camera;
  }
  Vec3 last(0.0);
  for (int i = 0; i < wanted.positions; ++i) {
    Vec3 x(side(random), wanted.planar ? 1.0 : height(random), side(random));
    if (wanted.length > 0.0 && i % 2 == 1) {
      const Vec3 way(gauss(random), gauss(random), gauss(random));
      x = last + wanted.length * glm::normalize(way);
      out.distance.instants.push_back({out.take.instants.size() - 1, out.take.instants.size()});
    }
    last = x;
    out.take.instants.push_back(std::to_string(i));
    for (std::size_t c = 0; c < out.cameras.size(); ++c) {
      const Camera& camera = out.cameras[c];
      const auto pixel = camera.project(x);
      if (!pixel || pixel->x < 0.0 || pixel->y < 0.0 || pixel->x > camera.width - 1 ||
          pixel->y > camera.height - 1)
        continue;
      const double dx = wanted.noise * gauss(random), dy = wanted.noise * gauss(random);
      Vec2 seen = *pixel + Vec2(dx, dy);
      if (chance(random) < wanted.mismatches)
        seen = Vec2(chance(random) * camera.width, chance(random) * camera.height);
      out.take.views.push_back({c, out.take.instants.size() - 1, {0}, {seen}});
    }
  }
  out.distance.metres = wanted.length;
  if (wanted.length == 0.0) {
    out.distance.cameras = {0, 1};
    out.distance.metres = glm::length(out.cameras[0].centre() - out.cameras[1].centre());
  }
  return out;
}

Calibration calibrate(const WandTruth& truth) {
  WandSettings settings;
  settings.distance = truth.distance;
  return calibrate_wand(truth.take, settings);
}

void expect_near(const WandTruth& truth, const Calibration& found, double centre, double degrees) {
  double worst_centre = 0.0, worst_rotation = 0.0;
  for (const CameraError& error : errors_of(found.rig.cameras, truth.cameras)) {
    worst_centre = std::max(worst_centre, glm::length(error.centre));
    worst_rotation = std::max(worst_rotation, glm::degrees(glm::length(error.rotation)));
  }
  std::printf("worst centre %.3f mm, rotation %.4f deg, rms %.4f, noise %.4f px\n",
              1e3 * worst_centre, worst_rotation, found.adjusted.rms, found.adjusted.noise);
  EXPECT_LE(worst_centre, centre);
  EXPECT_LE(worst_rotation, degrees);
}

void expect_refused(const WandTruth& truth, const std::string& words) {
  test::expect_refused([&] { calibrate(truth); }, {words}, Error::Kind::bad_input);
}

TEST(Wand, KnownLenses) {
  for (unsigned seed = 1; seed <= 3; ++seed) {
    const WandTruth truth = make_wand({.seed = seed});
    const Calibration found = calibrate(truth);
    expect_near(truth, found, 2e-3, 0.04);
    EXPECT_LE(found.adjusted.rms / std::sqrt(2.0), 1.05 * 0.25);
    EXPECT_NEAR(found.adjusted.noise, 0.25, 0.02);
  }
}

TEST(Wand, GuessedLensesAndFewerOrMoreCameras) {
  for (const int cameras : {4, 8, 16}) {
    const WandTruth truth = make_wand({.cameras = cameras, .seed = 5, .known = false});
    const Calibration found = calibrate(truth);
    // A principal point and its camera's rotation can hardly be told apart by points alone: the
    // errors are larger than with known lenses, and must be as large as said.
    expect_near(truth, found, 5e-3, 0.15);
    const std::vector<CameraError> errors = errors_of(found.rig.cameras, truth.cameras);
    for (std::size_t c = 0; c < errors.size(); ++c) {
      EXPECT_LE(glm::length(errors[c].centre), 3.5 * found.cameras[c].centre_sigma);
      EXPECT_LE(glm::degrees(glm::length(errors[c].rotation)),
                3.5 * found.cameras[c].rotation_sigma);
    }
    EXPECT_LE(found.adjusted.rms / std::sqrt(2.0), 1.1 * 0.25);
  }
}

TEST(Wand, CamerasDistanceGivesTheScale) {
  const WandTruth truth = make_wand({.cameras = 4, .positions = 200, .length = 0.0});
  expect_near(truth, calibrate(truth), 2e-3, 0.04);
}

TEST(Wand, CovariancesAreHonest) {
  double squares = 0.0;
  int inside = 0, all = 0;
  for (unsigned seed = 11; seed <= 16; ++seed) {
    const WandTruth truth = make_wand({.cameras = 4, .positions = 160, .seed = seed});
    const Calibration found = calibrate(truth);
    const std::vector<CameraError> errors = errors_of(found.rig.cameras, truth.cameras);
    for (std::size_t c = 0; c < errors.size(); ++c) {
      for (int i = 0; i < 3; ++i) {
        const Uncertainty& sure = found.adjusted.uncertainties[c];
        for (const double e : {errors[c].centre[i] / std::sqrt(sure.centre[i][i]),
                               errors[c].rotation[i] / std::sqrt(sure.rotation[i][i])}) {
          squares += e * e;
          inside += std::abs(e) <= 3.0;
          ++all;
        }
      }
    }
  }
  std::printf("%d of %d within 3 sigma, mean square %.3f\n", inside, all, squares / all);
  EXPECT_GE(inside, 0.97 * all);
  EXPECT_NEAR(squares / all, 1.0, 0.4);
}

TEST(Wand, BadTakesAreRefused) {
  const WandTruth good = make_wand({.cameras = 4, .positions = 120});
  WandTruth truth = good;
  truth.distance.instants.clear();
  expect_refused(truth, "how large the world is");
  truth = good;
  truth.distance.metres = -1.0;
  expect_refused(truth, "must be above 0");
  expect_refused(make_wand({.cameras = 4, .positions = 20}), "at least 30 are needed");
  expect_refused(make_wand({.cameras = 4, .positions = 200, .planar = true, .length = 0.0}),
                 "in a plane");
  truth = good;
  // The last camera's pictures are of other instants.
  std::mt19937 random(3);
  std::uniform_real_distribution<double> chance(0.0, 1000.0);
  for (View& view : truth.take.views)
    if (view.camera == 3) view.corners[0] = Vec2(chance(random), chance(random));
  expect_refused(truth, truth.cameras[3].name);
}

// A light of \p peak levels at \p place, above grey 10.
void draw_light(Picture& picture, const Vec2& place, double peak, double sigma) {
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < picture.width; ++x) {
      const Vec2 d = Vec2(x, y) - place;
      const double value = peak * std::exp(-glm::dot(d, d) / (2.0 * sigma * sigma));
      if (value < 0.5) continue;
      picture.row(y)[x] =
          static_cast<std::uint8_t>(std::min(255.0, picture.row(y)[x] + std::round(value)));
    }
}

Picture dark_picture(int width = 160, int height = 120) {
  return {width, height, 1,
          std::vector<std::uint8_t>(static_cast<std::size_t>(width) * height, 10)};
}

TEST(FindLight, FindsTheMiddleToATwentiethOfAPixel) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> x(10.0, 140.0), y(10.0, 100.0);
  for (int i = 0; i < 50; ++i) {
    const Vec2 place(x(random), y(random));
    Picture picture = dark_picture();
    draw_light(picture, place, 200.0, 1.5);
    const Lights found = find_lights(picture, 1);
    ASSERT_EQ(found.places.size(), 1u);
    EXPECT_LT(glm::length(found.places[0] - place), 0.05);
  }
}

TEST(FindLight, TellsWhyNot) {
  Picture picture = dark_picture();
  EXPECT_EQ(find_lights(picture, 1).fault, LightFault::dark);
  draw_light(picture, Vec2(30.0, 40.0), 200.0, 1.5);
  EXPECT_EQ(find_lights(picture, 1).fault, LightFault::none);
  draw_light(picture, Vec2(90.0, 60.0), 140.0, 1.5);
  EXPECT_EQ(find_lights(picture, 1).fault, LightFault::several);
  const Lights two = find_lights(picture, 2);
  ASSERT_EQ(two.places.size(), 2u);
  EXPECT_LT(glm::length(two.places[0] - Vec2(30.0, 40.0)), 0.05);
  picture = dark_picture();
  draw_light(picture, Vec2(80.0, 60.0), 200.0, 12.0);
  EXPECT_EQ(find_lights(picture, 1).fault, LightFault::too_large);
  picture.pixels.assign(picture.pixels.size(), 255);
  EXPECT_EQ(find_lights(picture, 1).fault, LightFault::too_bright);
}

class WandTool : public testing::Test {
 protected:
  std::string path(const char* name) const { return folder_.file(name); }

  int run(const std::string& arguments) {
    const int status =
        std::system(fmt::format("'{}/tools/polyhull-calibrate' wand {} >'{}' 2>&1",
                                std::getenv("POLYHULL_BUILD"), arguments, path("out.txt"))
                        .c_str());
    std::stringstream text;
    text << std::ifstream(path("out.txt")).rdbuf();
    text_ = text.str();
    return WEXITSTATUS(status);
  }

  void expect_said(const std::string& words) const {
    EXPECT_NE(text_.find(words), std::string::npos) << words << " not in: " << text_;
  }

  void write_rig(const WandTruth& truth) const {
    Rig rig;
    rig.cameras = truth.cameras;
    std::ofstream(path("lenses.json")) << rig_to_json(rig);
  }

  const test::Folder folder_;
  std::string text_;
};

TEST_F(WandTool, FromPicturesToRigAndReport) {
  // Three small cameras; each picture shows the wand's two lights.
  WandTruth truth = make_wand({.cameras = 3, .positions = 120, .noise = 0.0, .mismatches = 0.0});
  constexpr double smaller = 1.0 / 6.0;
  for (Camera& camera : truth.cameras) {
    camera.width = 320;
    camera.height = 180;
    for (int i = 0; i < 2; ++i) {
      camera.K[i][i] *= smaller;
      camera.K[2][i] = smaller * (camera.K[2][i] + 0.5) - 0.5;
    }
  }
  std::map<std::pair<std::size_t, std::size_t>, Picture> pictures;
  for (const View& view : truth.take.views) {
    Picture& picture = pictures[{view.camera, view.instant / 2}];
    if (picture.empty()) picture = dark_picture(320, 180);
    draw_light(picture, smaller * (view.corners[0] + 0.5) - 0.5,
               view.instant % 2 == 0 ? 220.0 : 120.0, 1.3);
  }
  for (const auto& [key, picture] : pictures) {
    const auto folder = folder_ / "take" / truth.cameras[key.first].name;
    std::filesystem::create_directories(folder);
    save_picture(picture, (folder / fmt::format("{:03}.png", key.second)).string());
  }
  write_rig(truth);
  const std::string out = path("rig.json"), page = path("page.html");
  EXPECT_EQ(run(fmt::format("--quiet '{}' --length 500 --rig '{}' -o '{}' --report '{}'",
                            path("take"), path("lenses.json"), out, page)),
            0)
      << text_;
  expect_said("pictures used");
  expect_said(": good");
  const std::vector<Camera> found = load_rig(out).cameras;
  std::vector<Camera> expected;
  for (const Camera& camera : found)
    for (const Camera& other : truth.cameras)
      if (other.name == camera.name) expected.push_back(other);
  for (const CameraError& error : errors_of(found, expected)) {
    EXPECT_LT(glm::length(error.centre), 4e-3);
    EXPECT_LT(glm::degrees(glm::length(error.rotation)), 0.05);
  }
  EXPECT_GT(std::filesystem::file_size(page), 10000u);
}

TEST_F(WandTool, FromDetectionsAndBadInput) {
  const WandTruth truth = make_wand({.cameras = 4, .positions = 120});
  {
    std::ofstream points(path("points.csv"));
    for (const View& view : truth.take.views)
      points << fmt::format("{}{},{},{},{}\n", view.instant / 2, view.instant % 2 == 0 ? 'a' : 'b',
                            truth.cameras[view.camera].name, view.corners[0].x, view.corners[0].y);
  }
  write_rig(truth);
  const std::string input =
      fmt::format("--quiet --detections '{}' --rig '{}' ", path("points.csv"), path("lenses.json"));
  EXPECT_EQ(run(input + "--length 500 -o '" + path("rig.json") + "' --report '" +
                path("page.html") + "'"),
            0)
      << text_;
  std::vector<Camera> found;
  const Rig rig = load_rig(path("rig.json"));
  for (const Camera& camera : truth.cameras) found.push_back(*rig.find(camera.name));
  for (const CameraError& error : errors_of(found, truth.cameras))
    EXPECT_LT(glm::length(error.centre), 3e-3);
  const double apart = 1e3 * glm::length(truth.cameras[0].centre() - truth.cameras[1].centre());
  EXPECT_EQ(run(fmt::format("{} --cameras-apart {} {} {}", input, truth.cameras[0].name,
                            truth.cameras[1].name, apart)),
            0)
      << text_;

  EXPECT_EQ(run(input), 1);
  expect_said("how large the world is");
  EXPECT_EQ(run(input + "--length -3"), 1);
  expect_said("must be above 0");
  EXPECT_EQ(run(input + "--between 1a nowhere 20"), 1);
  expect_said("no point 'nowhere'");
  EXPECT_EQ(run("--quiet --length 500"), 1);
  expect_said("Name a folder of pictures or --detections");
  std::ofstream(path("bad.txt")) << "1a left 3\n";
  EXPECT_EQ(run(fmt::format("--detections '{}' --size 8x8 --length 5", path("bad.txt"))), 1);
  expect_said("line 1: expected POINT CAMERA U V");
  // A camera that shares nothing.
  std::ofstream(path("points.csv"), std::ios::app) << "lonely,alone,3,4\n";
  EXPECT_EQ(run(fmt::format("--quiet --detections '{}' --size 1920x1080 --length 500",
                            path("points.csv"))),
            1);
  expect_said("Camera 'alone' shares 0 points");
}

}  // namespace
}  // namespace polyhull::calibration
