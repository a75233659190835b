// SPDX-License-Identifier: LGPL-2.1-or-later
#include "colours/overlap_colours.h"

#include <cmath>
#include <optional>
#include <string_view>

#include "base/colour_difference.h"
#include "base/error.h"
#include "camera_files.h"
#include "hull/build/stage.h"
#include "hull/camera_contours.h"
#include "mask_contours.h"
#include "refine/refine.h"
#include "texture/colour/colour_balance.h"
#include "texture/texture_hull.h"

namespace polyhull {
namespace {

/// CIEDE2000 of a mid grey and one whose light is exp(\p ratio) times as much, by channel.
double difference(const Vec3& ratio) {
  constexpr double grey = 0.18;
  return colour_difference(lab_of_linear(grey * glm::exp(0.5 * ratio)),
                           lab_of_linear(grey * glm::exp(-0.5 * ratio)));
}

/// The surface and the cameras that see it.
struct Subject {
  Hull surface;
  std::vector<Camera> cameras;
  std::vector<FillPicture> pictures;
};

Subject subject_of(const Rig& rig, std::span<const SubjectPicture> given) {
  Subject subject;
  std::vector<CameraContours> views;
  subject.cameras.reserve(given.size());  // views point into it
  for (const SubjectPicture& one : given) {
    const Camera& camera = subject.cameras.emplace_back(rig.cameras[one.camera]);
    views.push_back({&camera, &one.contours});
    subject.pictures.push_back({{0, 0, one.picture.width, one.picture.height},
                                4 * one.picture.width,
                                one.picture.pixels,
                                Mat3f(camera.colour)});
  }
  HullOptions options;
  options.bounds = rig.bounds;
  HullStage stage;
  HullRefiner refiner;
  subject.surface =
      refiner.refine(stage.build(views, options, 0.0), views, rig.metres_per_unit(), {});
  if (subject.surface.triangles.empty())
    throw Error(Error::Kind::bad_input,
                "The pictures' silhouettes have no hull in common; they must be of one instant. "
                "`polyhull-rig check --pictures` looks closer.");
  return subject;
}

}  // namespace

std::string match_overlaps(Rig& rig, std::span<const SubjectPicture> given) {
  if (given.size() < 2)
    throw Error(Error::Kind::bad_input, "Overlaps need pictures of two cameras at least.");
  const Subject subject = subject_of(rig, given);
  const Texturing texturing =
      texture_hull(subject.surface, subject.cameras, {.metric = TextureMetric::camera_normal});
  const ColourViews views{subject.cameras, subject.pictures, texturing};
  const std::vector<ColourPair> pairs = colour_pairs(subject.surface, views);
  if (pairs.empty())
    throw Error(Error::Kind::bad_input,
                "No two cameras see the same places of the subject well enough to be compared.");
  std::vector<std::string_view> names;
  for (const Camera& camera : subject.cameras) names.push_back(camera.name);
  const std::vector<Vec3f> gains =
      ColourBalance().update(subject.surface, views, names, std::nullopt, 0.0);

  std::string table = "gains of red, green, blue by what cameras see of the same places\n";
  for (std::size_t k = 0; k < given.size(); ++k) {
    const Vec3 gain(gains[k]);
    table += fmt::format("{:12} {:9.5f} {:9.5f} {:9.5f}\n", names[k], gain.r, gain.g, gain.b);
    Mat3& colour = rig.cameras[given[k].camera].colour;
    for (int column = 0; column < 3; ++column) colour[column] *= gain;
  }
  table += "delta E00 of a mid grey as both see it: before, after\n";
  for (const ColourPair& pair : pairs)
    table += fmt::format(
        "{:12} {:12} {:6.2f} {:6.2f}\n", names[pair.a], names[pair.b], difference(pair.ratio),
        difference(pair.ratio + glm::log(Vec3(gains[pair.a]) / Vec3(gains[pair.b]))));
  validate_rig(rig, "the gains found");
  return table;
}

std::string match_overlaps(Rig& rig, const std::vector<std::string>& files) {
  std::vector<SubjectPicture> pictures;
  for (const auto& [number, path] : assign_files(files, rig, "--pictures", "polyhull-rig")) {
    Rings contours = contours_of_picture(path, rig.cameras[number], {});
    Picture picture = load_picture(path);
    if (picture.channels != 4)
      throw Error(
          Error::Kind::bad_input,
          "'{}' has no alpha; --overlaps needs the matte there: `... ! chromamatte ! pngenc "
          "! filesink` writes such pictures.",
          path);
    pictures.push_back({number, std::move(picture), std::move(contours)});
  }
  return match_overlaps(rig, pictures);
}

}  // namespace polyhull
