// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What composite does with one frame, apart from queues and negotiation: the scene and the
/// viewport that are true for it, and the drawing.
#pragma once

#include <gst/video/video.h>

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/error.h"
#include "plugins/common/statistics.h"
#include "plugins/composite/background_content.h"
#include "plugins/composite/background_video.h"
#include "plugins/composite/gl.h"
#include "plugins/composite/open_scenes.h"
#include "plugins/composite/pad.h"
#include "plugins/composite/properties.h"
#include "render/lens/lens_picture.h"
#include "render/processor/processor_renderer.h"
#include "scene/announcement.h"

namespace polyhull::element {

/// The pictures of one frame: buffers with the formats they have, apart from what metas say.
struct FrameBuffers {
  GstBuffer* background = nullptr;
  const GstVideoInfo* info = nullptr;    ///< RGBA, of the background
  const GstVideoInfo* output = nullptr;  ///< RGBA, NV12 or I420
  bool background_on_gpu = false;
  bool output_on_gpu = false;
};

/// Throws Error (unsupported) where rows are apart by what is no multiple of four bytes.
void check_strides(int from, int to);

/// Draws frame after frame. For one thread.
class FrameComposer {
 public:
  FrameComposer(CompositeGl& gl, Statistics& statistics);

  /// The announcement that is true from now on; nullopt: none. Throws Error if its scene cannot be
  /// opened.
  void announce(std::optional<Announcement> announcement);
  bool announced() const { return announcement_.has_value(); }

  /// Gets the frame ready: what is to be drawn, and by what. \p meshes are the pads with a mesh to
  /// show, \p background the frame that may have planes attached, \p time its stream time where it is
  /// valid, of a stream that is \p live or not; \p on_gpu: a picture comes or goes in OpenGL's memory. Throws Error where the scene cannot
  /// be opened, there has been no viewport and this is none, or OpenGL is asked for and not to be had.
  void prepare(const CompositeSettings& settings, const GstVideoInfo& info, GstBuffer* background,
               GstClockTime time, bool live, const std::vector<GstAggregatorPad*>& meshes,
               bool on_gpu);

  /// Whether \p file can be announced without holding up a frame; where not, it is loaded beside. From
  /// any thread.
  bool is_ready_for(const SceneFile& file) { return scenes_.is_ready(file); }

  /// Whether the background is the result as it is.
  bool untouched() const {
    return plan_.untouched() && !lens_.finishes(plan_) && view_ == CompositeView::composite;
  }

  /// What becomes of the frame, for the log.
  const char* drawn_by() const {
    return untouched() ? "untouched" : with_gl_ ? "drawn by OpenGL" : "drawn by the processor";
  }

  /// How many meshes were left out because their vertices are not finite or too far away.
  int unusable() const { return plan_.unusable; }

  /// The background in the output's format, which is a video format: a new buffer without times.
  /// Throws Error.
  GstBuffer* background_as_video(const FrameBuffers& buffers);

  /// Draws what prepare() found. \p output holds the background already where it is in system
  /// memory and not the same buffer. Where OpenGL fails, the processor draws this frame and all that
  /// follow until reset(), and a warning says so; but Error where a picture is in OpenGL's memory.
  /// With \p later OpenGL is not waited for where both are in system memory and RGBA, but for a
  /// key: then the
  /// place is returned to take() the picture from, before the second draw() after this one.
  /// Throws Error.
  std::optional<unsigned> draw(const FrameBuffers& buffers, GstBuffer* output, bool later);

  /// Completes \p output, RGBA as \p info says, which draw() has left at \p place. False: the picture
  /// was lost as OpenGL failed. Throws Error.
  bool take(unsigned place, const GstVideoInfo& info, GstBuffer* output);

  /// The next frame does not follow on the last one.
  void forget_motion() { viewport_before_.reset(); }

  void reset();

 private:
  const OpenScenes::Open& own_scene(const CompositeSettings& settings, bool live);
  OpenScenes::Open with_lamps(const OpenScenes::Open& open);
  void set_scene(const CompositeSettings& settings, bool live);
  void set_mirrors(const std::string& choice);
  void add_environment(ShadowQuality quality);
  void set_soft_light();
  void draw_on_gpu(const FrameBuffers& buffers, GstBuffer* output);
  std::optional<unsigned> draw_in_memory(const FrameBuffers& buffers, GstBuffer* output,
                                         bool later);
  void draw_as_video(const FrameBuffers& buffers, GstBuffer* output);
  void draw_through_lens(const FrameBuffers& buffers, GstBuffer* output);
  /// The renderer's share of a frame through the lens.
  struct LensWork {
    double inside = 0.0;  ///< ms
    std::optional<RenderStatistics> drawn;
  };
  /// Where a composite is drawn: RGBA rows, of which the target holds the background's already.
  struct DrawnRows {
    const std::uint8_t* background;
    int background_stride;
    std::uint8_t* target;
    int target_stride, width, height;
  };
  void lens_over(const DrawnRows& rows, LensWork& work);
  void lens_over_greys(const DrawnRows& rows, LensWork& work);
  void set_viewport(const CompositeSettings& settings, GstClockTime time, double pixel_aspect);
  void draw_subjects(const DrawnRows& rows, LensWork& work);
  void draw_fading(const DrawnRows& rows, LensWork& work);
  void set_lens(const CompositeSettings& settings, const GstVideoInfo& info, GstBuffer* background);
  void with_renderer(const std::function<void(Renderer&)>& work);
  bool run_gl(const std::function<void(Compositor&)>& work);  // false: it failed, and is given up
  void give_up_gl(const Error& why);
  bool draws_with_gl(Backend wanted, bool on_gpu);
  RenderPlan plan();
  void add_subject(GstAggregatorPad* pad, bool by_image);
  void match(GstAggregatorPad* pad);
  std::shared_ptr<const ImageSubject> image_of(GstAggregatorPad* pad);
  void report(const RenderStatistics& statistics);

  CompositeGl& gl_;
  std::unique_ptr<ProcessorRenderer> processor_;
  bool with_gl_ = false;
  bool on_gpu_ = false;     // a picture of the frame is
  bool gl_failed_ = false;  // since reset()
  Statistics& statistics_;
  BackgroundContent background_content_;
  BackgroundVideo background_video_;
  std::optional<Announcement> announcement_;
  ViewportKeyFrames key_frames_;
  OpenScenes scenes_;
  SceneVersions versions_;  // of the property's
  static constexpr std::uint64_t not_looked_at = ~std::uint64_t{0};
  std::uint64_t choice_ = not_looked_at;  // CompositeSettings::scene_choice that wanted_ is of
  SceneFile wanted_;                      // no name: no scene
  std::optional<OpenScenes::Open> own_;   // the property's; none: no frame yet
  std::shared_ptr<const Scene> lamps_moved_,
      lamps_of_;  // the scene with its lamps elsewhere; of which
  /// What frame_'s mirrors were chosen by, and what was said of them last.
  struct {
    std::shared_ptr<const Scene> scene;
    std::string choice, missing;
  } mirrors_;
  /// The lights of an environment, and what they follow from.
  struct {
    std::shared_ptr<const Scene> scene;
    Bounds bounds;  // of the scene: they lie far outside of it
    std::size_t count = 0;
    std::vector<Light> lights;
  } around_;
  /// RenderFrame::soft_light, and what it follows from.
  struct {
    std::shared_ptr<const Environment> of;
    std::size_t count = 0;
    std::shared_ptr<const std::vector<EnvironmentPart>> parts;
  } soft_;
  RenderFrame frame_;
  std::vector<float> opacities_;  // of its subjects
  bool fading_ = false;           // any of them is below 1
  RenderPlan plan_;
  RenderSettings settings_;
  CompositeView view_ = CompositeView::composite;
  Camera viewport_;  // of the last frame that had one, as the lens has not changed it
  LensWatch lens_watch_;
  LensPicture lens_;
  std::optional<Camera> viewport_before_;  // the last frame's, and its time
  GstClockTime time_before_ = GST_CLOCK_TIME_NONE;
  std::uint64_t number_ = 0;                  // of the frame: what its grain is made of
  std::vector<std::uint8_t> through_lens_;    // what becomes video
  std::vector<std::uint8_t> unfaded_, less_;  // the background, and a composite of fewer subjects
  /// By a pass's name those of its times, which statistics_ points to.
  std::map<std::string_view, std::pair<std::string, std::string>> pass_figures_;
};

}  // namespace polyhull::element
