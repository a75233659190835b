// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Colours seen earlier, for what no camera sees now: after one turn the back is known.
///
/// What is seen is kept as points of the surface with normals and colours, which stay when it is hidden.
/// From one instant to the next all points move as the parts they belong to (local_motion.h), which are
/// held against the points' own colours, so that errors do not add up while a part is seen. Where no
/// camera sees the surface, its fill becomes
///   fill + trust * near * (remembered - fill),
/// remembered: the mean of the points around, over a width that grows with their distance from
/// the surface, which is a guess there; near: falls with what lies between, and with the points' age.
///
/// The trust is measured, not assumed: a point that was hidden and is seen again tells how wrong its
/// colour was, and how wrong what was filled in meanwhile. With the mean squares e of the
/// one and f of the other, trust = max(0, 1 - e / f), by how long points had been hidden: what has
/// drifted for longer is less right. Nothing is trusted until enough points have told.
/// So memory gives way to the fill where the motion is lost.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "texture/colour/colour_pairs.h"
#include "texture/colour/coloured_points.h"
#include "texture/fill_samples.h"

namespace polyhull {

struct SeenSurface;

/// Of one call, for `stats`.
struct MemoryStatistics {
  std::size_t points = 0;      ///< that are remembered
  std::size_t vertices = 0;    ///< whose fill is from memory by half or more
  double trust = 0.0;          ///< 0..1, in what has been hidden for long
  double error = 0.0;          ///< e: root mean square over what was seen again, codes
  double error_without = 0.0;  ///< f, the same
};

/// Remembers one stream's colours. Not for use by two threads at once.
class ColourMemory {
 public:
  /// No more points are kept.
  static constexpr std::size_t most = 60000;

  /// Mixes into \p fill (Texturing::fill of \p hull without memory; may be empty) what is remembered,
  /// and remembers what \p views show. \p time: of the instant, seconds; none: a twenty-fifth after the
  /// last one. What has been hidden for \p half_life seconds counts half. Begins anew where time
  /// goes back or stands still for more than two seconds, and where nothing is where it was. The same for any
  /// number of threads.
  void update(const Hull& hull, const ColourViews& views, std::optional<double> time,
              double half_life, std::vector<std::uint32_t>& fill);

  /// Forgets all.
  void reset() { *this = {}; }

  const MemoryStatistics& statistics() const { return statistics_; }

 private:
  /// What is known of a point besides its place and colour.
  struct Trace {
    float confidence = 1.0f;
    float hidden = 0.0f;  // seconds since it was seen
    // What was filled in there without memory meanwhile.
    Vec3f filled{0.0f};
    float filled_square = 0.0f;
    float fills = 0.0f;
  };
  void age(std::optional<double> time, double half_life);
  bool meet(const SeenSurface& now);
  void judge(const Trace& trace, const Vec3f& remembered, const Vec3f& seen);
  void thin(float pixel);
  void add(const SeenSurface& now);
  void note(const Hull& hull, std::span<const Vec3f> normals, float pixel,
            std::span<const std::uint32_t> fill);
  void recall(const Hull& hull, const ColourViews& views, float pixel,
              std::span<const FillSample> samples, std::vector<std::uint32_t>& fill);

  Vec3 origin_{0.0};                 // of the points
  ColouredPoints points_;            // what is remembered
  std::vector<Trace> traces_;        // of each
  std::vector<std::uint8_t> shown_;  // of each: seen at the last instant
  std::optional<double> last_;
  std::size_t instant_ = 0;
  /// What was told by points that were hidden for about as long: how many, and sums of their squares.
  struct Told {
    double points = 0.0, error = 0.0, error_without = 0.0;
  };
  static constexpr std::size_t spans = 4;
  static std::size_t span_of(float hidden);
  std::array<double, spans> trusts() const;
  std::array<Told, spans> told_;
  MemoryStatistics statistics_;
};

}  // namespace polyhull
