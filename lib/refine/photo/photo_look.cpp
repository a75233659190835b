// SPDX-License-Identifier: LGPL-2.1-or-later
// What the pictures say of a surface: which cameras see a vertex, and how well patches agree.
#include <algorithm>
#include <array>
#include <cmath>

#include "base/thread_pool.h"
#include "refine/photo/photo.h"

namespace polyhull::refine {
namespace {

constexpr float finest = 2.0f;           ///< pixels of a depth map's texel
constexpr float longest_side = 2048.0f;  ///< texels
/// How far behind the nearest surface a vertex may be and still be seen, cells: less than a limb.
constexpr float behind = 1.0f;
/// Points of a patch along a side, and cameras that are asked at most and at least.
constexpr int side = 5, points = side * side;
constexpr std::size_t most_cameras = 5, least_cameras = 3;
/// Cosine of the least angle between two of them, 15 degrees.
constexpr float nearest = 0.966f;

/// Draws 1 / depth, linear in the picture, of triangles that face the camera.
void draw(const Vec3f (&corner)[3], int across, int down, float* inverse) {
  const Vec3f &a = corner[0], &b = corner[1], &c = corner[2];
  const float area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
  if (!(area < 0.0f)) return;  // counter-clockwise as seen, and rows go down
  const int left = std::max(0, static_cast<int>(std::ceil(std::min({a.x, b.x, c.x}))));
  const int right = std::min(across - 1, static_cast<int>(std::floor(std::max({a.x, b.x, c.x}))));
  const int top = std::max(0, static_cast<int>(std::ceil(std::min({a.y, b.y, c.y}))));
  const int bottom = std::min(down - 1, static_cast<int>(std::floor(std::max({a.y, b.y, c.y}))));
  for (int y = top; y <= bottom; ++y)
    for (int x = left; x <= right; ++x) {
      const float u = static_cast<float>(x), v = static_cast<float>(y);
      const float p = ((b.x - u) * (c.y - v) - (b.y - v) * (c.x - u)) / area;
      const float q = ((c.x - u) * (a.y - v) - (c.y - v) * (a.x - u)) / area;
      const float r = 1.0f - p - q;
      if (p < -1e-4f || q < -1e-4f || r < -1e-4f) continue;
      float& here = inverse[static_cast<std::size_t>(y) * across + x];
      here = std::max(here, p * a.z + q * b.z + r * c.z);
    }
}

}  // namespace

Vec2f PhotoCarver::Look::pixel(const Vec3f& point) const {
  const Vec3f at = view->project(point);
  if (!(at.z > 0.0f)) return Vec2f(-1e6f);
  return lens ? Vec2f(camera->distort(Vec2(at.x, at.y))) : Vec2f(at.x, at.y);
}

bool PhotoCarver::Look::sees(const Vec3f& point) const {
  const Vec3f at = view->project(point);
  if (!(at.z > 0.0f)) return false;
  const float px = at.x / texel + 0.5f, py = at.y / texel + 0.5f;
  if (!(px >= 0.5f && py >= 0.5f && px < static_cast<float>(across) &&
        py < static_cast<float>(down)))
    return false;
  const int x = static_cast<int>(px), y = static_cast<int>(py);
  const float nearest = inverse[static_cast<std::size_t>(y) * across + x];
  return nearest == 0.0f || at.z - behind < 1.0f / nearest;
}

bool PhotoCarver::Look::well_inside(const Vec3f& point, const PhotoSettings& settings) const {
  const Vec3f at = view->project(point);
  const float reach = std::max(settings.spacing * view->focal / at.z, 1.0f) * (side / 2 + 0.5f);
  return view->coarse.at(at.x, at.y, -1.0f) > reach;
}

void PhotoCarver::take_luma(const ViewPixels& picture, Look& look) {
  look.left = picture.roi.x;
  look.top = picture.roi.y;
  look.width = picture.roi.width;
  look.height = picture.roi.height;
  look.luma.resize(static_cast<std::size_t>(look.width) * look.height);
  for (int y = 0; y < look.height; ++y) {
    const std::uint8_t* row = picture.pixels + static_cast<std::ptrdiff_t>(picture.stride) * y;
    std::uint8_t* out = look.luma.data() + static_cast<std::size_t>(y) * look.width;
    for (int x = 0; x < look.width; ++x) {
      const std::uint8_t* p = row + picture.channels * x;
      out[x] = picture.channels < 3
                   ? p[0]
                   : static_cast<std::uint8_t>((77 * p[0] + 150 * p[1] + 29 * p[2] + 128) >> 8);
    }
  }
}

void PhotoCarver::set_up(std::span<const CameraContours> cameras,
                         std::span<const ViewPixels> pictures, std::span<const ContactView> views,
                         int threads) {
  looks_.resize(pictures.size());
  parallel_each(looks_.size(), 1, threads, [&](std::size_t k) {
    Look& look = looks_[k];
    look.camera = cameras[k].camera;
    look.view = &views[k];
    look.lens = look.camera->has_distortion();
    take_luma(pictures[k], look);
  });
}

void PhotoCarver::draw_depths(const CellSurface& surface, Look& look) {
  const float texel = look.texel = std::max(
      finest, static_cast<float>(std::max(look.camera->width, look.camera->height)) / longest_side);
  look.across = static_cast<int>(static_cast<float>(look.camera->width) / texel) + 1;
  look.down = static_cast<int>(static_cast<float>(look.camera->height) / texel) + 1;
  look.inverse.assign(static_cast<std::size_t>(look.across) * look.down, 0.0f);
  std::vector<Vec3f> seen(surface.points.size());
  for (std::size_t v = 0; v < seen.size(); ++v) {
    const Vec3f at = look.view->project(surface.points[v]);
    seen[v] = {at.x / texel, at.y / texel, at.z > 0.0f ? 1.0f / at.z : -1.0f};
  }
  for (std::size_t t = 0; t < surface.triangles.size(); t += 3) {
    const Vec3f corner[3] = {seen[surface.triangles[t]], seen[surface.triangles[t + 1]],
                             seen[surface.triangles[t + 2]]};
    if (corner[0].z > 0.0f && corner[1].z > 0.0f && corner[2].z > 0.0f)
      draw(corner, look.across, look.down, look.inverse.data());
  }
}

/// A patch's points in one picture, less their mean, of length 1.
struct PhotoCarver::Patch {
  std::array<float, points> value{};

  /// False where the picture does not hold it, or it is plain. \p centre: the patch's middle in the
  /// picture, \p across and \p down from one of its points to the next.
  bool take(const Look& look, const Vec2f& centre, const Vec2f& across, const Vec2f& down,
            float texture) {
    float sum = 0.0f;
    for (int j = 0; j < side; ++j)
      for (int i = 0; i < side; ++i) {
        const Vec2f at = centre + static_cast<float>(i - side / 2) * across +
                         static_cast<float>(j - side / 2) * down -
                         Vec2f(static_cast<float>(look.left), static_cast<float>(look.top));
        if (!(at.x >= 0.0f && at.y >= 0.0f && at.x < static_cast<float>(look.width - 1) &&
              at.y < static_cast<float>(look.height - 1)))
          return false;
        const int x = static_cast<int>(at.x), y = static_cast<int>(at.y);
        const float a = at.x - static_cast<float>(x), b = at.y - static_cast<float>(y);
        const std::uint8_t* p = look.luma.data() + static_cast<std::size_t>(y) * look.width + x;
        const std::uint8_t* q = p + look.width;
        const float upper = p[0] + a * static_cast<float>(p[1] - p[0]);
        const float lower = q[0] + a * static_cast<float>(q[1] - q[0]);
        sum += value[static_cast<std::size_t>(side * j + i)] = upper + b * (lower - upper);
      }
    float square = 0.0f;
    for (float& v : value) {
      v -= sum / points;
      square += v * v;
    }
    if (square < points * texture * texture) return false;
    const float scale = 1.0f / std::sqrt(square);
    for (float& v : value) v *= scale;
    return true;
  }
};

/// A camera that sees a vertex.
struct PhotoCarver::Candidate {
  float cosine;  ///< of the way there and the normal
  Vec3f way;     ///< unit
  const Look* look;
};

/// The first few of \p asked that look from different sides: neighbours agree at any depth.
void PhotoCarver::keep_apart(std::vector<Candidate>& asked) {
  std::size_t kept = 0;
  for (const Candidate& candidate : asked) {
    if (kept == most_cameras) break;
    const bool near = std::any_of(asked.begin(), asked.begin() + kept, [&](const Candidate& other) {
      return glm::dot(candidate.way, other.way) > nearest;
    });
    if (!near) asked[kept++] = candidate;
  }
  asked.resize(kept);
}

void PhotoCarver::find_agreement(const CellSurface& surface, std::uint32_t vertex,
                                 const PhotoSettings& settings, float* agreement) const {
  const Vec3f &point = surface.points[vertex], &normal = surface.normals[vertex];
  std::vector<Candidate> asked;
  for (const Look& look : looks_) {
    const Vec3f way = glm::normalize(look.view->centre - point);
    const float cosine = glm::dot(way, normal);
    if (cosine > settings.least_cosine && look.sees(point) && look.well_inside(point, settings))
      asked.push_back({cosine, way, &look});
  }
  std::stable_sort(asked.begin(), asked.end(),
                   [](const Candidate& a, const Candidate& b) { return a.cosine > b.cosine; });
  keep_apart(asked);
  if (asked.size() < least_cameras) return;
  const Vec3f axis = std::abs(normal.x) < 0.7f ? Vec3f(1, 0, 0) : Vec3f(0, 1, 0);
  const Vec3f u = glm::normalize(glm::cross(normal, axis)), v = glm::cross(normal, u);
  const Look& first = *asked.front().look;
  const float pixel = first.view->project(point).z / first.view->focal;  // cells
  const float spacing = std::max(settings.spacing, pixel);
  for (int d = 0; d <= settings.steps; ++d) {
    const Vec3f at = point - static_cast<float>(d) * settings.step * normal;
    std::array<float, points> sum{};
    int count = 0;
    for (const Candidate& candidate : asked) {
      const Look& look = *candidate.look;
      const Vec2f centre = look.pixel(at);
      Patch patch;
      if (!patch.take(look, centre, look.pixel(at + spacing * u) - centre,
                      look.pixel(at + spacing * v) - centre, settings.texture))
        continue;
      for (int i = 0; i < points; ++i) sum[i] += patch.value[i];
      ++count;
    }
    if (count < static_cast<int>(least_cameras)) continue;
    // The square of the sum holds every pair twice and each patch with itself, which is 1.
    float square = 0.0f;
    for (const float s : sum) square += s * s;
    const auto m = static_cast<float>(count);
    agreement[d] = (square - m) / (m * (m - 1.0f));
  }
}

}  // namespace polyhull::refine
