// SPDX-License-Identifier: LGPL-2.1-or-later
#include "view/raster_view.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "base/thread_pool.h"
#include "raytrace/loops/view_loops.h"
#include "scene/reflection.h"

namespace polyhull {
namespace {

constexpr unsigned all_samples = (1u << packed_samples) - 1u;
constexpr std::size_t most_mirrors = 256;  // of which a byte says which

/// The middle of some of a pixel's samples, pixel (0, 0).
Vec2 middle(unsigned samples) {
  const auto places = sample_places(packed_samples);
  Vec2 sum(0.0);
  for (int s = 0; s < packed_samples; ++s)
    if (samples >> s & 1) sum += Vec2(places[s][0], places[s][1]);
  return sum / static_cast<double>(std::popcount(samples));
}

bool none_of_eight(const std::uint8_t* bytes) {
  std::uint64_t all;
  std::memcpy(&all, bytes, sizeof all);
  return all == 0;
}

}  // namespace

/// One drawing of the scene over the screen: as the eye sees it, or as a mirror shows it.
struct RasterView::Pass {
  const Camera& camera;
  const ViewOptions& options;
  const ViewRays& rays;
  std::span<Vec3f> picture;
  const SceneOnScreen& screen;
  Vec3f eye;
  const Mirror* mirror = nullptr;  ///< that shows the scene; null: the eye sees it
  std::uint8_t mirror_number = 0;
  bool by_rays = false;  ///< what the mirror shows is so little that it is traced
  Vec3f f0{0.0f};        ///< of the mirror
  bool sky = false;      ///< whether there is light where nothing is

  /// The rays through the middles of the pixels of \p span, where they meet \p of: what a mirror
  /// reflects changes too slowly for their places to count.
  RayRow rays_to(const Mirror& of, const Span& span) const {
    const Way way = rays.way(static_cast<float>(span.x - 0.5), static_cast<float>(span.y - 0.5), 0);
    const Vec3f at = way.ray.direction;
    return {span.count,
            {at.x, at.y, at.z},
            {way.dx.x, way.dx.y, way.dx.z},
            {of.normal.x, of.normal.y, of.normal.z}};
  }
};

/// Rows of a pass, and what of them is left to rays.
struct RasterView::Band {
  struct Traced {
    float x, y;
    std::size_t pixel;
    Vec3f share;
  };
  /// Columns of a tile that show one triangle alone, or whose samples are drawn: row by row, from
  /// ids[place] on.
  struct Stretch {
    int first, end;
    std::uint32_t alone;  // no_triangle: they are drawn
    std::size_t place;

    int columns() const { return end - first; }
    std::size_t at(int column, int row) const {
      return place + static_cast<std::size_t>(packed_samples) * (row * columns() + column - first);
    }
  };
  int number = 0, left = 0, right = 0, top = 0, bottom = 0;
  CoveredBlocks blocks;
  std::vector<Stretch> stretches;  // of the tile under way
  std::vector<float> inverse;
  std::vector<std::uint32_t> ids;
  PixelRuns runs;  // of the row under way
  std::vector<Traced> traced;
  std::vector<std::uint32_t> mirror_pixels;
  std::uint64_t edges = 0;
  RayWork work;
};

// Not inlined: the compiler would find the thread's own memory anew for each use, deep in the loops.
[[gnu::noinline]] RasterView::Band& RasterView::own_band() {
  thread_local Band own;
  return own;
}

RasterView::RasterView(const TracedScene& scene, const LightCache& light)
    : scene_(scene),
      shader_(scene, light),
      mirror_pixels_(std::min(scene.scene().mirrors.size(), most_mirrors)) {}

void RasterView::draw(const Camera& camera, const ViewOptions& options, std::span<Vec3f> picture,
                      ViewStatistics* statistics) {
  Camera pinhole = camera;
  pinhole.distortion.clear();
  const ViewRays rays(scene_, shader_.light_cache(), pinhole, options);
  const auto screen = std::make_shared<SceneOnScreen>();
  screen->set(scene_.scene(), pixels_from_scene(pinhole), {}, camera.width, camera.height,
              options.threads);
  triangles_ = screen;
  Pass pass{pinhole, options, rays, picture, *screen, Vec3f(camera.centre())};
  pass.sky = scene_.scene().exposure * scene_.scene().sky != Vec3f(0.0f);
  rays_ = edges_ = 0;
  for (auto& pixels : mirror_pixels_) pixels = 0;
  mirror_samples_.resize(picture.size());
  mirror_.resize(picture.size());
  draw_screen(pass);
  for (std::size_t m = 0; m < mirror_pixels_.size(); ++m)
    if (mirror_pixels_[m] > 0) draw_mirror(pass, m);
  if (statistics) *statistics = {rays_, edges_};
}

void RasterView::draw_mirror(const Pass& direct, std::size_t number) {
  const Scene& scene = scene_.scene();
  const Mirror& mirror = scene.mirrors[number];
  Pass pass{direct.camera, direct.options, direct.rays, direct.picture, mirrored_};
  pass.mirror = &mirror;
  pass.mirror_number = static_cast<std::uint8_t>(number);
  pass.f0 = material_of(scene, mirror).f0();
  pass.sky = direct.sky;
  const Mat4 reflected = reflection(Vec3(mirror.normal), mirror.offset);
  pass.eye = Vec3f(reflected * Vec4(Vec3(direct.eye), 1.0));
  // As many rays as triangles take longer than the triangles.
  std::size_t triangles = 0;
  for (const SceneMesh& mesh : scene.meshes) triangles += mesh.triangles.size() / 3;
  pass.by_rays = mirror_pixels_[number] < triangles;
  if (!pass.by_rays) {
    // What lies in the mirror's plane, itself above all, does not hide what it shows.
    const Vec4 kept(Vec3(mirror.normal), -mirror.offset - scene_.epsilon());
    mirrored_.set(scene, pixels_from_scene(direct.camera) * reflected, kept, direct.camera.width,
                  direct.camera.height, direct.options.threads);
  }
  draw_screen(pass);
}

void RasterView::draw_screen(const Pass& pass) {
  shader_.look_from(pass.eye);
  const int height = pass.camera.height;
  const auto bands = static_cast<std::size_t>((height + band_rows - 1) / band_rows);
  parallel_for(bands, 1, pass.options.threads, [&](std::size_t begin, std::size_t end) {
    Band& band = own_band();
    for (std::size_t b = begin; b < end; ++b) {
      band.number = static_cast<int>(b);
      band.top = band.number * band_rows;
      band.bottom = std::min(band.top + band_rows, height);
      draw_band(pass, band);
    }
  });
}

/// The samples of a pixel that a pass draws.
inline unsigned RasterView::wanted(const Pass& pass, std::size_t pixel) const {
  if (pass.mirror == nullptr) return all_samples;
  return mirror_[pixel] == pass.mirror_number ? mirror_samples_[pixel] : 0;
}

/// The columns of a band that a pass draws.
void RasterView::find_part(const Pass& pass, Band& band) const {
  band.left = 0;
  band.right = pass.camera.width;
  if (pass.mirror == nullptr) return;
  const auto width = static_cast<std::size_t>(pass.camera.width);
  std::swap(band.left, band.right);
  for (int y = band.top; y < band.bottom; ++y) {
    // Only outside what is known already, eight pixels at a time where they show no mirror.
    const std::uint8_t* shown = &mirror_samples_[y * width];
    int x = 0;
    while (x + 8 <= band.left && none_of_eight(shown + x)) x += 8;
    while (x < band.left && wanted(pass, y * width + x) == 0) ++x;
    band.left = std::min(band.left, x);
    x = pass.camera.width;
    while (x - 8 >= band.right && none_of_eight(shown + x - 8)) x -= 8;
    while (x > band.right && wanted(pass, y * width + x - 1) == 0) --x;
    band.right = std::max(band.right, x);
  }
}

void RasterView::draw_band(const Pass& pass, Band& band) {
  if (pass.mirror == nullptr) {
    const auto width = static_cast<std::size_t>(pass.camera.width);
    const std::size_t first = band.top * width, count = (band.bottom - band.top) * width;
    std::fill_n(&pass.picture[first], count, Vec3f(0.0f));
    std::fill_n(&mirror_samples_[first], count, std::uint8_t{0});
  }
  find_part(pass, band);
  if (band.left >= band.right) return;
  band.edges = 0;
  band.traced.clear();
  band.mirror_pixels.assign(mirror_pixels_.size(), 0);
  if (pass.by_rays) {
    for (int y = band.top; y < band.bottom; ++y)
      for (int x = band.left; x < band.right; ++x)
        if (const unsigned samples =
                wanted(pass, static_cast<std::size_t>(y) * pass.camera.width + x))
          send(pass, band, x, y, samples);
  } else {
    band.blocks.begin(band.left, band.right, band.top, band.bottom);
    pass.screen.look(band.number, band.blocks);
    // By tiles: their samples, textures and light stay in the nearest caches.
    for (int x = band.left; x < band.right; x += Span::most)
      draw_tile(pass, band, x, std::min(x + Span::most, band.right));
  }
  trace(pass, band);
  for (std::size_t m = 0; m < band.mirror_pixels.size(); ++m)
    if (band.mirror_pixels[m] > 0) mirror_pixels_[m] += band.mirror_pixels[m];
  edges_ += band.edges;
}

/// Finds which columns of a tile show one triangle alone. Returns how many samples the others have.
std::size_t RasterView::find_stretches(Band& band, int left, int right) {
  static_assert(Span::most % CoveredBlocks::width == 0);
  const int rows = band.bottom - band.top;
  std::size_t place = 0;
  band.stretches.clear();
  for (int x = left; x < right; x += CoveredBlocks::width) {
    const int end = std::min(x + CoveredBlocks::width, right);
    const std::uint32_t alone =
        band.blocks.alone(static_cast<std::size_t>((x - band.left) / CoveredBlocks::width));
    if (band.stretches.empty() || band.stretches.back().alone != alone)
      band.stretches.push_back({x, end, alone, place});
    band.stretches.back().end = end;
    if (alone == no_triangle) place += static_cast<std::size_t>(packed_samples) * rows * (end - x);
  }
  return place;
}

/// Draws columns \p left .. \p right - 1 of a band.
void RasterView::draw_tile(const Pass& pass, Band& band, int left, int right) {
  const std::size_t size = find_stretches(band, left, right);
  band.inverse.resize(size);
  band.ids.resize(size);
  std::fill_n(band.inverse.data(), size, 0.0f);
  std::fill_n(band.ids.data(), size, no_triangle);
  for (const Band::Stretch& part : band.stretches)
    if (part.alone == no_triangle)
      pass.screen.draw(band.blocks, (part.first - band.left) / CoveredBlocks::width,
                       (part.end - 1 - band.left) / CoveredBlocks::width,
                       {part.first, part.end, band.top, band.bottom, packed_samples,
                        sample_places(packed_samples), band.inverse.data() + part.place,
                        band.ids.data() + part.place, true});
  for (int y = band.top; y < band.bottom; ++y) draw_row(pass, band, left, right, y);
}

void RasterView::draw_row(const Pass& pass, Band& band, int x, int end, int y) {
  const std::size_t row = static_cast<std::size_t>(y) * pass.camera.width;
  std::uint8_t whole[Span::most];
  std::uint32_t one[Span::most];  // a triangle that each pixel shows
  for (const Band::Stretch& part : band.stretches) {
    const int at = part.first - x;
    std::fill_n(whole + at, part.columns(), std::uint8_t{1});
    std::fill_n(one + at, part.columns(), part.alone);
    if (part.alone == no_triangle)
      ViewLoops::best().alike(&band.ids[part.at(part.first, y - band.top)], part.columns(),
                              whole + at, one + at);
  }
  if (pass.mirror != nullptr) {
    // Not by wanted(): this is vectorised.
    const std::uint8_t* shown = &mirror_samples_[row + x];
    const std::uint8_t* by = &mirror_[row + x];
    for (int i = 0; i < end - x; ++i)
      whole[i] &=
          static_cast<std::uint8_t>((shown[i] == all_samples) & (by[i] == pass.mirror_number));
  }
  const auto finish = [&](PixelRun& run) { shade(pass, band, run, y); };
  const int begin = x;
  const Band::Stretch* part = band.stretches.data();
  while (x < end) {
    band.runs.finish_before(x, finish);
    const int first = x;
    const std::uint32_t number = one[first - begin];
    while (x < end && whole[x - begin] && one[x - begin] == number) ++x;
    if (x > first) {
      if (number != no_triangle) band.runs.add_whole(number, first, x - first);
      for (int i = first; number == no_triangle && i < x; ++i) add_sky(pass, i, y, all_samples);
      continue;
    }
    unsigned left = wanted(pass, row + x);
    band.edges += left != 0;
    while (part->end <= x) ++part;
    if (part->alone != no_triangle) {  // a mirror's border, which shows it
      if (left != 0) band.runs.add(part->alone, x, left);
      ++x;
      continue;
    }
    // Each triangle once, at the middle of its samples.
    const std::uint32_t* ids = &band.ids[part->at(x, y - band.top)];
    while (left != 0) {
      const std::uint32_t shown = ids[std::countr_zero(left)];
      unsigned samples = 0;
      for (unsigned s = 0; s < packed_samples; ++s)
        samples |= static_cast<unsigned>(ids[s] == shown) << s;
      samples &= left;
      left &= ~samples;
      if (shown != no_triangle)
        band.runs.add(shown, x, samples);
      else
        add_sky(pass, x, y, samples);
    }
    ++x;
  }
  band.runs.finish_before(end + 1, finish);
}

/// Adds the sky to some samples of a pixel that show nothing else.
void RasterView::add_sky(const Pass& pass, int x, int y, unsigned samples) {
  if (!pass.sky) return;
  const float share = static_cast<float>(std::popcount(samples)) / packed_samples;
  Vec3f seen(0.0f), mirrored(1.0f);
  if (pass.mirror != nullptr || scene_.scene().environment)
    seen = pass.rays.way(static_cast<float>(x), static_cast<float>(y), 0).ray.direction;
  if (pass.mirror != nullptr) {
    mirrored = fresnel(pass.f0, -glm::dot(pass.mirror->normal, glm::normalize(seen)));
    seen = glm::reflect(seen, pass.mirror->normal);
  }
  const Vec3f sky = share * glm::min(scene_.scene().exposure * scene_.sky(seen), Vec3f(1.0f));
  pass.picture[static_cast<std::size_t>(y) * pass.camera.width + x] += sky * mirrored;
}

/// Adds a triangle's colour to the pixels of row \p y that show it.
void RasterView::shade(const Pass& pass, Band& band, PixelRun& run, int y) {
  const ScreenTriangle& piece = pass.screen.piece(run.number);
  const int mirror = shader_.mirror(piece.id);
  if (mirror != SpanShader::no_mirror && !leave(pass, band, mirror, run, y)) return;
  const Span span{run.first + 0.5, y + 0.5, run.count, run.right, run.down};
  Float4 values[Span::most];
  const SpanShader::Look& look = shader_.shade(piece, span, values);
  ColourRow row{run.count, look.albedo, look.emitted, run.weight, nullptr, {}, 0.0f, nullptr, {}};
  float own[Span::most], shown[Span::most];
  if (mirror != SpanShader::no_mirror) {
    const Mirror& of = scene_.scene().mirrors[mirror];
    const Material& material = material_of(scene_.scene(), of);
    ViewLoops::best().fresnel(pass.rays_to(of, span), own);
    row.own_fifth = own;
    row.own_f0 = to_float4(material.f0());
    row.own_scatter = 1.0f - material.metallic;
  }
  if (pass.mirror != nullptr) {
    ViewLoops::best().fresnel(pass.rays_to(*pass.mirror, span), shown);
    row.shown_fifth = shown;
    row.shown_f0 = to_float4(pass.f0);
  }
  ViewLoops::best().add(
      row, values, &pass.picture[static_cast<std::size_t>(y) * pass.camera.width + run.first].x);
}

/// Leaves what a mirror shows in a run's pixels to its own pass, or all of a pixel to rays, which
/// then has no weight in the run; false where that are all of them.
bool RasterView::leave(const Pass& pass, Band& band, int mirror, PixelRun& run, int y) {
  bool flat =
      pass.mirror == nullptr && mirror >= 0 && mirror < static_cast<int>(band.mirror_pixels.size());
  if (flat) {
    const Mirror& of = scene_.scene().mirrors[mirror];
    flat = glm::dot(of.normal, pass.eye) - of.offset > scene_.epsilon();
  }
  if (flat && pass.options.mirror_depth < 1) return true;
  const std::size_t first = static_cast<std::size_t>(y) * pass.camera.width + run.first;
  std::uint32_t kept = 0;
  for (int i = 0; i < run.count; ++i) {
    std::uint8_t& samples = mirror_samples_[first + i];
    // One mirror a pixel; where two meet, rays see the other.
    if (flat && (samples == 0 || mirror_[first + i] == mirror)) {
      samples |= run.samples[i];
      mirror_[first + i] = static_cast<std::uint8_t>(mirror);
      ++kept;
      continue;
    }
    send(pass, band, run.first + i, y, run.samples[i]);
    run.weight[i] = 0.0f;
  }
  if (kept > 0) band.mirror_pixels[mirror] += kept;
  return kept > 0;
}

/// Leaves some samples of a pixel to rays.
void RasterView::send(const Pass& pass, Band& band, int x, int y, unsigned samples) {
  const Vec2 place = Vec2(x, y) + middle(samples);
  Vec3f share(static_cast<float>(std::popcount(samples)) / packed_samples);
  band.traced.push_back({static_cast<float>(place.x - 0.5), static_cast<float>(place.y - 0.5),
                         static_cast<std::size_t>(y) * pass.camera.width + x, share});
}

void RasterView::trace(const Pass& pass, Band& band) {
  for (std::size_t first = 0; first < band.traced.size(); first += ray_batch) {
    const std::size_t count = std::min(ray_batch, band.traced.size() - first);
    for (std::size_t k = 0; k < count; ++k) {
      const Band::Traced& traced = band.traced[first + k];
      Way way = pass.rays.way(traced.x, traced.y, static_cast<std::uint32_t>(k));
      way.throughput *= traced.share;
      if (pass.mirror != nullptr) {
        const float cosine = -glm::dot(pass.mirror->normal, glm::normalize(way.ray.direction));
        way = pass.rays.mirrored(way, *pass.mirror, fresnel(pass.f0, cosine));
      }
      band.work.ways[k] = way;
    }
    rays_ += pass.rays.follow(band.work, count, pass.mirror != nullptr ? 1 : 0);
    for (std::size_t k = 0; k < count; ++k)
      pass.picture[band.traced[first + k].pixel] += band.work.values[k];
  }
}

}  // namespace polyhull
