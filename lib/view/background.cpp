// SPDX-License-Identifier: LGPL-2.1-or-later
#include "view/background.h"

#include <algorithm>
#include <mutex>
#include <utility>

#include "base/error.h"
#include "base/srgb.h"
#include "base/thread_pool.h"
#include "raytrace/light_store.h"
#include "raytrace/loops/view_loops.h"
#include "view/gradual_light.h"
#include "view/raster_view.h"
#include "view/scene_planes.h"

namespace polyhull {
namespace {

constexpr float view_weight = 32.0f;  // samples that the fast view counts as

/// The factor by which all lights and the sky are brighter than the base, if that is the only
/// difference.
std::optional<Vec3f> common_factor(const std::vector<Light>& base, const Vec3f& base_sky,
                                   const std::vector<Light>& now, const Vec3f& sky) {
  std::optional<Vec3f> factor;
  const auto fits = [&](const Vec3f& before, const Vec3f& after) {
    Vec3f ratio(1.0f);
    for (int k = 0; k < 3; ++k)
      if (before[k] > 0.0f)
        ratio[k] = after[k] / before[k];
      else if (after[k] > 0.0f)
        return false;
    if (factor && glm::length(*factor - ratio) > 1e-5f * glm::length(ratio)) return false;
    if (!factor) factor = ratio;
    return true;
  };
  for (std::size_t i = 0; i < base.size(); ++i) {
    Light same = now[i];
    same.radiance = base[i].radiance;
    if (same != base[i] || !fits(base[i].radiance, now[i].radiance)) return {};
  }
  if (base_sky != Vec3f(0.0f) || sky != Vec3f(0.0f))
    if (!fits(base_sky, sky)) return {};
  return factor ? factor : Vec3f(1.0f);
}

/// Radiances as gain times (base + difference).
struct Dimming {
  Vec3f gain{1.0f};
  std::vector<Vec3f> differences;  // by light
  std::ptrdiff_t different = 0;    // of these
};

/// The lights \p now as others than the base's in brightness and colour alone, with as few differences as
/// there can be; nothing: they are elsewhere, too, or the sky is another. \p scaled: whether there may be a
/// gain.
std::optional<Dimming> dimming(const std::vector<Light>& base, const Vec3f& base_sky,
                               const std::vector<Light>& now, const Vec3f& sky, bool scaled) {
  constexpr std::size_t most_tried = 8;
  constexpr float rounding = 1e-5f;
  const auto positive = [](const Vec3f& v) { return v.x > 0.0f && v.y > 0.0f && v.z > 0.0f; };
  std::vector<Vec3f> gains{Vec3f(1.0f)};
  const auto try_ratio = [&](const Vec3f& before, const Vec3f& after) {
    if (scaled && gains.size() < most_tried && positive(before) && positive(after))
      gains.push_back(after / before);
  };
  try_ratio(base_sky, sky);
  for (std::size_t i = 0; i < base.size(); ++i) {
    Light same = now[i];
    same.radiance = base[i].radiance;
    if (same != base[i]) return {};
    try_ratio(base[i].radiance, now[i].radiance);
  }
  std::optional<Dimming> best;
  for (const Vec3f& gain : gains) {
    if (glm::length(gain * base_sky - sky) > rounding * glm::length(sky)) continue;
    Dimming found{gain, {}, 0};
    for (std::size_t i = 0; i < base.size(); ++i) {
      const Vec3f difference = now[i].radiance / gain - base[i].radiance;
      const bool same = glm::length(difference) <= rounding * glm::length(base[i].radiance);
      found.differences.push_back(same ? Vec3f(0.0f) : difference);
      found.different += same ? 0 : 1;
    }
    if (!best || found.different < best->different) best = std::move(found);
  }
  return best;
}

/// Keeps \p light in a file; why it could not, or nothing. The picture does not need it.
std::string keep(const LightCache& light, const TracedScene& scene,
                 const LightCacheOptions& options, const std::filesystem::path& folder) {
  if (folder.empty()) return {};
  try {
    store_light(light, scene, options, folder);
    return {};
  } catch (const Error& error) {
    return error.what();
  }
}

}  // namespace

Background::Background(Scene scene, const BackgroundOptions& options)
    : options_(options), traced_(std::move(scene)) {
  const Scene& own = traced_.scene();
  sky_ = own.sky;
  for (std::size_t m = 0; m < own.meshes.size(); ++m) {
    const bool is_light =
        std::any_of(own.lights.begin(), own.lights.end(),
                    [&](const Light& light) { return light.mesh == static_cast<int>(m); });
    other_emitters_ |= !is_light && own.materials[own.meshes[m].material].emission != Vec3f(0.0f);
  }
}

Background::~Background() = default;

bool Background::has_parts_of(const Scene& posed) const {
  const std::vector<SceneMesh>& own = scene().meshes;
  return own.size() == posed.meshes.size() && scene().lights.size() == posed.lights.size() &&
         std::equal(own.begin(), own.end(), posed.meshes.begin(),
                    [](const SceneMesh& a, const SceneMesh& b) {
                      // A scene that has never been posed may know of no nodes: all its meshes are there then.
                      const bool same_node = a.node < 0 || b.node < 0 || a.node == b.node;
                      return same_node && a.positions.size() == b.positions.size() &&
                             a.triangles == b.triangles;
                    });
}

bool Background::take_pose(const Scene& posed) {
  if (!has_parts_of(posed)) return false;
  keep_light_as_it_is();
  const bool other_mirrors = scene().mirrors != posed.mirrors;
  traced_.take_pose(posed);
  geometry_ = geometry_key(scene());
  posed_ = light_ != nullptr;
  if (gradual_) gradual_->stop();
  if (other_mirrors) raster_.reset();
  camera_.reset();
  return true;
}

/// What lamps would give alone is of the pose before: what has been mixed of it stays.
void Background::keep_light_as_it_is() {
  if (lamps_.empty()) return;
  LightValues values = light_->all_values();
  const Float4 gain = to_float4(light_->gain());
  for (std::vector<Float4>& side : values.sides)
    for (Float4& value : side) {
      const float divided = value[3];
      value *= gain;
      value[3] = divided;
    }
  values.mean_bounced *= light_->gain();
  light_->set_values(std::move(values));
  light_->set_gain(Vec3f(1.0f));
  lamps_.forget();
  base_lights_ = scene().lights;
  base_sky_ = scene().sky;
}

/// Makes the light that of the scene's lights, if they differ from the base's in brightness and colour
/// alone, and what each gives may be asked for; else false.
bool Background::dim_lights(const Vec3f& sky) {
  const std::vector<Light>& now = traced_.scene().lights;
  Dimming dimmed;
  dimmed.differences.resize(now.size());
  if (const auto factor =
          other_emitters_ ? std::nullopt : common_factor(base_lights_, base_sky_, now, sky)) {
    dimmed.gain = *factor;
  } else {
    // Of a light that is yet to be exact nobody knows where its borders are.
    if (gradual_ || light_failed_ || posed_) return false;
    auto found = dimming(base_lights_, base_sky_, now, sky, !other_emitters_);
    if (!found) return false;
    dimmed = std::move(*found);
  }
  if (!lamps_.show(traced_, options_.light, options_.progressive, dimmed.differences, *light_))
    return false;
  light_->set_gain(dimmed.gain);
  return true;
}

bool Background::apply_lights(const std::vector<Light>& lights, const Vec3f& sky,
                              const std::atomic<bool>* stop) {
  if (lights.size() != traced_.scene().lights.size()) {
    throw Error(Error::Kind::bad_input,
                "A background's scene has {} lights, but {} were given; give as many.",
                traced_.scene().lights.size(), lights.size());
  }
  bool changed = sky != traced_.scene().sky;
  traced_.set_sky(sky);
  for (std::size_t i = 0; i < lights.size(); ++i) {
    if (lights[i] == traced_.scene().lights[i]) continue;
    traced_.set_light(i, lights[i]);
    changed = true;
  }
  if (light_ && !changed) return false;
  for (std::size_t i = 0; posed_ && i < lights.size(); ++i) {
    const Vec3f radiance = base_lights_[i].radiance;
    base_lights_[i] = traced_.scene().lights[i];
    base_lights_[i].radiance = radiance;
  }
  if (light_ && dim_lights(sky)) return false;
  light_scene(stop);
  geometry_ = geometry_key(traced_.scene());  // lamps may have moved
  base_lights_ = traced_.scene().lights;
  base_sky_ = sky;
  return true;
}

/// Why a light could not be kept in a file; written before GradualLight's last light is shown.
struct Background::Kept {
  std::mutex mutex;
  std::string why_not;
};

/// From a file where there is one.
void Background::light_scene(const std::atomic<bool>* stop) {
  const bool first = light_ == nullptr;
  posed_ = false;
  traced_.build_tree();
  raster_.reset();
  gradual_.reset();
  lamps_.forget();
  light_.reset();  // the memory first
  light_not_kept_.clear();
  light_failed_ = false;
  const std::filesystem::path folder = first ? options_.light_folder : std::filesystem::path();
  if (!folder.empty()) light_ = load_light(traced_, options_.light, folder);
  light_was_kept_ = light_ != nullptr;
  if (light_) return;
  if (options_.progressive) {
    light_scene_gradually(folder);
    return;
  }
  light_ = std::make_unique<LightCache>(traced_, options_.light, stop);
  if (stop && *stop) return;  // it is not to be kept
  light_not_kept_ = keep(*light_, traced_, options_.light, folder);
}

void Background::light_scene_gradually(const std::filesystem::path& folder) {
  light_ = GradualLight::first(traced_, options_.light);
  kept_ = std::make_shared<Kept>();
  gradual_ = std::make_unique<GradualLight>(traced_.scene(), options_.light,
                                            [kept = kept_, options = options_.light, folder](
                                                const TracedScene& scene, const LightCache& light) {
                                              const std::string why_not =
                                                  keep(light, scene, options, folder);
                                              const std::lock_guard lock(kept->mutex);
                                              kept->why_not = why_not;
                                            });
}

/// True if the light has changed.
bool Background::advance_light() {
  if (!gradual_) return lamps_.advance(traced_, options_.light, *light_);
  if (!gradual_->advance(*light_)) {
    if (const std::string why = gradual_->failure(); !why.empty()) {
      light_not_kept_ =
          "The exact light could not be computed, and the picture keeps a coarser one: " + why;
      light_failed_ = true;
      gradual_.reset();
    }
    return false;
  }
  if (!gradual_->is_exact()) return true;
  light_->count_rays(gradual_->rays());
  gradual_.reset();  // waits until the light is in its file
  const std::lock_guard lock(kept_->mutex);
  light_not_kept_ = kept_->why_not;
  return true;
}

Background::Work Background::update(const Camera& camera, const std::vector<Light>& lights,
                                    float exposure, float sky) {
  const bool still = light_ && !advance_light() && camera_ == camera && exposure == exposure_ &&
                     lights == traced_.scene().lights && sky * sky_ == traced_.scene().sky;
  unchanged_ = still ? unchanged_ + 1 : 0;
  if (still) return Work::none;
  const bool lit = apply_lights(lights, sky * sky_);
  traced_.set_exposure(exposure);
  exposure_ = exposure;
  camera_ = camera;
  draw(camera);
  samples_ = 0;
  rows_done_ = 0;
  sums_.clear();
  return lit ? Work::lit : Work::drawn;
}

void Background::prepare(const std::vector<Light>& lights, float sky, int threads,
                         const std::atomic<bool>& stop) {
  const int own = std::exchange(options_.light.threads, threads);
  apply_lights(lights, sky * sky_, &stop);
  options_.light.threads = own;
}

void Background::rest(int still) {
  if (!light_ || unchanged_ < still || view_.empty()) return;
  if (samples_ == 0) {  // else it would be another picture
    for (std::vector<Vec3f>* of : {&view_, &sums_, &refined_}) *of = std::vector<Vec3f>();
    rows_done_ = 0;  // of a sample whose sums are gone
  }
  raster_.reset();
  light_->rest();
}

/// Draws what rest() has given back.
void Background::end_rest() {
  if (view_.empty() && camera_) draw(*camera_);
}

void Background::draw(const Camera& camera) {
  view_.resize(static_cast<std::size_t>(camera.width) * camera.height);
  by_rays_ = options_.method == ViewMethod::rays || camera.has_distortion();
  planes_.reset();
  const std::vector<Material>& materials = scene().materials;
  if (by_rays_ || std::any_of(materials.begin(), materials.end(),
                              [](const Material& material) { return material.is_mirror(); }))
    traced_.build_tree();
  if (by_rays_) {
    render_view(traced_, *light_, camera, options_.view, view_, &statistics_);
    return;
  }
  if (!raster_) raster_ = std::make_unique<RasterView>(traced_, *light_);
  raster_->draw(camera, options_.view, view_, &statistics_);
  planes_ = std::make_shared<const ScenePlanes>(ScenePlanes{
      geometry_, pixels_from_scene(camera), camera.width, camera.height, raster_->triangles()});
}

bool Background::refine(int rows) {
  if (!camera_ || rows < 1 || gradual_ || !lamps_.is_exact()) return false;
  end_rest();
  traced_.build_tree();
  if (sums_.empty()) sums_.assign(view_.size(), Vec3f(0.0f));
  const int end = std::min(rows_done_ + rows, camera_->height);
  trace_paths(traced_, *camera_, samples_, 1, options_.paths, sums_, rows_done_, end);
  rows_done_ = end;
  if (rows_done_ < camera_->height) return false;
  rows_done_ = 0;
  ++samples_;
  const float whole = view_weight + static_cast<float>(samples_);
  refined_.resize(view_.size());
  for (std::size_t i = 0; i < view_.size(); ++i)
    refined_[i] = (view_weight * view_[i] + sums_[i]) / whole;
  return true;
}

void Background::write(std::uint8_t* pixels, std::size_t stride, int red) {
  end_rest();
  const auto columns = static_cast<std::size_t>(width());
  const std::uint8_t* table = linear_to_srgb_table();
  const std::vector<Vec3f>& shown = picture();
  parallel_each(static_cast<std::size_t>(height()), 16, options_.view.threads, [&](std::size_t y) {
    ViewLoops::best().encode(&shown[y * columns].x, width(), table, red, pixels + y * stride);
  });
}

Announcement Background::announcement() const {
  Announcement out;
  if (camera_) out.viewport = *camera_;
  out.scene = scene().name;
  out.lights = scene().lights;
  out.exposure = exposure_;
  out.sky = scene().sky;
  if (light_) out.ambient = light_->mean_bounced();
  return out;
}

}  // namespace polyhull
