// SPDX-License-Identifier: LGPL-2.1-or-later
// polyhull-rig check --pictures: cameras that contradict each other are found and named, good rigs
// are not.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <functional>
#include <glm/gtc/quaternion.hpp>

#include "base/error.h"
#include "base/picture.h"
#include "builtin/default_rig.h"
#include "camera_files.h"
#include "mask_contours.h"
#include "mask_picture.h"
#include "rig/check_pictures.h"
#include "rig/import.h"
#include "studio/cameras/camera_picture.h"
#include "studio/figure/figure.h"
#include "support/refusal.h"
#include "support/run_kind.h"

namespace polyhull {
namespace {

std::string all_of(const std::vector<std::string>& warnings) {
  std::string all;
  for (const std::string& warning : warnings) all += warning + "\n";
  return all;
}

// The true mattes or the pictures of all cameras of a rig at one instant, as files.
std::vector<std::string> files_of(const Rig& rig, double seconds, bool coloured) {
  static const auto figure = open_subject("figure");
  const auto folder = std::filesystem::temp_directory_path() / "polyhull_rig_pictures";
  std::filesystem::create_directories(folder);
  std::vector<std::string> files;
  for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
    const Camera& camera = rig.cameras[i];
    CameraPicture drawn(rig, static_cast<int>(i), figure);
    drawn.set_time(seconds);
    Picture picture{camera.width, camera.height, coloured ? 4 : 1, {}};
    picture.pixels.resize(static_cast<std::size_t>(camera.width) * camera.height *
                          picture.channels);
    if (coloured) {
      PictureLook look;
      look.screen.colour[0] = 40, look.screen.colour[1] = 170, look.screen.colour[2] = 60;
      look.screen.unevenness = 0.1;
      look.shadow = 0.2;
      look.noise = 3.0;
      drawn.picture(look, 0, false, picture.row(0), 4 * camera.width);
    } else {
      drawn.matte(picture.row(0), camera.width);
    }
    files.push_back((folder / (camera.name + (coloured ? "_colour.png" : ".png"))).string());
    save_picture(picture, files.back());
  }
  return files;
}

std::vector<CameraPictureRings> rings_of(const Rig& rig, const std::vector<std::string>& files) {
  std::vector<CameraPictureRings> pictures;
  for (const auto& [camera, path] : assign_files(files, rig, "--pictures", "polyhull-rig"))
    pictures.push_back({camera, contours_of_picture(path, rig.cameras[camera], {})});
  return pictures;
}

std::string said(const Rig& rig, const std::vector<CameraPictureRings>& pictures) {
  return all_of(examine_pictures(rig, pictures).warnings);
}

bool names(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

constexpr double instants[] = {0.0, 2.7, 5.9};

TEST(RigPictures, AGoodRigIsNeverNamed) {
  for (const double seconds : instants)
    for (const bool bounds : {true, false}) {
      Rig rig = default_rig();
      if (!bounds) rig.bounds.reset();
      EXPECT_EQ(said(rig, rings_of(rig, files_of(rig, seconds, false))), "") << seconds;
    }
  for (const double seconds : {0.0, 4.1})
    EXPECT_EQ(said(default_rig(), rings_of(default_rig(), files_of(default_rig(), seconds, true))),
              "")
        << seconds;
}

TEST(RigPictures, LensDistortionIsTakenOut) {
  Rig rig = default_rig();
  for (Camera& camera : rig.cameras) camera.distortion = {-0.2, 0.04, 1e-3, -1e-3};
  EXPECT_EQ(said(rig, rings_of(rig, files_of(rig, 1.3, false))), "");
}

TEST(RigPictures, SwappedPicturesAreNamed) {
  for (const double seconds : instants)
    for (const bool bounds : {true, false}) {
      Rig rig = default_rig();
      if (!bounds) rig.bounds.reset();
      const std::vector<CameraPictureRings> good = rings_of(rig, files_of(rig, seconds, false));
      for (std::size_t i = 0; i < 4; ++i)
        for (std::size_t k = i + 1; k < 4; ++k) {
          auto pictures = good;
          std::swap(pictures[i].rings, pictures[k].rings);
          const std::string text = said(rig, pictures);
          EXPECT_TRUE(
              names(text, rig.cameras[i].name + " and " + rig.cameras[k].name + " look swapped"))
              << seconds << " " << bounds << ": " << i << " " << k << ": " << text
              << examine_pictures(rig, pictures).table;
          EXPECT_FALSE(names(text, "; or")) << text;
        }
    }
}

TEST(RigPictures, MirroredAndTurnedPicturesAreNamed) {
  const Rig rig = default_rig();
  for (const double seconds : instants) {
    const std::vector<CameraPictureRings> good = rings_of(rig, files_of(rig, seconds, false));
    for (std::size_t i = 0; i < 4; ++i)
      for (const bool turned : {false, true}) {
        auto pictures = good;
        for (Vec2f& p : pictures[i].rings.points) {
          p.x = 1023 - p.x;
          if (turned) p.y = 767 - p.y;
        }
        const std::string text = said(rig, pictures);
        EXPECT_TRUE(names(text, "the picture of " + rig.cameras[i].name + " looks " +
                                    (turned ? "upside down" : "mirrored")))
            << seconds << ": " << i << ": " << text << examine_pictures(rig, pictures).table;
        EXPECT_FALSE(names(text, "; or")) << text;
      }
  }
}

// A rig that was read as if its poses were x_cam = R x + t.
TEST(RigPictures, PosesInAnotherFormAreNamed) {
  const Mat3 turn = from_rows({1, 0, 0, 0, -1, 0, 0, 0, -1});
  const auto invert = [](Camera& camera) {
    const Vec3 centre = camera.centre();
    camera.R = glm::transpose(camera.R);
    camera.t = centre;
  };
  const auto to_opengl = [&](Camera& camera) {
    camera.R = turn * camera.R;
    camera.t = turn * camera.t;
  };
  // Half the angle's sine in x, y, z and its cosine, read as cosine and x, y, z.
  const auto put_w_first = [](Camera& camera) {
    const glm::dquat meant = glm::quat_cast(camera.R);
    glm::dquat read = meant;
    read.w = meant.x, read.x = meant.y, read.y = meant.z, read.z = meant.w;
    camera.R = glm::mat3_cast(read);
  };
  const std::pair<std::function<void(Camera&)>, const char*> forms[] = {
      {[](Camera& camera) { camera.R = glm::transpose(camera.R); }, "look transposed"},
      {[](Camera& camera) { camera.t = camera.centre(); }, "the places of the cameras"},
      {invert, "the poses look like camera to world: their"},
      {put_w_first, "qx qy qz qw"},
      {to_opengl, "the cameras look like OpenGL's"},
      {[&](Camera& camera) {
         to_opengl(camera);
         invert(camera);
       },
       "camera to world of OpenGL's"}};
  Rig rig = default_rig();
  for (Camera& camera : rig.cameras) camera.distortion = {-0.05, 0.0, 0.0, 0.0};
  rig.bounds.reset();
  const std::vector<CameraPictureRings> pictures = rings_of(rig, files_of(rig, 0.0, false));
  for (const auto& [change, words] : forms) {
    Rig read = rig;
    for (Camera& camera : read.cameras) change(camera);
    const std::string text = said(read, pictures);
    EXPECT_TRUE(names(text, words)) << words << ": " << text;
    EXPECT_FALSE(names(text, "; or")) << text;
  }
  // Within a room's bounds cameras of some other form look at nothing, which contradicts nothing.
  rig.bounds = Bounds{Vec3(-4.0, 0.0, -4.0), Vec3(4.0, 3.0, 4.0)};
  std::vector<CameraPictureRings> swapped = pictures;
  std::swap(swapped[0].rings, swapped[1].rings);
  const std::string text = said(rig, swapped);
  EXPECT_TRUE(names(text, "cam0 and cam1 look swapped")) << text;
  EXPECT_FALSE(names(text, "; or")) << text;
}

TEST(RigPictures, BackgroundInAPictureIsNoWrongCamera) {
  for (const double seconds : instants) {
    const Rig rig = default_rig();
    auto pictures = rings_of(rig, files_of(rig, seconds, false));
    Rings& rings = pictures[2].rings;
    for (const Vec2f& p : {Vec2f(10, 10), Vec2f(10, 500), Vec2f(60, 500), Vec2f(60, 10)})
      rings.points.push_back(p);
    rings.ends.push_back(static_cast<std::uint32_t>(rings.points.size()));
    const std::string text = said(rig, pictures);
    EXPECT_TRUE(names(text, "cam2 (from 1") && names(text, "beside the subject")) << text;
    EXPECT_TRUE(names(text, "The calibration is not at fault")) << text;
    EXPECT_FALSE(names(text, "; or")) << text;
    // Beside a wrong camera it is not all that is wrong.
    std::swap(pictures[0].rings, pictures[1].rings);
    EXPECT_FALSE(names(said(rig, pictures), "not at fault")) << said(rig, pictures);
  }
}

// Each piece is looked at alone, in a part of a second.
TEST(RigPictures, ThousandsOfPiecesTakeNoMinutes) {
  const Rig rig = default_rig();
  auto pictures = rings_of(rig, files_of(rig, instants[0], false));
  Rings& rings = pictures[2].rings;
  int pieces = 0;
  for (int y = 8; y < 750; y += 14)
    for (int x = 8; x < 1010; x += 14) {
      if (x > 300 && x < 724) continue;
      for (const Vec2f& p : {Vec2f(0, 0), Vec2f(0, 10), Vec2f(10, 10), Vec2f(10, 0)})
        rings.points.push_back(Vec2f(x, y) + p);
      rings.ends.push_back(static_cast<std::uint32_t>(rings.points.size()));
      ++pieces;
    }
  EXPECT_GT(pieces, 2000);
  const std::clock_t begin = std::clock();
  const std::string text = said(rig, pictures);
  EXPECT_TRUE(names(text, "cam2 (from ") && names(text, "not at fault")) << text;
  if (!test::sanitized()) {
    EXPECT_LT(static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC, 3.0);
  }
}

TEST(RigPictures, RealPicturesAreNamedWhenSwappedOnly) {
  const char* data = std::getenv("POLYHULL_DATA");
  const std::string folder = std::string(data ? data : "") + "/oxford_dino/";
  if (!std::filesystem::exists(folder + "silhouettes_derived"))
    GTEST_SKIP() << "needs oxford_dino under $POLYHULL_DATA";
  import::Options options;
  options.width = 720;
  options.height = 576;
  options.name = "viff.%03d";
  const Rig rig = import::projection_matrices({folder + "dino_Ps_metric.txt"}, options);
  std::vector<std::string> files;
  for (std::size_t i = 0; i < rig.cameras.size(); i += 4)
    files.push_back(folder + "silhouettes_derived/" + rig.cameras[i].name + ".png");
  std::vector<CameraPictureRings> pictures = rings_of(rig, files);
  EXPECT_EQ(said(rig, pictures), "");
  std::swap(pictures[1].rings, pictures[2].rings);
  EXPECT_TRUE(names(said(rig, pictures), "viff.004 and viff.008 look swapped"))
      << said(rig, pictures);
}

TEST(RigPictures, AMaskIsReadFromItsGreyItsAlphaOrItsColours) {
  const Rig rig = default_rig();
  const std::string plain = files_of(rig, 0.0, false)[0];
  const Picture matte = load_picture(plain, 1);
  const Rings expected = contours_of_picture(plain, rig.cameras[0], {});
  const std::string path =
      (std::filesystem::temp_directory_path() / "polyhull_rig_pictures" / "kind.png").string();
  for (const int channels : {3, 4}) {
    for (const bool in_alpha : {false, true}) {
      if (channels == 3 && in_alpha) continue;
      Picture picture{matte.width, matte.height, channels, {}};
      for (const std::uint8_t v : matte.pixels)
        for (int c = 0; c < channels; ++c)
          picture.pixels.push_back(c == 3 ? (in_alpha ? v : 255) : (in_alpha ? 90 : v));
      save_picture(picture, path);
      EXPECT_EQ(contours_of_picture(path, rig.cameras[0], {}), expected) << channels << in_alpha;
    }
  }
  // Grey with a few coloured pixels of all hues is neither a mask nor a picture that can be keyed.
  Picture neither{1024, 768, 3, std::vector<std::uint8_t>(3 * 1024 * 768, 120)};
  for (std::size_t i = 0; i < neither.pixels.size(); ++i)
    neither.pixels[i] = i % 200 == 0 ? 255 : static_cast<std::uint8_t>(105 + i / 3 * 7 % 30);
  save_picture(neither, path);
  test::expect_refused([&] { contours_of_picture(path, rig.cameras[0], {}); },
                       {"kind.png: no coloured screen", "mask"});
}

// A mask of another convention as a file; \p write gives a pixel's samples for a level of the matte.
template <typename Write>
std::string mask_file(const Picture& matte, int channels, Write write) {
  Picture picture{matte.width, matte.height, channels, {}};
  for (const std::uint8_t level : matte.pixels)
    for (int c = 0; c < channels; ++c)
      picture.pixels.push_back(static_cast<std::uint8_t>(write(level, c)));
  const std::string path =
      (std::filesystem::temp_directory_path() / "polyhull_rig_pictures" / "other.png").string();
  save_picture(picture, path);
  return path;
}

TEST(RigPictures, MasksOfOtherConventionsAreTheSameMask) {
  const Rig rig = default_rig();
  const std::string plain = files_of(rig, 0.0, false)[0];
  const Picture matte = load_picture(plain, 1);
  Picture hard = matte;
  for (std::uint8_t& v : hard.pixels) v = v >= 128 ? 255 : 0;
  const auto rings = [&](const std::string& path) {
    return contours_of_picture(path, rig.cameras[0], {});
  };
  const Rings soft = rings(plain);
  const Rings sharp = rings(mask_file(hard, 1, [](int v, int) { return v; }));
  for (const int one : {1, 2, 31, 200})
    EXPECT_EQ(rings(mask_file(hard, 1, [&](int v, int) { return v ? one : 0; })), sharp) << one;
  EXPECT_EQ(rings(mask_file(hard, 4, [](int v, int c) { return c == 3 ? v / 255 : 90; })), sharp);
  EXPECT_EQ(rings(mask_file(hard, 3, [](int v, int c) { return c == 2 ? v / 255 : 0; })), sharp);
  // Labels: a person with a border that is left open, parts of the body, instances.
  Picture labels = hard;
  for (int y = 0; y < hard.height; ++y)
    for (int x = 2; x < hard.width - 2; ++x)
      if (hard.row(y)[x] && (!hard.row(y)[x - 2] || !hard.row(y)[x + 2])) labels.row(y)[x] = 1;
  EXPECT_EQ(rings(mask_file(labels, 1, [](int v, int) { return v == 255 ? 15
                                                               : v      ? 255
                                                                        : 0; })),
            sharp);
  for (const int step : {1, 3, 60})
    EXPECT_EQ(rings(mask_file(hard, 1,
                              [&, n = 0](int v, int) mutable {
                                const int row = n++ / 1024;
                                return v ? step * (1 + row / 100 % 4) : 0;
                              })),
              sharp);
  // A background that is not black, and alpha that is dithered.
  for (const auto& [ground, subject] : {std::pair{1, 2}, {16, 235}, {30, 9}})
    EXPECT_EQ(
        rings(mask_file(hard, 1, [g = ground, s = subject](int v, int) { return v ? s : g; })),
        sharp)
        << ground;
  EXPECT_EQ(rings(mask_file(hard, 4,
                            [n = 0](int v, int c) mutable { return c < 3 ? v : 254 + n++ % 2; })),
            sharp);
  // Two parts of the subject of different colours are both of it.
  const Rings parts = rings(mask_file(hard, 3, [n = 0](int v, int c) mutable {
    const int row = n++ / 3 / 1024;
    return v == 0 ? 0 : row % 64 < 32 ? (c == 0 ? 255 : 0) : (c == 2 ? 128 : 0);
  }));
  EXPECT_EQ(parts, sharp);
  using Colour = std::array<int, 3>;
  const std::pair<Colour, Colour> colours[] = {
      {{255, 0, 0}, {0, 0, 0}}, {{0, 255, 0}, {0, 0, 0}},      {{0, 0, 255}, {255, 255, 255}},
      {{0, 0, 0}, {255, 0, 0}}, {{253, 231, 37}, {68, 1, 84}}, {{255, 0, 255}, {128, 128, 128}},
      {{128, 0, 0}, {0, 0, 0}}};
  for (const auto& [subject, ground] : colours) {
    const Rings got = rings(mask_file(matte, 3, [&, s = subject, g = ground](int v, int c) {
      return (s[c] * v + g[c] * (255 - v) + 127) / 255;
    }));
    ASSERT_EQ(got.size(), soft.size()) << subject[0] << " on " << ground[0];
    double most = 0.0;
    for (const Vec2f& p : got.points) {
      double nearest = 1e9;
      for (std::size_t i = 0; i < soft.size(); ++i)
        for (std::size_t k = 0; k < soft.ring(i).size(); ++k) {
          const Vec2 a(soft.ring(i)[k]), b(soft.ring(i)[(k + 1) % soft.ring(i).size()]);
          const double along = std::clamp(dot(Vec2(p) - a, b - a) / dot(b - a, b - a), 0.0, 1.0);
          nearest = std::min(nearest, length(a + along * (b - a) - Vec2(p)));
        }
      most = std::max(most, nearest);
    }
    EXPECT_LT(most, 1.3) << subject[0] << " on " << ground[0];
  }
}

TEST(RigPictures, AShadedSubjectBeforeBlackIsNoMask) {
  const Rig rig = default_rig();
  const Picture matte = load_picture(files_of(rig, 0.0, false)[0], 1);
  const std::string path = mask_file(matte, 3, [n = 0](int v, int c) mutable {
    const int x = n++ / 3 % 1024;
    return v * (c == 0 ? 120 + x % 100 : 60 + x % 80) / 255;
  });
  EXPECT_TRUE(load_mask_picture(path).to_key);
  EXPECT_FALSE(
      load_mask_picture(mask_file(matte, 3, [](int v, int c) { return c ? 0 : v; })).to_key);
}

TEST(RigPictures, InvertedMasksAreSaidToBe) {
  const Rig rig = default_rig();
  const Picture matte = load_picture(files_of(rig, 0.0, false)[0], 1);
  const auto expect_inverted = [&](const std::string& path) {
    for (const auto& contours : {contours_of_mask, contours_of_picture})
      test::expect_refused([&] { contours(path, rig.cameras[0], {}); }, "looks inverted");
  };
  expect_inverted(mask_file(matte, 1, [](int v, int) { return 255 - v; }));
  expect_inverted(mask_file(matte, 1, [](int v, int) { return v < 128 ? 1 : 0; }));
  expect_inverted(mask_file(matte, 4, [](int v, int c) { return c == 3 ? 255 - v : 90; }));
}

TEST(RigPictures, TooFewAreRefused) {
  EXPECT_THROW(examine_pictures(default_rig(), {}), Error);
}

TEST(RigPictures, ACameraWithAWrongUnitIsNamed) {
  for (const double seconds : instants) {
    const std::vector<CameraPictureRings> pictures =
        rings_of(default_rig(), files_of(default_rig(), seconds, false));
    for (std::size_t i = 0; i < 4; ++i)
      for (const double factor : {1000.0, 1.0 / 25.4, 1.3}) {
        Rig rig = default_rig();
        rig.cameras[i].t *= factor;
        const std::string text = said(rig, pictures);
        EXPECT_TRUE(names(text, rig.cameras[i].name + " contradicts the others"))
            << seconds << ": " << i << " x" << factor << ": " << text;
      }
    Rig rig = default_rig();
    rig.bounds->min *= 0.001;
    rig.bounds->max *= 0.001;
    EXPECT_TRUE(names(said(rig, pictures), "not with the bounds")) << said(rig, pictures);
  }
}

// Silhouettes agree whatever the unit: the size of their hull tells.
TEST(RigPictures, ASubjectOfNoPersonsSizeIsNamed) {
  const auto pictures = rings_of(default_rig(), files_of(default_rig(), 0.0, false));
  for (const bool bounds : {true, false}) {
    Rig rig = default_rig();
    const RigReport right = examine_pictures(rig, pictures);
    EXPECT_TRUE(names(right.table, "the hull of all is 1.7")) << right.table;
    rig.unit = "10";
    if (!bounds) rig.bounds.reset();
    const RigReport report = examine_pictures(rig, pictures);
    EXPECT_TRUE(names(all_of(report.warnings), "The subject is 17.")) << all_of(report.warnings);
    rig.unit = "cm";
    EXPECT_TRUE(names(said(rig, pictures), "\"unit\": \"m\"")) << said(rig, pictures);
  }
}

}  // namespace
}  // namespace polyhull
