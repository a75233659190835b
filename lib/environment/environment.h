// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The light from all around, as an equirectangular picture has it.
///
/// Of a direction with angles phi = atan2(z, x) and theta from the y axis (up) the picture's place is
/// u = phi / 2 pi + 1/2 from its left to its right, v = theta / pi from its top to its bottom: its middle is at +x,
/// and +z to the right of that, as Blender's and three.js's glTF scenes have it.
///
/// What is seen is the picture, bilinear between pixels. What lights are its pixels as areas of one radiance, once
/// they are at most 1024x512.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "base/vector.h"
#include "environment/radiance_picture.h"

namespace polyhull {

/// A direction in which light comes, unit length, with the radiance there and the density, per solid angle, with
/// which it was chosen; where all is black the density is 0.
struct EnvironmentSample {
  Vec3f direction{0.0f, 1.0f, 0.0f};
  Vec3f radiance{0.0f};
  float density = 0.0f;
};

/// A part of the light: what a parallelogram gives that lies far away in `direction`, with its sides along `across`
/// (level) and upwards.
struct EnvironmentPart {
  Vec3f direction{0.0f, 1.0f, 0.0f};  ///< unit length
  Vec3f across{1.0f, 0.0f, 0.0f};     ///< unit length, at a right angle to it
  Vec2f width{0.0f};                  ///< along across and upwards, radians
  Vec3f irradiance{0.0f};             ///< of a surface that faces it
  /// Whether it throws shadows of edges that are to be seen as such: a sun, a lamp far away.
  bool is_sharp() const { return std::max(width.x, width.y) < 0.2f; }
};

class Environment {
 public:
  /// \p picture turned by \p degrees about the y axis, counter-clockwise seen from above. \p name says in errors
  /// what it is. Throws Error where it is not twice as wide as high, or holds what is no radiance from 0 to 1e9.
  Environment(const RadiancePicture& picture, double degrees, const std::string& name);

  /// What is seen in \p direction, which need not have unit length: bilinear.
  Vec3f radiance(const Vec3f& direction) const { return at(levels_.front(), direction); }
  /// The mean over about \p solid_angle around it.
  Vec3f radiance(const Vec3f& direction, float solid_angle) const;

  /// A direction from a point of the unit square, chosen in proportion to the luminance (Pharr, Jakob, Humphreys,
  /// "Physically Based Rendering", third edition, 13.6.7 and 14.2.4): of uniform points the mean of radiance / density is the
  /// integral of the radiance.
  EnvironmentSample sample(const Vec2f& square) const;

  /// Of a surface with unit normal \p normal that sees all of the half space before it. Within a thousandth, but
  /// where a sun grazes the surface within a hundredth of what it gives one that faces it.
  Vec3f irradiance(const Vec3f& normal) const;

  /// At most \p count parts (or three) that together give what all of it gives. What is far brighter than the
  /// mean is cut apart from the rest, and of that what is above the horizon from what is below; then again and
  /// again, each time where the variance of the directions in which light comes becomes least (Viriyothai and Debevec, "Variance
  /// Minimization Light Probe Sampling", SIGGRAPH 2009 posters): a sun stays whole.
  std::vector<EnvironmentPart> parts(std::size_t count) const;

  /// Those of parts(\p count) that are not sharp, cut further in the same way until they are \p finer, or
  /// cannot be cut. Neighbours in the list are mostly neighbours in direction, too.
  std::vector<EnvironmentPart> soft_parts(std::size_t count, std::size_t finer) const;

  /// What is seen, turned by turn() of a whole turn; at most 4096x2048 pixels.
  const RadiancePicture& picture() const { return levels_.front(); }
  float turn() const { return turn_; }

  /// A hash of all that the light depends on.
  std::uint64_t content() const { return content_; }

 private:
  /// Some pixels together.
  struct Cell {
    std::array<Vec3, 3> moments{};  ///< by channel, the integral of radiance times direction
    double luminous = 0.0;          ///< the integral of the luminance
    Vec3 moment() const;            ///< of the luminance
    void add(const Cell& other);
  };
  struct Region;

  Vec3f at(const RadiancePicture& level, const Vec3f& direction) const;
  Vec3f direction(double u, double cosine) const;
  void make_distribution();
  void make_cells();
  void make_irradiance();
  Region region(std::size_t layer, const std::array<int, 4>& cells) const;
  EnvironmentPart part_of(const Region& region) const;
  std::vector<Region> regions(std::size_t count) const;
  void cut(std::size_t count, std::vector<Region>& regions) const;

  float turn_;  // of a whole one
  std::uint64_t content_ = 0;
  std::vector<RadiancePicture> levels_;  // each half as large as the one before
  RadiancePicture lighting_;
  std::vector<float> rows_,
      columns_;         // the sums up to each row of lighting_, and within each up to each column
  int cells_high_ = 0;  // and twice as many wide
  /// Of what is at most some times as bright as the whole on average, and of what is brighter by how much: a sun
  /// is another light than the sky before which it stands.
  std::array<std::vector<Cell>, 2> cells_;
  std::vector<Vec3f> irradiance_;  // by normal, octahedral
};

/// The environment of the picture at \p path, turned by \p degrees. Throws Error as load_radiance() and Environment do.
std::shared_ptr<const Environment> load_environment(const std::string& path, double degrees);

}  // namespace polyhull
