// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/processor/processor_renderer.h"

#include <algorithm>
#include <atomic>
#include <cstring>
#include <numbers>
#include <optional>
#include <utility>

#include "base/srgb.h"
#include "base/stopwatch.h"
#include "base/thread_pool.h"
#include "render/processor/scene/albedo_layer.h"
#include "render/processor/area_shadow.h"
#include "render/processor/mirror_view.h"
#include "render/processor/scene/scene_layer.h"
#include "render/processor/subject_layer.h"
#include "render/processor/video_rows.h"
#include "view/scene_planes.h"

namespace polyhull {

using namespace processor;

namespace {

int samples_of(const RenderSettings& settings) {
  const int wanted = settings.edge_samples;
  return wanted >= 8 ? 8 : wanted >= 4 ? 4 : wanted >= 2 ? 2 : 1;
}

}  // namespace

struct ProcessorRenderer::State {
  std::shared_ptr<const Scene> scene_held;
  std::optional<TracedScene> scene;
  std::optional<std::uint64_t> geometry;  // geometry_key() of the scene, once it is asked for
  SceneLayer direct, mirrored;
  ShadowCasters casters;
  std::optional<Light> shadow_light;  // for which casters has the subjects
  AreaShadow shadow, mirror_shadow;
  std::vector<ReadySubject> subjects;
  SubjectLayer front, image;
  std::vector<std::uint8_t> background_copy;
  AlbedoLayer albedo, mirror_albedo;

  bool still(const RenderPlan& plan) const;
  void ready_subjects(const RenderFrame& frame, const RenderPlan& plan,
                      const RenderSettings& settings, RenderStatistics& statistics);
  void bring_to_screen(const RenderFrame& frame, const RenderPlan& plan);
  void prepare(const RenderFrame& frame, const RenderPlan& plan, const RenderSettings& settings,
               RenderStatistics& statistics);
  /// Of which layers the content is another one than before.
  struct Fresh {
    bool direct = false, mirrored = false;
  };
  std::shared_ptr<const SceneOnScreen> ready_triangles(const RenderFrame& frame,
                                                       const LayerView& view);
  Fresh draw_scene(const RenderFrame& frame, const RenderPlan& plan, const RenderSettings& settings,
                   RenderStatistics& statistics);
  ShadowView view_in_mirror(const RenderFrame& frame, const RenderPlan& plan,
                            const Fresh& fresh) const;
  void draw_shadows(const RenderFrame& frame, const RenderPlan& plan,
                    const RenderSettings& settings, const Fresh& fresh,
                    RenderStatistics& statistics);
};

ProcessorRenderer::ProcessorRenderer() : state_(std::make_unique<State>()) {}
ProcessorRenderer::~ProcessorRenderer() = default;

std::string ProcessorRenderer::description() const {
  return std::string("the processor, with ") + loops().name;
}

/// Whether all subjects are those of the last frame, in place.
bool ProcessorRenderer::State::still(const RenderPlan& plan) const {
  bool same = subjects.size() == plan.subjects.size();
  for (std::size_t i = 0; same && i < subjects.size(); ++i)
    same = plan.subjects[i].content != 0 && plan.subjects[i].content == subjects[i].content &&
           plan.subjects[i].local_to_scene == subjects[i].local_to_scene;
  return same;
}

/// Makes the subjects' views ready.
void ProcessorRenderer::State::ready_subjects(const RenderFrame& frame, const RenderPlan& plan,
                                              const RenderSettings& settings,
                                              RenderStatistics& statistics) {
  bool reused = !plan.subjects.empty();
  subjects.resize(plan.subjects.size());
  for (std::size_t i = 0; i < subjects.size(); ++i) {
    const PlacedSubject& placed = plan.subjects[i];
    ReadySubject& subject = subjects[i];
    const bool same = settings.skip && placed.content != 0 && placed.content == subject.content;
    const SkinCounts counts =
        subject.skin.prepare(*placed.mesh, eyes_on(placed, frame, plan), plan.pixel_size, same,
                             !settings.skip, settings.soft_edges);
    statistics.pictures_uploaded += counts.pictures;
    statistics.pictures_skipped += counts.pictures_skipped;
    reused = reused && same;
    subject.content = placed.content;
    subject.local_to_scene = placed.local_to_scene;
    subject.scale = scale_of(placed);
  }
  statistics.mesh_reused = reused;
}

void ProcessorRenderer::State::bring_to_screen(const RenderFrame& frame, const RenderPlan& plan) {
  const Mat4 pixels = pixels_from_clip(frame.width, frame.height) * plan.clip_from_scene;
  if (!plan.subject.empty())
    front.fill(subjects, {0, pixels, Facing::clockwise, std::nullopt}, frame.width, frame.height);
  if (plan.mirror.empty()) return;
  const Mirror& m = *mirror_of(frame, plan);
  image.fill(
      subjects,
      {1, pixels * reflection(Vec3(m.normal), m.offset), Facing::counterclockwise, kept_side(m)},
      frame.width, frame.height);
}

/// Makes ready what subjects look like, and what they hide, side by side.
void ProcessorRenderer::State::prepare(const RenderFrame& frame, const RenderPlan& plan,
                                       const RenderSettings& settings,
                                       RenderStatistics& statistics) {
  const bool same = settings.skip && still(plan);
  const bool shadowed = !plan.shadow.empty() || !plan.mirror_shadow.empty();
  double prepared[2] = {0.0, 0.0};  // seconds
  parallel_for(shadowed ? 2 : 1, 1, 0, [&](std::size_t begin, std::size_t end) {
    for (std::size_t task = begin; task < end; ++task) {
      Stopwatch own;
      if (task == 0) {
        ready_subjects(frame, plan, settings, statistics);
        bring_to_screen(frame, plan);
      } else {
        const Light& light = frame.lights[static_cast<std::size_t>(plan.light)];
        casters.set(plan, light, same && shadow_light == light);
        shadow_light = light;
      }
      prepared[task] = own.lap();
    }
  });
  if (!shadowed) shadow_light.reset();
  statistics.passes.push_back({"upload", 1e3 * prepared[0], -1.0});
  if (shadowed) statistics.passes.push_back({"shadow-maps", 1e3 * prepared[1], -1.0});
}

/// The frame's planes, where they are of this view of the scene.
std::shared_ptr<const SceneOnScreen> ProcessorRenderer::State::ready_triangles(
    const RenderFrame& frame, const LayerView& view) {
  if (!scene || !frame.planes) return nullptr;
  if (!geometry) geometry = geometry_key(scene->scene());
  return frame.planes->are_of(*geometry, view.pixels_from_scene, view.width, view.height)
             ? frame.planes->triangles
             : nullptr;
}

/// Draws what is missing of the scene as the viewport and the mirror see it.
ProcessorRenderer::State::Fresh ProcessorRenderer::State::draw_scene(
    const RenderFrame& frame, const RenderPlan& plan, const RenderSettings& settings,
    RenderStatistics& statistics) {
  const TracedScene* traced = scene ? &*scene : nullptr;
  LayerView view;
  const Camera viewport = resized(frame.viewport, frame.width, frame.height);
  const PixelRays rays(viewport);
  view.pixels_from_scene = pixels_from_scene(viewport);
  view.width = frame.width;
  view.height = frame.height;
  view.samples = samples_of(settings);
  const Mirror* mirror = mirror_of(frame, plan);
  if (mirror) view.mirror_mesh = mirror->mesh;
  if (!settings.skip)
    for (SceneLayer* layer : {&direct, &mirrored}) layer->forget();
  Fresh fresh;
  const std::shared_ptr<const SceneOnScreen> ready = ready_triangles(frame, view);
  fresh.direct = direct.set(traced, view, ready);
  statistics.scene_planes_taken = fresh.direct && ready;
  if (fresh.direct) albedo.reset(direct, Vec3f(plan.eye), rays);
  if (!traced) return fresh;

  bool drawn = direct.ensure_middles(AreaShadow::asked(plan.shadow, view));
  if (mirror) {
    LayerView behind = view;
    behind.mirror_mesh = -1;
    const Mat4 turned = reflection(Vec3(mirror->normal), mirror->offset);
    behind.pixels_from_scene = view.pixels_from_scene * turned;
    behind.kept = kept_side(*mirror);
    fresh.mirrored = mirrored.set(traced, behind) || fresh.direct;
    if (fresh.mirrored)
      mirror_albedo.reset(mirrored, Vec3f(turned * Vec4(plan.eye, 1.0)),
                          reflected(rays, mirror->normal));
    drawn = mirrored.ensure_samples({&plan.mirror, 1}) || drawn;
    drawn = mirrored.ensure_middles(
                bounding(plan.mirror, AreaShadow::asked(plan.mirror_shadow, view))) ||
            drawn;
  }
  std::vector<Rectangle> sampled{plan.subject, plan.mirror};
  if (!plan.mirror_shadow.empty()) {
    mirror_shadow.begin(casters, view_in_mirror(frame, plan, fresh),
                        frame.lights[static_cast<std::size_t>(plan.light)], settings.shadow,
                        plan.mirror_shadow);
    const std::vector<Rectangle> reached = mirror_shadow.reached(view);
    sampled.insert(sampled.end(), reached.begin(), reached.end());
  }
  drawn = direct.ensure_samples(sampled) || drawn;
  statistics.scene_depth_reused = !drawn;
  return fresh;
}

/// Who sees the shadow in the plan's mirror.
ShadowView ProcessorRenderer::State::view_in_mirror(const RenderFrame& frame,
                                                    const RenderPlan& plan,
                                                    const Fresh& fresh) const {
  const Mirror& mirror = *mirror_of(frame, plan);
  const PixelRays rays(resized(frame.viewport, frame.width, frame.height));
  return {mirrored, fresh.mirrored,
          Vec3f(reflection(Vec3(mirror.normal), mirror.offset) * Vec4(plan.eye, 1.0)),
          reflected(rays, mirror.normal), &direct};
}

/// The shadow as the viewport sees it, and as the mirror shows it.
void ProcessorRenderer::State::draw_shadows(const RenderFrame& frame, const RenderPlan& plan,
                                            const RenderSettings& settings, const Fresh& fresh,
                                            RenderStatistics& statistics) {
  if (plan.light < 0) return;
  const Light& light = frame.lights[static_cast<std::size_t>(plan.light)];
  const PixelRays rays(resized(frame.viewport, frame.width, frame.height));
  if (!plan.shadow.empty()) {
    const ShadowView view{direct, fresh.direct, Vec3f(plan.eye), rays};
    statistics.static_shadow_reused =
        shadow.begin(casters, view, light, settings.shadow, plan.shadow);
    shadow.draw(casters, *scene, view, light);
    statistics.rays += shadow.rays();
  }
  if (!plan.mirror_shadow.empty()) {
    mirror_shadow.draw(casters, *scene, view_in_mirror(frame, plan, fresh), light);
    statistics.rays += mirror_shadow.rays();
  }
}

/// Puts the layers of one band together, as renderer.h says.
class ProcessorRenderer::Blend {
 public:
  Blend(State& state, const RenderFrame& frame, const RenderPlan& plan,
        const RenderSettings& settings, const MirrorView* mirror, const std::uint8_t* background,
        int background_stride, const PictureTarget& target)
      : state_(state),
        frame_(frame),
        plan_(plan),
        settings_(settings),
        mirror_(mirror),
        changed_(plan.changed()),
        background_(background),
        background_stride_(background_stride),
        target_(target) {
    if (plan.light < 0) return;
    const Vec3f power = light_power(frame.lights[static_cast<std::size_t>(plan.light)]) *
                        (frame.exposure / std::numbers::pi_v<float>);
    for (int c = 0; c < 3; ++c) power_[c] = power[c];
  }

  int first_band() const { return changed_.y / band_rows; }
  int last_band() const { return (changed_.y + changed_.height - 1) / band_rows; }

  /// Draws band \p band into the target.
  void draw(int band) {
    thread_local SubjectLayer::Scratch scratch;
    thread_local std::vector<glm::vec4> front, image;
    const int top = std::max(changed_.y, band * band_rows);
    const int bottom = std::min(changed_.y + changed_.height, (band + 1) * band_rows);
    const auto reaches = [&](const Rectangle& part) {
      return !part.empty() && part.y < bottom && part.y + part.height > top;
    };
    const bool scene = state_.scene.has_value();
    Stopwatch watch;
    if (reaches(plan_.subject))
      state_.front.paint(state_.subjects, band, plan_.subject, state_.direct, nullptr, scene,
                         scratch, front);
    seconds_subject += watch.lap();
    if (reaches(plan_.mirror))
      state_.image.paint(state_.subjects, band, plan_.mirror, state_.mirrored, &state_.direct,
                         scene, scratch, image);
    seconds_mirror += watch.lap();
    const Rectangle rows{changed_.x, top, changed_.width, bottom - top};
    const PixelRows out = target_.video ? background_rows(background_, background_stride_, rows,
                                                          frame_.width, frame_.height)
                                        : PixelRows{target_.pixels, target_.stride, 0, 0};
    Piece piece;
    Touched touched;  // of two rows that share their chroma
    for (int y = top; y < bottom; ++y) {
      blend_row(y, row_of(plan_.subject, front, band, y), row_of(plan_.mirror, image, band, y),
                {reaches(plan_.shadow), reaches(plan_.mirror_shadow)}, out, piece, touched);
      if (!target_.video || (y % 2 == 0 && y + 1 < bottom)) continue;
      write_rows(out, y & ~1, std::exchange(touched, {}), *target_.video);
    }
    seconds_blend += watch.lap();
  }

  std::atomic<double> seconds_subject = 0.0, seconds_mirror = 0.0, seconds_blend = 0.0;

 private:
  /// A row of a subject layer.
  struct Span {
    int left = 0, right = 0;
    const glm::vec4* colours = nullptr;  // of column left and on
    bool meets(int begin, int end) const { return begin < right && end > left; }
    glm::vec4 at(int x) const {
      return x >= left && x < right ? colours[x - left] : glm::vec4(0.0f);
    }
  };
  static Span row_of(const Rectangle& part, const std::vector<glm::vec4>& layer, int band, int y) {
    const int top = std::max(part.y, band * band_rows);
    if (part.empty() || y < top || y >= part.y + part.height) return {};
    return {part.x, part.x + part.width, &layer[static_cast<std::size_t>(y - top) * part.width]};
  }

  /// Where light may be missing.
  struct Shaded {
    bool seen = false, mirrored = false;
  };

  /// Up to 16 pixels of a row on their way into the picture. What has no part in them stays as the
  /// piece before left it: nothing.
  struct Piece {
    BlendPixels pixels{};
    float in_mirror[16];  ///< what is taken from what the mirror shows
    bool has_subject = true, has_mirror = true;  ///< else all of theirs is nothing
  };

  /// Blends the changed part of row \p y into \p out.
  void blend_row(int y, const Span& over, const Span& mirrored, const Shaded& shaded,
                 const PixelRows& out, Piece& piece, Touched& touched) {
    for (int x = changed_.x; x < changed_.x + changed_.width;) {
      // Those that nothing reaches at once.
      const int end = std::min((x | 15) + 1, changed_.x + changed_.width);
      const bool seen = shaded.seen && state_.shadow.reaches(x, y) &&
                        state_.shadow.taken(state_.direct, x & ~15, y, piece.pixels.taken);
      const bool shown = shaded.mirrored && state_.mirror_shadow.reaches(x, y) &&
                         state_.mirror_shadow.taken(state_.mirrored, x & ~15, y, piece.in_mirror);
      const bool covered = over.meets(x, end), reflected = mirrored.meets(x, end);
      if (seen || shown || covered || reflected) {
        fill_ground(x, end, y, seen, piece.pixels);
        if (covered || piece.has_subject) fill_subject(x, end, over, piece.pixels);
        piece.has_subject = covered;
        if (!shown) std::fill_n(piece.in_mirror, 16, 0.0f);
        if (shown || reflected || piece.has_mirror) fill_mirror(x, end, y, mirrored, piece);
        piece.has_mirror = shown || reflected;
        touched.left = std::min(touched.left, x);
        touched.right = std::max(touched.right, end);
        std::uint32_t made[16];
        loops().blend(piece.pixels, power_, srgb_to_linear_table(), srgb_lines(), made);
        std::memcpy(out.at(x, y), made + (x & 15), 4 * static_cast<std::size_t>(end - x));
      }
      x = end;
    }
  }

  /// The background of pixels \p x to \p end - 1 and, where \p seen, what it loses.
  void fill_ground(int x, int end, int y, bool seen, BlendPixels& pixels) {
    const int first = x & ~15;
    const std::uint8_t* coded = background_ + static_cast<std::ptrdiff_t>(y) * background_stride_;
    if (end - x < 16) std::fill_n(pixels.background, 16, 0u);
    std::memcpy(pixels.background + (x - first), coded + 4 * x,
                4 * static_cast<std::size_t>(end - x));
    if (!seen) {
      std::fill_n(pixels.taken, 16, 0.0f);
      return;
    }
    for (int i = 0; i < 16; ++i)
      if (first + i < x || first + i >= end) pixels.taken[i] = 0.0f;
    const std::uint64_t* albedo = state_.albedo.at(*state_.scene, state_.direct, first, y);
    for (int i = 0; i < 16; ++i) pixels.albedo[i] = pixels.taken[i] > 0.0f ? albedo[i] : 0;
  }

  static void fill_subject(int x, int end, const Span& over, BlendPixels& pixels) {
    for (int i = 0; i < 16; ++i) {
      const int column = (x & ~15) + i;
      const glm::vec4 colour = column >= x && column < end ? over.at(column) : glm::vec4(0.0f);
      pixels.red[i] = colour.r;
      pixels.green[i] = colour.g;
      pixels.blue[i] = colour.b;
      pixels.alpha[i] = colour.a;
    }
  }

  /// What the mirror changes where the subject does not cover it.
  void fill_mirror(int x, int end, int y, const Span& mirrored, Piece& piece) {
    BlendPixels& pixels = piece.pixels;
    for (int i = 0; i < 16; ++i) {
      const int column = (x & ~15) + i;
      const bool open = column >= x && column < end && pixels.alpha[i] < 1.0f;
      const glm::vec4 image = open ? mirrored.at(column) : glm::vec4(0.0f);
      pixels.keep[i] = 1.0f;
      pixels.covered[i] = image.a;
      Vec3f gone(0.0f), more(0.0f), dimmed(0.0f);
      if (open && piece.in_mirror[i] > 0.0f)
        dimmed = piece.in_mirror[i] * mirror_dimming(column, y, image.a);
      if (image.a > 0.0f) {
        if (settings_.mirror == MirrorMode::plain) {
          pixels.keep[i] = 1.0f - settings_.reflection_alpha * image.a;
          more = settings_.reflection_alpha * Vec3f(image);
        } else {
          const Vec3f share = mirror_->share(column, y);
          more = share * Vec3f(image);
          // Of metal all light was what it showed.
          if (mirror_->only_mirrors())
            pixels.keep[i] = 1.0f - image.a;
          else
            gone = image.a * share * mirror_->shown(column, y);
        }
      }
      for (int c = 0; c < 3; ++c) {
        pixels.dimmed[c][i] = dimmed[c];
        pixels.gone[c][i] = gone[c];
        pixels.more[c][i] = more[c];
      }
    }
  }

  /// What pixel (x, y) of the mirror, \p covered of which shows the subject, loses for each E that
  /// is taken where it looks.
  Vec3f mirror_dimming(int x, int y, float covered) {
    float seen = state_.direct.mirror_at(x, y);
    // Of other mirrors the covered part goes with what they showed there.
    if (!mirror_->only_mirrors()) seen = std::max(seen - covered, 0.0f);
    if (seen == 0.0f) return Vec3f(0.0f);
    const std::uint64_t albedo =
        state_.mirror_albedo.at(*state_.scene, state_.mirrored, x & ~15, y)[x & 15];
    const Vec3f scattered(static_cast<float>(albedo & 0xffff),
                          static_cast<float>(albedo >> 16 & 0xffff),
                          static_cast<float>(albedo >> 32 & 0xffff));
    return seen * mirror_->share(x, y) * scattered / 65535.0f *
           Vec3f(power_[0], power_[1], power_[2]);
  }

  State& state_;
  const RenderFrame& frame_;
  const RenderPlan& plan_;
  const RenderSettings& settings_;
  const MirrorView* mirror_;
  Rectangle changed_;
  const std::uint8_t* background_;
  int background_stride_;
  PictureTarget target_;
  float power_[3] = {};  // of the main light, as a picture value per albedo and E
};

void ProcessorRenderer::render(const RenderFrame& frame, const RenderPlan& plan,
                               const RenderSettings& settings, const std::uint8_t* background,
                               int background_stride, std::uint8_t* target, int target_stride) {
  draw(frame, plan, settings, background, background_stride, {target, target_stride});
}

void ProcessorRenderer::render_yuv(const RenderFrame& frame, const RenderPlan& plan,
                                   const RenderSettings& settings, const std::uint8_t* background,
                                   int background_stride, const YuvPicture& target) {
  draw(frame, plan, settings, background, background_stride, {nullptr, 0, &target});
}

void ProcessorRenderer::draw(const RenderFrame& frame, const RenderPlan& plan,
                             const RenderSettings& settings, const std::uint8_t* background,
                             int background_stride, const PictureTarget& target) {
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
    s.geometry.reset();
    // The next scene may take this one's address.
    for (SceneLayer* layer : {&s.direct, &s.mirrored}) layer->forget();
    if (frame.scene && !frame.scene->meshes.empty()) s.scene.emplace(*frame.scene);
  }
  s.prepare(frame, plan, settings, statistics_);
  watch.lap();
  const State::Fresh fresh = s.draw_scene(frame, plan, settings, statistics_);
  pass("scene-depth");
  s.draw_shadows(frame, plan, settings, fresh, statistics_);
  if (plan.light >= 0) pass("shadow");

  std::optional<MirrorView> mirror;
  if (plan.mirror_index >= 0) {
    const std::uint8_t* unchanged = background;
    if (background == target.pixels) {
      // Other rows of the background are read for the mirror when they may be written already.
      const std::size_t size = static_cast<std::size_t>(background_stride) * (frame.height - 1) +
                               4 * static_cast<std::size_t>(frame.width);
      s.background_copy.assign(background, background + size);
      unchanged = s.background_copy.data();
    }
    mirror.emplace(frame, plan, *s.scene, s.mirrored, unchanged, background_stride);
  }
  Blend blend(s, frame, plan, settings, mirror ? &*mirror : nullptr, background, background_stride,
              target);
  const int first = blend.first_band();
  parallel_for(static_cast<std::size_t>(blend.last_band() - first + 1), 1, 0,
               [&](std::size_t begin, std::size_t end) {
                 for (std::size_t i = begin; i < end; ++i) blend.draw(first + static_cast<int>(i));
               });
  for (const auto& [name, seconds] : {std::pair{"subject", blend.seconds_subject.load()},
                                      {"mirror", blend.seconds_mirror.load()},
                                      {"blend", blend.seconds_blend.load()}})
    statistics_.passes.push_back({name, 1e3 * seconds, -1.0});
}

}  // namespace polyhull
