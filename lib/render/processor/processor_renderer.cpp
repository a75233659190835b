// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/processor/processor_renderer.h"

#include <algorithm>
#include <atomic>
#include <limits>
#include <numbers>
#include <optional>

#include "base/srgb.h"
#include "base/stopwatch.h"
#include "base/thread_pool.h"
#include "render/processor/area_shadow.h"
#include "render/processor/mirror_view.h"
#include "render/processor/scene_layer.h"
#include "render/processor/skin.h"

namespace polyhull {

using namespace processor;

namespace {

/// A subject ready to be drawn.
struct ReadySubject {
  Skin skin;
  std::uint64_t content = 0;
  Mat4 local_to_scene{1.0};
};

/// The subjects as one eye sees them: the viewport's own, or the mirrored one.
struct SubjectLayer {
  ScreenTriangles triangles;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> vertex_of;  // by id: subject, first vertex
};

/// A thread's working memory for one band.
struct BandScratch {
  std::vector<float> inverse;
  std::vector<std::uint32_t> ids;
  std::vector<glm::vec4> front, image;
  std::vector<SkinItems> items;
  SkinScratch skin;
};

int samples_of(const RenderSettings& settings) {
  const int wanted = settings.edge_samples;
  return wanted >= 8 ? 8 : wanted >= 4 ? 4 : wanted >= 2 ? 2 : 1;
}

}  // namespace

struct ProcessorRenderer::State {
  std::shared_ptr<const Scene> scene_held;
  std::optional<TracedScene> scene;
  SceneLayer direct, mirrored;
  SceneLayer around;  // as direct, all over the picture, where a mirror's points are looked up
  AreaShadow shadow;
  bool shadow_known = false;  // of the subjects and light that shadow has
  Light shadow_light;
  std::vector<ReadySubject> subjects;
  SubjectLayer front, image;
  std::vector<std::uint8_t> background_copy;
  std::vector<std::uint64_t> albedo;  // by pixel: 16 bits per colour, and 1 above them where known

  bool ready_subjects(const RenderFrame& frame, const RenderPlan& plan,
                      const RenderSettings& settings, RenderStatistics& statistics);
  void bring_to_screen(const RenderFrame& frame, const RenderPlan& plan);
  Vec3f albedo_at(const RenderPlan& plan, int x, int y, int width);
  void paint_layer(const SubjectLayer& layer, const RenderPlan& plan, const Rectangle& part,
                   int band, bool in_mirror, BandScratch& scratch, std::vector<glm::vec4>& into);
};

ProcessorRenderer::ProcessorRenderer() : state_(std::make_unique<State>()) {}
ProcessorRenderer::~ProcessorRenderer() = default;

std::string ProcessorRenderer::description() const {
  return std::string("the processor, with ") + loops().name;
}

/// Makes the subjects' views ready; true where all of them are those of the last frame, in place.
bool ProcessorRenderer::State::ready_subjects(const RenderFrame& frame, const RenderPlan& plan,
                                              const RenderSettings& settings,
                                              RenderStatistics& statistics) {
  bool still = subjects.size() == plan.subjects.size();
  bool reused = !plan.subjects.empty();
  subjects.resize(plan.subjects.size());
  for (std::size_t i = 0; i < subjects.size(); ++i) {
    const PlacedSubject& placed = plan.subjects[i];
    ReadySubject& subject = subjects[i];
    std::vector<Vec3> eyes{Vec3(placed.from_scene * Vec4(plan.eye, 1.0))};
    if (plan.mirror_index >= 0) {
      const Mirror& m = frame.scene->mirrors[static_cast<std::size_t>(plan.mirror_index)];
      eyes.emplace_back(placed.from_scene *
                        (reflection(Vec3(m.normal), m.offset) * Vec4(plan.eye, 1.0)));
    }
    const bool same = settings.skip && placed.content != 0 && placed.content == subject.content;
    const SkinCounts counts = subject.skin.prepare(*placed.mesh, eyes, same, !settings.skip);
    statistics.pictures_uploaded += counts.pictures;
    statistics.pictures_skipped += counts.pictures_skipped;
    still = still && same && placed.local_to_scene == subject.local_to_scene;
    reused = reused && same;
    subject.content = placed.content;
    subject.local_to_scene = placed.local_to_scene;
  }
  statistics.mesh_reused = reused;
  return still;
}

void ProcessorRenderer::State::bring_to_screen(const RenderFrame& frame, const RenderPlan& plan) {
  const auto fill = [&](SubjectLayer& layer, std::size_t eye, const Mat4& clip, Facing facing,
                        const std::optional<Vec4>& kept) {
    layer.triangles.begin(frame.width, frame.height);
    layer.vertex_of.clear();
    const Mat4 pixels = pixels_from_clip(frame.width, frame.height) * clip;
    for (std::size_t s = 0; s < subjects.size(); ++s) {
      const Mat4 from_local = pixels * plan.subjects[s].local_to_scene;
      const Vec4 plane = kept ? *kept * plan.subjects[s].local_to_scene : Vec4(0, 0, 0, 1);
      const Skin& skin = subjects[s].skin;
      for (std::size_t v = skin.first_vertex(eye); v < skin.last_vertex(eye); v += 3) {
        std::array<Corner, 3> corners;
        for (std::size_t k = 0; k < 3; ++k) {
          const Vec4 point(Vec3(skin.vertex(v + k).position), 1.0);
          corners[k] = {Vec3(from_local * point), glm::dot(plane, point)};
        }
        layer.triangles.add(corners, static_cast<std::uint32_t>(layer.vertex_of.size()), facing);
        layer.vertex_of.emplace_back(static_cast<std::uint32_t>(s), static_cast<std::uint32_t>(v));
      }
    }
  };
  if (!plan.subject.empty()) fill(front, 0, plan.clip_from_scene, Facing::clockwise, std::nullopt);
  if (!plan.mirror.empty()) {
    const Mirror& m = frame.scene->mirrors[static_cast<std::size_t>(plan.mirror_index)];
    fill(image, 1, plan.clip_from_scene * reflection(Vec3(m.normal), m.offset),
         Facing::counterclockwise, Vec4(Vec3(m.normal), -m.offset - 1e-4));
  }
}

/// The light that a scene's point scatters, per irradiance times pi: seen at pixel (x, y).
Vec3f ProcessorRenderer::State::albedo_at(const RenderPlan& plan, int x, int y, int width) {
  std::uint64_t& known = albedo[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + x];
  if (known == 0) {
    const RayHit hit = direct.hit(x, y);
    Vec3f value(0.0f);
    if (hit.hit()) {
      Ray ray;
      ray.origin = Vec3f(plan.eye);
      const Surface surface = scene->plain_surface(ray, hit);
      value = scene->base_colour(hit);
      if (surface.material->is_mirror()) {
        const float cosine =
            std::abs(glm::dot(surface.normal, glm::normalize(surface.point - ray.origin)));
        value *= (Vec3f(1.0f) - fresnel(surface.material->f0(), cosine)) *
                 (1.0f - surface.material->metallic);
      }
    }
    known = std::uint64_t{1} << 48;
    for (int k = 0; k < 3; ++k)
      known |= static_cast<std::uint64_t>(std::clamp(value[k], 0.0f, 1.0f) * 65535.0f + 0.5f)
               << (16 * k);
  }
  return Vec3f(known & 0xffff, known >> 16 & 0xffff, known >> 32 & 0xffff) / 65535.0f;
}

/// Draws the part of a subject layer in a band: premultiplied colour and coverage per pixel of
/// part.
void ProcessorRenderer::State::paint_layer(const SubjectLayer& layer, const RenderPlan& plan,
                                           const Rectangle& part, int band, bool in_mirror,
                                           BandScratch& scratch, std::vector<glm::vec4>& into) {
  const int top = std::max(part.y, band * band_rows);
  const int bottom = std::min(part.y + part.height, (band + 1) * band_rows);
  const auto width = static_cast<std::size_t>(part.width);
  const auto rows = static_cast<std::size_t>(bottom - top);
  into.assign(width * rows, glm::vec4(0.0f));
  const SceneLayer& hiding = in_mirror ? mirrored : direct;
  const int samples = hiding.view().samples;
  const auto all = static_cast<std::size_t>(samples) * width * rows;
  scratch.inverse.assign(all, 0.0f);
  scratch.ids.assign(all, no_triangle);
  if (scene) {
    const SceneLayer::Band& scene_band = hiding.band(band);
    const auto full = static_cast<std::size_t>(hiding.view().width);
    const int band_top = band * band_rows;
    const auto band_height =
        static_cast<std::size_t>(std::min(band_rows, hiding.view().height - band_top));
    for (std::size_t s = 0; s < static_cast<std::size_t>(samples); ++s) {
      for (std::size_t y = 0; y < rows; ++y) {
        const std::size_t row = static_cast<std::size_t>(top - band_top) + y;
        const float* from = &scene_band.inverse[(s * band_height + row) * full + part.x];
        float* to = &scratch.inverse[(s * rows + y) * width];
        std::copy_n(from, width, to);
        if (!in_mirror) continue;
        const std::uint8_t* marks =
            &direct.band(band).mirror[row * full + static_cast<std::size_t>(part.x)];
        for (std::size_t x = 0; x < width; ++x)
          if (!(marks[x] >> s & 1)) to[x] = std::numeric_limits<float>::infinity();
      }
    }
  }
  const float(*places)[2] = sample_places(samples);
  layer.triangles.draw(band, {part.x, part.x + part.width, top, bottom, samples, places,
                              scratch.inverse.data(), scratch.ids.data()});

  scratch.items.resize(subjects.size());
  for (SkinItems& items : scratch.items) items.clear();
  const float each = 1.0f / static_cast<float>(samples);
  for (std::size_t y = 0; y < rows; ++y) {
    for (std::size_t x = 0; x < width; ++x) {
      std::uint32_t seen[8];
      int count = 0;
      for (std::size_t s = 0; s < static_cast<std::size_t>(samples); ++s) {
        const std::uint32_t number = scratch.ids[(s * rows + y) * width + x];
        if (number != no_triangle) seen[count++] = number | static_cast<std::uint32_t>(s) << 28;
      }
      // Each triangle in the pixel is coloured once, in the middle of its samples.
      while (count > 0) {
        const std::uint32_t number = seen[0] & 0x0fffffffu;
        float sx = 0.0f, sy = 0.0f;
        int own = 0, left = 0;
        for (int i = 0; i < count; ++i) {
          if ((seen[i] & 0x0fffffffu) == number) {
            sx += places[seen[i] >> 28][0];
            sy += places[seen[i] >> 28][1];
            ++own;
          } else {
            seen[left++] = seen[i];
          }
        }
        count = left;
        const ScreenTriangle& piece = layer.triangles.piece(number);
        const Foot at = foot(piece, part.x + static_cast<double>(x) + sx / static_cast<float>(own),
                             top + static_cast<double>(y) + sy / static_cast<float>(own));
        const auto [subject, first] = layer.vertex_of[piece.id];
        const Skin& skin = subjects[subject].skin;
        const HullVertex &a = skin.vertex(first), &b = skin.vertex(first + 1),
                         &c = skin.vertex(first + 2);
        const float wa = 1.0f - at.second - at.third;
        const Vec3f p = wa * a.position + at.second * b.position + at.third * c.position;
        SkinItems& items = scratch.items[subject];
        items.x.push_back(p.x);
        items.y.push_back(p.y);
        items.z.push_back(p.z);
        std::array<float, 4>& weights = items.weights.emplace_back();
        for (std::size_t k = 0; k < 4; ++k)
          weights[k] = (wa * a.weights[k] + at.second * b.weights[k] + at.third * c.weights[k]) *
                       (1.0f / 65535.0f);
        items.slots.push_back(a.slots[0] | a.slots[1] << 8 | a.slots[2] << 16 |
                              static_cast<std::uint32_t>(a.slots[3]) << 24);
        items.share.push_back(static_cast<float>(own) * each);
        items.pixel.push_back(static_cast<std::uint32_t>(y * width + x));
      }
    }
  }
  for (std::size_t s = 0; s < subjects.size(); ++s)
    subjects[s].skin.paint(scratch.items[s], scratch.skin, into.data());
}

void ProcessorRenderer::render(const RenderFrame& frame, const RenderPlan& plan,
                               const RenderSettings& settings, const std::uint8_t* background,
                               int background_stride, std::uint8_t* target, int target_stride) {
  State& s = *state_;
  statistics_ = {};
  statistics_.subject_skipped = plan.subject.empty();
  statistics_.shadow_skipped = plan.shadow.empty();
  statistics_.mirror_skipped = plan.mirror.empty();
  const Rectangle changed = plan.changed();
  if (changed.empty()) return;

  Stopwatch watch;
  const auto pass = [&](const char* name) {
    statistics_.passes.push_back({name, 1e3 * watch.lap(), -1.0});
  };
  if (frame.scene != s.scene_held) {
    s.scene_held = frame.scene;
    s.scene.reset();
    if (frame.scene && !frame.scene->meshes.empty()) s.scene.emplace(*frame.scene);
  }
  const bool still = s.ready_subjects(frame, plan, settings, statistics_);
  s.bring_to_screen(frame, plan);
  pass("upload");

  const TracedScene* scene = s.scene ? &*s.scene : nullptr;
  const Mat4 pixels_from_scene = pixels_from_clip(frame.width, frame.height) * plan.clip_from_scene;
  LayerView view{pixels_from_scene, frame.width, frame.height, samples_of(settings), {}, -1};
  const Mirror* mirror = nullptr;
  if (plan.mirror_index >= 0) {
    mirror = &frame.scene->mirrors[static_cast<std::size_t>(plan.mirror_index)];
    view.mirror_mesh = mirror->mesh;
  }
  if (!settings.skip)
    for (SceneLayer* layer : {&s.direct, &s.mirrored, &s.around}) layer->forget();
  const bool fresh = s.direct.set(scene, view);
  if (fresh || s.albedo.size() != static_cast<std::size_t>(frame.width) * frame.height)
    s.albedo.assign(static_cast<std::size_t>(frame.width) * frame.height, 0);
  if (scene) {
    bool drawn = s.direct.ensure(changed);
    if (mirror) {
      LayerView behind = view;
      behind.pixels_from_scene =
          pixels_from_scene * reflection(Vec3(mirror->normal), mirror->offset);
      behind.kept = Vec4(Vec3(mirror->normal), -mirror->offset - 1e-4);
      behind.mirror_mesh = -1;
      s.mirrored.set(scene, behind);
      drawn = s.mirrored.ensure(plan.mirror) || drawn;
      LayerView middles = view;
      middles.samples = 0;
      middles.mirror_mesh = -1;
      s.around.set(scene, middles);
      drawn = s.around.ensure({0, 0, frame.width, frame.height}) || drawn;
    }
    statistics_.scene_depth_reused = !drawn;
  }
  pass("scene-depth");

  Vec3f power(0.0f);
  if (!plan.shadow.empty()) {
    const Light& light = frame.lights[static_cast<std::size_t>(plan.light)];
    const bool same = still && s.shadow_known && s.shadow_light == light;
    s.shadow.set_subjects(plan, light, same);
    s.shadow_known = true;
    s.shadow_light = light;
    pass("shadow-maps");
    statistics_.static_shadow_reused =
        s.shadow.draw(*scene, s.direct, fresh, resized(frame.viewport, frame.width, frame.height),
                      light, settings.shadow, plan.shadow);
    statistics_.rays = s.shadow.rays();
    power = light_power(light) * (frame.exposure / std::numbers::pi_v<float>);
    pass("shadow");
  } else {
    s.shadow_known = false;
  }

  std::optional<MirrorView> mirror_view;
  if (mirror)
    mirror_view.emplace(frame, plan, *scene, s.around, s.mirrored, background, background_stride);
  const int first = changed.y / band_rows, last = (changed.y + changed.height - 1) / band_rows;
  std::atomic<double> spent[3] = {0.0, 0.0,
                                  0.0};  // seconds, of all threads: subject, mirror, blend
  const auto draw_band = [&](int band) {
    thread_local BandScratch scratch;
    const int top = std::max(changed.y, band * band_rows);
    const int bottom = std::min(changed.y + changed.height, (band + 1) * band_rows);
    const auto reaches = [&](const Rectangle& part) {
      return !part.empty() && part.y < bottom && part.y + part.height > top;
    };
    const bool has_front = reaches(plan.subject), has_image = reaches(plan.mirror),
               has_shadow = reaches(plan.shadow);
    Stopwatch watch;
    if (has_front) s.paint_layer(s.front, plan, plan.subject, band, false, scratch, scratch.front);
    spent[0] += watch.lap();
    if (has_image) s.paint_layer(s.image, plan, plan.mirror, band, true, scratch, scratch.image);
    spent[1] += watch.lap();
    const auto value = [&](const Rectangle& part, const std::vector<glm::vec4>& layer, int x,
                           int y) {
      const int part_top = std::max(part.y, band * band_rows);
      if (x < part.x || x >= part.x + part.width || y < part_top || y >= part.y + part.height)
        return glm::vec4(0.0f);
      return layer[static_cast<std::size_t>(y - part_top) * part.width + (x - part.x)];
    };
    for (int y = top; y < bottom; ++y) {
      const std::uint8_t* from = background + static_cast<std::ptrdiff_t>(y) * background_stride;
      std::uint8_t* to = target + static_cast<std::ptrdiff_t>(y) * target_stride;
      const bool in_front =
          has_front && y >= plan.subject.y && y < plan.subject.y + plan.subject.height;
      const bool in_image =
          has_image && y >= plan.mirror.y && y < plan.mirror.y + plan.mirror.height;
      for (int x = changed.x; x < changed.x + changed.width; ++x) {
        // Piece by piece of 16 pixels, those that nothing reaches at once.
        if (const int next = std::min((x | 15) + 1, changed.x + changed.width);
            (x & 15) == 0 || x == changed.x) {
          const auto touched = [&](const Rectangle& part) {
            return x < part.x + part.width && next > part.x;
          };
          if (!(in_front && touched(plan.subject)) && !(in_image && touched(plan.mirror)) &&
              !(has_shadow && s.shadow.reaches(x, y))) {
            x = next - 1;
            continue;
          }
        }
        const glm::vec4 over =
            has_front ? value(plan.subject, scratch.front, x, y) : glm::vec4(0.0f);
        glm::vec4 image = has_image ? value(plan.mirror, scratch.image, x, y) : glm::vec4(0.0f);
        float taken = 0.0f;
        if (has_shadow && over.a < 1.0f && s.shadow.reaches(x, y))
          taken = s.shadow.taken(s.direct, x, y);
        if (over.a == 0.0f && image.a == 0.0f && taken == 0.0f) continue;
        const std::uint8_t* coded = from + 4 * x;
        Vec3f light(srgb_to_linear(coded[0]), srgb_to_linear(coded[1]), srgb_to_linear(coded[2]));
        if (taken > 0.0f) {
          const Vec3f missing = s.albedo_at(plan, x, y, frame.width) * power * taken;
          // Less than a sixth of the smallest step of the darkest values is no change.
          if (over.a == 0.0f && image.a == 0.0f &&
              std::max({missing.x, missing.y, missing.z}) < 4e-5f)
            continue;
          light = glm::max(light - missing, Vec3f(0.0f));
        }
        if (image.a > 0.0f && over.a < 1.0f) {
          if (settings.mirror == MirrorMode::plain) {
            light = glm::mix(light, Vec3f(image) / image.a, settings.reflection_alpha * image.a);
          } else {
            const Vec3f change = Vec3f(image) - image.a * mirror_view->shown(x, y);
            light = glm::max(light + mirror_view->share(x, y) * change, Vec3f(0.0f));
          }
        }
        light = light * (1.0f - over.a) + Vec3f(over);
        std::uint8_t* out = to + 4 * x;
        const float alpha = coded[3] + (255.0f - coded[3]) * over.a;
        for (int k = 0; k < 3; ++k) out[k] = linear_to_srgb(light[k]);
        out[3] = static_cast<std::uint8_t>(alpha + 0.5f);
      }
    }
    spent[2] += watch.lap();
  };
  // Reading other rows of the background for the mirror while they are written would not do.
  if (mirror_view && background == target) {
    s.background_copy.resize(static_cast<std::size_t>(background_stride) * frame.height);
    std::copy_n(background,
                static_cast<std::size_t>(background_stride) * (frame.height - 1) + 4 * frame.width,
                s.background_copy.data());
    mirror_view.emplace(frame, plan, *scene, s.around, s.mirrored, s.background_copy.data(),
                        background_stride);
  }
  parallel_for(static_cast<std::size_t>(last - first + 1), 1, 0,
               [&](std::size_t begin, std::size_t end) {
                 for (std::size_t i = begin; i < end; ++i) draw_band(first + static_cast<int>(i));
               });
  const char* const names[] = {"subject", "mirror", "blend"};
  for (std::size_t i = 0; i < 3; ++i)
    statistics_.passes.push_back({names[i], 1e3 * spent[i], -1.0});
}

}  // namespace polyhull
