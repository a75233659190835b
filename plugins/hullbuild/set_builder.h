// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// From one set of views to one mesh in a buffer that shares the views' pixels, with the words and
/// figures that go with it.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hull/build/stage.h"
#include "hull/subject_size.h"
#include "plugins/common/memory/payload_buffer.h"
#include "plugins/common/statistics.h"
#include "plugins/hullbuild/coarsening.h"
#include "plugins/hullbuild/properties.h"
#include "rig/rig.h"

namespace polyhull::element {

/// One view of a set and the name of the camera that it counts as.
struct SetView {
  std::string camera;
  const ViewBuffer* view = nullptr;
};

/// What was mended of one camera's silhouette.
struct CameraRepair {
  std::string camera;
  std::uint32_t holes = 0, pieces = 0;  ///< filled, dropped
};

/// Builds meshes, keeping from set to set what can be reused. For one thread.
class SetBuilder {
 public:
  explicit SetBuilder(Statistics& statistics);

  /// The rig of the sets to come; as reset(). \p built_in: nobody has set one.
  void set_rig(Rig rig, bool built_in);
  const Rig& rig() const { return rig_; }

  /// Throws Error if the rig has no camera \p camera or its size is not width x height; \p where
  /// names the pad.
  void check(const std::string& where, const std::string& camera, int width, int height) const;

  /// A buffer with the mesh of \p views (any order; each camera once, each checked), without times.
  /// Fewer than two views with foreground give an empty hull. Warnings are posted on \p element.
  /// Contours are coarsened by up to \p coarser, px. \p opacity: Mesh::opacity. Throws Error as
  /// HullStage::build().
  GstBuffer* build(GstElement* element, std::vector<SetView> views, const HullSettings& settings,
                   std::uint64_t trigger, double coarser, float opacity);

  /// How many times as large the last set's hull would be, by volume, had it no other views than those of
  /// the cameras \p left: 1 where it has not, infinite where fewer than two were left. None where there
  /// is no such hull.
  std::optional<double> growth(const std::vector<std::string>& left) const;

  /// Of the last set: whether its hull is empty, and whether one was asked for and each of its views,
  /// two at least, has a foreground.
  bool is_empty() const { return is_empty_; }
  /// Whether it is that of the set before.
  bool is_reused() const { return stage_->statistics().reused; }
  bool all_see_foreground() const { return all_see_foreground_; }

  /// Of the last set: how large its hull is.
  const SubjectSize& size() const { return size_; }
  /// Of the last set, whose hull was built within bounds and is empty: where its silhouettes meet
  /// without them, if they do, world units.
  std::optional<Bounds> elsewhere() const;

  /// Of the last set: the cameras whose silhouettes were mended.
  const std::vector<CameraRepair>& repairs() const { return repairs_; }

  /// Of the last set: what its cameras, by name, say of each other; nothing where the silhouettes
  /// are those of the set before, of no views where nobody is asked.
  const std::optional<CameraDoubts>& doubts() const { return doubts_; }
  /// The frontier points that go with doubts().
  const std::vector<Tangency>& tangencies() const { return tangencies_; }
  /// Of the last set.
  const std::vector<std::string>& cameras() const { return cameras_; }

  /// Forgets contours and hulls of former frames.
  void reset();

 private:
  void build_hull(GstElement* element, Mesh& mesh, const HullSettings& settings);
  void take_repairs(Mesh& mesh);
  void take_doubts(const Mesh& mesh, const HullSettings& settings);
  void report(const Mesh& mesh, bool has_surface);

  Statistics& statistics_;
  Rig rig_;
  bool built_in_ = false;
  Coarsener coarsener_;
  std::unique_ptr<HullStage> stage_;
  HullOptions options_;                                // of the last hull
  SubjectSize size_;                                   // of the last set
  std::vector<CameraRepair> repairs_;                  // of it
  std::vector<std::string> cameras_;                   // of it
  std::optional<CameraDoubts> doubts_;                 // of it
  std::vector<Tangency> tangencies_;                   // of it
  std::uint32_t round_ = 0;                            // of doubts and tangencies
  bool is_empty_ = true, all_see_foreground_ = false;  // of the last set
};

}  // namespace polyhull::element
