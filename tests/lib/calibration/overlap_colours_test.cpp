// SPDX-License-Identifier: LGPL-2.1-or-later
// Cameras with colours of their own, matched by what they see of the same places of a body.
#include "colours/overlap_colours.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include "base/colour_difference.h"
#include "base/error.h"
#include "base/srgb.h"
#include "support/body_scenes.h"

namespace polyhull::test {
namespace {

/// What camera \p k of five multiplies light by: .75 to 1.3.
Vec3 response(std::size_t k) {
  Vec3 gain;
  for (int c = 0; c < 3; ++c)
    gain[c] = std::exp(0.27 * std::sin(2.4 * static_cast<double>(k) + 1.3 * c + 0.4));
  return gain;
}

struct Stage {
  BodyScene scene = body_scene(body_rig("5"), {"figure", open_subject("figure"), 3.0});
  Rig rig = body_rig("5");
  std::vector<SubjectPicture> pictures;

  Stage() {
    for (std::size_t k = 0; k < scene.pictures.size(); ++k) {
      Picture picture = scene.pictures[k];
      for (std::size_t i = 0; i < picture.pixels.size(); ++i)
        if (i % 4 < 3)
          picture.pixels[i] = linear_to_srgb(static_cast<float>(
              response(k)[static_cast<int>(i % 4)] * srgb_to_linear(picture.pixels[i])));
      pictures.push_back({k, std::move(picture), scene.contours[k]});
    }
  }

  /// How far grey lies apart that two cameras see, at worst; CIEDE2000.
  double worst() const {
    double worst = 0.0;
    for (std::size_t a = 0; a < rig.cameras.size(); ++a)
      for (std::size_t b = 0; b < a; ++b)
        worst = std::max(
            worst, colour_difference(lab_of_linear(rig.cameras[a].colour * (0.18 * response(a))),
                                     lab_of_linear(rig.cameras[b].colour * (0.18 * response(b)))));
    return worst;
  }
};

TEST(OverlapColours, CamerasAgreeOnABody) {
  Stage stage;
  const double before = stage.worst();
  const std::string table = match_overlaps(stage.rig, stage.pictures);
  std::printf("%sgrey apart by %.2f before, %.2f after\n", table.c_str(), before, stage.worst());
  EXPECT_GT(before, 5.0);
  EXPECT_LE(stage.worst(), 2.0);
  // What is right stays right.
  match_overlaps(stage.rig, stage.pictures);
  EXPECT_LE(stage.worst(), 2.0);
}

TEST(OverlapColours, WhatCannotBeCompared) {
  Stage stage;
  EXPECT_THROW(match_overlaps(stage.rig, std::span(stage.pictures).first(1)), Error);
  for (SubjectPicture& one : stage.pictures) one.contours = {};
  EXPECT_THROW(match_overlaps(stage.rig, stage.pictures), Error);
}

}  // namespace
}  // namespace polyhull::test
