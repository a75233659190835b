// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/composite/frame.h"

#include <gst/gl/gl.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "base/error.h"
#include "base/stopwatch.h"
#include "plugins/common/guard.h"
#include "plugins/common/memory/scene_metas.h"
#include "plugins/common/memory/video_frame.h"
#include "render/fill.h"

namespace polyhull::element {
namespace {

constexpr GstMapFlags on_gpu(GstMapFlags flags) {
  return static_cast<GstMapFlags>(flags | GST_MAP_GL);
}

}  // namespace

void check_strides(int from, int to) {
  if (from % 4 == 0 && to % 4 == 0) return;
  throw Error(Error::Kind::unsupported,
              "Composite got pictures whose rows are {} and {} bytes apart, which is not a "
              "multiple of four. Put a videoconvert in front of it and behind it.",
              from, to);
}

FrameComposer::FrameComposer(CompositeGl& gl, Statistics& statistics)
    : gl_(gl), statistics_(statistics) {
  statistics.declare({"drawn",
                      "drawn-by-processor",
                      "gl-failures",
                      "rays",
                      "subject-skipped",
                      "shadow-skipped",
                      "mirror-skipped",
                      "mirrors",
                      "mirrors-skipped",
                      "mirrors-missing",
                      "shadow-lights",
                      "lights-skipped",
                      "scene-depth-reused",
                      "scene-planes-taken",
                      "static-shadow-reused",
                      "mesh-reused",
                      "pictures-uploaded",
                      "pictures-skipped",
                      "bytes-uploaded",
                      "image-based",
                      "image-based-refused",
                      "meshes-without-surface",
                      "subjects-unmatched",
                      "background-bytes-uploaded",
                      "backgrounds-converted",
                      "colours-unconverted",
                      "through-lens",
                      "motion-blurred",
                      "lens-without-scene",
                      "scenes-unusable",
                      "viewports-unusable",
                      "pixels-shaded",
                      "pixels-changed"});
}

void FrameComposer::prepare(const CompositeSettings& settings, const GstVideoInfo& info,
                            GstBuffer* background, GstClockTime time, bool live,
                            const std::vector<GstAggregatorPad*>& meshes, bool on_gpu) {
  settings_ = render_settings(settings);
  view_ = settings.view;
  frame_.width = GST_VIDEO_INFO_WIDTH(&info);
  frame_.height = GST_VIDEO_INFO_HEIGHT(&info);
  frame_.planes = PlanesMeta::get(background);
  frame_.depth = DepthMeta::get(background);
  frame_.subjects.clear();
  opacities_.clear();
  const bool image_based = settings.subject == SubjectShape::image_based;
  const bool by_image = image_based && !on_gpu && settings.backend != Backend::gl;
  if (image_based && !by_image && !meshes.empty())
    statistics_.warn(gl_.element(), "image-based-refused",
                     "OpenGL does not draw subject=image-based: the meshes' triangles are drawn "
                     "instead. Set backend=processor, with pictures in system memory.");
  for (GstAggregatorPad* pad : meshes) add_subject(pad, by_image);
  fading_ = std::any_of(opacities_.begin(), opacities_.end(), [](float o) { return o < 1.0f; });
  set_viewport(settings, time, 1.0 * GST_VIDEO_INFO_PAR_N(&info) / GST_VIDEO_INFO_PAR_D(&info));
  set_scene(settings, live);
  set_mirrors(settings.mirrors);
  set_lens(settings, info, background);
  number_ = GST_BUFFER_PTS_IS_VALID(background) ? GST_BUFFER_PTS(background) : number_ + 1;
  on_gpu_ = on_gpu;
  // Without a mesh no context is needed, nor made.
  plan_ = {};
  if (frame_.subjects.empty()) return;
  with_gl_ = !by_image && draws_with_gl(settings.backend, on_gpu);
  scenes_.want_rays(!with_gl_ || std::any_of(frame_.subjects.begin(), frame_.subjects.end(),
                                             [](const RenderSubject& subject) {
                                               return subject.lighting != SubjectLighting::off;
                                             }));
  // The processor uploads nothing, and of pictures in OpenGL's memory nobody does.
  frame_.background_content = 0;
  if (with_gl_ && !on_gpu && !lens_.active() && !fading_)
    frame_.background_content = background_content_.number_of(background);
  else
    background_content_.reset();
  set_soft_light();
  plan_ = plan();
  for (GstAggregatorPad* pad : meshes) match(pad);
}

/// Of frame_; empty, and no renderer is asked, where that has no subject.
RenderPlan FrameComposer::plan() {
  if (frame_.subjects.empty()) return {};
  if (with_gl_) return gl_.plan(frame_, settings_);
  if (!processor_) processor_ = std::make_unique<ProcessorRenderer>();
  return processor_->plan(frame_, settings_);
}

/// What is drawn of the pad's mesh by its silhouettes, made once; null where they are of no use.
std::shared_ptr<const ImageSubject> FrameComposer::image_of(GstAggregatorPad* pad) {
  MeshPadState& state = state_of<MeshPadState>(pad);
  if (state.image_content == state.content) return state.image;
  state.image_content = state.content;
  state.image.reset();
  try {
    const Stopwatch watch;
    state.image = std::make_shared<const ImageSubject>(image_subject(state.mesh->mesh()));
    statistics_.set("image-based-ms", watch.milliseconds());
    statistics_.count("image-based");
  } catch (const Error& error) {
    statistics_.warn(
        gl_.element(), "meshes-unusable",
        fmt::format("A mesh on {} is not drawn: {}", GST_OBJECT_NAME(pad), error.what()));
  }
  return state.image;
}

/// Adds what is to be drawn of the pad's mesh to the frame.
void FrameComposer::add_subject(GstAggregatorPad* pad, bool by_image) {
  const MeshPadState& state = state_of<MeshPadState>(pad);
  const Mesh& mesh = state.mesh->mesh();
  const std::shared_ptr<const ImageSubject> image = by_image ? image_of(pad) : nullptr;
  if (by_image && !image) return;
  if (!by_image && mesh.hull.empty()) {
    statistics_.warn(gl_.element(), "meshes-without-surface",
                     fmt::format("The mesh on {} has silhouettes but no triangles, so nothing of "
                                 "it is seen. Set subject=image-based, or hullbuild "
                                 "surface=polyhedral; or the silhouettes do not meet.",
                                 GST_OBJECT_NAME(pad)));
    return;
  }
  const PlacementSettings settings = snapshot(pad, state.placement);
  frame_.subjects.push_back({&mesh, placement(settings), state.content, image, settings.light,
                             static_cast<float>(settings.relight), grade(settings)});
  opacities_.push_back(mesh.opacity);
}

/// Has the context ready where OpenGL is chosen.
bool FrameComposer::draws_with_gl(Backend wanted, bool on_gpu) {
  if (wanted == Backend::processor || (gl_failed_ && !on_gpu)) return false;
  if (wanted == Backend::gl || on_gpu) {
    gl_.ensure();
    return true;
  }
  return gl_.has_hardware();
}

std::optional<unsigned> FrameComposer::draw(const FrameBuffers& buffers, GstBuffer* output,
                                            bool later) {
  const bool key = view_ == CompositeView::key, video = is_video_output(*buffers.output);
  if (lens_.active() || fading_ || (key && video)) {
    draw_through_lens(buffers, output);
  } else if (with_gl_ && buffers.background_on_gpu && buffers.output_on_gpu && !key) {
    draw_on_gpu(buffers, output);
  } else if (video) {
    draw_as_video(buffers, output);
  } else {
    const std::optional<unsigned> place =
        draw_in_memory(buffers, output, later && !on_gpu_ && !key);
    if (!key) return place;
  }
  if (!key || video) return std::nullopt;
  const MappedFrame target(*buffers.info, output, GST_MAP_READWRITE);
  show_key(target.data(), target.stride(), GST_VIDEO_INFO_WIDTH(buffers.info),
           GST_VIDEO_INFO_HEIGHT(buffers.info));
  return std::nullopt;
}

void FrameComposer::draw_on_gpu(const FrameBuffers& buffers, GstBuffer* output) {
  // What other threads of other contexts draw must be finished.
  if (GstGLSyncMeta* sync = gst_buffer_get_gl_sync_meta(buffers.background))
    gst_gl_sync_meta_wait(sync, gl_.context());
  const MappedFrame background(*buffers.info, buffers.background, on_gpu(GST_MAP_READ));
  const MappedFrame target(*buffers.info, output, on_gpu(GST_MAP_WRITE));
  run_gl([&](Compositor& compositor) {
    compositor.render(frame_, plan_, settings_, background.texture(), target.texture());
    report(compositor.statistics());
  });
  if (GstGLSyncMeta* sync = gst_buffer_get_gl_sync_meta(output))
    gst_gl_sync_meta_set_sync_point(sync, gl_.context());
}

void FrameComposer::with_renderer(const std::function<void(Renderer&)>& work) {
  if (with_gl_ && run_gl(work)) return;
  if (processor_) work(*processor_);
}

bool FrameComposer::run_gl(const std::function<void(Compositor&)>& work) {
  try {
    gl_.run(work);
    return true;
  } catch (const Error& error) {
    give_up_gl(error);
    return false;
  }
}

void FrameComposer::give_up_gl(const Error& why) {
  if (on_gpu_)
    throw Error(why.kind(),
                "OpenGL failed: {} Pictures in its memory cannot be drawn without it. Stop and "
                "start the pipeline; with pictures in system memory on both sides the processor "
                "would have gone on.",
                sentence(why.what()));
  with_gl_ = false;
  gl_failed_ = true;
  if (!processor_) processor_ = std::make_unique<ProcessorRenderer>();
  gl_.release();
  statistics_.warn(
      gl_.element(), "gl-failures",
      fmt::format("OpenGL failed: {} The processor draws from this frame on, more slowly. Look "
                  "at the graphics driver's messages, and stop and start the pipeline to draw "
                  "with OpenGL again.",
                  sentence(why.what())));
}

GstBuffer* FrameComposer::background_as_video(const FrameBuffers& buffers) {
  const std::uint64_t before = background_video_.conversions();
  GstBuffer* video = background_video_.of(buffers.background, *buffers.info, *buffers.output);
  statistics_.count("backgrounds-converted", background_video_.conversions() - before);
  return gst_buffer_copy(video);
}

void FrameComposer::draw_as_video(const FrameBuffers& buffers, GstBuffer* output) {
  g_autoptr(GstBuffer) untouched = background_as_video(buffers);
  const MappedFrame background(*buffers.info, buffers.background, GST_MAP_READ);
  const MappedFrame target(*buffers.output, output, GST_MAP_WRITE);
  check_strides(background.stride(), 0);
  {
    const MappedFrame from(*buffers.output, untouched, GST_MAP_READ);
    gst_video_frame_copy(const_cast<GstVideoFrame*>(&target.frame()), &from.frame());
  }
  with_renderer([&](Renderer& renderer) {
    renderer.render_yuv(frame_, plan_, settings_, background.data(), background.stride(),
                        yuv_picture(target.frame()));
    report(renderer.statistics());
  });
}

std::optional<unsigned> FrameComposer::draw_in_memory(const FrameBuffers& buffers,
                                                      GstBuffer* output, bool later) {
  std::optional<unsigned> place;
  const auto draw = [&](const std::uint8_t* from, int from_stride, std::uint8_t* to,
                        int to_stride) {
    check_strides(from_stride, to_stride);
    const auto start = [&](Compositor& compositor) {
      place = compositor.start(frame_, plan_, settings_, from, from_stride);
      report(compositor.statistics());
    };
    if (later && with_gl_ && run_gl(start)) return;
    with_renderer([&](Renderer& renderer) {
      renderer.render(frame_, plan_, settings_, from, from_stride, to, to_stride);
      report(renderer.statistics());
    });
  };
  if (output == buffers.background) {
    const MappedFrame both(*buffers.info, output, GST_MAP_READWRITE);
    draw(both.data(), both.stride(), both.data(), both.stride());
    return place;
  }
  const MappedFrame background(*buffers.info, buffers.background, GST_MAP_READ);
  const MappedFrame target(*buffers.info, output, GST_MAP_READWRITE);
  const std::size_t row = 4 * static_cast<std::size_t>(frame_.width);
  for (int y = 0; y < frame_.height; ++y)
    std::memcpy(target.data() + static_cast<std::ptrdiff_t>(y) * target.stride(),
                background.data() + static_cast<std::ptrdiff_t>(y) * background.stride(), row);
  draw(background.data(), background.stride(), target.data(), target.stride());
  return place;
}

bool FrameComposer::take(unsigned place, const GstVideoInfo& info, GstBuffer* output) {
  if (gl_failed_) return false;
  const MappedFrame target(info, output, GST_MAP_READWRITE);
  return run_gl(
      [&](Compositor& compositor) { compositor.take(place, target.data(), target.stride()); });
}

void FrameComposer::report(const RenderStatistics& s) {
  for (const RenderStatistics::PassTime& pass : s.passes) {
    const auto [found, fresh] = pass_figures_.try_emplace(pass.name);
    auto& [cpu, gpu] = found->second;
    if (fresh) {
      cpu = std::string(pass.name) + "-ms";
      gpu = std::string(pass.name) + "-gpu-ms";
    }
    statistics_.set(cpu.c_str(), pass.cpu_milliseconds);
    statistics_.set(gpu.c_str(), pass.gpu_milliseconds);
  }
  statistics_.count("drawn");
  if (!with_gl_) statistics_.count("drawn-by-processor");
  statistics_.count("rays", s.rays);
  statistics_.count("pictures-uploaded", s.pictures_uploaded);
  statistics_.count("pictures-skipped", s.pictures_skipped);
  statistics_.count("bytes-uploaded", s.bytes_uploaded);
  statistics_.count("background-bytes-uploaded", s.background_bytes_uploaded);
  statistics_.count("pixels-shaded", s.pixels_shaded);
  statistics_.count("pixels-changed", s.pixels_changed);
  statistics_.count("subject-skipped", s.subject_skipped);
  statistics_.count("shadow-skipped", s.shadow_skipped);
  statistics_.count("mirror-skipped", s.mirror_skipped);
  statistics_.count("mirrors", s.mirrors);
  statistics_.count("mirrors-skipped", s.mirrors_skipped);
  statistics_.count("shadow-lights", s.shadow_lights);
  statistics_.count("lights-skipped", s.lights_skipped);
  statistics_.count("scene-depth-reused", s.scene_depth_reused);
  statistics_.count("scene-planes-taken", s.scene_planes_taken);
  statistics_.count("static-shadow-reused", s.static_shadow_reused);
  statistics_.count("mesh-reused", s.mesh_reused);
}

void FrameComposer::reset() {
  with_gl_ = false;
  gl_failed_ = false;
  announcement_.reset();
  processor_.reset();
  background_content_.reset();
  background_video_.reset();
  own_.reset();
  lamps_moved_.reset();
  lamps_of_.reset();
  mirrors_ = {};
  around_ = {};
  choice_ = not_looked_at;
  frame_ = {};
  scenes_.reset();
  plan_ = {};
  viewport_ = {};
  lens_ = {};
  lens_watch_ = {};
  through_lens_ = {};
  number_ = 0;
  forget_motion();
}

}  // namespace polyhull::element
