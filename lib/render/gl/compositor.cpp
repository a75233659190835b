// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/gl/compositor.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "render/gl/passes.h"
#include "render/view_picture.h"

namespace polyhull {
namespace {

using gl::Pass;

/// What decides the scene's depth as seen from the viewport.
struct DepthKey {
  const Scene* scene = nullptr;
  Mat4 clip_from_scene{0.0};
  int width = 0, height = 0;
  bool operator==(const DepthKey&) const = default;
};

/// What decides what of a subject is on the graphics processor.
struct SkinKey {
  std::uint64_t content = 0;
  std::vector<Vec3> eyes;
  int levels = 0;  // of smaller pictures; more than needed do no harm
  bool all_views = false;
  bool operator==(const SkinKey&) const = default;
};

}  // namespace

struct Compositor::State {
  gl::Program depth, blend;
  SkinPrograms skin;
  std::shared_ptr<const Scene> scene_held;  // keeps the pointer that keys compare with alive
  SceneBuffers scene;
  std::vector<SubjectBuffers> subjects;
  std::vector<SkinKey> skin_keys;
  gl::LightLayer light;
  gl::EdgeLayer front;
  ShadowPass shadow;
  MirrorPass mirror;
  gl::Texture background, output;
  gl::Framebuffer target, source;
  gl::VertexArray nothing;
  int background_width = 0, background_height = 0;
  std::optional<DepthKey> depth_key;
  Rectangle depth_part;
  gl::PassTimer timer;
  RenderStatistics& statistics;  // the renderer's

  explicit State(RenderStatistics& of_renderer) : statistics(of_renderer) {}

  void use_scene(const RenderFrame& frame);
  void upload_subjects(const RenderFrame& frame, const RenderPlan& plan,
                       const RenderSettings& settings);
  void draw_scene_depth(const PassInput& in);
  void draw_layers(const RenderFrame& frame, const RenderPlan& plan, const RenderSettings& settings,
                   GLuint background_texture);
  void draw_front(const PassInput& in);
  void draw_blend(const PassInput& in, GLuint background_texture, GLuint to);
  void finish(const RenderPlan& plan);
};

void Compositor::State::use_scene(const RenderFrame& frame) {
  if (frame.scene == scene_held) return;
  scene_held = frame.scene;
  depth_key.reset();
  if (scene_held) scene.load(*scene_held);
}

void Compositor::State::upload_subjects(const RenderFrame& frame, const RenderPlan& plan,
                                        const RenderSettings& settings) {
  subjects.resize(plan.subjects.size());
  skin_keys.resize(plan.subjects.size());
  statistics.mesh_reused = !plan.subjects.empty();
  for (std::size_t i = 0; i < plan.subjects.size(); ++i) {
    const PlacedSubject& subject = plan.subjects[i];
    SkinKey key{subject.content, eyes_on(subject, frame, plan), 0, !settings.skip};
    for (std::size_t k = 0; k < subject.mesh->views.size(); ++k)
      key.levels = std::max(key.levels, levels_needed(*subject.mesh, static_cast<int>(k), key.eyes,
                                                      plan.pixel_size));
    SkinKey enough = key;
    enough.levels = std::max(key.levels, skin_keys[i].levels);
    if (settings.skip && subject.content != 0 && skin_keys[i] == enough) continue;
    statistics.mesh_reused = false;
    subjects[i].upload_shape(subject.mesh->hull);
    const UploadCounts counts =
        subjects[i].upload_skin(*subject.mesh, key.eyes, key.levels, key.all_views);
    statistics.pictures_uploaded += counts.pictures;
    statistics.pictures_skipped += counts.pictures_skipped;
    statistics.bytes_uploaded += 4 * counts.pixels;
    skin_keys[i] = std::move(key);
  }
}

void Compositor::State::draw_scene_depth(const PassInput& in) {
  // The mirror looks up points all over the picture.
  Rectangle part = in.plan.shadow;
  if (!in.plan.mirror.empty() || !in.settings.skip) part = {0, 0, in.frame.width, in.frame.height};
  light.resize(in.frame.width, in.frame.height);
  const DepthKey key{in.frame.scene.get(), in.plan.clip_from_scene, in.frame.width,
                     in.frame.height};
  if (in.settings.skip && depth_key == key && intersection(part, depth_part) == part) {
    statistics.scene_depth_reused = true;
    return;
  }
  depth_key = key;
  depth_part = part;
  light.bind();
  gl::scissor(part);
  glDisable(GL_CULL_FACE);
  glDisable(GL_STENCIL_TEST);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);
  glDepthMask(GL_TRUE);
  glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
  glClear(GL_DEPTH_BUFFER_BIT);
  if (!depth.made()) depth = gl::Program("scene.vert", "depth.frag");
  depth.use();
  depth.set("clip_from_scene", glm::mat4(in.plan.clip_from_scene));
  in.scene.draw();
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
}

void Compositor::State::draw_front(const PassInput& in) {
  front.resize(in.frame.width, in.frame.height, in.settings.edge_samples);
  front.begin(in.plan.subject);
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
  glEnable(GL_CULL_FACE);
  glCullFace(GL_BACK);
  glFrontFace(GL_CW);  // the framebuffer's rows go down the picture
  if (!gl::is_embedded()) glEnable(GL_FRAMEBUFFER_SRGB);
  skin.draw(in, 0, clip);
  glDisable(GL_CULL_FACE);
  front.resolve(in.plan.subject);
  if (!gl::is_embedded()) glDisable(GL_FRAMEBUFFER_SRGB);
}

void Compositor::State::draw_blend(const PassInput& in, GLuint background_texture, GLuint to) {
  if (!blend.made()) blend = gl::Program("fullscreen.vert", "composite.frag");
  glBindFramebuffer(GL_FRAMEBUFFER, target.get());
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, to, 0);
  gl::check_framebuffer("output texture");
  glViewport(0, 0, in.frame.width, in.frame.height);
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_STENCIL_TEST);
  glDisable(GL_BLEND);
  blend.use();
  const auto bind = [&](int unit, const char* sampler, GLuint texture) {
    gl::bind_texture(unit, GL_TEXTURE_2D, texture);
    blend.set(sampler, unit);
  };
  bind(0, "background", background_texture);
  bind(1, "shadow", light.colour());
  bind(2, "mirror", mirror.image());
  bind(3, "mirrored_scene", mirror.shown());
  bind(4, "subject", front.texture());
  glBindVertexArray(nothing.get());
  if (const Mirror* m = mirror_of(in.frame, in.plan)) {
    const SceneMesh& mesh = in.frame.scene->meshes[static_cast<std::size_t>(m->mesh)];
    const Material& material = in.frame.scene->materials[static_cast<std::size_t>(mesh.material)];
    const PixelRays rays(resized(in.frame.viewport, in.frame.width, in.frame.height));
    blend.set("ray_x", rays.x);
    blend.set("ray_y", rays.y);
    blend.set("ray_0", rays.origin);
    blend.set("mirror_normal", m->normal);
    blend.set("mirror_f0", material.f0());
    blend.set("only_mirrors", material.only_mirrors());
    blend.set("reflection_alpha",
              in.settings.mirror == MirrorMode::plain ? in.settings.reflection_alpha : -1.0f);
  }
  // Every layer holds something only inside its own rectangle; outside it are old pixels. So the
  // changed part is drawn in pieces, each with the layers that reach it; where none does, the
  // background is copied, because the whole part is read back.
  const Rectangle parts[4] = {in.plan.shadow, in.plan.mirror, in.plan.subject, in.plan.mirror_shadow};
  std::vector<int> columns, rows;
  for (const Rectangle& part : parts) {
    if (part.empty()) continue;
    columns.insert(columns.end(), {part.x, part.x + part.width});
    rows.insert(rows.end(), {part.y, part.y + part.height});
  }
  for (auto* edges : {&columns, &rows}) {
    std::sort(edges->begin(), edges->end());
    edges->erase(std::unique(edges->begin(), edges->end()), edges->end());
  }
  for (std::size_t j = 0; j + 1 < rows.size(); ++j) {
    for (std::size_t i = 0; i + 1 < columns.size(); ++i) {
      const Rectangle piece{columns[i], rows[j], columns[i + 1] - columns[i],
                            rows[j + 1] - rows[j]};
      const auto reaches = [&](int layer) { return intersection(parts[layer], piece) == piece; };
      blend.set("has_shadow", reaches(0));
      blend.set("has_mirror", reaches(1));
      blend.set("has_subject", reaches(2));
      gl::scissor(piece);
      glDrawArrays(GL_TRIANGLES, 0, 3);
    }
  }
}

void Compositor::State::draw_layers(const RenderFrame& frame, const RenderPlan& plan,
                                    const RenderSettings& settings, GLuint background_texture) {
  const PassInput in{frame, plan, settings, scene, subjects, timer};
  glDisable(GL_BLEND);
  glDisable(GL_DITHER);
  const bool receivers = frame.scene && (!plan.shadow.empty() || !plan.mirror.empty());
  if (!plan.shadow.empty()) {
    timer.begin(Pass::shadow_maps);
    shadow.draw_maps(in);
    statistics.static_shadow_reused = shadow.static_reused();
    timer.end();
  }
  if (receivers) {
    timer.begin(Pass::scene_depth);
    draw_scene_depth(in);
    timer.end();
  }
  if (!plan.shadow.empty()) {
    timer.begin(Pass::shadow);
    shadow.draw(in, light);
    timer.end();
  }
  if (!plan.mirror.empty()) {
    timer.begin(Pass::mirror);
    mirror.draw(in, background_texture, light.depth());
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
  glUseProgram(0);
  glFrontFace(GL_CCW);
  glPixelStorei(GL_PACK_ROW_LENGTH, 0);
  glPixelStorei(GL_UNPACK_ROW_LENGTH, 0);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
  for (int unit = 4; unit >= 0; --unit) {
    gl::bind_texture(unit, GL_TEXTURE_2D, 0);
    glBindTexture(GL_TEXTURE_2D_ARRAY, 0);
  }
  statistics.subject_skipped = plan.subject.empty();
  statistics.shadow_skipped = plan.shadow.empty();
  statistics.mirror_skipped = plan.mirror.empty();
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

void Compositor::render(const RenderFrame& frame, const RenderPlan& plan,
                        const RenderSettings& settings, unsigned background, unsigned target) {
  State& s = *state_;
  s.statistics = {};
  s.timer.next_frame();
  s.timer.begin(Pass::upload);
  s.use_scene(frame);
  s.upload_subjects(frame, plan, settings);
  s.timer.end();
  s.draw_layers(frame, plan, settings, background);
  s.timer.begin(Pass::blend);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, s.source.get());
  glFramebufferTexture2D(GL_READ_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, background, 0);
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, s.target.get());
  glFramebufferTexture2D(GL_DRAW_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, target, 0);
  gl::check_framebuffer("output texture");
  glDisable(GL_SCISSOR_TEST);
  glBlitFramebuffer(0, 0, frame.width, frame.height, 0, 0, frame.width, frame.height,
                    GL_COLOR_BUFFER_BIT, GL_NEAREST);
  const PassInput in{frame, plan, settings, s.scene, s.subjects, s.timer};
  s.draw_blend(in, background, target);
  s.timer.end();
  s.finish(plan);
}

void Compositor::render(const RenderFrame& frame, const RenderPlan& plan,
                        const RenderSettings& settings, const std::uint8_t* background,
                        int background_stride, std::uint8_t* target, int target_stride) {
  State& s = *state_;
  s.statistics = {};
  s.timer.next_frame();
  const Rectangle changed = plan.changed();
  if (changed.empty()) return s.finish(plan);
  s.timer.begin(Pass::upload);
  s.use_scene(frame);
  s.upload_subjects(frame, plan, settings);
  if (s.background_width != frame.width || s.background_height != frame.height) {
    s.background_width = frame.width;
    s.background_height = frame.height;
    for (gl::Texture* texture : {&s.background, &s.output}) {
      gl::bind_texture(0, GL_TEXTURE_2D, texture->get());
      glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, frame.width, frame.height, 0, GL_RGBA,
                   GL_UNSIGNED_BYTE, nullptr);
      gl::texture_parameters(GL_TEXTURE_2D, GL_LINEAR);
    }
  }
  // The mirror looks up points all over the picture; the other passes only what they change.
  const Rectangle part = plan.mirror.empty() ? changed : Rectangle{0, 0, frame.width, frame.height};
  gl::bind_texture(0, GL_TEXTURE_2D, s.background.get());
  glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
  glPixelStorei(GL_UNPACK_ROW_LENGTH, background_stride / 4);
  glTexSubImage2D(
      GL_TEXTURE_2D, 0, part.x, part.y, part.width, part.height, GL_RGBA, GL_UNSIGNED_BYTE,
      background + static_cast<std::ptrdiff_t>(part.y) * background_stride + 4 * part.x);
  glPixelStorei(GL_UNPACK_ROW_LENGTH, 0);
  s.statistics.bytes_uploaded +=
      4ull * static_cast<std::uint64_t>(part.width) * static_cast<std::uint64_t>(part.height);
  s.timer.end();
  s.draw_layers(frame, plan, settings, s.background.get());
  const PassInput in{frame, plan, settings, s.scene, s.subjects, s.timer};
  s.timer.begin(Pass::blend);
  s.draw_blend(in, s.background.get(), s.output.get());
  s.timer.end();
  s.timer.begin(Pass::read_back);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, s.target.get());
  glPixelStorei(GL_PACK_ALIGNMENT, 4);
  glPixelStorei(GL_PACK_ROW_LENGTH, target_stride / 4);
  glReadPixels(changed.x, changed.y, changed.width, changed.height, GL_RGBA, GL_UNSIGNED_BYTE,
               target + static_cast<std::ptrdiff_t>(changed.y) * target_stride + 4 * changed.x);
  s.timer.end();
  s.finish(plan);
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
