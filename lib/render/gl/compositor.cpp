// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/gl/compositor.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "base/error.h"
#include "render/fill.h"
#include "render/gl/background_texture.h"
#include "render/gl/objects/pixel_query.h"
#include "render/gl/objects/pixel_readings.h"
#include "render/gl/passes.h"
#include "render/subject/view_picture.h"

namespace polyhull {
namespace {

using gl::Pass;

/// What decides what of a subject is on the graphics processor.
struct SkinKey {
  std::uint64_t content = 0;
  std::vector<Vec3> eyes;
  int levels = 0;  // of smaller pictures; more than needed do no harm
  bool all_views = false, soft = false;
  double pixel_size = 0.0;  // where the weights depend on it
  bool operator==(const SkinKey&) const = default;
};

}  // namespace

struct Compositor::State {
  gl::Program depth;
  SkinPrograms skin;
  std::shared_ptr<const Scene> scene_held;  // keeps the pointer that keys compare with alive
  SceneBuffers scene;
  std::vector<SubjectBuffers> subjects;
  std::vector<SkinKey> skin_keys;
  SceneLayers layers;  // as the viewport sees the scene
  DepthPicturePass depth_picture;
  gl::EdgeLayer front;
  LightMaps maps;  // of the latest lights that throw shadows
  ShadowPrograms shadow_programs;
  ShadowPass shadow{shadow_programs};                               // on the layers
  std::map<std::vector<std::size_t>, MirrorShadow> mirror_shadows;  // by SeenMirror::way
  MirrorPass mirror;
  BlendPass blend;
  BackgroundTexture background;
  gl::PictureTexture output;
  gl::PictureTexture beneath;  // the background with what all but one of the mirrors show
  gl::PictureTarget target;
  gl::PixelReadings readings;
  gl::PixelQuery blended, blended_for[2];  // pixels that the blend draws: of render(), by places
  std::uint64_t later_shaded = 0, later_changed = 0;  // of pictures taken since the last frame
  gl::PassTimer timer;
  RenderStatistics& statistics;  // the renderer's

  explicit State(RenderStatistics& of_renderer) : statistics(of_renderer) {}

  PassInput input(const RenderFrame& frame, const RenderPlan& plan, const RenderSettings& settings,
                  bool translucent) {
    PassInput in{frame, plan, settings, scene, subjects, timer, {}, glm::vec3(0.0f), translucent};
    set_lights(in);
    return in;
  }

  void use_scene(const RenderFrame& frame);
  void upload_subjects(const RenderPlan& plan, const RenderSettings& settings);
  void draw_layers(const PassInput& in);
  void draw_maps(const PassInput& in);
  bool draw_scene(const PassInput& in);
  void draw_shadows(const PassInput& in);
  void draw_front(const PassInput& in);
  MirrorShadow* shadow_in(const SeenMirror& seen);
  void draw_picture(const PassInput& in, GLuint background_texture, GLuint to,
                    const Rectangle& copied, gl::PixelQuery* blended);
  void draw_blend(const PassInput& in, GLuint below, const SeenMirror* seen, bool front, GLuint to,
                  gl::PixelQuery* blended);
  void finish(const RenderPlan& plan);
};

void Compositor::State::use_scene(const RenderFrame& frame) {
  if (frame.scene == scene_held) return;
  scene_held = frame.scene;
  layers.forget();
  mirror_shadows.clear();
  if (scene_held) scene.load(*scene_held);
}

void Compositor::State::upload_subjects(const RenderPlan& plan, const RenderSettings& settings) {
  subjects.resize(plan.subjects.size());
  skin_keys.resize(plan.subjects.size());
  statistics.mesh_reused = !plan.subjects.empty();
  for (std::size_t i = 0; i < plan.subjects.size(); ++i) {
    const PlacedSubject& subject = plan.subjects[i];
    SkinKey key{subject.content, eyes_on(subject, plan), 0, !settings.skip, settings.soft_edges};
    if (subject.mesh->texturing && subject.mesh->texturing->metric == TextureMetric::lumigraph)
      key.pixel_size = plan.pixel_size;
    for (std::size_t k = 0; k < subject.mesh->views.size(); ++k)
      key.levels = std::max(
          key.levels, levels_needed(*subject.mesh, static_cast<int>(k), key.eyes, plan.pixel_size));
    SkinKey enough = key;
    enough.levels = std::max(key.levels, skin_keys[i].levels);
    if (!settings.skip || subject.content == 0 || skin_keys[i] != enough) {
      statistics.mesh_reused = false;
      subjects[i].upload_shape(subject.mesh->hull);
      const UploadCounts counts = subjects[i].upload_skin(*subject.mesh, key.eyes, plan.pixel_size,
                                                          key.levels, key.all_views, key.soft);
      statistics.pictures_uploaded += counts.pictures;
      statistics.pictures_skipped += counts.pictures_skipped;
      statistics.bytes_uploaded += 4 * counts.pixels;
      skin_keys[i] = std::move(key);
    }
    subjects[i].upload_form(subject.form);
  }
}

void Compositor::State::draw_front(const PassInput& in) {
  front.resize(in.frame.width, in.frame.height, in.settings.edge_samples);
  const Rectangle part = whole_tiles(in.plan.subject, in.frame.width, in.frame.height);
  front.begin(part);
  glDisable(GL_CULL_FACE);
  glDisable(GL_STENCIL_TEST);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);
  const glm::mat4 clip(in.plan.clip_from_scene);
  if (in.frame.scene) {
    glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
    if (!depth.made()) depth = gl::Program("scene.vert", "depth.frag");
    depth.use();
    depth.set("clip_from_scene", clip);
    in.scene.draw();
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  }
  depth_picture.draw(in);
  glEnable(GL_CULL_FACE);
  glCullFace(GL_BACK);
  glFrontFace(GL_CW);  // the framebuffer's rows go down the picture
  if (!gl::is_embedded()) glEnable(GL_FRAMEBUFFER_SRGB);
  skin.draw(in, 0, clip);
  glDisable(GL_CULL_FACE);
  if (in.settings.soft_edges) skin.draw_ribbons(in, clip);
  front.resolve(part);
  if (!gl::is_embedded()) glDisable(GL_FRAMEBUFFER_SRGB);
}

/// Puts what mirror \p seen shows (null: none), and with \p front what is seen directly, over \p below.
void Compositor::State::draw_blend(const PassInput& in, GLuint below, const SeenMirror* seen,
                                   bool is_front, GLuint to, gl::PixelQuery* blended) {
  target.bind(to);
  if (blended) blended->begin();
  blend.draw(in, {below, is_front, layers, shadow, front.texture(), seen, &mirror,
                  seen ? shadow_in(*seen) : nullptr});
  if (blended) blended->end();
}

MirrorShadow* Compositor::State::shadow_in(const SeenMirror& seen) {
  return &mirror_shadows.try_emplace(seen.way, shadow_programs).first->second;
}

/// Draws the layers and puts them together over \p background_texture in \p to, which becomes it first
/// in \p copied. Mirrors come one by one, the last first: of two that belong to one pixel each takes
/// the place of what is there.
void Compositor::State::draw_picture(const PassInput& in, GLuint background_texture, GLuint to,
                                     const Rectangle& copied, gl::PixelQuery* blended) {
  draw_layers(in);
  std::vector<const SeenMirror*> seen;
  for (const SeenMirror& mirror : in.plan.mirrors)
    if (!mirror.image.empty() || !mirror.shadow.empty()) seen.push_back(&mirror);
  GLuint below = background_texture;
  const auto draw_image = [&](const SeenMirror& of) {
    if (!of.image.empty()) mirror.draw(in, of, background_texture, layers.depth());
  };
  if (!seen.empty()) timer.begin(Pass::mirror);
  if (seen.size() > 1) {
    beneath.resize(in.frame.width, in.frame.height);
    below = beneath.get();
    target.copy(background_texture, to, copied);
    target.copy(background_texture, below, in.plan.changed());
  }
  for (; seen.size() > 1; seen.pop_back()) {
    draw_image(*seen.back());
    draw_blend(in, below, seen.back(), false, to, blended);
    target.copy(to, below, bounding(seen.back()->image, seen.back()->shadow));
  }
  if (!seen.empty()) {
    draw_image(*seen[0]);
    timer.end();
  }
  timer.begin(Pass::blend);
  if (below == background_texture) target.copy(background_texture, to, copied);
  draw_blend(in, below, seen.empty() ? nullptr : seen[0], true, to, blended);
  timer.end();
}

/// Makes ready the scene as the viewport sees it and as the plan's mirrors show it; returns whether all
/// was kept.
bool Compositor::State::draw_scene(const PassInput& in) {
  const RenderPlan& plan = in.plan;
  // Mirrors look up points all over the picture.
  const bool whole = !plan.mirror().empty() || !in.settings.skip;
  bool kept = layers.draw(in.frame, in.settings.skip, direct_view(in.frame, plan),
                          whole ? Rectangle{0, 0, in.frame.width, in.frame.height} : plan.shadow,
                          in.grid_step(), scene);
  // Layers are large: where the viewport has passed many mirrors, theirs go.
  if (mirror_shadows.size() > most_mirrors)
    std::erase_if(mirror_shadows, [&](const auto& own) {
      return std::none_of(plan.mirrors.begin(), plan.mirrors.end(),
                          [&](const SeenMirror& seen) { return seen.way == own.first; });
    });
  for (const SeenMirror& seen : plan.mirrors)
    if (!seen.shadow.empty())
      kept = shadow_in(seen)->layers.draw(in.frame, in.settings.skip, view_in_mirror(plan, seen),
                                          seen.shadow, in.grid_step(), scene) &&
             kept;
  return kept;
}

void Compositor::State::draw_shadows(const PassInput& in) {
  const RenderPlan& plan = in.plan;
  const Rectangle asked = bounding(plan.shadow, plan.mirror_shadow());
  if (!plan.shadow.empty()) shadow.draw(in, maps, layers, plan.shadow, asked);
  for (const SeenMirror& seen : plan.mirrors) {
    if (seen.shadow.empty()) continue;
    MirrorShadow& own = *shadow_in(seen);
    own.shadow.draw(in, maps, own.layers, seen.shadow, asked);
  }
}

/// Draws the depth maps of the lights that throw shadows.
void Compositor::State::draw_maps(const PassInput& in) {
  std::erase_if(maps, [&](const auto& own) {
    return std::none_of(in.lights.begin(), in.lights.end(),
                        [&](const PassLight& light) { return light.planned.light == own.first; });
  });
  const SubjectsShape shape = shape_of(in.plan);
  statistics.static_shadow_reused = true;
  for (const PassLight& light : in.lights) {
    ShadowMaps& own = maps[light.planned.light];
    own.draw(in, light, shape, shadow_programs);
    statistics.static_shadow_reused = statistics.static_shadow_reused && own.static_reused();
  }
}

void Compositor::State::draw_layers(const PassInput& in) {
  const RenderFrame& frame = in.frame;
  const RenderPlan& plan = in.plan;
  glDisable(GL_BLEND);
  glDisable(GL_DITHER);
  const bool shadows = !plan.shadow.empty() || !plan.mirror_shadow().empty();
  if (shadows) {
    timer.begin(Pass::shadow_maps);
    draw_maps(in);
    timer.end();
  }
  if (frame.scene && (shadows || !plan.mirror().empty())) {
    timer.begin(Pass::scene_depth);
    statistics.scene_depth_reused = draw_scene(in);
    timer.end();
  }
  if (shadows) {
    timer.begin(Pass::shadow);
    draw_shadows(in);
    timer.end();
  }
  if (!plan.subject.empty()) {
    timer.begin(Pass::subject);
    draw_front(in);
    timer.end();
  }
}

void Compositor::State::finish(const RenderPlan& plan) {
  // What others in this context may not expect.
  glDisable(GL_SCISSOR_TEST);
  glDisable(GL_DEPTH_TEST);
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
  glBindVertexArray(0);
  glBindBuffer(GL_ARRAY_BUFFER, 0);
  glUseProgram(0);
  glFrontFace(GL_CCW);
  glPixelStorei(GL_PACK_ROW_LENGTH, 0);
  glPixelStorei(GL_UNPACK_ROW_LENGTH, 0);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
  for (int unit = 10; unit >= 0; --unit) {
    gl::bind_texture(unit, GL_TEXTURE_2D, 0);
    glBindTexture(GL_TEXTURE_2D_ARRAY, 0);
    glBindTexture(GL_TEXTURE_3D, 0);
  }
  statistics.take(plan);
  statistics.passes.clear();
  for (std::size_t i = 0; i < gl::pass_count; ++i) {
    const auto pass = static_cast<Pass>(i);
    statistics.passes.push_back(
        {gl::pass_name(pass), timer.cpu_milliseconds(pass), timer.gpu_milliseconds(pass)});
  }
}

Compositor::Compositor() {
  const int version = epoxy_gl_version();
  const bool embedded = gl::is_embedded();
  if (version < (embedded ? 30 : 33)) {
    throw Error(Error::Kind::unsupported,
                "Drawing composites with OpenGL needs version 3.3, or OpenGL ES 3.0; this context "
                "is {}{}.{}. Let the processor draw them (backend=processor).",
                embedded ? "OpenGL ES " : "OpenGL ", version / 10, version % 10);
  }
  state_ = std::make_unique<State>(statistics_);
}

Compositor::~Compositor() = default;

void Compositor::abandon() {
  const gl::ContextGone gone;
  state_.reset();
}

void Compositor::render(const RenderFrame& frame, const RenderPlan& plan,
                        const RenderSettings& settings, unsigned background, unsigned target) {
  State& s = *state_;
  gl::forget_errors();
  s.statistics = {};
  s.timer.next_frame();
  s.timer.begin(Pass::upload);
  s.use_scene(frame);
  s.upload_subjects(plan, settings);
  s.timer.end();
  const PassInput in = s.input(frame, plan, settings, settings.alpha != AlphaCoding::ignored);
  s.draw_picture(in, background, target, {0, 0, frame.width, frame.height}, nullptr);
  s.finish(plan);
  gl::check_errors();
}

/// Draws what changes into the output's texture, which is then what is read from.
void Compositor::draw(const RenderFrame& frame, const RenderPlan& plan,
                      const RenderSettings& settings, const std::uint8_t* background,
                      int background_stride, gl::PixelQuery& blended) {
  State& s = *state_;
  const Rectangle changed = plan.changed();
  gl::forget_errors();
  s.timer.begin(Pass::upload);
  s.use_scene(frame);
  s.upload_subjects(plan, settings);
  s.output.resize(frame.width, frame.height);
  // Mirrors look up points all over the picture; the other passes only what they change.
  const Rectangle part =
      plan.mirror().empty() ? changed : Rectangle{0, 0, frame.width, frame.height};
  const std::uint64_t bytes =
      s.background.update(frame, part, background, background_stride, settings.skip);
  s.statistics.background_bytes_uploaded = bytes;
  s.statistics.bytes_uploaded += bytes;
  s.timer.end();
  const PassInput in = s.input(frame, plan, settings,
                               settings.alpha != AlphaCoding::ignored &&
                                   any_translucent(background, background_stride, part));
  blended.forget();
  s.draw_picture(in, s.background.get(), s.output.get(), changed, &blended);
  gl::check_errors();
  s.target.read();
  glPixelStorei(GL_PACK_ALIGNMENT, 4);
}

void Compositor::render(const RenderFrame& frame, const RenderPlan& plan,
                        const RenderSettings& settings, const std::uint8_t* background,
                        int background_stride, std::uint8_t* target, int target_stride) {
  State& s = *state_;
  s.statistics = {};
  s.timer.next_frame();
  const Rectangle changed = plan.changed();
  if (changed.empty()) return s.finish(plan);
  // Fails before anything is written, so that target can be drawn otherwise.
  draw(frame, plan, settings, background, background_stride, s.blended);
  s.timer.begin(Pass::read_back);
  glPixelStorei(GL_PACK_ROW_LENGTH, target_stride / 4);
  glReadPixels(changed.x, changed.y, changed.width, changed.height, GL_RGBA, GL_UNSIGNED_BYTE,
               target + static_cast<std::ptrdiff_t>(changed.y) * target_stride + 4 * changed.x);
  s.statistics.pixels_shaded = s.blended.take();
  s.statistics.pixels_changed = s.background.pixels_changed(changed, target, target_stride);
  s.timer.end();
  s.finish(plan);
  gl::check_errors();
}

unsigned Compositor::start(const RenderFrame& frame, const RenderPlan& plan,
                           const RenderSettings& settings, const std::uint8_t* background,
                           int background_stride) {
  State& s = *state_;
  s.statistics = {};
  s.statistics.pixels_shaded = std::exchange(s.later_shaded, 0);
  s.statistics.pixels_changed = std::exchange(s.later_changed, 0);
  s.timer.next_frame();
  if (!plan.changed().empty())
    draw(frame, plan, settings, background, background_stride, s.blended_for[s.readings.next()]);
  s.timer.begin(Pass::read_back);
  const unsigned place = s.readings.start(plan.changed());
  s.timer.end();
  s.finish(plan);
  gl::check_errors();
  return place;
}

void Compositor::take(unsigned place, std::uint8_t* target, int target_stride) {
  state_->later_changed += state_->readings.take(place, target, target_stride);
  state_->later_shaded += state_->blended_for[place].take();
}

void Compositor::wait_for_passes(bool wait) {
  state_->timer.wait_for_passes(wait);
}

std::string Compositor::description() const {
  const auto text = [](GLenum name) {
    const auto* words = reinterpret_cast<const char*>(glGetString(name));
    return std::string(words ? words : "?");
  };
  return text(GL_VERSION) + " (" + text(GL_RENDERER) + ")";
}

}  // namespace polyhull
