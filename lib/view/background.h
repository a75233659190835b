// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A scene's picture for a viewport that moves or stands still, with work only where something
/// changed.
///
/// A new view costs one picture of RasterView, or of render_view() where rays are asked for or the
/// lens distorts. A view that stays can be refined towards the path tracer's
/// picture: after n samples per pixel the picture is
///   (32 V + n T_n) / (32 + n),  V the fast view, T_n the mean of the n samples,
/// so the first samples' noise does not show and the limit is the exact picture. Brighter or darker
/// lights (all by the same factor) scale the light cache; what changes the brightness or colour of some
/// adds what these give (lamp_mix.h); other changes of the lights fill it anew:
/// at once, or with BackgroundOptions::progressive coarsely at first (gradual_light.h). A scene whose nodes
/// move keeps on its surfaces the light that it has (take_pose()).
#pragma once

#include <atomic>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "raytrace/path_tracer.h"
#include "scene/announcement.h"
#include "view/lamp_mix.h"
#include "view/view_renderer.h"

namespace polyhull {

class GradualLight;
class RasterView;
struct ScenePlanes;  // view/scene_planes.h

/// How new views are drawn.
enum class ViewMethod {
  raster,  ///< RasterView
  rays,    ///< render_view(): three to four times slower; contrast on surfaces is smoothed, too
};

/// The options of the three that make the picture.
struct BackgroundOptions {
  ViewMethod method = ViewMethod::raster;
  LightCacheOptions light;
  /// Where the first light of a scene is kept in files (light_store.h); empty: nowhere. Later ones
  /// are of lamps that move, and hardly come again.
  std::filesystem::path light_folder;
  /// Whether new light is coarse at first, and better with the updates that follow.
  bool progressive = false;
  ViewOptions view;
  PathOptions paths;
};

class Background {
 public:
  /// Prepares the scene for rays; the light is computed with the first picture. Throws Error as
  /// RayCaster does.
  explicit Background(Scene scene, const BackgroundOptions& options = {});
  ~Background();

  const Scene& scene() const { return traced_.scene(); }

  /// Whether \p posed, the same scene in another pose, has the same meshes, of the same nodes, with the same
  /// triangles. It has not where nodes are hidden, or turned inside out by a mirror image.
  bool has_parts_of(const Scene& posed) const;

  /// Takes over where everything is in \p posed, the same scene in another pose; the next update() draws it.
  /// The light on each surface stays that of the pose before, wherever lamps have moved meanwhile. False,
  /// and nothing changes, unless has_parts_of().
  bool take_pose(const Scene& posed);

  /// What update() did.
  enum class Work {
    none,   ///< nothing had changed: the picture is the last one
    drawn,  ///< a new view was drawn
    lit,    ///< the light was computed, and the view drawn
  };

  /// Makes the picture that of \p camera under \p lights (as many as the scene has) at \p exposure,
  /// the scene's sky \p sky times as bright. Throws Error for another number of lights. While the light is not yet exact it is brought a
  /// frame further first: call it for each frame.
  Work update(const Camera& camera, const std::vector<Light>& lights, float exposure,
              float sky = 1.0f);

  /// ViewOptions::contrast; if it is another one, and rays draw, the next update() draws anew.
  void set_contrast(float contrast) {
    if (contrast != options_.view.contrast && by_rays_) camera_.reset();
    options_.view.contrast = contrast;
  }

  /// How the next views are drawn; the next update() draws anew if it is another way.
  void set_method(ViewMethod method) {
    if (method != options_.method) camera_.reset();
    options_.method = method;
  }

  /// Computes the light of \p lights and \p sky, as of update(), before there is a view, on at most
  /// \p threads threads (0: all): the first update() then only draws. Once \p stop is true it comes to an
  /// end early; this is of no use then.
  void prepare(const std::vector<Light>& lights, float sky, int threads,
               const std::atomic<bool>& stop);

  /// For where nobody will refine(): once the view has stood still for \p still updates, gives back the memory that
  /// only new views need. The next one, refine() and write() fetch what they want again: the same picture. A picture
  /// with samples in it is kept.
  void rest(int still);

  /// Traces the next rows of the next sample of each pixel, at most \p rows of them; true when a
  /// whole pass over the picture has been finished and the picture is a better one. Not before the
  /// light is exact.
  bool refine(int rows);

  /// Samples per pixel that are in the picture.
  std::uint32_t samples() const { return samples_; }

  /// The picture, linear (1 = white), row by row; empty after rest().
  const std::vector<Vec3f>& picture() const { return samples_ > 0 ? refined_ : view_; }
  int width() const { return camera_ ? camera_->width : 0; }
  int height() const { return camera_ ? camera_->height : 0; }

  /// Writes the picture as 8-bit sRGB with four bytes per pixel, the fourth 255; \p red is the
  /// place of red in a pixel (0: RGBA, 2: BGRA), \p stride the bytes from row to row.
  void write(std::uint8_t* pixels, std::size_t stride, int red);

  /// What composite must know of the picture.
  Announcement announcement() const;

  /// What the view has ready for others; null where rays drew it.
  const std::shared_ptr<const ScenePlanes>& planes() const { return planes_; }

  const ViewStatistics& view_statistics() const { return statistics_; }
  /// Whether the light came from a file.
  bool light_was_kept() const { return light_was_kept_; }
  /// Why the last light that was computed could not be kept in a file, or could not become exact;
  /// empty: it was, or was not to, or is not yet exact.
  const std::string& light_not_kept() const { return light_not_kept_; }
  /// Whether the light is exact, not on its way there.
  bool light_is_exact() const {
    return light_ && !gradual_ && !light_failed_ && !posed_ && lamps_.is_exact();
  }
  /// Of the last light.
  std::uint64_t light_rays() const { return light_ ? light_->rays() : 0; }
  std::size_t light_nodes() const { return light_ ? light_->nodes() : 0; }

 private:
  void keep_light_as_it_is();
  bool dim_lights(const Vec3f& sky);
  bool apply_lights(const std::vector<Light>& lights, const Vec3f& sky,
                    const std::atomic<bool>* stop = nullptr);
  void light_scene(const std::atomic<bool>* stop);
  void light_scene_gradually(const std::filesystem::path& folder);
  bool advance_light();
  void draw(const Camera& camera);
  void end_rest();

  BackgroundOptions options_;
  TracedScene traced_;
  Vec3f sky_{0.0f};                 // the scene's own
  std::vector<Light> base_lights_;  // under which light_ was filled
  Vec3f base_sky_{0.0f};            // as base_lights_
  bool other_emitters_ = false;     // glowing surfaces that are not lights
  bool posed_ = false;              // the scene is in another pose than light_ was filled in
  std::unique_ptr<LightCache> light_;
  bool light_was_kept_ = false;
  std::string light_not_kept_;
  bool light_failed_ = false;  // to become the exact one
  struct Kept;                 // what the other thread says of the file
  std::shared_ptr<Kept> kept_;
  std::unique_ptr<GradualLight> gradual_;  // null: the light is exact
  LampMix lamps_;                       // under the lights now, where some differ from the base's
  std::unique_ptr<RasterView> raster_;  // of light_; null: the next view makes it
  std::uint64_t geometry_ = 0;          // geometry_key() now
  std::shared_ptr<const ScenePlanes> planes_;
  std::optional<Camera> camera_;
  float exposure_ = 0.0f;
  ViewStatistics statistics_;
  std::vector<Vec3f> view_, sums_, refined_;
  bool by_rays_ = false;  // the view
  std::uint32_t samples_ = 0;
  int rows_done_ = 0;  // of the pass under way
  int unchanged_ = 0;  // updates, one after the other
};

}  // namespace polyhull
